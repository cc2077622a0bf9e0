//! Where the files of a catalog are: paths below its folder, with `/` between their parts.

use std::borrow::Cow;

use super::links::joined;
use super::sha256::{digest, hex};

/// The page, its data in three forms, and the style of the pages of scenes.
pub(super) const PAGE: &str = "index.html";
pub(super) const DATA: &str = "catalog.json";
pub(super) const TABLE: &str = "catalog.csv";
pub(super) const LINKED: &str = "catalog.jsonld";
pub(super) const STYLE_FILE: &str = "catalog.css";
/// The folder of a built page that opens scenes, and that of the scenes which it opens.
pub(super) const LIVE: &str = "page";
pub(super) const FILES: &str = "files";

/// Returns the picture of a scene. `name` is the path of the scene below the folder of scenes.
pub(super) fn picture(name: &str) -> String {
    format!("pictures/{}.png", short(name))
}

/// Returns the larger picture of a scene.
pub(super) fn large(name: &str) -> String {
    format!("large/{}.jpg", short(name))
}

/// Returns the page of a scene.
pub(super) fn scene_page(name: &str) -> String {
    format!("scenes/{}.html", short(name))
}

/// Returns the file with the nodes and problems of a scene, and the list of the files that it
/// needs.
pub(super) fn detail(name: &str) -> String {
    format!("scenes/{}.json", short(name))
}

/// Returns the path of a scene with a last part that leaves room for an ending: file systems allow
/// 255 bytes. A longer one is cut, and has a part of the hash of the path behind it.
fn short(name: &str) -> Cow<'_, str> {
    const MOST: usize = 240;
    const KEPT: usize = 200;
    let start = name.rfind('/').map_or(0, |slash| slash + 1);
    if name.len() - start <= MOST {
        return name.into();
    }
    let end = name.floor_char_boundary(start + KEPT);
    let hash = hex(&digest(name.as_bytes())[..8]);
    format!("{}~{hash}", &name[..end]).into()
}

/// Returns the address of the folder of the catalog as seen from the page of a scene.
pub(super) fn root(name: &str) -> String {
    "../".repeat(name.matches('/').count() + 1)
}

/// Returns the address that opens a scene in the built page, relative to the folder of the catalog.
pub(super) fn live(name: &str) -> String {
    // Addresses are encoded once for themselves and once as the values of a query.
    let value = |path: String| joined("", &joined("..", &path));
    let (scene, list) = (value(format!("{FILES}/{name}")), value(detail(name)));
    format!("{LIVE}/index.html?scene={scene}&files={list}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_files_of_scenes_with_long_names_have_names_that_fit() {
        let names = ["日".repeat(84), "日".repeat(84) + "x", "a/b.iv".into()];
        let pages = names.map(|name| scene_page(&format!("a/{name}")));
        assert_eq!(pages[2], "scenes/a/a/b.iv.html");
        assert_ne!(pages[0], pages[1]);
        for page in pages {
            assert!(page.split('/').all(|part| part.len() <= 245), "{page}");
        }
    }

    #[test]
    fn an_address_in_a_query_is_encoded_twice() {
        let expected =
            "page/index.html?scene=../files/a/%2526%2520b.iv&files=../scenes/a/%2526%2520b.iv.json";
        assert_eq!(live("a/& b.iv"), expected);
        assert_eq!(root("a/b.iv"), "../../");
    }
}
