//! Points on triangles of plain surfaces, whose material is the same everywhere.
//!
//! [`RenderScene::point`] gathers everything that any surface may have. Light paths meet mostly
//! plain triangles, of which they need a place and a normal.

use glam::Vec3;
use ivcam_inventor::traversal::state::FogKind;

use super::looks::Surface;
use super::point::{Point, clear_of};
use super::render_scene::RenderScene;
use super::sight::clearance;
use crate::bvh::{Hit, Ray};

/// Where a light path meets a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MetPoint {
    /// The position in meters.
    pub position: Vec3,
    /// The geometric normal, of length 1, on the side that the ray came from.
    pub geometric: Vec3,
    /// The normal for lighting, as in the file.
    pub normal: Vec3,
    /// The distance from the surface at which a ray starts, in meters.
    pub clearance: f32,
}

impl MetPoint {
    /// Returns a ray from the point in any direction, also along its surface.
    ///
    /// Where a ray meets the plane that it starts on, the distance has an error of a few ulps of
    /// the largest coordinate of the point or of the triangle's corners, whatever the plane's
    /// direction. So the ray starts that far from the surface. [`Point::leave`] allows only for the
    /// error of the position: from a floor at the camera's height, 17% of the rays of a cosine lobe
    /// met the floor again.
    #[inline]
    pub(crate) fn leave(&self, direction: Vec3) -> Ray {
        let side = match direction.dot(self.geometric) < 0.0 {
            true => -self.geometric,
            false => self.geometric,
        };
        let origin = [0, 1, 2].map(|i| clear_of(self.position[i], side[i], self.clearance));
        Ray::new(Vec3::from_array(origin), direction)
    }
}

impl Point<'_> {
    /// The place of the point.
    pub(crate) fn met(&self) -> MetPoint {
        MetPoint {
            position: self.position,
            geometric: self.geometric,
            normal: self.normal,
            clearance: self.clearance(),
        }
    }
}

/// What the points of a plain surface need of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlainSurface {
    first: u32,
    counterclockwise: bool,
    two_sided: bool,
    has_normals: bool,
}

impl PlainSurface {
    /// The values of a surface; `None` if it is not plain: it has textures, transparent parts, fog
    /// or several materials.
    pub(crate) fn of(surface: &Surface) -> Option<Self> {
        let is_plain = surface.textures().next().is_none()
            && surface.is_opaque()
            && surface.materials.is_empty()
            && surface.environment.fog == FogKind::None;
        is_plain.then_some(Self {
            first: surface.first,
            counterclockwise: surface.counterclockwise,
            two_sided: surface.two_sided,
            has_normals: !surface.normals.is_empty(),
        })
    }

    /// A point of the surface, as far as its material depends on it.
    pub(crate) fn any_point(surface: &Surface) -> Point<'_> {
        let limit = Vec3::splat(surface.diffuse_limit());
        Point {
            position: Vec3::ZERO,
            geometric: Vec3::Z,
            normal: Vec3::Z,
            front: true,
            diffuse: surface.diffuse_at(0).clamp(Vec3::ZERO, limit),
            transparency: 0.0,
            texel: None,
            overlay: None,
            surface,
            error: 0.0,
            extent: 0.0,
        }
    }
}

impl RenderScene {
    /// The corners of the triangle that was hit; `None` if it is no triangle, or one of a
    /// prototype.
    #[inline(always)]
    pub(crate) fn own_corners(&self, hit: &Hit) -> Option<[Vec3; 3]> {
        let corners = self.triangles.get(hit.primitive as usize);
        corners.filter(|_| hit.place == 0).copied()
    }

    /// Returns the place of a hit on a triangle of a plain surface, as [`RenderScene::point`] has
    /// it; `None` if the triangle is too small for its normal to be known at once.
    #[inline(always)]
    pub(crate) fn plain_point(
        &self,
        (ray, hit): (&Ray, &Hit),
        [a, b, c]: &[Vec3; 3],
        plain: &PlainSurface,
    ) -> Option<MetPoint> {
        let across = (b - a).cross(c - a);
        let length = across.length();
        if !(length > 1e-30) {
            return None;
        }
        let outward = across / length;
        let along = outward.dot(ray.direction);
        let (own, u, v) = (1.0 - hit.u - hit.v, hit.u, hit.v);
        let geometric = if along > 0.0 { -outward } else { outward };
        let sum = a.abs() * own + b.abs() * u + c.abs() * v;
        let position = a * own + b * u + c * v;
        let error = 8.0 * f32::EPSILON * sum.dot(geometric.abs());
        let mut normal = match plain.counterclockwise {
            true => outward,
            false => -outward,
        };
        if plain.has_normals {
            let surface = self.surface(hit);
            let local = (hit.primitive - plain.first) as usize;
            if let Some([a, b, c]) = surface.normals.get(local) {
                normal = (a * own + b * u + c * v).normalize_or_zero();
            }
        }
        let front = (along < 0.0) == plain.counterclockwise;
        if plain.two_sided && !front {
            normal = -normal;
        }
        Some(MetPoint {
            position,
            geometric,
            normal,
            clearance: clearance(position, error, sum.max_element()),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::CompileOptions;
    use ivcam_inventor::iv::Document;
    use ivcam_inventor::snapshot::Snapshot;

    #[test]
    fn a_plain_point_is_the_point_of_the_hit_bit_by_bit() {
        let faces = "IndexedFaceSet { coordIndex [ 0,1,2,-1, 3,1,0,-1 ] }";
        let text = format!(
            "#Inventor V2.1 ascii\nShapeHints {{ creaseAngle 2 }} \
             Coordinate3 {{ point [ -1 0 0, 1 .2 0, 0 1 .5, .3 -1 -.4 ] }} {faces} \
             ShapeHints {{ creaseAngle 0 vertexOrdering CLOCKWISE }} \
             Translation {{ translation .2 .1 -2 }} {faces} \
             ShapeHints {{ vertexOrdering COUNTERCLOCKWISE shapeType UNKNOWN_SHAPE_TYPE }} \
             Translation {{ translation -.3 0 -2 }} {faces}"
        );
        let document = Document::read_headerless("p.iv", text.into()).unwrap();
        let snapshot = Snapshot::at(&document, 0.0);
        let scene = RenderScene::compile(&snapshot, &CompileOptions::default()).unwrap();
        let mut met = 0;
        for i in 0..600u16 {
            let at = |k: u16| f32::from(k) / 12.0 - 1.0;
            let side = if i % 2 == 0 { 5.0 } else { -9.0 };
            let from = Vec3::new(0.1, 0.2, side);
            let aim = Vec3::new(at(i % 25), at(i / 25), -2.0);
            let ray = Ray::new(from, aim - from);
            let Some(hit) = scene.hit(&ray) else { continue };
            let known = scene.point(&ray, &hit).met();
            let plain = PlainSurface::of(scene.surface(&hit)).unwrap();
            let corners = scene.own_corners(&hit).unwrap();
            let found = scene.plain_point((&ray, &hit), &corners, &plain).unwrap();
            assert_eq!(format!("{known:?}"), format!("{found:?}"));
            met += 1;
        }
        assert!(met > 200, "{met}");
    }
}
