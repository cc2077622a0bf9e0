//! Shapes as mathematics: triangle meshes, exact quadrics, NURBS, extrusions, grids, strokes and
//! text.
//!
//! Every function takes plain numbers in the shape's own space and returns triangles, polygons or
//! the place where a ray meets the shape. Front faces are counterclockwise. Nothing here knows
//! nodes, the traversal state, cameras or scenes: `scene::shapes` reads the nodes and calls these
//! functions, so `geometry::nurbs` is the mathematics of what `scene::shapes::nurbs` draws.

mod box_coordinates;
mod corner;
mod elevation_grid;
mod extrusion;
mod facets;
mod markers;
mod mesh;
pub mod normals;
pub mod nurbs;
pub mod quadric;
mod stroke;
mod tessellate;
pub mod text;

pub use box_coordinates::BoxCoordinates;
pub use corner::Corner;
pub use elevation_grid::{ElevationGrid, elevation_grid};
pub use extrusion::{Extrusion, extrusion};
pub use facets::facets;
pub use markers::{MarkerBitmap, marker_bitmap};
pub use mesh::Mesh;
pub use quadric::{Quadric, QuadricKind};
pub use stroke::{Stroke, StrokeView};
pub use tessellate::cut_polygon;
