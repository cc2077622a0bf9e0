//! Scene files in folders.

use std::path::PathBuf;

use crate::diag::{Diagnostic, Result};

/// Endings of the files that a folder is searched for.
const ENDINGS: [&str; 6] = [".iv", ".wrl", ".iv.gz", ".wrl.gz", ".wrz", ".vrml"];

/// Every file that was named, and every scene below every folder that was named, sorted.
///
/// # Errors
/// A folder that cannot be read, or holds no scene file.
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
