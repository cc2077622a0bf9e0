//! Removes cycles from a document, so that no node contains itself.

use ivcam_base::diag::excerpt;

use crate::grammar::value::{NodeId, Value};
use crate::grammar::{self, Treatment};
use crate::iv::document::{ClassRef, Document};

/// A reference from a node to a node that it contains. Numbers are indices.
#[derive(Clone, Copy)]
enum CycleEdge {
    /// A child.
    Child(usize),
    /// The value of an `SFNode` field.
    Field(usize),
    /// A node of an `MFNode` field: the field and the index in its list.
    Element(usize, usize),
    /// A root of an included file.
    Included(usize),
    /// The first node of the body's copy, for an instance of a proto.
    Expansion,
}

/// Returns the edges of a node and their targets, in the order of traversal.
fn edges(document: &Document, id: NodeId) -> Vec<(CycleEdge, NodeId)> {
    let node = &document.nodes[id.0 as usize];
    let mut out = Vec::new();
    if let Some(&other) = document.expansions.get(&id) {
        out.push((CycleEdge::Expansion, other));
        return out;
    }
    for (i, &child) in node.children.iter().enumerate() {
        out.push((CycleEdge::Child(i), child));
    }
    let walked = match node.class {
        ClassRef::Known(class) => class.get().treatment != Treatment::Kept,
        ClassRef::Extension(i) => {
            let kept = |n: &str| grammar::any(n).is_some_and(|c| c.treatment == Treatment::Kept);
            !document.extensions[i as usize].is_a.iter().any(|n| kept(n))
        }
    };
    for (i, field) in node.fields.iter().enumerate().filter(|_| walked) {
        match &field.value {
            Value::Node(Some(target)) => out.push((CycleEdge::Field(i), *target)),
            Value::Nodes(targets) => {
                out.extend(
                    targets
                        .iter()
                        .enumerate()
                        .map(|(k, &t)| (CycleEdge::Element(i, k), t)),
                );
            }
            _ => {}
        }
    }
    if let Some(roots) = document.included.get(&id) {
        out.extend(
            roots
                .iter()
                .enumerate()
                .map(|(i, &t)| (CycleEdge::Included(i), t)),
        );
    }
    out
}

/// Removes every edge that closes a cycle, so that traversal ends.
///
/// It is a depth-first search with an explicit stack, because files may nest deeper than recursion
/// allows.
pub(super) fn cut_cycles(document: &mut Document) {
    const NEW: u8 = 0;
    const OPEN: u8 = 1;
    const DONE: u8 = 2;
    let mut colors = vec![NEW; document.nodes.len()];
    let mut cuts = Vec::new();
    let mut stack: Vec<(NodeId, std::vec::IntoIter<(CycleEdge, NodeId)>)> = Vec::new();
    for root in document.roots.clone() {
        if colors[root.0 as usize] != NEW {
            continue;
        }
        colors[root.0 as usize] = OPEN;
        stack.push((root, edges(document, root).into_iter()));
        while let Some((id, rest)) = stack.last_mut() {
            let id = *id;
            let Some((edge, target)) = rest.next() else {
                colors[id.0 as usize] = DONE;
                stack.pop();
                continue;
            };
            match colors[target.0 as usize] {
                NEW => {
                    colors[target.0 as usize] = OPEN;
                    stack.push((target, edges(document, target).into_iter()));
                }
                OPEN => cuts.push((id, edge, target)),
                _ => {}
            }
        }
    }
    for (id, edge, target) in cuts.into_iter().rev() {
        cut(document, id, edge, target);
    }
}

/// Removes an edge and warns about it.
fn cut(document: &mut Document, id: NodeId, edge: CycleEdge, target: NodeId) {
    let data = &document.nodes[target.0 as usize];
    let name = excerpt(data.name.as_deref().unwrap_or("a node")).into_owned();
    let span = document.nodes[id.0 as usize].span;
    document
        .sink
        .warn(
            span,
            format!("`{name}` contains itself; the inner one is left out"),
        )
        .help("a node cannot be used inside itself");
    let node = &mut document.nodes[id.0 as usize];
    match edge {
        CycleEdge::Child(i) => {
            node.children.remove(i);
        }
        CycleEdge::Field(i) => node.fields[i].value = Value::Node(None),
        CycleEdge::Element(i, k) => {
            if let Value::Nodes(list) = &mut node.fields[i].value {
                list.remove(k);
            }
        }
        CycleEdge::Included(i) => {
            if let Some(roots) = document.included.get_mut(&id) {
                roots.remove(i);
            }
        }
        CycleEdge::Expansion => {
            document.expansions.remove(&id);
        }
    }
}
