//! Shapes as mathematics: triangle meshes, exact quadrics, NURBS, extrusions, grids, strokes and
//! text.
//!
//! Every function takes plain numbers in object space and returns triangles, polygons or the
//! intersection with a ray. Front faces are counterclockwise. Nothing here knows nodes, the
//! traversal state, cameras or scenes: `scene::shapes` reads the nodes and calls these functions.
//! For example, `geometry::nurbs` has the mathematics of what `scene::shapes::nurbs` draws.

mod box_coordinates;
mod corner;
mod elevation_grid;
mod extrusion;
mod facets;
mod markers;
mod mesh;
pub(crate) mod normals;
pub(crate) mod nurbs;
pub(crate) mod quadric;
mod quadric_area;
mod stroke;
mod tessellate;
pub mod text;

pub(crate) use box_coordinates::BoxCoordinates;
pub(crate) use corner::Corner;
pub(crate) use elevation_grid::{ElevationGrid, elevation_grid};
pub(crate) use extrusion::{Extrusion, extrusion};
pub(crate) use facets::{Fineness, facets};
pub(crate) use markers::{MarkerBitmap, marker_bitmap};
pub use mesh::TriangleMesh;
pub(crate) use quadric::{Quadric, QuadricKind};
pub(crate) use stroke::{Stroke, StrokeView, piece_counts};
pub(crate) use tessellate::cut_polygon;
