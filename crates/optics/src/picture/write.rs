//! Writes picture files, with as much of the picture's provenance as each format holds.

use std::io::Write;
use std::path::Path;

use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder as _};
use indexmap::IndexMap;
use ivcam_base::diag::Result;
use ivcam_base::files::{WriteSeek, write_whole, write_whole_seekable};

use super::developed::{Depth, Picture, PictureFormat};
use super::rows::{
    Heading, LATE_LENGTH, PictureRows, RowSource, cut_off, fill_placeholder, write_levels,
};
use super::{exr, sgi, tiff};
use crate::film::Resolution;

impl Picture {
    /// Writes the picture in the format of the path's extension.
    ///
    /// # Errors
    /// Fails if the extension is unknown or the file cannot be written. A failed write leaves no
    /// file.
    pub fn save(&self, path: impl AsRef<Path>, depth: Depth) -> Result<()> {
        let path = path.as_ref();
        match PictureFormat::of(path)? {
            PictureFormat::Exr => write_whole_seekable(path, |file| self.write_exr(file)),
            format => write_whole(path, |file| self.write(format, depth, file)),
        }
    }

    /// Writes the picture to a stream.
    pub fn write(
        &self,
        format: PictureFormat,
        depth: Depth,
        to: &mut dyn Write,
    ) -> std::io::Result<()> {
        match format {
            PictureFormat::Png => self.write_png(to, depth),
            PictureFormat::Ppm => self.write_ppm(to, depth),
            PictureFormat::Exr => {
                let mut bytes = std::io::Cursor::new(Vec::new());
                self.write_exr(&mut bytes)?;
                to.write_all(bytes.get_ref())
            }
            PictureFormat::Sgi => sgi::write(self, depth, to),
            PictureFormat::Tiff => tiff::write(self, depth, to),
            PictureFormat::Jpeg => self.write_jpeg(to),
        }
    }

    fn write_exr(&self, to: &mut dyn WriteSeek) -> std::io::Result<()> {
        let (heading, mut rows) = PictureRows::of(self);
        exr::write_rows(&heading, &mut rows, to)
    }

    fn write_png(&self, file: &mut dyn Write, depth: Depth) -> std::io::Result<()> {
        let (width, height) = (self.width, self.height);
        let encoder = png_encoder(file, Resolution { width, height }, depth, &self.provenance)?;
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.levels(depth))?;
        Ok(writer.finish()?)
    }

    fn write_ppm(&self, file: &mut dyn Write, depth: Depth) -> std::io::Result<()> {
        let (width, height) = (self.width, self.height);
        let head = ppm_head(Resolution { width, height }, depth, &self.provenance);
        file.write_all(head.as_bytes())?;
        file.write_all(&self.levels(depth))
    }
}

/// Returns an encoder of a PNG in red, green and blue, with a provenance.
pub(super) fn png_encoder<W: Write>(
    to: W,
    size: Resolution,
    depth: Depth,
    provenance: &IndexMap<String, String>,
) -> std::io::Result<png::Encoder<'static, W>> {
    let mut encoder = png::Encoder::new(to, size.width, size.height);
    // A photograph takes a twentieth of the time of the usual compression, and 2% less to 16% more
    // bytes (docs/performance.md, "Start-up").
    encoder.set_compression(png::Compression::Fast);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(match depth {
        Depth::Eight => png::BitDepth::Eight,
        Depth::Sixteen => png::BitDepth::Sixteen,
    });
    for (key, value) in provenance {
        encoder.add_itxt_chunk(key.clone(), value.clone())?;
    }
    Ok(encoder)
}

/// Returns the text in front of the levels of a PPM.
fn ppm_head(size: Resolution, depth: Depth, provenance: &IndexMap<String, String>) -> String {
    let mut head = "P6\n".to_owned();
    for (key, value) in provenance {
        head += &format!("# {key}: {}\n", value.replace(['\n', '\r'], " "));
    }
    let top = match depth {
        Depth::Eight => 255,
        Depth::Sixteen => 65_535,
    };
    head + &format!("{} {}\n{top}\n", size.width, size.height)
}

/// Writes a picture as PPM while its rows are made.
pub(super) fn ppm_rows(
    heading: &Heading,
    depth: Depth,
    rows: &mut dyn RowSource,
    mut to: &mut dyn WriteSeek,
) -> std::io::Result<()> {
    let head = ppm_head(heading.resolution, depth, &heading.with_placeholder());
    to.write_all(head.as_bytes())?;
    write_levels(heading, depth, rows, &mut to)?;
    match heading.late {
        None => Ok(()),
        Some(key) => {
            let late = rows.late().replace(['\n', '\r'], " ");
            let mut late = cut_off(&late).to_owned();
            // The blanks that are left over become a comment of their own.
            if late.len() + 2 <= LATE_LENGTH {
                late += "\n#";
            }
            let start = format!("# {key}: ");
            fill_placeholder(to, head.as_bytes(), start.as_bytes(), late.as_bytes())
        }
    }
}

/// The quality of JPEG pictures, out of 100. A smooth picture loses less than two levels of 255
/// (`a_jpeg_is_near_and_tells_its_command`), while the noise of 16 samples in the room is 7%
/// (docs/performance.md).
const JPEG_QUALITY: u8 = 95;

impl Picture {
    fn write_jpeg(&self, to: &mut dyn Write) -> std::io::Result<()> {
        let mut bytes = Vec::new();
        let mut encoder = JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY);
        encoder
            .set_exif_metadata(tiff::exif(self))
            .map_err(std::io::Error::other)?;
        let levels = self.levels(Depth::Eight);
        encoder
            .write_image(&levels, self.width, self.height, ExtendedColorType::Rgb8)
            .map_err(std::io::Error::other)?;
        to.write_all(&bytes)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;
    use std::path::PathBuf;

    use ::exr::prelude as exr;
    use indexmap::IndexMap;

    use super::*;
    use crate::film::Response;
    use crate::picture::{Raster, Samples};

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

    /// A picture large enough for runs, blocks and an odd edge, with smooth colors.
    fn gradient() -> Picture {
        let (width, height) = (37, 21);
        let pixel = |i: u32| {
            let (x, y) = (i % width, i / width);
            [x as f32 / 36.0, y as f32 / 20.0, 0.25]
        };
        Picture {
            width,
            height,
            pixels: (0..width * height).map(pixel).collect(),
            ..picture()
        }
    }

    fn written(picture: &Picture, format: PictureFormat, depth: Depth) -> Vec<u8> {
        let mut bytes = Vec::new();
        picture.write(format, depth, &mut bytes).unwrap();
        bytes
    }

    #[test]
    fn sgi_and_tiff_read_back_with_every_level() {
        let picture = gradient();
        for format in [PictureFormat::Sgi, PictureFormat::Tiff] {
            for depth in [Depth::Eight, Depth::Sixteen] {
                let raster = Raster::decode(&written(&picture, format, depth), "x").unwrap();
                assert_eq!((raster.width, raster.height), (37, 21), "{format:?}");
                let levels = match raster.samples {
                    Samples::U8(levels) => levels,
                    Samples::U16(levels) => levels.iter().flat_map(|l| l.to_be_bytes()).collect(),
                    Samples::F32(_) => panic!("levels were written"),
                };
                assert!(levels == picture.levels(depth), "{format:?} {depth:?}");
            }
        }
    }

    #[test]
    fn a_jpeg_is_near_and_tells_its_command() {
        let picture = gradient();
        let bytes = written(&picture, PictureFormat::Jpeg, Depth::Sixteen);
        let raster = Raster::decode(&bytes, "x").unwrap();
        let error = |i: usize| {
            let (read, drawn) = (raster.color(i), picture.pixels[i]);
            (0..3)
                .map(|c| f64::from(read[c] - drawn[c]).powi(2))
                .sum::<f64>()
        };
        let pixels = picture.pixels.len();
        let rms = ((0..pixels).map(error).sum::<f64>() / (3 * pixels) as f64).sqrt();
        // Two levels of 255: a smooth picture loses less at this quality, and swapped channels or
        // rows would lose a hundred times as much.
        assert!(rms < 2.0 / 255.0, "{rms}");
        let mut decoder = image::codecs::jpeg::JpegDecoder::new(Cursor::new(&bytes)).unwrap();
        let exif = image::ImageDecoder::exif_metadata(&mut decoder)
            .unwrap()
            .unwrap();
        let command = b"ivcam -batch room.iv";
        let long = |at: usize| u32::from_be_bytes(exif[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!(exif[8..12], [0, 1, 0x01, 0x0e]);
        let (length, start) = (long(14), long(18));
        assert_eq!(&exif[start..start + length - 1], command);
        assert_eq!((exif[start + length - 1], exif.len()), (0, start + length));
    }

    #[test]
    fn a_tiff_tells_its_command() {
        let bytes = written(&gradient(), PictureFormat::Tiff, Depth::Eight);
        let short = |at: usize| usize::from(u16::from_be_bytes([bytes[at], bytes[at + 1]]));
        let long = |at: usize| short(at) << 16 | short(at + 2);
        let entries = (0..short(8)).map(|i| 10 + 12 * i);
        let tags: Vec<usize> = entries.clone().map(short).collect();
        assert!(tags.is_sorted(), "{tags:x?}");
        let description = entries.clone().find(|at| short(*at) == 0x010e).unwrap();
        let (length, start) = (long(description + 4), long(description + 8));
        assert_eq!(&bytes[start..start + length], b"ivcam -batch room.iv\0");
    }

    #[test]
    fn an_sgi_picture_is_named_by_its_command_where_that_fits() {
        let mut picture = gradient();
        let name = |picture: &Picture| {
            let bytes = written(picture, PictureFormat::Sgi, Depth::Eight);
            let name: Vec<u8> = bytes[24..104]
                .iter()
                .copied()
                .take_while(|&b| b != 0)
                .collect();
            String::from_utf8(name).unwrap()
        };
        assert_eq!(name(&picture), "ivcam -batch room.iv");
        picture.provenance.insert("Command".into(), "x".repeat(80));
        picture
            .provenance
            .insert("Software".into(), "ivcam 9".into());
        assert_eq!(name(&picture), "ivcam 9");
    }

    #[test]
    fn an_unknown_extension_is_refused_before_anything_is_written() {
        let error = picture()
            .save(Path::new("room.bmpx"), Depth::Eight)
            .unwrap_err();
        assert!(error.help.as_deref().unwrap_or_default().contains(".png"));
    }
}
