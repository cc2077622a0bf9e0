//! Traces a ray through a prescription, surface by surface, in lens space.
//!
//! Lens space is millimeters. Light travels toward +z, the first vertex is the origin, the film
//! is at positive z. Nothing here knows about scenes or pixels; `camera` does the crossing.
//!
//! Between two surfaces a ray may run backwards (t < 0): thin edges and zero gaps make surfaces
//! cross outside their rims, and the ray is still right. There is no epsilon anywhere, so a lens
//! scaled by a power of two gives the same directions to the last bit.

use glam::DVec3;

use crate::lens::trace::element::Element;
use crate::lens::trace::meet::Hit;
use crate::lens::trace::ray::{LensRay, Loss, LossKind, Toward, unit};
use crate::lens::trace::refraction::refract;

/// A trace through all surfaces, in one direction.
pub(crate) struct Tracer<'a> {
    pub elements: &'a [Element],
    pub toward: Toward,
    /// Whether semi-diameters block rays. If not, only the surfaces themselves end a ray.
    pub apertures: bool,
}

impl Tracer<'_> {
    /// Follows a ray from surface to surface. `at_hit` is called at every hit, the last one of a lost
    /// ray included.
    pub(crate) fn follow(
        &self,
        ray: LensRay,
        mut at_hit: impl FnMut(usize, DVec3),
    ) -> Result<LensRay, Loss> {
        self.walk(ray, |surface, vertex_z, hit| {
            at_hit(surface, hit.point + vertex_z * DVec3::Z);
        })
    }

    /// Follows a ray. `at_hit` is called with the surface, the z of its vertex, and the hit relative to
    /// that vertex.
    pub(crate) fn walk(
        &self,
        ray: LensRay,
        mut at_hit: impl FnMut(usize, f64, &Hit),
    ) -> Result<LensRay, Loss> {
        let count = self.elements.len();
        let first = if self.toward == Toward::Film {
            0
        } else {
            count.saturating_sub(1)
        };
        let missed = Loss {
            kind: LossKind::Missed,
            surface: first,
        };
        let mut d = unit(ray.direction).ok_or(missed)?;
        if !ray.origin.is_finite() {
            return Err(missed);
        }
        let sign = if self.toward == Toward::Film {
            1.0
        } else {
            -1.0
        };
        // `p` is from the vertex of the surface, so positions keep their digits behind a long gap.
        let mut p = ray.origin;
        let mut vertex_z = 0.0;
        for i in 0..count {
            let surface = if self.toward == Toward::Film {
                i
            } else {
                count - 1 - i
            };
            let element = &self.elements[surface];
            vertex_z = element.vertex_z;
            p.z += match self.toward {
                _ if i == 0 => -vertex_z,
                Toward::Film => -self.elements[surface - 1].gap,
                Toward::Scene => element.gap,
            };
            let lost = |kind| Loss { kind, surface };
            let hit = element.meet(p, d, sign).ok_or(lost(LossKind::Missed))?;
            p = hit.point;
            at_hit(surface, vertex_z, &hit);
            let r2 = p.x * p.x + p.y * p.y;
            if self.apertures && !(r2 <= element.clear && element.is_open_at(p)) {
                return Err(lost(LossKind::Blocked));
            }
            d = refract(d, &hit, element.bend(self.toward), sign)
                .ok_or(lost(LossKind::TotalReflection))?;
        }
        Ok(LensRay {
            origin: p + vertex_z * DVec3::Z,
            direction: d,
        })
    }
}
