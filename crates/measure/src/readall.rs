//! Reads every scene below a folder and prints the messages.
//!
//! `cargo run --release -p measure -- readall -- FOLDER [-q]`; `-q` prints only
//! the summary.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use ivcam_inventor::iv::{Document, Limits};

use super::shared::scenes;

pub(crate) fn run(arguments: Vec<String>) -> ExitCode {
    let quiet = arguments.iter().any(|a| a == "-q");
    let folders = arguments.iter().filter(|a| !a.starts_with('-'));
    let mut files: Vec<PathBuf> = folders.flat_map(|f| scenes::below(Path::new(f))).collect();
    files.sort();
    let (mut read, mut bytes, mut nodes) = (0, 0, 0);
    let mut kinds: BTreeMap<String, usize> = BTreeMap::new();
    let start = Instant::now();
    for file in &files {
        let begun = Instant::now();
        match Document::open_with(file, &[], &Limits::default()) {
            Ok(document) => {
                read += 1;
                bytes += document.sources[0].len();
                nodes += document.nodes.len();
                for item in document.sink.items() {
                    *kinds.entry(shape(&item.message)).or_default() += item.count;
                }
                if !quiet {
                    let ms = begun.elapsed().as_secs_f64() * 1e3;
                    let count = document.nodes.len();
                    println!(
                        "== {} | {} | {count} nodes | {ms:.2} ms",
                        file.display(),
                        document.format
                    );
                    for item in document.sink.items() {
                        println!("{}", item.render(false));
                    }
                }
            }
            Err(error) => println!("== {}\n{}", file.display(), error.render(false)),
        }
    }
    let seconds = start.elapsed().as_secs_f64();
    for (kind, count) in kinds {
        println!("{count:6}  {kind}");
    }
    let rate = bytes as f64 / seconds / 1e6;
    println!(
        "{read} of {} files, {nodes} nodes, {bytes} bytes, {seconds:.3} s, {rate:.0} MB/s",
        files.len()
    );
    ExitCode::SUCCESS
}

/// Removes the names from a message, so that messages of a kind can be counted.
fn shape(message: &str) -> String {
    message
        .split('`')
        .enumerate()
        .map(|(i, part)| if i % 2 == 1 { "`…`" } else { part })
        .collect()
}
