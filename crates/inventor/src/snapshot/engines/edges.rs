//! The graph of connections and routes, and the order in which its values are computed.

use std::collections::{HashMap, HashSet};

use ivcam_base::diag::Span;

use crate::grammar::{FieldType, class};
use crate::iv::document::ClassRef;
use crate::iv::{Document, NodeId, NodeRef, Route};

/// The target of a connection or route in its node.
#[derive(Clone, Debug, PartialEq)]
pub enum Slot {
    /// A field, by its index.
    Field(u16, FieldType),
    /// A VRML97 `eventIn` that is not a field.
    Input(&'static str, FieldType),
}

/// A connection or route.
#[derive(Clone, Debug)]
pub(super) struct Edge {
    pub(super) from: NodeId,
    pub(super) output: Box<str>,
    pub(super) slot: Slot,
    pub(super) span: Span,
}

/// Returns the edges into each node that has any, in the order of the file.
pub(super) fn edges(document: &Document) -> Vec<(NodeId, Vec<Edge>)> {
    let mut out: Vec<(NodeId, Vec<Edge>)> = Vec::new();
    for index in 0..document.nodes.len() {
        let id = NodeId(index as u32);
        let node = NodeRef { document, id };
        let mut into: Vec<Edge> = Vec::new();
        for entry in &document.nodes[index].fields {
            if let Some(connection) = &entry.connection
                && let Some(kind) = field_type(node, entry.index)
            {
                into.push(Edge {
                    from: document.node(connection.from).id,
                    output: connection.output.clone(),
                    slot: Slot::Field(entry.index, kind),
                    span: entry.span,
                });
            }
        }
        if !into.is_empty() {
            out.push((id, into));
        }
    }
    let mut places: HashMap<NodeId, usize> = out
        .iter()
        .enumerate()
        .map(|(i, (id, _))| (*id, i))
        .collect();
    for route in document.routes.iter().filter(|r| is_computed(document, r)) {
        let to = document.node(route.to);
        let Some(slot) = slot(to, &route.input) else {
            continue; // The target is a script or a class that is not drawn.
        };
        let edge = Edge {
            from: document.node(route.from).id,
            output: route.output.clone(),
            slot,
            span: to.span(),
        };
        let place = *places.entry(to.id).or_insert_with(|| {
            out.push((to.id, Vec::new()));
            out.len() - 1
        });
        out[place].1.push(edge);
    }
    out
}

/// Returns whether the value of a route is computed on request, because it comes from an Inventor
/// engine or from a node that moves by itself. The other routes carry events.
pub(crate) fn is_computed(document: &Document, route: &Route) -> bool {
    let class = document.node(route.from).class();
    class.is_some_and(|c| {
        c.is_a("Engine") || matches!(c.id, class::ROTOR | class::PENDULUM | class::SHUTTLE)
    })
}

/// Returns the type of a field.
pub(crate) fn field_type(node: NodeRef<'_>, index: u16) -> Option<FieldType> {
    let index = usize::from(index);
    match node.data().class {
        ClassRef::Known(id) => id.get().fields.get(index).map(|f| f.kind),
        ClassRef::Extension(i) => {
            let fields = &node.document.extensions[i as usize].fields;
            fields.get(index).map(|f| f.1)
        }
    }
}

/// Returns the field or input that a route's `TO` names. The prefix `set_` of a field's name is
/// optional.
pub fn slot(node: NodeRef<'_>, name: &str) -> Option<Slot> {
    let class = node.class()?;
    let short = name.strip_prefix("set_").unwrap_or(name);
    let field = class.field(name).or_else(|| class.field(short));
    if let Some((index, decl)) = field {
        return Some(Slot::Field(index as u16, decl.kind));
    }
    let input = class.inputs.iter().find(|(n, _)| *n == name || *n == short);
    input.map(|&(name, kind)| Slot::Input(name, kind))
}

/// Sorts nodes topologically by a depth-first search without recursion. Returns the indices of the
/// nodes, each after the nodes that it takes values from, and the edges (index of the node, number
/// of the edge) that are left out because they close a cycle.
pub(super) fn sorted(edges: &[(NodeId, Vec<Edge>)]) -> (Vec<usize>, HashSet<(usize, usize)>) {
    #[derive(Clone, Copy, PartialEq)]
    enum EdgeMark {
        New,
        Open,
        Done,
    }
    let places: HashMap<NodeId, usize> = edges
        .iter()
        .enumerate()
        .map(|(i, (id, _))| (*id, i))
        .collect();
    let mut marks = vec![EdgeMark::New; edges.len()];
    let mut order = Vec::with_capacity(edges.len());
    let mut cut = HashSet::new();
    for start in 0..edges.len() {
        if marks[start] != EdgeMark::New {
            continue;
        }
        marks[start] = EdgeMark::Open;
        let mut stack = vec![(start, 0)];
        while let Some((place, next)) = stack.last_mut() {
            let (place, which) = (*place, *next);
            let Some(edge) = edges[place].1.get(which) else {
                marks[place] = EdgeMark::Done;
                order.push(place);
                stack.pop();
                continue;
            };
            *next += 1;
            if let Some(&from) = places.get(&edge.from) {
                match marks[from] {
                    EdgeMark::New => {
                        marks[from] = EdgeMark::Open;
                        stack.push((from, 0));
                    }
                    EdgeMark::Open => {
                        cut.insert((place, which));
                    }
                    EdgeMark::Done => {}
                }
            }
        }
    }
    (order, cut)
}
