//! The order in which to declare the protos of a document.

use std::collections::{HashMap, HashSet};

use crate::grammar::value::{NodeId, Value};
use crate::iv::declarations::Proto;
use crate::iv::document::{ClassRef, Document};

/// Returns the indices of the file's own protos, grouped by the proto whose body declares them.
/// Each proto comes after the protos that it uses.
pub(super) fn protos_by_body(document: &Document) -> HashMap<Option<usize>, Vec<usize>> {
    let order = proto_order(document);
    let written: HashSet<usize> = order.iter().copied().collect();
    let mut within: HashMap<Option<usize>, Vec<usize>> = HashMap::new();
    for place in order {
        let around = document.protos.list[place].within;
        let around = around.filter(|p| written.contains(p));
        within.entry(around).or_default().push(place);
    }
    within
}

/// Returns the indices of the file's own protos, each after those that its body has instances of.
fn proto_order(document: &Document) -> Vec<usize> {
    let own = |p: &Proto| document.nodes[p.defaults.0 as usize].source == 0;
    let mut order = Vec::new();
    for (i, proto) in document.protos.list.iter().enumerate() {
        if !own(proto) && !proto.external {
            continue;
        }
        let mut stack = vec![(i, false)];
        while let Some((i, ready)) = stack.pop() {
            if order.contains(&i) {
                continue;
            }
            if ready {
                order.push(i);
                continue;
            }
            stack.push((i, true));
            if !document.protos.list[i].external {
                stack.extend(instances_in(document, i).into_iter().map(|k| (k, false)));
            }
        }
    }
    order
}

/// Returns the extensions of the protos that have instances. A node that holds the defaults of a
/// proto does not count as an instance.
pub(super) fn instanced(document: &Document) -> HashSet<u32> {
    let defaults: HashSet<NodeId> = document.protos.list.iter().map(|p| p.defaults).collect();
    let ids = document.ids();
    let nodes = ids.filter(|id| !defaults.contains(id));
    nodes
        .filter_map(|id| match document.nodes[id.0 as usize].class {
            ClassRef::Extension(i) if document.protos.of_extension(i).is_some() => Some(i),
            _ => None,
        })
        .collect()
}

/// Returns the indices of the protos that a proto's body and defaults have instances of.
pub(super) fn instances_in(document: &Document, proto: usize) -> Vec<usize> {
    let proto = &document.protos.list[proto];
    let mut stack = proto.body.clone();
    stack.push(proto.defaults);
    let mut seen = HashSet::new();
    let mut out = Vec::new();
    while let Some(id) = stack.pop() {
        if !seen.insert(id) {
            continue;
        }
        let node = &document.nodes[id.0 as usize];
        if id != proto.defaults
            && let ClassRef::Extension(i) = node.class
        {
            out.extend(document.protos.of_extension(i));
        }
        stack.extend(targets(document, id));
    }
    out
}

/// Returns all nodes that a node refers to: children, field values and sources of connections.
pub(super) fn targets(document: &Document, id: NodeId) -> Vec<NodeId> {
    let node = &document.nodes[id.0 as usize];
    let mut out = node.children.clone();
    for field in &node.fields {
        match &field.value {
            Value::Node(Some(target)) => out.push(*target),
            Value::Nodes(targets) => out.extend(targets),
            _ => {}
        }
        out.extend(field.connection.iter().map(|c| c.from));
    }
    out
}
