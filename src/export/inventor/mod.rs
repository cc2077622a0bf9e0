//! Writes a VRML97 scene as Inventor V2.1, from the [`Model`].
//!
//! The file is one `Separator`. `head` writes what shines on or sees all shapes: cameras, lights
//! and the headlight, before every transform. `tree` writes the groups, shapes and geometry, and
//! `look` their materials and textures. Scenes in Inventor and VRML 1.0 are rewritten by
//! [`Document::write`] instead, which keeps their nodes.
//!
//! [`Document::write`]: ivcam_inventor::iv::Document::write
//! [`Model`]: ivcam_render::scene::model::Model

mod camera;
mod head;
mod light;
mod look;
#[cfg(test)]
mod tests;
mod tree;
mod write;

pub(super) use camera::Viewing;
pub(super) use look::approximates_texture;
pub(super) use write::write;
