//! Finds the hits of a ray on the primitives of prototypes.

use glam::{DAffine3, DMat4, DVec3};
use ivcam_base::math::lanes::bits;
use ivcam_inventor::traversal::Grid;

use super::extent::grid_bounds;
use super::local_ray::LocalRay;
use super::prototype::{ElementContent, Prototype, copy_matrix};
use super::shape::ShapeLists;
use super::steps::RaySteps;
use super::store::Instances;
use super::tree::{InstanceItem, PrototypeTree};
use crate::bvh::{Hit, PreparedRay};
use crate::geometry::Quadric;

/// The largest number of ranges of a grid that wait to be visited: one for each halving of three
/// 31-bit numbers.
const RANGES: usize = 96;

/// A search for the hits of one ray.
struct InstanceSearch<'a, 'f> {
    instances: &'a Instances,
    lists: ShapeLists<'a>,
    trees: &'a [PrototypeTree],
    /// The ray in the scene.
    ray: &'a PreparedRay,
    origin: DVec3,
    direction: DVec3,
    t_min: f32,
    t_max: f32,
    /// Whether near boxes are visited first.
    sorted: bool,
    steps: &'a RaySteps<'a>,
    found: &'f mut dyn FnMut(Hit) -> f32,
}

/// A prototype that is being searched.
struct Visit<'a> {
    prototype: &'a Prototype,
    tree: &'a PrototypeTree,
    /// The matrix from the prototype's space to the world.
    world: DMat4,
    /// The number of its first primitive in order of drawing.
    first: u64,
}

/// A range of the places of a grid: the first and the last in each direction.
#[derive(Clone, Copy, Default)]
struct GridRange {
    from: [u32; 3],
    to: [u32; 3],
    near: f32,
}

impl Instances {
    /// Calls `found` with the hits of a ray on one of the scene's instances, or on one grid of
    /// them. `found` returns the farthest distance of interest for further hits, and this function
    /// returns the last of these. Near primitives come first if `sorted`, else the order is the
    /// fastest one.
    pub(in crate::scene) fn search(
        &self,
        lists: ShapeLists<'_>,
        (ray, sorted, steps): (&PreparedRay, bool, &RaySteps<'_>),
        element: usize,
        (t_min, t_max): (f32, f32),
        found: &mut dyn FnMut(Hit) -> f32,
    ) -> f32 {
        let mut search = InstanceSearch {
            instances: self,
            lists,
            trees: self.trees(lists),
            ray,
            origin: ray.origin.as_dvec3(),
            direction: ray.direction.as_dvec3(),
            t_min,
            t_max,
            sorted,
            steps,
            found,
        };
        search.element(&self.root, element, &DMat4::IDENTITY, 0);
        search.t_max
    }
}

impl<'a> InstanceSearch<'a, '_> {
    /// Whether no further hit matters.
    fn is_over(&self) -> bool {
        self.t_max < self.t_min
    }

    /// Takes a step in a prototype. If the ray is cut, no further hit matters.
    #[inline]
    fn step(&mut self, prototype: u32) -> bool {
        let may_go_on = self.steps.take();
        if !may_go_on {
            self.t_max = f32::NEG_INFINITY;
            self.instances.cut_in.note(prototype);
        }
        may_go_on
    }

    /// The matrix to the scene of a matrix to the world.
    fn placed(&self, world: DMat4) -> DAffine3 {
        self.instances.placed(world)
    }

    fn local_ray(&self, world: DMat4, bounds: (DVec3, DVec3)) -> LocalRay {
        LocalRay::new(self.origin, self.direction, &self.placed(world), bounds)
    }

    /// Searches the instances of an element.
    fn element(&mut self, prototype: &'a Prototype, number: usize, world: &DMat4, first: u64) {
        let element = &prototype.elements[number];
        let world = prototype.world(element, world);
        let first = first + element.first;
        match &element.content {
            ElementContent::Shape { .. } => {} // its primitives are items of the tree
            ElementContent::Instance { prototype, grid } => match grid {
                None => self.prototype(*prototype, world, first),
                Some(grid) => self.grid(grid, *prototype, &world, first),
            },
        }
    }

    /// Searches a prototype.
    fn prototype(&mut self, number: u32, world: DMat4, first: u64) {
        if !self.step(number) {
            return;
        }
        let visit = Visit {
            prototype: &self.instances.prototypes[number as usize],
            tree: &self.trees[number as usize],
            world,
            first,
        };
        let ray = self.local_ray(world, visit.prototype.extent.bounds);
        // The element whose primitives were tested last, with its placement.
        let mut last = (u32::MAX, DAffine3::IDENTITY);
        let limits = (self.t_min, self.t_max);
        let padded = (&ray.prepared, ray.padding.as_vec3());
        let tree = &visit.tree.tree;
        tree.walk_padded(padded, self.sorted, limits, |block, _, _| {
            for lane in bits(block.non_triangles()) {
                if !self.step(number) {
                    break;
                }
                let item = visit.tree.items[block.primitive(lane) as usize];
                self.item(item, &visit, &ray, &mut last);
                if self.is_over() {
                    break;
                }
            }
            self.t_max
        });
    }

    /// Tests what is in a box of a prototype's tree.
    fn item(
        &mut self,
        item: InstanceItem,
        visit: &Visit<'a>,
        ray: &LocalRay,
        last: &mut (u32, DAffine3),
    ) {
        let (element, primitive) = match item {
            InstanceItem::Inner {
                element,
                box_number,
            } => {
                let (low, high) = visit.tree.boxes[box_number as usize];
                let bounds = (low.as_dvec3(), high.as_dvec3());
                if ray.enters(bounds, (self.t_min, self.t_max)).is_some() {
                    self.element(visit.prototype, element as usize, &visit.world, visit.first);
                }
                return;
            }
            InstanceItem::Triangle { element, triangle } => (element, triangle),
            InstanceItem::Quadric { element, quadric } => (element, quadric),
        };
        let part = &visit.prototype.elements[element as usize];
        if last.0 != element {
            let world = visit.prototype.world(part, &visit.world);
            *last = (element, self.placed(world));
        }
        let place = visit.first + part.first + 1;
        match item {
            InstanceItem::Triangle { .. } => self.triangle(primitive, place, &last.1),
            _ => self.quadric(primitive, place, &last.1),
        }
    }

    /// Tests a triangle.
    fn triangle(&mut self, primitive: u32, place: u64, placed: &DAffine3) {
        let corners = self.lists.triangles[primitive as usize];
        // These are the operations of `Placement::point`.
        let corners = corners.map(|p| placed.transform_point3(p.as_dvec3()).as_vec3());
        if let Some((t, u, v)) = self.ray.triangle(&corners, self.t_min, self.t_max) {
            self.t_max = (self.found)(Hit {
                t,
                primitive,
                u,
                v,
                place,
            });
        }
    }

    /// Tests a round surface, which the ray may hit twice.
    fn quadric(&mut self, number: u32, place: u64, placed: &DAffine3) {
        let stored = &self.lists.quadrics[number as usize];
        let Some(quadric) = Quadric::new(stored.kind, *placed, stored.material) else {
            return;
        };
        let roots = quadric.intersect(self.origin, self.direction);
        let mut from = self.t_min;
        for t in roots.map(|t| t as f32) {
            if t > from && t < self.t_max {
                from = t;
                let primitive = self.lists.triangles.len() as u32 + number;
                self.t_max = (self.found)(Hit::on(primitive, place, t));
            }
        }
    }

    /// Searches the copies of a prototype on a grid, by halving ranges of places.
    fn grid(&mut self, grid: &Grid, number: u32, world: &DMat4, first: u64) {
        let inside = &self.instances.prototypes[number as usize].extent;
        let around = |range: &GridRange| {
            let wide = |place: [u32; 3]| place.map(u64::from);
            let (low, high) = grid_bounds(grid, wide(range.from), wide(range.to));
            (inside.bounds.0 + low, inside.bounds.1 + high)
        };
        let mut all = GridRange {
            from: [0; 3],
            to: grid.counts.map(|n| (n - 1) as u32),
            near: 0.0,
        };
        let ray = self.local_ray(*world, around(&all));
        let enters = |range: &GridRange, limits| ray.enters(around(range), limits);
        let mut waiting = [GridRange::default(); RANGES];
        let mut count = 0;
        if enters(&all, (self.t_min, self.t_max)).is_none() {
            return;
        }
        loop {
            if !self.step(number) {
                return;
            }
            if let Some([mut a, mut b]) = all.halves() {
                let limits = (self.t_min, self.t_max);
                let enter = |half: &mut GridRange| {
                    let near = enters(half, limits);
                    half.near = near.unwrap_or(f64::INFINITY) as f32;
                    near.is_some()
                };
                let (hits_a, hits_b) = (enter(&mut a), enter(&mut b));
                if hits_a && hits_b {
                    let (near, far) = if b.near < a.near { (b, a) } else { (a, b) };
                    waiting[count] = far;
                    count += 1;
                    all = near;
                    continue;
                }
                if hits_a || hits_b {
                    all = if hits_a { a } else { b };
                    continue;
                }
            } else {
                let place = all.number(grid);
                let each = first + place * inside.count;
                self.prototype(number, copy_matrix(grid, world, place), each);
            }
            loop {
                if count == 0 || self.is_over() {
                    return;
                }
                count -= 1;
                all = waiting[count];
                // A range at the limit itself may hold a hit within rounding.
                if all.near <= self.t_max + self.t_max.abs() * 1e-5 {
                    break;
                }
            }
        }
    }
}

impl GridRange {
    /// Returns the halves of the range along its longest side, or `None` for a single place.
    fn halves(&self) -> Option<[Self; 2]> {
        let length = |axis: &usize| self.to[*axis] - self.from[*axis];
        let axis = (0..3).max_by_key(length)?;
        if length(&axis) == 0 {
            return None;
        }
        let middle = self.from[axis] + length(&axis) / 2;
        let (mut a, mut b) = (*self, *self);
        a.to[axis] = middle;
        b.from[axis] = middle + 1;
        Some([a, b])
    }

    /// The number of a single place, with x fastest and z slowest.
    fn number(&self, grid: &Grid) -> u64 {
        let [columns, rows, _] = grid.counts;
        let [i, j, k] = self.from.map(u64::from);
        i + columns * (j + rows * k)
    }
}
