//! Opens the files that a scene names.

use std::collections::HashMap;
use std::fmt::Debug;
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use crate::diag::{Diagnostic, ErrorKind, Result};

/// Opens a file that a scene names. A reader of scenes without a file system implements this.
pub trait Loader: Debug + Send + Sync {
    /// Opens the file that `reference` means in the file called `from`. Returns its bytes and its
    /// name, which is `from` for the files that it names itself.
    ///
    /// # Errors
    /// There is no such file, or it may not be opened.
    fn load(&self, from: &str, reference: &str) -> Result<(String, Vec<u8>)>;
}

/// A loader that opens nothing.
#[derive(Debug)]
pub struct Nowhere;

impl Loader for Nowhere {
    fn load(&self, _: &str, reference: &str) -> Result<(String, Vec<u8>)> {
        Err(Diagnostic::error(format!(
            "`{reference}` is not opened: no files are, here"
        )))
    }
}

/// A loader for the files below a scene's folder and below the search paths.
#[derive(Debug)]
pub struct Folder {
    allowed: Vec<PathBuf>,
    bytes: usize,
    /// Canonical paths of the folders that were asked for.
    real: Mutex<HashMap<PathBuf, Option<PathBuf>>>,
}

impl Folder {
    /// Makes a loader for the scene at `path`, which refuses files of more than `bytes`.
    pub fn of(path: &Path, search: &[&Path], bytes: usize) -> Self {
        let own = std::iter::once(folder_of(path));
        let given = search.iter().map(|p| p.to_path_buf());
        Self {
            allowed: own
                .chain(given)
                .filter_map(|p| p.canonicalize().ok())
                .collect(),
            bytes,
            real: Mutex::default(),
        }
    }

    /// Returns the canonical path of a folder, for which the system is asked once.
    fn real_folder(&self, folder: &Path) -> Option<PathBuf> {
        let mut real = self.real.lock().unwrap_or_else(PoisonError::into_inner);
        let known = real.get(folder).cloned();
        known.unwrap_or_else(|| {
            let found = folder.canonicalize().ok();
            real.insert(folder.to_path_buf(), found.clone());
            found
        })
    }

    /// Returns the canonical path of a file below a folder. Unless there are links below the
    /// folder, that is the canonical folder and the rest of the path.
    fn real(&self, base: &Path, tail: &Path) -> Option<PathBuf> {
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

    /// Returns the canonical path of a file below a folder, if there is one. `Err` means that it is
    /// outside of the allowed folders.
    fn permitted(&self, base: &Path, tail: &Path) -> std::result::Result<Option<PathBuf>, ()> {
        let real = self.real(base, tail);
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

fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

/// Finds a file whose name differs in case only, as scenes from systems that ignored case need it.
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

/// Whether a reference is an absolute path of any system.
pub(super) fn is_absolute(reference: &str) -> bool {
    let drive =
        reference.as_bytes().get(1) == Some(&b':') && reference.as_bytes()[0].is_ascii_alphabetic();
    reference.starts_with(['/', '\\']) || drive
}

impl Loader for Folder {
    fn load(&self, from: &str, reference: &str) -> Result<(String, Vec<u8>)> {
        let plain = reference.strip_prefix("file:").unwrap_or(reference);
        let plain = plain.strip_prefix("//").unwrap_or(plain);
        if plain.contains("://") || plain.starts_with("urn:") {
            let message =
                format!("`{reference}` is an address, and nothing is fetched from the net");
            return Err(Diagnostic::error(message));
        }
        let plain = plain.replace('\\', "/");
        let beside = folder_of(Path::new(from));
        let mut bases = vec![beside];
        bases.extend(self.allowed.iter().cloned());
        // Of an absolute path only the last parts are used: the file that it names is not opened.
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
                "`{reference}` lies outside the scene's folder and is not opened"
            ))
            .of_kind(ErrorKind::OutsideFolder)
            .with_help("`--search FOLDER` allows what is below that folder")
        } else {
            Diagnostic::not_found(format!("`{reference}` is not there")).with_help(format!(
                "it was looked for beside `{from}` and in the search paths"
            ))
        })
    }
}

impl Folder {
    fn read(&self, from: &str, path: &Path) -> Result<(String, Vec<u8>)> {
        let name = self.shown(from, path);
        let size = path
            .metadata()
            .map_err(|e| Diagnostic::io(&name, &e))?
            .len();
        if size > self.bytes as u64 {
            return Err(Diagnostic::beyond_limit(format!(
                "`{name}` is larger than {} bytes",
                self.bytes
            )));
        }
        let bytes = std::fs::read(path).map_err(|e| Diagnostic::io(&name, &e))?;
        Ok((name, bytes))
    }

    /// Returns a path as the user would write it, if it is below the folder that `from` is in.
    fn shown(&self, from: &str, path: &Path) -> String {
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

/// Returns the path itself, then its last parts: all but the first, and so on to the file's name
/// alone. Of an absolute path only the last parts are returned.
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
