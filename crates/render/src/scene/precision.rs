//! Reports scenes that are too large or too small for the precision of their positions.

use glam::{DVec3, Vec3};
use ivcam_base::diag::Diagnostic;

/// Points with a larger coordinate, in meters, are left out, because the square of a distance would
/// overflow `f32`.
pub(super) const MAX_COORDINATE: f32 = 1e18;

/// Whether a point can be drawn, which means that it is finite and not too far away.
#[inline]
pub(super) fn in_reach(p: Vec3) -> bool {
    let reaches = |v: f32| v.abs() < MAX_COORDINATE; // false for NaN
    reaches(p.x) & reaches(p.y) & reaches(p.z)
}

/// Whether numbers are finite and below [`MAX_COORDINATE`].
pub(super) fn are_in_reach(numbers: &[f64]) -> bool {
    // A comparison with NaN is false.
    let mut numbers = numbers.iter();
    numbers.all(|v| v.abs() < f64::from(MAX_COORDINATE))
}

/// The farthest position in meters. Files and rays keep 24 bits of a position, which are steps of
/// 8 m at this distance.
const FAR_AWAY: f64 = 1e8;
/// The smallest size of a scene in meters. The area of smaller faces is dominated by rounding.
const SMALLEST: f64 = 1e-12;

/// Returns a warning if a scene with a bounding box, or the camera, is beyond the precision of
/// positions. All positions are in meters in world space.
pub fn precision_warning(
    bounds: Option<(DVec3, DVec3)>,
    camera: Option<DVec3>,
) -> Option<Box<Diagnostic>> {
    let farthest = |p: DVec3| p.abs().max_element();
    let scene = bounds.map_or(0.0, |(min, max)| farthest(min).max(farthest(max)));
    let size = bounds.map_or(1.0, |(min, max)| (max - min).max_element());
    let camera = camera.map_or(0.0, farthest);
    let (what, help) = if scene > FAR_AWAY {
        (
            format!("the scene extends to {scene:.1e} m from the origin"),
            "a scale that brings it below 1e8 m draws it exactly",
        )
    } else if camera > FAR_AWAY {
        (
            format!("the camera is {camera:.1e} m from the origin"),
            "a camera and a scene nearer to the origin are drawn exactly",
        )
    } else if size > 0.0 && size < SMALLEST {
        (
            format!("the scene is {size:.1e} m across"),
            "a scale that brings it above 1e-12 m draws it exactly",
        )
    } else {
        return None;
    };
    let message = format!("{what}; positions have 24 bits, so parts of the picture may be wrong");
    Some(Diagnostic::warning(message).with_help(help))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_scenes_and_cameras_beyond_the_precision_are_reported() {
        let around = |middle: f64, size: f64| {
            let middle = DVec3::new(0.0, middle, 0.0);
            Some((middle - 0.5 * size, middle + 0.5 * size))
        };
        let reported = |bounds, camera: f64| {
            let warning = precision_warning(bounds, Some(DVec3::new(camera, 0.0, 0.0)));
            warning.map(|w| w.message.split(';').next().unwrap_or_default().to_owned())
        };
        assert_eq!(reported(None, 0.0), None);
        assert_eq!(reported(around(9e7, 1e-9), 9e7), None);
        assert_eq!(reported(around(5.0, 0.0), 1.0), None);
        let far = "the scene extends to 3.0e9 m from the origin";
        assert_eq!(reported(around(2e9, 2e9), 0.0).as_deref(), Some(far));
        let camera = "the camera is 2.0e8 m from the origin";
        assert_eq!(reported(around(0.0, 1.0), -2e8).as_deref(), Some(camera));
        let small = "the scene is 1.0e-13 m across";
        assert_eq!(reported(around(0.0, 1e-13), 0.0).as_deref(), Some(small));
    }
}
