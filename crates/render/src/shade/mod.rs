//! Computes the radiance along a ray by one of the shading models, which have Ivray's letters.
//!
//! Values are linear on the scale of Inventor's colors: 0 is black and 1 is full intensity. `film`
//! converts them to exposure. Lighting is OpenGL's fixed-function equation with Inventor's rules
//! for ambient light, attenuation, spots, two sides and fog, evaluated at every point instead of at
//! every vertex:
//!
//! ```text
//! color = emissive + ambient · E + Σ a s (ambient · A + diffuse · C max(N·L, 0)
//!                                         + specular · C max(N·H, 0)^(128 shininess))
//! ```
//!
//! Here E is the Environment's ambient light, C the light's color times its intensity, A the
//! ambient part of a VRML 97 light, a the attenuation and s the spot factor. H lies halfway between
//! L and the camera's backward direction. This is OpenGL's viewer at infinity, which Inventor does
//! not change. For VRML97, H lies halfway between L and the direction to the viewer.
//!
//! Model `i` is another one: see `path`.

mod counts;
#[cfg(test)]
mod instance_tests;
mod lanes;
mod light_paths;
mod lighting;
mod many_lights;
mod packet;
mod path;
#[cfg(test)]
mod path_tests;
mod shader;
mod shading;

pub use path::{ClearSky, EnvironmentLight, Flash, PathOptions};
pub use shader::{ShadeOptions, Shader, Work};
pub use shading::Shading;
