//! Reads every scene below a folder, writes it and reads that: is it the same document?
//!
//! `cargo run --release --example roundtrip -- FOLDER [--only TEXT]`. Exit 1 if one is not.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

use ivcam::iv::{Document, Folder, Format, Limits};

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().unwrap_or_else(|| ".".into());
    let only = arguments.skip_while(|a| a != "--only").nth(1);
    let mut files = Vec::new();
    collect(Path::new(&folder), &mut files);
    files.sort();
    files.retain(|f| {
        only.as_ref()
            .is_none_or(|o| f.to_string_lossy().contains(o.as_str()))
    });
    let (mut read, mut ascii, mut binary, mut other) = (0, 0, 0, 0);
    for file in &files {
        let Ok(document) = Document::open(file) else {
            continue;
        };
        read += 1;
        for format in [Format::Ascii, Format::Binary] {
            if format == Format::Binary && document.is_vrml97() {
                other += 1; // protos, routes and scripts are more than binary can say
                continue;
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
    let loader = Arc::new(Folder::of(file, &[], usize::MAX));
    let name = file.display().to_string();
    match Document::read(&name, bytes, loader, &Limits::default()) {
        Ok(again) => {
            let difference = document.difference(&again)?;
            let said = again
                .sink
                .items()
                .first()
                .map(|d| d.to_string())
                .unwrap_or_default();
            Some(format!("{difference} {said}"))
        }
        Err(error) => Some(error.to_string()),
    }
}

fn collect(path: &Path, files: &mut Vec<PathBuf>) {
    if path.is_dir() {
        let entries = std::fs::read_dir(path).into_iter().flatten();
        entries
            .flatten()
            .for_each(|entry| collect(&entry.path(), files));
    } else {
        let name = path.to_string_lossy().to_lowercase();
        let name = name.trim_end_matches(".gz");
        if [".iv", ".wrl", ".env", ".vrml"]
            .iter()
            .any(|e| name.ends_with(e))
        {
            files.push(path.to_path_buf());
        }
    }
}
