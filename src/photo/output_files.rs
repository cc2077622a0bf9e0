//! Guards files: no output replaces an input, and a file that cannot be written is found before the
//! work for it begins.

use std::path::{Path, PathBuf};

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::{check_writable, folder_of};
use ivcam_base::platform::real_path;

/// Checks that a file can be written, so that hours of work are not lost for want of a folder.
///
/// # Errors
/// Fails if the file's folder does not exist or nothing can be written to it, or a folder has the
/// file's name.
pub(crate) fn writable(path: &Path) -> Result<()> {
    let folder = folder_of(path);
    if !folder.is_dir() {
        return Err(
            Diagnostic::not_found(format!("there is no folder `{}`", folder.display()))
                .in_file(path.display().to_string()),
        );
    }
    if path.is_dir() {
        return Err(
            Diagnostic::error(format!("`{}` is a folder", path.display()))
                .with_help("give the output the name of a file"),
        );
    }
    check_writable(path)
}

/// Returns the input that writing to `path` would replace under any name: a link, or another
/// spelling.
pub(crate) fn overwritten_input<'a>(path: &Path, inputs: &'a [PathBuf]) -> Option<&'a PathBuf> {
    inputs.iter().find(|input| is_same_file(input, path))
}

/// Returns the existing files that a value names: one, or several with commas between.
pub fn files_in(value: &Path) -> Vec<PathBuf> {
    if value.is_file() {
        return vec![value.to_path_buf()];
    }
    let text = value.to_string_lossy();
    let parts = text.split(',').map(PathBuf::from);
    parts.filter(|part| part.is_file()).collect()
}

/// Returns whether two paths lead to one file, which need not exist.
pub(crate) fn is_same_file(a: &Path, b: &Path) -> bool {
    canonical(a) == canonical(b) || is_hard_link(a, b)
}

/// Returns the path without links and detours. Of a file that does not exist, the folder's path is
/// made so.
fn canonical(path: &Path) -> PathBuf {
    if let Ok(real) = real_path(path) {
        return real;
    }
    let folder = folder_of(path);
    let folder = real_path(&folder).unwrap_or(folder);
    folder.join(path.file_name().unwrap_or_default())
}

/// Returns whether two names stand for one entry of the disk.
#[cfg(unix)]
fn is_hard_link(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let entry = |path: &Path| path.metadata().ok().map(|m| (m.dev(), m.ino()));
    entry(a).is_some_and(|a| Some(a) == entry(b))
}

#[cfg(not(unix))]
fn is_hard_link(_: &Path, _: &Path) -> bool {
    false
}
