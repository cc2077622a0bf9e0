//! What is under the pointer: the nearest shape, and the sensors that act for it.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::{DMat4, DVec3};

use super::picker::{ShapeHit, ShapePicker};
use crate::grammar::{class, vrml_sensor};
use crate::iv::{Document, NodeId, NodeRef};
use crate::pose::{CameraPose, ViewRay};
use crate::snapshot::{Corners, Snapshot};
use crate::traversal::{State, Visitor, WalkOptions, walk};

/// A node that acts for a shape, and the transform from its space to the world.
pub(super) type TargetNode = (NodeId, DMat4);

/// The nearest shape on a ray.
#[derive(Clone, Debug)]
pub(super) struct PointerHit {
    /// The point.
    pub surface: ShapeHit,
    /// The shape, and the nodes above it from the root.
    pub path: Vec<NodeId>,
    /// The enabled sensors and the `Anchor` of the lowest group that has any (ISO 14772-1,
    /// 4.6.7.3).
    pub targets: Vec<TargetNode>,
}

/// What a search with the pointer finds.
#[derive(Debug, Default)]
pub(super) struct PointerFound {
    pub hit: Option<PointerHit>,
    /// All pointing-device sensors, where they come first.
    pub sensors: Vec<TargetNode>,
}

/// What the pointer acts on at a place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PointerTarget {
    /// The name of a sensor or an `Anchor`, which is empty if it has none.
    pub name: String,
    /// Its class.
    pub class: &'static str,
    /// Whether it is dragged, and not only touched.
    pub is_dragged: bool,
}

impl PointerTarget {
    /// Returns what acts for the nearest shape on a ray, in a document as events have left it at a
    /// time in seconds. Of several, a sensor that is dragged comes first.
    pub fn find(
        document: &Document,
        now: f64,
        viewer: &CameraPose,
        ray: &ViewRay,
        picker: &Arc<dyn ShapePicker>,
    ) -> Option<Self> {
        let world = PointerWorld {
            document,
            now,
            viewer,
            picker,
        };
        let hit = world.search(ray, None).hit?;
        let targets = hit.targets.iter().filter_map(|(id, _)| {
            let node = document.node(*id);
            let class = node.class()?;
            Some(Self {
                name: node.data().name.as_deref().unwrap_or_default().to_owned(),
                class: class.name,
                is_dragged: !matches!(class.id, class::ANCHOR | class::TOUCH_SENSOR),
            })
        });
        targets.min_by_key(|target| !target.is_dragged)
    }

    /// Returns whether a document has a node that acts for the pointer.
    pub fn exist_in(document: &Document) -> bool {
        let mut nodes = (0..document.nodes.len() as u32).map(|i| document.node(NodeId(i)));
        nodes.any(|node| is_sensor(node) || node.class_id() == Some(class::ANCHOR))
    }
}

/// A document that is searched, as a viewer sees it.
pub(super) struct PointerWorld<'d> {
    pub document: &'d Document,
    pub now: f64,
    pub viewer: &'d CameraPose,
    pub picker: &'d Arc<dyn ShapePicker>,
}

impl PointerWorld<'_> {
    /// Finds the nearest shape on a ray. If there is a list, only shapes below its nodes count.
    pub(super) fn search(&self, ray: &ViewRay, only: Option<&BTreeSet<NodeId>>) -> PointerFound {
        let mut search = PointerSearch {
            picker: &**self.picker,
            ray,
            only,
            levels: vec![Level::default()],
            found: PointerFound::default(),
        };
        self.walk(&mut search);
        search.leave();
        search.found
    }

    /// Returns the middle of the bounding box of the shapes below some nodes.
    pub(super) fn middle(&self, only: Option<&BTreeSet<NodeId>>) -> Option<DVec3> {
        let mut search = MiddleSearch {
            picker: &**self.picker,
            only,
            path: Vec::new(),
            bounds: None,
        };
        self.walk(&mut search);
        search.bounds.map(|(low, high)| 0.5 * (low + high))
    }

    fn walk<'v>(&self, visitor: &mut impl for<'a> Visitor<'a>) {
        let snapshot = Snapshot::of_part(self.document, self.now);
        let options = WalkOptions {
            camera: Some(self.viewer.clone()),
            ..WalkOptions::default()
        };
        walk(&snapshot, &options, visitor);
    }
}

/// Returns whether a node is a pointing-device sensor.
pub(super) fn is_sensor(node: NodeRef<'_>) -> bool {
    matches!(
        node.class_id(),
        Some(
            class::TOUCH_SENSOR
                | class::PLANE_SENSOR
                | class::CYLINDER_SENSOR
                | class::SPHERE_SENSOR
        )
    )
}

/// A node on the path of the walk.
#[derive(Default)]
struct Level {
    node: Option<NodeId>,
    /// What acts for the shapes below this node.
    targets: Vec<TargetNode>,
    /// Whether the nearest shape so far is below this node, and nothing lower acts for it.
    waits: bool,
}

struct PointerSearch<'p> {
    picker: &'p dyn ShapePicker,
    ray: &'p ViewRay,
    only: Option<&'p BTreeSet<NodeId>>,
    levels: Vec<Level>,
    found: PointerFound,
}

impl<'a> Visitor<'a> for PointerSearch<'_> {
    fn shape(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        let above = self.levels.iter().filter_map(|level| level.node);
        let path: Vec<NodeId> = above.chain([node.id]).collect();
        if !counts(self.only, &path) {
            return;
        }
        let Some(surface) = self.picker.hit(node, state, self.ray) else {
            return;
        };
        let nearest = self.found.hit.as_ref();
        // Of shapes in one plane the last drawn is seen.
        if nearest.is_some_and(|hit| hit.surface.distance < surface.distance) {
            return;
        }
        self.levels.iter_mut().for_each(|level| level.waits = false);
        if let Some(level) = self.levels.last_mut() {
            level.waits = true;
        }
        self.found.hit = Some(PointerHit {
            surface,
            path,
            targets: Vec::new(),
        });
    }

    fn enter(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        let is_anchor = node.class_id() == Some(class::ANCHOR);
        let own = is_anchor.then_some((node.id, state.world_from_object));
        self.levels.push(Level {
            node: Some(node.id),
            targets: own.into_iter().collect(),
            waits: false,
        });
    }

    fn leave(&mut self) {
        let Some(level) = self.levels.pop() else {
            return;
        };
        if !level.waits {
            return;
        }
        match (&mut self.found.hit, self.levels.last_mut()) {
            (Some(hit), _) if !level.targets.is_empty() => hit.targets = level.targets,
            (_, Some(above)) => above.waits = true,
            _ => {}
        }
    }

    fn sensor(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        if !is_sensor(node) {
            return;
        }
        let target = (node.id, state.world_from_object);
        self.found.sensors.push(target);
        if let Some(level) = self.levels.last_mut()
            && node.get(vrml_sensor::ENABLED)
        {
            level.targets.push(target);
        }
    }
}

struct MiddleSearch<'p> {
    picker: &'p dyn ShapePicker,
    only: Option<&'p BTreeSet<NodeId>>,
    path: Vec<NodeId>,
    bounds: Option<Corners>,
}

impl<'a> Visitor<'a> for MiddleSearch<'_> {
    fn shape(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        self.path.push(node.id);
        if counts(self.only, &self.path)
            && let Some((low, high)) = self.picker.bounds(node, state)
        {
            let all = self.bounds.get_or_insert((low, high));
            *all = (all.0.min(low), all.1.max(high));
        }
        self.path.pop();
    }

    fn enter(&mut self, node: NodeRef<'a>, _: &State<'a>) {
        self.path.push(node.id);
    }

    fn leave(&mut self) {
        self.path.pop();
    }
}

/// Returns whether the shape at the end of a path is below one of some nodes, or is one.
fn counts(only: Option<&BTreeSet<NodeId>>, path: &[NodeId]) -> bool {
    only.is_none_or(|only| path.iter().any(|node| only.contains(node)))
}
