//! What a file is by its content, whatever its name is.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use ivcam_optics::lens::Lens;

/// The bytes by which a scene or a picture is recognized.
const START: u64 = 64;

/// The kind of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FileKind {
    Scene,
    Lens,
    Picture,
}

impl FileKind {
    /// Returns the kind of a file, if it is known.
    pub(crate) fn of(path: &Path) -> Option<Self> {
        if !path.is_file() {
            return None;
        }
        let mut start = Vec::new();
        File::open(path)
            .ok()?
            .take(START)
            .read_to_end(&mut start)
            .ok()?;
        if start.starts_with(b"#Inventor") || start.starts_with(b"#VRML") {
            return Some(Self::Scene);
        }
        let is_float_picture = start.starts_with(&[0x76, 0x2f, 0x31, 0x01]);
        let is_sgi = start.starts_with(&[0x01, 0xda]);
        if is_float_picture || is_sgi || image::guess_format(&start).is_ok() {
            return Some(Self::Picture);
        }
        Lens::open(path).is_ok().then_some(Self::Lens)
    }
}
