//! Compares the time and peak memory of reading and compiling with another program's reading.
//!
//! `cargo run --release -p measure -- against -- FOLDER PROGRAM [--least BYTES]
//! [--rows]`. Every scene of at least 100 kB below the folder is read by both programs in processes
//! of their own, repeatedly for half a second of processor time (all threads, so that other load
//! does not count; the other program a tenth); the fastest of three such processes counts. PROGRAM
//! takes a scene and prints the seconds per reading and the kB that the process had used after the
//! first (`coin_read.cpp` does so with Coin).
//!
//! *Compiled* is everything but the tree for ray tracing: triangles, normals, materials, textures
//! of files, lights, bounds. *Ready* includes the tree, which is built for the first ray, and the
//! decoding of pictures within the scene file, which otherwise waits for the first texel. Memory
//! includes the tree. The exit code is 1 if reading and compiling is not 5 times faster than the
//! other program's reading (median), or any file takes more memory.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use ivcam_inventor::iv::{Document, Limits};
use ivcam_inventor::snapshot::Snapshot;
use ivcam_render::scene::{CompileOptions, RenderScene};

use super::shared::pictures::peak_kilobytes;
use super::shared::scenes;
use super::shared::words::value_of;

/// The cost of a process.
#[derive(Clone, Copy)]
struct Cost {
    /// Seconds of reading, of reading and compiling, and of both with the tree. The other program's
    /// three are equal.
    seconds: [f64; 3],
    kilobytes: f64,
}

const STAGES: [&str; 3] = ["read", "compiled", "ready"];

pub(crate) fn run(arguments: Vec<String>) -> ExitCode {
    if arguments.first().is_some_and(|a| a == "--one") {
        return one(Path::new(&arguments[1]));
    }
    let value = |name: &str| value_of(name, &arguments);
    let [folder, program, ..] = arguments.as_slice() else {
        return crate::usage("against");
    };
    let least = value("--least")
        .and_then(|v| v.parse::<u64>().ok())
        .unwrap_or(100_000);
    let rows = arguments.iter().any(|a| a == "--rows");
    let mut files = scenes::below(Path::new(folder));
    files.retain(|file| file.metadata().is_ok_and(|m| m.len() >= least));
    let mine = std::env::current_exe().expect("a program has a path");
    let mut pairs: Vec<(PathBuf, Cost, Cost)> = Vec::new();
    for file in files {
        let ours = cost(|| {
            Command::new(&mine)
                .args(["against", "--one"])
                .arg(&file)
                .output()
        });
        let theirs = cost(|| Command::new(program).arg(&file).output());
        match (ours, theirs) {
            (Some(ours), Some(theirs)) => pairs.push((file, ours, theirs)),
            (None, _) => println!("not read by us: {}", file.display()),
            (_, None) => println!("not read by them: {}", file.display()),
        }
    }
    table(&pairs, rows)
}

/// Returns the processor time of this process's threads, those that have ended too: the user's and
/// the system's part, in hundredths of seconds (fields 14 and 15).
fn processor_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // The name of the program before the third field may have spaces.
    let fields = text.rsplit(") ").next().unwrap_or_default();
    let spent = fields.split_whitespace().skip(11).take(2);
    0.01 * spent.filter_map(|n| n.parse::<f64>().ok()).sum::<f64>()
}

/// Returns the processor time of a piece of work, repeated as that clock requires.
fn seconds_each(work: &mut dyn FnMut()) -> f64 {
    let start = processor_seconds();
    for done in 1..10_000 {
        work();
        let spent = processor_seconds() - start;
        if spent > 0.5 {
            return spent / f64::from(done);
        }
    }
    0.0
}

/// Reads and compiles a scene and prints the cost.
fn one(file: &Path) -> ExitCode {
    let open = || Document::open_with(file, &[], &Limits::default()).ok();
    let compile =
        |d: Document| RenderScene::compile(&Snapshot::at(&d, 0.0), &CompileOptions::default()).ok();
    let ready = || {
        open()
            .and_then(compile)
            .inspect(|scene| scene.prepare(u64::MAX))
    };
    if ready().is_none() {
        return ExitCode::from(1);
    }
    let peak = peak_kilobytes().unwrap_or(0);
    let seconds = [
        seconds_each(&mut || drop(open())),
        seconds_each(&mut || drop(open().and_then(compile))),
        seconds_each(&mut || drop(ready())),
    ];
    let [read, compiled, ready] = seconds;
    println!("{read:.7} {compiled:.7} {ready:.7} {peak}");
    ExitCode::SUCCESS
}

fn cost(mut run: impl FnMut() -> std::io::Result<std::process::Output>) -> Option<Cost> {
    let mut best: Option<Cost> = None;
    for _ in 0..3 {
        let output = run().ok().filter(|o| o.status.success())?;
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let numbers: Vec<f64> = text
            .split_whitespace()
            .filter_map(|w| w.parse().ok())
            .collect();
        let (kilobytes, seconds) = numbers.split_last()?;
        let last = *seconds.last()?;
        let new = Cost {
            seconds: [0, 1, 2].map(|i| seconds.get(i).copied().unwrap_or(last)),
            kilobytes: *kilobytes,
        };
        let least = |b: Cost| Cost {
            seconds: [0, 1, 2].map(|i| new.seconds[i].min(b.seconds[i])),
            kilobytes: new.kilobytes.min(b.kilobytes),
        };
        best = Some(best.map_or(new, least));
    }
    best
}

fn table(pairs: &[(PathBuf, Cost, Cost)], rows: bool) -> ExitCode {
    if pairs.is_empty() {
        println!("no files to compare");
        return ExitCode::from(2);
    }
    println!("| | ivcam | other | other / ivcam |\n|---|---|---|---|");
    for (file, ours, theirs) in pairs.iter().filter(|_| rows) {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        for (i, stage) in STAGES.iter().enumerate() {
            let (a, b) = (1e3 * ours.seconds[i], 1e3 * theirs.seconds[i]);
            println!("| {name} {stage}, ms | {a:.3} | {b:.3} | {:.1} |", b / a);
        }
        let (a, b) = (ours.kilobytes / 1e3, theirs.kilobytes / 1e3);
        println!("| {name} MB | {a:.1} | {b:.1} | {:.1} |", b / a);
    }
    let mut median = [0.0; 3];
    println!(
        "\n| {} files | faster by (median) | least | most | all: ivcam, ms | other, ms |",
        pairs.len()
    );
    println!("|---|---|---|---|---|---|");
    for (i, stage) in STAGES.iter().enumerate() {
        let ratios = sorted(pairs.iter().map(|(_, a, b)| b.seconds[i] / a.seconds[i]));
        let sum =
            |f: &dyn Fn(&(PathBuf, Cost, Cost)) -> f64| 1e3 * pairs.iter().map(f).sum::<f64>();
        median[i] = ratios[ratios.len() / 2];
        println!(
            "| {stage} | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} |",
            median[i],
            ratios[0],
            ratios[ratios.len() - 1],
            sum(&|p| p.1.seconds[i]),
            sum(&|p| p.2.seconds[i]),
        );
    }
    let leaner = sorted(pairs.iter().map(|(_, a, b)| b.kilobytes / a.kilobytes));
    println!(
        "peak memory smaller by {:.2} (median), {:.2} (least); larger for {}",
        leaner[leaner.len() / 2],
        leaner[0],
        leaner.iter().filter(|r| **r < 1.0).count()
    );
    ExitCode::from(u8::from(median[1] < 5.0 || leaner[0] < 1.0))
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}
