//! The handles of draggers and manipulators, for whoever asks to see them.
//!
//! A document is rewritten: beside each dragger comes a separator with the dragger's own motion and
//! its handles, and after each manipulator one that is scaled to surround what the manipulator
//! moves, as a `SurroundScale` does. Parts that the file gives the dragger (`translator`, `rotator`,
//! …) are drawn; a dragger without any gets the ones in `handles.iv`, which are ours. What shows
//! only while something is dragged is left out.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::survey::bounds_of;
use crate::diag::{Diagnostic, Result, Span};
use crate::grammar::{self, Class, Dialect, point_light, transform};
use crate::iv::nodes_in;
use crate::iv::{Document, FieldEntry, Limits, Loader, Node, NodeId, NodeRef, Value};
use crate::traversal::state::{Language, State};

/// The document with handles beside its draggers and manipulators.
pub fn with_handles(document: &Document) -> Document {
    let mut out = document.clone();
    let Some(ours) = take_in_ours(&mut out) else {
        return out;
    };
    let made: Vec<(NodeId, NodeId)> = (0..document.nodes.len())
        .filter_map(|index| {
            let node = document.node(NodeId(index as u32));
            Some((node.id, handles_of(node, &ours, &mut out)?))
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

/// No file is named by the handles' own.
#[derive(Debug)]
pub(super) struct NoFiles;

impl Loader for NoFiles {
    fn load(&self, _: &str, name: &str) -> Result<(String, Vec<u8>)> {
        Err(Diagnostic::error(format!("no file `{name}`")))
    }
}

/// Where the handles of a class begin, once they are part of a document.
struct Ours {
    document: Document,
    first: u32,
}

impl Ours {
    fn of(&self, class: &str) -> Option<NodeId> {
        let id = self.document.names.get(class)?;
        Some(NodeId(self.first + id.0))
    }
}

fn take_in_ours(into: &mut Document) -> Option<Ours> {
    let text = include_bytes!("handles.iv").to_vec();
    let limits = Limits::default();
    let document = Document::read("handles.iv", text, Arc::new(NoFiles), &limits).ok()?;
    let first = into.nodes.len() as u32;
    for node in &document.nodes {
        let mut node = node.clone();
        node.children.iter_mut().for_each(|id| id.0 += first);
        (node.name, node.span, node.source) = (None, Span::default(), 0);
        node.fields
            .iter_mut()
            .for_each(|f| f.span = Span::default());
        into.add(node);
    }
    Some(Ours { document, first })
}

/// A separator with the handles of a dragger or a manipulator; `None` for any other node.
fn handles_of(node: NodeRef<'_>, ours: &Ours, out: &mut Document) -> Option<NodeId> {
    let class = node.known_class()?;
    let (dragger, motion) = if let Some(kind) = class.name.strip_suffix("Manip") {
        (
            grammar::any(&format!("{kind}Dragger"))?,
            surround(node, kind),
        )
    } else if class.name.ends_with("Dragger") {
        (class, own_motion(node))
    } else {
        return None;
    };
    let mut children = vec![out.add(motion?)];
    children.extend(stated_parts(node, dragger));
    if children.len() == 1 {
        children.extend([ours.of("material")?, ours.of(dragger.name)?]);
    }
    Some(out.add(node_of("Separator", Vec::new(), children)?))
}

/// The parts that a file gives a dragger, those left out that show while it is dragged.
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
        .filter_map(|p| nodes_in(node, p.name).first().copied())
        .collect()
}

/// The motion that a dragger's fields state.
fn own_motion(node: NodeRef<'_>) -> Option<Node> {
    let fields = vec![
        entry("translation", Value::Vec3(node.get(transform::TRANSLATION)))?,
        entry("rotation", Value::Rotation(node.get(transform::ROTATION)))?,
        entry(
            "scaleFactor",
            Value::Vec3(node.get(transform::SCALE_FACTOR)),
        )?,
    ];
    node_of("Transform", fields, Vec::new())
}

/// The scale by which a manipulator's handles surround what comes after it in its group; lights'
/// stand where the light does.
fn surround(node: NodeRef<'_>, kind: &str) -> Option<Node> {
    if kind.ends_with("Light") {
        let at = node.find(point_light::LOCATION).unwrap_or(Vec3::ZERO);
        let fields = vec![entry("translation", Value::Vec3(at))?];
        return node_of("Transform", fields, Vec::new());
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
    let state = State::new(Language::Inventor);
    let (min, max) = after
        .filter_map(|list| bounds_of(node.document, list, state.clone()))
        .next()
        .unwrap_or((DVec3::NEG_ONE, DVec3::ONE));
    let half = 0.5 * (max - min);
    // What an `AntiSquish` in these manipulators makes of three scales.
    let scale = match kind {
        "HandleBox" | "TabBox" | "Transformer" => half,
        "Trackball" | "Centerball" => DVec3::splat(half.length() / 3f64.sqrt()),
        _ => DVec3::splat(half.max_element()),
    };
    let scale = scale.max(DVec3::splat(1e-6 * half.max_element().max(1e-6)));
    let fields = vec![
        entry("translation", Value::Vec3((0.5 * (min + max)).as_vec3()))?,
        entry("scaleFactor", Value::Vec3(scale.as_vec3()))?,
    ];
    node_of("Transform", fields, Vec::new())
}

fn entry(field: &str, value: Value) -> Option<FieldEntry> {
    FieldEntry::made(grammar::by_name("Transform", Dialect::IV2)?, field, value)
}

fn node_of(class: &str, fields: Vec<FieldEntry>, children: Vec<NodeId>) -> Option<Node> {
    let class = grammar::by_name(class, Dialect::IV2)?;
    Some(Node::made(class, fields, children))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{CompileOptions, RenderScene};

    fn bounds(text: &str) -> Option<(DVec3, DVec3)> {
        let text = format!("#Inventor V2.1 ascii\n{text}").into_bytes();
        let document = Document::read("a.iv", text, Arc::new(NoFiles), &Limits::default());
        let options = CompileOptions {
            handles: true,
            ..CompileOptions::default()
        };
        RenderScene::survey(&document.expect("reads"), &options).bounds
    }

    #[test]
    fn every_dragger_of_the_catalogue_has_handles() {
        for class in grammar::CLASSES
            .iter()
            .filter(|c| c.name.ends_with("Dragger"))
        {
            if class.treatment != grammar::Treatment::Abstract && class.name != "Dragger" {
                assert!(
                    bounds(&format!("{} {{ }}", class.name)).is_some(),
                    "{}",
                    class.name
                );
            }
        }
    }

    #[test]
    fn a_dragger_s_handles_move_with_it_and_nothing_else_does() {
        let (min, max) = bounds("Translate1Dragger { translation 10 0 0 } Cube { }").expect("both");
        assert!((min.x + 1.0).abs() < 1e-5 && (max.x - 11.5).abs() < 1e-5);
    }

    #[test]
    fn a_manipulator_s_handles_surround_what_it_moves() {
        let (min, max) = bounds(
            "Separator { HandleBoxManip { } Translation { translation 3 0 0 } Cube { width 4 } }",
        )
        .expect("both");
        assert!(
            min.x < 1.0 && min.x > 0.0 && max.x > 5.0 && max.x < 6.5,
            "{min} {max}"
        );
    }

    #[test]
    fn a_part_in_the_file_takes_the_place_of_the_usual_handles() {
        let (min, _) =
            bounds("Translate1Dragger { translator Sphere { radius 7 } }").expect("a ball");
        assert!((min.x + 7.0).abs() < 1e-5);
    }
}
