//! Compiles a walk into what a ray can hit: triangles, exact quadrics, materials, lights.
//!
//! The scene is moved in f64 so that the compile origin (the camera) is at zero, then kept in
//! f32. What a picture does not need is left out, and the census says so.

pub mod background;
pub mod builder;
pub mod census;
pub mod check;
pub mod inventor_box;
pub mod light;
pub mod packets;
pub mod screen;
pub mod shapes;
mod snapshot;
pub mod surface;
pub mod survey;
pub mod texture;

use std::sync::{Arc, OnceLock};

use glam::{DVec3, Vec2, Vec3};

use crate::bvh::{Block, BlockHits, Bvh, COPLANAR, Hit, PreparedRay, Ray};
use crate::diag::{Diagnostic, Result};
use crate::geometry::text::Fonts;
use crate::geometry::{Quadric, Stroke, StrokeView};
use crate::iv::Limits;
use crate::math::lanes::bits;
use crate::pose::CameraPose;
use crate::snapshot::Snapshot;
use crate::traversal::{self, WalkOptions};

pub use builder::Builder;
pub use census::Census;
pub use light::Light;
pub use snapshot::snapshot;
pub use surface::{Point, Surface};
pub use survey::Survey;

use texture::Texture;

/// What a picture needs of a scene; a lookup from the shading, not a branch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Needs {
    pub normals: bool,
    pub materials: bool,
    pub lights: bool,
    pub textures: bool,
    pub secondary: bool,
    /// Round shapes are cut into triangles, whose corners can be lit.
    pub facets: bool,
}

impl Needs {
    /// Everything about the exact shapes.
    pub const ALL: Self = Self {
        normals: true,
        materials: true,
        lights: true,
        textures: true,
        secondary: true,
        facets: false,
    };
}

#[derive(Clone, Debug)]
pub struct CompileOptions {
    /// The point of the world that becomes the origin. Default: zero; for pictures the camera.
    pub origin: DVec3,
    /// What levels of detail, billboards and pixel widths go by. Default: none.
    pub camera: Option<CameraPose>,
    /// Default: everything.
    pub needs: Needs,
    /// Height of the picture in pixels, for lines and points. Default: 240.
    pub pixel_rows: u32,
    /// Primitives kept before the rest is left out. Default: 16 million, below 3 GB.
    pub max_primitives: usize,
    /// Nodes met before the rest is left out. Default: 300,000, or twice the
    /// document's nodes if that is more.
    pub max_visits: u64,
    /// Compiles what `DrawStyle` hides or shows as lines like everything else. Default: no.
    pub ignore_draw_style: bool,
    /// Folders besides the scene's own in which textures are looked for. Default: none.
    pub texture_folders: Vec<std::path::PathBuf>,
    /// Typefaces to draw text with before the shipped ones. Default: none.
    pub fonts: Arc<Fonts>,
}

impl Default for CompileOptions {
    fn default() -> Self {
        Self {
            origin: DVec3::ZERO,
            camera: None,
            needs: Needs::ALL,
            pixel_rows: 240,
            max_primitives: Limits::default().primitives,
            max_visits: Limits::default().visits as u64,
            ignore_draw_style: false,
            texture_folders: Vec::new(),
            fonts: Arc::default(),
        }
    }
}

/// The nearest of what a ray was found to meet so far.
struct Front {
    best: Option<Hit>,
    nearest: f32,
    /// Where the plane of the nearest ends.
    end: f32,
    /// Farther hits do not count.
    t_max: f32,
    plane_end: f32,
    /// One hit has given way to another in its plane.
    contested: bool,
    /// After that the plane has moved: what gave way may be in it, and what it gave way to not.
    unsure: bool,
}

impl Front {
    fn new(ray: &Ray) -> Self {
        Self {
            best: None,
            nearest: f32::INFINITY,
            end: f32::INFINITY,
            t_max: ray.t_max,
            plane_end: ray.plane_end,
            contested: false,
            unsure: false,
        }
    }

    /// Looks again, for the last drawn in the plane that is now known.
    fn look_again(&mut self) {
        self.best = None;
        self.nearest = f32::NEG_INFINITY;
    }

    #[inline(always)]
    fn offer(&mut self, hit: Hit, rank: impl Fn(&Hit) -> u64) {
        if hit.t < self.nearest {
            self.nearest = hit.t;
            self.unsure |= self.contested;
            self.end = if hit.t <= self.plane_end {
                self.plane_end
            } else {
                hit.t + hit.t.abs() * COPLANAR
            };
            self.t_max = self.t_max.min(self.end.next_up());
        }
        let rival = self.best.as_ref().filter(|best| best.t <= self.end);
        self.contested |= rival.is_some();
        if rival.is_none_or(|best| rank(best) <= rank(&hit)) {
            self.best = Some(hit);
        }
    }
}

/// What a ray can hit, and how it looks.
#[derive(Debug, Default)]
pub struct RenderScene {
    pub origin: DVec3,
    triangles: Vec<[Vec3; 3]>,
    quadrics: Vec<Quadric>,
    strokes: Vec<Stroke>,
    /// Surface of each triangle, quadric and stroke.
    owners: Vec<u32>,
    surfaces: Vec<Surface>,
    light_sets: Vec<Arc<Vec<Light>>>,
    textures: Vec<Arc<Texture>>,
    /// Built when the first ray asks for it.
    tree: OnceLock<Bvh>,
    /// Whether any surface is see-through in places or seen from one side only.
    special: bool,
    /// Whether any surface is seen before everything else.
    annotated: bool,
    /// Whether everything stops all light.
    solid: bool,
    /// The camera, for what is measured in pixels.
    view: StrokeView,
    pub(crate) background: background::Background,
    census: Census,
    bounds: Option<(Vec3, Vec3)>,
}

/// A triangle as Coin's triangle callback gives it: world space, three corners each.
#[derive(Clone, Copy, Debug)]
pub struct OracleTriangle {
    pub position: [DVec3; 3],
    pub normal: [Vec3; 3],
    pub diffuse: [Vec3; 3],
    pub transparency: f32,
    pub shape: u32,
}

impl RenderScene {
    pub fn survey(snapshot: &Snapshot<'_>, options: &CompileOptions) -> Survey {
        survey::survey(snapshot, options)
    }

    /// Walks the snapshot and compiles what it draws.
    pub fn compile(snapshot: &Snapshot<'_>, options: &CompileOptions) -> Result<Self> {
        let walk_options = WalkOptions {
            camera: options.camera.clone(),
            max_visits: options.max_visits,
            ..WalkOptions::default()
        };
        let mut builder = Builder::new(snapshot, options);
        builder.expect_all();
        traversal::walk(snapshot, &walk_options, &mut builder);
        let mut scene = builder.finish()?;
        scene.settle()?;
        Ok(scene)
    }

    /// What is known once everything is collected: the box around it, fog, what lets light through.
    fn settle(&mut self) -> Result<()> {
        if u32::try_from(self.owners.len()).is_err() {
            return Err(Diagnostic::error("the scene has more than 2^32 primitives"));
        }
        let triangles = around(self.triangles.as_flattened());
        let others = self.boxes_of_others().chain(triangles);
        self.bounds = others.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        self.settle_fog();
        if self.census.transparent {
            self.settle_centers();
        }
        self.solid = self
            .surfaces
            .iter()
            .all(|s| s.casts_shadow && s.clip.is_empty() && s.is_opaque());
        Ok(())
    }

    /// The box around each primitive.
    fn boxes(&self) -> impl Iterator<Item = (Vec3, Vec3)> + '_ {
        let triangles = self.triangles.iter();
        let triangles = triangles.map(|[a, b, c]| (a.min(*b).min(*c), a.max(*b).max(*c)));
        triangles.chain(self.boxes_of_others())
    }

    fn boxes_of_others(&self) -> impl Iterator<Item = (Vec3, Vec3)> + '_ {
        let quadrics = self.quadrics.iter().map(|q| {
            let (min, max) = q.bounds();
            widen(min, max)
        });
        let strokes = self.strokes.iter().map(|s| s.bounds(&self.view));
        quadrics.chain(strokes)
    }

    /// The tree that rays go through, built when it is first asked for: what needs no ray (bounds,
    /// counts, triangles) does not wait for it. The same tree whoever asks.
    fn tree(&self) -> &Bvh {
        self.tree.get_or_init(|| {
            let corners = |primitive: u32| self.triangles.get(primitive as usize).copied();
            Bvh::build(self.boxes().collect(), corners)
        })
    }

    /// Builds what rays need now, so that the first ray does not wait.
    pub fn prepare(&self) {
        self.tree();
        for texture in &self.textures {
            texture.texels();
        }
    }

    /// Where the box of each surface has its center.
    fn settle_centers(&mut self) {
        let mut around: Vec<Option<(Vec3, Vec3)>> = vec![None; self.surfaces.len()];
        for (owner, (min, max)) in self.owners.iter().zip(self.boxes()) {
            let all = &mut around[*owner as usize];
            *all = Some(all.map_or((min, max), |(a, b)| (a.min(min), b.max(max))));
        }
        for (surface, around) in self.surfaces.iter_mut().zip(around) {
            surface.center = around.map_or(Vec3::ZERO, |(min, max)| 0.5 * (min + max));
        }
    }

    /// Fog without a visibility reaches to the far end of what the camera sees (Coin).
    fn settle_fog(&mut self) {
        let Some((min, max)) = self.bounds else {
            return;
        };
        let corner = |i: usize| {
            Vec3::new(
                if i & 1 == 0 { min.x } else { max.x },
                if i & 2 == 0 { min.y } else { max.y },
                if i & 4 == 0 { min.z } else { max.z },
            )
        };
        let far = (0..8)
            .map(|i| corner(i).dot(self.view.forward))
            .fold(0.0, f32::max);
        for surface in &mut self.surfaces {
            if surface.environment.visibility <= 0.0 {
                surface.environment.visibility = far;
            }
        }
    }

    /// The nearest thing a ray sees: closed surfaces from outside only, clip planes applied. Of
    /// things in one plane it is the one drawn last, as in OpenGL with Inventor's depth test.
    pub fn hit(&self, ray: &Ray) -> Option<Hit> {
        if !self.special {
            return self.hit_any_side(ray);
        }
        if self.annotated {
            let over = |hit: &Hit| self.surface(hit).on_top && self.is_seen(ray, hit);
            if let Some(hit) = self.nearest(ray, over) {
                return Some(hit);
            }
        }
        self.nearest(ray, |hit| self.is_seen(ray, hit))
    }

    /// The nearest primitive whatever side of it the ray meets.
    pub fn hit_any_side(&self, ray: &Ray) -> Option<Hit> {
        self.nearest(ray, |_| true)
    }

    #[inline(always)]
    fn nearest(&self, ray: &Ray, is_seen: impl Fn(&Hit) -> bool) -> Option<Hit> {
        let prepared = PreparedRay::new(ray);
        let look = |front: &mut Front| {
            self.tree()
                .walk(&prepared, ray.t_min, front.t_max, |block, hits, t_max| {
                    self.visit(&prepared, (block, hits), ray.t_min, t_max, |hit| {
                        let passed = hit.t <= ray.plane_end && self.rank(&hit) >= ray.passed;
                        if !passed && is_seen(&hit) {
                            front.offer(hit, |hit| self.rank(hit));
                        }
                        front.t_max
                    })
                });
        };
        let mut front = Front::new(ray);
        look(&mut front);
        if front.unsure {
            front.look_again();
            look(&mut front);
        }
        front.best
    }

    /// Where a primitive stands in the order of drawing: the blended ones after the others.
    pub fn rank(&self, hit: &Hit) -> u64 {
        let owner = self.owners[hit.primitive as usize];
        let surface = &self.surfaces[owner as usize];
        let first = u64::from(surface.layer) << 1 | u64::from(!surface.is_opaque());
        // Surfaces number fewer than 2^29: each has a node.
        first << 61 | u64::from(owner) << 32 | u64::from(hit.primitive)
    }

    /// The ray that goes on behind what it met: to the rest of what lies in the same plane, from
    /// the last drawn to the first, then farther on. Nothing is met twice or left out.
    pub fn continue_behind(&self, ray: &Ray, hit: &Hit) -> Ray {
        let mut ahead = *ray;
        if hit.t > ray.plane_end {
            let thickness = hit.t.abs() * COPLANAR;
            ahead.t_min = (hit.t - thickness).max(ray.t_min).max(ray.plane_end);
            ahead.plane_end = hit.t + thickness;
        }
        ahead.passed = self.rank(hit);
        ahead
    }

    /// Takes the triangles met in a block and meets what else is in it. `found` answers a hit with the distance up to which further ones
    /// count, and so does this function.
    #[inline(always)]
    fn visit(
        &self,
        ray: &PreparedRay,
        (block, hits): (&Block, &BlockHits),
        t_min: f32,
        mut t_max: f32,
        mut found: impl FnMut(Hit) -> f32,
    ) -> f32 {
        for lane in bits(hits.mask) {
            let t = hits.t[lane];
            if t < t_max {
                t_max = found(Hit {
                    t,
                    primitive: block.primitive(lane),
                    u: hits.u[lane],
                    v: hits.v[lane],
                });
            }
        }
        for lane in bits(block.non_triangles()) {
            let mut from = t_min;
            // A curved one may be met twice.
            while let Some(hit) = self.meet(ray, block.primitive(lane), from, t_max) {
                from = hit.t;
                t_max = found(hit);
            }
        }
        t_max
    }

    #[inline]
    fn meet(&self, ray: &PreparedRay, primitive: u32, t_min: f32, t_max: f32) -> Option<Hit> {
        let index = primitive as usize;
        if let Some(corners) = self.triangles.get(index) {
            let (t, u, v) = ray.triangle(corners, t_min, t_max)?;
            return Some(Hit { t, primitive, u, v });
        }
        let index = index - self.triangles.len();
        if let Some(quadric) = self.quadrics.get(index) {
            let roots = quadric.intersect(ray.origin.as_dvec3(), ray.direction.as_dvec3());
            let t = roots
                .into_iter()
                .flatten()
                .map(|t| t as f32)
                .find(|&t| t > t_min && t < t_max)?;
            return Some(Hit {
                t,
                primitive,
                u: 0.0,
                v: 0.0,
            });
        }
        let stroke = self.strokes.get(index - self.quadrics.len())?;
        let t = stroke.intersect(ray.origin, ray.direction, &self.view)?;
        (t > t_min && t < t_max).then_some(Hit {
            t,
            primitive,
            u: 0.0,
            v: 0.0,
        })
    }

    fn is_seen(&self, ray: &Ray, hit: &Hit) -> bool {
        let surface = self.surface(hit);
        if surface.clip.is_empty() && !surface.culls {
            return true;
        }
        let at = ray.at(hit.t);
        if surface
            .clip
            .iter()
            .any(|(normal, distance)| normal.dot(at) < *distance)
        {
            return false;
        }
        !surface.culls || self.is_front(ray, hit, surface)
    }

    /// Whether the ray meets the outside: the side from which the corners run as hinted.
    pub(crate) fn is_front(&self, ray: &Ray, hit: &Hit, surface: &Surface) -> bool {
        let outward = self.geometric_normal(ray, hit);
        let faces = outward.dot(ray.direction) < 0.0;
        faces == surface.counterclockwise
    }

    /// The share of light that gets through between the ray's ends: 1 where nothing is in the
    /// way, the product of the transparencies otherwise. The first opaque thing ends the search,
    /// in whatever order things are met.
    pub fn transmittance(&self, ray: &Ray, t_max: f32) -> f32 {
        let prepared = PreparedRay::new(ray);
        let mut through = 1.0;
        self.tree()
            .walk_any(&prepared, ray.t_min, t_max, |block, hits, t_max| {
                self.visit(&prepared, (block, hits), ray.t_min, t_max, |hit| {
                    through *= self.lets_through(ray, &hit);
                    if through > 0.0 {
                        t_max
                    } else {
                        f32::NEG_INFINITY
                    }
                })
            });
        through
    }

    /// Whether a primitive lets no light through anywhere.
    fn stops_light(&self, primitive: u32) -> bool {
        let surface = &self.surfaces[self.owners[primitive as usize] as usize];
        surface.casts_shadow && surface.clip.is_empty() && surface.is_opaque()
    }

    /// The share of light that a primitive lets through where a ray meets it.
    fn lets_through(&self, ray: &Ray, hit: &Hit) -> f32 {
        let surface = self.surface(hit);
        if !surface.casts_shadow {
            return 1.0;
        }
        if self.stops_light(hit.primitive) {
            return 0.0;
        }
        if surface.clip.is_empty() || self.is_seen(ray, hit) {
            self.point(ray, hit).transparency
        } else {
            1.0
        }
    }

    pub fn surface(&self, hit: &Hit) -> &Surface {
        &self.surfaces[self.owners[hit.primitive as usize] as usize]
    }

    /// Whether what two neighboring rays meet may be lit quite differently: other surfaces, or
    /// faces that are turned from each other by more than 10 degrees.
    pub fn is_unlike(&self, [a, b]: [(&Ray, Option<Hit>); 2]) -> bool {
        let (ray, other) = (a.0, b.0);
        let (Some(a), Some(b)) = (a.1, b.1) else {
            return a.1.is_some() != b.1.is_some();
        };
        if a.primitive == b.primitive && (a.primitive as usize) < self.triangles.len() {
            return false;
        }
        let [owner, others] = [a, b].map(|hit| self.owners[hit.primitive as usize]);
        let aligned = || {
            let normal = self.geometric_normal(ray, &a);
            normal.dot(self.geometric_normal(other, &b))
        };
        owner != others || aligned() < 0.985
    }

    fn geometric_normal(&self, ray: &Ray, hit: &Hit) -> Vec3 {
        let index = hit.primitive as usize;
        if let Some([a, b, c]) = self.triangles.get(index) {
            let n = (b - a).cross(c - a);
            let length = n.length();
            // Triangles of a millionth of a meter square to nothing in f32.
            return if length > 1e-30 {
                n / length
            } else {
                let scale = 1.0 / (b - a).abs().max((c - a).abs()).max_element().max(1e-38);
                ((b - a) * scale)
                    .cross((c - a) * scale)
                    .normalize_or(-ray.direction)
            };
        }
        let index = index - self.triangles.len();
        match self.quadrics.get(index) {
            Some(quadric) => {
                let (_, n) = quadric.project_to_surface(ray.at(hit.t).as_dvec3());
                let m = quadric.object_from_scene.matrix3.transpose();
                (m * n).normalize_or(DVec3::Y).as_vec3()
            }
            None => self.strokes[index - self.quadrics.len()]
                .face
                .try_normalize()
                .unwrap_or(-ray.direction.normalize_or(Vec3::Z)),
        }
    }

    /// Everything about the point where a ray met the scene.
    pub fn point(&self, ray: &Ray, hit: &Hit) -> Point<'_> {
        surface::point(self, ray, hit)
    }

    /// How many texels a pixel covers where a ray meets a surface: its width there, by the texels a
    /// meter that a triangle's corners or a round shape's mapping give, or a line's ends by pixel.
    /// 1 where nothing says.
    fn texels_across(
        &self,
        point: &Point<'_>,
        ray: &Ray,
        hit: &Hit,
        texture: &surface::TextureUse,
    ) -> f32 {
        let index = hit.primitive as usize;
        if texture.texture.is_deep() && index >= self.triangles.len() {
            return 1.0;
        }
        let size = Vec2::new(texture.texture.width as f32, texture.texture.height as f32);
        let texel = |t: Vec2| texture.matrix.transform_point3(t.extend(0.0)).truncate() * size;
        let along = hit.t * ray.direction.length();
        let facing = (point.geometric.dot(ray.direction) / ray.direction.length()).abs();
        let pixel = self.view.fixed + self.view.per_depth * along;
        // The pixel's ellipse on the surface is longer than wide; OpenGL takes the longer side.
        let longer = pixel / facing.max(1e-3);
        let wide = if let Some([a, b, c]) = self.triangles.get(index) {
            let local = index - point.surface.first as usize;
            let Some(uv) = point.surface.coordinates.get(local) else {
                return 1.0;
            };
            let [a_at, b_at, c_at] = uv.map(texel);
            let texels = (b_at - a_at).perp_dot(c_at - a_at).abs();
            longer * (texels / (b - a).cross(c - a).length()).sqrt()
        } else if let Some(quadric) = self.quadrics.get(index - self.triangles.len()) {
            let at = |p: Vec3| {
                quadric
                    .texture_coordinates(quadric.project_to_surface(p.as_dvec3()).0)
                    .as_vec2()
            };
            let (middle, (right, up)) =
                (at(point.position), point.geometric.any_orthonormal_pair());
            // A step across the seam of a round texture is a short one too.
            let step = |way: Vec3| {
                let change = at(point.position + pixel * way) - middle;
                texel(change - change.round()) - texel(Vec2::ZERO)
            };
            longer / pixel * step(right).perp_dot(step(up)).abs().sqrt()
        } else {
            let stroke = &self.strokes[index - self.triangles.len() - self.quadrics.len()];
            let [from, to] = stroke.coordinates.map(texel);
            (to - from).length() / stroke.pixels(&self.view)
        };
        if wide.is_finite() { wide } else { 1.0 }
    }

    /// A hit triangle's corners as points, with their weights; `None` for other primitives.
    pub fn corner_points(&self, ray: &Ray, hit: &Hit) -> Option<[(Point<'_>, f32); 3]> {
        self.triangles.get(hit.primitive as usize)?;
        let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
        Some([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)].map(|(u, v)| {
            let i = if u == 1.0 {
                1
            } else {
                2 * usize::from(v == 1.0)
            };
            (self.point(ray, &Hit { u, v, ..*hit }), weights[i])
        }))
    }

    pub fn census(&self) -> &Census {
        &self.census
    }

    /// The lights of a surface.
    pub fn lights_of(&self, surface: &Surface) -> &[Light] {
        self.lights_of_set(surface.lights)
    }

    /// The lights of a number that surfaces have.
    pub fn lights_of_set(&self, set: u32) -> &[Light] {
        &self.light_sets[set as usize]
    }

    /// All lights, each once.
    pub fn lights(&self) -> Vec<Light> {
        let mut all: Vec<Light> = Vec::new();
        for light in self.light_sets.iter().flat_map(|s| s.iter()) {
            if !all.contains(light) {
                all.push(*light);
            }
        }
        all
    }

    /// What a ray that meets nothing sees: black, or the first `Background`.
    pub fn background(&self) -> &background::Background {
        &self.background
    }

    /// The box around everything, the compile origin at zero.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.bounds
    }

    pub fn primitives(&self) -> (usize, usize, usize) {
        (
            self.triangles.len(),
            self.quadrics.len(),
            self.strokes.len(),
        )
    }

    /// The corners of a primitive, or nothing if it is not a triangle.
    #[inline]
    pub fn corners(&self, primitive: u32) -> Option<&[Vec3; 3]> {
        self.triangles.get(primitive as usize)
    }

    /// The number of a primitive's surface.
    #[inline]
    pub fn surface_number(&self, primitive: u32) -> usize {
        self.owners[primitive as usize] as usize
    }

    pub fn surfaces(&self) -> &[Surface] {
        &self.surfaces
    }

    /// The triangles in order of traversal, for holding against another program's.
    pub fn triangles(&self) -> impl Iterator<Item = OracleTriangle> + '_ {
        self.triangles.iter().enumerate().map(|(i, corners)| {
            let surface = &self.surfaces[self.owners[i] as usize];
            let local = i - surface.first as usize;
            let materials = surface.materials_of(local);
            let flat = (corners[1] - corners[0])
                .cross(corners[2] - corners[0])
                .normalize_or_zero();
            OracleTriangle {
                position: corners.map(|p| p.as_dvec3() + self.origin),
                normal: surface.normals.get(local).unwrap_or([flat; 3]),
                diffuse: materials.map(|m| surface.diffuse_at(m)),
                transparency: surface.transparency_at(materials[0]),
                shape: surface.shape,
            }
        })
    }
}

/// The box around points, none of them NaN.
fn around(points: &[Vec3]) -> Option<(Vec3, Vec3)> {
    // Four at a time, as processors do it.
    let mut low = [*points.first()?; 4];
    let mut high = low;
    let fours = points.chunks_exact(4);
    for (i, &p) in fours.remainder().iter().enumerate() {
        (low[i], high[i]) = (low[i].min(p), high[i].max(p));
    }
    for four in fours {
        for (i, &p) in four.iter().enumerate() {
            (low[i], high[i]) = (low[i].min(p), high[i].max(p));
        }
    }
    let low = low.into_iter().reduce(Vec3::min)?;
    Some((low, high.into_iter().reduce(Vec3::max)?))
}

/// An f64 box as an f32 box that holds it.
fn widen(min: DVec3, max: DVec3) -> (Vec3, Vec3) {
    let down = |v: f64| (v as f32).next_down();
    let up = |v: f64| (v as f32).next_up();
    (
        Vec3::new(down(min.x), down(min.y), down(min.z)),
        Vec3::new(up(max.x), up(max.y), up(max.z)),
    )
}
