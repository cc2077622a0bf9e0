//! Opening pipes that have names, which waits for the program at the other end.

use std::fs::{File, OpenOptions};
use std::io::{Cursor, Error, ErrorKind, Read};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::Path;
use std::time::{Duration, Instant};

use rustix::fs::{OFlags, fcntl_setfl};

/// How long a pipe may have no program at its other end.
const ALONE: Duration = Duration::from_secs(5);
/// How long the program at the other end may write nothing at all.
const SILENT: Duration = Duration::from_secs(60);
/// The time between two looks.
const TURN: Duration = Duration::from_millis(20);

/// The flag that opens a pipe without waiting for its other end.
const WITHOUT_WAITING: i32 = OFlags::NONBLOCK.bits() as i32;

/// Returns whether a path is a pipe.
pub(super) fn is_pipe(path: &Path) -> bool {
    path.metadata().is_ok_and(|m| m.file_type().is_fifo())
}

/// Opens a pipe for reading when its first bytes are there.
///
/// # Errors
/// Fails if it cannot be opened, or if no bytes come in time.
pub(super) fn open_to_read(path: &Path) -> std::io::Result<impl Read> {
    let mut file = OpenOptions::new()
        .read(true)
        .custom_flags(WITHOUT_WAITING)
        .open(path)?;
    let mut first = [0; 4096];
    let start = Instant::now();
    let mut alone_since = start;
    let count = loop {
        match file.read(&mut first) {
            Ok(0) if alone_since.elapsed() > ALONE => {
                return Err(late("no program writes to this pipe"));
            }
            Ok(0) => {}
            Err(e) if e.kind() == ErrorKind::WouldBlock => {
                alone_since = Instant::now();
                if start.elapsed() > SILENT {
                    return Err(late("nothing was written to this pipe for 60 s"));
                }
            }
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            done => break done?,
        }
        std::thread::sleep(TURN);
    };
    fcntl_setfl(&file, OFlags::empty())?;
    Ok(Cursor::new(first).take(count as u64).chain(file))
}

/// Opens a pipe for writing when a program reads it.
///
/// # Errors
/// Fails if it cannot be opened, or if no program reads it in time.
pub(super) fn open_to_write(path: &Path) -> std::io::Result<File> {
    let start = Instant::now();
    loop {
        let opened = OpenOptions::new()
            .write(true)
            .custom_flags(WITHOUT_WAITING)
            .open(path);
        match opened {
            Err(e) if e.raw_os_error() == Some(rustix::io::Errno::NXIO.raw_os_error()) => {
                if start.elapsed() > ALONE {
                    return Err(late("no program reads this pipe"));
                }
            }
            opened => {
                let file = opened?;
                fcntl_setfl(&file, OFlags::empty())?;
                return Ok(file);
            }
        }
        std::thread::sleep(TURN);
    }
}

fn late(text: &str) -> Error {
    Error::new(ErrorKind::TimedOut, text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::folder::Folder;
    use std::io::Write;

    #[test]
    fn a_pipe_passes_bytes_on_and_one_without_a_reader_is_refused() {
        let folder = Folder::new("pipes");
        let path = std::path::PathBuf::from(folder.path("pipe"));
        let made = std::process::Command::new("mkfifo").arg(&path).status();
        assert!(made.is_ok_and(|status| status.success()) && is_pipe(&path));
        let writer = {
            let path = path.clone();
            std::thread::spawn(move || open_to_write(&path)?.write_all(&[7; 100_000]))
        };
        let mut bytes = Vec::new();
        open_to_read(&path)
            .unwrap()
            .read_to_end(&mut bytes)
            .unwrap();
        assert_eq!(bytes, [7; 100_000]);
        writer.join().unwrap().unwrap();
        let start = Instant::now();
        let alone = open_to_write(&path).unwrap_err();
        assert_eq!(alone.to_string(), "no program reads this pipe");
        assert!(start.elapsed() < 2 * ALONE);
    }
}
