//! Reads every scene below a folder, writes it, reads the result, and compares the documents.
//!
//! `cargo run --release -p measure -- roundtrip -- FOLDER [--only TEXT]
//! [--keep FOLDER]`. The exit code is 1 if a document differs, or if reading it back gives a
//! message that reading the scene did not. `--keep` keeps the written files in a folder.

use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

use ivcam_inventor::iv::{Document, FolderLoader, Format, Limits};

use super::shared::scenes;
use super::shared::words::value_of;

pub(crate) fn run(arguments: Vec<String>) -> ExitCode {
    let folder = arguments.first().cloned().unwrap_or_else(|| ".".into());
    let option = |name: &str| value_of(name, &arguments);
    let (only, keep) = (option("--only"), option("--keep"));
    let mut files = scenes::below(Path::new(&folder));
    files.retain(|f| {
        only.as_ref()
            .is_none_or(|o| f.to_string_lossy().contains(o.as_str()))
    });
    let (mut read, mut ascii, mut binary, mut other) = (0, 0, 0, 0);
    for (number, file) in files.iter().enumerate() {
        let Ok(document) = Document::open(file) else {
            continue;
        };
        read += 1;
        for format in [Format::Ascii, Format::Binary] {
            if format == Format::Binary && document.is_vrml97() {
                other += 1; // The binary format cannot represent protos, routes and scripts.
                continue;
            }
            if let Some(folder) = keep {
                let kind = if format == Format::Ascii {
                    "ascii"
                } else {
                    "binary"
                };
                let path = Path::new(folder).join(format!("{number:03}-{kind}.iv"));
                if let Err(error) = std::fs::write(&path, document.write(format)) {
                    eprintln!("{}: {error}", path.display());
                }
            }
            match again(&document, file, format) {
                None if format == Format::Ascii => ascii += 1,
                None => binary += 1,
                Some(difference) => println!("{} {format:?}: {difference}", file.display()),
            }
        }
    }
    println!(
        "{read} files read; the same after ASCII {ascii}, after binary {binary} of {}",
        read - other
    );
    if ascii == read && binary == read - other {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(1)
    }
}

fn again(document: &Document, file: &Path, format: Format) -> Option<String> {
    let bytes = document.write(format);
    let loader = Arc::new(FolderLoader::new(file, &[], usize::MAX));
    let name = file.display().to_string();
    match Document::read(&name, bytes, loader, &Limits::default()) {
        Ok(again) => {
            let said = |d: &Document| d.sink.items().len();
            let last = again.sink.items().last().map(|d| d.to_string());
            let more = last.filter(|_| said(&again) > said(document));
            let difference = document.difference(&again).or(more.clone())?;
            Some(format!("{difference} {}", more.unwrap_or_default()))
        }
        Err(error) => Some(error.to_string()),
    }
}
