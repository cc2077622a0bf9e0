//! Counts nodes by class and by how they are treated.

use std::borrow::Cow;
use std::collections::HashSet;

use indexmap::IndexMap;
use ivcam_base::diag::excerpt;
use ivcam_inventor::grammar::{Treatment, collision};
use ivcam_inventor::iv::{Document, NodeId};
use ivcam_inventor::traversal::each_child;

/// Returns the number of nodes of each class, by how they are treated. The most frequent class of
/// each group is first.
pub fn classes(document: &Document) -> [(&'static str, Vec<(String, usize)>); 4] {
    let mut counts: IndexMap<(Cow<'_, str>, usize), usize> = IndexMap::new();
    let unseen = proxies(document);
    for id in 0..document.nodes.len() {
        let id = NodeId(id as u32);
        if document.is_template(id) || document.expansions.contains_key(&id) {
            continue; // the nodes of a prototype are counted at each of its uses
        }
        let node = document.node(id);
        let column = match node.known_class().map(|c| c.treatment) {
            Some(Treatment::Rendered) if unseen.contains(&id) => 2,
            Some(Treatment::Rendered) => 0,
            Some(Treatment::State | Treatment::Group) => 1,
            Some(Treatment::Kept | Treatment::Abstract) => 2,
            None => 3,
        };
        *counts
            .entry((excerpt(node.class_name()), column))
            .or_default() += 1;
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
            of.map(|((class, _), n)| (class.to_string(), *n)).collect(),
        )
    })
}

/// Returns the nodes that stand for others when a viewer collides with them, which are never drawn:
/// those below the `proxy` of a `Collision` and nowhere else.
fn proxies(document: &Document) -> HashSet<NodeId> {
    let ids = document.ids();
    let proxies: HashSet<NodeId> = ids
        .filter_map(|id| document.node(id).get_node(collision::PROXY))
        .map(|node| node.id)
        .collect();
    if proxies.is_empty() {
        return HashSet::new();
    }
    let below = |start: Vec<NodeId>, enters: &dyn Fn(NodeId) -> bool| {
        let (mut found, mut left) = (HashSet::new(), start);
        while let Some(id) = left.pop() {
            let id = document.node(id).id;
            if enters(id) && found.insert(id) {
                each_child(document, id, |child| left.push(child));
            }
        }
        found
    };
    let seen = below(document.roots.clone(), &|id| !proxies.contains(&id));
    let mut unseen = below(proxies.iter().copied().collect(), &|_| true);
    unseen.retain(|id| !seen.contains(id));
    unseen
}
