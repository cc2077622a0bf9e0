//! Where a scene's sensors and viewpoints are at one moment.

use glam::DMat4;

use super::collision::hears_collisions;
use crate::grammar::class;
use crate::iv::{Document, NodeId, NodeRef};
use crate::pose::CameraPose;
use crate::snapshot::{BindableKind, Snapshot};
use crate::traversal::{Instance, Leading, State, Visitor, WalkOptions, walk};

/// The places of sensors and viewpoints, and the bindable nodes that come first.
#[derive(Debug, Default)]
pub(super) struct WorldSurvey {
    /// The first bindable node of each kind that is not in an inlined file.
    pub first: [Option<NodeId>; BindableKind::COUNT],
    /// The poses of the `Viewpoint`s.
    pub viewpoints: Vec<(NodeId, CameraPose)>,
    /// The sensors that depend on the viewer, each with the transform from its space to the world.
    /// A sensor that is used several times occurs as often.
    pub sensors: Vec<(NodeId, DMat4)>,
}

impl WorldSurvey {
    /// Looks at a scene at a time. `leading` finds what is looked for.
    pub(super) fn of(
        document: &Document,
        now: f64,
        viewer: Option<&CameraPose>,
        leading: &Leading,
    ) -> Self {
        let snapshot = Snapshot::of_part(document, now);
        let options = WalkOptions {
            camera: viewer.cloned(),
            ..WalkOptions::default()
        };
        let mut search = SurveyCollector {
            survey: Self::default(),
            leading,
        };
        walk(&snapshot, &options, &mut search);
        search.survey
    }

    /// Finds the nodes that lead to what is looked for.
    pub(super) fn leading(document: &Document) -> Leading {
        Leading::to(document, |node| {
            BindableKind::of(node).is_some() || is_viewer_sensor(node)
        })
    }
}

/// Returns whether a scene has sensors that depend on where the viewer is, or a route from a
/// `Collision`.
pub fn depends_on_viewer(document: &Document) -> bool {
    let mut nodes = document.ids();
    nodes.any(|id| is_viewer_sensor(NodeRef { document, id })) || hears_collisions(document)
}

/// Returns whether a node is a sensor that depends on the viewer.
pub(super) fn is_viewer_sensor(node: NodeRef<'_>) -> bool {
    matches!(
        node.class_id(),
        Some(class::PROXIMITY_SENSOR | class::VISIBILITY_SENSOR)
    )
}

struct SurveyCollector<'l> {
    survey: WorldSurvey,
    leading: &'l Leading,
}

impl SurveyCollector<'_> {
    fn meet(&mut self, node: NodeRef<'_>, state: &State<'_>) {
        if let Some(kind) = BindableKind::of(node)
            && state.bindables.include(node.id)
        {
            self.survey.first[kind as usize].get_or_insert(node.id);
        }
    }
}

impl<'a> Visitor<'a> for SurveyCollector<'_> {
    fn shape(&mut self, _: NodeRef<'a>, _: &State<'a>) {}

    fn instance(&mut self, part: Instance<'a>, _: &State<'a>) -> bool {
        !self.leading.is_in(part)
    }

    fn camera(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        self.meet(node, state);
        if let Some(pose) = CameraPose::from_node(node, state.world_from_object) {
            self.survey.viewpoints.push((node.id, pose));
        }
    }

    fn bindable(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        self.meet(node, state);
    }

    fn sensor(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        if is_viewer_sensor(node) {
            self.survey.sensors.push((node.id, state.world_from_object));
        }
    }
}
