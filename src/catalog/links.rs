//! Addresses of files relative to the catalog's page, and the files converted from a scene.

use std::path::{Path, PathBuf};

use super::entry::Converted;
use crate::archive::{bytes_of, path_of};

/// The endings of files that a scene may have been converted to, in the order of the page.
const CONVERTED: [&str; 9] = [
    "glb", "gltf", "x3d", "wrl", "iv", "obj", "ply", "usda", "png",
];

/// Returns the address of a file as seen from a folder. Both paths are canonical.
pub(crate) fn link(from: &Path, to: &Path) -> String {
    let (from, to): (Vec<_>, Vec<_>) = (from.components().collect(), to.components().collect());
    let same = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let up = std::iter::repeat_n("..".to_owned(), from.len() - same);
    let down = to[same..]
        .iter()
        .map(|part| encoded(part.as_os_str().as_encoded_bytes()));
    up.chain(down).collect::<Vec<_>>().join("/")
}

/// Returns the address of a file below a folder. `folder` is an address and may be empty, `file` a
/// path with `/` between its parts.
pub(super) fn joined(folder: &str, file: &str) -> String {
    let parts = file.split('/').map(|part| encoded(part.as_bytes()));
    below(folder, parts)
}

/// Returns the address of a file that was read, by its name below a folder. Unlike a file that is
/// named after it, it may have bytes that are not UTF-8: see [`path_of`].
pub(crate) fn original(folder: &str, name: &str) -> String {
    let parts = name.split('/').map(|part| encoded(&bytes_of(part)));
    below(folder, parts)
}

fn below(folder: &str, parts: impl Iterator<Item = String>) -> String {
    let above = (!folder.is_empty()).then(|| folder.to_owned());
    above.into_iter().chain(parts).collect::<Vec<_>>().join("/")
}

/// Encodes a part of a path for an address: all bytes but letters, digits and `-._~` as `%XX`.
fn encoded(part: &[u8]) -> String {
    let mut out = String::new();
    for &byte in part {
        if byte.is_ascii_alphanumeric() || b"-._~".contains(&byte) {
            out.push(char::from(byte));
        } else {
            out += &format!("%{byte:02X}");
        }
    }
    out
}

/// Returns the files below some folders that were converted from a scene: those at its place with
/// its name, or its name without its ending if no other scene has that name, and another ending.
pub(super) fn converted(
    out: &Path,
    folders: &[PathBuf],
    file: &str,
    stem: Option<&str>,
    scene: &Path,
) -> Vec<Converted> {
    let names = std::iter::once(file).chain(stem);
    let names: Vec<&str> = names.collect();
    let candidates = CONVERTED.iter().flat_map(|kind| {
        folders.iter().flat_map({
            let names = &names;
            move |folder| {
                let path = move |name: &&str| folder.join(path_of(&format!("{name}.{kind}")));
                names.iter().map(path).map(move |path| (*kind, path))
            }
        })
    });
    let found = candidates.filter_map(|(kind, path)| {
        let real = path.canonicalize().ok()?;
        let is_other = real.is_file() && real != scene;
        is_other.then(|| Converted {
            kind: kind.to_owned(),
            link: link(out, &real),
        })
    });
    let mut list: Vec<Converted> = Vec::new();
    found.for_each(|one| {
        if !list.contains(&one) {
            list.push(one);
        }
    });
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_address_of_a_file_that_was_read_has_its_bytes() {
        assert_eq!(original("../in", "a/b\\xE4r.iv"), "../in/a/b%E4r.iv");
        assert_eq!(joined("", "a/b\\xE4r.iv.png"), "a/b%5CxE4r.iv.png");
    }

    #[test]
    fn an_address_is_relative_and_encoded() {
        for (from, to, expected) in [
            ("/a/out", "/a/in/b.iv", "../in/b.iv"),
            ("/a/in/out", "/a/in/b.iv", "../b.iv"),
            (
                "/a",
                "/a/b/c d#?%\"<é.iv",
                "b/c%20d%23%3F%25%22%3C%C3%A9.iv",
            ),
            ("/a/out", "/a/in/javascript:x", "../in/javascript%3Ax"),
        ] {
            assert_eq!(link(Path::new(from), Path::new(to)), expected);
        }
    }

    #[test]
    fn converted_files_are_found_by_both_names_but_not_the_scene_itself() {
        let top = std::env::temp_dir().join(format!("ivcam-links-{}", std::process::id()));
        std::fs::create_dir_all(top.join("b")).unwrap();
        let top = top.canonicalize().unwrap();
        for name in ["b/a.wrl", "b/a.glb", "b/a.wrl.x3d", "b/a.txt"] {
            std::fs::write(top.join(name), "").unwrap();
        }
        let folders = [top.clone(), top.clone()];
        let scene = top.join("b/a.wrl");
        let found = |stem| {
            let list = converted(&top, &folders, "b/a.wrl", stem, &scene);
            list.into_iter().map(|c| c.link).collect::<Vec<_>>()
        };
        let (with, without) = (found(Some("b/a")), found(None));
        std::fs::remove_dir_all(&top).unwrap();
        assert_eq!(with, ["b/a.glb", "b/a.wrl.x3d"]);
        assert_eq!(without, ["b/a.wrl.x3d"]);
    }
}
