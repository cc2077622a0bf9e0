//! Points of surfaces that are lit side by side.
//!
//! A plain surface is lit by its diffuse color and nothing else: no texture, no highlight, no
//! mirror, no transparency, no fog. Most surfaces of most scenes are plain. Points on their
//! triangles are computed side by side with the arithmetic of `RenderScene::point`, to rounding.
//! Other points are computed one by one and then join them to be lit: [`PointLanes::take`].

use glam::Vec3;

use crate::bvh::{PacketHits, RayPacket};
use crate::math::lanes::{
    LANES, Lanes, SimdKernel, Vec3Lanes, bits, dispatch, of_lane, power, set_lane,
};
use crate::scene::{Light, Point, RenderScene, Surface};
use crate::traversal::state::{FogKind, LightKind};

const ZERO: Vec3Lanes = [[0.0; LANES]; 3];

/// The points that a packet of rays hits, as lighting needs them, one light after another. Numbers
/// in lanes that are not in `mask` mean nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct PointLanes {
    /// Which lanes hold a point, of a plain surface or of another that was taken: bits.
    pub mask: u32,
    /// Which of them have a highlight: bits.
    shiny: u32,
    gathered: Gathered,
    placed: Placed,
    /// The light that reaches the points: see [`PointLanes::reach`].
    pub lit: LightLanes,
}

/// Positions and normals of the points.
#[derive(Clone, Debug)]
struct Placed {
    position: Vec3Lanes,
    /// The geometric normal, of length 1, on the side that the ray came from.
    geometric: Vec3Lanes,
    normal: Vec3Lanes,
    /// How far rounding may have moved the position.
    error: Lanes<f32>,
    /// Twice the triangle's area.
    area: Lanes<f32>,
}

impl Default for Placed {
    fn default() -> Self {
        Self {
            position: ZERO,
            geometric: ZERO,
            normal: ZERO,
            error: [0.0; LANES],
            area: [0.0; LANES],
        }
    }
}

/// The part of a surface that a packet of points needs: a cache line in place of many fields.
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
    /// Whether corners have normals of their own.
    has_normals: bool,
    /// Whether corners have materials of their own.
    has_materials: bool,
}

impl PlainSurface {
    pub(super) fn new(surface: &Surface) -> Self {
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
    corners: [Vec3Lanes; 3],
    normals: [Vec3Lanes; 3],
    /// 1 where the corners run counterclockwise seen from outside, else −1.
    turn: Lanes<f32>,
    /// 1 where the back is lit like the front, else 0.
    two_sided: Lanes<f32>,
    /// 1 where the corners have normals, else 0.
    smooth: Lanes<f32>,
    diffuse: Vec3Lanes,
    /// The specular color of points that are not of plain surfaces.
    specular: Vec3Lanes,
    exponent: Lanes<f32>,
    /// What the surface gives off without any light.
    glow: Vec3Lanes,
    /// The surface's set of lights.
    lights: [u32; LANES],
}

impl Default for Gathered {
    fn default() -> Self {
        Self {
            corners: [ZERO; 3],
            normals: [ZERO; 3],
            turn: [1.0; LANES],
            two_sided: [0.0; LANES],
            smooth: [0.0; LANES],
            diffuse: ZERO,
            specular: ZERO,
            exponent: [0.0; LANES],
            glow: ZERO,
            lights: [0; LANES],
        }
    }
}

impl PointLanes {
    /// Computes the points of a packet's hits on plain surfaces and forgets all others.
    pub(super) fn gather(
        &mut self,
        scene: &RenderScene,
        surfaces: &[PlainSurface],
        rays: &RayPacket,
        hits: &PacketHits,
    ) {
        self.clear();
        for lane in bits(hits.mask) {
            let is_plain = self.gathered.take(scene, surfaces, lane, hits);
            self.mask |= u32::from(is_plain) << lane;
        }
        if self.mask != 0 {
            self.mask &= dispatch(Placing {
                from: &self.gathered,
                rays,
                hits,
                to: &mut self.placed,
            });
        }
    }
}

impl Gathered {
    /// Fills a lane if its hit is on a triangle of a plain surface, and returns whether it is.
    #[inline(always)]
    fn take(
        &mut self,
        scene: &RenderScene,
        surfaces: &[PlainSurface],
        lane: usize,
        hits: &PacketHits,
    ) -> bool {
        let primitive = hits.primitive[lane];
        let Some(corners) = scene.corners(primitive) else {
            return false;
        };
        let number = scene.surface_number(primitive);
        let plain = &surfaces[number];
        if !plain.is_plain {
            return false;
        }
        for (to, corner) in self.corners.iter_mut().zip(corners) {
            set_lane(to, lane, *corner);
        }
        let local = (primitive - plain.first) as usize;
        self.smooth[lane] = 0.0;
        if plain.has_normals
            && let Some(normals) = scene.surfaces()[number].normals.get(local)
        {
            for (to, normal) in self.normals.iter_mut().zip(normals) {
                set_lane(to, lane, normal);
            }
            self.smooth[lane] = 1.0;
        }
        (self.turn[lane], self.two_sided[lane]) = (plain.turn, plain.two_sided);
        let diffuse = if plain.has_materials {
            let surface = &scene.surfaces()[number];
            let blend = surface.diffuse_between(local, hits.u[lane], hits.v[lane]);
            blend.clamp(Vec3::ZERO, Vec3::ONE)
        } else {
            plain.diffuse
        };
        set_lane(&mut self.diffuse, lane, diffuse);
        set_lane(&mut self.glow, lane, plain.glow);
        self.lights[lane] = plain.lights;
        true
    }
}

/// Normals, positions and their errors.
struct Placing<'a> {
    from: &'a Gathered,
    rays: &'a RayPacket,
    hits: &'a PacketHits,
    to: &'a mut Placed,
}

impl SimdKernel for Placing<'_> {
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
        for i in 0..LANES {
            let (ex, fx) = (b[0][i] - a[0][i], c[0][i] - a[0][i]);
            let (ey, fy) = (b[1][i] - a[1][i], c[1][i] - a[1][i]);
            let (ez, fz) = (b[2][i] - a[2][i], c[2][i] - a[2][i]);
            let (nx, ny, nz) = (ey * fz - fy * ez, ez * fx - fz * ex, ex * fy - fx * ey);
            let area = (nx * nx + ny * ny + nz * nz).sqrt();
            let scale = 1.0 / area;
            to.area[i] = area;
            (flat[0][i], flat[1][i], flat[2][i]) = (nx * scale, ny * scale, nz * scale);
        }
        // The signs of the geometric normal and of the one to light with.
        let [mut away, mut lit, mut toward] = [[0.0f32; LANES]; 3];
        for (flat, direction) in flat.iter().zip(&rays.direction) {
            for i in 0..LANES {
                toward[i] += flat[i] * direction[i];
            }
        }
        for i in 0..LANES {
            let turn = from.turn[i];
            away[i] = if toward[i] > 0.0 { -1.0 } else { 1.0 };
            // The ray came from outside where this is positive.
            let front = if toward[i] < 0.0 { turn } else { -turn };
            let back = (from.two_sided[i] > 0.0) & (front < 0.0);
            lit[i] = if back { -1.0 } else { 1.0 };
        }
        let [mut size, mut error] = [[0.0f32; LANES]; 2];
        for k in 0..3 {
            let blend = |x: &[Vec3Lanes; 3], i: usize| {
                let (u, v) = (hits.u[i], hits.v[i]);
                x[0][k][i] * (1.0 - u - v) + x[1][k][i] * u + x[2][k][i] * v
            };
            for i in 0..LANES {
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
        for i in 0..LANES {
            to.error[i] = 8.0 * f32::EPSILON * error[i];
            // Corners without normals, or with normals that cancel, give zero: unlit.
            size[i] = if size[i] > 0.0 {
                1.0 / size[i].sqrt()
            } else {
                0.0
            };
        }
        for (normal, flat) in to.normal.iter_mut().zip(&flat) {
            for i in 0..LANES {
                let smooth = size[i] * normal[i];
                let own = from.turn[i] * flat[i];
                normal[i] = lit[i] * if from.smooth[i] > 0.0 { smooth } else { own };
            }
        }
        let whole = |i: usize| u32::from(to.area[i] > 1e-30) << i;
        (0..LANES).fold(0, |all, i| all | whole(i))
    }
}

/// The light that reaches the points of a packet: [`Light::reach`] side by side.
#[derive(Clone, Debug, Default)]
pub(super) struct LightLanes {
    /// Rays from the points that the light may reach to the light, clear of the points' surfaces.
    pub rays: RayPacket,
    /// The factor of the light's color without the angle to the normal.
    factor: Lanes<f32>,
    /// The factor of the light's color with the angle to the normal.
    share: Lanes<f32>,
    /// The factor of the light's color in the highlight.
    highlight: Lanes<f32>,
}

impl PointLanes {
    /// Sets the radiances of some lanes to what their points give off without any light.
    pub(super) fn glow(&self, lanes: u32, radiances: &mut Vec3Lanes) {
        dispatch(Glow {
            glow: &self.gathered.glow,
            lanes,
            radiances,
        });
    }

    /// Forgets all points.
    pub(super) fn clear(&mut self) {
        (self.mask, self.shiny) = (0, 0);
    }

    /// Takes a point that is not of a plain surface, to be lit with the others. One without
    /// `highlight` is matt.
    pub(super) fn take(&mut self, lane: usize, point: &Point<'_>, highlight: bool) {
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
    pub(super) fn reach(&mut self, light: &Light, lanes: u32) {
        let facing = dispatch(Reach {
            points: &self.placed,
            light,
            lit: &mut self.lit,
        });
        self.lit.rays.mask = facing & lanes;
        if let Some((least, exponent)) = light.spot() {
            self.lit.rays.mask &= dispatch(Cone {
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
    pub(super) fn add(
        &mut self,
        color: Vec3,
        backward: Vec3,
        through: &Lanes<f32>,
        radiances: &mut Vec3Lanes,
    ) {
        if self.shiny & self.lit.rays.mask != 0 {
            dispatch(Shine {
                normal: &self.placed.normal,
                exponent: &self.gathered.exponent,
                backward,
                lit: &mut self.lit,
            });
        }
        dispatch(Add {
            points: &self.gathered,
            shiny: self.shiny,
            lit: &self.lit,
            color,
            through,
            radiances,
        });
    }

    /// A lane's set of lights.
    pub(super) fn lights(&self, lane: usize) -> u32 {
        self.gathered.lights[lane]
    }

    /// The points whose surfaces have a set of lights: bits.
    pub(super) fn with_lights(&self, set: u32) -> u32 {
        let lights = self.gathered.lights.iter().enumerate();
        self.mask & lights.fold(0, |all, (i, of)| all | u32::from(*of == set) << i)
    }
}

struct Glow<'a> {
    glow: &'a Vec3Lanes,
    lanes: u32,
    radiances: &'a mut Vec3Lanes,
}

impl SimdKernel for Glow<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        for (radiance, glow) in self.radiances.iter_mut().zip(self.glow) {
            for i in 0..LANES {
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

impl SimdKernel for Cone<'_> {
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
        let mut inside = [0u32; LANES];
        for i in 0..LANES {
            let along = -(x[i] * d.x + y[i] * d.y + z[i] * d.z);
            let is_inside = (along >= self.least) & (along > 0.0);
            let part = power(along.clamp(0.0, 1.0), self.exponent);
            let cone = if is_inside { part } else { 0.0 };
            factor[i] *= cone;
            share[i] *= cone;
            inside[i] = u32::from(cone > 0.0);
        }
        (0..LANES).fold(0, |all, i| all | inside[i] << i)
    }
}

/// Highlights by the half-way vector, as [`crate::shade`] tells.
struct Shine<'a> {
    normal: &'a Vec3Lanes,
    exponent: &'a Lanes<f32>,
    backward: Vec3,
    lit: &'a mut LightLanes,
}

impl SimdKernel for Shine<'_> {
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
        let mut aligned = [0.0f32; LANES];
        for i in 0..LANES {
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
        for i in 0..LANES {
            highlight[i] = factor[i] * power(aligned[i], self.exponent[i]);
        }
    }
}

struct Add<'a> {
    points: &'a Gathered,
    shiny: u32,
    lit: &'a LightLanes,
    color: Vec3,
    through: &'a Lanes<f32>,
    radiances: &'a mut Vec3Lanes,
}

impl SimdKernel for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let (mask, share) = (self.lit.rays.mask, &self.lit.share);
        let shiny = mask & self.shiny;
        for k in 0..3 {
            let (diffuse, radiance) = (&self.points.diffuse[k], &mut self.radiances[k]);
            for i in 0..LANES {
                let more = self.color[k] * diffuse[i] * (share[i] * self.through[i]);
                radiance[i] += if mask >> i & 1 == 1 { more } else { 0.0 };
            }
            if shiny != 0 {
                let (specular, highlight) = (&self.points.specular[k], &self.lit.highlight);
                for i in 0..LANES {
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

impl SimdKernel for Reach<'_> {
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
                out.direction[k] = [-light.direction[k]; LANES];
            }
            out.t_max = [f32::INFINITY; LANES];
            *factor = [1.0; LANES];
        } else {
            let [kq, kl, kc] = light.attenuation.to_array();
            let [px, py, pz] = &points.position;
            for i in 0..LANES {
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
        let mut side = [0.0f32; LANES];
        for i in 0..LANES {
            let along = |v: &Vec3Lanes| {
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
        (0..LANES).fold(0, |all, i| all | u32::from(share[i] > 0.0) << i)
    }
}
