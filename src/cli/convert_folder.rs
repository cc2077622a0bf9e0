//! `ivcam convert FOLDER --to FORMAT -o OUT/`: converts every scene below a folder.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use clap::ArgMatches;
use ivcam_base::diag::{Diagnostic, ErrorKind, Result, Severity};
use ivcam_base::files::{folder_of, named_project, write_whole};
use ivcam_base::platform::real_path;
use ivcam_inventor::iv::{Document, Limits};
use ivcam_render::scene::check::FileState;
use serde_json::{Value as Json, json};

use super::convert::{self, ConvertedFile};
use super::folder_mode::{
    FileProgress, create_folder, failure_line, keep_files_of_others, nothing_to_draw_line,
    output_folder, problem_text,
};
use super::outputs::is_forced;
use super::{ERROR, print_warnings, render, text};
use crate::archive::{EarlierResults, Job, Jobs, Naming, Record, for_each};
use crate::export::{Conversion, ExportOptions, source_report};

/// The arguments that the converted files depend on.
const OPTIONS: [&str; 12] = [
    "to",
    "tolerance",
    "scene-time",
    "animate",
    "keep-origin",
    "search",
    "contain",
    "fonts",
    "scene-limit",
    "memory",
    "work",
    "time",
];

/// What the conversion of each scene needs.
struct FolderBatch<'m> {
    folder: &'m Path,
    output: ConvertedFile,
    options: ExportOptions,
    search: Vec<&'m Path>,
    contain: Option<&'m Path>,
    limits: Limits,
    /// The scenes whose converted files have their names.
    scenes: BTreeSet<PathBuf>,
}

/// A scene that was converted, or that has nothing to draw.
struct FolderResult {
    conversion: Conversion,
    /// The warnings about the scene.
    problems: Vec<Diagnostic>,
    is_damaged: bool,
    /// The keys of the report about the scene.
    source: Json,
}

/// The results of all scenes.
#[derive(Default)]
struct ConversionSum {
    converted: usize,
    up_to_date: usize,
    empty: usize,
    failed: usize,
    damaged: usize,
    with_losses: usize,
    with_missing: usize,
    /// One object for each scene, for `--report`.
    files: Vec<Json>,
}

/// Runs the command and returns the exit code: that of an error if a scene failed, and that of
/// losses if there are some and `--strict` is given.
///
/// # Errors
/// Returns an error if an option is invalid, or if the output folder cannot be used.
pub(crate) fn run(m: &ArgMatches, folder: &Path) -> Result<i32> {
    let out = output_folder(m, folder)?;
    let output = match text(m, "to") {
        Some("ascii") => {
            let error = "`--to ascii` keeps the language of each scene, so it is for one scene";
            let help = "use `--to iv` for Inventor or `--to vrml97` for VRML97";
            return Err(Diagnostic::unsupported(error).with_help(help));
        }
        None => {
            let error = "the format of a folder of scenes is not known";
            let help = "name one with `--to`, as in `--to glb`";
            return Err(Diagnostic::error(error).with_help(help));
        }
        to => convert::wanted(to, None),
    };
    let (search, contain) = super::readable_folders(m);
    let mut batch = FolderBatch {
        folder,
        output,
        options: convert::options(m, None)?,
        search,
        contain,
        limits: super::limits(m)?,
        scenes: BTreeSet::new(),
    };
    let threads = render::threads(m)?;
    let jobs = Jobs::find(folder, &out, output.ending(), Naming::Short)?;
    print_warnings(&jobs.sink);
    let record = Record::open(&out, "convert", options_given(m));
    if !is_forced(m) {
        keep_files_of_others(&jobs, &record, "convert")?;
    }
    create_folder(&out)?;
    record.write()?;
    let earlier = EarlierResults::open(&out, "convert");
    let is_current = |job: &Job| {
        let is_newer = || record.is_up_to_date(&job.output, &[job.input.as_path()]);
        !is_forced(m) && earlier.of(&job.name).is_some() && is_newer()
    };
    let (current, waiting): (Vec<Job>, Vec<Job>) = jobs.list.iter().cloned().partition(is_current);
    let at_once = threads.min(waiting.len());
    let allowance = super::allowance(m, at_once)?;
    batch.options.model.compile.memory = allowance.memory;
    let keeps_name = |job: &&Job| job.input.file_name() == job.output.file_name();
    let inputs = jobs.list.iter().filter(keeps_name);
    batch.scenes = inputs
        .filter_map(|job| real_path(&job.input).ok())
        .collect();
    let progress = FileProgress::new(waiting.len(), false);
    let mut sum = ConversionSum::default();
    let unchanged = current.iter().filter_map(|job| earlier.of(&job.name));
    unchanged.clone().for_each(|result| sum.add_earlier(result));
    let mut results = earlier.keep(unchanged)?;
    let mut kept = Ok(());
    let mut done = |job: &Job, result: Result<Result<FolderResult>>| {
        let is_made = matches!(result, Ok(Ok(_)));
        let line = sum.add(job, result, output);
        if let Some(result) = sum.files.last().filter(|_| is_made && kept.is_ok()) {
            kept = results.add(result);
        }
        progress.done(&job.name, line.as_deref());
    };
    let convert = |job: &Job| {
        allowance.during(|| match batch.read(job) {
            Ok(document) => batch.convert(job, &document).map(Ok),
            Err(unreadable) => Ok(Err(unreadable)),
        })
    };
    for_each(&waiting, threads, &convert, &mut done)?;
    kept?;
    progress.finish(jobs.list.len(), &sum.counts(&jobs));
    sum.write_report(m)?;
    Ok(match (sum.failed, m.get_flag("strict") && sum.lost()) {
        (0, false) => 0,
        (0, true) => convert::LOSSES,
        _ => ERROR,
    })
}

impl FolderBatch<'_> {
    fn read(&self, job: &Job) -> Result<Document> {
        let project = named_project(&job.input, self.folder);
        let contain = self.contain.or(project.as_deref());
        Document::open_or_stdin(&job.input, &self.search, contain, &self.limits)
    }

    /// Converts a scene and writes its files. A scene with nothing to draw is not written.
    fn convert(&self, job: &Job, document: &Document) -> Result<FolderResult> {
        let output = self.output.of(document);
        let endings = convert::endings(output, document);
        convert::check_ending(&job.output, &endings)?;
        let stem = job.output.file_stem().unwrap_or_default();
        let options = ExportOptions {
            stem: stem.to_string_lossy().into_owned(),
            ..self.options.clone()
        };
        let terms = output.terms(document);
        let mut conversion = convert::converted(&terms, output, &options)?;
        let found = document.sink.items().iter().chain(&conversion.diagnostics);
        let problems = found.filter(|d| d.severity >= Severity::Warning).cloned();
        let problems: Vec<Diagnostic> = problems.collect();
        let source = source_report(document, &conversion, &options.model.compile);
        let kept = match output {
            ConvertedFile::Rewritten(_) => &self.scenes,
            ConvertedFile::Exported(_) => &BTreeSet::new(),
        };
        conversion.carry_files(document, [&job.input, &job.output], kept);
        // A scene that draws nothing may declare prototypes for others.
        if !conversion.is_empty || conversion.keeps_addresses {
            let folder = folder_of(&job.output);
            std::fs::create_dir_all(&folder).map_err(|e| Diagnostic::io(folder.display(), &e))?;
            convert::keep_scene(&conversion, &job.output, &job.input, document)?;
            convert::write(&conversion, &terms, output, &job.output)?;
            // The bytes of many scenes may wait to be counted.
            (conversion.bytes, conversion.beside) = Default::default();
        }
        Ok(FolderResult {
            conversion,
            problems,
            is_damaged: FileState::of(document) == FileState::Damaged,
            source,
        })
    }
}

impl ConversionSum {
    /// Adds the result of a scene, and returns the line to print about it. The inner result is an
    /// error if the scene could not be read.
    fn add(
        &mut self,
        job: &Job,
        result: Result<Result<FolderResult>>,
        output: ConvertedFile,
    ) -> Option<String> {
        let state = match &result {
            Ok(Err(_)) => json!({ "state": FileState::Unreadable.name() }),
            _ => Json::Null,
        };
        let converted = match result.flatten() {
            Ok(converted) => converted,
            Err(error) => {
                self.failed += 1;
                self.list(job, "failed", Some(error.to_string()), state);
                return Some(failure_line(job, &error));
            }
        };
        let problems = problem_text(job, &converted.problems);
        let is_missing =
            |d: &Diagnostic| matches!(d.kind, ErrorKind::NotFound | ErrorKind::OutsideFolder);
        self.with_missing += usize::from(converted.problems.iter().any(is_missing));
        self.damaged += usize::from(converted.is_damaged);
        if converted.conversion.is_empty {
            self.empty += 1;
            let line = nothing_to_draw_line(job, problems.as_deref());
            self.list(job, "nothing to draw", problems, converted.source);
            return Some(line);
        }
        let losses = &converted.conversion.losses;
        self.converted += 1;
        self.with_losses += usize::from(losses.has_stated());
        let path = job.output.display().to_string();
        let mut report = losses.json(&job.name, output.name(), &path);
        let losses = json!({ "losses": report["losses"].take() });
        let line = problems
            .as_ref()
            .map(|problems| format!("{}: {problems}", job.name));
        self.list(
            job,
            "converted",
            problems,
            convert::joined(losses, converted.source),
        );
        line
    }

    /// Adds a scene that is up to date, with what the run that converted it has found.
    fn add_earlier(&mut self, result: &Json) {
        let is_any = |key: &str| result[key].as_array().is_some_and(|list| !list.is_empty());
        let losses = result["losses"].as_array().into_iter().flatten();
        self.up_to_date += 1;
        self.damaged += usize::from(result["state"] == FileState::Damaged.name());
        self.with_losses += usize::from(losses.into_iter().any(|loss| loss["stated"] == true));
        self.with_missing += usize::from(is_any("missing") || is_any("outside"));
        let state = json!({ "result": "up to date" });
        self.files.push(convert::joined(result.clone(), state));
    }

    /// Returns whether a format could not express something, or a scene is damaged.
    fn lost(&self) -> bool {
        self.with_losses + self.damaged > 0
    }

    /// Adds a scene to the report. `more` are its further keys.
    fn list(&mut self, job: &Job, result: &str, message: Option<String>, more: Json) {
        let file = json!({
            "file": job.name,
            "result": result,
            "output": job.output.display().to_string(),
            "message": message,
            "state": Json::Null,
            "losses": Json::Null,
        });
        self.files.push(convert::joined(file, more));
    }

    fn counts(&self, jobs: &Jobs) -> [(usize, &'static str); 8] {
        [
            (self.converted, "converted"),
            (self.up_to_date, "up to date"),
            (self.empty, "with nothing to draw"),
            (self.failed, "failed"),
            (self.damaged, "damaged"),
            (self.with_losses, "with losses (`--report` lists them)"),
            (self.with_missing, "with missing files"),
            (jobs.renamed, "named with their endings"),
        ]
    }

    /// Writes the file of `--report`, if it was given.
    fn write_report(&mut self, m: &ArgMatches) -> Result<()> {
        let Some(path) = m.get_one::<PathBuf>("report") else {
            return Ok(());
        };
        self.files.sort_by_key(|file| file["file"].to_string());
        let report = json!({
            "ivcam": env!("CARGO_PKG_VERSION"),
            "converted": self.converted,
            "up_to_date": self.up_to_date,
            "empty": self.empty,
            "failed": self.failed,
            "damaged": self.damaged,
            "with_losses": self.with_losses,
            "with_missing_files": self.with_missing,
            "files": self.files,
        });
        write_whole(path, |file| writeln!(file, "{report:#}"))
    }
}

/// Returns the options that the converted files depend on.
fn options_given(m: &ArgMatches) -> Json {
    let values = |name: &str| -> Json {
        let given = m.get_raw(name).into_iter().flatten();
        given.map(|value| value.to_string_lossy()).collect()
    };
    let given = OPTIONS
        .iter()
        .map(|name| ((*name).to_owned(), values(name)));
    given.collect::<serde_json::Map<String, Json>>().into()
}
