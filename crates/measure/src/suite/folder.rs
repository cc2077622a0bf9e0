//! The folder in which the scenes lie with their stand-ins, and their pictures are made.

use std::path::{Path, PathBuf};

/// A folder with the suite's scenes.
pub(super) struct Folder {
    pub(super) root: PathBuf,
    /// The folders of scenes, each of which gets all stand-ins.
    places: Vec<PathBuf>,
}

impl Folder {
    /// Copies all scenes below `suite` and the programs of their scripts. Pictures and sounds are
    /// left out. Scenes inline others under their names of 1999 too, which end with `.wrl`.
    ///
    /// # Errors
    /// A file cannot be read or written.
    pub(super) fn copy(suite: &Path, root: &Path) -> Result<Self, String> {
        let mut folder = Self {
            root: root.to_path_buf(),
            places: Vec::new(),
        };
        folder.copy_below(suite, root)?;
        Ok(folder)
    }

    fn copy_below(&mut self, from: &Path, to: &Path) -> Result<(), String> {
        let error = |path: &Path, e: std::io::Error| format!("{}: {e}", path.display());
        std::fs::create_dir_all(to).map_err(|e| error(to, e))?;
        self.places.push(to.to_path_buf());
        for entry in std::fs::read_dir(from)
            .map_err(|e| error(from, e))?
            .flatten()
        {
            let (path, target) = (entry.path(), to.join(entry.file_name()));
            if path.is_dir() {
                self.copy_below(&path, &target)?;
                continue;
            }
            let copy = |to: &Path| std::fs::copy(&path, to).map_err(|e| error(&path, e));
            let kind = path.extension().unwrap_or_default();
            if kind == "x3d" || kind == "js" {
                copy(&target)?;
            }
            if kind == "x3d" {
                copy(&target.with_extension("wrl"))?;
            }
        }
        Ok(())
    }

    /// Writes a file into every folder of scenes.
    ///
    /// # Errors
    /// It cannot be written.
    pub(super) fn write(&self, name: &str, bytes: &[u8]) -> Result<(), String> {
        for place in &self.places {
            let path = place.join(name);
            std::fs::write(&path, bytes).map_err(|e| format!("{}: {e}", path.display()))?;
        }
        Ok(())
    }

    /// Returns the scene of an entry, by the first of its names that is there.
    pub(super) fn scene(&self, names: &[String]) -> Option<PathBuf> {
        let path = |name: &String| self.root.join(name).with_extension("x3d");
        names.iter().map(path).find(|path| path.is_file())
    }
}
