//! What shapes draw into: the interface, the lists that they hand over, and the canvas that only
//! counts and bounds.
//!
//! A shape's function draws in the shape's own space through a [`Canvas`]. There are two of them:
//! [`BoundsCanvas`] for surveys, and the scene builder of `compile`, which keeps triangles and
//! materials. A function asks what is wanted, never which of the two it draws into.

mod bounds;
mod drawing;
mod picture_view;
mod placement;
mod points;
mod reports;
mod runs;
mod triangle_list;
mod vertices;

pub(crate) use bounds::{BoundsCanvas, grow};
pub(crate) use drawing::{Canvas, MaterialsBy, Sides, Wants};
pub(crate) use picture_view::PictureView;
pub(crate) use placement::Placement;
pub(crate) use points::{FAR_MORE, Points};
pub(crate) use reports::Reports;
pub(crate) use runs::{Broken, Runs, counted};
pub(crate) use triangle_list::{IndexedTriangle, TriangleList};
pub(crate) use vertices::{
    By, Normals, Place, Vertices, count, faces_are_parts, indices, is_per_vertex, without_index,
    wrapped,
};
