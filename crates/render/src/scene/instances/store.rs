//! All prototypes of a scene, and how their primitives are placed in it.

use std::ops::Range;
use std::sync::OnceLock;

use glam::{DAffine3, DMat4, DVec3, Vec3};
use ivcam_inventor::traversal::Grid;

use super::extent::{Extent, moved, product};
use super::prototype::{Content, Prototype, PrototypeElement, copy_matrix};
use super::tree::PrototypeTree;
use crate::geometry::Quadric;
use crate::scene::placement::Placement;

/// The primitives of the shape with one surface.
#[derive(Clone, Debug, Default)]
pub(in crate::scene) struct ShapePrimitives {
    /// The number of the first one in order of drawing, for a shape that is no part of a
    /// prototype.
    pub first: u64,
    /// The triangles.
    pub triangles: Range<u32>,
    /// The round surfaces.
    pub quadrics: Range<u32>,
    /// The lines and points.
    pub strokes: Range<u32>,
}

impl ShapePrimitives {
    /// The number of primitives.
    pub(in crate::scene) fn len(&self) -> u64 {
        let all = [&self.triangles, &self.quadrics, &self.strokes];
        all.iter().map(|r| u64::from(r.end - r.start)).sum()
    }
}

/// The parts of a scene that are stored once and drawn many times.
///
/// Primitives are numbered as in the scene: triangles first, then quadrics.
#[derive(Debug, Default)]
pub(in crate::scene) struct Instances {
    /// The point of world space that is the scene's origin, in meters.
    origin: DVec3,
    /// The triangles of prototypes, each in the object space of its shape.
    pub triangles: Vec<[Vec3; 3]>,
    /// The round surfaces of prototypes, in object space.
    pub quadrics: Vec<Quadric>,
    /// The surface number of each triangle and quadric.
    pub owners: Vec<u32>,
    /// The prototypes. One is after those that it contains.
    pub prototypes: Vec<Prototype>,
    /// The grids on which prototypes are copied.
    pub grids: Vec<Grid>,
    /// The prototypes that the scene contains. Its space is the world.
    pub root: Prototype,
    /// The primitives of the shape with each surface.
    pub shapes: Vec<ShapePrimitives>,
    /// The tree of each prototype, which is built for the first ray.
    trees: OnceLock<Vec<PrototypeTree>>,
}

impl Instances {
    /// Returns a store without prototypes, for a scene with this origin.
    pub(in crate::scene) fn new(origin: DVec3) -> Self {
        Self {
            origin,
            ..Self::default()
        }
    }

    /// The number of primitives and elements of all prototypes, which are in their trees.
    pub(in crate::scene) fn len(&self) -> usize {
        let elements = self.prototypes.iter().map(Prototype::len).sum::<usize>();
        self.owners.len() + self.root.len() + elements
    }

    /// Returns the extent of an element, before the matrices that place it, or `None` if it is too
    /// large.
    pub(in crate::scene) fn extent(&self, content: Content) -> Option<Extent> {
        let prototype = |number: u32| &self.prototypes[number as usize].extent;
        match content {
            Content::Shape { .. } => None,
            Content::Prototype { number } => Some(prototype(number).inside()),
            Content::Grid { number, grid } => {
                let inside = prototype(number).inside();
                inside.copied(&self.grids[grid as usize])
            }
        }
    }

    /// The boxes of the scene's prototypes in the scene.
    pub(in crate::scene) fn boxes(&self) -> impl Iterator<Item = (Vec3, Vec3)> + '_ {
        self.root.elements.iter().map(|element| {
            let bounds = self.bounds(element.content);
            let (low, high) = moved(bounds, &product(self.root.matrices(element)));
            outward((low - self.origin, high - self.origin))
        })
    }

    /// The box of an element in its own space.
    pub(super) fn bounds(&self, content: Content) -> (DVec3, DVec3) {
        self.extent(content).unwrap_or(Extent::NONE).bounds
    }

    /// The trees of all prototypes.
    pub(super) fn trees(&self) -> &[PrototypeTree] {
        let tree = |prototype: &Prototype| PrototypeTree::new(self, prototype);
        self.trees
            .get_or_init(|| self.prototypes.iter().map(tree).collect())
    }

    /// The matrix from the object space of a shape to the world, by the number of the shape's first
    /// primitive in order of drawing.
    fn world_from_object(&self, mut number: u64) -> DMat4 {
        let (mut prototype, mut world) = (&self.root, DMat4::IDENTITY);
        loop {
            let element = prototype.element_with(number);
            number -= element.first;
            world = prototype.world(element, &world);
            match element.content {
                Content::Shape { .. } => return world,
                Content::Prototype { number: inner } => {
                    prototype = &self.prototypes[inner as usize];
                }
                Content::Grid {
                    number: inner,
                    grid,
                } => {
                    prototype = &self.prototypes[inner as usize];
                    let each = prototype.extent.count;
                    world = copy_matrix(&self.grids[grid as usize], &world, number / each);
                    number %= each;
                }
            }
        }
    }

    /// The matrix to the scene of a matrix to the world, as [`Placement`] computes it.
    pub(super) fn placed(&self, world: DMat4) -> DAffine3 {
        let mut affine = DAffine3::from_mat4(world);
        affine.translation -= self.origin;
        affine
    }

    /// The placement of a shape, by the place of a hit.
    #[inline(never)]
    pub(in crate::scene) fn placement(&self, place: u64) -> Placement {
        Placement::around(self.origin).moved_to(self.world_from_object(place - 1))
    }

    /// The corners of a triangle in the scene, or `None` for another primitive.
    #[inline(never)]
    pub(in crate::scene) fn corners(&self, primitive: u32, place: u64) -> Option<[Vec3; 3]> {
        let corners = self.triangles.get(primitive as usize)?;
        let placement = self.placement(place);
        Some(corners.map(|p| placement.point(p)))
    }

    /// A round surface in the scene, or `None` for another primitive.
    pub(in crate::scene) fn quadric(&self, primitive: u32, place: u64) -> Option<Quadric> {
        let index = (primitive as usize).checked_sub(self.triangles.len())?;
        let quadric = self.quadrics.get(index)?;
        let placement = self.placement(place).scene_from_object;
        Quadric::new(quadric.kind, placement, quadric.material)
    }

    /// The numbers of the triangles and round surfaces of the shape with a surface.
    pub(in crate::scene) fn primitives_of(&self, surface: u32) -> impl Iterator<Item = u32> {
        let shape = &self.shapes[surface as usize];
        let triangles = self.triangles.len() as u32;
        let quadrics = triangles + shape.quadrics.start..triangles + shape.quadrics.end;
        shape.triangles.clone().chain(quadrics)
    }

    /// Calls `found` with the surface and the place of each shape with a wanted surface, as often
    /// as it is drawn, up to a number of times. Glyphs are left out.
    pub(in crate::scene) fn each_shape(
        &self,
        is_wanted: &dyn Fn(u32) -> bool,
        most: usize,
        found: &mut dyn FnMut(u32, u64),
    ) {
        let mut contain_one: Vec<bool> = Vec::with_capacity(self.prototypes.len());
        for prototype in &self.prototypes {
            let is_one = |element: &PrototypeElement| match element.content {
                Content::Shape { surface } => is_wanted(surface),
                Content::Prototype { number } | Content::Grid { number, .. } => {
                    contain_one[number as usize]
                }
            };
            let contains = !prototype.is_glyph && prototype.elements.iter().any(is_one);
            contain_one.push(contains);
        }
        let mut left = most;
        let mut take = |surface: u32, place: u64| {
            if left > 0 && is_wanted(surface) {
                left -= 1;
                found(surface, place);
            }
            left > 0
        };
        self.shapes_in(&self.root, 0, &contain_one, &mut take);
    }

    /// Calls `take` with the shapes of a prototype until it returns `false`, which is returned.
    fn shapes_in(
        &self,
        prototype: &Prototype,
        before: u64,
        contain_one: &[bool],
        take: &mut dyn FnMut(u32, u64) -> bool,
    ) -> bool {
        prototype.elements.iter().all(|element| {
            let first = before + element.first;
            let (number, copies) = match element.content {
                Content::Shape { surface } => return take(surface, first + 1),
                Content::Prototype { number } => (number, 1),
                Content::Grid { number, grid } => (number, self.grids[grid as usize].len()),
            };
            let inner = &self.prototypes[number as usize];
            let mut copies = 0..if contain_one[number as usize] {
                copies
            } else {
                0
            };
            copies.all(|copy| {
                let first = first + copy * inner.extent.count;
                self.shapes_in(inner, first, contain_one, take)
            })
        })
    }

    /// The number of a primitive in order of drawing. `lists` are the numbers of triangles and of
    /// quadrics before those of the list that it is in: those of prototypes, or of the scene.
    pub(in crate::scene) fn number(
        &self,
        owner: u32,
        (primitive, place): (u32, u64),
        lists: [usize; 2],
    ) -> u64 {
        let shape = &self.shapes[owner as usize];
        let [triangles, quadrics] = lists.map(|n| n as u32);
        let count = |range: &Range<u32>| range.end - range.start;
        let local = if primitive < triangles {
            primitive - shape.triangles.start
        } else if primitive < triangles + quadrics {
            count(&shape.triangles) + (primitive - triangles - shape.quadrics.start)
        } else {
            let stroke = primitive - triangles - quadrics - shape.strokes.start;
            count(&shape.triangles) + count(&shape.quadrics) + stroke
        };
        let first = if place == 0 { shape.first } else { place - 1 };
        first + u64::from(local)
    }
}

/// Converts an f64 box to an f32 box that contains it and its primitives after rounding.
pub(super) fn outward((low, high): (DVec3, DVec3)) -> (Vec3, Vec3) {
    let down = |v: f64| ((v - v.abs() * 1e-12) as f32).next_down().next_down();
    let up = |v: f64| ((v + v.abs() * 1e-12) as f32).next_up().next_up();
    (
        Vec3::new(down(low.x), down(low.y), down(low.z)),
        Vec3::new(up(high.x), up(high.y), up(high.z)),
    )
}
