//! Adds handles after the draggers and manipulators of a document.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use ivcam_base::diag::Span;

use crate::grammar::{self, Class, Field, class, point_light, transform};
use crate::iv::{Document, FieldEntry, Limits, NoFiles, Node, NodeId, NodeRef, Value};
use crate::snapshot::at_time::Snapshot;
use crate::snapshot::bounds::{Bounds, Corners};

/// Returns the document with handles for its draggers and manipulators.
pub(crate) fn with_handles(snapshot: &Snapshot<'_>, bounds: &dyn Bounds) -> Document {
    let document = snapshot.document();
    let mut out = document.clone();
    let Some(library) = Library::add_to(&mut out) else {
        return out;
    };
    let around = |nodes: &[NodeId]| bounds.of_nodes(snapshot, nodes);
    let made: Vec<(NodeId, NodeId)> = (0..document.nodes.len())
        .filter_map(|index| {
            let node = document.node(NodeId(index as u32));
            Some((node.id, handles_of(node, &around, &library, &mut out)?))
        })
        .collect();
    let lists = out.nodes.iter_mut().map(|n| &mut n.children);
    for list in lists.chain(std::iter::once(&mut out.roots)) {
        for (node, handles) in &made {
            if let Some(place) = list.iter().position(|id| id == node) {
                list.insert(place + 1, *handles);
            }
        }
    }
    out
}

/// The default handles of each class, after they have been added to a document.
struct Library {
    document: Document,
    /// The index of the first added node.
    first: u32,
}

impl Library {
    fn add_to(document: &mut Document) -> Option<Self> {
        let text = include_bytes!("handles.iv").to_vec();
        let limits = Limits::default();
        let library = Document::read("handles.iv", text, Arc::new(NoFiles), &limits).ok()?;
        let first = document.nodes.len() as u32;
        for node in &library.nodes {
            let mut node = node.clone();
            node.children.iter_mut().for_each(|id| id.0 += first);
            (node.name, node.span, node.source) = (None, Span::default(), 0);
            node.fields
                .iter_mut()
                .for_each(|f| f.span = Span::default());
            document.add(node);
        }
        Some(Self {
            document: library,
            first,
        })
    }

    fn get(&self, class: &str) -> Option<NodeId> {
        let id = self.document.names.get(class)?;
        Some(NodeId(self.first + id.0))
    }
}

/// Returns the bounding box of consecutive nodes.
type HandleBox<'a> = &'a dyn Fn(&[NodeId]) -> Option<Corners>;

/// Adds a separator with the handles of a dragger or manipulator. Returns `None` for other nodes.
fn handles_of(
    node: NodeRef<'_>,
    around: HandleBox<'_>,
    library: &Library,
    out: &mut Document,
) -> Option<NodeId> {
    let class = node.known_class()?;
    let (dragger, motion) = if let Some(kind) = class.name.strip_suffix("Manip") {
        (
            grammar::any(&format!("{kind}Dragger"))?,
            surround(node, kind, around),
        )
    } else if class.name.ends_with("Dragger") {
        (class, own_motion(node))
    } else {
        return None;
    };
    let mut children = vec![out.add(motion)];
    children.extend(stated_parts(node, dragger));
    if children.len() == 1 {
        children.extend([library.get("material")?, library.get(dragger.name)?]);
    }
    Some(out.add(Node::synthetic(
        class::SEPARATOR.get(),
        Vec::new(),
        children,
    )))
}

/// Returns the parts of a dragger that a file states, without those that are visible only during
/// dragging.
fn stated_parts(node: NodeRef<'_>, dragger: &Class) -> Vec<NodeId> {
    let shown = |name: &str| {
        let passing = [
            "Active",
            "Switch",
            "Sep",
            "Separator",
            "Group",
            "Scale",
            "Squish",
            "List",
        ];
        !passing.iter().any(|end| name.ends_with(end)) && !name.contains("Feedback")
    };
    let parts = dragger.parts.iter().filter(|p| shown(p.name));
    parts
        .filter_map(|p| node.nodes_named(p.name).first().copied())
        .collect()
}

/// Returns a transform with the motion that a dragger's fields state.
fn own_motion(node: NodeRef<'_>) -> Node {
    transform(vec![
        entry(
            transform::TRANSLATION,
            Value::Vec3(node.get(transform::TRANSLATION)),
        ),
        entry(
            transform::ROTATION,
            Value::Rotation(node.get(transform::ROTATION)),
        ),
        entry(
            transform::SCALE_FACTOR,
            Value::Vec3(node.get(transform::SCALE_FACTOR)),
        ),
    ])
}

/// Returns the transform with which a manipulator's handles surround the nodes after it in its
/// group. The handles of a light are at its location.
fn surround(node: NodeRef<'_>, kind: &str, around: HandleBox<'_>) -> Node {
    if kind.ends_with("Light") {
        let at = node.find(point_light::LOCATION).unwrap_or(Vec3::ZERO);
        return transform(vec![entry(transform::TRANSLATION, Value::Vec3(at))]);
    }
    let nodes = &node.document.nodes;
    let lists = nodes
        .iter()
        .map(|n| &n.children)
        .chain(std::iter::once(&node.document.roots));
    let after = lists.filter_map(|list| {
        let place = list.iter().position(|id| *id == node.id)?;
        Some(&list[place + 1..])
    });
    let (min, max) = after
        .filter_map(around)
        .next()
        .unwrap_or((DVec3::NEG_ONE, DVec3::ONE));
    let half = 0.5 * (max - min);
    // The result of the `AntiSquish` in these manipulators for three different scales.
    let scale = match kind {
        "HandleBox" | "TabBox" | "Transformer" => half,
        "Trackball" | "Centerball" => DVec3::splat(half.length() / 3f64.sqrt()),
        _ => DVec3::splat(half.max_element()),
    };
    let scale = scale.max(DVec3::splat(1e-6 * half.max_element().max(1e-6)));
    let center = (0.5 * (min + max)).as_vec3();
    transform(vec![
        entry(transform::TRANSLATION, Value::Vec3(center)),
        entry(transform::SCALE_FACTOR, Value::Vec3(scale.as_vec3())),
    ])
}

fn entry<T: ?Sized>(field: Field<T>, value: Value) -> FieldEntry {
    FieldEntry::new(field.index, value, Span::default())
}

fn transform(fields: Vec<FieldEntry>) -> Node {
    Node::synthetic(class::TRANSFORM.get(), fields, Vec::new())
}
