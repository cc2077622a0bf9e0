//! OpenGL's lighting equation, term by term.

use glam::Vec3;

use crate::scene::{Point, Reaching};
use crate::traversal::state::FogKind;

/// What shines by itself and what the surroundings give.
pub(super) fn ambient(point: &Point<'_>) -> Vec3 {
    point.surface.glow()
}

/// What a light that reaches a point gives, times the share of it that is not in shadow.
pub(super) fn direct(
    point: &Point<'_>,
    reaching: &Reaching,
    backward: Vec3,
    specular: bool,
    shadow: f32,
) -> Vec3 {
    let surface = point.surface;
    let mut sum = surface.ambient * reaching.ambient;
    let facing = point.normal.dot(reaching.toward);
    if facing > 0.0 && shadow > 0.0 {
        let mut lit = point.diffuse * facing;
        if specular && surface.specular != Vec3::ZERO {
            let half = (reaching.toward + backward).normalize_or_zero();
            let aligned = point.normal.dot(half).max(0.0);
            let exponent = surface.exponent();
            // x^0 is 1, even of 0.
            let share = if exponent == 0.0 {
                1.0
            } else {
                libm::powf(aligned, exponent)
            };
            lit += surface.specular * share;
        }
        sum += reaching.color * lit * shadow;
    }
    sum
}

/// The color through the fog between the eye and the point.
///
/// Coin's densities: at the visibility distance an 8-bit picture no longer shows the color, that
/// is e^−5.545 = 1/256 for FOG and e^−(2.35)² for SMOKE; HAZE is linear.
pub(super) fn fogged(color: Vec3, point: &Point<'_>, eye: Vec3, backward: Vec3) -> Vec3 {
    let environment = &point.surface.environment;
    if environment.fog == FogKind::None || environment.visibility <= 0.0 {
        return color;
    }
    // By depth, not by distance, as OpenGL does; VRML 97 asks for the distance (4.10).
    let depth = match environment.fog {
        FogKind::Linear | FogKind::Exponential => eye.distance(point.position),
        _ => (eye - point.position).dot(backward),
    } / environment.visibility;
    let clear = match environment.fog {
        FogKind::Haze | FogKind::Linear => 1.0 - depth,
        FogKind::Exponential if depth >= 1.0 => 0.0,
        FogKind::Exponential => libm::expf(-depth / (1.0 - depth)),
        FogKind::Fog => libm::expf(-5.545 * depth),
        _ => libm::expf(-(2.35 * depth) * (2.35 * depth)),
    };
    environment.fog_color.lerp(color, clear.clamp(0.0, 1.0))
}
