//! What the commands that work through a folder of scenes share: the output folder, progress, and
//! the sum at the end.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};

use clap::ArgMatches;
use ivcam_base::diag::{Diagnostic, Result, counted};
use ivcam_optics::picture::PictureFormat;

use super::outputs::is_standard_stream;
use crate::archive::{Job, Jobs, Record, RecordState};
use crate::export::Target;

/// Returns the output folder that `-o` names. It need not exist.
///
/// # Errors
/// Returns an error if there is none, or if the name is that of a file.
pub(crate) fn output_folder(m: &ArgMatches, folder: &Path) -> Result<PathBuf> {
    let folder = folder.display();
    let named = m.get_raw("output").and_then(|mut values| values.next());
    let Some(out) = named.map(PathBuf::from) else {
        let error = format!("`{folder}` is a folder, and there is no output folder");
        return Err(Diagnostic::error(error).with_help("name one with `-o OUT/`"));
    };
    refuse_standard_output(&out)?;
    if out.exists() && !out.is_dir() {
        let error = format!("`{}` is a file", out.display());
        return Err(Diagnostic::error(error).with_help(format!(
            "`{folder}` is a folder, so `-o` has to name a folder"
        )));
    }
    let is_file_name = PictureFormat::of(&out).is_ok() || Target::of_path(&out).is_some();
    if !out.exists() && is_file_name {
        let error = format!("`{}` is the name of a file", out.display());
        return Err(Diagnostic::error(error).with_help(format!(
            "`{folder}` is a folder, so `-o` has to name a folder"
        )));
    }
    Ok(out)
}

/// Refuses `-`, which stands for standard output, as the name of an output folder.
///
/// # Errors
/// Returns an error if it is the name.
pub(crate) fn refuse_standard_output(out: &Path) -> Result<()> {
    match is_standard_stream(out) {
        false => Ok(()),
        true => Err(
            Diagnostic::error("`-o -` is standard output, and several files are written")
                .with_help("name a folder with `-o OUT/`"),
        ),
    }
}

/// Creates the output folder.
///
/// # Errors
/// Returns an error if that is not possible.
pub(crate) fn create_folder(out: &Path) -> Result<()> {
    std::fs::create_dir_all(out).map_err(|e| Diagnostic::io(out.display(), &e))
}

/// Refuses an output folder with files that no earlier run of the command made.
///
/// # Errors
/// Returns an error that names the first such file.
pub(crate) fn keep_files_of_others(jobs: &Jobs, record: &Record, command: &str) -> Result<()> {
    let made = jobs.list.iter().find(|job| job.output.exists());
    let Some(job) = made.filter(|_| record.state == RecordState::Absent) else {
        return Ok(());
    };
    let path = job.output.display();
    Err(Diagnostic::error(format!(
        "`{path}` exists, and `ivcam {command}` did not make it"
    ))
    .with_help("choose another output folder, or replace it with `--force`"))
}

/// The progress over files, which is visible only on a terminal.
pub(crate) struct FileProgress {
    bar: indicatif::ProgressBar,
    quiet: bool,
}

impl FileProgress {
    /// Creates the progress for some files.
    pub(crate) fn new(files: usize, quiet: bool) -> Self {
        let bar = match quiet || !std::io::stderr().is_terminal() {
            true => indicatif::ProgressBar::hidden(),
            false => indicatif::ProgressBar::new(files as u64),
        };
        let template = "{bar:30} {pos} of {len}  {elapsed}  {wide_msg}";
        if let Ok(style) = indicatif::ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        Self { bar, quiet }
    }

    /// Counts a file, and prints a line about it if there is one.
    pub(crate) fn done(&self, name: &str, line: Option<&str>) {
        self.bar.inc(1);
        self.bar.set_message(name.to_owned());
        if let Some(line) = line {
            self.bar.suspend(|| super::status!("{line}"));
        }
    }

    /// Removes the bar and prints the sum, as in `3 scenes: 2 pictures made, 1 failed`. Counts of 0
    /// are left out.
    pub(crate) fn finish(&self, files: usize, counts: &[(usize, &str)]) {
        self.finish_counting("scene", files, counts);
    }

    /// Removes the bar.
    pub(crate) fn clear(&self) {
        self.bar.finish_and_clear();
    }

    /// Removes the bar and prints the sum as [`finish`](Self::finish) does, over items of another
    /// name.
    pub(crate) fn finish_counting(&self, item: &str, items: usize, counts: &[(usize, &str)]) {
        self.clear();
        if self.quiet {
            return;
        }
        let present = counts.iter().filter(|(n, _)| *n > 0);
        let parts: Vec<String> = present.map(|(n, what)| format!("{n} {what}")).collect();
        let items = counted(items, item);
        let line = match parts.is_empty() {
            true => items,
            false => format!("{items}: {}", parts.join(", ")),
        };
        super::print_wrapped(&line);
    }
}

/// Returns a text about the problems of a scene for a line that begins with its name: their number,
/// and the first of the worst.
pub(crate) fn problem_text(job: &Job, problems: &[Diagnostic]) -> Option<String> {
    let worst = problems
        .iter()
        .reduce(|worst, next| match next.rank() > worst.rank() {
            true => next,
            false => worst,
        })?;
    let count: usize = problems.iter().map(|d| d.count).sum();
    let worst = worst.in_line_of(&job.input.display().to_string());
    Some(format!("{}, such as {worst}", counted(count, "problem")))
}

/// Returns the line about a scene with nothing to draw, with the text about its problems.
pub(crate) fn nothing_to_draw_line(job: &Job, problems: Option<&str>) -> String {
    let more = problems.map(|problems| format!("; {problems}"));
    format!("{}: nothing to draw{}", job.name, more.unwrap_or_default())
}

/// Returns the line about a scene that failed.
pub(crate) fn failure_line(job: &Job, error: &Diagnostic) -> String {
    let message = error.in_line_of(&job.input.display().to_string());
    let help = error.help.iter().map(|help| format!("; {help}"));
    format!("{}: {message}{}", job.name, help.collect::<String>())
}
