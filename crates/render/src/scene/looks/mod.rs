//! The appearance of a scene: materials, textures, lights and the background.

mod background;
mod colors;
mod decode;
mod light;
mod light_sets;
mod surface;
mod texture;
mod texture_files;
mod usual_filter;

pub(crate) use background::Background;
pub(crate) use colors::MaterialColors;
pub(in crate::scene) use light::LightBits;
pub use light::{IncidentLight, Light, SHADOW_END};
pub(crate) use light_sets::LightSets;
pub(in crate::scene) use light_sets::LightTree;
pub use surface::Surface;
pub(crate) use surface::{
    CornerNormals, FurtherTexture, Mapping, PhysicalSurface, TextureUse, between,
};
pub(crate) use texture::{Repeat, Texture};
pub(crate) use texture_files::{FileField, PANORAMA, PICTURES, TextureFiles, shows_picture};
pub(in crate::scene) use usual_filter::usual_filter;
