//! Nodes counted by class and by what becomes of them.

use indexmap::IndexMap;

use crate::grammar::Treatment;
use crate::iv::{Document, NodeId};

/// Nodes by class and by what becomes of them, the most frequent first.
pub(crate) fn classes(document: &Document) -> [(&'static str, Vec<(String, usize)>); 4] {
    let mut counts: IndexMap<(&str, usize), usize> = IndexMap::new();
    for id in 0..document.nodes.len() {
        let id = NodeId(id as u32);
        if document.is_template(id) || document.expansions.contains_key(&id) {
            continue; // a proto's body is counted where it is used, by its own nodes
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
