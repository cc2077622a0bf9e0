//! Finds the hits of a ray on the primitives of prototypes.

use glam::{DAffine3, DMat4, DVec3};
use ivcam_base::math::lanes::bits;
use ivcam_inventor::traversal::Grid;

use super::extent::grid_bounds;
use super::local_ray::LocalRay;
use super::prototype::{Content, Prototype, PrototypeElement, copy_matrix};
use super::shape::ShapeLists;
use super::store::Instances;
use super::tree::PrototypeTree;
use crate::bvh::{Hit, PreparedRay};
use crate::geometry::Quadric;

/// The largest number of ranges of a grid that wait to be visited: one for each halving of three
/// 31-bit numbers, and the whole.
const RANGES: usize = 97;

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
    found: &'f mut dyn FnMut(Hit) -> f32,
}

/// An element of a prototype, with the prototype.
type Part<'a> = (&'a Prototype, &'a PrototypeElement);

/// A range of the places of a grid: the first and the last in each direction.
#[derive(Clone, Copy)]
struct GridRange {
    from: [u32; 3],
    to: [u32; 3],
    /// The distance at which the ray enters its box; infinite if it misses it.
    near: f32,
}

impl Instances {
    /// Calls `found` with the hits of a ray on one of the scene's instances, or on one grid of them.
    /// `found` returns the farthest distance of interest for further hits, and this function returns
    /// the last of these. Near primitives come first if `sorted`, else the order is the fastest one.
    pub(in crate::scene) fn search(
        &self,
        lists: ShapeLists<'_>,
        (ray, sorted): (&PreparedRay, bool),
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
            found,
        };
        let element = &self.root.elements[element];
        search.element((&self.root, element), &DMat4::IDENTITY, 0);
        search.t_max
    }
}

impl<'a> InstanceSearch<'a, '_> {
    /// Whether no further hit matters.
    fn is_over(&self) -> bool {
        self.t_max < self.t_min
    }

    fn local_ray(&self, world: DMat4, bounds: (DVec3, DVec3)) -> LocalRay {
        let placed = self.instances.placed(world);
        LocalRay::new(self.origin, self.direction, &placed, bounds)
    }

    /// Searches the instances of an element of a prototype, which has a matrix to the world and whose
    /// first primitive has the number `first` in order of drawing.
    fn element(&mut self, (prototype, element): Part<'a>, world: &DMat4, first: u64) {
        // The primitives of shapes are items of the tree.
        let Content::Instance {
            prototype: inner,
            grid,
        } = &element.content
        else {
            return;
        };
        let world = prototype.world(element, world);
        let first = first + element.first;
        match grid {
            None => self.prototype(*inner, world, first),
            Some(grid) => self.grid(grid, *inner, &world, first),
        }
    }

    /// Searches a prototype.
    fn prototype(&mut self, number: u32, world: DMat4, first: u64) {
        let prototype = &self.instances.prototypes[number as usize];
        let PrototypeTree { tree, items, boxes } = &self.trees[number as usize];
        let ray = self.local_ray(world, prototype.extent.bounds);
        // The element whose primitives were tested last, with its placement.
        let mut last = (u32::MAX, DAffine3::IDENTITY);
        let limits = (self.t_min, self.t_max);
        let padded = (&ray.prepared, ray.padding.as_vec3());
        tree.walk_padded(padded, self.sorted, limits, |block, _, _| {
            for lane in bits(block.non_triangles()) {
                let item = items[block.primitive(lane) as usize];
                let element = &prototype.elements[item.element as usize];
                if let Content::Instance { .. } = element.content {
                    let (low, high) = boxes[item.number as usize];
                    let bounds = (low.as_dvec3(), high.as_dvec3());
                    if ray.enters(bounds, (self.t_min, self.t_max)).is_some() {
                        self.element((prototype, element), &world, first);
                    }
                } else {
                    if last.0 != item.element {
                        let world = prototype.world(element, &world);
                        last = (item.element, self.instances.placed(world));
                    }
                    self.primitive(item.number, first + element.first + 1, &last.1);
                }
                if self.is_over() {
                    break;
                }
            }
            self.t_max
        });
    }

    /// Tests a triangle, or a round surface, which the ray may hit twice.
    fn primitive(&mut self, primitive: u32, place: u64, placed: &DAffine3) {
        let mut hit = Hit {
            t: self.t_min,
            primitive,
            u: 0.0,
            v: 0.0,
            place,
        };
        if let Some(corners) = self.lists.triangles.get(primitive as usize) {
            // These are the operations of `Placement::point`.
            let corners = corners.map(|p| placed.transform_point3(p.as_dvec3()).as_vec3());
            if let Some((t, u, v)) = self.ray.triangle(&corners, self.t_min, self.t_max) {
                (hit.t, hit.u, hit.v) = (t, u, v);
                self.t_max = (self.found)(hit);
            }
            return;
        }
        let stored = &self.lists.quadrics[primitive as usize - self.lists.triangles.len()];
        let Some(quadric) = Quadric::new(stored.kind, *placed, stored.material) else {
            return;
        };
        let roots = quadric.intersect(self.origin, self.direction);
        for t in roots.map(|t| t as f32) {
            if t > hit.t && t < self.t_max {
                hit.t = t;
                self.t_max = (self.found)(hit);
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
            near: f32::INFINITY,
        };
        let ray = self.local_ray(*world, around(&all));
        let enter = |range: &mut GridRange, limits| {
            if let Some(near) = ray.enters(around(range), limits) {
                range.near = near as f32;
            }
        };
        enter(&mut all, (self.t_min, self.t_max));
        let mut waiting = [all; RANGES];
        let mut count = 1;
        while count > 0 && !self.is_over() {
            count -= 1;
            let range = waiting[count];
            // A range at the limit itself may hold a hit within rounding.
            let limit = self.t_max + self.t_max.abs() * 1e-5;
            if range.near == f32::INFINITY || range.near > limit {
                continue;
            }
            let Some([mut a, mut b]) = range.halves() else {
                let place = range.number(grid);
                let each = first + place * inside.count;
                self.prototype(number, copy_matrix(grid, world, place), each);
                continue;
            };
            let limits = (self.t_min, self.t_max);
            enter(&mut a, limits);
            enter(&mut b, limits);
            let (near, far) = if b.near < a.near { (b, a) } else { (a, b) };
            waiting[count..count + 2].copy_from_slice(&[far, near]);
            count += 2;
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
        let missed = Self {
            near: f32::INFINITY,
            ..*self
        };
        let (mut a, mut b) = (missed, missed);
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
