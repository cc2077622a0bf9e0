//! Compiles a walk into what a ray can hit: triangles, exact quadrics, materials, lights.
//!
//! The scene is moved in f64 so that the compile origin (the camera) is at zero, then kept in
//! f32. What a picture does not need is left out, and the census says so.

mod canvas;
mod census;
pub mod check;
mod compile;
mod hit;
mod inventor_box;
mod looks;
mod options;
mod packets;
mod pixel_footprint;
mod point;
mod render_scene;
mod shapes;
mod snapshot;
mod survey;
mod texel_footprint;

pub use census::Census;
pub use looks::{Background, Light, Reaching, Surface};
pub use options::{CompileOptions, Needs};
pub use point::Point;
pub use render_scene::{OracleTriangle, RenderScene};
pub use snapshot::snapshot;
pub use survey::Survey;
