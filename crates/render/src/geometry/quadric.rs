//! Spheres, cylinders, cones and their caps as exact surfaces instead of meshes.
//!
//! A ray is transformed to object space and intersected there in f64. A sphere at a thousand radii
//! therefore keeps its outline, and a non-uniform scale needs no special case.

use glam::{DAffine3, DVec2, DVec3, Vec3};
use ivcam_base::math;
use ivcam_base::math::lanes::{LANES, Lanes, RaysInLanes, SimdKernel, bits, dispatch, of_lane};

/// A surface of revolution about the y axis of object space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum QuadricKind {
    /// A sphere around the origin.
    Sphere { radius: f64 },
    /// The side of a cylinder from y = −half_height to y = +half_height.
    CylinderSide { radius: f64, half_height: f64 },
    /// The side of a cone with its tip at y = +half_height and its base at y = −half_height.
    ConeSide { radius: f64, half_height: f64 },
    /// The part of a sphere or a plane whose distance from the y axis is between `inner` and
    /// `outer`. The vertex is the origin and the center is at y = 1/curvature. It faces up. A lens
    /// surface is a zone.
    Zone {
        curvature: f64,
        inner: f64,
        outer: f64,
    },
    /// A disc at the height y that faces up or down.
    Disc { radius: f64, y: f64, up: bool },
}

/// A quadric surface in the scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quadric {
    /// The surface in object space.
    pub kind: QuadricKind,
    /// The matrix from object space to the scene.
    pub scene_from_object: DAffine3,
    /// The inverse matrix.
    pub object_from_scene: DAffine3,
    /// The index of the material among those of the shape.
    pub material: u32,
    /// Whether the matrix mirrors the shape.
    pub mirrored: bool,
    /// A sphere around the surface.
    around: BoundingSphere,
}

/// A sphere around a surface. Most rays that enter a surface's box miss the sphere, and the test is
/// much faster than the exact intersection.
#[derive(Clone, Copy, Debug)]
struct BoundingSphere {
    center: Vec3,
    /// The square of the radius, enlarged by the rounding error of the center.
    square: f32,
}

/// A bound of the relative error of the squared distance between a ray and a center, from rounding.
/// Each term is within 32 ulps of the distance from the ray's origin to the center.
const SQUARE_ERROR: f32 = 1e-8;

impl BoundingSphere {
    /// Returns a sphere around a surface in the scene. It is exact for a sphere whose matrix keeps
    /// its axes orthogonal.
    fn of(kind: QuadricKind, matrix: &DAffine3) -> Self {
        let (min, max) = exact_bounds(kind, matrix);
        let center = 0.5 * (min + max);
        let mut radius = 0.5 * (max - min).length();
        if let QuadricKind::Sphere { radius: own } = kind {
            // The largest row sum of MᵀM bounds the square of the largest stretch.
            let product = matrix.matrix3.transpose() * matrix.matrix3;
            let rows = [product.x_axis, product.y_axis, product.z_axis];
            let stretch = rows.map(|row| row.abs().element_sum());
            let square = stretch.into_iter().fold(0.0, f64::max);
            radius = radius.min(own.abs() * square.sqrt());
        }
        let rounding = f64::from(f32::EPSILON) * center.abs().max_element();
        Self {
            center: center.as_vec3(),
            square: (1.001 * (radius + 2.0 * rounding).powi(2)) as f32,
        }
    }

    /// Whether a ray may enter the sphere from distance 0 to `t_max`.
    #[inline(always)]
    fn may_hit(&self, origin: Vec3, direction: Vec3, t_max: f32) -> bool {
        let from = origin - self.center;
        let square = direction.length_squared();
        let along = -from.dot(direction) / square;
        // The squared distance between the center and the nearest point of the ray.
        let beyond = (along - t_max).max(-along).max(0.0);
        let off = (from + along * direction).length_squared() + beyond * beyond * square;
        // Not greater, so that a ray with NaN is kept.
        !(off > self.square + SQUARE_ERROR * from.length_squared())
    }
}

impl Quadric {
    /// Makes a surface. Returns `None` if the matrix has no inverse, because no ray hits a
    /// flattened shape.
    pub(crate) fn new(
        kind: QuadricKind,
        scene_from_object: DAffine3,
        material: u32,
    ) -> Option<Self> {
        let object_from_scene = scene_from_object.inverse();
        object_from_scene.is_finite().then_some(Self {
            kind,
            scene_from_object,
            object_from_scene,
            material,
            mirrored: scene_from_object.matrix3.determinant() < 0.0,
            around: BoundingSphere::of(kind, &scene_from_object),
        })
    }

    /// Whether a ray may intersect the surface from distance 0 to `t_max`. It is a test in f32 that
    /// most rays fail without the exact intersection.
    #[inline]
    pub(crate) fn may_hit(&self, origin: Vec3, direction: Vec3, t_max: f32) -> bool {
        self.around.may_hit(origin, direction, t_max)
    }

    /// Returns the near and the far distance at which a ray intersects the surface. A distance is
    /// NaN if there is no such intersection.
    pub(crate) fn intersect(&self, origin: DVec3, direction: DVec3) -> [f64; 2] {
        let o = self.object_from_scene.transform_point3(origin);
        let d = self.object_from_scene.transform_vector3(direction);
        match self.kind {
            QuadricKind::Sphere { radius } => sphere(o, d, radius),
            QuadricKind::CylinderSide {
                radius,
                half_height,
            } => cylinder_side(o, d, radius, half_height),
            QuadricKind::ConeSide {
                radius,
                half_height,
            } => cone_side(o, d, radius, half_height),
            QuadricKind::Zone {
                curvature,
                inner,
                outer,
            } => zone(o, d, curvature, [inner, outer]),
            QuadricKind::Disc { radius, y, .. } => disc(o, d, radius, y),
        }
    }

    /// Computes [`Quadric::intersect`] for rays in lanes, to the same bits. Returns a bit mask of
    /// the lanes whose rays may intersect the surface from distance 0 to their `t_max`; only these
    /// lanes of `distances` are set.
    pub(crate) fn intersect_lanes(
        &self,
        rays: RaysInLanes<'_>,
        lanes: u32,
        distances: &mut [Lanes<f32>; 2],
    ) -> u32 {
        let near = lanes & dispatch(MayHit(&self.around, rays));
        if near.count_ones() > FEW {
            dispatch(Intersect {
                quadric: self,
                rays,
                distances,
            });
            return near;
        }
        for lane in bits(near) {
            let [origin, direction] = [rays.origin, rays.direction].map(|v| of_lane(v, lane));
            let found = self.intersect(origin.as_dvec3(), direction.as_dvec3());
            (distances[0][lane], distances[1][lane]) = (found[0] as f32, found[1] as f32);
        }
        near
    }

    /// Projects a hit point onto the surface, which removes the rounding error of the ray's
    /// distance. Returns the point and the outward normal, both in object space.
    pub(crate) fn project_to_surface(&self, scene_point: DVec3) -> (DVec3, DVec3) {
        let p = self.object_from_scene.transform_point3(scene_point);
        match self.kind {
            QuadricKind::Sphere { radius } => {
                let n = p.normalize_or(DVec3::Y);
                (n * radius, n)
            }
            QuadricKind::CylinderSide { radius, .. } => {
                let n = DVec3::new(p.x, 0.0, p.z).normalize_or(DVec3::Z);
                (n * radius + DVec3::Y * p.y, n)
            }
            QuadricKind::ConeSide {
                radius,
                half_height,
            } => {
                let k = radius / (2.0 * half_height);
                let out = DVec3::new(p.x, 0.0, p.z).normalize_or(DVec3::Z);
                let at = out * (k * (half_height - p.y)) + DVec3::Y * p.y;
                (at, (out + DVec3::Y * k).normalize())
            }
            QuadricKind::Zone { curvature: c, .. } => {
                // This is one Newton step along the gradient of y − ½ c |p|².
                let n = DVec3::new(-c * p.x, 1.0 - c * p.y, -c * p.z);
                let length = n.length();
                let off = 0.5 * (c * p.length_squared() - 2.0 * p.y) / length;
                let n = n / length;
                (p + off * n, n)
            }
            QuadricKind::Disc { y, up, .. } => {
                let n = if up { DVec3::Y } else { DVec3::NEG_Y };
                (DVec3::new(p.x, y, p.z), n)
            }
        }
    }

    /// Returns Inventor's texture coordinates. On sides and spheres s runs around from the back and
    /// t runs up. On caps the texture is upright as seen from outside; on the top one −z is up.
    pub(crate) fn texture_coordinates(&self, p: DVec3) -> DVec2 {
        let around = || {
            let turn = libm::atan2(p.x, p.z) / std::f64::consts::TAU;
            turn + 0.5
        };
        match self.kind {
            QuadricKind::Sphere { radius } => {
                let v = libm::asin((p.y / radius).clamp(-1.0, 1.0)) / std::f64::consts::PI + 0.5;
                DVec2::new(around(), v)
            }
            QuadricKind::CylinderSide { half_height, .. }
            | QuadricKind::ConeSide { half_height, .. } => {
                DVec2::new(around(), 0.5 + 0.5 * p.y / half_height)
            }
            QuadricKind::Zone { outer, .. } => {
                DVec2::new(0.5 + 0.5 * p.x / outer, 0.5 - 0.5 * p.z / outer)
            }
            QuadricKind::Disc { radius, up, .. } => {
                let v = if up { -p.z } else { p.z };
                DVec2::new(0.5 + 0.5 * p.x / radius, 0.5 + 0.5 * v / radius)
            }
        }
    }

    /// Returns the coordinates in a 3D texture, from 0 to 1 along each side of the shape's box.
    pub(crate) fn volume_coordinates(&self, p: DVec3) -> DVec3 {
        let (radius, half_height) = match self.kind {
            QuadricKind::Sphere { radius } => (radius, radius),
            QuadricKind::CylinderSide {
                radius,
                half_height,
            }
            | QuadricKind::ConeSide {
                radius,
                half_height,
            } => (radius, half_height),
            QuadricKind::Zone { outer, .. } => (outer, outer),
            QuadricKind::Disc { radius, y, .. } => (radius, y.abs()),
        };
        let half = DVec3::new(radius, half_height, radius).max(DVec3::splat(1e-300));
        0.5 * p / half + 0.5
    }

    /// Returns the exact bounding box of the surface in the scene.
    pub(crate) fn bounds(&self) -> (DVec3, DVec3) {
        exact_bounds(self.kind, &self.scene_from_object)
    }
}

/// Returns the exact bounding box of a surface under a matrix. For each axis it uses the support
/// function of an ellipse or an ellipsoid, and the cone's tip.
pub(crate) fn exact_bounds(kind: QuadricKind, matrix: &DAffine3) -> (DVec3, DVec3) {
    let m = matrix.matrix3;
    let ring = |radius: f64, y: f64| {
        let center = matrix.transform_point3(DVec3::Y * y);
        let reach = (m.x_axis * m.x_axis + m.z_axis * m.z_axis).map(f64::sqrt) * radius;
        (center - reach, center + reach)
    };
    match kind {
        QuadricKind::Sphere { radius } => {
            let squares = m.x_axis * m.x_axis + m.y_axis * m.y_axis + m.z_axis * m.z_axis;
            let reach = squares.map(f64::sqrt) * radius;
            (matrix.translation - reach, matrix.translation + reach)
        }
        QuadricKind::CylinderSide {
            radius,
            half_height,
        } => join(ring(radius, half_height), ring(radius, -half_height)),
        QuadricKind::ConeSide {
            radius,
            half_height,
        } => {
            let tip = matrix.transform_point3(DVec3::Y * half_height);
            join(ring(radius, -half_height), (tip, tip))
        }
        QuadricKind::Zone {
            curvature, outer, ..
        } => join(ring(outer, 0.0), ring(outer, sag(curvature, outer))),
        QuadricKind::Disc { radius, y, .. } => ring(radius, y),
    }
}

/// Returns the height of a sphere above its vertex, at a distance from the axis within its radius.
pub(super) fn sag(curvature: f64, off: f64) -> f64 {
    let square = (1.0 - (curvature * off) * (curvature * off)).max(0.0);
    curvature * off * off / (1.0 + square.sqrt())
}

/// Returns the bounding box of two boxes.
fn join(a: (DVec3, DVec3), b: (DVec3, DVec3)) -> (DVec3, DVec3) {
    (a.0.min(b.0), a.1.max(b.1))
}

/// The largest number of rays that are intersected one by one.
const FEW: u32 = 2;

/// Tests rays against a bounding sphere.
struct MayHit<'a>(&'a BoundingSphere, RaysInLanes<'a>);

impl SimdKernel for MayHit<'_> {
    /// A bit mask of the lanes whose rays may enter the sphere.
    type Output = u32;

    #[inline(always)]
    fn run<const FUSED: bool>(self) -> u32 {
        let Self(sphere, rays) = self;
        let mut may = [0u32; LANES];
        for (i, may) in may.iter_mut().enumerate() {
            let (origin, direction) = (of_lane(rays.origin, i), of_lane(rays.direction, i));
            *may = u32::from(sphere.may_hit(origin, direction, rays.t_max[i]));
        }
        (0..LANES).fold(0, |all, i| all | may[i] << i)
    }
}

/// Computes [`Quadric::intersect`] in all lanes.
struct Intersect<'a> {
    quadric: &'a Quadric,
    rays: RaysInLanes<'a>,
    distances: &'a mut [Lanes<f32>; 2],
}

impl Intersect<'_> {
    #[inline(always)]
    fn each(self, distances: impl Fn(DVec3, DVec3) -> [f64; 2]) {
        let matrix = &self.quadric.object_from_scene;
        let [near, far] = self.distances;
        for i in 0..LANES {
            let origin = of_lane(self.rays.origin, i).as_dvec3();
            let direction = of_lane(self.rays.direction, i).as_dvec3();
            let found = distances(
                matrix.transform_point3(origin),
                matrix.transform_vector3(direction),
            );
            (near[i], far[i]) = (found[0] as f32, found[1] as f32);
        }
    }
}

impl SimdKernel for Intersect<'_> {
    type Output = ();

    /// The operations are not fused, so that single rays have the same hits.
    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        match self.quadric.kind {
            QuadricKind::Sphere { radius } => self.each(|o, d| sphere(o, d, radius)),
            QuadricKind::CylinderSide {
                radius,
                half_height,
            } => self.each(|o, d| cylinder_side(o, d, radius, half_height)),
            QuadricKind::ConeSide {
                radius,
                half_height,
            } => self.each(|o, d| cone_side(o, d, radius, half_height)),
            QuadricKind::Zone {
                curvature,
                inner,
                outer,
            } => self.each(|o, d| zone(o, d, curvature, [inner, outer])),
            QuadricKind::Disc { radius, y, .. } => self.each(|o, d| disc(o, d, radius, y)),
        }
    }
}

// The functions below return the distances at which the ray from `o` along `d` hits a surface in
// object space, near and far, or NaN. They choose between values instead of branching, so that they
// can be vectorized.

/// Intersects a ray with a sphere. The discriminant is computed from the foot of the perpendicular.
/// The usual form b² − ac would be a difference of two large numbers for a distant sphere.
#[inline(always)]
fn sphere(o: DVec3, d: DVec3, radius: f64) -> [f64; 2] {
    let dd = d.length_squared();
    let b = -o.dot(d);
    let foot = o + (b / dd) * d;
    let disc = radius * radius - foot.length_squared();
    let c = o.length_squared() - radius * radius;
    let q = b + (disc * dd).sqrt().copysign(b);
    let two = sorted(c / q, q / dd);
    if dd == 0.0 {
        [f64::NAN; 2]
    } else if q == 0.0 {
        [0.0, f64::NAN]
    } else {
        two
    }
}

#[inline(always)]
fn cylinder_side(o: DVec3, d: DVec3, radius: f64, half_height: f64) -> [f64; 2] {
    let a = d.x * d.x + d.z * d.z;
    let b = o.x * d.x + o.z * d.z;
    let c = o.x * o.x + o.z * o.z - radius * radius;
    keep(roots(a, b, c), |t| (o.y + t * d.y).abs() <= half_height)
}

/// Intersects a ray with the part −h ≤ y ≤ h of the cone x² + z² = k²(h − y)².
#[inline(always)]
fn cone_side(o: DVec3, d: DVec3, radius: f64, half_height: f64) -> [f64; 2] {
    let k = radius / (2.0 * half_height);
    let (k2, y) = (k * k, half_height - o.y);
    let a = d.x * d.x + d.z * d.z - k2 * d.y * d.y;
    let b = o.x * d.x + o.z * d.z + k2 * y * d.y;
    let c = o.x * o.x + o.z * o.z - k2 * y * y;
    keep(roots(a, b, c), |t| (o.y + t * d.y).abs() <= half_height)
}

/// Intersects a ray with the part of the sphere c |p|² = 2 y between two distances from the axis,
/// in the half with the vertex.
#[inline(always)]
fn zone(o: DVec3, d: DVec3, c: f64, [inner, outer]: [f64; 2]) -> [f64; 2] {
    let a = c * d.length_squared();
    let b = c * o.dot(d) - d.y;
    let found = roots(a, b, c * o.length_squared() - 2.0 * o.y);
    keep(found, |t| {
        let p = o + t * d;
        let off = p.x * p.x + p.z * p.z;
        (off >= inner * inner) & (off <= outer * outer) & (c * p.y <= 1.0)
    })
}

#[inline(always)]
fn disc(o: DVec3, d: DVec3, radius: f64, y: f64) -> [f64; 2] {
    let t = (y - o.y) / d.y;
    let p = DVec2::new(o.x + t * d.x, o.z + t * d.z);
    let inside = (d.y != 0.0) & (p.length_squared() <= radius * radius);
    [if inside { t } else { f64::NAN }, f64::NAN]
}

/// Returns the roots of a t² + 2 b t + c. The discriminant is computed by Kahan's difference of
/// products.
#[inline(always)]
fn roots(a: f64, b: f64, c: f64) -> [f64; 2] {
    let disc = math::diff_of_products(b, b, a, c);
    let q = -(b + disc.sqrt().copysign(b));
    let two = sorted(q / a, c / q);
    let single = if b == 0.0 { f64::NAN } else { -0.5 * c / b };
    if a == 0.0 {
        [single, f64::NAN]
    } else if q == 0.0 {
        [0.0, f64::NAN]
    } else {
        two
    }
}

#[inline(always)]
fn sorted(s: f64, t: f64) -> [f64; 2] {
    [s.min(t), s.max(t)]
}

#[inline(always)]
fn keep(roots: [f64; 2], inside: impl Fn(f64) -> bool) -> [f64; 2] {
    roots.map(|t| if inside(t) { t } else { f64::NAN })
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivcam_base::math::lanes::set_lane;

    fn plain(kind: QuadricKind) -> Quadric {
        Quadric::new(kind, DAffine3::IDENTITY, 0).expect("the identity has an inverse")
    }

    #[test]
    fn a_ray_along_the_axis_hits_a_sphere_at_its_poles() {
        let q = plain(QuadricKind::Sphere { radius: 2.0 });
        let [near, far] = q.intersect(DVec3::new(0.0, 0.0, 1e6), DVec3::NEG_Z);
        assert!((near - (1e6 - 2.0)).abs() < 1e-9);
        assert!((far - (1e6 + 2.0)).abs() < 1e-9);
    }

    #[test]
    fn a_cone_is_half_as_wide_at_half_its_height() {
        let q = plain(QuadricKind::ConeSide {
            radius: 1.0,
            half_height: 1.0,
        });
        let [near, far] = q.intersect(DVec3::new(5.0, 0.0, 0.0), DVec3::NEG_X);
        assert!((near - 4.5).abs() < 1e-12);
        assert!((far - 5.5).abs() < 1e-12);
    }

    #[test]
    fn a_zone_is_the_surface_of_the_sphere_within_its_rim() {
        let (radius, outer) = (2.0, 1.0);
        let zone = plain(QuadricKind::Zone {
            curvature: -1.0 / radius,
            inner: 0.0,
            outer,
        });
        // The center is at y = −2, so at x = 0.5 the surface is at y = −2 + √(4 − 0.25).
        let from = |x: f64| zone.intersect(DVec3::new(x, 5.0, 0.0), DVec3::NEG_Y)[0];
        let expected = 5.0 + 2.0 - 3.75f64.sqrt();
        assert!((from(0.5) - expected).abs() < 1e-14);
        assert!(from(1.01).is_nan());
        let (_, normal) = zone.project_to_surface(DVec3::new(0.5, -2.0 + 3.75f64.sqrt(), 0.0));
        assert!((normal - DVec3::new(0.25, 3.75f64.sqrt() / 2.0, 0.0)).length() < 1e-14);
    }

    #[test]
    fn a_rotated_sphere_has_the_box_of_the_sphere() {
        let turn = DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
        let (min, max) = exact_bounds(QuadricKind::Sphere { radius: 3.0 }, &turn);
        assert!((min + 3.0).abs().max_element() < 1e-12);
        assert!((max - 3.0).abs().max_element() < 1e-12);
    }

    #[test]
    fn rays_in_lanes_have_the_hits_of_single_rays_to_the_bit() {
        let (radius, half_height) = (1.25, 0.75);
        let kinds = [
            QuadricKind::Sphere { radius },
            QuadricKind::CylinderSide {
                radius,
                half_height,
            },
            QuadricKind::ConeSide {
                radius,
                half_height,
            },
            QuadricKind::Zone {
                curvature: -0.5,
                inner: 0.25,
                outer: radius,
            },
            QuadricKind::Disc {
                radius,
                y: 0.5,
                up: true,
            },
        ];
        let mut state = 1u64;
        let mut unit = move || {
            state = ivcam_optics::sampling::mix(state);
            (state >> 40) as f32 / (1u64 << 24) as f32 - 0.5
        };
        for kind in kinds {
            let mut hits = 0;
            for round in 0..300 {
                let matrix = DAffine3::from_scale_rotation_translation(
                    DVec3::new(1.0, f64::from(1.5 + unit()), 0.75),
                    glam::DQuat::from_rotation_x(f64::from(7.0 * unit())),
                    DVec3::new(f64::from(unit()), 0.5, 0.25),
                );
                let quadric = Quadric::new(kind, matrix, 0).expect("an inverse");
                let (mut origin, mut direction) = Default::default();
                let mut t_max = [f32::INFINITY; LANES];
                for lane in 0..LANES {
                    let from = Vec3::new(unit(), unit(), unit()) * 20.0;
                    let to = Vec3::new(unit(), unit(), unit()) * 2.0;
                    // Some rays are along an axis, and some have no length.
                    let along = [to - from, Vec3::Y, Vec3::NEG_X, Vec3::ZERO];
                    set_lane(&mut origin, lane, from);
                    set_lane(
                        &mut direction,
                        lane,
                        along[if lane < 24 { 0 } else { lane % 4 }],
                    );
                    t_max[lane] = [f32::INFINITY, 1.0, 0.5][lane % 3];
                }
                let rays = RaysInLanes {
                    origin: &origin,
                    direction: &direction,
                    t_max: &t_max,
                };
                // With few lanes the rays are intersected one by one.
                let lanes = if round % 2 == 0 { u32::MAX } else { 0b1001 };
                let mut distances = [[0.0; LANES]; 2];
                let may = quadric.intersect_lanes(rays, lanes, &mut distances);
                assert_eq!(may & !lanes, 0);
                for lane in bits(lanes) {
                    let [o, d] = [&origin, &direction].map(|v| of_lane(v, lane).as_dvec3());
                    let known = quadric.intersect(o, d).map(|t| t as f32);
                    let found = [distances[0][lane], distances[1][lane]];
                    if may >> lane & 1 == 1 {
                        let same = |(a, b): (f32, f32)| a == b || a.is_nan() && b.is_nan();
                        let all = found.into_iter().zip(known).all(same);
                        assert!(all, "{kind:?}: {found:?} {known:?}");
                    } else {
                        let lost = known.iter().any(|t| *t > 0.0 && *t < t_max[lane]);
                        assert!(!lost, "{kind:?}: {o} {d} {known:?}");
                    }
                    hits += usize::from(known[0] > 0.0);
                }
            }
            assert!(hits > 500, "{kind:?}: {hits}");
        }
    }
}
