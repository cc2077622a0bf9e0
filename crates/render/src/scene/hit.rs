//! The hits of a single ray in a scene, and the light that it transmits.

use std::sync::atomic::Ordering;

use glam::{DVec3, Vec3};
use ivcam_base::math::lanes::bits;

use super::instances::RaySteps;
use super::looks::Surface;
use super::placed::Primitive;
use super::render_scene::RenderScene;
use crate::bvh::{Block, BlockHits, COPLANAR, Hit, PreparedRay, Primitives, Ray};

/// The search for the hit that is visible: of the hits in the nearest plane, the one drawn last.
struct Front {
    best: Option<Hit>,
    /// The distance of the nearest hit.
    nearest: f32,
    /// The farthest distance that counts as the plane of the nearest hit.
    end: f32,
    /// Farther hits are ignored.
    t_max: f32,
    /// The ray's [`Ray::plane_end`].
    plane_end: f32,
    /// Whether a hit was compared with another one in the same plane.
    contested: bool,
    /// Whether the plane has moved after such a comparison. The hit that lost may be in the new
    /// plane, and the one that won may be outside it.
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

    /// Prepares a second search, for the primitive drawn last in the plane that is now known.
    fn restart(&mut self) {
        self.best = None;
        self.nearest = f32::NEG_INFINITY;
    }

    /// Adds a hit to the search.
    #[inline(always)]
    fn add(&mut self, hit: Hit, rank: impl Fn(&Hit) -> u64) {
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

impl RenderScene {
    /// Returns the nearest visible hit of a ray. Back faces of closed surfaces and clipped points
    /// are invisible. Of several primitives in the same plane the hit is on the one drawn last, as
    /// in OpenGL with Inventor's depth test.
    pub fn hit(&self, ray: &Ray) -> Option<Hit> {
        if !self.special {
            return self.hit_any_side(ray);
        }
        if self.annotated {
            let over = |hit: &Hit| self.surface(hit).on_top && self.is_visible(ray, hit);
            if let Some(hit) = self.nearest(ray, over) {
                return Some(hit);
            }
        }
        self.nearest(ray, |hit| self.is_visible(ray, hit))
    }

    /// Returns the nearest hit of a ray, including back faces and clipped points.
    pub fn hit_any_side(&self, ray: &Ray) -> Option<Hit> {
        self.nearest(ray, |_| true)
    }

    /// Returns the nearest hit that `is_visible` accepts.
    #[inline(always)]
    pub(super) fn nearest(&self, ray: &Ray, is_visible: impl Fn(&Hit) -> bool) -> Option<Hit> {
        match self.instances {
            _ if self.is_crowded() => self.nearest_in_crowd(ray, is_visible),
            None => self.nearest_in::<false, false>(ray, is_visible),
            Some(_) => self.nearest_in::<true, false>(ray, is_visible),
        }
    }

    /// Does the work of [`RenderScene::nearest`] where many primitives are at one place.
    #[inline(never)]
    fn nearest_in_crowd(&self, ray: &Ray, is_visible: impl Fn(&Hit) -> bool) -> Option<Hit> {
        self.nearest_in::<true, true>(ray, is_visible)
    }

    /// Does the work of [`RenderScene::nearest`] for a scene with or without instances, and with or
    /// without a limit on the tests of primitives. The limit has an effect only with `INSTANCES`.
    #[inline(always)]
    fn nearest_in<const INSTANCES: bool, const LIMITED: bool>(
        &self,
        ray: &Ray,
        is_visible: impl Fn(&Hit) -> bool,
    ) -> Option<Hit> {
        if self.stop.is_set() {
            return None;
        }
        let prepared = PreparedRay::new(ray);
        let search = |front: &mut Front| {
            let steps = RaySteps::new(self.most_steps, &self.stop);
            self.tree()
                .walk(&prepared, ray.t_min, front.t_max, |block, hits, t_max| {
                    if LIMITED && !takes_block(&steps, block) {
                        return f32::NEG_INFINITY;
                    }
                    let range = (ray.t_min, t_max);
                    let query = (&prepared, true, &steps);
                    self.visit::<INSTANCES>(query, (block, hits), range, |hit| {
                        if LIMITED && !steps.take() {
                            return f32::NEG_INFINITY;
                        }
                        let passed = hit.t <= ray.plane_end && self.rank(&hit) >= ray.passed;
                        if !passed && is_visible(&hit) {
                            front.add(hit, |hit| self.rank(hit));
                        }
                        front.t_max
                    })
                });
            INSTANCES && steps.is_cut()
        };
        let mut front = Front::new(ray);
        let mut is_cut = search(&mut front);
        if front.unsure && !is_cut {
            let first = front.best.take();
            front.restart();
            is_cut = search(&mut front);
            front.best = front.best.or(first);
        }
        if is_cut && !self.stop.is_set() {
            self.count_cut();
        }
        front.best
    }

    /// Counts a ray that was cut.
    #[cold]
    fn count_cut(&self) {
        self.cut.fetch_add(1, Ordering::Relaxed);
    }

    /// Returns the rank of a primitive in the drawing order. Transparent primitives are drawn after
    /// opaque ones.
    pub(crate) fn rank(&self, hit: &Hit) -> u64 {
        let owner = self.owner(hit.primitive);
        let surface = &self.surfaces[owner as usize];
        let first = u64::from(surface.layer) << 1 | u64::from(!surface.is_opaque());
        // There are fewer than 2^29 surfaces, because each has a node.
        let number = match &self.instances {
            None => u64::from(owner) << 32 | u64::from(hit.primitive),
            Some(instances) => {
                let shape = &instances.shapes[owner as usize];
                let first = match hit.place {
                    0 => shape.first.unwrap_or_default(),
                    place => place - 1,
                };
                first + u64::from(self.lists().local(shape, hit.primitive))
            }
        };
        first << 61 | number
    }

    /// Returns the ray that continues behind a hit. It hits the remaining primitives in the same
    /// plane, from the last drawn to the first, and then those behind the plane. Each primitive is
    /// hit exactly once.
    pub(crate) fn continue_behind(&self, ray: &Ray, hit: &Hit) -> Ray {
        let mut ahead = *ray;
        if hit.t > ray.plane_end {
            let thickness = hit.t.abs() * COPLANAR;
            ahead.t_min = (hit.t - thickness).max(ray.t_min).max(ray.plane_end);
            ahead.plane_end = hit.t + thickness;
        }
        ahead.passed = self.rank(hit);
        ahead
    }

    /// Calls `found` with the hits of a block: those on triangles, which are given, and those on
    /// other primitives, which are computed. `found` returns the farthest distance of interest for
    /// further hits, and this function returns the last of these. Instances are searched with near
    /// primitives first if `sorted`. The search of instances takes the address of `found`, which
    /// keeps its values out of registers, so it is compiled only where `INSTANCES`.
    #[inline(always)]
    fn visit<const INSTANCES: bool>(
        &self,
        (ray, sorted, steps): (&PreparedRay, bool, &RaySteps<'_>),
        (block, hits): (&Block, &BlockHits),
        (t_min, mut t_max): (f32, f32),
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
                    place: 0,
                });
            }
        }
        for lane in bits(block.non_triangles()) {
            if INSTANCES
                && let Some(instances) = &self.instances
                && let Some(element) =
                    (block.primitive(lane) as usize).checked_sub(self.owners.len())
            {
                let range = (t_min, t_max);
                let lists = self.lists();
                let query = (ray, sorted, steps);
                t_max = instances.search(lists, query, element, range, &mut found);
                continue;
            }
            let primitive = block.primitive(lane);
            let mut from = t_min;
            for t in self.distances(ray.origin, ray.direction, primitive, t_max) {
                if t > from && t < t_max {
                    from = t;
                    t_max = found(Hit::on(primitive, 0, t));
                }
            }
        }
        t_max
    }

    /// Whether a hit is neither clipped nor on a culled back face.
    pub(crate) fn is_visible(&self, ray: &Ray, hit: &Hit) -> bool {
        let surface = self.surface(hit);
        if surface.clip.is_empty() && !surface.culls {
            return true;
        }
        !is_clipped(surface, ray.at(hit.t)) && (!surface.culls || self.is_front(ray, hit, surface))
    }

    /// Whether the light that a ray leads to passes a hit, because it meets a culled back face.
    ///
    /// A face that is not there for the camera is not there for a light: what the light sees, not
    /// what the shaded point sees, decides.
    pub(super) fn is_culled_from_light(&self, ray: &Ray, hit: &Hit) -> bool {
        let surface = self.surface(hit);
        if !self.culls_shadows || !surface.culls {
            return false;
        }
        let outward = self.geometric_normal(ray, hit);
        let from_light = Ray::new(ray.origin, -ray.direction);
        !self.is_front_of(&from_light, hit, surface, outward)
    }

    /// Whether the ray hits the front: the side from which the vertices have the hinted order.
    pub fn is_front(&self, ray: &Ray, hit: &Hit, surface: &Surface) -> bool {
        let outward = self.geometric_normal(ray, hit);
        self.is_front_of(ray, hit, surface, outward)
    }

    /// Whether the ray hits the front, given the outward normal at the hit.
    ///
    /// A mirroring matrix reverses the order of vertices in the picture, and so exchanges front and
    /// back, as in OpenGL and thus in SGI's library (`glFrontFace`). The normal of a triangle,
    /// which comes from its vertices, is reversed already; that of a quadric is not.
    pub(super) fn is_front_of(
        &self,
        ray: &Ray,
        hit: &Hit,
        surface: &Surface,
        outward: Vec3,
    ) -> bool {
        let faces = outward.dot(ray.direction) < 0.0;
        let mirrored = !self.is_triangle(hit)
            && matches!(self.primitive(hit), Primitive::Quadric(q) if q.mirrored);
        (faces == surface.counterclockwise) != mirrored
    }

    /// Returns the fraction of light that is transmitted between the ray's ends. It is the product
    /// of the transparencies of all primitives between them. Any opaque primitive ends the search.
    pub fn transmittance(&self, ray: &Ray, t_max: f32) -> f32 {
        match self.instances {
            _ if self.is_crowded() => self.transmittance_in::<true, true>(ray, t_max),
            None => self.transmittance_in::<false, false>(ray, t_max),
            Some(_) => self.transmittance_in::<true, false>(ray, t_max),
        }
    }

    /// Does the work of [`RenderScene::transmittance`] for a scene with or without instances, and
    /// with or without a limit as in [`RenderScene::nearest_in`].
    fn transmittance_in<const INSTANCES: bool, const LIMITED: bool>(
        &self,
        ray: &Ray,
        t_max: f32,
    ) -> f32 {
        if self.stop.is_set() {
            return 0.0;
        }
        let prepared = PreparedRay::new(ray);
        let steps = RaySteps::new(self.most_steps, &self.stop);
        let mut through = 1.0;
        self.tree()
            .walk_any(&prepared, ray.t_min, t_max, |block, hits, t_max| {
                if LIMITED && !takes_block(&steps, block) {
                    return f32::NEG_INFINITY;
                }
                let range = (ray.t_min, t_max);
                let query = (&prepared, false, &steps);
                self.visit::<INSTANCES>(query, (block, hits), range, |hit| {
                    if LIMITED && !steps.take() {
                        return f32::NEG_INFINITY;
                    }
                    through *= self.lets_through(ray, &hit);
                    if through > 0.0 {
                        t_max
                    } else {
                        f32::NEG_INFINITY
                    }
                })
            });
        if INSTANCES && steps.is_cut() && !self.stop.is_set() {
            self.count_cut();
        }
        through
    }

    /// Whether a primitive blocks all light everywhere.
    pub(super) fn stops_light(&self, primitive: u32) -> bool {
        let surface = &self.surfaces[self.owner(primitive) as usize];
        surface.casts_shadow && surface.clip.is_empty() && surface.is_opaque()
    }

    /// Returns the fraction of light that a primitive transmits at a hit.
    fn lets_through(&self, ray: &Ray, hit: &Hit) -> f32 {
        let surface = self.surface(hit);
        if !surface.casts_shadow || self.is_culled_from_light(ray, hit) {
            1.0
        } else if self.stops_light(hit.primitive) {
            0.0
        } else if is_clipped(surface, ray.at(hit.t)) {
            1.0
        } else {
            self.point(ray, hit).transparency
        }
    }

    /// Whether the hits of two neighboring rays may have very different light: they are on
    /// different surfaces, or the angle between their faces exceeds 10 degrees.
    pub(crate) fn is_unlike(&self, [a, b]: [(Ray, Option<Hit>); 2]) -> bool {
        let (ray, other) = (&a.0, &b.0);
        let (Some(a), Some(b)) = (a.1, b.1) else {
            return a.1.is_some() != b.1.is_some();
        };
        if a.primitive == b.primitive && a.place == b.place && self.is_triangle(&a) {
            return false;
        }
        let [owner, others] = [a, b].map(|hit| (self.owner(hit.primitive), hit.place));
        let aligned = || {
            let normal = self.geometric_normal(ray, &a);
            normal.dot(self.geometric_normal(other, &b))
        };
        owner != others || aligned() < 0.985
    }

    /// Returns the outward unit normal of the primitive at a hit.
    #[inline(always)]
    pub(crate) fn geometric_normal(&self, ray: &Ray, hit: &Hit) -> Vec3 {
        let Some([a, b, c]) = self.corners(hit.primitive, hit.place) else {
            return self.normal_of_other(ray, hit);
        };
        let n = (b - a).cross(c - a);
        let length = n.length();
        // For triangles smaller than about 1e-15 m the product underflows in f32, so they are
        // scaled first.
        if length > 1e-30 {
            n / length
        } else {
            let scale = 1.0 / (b - a).abs().max((c - a).abs()).max_element().max(1e-38);
            ((b - a) * scale)
                .cross((c - a) * scale)
                .normalize_or(-ray.direction)
        }
    }

    /// Returns the outward unit normal of a hit primitive that is not a triangle.
    #[inline(never)]
    fn normal_of_other(&self, ray: &Ray, hit: &Hit) -> Vec3 {
        match self.primitive(hit) {
            Primitive::Quadric(quadric) => {
                let (_, n) = quadric.project_to_surface(ray.at(hit.t).as_dvec3());
                let m = quadric.object_from_scene.matrix3.transpose();
                (m * n).normalize_or(DVec3::Y).as_vec3()
            }
            Primitive::Stroke(stroke) => stroke
                .face
                .try_normalize()
                .unwrap_or(-ray.direction.normalize_or(Vec3::Z)),
            Primitive::Triangle(_) => Vec3::ZERO, // `geometric_normal` has computed it
        }
    }
}

/// Takes the steps of a block: one, and one for each primitive that is not a triangle. Returns
/// `false` if the ray is cut.
fn takes_block(steps: &RaySteps<'_>, block: &Block) -> bool {
    (0..=block.non_triangles().count_ones()).all(|_| steps.take())
}

/// Whether a point is cut away by a clip plane of its surface.
pub(super) fn is_clipped(surface: &Surface, at: Vec3) -> bool {
    let mut planes = surface.clip.iter();
    planes.any(|(normal, distance)| normal.dot(at) < *distance)
}
