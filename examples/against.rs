//! Reading, and reading and compiling, held against another program's reading: time and peak memory,
//! in one run.
//!
//! `cargo run --release --example against -- FOLDER PROGRAM [--least BYTES] [--rows]`. Every scene
//! of at least 100 kB below the folder is read by either in a process of its own, three times, the
//! least time counting: processor time of all threads, so that other work does not. PROGRAM takes a scene and prints seconds and kB (`coin_read.cpp` does it
//! with Coin). Exit 1 if reading and
//! compiling is not 5 times faster than their reading (median), or any file takes more memory.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use ivcam::iv::{Document, Limits};
use ivcam::scene::{CompileOptions, RenderScene};

/// What a process took.
#[derive(Clone, Copy)]
struct Cost {
    /// Of reading alone; of theirs the same as `seconds`.
    read: f64,
    /// Of reading and compiling.
    seconds: f64,
    kilobytes: f64,
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.first().is_some_and(|a| a == "--one") {
        return one(Path::new(&arguments[1]));
    }
    let value = |name: &str| arguments.iter().skip_while(|a| *a != name).nth(1);
    let [folder, program, ..] = arguments.as_slice() else {
        eprintln!("against FOLDER PROGRAM [--least BYTES] [--rows]");
        return ExitCode::from(2);
    };
    let least = value("--least").and_then(|v| v.parse().ok());
    let rows = arguments.iter().any(|a| a == "--rows");
    let mut files = Vec::new();
    collect(Path::new(folder), least.unwrap_or(100_000), &mut files);
    files.sort();
    let mine = std::env::current_exe().expect("a program has a path");
    let mut pairs: Vec<(PathBuf, Cost, Cost)> = Vec::new();
    for file in files {
        let ours = cost(|| Command::new(&mine).arg("--one").arg(&file).output());
        let theirs = cost(|| Command::new(program).arg(&file).output());
        match (ours, theirs) {
            (Some(ours), Some(theirs)) => pairs.push((file, ours, theirs)),
            (None, _) => println!("not read by us: {}", file.display()),
            (_, None) => println!("not read by them: {}", file.display()),
        }
    }
    table(&pairs, rows)
}

/// What the system has counted for this process's threads (nanoseconds, the first number).
fn processor_seconds() -> f64 {
    let threads = std::fs::read_dir("/proc/self/task")
        .into_iter()
        .flatten()
        .flatten();
    let spent = threads.filter_map(|t| {
        let text = std::fs::read_to_string(t.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    });
    1e-9 * spent.sum::<f64>()
}

/// Processor time of a piece of work, as often done as the system's clock (4 ms) asks for.
fn seconds_each(work: &mut dyn FnMut()) -> f64 {
    let start = processor_seconds();
    for done in 1..10_000 {
        work();
        let spent = processor_seconds() - start;
        if spent > 0.1 {
            return spent / f64::from(done);
        }
    }
    0.0
}

/// Reads and compiles a scene and prints what it took.
fn one(file: &Path) -> ExitCode {
    let open = || Document::open_with(file, &[], &Limits::default());
    let compile = |d: &Document| RenderScene::compile(d, &CompileOptions::default());
    let Some(scene) = open().ok().and_then(|d| compile(&d).ok()) else {
        return ExitCode::from(1);
    };
    drop(scene);
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let peak = peak
        .and_then(|p| p.split_whitespace().next())
        .unwrap_or("0");
    let read = seconds_each(&mut || drop(open()));
    let all = seconds_each(&mut || drop(open().map(|d| compile(&d).is_ok())));
    println!("{read:.6} {all:.6} {peak}");
    ExitCode::SUCCESS
}

fn cost(mut run: impl FnMut() -> std::io::Result<std::process::Output>) -> Option<Cost> {
    let mut best: Option<Cost> = None;
    for _ in 0..3 {
        let output = run().ok().filter(|o| o.status.success())?;
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let mut numbers = text.split_whitespace().rev().filter_map(|w| w.parse().ok());
        let (kilobytes, seconds) = (numbers.next()?, numbers.next()?);
        let read = numbers.next().unwrap_or(seconds);
        best = Some(match best {
            None => Cost {
                read,
                seconds,
                kilobytes,
            },
            Some(b) => Cost {
                read: b.read.min(read),
                seconds: b.seconds.min(seconds),
                kilobytes: b.kilobytes.min(kilobytes),
            },
        });
    }
    best
}

fn table(pairs: &[(PathBuf, Cost, Cost)], rows: bool) -> ExitCode {
    println!("| | ours | theirs | theirs / ours |\n|---|---|---|---|");
    let line = |name: &str, what: &str, ours: f64, theirs: f64, digits: usize| {
        println!(
            "| {name} {what} | {ours:.digits$} | {theirs:.digits$} | {:.1} |",
            theirs / ours
        );
    };
    for (file, ours, theirs) in pairs.iter().filter(|_| rows) {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        line(&name, "read, ms", 1e3 * ours.read, 1e3 * theirs.read, 2);
        line(
            &name,
            "compiled, ms",
            1e3 * ours.seconds,
            1e3 * theirs.seconds,
            2,
        );
        line(&name, "MB", ours.kilobytes / 1e3, theirs.kilobytes / 1e3, 1);
    }
    let reading = sorted(pairs.iter().map(|(_, a, b)| b.read / a.read));
    let faster = sorted(pairs.iter().map(|(_, a, b)| b.seconds / a.seconds));
    let leaner = sorted(pairs.iter().map(|(_, a, b)| b.kilobytes / a.kilobytes));
    let (Some(slowest), Some(fattest)) = (faster.first(), leaner.first()) else {
        println!("no files to hold against each other");
        return ExitCode::from(2);
    };
    let sum = |f: fn(&Cost) -> f64, which: fn(&(PathBuf, Cost, Cost)) -> Cost| -> f64 {
        pairs.iter().map(|p| f(&which(p))).sum()
    };
    line(
        "all files,",
        "read, ms",
        1e3 * sum(|c| c.read, |p| p.1),
        1e3 * sum(|c| c.read, |p| p.2),
        0,
    );
    line(
        "all files,",
        "compiled, ms",
        1e3 * sum(|c| c.seconds, |p| p.1),
        1e3 * sum(|c| c.seconds, |p| p.2),
        0,
    );
    let median = |list: &[f64]| list[list.len() / 2];
    println!(
        "{} files; reading faster by {:.1} (median), {:.1} (least), {:.1} (most); reading and \
         compiling by {:.1} (median), {slowest:.1} (least), {:.1} (most); peak memory smaller by {:.1} (median), {fattest:.1} (least)",
        pairs.len(),
        median(&reading),
        reading[0],
        reading[reading.len() - 1],
        median(&faster),
        faster[faster.len() - 1],
        median(&leaner),
    );
    ExitCode::from(u8::from(median(&faster) < 5.0 || *fattest < 1.0))
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

fn collect(path: &Path, least: u64, files: &mut Vec<PathBuf>) {
    if path.is_dir() {
        let entries = std::fs::read_dir(path).into_iter().flatten();
        entries
            .flatten()
            .for_each(|e| collect(&e.path(), least, files));
        return;
    }
    let name = path.to_string_lossy().to_lowercase();
    let scene = [".iv", ".wrl"]
        .iter()
        .any(|e| name.trim_end_matches(".gz").ends_with(e));
    if scene && path.metadata().is_ok_and(|m| m.len() >= least) {
        files.push(path.to_path_buf());
    }
}
