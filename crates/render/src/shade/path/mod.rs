//! The light of a scene by path tracing: model `i`.
//!
//! A path starts at the camera and turns at every surface that it meets, in a direction that is
//! drawn from the surface's scattering. At each turn it gathers the surface's own emission, and the
//! light of up to four lights of the file at the first turn and of one at later turns, of one point
//! on a luminous shape, and of one direction of the environment picture. Light that both ways find
//! is weighted by the power heuristic (Veach, *Robust Monte Carlo methods for light transport
//! simulation*, 1997, 9.2). After one turn a path may end at random ("Russian roulette"), so that
//! the mean is exact without a limit of depth.
//!
//! Every random number is a function of seed, pixel, sample and its place in the path.

mod bsdf;
mod environment;
mod frame;
mod lamps;
mod material;
mod microfacets;
mod options;
mod sky;
mod tracer;
mod vertex;

pub use environment::EnvironmentLight;
pub(super) use material::PathSurface;
pub(super) use options::PathSettings;
pub use options::{Flash, PathOptions};
pub use sky::ClearSky;
pub(super) use tracer::{CameraPath, PathLights, PathTracer, PathWork};
