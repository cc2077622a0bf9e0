//! Checks what must be seen in the scenes of the standard's own test suite.
//!
//! `cargo run --release -p measure -- suite PROGRAM FOLDER [--only TEXT] [--keep FOLDER]`.
//!
//! The folder has the X3D scenes of NIST's VRML97 suite of 1999 (`examples/ConformanceNist` of
//! the Web3D archive, or a sample of it). PROGRAM is `ivcam` with the feature `scripts`. Pictures
//! and levels of detail are replaced by stand-ins of known colors, and each scene is drawn as a
//! viewer of its time shows it, by the standard's own equation of light (`--look viewer -s p`).
//! `entries.txt` says what must be seen; its values come from the standard and from the scenes.
//! Prints a row for each category, and the checks that fail. The exit code is 1 if a check fails.
//! `--keep` names a new folder for the scenes and pictures, which stay there.

mod checks;
mod entries;
mod folder;
mod stand_ins;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use rayon::prelude::*;

use self::checks::Judge;
use self::entries::SuiteEntry;
use self::folder::Folder;
use super::shared::words::value_of;

/// What became of an entry.
enum Verdict {
    Passed,
    Failed(Vec<String>),
    /// The entry has no check, only words that say why.
    NotJudged,
    /// The scene is not in the folder.
    Absent,
}

/// The numbers of a category's entries.
#[derive(Default)]
struct CategoryCounts {
    passed: usize,
    failed: usize,
    not_judged: usize,
    absent: usize,
}

pub(crate) fn run(arguments: Vec<String>) -> ExitCode {
    let value = |name: &str| value_of(name, &arguments);
    let [program, suite, ..] = arguments.as_slice() else {
        return crate::usage("suite");
    };
    let usual = std::env::temp_dir().join(format!("ivcam-suite-{}", std::process::id()));
    let kept = value("--keep").map(PathBuf::from);
    let root = kept.clone().unwrap_or(usual);
    let result = measure(
        Path::new(program),
        Path::new(suite),
        &root,
        value("--only").map(String::as_str),
    );
    if kept.is_none() {
        drop(std::fs::remove_dir_all(&root));
    }
    result.unwrap_or_else(|message| {
        eprintln!("{message}");
        ExitCode::from(2)
    })
}

fn measure(
    program: &Path,
    suite: &Path,
    root: &Path,
    only: Option<&str>,
) -> Result<ExitCode, String> {
    let entries = entries::parse(include_str!("entries.txt"))?;
    let folder = Folder::copy(suite, root)?;
    stand_ins::write(&folder)?;
    let chosen = |e: &&SuiteEntry| only.is_none_or(|text| e.names.iter().any(|n| n.contains(text)));
    let chosen: Vec<&SuiteEntry> = entries.iter().filter(chosen).collect();
    let judge = Judge { program, root };
    let verdicts: Vec<Verdict> = chosen
        .par_iter()
        .map(|entry| verdict(&judge, &folder, entry))
        .collect();
    Ok(report(&chosen, &verdicts))
}

fn verdict(judge: &Judge<'_>, folder: &Folder, entry: &SuiteEntry) -> Verdict {
    let Some(scene) = folder.scene(&entry.names) else {
        return Verdict::Absent;
    };
    if entry.pictures.iter().all(|(_, checks)| checks.is_empty()) {
        return Verdict::NotJudged;
    }
    let mut failures = Vec::new();
    for (number, (setting, checks)) in entry.pictures.iter().enumerate() {
        let wrong = judge.failures(&scene, number, setting, checks);
        let place = |text: String| format!("at {} s, picture {number}: {text}", setting.time);
        failures.extend(wrong.unwrap_or_else(|e| vec![e]).into_iter().map(place));
    }
    match failures.is_empty() {
        true => Verdict::Passed,
        false => Verdict::Failed(failures),
    }
}

/// Prints the table and the failures.
fn report(entries: &[&SuiteEntry], verdicts: &[Verdict]) -> ExitCode {
    let mut rows: BTreeMap<&str, CategoryCounts> = BTreeMap::new();
    let mut sum = CategoryCounts::default();
    for (entry, verdict) in entries.iter().zip(verdicts) {
        for row in [rows.entry(entry.category()).or_default(), &mut sum] {
            match verdict {
                Verdict::Passed => row.passed += 1,
                Verdict::Failed(_) => row.failed += 1,
                Verdict::NotJudged => row.not_judged += 1,
                Verdict::Absent => row.absent += 1,
            }
        }
    }
    println!("| category | scenes | pass | fail | not judged |\n|---|---|---|---|---|");
    for (name, row) in rows.iter().chain([(&"all", &sum)]) {
        let scenes = row.passed + row.failed + row.not_judged;
        println!(
            "| {name} | {scenes} | {} | {} | {} |",
            row.passed, row.failed, row.not_judged
        );
    }
    println!(
        "\n{} scenes of the table are not in the folder.",
        sum.absent
    );
    for (entry, verdict) in entries.iter().zip(verdicts) {
        let name = &entry.names[0];
        match (verdict, &entry.against) {
            (Verdict::Failed(failures), _) => {
                println!("\nfails: {name}\n  {}", entry.words);
                failures.iter().for_each(|failure| println!("  {failure}"));
            }
            (Verdict::NotJudged, _) => println!("\nnot judged: {name}\n  {}", entry.words),
            (Verdict::Passed, Some(words)) => {
                println!("\nby the standard, against the suite's sentence: {name}\n  {words}");
            }
            _ => {}
        }
    }
    ExitCode::from(u8::from(sum.failed > 0))
}
