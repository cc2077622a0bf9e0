//! The facts about a scene that a photograph needs before the scene is compiled.

use ivcam_base::diag::Diagnostic;
use ivcam_inventor::grammar::{class, navigation_info};
use ivcam_inventor::iv::{Limits, NodeRef};
use ivcam_inventor::pose::CameraPose;
use ivcam_inventor::snapshot::Snapshot;
use ivcam_inventor::traversal::role::{Role, role};
use ivcam_inventor::traversal::state::State;
use ivcam_inventor::traversal::{
    self, Instance, LaterCamera, Leading, Visitor, WalkOptions, first_pose,
};
use ivcam_render::scene::model::Place;

/// The camera, lights and navigation settings of a scene.
#[derive(Default)]
pub(crate) struct Overview {
    /// The first camera.
    pub camera: Option<CameraPose>,
    /// Whether a shape is lit by a light of the scene.
    pub has_light: bool,
    /// The field `headlight` of the first `NavigationInfo`, of VRML97 or in a file of VRML 1.0.
    pub navigation_info: Option<bool>,
    /// That node, if it states the field.
    pub headlight_node: Option<Place>,
    /// The warning that a camera after the first acts on shapes.
    pub later_camera: Option<Box<Diagnostic>>,
    /// What the walk left out.
    pub diagnostics: Vec<Diagnostic>,
}

impl Overview {
    /// Traverses a scene within limits and collects the facts.
    pub(crate) fn of(snapshot: &Snapshot<'_>, limits: &Limits) -> Self {
        let is_told = |node: NodeRef<'_>| {
            let role = role(node);
            matches!(role, Role::Camera | Role::Light) || is_navigation_info(node)
        };
        let mut collector = OverviewCollector {
            overview: Self::default(),
            cameras: LaterCamera::default(),
            leading: Leading::to(snapshot.document(), is_told),
        };
        traversal::walk(snapshot, &WalkOptions::within(limits), &mut collector);
        collector.overview
    }
}

/// Collects the facts, and skips the parts of the scene without any.
struct OverviewCollector {
    overview: Overview,
    cameras: LaterCamera,
    leading: Leading,
}

impl<'a> Visitor<'a> for OverviewCollector {
    fn shape(&mut self, _: NodeRef<'a>, state: &State<'a>) {
        self.overview.has_light |= !state.lights.is_empty();
        let found = self.cameras.at_shape(state);
        self.overview.later_camera = self.overview.later_camera.take().or(found);
    }

    fn instance(&mut self, part: Instance<'a>, state: &State<'a>) -> bool {
        let tells_light = !self.overview.has_light && !state.lights.is_empty();
        !tells_light && !self.leading.is_in(part)
    }

    fn camera(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        self.cameras.at_camera(node);
        if self.overview.camera.is_none() {
            self.overview.camera = first_pose(node, state);
        }
    }

    fn report(&mut self, diagnostic: Box<Diagnostic>) {
        self.overview.diagnostics.push(*diagnostic);
    }

    fn bindable(&mut self, node: NodeRef<'a>, _: &State<'a>) {
        if is_navigation_info(node) && self.overview.navigation_info.is_none() {
            self.overview.navigation_info = Some(node.get(navigation_info::HEADLIGHT));
            let is_stated = node.states(navigation_info::HEADLIGHT);
            self.overview.headlight_node = is_stated.then(|| Place::of(node));
        }
    }
}

/// Returns whether a node is a `NavigationInfo`, which files of VRML 1.0 have too.
fn is_navigation_info(node: NodeRef<'_>) -> bool {
    let classes = [class::NAVIGATION_INFO, class::VRML97_NAVIGATION_INFO];
    node.class_id().is_some_and(|id| classes.contains(&id))
}
