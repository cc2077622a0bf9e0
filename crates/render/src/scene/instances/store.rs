//! All prototypes of a scene, and how their primitives are placed in it.

use std::sync::OnceLock;

use glam::{DAffine3, DMat4, DVec3, Vec3};
use ivcam_inventor::traversal::Grid;

use super::extent::{Extent, moved, product};
use super::prototype::{ElementContent, Prototype, PrototypeElement, copy_matrix};
use super::shape::{ShapeLists, ShapePrimitives};
use super::steps::CutPrototype;
use super::tree::PrototypeTree;
use crate::geometry::Quadric;
use crate::scene::placement::Placement;

/// The prototypes of a scene and their instances.
#[derive(Debug, Default)]
pub(in crate::scene) struct Instances {
    /// The point of world space that is the scene's origin, in meters.
    origin: DVec3,
    /// The prototypes. One is after those that it contains.
    pub prototypes: Vec<Prototype>,
    /// The instances that the scene itself contains. Their space is the world.
    pub root: Prototype,
    /// The primitives of the shape with each surface.
    pub shapes: Vec<ShapePrimitives>,
    /// The tree of each prototype, which is built for the first ray.
    trees: OnceLock<Vec<PrototypeTree>>,
    /// The prototype in which a ray was cut.
    pub cut_in: CutPrototype,
}

impl Instances {
    /// Returns a store without prototypes, for a scene with this origin.
    pub(in crate::scene) fn new(origin: DVec3) -> Self {
        Self {
            origin,
            ..Self::default()
        }
    }

    /// The number of elements of all prototypes, which are in their trees.
    pub(in crate::scene) fn len(&self) -> usize {
        let elements = self.prototypes.iter().map(Prototype::len).sum::<usize>();
        self.root.len() + elements
    }

    /// Whether the shape with a surface is in a prototype, so that it is drawn only by instances.
    pub(in crate::scene) fn has_shape(&self, surface: u32) -> bool {
        let shape = self.shapes.get(surface as usize);
        shape.is_none_or(|shape| shape.first.is_none())
    }

    /// Returns the extent of instances, before the matrices that place them, or `None` if it is too
    /// large.
    pub(in crate::scene) fn extent(&self, content: &ElementContent) -> Option<Extent> {
        let ElementContent::Instance { prototype, grid } = content else {
            return None;
        };
        let inside = self.prototypes[*prototype as usize].extent.inside();
        match grid {
            None => Some(inside),
            Some(grid) => inside.copied(grid),
        }
    }

    /// Returns an instance of a prototype, once or on a grid. If it is opaque, copies at one place
    /// are one copy: a grid of a grid becomes one grid. `matrices` lead to the instance.
    pub(in crate::scene) fn content(
        &self,
        mut prototype: u32,
        mut grid: Option<Grid>,
        matrices: &mut Vec<DMat4>,
    ) -> ElementContent {
        while let Some(outer) = &mut grid
            && let part = &self.prototypes[prototype as usize]
            && part.is_opaque
        {
            *outer = outer.without_repeats();
            let Some((between, inner, finer)) = part.as_grid() else {
                break;
            };
            let Some(both) = outer.of_grids(finer) else {
                break;
            };
            matrices.extend_from_slice(between);
            (prototype, *outer) = (inner, both);
        }
        let grid = grid.map(Box::new);
        ElementContent::Instance { prototype, grid }
    }

    /// The boxes of the scene's instances in the scene.
    pub(in crate::scene) fn boxes(&self) -> impl Iterator<Item = (Vec3, Vec3)> + '_ {
        self.root.elements.iter().map(|element| {
            let bounds = self.bounds(&element.content);
            let (low, high) = moved(bounds, &product(self.root.matrices(element)));
            outward((low - self.origin, high - self.origin))
        })
    }

    /// The box of instances in their own space.
    pub(super) fn bounds(&self, content: &ElementContent) -> (DVec3, DVec3) {
        self.extent(content).unwrap_or(Extent::NONE).bounds
    }

    /// The trees of all prototypes.
    pub(super) fn trees(&self, lists: ShapeLists<'_>) -> &[PrototypeTree] {
        let tree = |prototype: &Prototype| PrototypeTree::new(self, lists, prototype);
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
            let ElementContent::Instance {
                prototype: inner,
                grid,
            } = &element.content
            else {
                return world;
            };
            prototype = &self.prototypes[*inner as usize];
            if let Some(grid) = grid {
                let each = prototype.extent.count;
                world = copy_matrix(grid, &world, number / each);
                number %= each;
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

    /// A round surface of a prototype in the scene.
    pub(in crate::scene) fn quadric(&self, quadric: &Quadric, place: u64) -> Option<Quadric> {
        let placement = self.placement(place).scene_from_object;
        Quadric::new(quadric.kind, placement, quadric.material)
    }

    /// Returns the surface and the place of each shape with a wanted surface, as often as it is
    /// drawn, up to a number of times. Glyphs are left out.
    pub(in crate::scene) fn shapes_with(
        &self,
        is_wanted: &dyn Fn(u32) -> bool,
        most: usize,
    ) -> Vec<(u32, u64)> {
        let mut contain_one: Vec<bool> = Vec::with_capacity(self.prototypes.len());
        for prototype in &self.prototypes {
            let is_one = |element: &PrototypeElement| match element.content {
                ElementContent::Shape { surface } => is_wanted(surface),
                ElementContent::Instance { prototype, .. } => contain_one[prototype as usize],
            };
            let contains = !prototype.is_glyph && prototype.elements.iter().any(is_one);
            contain_one.push(contains);
        }
        let mut found = Vec::new();
        let wanted = (is_wanted, &contain_one[..], most);
        self.collect_shapes(&self.root, 0, wanted, &mut found);
        found.truncate(most);
        found
    }

    /// Adds the wanted shapes of a prototype whose first primitive has the number `before` in order
    /// of drawing.
    fn collect_shapes(
        &self,
        prototype: &Prototype,
        before: u64,
        wanted: (&dyn Fn(u32) -> bool, &[bool], usize),
        found: &mut Vec<(u32, u64)>,
    ) {
        let (is_wanted, contain_one, most) = wanted;
        for element in &prototype.elements {
            let first = before + element.first;
            match &element.content {
                ElementContent::Shape { surface } => {
                    found.extend(is_wanted(*surface).then_some((*surface, first + 1)));
                }
                ElementContent::Instance { prototype, grid }
                    if contain_one[*prototype as usize] =>
                {
                    let inner = &self.prototypes[*prototype as usize];
                    for copy in 0..grid.as_ref().map_or(1, |grid| grid.len()) {
                        if found.len() >= most {
                            return;
                        }
                        let first = first + copy * inner.extent.count;
                        self.collect_shapes(inner, first, wanted, found);
                    }
                }
                ElementContent::Instance { .. } => {}
            }
        }
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
