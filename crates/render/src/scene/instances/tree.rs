//! The tree over the primitives and elements of a prototype.

use glam::Vec3;

use super::extent::{moved, product};
use super::prototype::{ElementContent, Prototype};
use super::shape::ShapeLists;
use super::store::{Instances, outward};
use crate::bvh::Bvh;

/// What is in a box of the tree. `element` is the index of an element of the prototype.
#[derive(Clone, Copy, Debug)]
pub(super) enum InstanceItem {
    /// A triangle, by its index.
    Triangle { element: u32, triangle: u32 },
    /// A round surface, by its index.
    Quadric { element: u32, quadric: u32 },
    /// Instances of another prototype, with the index of their box.
    Inner { element: u32, box_number: u32 },
}

/// The tree of a prototype.
#[derive(Debug)]
pub(super) struct PrototypeTree {
    /// The tree, in the prototype's space.
    pub tree: Bvh,
    /// What is in each of the tree's boxes.
    pub items: Vec<InstanceItem>,
    /// The boxes of instances of other prototypes.
    pub boxes: Vec<(Vec3, Vec3)>,
}

impl PrototypeTree {
    /// Builds the tree of a prototype.
    pub(super) fn new(instances: &Instances, lists: ShapeLists<'_>, prototype: &Prototype) -> Self {
        let (mut all, mut items, mut boxes) = (Vec::new(), Vec::new(), Vec::new());
        for (element, part) in (0..).zip(&prototype.elements) {
            let matrix = product(prototype.matrices(part));
            if let ElementContent::Shape { surface } = part.content {
                for number in lists.numbers(&instances.shapes[surface as usize]) {
                    all.push(outward(lists.around(number, &matrix)));
                    items.push(match number.checked_sub(lists.triangles.len() as u32) {
                        None => InstanceItem::Triangle {
                            element,
                            triangle: number,
                        },
                        Some(quadric) => InstanceItem::Quadric { element, quadric },
                    });
                }
                continue;
            }
            let around = outward(moved(instances.bounds(&part.content), &matrix));
            let box_number = boxes.len() as u32;
            items.push(InstanceItem::Inner {
                element,
                box_number,
            });
            boxes.push(around);
            all.push(around);
        }
        Self {
            tree: Bvh::build(all.into_iter(), true, |_| None),
            items,
            boxes,
        }
    }
}
