//! A picture of a model, for its textures.

use crate::scene::looks;

/// A picture in 8 bits for each channel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// The width in pixels.
    pub width: u32,
    /// The height in pixels.
    pub height: u32,
    /// The number of components that the file has: 1 gray, 2 gray and alpha, 3 color, 4 color and
    /// alpha.
    pub components: usize,
    /// Red, green, blue and alpha of each pixel, in rows from the top.
    pub pixels: Vec<[u8; 4]>,
}

impl Image {
    /// Copies the first layer of a texture. Returns `None` if it has no texels.
    pub(super) fn of(texture: &looks::Texture) -> Option<Self> {
        if texture.width == 0 || texture.height == 0 {
            return None;
        }
        Some(Self {
            width: u32::try_from(texture.width).ok()?,
            height: u32::try_from(texture.height).ok()?,
            components: texture.components,
            pixels: texture.rows().rev().flatten().collect(),
        })
    }

    /// Whether the picture has color components, and not only gray ones.
    pub fn has_color(&self) -> bool {
        self.components >= 3
    }

    /// Whether the picture has an alpha component.
    pub fn has_alpha(&self) -> bool {
        matches!(self.components, 2 | 4)
    }

    /// Whether some pixel is not opaque.
    pub fn is_transparent(&self) -> bool {
        self.pixels.iter().any(|p| p[3] < 255)
    }

    /// Whether every pixel is either opaque or invisible.
    pub fn is_cutout(&self) -> bool {
        self.pixels.iter().all(|p| p[3] == 0 || p[3] == 255)
    }

    /// Returns the picture as a PNG file.
    pub fn png(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        let (color, kept): (_, &[usize]) = match (self.has_color(), self.is_transparent()) {
            (false, false) => (png::ColorType::Grayscale, &[0]),
            (false, true) => (png::ColorType::GrayscaleAlpha, &[0, 3]),
            (true, false) => (png::ColorType::Rgb, &[0, 1, 2]),
            (true, true) => (png::ColorType::Rgba, &[0, 1, 2, 3]),
        };
        let mut data = Vec::with_capacity(self.pixels.len() * kept.len());
        for pixel in &self.pixels {
            data.extend(kept.iter().map(|&channel| pixel[channel]));
        }
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_color(color);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder
            .write_header()
            .expect("a vector accepts the header of a picture that has pixels");
        writer
            .write_image_data(&data)
            .expect("the data has the size that the header states");
        writer.finish().expect("a vector accepts the last chunk");
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_png_has_the_picture_and_no_more_channels_than_it_needs() {
        let image = |pixels: &[[u8; 4]], components| Image {
            width: pixels.len() as u32,
            height: 1,
            components,
            pixels: pixels.to_vec(),
        };
        let gray = [[9, 9, 9, 255], [200, 200, 200, 255]];
        let color = [[1, 2, 3, 255], [4, 5, 6, 7]];
        for (pixels, components, channels) in [(gray, 1, 1), (gray, 3, 3), (color, 4, 4)] {
            let bytes = image(&pixels, components).png();
            let read = image::load_from_memory(&bytes).expect("a picture");
            assert_eq!(usize::from(read.color().channel_count()), channels);
            let read: Vec<[u8; 4]> = read.to_rgba8().pixels().map(|p| p.0).collect();
            assert_eq!(read, pixels);
        }
    }
}
