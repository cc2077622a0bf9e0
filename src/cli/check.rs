//! `ivcam check`: what is in a scene file, what of it is drawn, and what is wrong with it.
//!
//! The JSON form is described in `docs/guide/machine.md`.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};

use super::flags::{FONTS, LIMIT};
use super::{ERROR, switch, tell};
use crate::diag::Result;
use crate::scene::CompileOptions;
use crate::scene::check::{Checked, classes, counted, scene_files};
use crate::snapshot::SnapshotOptions;

pub(crate) fn command() -> Command {
    let path = |name: &'static str| Arg::new(name).value_parser(value_parser!(PathBuf));
    Command::new("check")
        .about("Tells what is in scene files, what is drawn of it, and what is wrong")
        .arg(
            path("scenes")
                .value_name("SCENE")
                .num_args(1..)
                .required(true)
                .help("scene files, or folders to walk"),
        )
        .arg(switch("json", "answer as JSON, one object a file"))
        .arg(switch(
            "full",
            "of many files, the whole report of each, not a line",
        ))
        .arg(switch(
            "handles",
            "count the handles of draggers and manipulators in",
        ))
        .arg(
            path("search")
                .long("search")
                .value_name("FOLDER")
                .action(ArgAction::Append)
                .help("also look here for files that a scene names"),
        )
        .args([FONTS, LIMIT].iter().map(super::flags::argument))
}

pub(crate) fn run(matches: &ArgMatches, out: &mut dyn Write) -> Result<i32> {
    let named: Vec<&PathBuf> = matches.get_many("scenes").into_iter().flatten().collect();
    let search: Vec<&Path> = matches
        .get_many::<PathBuf>("search")
        .into_iter()
        .flatten()
        .map(PathBuf::as_path)
        .collect();
    let limits = super::limits(matches)?;
    let fonts = super::fonts(matches)?;
    fonts.warnings.iter().for_each(|t| tell(t));
    let options = CompileOptions {
        texture_folders: search.iter().map(|p| p.to_path_buf()).collect(),
        fonts,
        max_primitives: limits.primitives,
        max_visits: limits.visits as u64,
        ..CompileOptions::default()
    };
    let at = SnapshotOptions {
        handles: matches.get_flag("handles"),
        ..SnapshotOptions::default()
    };
    let files = scene_files(&named)?;
    let json = matches.get_flag("json");
    let several = files.len() > 1 || named.iter().any(|p| p.is_dir());
    let lines = several && !matches.get_flag("full");
    let bar = progress(files.len(), several);
    let mut total = Total::default();
    for file in &files {
        let checked = Checked::read(file, &search, &limits, &at, &options);
        total.add(&checked);
        let written = match (json, lines) {
            (true, _) if several => writeln!(out, "{}", checked.json()),
            (true, _) => writeln!(out, "{:#}", checked.json()),
            (false, true) => bar.suspend(|| writeln!(out, "{}", checked.summary())),
            (false, false) => bar.suspend(|| checked.report(out)),
        };
        super::written(written)?;
        if !json && !lines {
            bar.suspend(|| checked.problems().for_each(tell));
        } else if json && !several {
            checked.document.as_ref().err().iter().for_each(|e| tell(e));
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    if several && !json {
        super::written(writeln!(out, "{}", total.line()))?;
    }
    Ok(if total.unread > 0 { ERROR } else { 0 })
}

/// What many files come to.
#[derive(Default)]
struct Total {
    files: usize,
    unread: usize,
    with_problems: usize,
    with_unknown: usize,
    with_missing: usize,
}

impl Total {
    fn add(&mut self, checked: &Checked) {
        self.files += 1;
        self.unread += usize::from(checked.document.is_err());
        self.with_missing += usize::from(!checked.missing.is_empty());
        if let Ok((document, _)) = &checked.document {
            self.with_problems += usize::from(checked.problems().next().is_some());
            self.with_unknown += usize::from(!classes(document)[3].1.is_empty());
        }
    }

    /// `3 files: 1 not read, 1 with problems, …`; what there is none of is left out.
    fn line(&self) -> String {
        let parts = [
            (self.unread, "not read"),
            (self.with_problems, "with problems"),
            (self.with_unknown, "with unknown classes"),
            (self.with_missing, "with missing files"),
        ];
        let told: Vec<String> = parts
            .iter()
            .filter(|(n, _)| *n > 0)
            .map(|(n, what)| format!("{n} {what}"))
            .collect();
        let told = match told.is_empty() {
            true => "nothing to tell".to_owned(),
            false => told.join(", "),
        };
        format!("{}: {told}", counted(self.files, "file"))
    }
}

fn progress(files: usize, several: bool) -> indicatif::ProgressBar {
    if several && std::io::stderr().is_terminal() {
        indicatif::ProgressBar::new(files as u64)
    } else {
        indicatif::ProgressBar::hidden()
    }
}
