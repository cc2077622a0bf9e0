//! The routes of a scene by the event that they carry.

use std::collections::HashMap;
use std::sync::LazyLock;

use indexmap::IndexSet;

use crate::iv::{Document, NodeId, NodeRef, Route};
use crate::snapshot::engines::edges::is_computed;

/// An event of a node: the node and the event's name.
pub(super) type End = (NodeId, Box<str>);

/// The routes, which a scene can change while it plays.
#[derive(Debug, Default)]
pub struct Wires {
    targets: HashMap<End, IndexSet<End>>,
}

impl Wires {
    /// Returns the routes of a document that carry events.
    pub(super) fn of(document: &Document) -> Self {
        let mut wires = Self::default();
        wires.extend(document, &document.routes);
        wires
    }

    /// Adds the routes of a list that carry events.
    pub fn extend(&mut self, document: &Document, routes: &[Route]) {
        for route in routes.iter().filter(|r| !is_computed(document, r)) {
            let from = document.node(route.from);
            let end = (from.id, output_name(from, &route.output).into());
            self.add(end, (document.node(route.to).id, route.input.clone()));
        }
    }

    /// Adds a route. A route that exists already stays one route (VRML97, 4.10.2).
    pub fn add(&mut self, from: End, to: End) {
        self.targets.entry(from).or_default().insert(to);
    }

    /// Removes a route.
    pub fn remove(&mut self, from: &End, to: &End) {
        if let Some(targets) = self.targets.get_mut(from) {
            targets.retain(|t| t != to);
        }
    }

    /// Returns the targets of an event, in the order in which the routes were added.
    pub(super) fn targets(&self, from: &End) -> impl Iterator<Item = &End> {
        static NONE: LazyLock<IndexSet<End>> = LazyLock::new(IndexSet::default);
        self.targets.get(from).unwrap_or(&NONE).iter()
    }

    /// Returns whether routes lead from certain events to certain nodes, directly or through other
    /// nodes.
    pub(super) fn lead(&self, from: impl Fn(&End) -> bool, to: impl Fn(NodeId) -> bool) -> bool {
        let mut next: HashMap<NodeId, Vec<NodeId>> = HashMap::new();
        let mut open = Vec::new();
        for (end, targets) in &self.targets {
            let targets = targets.iter().map(|(node, _)| *node);
            if from(end) {
                open.extend(targets.clone());
            }
            next.entry(end.0).or_default().extend(targets);
        }
        while let Some(node) = open.pop() {
            if to(node) {
                return true;
            }
            // A node that is removed is not visited again.
            open.extend(next.remove(&node).unwrap_or_default());
        }
        false
    }

    /// Returns whether there are no routes.
    pub(super) fn is_empty(&self) -> bool {
        self.targets.is_empty()
    }
}

/// Returns the one name of an output that has several: an `exposedField` sends `x_changed`, which a
/// file may also call `x`. A script's outputs have only one name.
pub(super) fn output_name<'a>(node: NodeRef<'_>, name: &'a str) -> &'a str {
    let Some(class) = node.class() else {
        return name;
    };
    let is_output = |name: &str| class.outputs.iter().any(|(n, _)| *n == name);
    let short = name.strip_suffix("_changed").unwrap_or(name);
    if class.field(name).is_none()
        && !is_output(name)
        && (class.field(short).is_some() || is_output(short))
    {
        short
    } else {
        name
    }
}
