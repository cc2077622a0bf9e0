//! The frames of a movie in their folder: which are done, missing, broken and in work.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::time::Duration;

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::{Claims, Held};
use ivcam_optics::picture::Raster;

use super::label::{FrameSize, read_label};

/// The last bytes of every PNG file: its chunk `IEND` with its checksum.
const END_OF_PNG: [u8; 12] = *b"\0\0\0\0IEND\xae\x42\x60\x82";

/// The state of one frame.
#[derive(Debug)]
pub(crate) enum FrameState {
    /// The picture is whole.
    Done,
    /// There is no picture, and no process is making it.
    Missing,
    /// There is a file that is not a whole picture, for this reason.
    Broken(String),
    /// A process has claimed the frame.
    InWork(Held),
}

/// The frames of a movie in their folder.
pub(crate) struct Frames {
    /// The folder.
    pub folder: PathBuf,
    /// Frames per second.
    pub rate: f64,
    /// The states of all frames, by their numbers.
    pub states: Vec<FrameState>,
}

impl Frames {
    /// Reads every frame of a movie. `place` is the folder of the frames, or the movie that is made
    /// of them.
    ///
    /// # Errors
    /// Fails if there is no folder with frames.
    pub(crate) fn survey(place: &Path) -> Result<Self> {
        let folder = folder_of_frames(place);
        let label = read_label(&folder)?;
        let claims = Claims::new(&folder, Duration::ZERO);
        let examined = (0..label.frames).map(|n| examine(&frame_path(&folder, n)));
        let examined: Vec<_> = examined.collect();
        let size = label.size.or_else(|| most_common_size(&examined));
        let state = |(number, examined)| match (examined, claims.held(&claim_name(number))) {
            (Some(Ok(this)), _) => state_by_size(this, size),
            (Some(Err(reason)), _) => FrameState::Broken(reason),
            (None, Some(held)) if !held.is_dead => FrameState::InWork(held),
            (None, _) => FrameState::Missing,
        };
        Ok(Self {
            rate: label.rate,
            states: (0..).zip(examined).map(state).collect(),
            folder,
        })
    }

    /// Returns the files of all frames, in order.
    pub(crate) fn paths(&self) -> Vec<PathBuf> {
        let numbers = 0..self.states.len() as u32;
        numbers.map(|n| frame_path(&self.folder, n)).collect()
    }

    /// Removes the files of broken frames, so that they are made again.
    ///
    /// # Errors
    /// Fails if a file cannot be removed.
    pub(crate) fn remove_broken(&mut self) -> Result<()> {
        for (number, state) in self.states.iter_mut().enumerate() {
            if matches!(state, FrameState::Broken(_)) {
                let path = frame_path(&self.folder, number as u32);
                std::fs::remove_file(&path).map_err(|e| Diagnostic::io(path.display(), &e))?;
                *state = FrameState::Missing;
            }
        }
        Ok(())
    }
}

/// Returns the file of a frame.
pub(super) fn frame_path(folder: &Path, number: u32) -> PathBuf {
    folder.join(format!("{number:05}.png"))
}

/// Returns the name under which a frame is claimed.
pub(super) fn claim_name(number: u32) -> String {
    format!("{number:05}")
}

/// Returns the folder of the frames of a movie that is given by its file's name.
pub(crate) fn folder_beside(movie: &Path) -> PathBuf {
    let stem = movie.file_stem().unwrap_or_default().to_string_lossy();
    movie.with_file_name(format!("{stem}-frames"))
}

/// Returns whether a file ends as a whole PNG does. Frames get their names when they are complete,
/// so only a damaged disk or a failed copy leaves another.
pub(super) fn is_whole(path: &Path) -> bool {
    let ends_well = || -> std::io::Result<bool> {
        let mut file = File::open(path)?;
        let mut end = [0; END_OF_PNG.len()];
        file.seek(SeekFrom::End(-(END_OF_PNG.len() as i64)))?;
        file.read_exact(&mut end)?;
        Ok(end == END_OF_PNG)
    };
    ends_well().unwrap_or(false)
}

/// Returns the size of the picture in a file, or why it is not a whole picture. `None` if there is
/// no file.
fn examine(path: &Path) -> Option<std::result::Result<FrameSize, String>> {
    path.exists().then(|| match is_whole(path) {
        true => match Raster::open(path) {
            Ok(raster) => Ok((raster.width, raster.height)),
            Err(error) => Err(error.message),
        },
        false => Err("the file is cut off, or is not a PNG".into()),
    })
}

/// Returns the state of a whole picture in a movie whose frames have a size.
fn state_by_size((width, height): FrameSize, size: Option<FrameSize>) -> FrameState {
    match size.filter(|size| *size != (width, height)) {
        Some((w, h)) => FrameState::Broken(format!(
            "{width}x{height} pixels, where the movie has {w}x{h}"
        )),
        None => FrameState::Done,
    }
}

/// Returns the size that most pictures have.
fn most_common_size(
    examined: &[Option<std::result::Result<FrameSize, String>>],
) -> Option<FrameSize> {
    let mut counts = BTreeMap::new();
    for size in examined.iter().flatten().flatten() {
        *counts.entry(*size).or_insert(0) += 1;
    }
    let most = counts.into_iter().max_by_key(|(_, count)| *count);
    most.map(|(size, _)| size)
}

/// Returns a folder as it is, and the folder of the frames for a movie's name.
fn folder_of_frames(place: &Path) -> PathBuf {
    if place.is_dir() {
        return place.to_path_buf();
    }
    let beside = folder_beside(place);
    if beside.is_dir() {
        beside
    } else {
        place.to_path_buf()
    }
}
