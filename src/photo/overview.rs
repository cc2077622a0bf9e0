//! The facts about a scene that a photograph needs before the scene is compiled.

use crate::grammar::{class, vrml97_navigation_info};
use crate::iv::NodeRef;
use crate::pose::CameraPose;
use crate::snapshot::Snapshot;
use crate::traversal::role::Role;
use crate::traversal::state::State;
use crate::traversal::{self, Visitor, WalkOptions};

/// The camera, lights and navigation settings of a scene.
#[derive(Default)]
pub(super) struct Overview {
    /// The first camera.
    pub camera: Option<CameraPose>,
    /// Whether a shape is lit by a light of the scene.
    pub has_light: bool,
    /// The field `headlight` of the first VRML 97 `NavigationInfo`.
    pub navigation_info: Option<bool>,
}

impl Overview {
    /// Traverses a scene and collects the facts.
    pub(super) fn of(snapshot: &Snapshot<'_>) -> Self {
        let mut overview = Self::default();
        traversal::walk(snapshot, &WalkOptions::default(), &mut overview);
        overview
    }
}

impl<'a> Visitor<'a> for Overview {
    fn shape(&mut self, _: NodeRef<'a>, state: &State<'a>) {
        self.has_light |= !state.lights.is_empty();
    }

    fn camera(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        if self.camera.is_none() {
            self.camera = CameraPose::from_node(node, state.world_from_object);
        }
    }

    fn node(&mut self, node: NodeRef<'a>, _: Role) {
        let is_info = node.class_id() == Some(class::VRML97_NAVIGATION_INFO);
        if is_info && self.navigation_info.is_none() {
            self.navigation_info = Some(node.get(vrml97_navigation_info::HEADLIGHT));
        }
    }
}

/// Returns the first camera in the order of traversal.
pub(super) fn first_camera(snapshot: &Snapshot<'_>) -> Option<CameraPose> {
    Overview::of(snapshot).camera
}
