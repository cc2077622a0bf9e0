//! Points that are lit in lanes.
//!
//! Points on triangles are placed in lanes, with the results of `RenderScene::point` up to
//! rounding. Other points are computed one by one and then added by [`PointLanes::take`], so that
//! all are lit together. A plain surface has no texture, reflection, transparency or fog, so the
//! light of its points is their radiance.

use glam::Vec3;
use ivcam_base::math::lanes::{
    LANES, Lanes, SimdKernel, Vec3Lanes, bits, dispatch, of_lane, power, set_lane,
};
use ivcam_inventor::traversal::state::{FogKind, LightKind};

use super::shader::ShadeOptions;
use super::shading::Shading;
use crate::bvh::{PacketHits, Ray, RayPacket};
use crate::scene::{Light, Point, RenderScene, SHADOW_END, Surface, TrianglePoint, clear_of};

const ZERO: Vec3Lanes = [[0.0; LANES]; 3];

/// The points that a packet of rays hits, with what lighting needs of them. They are lit by one
/// light after another. Lanes that are not in `mask` have arbitrary values.
#[derive(Clone, Debug, Default)]
pub(super) struct PointLanes {
    /// A bit mask of the lanes that hold a point to be lit.
    pub mask: u32,
    /// A bit mask of the points on triangles that were placed in lanes.
    pub placed_here: u32,
    /// A bit mask of those on plain surfaces.
    pub plain: u32,
    /// A bit mask of the points that have a highlight.
    pub shiny: u32,
    /// A bit mask of the points whose highlights depend on the viewer's position.
    local_viewer: u32,
    /// The directions to the viewer, for highlights.
    to_viewer: Vec3Lanes,
    pub gathered: Gathered,
    pub placed: Placed,
    /// The light that reaches the points: see [`PointLanes::reach`].
    pub lit: LightLanes,
}

/// Positions and normals of the points.
#[derive(Clone, Debug, Default)]
pub(super) struct Placed {
    pub position: Vec3Lanes,
    /// The geometric normal, of length 1, on the side that the ray came from.
    pub geometric: Vec3Lanes,
    /// The normal used for lighting, of length 1, or zero.
    normal: Vec3Lanes,
    /// A bound of the position's rounding error, in meters.
    pub error: Lanes<f32>,
    /// Twice the triangle's area, in square meters.
    area: Lanes<f32>,
    /// A bit mask of the points whose front the ray hit.
    front: u32,
}

impl Placed {
    /// The coordinate `k` of the origin of a ray that leaves the point in lane `i` toward the side
    /// of the geometric normal (1) or the other one (−1), clear of the surface.
    #[inline(always)]
    fn clear_of(&self, k: usize, i: usize, side: f32) -> f32 {
        clear_of(
            self.position[k][i],
            side * self.geometric[k][i],
            self.error[i],
        )
    }

    /// Returns a ray that leaves the point in a lane in a direction, clear of the surface.
    pub(super) fn leave(&self, lane: usize, direction: Vec3) -> Ray {
        let toward = direction.dot(of_lane(&self.geometric, lane));
        let side = if toward < 0.0 { -1.0 } else { 1.0 };
        let origin = [0, 1, 2].map(|k| self.clear_of(k, lane, side));
        Ray::new(Vec3::from_array(origin), direction)
    }
}

/// The values of a surface that points in lanes need. They fit into a cache line, unlike
/// [`Surface`].
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfaceValues {
    diffuse: Vec3,
    /// The largest diffuse color that is not cut.
    diffuse_limit: f32,
    /// The light without any light source, if it is the same for all points.
    glow: Option<Vec3>,
    /// The specular color; zero if the shading model has no highlights.
    specular: Vec3,
    /// The specular exponent.
    exponent: f32,
    /// The number of its set of lights.
    lights: u32,
    /// The number of its first primitive.
    first: u32,
    /// Whether the corners run counterclockwise seen from outside.
    counterclockwise: bool,
    two_sided: bool,
    base_color: bool,
    local_viewer: bool,
    is_plain: bool,
    /// Whether each corner has its own normal.
    has_normals: bool,
    /// Whether each corner has its own material.
    has_materials: bool,
}

impl SurfaceValues {
    pub(super) fn new(surface: &Surface, shading: Shading, is_mirror: bool) -> Self {
        let diffuse_limit = match shading {
            Shading::Gl => 1.0,
            _ => surface.diffuse_limit(),
        };
        let diffuse = surface
            .diffuse_at(0)
            .clamp(Vec3::ZERO, Vec3::splat(diffuse_limit));
        // Otherwise the ambient light of a point depends on its own diffuse color.
        let has_one_glow = surface.ambient_intensity.is_none()
            || surface.materials.is_empty()
            || surface.environment.ambient == Vec3::ZERO;
        Self {
            diffuse,
            diffuse_limit,
            glow: has_one_glow.then(|| surface.glow(diffuse)),
            specular: match shading {
                Shading::Diffuse => Vec3::ZERO,
                _ => surface.specular,
            },
            exponent: surface.exponent(),
            lights: surface.lights,
            first: surface.first,
            counterclockwise: surface.counterclockwise,
            two_sided: surface.two_sided,
            base_color: surface.base_color,
            local_viewer: surface.local_viewer,
            is_plain: surface.textures().next().is_none()
                && !surface.base_color
                && !is_mirror
                && surface.environment.fog == FogKind::None
                && surface.is_opaque(),
            has_normals: !surface.normals.is_empty(),
            has_materials: !surface.materials.is_empty(),
        }
    }
}

/// Corners, normals and colors of the points' primitives, copied into lanes.
#[derive(Clone, Debug)]
pub(super) struct Gathered {
    corners: [Vec3Lanes; 3],
    normals: [Vec3Lanes; 3],
    /// 1 if the corners run counterclockwise seen from outside, else −1.
    turn: Lanes<f32>,
    /// 1 if the back is lit like the front, else 0.
    two_sided: Lanes<f32>,
    /// 1 if the corners have normals, else 0.
    smooth: Lanes<f32>,
    pub diffuse: Vec3Lanes,
    /// The specular color of shiny points.
    pub specular: Vec3Lanes,
    /// The specular exponent of shiny points.
    exponent: Lanes<f32>,
    /// The radiance of the surface without any light.
    glow: Vec3Lanes,
    /// The number of the surface's set of lights.
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
    /// Removes all points, and places those of a packet's hits on triangles.
    pub(super) fn gather(
        &mut self,
        scene: &RenderScene,
        surfaces: &[SurfaceValues],
        rays: &RayPacket,
        hits: &PacketHits,
    ) {
        (self.mask, self.placed_here, self.plain, self.shiny) = (0, 0, 0, 0);
        self.local_viewer = 0;
        match scene.has_instances() {
            true => self.take_all::<true>(scene, surfaces, hits),
            false => self.take_all::<false>(scene, surfaces, hits),
        }
        if self.placed_here != 0 {
            let whole = dispatch(Placing {
                from: &self.gathered,
                rays,
                hits,
                to: &mut self.placed,
            });
            let all = [&mut self.mask, &mut self.placed_here, &mut self.plain];
            all.into_iter().for_each(|mask| *mask &= whole);
            self.shiny &= whole;
        }
    }

    /// Fills the lanes whose hits are on triangles.
    fn take_all<const INSTANCES: bool>(
        &mut self,
        scene: &RenderScene,
        surfaces: &[SurfaceValues],
        hits: &PacketHits,
    ) {
        if !self.take_one::<INSTANCES>(scene, surfaces, hits) {
            for lane in bits(hits.mask) {
                self.take_triangle::<INSTANCES>(scene, surfaces, lane, hits);
            }
        }
    }

    /// Does what [`PointLanes::take_all`] does if all hits are on one triangle without materials of
    /// its own, as most of the samples of a pixel are. Otherwise it returns false.
    fn take_one<const INSTANCES: bool>(
        &mut self,
        scene: &RenderScene,
        surfaces: &[SurfaceValues],
        hits: &PacketHits,
    ) -> bool {
        let Some(first) = bits(hits.mask).next() else {
            return true;
        };
        let of = |lane: usize| {
            let place = if INSTANCES { hits.place[lane] } else { 0 };
            (hits.primitive[lane], place)
        };
        let (primitive, place) = of(first);
        if bits(hits.mask).any(|lane| of(lane) != (primitive, place))
            || surfaces[scene.owner(primitive) as usize].has_materials
        {
            return false;
        }
        self.take_triangle::<INSTANCES>(scene, surfaces, first, hits);
        let gathered = &mut self.gathered;
        let corners = gathered.corners.iter_mut().chain(&mut gathered.normals);
        let colors = [
            &mut gathered.diffuse,
            &mut gathered.glow,
            &mut gathered.specular,
        ];
        let numbers = corners.chain(colors).flatten().chain([
            &mut gathered.turn,
            &mut gathered.two_sided,
            &mut gathered.smooth,
            &mut gathered.exponent,
        ]);
        numbers.for_each(|lanes| *lanes = [lanes[first]; LANES]);
        gathered.lights = [gathered.lights[first]; LANES];
        for mask in [
            &mut self.mask,
            &mut self.placed_here,
            &mut self.plain,
            &mut self.shiny,
            &mut self.local_viewer,
        ] {
            *mask = if *mask == 0 { 0 } else { hits.mask };
        }
        true
    }

    /// Fills a lane if its hit is on a triangle.
    #[inline(always)]
    fn take_triangle<const INSTANCES: bool>(
        &mut self,
        scene: &RenderScene,
        surfaces: &[SurfaceValues],
        lane: usize,
        hits: &PacketHits,
    ) {
        let primitive = hits.primitive[lane];
        let place = if INSTANCES { hits.place[lane] } else { 0 };
        let Some(corners) = scene.corners(primitive, place) else {
            return;
        };
        let number = scene.owner(primitive) as usize;
        let values = &surfaces[number];
        let to = &mut self.gathered;
        for (to, corner) in to.corners.iter_mut().zip(corners) {
            set_lane(to, lane, corner);
        }
        let local = (primitive - values.first) as usize;
        to.smooth[lane] = 0.0;
        if values.has_normals
            && let Some(normals) = scene.normals(&scene.surfaces()[number], local, place)
        {
            for (to, normal) in to.normals.iter_mut().zip(normals) {
                set_lane(to, lane, normal);
            }
            to.smooth[lane] = 1.0;
        }
        to.turn[lane] = if values.counterclockwise { 1.0 } else { -1.0 };
        to.two_sided[lane] = f32::from(u8::from(values.two_sided));
        let diffuse = if values.has_materials {
            let surface = &scene.surfaces()[number];
            let blend = surface.diffuse_between(local, hits.u[lane], hits.v[lane]);
            blend.clamp(Vec3::ZERO, Vec3::splat(values.diffuse_limit))
        } else {
            values.diffuse
        };
        set_lane(&mut to.diffuse, lane, diffuse);
        let glow = values.glow;
        let glow = glow.unwrap_or_else(|| scene.surfaces()[number].glow(diffuse));
        set_lane(&mut to.glow, lane, glow);
        to.lights[lane] = values.lights;
        let bit = 1 << lane;
        self.placed_here |= bit;
        self.mask |= if values.base_color { 0 } else { bit };
        self.plain |= if values.is_plain { bit } else { 0 };
        if values.specular != Vec3::ZERO {
            set_lane(&mut to.specular, lane, values.specular);
            to.exponent[lane] = values.exponent;
            self.shiny |= bit;
            self.local_viewer |= if values.local_viewer { bit } else { 0 };
        }
    }

    /// The point on a triangle in a lane.
    pub(super) fn on_triangle(&self, lane: usize) -> TrianglePoint {
        let Placed {
            position,
            geometric,
            normal,
            ..
        } = &self.placed;
        TrianglePoint {
            position: of_lane(position, lane),
            geometric: of_lane(geometric, lane),
            normal: of_lane(normal, lane),
            front: self.placed.front >> lane & 1 == 1,
            diffuse: of_lane(&self.gathered.diffuse, lane),
            error: self.placed.error[lane],
            doubled_area: self.placed.area[lane],
        }
    }

    /// Replaces the diffuse color of a point.
    pub(super) fn recolor(&mut self, lane: usize, point: &Point<'_>) {
        let to = &mut self.gathered;
        set_lane(&mut to.diffuse, lane, point.diffuse);
        set_lane(&mut to.glow, lane, point.surface.glow(point.diffuse));
    }
}

/// Computes normals, positions and their rounding errors.
struct Placing<'a> {
    from: &'a Gathered,
    rays: &'a RayPacket,
    hits: &'a PacketHits,
    to: &'a mut Placed,
}

impl SimdKernel for Placing<'_> {
    /// A bit mask of the triangles whose doubled area exceeds 1e-30 m². The normal of a smaller one
    /// is dominated by rounding.
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
        // The signs of the geometric normal and of the normal for lighting.
        let [mut away, mut lit, mut toward] = [[0.0f32; LANES]; 3];
        let mut fronts = [0u32; LANES];
        for (flat, direction) in flat.iter().zip(&rays.direction) {
            for i in 0..LANES {
                toward[i] += flat[i] * direction[i];
            }
        }
        for i in 0..LANES {
            let turn = from.turn[i];
            away[i] = if toward[i] > 0.0 { -1.0 } else { 1.0 };
            // This is positive if the ray came from outside.
            let front = if toward[i] < 0.0 { turn } else { -turn };
            fronts[i] = u32::from(front > 0.0);
            let back = (from.two_sided[i] > 0.0) & (front < 0.0);
            lit[i] = if back { -1.0 } else { 1.0 };
        }
        to.front = (0..LANES).fold(0, |all, i| all | fronts[i] << i);
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
            // Corners without normals, or with normals that cancel, give zero: the point is unlit.
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

/// The light that reaches the points of a packet: [`Light::reach`] in lanes.
#[derive(Clone, Debug, Default)]
pub(super) struct LightLanes {
    /// Rays to the light from the points that it may reach. They start clear of the points'
    /// surfaces.
    pub rays: RayPacket,
    /// The factor of the light's color from attenuation and the spot's cone.
    factor: Lanes<f32>,
    /// `factor` times the cosine to the normal.
    pub share: Lanes<f32>,
    /// `factor` times the highlight's specular factor.
    pub highlight: Lanes<f32>,
}

impl PointLanes {
    /// Sets the radiances of some lanes to those by a shading model without lights.
    pub(super) fn show(&self, shading: Shading, lanes: u32, radiances: &mut Vec3Lanes) {
        for lane in bits(lanes) {
            let color = match shading {
                Shading::Flat => of_lane(&self.gathered.diffuse, lane),
                Shading::Normal => 0.5 * of_lane(&self.placed.normal, lane) + 0.5,
                _ => of_lane(&self.gathered.glow, lane).clamp(Vec3::ZERO, Vec3::ONE),
            };
            set_lane(radiances, lane, color);
        }
    }

    /// Sets the radiances of some lanes to those of their points without any light.
    pub(super) fn glow(&self, lanes: u32, radiances: &mut Vec3Lanes) {
        dispatch(Glow {
            glow: &self.gathered.glow,
            lanes,
            radiances,
        });
    }

    /// Adds a point that was not placed here, to be lit with the others. Without `highlight` its
    /// specular color is ignored.
    pub(super) fn take(&mut self, lane: usize, point: &Point<'_>, highlight: bool) {
        let (placed, gathered) = (&mut self.placed, &mut self.gathered);
        set_lane(&mut placed.position, lane, point.position);
        set_lane(&mut placed.geometric, lane, point.geometric);
        set_lane(&mut placed.normal, lane, point.normal);
        placed.error[lane] = point.error;
        let surface = point.surface;
        gathered.lights[lane] = surface.lights;
        self.mask |= 1 << lane;
        if highlight && surface.specular != Vec3::ZERO {
            set_lane(&mut gathered.specular, lane, surface.specular);
            gathered.exponent[lane] = surface.exponent();
            self.shiny |= 1 << lane;
            self.local_viewer |= u32::from(surface.local_viewer) << lane;
        }
        self.recolor(lane, point);
    }

    /// Computes how much of a light reaches the points of some lanes.
    pub(super) fn reach(&mut self, light: &Light, lanes: u32) {
        let facing = dispatch(Reach {
            points: &self.placed,
            light,
            lit: &mut self.lit,
        });
        self.lit.rays.mask = facing & lanes;
        if let Some((least, exponent)) = light.spot() {
            self.lit.rays.mask &= dispatch(SpotCone {
                direction: light.direction,
                least,
                exponent,
                lit: &mut self.lit,
            });
        } else if let LightKind::Beam { .. } | LightKind::Cone { .. } = light.kind {
            for lane in bits(self.lit.rays.mask) {
                let cone = light.cone(of_lane(&self.lit.rays.direction, lane));
                self.lit.share[lane] *= cone;
                self.lit.factor[lane] *= cone;
                self.lit.rays.mask &= !(u32::from(!(cone > 0.0)) << lane);
            }
        }
        if light.encoded > 0.0 {
            for lane in bits(self.lit.rays.mask) {
                let factor = self.lit.factor[lane];
                let shown = light.shown(factor);
                self.lit.share[lane] *= shown / factor.max(f32::MIN_POSITIVE);
                self.lit.factor[lane] = shown;
            }
        }
    }

    /// Computes the directions to the viewer from the points with highlights.
    pub(super) fn face_viewer(&mut self, options: &ShadeOptions) {
        if self.shiny == 0 {
            return;
        }
        let [x, y, z] = options.backward.to_array();
        self.to_viewer = [[x; LANES], [y; LANES], [z; LANES]];
        for lane in bits(self.shiny & self.local_viewer) {
            let point = of_lane(&self.placed.position, lane);
            set_lane(&mut self.to_viewer, lane, options.to_viewer(point, true));
        }
    }

    /// Computes the highlights of the light of the last [`PointLanes::reach`]. A highlight is
    /// brightest where the normal is halfway between the directions to the light and the viewer.
    pub(super) fn shine(&mut self) {
        if self.shiny & self.lit.rays.mask != 0 {
            dispatch(Shine {
                normal: &self.placed.normal,
                exponent: &self.gathered.exponent,
                to_viewer: &self.to_viewer,
                lit: &mut self.lit,
            });
        }
    }

    /// Adds the light of the last [`PointLanes::reach`] to the radiances. `through` is the fraction
    /// that is not in shadow.
    pub(super) fn add(&mut self, color: Vec3, through: &Lanes<f32>, radiances: &mut Vec3Lanes) {
        self.shine();
        dispatch(Add {
            points: &self.gathered,
            shiny: self.shiny,
            lit: &self.lit,
            color,
            through,
            radiances,
        });
    }

    /// The number of a lane's set of lights.
    pub(super) fn lights(&self, lane: usize) -> u32 {
        self.gathered.lights[lane]
    }

    /// A bit mask of the points whose surfaces have a given set of lights.
    pub(super) fn with_lights(&self, set: u32) -> u32 {
        let lights = self.gathered.lights.iter().enumerate();
        self.mask & lights.fold(0, |all, (i, of)| all | u32::from(*of == set) << i)
    }
}

/// Sets radiances to those without any light.
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

/// Applies the cone of a spot light: [`Light::cone`] in lanes.
struct SpotCone<'a> {
    direction: Vec3,
    /// The cosine of the angle between the axis and the cone's edge.
    least: f32,
    exponent: f32,
    lit: &'a mut LightLanes,
}

impl SimdKernel for SpotCone<'_> {
    /// A bit mask of the points inside the cone.
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

/// Computes highlights by the halfway vector: see [`crate::shade`].
struct Shine<'a> {
    normal: &'a Vec3Lanes,
    exponent: &'a Lanes<f32>,
    to_viewer: &'a Vec3Lanes,
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
        let [vx, vy, vz] = self.to_viewer;
        let mut aligned = [0.0f32; LANES];
        for i in 0..LANES {
            let [hx, hy, hz] = [x[i] + vx[i], y[i] + vy[i], z[i] + vz[i]];
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

/// Adds one light to radiances.
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

/// Computes directions, distances and factors of one light: [`Light::reach`] in lanes.
struct Reach<'a> {
    points: &'a Placed,
    light: &'a Light,
    lit: &'a mut LightLanes,
}

impl SimdKernel for Reach<'_> {
    /// A bit mask of the points that face the light.
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
                let falloff = falloff.max(light.least_divisor);
                let part = if falloff > 0.0 { 1.0 / falloff } else { 1.0 };
                factor[i] = part * light.left_at(distance);
                out.t_max[i] = distance * SHADOW_END;
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
                out.origin[k][i] = points.clear_of(k, i, *side);
            }
        }
        (0..LANES).fold(0, |all, i| all | u32::from(share[i] > 0.0) << i)
    }
}
