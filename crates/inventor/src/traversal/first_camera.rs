//! Finds the first camera of a scene.

use ivcam_base::diag::Diagnostic;

use super::leading::Leading;
use super::role::{Role, role};
use super::state::{Bindables, Language, State};
use super::visitor::{Instance, Visitor, WalkOptions};
use super::walk::walk;
use crate::grammar::Class;
use crate::iv::{NodeId, NodeRef};
use crate::pose::CameraPose;
use crate::snapshot::Snapshot;

/// Returns the first camera in the order of traversal. The `Viewpoint`s of files that a VRML97
/// `Inline` names do not count (ISO 14772-1, 4.6.10).
pub fn first_camera(snapshot: &Snapshot<'_>, options: &WalkOptions) -> Option<CameraPose> {
    let is_camera = |node: NodeRef<'_>| role(node) == Role::Camera;
    let mut search = CameraSearch {
        found: None,
        leading: Leading::to(snapshot.document(), is_camera),
    };
    walk(snapshot, options, &mut search);
    search.found
}

/// Returns the pose of a camera from which a scene may be seen without a choice of it. A
/// `Viewpoint` must be bound, or be a candidate for the first one; the viewer may be elsewhere than
/// at a bound one.
pub fn first_pose(camera: NodeRef<'_>, state: &State<'_>) -> Option<CameraPose> {
    let is_viewpoint = camera.known_class().is_some_and(Class::is_vrml97);
    if is_viewpoint && !state.bindables.include(camera.id) {
        return None;
    }
    let mut pose = CameraPose::from_node(camera, state.world_from_object)?;
    if let Bindables::Bound(nodes) = state.bindables
        && is_viewpoint
    {
        nodes.place_viewer(&mut pose);
    }
    Some(pose)
}

/// Finds a camera by which SGI's library and Coin show shapes, though it is not the first, from
/// which the scene is seen here as in viewers. VRML has its own rules for viewpoints.
#[derive(Debug, Default)]
pub struct LaterCamera {
    first: Option<NodeId>,
    is_reported: bool,
}

impl LaterCamera {
    /// Returns a warning at the first shape that a camera other than the first acts on.
    pub fn at_shape(&mut self, state: &State<'_>) -> Option<Box<Diagnostic>> {
        let camera = state.camera?;
        let first = self.first?;
        let is_inventor = Language::of(camera.document) == Language::Inventor;
        if self.is_reported || camera.id == first || !is_inventor {
            return None;
        }
        self.is_reported = true;
        let class = camera.class_name();
        let message = format!(
            "the scene is seen from its first camera, but this `{class}` acts on its shapes"
        );
        let help = "`--camera` takes a file with a camera, or the text of its node";
        let warning = Diagnostic::warning(message).with_help(help);
        Some(match camera.source() {
            Some(source) => warning.at(source, camera.span()),
            None => warning,
        })
    }

    /// Notes a camera.
    pub fn at_camera(&mut self, camera: NodeRef<'_>) {
        self.first.get_or_insert(camera.id);
    }
}

/// Finds a camera, and skips the parts of the scene without one.
struct CameraSearch {
    found: Option<CameraPose>,
    leading: Leading,
}

impl<'a> Visitor<'a> for CameraSearch {
    fn shape(&mut self, _: NodeRef<'a>, _: &State<'a>) {}

    fn instance(&mut self, part: Instance<'a>, _: &State<'a>) -> bool {
        !self.leading.is_in(part)
    }

    fn camera(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        if self.found.is_none() {
            self.found = first_pose(node, state);
        }
    }

    fn is_full(&self) -> bool {
        self.found.is_some()
    }
}
