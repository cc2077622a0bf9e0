//! Finds the pictures of a folder.

use std::path::{Path, PathBuf};

use ivcam_base::diag::{ErrorKind, Result, Sink};
use ivcam_render::scene::check::files_below;

use crate::archive::{Jobs, Naming, is_below, name_of};

/// The file name extensions of pictures.
const ENDINGS: [&str; 22] = [
    "png", "jpg", "jpeg", "jpe", "jfif", "tif", "tiff", "gif", "bmp", "pnm", "ppm", "pgm", "pbm",
    "tga", "sgi", "rgb", "rgba", "bw", "int", "inta", "exr", "hdr",
];

/// The folder below the report that gets the pictures of scenes.
pub(super) const RENDERED: &str = "rendered";

/// A picture of one of the two folders, or a scene of which one is made.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PictureFile {
    /// The path below the folder, as [`name_of`] writes it.
    pub name: String,
    /// The name without its ending.
    pub stem: String,
    /// The picture.
    pub path: PathBuf,
    /// The scene that the picture is made of, if it is not there.
    pub scene: Option<PathBuf>,
}

impl PictureFile {
    /// Returns the picture of a path below a folder.
    pub(super) fn below(folder: &Path, path: PathBuf) -> Self {
        let inside = path.strip_prefix(folder).unwrap_or(&path);
        let name = name_of(inside);
        let stem = name_of(&inside.with_extension(""));
        Self {
            name,
            stem,
            path,
            scene: None,
        }
    }
}

/// Returns the pictures below a folder, sorted, without those in the folder of the report.
///
/// # Errors
/// Returns an error if the folder cannot be read.
pub(super) fn pictures(folder: &Path, out: &Path, sink: &mut Sink) -> Result<Vec<PictureFile>> {
    let is_picture = |name: &str| {
        let ending = Path::new(name).extension().and_then(|e| e.to_str());
        ending.is_some_and(|ending| ENDINGS.contains(&ending))
    };
    let mut paths = files_below(folder, &is_picture, sink)?;
    if is_below(out, folder) {
        paths.retain(|path| !is_below(path, out));
    }
    let files = paths.into_iter();
    Ok(files.map(|path| PictureFile::below(folder, path)).collect())
}

/// Returns whether there is a scene below a folder.
pub(crate) fn has_scenes(folder: &Path, out: &Path) -> bool {
    Jobs::find(folder, &out.join(RENDERED), "png", Naming::Short).is_ok()
}

/// Returns the scenes below the new folder that have no picture beside them, each with the picture
/// that it becomes below the folder of the report.
///
/// # Errors
/// Returns an error if the folder cannot be read.
pub(super) fn scenes(
    folder: &Path,
    out: &Path,
    pictures: &[PictureFile],
    sink: &mut Sink,
) -> Result<Option<Vec<PictureFile>>> {
    let rendered = out.join(RENDERED);
    let jobs = match Jobs::find(folder, &rendered, "png", Naming::Short) {
        Ok(jobs) => jobs,
        Err(error) if error.kind == ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error),
    };
    sink.extend_from(&jobs.sink);
    let scenes = jobs.list.into_iter().filter_map(|job| {
        let made = PictureFile::below(&rendered, job.output);
        let is_there = pictures.iter().any(|picture| picture.stem == made.stem);
        let scene = PictureFile {
            name: job.name,
            scene: Some(job.input),
            ..made
        };
        (!is_there).then_some(scene)
    });
    Ok(Some(scenes.collect()))
}
