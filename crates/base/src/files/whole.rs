//! Atomic writing: a file appears under its name only when it is complete.
//!
//! The bytes go to a temporary file in the same folder, which is renamed at the end. Its name is
//! random and it is created exclusively, so that no two processes share one, also on different
//! machines with one folder. It is locked while its process lives. An unlocked one is left over
//! from a process that died, and the next process that writes the same file removes it.

use std::fs::{File, OpenOptions};
use std::hash::{BuildHasher, RandomState};
use std::io::{BufWriter, Cursor, Error, ErrorKind, Seek, Write};
use std::path::{Path, PathBuf};

use super::folder::folder_of;
#[cfg(unix)]
use super::pipes;
use crate::diag::{Diagnostic, Result};
use crate::platform::process_id;

/// Temporary names that are tried in turn. A second one is needed only if two processes chose the
/// same 64 random bits.
const TRIES: usize = 8;

/// The symbolic links that are followed from one name, as many as Linux follows.
const MOST_LINKS: usize = 40;

/// The longest part of a file's name in those of its temporary files. A name has at most 255 bytes,
/// and what follows takes up to 30.
const LONGEST_PREFIX: usize = 220;

/// A file that can be written under its name.
struct Writable {
    /// The file that is replaced. A symbolic link is kept, and this is the file that it points to.
    target: PathBuf,
    kind: TargetKind,
}

enum TargetKind {
    /// A temporary file, which becomes the target.
    Temporary(Temporary),
    /// A pipe or a device such as `/dev/null`, which is written to and stays what it is.
    Stream(File),
}

/// A locked file, removed when it is dropped.
struct Temporary {
    path: PathBuf,
    file: File,
}

impl Writable {
    /// Opens the stream, or creates the temporary file.
    fn new(path: &Path) -> Result<Self> {
        let target = match is_stream(path) {
            true => path.to_path_buf(),
            false => link_target(path),
        };
        let is_wrong_name = |e: &Error| e.kind() == ErrorKind::InvalidFilename;
        if let Some(e) = target.symlink_metadata().err().filter(is_wrong_name) {
            return Err(Diagnostic::io(path.display(), &e));
        }
        let kind = if is_stream(&target) {
            open_stream(&target).map(TargetKind::Stream)
        } else {
            remove_leftovers(&target);
            Temporary::beside(&target).map(TargetKind::Temporary)
        };
        let kind = kind.map_err(|e| Diagnostic::io(path.display(), &e))?;
        Ok(Self { target, kind })
    }

    /// Writes the file, and gives it its name when it is complete.
    fn write(self, write: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> Result<()> {
        let Self { target, kind } = self;
        let attempt = || match kind {
            TargetKind::Stream(mut stream) => {
                write(&mut stream)?;
                stream.flush()
            }
            TargetKind::Temporary(temporary) => temporary.write(&target, |to| write(to)),
        };
        attempt().map_err(|e| Diagnostic::io(target.display(), &e))
    }
}

/// Checks that a file can be written, by creating a temporary file beside it. This finds a folder
/// or a file system that is read-only and a name that is too long before any work is done.
///
/// # Errors
/// Fails if the file could not be written.
pub fn check_writable(path: &Path) -> Result<()> {
    if is_stream(path) {
        return Ok(()); // Opening a pipe waits for its reader.
    }
    Writable::new(path).map(|_| ())
}

/// Writes a file that appears under its name only when it is complete. A failed write leaves no
/// file. A pipe or a device, such as `/dev/null`, is written to and stays what it is.
///
/// # Errors
/// Fails if the folder does not exist, the disk is full, or `write` fails.
pub fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> Result<()> {
    Writable::new(path)?.write(write)
}

/// Writes a file that does not exist yet, and appears only when it is complete. Returns whether it
/// was written: of several processes that try, one writes it.
///
/// # Errors
/// Fails if the folder does not exist or the disk is full.
pub fn write_new(path: &Path, content: &[u8]) -> Result<bool> {
    let attempt = || {
        let temporary = Temporary::beside(path)?;
        (&temporary.file).write_all(content)?;
        temporary.file.sync_data()?;
        match std::fs::hard_link(&temporary.path, path) {
            Ok(()) => Ok(true),
            Err(e) if e.kind() == ErrorKind::AlreadyExists => Ok(false),
            // Without hard links, two processes that write in the same instant could both succeed.
            Err(_) if path.exists() => Ok(false),
            Err(_) => std::fs::rename(&temporary.path, path).map(|()| true),
        }
    };
    attempt().map_err(|e| Diagnostic::io(path.display(), &e))
}

/// Writes a file as [`write_whole`] does, to a stream that can be moved. What goes to a pipe or a
/// device is collected in memory first.
///
/// # Errors
/// Returns the errors of [`write_whole`].
pub fn write_whole_seekable(
    path: &Path,
    write: impl FnOnce(&mut dyn WriteSeek) -> std::io::Result<()>,
) -> Result<()> {
    let Writable { target, kind } = Writable::new(path)?;
    let attempt = || match kind {
        TargetKind::Stream(mut stream) => {
            let mut bytes = Cursor::new(Vec::new());
            write(&mut bytes)?;
            stream.write_all(bytes.get_ref())
        }
        TargetKind::Temporary(temporary) => temporary.write(&target, |to| write(to)),
    };
    attempt().map_err(|e| Diagnostic::io(target.display(), &e))
}

/// A stream that can be moved, to write what was not known before.
pub trait WriteSeek: Write + Seek {}

impl<T: Write + Seek> WriteSeek for T {}

impl Temporary {
    /// Writes the file, and gives it the name of `target`.
    fn write(
        &self,
        target: &Path,
        write: impl FnOnce(&mut BufWriter<&File>) -> std::io::Result<()>,
    ) -> std::io::Result<()> {
        let mut to = BufWriter::new(&self.file);
        write(&mut to)?;
        to.flush()?;
        drop(to);
        self.file.sync_data()?;
        std::fs::rename(&self.path, target)
    }

    /// Creates a temporary file in the folder of `target` and locks it.
    fn beside(target: &Path) -> std::io::Result<Self> {
        for _ in 0..TRIES {
            let path =
                target.with_file_name(format!("{}{:016x}.tmp", temporary_prefix(target), random()));
            let file = match OpenOptions::new().write(true).create_new(true).open(&path) {
                Err(e) if e.kind() == ErrorKind::AlreadyExists => continue,
                opened => opened?,
            };
            // A file system without locks works too; its leftovers stay.
            let _ = file.try_lock();
            // Before the lock, another process may have taken the file for a leftover.
            if path.exists() {
                return Ok(Self { path, file });
            }
        }
        Err(Error::other("no temporary file could be created beside it"))
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        // After the file has been renamed, there is nothing under this name.
        let _ = std::fs::remove_file(&self.path);
    }
}

/// Returns whether a path is a pipe or a device.
fn is_stream(path: &Path) -> bool {
    path.metadata().is_ok_and(|m| !m.is_file() && !m.is_dir())
}

/// Opens a pipe, when a program reads it, or a device.
fn open_stream(path: &Path) -> std::io::Result<File> {
    #[cfg(unix)]
    if pipes::is_pipe(path) {
        return pipes::open_to_write(path);
    }
    OpenOptions::new().write(true).open(path)
}

/// Returns the file that a path leads to through symbolic links, also if it does not exist yet.
fn link_target(path: &Path) -> PathBuf {
    let mut target = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        let Ok(next) = target.read_link() else {
            return target;
        };
        target = folder_of(&target).join(next);
    }
    target
}

/// Returns the beginning of the names of temporary files for a target: its name, or the beginning
/// of a long one.
pub fn temporary_prefix(target: &Path) -> String {
    let name = target.file_name().unwrap_or_default().to_string_lossy();
    let mut end = name.len().min(LONGEST_PREFIX);
    while !name.is_char_boundary(end) {
        end -= 1;
    }
    format!(".{}.", &name[..end])
}

/// Returns a number that other processes cannot predict.
fn random() -> u64 {
    RandomState::new().hash_one(process_id())
}

/// Removes the temporary files of dead processes that were writing the same file.
fn remove_leftovers(target: &Path) {
    let folder = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let Ok(entries) = std::fs::read_dir(folder) else {
        return;
    };
    let prefix = temporary_prefix(target);
    let is_temporary = |name: &str| {
        let middle = name
            .strip_prefix(&prefix)
            .and_then(|n| n.strip_suffix(".tmp"));
        middle.is_some_and(|m| m.len() == 16 && m.bytes().all(|b| b.is_ascii_hexdigit()))
    };
    for entry in entries.flatten() {
        if is_temporary(&entry.file_name().to_string_lossy())
            && entry.file_type().is_ok_and(|t| t.is_file())
            && OpenOptions::new()
                .write(true)
                .open(entry.path())
                .is_ok_and(|file| file.try_lock().is_ok())
        {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::folder::Folder;

    #[test]
    fn a_failed_write_leaves_nothing_behind() {
        let folder = Folder::new("files-half");
        let result = write_whole(&folder.0.join("half.png"), |file| {
            file.write_all(b"half")?;
            Err(Error::other("the disk caught fire"))
        });
        assert!(result.unwrap_err().message.contains("caught fire"));
        assert!(folder.names().is_empty());
    }

    /// Writes to a file until some bytes are written, then fails with an error of the system.
    struct Failing<'a> {
        file: &'a mut dyn Write,
        left: usize,
        errno: i32,
    }

    impl Write for Failing<'_> {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            if self.left == 0 {
                return Err(Error::from_raw_os_error(self.errno));
            }
            let count = bytes.len().min(self.left);
            let written = self.file.write(&bytes[..count])?;
            self.left -= written;
            Ok(written)
        }

        fn flush(&mut self) -> std::io::Result<()> {
            self.file.flush()
        }
    }

    #[cfg(unix)]
    #[test]
    fn an_error_of_the_disk_at_any_byte_keeps_the_old_file_and_leaves_no_other() {
        let folder = Folder::new("files-disk");
        let path = folder.0.join("a.png");
        write_whole(&path, |file| file.write_all(b"old")).unwrap();
        let content = vec![7u8; 100_000];
        let (io, no_space, too_large) = (5, 28, 27); // EIO, ENOSPC, EFBIG
        for errno in [io, no_space, too_large] {
            for left in [0, 1, 8_191, 8_192, 8_193, 99_999] {
                let result = write_whole(&path, |file| {
                    let mut file = Failing { file, left, errno };
                    let mut pieces = content.chunks(777);
                    pieces.try_for_each(|piece| file.write_all(piece))
                });
                assert!(result.is_err(), "error {errno} after {left} bytes");
                assert_eq!(std::fs::read(&path).unwrap(), b"old");
                assert_eq!(folder.names(), ["a.png"]);
            }
        }
    }

    #[test]
    fn two_writers_of_one_file_have_temporary_files_of_their_own() {
        let folder = Folder::new("files-two");
        let path = folder.0.join("a.png");
        let (first, second) = (Writable::new(&path).unwrap(), Writable::new(&path).unwrap());
        assert_eq!(folder.names().len(), 2);
        first.write(|file| file.write_all(b"first")).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"first");
        second.write(|file| file.write_all(b"second")).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"second");
        assert_eq!(folder.names(), ["a.png"]);
    }

    #[test]
    fn a_new_file_is_written_once_and_never_replaced() {
        let folder = Folder::new("files-new");
        let path = folder.0.join("a.txt");
        assert!(write_new(&path, b"first").unwrap());
        assert!(!write_new(&path, b"second").unwrap());
        assert_eq!(std::fs::read(&path).unwrap(), b"first");
        assert_eq!(folder.names(), ["a.txt"]);
        assert!(write_new(&folder.0.join("gone/a.txt"), b"").is_err());
    }

    #[test]
    fn what_a_dead_process_left_is_removed_and_other_files_stay() {
        let folder = Folder::new("files-dead");
        let path = folder.0.join("a.png");
        for name in [
            ".a.png.0123456789abcdef.tmp",
            ".a.png.notes.tmp",
            ".b.png.0123456789abcdef.tmp",
        ] {
            std::fs::write(folder.0.join(name), b"left over").unwrap();
        }
        write_whole(&path, |file| file.write_all(b"whole")).unwrap();
        assert_eq!(
            folder.names(),
            [".a.png.notes.tmp", ".b.png.0123456789abcdef.tmp", "a.png"]
        );
    }

    #[test]
    fn a_missing_folder_and_a_long_name_are_found_before_the_work() {
        let folder = Folder::new("files-early");
        assert!(check_writable(&folder.0.join("gone/a.png")).is_err());
        assert!(check_writable(&folder.0.join("a".repeat(256))).is_err());
        assert!(check_writable(&folder.0.join("a.png")).is_ok());
        assert!(folder.names().is_empty());
    }

    #[test]
    fn the_longest_names_can_be_written() {
        let folder = Folder::new("files-long");
        for name in ["a".repeat(255), format!("b{}", "é".repeat(127))] {
            write_whole(&folder.0.join(&name), |file| file.write_all(b"whole")).unwrap();
            assert!(folder.names().contains(&name));
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_link_to_a_file_that_does_not_exist_yet_stays_a_link() {
        let folder = Folder::new("files-link");
        std::os::unix::fs::symlink("b.png", folder.0.join("a.png")).unwrap();
        std::os::unix::fs::symlink("a.png", folder.0.join("link.png")).unwrap();
        for text in ["first", "second"] {
            let write = |file: &mut dyn Write| file.write_all(text.as_bytes());
            write_whole(&folder.0.join("link.png"), write).unwrap();
            assert_eq!(
                std::fs::read(folder.0.join("b.png")).unwrap(),
                text.as_bytes()
            );
            assert!(folder.0.join("link.png").is_symlink() && folder.0.join("a.png").is_symlink());
        }
    }
}
