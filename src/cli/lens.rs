//! `ivcam lens`: writes the data of a lens, or traces rays through it.
//!
//! Every output is one entry of a table: an option, and the function that makes what it writes. The
//! arguments of the command, its help and the running of all outputs that are asked for follow from
//! the table. Nothing is written before all outputs are made, so a command that fails leaves no
//! part of its files.

use std::io::Write;
use std::path::Path;

use clap::{Arg, ArgAction, ArgMatches, Command};
use ivcam_base::diag::{Diagnostic, Result, Sink};
use ivcam_base::files::write_whole;
use ivcam_base::work::Budget;
use ivcam_optics::lens::Lens;
use ivcam_optics::picture::Depth;

use super::lens_request::{CONDITIONS, Content, LensRequest};
use super::lens_survey::LensSurvey;
use super::messages::heard;
use super::{
    flags, is_given, lens_batch, lens_export, lens_files, lens_json, lens_list, print_diagnostic,
    sheet, switch, text, value,
};
use crate::photo::{LensChoice, options};

/// An output of the command.
struct Output {
    flag: &'static str,
    /// The name of the option's value, or nothing for a switch.
    value: &'static str,
    help: &'static str,
    place: Destination,
    /// Makes the content from the option's value.
    make: fn(&LensRequest<'_>, &str) -> Result<Content>,
}

/// Where an output goes.
enum Destination {
    /// To the file that the option names. The list has the endings of its name; without a list, the
    /// output takes any name or checks it.
    File(&'static [&'static str]),
    /// To the file of `--output`, or else to standard output.
    FileOrStandardOutput,
    StandardOutput,
}

/// All outputs, in the order in which they are written.
static OUTPUTS: [Output; 11] = [
    Output {
        flag: "write",
        value: "FILE",
        help: "write the prescription",
        place: Destination::File(&[".dat (pbrt's four columns)", ".zmx", ".seq", ".json"]),
        make: lens_files::prescription,
    },
    Output {
        flag: "diagram",
        value: "FILE",
        help: "draw the section with rays",
        place: Destination::File(&[".svg", ".fig (xfig)"]),
        make: lens_files::diagram,
    },
    Output {
        flag: "sheet",
        value: "FILE",
        help: "write the data sheet as one page",
        place: Destination::File(&[".html", ".htm", ".svg"]),
        make: lens_files::page,
    },
    Output {
        flag: "csv",
        value: "FILE",
        help: "write the curves, fans, coefficients and spots as CSV, one value a row",
        place: Destination::File(&[]),
        make: lens_files::csv,
    },
    Output {
        flag: "psf",
        value: "FILE",
        help: "draw the images of points with diffraction: .png, .exr or another picture format",
        place: Destination::File(&[]),
        make: lens_files::points,
    },
    Output {
        flag: "as-scene",
        value: "FILE.iv",
        help: "write the lens as solids of a scene, with the film behind it (--focus), in meters",
        place: Destination::File(&[".iv"]),
        make: lens_files::scene,
    },
    Output {
        flag: "trace",
        value: "RAYS.json",
        help: "trace a list of rays (`-` reads standard input)",
        place: Destination::StandardOutput,
        make: lens_files::rays,
    },
    Output {
        flag: "export",
        value: "FORMAT",
        help: "writes the lens for another program: opencv, ros, opentrackio, lensfun, stmap, psf, osl, zmx, seq or json",
        place: Destination::FileOrStandardOutput,
        make: lens_export::export,
    },
    Output {
        flag: "batch",
        value: "FILE.jsonl",
        help: "figures of merit of many variations of the lens: each line has changes, such as {\"R\": {\"3\": 51.2}}, or a prescription",
        place: Destination::FileOrStandardOutput,
        make: lens_batch::batch,
    },
    Output {
        flag: "tolerance",
        value: "TABLE",
        help: "the yield of the lens made within the tolerances of a table, by Monte Carlo",
        place: Destination::FileOrStandardOutput,
        make: lens_batch::tolerance,
    },
    Output {
        flag: "json",
        value: "",
        help: "prints JSON",
        place: Destination::StandardOutput,
        make: lens_json::json,
    },
];

/// The options of `--batch` and `--tolerance`, each with the name of its value and its help.
const BATCH: [(&str, &str, &str); 3] = [
    (
        "film-at",
        "PLACE",
        "with --batch and --tolerance: where the film of each lens stands: best, paraxial, or fixed where the lens itself has it [best]",
    ),
    (
        "trials",
        "N",
        "with --tolerance: the number of lenses [1000]",
    ),
    (
        "seed",
        "N",
        "with --tolerance: the seed of the random numbers [0]",
    ),
];

/// The options that some outputs do not use, each with those that do. `""` is the data sheet as
/// text.
const USES: [(&str, &[&str]); 11] = [
    ("film-at", &["batch", "tolerance"]),
    ("trials", &["tolerance"]),
    ("seed", &["tolerance"]),
    (
        "defocus",
        &[
            "",
            "diagram",
            "sheet",
            "csv",
            "psf",
            "export",
            "curves",
            "film-at fixed",
        ],
    ),
    (
        "fields",
        &["", "sheet", "csv", "psf", "curves", "batch", "tolerance"],
    ),
    ("frequencies", &["", "sheet", "csv", "curves", "batch"]),
    (
        "film",
        &[
            "",
            "write",
            "diagram",
            "sheet",
            "csv",
            "psf",
            "export",
            "curves",
            "batch",
            "tolerance",
        ],
    ),
    ("coating", &["", "write", "sheet", "export", "json"]),
    (
        "size",
        &[
            "export opencv",
            "export ros",
            "export opentrackio",
            "export lensfun",
            "export stmap",
            "export psf",
            "export osl",
        ],
    ),
    ("model", &["export opencv", "export ros"]),
    (
        "residual",
        &[
            "export opencv",
            "export ros",
            "export opentrackio",
            "export lensfun",
        ],
    ),
];

impl Output {
    /// Returns the option that asks for the output.
    fn argument(&self) -> Arg {
        if self.value.is_empty() {
            return switch(self.flag, self.help);
        }
        let argument = value(self.flag, self.value, self.help).allow_hyphen_values(true);
        match self.place {
            Destination::File(endings @ [_, ..]) => {
                argument.help(format!("{}: {}", self.help, any_of(endings)))
            }
            _ => argument,
        }
    }

    fn is_asked_for(&self, matches: &ArgMatches) -> bool {
        match self.value {
            "" => matches.get_flag(self.flag),
            _ => matches.contains_id(self.flag),
        }
    }

    /// Returns the file to write; none for standard output.
    fn file<'m>(&self, matches: &'m ArgMatches) -> Option<&'m str> {
        match self.place {
            Destination::File(_) => text(matches, self.flag),
            Destination::FileOrStandardOutput => text(matches, "output"),
            Destination::StandardOutput => None,
        }
    }

    /// Checks the ending of the file's name.
    fn check_ending(&self, matches: &ArgMatches) -> Result<()> {
        let (Destination::File(endings @ [_, ..]), Some(file)) = (&self.place, self.file(matches))
        else {
            return Ok(());
        };
        let ending = format!(".{}", lens_files::ending(file));
        let known = endings.iter().filter_map(|known| known.split(' ').next());
        if known.into_iter().any(|known| known == ending) {
            return Ok(());
        }
        let error = format!("`--{} {file}` has no known extension", self.flag);
        Err(Diagnostic::unsupported(error)
            .with_help(format!("end the name in {}", any_of(endings))))
    }

    fn make(&self, request: &LensRequest<'_>) -> Result<Content> {
        let value = match self.value {
            "" => None,
            _ => text(request.matches, self.flag),
        };
        (self.make)(request, value.unwrap_or_default())
    }
}

/// Returns the definition of the command.
pub(crate) fn command() -> Command {
    let conditions = CONDITIONS.map(|(name, of, help)| value(name, of, help));
    Command::new("lens")
        .about("Prints the data of a lens, or traces rays through it")
        .arg(
            Arg::new("lens")
                .value_name("LENS")
                .num_args(1..)
                .action(ArgAction::Append)
                .help("a shipped lens, a file or a folder of lens files; several have one line each; without one, or with a part of a name, lists shipped lenses"),
        )
        .args(OUTPUTS.iter().map(Output::argument))
        .args(lens_export::arguments())
        .args(options::lens_options().map(flags::argument))
        .arg(flags::argument(&options::WORK))
        .mut_arg("zoom", |arg| arg.visible_alias("scale"))
        .mut_arg("efl", |arg| arg.conflicts_with("zoom"))
        .mut_arg("focus", |arg| {
            arg.help("focus, in meters from the front vertex (or `inf`)")
        })
        .args(conditions.map(|arg| arg.allow_hyphen_values(true)))
        .args(BATCH.map(|(name, of, help)| value(name, of, help)))
        .arg(
            switch(
                "curves",
                "with --json: the data sheet's curves and aberrations too",
            )
            .requires("json"),
        )
}

/// What `ivcam lens` prints.
#[derive(Clone, Debug, Default)]
pub struct LensOutput {
    /// The text for standard output.
    pub text: String,
    /// The warnings, as standard error would show them.
    pub messages: Vec<String>,
}

/// Runs `ivcam lens` with some arguments, without the name of the program and of the command. What
/// the command prints is returned, so that a program gets the same numbers as a terminal.
///
/// ```
/// let words = ["biogon", "--efl", "50", "--json"].map(String::from);
/// let output = ivcam::cli::lens_output(&words)?;
/// assert!(output.text.starts_with('{') && output.messages.is_empty());
/// # Ok::<(), Box<ivcam::Diagnostic>>(())
/// ```
///
/// # Errors
/// Returns an error if an argument is invalid, the lens cannot be read, or a file not be written.
pub fn lens_output(words: &[String]) -> Result<LensOutput> {
    output_by(words, |matches, out| run(matches, out))
}

/// Runs `ivcam lens` as [`lens_output`] does, for a lens that was opened with the same arguments
/// and not focused yet. Its file is not read again, and may have changed.
///
/// # Errors
/// Returns an error if an argument is invalid, or a file cannot be written.
pub fn output_of_lens(lens: &Lens, words: &[String]) -> Result<LensOutput> {
    output_by(words, |matches, out| {
        let outputs = outputs_of(matches)?;
        write(&outputs, matches, out, || LensRequest::of(lens, matches))
    })
}

/// Runs some work with the arguments, and returns what it printed.
fn output_by(
    words: &[String],
    work: impl FnOnce(&ArgMatches, &mut dyn Write) -> Result<i32>,
) -> Result<LensOutput> {
    let words = std::iter::once("lens").chain(words.iter().map(String::as_str));
    let matches = command().try_get_matches_from(words);
    let matches =
        matches.map_err(|e| Diagnostic::error(e.render().to_string().trim().to_owned()))?;
    let mut out = Vec::new();
    let (code, messages) = heard(|| work(&matches, &mut out));
    code?;
    Ok(LensOutput {
        text: String::from_utf8_lossy(&out).into_owned(),
        messages,
    })
}

/// Runs the command and returns the exit code.
pub(crate) fn run(matches: &ArgMatches, out: &mut dyn Write) -> Result<i32> {
    let outputs = outputs_of(matches)?;
    let names = matches.get_many::<String>("lens");
    let names: Vec<&str> = names.into_iter().flatten().map(String::as_str).collect();
    let Some(&name) = names.first() else {
        return without_lens(&outputs, matches, out);
    };
    if names.len() > 1 || Path::new(name).is_dir() {
        return survey(&names, &outputs, matches, out);
    }
    let is_file = Path::new(name).exists()
        || outputs.iter().any(|output| output.flag != "json")
        || of_one_lens(matches).next().is_some();
    if !is_file && let Some(list) = lens_list::named_like(name, !outputs.is_empty())? {
        return save(list, None, out);
    }
    write(&outputs, matches, out, || LensRequest::open(name, matches))
}

/// Returns the outputs that are asked for.
///
/// # Errors
/// Fails if an option does nothing for them.
fn outputs_of(matches: &ArgMatches) -> Result<Vec<&'static Output>> {
    let is_asked_for = |output: &&Output| output.is_asked_for(matches);
    let outputs: Vec<&Output> = OUTPUTS.iter().filter(is_asked_for).collect();
    check_uses(&outputs, matches)?;
    Ok(outputs)
}

/// Makes and writes the outputs of one lens, which `open` opens, or its data sheet as text.
fn write<'m>(
    outputs: &[&Output],
    matches: &'m ArgMatches,
    out: &mut dyn Write,
    open: impl FnOnce() -> Result<LensRequest<'m>>,
) -> Result<i32> {
    check_standard_output(outputs, matches)?;
    for output in outputs {
        output.check_ending(matches)?;
    }
    let work = options::work(&flags::given_options(matches))?;
    let budget = Budget::new(u64::MAX, work);
    let made = budget.during(|| {
        let request = open()?;
        check_focus(outputs, &request);
        match outputs.is_empty() {
            true => Ok(vec![sheet::text(&request)?]),
            false => outputs.iter().map(|output| output.make(&request)).collect(),
        }
    });
    if budget.cut().is_some() {
        let text = format!("the lens takes more than {work} steps of work");
        return Err(Diagnostic::beyond_limit(text).with_help("`--work N` raises the limit"));
    }
    let contents: Vec<Content> = made?;
    if outputs.is_empty() {
        return save(contents.into_iter().next().unwrap_or_default(), None, out);
    }
    for (output, content) in outputs.iter().zip(contents) {
        save(content, output.file(matches), out)?;
    }
    Ok(0)
}

/// Writes the survey of a folder, or of several lenses: as text, JSON or CSV, or as a page.
fn survey(
    names: &[&str],
    outputs: &[&Output],
    matches: &ArgMatches,
    out: &mut dyn Write,
) -> Result<i32> {
    const POSSIBLE: [&str; 6] = ["json", "csv", "sheet", "glass-catalogue", "gap", "work"];
    let flags = outputs.iter().map(|output| output.flag);
    let asked = flags.chain(of_one_lens(matches));
    if let Some(other) = asked.into_iter().find(|name| !POSSIBLE.contains(name)) {
        let what = match names {
            [folder] => format!("`{folder}` is a folder"),
            _ => format!("{} are named", names.len()),
        };
        let error = format!("`--{other}` needs one lens, and {what}");
        return Err(Diagnostic::error(error).with_help(
            "a folder and several lenses take --json, --csv FILE and --sheet FILE.html",
        ));
    }
    let is_page = |file: &&str| ["html", "htm"].contains(&&*lens_files::ending(file));
    if let Some(file) = text(matches, "sheet").filter(|file| !is_page(file)) {
        let error = format!("`--sheet {file}`: the sheet of several lenses is a page of HTML");
        return Err(Diagnostic::unsupported(error).with_help("end the name in .html or .htm"));
    }
    let (choice, _) =
        LensChoice::from_options("", &flags::given_options(matches), &mut Sink::new())?;
    let work = options::work(&flags::given_options(matches))?;
    let survey = match names {
        [folder] => LensSurvey::of(Path::new(folder), &choice.reading()?, work)?,
        names => LensSurvey::of_names(names, &choice.reading()?, work),
    };
    if outputs.is_empty() {
        save(survey.text(), None, out)?;
    }
    for output in outputs {
        let content = match output.flag {
            "json" => survey.json()?,
            "csv" => survey.csv(),
            _ => survey.page(),
        };
        save(content, output.file(matches), out)?;
    }
    // A file below a folder may be no lens; one that is named has to be.
    match survey.unread().filter(|_| names.len() > 1) {
        None => Ok(0),
        Some(text) => {
            print_diagnostic(&Diagnostic::error(text));
            Ok(2)
        }
    }
}

/// Refuses options that none of the outputs uses. Those of the lens itself have a warning.
fn check_uses(outputs: &[&Output], matches: &ArgMatches) -> Result<()> {
    let mut users: Vec<String> = outputs
        .iter()
        .map(|output| output.flag.to_owned())
        .collect();
    for option in ["export", "film-at"] {
        users.extend(text(matches, option).map(|value| format!("{option} {value}")));
    }
    if matches.get_flag("curves") {
        users.push("curves".to_owned());
    }
    if outputs.is_empty() {
        users.push(String::new());
    }
    let is_idle = |with: &[&str]| !users.iter().any(|user| with.contains(&user.as_str()));
    let given = USES.iter().filter(|(name, _)| is_given(matches, name));
    for (name, with) in given.filter(|(_, with)| is_idle(with)) {
        let with = with.iter().filter(|flag| !flag.is_empty());
        let with: Vec<String> = with.map(|flag| format!("`--{flag}`")).collect();
        let with: Vec<&str> = with.iter().map(String::as_str).collect();
        let text = format!("`--{name}` does nothing without {}", any_of(&with));
        if !options::lens_options().any(|option| option.name == *name) {
            return Err(Diagnostic::error(text).with_help("leave it out"));
        }
        print_diagnostic(&Diagnostic::warning(text).with_help("leave it out"));
    }
    Ok(())
}

/// Returns the options of one lens that are given.
fn of_one_lens(matches: &ArgMatches) -> impl Iterator<Item = &'static str> {
    let lens_options = options::lens_options().map(|option| option.name);
    let conditions = CONDITIONS.iter().map(|(name, ..)| *name);
    lens_options
        .chain(conditions)
        .filter(|name| is_given(matches, name))
}

/// Warns of a focus that moves the film alone if only surfaces are written or traced.
fn check_focus(outputs: &[&Output], request: &LensRequest<'_>) {
    let has_no_film = |output: &&Output| ["write", "trace"].contains(&output.flag);
    if !outputs.is_empty() && outputs.iter().all(has_no_film) && request.moves_film_alone() {
        let flag = outputs[0].flag;
        let text = format!("`--focus` does nothing with `--{flag}`: it moves the film alone");
        let help = "leave it out; `--export zmx -o FILE` writes the gap to the film";
        print_diagnostic(&Diagnostic::warning(text).with_help(help));
    }
}

/// Lists the shipped lenses, if nothing is asked for that needs a lens.
fn without_lens(outputs: &[&Output], matches: &ArgMatches, out: &mut dyn Write) -> Result<i32> {
    let flags = outputs.iter().map(|output| output.flag);
    let mut asked = flags
        .filter(|flag| *flag != "json")
        .chain(of_one_lens(matches));
    match asked.next() {
        None => save(lens_list::list(!outputs.is_empty())?, None, out),
        Some(name) => Err(Diagnostic::error(format!("`--{name}` needs a lens"))
            .with_help("`ivcam lens` lists the lenses that come with the program")),
    }
}

/// Refuses two outputs that would both go to standard output.
fn check_standard_output(outputs: &[&Output], matches: &ArgMatches) -> Result<()> {
    let mut printed = outputs.iter().filter(|o| o.file(matches).is_none());
    let (Some(first), Some(second)) = (printed.next(), printed.next()) else {
        return Ok(());
    };
    let (first, second) = (first.flag, second.flag);
    let help = match [first, second].contains(&"export") {
        true => "give `--export` a file with `-o FILE`",
        false => "run the command once for each",
    };
    let error = format!("`--{first}` and `--{second}` both write to standard output");
    Err(Diagnostic::error(error).with_help(help))
}

/// Writes an output to its file, or to standard output if it has none. Pictures have their files
/// with them.
fn save(content: Content, file: Option<&str>, out: &mut dyn Write) -> Result<i32> {
    match (content, file) {
        (Content::Pictures(pictures), _) => {
            for (file, picture) in pictures {
                picture.save(&file, Depth::Eight)?;
            }
            Ok(0)
        }
        (Content::Text(text), Some(file)) => {
            write_whole(Path::new(file), |to| to.write_all(text.as_bytes()))?;
            Ok(0)
        }
        (Content::Text(text), None) => super::exit_code(out.write_all(text.as_bytes())),
    }
}

/// Returns a list of alternatives: `a, b or c`.
fn any_of(names: &[&str]) -> String {
    match names {
        [first @ .., last] if !first.is_empty() => format!("{} or {last}", first.join(", ")),
        _ => names.concat(),
    }
}
