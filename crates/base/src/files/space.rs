//! Asks for free disk space before a file is made, so that hours of work do not end on a full disk.

use std::path::Path;

use super::folder::folder_of;
use crate::diag::{Diagnostic, Result};
use crate::memory::size_text;

/// The size that a file may have, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SizeEstimate {
    /// The least size.
    pub least: u64,
    /// The greatest size.
    pub most: u64,
}

impl SizeEstimate {
    /// Returns the total size of `files` files of this size.
    pub fn times(self, files: u64) -> Self {
        Self {
            least: self.least.saturating_mul(files),
            most: self.most.saturating_mul(files),
        }
    }
}

/// Checks that a file or the files of a folder have room on their disk. Returns a warning if they
/// may not fit. Nothing is checked for a device or a pipe, and where the system does not report
/// the free space.
///
/// # Errors
/// Fails if the free space is less than the least size.
pub fn check_space(path: &Path, size: SizeEstimate) -> Result<Option<Box<Diagnostic>>> {
    let is_stream = path.metadata().is_ok_and(|m| !m.is_file() && !m.is_dir());
    if is_stream {
        return Ok(None);
    }
    let folder = if path.is_dir() {
        path.to_path_buf()
    } else {
        folder_of(path)
    };
    let Some(free) = free_space(&folder) else {
        return Ok(None);
    };
    match judge(path, size, free) {
        Some((true, problem)) => Err(problem),
        Some((false, problem)) => Ok(Some(problem)),
        None => Ok(None),
    }
}

/// Returns what is wrong with the free space, in bytes, and whether the file cannot fit.
fn judge(path: &Path, size: SizeEstimate, free: u64) -> Option<(bool, Box<Diagnostic>)> {
    if free >= size.most {
        return None;
    }
    let (name, free_text) = (path.display(), size_text(free));
    let cannot_fit = free < size.least;
    let diagnostic = if cannot_fit {
        let least = size_text(size.least);
        Diagnostic::error(format!(
            "`{name}` takes at least {least}, and its disk has {free_text} free"
        ))
    } else {
        let most = size_text(size.most);
        Diagnostic::warning(format!(
            "`{name}` may take up to {most}, and its disk has {free_text} free"
        ))
    };
    let help = "free some space, or write to another disk";
    Some((
        cannot_fit,
        diagnostic.in_file(name.to_string()).with_help(help),
    ))
}

/// Returns the bytes that the user may still write to the file system of a folder.
#[cfg(unix)]
fn free_space(folder: &Path) -> Option<u64> {
    let about = rustix::fs::statvfs(folder).ok()?;
    // A file system without blocks does not report its free space.
    let free = about.f_bavail.saturating_mul(about.f_frsize);
    (about.f_blocks > 0).then_some(free)
}

#[cfg(not(unix))]
fn free_space(_: &Path) -> Option<u64> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: SizeEstimate = SizeEstimate {
        least: 2_000,
        most: 3_000_000,
    };

    #[test]
    fn a_file_that_cannot_fit_is_refused_and_one_that_may_not_fit_is_warned_of() {
        let at = |free| judge(Path::new("a.png"), SIZE, free);
        assert!(at(3_000_000).is_none());
        let (cannot_fit, warning) = at(2_000).unwrap();
        assert!(!cannot_fit && warning.message.contains("up to 2.9 MB"));
        let (cannot_fit, error) = at(1_999).unwrap();
        assert!(cannot_fit && error.message.contains("at least 2.0 kB"));
        assert!(error.message.ends_with("has 2.0 kB free"));
    }

    #[cfg(unix)]
    #[test]
    fn a_disk_has_less_than_an_exabyte_free_and_a_device_is_not_asked() {
        let huge = SizeEstimate {
            least: 1 << 60,
            most: 1 << 60,
        };
        let folder = std::env::temp_dir();
        assert!(check_space(&folder.join("a.png"), huge).is_err());
        assert!(check_space(&folder, huge).is_err());
        let nothing = SizeEstimate { least: 0, most: 0 };
        assert!(check_space(&folder, nothing).unwrap().is_none());
        assert!(check_space(Path::new("/dev/null"), huge).unwrap().is_none());
    }
}
