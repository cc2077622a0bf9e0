//! Radiance along a ray, by the shading models of Ivray's letters.
//!
//! Values are linear and as Inventor means its colors: 0 is black, 1 is full. What becomes of them
//! on film is the film's business. Lighting is OpenGL's fixed-function equation with Inventor's
//! rules for ambient light, attenuation, spots, two sides and fog, worked out at every point
//! instead of at every vertex:
//!
//! ```text
//! color = emissive + ambient · E + Σ a s (ambient · A + diffuse · C max(N·L, 0)
//!                                         + specular · C max(N·H, 0)^(128 shininess))
//! ```
//!
//! with E the Environment's ambient light, C the light's color times intensity, A a VRML 97
//! light's ambient share, a the attenuation and s the spot. H lies halfway between L and the
//! camera's backward direction: OpenGL's viewer at infinity, which Inventor leaves as it is.

mod lanes;
mod lighting;
mod packet;
mod shader;
mod shading;

pub(crate) use shader::{ShadeOptions, Shader, Work};
pub(crate) use shading::Shading;
