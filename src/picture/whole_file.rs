//! Atomic writing: a file appears under its name only when it is complete.

use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::diag::{Diagnostic, Result};

/// Writes a temporary file in the same folder and renames it when it is complete. A failed write
/// leaves no file. A pipe or a device, such as `/dev/null`, is written to and stays what it is.
///
/// # Errors
/// Fails if the folder does not exist, the disk is full, or `write` fails.
pub(crate) fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> Result<()> {
    // A symbolic link is kept, and the file that it points to is replaced.
    let linked = path.is_symlink().then(|| std::fs::canonicalize(path).ok());
    let target = linked.flatten();
    let path = target.as_deref().unwrap_or(path);
    if path.metadata().is_ok_and(|m| !m.is_file() && !m.is_dir()) {
        let stream = std::fs::OpenOptions::new().write(true).open(path);
        return stream
            .and_then(|mut stream| write(&mut stream).and_then(|()| stream.flush()))
            .map_err(|e| Diagnostic::io(path.display(), &e));
    }
    let temporary = temporary(path);
    let attempt = || {
        let mut file = BufWriter::new(std::fs::File::create(&temporary)?);
        write(&mut file)?;
        file.into_inner()
            .map_err(std::io::IntoInnerError::into_error)?
            .sync_data()?;
        std::fs::rename(&temporary, path)
    };
    attempt().map_err(|e| {
        let _ = std::fs::remove_file(&temporary);
        Diagnostic::io(path.display(), &e)
    })
}

/// Returns a path in the same folder that no other process uses.
fn temporary(path: &Path) -> PathBuf {
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
        assert!(!path.exists() && !temporary(&path).exists());
    }
}
