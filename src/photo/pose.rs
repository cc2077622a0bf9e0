//! Finds the pose of the camera, and reads environment files.

use std::path::Path;

use glam::{DMat4, DVec3};
use ivcam_base::diag::{Diagnostic, Result, Sink};
use ivcam_base::files::{MAX_TEXT, read_file};
use ivcam_base::math::Meters;
use ivcam_inventor::grammar::{class, directional_light};
use ivcam_inventor::iv::{Document, NodeId, NodeRef};
use ivcam_inventor::pose::{CameraPose, ViewDirection};
use ivcam_inventor::snapshot::Snapshot;
use ivcam_render::camera::half_field;
use ivcam_render::scene::{CompileOptions, Light, RenderScene, Survey};

use super::plan::{Optics, Plan};
use super::view::{Override, WholeView};

/// Returns the pose of the camera. It is the side of `--view`, or else the camera of `-camread`, or
/// else that of the environment file, or else the scene's first, or else a view of the whole scene.
/// `sink` receives what is wrong with the file of `-camread`.
pub(super) fn resolve_pose(
    plan: &Plan,
    snapshot: &Snapshot<'_>,
    environment: &Environment,
    first: Option<CameraPose>,
    bounds: impl FnOnce() -> (DVec3, DVec3),
    sink: &mut Sink,
) -> Result<CameraPose> {
    let view = match (plan.view, &plan.camera) {
        (Some(Override::Always(_)), Some(_)) => {
            let error = "`--view` can't be used with `--camera`";
            return Err(Diagnostic::unsupported(error).with_help("leave one of them out"));
        }
        (Some(Override::Always(view)), None) => view,
        (_, Some(choice)) => return Ok(choice.pose(sink)?.fitted(plan.resolution.aspect())),
        (other, None) => match (environment.pose.clone().or(first), other) {
            (Some(pose), _) => return Ok(pose.fitted(plan.resolution.aspect())),
            (None, Some(Override::IfUnstated(view))) => view,
            (None, _) => WholeView::Side(ViewDirection::FRONT),
        },
    };
    let format = &snapshot.document().format;
    let has_viewpoint = ["VRML V2", "X3D"].iter().any(|own| format.starts_with(own));
    Ok(match view {
        WholeView::Standard if has_viewpoint => CameraPose::default_viewpoint(),
        WholeView::Standard => view_of_everything(bounds(), plan, ViewDirection::FRONT),
        WholeView::Side(side) => view_of_everything(bounds(), plan, side),
    })
}

/// Returns a pose on a side of a scene from which all of its bounding box is visible.
pub(super) fn view_of_everything(
    bounds: (DVec3, DVec3),
    plan: &Plan,
    side: ViewDirection,
) -> CameraPose {
    match (view_through_lens(bounds, plan), side) {
        (Some(front), ViewDirection::FRONT) => front,
        (Some(front), _) => front.turned_around(0.5 * (bounds.0 + bounds.1), side),
        (None, _) => CameraPose::view_all_from(bounds, plan.resolution.aspect(), side),
    }
}

/// Returns the bounding box of a scene as Inventor's `viewAll` sees it, in meters.
pub(super) fn inventor_bounds(snapshot: &Snapshot<'_>, plan: &Plan) -> Option<(DVec3, DVec3)> {
    surveyed(snapshot, plan).inventor_bounds
}

/// Returns the bounding box of what a scene draws, in meters. Inventor's box may be larger: it is
/// that of turned boxes of shapes.
pub(super) fn drawn_bounds(snapshot: &Snapshot<'_>, plan: &Plan) -> Option<(DVec3, DVec3)> {
    surveyed(snapshot, plan).bounds
}

fn surveyed(snapshot: &Snapshot<'_>, plan: &Plan) -> Survey {
    let options = CompileOptions {
        fonts: plan.fonts.clone(),
        limits: plan.limits.clone(),
        memory: plan.memory.bytes(),
        ..CompileOptions::default()
    };
    RenderScene::survey(snapshot, &options)
}

/// Returns a pose that looks along −z and from which the plan's lens shows the whole box and can
/// focus, or `None` if the plan has no lens. The field is narrowed by 0.7 up to 16 times, which
/// moves the camera away until the lens can focus: at most 1.5 times as far as necessary, and up to
/// 300 times as far as for the whole field. No search for the two numbers is
/// recorded.
pub(crate) fn view_through_lens(bounds: (DVec3, DVec3), plan: &Plan) -> Option<CameraPose> {
    let Optics::Lens(choice) = &plan.optics else {
        return None;
    };
    // Problems of the lens are reported when it is opened for the picture.
    let lens = choice.open(&mut Sink::new()).ok()?;
    let mut half_angle = half_field(&lens, plan.film)?;
    let mut pose = CameraPose::view_all_within(bounds, half_angle);
    for _ in 0..16 {
        if lens.focused(choice.method, own_focus(&pose)).is_ok() {
            break;
        }
        half_angle *= 0.7;
        pose = CameraPose::view_all_within(bounds, half_angle);
    }
    pose.source = format!("{}, {:.3} m away", pose.source, pose.focal_distance);
    Some(pose)
}

/// The camera and headlight of a SceneViewer environment file. Its lights and fog become the first
/// nodes of the scene.
#[derive(Default)]
pub(super) struct Environment {
    /// The pose of the file's camera.
    pub pose: Option<CameraPose>,
    /// The file's headlight, in camera space.
    pub headlight: Option<Light>,
}

impl Environment {
    /// Reads the file into the scene's document. Such a file has a `Label`, a camera, an
    /// `Environment`, a `Group` of lights, and, if the headlight is on, a `DirectionalLight` in
    /// camera space.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read or has neither a camera nor a light.
    pub(super) fn merge(document: &mut Document, path: &Path, time: f64) -> Result<Self> {
        let bytes = read_file(path, MAX_TEXT)?;
        let roots = document.read_more(&path.display().to_string(), bytes)?;
        let mut this = Self::default();
        let mut around = Vec::new();
        let snapshot = Snapshot::at(document, time);
        for root in roots {
            let node = snapshot.document().node(root);
            if let Some(pose) = CameraPose::from_node(node, DMat4::IDENTITY) {
                this.pose = Some(pose);
            } else if node.class_id() == Some(class::DIRECTIONAL_LIGHT) {
                this.headlight = headlight_of_node(node);
            } else {
                around.push(root);
            }
        }
        let is_known = |id: &NodeId| document.node(*id).class().is_some();
        if this.pose.is_none() && this.headlight.is_none() && !around.iter().any(is_known) {
            return Err(
                Diagnostic::error("there is no camera and no light in the file")
                    .in_file(path.display().to_string())
                    .with_help("an environment file is what SceneViewer saves"),
            );
        }
        around.append(&mut document.roots);
        document.roots = around;
        Ok(this)
    }
}

/// Returns the headlight that a node describes, unless it is off.
fn headlight_of_node(node: NodeRef<'_>) -> Option<Light> {
    let mut light = Light::headlight(node.get(directional_light::DIRECTION));
    light.color = node.get(directional_light::COLOR) * node.get(directional_light::INTENSITY);
    node.get(directional_light::ON).then_some(light)
}

/// Returns the distance in focus that the scene's camera states, or infinity if it is not positive.
pub(super) fn own_focus(pose: &CameraPose) -> Meters {
    let distance = pose.focal_distance;
    Meters(if distance > 0.0 {
        distance
    } else {
        f64::INFINITY
    })
}
