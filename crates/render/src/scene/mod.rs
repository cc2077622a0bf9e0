//! Compiles a snapshot into a scene that rays can hit: triangles, exact quadrics, materials and
//! lights.
//!
//! The scene is moved in f64 so that the compile origin (the camera) is at zero, then stored in
//! f32. Anything that the picture does not need is left out and counted in the census.

mod alias;
mod canvas;
mod census;
pub mod check;
mod compile;
mod emitter_list;
mod emitter_tree;
mod emitters;
mod hit;
mod instances;
mod instancing;
mod inventor_box;
mod lamp_faces;
mod lamp_lanes;
mod left_out;
mod lit_face;
mod looks;
pub mod model;
mod moved;
mod near;
mod options;
mod packets;
mod pick;
mod pixel_footprint;
mod placed;
mod placement;
mod plain_point;
mod point;
mod precision;
mod render_scene;
mod shapes;
mod sight;
mod small_lights;
mod snapshot;
mod studio;
mod surface_names;
mod survey;
mod surveyed_prototypes;
mod texel_footprint;
mod unapplied;

pub(crate) use alias::AliasTable;
pub use census::{Census, InstanceCounts};
pub(crate) use emitter_list::Emitters;
pub(crate) use emitter_tree::{LampNode, LampRange};
pub(crate) use emitters::sound_color;
pub(crate) use lamp_faces::LampFace;
pub use left_out::Unneeded;
pub(crate) use lit_face::{FacetHighlight, LitFace};
pub(crate) use looks::PhysicalSurface;
pub use looks::{IncidentLight, Light, SHADOW_END, Surface};
pub use options::CompileOptions;
pub use options::{ColorCoding, Instancing, Needs, TextureFilter};
pub(crate) use plain_point::{MetPoint, PlainSurface};
pub(crate) use point::{Point, TrianglePoint, clear_of};
pub use precision::precision_warning;
pub use render_scene::OracleTriangle;
pub use render_scene::RenderScene;
pub(crate) use small_lights::SmallLight;
pub use snapshot::{shape_picker, snapshot};
pub use studio::Studio;
pub use surface_names::{MatteKind, SurfaceNames};
pub use survey::{Survey, draws_nothing, unused_prototypes};
