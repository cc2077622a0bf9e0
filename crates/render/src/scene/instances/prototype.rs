//! A prototype: shapes in their object space, and other prototypes.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use glam::DMat4;
use ivcam_base::diag::{Source, Span};
use ivcam_inventor::traversal::Grid;

use super::extent::Extent;

/// The content of an element of a prototype.
#[derive(Clone, Debug)]
pub(in crate::scene) enum ElementContent {
    /// The shape with the number of a surface.
    Shape { surface: u32 },
    /// An instance of the prototype with a number, or instances at every place of a grid.
    Instance {
        prototype: u32,
        grid: Option<Box<Grid>>,
    },
}

/// A part of a prototype.
#[derive(Clone, Debug)]
pub(super) struct PrototypeElement {
    /// The number of its first primitive in the prototype, in order of drawing.
    pub first: u64,
    /// The matrices from the prototype's space to its own, as indices in [`Prototype::steps`].
    pub steps: Range<u32>,
    /// What it draws.
    pub content: ElementContent,
}

/// A part of the scene that is stored once and drawn many times.
#[derive(Debug)]
pub(in crate::scene) struct Prototype {
    /// The elements in order of drawing. Each draws something.
    pub(super) elements: Vec<PrototypeElement>,
    /// The matrices of the elements.
    steps: Vec<DMat4>,
    /// The size of all elements.
    pub extent: Extent,
    /// Whether it is a glyph of a text.
    pub is_glyph: bool,
    /// Whether everything in it is opaque, so that of two copies at one place one is seen.
    pub is_opaque: bool,
    /// The first part of the scene that is this prototype.
    pub source: Option<(Arc<Source>, Span)>,
}

impl Default for Prototype {
    fn default() -> Self {
        Self {
            elements: Vec::new(),
            steps: Vec::new(),
            extent: Extent::NONE,
            is_glyph: false,
            is_opaque: false,
            source: None,
        }
    }
}

impl Prototype {
    /// What the elements draw.
    pub(in crate::scene) fn contents(&self) -> impl Iterator<Item = &ElementContent> {
        self.elements.iter().map(|element| &element.content)
    }

    /// The number of elements.
    pub(in crate::scene) fn len(&self) -> usize {
        self.elements.len()
    }

    /// Adds an element with its extent in the prototype's space. Returns `None`, without adding
    /// it, if the prototype would be too large.
    pub(in crate::scene) fn add(
        &mut self,
        content: ElementContent,
        matrices: &[DMat4],
        extent: &Extent,
    ) -> Option<()> {
        let first = self.extent.count;
        self.extent = self.extent.and(extent)?;
        let from = self.steps.len() as u32;
        self.steps.extend_from_slice(matrices);
        self.elements.push(PrototypeElement {
            first,
            steps: from..self.steps.len() as u32,
            content,
        });
        Some(())
    }

    /// Returns what the prototype draws if that is one grid of another prototype: the matrices
    /// before the grid, if they only move it, the number of that prototype, and the grid.
    pub(in crate::scene) fn as_grid(&self) -> Option<(&[DMat4], u32, &Grid)> {
        let [element] = &self.elements[..] else {
            return None;
        };
        let ElementContent::Instance {
            prototype,
            grid: Some(grid),
        } = &element.content
        else {
            return None;
        };
        let matrices = self.matrices(element);
        let only_moves = |m: &DMat4| {
            let still = DMat4::from_translation(m.w_axis.truncate());
            *m == still
        };
        let is_first = element.first == 0;
        (is_first && matrices.iter().all(only_moves)).then_some((matrices, *prototype, grid))
    }

    /// Drops an instance if a later one of the same prototype has the same matrices and grid, and
    /// the prototype is opaque. `is_opaque` answers for the number of a prototype.
    pub(in crate::scene) fn drop_covered(&mut self, is_opaque: impl Fn(u32) -> bool) {
        let mut last: HashMap<u64, usize> = HashMap::new();
        let mut is_covered = vec![false; self.elements.len()];
        for (number, element) in self.elements.iter().enumerate().rev() {
            let ElementContent::Instance { prototype, grid } = &element.content else {
                continue;
            };
            if !is_opaque(*prototype) {
                continue;
            }
            let key = self.matrices(element).iter().flat_map(DMat4::to_cols_array);
            let key = key.fold(u64::from(*prototype), |key, x| {
                (key ^ x.to_bits())
                    .wrapping_mul(0x9e37_79b9_7f4a_7c15)
                    .rotate_left(29)
            });
            let known = *last.entry(key).or_insert(number);
            let other = &self.elements[known];
            is_covered[number] = known != number
                && self.matrices(other) == self.matrices(element)
                && matches!(&other.content, ElementContent::Instance { prototype: p, grid: g }
                    if p == prototype && g == grid);
        }
        let mut is_covered = is_covered.into_iter();
        self.elements
            .retain(|_| !is_covered.next().unwrap_or(false));
    }

    /// Leaves room for shapes of the scene, which are drawn between elements. Returns the number of
    /// the first one, or `None` if there are too many.
    pub(in crate::scene) fn skip(&mut self, primitives: u64) -> Option<u64> {
        let first = self.extent.count;
        let only_count = Extent::of_count(primitives);
        self.extent = self.extent.and(&only_count)?;
        Some(first)
    }

    /// The matrices from the prototype's space to an element's.
    pub(super) fn matrices(&self, element: &PrototypeElement) -> &[DMat4] {
        &self.steps[element.steps.start as usize..element.steps.end as usize]
    }

    /// The matrix from an element's space to the world, given the prototype's. It is multiplied in
    /// the order of a walk.
    pub(super) fn world(&self, element: &PrototypeElement, world: &DMat4) -> DMat4 {
        let matrices = self.matrices(element).iter();
        matrices.fold(*world, |world, matrix| world * *matrix)
    }

    /// The element with a primitive, by its number in the prototype.
    pub(super) fn element_with(&self, primitive: u64) -> &PrototypeElement {
        let after = self.elements.partition_point(|e| e.first <= primitive);
        &self.elements[after - 1]
    }
}

/// The matrix of one copy of a grid.
pub(super) fn copy_matrix(grid: &Grid, world: &DMat4, number: u64) -> DMat4 {
    *world * DMat4::from_translation(grid.offset(number))
}
