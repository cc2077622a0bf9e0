//! Writes picture files: PNG, PPM and EXR, with the picture's provenance as metadata.

use std::io::Write;
use std::path::Path;

use super::developed::{Depth, Picture, PictureFormat};
use super::exr;
use super::whole_file::write_whole;
use crate::diag::Result;

impl Picture {
    /// Writes the picture in the format of the path's extension.
    ///
    /// # Errors
    /// Fails if the extension is unknown or the file cannot be written. A failed write leaves no
    /// file.
    pub fn save(&self, path: &Path, depth: Depth) -> Result<()> {
        let format = PictureFormat::of(path)?;
        write_whole(path, |file| match format {
            PictureFormat::Png => self.write_png(file, depth),
            PictureFormat::Ppm => self.write_ppm(file, depth),
            PictureFormat::Exr => exr::write(self, file),
        })
    }

    fn write_png(&self, file: &mut dyn Write, depth: Depth) -> std::io::Result<()> {
        let mut encoder = png::Encoder::new(file, self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(match depth {
            Depth::Eight => png::BitDepth::Eight,
            Depth::Sixteen => png::BitDepth::Sixteen,
        });
        for (key, value) in &self.provenance {
            encoder.add_itxt_chunk(key.clone(), value.clone())?;
        }
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.levels(depth))?;
        Ok(writer.finish()?)
    }

    fn write_ppm(&self, file: &mut dyn Write, depth: Depth) -> std::io::Result<()> {
        let top = match depth {
            Depth::Eight => 255,
            Depth::Sixteen => 65_535,
        };
        writeln!(file, "P6")?;
        for (key, value) in &self.provenance {
            writeln!(file, "# {key}: {}", value.replace(['\n', '\r'], " "))?;
        }
        writeln!(file, "{} {}\n{top}", self.width, self.height)?;
        file.write_all(&self.levels(depth))
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use ::exr::prelude as exr;
    use indexmap::IndexMap;

    use super::*;
    use crate::film::Response;

    fn picture() -> Picture {
        let mut provenance = IndexMap::new();
        provenance.insert("Command".to_owned(), "ivcam -batch room.iv".to_owned());
        Picture {
            width: 2,
            height: 1,
            pixels: vec![[0.0, 0.5, 1.0], [2.0, -1.0, f32::NAN]],
            response: Response::Linear,
            provenance,
        }
    }

    fn scratch(name: &str) -> PathBuf {
        std::env::temp_dir().join(format!("ivcam-picture-{}-{name}", std::process::id()))
    }

    #[test]
    fn a_png_keeps_levels_and_provenance() {
        for (depth, half) in [
            (Depth::Eight, 128.0 / 255.0),
            (Depth::Sixteen, 32_768.0 / 65_535.0),
        ] {
            let path = scratch("levels.png");
            picture().save(&path, depth).unwrap();
            let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
            let reader = png::Decoder::new(file).read_info().unwrap();
            let text = &reader.info().utf8_text[0];
            assert_eq!(text.get_text().unwrap(), "ivcam -batch room.iv");
            let back = image::open(&path).unwrap().to_rgb32f();
            assert_eq!(back.get_pixel(0, 0).0[0], 0.0);
            assert!((back.get_pixel(0, 0).0[1] - half as f32).abs() < 1e-6);
            assert_eq!(back.get_pixel(1, 0).0, [1.0, 0.0, 0.0]);
            std::fs::remove_file(path).unwrap();
        }
    }

    #[test]
    fn an_exr_keeps_values_beyond_white() {
        let path = scratch("values.exr");
        picture().save(&path, Depth::Eight).unwrap();
        let image = exr::read_first_flat_layer_from_file(&path).unwrap();
        let made = image
            .layer_data
            .attributes
            .other
            .iter()
            .any(|(k, _)| k == "Command");
        assert!(made);
        let red = &image
            .layer_data
            .channel_data
            .list
            .iter()
            .find(|c| c.name.to_string() == "R");
        let red: Vec<f32> = red.unwrap().sample_data.values_as_f32().collect();
        assert_eq!(red, [0.0, 2.0]);
        std::fs::remove_file(path).unwrap();
    }

    #[test]
    fn an_unknown_extension_is_refused_before_anything_is_written() {
        let error = picture()
            .save(Path::new("room.bmpx"), Depth::Eight)
            .unwrap_err();
        assert!(error.help.as_deref().unwrap_or_default().contains(".png"));
    }
}
