//! The cameras: the viewpoint that is bound first, and the others in a switch.

use ivcam_inventor::grammar::value::{NodeId, Value};
use ivcam_inventor::iv::Limits;
use ivcam_inventor::pose::{CameraPose, Projection};
use ivcam_inventor::snapshot::Snapshot;
use ivcam_render::scene::model::{Model, Motion, Place, SceneCamera};

use crate::export::clipping::SceneSphere;
use crate::export::losses::Losses;
use crate::export::nodes::{NodeBuilder, rotation, vec3};
use crate::photo::overview::Overview;

/// The name of the kind of loss about the headlight.
const HEADLIGHT: &str = "headlight";

/// What a VRML97 scene says about its viewer, which the model does not hold.
#[derive(Clone, Debug)]
pub(in crate::export) struct Viewing {
    /// The pose of the viewpoint that is bound first, in the scene's world space.
    pub camera: Option<CameraPose>,
    /// Whether the headlight is on.
    pub headlight: bool,
    /// The node that states whether it is, if there is one.
    pub headlight_node: Option<Place>,
}

impl Viewing {
    /// Finds the settings of a VRML97 scene. Without a `NavigationInfo` the headlight is on.
    pub(in crate::export) fn of(snapshot: &Snapshot<'_>, limits: &Limits) -> Self {
        let overview = Overview::of(snapshot, limits);
        Self {
            camera: overview.camera,
            headlight: overview.navigation_info.unwrap_or(true),
            headlight_node: overview.headlight_node,
        }
    }

    /// Reports what becomes of the headlight. `text` says it.
    pub(in crate::export) fn report_headlight(&self, text: &str, losses: &mut Losses) {
        let place = self.headlight_node.clone().unwrap_or_default();
        losses.add_stated(HEADLIGHT, text, place, (1, self.headlight_node.is_some()));
    }
}

/// Returns the nodes of the cameras, and the node of the one that is in use.
pub(super) fn cameras(
    model: &Model,
    viewing: &Viewing,
    nodes: &mut NodeBuilder,
) -> (Vec<NodeId>, Option<NodeId>) {
    let around = SceneSphere::of(model.bounds());
    let first = model
        .cameras
        .iter()
        .position(|c| is_first(c, model, viewing));
    let mut found = Vec::new();
    let mut others = Vec::new();
    let mut used = None;
    for (i, camera) in model.cameras.iter().enumerate() {
        let id = node((i, camera), around, nodes);
        if Some(i) == first {
            used = Some(id);
            found.push(id);
        } else {
            others.push(id);
        }
    }
    if !others.is_empty() {
        let switch = nodes.group("Switch", Vec::new(), others);
        nodes.name(switch, "viewpoints");
        found.push(switch);
    }
    (found, used)
}

/// Whether a camera of the model is the one that is bound first.
fn is_first(camera: &SceneCamera, model: &Model, viewing: &Viewing) -> bool {
    viewing.camera.as_ref().is_some_and(|bound| {
        let position = bound.position - model.offset;
        camera.pose.position == position && camera.pose.orientation == bound.orientation
    })
}

/// Returns the node of a camera. Its clipping planes enclose the scene.
fn node(
    (number, camera): (usize, &SceneCamera),
    around: SceneSphere,
    nodes: &mut NodeBuilder,
) -> NodeId {
    let pose = &camera.pose.clone().fitted(1.0);
    let [nearest, far] = around.depths(number, camera, &Motion::default());
    let near = nearest.max(1e-4 * far);
    let depth = (around.center - pose.position).dot(pose.direction());
    let number = |value: f64| Value::Float(value as f32);
    let mut fields = vec![
        ("position", vec3(pose.position)),
        ("orientation", rotation(pose.orientation)),
        ("nearDistance", number(near)),
        ("farDistance", number(far)),
        ("focalDistance", number(depth.max(near))),
    ];
    let class = match pose.projection {
        Projection::Perspective { height_angle } => {
            fields.push(("heightAngle", number(height_angle)));
            "PerspectiveCamera"
        }
        Projection::Orthographic { height } => {
            fields.push(("height", number(height)));
            "OrthographicCamera"
        }
    };
    let id = nodes.node(class, fields);
    nodes.name(id, &camera.name);
    id
}
