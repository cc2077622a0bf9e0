//! How things look: materials, textures, lights and what lies behind everything.

mod background;
mod light;
mod surface;
pub(super) mod texture;

pub(crate) use background::Background;
pub(crate) use light::{Light, Reaching};
pub(crate) use surface::{CornerNormals, Mapping, Surface, TextureUse};
pub(crate) use texture::{Filter, Repeat, Texture};
