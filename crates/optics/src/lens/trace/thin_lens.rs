//! Ideal thin lenses inside of a system.
//!
//! An ideal lens of focal length f changes the slopes t = (dx/dz, dy/dz) of a ray at the point P of
//! its plane: n' t' = n t − P/f, as the surface `PARAXIAL` of Zemax does. A point then has a sharp
//! image and a plane a plane one, to scale, at every aperture and field. No glass does that, and
//! cosines of directions are not preserved: light is that of the pupil behind the ideal lens.

use glam::DVec3;

use crate::lens::trace::ray::Toward;

/// The unit direction behind an ideal lens between media of these indices, which a ray of the
/// direction `d` meets at a point of its plane. Returns none for a ray along the plane.
pub(super) fn bend(
    d: DVec3,
    point: DVec3,
    [front, behind]: [f64; 2],
    focal_length: f64,
    toward: Toward,
) -> Option<DVec3> {
    let turn = point.truncate() / focal_length;
    let slopes = d.truncate() / d.z;
    let slopes = match toward {
        Toward::Film => (front * slopes - turn) / behind,
        Toward::Scene => (behind * slopes + turn) / front,
    };
    slopes
        .is_finite()
        .then(|| d.z.signum() * slopes.extend(1.0).normalize())
}
