//! The nodes before the shapes: the origin, cameras, the headlight and lights.
//!
//! An Inventor camera or light acts on what follows it, so these nodes come before all shapes.
//! Their positions are in world space, because no transform precedes them.

use glam::DVec3;
use ivcam_inventor::grammar::value::{NodeId, Value};
use ivcam_render::scene::model::Model;

use super::camera::{Viewing, cameras};
use super::light::{LightWriter, ambient_fields};
use crate::export::losses::Losses;
use crate::export::nodes::NodeBuilder;

/// Returns the nodes before the shapes.
pub(super) fn head(
    model: &Model,
    viewing: &Viewing,
    nodes: &mut NodeBuilder,
    losses: &mut Losses,
) -> Vec<NodeId> {
    let mut head = Vec::new();
    if let Some(text) = origin_text(model.offset) {
        head.push(nodes.node("Info", vec![("string", Value::String(text.into()))]));
    }
    head.push(nodes.node("Environment", ambient_fields(model)));
    let (cameras, first) = cameras(model, viewing, nodes);
    head.extend(cameras);
    head.extend(headlight(model, viewing, first, nodes, losses));
    let mut writer = LightWriter::new(model, nodes, losses);
    head.extend(model.lights.iter().flat_map(|light| writer.light(light)));
    head
}

/// Returns the node that has the effect of the scene's headlight, if one is needed.
///
/// A viewer of Inventor lights a scene without lights by its own headlight. In a scene with lights
/// the headlight is a directional light that turns with the file's camera, by the connection that
/// Inventor's viewers have. A scene without any light and headlight gets a light of intensity 0,
/// because a scene without a light would be lit by a viewer's headlight.
fn headlight(
    model: &Model,
    viewing: &Viewing,
    camera: Option<NodeId>,
    nodes: &mut NodeBuilder,
    losses: &mut Losses,
) -> Option<NodeId> {
    if !viewing.headlight {
        let text = "the headlight is off, but a viewer of Inventor may turn its own on";
        viewing.report_headlight(text, losses);
        let is_dark = model.lights.is_empty();
        let dark = vec![("intensity", Value::Float(0.0))];
        return is_dark.then(|| nodes.node("DirectionalLight", dark));
    }
    if model.lights.is_empty() {
        return None;
    }
    let light = nodes.node("DirectionalLight", Vec::new());
    nodes.name(light, "headlight");
    let Some(camera) = camera else {
        let text = "the headlight shines along -z, because the scene has no camera to follow";
        viewing.report_headlight(text, losses);
        return Some(light);
    };
    if model.cameras.len() > 1 {
        viewing.report_headlight("the headlight follows the first camera alone", losses);
    }
    let turn = nodes.connected("Rotation", "rotation", camera, "orientation");
    // The light acts beyond the group, and the rotation does not.
    Some(nodes.group("TransformSeparator", Vec::new(), vec![turn, light]))
}

/// The text about a model that was moved to the origin, or `None` if it was not.
fn origin_text(offset: DVec3) -> Option<String> {
    let DVec3 { x, y, z } = offset;
    let text = || format!("the origin of this file is at {x} {y} {z} of the original scene");
    (offset != DVec3::ZERO).then(text)
}
