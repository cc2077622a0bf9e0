//! The tree over the primitives and elements of a prototype.

use glam::{DAffine3, DVec3, Vec3};

use super::extent::{moved, product};
use super::prototype::{Content, Prototype};
use super::store::{Instances, outward};
use crate::bvh::Bvh;
use crate::geometry::quadric::exact_bounds;

/// What is in a box of the tree. `element` is the index of an element of the prototype.
#[derive(Clone, Copy, Debug)]
pub(super) enum InstanceItem {
    /// A triangle, by its index.
    Triangle { element: u32, triangle: u32 },
    /// A round surface, by its index.
    Quadric { element: u32, quadric: u32 },
    /// A prototype or a grid, with the index of its box.
    Inner { element: u32, box_number: u32 },
}

/// The tree of a prototype.
#[derive(Debug)]
pub(super) struct PrototypeTree {
    /// The tree, in the prototype's space.
    pub tree: Bvh,
    /// What is in each of the tree's boxes.
    pub items: Vec<InstanceItem>,
    /// The boxes of inner prototypes and grids.
    pub boxes: Vec<(Vec3, Vec3)>,
}

impl PrototypeTree {
    /// Builds the tree of a prototype.
    pub(super) fn new(instances: &Instances, prototype: &Prototype) -> Self {
        let (mut all, mut items, mut inner) = (Vec::new(), Vec::new(), Vec::new());
        for (number, element) in (0..).zip(&prototype.elements) {
            let matrix = product(prototype.matrices(element));
            let Content::Shape { surface } = element.content else {
                let around = outward(moved(instances.bounds(element.content), &matrix));
                items.push(InstanceItem::Inner {
                    element: number,
                    box_number: inner.len() as u32,
                });
                inner.push(around);
                all.push(around);
                continue;
            };
            let shape = &instances.shapes[surface as usize];
            for triangle in shape.triangles.clone() {
                all.push(outward(around(
                    &instances.triangles[triangle as usize],
                    &matrix,
                )));
                items.push(InstanceItem::Triangle {
                    element: number,
                    triangle,
                });
            }
            for quadric in shape.quadrics.clone() {
                let kind = instances.quadrics[quadric as usize].kind;
                all.push(outward(exact_bounds(kind, &matrix)));
                items.push(InstanceItem::Quadric {
                    element: number,
                    quadric,
                });
            }
        }
        Self {
            tree: Bvh::build(all.into_iter(), true, |_| None),
            items,
            boxes: inner,
        }
    }
}

/// The box around a triangle under a matrix.
pub(in crate::scene) fn around(corners: &[Vec3; 3], matrix: &DAffine3) -> (DVec3, DVec3) {
    let [a, b, c] = corners.map(|p| matrix.transform_point3(p.as_dvec3()));
    (a.min(b).min(c), a.max(b).max(c))
}
