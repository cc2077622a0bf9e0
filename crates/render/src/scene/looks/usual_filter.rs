//! The filter of a texture if no option chooses one.

use ivcam_inventor::grammar::{class, image_texture, texture_properties};
use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::traversal::state::TextureElement;

use super::texture::Texture;
use crate::scene::options::TextureFilter;

/// The largest width and height in texels of a `PixelTexture` that is not interpolated.
const SMALL_PIXEL_TEXTURE: usize = 8;

/// Returns the filter of a texture. An author states the texels of a small `PixelTexture` one by
/// one, as squares of color.
pub(in crate::scene) fn usual_filter(
    element: &TextureElement<'_>,
    texture: &Texture,
) -> TextureFilter {
    let is_small = texture.width.max(texture.height) <= SMALL_PIXEL_TEXTURE;
    let is_drawn = element.node.class_id() == Some(class::PIXEL_TEXTURE) && is_small;
    match is_drawn || states_nearest(element.node) {
        true => TextureFilter::Nearest,
        false => TextureFilter::of(element.quality),
    }
}

/// Whether X3D's `TextureProperties` of a texture ask for its nearest texel.
fn states_nearest(texture: NodeRef<'_>) -> bool {
    let properties = texture.get_node(image_texture::TEXTURE_PROPERTIES);
    properties.is_some_and(|properties| {
        properties.get(texture_properties::MAGNIFICATION_FILTER) == "NEAREST_PIXEL"
    })
}
