//! The folder in which the scenes are converted and their pictures made.

use std::path::{Path, PathBuf};

use super::x3d;

/// A folder with the suite's scenes in VRML97.
pub(super) struct Folder {
    pub(super) root: PathBuf,
    /// The folders of scenes, each of which gets all stand-ins.
    places: Vec<PathBuf>,
}

impl Folder {
    /// Converts all X3D scenes below `suite`, and copies the programs of their scripts. Pictures
    /// and sounds are left out. Returns the scenes that could not be converted, with the reason.
    ///
    /// # Errors
    /// A file cannot be read or written.
    pub(super) fn convert(suite: &Path, root: &Path) -> Result<(Self, Vec<String>), String> {
        let mut folder = Self {
            root: root.to_path_buf(),
            places: Vec::new(),
        };
        let mut wrong = Vec::new();
        folder.convert_below(suite, root, &mut wrong)?;
        Ok((folder, wrong))
    }

    fn convert_below(
        &mut self,
        from: &Path,
        to: &Path,
        wrong: &mut Vec<String>,
    ) -> Result<(), String> {
        let error = |path: &Path, e: std::io::Error| format!("{}: {e}", path.display());
        std::fs::create_dir_all(to).map_err(|e| error(to, e))?;
        self.places.push(to.to_path_buf());
        for entry in std::fs::read_dir(from)
            .map_err(|e| error(from, e))?
            .flatten()
        {
            let (path, target) = (entry.path(), to.join(entry.file_name()));
            if path.is_dir() {
                self.convert_below(&path, &target, wrong)?;
                continue;
            }
            let kind = path
                .extension()
                .and_then(|e| e.to_str())
                .unwrap_or_default();
            if !matches!(kind, "x3d" | "js") {
                continue;
            }
            let bytes = std::fs::read(&path).map_err(|e| error(&path, e))?;
            let text = String::from_utf8_lossy(&bytes);
            let (text, target) = match kind {
                "js" => (Ok(text.into_owned()), target),
                _ => (x3d::to_vrml97(&text), target.with_extension("wrl")),
            };
            match text {
                Ok(text) => std::fs::write(&target, text).map_err(|e| error(&target, e))?,
                Err(message) => wrong.push(format!("{}: {message}", path.display())),
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

    /// Returns the converted scene of an entry, by the first of its names that is there.
    pub(super) fn scene(&self, names: &[String]) -> Option<PathBuf> {
        let path = |name: &String| self.root.join(name).with_extension("wrl");
        names.iter().map(path).find(|path| path.is_file())
    }
}
