//! A turn of a path: the scattering at a point, in directions of the scene.

use glam::Vec3;

use super::bsdf::{Bsdf, BsdfSample, Reflectance};
use super::frame::ShadingFrame;
use crate::bvh::Ray;
use crate::scene::{FacetHighlight, LitFace, MetPoint};

/// The scattering at a point that is seen along a ray.
pub(super) struct Vertex {
    frame: ShadingFrame,
    /// The place on the side that is seen.
    met: MetPoint,
    bsdf: Bsdf,
}

impl Vertex {
    /// The scattering at a point that a ray with a direction of length 1 meets.
    ///
    /// The side that is seen is lit. An interpolated normal that points away from the viewer is
    /// turned until it is seen at a grazing angle.
    pub(super) fn new(
        met: MetPoint,
        direction: Vec3,
        reflectance: Reflectance,
        is_mirror: bool,
    ) -> Self {
        let wo = -direction;
        let own = match met.normal.dot(met.geometric) {
            along if along < 0.0 => -met.normal,
            _ => met.normal,
        };
        let own = own.normalize_or(met.geometric);
        let short = 1e-3 - own.dot(wo);
        let normal = match short > 0.0 {
            true => (own + short * wo).normalize_or(met.geometric),
            false => own,
        };
        let frame = ShadingFrame::around(normal);
        Self {
            bsdf: Bsdf::new(reflectance, frame.local(wo), is_mirror),
            frame,
            met,
        }
    }

    /// The position in meters.
    pub(super) fn position(&self) -> Vec3 {
        self.met.position
    }

    /// Returns a ray from the point in any direction.
    pub(super) fn leave(&self, direction: Vec3) -> Ray {
        self.met.leave(direction)
    }

    /// Whether directions are drawn in one way only, and need no choice.
    pub(super) fn is_matte(&self) -> bool {
        self.bsdf.is_matte()
    }

    /// The face at the point.
    pub(super) fn lit_face(&self) -> LitFace {
        LitFace {
            position: self.met.position,
            normal: self.met.geometric,
            highlight: self.bsdf.shares().map(|[facets, rest]| {
                let (wo, alpha) = (self.bsdf.viewer(), self.bsdf.roughness());
                FacetHighlight {
                    viewer: self.frame.world(wo),
                    normal: self.frame.world(Vec3::Z),
                    square: alpha * alpha,
                    strength: facets / (4.0 * wo.z),
                    matte: rest,
                }
            }),
        }
    }

    /// Returns the scattering from a direction times its cosine, and the density with which
    /// [`Vertex::sample`] draws it. No light comes through the face.
    pub(super) fn eval(&self, toward: Vec3) -> (Vec3, f32) {
        match toward.dot(self.met.geometric) > 0.0 {
            true => self.bsdf.eval(self.frame.local(toward)),
            false => (Vec3::ZERO, 0.0),
        }
    }

    /// Draws a direction from which light comes; the density of a mirrored one is infinite.
    pub(super) fn sample(&self, choice: f32, u: [f32; 2]) -> Option<(Vec3, BsdfSample)> {
        let drawn = self.bsdf.sample(choice, u)?;
        let toward = self.frame.world(drawn.wi);
        (toward.dot(self.met.geometric) > 0.0).then_some((toward, drawn))
    }
}

/// The share of light that a smooth boundary reflects, and the direction of the rest; `None` beyond
/// the critical angle. `normal` is on the side that the light is seen from, `ratio` the index there
/// over that on the other side.
pub(super) fn refract(d: Vec3, normal: Vec3, ratio: f32) -> Option<(f32, Vec3)> {
    let cos = (-d.dot(normal)).clamp(0.0, 1.0);
    let square = 1.0 - ratio * ratio * (1.0 - cos * cos);
    if square <= 0.0 {
        return None;
    }
    let inside = square.sqrt();
    // Fresnel's equations for the two polarizations.
    let s = (ratio * cos - inside) / (ratio * cos + inside);
    let p = (ratio * inside - cos) / (ratio * inside + cos);
    let direction = ratio * d + (ratio * cos - inside) * normal;
    Some((0.5 * (s * s + p * p), direction))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn glass_of_index_one_and_a_half_reflects_four_percent() {
        let (share, ahead) = refract(Vec3::NEG_Z, Vec3::Z, 1.0 / 1.5).unwrap();
        assert!((share - 0.04).abs() < 1e-6 && (ahead - Vec3::NEG_Z).length() < 1e-6);
        // Brewster's angle: the reflected light is polarized, so its share is half of one
        // polarization's.
        let (sin, cos) = (1.5 / 3.25f32.sqrt(), 1.0 / 3.25f32.sqrt());
        let (share, _) = refract(Vec3::new(sin, 0.0, -cos), Vec3::Z, 1.0 / 1.5).unwrap();
        let s = (1.0 - 2.25f32) / (1.0 + 2.25);
        assert!((share - 0.5 * s * s).abs() < 1e-6);
        assert!(refract(Vec3::new(0.8, 0.0, -0.6), Vec3::Z, 1.5).is_none());
    }
}
