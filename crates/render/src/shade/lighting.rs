//! The terms of OpenGL's lighting equation.

use glam::Vec3;
use ivcam_base::math::lanes::power;
use ivcam_inventor::traversal::state::FogKind;

use crate::scene::{IncidentLight, Point};

/// The terms without a light: emissive, and ambient from the surroundings.
pub(super) fn ambient(point: &Point<'_>) -> Vec3 {
    point.surface.glow(point.diffuse)
}

/// The terms of one light that reaches a point. `shadow` is the fraction of the light that arrives:
/// it scales the diffuse and specular terms, and not the ambient one. `to_viewer` is the direction
/// for highlights.
pub(super) fn direct(
    point: &Point<'_>,
    incident: &IncidentLight,
    to_viewer: Vec3,
    specular: bool,
    shadow: f32,
) -> Vec3 {
    let surface = point.surface;
    let mut sum = surface.ambient_at(point.diffuse) * incident.ambient;
    let facing = point.normal.dot(incident.toward);
    if facing > 0.0 && shadow > 0.0 {
        let mut lit = point.diffuse * facing;
        if specular && surface.specular != Vec3::ZERO {
            let half = (incident.toward + to_viewer).normalize_or_zero();
            let aligned = point.normal.dot(half).clamp(0.0, 1.0);
            let share = power(aligned, surface.exponent());
            lit += surface.specular * share;
        }
        sum += incident.color * lit * shadow;
    }
    sum
}

/// The eye that fog counts from, for a camera ray that starts at a depth of `start` behind it.
pub(super) fn eye(origin: Vec3, backward: Vec3, start: f32) -> Vec3 {
    match start {
        0.0 => origin,
        _ => origin + start * backward,
    }
}

/// Mixes a point's color with the fog between the eye and the point.
///
/// The densities are those of SGI's library, by its pictures: at the visibility distance FOG
/// transmits e^−4 and SMOKE e^−(2²); HAZE is linear.
pub(super) fn fogged(color: Vec3, point: &Point<'_>, eye: Vec3, backward: Vec3) -> Vec3 {
    match clearness(point, eye, backward) {
        1.0 => color,
        clear => point.surface.environment.fog_color.lerp(color, clear),
    }
}

/// The fraction of a point's light that the fog between the eye and the point lets through.
pub(super) fn clearness(point: &Point<'_>, eye: Vec3, backward: Vec3) -> f32 {
    let environment = &point.surface.environment;
    if environment.fog == FogKind::None || environment.visibility <= 0.0 {
        return 1.0;
    }
    // Inventor's fog depends on depth, as in OpenGL. That of VRML 97 depends on distance (4.10).
    let depth = match environment.fog {
        FogKind::Linear | FogKind::Exponential => eye.distance(point.position),
        _ => (eye - point.position).dot(backward),
    } / environment.visibility;
    let clear = match environment.fog {
        FogKind::Haze | FogKind::Linear => 1.0 - depth,
        FogKind::Exponential if depth >= 1.0 => 0.0,
        FogKind::Exponential => libm::expf(-depth / (1.0 - depth)),
        FogKind::Fog => libm::expf(-4.0 * depth),
        _ => libm::expf(-4.0 * depth * depth),
    };
    clear.clamp(0.0, 1.0)
}
