//! Lights and cameras of USD.

use glam::{DAffine3, DQuat, DVec3};
use ivcam_inventor::pose::Projection;
use ivcam_render::scene::model::{self, Feature, LightShape, Motion, Pose, SceneLight};

use super::text::{UsdText, matrix, tuple};
use crate::export::clipping::SceneSphere;
use crate::export::color::{illuminance, light_color};
use crate::export::losses::Losses;

/// The number of time codes in a second.
pub(super) const CODES_PER_SECOND: f64 = 30.0;

/// Writes a transform that may move.
pub(super) fn transform(out: &mut UsdText, still: &DAffine3, samples: &[(f64, DAffine3)]) {
    if samples.is_empty() && *still == DAffine3::IDENTITY {
        return;
    }
    let still = matrix(still);
    out.line(format_args!("matrix4d xformOp:transform = {still}"));
    if !samples.is_empty() {
        let at =
            |(time, m): &(f64, DAffine3)| format!("{}: {}", time * CODES_PER_SECOND, matrix(m));
        let list: Vec<String> = samples.iter().map(at).collect();
        let list = list.join(", ");
        out.line(format_args!(
            "matrix4d xformOp:transform.timeSamples = {{ {list} }}"
        ));
    }
    out.line("uniform token[] xformOpOrder = [\"xformOp:transform\"]");
}

fn placed(position: DVec3, turn: DQuat) -> DAffine3 {
    DAffine3::from_rotation_translation(turn, position)
}

/// The transforms of a list of poses at the times of a motion.
fn samples(motion: &Motion, poses: Option<&Vec<Pose>>) -> Vec<(f64, DAffine3)> {
    let poses = poses.into_iter().flatten();
    let moved = poses.map(|pose| placed(pose.position, pose.orientation));
    motion.times.iter().copied().zip(moved).collect()
}

/// Writes a light. One of intensity 1 lights a white surface that faces it to white. `center` is
/// that of the scene and `size` its size.
pub(super) fn light(
    out: &mut UsdText,
    (name, light, number): (&str, &SceneLight, usize),
    motion: &Motion,
    (center, size): (DVec3, f64),
    losses: &mut Losses,
) {
    let is_far = light.shape == LightShape::Directional;
    let distance = light.position.distance(center).max(0.05 * size);
    let class = if is_far {
        "DistantLight"
    } else {
        "SphereLight"
    };
    let is_spot = matches!(light.shape, LightShape::Spot { .. });
    if is_spot {
        out.line(format_args!("def {class} \"{name}\" ("));
        out.line("    prepend apiSchemas = [\"ShapingAPI\"]");
        out.open(")");
    } else {
        out.open(format_args!("def {class} \"{name}\""));
    }
    let (color, factor) = light_color(light);
    out.line(format_args!("color3f inputs:color = {}", tuple(color)));
    out.line("bool inputs:normalize = 1");
    if is_far {
        let intensity = factor * illuminance(light, 1.0);
        out.line(format_args!("float inputs:intensity = {intensity}"));
        out.line("float inputs:angle = 0");
    } else {
        if !light.linear {
            let uses = (1, light.states_attenuation);
            losses.feature_stated(Feature::LightFalloff, &light.place, uses);
        }
        // A normalized sphere of radiance L = I / (4πr²) has the illuminance π L r² / d².
        let intensity = 4.0 * factor * illuminance(light, distance) * distance * distance;
        out.line(format_args!("float inputs:intensity = {intensity}"));
        out.line(format_args!("float inputs:radius = {}", 1e-3 * size));
        out.line("bool treatAsPoint = 1");
    }
    if let LightShape::Spot { inner, outer, .. } = light.shape {
        let angle = outer.min(std::f32::consts::FRAC_PI_2);
        let softness = (1.0 - inner / angle.max(1e-3)).clamp(0.0, 1.0);
        losses.feature(Feature::SpotFalloff, &light.place, 1);
        out.line(format_args!(
            "float inputs:shaping:cone:angle = {}",
            angle.to_degrees()
        ));
        out.line(format_args!(
            "float inputs:shaping:cone:softness = {softness}"
        ));
    }
    let moving = motion.lights.iter().find(|(n, _)| *n == number);
    let still = placed(light.position, light.rotation());
    transform(
        out,
        &still,
        &samples(motion, moving.map(|(_, poses)| poses)),
    );
    out.close();
}

/// Writes a camera, with clipping planes around the scene.
pub(super) fn camera(
    out: &mut UsdText,
    (name, camera, number): (&str, &model::SceneCamera, usize),
    motion: &Motion,
    around: SceneSphere,
) {
    let pose = &camera.pose;
    let [nearest, far] = around.depths(number, camera, motion);
    let near = nearest.max(1e-4 * far);
    out.open(format_args!("def Camera \"{name}\""));
    // Apertures are in tenths of the unit of length.
    let (projection, height) = match pose.projection {
        Projection::Perspective { height_angle } => {
            let angle = height_angle.clamp(1e-4, 3.1);
            ("perspective", 100.0 * libm::tan(0.5 * angle))
        }
        Projection::Orthographic { height } => ("orthographic", 10.0 * height.abs()),
    };
    out.line(format_args!("token projection = \"{projection}\""));
    out.line("float focalLength = 50");
    out.line(format_args!("float verticalAperture = {}", height as f32));
    out.line(format_args!(
        "float horizontalAperture = {}",
        (height * pose.view_aspect()) as f32
    ));
    let [right, up] = (50.0 * pose.center).as_vec2().to_array();
    if [right, up] != [0.0; 2] {
        out.line(format_args!("float horizontalApertureOffset = {right}"));
        out.line(format_args!("float verticalApertureOffset = {up}"));
    }
    out.line(format_args!(
        "float2 clippingRange = ({}, {})",
        near as f32, far as f32
    ));
    let moving = motion.cameras.iter().find(|(n, _)| *n == number);
    let still = placed(pose.position, pose.orientation);
    transform(
        out,
        &still,
        &samples(motion, moving.map(|(_, poses)| poses)),
    );
    out.close();
}
