//! Puts what opens the scenes of a catalog in a browser beside it: a built page, and the scenes
//! with the files that they need.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::{Duration, UNIX_EPOCH};

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::folder_of;

use super::entry::Entry;
use super::needs::size_and_time;
use super::place::{FILES, LIVE};
use crate::archive::{is_below, path_of};

/// The files without which a folder is no built page.
const PARTS: [&str; 3] = ["index.html", "main.js", "ivcam.wasm"];

/// Checks that a folder has a built page, and that the catalog is not written into it.
///
/// # Errors
/// Returns an error that says what is wrong.
pub(super) fn check_page(page: &Path, out: &Path) -> Result<()> {
    if let Some(part) = PARTS.iter().find(|part| !page.join(part).is_file()) {
        let text = format!(
            "`{}` is not a built page: it has no `{part}`",
            page.display()
        );
        return Err(Diagnostic::not_found(text).with_help("`web/build FOLDER` makes one"));
    }
    if is_below(out, page) || is_below(page, &out.join(LIVE)) {
        let text = format!("`{}` cannot be copied into itself", page.display());
        return Err(Diagnostic::error(text).with_help("choose another output folder"));
    }
    Ok(())
}

/// Copies a built page below the folder of a catalog.
///
/// # Errors
/// Returns an error if a file cannot be copied.
pub(super) fn copy_page(page: &Path, out: &Path) -> Result<()> {
    let mut waiting = vec![PathBuf::new()];
    while let Some(below) = waiting.pop() {
        let folder = page.join(&below);
        let io = |e: std::io::Error| Diagnostic::io(folder.display(), &e);
        for entry in std::fs::read_dir(&folder).map_err(io)? {
            let entry = entry.map_err(io)?;
            let (path, kind) = (
                below.join(entry.file_name()),
                entry.file_type().map_err(io)?,
            );
            if kind.is_dir() {
                waiting.push(path);
            } else if kind.is_file() {
                copy(&page.join(&path), &out.join(LIVE).join(&path))?;
            }
        }
    }
    Ok(())
}

/// Copies the scenes of a catalog, and the files below the folder of scenes that they need. Returns
/// the number of files outside that folder, which are not copied.
///
/// # Errors
/// Returns an error if a file cannot be copied.
pub(super) fn copy_files(folder: &Path, out: &Path, entries: &[Entry]) -> Result<usize> {
    let mut files: Vec<&str> = Vec::new();
    let mut outside: Vec<&str> = Vec::new();
    for entry in entries.iter().filter(|entry| entry.error.is_none()) {
        files.push(&entry.file);
        for need in entry.needs.iter().filter(|need| need.state == "found") {
            let list = if need.is_inside() {
                &mut files
            } else {
                &mut outside
            };
            list.push(&need.file);
        }
    }
    for list in [&mut files, &mut outside] {
        list.sort_unstable();
        list.dedup();
    }
    for file in files {
        copy(&folder.join(path_of(file)), &out.join(FILES).join(file))?;
    }
    Ok(outside.len())
}

/// Copies a file with its time, unless the copy has its size and its time already.
fn copy(from: &Path, to: &Path) -> Result<()> {
    let (size, seconds) = size_and_time(from).unwrap_or_default();
    if size_and_time(to) == Some((size, seconds)) {
        return Ok(());
    }
    let attempt = || {
        std::fs::create_dir_all(folder_of(to))?;
        std::fs::copy(from, to)?;
        let time = UNIX_EPOCH + Duration::from_secs(seconds);
        File::options().append(true).open(to)?.set_modified(time)
    };
    attempt().map_err(|e| Diagnostic::io(to.display(), &e))
}
