//! What differs between an operating system and a web page. A page has one process, one folder of
//! files in memory without symbolic links, no folder for temporary files, and no threads.

use std::io::Result;
use std::path::{Path, PathBuf};

/// Returns the absolute path of an existing file or folder, without links and detours.
///
/// # Errors
/// Fails if there is no such file, or if a part of the path cannot be read.
#[cfg(not(target_family = "wasm"))]
pub fn real_path(path: &Path) -> Result<PathBuf> {
    path.canonicalize()
}

/// Returns the absolute path of an existing file or folder, without detours.
///
/// # Errors
/// Fails if there is no such file.
#[cfg(target_family = "wasm")]
pub fn real_path(path: &Path) -> Result<PathBuf> {
    use std::path::Component;
    path.metadata()?;
    let mut real = PathBuf::from("/");
    for part in path.components() {
        match part {
            Component::Normal(name) => real.push(name),
            Component::ParentDir => drop(real.pop()),
            _ => {}
        }
    }
    Ok(real)
}

/// Returns a number that no other running process of this machine has.
pub fn process_id() -> u32 {
    match cfg!(target_family = "wasm") {
        true => 0,
        false => std::process::id(),
    }
}

/// Returns the folder for temporary files, if the system has one.
pub fn temporary_folder() -> Option<PathBuf> {
    (!cfg!(target_family = "wasm")).then(std::env::temp_dir)
}
