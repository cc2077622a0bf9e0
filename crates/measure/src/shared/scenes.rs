//! The scene files below a folder.

use std::path::{Path, PathBuf};

/// Returns every scene file, plain or gzipped, sorted by name.
pub(crate) fn below(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    collect(folder, &mut files);
    files.sort();
    files
}

fn collect(path: &Path, files: &mut Vec<PathBuf>) {
    if path.is_dir() {
        let entries = std::fs::read_dir(path).into_iter().flatten();
        for entry in entries.flatten() {
            collect(&entry.path(), files);
        }
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
