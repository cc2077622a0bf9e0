//! Finds the first camera of a scene.

use super::leading::Leading;
use super::role::{Role, role};
use super::state::State;
use super::visitor::{Instance, Visitor, WalkOptions};
use super::walk::walk;
use crate::iv::NodeRef;
use crate::pose::CameraPose;
use crate::snapshot::Snapshot;

/// Returns the first camera in the order of traversal.
pub fn first_camera(snapshot: &Snapshot<'_>, options: &WalkOptions) -> Option<CameraPose> {
    let is_camera = |node: NodeRef<'_>| role(node) == Role::Camera;
    let mut search = CameraSearch {
        found: None,
        leading: Leading::to(snapshot.document(), is_camera),
    };
    walk(snapshot, options, &mut search);
    search.found
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
        let pose = CameraPose::from_node(node, state.world_from_object);
        self.found = self.found.take().or(pose);
    }

    fn is_full(&self) -> bool {
        self.found.is_some()
    }
}
