//! Points on triangles of plain surfaces, worked out side by side.
//!
//! A plain surface is lit by its diffuse color and nothing else: no texture, no highlight, no
//! mirror, nothing see-through, no fog. That is most of most scenes. The arithmetic is that of
//! [`super::surface::point`], to rounding.

use glam::Vec3;

use super::wide::bits;
use super::{BUNDLE, Hit, Light, Ray, RenderScene, Surface};
use crate::graph::state::{FogKind, LightKind};
use crate::math::lanes::{Lanewise, widely};

/// A number of every ray of a bundle.
pub type Side = [f32; BUNDLE];

/// A point or direction of every ray, axis by axis.
pub type Sides = [Side; 3];

const ZERO: Sides = [[0.0; BUNDLE]; 3];

/// What lighting needs of the points that a bundle of rays meets.
#[derive(Clone, Debug)]
pub struct PlainPoints {
    /// Which rays meet a plain surface: bits. The others' lanes mean nothing.
    pub mask: u32,
    placed: Placed,
    pub diffuse: Sides,
    /// What the surface gives off without any light.
    pub glow: Sides,
    /// The surface's set of lights.
    pub lights: [u32; BUNDLE],
}

#[derive(Clone, Debug)]
struct Placed {
    position: Sides,
    /// Of length 1, on the side that the ray came from.
    geometric: Sides,
    normal: Sides,
    /// How far rounding may have moved the position.
    error: Side,
    /// Twice the triangle's area.
    area: Side,
}

impl Placed {
    const NOWHERE: Self = Self {
        position: ZERO,
        geometric: ZERO,
        normal: ZERO,
        error: [0.0; BUNDLE],
        area: [0.0; BUNDLE],
    };
}

/// What a bundle asks of a surface, apart from its many other things.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlainSurface {
    diffuse: Vec3,
    glow: Vec3,
    lights: u32,
    first: u32,
    /// 1 where the corners run counterclockwise seen from outside, else −1.
    turn: f32,
    /// 1 where the back is lit like the front, else 0.
    two_sided: f32,
    is_plain: bool,
    /// Corners with normals, or with colors, of their own.
    has_normals: bool,
    has_materials: bool,
}

impl PlainSurface {
    pub fn of(surface: &Surface) -> Self {
        Self {
            diffuse: surface.diffuse_at(0).clamp(Vec3::ZERO, Vec3::ONE),
            glow: surface.glow(),
            lights: surface.lights,
            first: surface.first,
            turn: if surface.counterclockwise { 1.0 } else { -1.0 },
            two_sided: f32::from(u8::from(surface.two_sided)),
            is_plain: surface.texture.is_none()
                && !surface.base_color
                && surface.specular == Vec3::ZERO
                && surface.environment.fog == FogKind::None
                && surface.is_opaque(),
            has_normals: !surface.normals.is_empty(),
            has_materials: !surface.materials.is_empty(),
        }
    }
}

/// Corners, weights and normals, gathered from all over the scene.
struct Gathered {
    corners: [Sides; 3],
    normals: [Sides; 3],
    direction: Sides,
    u: Side,
    v: Side,
    /// 1 where the corners run counterclockwise seen from outside, else −1.
    turn: Side,
    /// 1 where the back is lit like the front, else 0.
    two_sided: Side,
    /// 1 where the corners have normals, else 0.
    smooth: Side,
}

impl RenderScene {
    /// The points of a bundle's hits on plain surfaces.
    pub fn plain_points(&self, rays: &[Ray], hits: &[Option<Hit>; BUNDLE]) -> PlainPoints {
        let mut points = PlainPoints {
            mask: 0,
            placed: Placed::NOWHERE,
            diffuse: ZERO,
            glow: ZERO,
            lights: [0; BUNDLE],
        };
        let mut gathered = Gathered {
            corners: [ZERO; 3],
            normals: [ZERO; 3],
            direction: ZERO,
            u: [0.0; BUNDLE],
            v: [0.0; BUNDLE],
            turn: [1.0; BUNDLE],
            two_sided: [0.0; BUNDLE],
            smooth: [0.0; BUNDLE],
        };
        for (lane, (ray, hit)) in rays.iter().zip(hits).enumerate() {
            if let Some(hit) = hit
                && self.gather(lane, ray, hit, &mut gathered, &mut points)
            {
                points.mask |= 1 << lane;
            }
        }
        if points.mask != 0 {
            points.placed = widely(Settle(&gathered));
            for lane in bits(points.mask) {
                // Triangles of a millionth of a meter square to nothing.
                points.mask &= !(u32::from(!(points.placed.area[lane] > 1e-30)) << lane);
            }
        }
        points
    }

    /// Whether the hit is on a triangle of a plain surface; its lane is filled then.
    #[inline(always)]
    fn gather(
        &self,
        lane: usize,
        ray: &Ray,
        hit: &Hit,
        into: &mut Gathered,
        points: &mut PlainPoints,
    ) -> bool {
        let index = hit.primitive as usize;
        let Some(corners) = self.triangles.get(index) else {
            return false;
        };
        let owner = self.owners[index] as usize;
        let plain = &self.plain[owner];
        if !plain.is_plain {
            return false;
        }
        let put = |to: &mut Sides, v: Vec3| (0..3).for_each(|axis| to[axis][lane] = v[axis]);
        for (to, corner) in into.corners.iter_mut().zip(corners) {
            put(to, *corner);
        }
        let local = index - plain.first as usize;
        if plain.has_normals
            && let Some(normals) = self.surfaces[owner].normals.get(local)
        {
            for (to, normal) in into.normals.iter_mut().zip(normals) {
                put(to, *normal);
            }
            into.smooth[lane] = 1.0;
        }
        put(&mut into.direction, ray.direction);
        (into.u[lane], into.v[lane]) = (hit.u, hit.v);
        (into.turn[lane], into.two_sided[lane]) = (plain.turn, plain.two_sided);
        let diffuse = if plain.has_materials {
            let blend = self.surfaces[owner].diffuse_between(local, hit);
            blend.clamp(Vec3::ZERO, Vec3::ONE)
        } else {
            plain.diffuse
        };
        put(&mut points.diffuse, diffuse);
        put(&mut points.glow, plain.glow);
        points.lights[lane] = plain.lights;
        true
    }
}

impl Surface {
    /// What shines by itself and what the surroundings give.
    pub fn glow(&self) -> Vec3 {
        self.emissive + self.ambient * self.environment.ambient
    }

    /// The diffuse color of one of the surface's triangles where it is hit.
    #[inline(always)]
    fn diffuse_between(&self, triangle: usize, hit: &Hit) -> Vec3 {
        let [a, b, c] = self.materials_of(triangle);
        let first = self.diffuse_at(a);
        if a == b && b == c {
            return first;
        }
        first * (1.0 - hit.u - hit.v) + self.diffuse_at(b) * hit.u + self.diffuse_at(c) * hit.v
    }
}

/// Normals, positions and their errors.
struct Settle<'a>(&'a Gathered);

impl Lanewise for Settle<'_> {
    type Output = Placed;

    #[inline(always)]
    fn run<const FUSED: bool>(self) -> Placed {
        let from = self.0;
        let mut to = Placed::NOWHERE;
        let mut flat = ZERO;
        let [a, b, c] = &from.corners;
        for i in 0..BUNDLE {
            let (ex, fx) = (b[0][i] - a[0][i], c[0][i] - a[0][i]);
            let (ey, fy) = (b[1][i] - a[1][i], c[1][i] - a[1][i]);
            let (ez, fz) = (b[2][i] - a[2][i], c[2][i] - a[2][i]);
            let (nx, ny, nz) = (ey * fz - fy * ez, ez * fx - fz * ex, ex * fy - fx * ey);
            let area = (nx * nx + ny * ny + nz * nz).sqrt();
            let scale = 1.0 / area;
            to.area[i] = area;
            (flat[0][i], flat[1][i], flat[2][i]) = (nx * scale, ny * scale, nz * scale);
        }
        // What the normals are multiplied by: the geometric one, and the one to light with.
        let [mut away, mut lit, mut toward] = [[0.0f32; BUNDLE]; 3];
        for (flat, direction) in flat.iter().zip(&from.direction) {
            for i in 0..BUNDLE {
                toward[i] += flat[i] * direction[i];
            }
        }
        for i in 0..BUNDLE {
            let turn = from.turn[i];
            away[i] = if toward[i] > 0.0 { -1.0 } else { 1.0 };
            // The ray came from outside where this is positive.
            let front = if toward[i] < 0.0 { turn } else { -turn };
            let back = (from.two_sided[i] > 0.0) & (front < 0.0);
            lit[i] = if back { -1.0 } else { 1.0 };
        }
        let [mut size, mut error] = [[0.0f32; BUNDLE]; 2];
        for k in 0..3 {
            let blend = |x: &[Sides; 3], i: usize| {
                let (u, v) = (from.u[i], from.v[i]);
                x[0][k][i] * (1.0 - u - v) + x[1][k][i] * u + x[2][k][i] * v
            };
            for i in 0..BUNDLE {
                let (u, v) = (from.u[i], from.v[i]);
                let reach = a[k][i].abs() * (1.0 - u - v) + b[k][i].abs() * u + c[k][i].abs() * v;
                error[i] += reach * flat[k][i].abs();
                to.position[k][i] = blend(&from.corners, i);
                to.geometric[k][i] = away[i] * flat[k][i];
                let smooth = blend(&from.normals, i);
                size[i] += smooth * smooth;
                to.normal[k][i] = smooth;
            }
        }
        for i in 0..BUNDLE {
            to.error[i] = 8.0 * f32::EPSILON * error[i];
            // Corners without normals, or with such as cancel, leave nothing: unlit.
            size[i] = if size[i] > 0.0 {
                1.0 / size[i].sqrt()
            } else {
                0.0
            };
        }
        for (normal, flat) in to.normal.iter_mut().zip(&flat) {
            for i in 0..BUNDLE {
                let smooth = size[i] * normal[i];
                let own = from.turn[i] * flat[i];
                normal[i] = lit[i] * if from.smooth[i] > 0.0 { smooth } else { own };
            }
        }
        to
    }
}

/// What of a light reaches the points of a bundle, as [`Light::reach`] has it for one.
#[derive(Clone, Debug)]
pub struct PlainLight {
    /// Towards the light, of length 1.
    pub toward: Sides,
    pub distance: Side,
    /// What the light's color is multiplied by, the angle to the normal included; 0 where nothing
    /// comes.
    pub share: Side,
    /// Where a ray to the light starts, clear of the surface.
    pub origin: Sides,
}

impl PlainPoints {
    /// What of a light reaches the points.
    pub fn lit_by(&self, light: &Light) -> PlainLight {
        let mut lit = widely(Reach {
            points: self,
            light,
        });
        if matches!(light.kind, LightKind::Spot { .. } | LightKind::Beam { .. }) {
            for lane in bits(self.mask) {
                let toward = Vec3::from([0, 1, 2].map(|k| lit.toward[k][lane]));
                lit.share[lane] *= light.cone(toward);
            }
        }
        lit
    }

    /// The points whose surfaces have a set of lights: bits.
    pub fn with_lights(&self, set: u32) -> u32 {
        let mut mask = 0;
        for lane in bits(self.mask) {
            mask |= u32::from(self.lights[lane] == set) << lane;
        }
        mask
    }
}

struct Reach<'a> {
    points: &'a PlainPoints,
    light: &'a Light,
}

impl Lanewise for Reach<'_> {
    type Output = PlainLight;

    #[inline(always)]
    fn run<const FUSED: bool>(self) -> PlainLight {
        let (points, light) = (&self.points.placed, self.light);
        let mut out = PlainLight {
            toward: ZERO,
            distance: [f32::INFINITY; BUNDLE],
            share: [1.0; BUNDLE],
            origin: ZERO,
        };
        if light.kind == LightKind::Directional {
            out.toward = [0, 1, 2].map(|k| [-light.direction[k]; BUNDLE]);
        } else {
            let [kq, kl, kc] = light.attenuation.to_array();
            for i in 0..BUNDLE {
                let to = [0, 1, 2].map(|k| light.position[k] - points.position[k][i]);
                let distance = (to[0] * to[0] + to[1] * to[1] + to[2] * to[2]).sqrt();
                let scale = 1.0 / distance.max(f32::MIN_POSITIVE);
                (0..3).for_each(|k| out.toward[k][i] = to[k] * scale);
                let falloff = kc + distance * (kl + distance * kq);
                let share = if falloff > 0.0 { 1.0 / falloff } else { 1.0 };
                out.share[i] = if distance > light.radius { 0.0 } else { share };
                out.distance[i] = distance;
            }
        }
        for i in 0..BUNDLE {
            let along = |v: &Sides| {
                v[0][i] * out.toward[0][i] + v[1][i] * out.toward[1][i] + v[2][i] * out.toward[2][i]
            };
            out.share[i] *= along(&points.normal).max(0.0);
            let side = if along(&points.geometric) < 0.0 {
                -1.0
            } else {
                1.0
            };
            for k in 0..3 {
                let off = side * points.geometric[k][i];
                let origin = points.position[k][i] + off * points.error[i];
                // The sum rounds too: one step farther.
                let step = (origin.abs() * f32::EPSILON).copysign(off);
                out.origin[k][i] = origin + if off == 0.0 { 0.0 } else { step };
            }
        }
        out
    }
}
