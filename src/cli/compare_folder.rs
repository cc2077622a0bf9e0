//! `ivcam compare NEW/ OLD/ -o REPORT/`: compares the pictures of two folders.

use std::io::Write;
use std::path::PathBuf;

use clap::ArgMatches;
use ivcam_base::diag::{Diagnostic, Result};

use super::compare_options::{
    limits, matching, paths, pixels_per_degree, registration, selection, sort,
};
use super::folder_mode::{FileProgress, output_folder};
use super::{
    ERROR, exit_code, print_diagnostic, print_warnings, render, render_folder, status, text,
};
use crate::compare_folder::{
    FolderComparison, FolderOptions, Photographs, ReportProgress, ReportSum,
};

/// The exit code if a limit is exceeded.
const DIFFERENT: i32 = 1;

/// Runs the command and returns the exit code: that of an error if a pair could not be compared or
/// a file could not be read, and else 1 if a limit is exceeded.
///
/// # Errors
/// Returns an error if an option is invalid, or if the report cannot be written.
pub(super) fn run(m: &ArgMatches, out: &mut dyn Write) -> Result<i32> {
    let quiet = m.get_flag("quiet");
    let comparison = FolderComparison::open(options(m)?)?;
    print_warnings(&comparison.sink);
    let [new, old] = comparison.to_search();
    if new * old > 0 && !quiet {
        status!(
            "{new} new and {old} old without a partner by name: up to {} pairs are tried by \
             picture; `--by-name` leaves them",
            new * old
        );
    }
    let mut meter = FolderMeter {
        quiet,
        progress: None,
    };
    let report = comparison.make(&mut meter)?;
    meter.end();
    report.lines.iter().for_each(|line| status!("{line}"));
    let progress = FileProgress::new(0, quiet);
    progress.finish_counting("pair", report.sum.pairs, &counts(&report.sum));
    if !quiet {
        status!("{}", report.page.display());
    }
    if report.sum.pairs == 0 {
        let error = Diagnostic::error("no new picture and no old one belong together");
        print_diagnostic(&error.with_help("`--pair FILE.csv` states which do"));
    }
    if m.get_flag("json") {
        exit_code(out.write_all(report.json.as_bytes()))?;
    }
    let ReportSum {
        pairs,
        failed,
        unreadable,
        exceeded,
        ..
    } = report.sum;
    Ok(match (pairs == 0 || failed + unreadable > 0, exceeded) {
        (true, _) => ERROR,
        (false, 0) => 0,
        (false, _) => DIFFERENT,
    })
}

/// Reads the options.
fn options(m: &ArgMatches) -> Result<FolderOptions> {
    let [new, old] = paths(m);
    let limits = limits(m)?;
    let given = |name: &str| {
        let value = text(m, name).map(|value| format!("--{name} {value}"));
        value.into_iter()
    };
    let mut words: Vec<String> = ["match", "ppd", "crop", "mask"]
        .into_iter()
        .flat_map(given)
        .collect();
    for name in ["align", "resize"] {
        words.extend(m.get_flag(name).then(|| format!("--{name}")));
    }
    if let Some(mask) = text(m, "mask").and_then(|mask| PathBuf::from(mask).metadata().ok()) {
        // A mask that has changed counts as another option.
        words.push(format!("{:?}", mask.modified().ok()));
    }
    Ok(FolderOptions {
        out: output_folder(m, &new)?,
        new,
        old,
        registration: registration(m),
        matching: matching(m),
        selection: selection(m)?,
        pixels_per_degree: pixels_per_degree(m)?,
        limits,
        sort: sort(m)?,
        pairs: text(m, "pair").map(PathBuf::from),
        by_name: m.get_flag("by-name"),
        force: render_folder::is_remade(m),
        threads: render::threads(m)?,
        words,
        photographs: Photographs {
            plan: render_folder::plan(m)?,
            given: render_folder::options_given(m),
            uses: render_folder::files_named(m),
        },
    })
}

fn counts(sum: &ReportSum) -> [(usize, &'static str); 10] {
    [
        (sum.within, "within the limits"),
        (sum.exceeded, "beyond a limit"),
        (sum.compared, "compared"),
        (sum.failed, "not compared"),
        (sum.up_to_date, "up to date"),
        (sum.by_picture, "paired by picture"),
        (sum.unpaired_new, "new without a partner"),
        (sum.unpaired_old, "old without a partner"),
        (sum.unreadable, "of these not readable"),
        (sum.beside_scenes, "pictures beside scenes left out"),
    ]
}

/// Shows the progress of one part after another.
struct FolderMeter {
    quiet: bool,
    progress: Option<FileProgress>,
}

impl FolderMeter {
    fn end(&mut self) {
        if let Some(progress) = self.progress.take() {
            progress.clear();
        }
    }
}

impl ReportProgress for FolderMeter {
    fn begin(&mut self, items: usize) {
        self.end();
        self.progress = Some(FileProgress::new(items, self.quiet));
    }

    fn done(&mut self, name: &str) {
        if let Some(progress) = &self.progress {
            progress.done(name, None);
        }
    }
}
