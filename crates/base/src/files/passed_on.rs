//! The contents of input files that one process reads and passes on to others.
//!
//! Processes that make one picture together open the same files at the same time, which a file
//! server notices. The first process keeps what it reads, and the others take it from there.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{PoisonError, RwLock};

/// The contents of files, by the paths under which they are opened.
pub type Contents = BTreeMap<PathBuf, Vec<u8>>;

/// Whether this process shares the files that it reads with other processes.
enum Passing {
    /// It reads files for itself.
    Off,
    /// It keeps the contents of all files, to send them.
    Keeps(Contents),
    /// It uses the contents that another process has sent.
    Has(Contents),
}

static PASSING: RwLock<Passing> = RwLock::new(Passing::Off);

/// Keeps the contents of all files that this process reads from now on.
pub fn keep_contents() {
    *PASSING.write().unwrap_or_else(PoisonError::into_inner) = Passing::Keeps(Contents::new());
}

/// Stops keeping contents, and returns those that were kept.
pub fn kept_contents() -> Contents {
    let mut passing = PASSING.write().unwrap_or_else(PoisonError::into_inner);
    match std::mem::replace(&mut *passing, Passing::Off) {
        Passing::Keeps(contents) => contents,
        _ => Contents::new(),
    }
}

/// Makes this process take the contents of files from another one.
pub fn take_contents(contents: Contents) {
    *PASSING.write().unwrap_or_else(PoisonError::into_inner) = Passing::Has(contents);
}

/// Returns the contents of a file that another process has read.
pub(super) fn taken(path: &Path) -> Option<Vec<u8>> {
    match &*PASSING.read().unwrap_or_else(PoisonError::into_inner) {
        Passing::Has(contents) => contents.get(path).cloned(),
        _ => None,
    }
}

/// Keeps the contents of a file, if this process keeps any.
pub(super) fn keep(path: &Path, bytes: &[u8]) {
    let keeps = || {
        matches!(
            *PASSING.read().unwrap_or_else(PoisonError::into_inner),
            Passing::Keeps(_)
        )
    };
    if !keeps() {
        return;
    }
    if let Passing::Keeps(contents) = &mut *PASSING.write().unwrap_or_else(PoisonError::into_inner)
    {
        contents.insert(path.to_owned(), bytes.to_owned());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::read_file;

    /// The state belongs to the process, so one test goes through all of it.
    #[test]
    fn contents_that_are_kept_can_be_taken_elsewhere() {
        let path = std::env::temp_dir().join(format!("ivcam-passed-on-{}", std::process::id()));
        std::fs::write(&path, "first").unwrap();
        keep_contents();
        assert_eq!(read_file(&path, 100).unwrap(), b"first");
        let contents = kept_contents();
        assert_eq!(contents[&path], b"first");
        std::fs::write(&path, "second").unwrap();
        assert_eq!(read_file(&path, 100).unwrap(), b"second");
        take_contents(contents);
        assert_eq!(read_file(&path, 100).unwrap(), b"first");
        take_contents(Contents::new());
        std::fs::remove_file(&path).unwrap();
    }
}
