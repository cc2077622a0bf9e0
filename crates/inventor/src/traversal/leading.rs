//! Finds the nodes below which there is a node of some kind, so that a walk can skip the others.

use super::role::{Role, role};
use super::visitor::Instance;
use crate::iv::{Document, NodeId, NodeRef, Value};

/// The nodes that are of some kind, or have such a node below.
#[derive(Debug)]
pub struct Leading(Vec<bool>);

impl Leading {
    /// Finds the nodes that lead to one that is wanted. A kit always does, because it may make its
    /// parts.
    pub fn to(document: &Document, wanted: impl Fn(NodeRef<'_>) -> bool) -> Self {
        let ids = || document.ids();
        let mut leads = vec![false; document.nodes.len()];
        let mut found: Vec<NodeId> = ids()
            .filter(|id| {
                let node = document.node(*id);
                role(node) == Role::Kit || wanted(node)
            })
            .collect();
        if found.is_empty() {
            return Self(leads);
        }
        let parents = Parents::of(document);
        while let Some(id) = found.pop() {
            if !std::mem::replace(&mut leads[id.0 as usize], true) {
                found.extend(parents.of_node(id));
            }
        }
        Self(leads)
    }

    /// Whether there is a wanted node in a part of the document.
    pub fn is_in(&self, part: Instance<'_>) -> bool {
        self.0[part.node().id.0 as usize]
    }
}

/// The nodes that have a node below them.
pub(crate) struct Parents(Vec<(NodeId, NodeId)>);

impl Parents {
    /// Finds the parents of all nodes of a document.
    pub(crate) fn of(document: &Document) -> Self {
        let mut parents = Vec::new();
        for id in document.ids() {
            each_child(document, id, |child| parents.push((child, id)));
        }
        parents.sort_unstable_by_key(|(child, _)| child.0);
        Self(parents)
    }

    /// Returns the parents of a node.
    pub(crate) fn of_node(&self, node: NodeId) -> impl Iterator<Item = NodeId> {
        let first = self.0.partition_point(|(child, _)| child.0 < node.0);
        let above = self.0[first..].iter();
        above
            .take_while(move |(child, _)| *child == node)
            .map(|(_, parent)| *parent)
    }
}

/// Calls a function with each child of a node, and with the nodes in its fields.
pub fn each_child(document: &Document, id: NodeId, mut found: impl FnMut(NodeId)) {
    let node = document.node(id).data();
    let fields = node.fields.iter().map(|field| match &field.value {
        Value::Node(Some(id)) => std::slice::from_ref(id),
        Value::Nodes(ids) => ids,
        _ => &[],
    });
    let included = document.included.get(&id).map_or(&[][..], Vec::as_slice);
    let all = fields.chain([&node.children[..], included]);
    all.flatten().for_each(|id| found(*id));
}
