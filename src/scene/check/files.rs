//! Finds scene files in folders.

use std::path::PathBuf;

use crate::diag::{Diagnostic, Result};

/// The file name extensions of scene files.
const ENDINGS: [&str; 6] = [".iv", ".wrl", ".iv.gz", ".wrl.gz", ".wrz", ".vrml"];

/// Returns the given files, and the scene files in the given folders and their subfolders, sorted.
///
/// # Errors
/// Returns a diagnostic if a folder cannot be read or contains no scene file.
pub(crate) fn scene_files(named: &[&PathBuf]) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for path in named {
        if !path.is_dir() {
            files.push((*path).clone());
            continue;
        }
        let mut folders = vec![(*path).clone()];
        let before = files.len();
        while let Some(folder) = folders.pop() {
            let entries =
                std::fs::read_dir(&folder).map_err(|e| Diagnostic::io(folder.display(), &e))?;
            for path in entries.filter_map(|e| e.ok().map(|e| e.path())) {
                let name = path.to_string_lossy().to_lowercase();
                if path.is_dir() && !path.is_symlink() {
                    folders.push(path);
                } else if ENDINGS.iter().any(|e| name.ends_with(e)) {
                    files.push(path);
                }
            }
        }
        files[before..].sort();
        if files.len() == before {
            return Err(Diagnostic::not_found(format!(
                "no scene files below `{}`",
                path.display()
            ))
            .with_help(format!("looked for {}", ENDINGS.join(", "))));
        }
    }
    Ok(files)
}
