//! Opens the files that a scene refers to.

use std::collections::{BTreeSet, HashMap};
use std::ffi::OsStr;
use std::fmt::Debug;
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use ivcam_base::diag::{Diagnostic, ErrorKind, Result, excerpt_path};
use ivcam_base::files::read_file_named;
use ivcam_base::files::{folder_of, project_of};
use ivcam_base::platform::real_path;

use super::data_uri::percent;
use super::encoding::{text, text_of};

/// Opens the files that a scene refers to. A program that reads scenes from somewhere else than the
/// file system implements this trait.
pub trait Loader: Debug + Send + Sync {
    /// Opens the file that the file named `from` calls `reference`. Returns its name and its bytes.
    /// The name becomes `from` for the files that this file refers to.
    ///
    /// # Errors
    /// Returns an error if there is no such file, or if it may not be opened.
    fn load(&self, from: &str, reference: &str) -> Result<(String, Vec<u8>)>;

    /// Returns the paths of the files that were opened. A loader without a file system has none.
    fn opened_files(&self) -> Vec<PathBuf> {
        Vec::new()
    }
}

/// A loader that opens no files.
#[derive(Debug)]
pub struct NoFiles;

impl Loader for NoFiles {
    fn load(&self, _: &str, reference: &str) -> Result<(String, Vec<u8>)> {
        Err(Diagnostic::error(format!(
            "`{reference}` is not opened: this document cannot open other files"
        )))
    }
}

/// A loader for the files of a scene's project and below the search paths.
#[derive(Debug)]
pub struct FolderLoader {
    /// The canonical path of the folder below which the scene's own files are.
    root: Option<PathBuf>,
    /// Whether the user chose that folder.
    is_contained: bool,
    /// The canonical path of the scene's folder.
    own: Option<PathBuf>,
    /// The canonical paths of the folders that are searched too, whose files may be opened.
    search: Vec<PathBuf>,
    /// The largest size of a file, in bytes.
    bytes: usize,
    /// The canonical paths of the folders that were requested, as a cache.
    real: Mutex<HashMap<PathBuf, Option<PathBuf>>>,
    /// Canonical paths of the files that were opened.
    opened: Mutex<BTreeSet<PathBuf>>,
}

impl FolderLoader {
    /// Creates a loader for the scene at `path`. It opens files of the scene's project and files
    /// below the folders in `search`, and refuses files of more than `bytes` bytes.
    ///
    /// The project is all below the nearest folder, from the scene's own upward, with an entry
    /// named `.git`, `.hg`, `.svn` or `.ivcam-project`; without one, all below the folder one level
    /// above the scene's. It never is the root of a disk, a folder at the root, a user's home or
    /// the folder for temporary files, unless the scene itself lies there.
    pub fn new(path: &Path, search: &[&Path], bytes: usize) -> Self {
        Self::within(path, search, None, bytes)
    }

    /// Creates a loader like [`FolderLoader::new`], which opens files below `contain` instead of
    /// those of the scene's project.
    pub fn within(path: &Path, search: &[&Path], contain: Option<&Path>, bytes: usize) -> Self {
        let own = real_path(&folder_of(path)).ok();
        let root = match contain {
            Some(folder) => real_path(folder).ok(),
            None => own.as_deref().map(project_of),
        };
        let search = search.iter().filter_map(|p| real_path(p).ok());
        Self {
            root,
            is_contained: contain.is_some(),
            own,
            search: search.collect(),
            bytes,
            real: Mutex::default(),
            opened: Mutex::default(),
        }
    }

    /// Returns the canonical path of a folder. Only the first call for a folder queries the file
    /// system.
    fn real_folder(&self, folder: &Path) -> Option<PathBuf> {
        let mut real = self.real.lock().unwrap_or_else(PoisonError::into_inner);
        let known = real.get(folder).cloned();
        known.unwrap_or_else(|| {
            let found = real_path(folder).ok();
            real.insert(folder.to_path_buf(), found.clone());
            found
        })
    }

    /// Returns the canonical path of a file that is named by its path from a folder. Names that
    /// are not there as they are written are taken without regard to case.
    fn real_file(&self, base: &Path, tail: &Path) -> Option<PathBuf> {
        let mut path = self.real_folder(base)?;
        for part in tail.components() {
            match part {
                Component::Normal(name) => path = entry(&path, name)?,
                Component::ParentDir => {
                    path.pop();
                }
                Component::CurDir => {}
                Component::RootDir | Component::Prefix(_) => return None,
            }
        }
        Some(path)
    }

    /// Returns the canonical path of a file that is named by its path from a folder, or `None` if
    /// there is no such file.
    ///
    /// # Errors
    /// Returns the path of a file outside the folders that may be read.
    fn permitted(&self, base: &Path, tail: &Path) -> std::result::Result<Option<PathBuf>, PathBuf> {
        let Some(real) = self.real_file(base, tail).filter(|real| real.is_file()) else {
            return Ok(None);
        };
        let mut allowed = self.root.iter().chain(&self.search);
        if allowed.any(|folder| real.starts_with(folder)) {
            Ok(Some(real))
        } else {
            Err(real)
        }
    }

    /// Returns the error for a file outside the folders that may be read.
    fn refusal(&self, reference: &str, file: &Path) -> Box<Diagnostic> {
        let outside = match self.is_contained {
            true => "the folder that may be read",
            false => "the scene's project folder",
        };
        let name = excerpt_path(reference);
        let message = format!("`{name}` is outside {outside} and is not opened");
        let folder = folder_of(file);
        let allows = format!(
            "`--search {}` allows the files below that folder",
            folder.display()
        );
        let help = match &self.root {
            Some(root) => format!("files below `{}` are opened; {allows}", root.display()),
            None => allows,
        };
        Diagnostic::error(message)
            .of_kind(ErrorKind::OutsideFolder)
            .with_help(help)
    }
}

/// Returns the canonical path of a file or folder of a canonical folder. One whose name differs
/// only in case is found too, for scenes from file systems that ignore case, and one whose name is
/// not UTF-8 by the text that a scene of its encoding states.
fn entry(folder: &Path, name: &OsStr) -> Option<PathBuf> {
    let path = folder.join(name);
    let found = match path.symlink_metadata() {
        Ok(_) => path,
        Err(_) => {
            let entries = std::fs::read_dir(folder).ok()?.filter_map(|e| e.ok());
            let lower = |name: &OsStr| text(name.as_encoded_bytes()).to_lowercase();
            let name = lower(name);
            let same = entries.filter(|e| lower(&e.file_name()) == name);
            same.map(|e| e.path()).min()?
        }
    };
    match found.is_symlink() {
        true => real_path(&found).ok(),
        false => Some(found),
    }
}

/// Returns whether a reference is an absolute path on Unix or Windows.
pub(super) fn is_absolute(reference: &str) -> bool {
    let drive =
        reference.as_bytes().get(1) == Some(&b':') && reference.as_bytes()[0].is_ascii_alphabetic();
    reference.starts_with(['/', '\\']) || drive
}

impl Loader for FolderLoader {
    fn load(&self, from: &str, reference: &str) -> Result<(String, Vec<u8>)> {
        let plain = match reference.split_at_checked(5) {
            Some((scheme, path)) if scheme.eq_ignore_ascii_case("file:") => path,
            _ => reference,
        };
        let plain = plain.strip_prefix("//").unwrap_or(plain);
        if plain.contains("://") || plain.starts_with("urn:") {
            let name = excerpt_path(reference);
            let message = format!("`{name}` is a network address, and files are not downloaded");
            return Err(Diagnostic::error(message));
        }
        let plain = plain.replace('\\', "/");
        let decoded = text_of(percent(plain.as_bytes()));
        let mut tails = tails(&plain);
        if decoded != plain {
            tails.extend(self::tails(&decoded));
        }
        let beside = folder_of(Path::new(from));
        let mut bases = vec![beside];
        bases.extend(self.own.iter().chain(&self.search).cloned());
        let mut refused = None;
        for tail in tails {
            for base in &bases {
                match self.permitted(base, &tail) {
                    Ok(Some(path)) => return self.read(from, &path),
                    Ok(None) => {}
                    Err(file) => refused = refused.or(Some(file)),
                }
            }
        }
        // Only the last parts of an absolute path are used, so the file itself is not opened.
        let itself = Path::new(&plain);
        if refused.is_none() && is_absolute(&plain) && itself.is_file() {
            refused = real_path(itself).ok();
        }
        Err(match refused {
            Some(file) => self.refusal(reference, &file),
            None => {
                let name = excerpt_path(reference);
                Diagnostic::not_found(format!("`{name}` was not found")).with_help(format!(
                    "the folder of `{from}` and the search paths were searched"
                ))
            }
        })
    }
    fn opened_files(&self) -> Vec<PathBuf> {
        let opened = self.opened.lock().unwrap_or_else(PoisonError::into_inner);
        opened.iter().cloned().collect()
    }
}

impl FolderLoader {
    /// Reads a file and returns its name for messages and its bytes.
    fn read(&self, from: &str, path: &Path) -> Result<(String, Vec<u8>)> {
        let name = self.display_name(from, path);
        let bytes = read_file_named(path, &name, self.bytes)?;
        let mut opened = self.opened.lock().unwrap_or_else(PoisonError::into_inner);
        opened.insert(path.to_path_buf());
        Ok((name, bytes))
    }

    /// Returns a path relative to the working directory as the user would write it, if the file is
    /// below the folder of `from`. Otherwise it returns the canonical path.
    fn display_name(&self, from: &str, path: &Path) -> String {
        let base = folder_of(Path::new(from));
        let short = self
            .real_folder(&base)
            .and_then(|real| path.strip_prefix(real).ok().map(|p| base.join(p)));
        let short = short.unwrap_or_else(|| path.to_path_buf());
        short
            .strip_prefix(".")
            .unwrap_or(&short)
            .display()
            .to_string()
    }
}

/// Returns the path, then the path without its first part, and so on until only the file name is
/// left. A path with a fragment (`#Name`) is tried with and without the fragment. An absolute path
/// is treated as relative to the root.
fn tails(path: &str) -> Vec<PathBuf> {
    let mut out = Vec::new();
    for path in [Some(path), path.split_once('#').map(|(p, _)| p)]
        .into_iter()
        .flatten()
    {
        let path = if is_absolute(path) {
            path.trim_start_matches(|c: char| {
                c == '/'
                    || c.is_ascii_alphabetic()
                        && path.as_bytes().get(1) == Some(&b':')
                        && path.starts_with(c)
            })
            .trim_start_matches([':', '/'])
        } else {
            path
        };
        let parts: Vec<Component<'_>> = Path::new(path).components().collect();
        for i in 0..parts.len() {
            if i > 0 && parts[i..].iter().any(|p| matches!(p, Component::ParentDir)) {
                continue;
            }
            out.push(parts[i..].iter().collect());
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns what the references of a scene in a folder of some files open: the names of the
    /// files, which contain them, or nothing.
    fn opened<'a>(
        name: &str,
        files: &[(&OsStr, &str)],
        references: &[&'a str],
    ) -> Vec<(&'a str, String)> {
        let folder = std::env::temp_dir().join(format!("ivcam-{name}-{}", std::process::id()));
        for (file, content) in files {
            let path = folder.join(file);
            std::fs::create_dir_all(folder_of(&path)).unwrap();
            std::fs::write(path, content).unwrap();
        }
        let scene = folder.join("scenes/a.iv");
        let loader = FolderLoader::within(&scene, &[], Some(&folder), 1000);
        let from = scene.to_str().unwrap();
        let load = |&reference: &&'a str| {
            let bytes = loader.load(from, reference).map(|(_, bytes)| bytes);
            (
                reference,
                String::from_utf8(bytes.unwrap_or_default()).unwrap(),
            )
        };
        let opened = references.iter().map(load).collect();
        std::fs::remove_dir_all(folder).unwrap();
        opened
    }

    #[test]
    fn the_whole_path_is_tried_in_any_case_before_its_last_parts() {
        let files = [
            (OsStr::new("scenes/parts2/wheel.iv"), "of parts2"),
            (OsStr::new("scenes/WHEEL.IV"), "another"),
            (OsStr::new("Common/Ähre.iv"), "of common"),
        ];
        let references = [
            ("PARTS2/WHEEL.IV", "of parts2"),
            ("../scenes/Parts2/wheel.iv", "of parts2"),
            ("..\\COMMON\\ähre.IV", "of common"),
            ("elsewhere/Wheel.iv", "another"),
            ("parts2/none.iv", ""),
        ];
        let names = references.map(|(reference, _)| reference);
        assert_eq!(
            opened("cases", &files, &names),
            references.map(|(name, content)| (name, content.to_owned()))
        );
    }

    /// RFC 3986, section 2.1, for the URLs of VRML97 and X3D.
    #[test]
    fn urls_are_tried_as_they_are_written_and_then_decoded() {
        let files = [
            (OsStr::new("scenes/a b.png"), "decoded"),
            (OsStr::new("scenes/50%25.png"), "written"),
            (OsStr::new("scenes/50%.png"), "decoded"),
        ];
        let references = [
            ("a%20b.png", "decoded"),
            ("FILE:a%20b.png", "decoded"),
            ("50%25.png", "written"),
            ("50%.png", "decoded"),
        ];
        let names = references.map(|(reference, _)| reference);
        assert_eq!(
            opened("urls", &files, &names),
            references.map(|(name, content)| (name, content.to_owned()))
        );
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_file_whose_name_is_latin_1_is_found_by_a_scene_in_latin_1() {
        use std::os::unix::ffi::OsStrExt;
        let files = [(OsStr::from_bytes(b"scenes/gr\xf6\xdfe.png"), "found")];
        let reference = text(b"gr\xf6\xdfe.png");
        let found = opened("latin", &files, &[&reference]);
        assert_eq!(found[0].1, "found");
    }
}
