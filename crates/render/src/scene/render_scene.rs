//! A compiled scene.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::{DVec3, Vec3};
use ivcam_base::diag::{Diagnostic, ErrorKind, Result, counted};
use ivcam_base::work::{Budget, StopSignal, WorkLimit, until_stopped};

use super::census::Census;
use super::emitter_list::Emitters;
use super::instances::Instances;
use super::looks::{Background, Light, LightSets, Surface};
use super::surface_names::SurfaceNames;
use crate::bvh::{Bvh, Hit};
use crate::geometry::{Quadric, Stroke, StrokeView, piece_counts};

/// A compiled scene: primitives that rays can hit, and their surfaces. Primitives are numbered:
/// triangles first, then quadrics, then strokes.
#[derive(Debug, Default)]
pub struct RenderScene {
    /// The point of world space that is the scene's origin, in meters.
    pub origin: DVec3,
    pub(super) triangles: Vec<[Vec3; 3]>,
    pub(super) quadrics: Vec<Quadric>,
    /// The strokes. A long line is divided into several.
    pub(super) strokes: Vec<Stroke>,
    /// The number of strokes that are not the first part of their line.
    pub(super) further_pieces: usize,
    /// The surface number of each triangle, quadric and stroke. Those of prototypes are in the same
    /// lists, in the object space of their shape.
    pub(super) owners: Vec<u32>,
    pub(super) surfaces: Vec<Surface>,
    /// The names of the surfaces, if they were asked for.
    pub(super) names: Option<Box<SurfaceNames>>,
    pub(super) light_sets: LightSets,
    /// The lights that are in no set, if the options asked for them.
    pub(super) idle_lights: Option<Vec<Light>>,
    /// The prototypes with their instances, if there are any.
    pub(super) instances: Option<Box<Instances>>,
    /// The tree, which is built for the first ray. Its last boxes are those of instances.
    pub(super) tree: OnceLock<Bvh>,
    /// The luminous shapes as lights, which are found for the first light path.
    pub(super) emitters: OnceLock<Emitters>,
    /// Whether any surface is clipped, culled or drawn over everything else.
    pub(super) special: bool,
    /// Whether any surface is drawn over everything else.
    pub(super) annotated: bool,
    /// Whether any surface casts shadows only where a light sees its front.
    pub(super) culls_shadows: bool,
    /// Whether every surface blocks all light.
    pub(super) solid: bool,
    /// The transmittance of each surface: see [`Surface::transmittance`].
    pub(super) surface_transmittances: Vec<f32>,
    /// The camera, for sizes in pixels.
    pub(super) view: StrokeView,
    pub(super) background: Background,
    pub(super) census: Census,
    pub(super) bounds: Option<(Vec3, Vec3)>,
    /// The signal that ends all rays.
    pub(super) stop: StopSignal,
    /// The number of steps that a ray may take between parts that overlap.
    pub(super) most_steps: u64,
    /// The number of rays that took more.
    pub(super) cut: AtomicU64,
}

/// The number of rays for each primitive from which a refined tree saves more time than it takes to
/// build. Measurements are in docs/decisions/0005-who-builds-the-tree.md.
const RAYS_TO_REFINE: u64 = 64;

/// A triangle in world space, with the values that Coin's triangle callback gives.
#[derive(Clone, Copy, Debug)]
pub struct OracleTriangle {
    /// The corners' positions in meters.
    pub position: [DVec3; 3],
    /// The corners' normals.
    pub normal: [Vec3; 3],
    /// The corners' diffuse colors.
    pub diffuse: [Vec3; 3],
    /// The transparency of the first corner.
    pub transparency: f32,
}

impl RenderScene {
    /// Computes the values that depend on the whole scene: bounds, fog and transparency.
    pub(super) fn finalize(&mut self) -> Result<()> {
        let budget = Budget::of_thread();
        let work = budget.as_ref().map_or(WorkLimit::default(), Budget::work);
        self.most_steps = work.of_ray();
        if let Some(budget) = budget {
            budget.check()?;
            self.stop = budget.stop().clone();
        }
        let instances = self.instances.as_ref().map_or(0, |all| all.root.len());
        if u32::try_from(self.owners.len() + instances).is_err() {
            return Err(Diagnostic::beyond_limit(
                "the scene has more than 2^32 primitives",
            ));
        }
        let both = |a: (Vec3, Vec3), b: (Vec3, Vec3)| (a.0.min(b.0), a.1.max(b.1));
        self.bounds = match &self.instances {
            None => {
                let triangles = around(self.triangles.as_flattened());
                self.boxes_of_others().chain(triangles).reduce(both)
            }
            Some(_) => self
                .boxes()
                .filter(|(low, high)| low.x <= high.x)
                .reduce(both),
        };
        self.resolve_fog_distance();
        if self.census.transparent {
            self.find_centers();
        }
        self.divide_lines();
        self.surface_transmittances = self.surfaces.iter().map(Surface::transmittance).collect();
        self.solid = self.surface_transmittances.iter().all(|t| *t == 0.0);
        Ok(())
    }

    /// Divides long lines, so that the boxes of their parts are small. Instances number their
    /// strokes by ranges, so a scene that has any keeps whole lines.
    fn divide_lines(&mut self) {
        let (Some(bounds), None) = (self.bounds, &self.instances) else {
            return;
        };
        let counts = piece_counts(&self.strokes, &self.view, bounds);
        if counts.iter().all(|count| *count == 1) {
            return;
        }
        let owners = self
            .owners
            .split_off(self.owners.len() - self.strokes.len());
        let strokes = std::mem::take(&mut self.strokes);
        self.further_pieces = counts.iter().map(|count| *count as usize - 1).sum();
        for ((stroke, owner), count) in strokes.into_iter().zip(owners).zip(counts) {
            self.strokes.extend(stroke.divided(count));
            self.owners
                .extend(std::iter::repeat_n(owner, count as usize));
        }
    }

    /// The bounding box of each primitive, which is empty for those of prototypes, and then of each
    /// instance.
    fn boxes(&self) -> impl Iterator<Item = (Vec3, Vec3)> + '_ {
        let triangles = self.triangles.iter();
        let triangles = triangles.map(|[a, b, c]| (a.min(*b).min(*c), a.max(*b).max(*c)));
        let own = triangles.chain(self.boxes_of_others()).zip(&self.owners);
        let own = own.map(|(around, owner)| match self.is_in_prototype(*owner) {
            true => (Vec3::INFINITY, Vec3::NEG_INFINITY),
            false => around,
        });
        own.chain(self.instances.iter().flat_map(|all| all.boxes()))
    }

    /// The bounding box of each quadric and stroke.
    fn boxes_of_others(&self) -> impl Iterator<Item = (Vec3, Vec3)> + '_ {
        let quadrics = self.quadrics.iter().map(|q| {
            let (min, max) = q.bounds();
            widen(min, max)
        });
        let strokes = self.strokes.iter().map(|s| s.bounds(&self.view));
        quadrics.chain(strokes)
    }

    /// Returns the tree, which is built at the first call. Bounds and counts are available without
    /// it.
    pub(super) fn tree(&self) -> &Bvh {
        self.tree.get_or_init(|| self.build_tree(true))
    }

    /// Whether the tests of primitives are steps of a ray, because many are at one place.
    pub(super) fn is_crowded(&self) -> bool {
        self.tree().is_crowded()
    }

    /// Builds the tree now, so that the first ray does not wait. It is refined if the expected
    /// number of rays pays for that.
    pub fn prepare(&self, rays: u64) {
        let own = self.owners.iter().filter(|o| !self.is_in_prototype(**o));
        let refined = rays / RAYS_TO_REFINE >= own.count() as u64;
        self.tree.get_or_init(|| self.build_tree(refined));
    }

    fn build_tree(&self, refined: bool) -> Bvh {
        let corners = |primitive: u32| self.triangles.get(primitive as usize).copied();
        Bvh::build(until_stopped(self.boxes()), refined, corners).measure_crowding()
    }

    /// Computes the center of the bounding box of each surface.
    fn find_centers(&mut self) {
        let mut around: Vec<Option<(Vec3, Vec3)>> = vec![None; self.surfaces.len()];
        let own = self.owners.iter().zip(self.boxes());
        for (owner, (min, max)) in own.filter(|(_, (min, max))| min.x <= max.x) {
            let all = &mut around[*owner as usize];
            *all = Some(all.map_or((min, max), |(a, b)| (a.min(min), b.max(max))));
        }
        for (surface, around) in self.surfaces.iter_mut().zip(around) {
            surface.center = around.map_or(Vec3::ZERO, |(min, max)| 0.5 * (min + max));
        }
    }

    /// Sets the visibility of fog that has none, and that no far plane ends, to the depth of the
    /// scene's far side, where Inventor's viewers put the far plane.
    fn resolve_fog_distance(&mut self) {
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

    /// The surface of a hit.
    pub fn surface(&self, hit: &Hit) -> &Surface {
        &self.surfaces[self.owner(hit.primitive) as usize]
    }

    /// The names of the surfaces, if the options asked for them.
    pub fn names(&self) -> Option<&SurfaceNames> {
        self.names.as_deref()
    }

    /// The counts of nodes, primitives and what was left out.
    pub fn census(&self) -> &Census {
        &self.census
    }

    /// The lights of a surface.
    pub(crate) fn lights_of(&self, surface: &Surface) -> impl Iterator<Item = &Light> + Clone {
        self.lights_of_set(surface.lights)
    }

    /// The lights of a set, by [`Surface::lights`].
    #[inline]
    pub(crate) fn lights_of_set(&self, set: u32) -> impl Iterator<Item = &Light> + Clone {
        self.light_sets.of_set(set)
    }

    /// The number of lights of a set.
    pub(crate) fn light_count(&self, set: u32) -> usize {
        self.light_sets.count(set)
    }

    /// All different lights of shapes.
    pub fn lights(&self) -> Vec<Light> {
        self.light_sets.different()
    }

    /// All different lights of shapes, and the lights that light no shape if the options asked for
    /// them.
    pub fn lights_on_lens(&self) -> Vec<Light> {
        let idle = self.idle_lights.iter().flatten();
        self.lights().into_iter().chain(idle.copied()).collect()
    }

    /// Whether any surface is lit by a light.
    pub fn has_lights(&self) -> bool {
        !self.light_sets.is_empty()
    }

    /// Returns whether all work on the scene has to end. Rays then find nothing, so whoever has
    /// traced some asks before it uses the results.
    pub fn is_stopped(&self) -> bool {
        self.stop.is_set()
    }

    /// Returns the number of rays that were cut so far, because they took too many steps between
    /// parts that overlap.
    pub fn cut_rays(&self) -> u64 {
        self.cut.load(Ordering::Relaxed)
    }

    /// Returns a warning about the rays that were cut, if there are any.
    pub fn warn_of_cut_rays(&self) -> Option<Box<Diagnostic>> {
        let rays = self.cut_rays();
        if rays == 0 {
            return None;
        }
        let (rays, most) = (counted(rays as usize, "ray"), self.most_steps);
        let warning = Diagnostic::warning(format!(
            "{rays} took more than {most} steps between parts that overlap; what they see is not \
             sure, and the error of the picture is unknown"
        ));
        let help = "`--work N` raises the limit, of which a ray may take a 262,144th";
        let warning = warning.of_kind(ErrorKind::Limit).with_help(help);
        let part = self.instances.as_ref().and_then(|all| {
            let prototype = all.cut_in.get();
            all.prototypes.get(prototype as usize)
        });
        Some(match part.and_then(|part| part.source.as_ref()) {
            Some((source, span)) => warning.at(source, *span),
            None => warning,
        })
    }

    /// The background, which rays without a hit see.
    pub fn background(&self) -> &Background {
        &self.background
    }

    /// The bounding box of the scene in meters, with the compile origin at zero.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.bounds
    }

    /// The numbers of triangles, of quadrics, and of lines and points, as stored: what is drawn
    /// many times counts once.
    pub fn primitives(&self) -> (usize, usize, usize) {
        let strokes = self.strokes.len() - self.further_pieces;
        (self.triangles.len(), self.quadrics.len(), strokes)
    }

    /// All surfaces, by number.
    pub(crate) fn surfaces(&self) -> &[Surface] {
        &self.surfaces
    }

    /// The triangles in order of traversal, without those of prototypes, for comparison with
    /// another program.
    pub fn triangles(&self) -> impl Iterator<Item = OracleTriangle> + '_ {
        let all = self.triangles.iter().enumerate();
        let own = all.filter(|(i, _)| !self.is_in_prototype(self.owners[*i]));
        own.map(|(i, corners)| {
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
            }
        })
    }
}

/// The bounding box of points, none of which is NaN.
fn around(points: &[Vec3]) -> Option<(Vec3, Vec3)> {
    // Four boxes at a time, so that the compiler uses vector instructions.
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

/// Converts an f64 box to an f32 box that contains it.
fn widen(min: DVec3, max: DVec3) -> (Vec3, Vec3) {
    let down = |v: f64| (v as f32).next_down();
    let up = |v: f64| (v as f32).next_up();
    (
        Vec3::new(down(min.x), down(min.y), down(min.z)),
        Vec3::new(up(max.x), up(max.y), up(max.z)),
    )
}
