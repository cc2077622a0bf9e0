//! Where the camera stands.

use std::path::Path;

use glam::{DMat4, DVec3};

use super::plan::{Optics, Plan};
use crate::camera::half_field;
use crate::diag::{Diagnostic, Result, Sink};
use crate::grammar::{class, directional_light};
use crate::iv::{Document, NodeId, NodeRef};
use crate::math::Meters;
use crate::pose::CameraPose;
use crate::scene::{CompileOptions, Light, RenderScene};
use crate::snapshot::Snapshot;

/// Returns where the camera stands: the `-camread` file's camera, else the environment's, else the
/// scene's first, else a view of everything.
pub(super) fn resolve_pose(
    plan: &Plan,
    snapshot: &Snapshot<'_>,
    environment: &Environment,
    first: Option<CameraPose>,
) -> Result<CameraPose> {
    match &plan.camera {
        Some(choice) => choice.pose(),
        None => Ok(match environment.pose.clone().or(first) {
            Some(pose) => pose,
            None => view_of_everything(snapshot, plan),
        }),
    }
}

fn view_of_everything(snapshot: &Snapshot<'_>, plan: &Plan) -> CameraPose {
    let bounds = inventor_bounds(snapshot, plan).unwrap_or_default();
    view_through_lens(bounds, plan)
        .unwrap_or_else(|| CameraPose::view_all(bounds, plan.resolution.aspect()))
}

/// Returns the bounding box of a scene as Inventor's `viewAll` sees it, in meters.
pub(super) fn inventor_bounds(snapshot: &Snapshot<'_>, plan: &Plan) -> Option<(DVec3, DVec3)> {
    let options = CompileOptions {
        fonts: plan.fonts.clone(),
        ..CompileOptions::default()
    };
    RenderScene::survey(snapshot, &options).inventor_bounds
}

/// Returns a view of a box along −z from as far as the plan's lens needs, and can focus; `None` if
/// the plan has no lens.
pub(crate) fn view_through_lens(bounds: (DVec3, DVec3), plan: &Plan) -> Option<CameraPose> {
    let Optics::Lens(choice) = &plan.optics else {
        return None;
    };
    // What is wrong with the lens is said when it is opened for the picture.
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

/// What a SceneViewer environment file brings: its lights and fog go in front of the scene's own
/// nodes, its camera and headlight are kept apart.
#[derive(Default)]
pub(super) struct Environment {
    pub pose: Option<CameraPose>,
    pub headlight: Option<Light>,
}

impl Environment {
    /// Reads the file into the scene's document: `Label`, a camera, `Environment`, a `Group` of
    /// lights, and at the end, if the headlight is on, a `DirectionalLight` in camera space.
    pub(super) fn join(document: &mut Document, path: &Path, time: f64) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(|e| Diagnostic::io(path.display(), &e))?;
        let roots = document.read_more(&path.display().to_string(), bytes)?;
        let mut this = Self::default();
        let mut around = Vec::new();
        let snapshot = Snapshot::at(document, time);
        for root in roots {
            let node = snapshot.document().node(root);
            if let Some(pose) = CameraPose::from_node(node, DMat4::IDENTITY) {
                this.pose = Some(pose);
            } else if node.class_id() == Some(class::DIRECTIONAL_LIGHT) {
                this.headlight = lamp(node);
            } else {
                around.push(root);
            }
        }
        let speaks = |id: &NodeId| document.node(*id).class().is_some();
        if this.pose.is_none() && this.headlight.is_none() && !around.iter().any(speaks) {
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

fn lamp(node: NodeRef<'_>) -> Option<Light> {
    let mut light = Light::headlight(node.get(directional_light::DIRECTION));
    light.color = node.get(directional_light::COLOR) * node.get(directional_light::INTENSITY);
    node.get(directional_light::ON).then_some(light)
}

/// The distance that the scene's camera says is in focus; infinity where it says nothing of use.
pub(super) fn own_focus(pose: &CameraPose) -> Meters {
    let distance = pose.focal_distance;
    Meters(if distance > 0.0 {
        distance
    } else {
        f64::INFINITY
    })
}
