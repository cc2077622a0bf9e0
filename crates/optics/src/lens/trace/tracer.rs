//! Traces a ray through a prescription, surface by surface, in lens space.
//!
//! Lens space is in millimeters. Light travels toward +z, the first vertex is the origin, and the
//! film is at positive z. Nothing here knows about scenes or pixels; `camera` converts between the
//! two.
//!
//! Behind a mirror, the tracer counts z along the light, as the prescription does: the ray and its
//! hit are turned around, and light travels toward the film between all surfaces. Only the points
//! that are handed out have the z of lens space.
//!
//! A decentered surface has coordinates of its own. A ray is moved into them in front of it, and
//! out of them behind it, so that between surfaces it has those of the axis.
//!
//! Between two surfaces a ray may travel backward (t < 0): thin edges and zero gaps make surfaces
//! cross outside their rims, and the ray is still correct. There is no epsilon anywhere, so a lens
//! scaled by a power of two gives the same directions to the last bit.

use glam::DVec3;

use crate::lens::trace::element::Element;
use crate::lens::trace::intersect::SurfaceHit;
use crate::lens::trace::ray::{LensRay, Loss, LossKind, Toward, unit};

/// Traces rays through all surfaces in one direction.
pub(crate) struct Tracer<'a> {
    /// The surfaces from front to rear.
    pub elements: &'a [Element],
    pub toward: Toward,
    /// Whether apertures block rays. If not, a ray is lost only if it misses a surface or is
    /// totally reflected.
    pub apertures: bool,
}

impl Tracer<'_> {
    /// The surface that a ray meets as number `i`, and what is added to z, in millimeters, to make
    /// positions relative to its vertex. Before, they are relative to the vertex of the surface
    /// before it.
    #[inline(always)]
    pub(crate) fn leg(&self, i: usize) -> (usize, f64) {
        let surface = match self.toward {
            Toward::Film => i,
            Toward::Scene => self.elements.len() - 1 - i,
        };
        let shift = match self.toward {
            _ if i == 0 => -self.elements[surface].vertex_z,
            Toward::Film => -self.elements[surface - 1].gap,
            Toward::Scene => self.elements[surface].gap,
        };
        (surface, shift)
    }

    /// Traces a ray. `at_hit` is called with the surface and the point of every hit, including the
    /// last hit of a lost ray.
    pub(crate) fn follow(
        &self,
        ray: LensRay,
        mut at_hit: impl FnMut(usize, DVec3),
    ) -> Result<LensRay, Loss> {
        self.walk(ray, |surface, _, hit| {
            at_hit(surface, self.elements[surface].placed(hit.point));
        })
    }

    /// Traces a ray. `at_hit` is called with the surface, the direction of the ray that arrives,
    /// and the hit relative to the vertex.
    pub(crate) fn walk(
        &self,
        ray: LensRay,
        mut at_hit: impl FnMut(usize, DVec3, &SurfaceHit),
    ) -> Result<LensRay, Loss> {
        let count = self.elements.len();
        let first = match self.toward {
            Toward::Film => 0,
            Toward::Scene => count.saturating_sub(1),
        };
        let missed = Loss {
            kind: LossKind::Missed,
            surface: first,
        };
        let mut d = unit(ray.direction).ok_or(missed)?;
        if !ray.origin.is_finite() {
            return Err(missed);
        }
        let toward = self.toward;
        // `p` is relative to the vertex of the surface, so that it keeps its digits behind a long
        // gap.
        let mut p = ray.origin;
        let mut vertex_z = 0.0;
        for i in 0..count {
            let (surface, shift) = self.leg(i);
            let element = &self.elements[surface];
            vertex_z = element.vertex_z;
            p.z += shift;
            let lost = |kind| Loss { kind, surface };
            element.enter(toward, &mut p, &mut d);
            (p, d) = (element.arriving(toward, p), element.arriving(toward, d));
            let hit = element
                .intersect(p, d, element.sign(toward))
                .ok_or(lost(LossKind::Missed))?;
            at_hit(surface, d, &hit);
            if self.apertures && !element.is_open_at(hit.point) {
                return Err(lost(LossKind::Blocked));
            }
            d = element
                .bend(d, &hit, toward)
                .ok_or(lost(LossKind::TotalReflection))?;
            (p, d) = (
                element.leaving(toward, hit.point),
                element.leaving(toward, d),
            );
            element.leave(toward, &mut p, &mut d);
        }
        Ok(LensRay::new(p + vertex_z * DVec3::Z, d))
    }
}
