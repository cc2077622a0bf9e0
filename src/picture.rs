//! Image files out, with how they were made written into them.
//!
//! A file appears under its name only when it is whole: it is written beside it and renamed.

use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use exr::prelude as exr;
use indexmap::IndexMap;

use crate::diag::{Diagnostic, Result};
use crate::film::{Film, Response};

/// A picture in linear exposure values, rows from the top.
#[derive(Clone, Debug)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    /// Red, green, blue of each pixel; 1 is white on film.
    pub pixels: Vec<[f32; 3]>,
    pub response: Response,
    /// How it was made: key and value, written into PNG text and EXR attributes.
    pub provenance: IndexMap<String, String>,
}

/// Bits a channel in an integer format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    Eight,
    Sixteen,
}

/// What an output's name asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFormat {
    Png,
    Exr,
    Ppm,
}

impl PictureFormat {
    /// By the extension.
    ///
    /// # Errors
    /// An extension that is none of png, exr, ppm.
    pub fn of(path: &Path) -> Result<Self> {
        let extension = path
            .extension()
            .unwrap_or_default()
            .to_string_lossy()
            .to_lowercase();
        match extension.as_str() {
            "png" => Ok(Self::Png),
            "exr" => Ok(Self::Exr),
            "ppm" | "pnm" => Ok(Self::Ppm),
            _ => Err(Diagnostic::error(format!(
                "cannot tell the picture's format from `{}`",
                path.display()
            ))
            .with_help("end the output's name in .png, .exr or .ppm")),
        }
    }
}

impl Picture {
    /// Reads an EXR's red, green and blue, linear as they are.
    ///
    /// # Errors
    /// Not an EXR, or one without these channels.
    pub fn open_exr(path: &Path) -> Result<Self> {
        let wrong = |what: String| Diagnostic::error(what).in_file(path.display().to_string());
        let image = exr::read_first_flat_layer_from_file(path)
            .map_err(|e| wrong(format!("not a picture in EXR: {e}")))?;
        let layer = image.layer_data;
        let channel = |name: &str| {
            let found = layer
                .channel_data
                .list
                .iter()
                .find(|c| c.name.to_string() == name);
            let values = found.map(|c| c.sample_data.values_as_f32().collect::<Vec<f32>>());
            values.ok_or_else(|| wrong(format!("there is no channel `{name}` in the picture")))
        };
        let (r, g, b) = (channel("R")?, channel("G")?, channel("B")?);
        let pixels = r
            .into_iter()
            .zip(g)
            .zip(b)
            .map(|((r, g), b)| [r, g, b])
            .collect();
        Ok(Self {
            width: layer.size.width() as u32,
            height: layer.size.height() as u32,
            pixels,
            response: Response::Linear,
            provenance: IndexMap::new(),
        })
    }

    pub fn develop(film: &Film, response: Response) -> Self {
        let pixels = (0..film.pixels.len())
            .map(|i| film.level(i).as_vec3().to_array())
            .collect();
        let (width, height) = (film.resolution.width, film.resolution.height);
        Self {
            width,
            height,
            pixels,
            response,
            provenance: IndexMap::new(),
        }
    }

    /// Writes the picture in the format of the path's extension.
    ///
    /// # Errors
    /// An unknown extension, or whatever the disk has to say. Nothing is left under the name.
    pub fn save(&self, path: &Path, depth: Depth) -> Result<()> {
        let format = PictureFormat::of(path)?;
        write_whole(path, |file| match format {
            PictureFormat::Png => self.write_png(file, depth),
            PictureFormat::Ppm => self.write_ppm(file, depth),
            PictureFormat::Exr => self.write_exr(file),
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

    /// Big-endian levels, as both PNG and PPM want them.
    pub fn levels(&self, depth: Depth) -> Vec<u8> {
        let channels = self.pixels.iter().flatten().enumerate();
        let levels = channels.map(|(i, x)| self.response.level(f64::from(*x), i % 3));
        match depth {
            Depth::Eight => levels.map(|x| (x * 255.0).round() as u8).collect(),
            Depth::Sixteen => levels
                .flat_map(|x| ((x * 65_535.0).round() as u16).to_be_bytes())
                .collect(),
        }
    }

    fn write_exr(&self, file: &mut dyn Write) -> std::io::Result<()> {
        use self::exr::{Text, WritableImage};
        let size = (self.width as usize, self.height as usize);
        let channels = exr::SpecificChannels::rgb(|exr::Vec2(x, y)| {
            let [r, g, b] = self.pixels[y * self.width as usize + x];
            (r, g, b)
        });
        let mut layer = exr::Layer::new(
            size,
            exr::LayerAttributes::named(""),
            exr::Encoding::SMALL_LOSSLESS,
            channels,
        );
        layer.attributes.layer_name = None;
        let text = |s: &str| Text::new_or_none(s).unwrap_or_else(|| Text::from("?"));
        for (key, value) in &self.provenance {
            layer
                .attributes
                .other
                .insert(text(key), exr::AttributeValue::Text(text(value)));
        }
        let mut bytes = std::io::Cursor::new(Vec::new());
        exr::Image::from_layer(layer)
            .write()
            .non_parallel()
            .to_buffered(&mut bytes)
            .map_err(std::io::Error::other)?;
        file.write_all(bytes.get_ref())
    }
}

/// Writes a file beside its name and renames it when it is whole; on any failure, nothing is left.
///
/// # Errors
/// The folder does not exist, the disk is full, or what `write` returns.
pub fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> Result<()> {
    // A link stays one: what it points to is replaced.
    let linked = path.is_symlink().then(|| std::fs::canonicalize(path).ok());
    let whole = linked.flatten();
    let path = whole.as_deref().unwrap_or(path);
    let beside = beside(path);
    let attempt = || {
        let mut file = BufWriter::new(std::fs::File::create(&beside)?);
        write(&mut file)?;
        file.into_inner()
            .map_err(std::io::IntoInnerError::into_error)?
            .sync_data()?;
        std::fs::rename(&beside, path)
    };
    attempt().map_err(|e| {
        let _ = std::fs::remove_file(&beside);
        Diagnostic::io(path.display(), &e)
    })
}

/// A name in the same folder that no other process uses.
fn beside(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}.tmp", std::process::id()))
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn a_png_keeps_levels_and_how_it_was_made() {
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
    fn a_failed_write_leaves_nothing_behind() {
        let path = scratch("half.png");
        let result = write_whole(&path, |file| {
            file.write_all(b"half")?;
            Err(std::io::Error::other("the disk caught fire"))
        });
        assert!(result.unwrap_err().message.contains("caught fire"));
        assert!(!path.exists() && !beside(&path).exists());
    }

    #[test]
    fn an_unknown_extension_is_refused_before_anything_is_written() {
        let error = picture()
            .save(Path::new("room.bmpx"), Depth::Eight)
            .unwrap_err();
        assert!(error.help.as_deref().unwrap_or_default().contains(".png"));
    }
}
