//! Reading a whole file of bounded size.

use std::fs::File;
use std::io::Read;
use std::ops::Deref;
use std::path::Path;

use super::inputs::record;
#[cfg(target_os = "linux")]
use super::mapped::MappedFile;
#[cfg(feature = "mpi")]
use super::passed_on;
#[cfg(unix)]
use super::pipes;
use crate::diag::{Diagnostic, Result};

/// The largest text file other than a scene, in bytes: a lens, a camera, a glass catalogue, an
/// emulsion. The largest catalogues of makers have about 2 MB.
pub const MAX_TEXT: usize = 64 << 20;
/// The largest picture file, in bytes. A picture of 2²⁸ pixels, the most that are decoded, has
/// 1.6 GB at 16 bits.
pub const MAX_PICTURE: usize = 2 << 30;
/// The most that is read from a pipe or a device, whose size is not known beforehand, in bytes.
const MAX_STREAM: usize = 256 << 20;

/// The size from which [`open_file`] maps a file, in bytes.
pub const LARGE_FILE: usize = 16 << 20;

/// The bytes of a file.
#[derive(Debug)]
pub enum FileBytes {
    /// Bytes that were read.
    Read(Vec<u8>),
    /// A large file, which the system reads at the first access to its bytes.
    #[cfg(target_os = "linux")]
    Mapped(MappedFile),
}

impl FileBytes {
    /// Says that the bytes before an offset will hardly be read again, so that the memory of a
    /// mapped file can be used for something else.
    pub fn release_before(&self, offset: usize) {
        #[cfg(target_os = "linux")]
        if let Self::Mapped(file) = self {
            file.release_before(offset);
        }
        #[cfg(not(target_os = "linux"))]
        let _ = offset;
    }
}

impl Deref for FileBytes {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match self {
            Self::Read(bytes) => bytes,
            #[cfg(target_os = "linux")]
            Self::Mapped(file) => file,
        }
    }
}

/// Opens a file as [`read_file`] does. One of at least [`LARGE_FILE`] bytes is not copied: the
/// system reads it at the first access to its bytes. If another program shortens it before they
/// are dropped, this one may end.
///
/// # Errors
/// Returns the errors of [`read_file`].
pub fn open_file(path: &Path, limit: usize) -> Result<FileBytes> {
    #[cfg(target_os = "linux")]
    if let Some(file) = mapped(path, limit) {
        record(&path.to_string_lossy(), &file);
        return Ok(FileBytes::Mapped(file));
    }
    read_file(path, limit).map(FileBytes::Read)
}

/// Maps a large regular file. The first process of a team, which passes on what it reads, reads it.
#[cfg(target_os = "linux")]
fn mapped(path: &Path, limit: usize) -> Option<MappedFile> {
    let is_large = |about: &std::fs::Metadata| {
        about.is_file() && (LARGE_FILE as u64..=limit as u64).contains(&about.len())
    };
    if cfg!(feature = "mpi") || !path.metadata().is_ok_and(|about| is_large(&about)) {
        return None;
    }
    let file = File::open(path).ok()?;
    let about = file.metadata().ok().filter(is_large)?;
    MappedFile::new(&file, about.len() as usize).ok()
}

/// Reads a file, a pipe or a device of at most `limit` bytes. The size of a regular file is known
/// before it is read.
///
/// # Errors
/// Fails if the file cannot be read, or is larger.
pub fn read_file(path: &Path, limit: usize) -> Result<Vec<u8>> {
    read_file_named(path, &path.to_string_lossy(), limit)
}

/// Reads a file as [`read_file`] does. `name` is the file's name in messages.
///
/// # Errors
/// Returns the errors of [`read_file`].
pub fn read_file_named(path: &Path, name: &str, limit: usize) -> Result<Vec<u8>> {
    #[cfg(feature = "mpi")]
    if let Some(bytes) = passed_on::taken(path) {
        return Ok(bytes);
    }
    #[cfg(unix)]
    if pipes::is_pipe(path) {
        let pipe = pipes::open_to_read(path).map_err(|e| Diagnostic::io(name, &e))?;
        return read_stream(pipe, name, limit.min(MAX_STREAM));
    }
    let open = || File::open(path).and_then(|file| Ok((file.metadata()?, file)));
    let (about, file) = open().map_err(|e| Diagnostic::io(name, &e))?;
    let limit = if about.is_file() {
        limit
    } else {
        limit.min(MAX_STREAM)
    };
    if about.len() > limit as u64 {
        return Err(too_large(name, limit));
    }
    let bytes = read_stream(file, name, limit)?;
    #[cfg(feature = "mpi")]
    passed_on::keep(path, &bytes);
    Ok(bytes)
}

/// Reads a stream of at most `limit` bytes to its end. `name` is its name in messages.
///
/// # Errors
/// Fails if the stream cannot be read, or is longer.
pub fn read_stream(stream: impl Read, name: &str, limit: usize) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    stream
        .take((limit as u64).saturating_add(1))
        .read_to_end(&mut bytes)
        .map_err(|e| Diagnostic::io(name, &e))?;
    if bytes.len() > limit {
        return Err(too_large(name, limit));
    }
    record(name, &bytes);
    Ok(bytes)
}

fn too_large(name: &str, limit: usize) -> Box<Diagnostic> {
    Diagnostic::beyond_limit(format!("`{name}` is larger than {limit} bytes")).in_file(name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diag::ErrorKind;

    #[test]
    fn a_large_file_has_the_same_bytes_after_its_memory_is_given_back() {
        let name = format!("ivcam-files-{}-large", std::process::id());
        let path = std::env::temp_dir().join(name);
        let bytes: Vec<u8> = (0..LARGE_FILE + 5).map(|i| (i % 251) as u8).collect();
        std::fs::write(&path, &bytes).unwrap();
        let large = open_file(&path, usize::MAX).unwrap();
        if cfg!(all(target_os = "linux", not(feature = "mpi"))) {
            assert!(!matches!(large, FileBytes::Read(_)));
        }
        assert!(large[..] == bytes);
        for offset in [0, 1, 5000, bytes.len(), usize::MAX] {
            large.release_before(offset);
            assert!(large[..] == bytes, "{offset}");
        }
        let error = open_file(&path, LARGE_FILE).unwrap_err();
        assert_eq!(error.kind, ErrorKind::Limit);
        std::fs::write(&path, &bytes[..9]).unwrap();
        let small = open_file(&path, usize::MAX).unwrap();
        assert!(matches!(small, FileBytes::Read(_)) && small[..] == bytes[..9]);
        std::fs::remove_file(&path).unwrap();
    }

    #[test]
    fn a_file_above_the_limit_and_an_endless_device_are_refused() {
        let name = format!("ivcam-files-{}-five.txt", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::write(&path, b"12345").unwrap();
        assert_eq!(read_file(&path, 5).unwrap(), b"12345");
        let error = read_file(&path, 4).unwrap_err();
        assert_eq!(error.kind, ErrorKind::Limit);
        assert!(error.message.ends_with("is larger than 4 bytes"));
        std::fs::remove_file(&path).unwrap();
        let endless = Path::new("/dev/zero");
        if endless.exists() {
            assert_eq!(read_file(endless, 1000).unwrap_err().kind, ErrorKind::Limit);
        }
        assert_eq!(read_file(&path, 5).unwrap_err().kind, ErrorKind::NotFound);
    }
}
