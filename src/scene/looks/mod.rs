//! The appearance of a scene: materials, textures, lights and the background.

mod background;
mod colors;
mod light;
mod surface;
pub(super) mod texture;

pub(crate) use background::Background;
pub(crate) use colors::MaterialColors;
pub(crate) use light::{IncidentLight, Light};
pub(crate) use surface::{CornerNormals, Mapping, Surface, TextureUse};
pub(crate) use texture::{Filter, Repeat, Texture};
