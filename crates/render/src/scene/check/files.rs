//! Finds scene files in folders.

use std::path::{Path, PathBuf};

use ivcam_base::diag::{Diagnostic, Result, Sink};
use ivcam_base::platform::real_path;

/// The file name extensions of scene files.
const ENDINGS: [&str; 16] = [
    ".iv", ".wrl", ".iv.gz", ".wrl.gz", ".wrz", ".vrml", ".x3d", ".x3dv", ".x3d.gz", ".x3dz",
    ".x3dv.gz", ".gltf", ".glb", ".obj", ".ply", ".stl",
];

/// Returns the name of a scene file without its ending.
pub fn without_ending(name: &str) -> &str {
    let lower = name.to_ascii_lowercase();
    let lengths = ENDINGS
        .iter()
        .filter(|e| lower.ends_with(*e))
        .map(|e| e.len());
    &name[..name.len() - lengths.max().unwrap_or_default()]
}

/// Returns the given files, and the scene files in the given folders and their subfolders, sorted.
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
        let is_scene = |name: &str| ENDINGS.iter().any(|e| name.ends_with(e));
        let found = files_below(path, &is_scene, skipped)?;
        if found.is_empty() {
            return Err(Diagnostic::not_found(format!(
                "no scene files below `{}`",
                path.display()
            ))
            .with_help(format!("looked for {}", ENDINGS.join(", "))));
        }
        files.extend(found);
    }
    Ok(files)
}

/// Returns the files in a folder and its subfolders that `is_wanted` accepts, sorted. It receives
/// the path in lower case.
///
/// Only regular files of that folder count: a pipe may wait for ever, a device may have no end, and
/// a link may lead to a file that does not belong to the archive. `skipped` receives a warning for
/// each other entry that is wanted.
///
/// # Errors
/// Returns a diagnostic if a folder cannot be read.
pub fn files_below(
    folder: &Path,
    is_wanted: &dyn Fn(&str) -> bool,
    skipped: &mut Sink,
) -> Result<Vec<PathBuf>> {
    let real = real_path(folder).map_err(|e| Diagnostic::io(folder.display(), &e))?;
    let mut files = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        let entries =
            std::fs::read_dir(&folder).map_err(|e| Diagnostic::io(folder.display(), &e))?;
        for path in entries.filter_map(|e| e.ok().map(|e| e.path())) {
            if path.is_dir() && !path.is_symlink() {
                folders.push(path);
            } else if is_wanted(&path.to_string_lossy().to_lowercase()) {
                if let Some(why) = reason_to_skip(&path, &real) {
                    let text = format!("`{}` is skipped: {why}", path.display());
                    let warning = Diagnostic::warning(text);
                    skipped.add(*warning.with_help("name the file itself to check it"));
                } else {
                    files.push(path);
                }
            }
        }
    }
    files.sort();
    Ok(files)
}

/// Returns why an entry below a folder is not read, if it is not. `folder` is canonical.
fn reason_to_skip(path: &Path, folder: &Path) -> Option<&'static str> {
    match real_path(path) {
        Err(_) => Some("it is a link to nothing"),
        Ok(real) if !real.is_file() => Some("it is not a regular file"),
        Ok(real) if !real.starts_with(folder) => Some("it is a link to a file outside the folder"),
        Ok(_) => None,
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

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
        let mut skipped = Sink::new();
        let files = scene_files(&[&archive], &mut skipped).unwrap();
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
                "it is a link to nothing",
                "it is not a regular file"
            ]
        );
    }
}
