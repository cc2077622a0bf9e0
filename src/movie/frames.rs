//! The frames of a movie in their folder: which are done, missing, broken and in work.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::time::Duration;

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::{Claims, Held};
use ivcam_optics::picture::Raster;

use super::label::read_label;

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
        let (count, rate) = read_label(&folder)?;
        let claims = Claims::new(&folder, Duration::ZERO);
        let mut size = None;
        let mut states = Vec::with_capacity(count as usize);
        for number in 0..count {
            let path = frame_path(&folder, number);
            states.push(match (path.exists(), claims.held(&claim_name(number))) {
                (true, _) => examine(&path, &mut size),
                (false, Some(held)) if !held.is_dead => FrameState::InWork(held),
                (false, _) => FrameState::Missing,
            });
        }
        Ok(Self {
            folder,
            rate,
            states,
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

/// Reads a picture. `size` is that of the frames before it.
fn examine(path: &Path, size: &mut Option<(u32, u32)>) -> FrameState {
    if !is_whole(path) {
        return FrameState::Broken("the file is cut off, or is not a PNG".into());
    }
    match Raster::open(path) {
        Err(error) => FrameState::Broken(error.message),
        Ok(raster) => {
            let this = (raster.width, raster.height);
            let (width, height) = *size.get_or_insert(this);
            match this == (width, height) {
                true => FrameState::Done,
                false => FrameState::Broken(format!(
                    "{}x{} pixels, where the frames before have {width}x{height}",
                    this.0, this.1
                )),
            }
        }
    }
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
