//! Lines about what a file contains: the files of its textures, and its levels of detail.

use ivcam_inventor::grammar::{class, level_of_detail, lod, vrml97_lod};
use ivcam_inventor::iv::{Document, NodeId, NodeRef};

use super::missing::sounds;
use crate::scene::looks::{PICTURES, shows_picture};

/// The number of entries of a line; of more, the line says how many there are.
const SHOWN: usize = 6;

/// Returns the lines with their headings, of which each has at least one entry.
pub(super) fn lines(document: &Document) -> Vec<(&'static str, String)> {
    let (mut textures, mut levels) = (Vec::new(), Vec::new());
    let sounds = sounds(document);
    for index in 0..document.nodes.len() {
        let node = document.node(NodeId(index as u32));
        if !sounds.contains(&node.id) {
            textures.extend(self::textures(node));
        }
        levels.extend(levels_of(node));
    }
    let lines = [("textures", textures), ("levels", levels)];
    let lines = lines.into_iter().filter(|(_, list)| !list.is_empty());
    lines
        .map(|(heading, list)| (heading, shown(list)))
        .collect()
}

/// Returns the names of the files of a texture: of several names for one picture the first that is
/// there, or the first.
fn textures(node: NodeRef<'_>) -> Vec<String> {
    let Some(class) = node.class_id().filter(|class| shows_picture(*class)) else {
        return Vec::new();
    };
    let names = PICTURES.iter().flat_map(|field| field.names(node));
    let mut names: Vec<&str> = names.filter(|name| !name.starts_with("data:")).collect();
    if class != class::TEXTURE3 && names.len() > 1 {
        let is_there = |name: &&str| node.document.load_beside(node.id, name).is_ok();
        let used = names.iter().position(is_there).unwrap_or(0);
        names = vec![names[used]];
    }
    names.into_iter().map(str::to_owned).collect()
}

/// Returns what selects the levels of a node: the area on the screen in pixels, or the distance.
fn levels_of(node: NodeRef<'_>) -> Option<String> {
    let (unit, limits) = match node.class_id()? {
        class::LEVEL_OF_DETAIL => ("pixels", node.get(level_of_detail::SCREEN_AREA)),
        class::LOD => ("away", node.get(lod::RANGE)),
        class::VRML97_LOD => ("away", node.get(vrml97_lod::RANGE)),
        _ => return None,
    };
    let count = match node.class_id()? {
        class::VRML97_LOD => node.get_nodes(vrml97_lod::LEVEL).len(),
        _ => node.children().len(),
    };
    let limits: Vec<String> = limits.iter().map(f32::to_string).collect();
    let (class, limits) = (node.class_name(), limits.join(", "));
    Some(format!("{class} of {count} at {limits} {unit}"))
}

/// Returns the entries of a line, each once.
fn shown(mut list: Vec<String>) -> String {
    list.sort();
    list.dedup();
    let more = list.len().saturating_sub(SHOWN);
    list.truncate(SHOWN);
    match more {
        0 => list.join(", "),
        _ => format!("{} and {more} more", list.join(", ")),
    }
}
