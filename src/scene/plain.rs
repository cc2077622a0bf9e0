//! Points of surfaces, lit side by side; those on triangles of plain surfaces are worked out side
//! by side, too.
//!
//! A plain surface is lit by its diffuse color and nothing else: no texture, no highlight, no
//! mirror, nothing see-through, no fog. That is most of most scenes. The arithmetic is that of
//! [`super::surface::point`], to rounding. Other points are worked out one by one and join them to
//! be lit: [`LitPoints::take`].

use glam::Vec3;

use super::bundle::{HitLanes, RayLanes, Side, Sides, of_lane};
use super::wide::bits;
use super::{BUNDLE, Light, Point, RenderScene, Surface};
use crate::math::lanes::{Lanewise, power, widely};
use crate::traversal::state::{FogKind, LightKind};

const ZERO: Sides = [[0.0; BUNDLE]; 3];

/// What lighting needs of the points that a bundle of rays meets, one light after another. It is
/// filled again and again; what a lane holds that is not asked for means nothing.
#[derive(Clone, Debug, Default)]
pub struct LitPoints {
    /// Which rays meet a plain surface, or another that was taken: bits.
    pub mask: u32,
    /// Those of them that have a highlight.
    shiny: u32,
    gathered: Gathered,
    placed: Placed,
    /// What a light brings: see [`LitPoints::reach`].
    pub lit: LightLanes,
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

impl Default for Placed {
    fn default() -> Self {
        Self {
            position: ZERO,
            geometric: ZERO,
            normal: ZERO,
            error: [0.0; BUNDLE],
            area: [0.0; BUNDLE],
        }
    }
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

/// Corners, normals and colors, gathered from all over the scene.
#[derive(Clone, Debug)]
struct Gathered {
    corners: [Sides; 3],
    normals: [Sides; 3],
    /// 1 where the corners run counterclockwise seen from outside, else −1.
    turn: Side,
    /// 1 where the back is lit like the front, else 0.
    two_sided: Side,
    /// 1 where the corners have normals, else 0.
    smooth: Side,
    diffuse: Sides,
    /// Of points that are not of plain surfaces.
    specular: Sides,
    exponent: Side,
    /// What the surface gives off without any light.
    glow: Sides,
    /// The surface's set of lights.
    lights: [u32; BUNDLE],
}

impl Default for Gathered {
    fn default() -> Self {
        Self {
            corners: [ZERO; 3],
            normals: [ZERO; 3],
            turn: [1.0; BUNDLE],
            two_sided: [0.0; BUNDLE],
            smooth: [0.0; BUNDLE],
            diffuse: ZERO,
            specular: ZERO,
            exponent: [0.0; BUNDLE],
            glow: ZERO,
            lights: [0; BUNDLE],
        }
    }
}

impl RenderScene {
    /// The points of a bundle's hits on plain surfaces.
    pub fn plain_points(&self, rays: &RayLanes, hits: &HitLanes, points: &mut LitPoints) {
        points.clear();
        for lane in bits(hits.mask) {
            points.mask |= u32::from(self.gather(lane, hits, &mut points.gathered)) << lane;
        }
        if points.mask != 0 {
            let whole = widely(Settle {
                from: &points.gathered,
                rays,
                hits,
                to: &mut points.placed,
            });
            points.mask &= whole;
        }
    }

    /// Whether the hit is on a triangle of a plain surface; its lane is filled then.
    #[inline(always)]
    fn gather(&self, lane: usize, hits: &HitLanes, into: &mut Gathered) -> bool {
        let index = hits.primitive[lane] as usize;
        let Some(corners) = self.triangles.get(index) else {
            return false;
        };
        let owner = self.owners[index] as usize;
        let plain = &self.plain[owner];
        if !plain.is_plain {
            return false;
        }
        let put = |to: &mut Sides, v: Vec3| set_lane(to, lane, v);
        for (to, corner) in into.corners.iter_mut().zip(corners) {
            put(to, *corner);
        }
        let local = index - plain.first as usize;
        into.smooth[lane] = 0.0;
        if plain.has_normals
            && let Some(normals) = self.surfaces[owner].normals.get(local)
        {
            for (to, normal) in into.normals.iter_mut().zip(normals) {
                put(to, normal);
            }
            into.smooth[lane] = 1.0;
        }
        (into.turn[lane], into.two_sided[lane]) = (plain.turn, plain.two_sided);
        let diffuse = if plain.has_materials {
            let blend = self.surfaces[owner].diffuse_between(local, hits.u[lane], hits.v[lane]);
            blend.clamp(Vec3::ZERO, Vec3::ONE)
        } else {
            plain.diffuse
        };
        put(&mut into.diffuse, diffuse);
        put(&mut into.glow, plain.glow);
        into.lights[lane] = plain.lights;
        true
    }
}

/// Sets the point or direction of one ray.
#[inline(always)]
pub fn set_lane(all: &mut Sides, lane: usize, value: Vec3) {
    (all[0][lane], all[1][lane], all[2][lane]) = (value.x, value.y, value.z);
}

impl Surface {
    /// What shines by itself and what the surroundings give.
    pub fn glow(&self) -> Vec3 {
        self.emissive + self.ambient * self.environment.ambient
    }

    /// The diffuse color of one of the surface's triangles where it is hit.
    #[inline(always)]
    fn diffuse_between(&self, triangle: usize, u: f32, v: f32) -> Vec3 {
        let [a, b, c] = self.materials_of(triangle);
        let first = self.diffuse_at(a);
        if a == b && b == c {
            return first;
        }
        first * (1.0 - u - v) + self.diffuse_at(b) * u + self.diffuse_at(c) * v
    }
}

/// Normals, positions and their errors.
struct Settle<'a> {
    from: &'a Gathered,
    rays: &'a RayLanes,
    hits: &'a HitLanes,
    to: &'a mut Placed,
}

impl Lanewise for Settle<'_> {
    /// The triangles that are large enough: those of a millionth of a meter square to nothing.
    type Output = u32;

    #[inline(always)]
    fn run<const FUSED: bool>(self) -> u32 {
        let Self {
            from,
            rays,
            hits,
            to,
        } = self;
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
        for (flat, direction) in flat.iter().zip(&rays.direction) {
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
                let (u, v) = (hits.u[i], hits.v[i]);
                x[0][k][i] * (1.0 - u - v) + x[1][k][i] * u + x[2][k][i] * v
            };
            for i in 0..BUNDLE {
                let (u, v) = (hits.u[i], hits.v[i]);
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
        let whole = |i: usize| u32::from(to.area[i] > 1e-30) << i;
        (0..BUNDLE).fold(0, |all, i| all | whole(i))
    }
}

/// What of a light reaches the points of a bundle, as [`Light::reach`] has it for one.
#[derive(Clone, Debug, Default)]
pub struct LightLanes {
    /// From the points, clear of their surfaces, to the light; those that it could light.
    pub rays: RayLanes,
    /// What the light's color is multiplied by,
    factor: Side,
    /// and with the angle to the normal included.
    share: Side,
    /// What the highlight is multiplied by.
    highlight: Side,
}

impl LitPoints {
    /// Starts with what the points of some lanes give off by themselves.
    pub fn glow(&self, lanes: u32, radiances: &mut Sides) {
        widely(Glow {
            glow: &self.gathered.glow,
            lanes,
            radiances,
        });
    }

    /// Forgets all points.
    pub fn clear(&mut self) {
        (self.mask, self.shiny) = (0, 0);
    }

    /// Takes a point that is not of a plain surface, to be lit with the others. One without
    /// `highlight` is matt.
    pub fn take(&mut self, lane: usize, point: &Point<'_>, highlight: bool) {
        let (placed, gathered) = (&mut self.placed, &mut self.gathered);
        set_lane(&mut placed.position, lane, point.position);
        set_lane(&mut placed.geometric, lane, point.geometric);
        set_lane(&mut placed.normal, lane, point.normal);
        placed.error[lane] = point.error;
        let surface = point.surface;
        set_lane(&mut gathered.diffuse, lane, point.diffuse);
        set_lane(&mut gathered.glow, lane, surface.glow());
        gathered.lights[lane] = surface.lights;
        self.mask |= 1 << lane;
        if highlight && surface.specular != Vec3::ZERO {
            set_lane(&mut gathered.specular, lane, surface.specular);
            gathered.exponent[lane] = surface.exponent();
            self.shiny |= 1 << lane;
        }
    }

    /// What of a light reaches the points of some lanes.
    pub fn reach(&mut self, light: &Light, lanes: u32) {
        let facing = widely(Reach {
            points: &self.placed,
            light,
            lit: &mut self.lit,
        });
        self.lit.rays.mask = facing & lanes;
        if let Some((least, exponent)) = light.spot() {
            self.lit.rays.mask &= widely(Cone {
                direction: light.direction,
                least,
                exponent,
                lit: &mut self.lit,
            });
        } else if let LightKind::Beam { .. } = light.kind {
            for lane in bits(self.lit.rays.mask) {
                let cone = light.cone(of_lane(&self.lit.rays.direction, lane));
                self.lit.share[lane] *= cone;
                self.lit.factor[lane] *= cone;
                self.lit.rays.mask &= !(u32::from(!(cone > 0.0)) << lane);
            }
        }
    }

    /// Adds the light that was reached for, as much of it as comes through. Highlights lie where
    /// the normal is halfway between the light and `backward`.
    pub fn add(&mut self, color: Vec3, backward: Vec3, through: &Side, radiances: &mut Sides) {
        if self.shiny & self.lit.rays.mask != 0 {
            widely(Shine {
                normal: &self.placed.normal,
                exponent: &self.gathered.exponent,
                backward,
                lit: &mut self.lit,
            });
        }
        widely(Add {
            points: &self.gathered,
            shiny: self.shiny,
            lit: &self.lit,
            color,
            through,
            radiances,
        });
    }

    /// A lane's set of lights.
    pub fn lights(&self, lane: usize) -> u32 {
        self.gathered.lights[lane]
    }

    /// The points whose surfaces have a set of lights: bits.
    pub fn with_lights(&self, set: u32) -> u32 {
        let lights = self.gathered.lights.iter().enumerate();
        self.mask & lights.fold(0, |all, (i, of)| all | u32::from(*of == set) << i)
    }
}

struct Glow<'a> {
    glow: &'a Sides,
    lanes: u32,
    radiances: &'a mut Sides,
}

impl Lanewise for Glow<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        for (radiance, glow) in self.radiances.iter_mut().zip(self.glow) {
            for i in 0..BUNDLE {
                let on = self.lanes >> i & 1 == 1;
                radiance[i] = if on { glow[i] } else { radiance[i] };
            }
        }
    }
}

/// The cone of a spot, as [`Light::cone`] has it for one.
struct Cone<'a> {
    direction: Vec3,
    /// The cosine at its edge.
    least: f32,
    exponent: f32,
    lit: &'a mut LightLanes,
}

impl Lanewise for Cone<'_> {
    /// The points inside: bits.
    type Output = u32;

    #[inline(always)]
    fn run<const FUSED: bool>(self) -> u32 {
        let LightLanes {
            rays,
            factor,
            share,
            ..
        } = self.lit;
        let ([x, y, z], d) = (&rays.direction, self.direction);
        let mut inside = [0u32; BUNDLE];
        for i in 0..BUNDLE {
            let along = -(x[i] * d.x + y[i] * d.y + z[i] * d.z);
            let is_inside = (along >= self.least) & (along > 0.0);
            let part = power(along.clamp(0.0, 1.0), self.exponent);
            let cone = if is_inside { part } else { 0.0 };
            factor[i] *= cone;
            share[i] *= cone;
            inside[i] = u32::from(cone > 0.0);
        }
        (0..BUNDLE).fold(0, |all, i| all | inside[i] << i)
    }
}

/// Highlights by the half-way vector, as [`crate::shade`] tells.
struct Shine<'a> {
    normal: &'a Sides,
    exponent: &'a Side,
    backward: Vec3,
    lit: &'a mut LightLanes,
}

impl Lanewise for Shine<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let LightLanes {
            rays,
            factor,
            highlight,
            ..
        } = self.lit;
        let [x, y, z] = &rays.direction;
        let [nx, ny, nz] = self.normal;
        let mut aligned = [0.0f32; BUNDLE];
        for i in 0..BUNDLE {
            let [hx, hy, hz] = [
                x[i] + self.backward.x,
                y[i] + self.backward.y,
                z[i] + self.backward.z,
            ];
            let square = hx * hx + hy * hy + hz * hz;
            let scale = if square > 0.0 {
                1.0 / square.sqrt()
            } else {
                0.0
            };
            let along = (nx[i] * hx + ny[i] * hy + nz[i] * hz) * scale;
            aligned[i] = along.clamp(0.0, 1.0);
        }
        for i in 0..BUNDLE {
            highlight[i] = factor[i] * power(aligned[i], self.exponent[i]);
        }
    }
}

struct Add<'a> {
    points: &'a Gathered,
    shiny: u32,
    lit: &'a LightLanes,
    color: Vec3,
    through: &'a Side,
    radiances: &'a mut Sides,
}

impl Lanewise for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let (mask, share) = (self.lit.rays.mask, &self.lit.share);
        let shiny = mask & self.shiny;
        for k in 0..3 {
            let (diffuse, radiance) = (&self.points.diffuse[k], &mut self.radiances[k]);
            for i in 0..BUNDLE {
                let more = self.color[k] * diffuse[i] * (share[i] * self.through[i]);
                radiance[i] += if mask >> i & 1 == 1 { more } else { 0.0 };
            }
            if shiny != 0 {
                let (specular, highlight) = (&self.points.specular[k], &self.lit.highlight);
                for i in 0..BUNDLE {
                    let more = self.color[k] * specular[i] * (highlight[i] * self.through[i]);
                    radiance[i] += if shiny >> i & 1 == 1 { more } else { 0.0 };
                }
            }
        }
    }
}

struct Reach<'a> {
    points: &'a Placed,
    light: &'a Light,
    lit: &'a mut LightLanes,
}

impl Lanewise for Reach<'_> {
    /// The points that the light comes to from the front: bits.
    type Output = u32;

    #[inline(always)]
    fn run<const FUSED: bool>(self) -> u32 {
        let (points, light) = (self.points, self.light);
        let LightLanes {
            rays: out,
            factor,
            share,
            ..
        } = self.lit;
        if light.kind == LightKind::Directional {
            for k in 0..3 {
                out.direction[k] = [-light.direction[k]; BUNDLE];
            }
            out.t_max = [f32::INFINITY; BUNDLE];
            *factor = [1.0; BUNDLE];
        } else {
            let [kq, kl, kc] = light.attenuation.to_array();
            let [px, py, pz] = &points.position;
            for i in 0..BUNDLE {
                let (x, y, z) = (
                    light.position.x - px[i],
                    light.position.y - py[i],
                    light.position.z - pz[i],
                );
                let distance = (x * x + y * y + z * z).sqrt();
                let scale = 1.0 / distance.max(f32::MIN_POSITIVE);
                out.direction[0][i] = x * scale;
                out.direction[1][i] = y * scale;
                out.direction[2][i] = z * scale;
                let falloff = kc + distance * (kl + distance * kq);
                let part = if falloff > 0.0 { 1.0 / falloff } else { 1.0 };
                factor[i] = if distance > light.radius { 0.0 } else { part };
                // Up to the light itself and not to what lies behind it.
                out.t_max[i] = distance * (1.0 - 1e-5);
            }
        }
        let mut side = [0.0f32; BUNDLE];
        for i in 0..BUNDLE {
            let along = |v: &Sides| {
                v[0][i] * out.direction[0][i]
                    + v[1][i] * out.direction[1][i]
                    + v[2][i] * out.direction[2][i]
            };
            share[i] = factor[i] * along(&points.normal).max(0.0);
            side[i] = if along(&points.geometric) < 0.0 {
                -1.0
            } else {
                1.0
            };
        }
        for k in 0..3 {
            for (i, side) in side.iter().enumerate() {
                let off = side * points.geometric[k][i];
                let origin = points.position[k][i] + off * points.error[i];
                // The sum rounds too: one step farther.
                let step = (origin.abs() * f32::EPSILON).copysign(off);
                out.origin[k][i] = origin + if off == 0.0 { 0.0 } else { step };
            }
        }
        (0..BUNDLE).fold(0, |all, i| all | u32::from(share[i] > 0.0) << i)
    }
}
