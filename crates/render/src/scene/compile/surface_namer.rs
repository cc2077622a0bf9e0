//! Names the objects and the materials of a scene while it is walked.
//!
//! An object is a shape. Its name is the path of the named nodes that contain it, joined by `/`,
//! and its own name after them. A shape without a name has that of its class with its number among
//! the document's nodes of the class, as in `Cube.3`; in a named `Shape` of VRML97 nothing is added
//! to that node's name. A material has the name of its node or, if it has none, of its
//! `Appearance`, else class and number.

use std::collections::HashMap;

use ivcam_inventor::iv::{Document, NodeId, NodeRef};
use ivcam_inventor::traversal::role::{Role, role};
use ivcam_inventor::traversal::state::State;

use crate::scene::surface_names::SurfaceNames;

/// The name of the material of a shape that no material node precedes.
const DEFAULT_MATERIAL: &str = "default";

/// A node that the walk has entered.
struct EnteredNode<'a> {
    name: Option<&'a str>,
    /// Whether it is a VRML97 `Shape`.
    is_shape: bool,
}

/// Names surfaces by the nodes that the walk has entered.
pub(super) struct SurfaceNamer<'a> {
    document: &'a Document,
    /// The entered nodes, the outermost first.
    path: Vec<EnteredNode<'a>>,
    /// The first node of the path that counts: names in a part that is stored once begin with the
    /// part, because it is at several places.
    first: usize,
    /// The number of each node among those of its class, from 1.
    numbers: Vec<u32>,
    names: SurfaceNames,
}

impl<'a> SurfaceNamer<'a> {
    pub(super) fn new(document: &'a Document) -> Self {
        let mut counts: HashMap<&str, u32> = HashMap::new();
        let number = |id| {
            let count = counts.entry(document.node(id).class_name()).or_default();
            *count += 1;
            *count
        };
        Self {
            document,
            path: Vec::new(),
            first: 0,
            numbers: (0..document.nodes.len() as u32)
                .map(NodeId)
                .map(number)
                .collect(),
            names: SurfaceNames::default(),
        }
    }

    pub(super) fn enter(&mut self, node: NodeRef<'a>) {
        self.path.push(EnteredNode {
            name: node.data().name.as_deref(),
            is_shape: role(node) == Role::AppearanceAndGeometry,
        });
    }

    pub(super) fn leave(&mut self) {
        self.path.pop();
    }

    /// Begins a part that is stored once, whose names begin with the part. Returns what
    /// [`SurfaceNamer::end_part`] needs.
    pub(super) fn begin_part(&mut self) -> (usize, usize) {
        (
            std::mem::replace(&mut self.first, self.path.len()),
            self.path.len(),
        )
    }

    /// Ends a part, whose walk may have been broken off.
    pub(super) fn end_part(&mut self, (first, length): (usize, usize)) {
        self.first = first;
        self.path.truncate(length);
    }

    /// Names the surfaces of a shape, which have the numbers from `from` to before `to`.
    pub(super) fn name(&mut self, range: (usize, usize), shape: NodeRef<'_>, state: &State<'_>) {
        let path = self.path.get(self.first..).unwrap_or_default();
        let mut words: Vec<&str> = path.iter().filter_map(|node| node.name).collect();
        let is_named = |node: &EnteredNode<'_>| node.is_shape && node.name.is_some();
        let own = self.own_name(shape);
        if shape.data().name.is_some() || !path.last().is_some_and(is_named) {
            words.push(&own);
        }
        let object = words.join("/");
        let material = state.material_node.map(|node| self.own_name(node));
        let material = material.unwrap_or_else(|| DEFAULT_MATERIAL.to_owned());
        self.names.set(range, object, material);
    }

    /// Returns the names, with those of the surfaces that were added after the walk.
    pub(super) fn finish(mut self, walked: usize, all: usize, class: &str) -> SurfaceNames {
        if all > walked {
            let name = || class.to_owned();
            self.names.set((walked, all), name(), name());
        }
        self.names
    }

    /// The name of a node, or else its class and its number. A default part of a node kit is in a
    /// document of its own and has no number.
    fn own_name(&self, node: NodeRef<'_>) -> String {
        let class = node.class_name();
        match &node.data().name {
            Some(name) => name.to_string(),
            None if std::ptr::eq(node.document, self.document) => {
                format!("{class}.{}", self.numbers[node.id.0 as usize])
            }
            None => class.to_owned(),
        }
    }
}
