//! How things look: materials, textures, lights and what lies behind everything.

mod background;
mod light;
mod surface;
pub mod texture;

pub use background::Background;
pub use light::{Light, Reaching};
pub use surface::{CornerNormals, Mapping, Surface, TextureUse};
pub use texture::{Filter, Repeat, Texture};
