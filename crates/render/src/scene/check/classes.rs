//! Counts nodes by class and by how they are treated.

use indexmap::IndexMap;
use ivcam_inventor::grammar::Treatment;
use ivcam_inventor::iv::{Document, NodeId};

/// Returns the number of nodes of each class, by how they are treated. The most frequent class of
/// each group is first.
pub fn classes(document: &Document) -> [(&'static str, Vec<(String, usize)>); 4] {
    let mut counts: IndexMap<(&str, usize), usize> = IndexMap::new();
    for id in 0..document.nodes.len() {
        let id = NodeId(id as u32);
        if document.is_template(id) || document.expansions.contains_key(&id) {
            continue; // the nodes of a prototype are counted at each of its uses
        }
        let node = document.node(id);
        let column = match node.known_class().map(|c| c.treatment) {
            Some(Treatment::Rendered) => 0,
            Some(Treatment::State | Treatment::Group) => 1,
            Some(Treatment::Kept | Treatment::Abstract) => 2,
            None => 3,
        };
        *counts.entry((node.class_name(), column)).or_default() += 1;
    }
    counts.sort_by(|a, n, b, m| m.cmp(n).then(a.cmp(b)));
    ["drawn", "structure", "kept", "unknown"].map(|heading| {
        let column = ["drawn", "structure", "kept", "unknown"]
            .iter()
            .position(|h| *h == heading)
            .unwrap_or_default();
        let of = counts.iter().filter(|((_, c), _)| *c == column);
        (
            heading,
            of.map(|((class, _), n)| ((*class).to_owned(), *n))
                .collect(),
        )
    })
}
