//! Rays in lens space, and the reasons why they are lost.

use glam::DVec3;

/// A ray in lens space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensRay {
    /// A point of the ray, in millimeters.
    pub origin: DVec3,
    /// The direction. It need not be of unit length; that of a traced ray is.
    pub direction: DVec3,
}

impl LensRay {
    /// Creates a ray through a point in a direction.
    #[inline(always)]
    pub const fn new(origin: DVec3, direction: DVec3) -> Self {
        Self { origin, direction }
    }

    /// The point where the ray crosses a plane perpendicular to the axis.
    pub fn at_z(&self, z: f64) -> DVec3 {
        self.origin + (z - self.origin.z) / self.direction.z * self.direction
    }
}

/// The reason why a ray did not get through. It is not an error: vignetting consists of lost rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Loss {
    /// What happened to the ray.
    pub kind: LossKind,
    /// The surface, counted from 0 at the front, the stop included.
    pub surface: usize,
}

/// What happened to a lost ray at a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LossKind {
    /// The ray missed the surface, or hit only the other half of its sphere.
    Missed,
    /// The ray hit the surface outside its aperture.
    Blocked,
    /// The ray was totally reflected.
    TotalReflection,
}

/// The direction in which a ray travels through the lens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Toward {
    /// From the scene to the film.
    Film,
    /// From the film into the scene.
    Scene,
}

impl Toward {
    /// The sign of the direction along z.
    pub(crate) fn sign(self) -> f64 {
        match self {
            Self::Film => 1.0,
            Self::Scene => -1.0,
        }
    }
}

/// The path of a ray through a lens.
#[derive(Clone, Debug, PartialEq)]
pub struct RayPath {
    /// The ray behind the last surface, or the reason why it was lost.
    pub outcome: std::result::Result<LensRay, Loss>,
    /// The points at which the ray hit a surface, in the order of travel, in millimeters. The last
    /// may be where it was lost.
    pub hits: Vec<DVec3>,
}

/// The unit vector in a direction of any length: 1e-150 and 1e150 neither underflow nor overflow. A
/// vector that is of unit length within rounding is returned unchanged. Returns none for zero and
/// for a vector that is not finite.
pub fn unit(d: DVec3) -> Option<DVec3> {
    let square = d.length_squared();
    if (square - 1.0).abs() <= 8.0 * f64::EPSILON {
        return Some(d);
    }
    let largest = d.abs().max_element();
    if !(largest > 0.0 && largest.is_finite() && d.is_finite()) {
        return None;
    }
    let d = if (1e-100..1e100).contains(&largest) {
        d
    } else {
        d / largest
    };
    Some(d / d.length())
}
