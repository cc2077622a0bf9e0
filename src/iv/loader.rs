//! Opens the files that a scene refers to.

use std::collections::{BTreeSet, HashMap};
use std::fmt::Debug;
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use crate::diag::{Diagnostic, ErrorKind, Result};
use crate::files::read_file_named;

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

/// A loader for the files below a scene's folder and below the search paths.
#[derive(Debug)]
pub struct FolderLoader {
    /// The canonical paths of the folders whose files may be opened.
    allowed: Vec<PathBuf>,
    /// The largest size of a file, in bytes.
    bytes: usize,
    /// The canonical paths of the folders that were requested, as a cache.
    real: Mutex<HashMap<PathBuf, Option<PathBuf>>>,
    /// Canonical paths of the files that were opened.
    opened: Mutex<BTreeSet<PathBuf>>,
}

impl FolderLoader {
    /// Creates a loader for the scene at `path`. It opens files below the scene's folder and below
    /// the folders in `search`, and refuses files of more than `bytes` bytes.
    pub fn new(path: &Path, search: &[&Path], bytes: usize) -> Self {
        let own = std::iter::once(folder_of(path));
        let given = search.iter().map(|p| p.to_path_buf());
        Self {
            allowed: own
                .chain(given)
                .filter_map(|p| p.canonicalize().ok())
                .collect(),
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
            let found = folder.canonicalize().ok();
            real.insert(folder.to_path_buf(), found.clone());
            found
        })
    }

    /// Returns the canonical path of a file below a folder. If the path has no symbolic links below
    /// the folder, this is the canonical folder followed by the rest of the path.
    fn real_file(&self, base: &Path, tail: &Path) -> Option<PathBuf> {
        let mut path = self.real_folder(base)?;
        for part in tail.components() {
            let Component::Normal(part) = part else {
                return base.join(tail).canonicalize().ok();
            };
            path.push(part);
            if path.symlink_metadata().ok()?.is_symlink() {
                return base.join(tail).canonicalize().ok();
            }
        }
        Some(path)
    }

    /// Returns the canonical path of a file below a folder, or `None` if there is no such file.
    ///
    /// # Errors
    /// Returns an error if the file is outside the allowed folders.
    fn permitted(&self, base: &Path, tail: &Path) -> std::result::Result<Option<PathBuf>, ()> {
        let real = self.real_file(base, tail);
        let Some(real) = real.or_else(|| other_case(&base.join(tail))) else {
            return Ok(None);
        };
        if !real.is_file() {
            return Ok(None);
        }
        if self.allowed.iter().any(|a| real.starts_with(a)) {
            Ok(Some(real))
        } else {
            Err(())
        }
    }
}

/// Returns the folder that contains a file.
fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

/// Finds a file whose name differs only in case. Scenes from file systems that ignore case need
/// this.
fn other_case(path: &Path) -> Option<PathBuf> {
    let name = path.file_name()?.to_str()?;
    let entries = std::fs::read_dir(path.parent()?).ok()?;
    let mut names: Vec<PathBuf> = entries.filter_map(|e| e.ok().map(|e| e.path())).collect();
    names.sort();
    let same = |p: &PathBuf| {
        p.file_name()
            .and_then(|n| n.to_str())
            .is_some_and(|n| n.eq_ignore_ascii_case(name))
    };
    names.into_iter().find(same)?.canonicalize().ok()
}

/// Returns whether a reference is an absolute path on Unix or Windows.
pub(super) fn is_absolute(reference: &str) -> bool {
    let drive =
        reference.as_bytes().get(1) == Some(&b':') && reference.as_bytes()[0].is_ascii_alphabetic();
    reference.starts_with(['/', '\\']) || drive
}

impl Loader for FolderLoader {
    fn load(&self, from: &str, reference: &str) -> Result<(String, Vec<u8>)> {
        let plain = reference.strip_prefix("file:").unwrap_or(reference);
        let plain = plain.strip_prefix("//").unwrap_or(plain);
        if plain.contains("://") || plain.starts_with("urn:") {
            let message =
                format!("`{reference}` is a network address, and files are not downloaded");
            return Err(Diagnostic::error(message));
        }
        let plain = plain.replace('\\', "/");
        let beside = folder_of(Path::new(from));
        let mut bases = vec![beside];
        bases.extend(self.allowed.iter().cloned());
        // Only the last parts of an absolute path are used, so the file itself is not opened.
        let mut refused = is_absolute(&plain) && Path::new(&plain).is_file();
        for tail in tails(&plain) {
            for base in &bases {
                match self.permitted(base, &tail) {
                    Ok(Some(path)) => return self.read(from, &path),
                    Ok(None) => {}
                    Err(()) => refused = true,
                }
            }
        }
        Err(if refused {
            Diagnostic::error(format!(
                "`{reference}` is outside the scene's folder and is not opened"
            ))
            .of_kind(ErrorKind::OutsideFolder)
            .with_help("`--search FOLDER` allows the files below that folder")
        } else {
            Diagnostic::not_found(format!("`{reference}` was not found")).with_help(format!(
                "the folder of `{from}` and the search paths were searched"
            ))
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
