//! The scenes that were opened before, from one run of the window to the next.

use std::path::{Path, PathBuf};

use ivcam_base::diag::Result;
use ivcam_base::files::{MAX_TEXT, read_file};

use super::files;

/// The largest number of scenes in the list.
const MOST: usize = 12;

/// The last scenes, the last one first, and the file that keeps them.
#[derive(Clone, Debug, Default)]
pub(crate) struct RecentScenes {
    /// The file; none keeps the list to this run.
    file: Option<PathBuf>,
    pub scenes: Vec<PathBuf>,
}

impl RecentScenes {
    /// Returns the list of a user, without scenes that are gone. The file is `ivcam/recent` in the
    /// folder that the system has for the state of programs.
    pub(crate) fn of_user() -> Self {
        let folder = |name: &str| std::env::var_os(name).map(PathBuf::from);
        let state = folder("XDG_STATE_HOME")
            .or_else(|| folder("LOCALAPPDATA"))
            .or_else(|| Some(folder("HOME")?.join(".local/state")));
        let state = state.filter(|path| path.is_absolute());
        Self::of_file(state.map(|state| state.join("ivcam/recent")))
    }

    /// Returns the list in a file, one path a line; an empty one if there is no such file.
    pub(crate) fn of_file(file: Option<PathBuf>) -> Self {
        let bytes = file
            .as_deref()
            .and_then(|file| read_file(file, MAX_TEXT).ok());
        let text = String::from_utf8_lossy(bytes.as_deref().unwrap_or_default()).into_owned();
        let scenes = text
            .lines()
            .map(PathBuf::from)
            .filter(|path| path.is_file());
        Self {
            scenes: scenes.take(MOST).collect(),
            file,
        }
    }

    /// Puts a scene first, and writes the list.
    ///
    /// # Errors
    /// Fails if the file cannot be written.
    pub(crate) fn add(&mut self, scene: &Path) -> Result<()> {
        let Ok(scene) = scene.canonicalize() else {
            return Ok(());
        };
        // A path with a line break cannot be a line of the file.
        if scene
            .to_str()
            .is_none_or(|path| path.contains(['\n', '\r']))
        {
            return Ok(());
        }
        self.scenes.retain(|other| *other != scene);
        self.scenes.insert(0, scene);
        self.scenes.truncate(MOST);
        let Some(file) = &self.file else {
            return Ok(());
        };
        if let Some(folder) = file.parent() {
            // If this fails, so does the writing, which says why.
            let _ = std::fs::create_dir_all(folder);
        }
        let lines = self
            .scenes
            .iter()
            .map(|path| format!("{}\n", path.display()));
        files::write(file, &lines.collect::<String>())
    }
}
