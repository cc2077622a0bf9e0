//! The canvas that shapes draw into, with the lists of vertices and triangles that they pass to it.
//!
//! A shape's function draws in object space through a [`Canvas`]. There are two canvases:
//! [`BoundsCanvas`] only counts and bounds, for surveys. The scene builder of `compile` keeps
//! triangles and materials. A shape asks the canvas what it needs ([`Wants`]), and does not know
//! which one it is.

mod bounds;
mod drawing;
mod list_lengths;
mod mistake;
mod one_by_one;
mod picture_view;
mod points;
mod reports;
mod runs;
mod triangle_list;
mod vertices;

pub(crate) use bounds::{BoundsCanvas, grow};
pub(crate) use drawing::{Canvas, MaterialsBy, Sides, Wants, draw_mesh, draw_triangles};
pub(crate) use list_lengths::check_lists;
pub(crate) use mistake::Mistake;
pub(crate) use one_by_one::draw_facets;
pub(crate) use picture_view::PictureView;
pub(crate) use points::{Points, SPARSE_RATIO};
pub(crate) use reports::Reports;
pub(crate) use runs::{Broken, Runs, ShapeSize, check_counts, counted};
pub(crate) use triangle_list::{IndexedTriangle, TriangleList};
pub(crate) use vertices::{
    NormalPer, Normals, VertexPlace, Vertices, count, faces_are_parts, indices, is_per_vertex,
    without_index, wrapped,
};
