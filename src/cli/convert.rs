//! `ivcam convert`: rewrites a scene as Inventor V2.1 or VRML97, or writes it in another format.
//! `convert_folder` does the same for all scenes of a folder.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::io::Write;
use std::path::{Path, PathBuf};

use clap::{Arg, ArgMatches, Command, value_parser};
use ivcam_base::diag::{Diagnostic, Result, Severity};
use ivcam_base::files::{folder_of, write_whole};
use ivcam_base::work::Budget;
use ivcam_inventor::iv::{Document, Format};
use ivcam_render::scene::CompileOptions;
use ivcam_render::scene::check::FileState;
use ivcam_render::scene::model::{ModelOptions, Sampling};
use serde_json::Value as Json;

use super::flags::{FONTS, LIMIT, MEMORY, WORK};
use super::meter::{MeterKind, waiting};
use super::outputs::{FORCE, is_forced, is_standard_stream, keep_inputs};
use super::{parsed, print_diagnostic, print_warnings, status, switch, text};
use crate::export::{Conversion, ExportOptions, Target, convert, rewriting, source_report};

/// The names of the formats of Inventor and VRML, for `--to`.
const REWRITTEN: [&str; 3] = ["ascii", "binary", "iv"];

/// The exit code if `--strict` is given and something is lost or damaged.
pub(super) const LOSSES: i32 = 1;

/// Returns the definition of the command.
pub(crate) fn command() -> Command {
    let path = |name: &'static str| Arg::new(name).value_parser(value_parser!(PathBuf));
    let formats = REWRITTEN.into_iter();
    let formats = formats.chain(Target::ALL.iter().map(|t| t.name()));
    Command::new("convert")
        .about("Converts a scene to Inventor V2.1 or VRML97, or to the formats of other programs")
        .arg(
            path("scene")
                .value_name("SCENE")
                .required(true)
                .help("scene file: .iv, .wrl, .x3d, .x3dv, .glb, .gltf, .obj, .ply, .stl, plain or .gz; a folder with scenes; - for standard input"),
        )
        .arg(
            path("output")
                .short('o')
                .long("output")
                .value_name("FILE")
                .help("the file to write, whose ending chooses the format; the folder for those of a folder [standard output]"),
        )
        .arg(
            Arg::new("to")
                .long("to")
                .value_name("FORMAT")
                .value_parser(formats.collect::<Vec<_>>())
                .help("the format; iv and inventor are Inventor V2.1, ascii keeps VRML97, binary is Inventor's binary [the output's ending, or ascii]"),
        )
        .arg(path("report").long("report").value_name("FILE").help(
            "writes what the format could not express, and what is wrong with the scene, to a JSON file",
        ))
        .arg(switch("strict", "exits with code 1 if something that the file states could not be expressed, or if the scene is damaged"))
        .arg(Arg::new("tolerance").long("tolerance").value_name("FRACTION").help(
            "the largest error of triangles for round shapes, text and NURBS, from 0.0001 to 0.1 of their size [0.005]",
        ))
        .arg(Arg::new("scene-time").long("scene-time").value_name("SECONDS").help(
            "converts the scene as it is so many seconds after it was opened [0]",
        ))
        .arg(Arg::new("animate").long("animate").value_name("SECONDS").help(
            "the length of the animation that moving parts become; 0 for none [that of the scene's clocks]",
        ))
        .arg(switch(
            "keep-origin",
            "leaves a scene that is far from its origin where it is",
        ))
        .arg(switch(
            FORCE,
            "lets the output replace the scene that is read; converts all scenes of a folder again",
        ))
        .arg(
            Arg::new("threads")
                .short('j')
                .long("threads")
                .value_name("N")
                .help("threads for the scenes of a folder [one for each core]"),
        )
        .args(super::reading_arguments())
        .args([FONTS, LIMIT, MEMORY, WORK].iter().map(super::flags::argument))
        .arg(super::time_for_each("ends each scene after this time, such as 30s [never]"))
}

/// What a conversion writes.
#[derive(Clone, Copy)]
pub(super) enum ConvertedFile {
    /// The scene in the language of its file, Inventor or VRML97, as text or in binary.
    Rewritten(Format),
    /// A format that the scene is converted to.
    Exported(Target),
}

impl ConvertedFile {
    /// The name of the format.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Rewritten(Format::Ascii) => "ascii",
            Self::Rewritten(Format::Binary) => "binary",
            Self::Exported(target) => target.name(),
        }
    }

    /// Returns the document that is converted: of VRML that is rewritten, the one in Inventor's
    /// terms.
    pub(super) fn terms(self, document: &Document) -> Cow<'_, Document> {
        match self {
            Self::Rewritten(format) => document.in_inventor(format),
            Self::Exported(_) => Cow::Borrowed(document),
        }
    }

    /// Returns what is written for a document. Inventor and VRML 1.0 become Inventor V2.1 by
    /// rewriting the scene, which keeps its nodes.
    pub(super) fn of(self, document: &Document) -> Self {
        match self {
            Self::Exported(Target::Inventor) if !document.is_vrml97() && !document.is_x3d() => {
                Self::Rewritten(Format::Ascii)
            }
            _ => self,
        }
    }

    /// The ending of the names of files of a scene that is not VRML97.
    pub(super) fn ending(self) -> &'static str {
        match self {
            Self::Rewritten(_) => "iv",
            Self::Exported(target) => target.endings()[0],
        }
    }
}

/// Runs the command for one scene and returns the exit code.
pub(crate) fn run(matches: &ArgMatches, out: &mut dyn Write) -> Result<i32> {
    super::allowance(matches, 1)?.during(|| convert_one(matches, out))
}

fn convert_one(matches: &ArgMatches, out: &mut dyn Write) -> Result<i32> {
    let Some(scene) = matches.get_one::<PathBuf>("scene") else {
        return Err(Diagnostic::error("no scene was given"));
    };
    let output = matches.get_one::<PathBuf>("output").map(PathBuf::as_path);
    let output = output.filter(|path| !is_standard_stream(path));
    let options = options(matches, output)?;
    let (search, contain) = super::readable_folders(matches);
    let document = Document::open_or_stdin(scene, &search, contain, &super::limits(matches)?)?;
    print_warnings(&document.sink);
    let wanted = wanted(text(matches, "to"), output).of(&document);
    match (output, wanted) {
        (Some(output), _) => check_ending(output, &endings(wanted, &document))?,
        (None, ConvertedFile::Exported(target)) if target.has_files_beside() => {
            let title = target.title();
            let text = format!("{title} needs files beside it, so it is not written to a pipe");
            return Err(Diagnostic::unsupported(text).with_help("name the file with `-o`"));
        }
        _ => {}
    }
    let converting = format!("converting {}", scene.display());
    let terms = wanted.terms(&document);
    let convert = || converted(&terms, wanted, &options);
    let mut conversion = waiting(MeterKind::Bar, converting, convert)?;
    if let Some(output) = output {
        conversion.carry_files(&document, [scene, output], &BTreeSet::new());
        if !is_forced(matches) {
            keep_scene(&conversion, output, scene, &document)?;
        }
    }
    print_all(&conversion, scene);
    if let Some(report) = matches.get_one::<PathBuf>("report") {
        keep_inputs("--report", report, &document.opened_files())?;
        let names = [scene.as_path(), output.unwrap_or(Path::new("-"))];
        let [scene, output] = names.map(|path| path.display().to_string());
        let losses = conversion.losses.json(&scene, wanted.name(), &output);
        let source = source_report(&document, &conversion, &options.model.compile);
        let report_text = joined(losses, source);
        write_whole(report, |file| writeln!(file, "{report_text:#}"))?;
    }
    let is_damaged = FileState::of(&document) == FileState::Damaged;
    let lost = matches.get_flag("strict") && (is_damaged || conversion.losses.has_stated());
    let code = if lost { LOSSES } else { 0 };
    match output {
        None => {
            let written = put(&conversion, &terms, wanted, out).and_then(|()| out.flush());
            Budget::current().check()?;
            Ok(super::exit_code(written)?.max(code))
        }
        Some(path) => {
            write(&conversion, &terms, wanted, path)?;
            Ok(code)
        }
    }
}

/// Returns an object with the keys of two.
pub(super) fn joined(mut report: Json, more: Json) -> Json {
    if let (Json::Object(report), Json::Object(more)) = (&mut report, more) {
        report.extend(more);
    }
    report
}

/// Converts a document in the terms of its output. What only rewrites it has no bytes, which
/// [`write()`] makes.
pub(super) fn converted(
    document: &Document,
    output: ConvertedFile,
    options: &ExportOptions,
) -> Result<Conversion> {
    let conversion = match output {
        ConvertedFile::Rewritten(format) => rewriting(document, format, options),
        ConvertedFile::Exported(target) => convert(document, target, options)?,
    };
    // Writing ends early if the work is stopped.
    Budget::current().check()?;
    Ok(conversion)
}

/// Writes a converted scene. The file itself is written last, so that those beside it are there.
pub(super) fn write(
    conversion: &Conversion,
    document: &Document,
    format: ConvertedFile,
    path: &Path,
) -> Result<()> {
    for (name, bytes) in &conversion.beside {
        let beside = path.with_file_name(name);
        let folder = folder_of(&beside);
        std::fs::create_dir_all(&folder).map_err(|e| Diagnostic::io(folder.display(), &e))?;
        write_whole(&beside, |file| file.write_all(bytes))?;
    }
    let mut stopped = Ok(());
    let written = write_whole(path, |file| {
        put(conversion, document, format, file)?;
        stopped = Budget::current().check();
        let failure = |_| std::io::Error::from(std::io::ErrorKind::Interrupted);
        stopped.as_ref().copied().map_err(failure)
    });
    stopped.and(written)
}

/// Puts out the bytes of a converted scene. They end early if the work is stopped.
fn put(
    conversion: &Conversion,
    document: &Document,
    format: ConvertedFile,
    to: &mut dyn Write,
) -> std::io::Result<()> {
    match format {
        ConvertedFile::Rewritten(format) => document.write_to(format, to),
        ConvertedFile::Exported(_) => to.write_all(&conversion.bytes),
    }
}

/// Returns the options of a conversion.
pub(super) fn options(matches: &ArgMatches, output: Option<&Path>) -> Result<ExportOptions> {
    let limits = super::limits(matches)?;
    let memory = super::memory(matches)?;
    let fonts = super::fonts(matches)?;
    fonts.warnings.iter().for_each(|t| print_diagnostic(t));
    let fraction = |word: &str| word.parse().ok().filter(|t| (1e-4..=0.1).contains(t));
    let expects = "a number from 0.0001 to 0.1";
    let tolerance = parsed(matches, "tolerance", expects, fraction)?;
    let seconds = |word: &str| word.parse().ok().filter(|t: &f64| t.is_finite());
    let time = parsed(matches, "scene-time", "a number of seconds", seconds)?;
    let length = |word: &str| seconds(word).filter(|t| *t >= 0.0);
    let duration = parsed(matches, "animate", "a number of seconds from 0", length)?;
    let folders = matches.get_many::<PathBuf>("search").into_iter().flatten();
    let defaults = ModelOptions::default();
    let stem = output.and_then(Path::file_stem).unwrap_or_default();
    Ok(ExportOptions {
        time: time.unwrap_or(0.0),
        sampling: (duration != Some(0.0)).then(|| Sampling {
            duration,
            ..Sampling::default()
        }),
        model: ModelOptions {
            tolerance: tolerance.unwrap_or(defaults.tolerance),
            recenter: !matches.get_flag("keep-origin"),
            compile: CompileOptions {
                texture_folders: folders.cloned().collect(),
                fonts,
                limits: limits.clone(),
                memory: memory.bytes(),
                ..defaults.compile
            },
        },
        stem: stem.to_string_lossy().into_owned(),
    })
}

/// Returns what to write, from the value of `--to` or the ending of the output.
pub(super) fn wanted(to: Option<&str>, output: Option<&Path>) -> ConvertedFile {
    let target = match to {
        Some("binary") => return ConvertedFile::Rewritten(Format::Binary),
        Some("iv") => Some(Target::Inventor),
        Some(name) => Target::named(name),
        None => output.and_then(Target::of_path),
    };
    target.map_or(
        ConvertedFile::Rewritten(Format::Ascii),
        ConvertedFile::Exported,
    )
}

/// Prints what is wrong with the scene and what was lost.
fn print_all(conversion: &Conversion, scene: &Path) {
    let found = conversion.diagnostics.iter();
    let found = found.filter(|d| d.severity >= Severity::Warning);
    found.for_each(print_diagnostic);
    for message in conversion.losses.messages() {
        match message.place {
            Some(_) => print_diagnostic(&message),
            None => print_diagnostic(&message.in_file(scene.display().to_string())),
        }
    }
    if conversion.is_empty {
        status!("{}: nothing to draw was found", scene.display());
    }
}

/// Refuses to write a conversion over the scene or a file that the scene uses.
pub(super) fn keep_scene(
    conversion: &Conversion,
    output: &Path,
    scene: &Path,
    document: &Document,
) -> Result<()> {
    let mut inputs = document.opened_files();
    inputs.push(scene.to_path_buf());
    keep_inputs("--output", output, &inputs)?;
    let mut beside = conversion.beside.iter();
    beside.try_for_each(|(name, _)| keep_inputs("--output", &output.with_file_name(name), &inputs))
}

/// Returns the endings of names for files that hold what is written.
pub(super) fn endings(wanted: ConvertedFile, document: &Document) -> Vec<&'static str> {
    match wanted {
        ConvertedFile::Rewritten(format) => document.written_endings(format).to_vec(),
        ConvertedFile::Exported(target) => target.endings().to_vec(),
    }
}

/// Refuses a name that promises another format than the one that is written.
pub(super) fn check_ending(output: &Path, endings: &[&str]) -> Result<()> {
    let ending = output.extension().unwrap_or_default().to_string_lossy();
    if endings.iter().any(|e| ending.eq_ignore_ascii_case(e)) {
        return Ok(());
    }
    let path = output.display();
    let dotted =
        |list: &[&str]| -> Vec<String> { list.iter().map(|e| format!("`.{e}`")).collect() };
    let known = dotted(endings).join(" or ");
    let others = Target::ALL.iter().map(|t| t.endings()[0]);
    let others: Vec<&str> = others.filter(|e| !endings.contains(e)).collect();
    let others = dotted(&others).join(", ");
    Err(
        Diagnostic::unsupported(format!("`{path}` does not name the format that is written"))
            .with_help(format!(
                "end the output's name in {known}; other formats are {others}"
            )),
    )
}
