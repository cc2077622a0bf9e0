//! What a ray meets in a scene, and how much light gets through.

use glam::{DVec3, Vec3};

use super::looks::Surface;
use super::render_scene::RenderScene;
use crate::bvh::{Block, BlockHits, COPLANAR, Hit, PreparedRay, Ray};
use crate::math::lanes::bits;

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

impl RenderScene {
    /// The nearest thing a ray sees: closed surfaces from outside only, clip planes applied. Of
    /// things in one plane it is the one drawn last, as in OpenGL with Inventor's depth test.
    pub(crate) fn hit(&self, ray: &Ray) -> Option<Hit> {
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
    pub(crate) fn hit_any_side(&self, ray: &Ray) -> Option<Hit> {
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
    pub(crate) fn rank(&self, hit: &Hit) -> u64 {
        let owner = self.owners[hit.primitive as usize];
        let surface = &self.surfaces[owner as usize];
        let first = u64::from(surface.layer) << 1 | u64::from(!surface.is_opaque());
        // Surfaces number fewer than 2^29: each has a node.
        first << 61 | u64::from(owner) << 32 | u64::from(hit.primitive)
    }

    /// The ray that goes on behind what it met: to the rest of what lies in the same plane, from
    /// the last drawn to the first, then farther on. Nothing is met twice or left out.
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
    pub(super) fn meet(
        &self,
        ray: &PreparedRay,
        primitive: u32,
        t_min: f32,
        t_max: f32,
    ) -> Option<Hit> {
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

    pub(super) fn is_seen(&self, ray: &Ray, hit: &Hit) -> bool {
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
    pub(crate) fn transmittance(&self, ray: &Ray, t_max: f32) -> f32 {
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
    pub(super) fn stops_light(&self, primitive: u32) -> bool {
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

    /// Whether what two neighboring rays meet may be lit quite differently: other surfaces, or
    /// faces that are turned from each other by more than 10 degrees.
    pub(crate) fn is_unlike(&self, [a, b]: [(&Ray, Option<Hit>); 2]) -> bool {
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

    pub(super) fn geometric_normal(&self, ray: &Ray, hit: &Hit) -> Vec3 {
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
}
