//! Rays in lens space, and what becomes of them.

use glam::DVec3;

/// A ray in lens space. The direction need not be of unit length; what comes back from a trace is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensRay {
    pub origin: DVec3,
    pub direction: DVec3,
}

impl LensRay {
    /// The point where the ray crosses a plane perpendicular to the axis.
    pub(crate) fn at_z(&self, z: f64) -> DVec3 {
        self.origin + (z - self.origin.z) / self.direction.z * self.direction
    }
}

/// Why a ray did not get through. That is not an error: vignetting is made of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Loss {
    pub kind: LossKind,
    /// The surface, counted from 0 at the front, the stop included.
    pub surface: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LossKind {
    /// It passed beside the surface, or met only the other half of its sphere.
    Missed,
    /// It met the surface outside its semi-diameter.
    Blocked,
    /// It could not leave the glass.
    TotalReflection,
}

/// Which way a ray goes through the lens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Toward {
    Film,
    Scene,
}

/// The path of a ray: its outcome, and every point where it met a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct RayPath {
    pub outcome: std::result::Result<LensRay, Loss>,
    /// In the order of travel; the last may be where the ray was lost.
    pub hits: Vec<DVec3>,
}

/// A direction of unit length, whatever its length was: 1e-150 and 1e150 neither underflow nor
/// overflow. A vector of unit length within rounding keeps its bits. None for zero and for what is not
/// finite.
pub(crate) fn unit(d: DVec3) -> Option<DVec3> {
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
