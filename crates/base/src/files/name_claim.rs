//! Claims of the names of files that are written later, so that no other process takes them.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::Result;
use std::path::{Path, PathBuf};

/// The claim of a file's name: a locked file beside it. It ends when it is dropped or its process
/// ends; the file that a killed process leaves is taken over by the next claim.
#[derive(Debug)]
pub struct NameClaim {
    path: PathBuf,
    _locked: File,
}

impl NameClaim {
    /// Claims a name. Returns `None` if it is claimed already.
    ///
    /// # Errors
    /// Fails if the folder cannot be written, or has no locks.
    pub fn take(name: &Path) -> Result<Option<Self>> {
        let file_name = name.file_name().unwrap_or_default().to_string_lossy();
        let path = name.with_file_name(format!(".{file_name}.claim"));
        let mut options = OpenOptions::new();
        let locked = options
            .write(true)
            .create(true)
            .truncate(false)
            .open(&path)?;
        match locked.try_lock() {
            Ok(()) => Ok(Some(Self {
                path,
                _locked: locked,
            })),
            Err(TryLockError::WouldBlock) => Ok(None),
            Err(TryLockError::Error(error)) => {
                let _ = std::fs::remove_file(&path);
                Err(error)
            }
        }
    }
}

impl Drop for NameClaim {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::folder::Folder;

    #[test]
    fn a_name_is_claimed_once_until_the_claim_ends() {
        let folder = Folder::new("name-claim");
        let name = folder.0.join("a.png");
        let first = NameClaim::take(&name).unwrap();
        assert!(first.is_some());
        assert!(NameClaim::take(&name).unwrap().is_none());
        drop(first);
        assert!(folder.names().is_empty());
        assert!(NameClaim::take(&name).unwrap().is_some());
    }
}
