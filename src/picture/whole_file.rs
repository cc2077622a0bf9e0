//! A file appears under its name only when it is whole.

use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::diag::{Diagnostic, Result};

/// Writes a file beside its name and renames it when it is whole; on any failure, nothing is left.
///
/// # Errors
/// The folder does not exist, the disk is full, or what `write` returns.
pub(crate) fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> Result<()> {
    // A link stays one: what it points to is replaced.
    let linked = path.is_symlink().then(|| std::fs::canonicalize(path).ok());
    let whole = linked.flatten();
    let path = whole.as_deref().unwrap_or(path);
    let beside = beside(path);
    let attempt = || {
        let mut file = BufWriter::new(std::fs::File::create(&beside)?);
        write(&mut file)?;
        file.into_inner()
            .map_err(std::io::IntoInnerError::into_error)?
            .sync_data()?;
        std::fs::rename(&beside, path)
    };
    attempt().map_err(|e| {
        let _ = std::fs::remove_file(&beside);
        Diagnostic::io(path.display(), &e)
    })
}

/// A name in the same folder that no other process uses.
fn beside(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}.tmp", std::process::id()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_nothing_behind() {
        let name = format!("ivcam-picture-{}-half.png", std::process::id());
        let path = std::env::temp_dir().join(name);
        let result = write_whole(&path, |file| {
            file.write_all(b"half")?;
            Err(std::io::Error::other("the disk caught fire"))
        });
        assert!(result.unwrap_err().message.contains("caught fire"));
        assert!(!path.exists() && !beside(&path).exists());
    }
}
