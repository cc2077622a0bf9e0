//! The folder of a file, and the folder of the project that a file belongs to.

use std::path::{Path, PathBuf};

use crate::platform::{real_path, temporary_folder};

/// Names of entries that mark the top folder of a project.
const MARKERS: [&str; 4] = [".git", ".hg", ".svn", ".ivcam-project"];
/// Folders whose entries are the homes of users or disks. Neither they nor their entries are
/// projects.
const OWNERS: [&str; 4] = ["/home", "/Users", "/media", "/mnt"];
/// Folders for the temporary files of all users. Their entries may be projects.
const TEMPORARY: [&str; 2] = ["/var/tmp", "/private/tmp"];

/// Returns the folder that contains a file, `.` for a bare name.
pub fn folder_of(file: &Path) -> PathBuf {
    match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

/// Returns the folder below which the files of a project lie, given the folder of one of them as a
/// canonical path.
///
/// It is the nearest folder with one of `MARKERS`, which may be the given one. Without a marker
/// it is one level above the given folder. It never is, or lies above, the root of a disk, a folder
/// at the root, the home of a user, or the folder for temporary files; where the rule leads there,
/// it is the given folder itself.
pub fn project_of(folder: &Path) -> PathBuf {
    project_without(folder, &personal_folders())
}

/// Returns `folder` if its files are one project because a user named it, and the scene at `scene`
/// was found below it: then the project of the scene alone is a part of it. Returns `None` if the
/// scene's project is not smaller, or if the folder can never be a project (see [`project_of`]).
pub fn named_project(scene: &Path, folder: &Path) -> Option<PathBuf> {
    let (own, real) = (real_path(&folder_of(scene)).ok()?, real_path(folder).ok()?);
    named_without(&own, &real, &personal_folders()).then(|| folder.to_path_buf())
}

/// Returns whether a named folder is a project that is larger than that of a folder inside it.
/// Both are canonical paths.
fn named_without(own: &Path, named: &Path, personal: &[PathBuf]) -> bool {
    let project = project_without(own, personal);
    project != named && project.starts_with(named) && may_be_project(named, own, personal)
}

/// Returns the canonical paths of the home of the user and of the folder for temporary files.
fn personal_folders() -> Vec<PathBuf> {
    let named = ["HOME", "USERPROFILE"].map(std::env::var_os);
    let mut personal: Vec<PathBuf> = named.into_iter().flatten().map(Into::into).collect();
    personal.extend(temporary_folder());
    personal.iter().filter_map(|p| real_path(p).ok()).collect()
}

/// Returns whether a folder above another one belongs to one person and one disk.
fn may_be_project(candidate: &Path, folder: &Path, personal: &[PathBuf]) -> bool {
    let depth = candidate
        .components()
        .filter(|c| matches!(c, std::path::Component::Normal(_)));
    let is_one = |list: &[&str], path: &Path| list.iter().any(|s| path == Path::new(s));
    let parent = candidate.parent();
    depth.count() > 1
        && !personal.iter().any(|p| p.starts_with(candidate))
        && !is_one(&TEMPORARY, candidate)
        && !parent.is_some_and(|parent| is_one(&OWNERS, parent))
        && is_on_the_same_disk(candidate, folder)
}

/// Returns the folder of a project that is not one of some folders and not above one of them.
fn project_without(folder: &Path, personal: &[PathBuf]) -> PathBuf {
    let is_private = |candidate: &&Path| may_be_project(candidate, folder, personal);
    let is_marked = |folder: &&Path| {
        let marker = |name: &&str| folder.join(name).symlink_metadata().is_ok();
        MARKERS.iter().any(marker)
    };
    let above = || folder.ancestors().skip(1).take_while(is_private);
    let marked = std::iter::once(folder).chain(above()).find(is_marked);
    marked
        .or_else(|| above().next())
        .unwrap_or(folder)
        .to_path_buf()
}

#[cfg(unix)]
fn is_on_the_same_disk(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let disk = |path: &Path| path.metadata().ok().map(|about| about.dev());
    disk(a) == disk(b)
}

#[cfg(not(unix))]
fn is_on_the_same_disk(_: &Path, _: &Path) -> bool {
    true
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_project_ends_at_a_marker_or_one_level_up_and_before_folders_of_others() {
        let name = format!("ivcam-project-{}", std::process::id());
        let top = std::env::temp_dir().canonicalize().unwrap().join(name);
        let folder = top.join("a/b/c");
        std::fs::create_dir_all(&folder).unwrap();
        let found = |personal: &[&str]| {
            let personal: Vec<PathBuf> = personal.iter().map(|p| top.join(p)).collect();
            let project = project_without(&folder, &personal);
            project.strip_prefix(&top).unwrap().to_path_buf()
        };
        assert_eq!(found(&[]), Path::new("a/b"));
        assert_eq!(found(&["a/b"]), Path::new("a/b/c"), "a home");
        assert_eq!(found(&["a/b/d"]), Path::new("a/b/c"), "above a home");
        std::fs::create_dir(top.join("a/.git")).unwrap();
        assert_eq!(found(&[]), Path::new("a"));
        assert_eq!(found(&["a"]), Path::new("a/b"), "a home with a marker");
        std::fs::write(folder.join(".ivcam-project"), "").unwrap();
        assert_eq!(found(&["a"]), Path::new("a/b/c"));
        std::fs::remove_dir_all(&top).unwrap();
    }

    #[test]
    fn a_named_folder_is_the_project_of_what_is_below_unless_it_belongs_to_others() {
        let name = format!("ivcam-named-{}", std::process::id());
        let top = std::env::temp_dir().canonicalize().unwrap().join(name);
        let folder = top.join("a/b/c");
        std::fs::create_dir_all(&folder).unwrap();
        let widens = |named: &str, personal: &str| {
            let personal = [top.join(personal)];
            named_without(&folder, &top.join(named), &personal)
        };
        assert!(widens("a", "none"));
        assert!(
            !widens("a/b", "none") && !widens("a/b/c", "none"),
            "not larger"
        );
        assert!(
            !widens("a", "a") && !widens("a", "a/d"),
            "a home, and above one"
        );
        assert!(!named_without(&folder, Path::new("/"), &[]));
        std::fs::remove_dir_all(&top).unwrap();
    }

    #[test]
    fn no_folder_at_the_root_of_a_disk_is_a_project() {
        let folders = [
            "/",
            "/usr",
            "/usr/no-such-folder",
            "/tmp",
            "/home/no-one",
            "/home/no-one/a",
            "/var/tmp/a",
        ];
        for folder in folders {
            assert_eq!(project_without(Path::new(folder), &[]), Path::new(folder));
        }
    }
}
