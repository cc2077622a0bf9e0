//! Finds scene files in folders.

use std::collections::HashSet;
use std::io;
use std::path::{Path, PathBuf};

use ivcam_base::diag::{Diagnostic, Result, Severity, Sink};
use ivcam_base::platform::real_path;

use super::identity::endings;

/// Returns the length of the ending of a scene file's name; 0 if it has no such ending.
fn ending_length(name: &str) -> usize {
    let lower = name.to_ascii_lowercase();
    let plain = lower.strip_suffix(".gz").unwrap_or(&lower);
    let fitting = endings().filter(|e| plain.ends_with(e));
    let lengths = fitting.map(|e| e.len() + name.len() - plain.len());
    lengths.max().unwrap_or_default()
}

/// Returns the name of a scene file without its ending.
pub fn without_ending(name: &str) -> &str {
    &name[..name.len() - ending_length(name)]
}

/// Returns the given files, and the scene files in the given folders and their subfolders, sorted;
/// each of them once.
/// `skipped` receives a warning for each other entry with the name of a scene file, as in
/// [`files_below`].
///
/// # Errors
/// Returns a diagnostic if a folder cannot be read or contains no scene file.
pub fn scene_files(named: &[&PathBuf], skipped: &mut Sink) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for path in named {
        if !path.is_dir() {
            files.push((*path).clone());
            continue;
        }
        let found = files_below(path, &|name| ending_length(name) > 0, skipped)?;
        if found.is_empty() {
            return Err(Diagnostic::not_found(format!(
                "no scene files below `{}`",
                path.display()
            ))
            .with_help(format!(
                "looked for {}, each also with .gz",
                endings().collect::<Vec<_>>().join(", ")
            )));
        }
        files.extend(found);
    }
    let mut seen = HashSet::new();
    files.retain(|file| seen.insert(file.clone()));
    Ok(files)
}

/// Returns the files in a folder and its subfolders that `is_wanted` accepts, sorted. It receives
/// the path in lower case.
///
/// Only regular files of that folder count: a pipe may wait for ever, a device may have no end, and
/// a link may lead to a file that does not belong to the archive. `skipped` receives a warning for
/// each other entry that is wanted, for each link to a folder elsewhere, and for each subfolder
/// that cannot be read.
///
/// # Errors
/// Returns a diagnostic if the folder itself cannot be read.
pub fn files_below(
    folder: &Path,
    is_wanted: &dyn Fn(&str) -> bool,
    skipped: &mut Sink,
) -> Result<Vec<PathBuf>> {
    let real = real_path(folder).map_err(|e| Diagnostic::io(folder.display(), &e))?;
    let mut files = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(below) = folders.pop() {
        let entries = std::fs::read_dir(&below).and_then(Iterator::collect::<io::Result<Vec<_>>>);
        let entries = match entries.map_err(|e| Diagnostic::io(below.display(), &e)) {
            Ok(entries) => entries,
            Err(error) if below == folder => return Err(error),
            Err(error) => {
                skipped.add(*error.at_most(Severity::Warning));
                continue;
            }
        };
        for path in entries.into_iter().map(|entry| entry.path()) {
            let is_folder = path.is_dir();
            if is_folder && !path.is_symlink() {
                folders.push(path);
            } else if is_folder || is_wanted(&path.to_string_lossy().to_lowercase()) {
                match reason_to_skip(&path, &real) {
                    Some(why) => {
                        let text = format!("`{}` is skipped: {why}", path.display());
                        let warning = Diagnostic::warning(text);
                        skipped.add(*warning.with_help("name it in the command to read it"));
                    }
                    None if is_folder => {}
                    None => files.push(path),
                }
            }
        }
    }
    files.sort();
    Ok(files)
}

/// Returns why an entry below a folder is not read, if it is not. `folder` is canonical. A link to
/// a folder inside it is no reason: the files there are found without the link.
fn reason_to_skip(path: &Path, folder: &Path) -> Option<&'static str> {
    match real_path(path) {
        Err(_) => Some("it is a link to nothing"),
        Ok(real) if real.is_dir() && real.starts_with(folder) => None,
        Ok(real) if real.is_dir() => Some("it is a link to a folder outside the folder"),
        Ok(real) if !real.is_file() => Some("it is not a regular file"),
        Ok(real) if !real.starts_with(folder) => Some("it is a link to a file outside the folder"),
        Ok(_) => None,
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn every_format_may_be_packed() {
        for (name, stem) in [("a.obj.gz", "a"), ("b.VRML.GZ", "b"), ("c.x3dv", "c")] {
            assert_eq!(without_ending(name), stem);
        }
        for name in ["a.tar.gz", "b.iv.txt", "gz"] {
            assert_eq!(without_ending(name), name);
        }
    }

    #[test]
    fn devices_and_links_out_of_a_folder_are_skipped_with_a_warning() {
        let name = format!("ivcam-check-{}-links", std::process::id());
        let folder = std::env::temp_dir().join(name);
        let archive = folder.join("archive");
        std::fs::create_dir_all(&archive).unwrap();
        std::fs::write(folder.join("outside.iv"), "#Inventor V2.1 ascii\n").unwrap();
        std::fs::write(archive.join("a.iv"), "#Inventor V2.1 ascii\n").unwrap();
        let link = |to: &str, name: &str| {
            std::os::unix::fs::symlink(to, archive.join(name)).unwrap();
        };
        link("a.iv", "inside.iv");
        link("../outside.iv", "outside.iv");
        link("/dev/zero", "endless.iv");
        link("gone.iv", "nothing.iv");
        link("..", "above");
        link(".", "here");
        let mut skipped = Sink::new();
        let files = scene_files(&[&archive, &archive.join("a.iv")], &mut skipped).unwrap();
        let _ = std::fs::remove_dir_all(&folder);
        assert_eq!(files, [archive.join("a.iv"), archive.join("inside.iv")]);
        let mut reasons: Vec<&str> = skipped
            .items()
            .iter()
            .map(|d| d.message.rsplit(": ").next().unwrap())
            .collect();
        reasons.sort_unstable();
        assert_eq!(
            reasons,
            [
                "it is a link to a file outside the folder",
                "it is a link to a folder outside the folder",
                "it is a link to nothing",
                "it is not a regular file"
            ]
        );
    }
}
