//! The angles of the chief rays over the film, as a function that is quick to evaluate.
//!
//! Radii on the film are in millimeters, angles in radians from the axis.

use glam::DVec2;
use ivcam_base::diag::{Diagnostic, Result};

use crate::lens::{Conjugate, Lens};
use crate::lens_export::odd_curve::OddCurve;

/// The number of radii at which chief rays are traced. Between them the error of the angle is below
/// 1e-8 of it, for the aspheres of a phone's lens too (`tests`).
const NODES: usize = 128;
/// The relative irradiance below which a film point counts as dark.
const DARK: f64 = 0.02;

/// The angle of the chief ray over the radius on the film.
#[derive(Clone, Debug)]
pub(crate) struct ChiefRays {
    /// The z of the center of projection, from the front vertex: the paraxial entrance pupil's, or
    /// 0 if that is at infinity.
    pub origin_z: f64,
    /// The greatest radius on the film.
    pub reach: f64,
    /// The angle over the radius.
    angles: OddCurve,
}

impl ChiefRays {
    /// Traces the chief rays of a lens for film points up to a radius, or up to where light and
    /// chief rays end.
    ///
    /// For an object at a finite distance, the angle is that of the point of the object plane that
    /// the chief ray comes from, as seen from the center of projection.
    ///
    /// # Errors
    ///
    /// Returns an error for a lens without rotational symmetry, and if there are no chief rays.
    pub(crate) fn of(lens: &Lens, conjugate: Conjugate, radius: f64) -> Result<Self> {
        if lens
            .prescription()
            .surfaces
            .iter()
            .any(|s| !s.shape.is_rotational() || s.frame.is_some())
        {
            return Err(Diagnostic::unsupported(format!(
                "`{}` has cylinders, toroids or tilts: its distortion is no function of the radius",
                lens.name()
            ))
            .with_help("lenses of surfaces of revolution on one axis can be exported"));
        }
        let pupil = lens.first_order().entrance_pupil;
        let origin_z = pupil.map_or(0.0, |p| p.z);
        let angle = |r: f64| angle_of(lens, conjugate, origin_z, r);
        let none = || {
            Diagnostic::error(format!(
                "no chief ray of `{}` reaches the film",
                lens.name()
            ))
            .with_help("an afocal lens, or one that lets no light through, has none")
        };
        let reach = reach(lens, conjugate, radius, &angle).ok_or_else(none)?;
        let angles = OddCurve::of(reach, NODES, angle).ok_or_else(none)?;
        Ok(Self {
            origin_z,
            reach,
            angles,
        })
    }

    /// The angle at a radius up to [`Self::reach`].
    pub(crate) fn angle(&self, radius: f64) -> f64 {
        self.angles.at(radius)
    }

    /// The radius at an angle, up to 1% beyond the greatest one; none for a larger angle.
    pub(crate) fn radius(&self, angle: f64) -> Option<f64> {
        let (mut low, mut high) = (0.0, 1.01 * self.reach);
        if !(self.angle(high) >= angle) {
            return None;
        }
        // The angle grows with the radius, so the secant stays between the two ends.
        let mut at = angle / self.angle(self.reach) * self.reach;
        for _ in 0..60 {
            let off = self.angle(at) - angle;
            if off > 0.0 {
                high = at
            } else {
                low = at
            }
            let step = 1e-5 * self.reach;
            let slope = (self.angle(at + step) - self.angle((at - step).abs())) / (2.0 * step);
            let next = at - off / slope;
            let next = if next > low && next < high {
                next
            } else {
                0.5 * (low + high)
            };
            if (next - at).abs() <= 1e-14 * self.reach {
                break;
            }
            at = next;
        }
        Some(at)
    }
}

/// The angle at which the object point of a film radius is seen from the center of projection.
fn angle_of(lens: &Lens, conjugate: Conjugate, origin_z: f64, radius: f64) -> Option<f64> {
    let chief = lens.chief_ray(DVec2::new(0.0, radius), conjugate.film_z)?;
    let d = chief.direction;
    if conjugate.distance.is_infinite() {
        return Some(libm::atan2(d.truncate().length(), -d.z));
    }
    let far = (-conjugate.distance - chief.origin.z) / d.z;
    let y = (chief.origin + far * d).truncate().length();
    (far > 0.0).then(|| libm::atan2(y, conjugate.distance + origin_z))
}

/// The radius up to which there are chief rays and light, at most `radius`.
fn reach(
    lens: &Lens,
    conjugate: Conjugate,
    radius: f64,
    angle: &dyn Fn(f64) -> Option<f64>,
) -> Option<f64> {
    let center = lens.irradiance(DVec2::ZERO, conjugate.film_z);
    let lit = |r: f64| {
        angle(r).is_some() && lens.irradiance(DVec2::new(0.0, r), conjugate.film_z) > DARK * center
    };
    if !(center > 0.0 && radius > 0.0) {
        return None;
    }
    if lit(radius) {
        return Some(radius);
    }
    // The light may end and begin again beyond a rim, so the first dark radius is searched.
    let steps = 64;
    let at = |i: i32| radius * f64::from(i) / f64::from(steps);
    let dark = (1..=steps).find(|i| !lit(at(*i)))?;
    let (mut low, mut high) = (at(dark - 1), at(dark));
    for _ in 0..20 {
        let middle = 0.5 * (low + high);
        if lit(middle) {
            low = middle
        } else {
            high = middle
        }
    }
    Some(low).filter(|low| *low > 0.0)
}
