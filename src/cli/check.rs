//! `ivcam check`: lists the contents of scene files, what is drawn of them, and their problems.
//!
//! The JSON form is described in `docs/guide/machine.md`.

use std::io::{IsTerminal, Write};
use std::path::PathBuf;

use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use ivcam_base::diag::{Result, Sink, counted};
use ivcam_base::files::named_project;
use ivcam_inventor::events::SnapshotOptions;
use ivcam_optics::film::Resolution;
use ivcam_render::scene::CompileOptions;
use ivcam_render::scene::check::{
    Checked, FileState, classes, packed, scene_files, unexpected_ending,
};

use super::flags::{DRAG, EVENT, FONTS, LIMIT, MEMORY, TIME, TOUCH, WORK, argument, given_options};
use super::messages::print_first;
use super::{ERROR, print_diagnostic, print_warnings, switch};
use crate::photo::{options, snapshot_options};

/// Returns the definition of the command.
pub(crate) fn command() -> Command {
    let path = |name: &'static str| Arg::new(name).value_parser(value_parser!(PathBuf));
    Command::new("check")
        .about("Lists the contents of scene files, what is drawn of them, and their problems")
        .arg(
            path("scenes")
                .value_name("SCENE")
                .num_args(1..)
                .required(true)
                .help("scene files, folders with scene files, or - for standard input"),
        )
        .arg(
            Arg::new("only")
                .long("only")
                .value_name("STATE")
                .action(ArgAction::Append)
                .value_delimiter(',')
                .value_parser(FileState::ALL.map(FileState::name))
                .help("reports only files in these states; the last line counts all files"),
        )
        .arg(switch("json", "prints JSON, one object per file"))
        .arg(switch(
            "full",
            "prints the whole report of each of several files instead of a line",
        ))
        .arg(switch(
            "events",
            "lists the events that nodes send until --scene-time",
        ))
        .args([&TIME, &EVENT, &TOUCH, &DRAG].map(argument))
        .arg(switch(
            "handles",
            "includes the handles of draggers and manipulators",
        ))
        .args(super::reading_arguments())
        .args([FONTS, LIMIT, MEMORY, WORK].iter().map(argument))
}

/// Runs the command and returns the exit code.
pub(crate) fn run(matches: &ArgMatches, out: &mut dyn Write) -> Result<i32> {
    let named: Vec<&PathBuf> = matches.get_many("scenes").into_iter().flatten().collect();
    let (search, contain) = super::readable_folders(matches);
    let limits = super::limits(matches)?;
    let allowance = super::allowance(matches, 1)?;
    let fonts = super::fonts(matches)?;
    fonts.warnings.iter().for_each(|t| print_diagnostic(t));
    let options = CompileOptions {
        texture_folders: search.iter().map(|p| p.to_path_buf()).collect(),
        fonts,
        limits: limits.clone(),
        memory: super::memory(matches)?.bytes(),
        ..CompileOptions::default()
    };
    let given = given_options(matches);
    let at = SnapshotOptions {
        handles: matches.get_flag("handles"),
        log: matches.get_flag("events"),
        actions: options::actions(&given)?,
        aspect: Some(Resolution::VINTAGE.aspect()),
        ..snapshot_options(options::scene_time(&given)?.unwrap_or_default())
    };
    let mut skipped = Sink::new();
    let files = scene_files(&named, &mut skipped)?;
    print_warnings(&skipped);
    let json = matches.get_flag("json");
    let several = files.len() > 1 || named.iter().any(|p| p.is_dir());
    let lines = several && !matches.get_flag("full");
    let only: Vec<&String> = matches.get_many("only").into_iter().flatten().collect();
    let bar = progress(files.len(), several);
    let mut total = Total::default();
    for file in &files {
        let named = named
            .iter()
            .find(|path| path.is_dir() && file.starts_with(path));
        let project = named.and_then(|folder| named_project(file, folder));
        let contain = contain.or(project.as_deref());
        let checked =
            allowance.during(|| Checked::read(file, &search, contain, &limits, &at, &options));
        total.add(&checked);
        bar.inc(1);
        if !only.is_empty() && !only.iter().any(|state| *state == checked.state().name()) {
            continue;
        }
        let result = match (json, lines) {
            (true, _) if several => writeln!(out, "{}", checked.json()),
            (true, _) => writeln!(out, "{:#}", checked.json()),
            (false, true) => bar.suspend(|| writeln!(out, "{}", checked.summary())),
            (false, false) => bar.suspend(|| checked.report(out)),
        };
        super::exit_code(result)?;
        if !json && !lines {
            bar.suspend(|| print_first(checked.diagnostics().into_iter()));
        } else if json && !several {
            checked
                .document
                .as_ref()
                .err()
                .iter()
                .for_each(|e| print_diagnostic(e));
        }
    }
    bar.finish_and_clear();
    if several && json {
        super::status!("{}", total.line());
    } else if several {
        super::exit_code(writeln!(out, "{}", total.line()))?;
    }
    Ok(if total.states[2] > 0 { ERROR } else { 0 })
}

/// The numbers of files with each kind of problem.
#[derive(Default)]
struct Total {
    files: usize,
    /// The numbers of files by state, in the order of [`FileState::ALL`].
    states: [usize; 3],
    with_problems: usize,
    with_unknown: usize,
    packed: usize,
    with_unexpected_ending: usize,
    with_missing: usize,
    with_outside: usize,
}

impl Total {
    fn add(&mut self, checked: &Checked) {
        self.files += 1;
        self.states[checked.state() as usize] += 1;
        let (missing, outside) = checked.missing_and_outside();
        self.with_missing += usize::from(missing > 0);
        self.with_outside += usize::from(outside > 0);
        if let Ok((document, _)) = &checked.document {
            self.with_problems += usize::from(checked.problems().next().is_some());
            self.with_unknown += usize::from(!classes(document)[3].1.is_empty());
            self.packed += usize::from(packed(document).is_some());
            let ending = unexpected_ending(&checked.file, document);
            self.with_unexpected_ending += usize::from(ending.is_some());
        }
    }

    /// Returns the totals as `3 files: 1 whole, 1 damaged, 1 unreadable, 1 with problems, …`.
    /// Counts of 0 are omitted, except those of the states.
    fn line(&self) -> String {
        let states: Vec<String> = FileState::ALL
            .iter()
            .zip(self.states)
            .map(|(state, n)| format!("{n} {}", state.name()))
            .collect();
        let parts = [
            (self.with_problems, "with problems"),
            (self.with_unknown, "with unknown classes"),
            (self.packed, "packed with gzip"),
            (self.with_unexpected_ending, "named unlike their format"),
            (self.with_missing, "with missing files"),
            (
                self.with_outside,
                "with files outside the folder (`--search` opens more)",
            ),
        ];
        let present = parts.iter().filter(|(n, _)| *n > 0);
        let counts = present.map(|(n, what)| format!("{n} {what}"));
        let all: Vec<String> = states.into_iter().chain(counts).collect();
        format!("{}: {}", counted(self.files, "file"), all.join(", "))
    }
}

/// Returns a progress bar, which is visible only for several files on a terminal.
fn progress(files: usize, several: bool) -> indicatif::ProgressBar {
    if several && std::io::stderr().is_terminal() {
        indicatif::ProgressBar::new(files as u64)
    } else {
        indicatif::ProgressBar::hidden()
    }
}
