//! `ivcam render FOLDER -o OUT/`: makes a picture of every scene below a folder.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use clap::{Arg, ArgMatches};
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::{named_project, write_whole};
use ivcam_inventor::pose::ViewDirection;
use serde_json::{Value as Json, json};

use super::folder_mode::{
    FileProgress, create_folder, failure_line, keep_files_of_others, nothing_to_draw_line,
    output_folder, problem_text,
};
use super::{ERROR, flags, print_warnings, render, switch, text};
use crate::archive::{Job, Jobs, MadePicture, Naming, Record, for_each, make_picture};
use crate::photo::options::command_line;
use crate::photo::{Era, NEUTRAL, Override, Plan, WholeView};

/// The options that do not change a picture.
const OUTPUT_OPTIONS: [&str; 6] = ["output", "batch", "threads", "report", "quiet", "progress"];

/// The identifier of the switch `--force`.
const REMAKE: &str = "remake";

/// Returns the switch `--force`. It does not let a picture replace a file that is read.
pub(crate) fn remake() -> Arg {
    let help = "makes all pictures of a folder of scenes, also those that are up to date";
    switch(REMAKE, help).long("force")
}

/// Refuses `--force` for one scene.
///
/// # Errors
/// Returns an error if it was given.
pub(crate) fn check_alone(m: &ArgMatches) -> Result<()> {
    if !is_remade(m) {
        return Ok(());
    }
    let error = Diagnostic::error("`--force` is for a folder of scenes");
    Err(error.with_help("leave it out; the picture of one scene is always made"))
}

/// Returns whether `--force` was given.
pub(crate) fn is_remade(m: &ArgMatches) -> bool {
    m.get_flag(REMAKE)
}

/// Returns the plan of the pictures of a folder of scenes: where a scene states neither a camera
/// nor a background, it is seen from the right and above, on gray.
///
/// # Errors
/// Returns an error if an option is invalid.
pub(crate) fn plan(m: &ArgMatches) -> Result<Plan> {
    render::set_arithmetic(m)?;
    let mut plan = render::plan(m, Era::Modern)?;
    plan.view = plan.view.or(Some(Override::IfUnstated(WholeView::Side(
        ViewDirection::THREE_QUARTER,
    ))));
    plan.background = plan.background.or(Some(Override::IfUnstated(NEUTRAL)));
    Ok(plan)
}

/// The results of all scenes.
#[derive(Default)]
struct Sum {
    made: usize,
    up_to_date: usize,
    empty: usize,
    failed: usize,
    /// Pictures that have one color everywhere and so show nothing.
    one_color: usize,
    with_problems: usize,
    /// One object for each scene, for `--report`.
    files: Vec<Json>,
}

/// Runs the command and returns the exit code, which is that of an error if a scene failed.
///
/// # Errors
/// Returns an error if an option is invalid, or if the output folder cannot be used.
pub(crate) fn run(m: &ArgMatches, words: &[OsString], folder: &Path) -> Result<i32> {
    let out = output_folder(m, folder)?;
    refuse_options_of_one_scene(m)?;
    let mut plan = plan(m)?;
    let denoiser = render::denoiser(m)?;
    let threads = render::threads(m)?;
    let jobs = Jobs::find(folder, &out, "png", Naming::Short)?;
    print_warnings(&jobs.sink);
    let record = Record::open(&out, "render", options_given(m));
    let remake = is_remade(m);
    if !remake {
        keep_files_of_others(&jobs, &record, "render")?;
    }
    create_folder(&out)?;
    record.write()?;

    let uses = files_named(m);
    let is_current = |job: &Job| {
        let inputs: Vec<&Path> = uses
            .iter()
            .chain([&job.input])
            .map(PathBuf::as_path)
            .collect();
        !remake && record.is_up_to_date(&job.output, &inputs)
    };
    let (current, waiting): (Vec<Job>, Vec<Job>) = jobs.list.iter().cloned().partition(is_current);
    plan.memory = plan.memory.for_each_of(threads.min(waiting.len()));
    let quiet = m.get_flag("quiet");
    let progress = FileProgress::new(waiting.len(), quiet);
    let mut sum = Sum::default();
    current.iter().for_each(|job| sum.add_current(job));
    let work = |job: &Job| {
        let project = named_project(&job.input, folder).filter(|_| plan.contain.is_none());
        let command = command_for(words, m, job, project.as_deref());
        let plan = Plan {
            scene: job.input.clone(),
            contain: project.or_else(|| plan.contain.clone()),
            ..plan.clone()
        };
        make_picture(plan, &job.output, &command, denoiser.as_ref())
    };
    let mut done = |job: &Job, result: Result<MadePicture>| {
        let line = sum.add(job, result);
        progress.done(&job.name, line.as_deref());
    };
    for_each(&waiting, threads, &work, &mut done)?;
    progress.finish(jobs.list.len(), &sum.counts(&jobs));
    sum.write_report(m)?;
    Ok(if sum.failed > 0 { ERROR } else { 0 })
}

/// Refuses the options whose output belongs to one picture.
fn refuse_options_of_one_scene(m: &ArgMatches) -> Result<()> {
    for option in [
        "write-camera",
        "aov",
        "layers",
        "checkpoint",
        "sample-range",
        "every",
        "tev",
        "progress",
    ] {
        if text(m, option).is_some() {
            let error = format!("`--{option}` is for one scene, and this is a folder");
            return Err(Diagnostic::unsupported(error)
                .with_help("name one scene; `--report` lists the scenes of a folder"));
        }
    }
    Ok(())
}

impl Sum {
    fn add_current(&mut self, job: &Job) {
        self.up_to_date += 1;
        self.list(job, "up to date", Some(&job.output), None);
    }

    /// Adds the result of a scene, and returns the line to print about it.
    fn add(&mut self, job: &Job, result: Result<MadePicture>) -> Option<String> {
        match result {
            Err(error) => {
                self.failed += 1;
                self.list(job, "failed", None, Some(error.to_string()));
                Some(failure_line(job, &error))
            }
            Ok(made) if made.is_empty => {
                self.empty += 1;
                let problems = problem_text(job, &made.problems);
                let line = nothing_to_draw_line(job, problems.as_deref());
                self.list(job, "nothing to draw", None, problems);
                Some(line)
            }
            Ok(made) => {
                let problems = problem_text(job, &made.problems);
                self.made += 1;
                self.one_color += usize::from(made.one_color.is_some());
                self.with_problems += usize::from(problems.is_some());
                let is_said = |why: &String| problems.iter().any(|text| text.contains(why));
                let why = made.one_color.filter(|why| !is_said(why));
                let said: Vec<String> = why.into_iter().chain(problems).collect();
                let message = (!said.is_empty()).then(|| said.join("; "));
                self.list(job, "made", Some(&job.output), message.clone());
                message.map(|message| format!("{}: {message}", job.name))
            }
        }
    }

    fn list(&mut self, job: &Job, result: &str, picture: Option<&Path>, message: Option<String>) {
        self.files.push(json!({
            "file": job.name,
            "result": result,
            "picture": picture.map(|path| path.display().to_string()),
            "message": message,
        }));
    }

    fn counts(&self, jobs: &Jobs) -> [(usize, &'static str); 7] {
        let pictures = match self.made {
            1 => "picture made",
            _ => "pictures made",
        };
        [
            (self.made, pictures),
            (self.up_to_date, "up to date"),
            (self.empty, "with nothing to draw"),
            (self.failed, "failed"),
            (self.one_color, "of one color everywhere"),
            (self.with_problems, "with problems"),
            (jobs.renamed, "named with their endings"),
        ]
    }

    /// Writes the file of `--report`, if it was given.
    fn write_report(&mut self, m: &ArgMatches) -> Result<()> {
        let Some(path) = text(m, "report") else {
            return Ok(());
        };
        self.files.sort_by_key(|file| file["file"].to_string());
        let report = json!({
            "ivcam": env!("CARGO_PKG_VERSION"),
            "made": self.made,
            "up_to_date": self.up_to_date,
            "empty": self.empty,
            "failed": self.failed,
            "one_color": self.one_color,
            "files": self.files,
        });
        write_whole(Path::new(path), |file| writeln!(file, "{report:#}"))
    }
}

/// Returns the options that pictures depend on.
pub(crate) fn options_given(m: &ArgMatches) -> Json {
    let given = flags::given_options(m);
    let counts = given
        .list()
        .filter(|(name, _)| !OUTPUT_OPTIONS.contains(name));
    let text = |value: &OsString| value.to_string_lossy().into_owned();
    counts
        .map(|(name, values)| (name.to_owned(), values.iter().map(text).collect::<Json>()))
        .collect::<serde_json::Map<String, Json>>()
        .into()
}

/// Returns the files that the options name, such as a lens or a camera.
pub(crate) fn files_named(m: &ArgMatches) -> Vec<PathBuf> {
    let given = flags::given_options(m);
    let values = given
        .list()
        .filter(|(name, _)| !OUTPUT_OPTIONS.contains(name))
        .flat_map(|(_, values)| values.to_vec());
    values
        .map(PathBuf::from)
        .filter(|path| path.is_file())
        .collect()
}

/// Returns the command line that makes one of the pictures. `project` is the folder below which
/// files of its scene are opened, if it is not the scene's project.
fn command_for(words: &[OsString], m: &ArgMatches, job: &Job, project: Option<&Path>) -> String {
    let value = |id: &str| m.get_raw(id).and_then(|mut words| words.next());
    let (scene, output) = (value("scene"), value("output"));
    let of_folder = ["--search", "--contain", "--fonts"].map(OsStr::new);
    let mut line: Vec<OsString> = Vec::new();
    for word in words {
        let before = line.last().map(OsString::as_os_str);
        let attached = ["-o", "-o=", "--output="]
            .into_iter()
            .find(|start| output.is_some_and(|o| *word == joined(start, o)));
        if word == "--force" {
            continue;
        }
        line.push(if let Some(start) = attached {
            joined(start, job.output.as_os_str())
        } else if Some(word.as_os_str()) == output && before.is_some_and(is_output) {
            job.output.clone().into()
        } else if Some(word.as_os_str()) == scene && !before.is_some_and(|b| of_folder.contains(&b))
        {
            job.input.clone().into()
        } else {
            word.clone()
        });
    }
    line.extend(project.map(|folder| joined("--contain=", folder.as_os_str())));
    command_line(&line)
}

fn is_output(word: &OsStr) -> bool {
    word == "-o" || word == "--output"
}

fn joined(start: &str, end: &OsStr) -> OsString {
    let mut word = OsString::from(start);
    word.push(end);
    word
}
