//! Writes pictures while their rows are made, so that they never are in memory as a whole.

use std::io::Write;
use std::path::Path;

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::{write_whole, write_whole_seekable};

use super::developed::{Depth, PictureFormat};
use super::rows::{Heading, RowSource, write_levels};
use super::{exr, tiff, write};

impl PictureFormat {
    /// Returns whether the format can be written by rows.
    pub fn has_rows(self) -> bool {
        !matches!(self, Self::Sgi | Self::Jpeg)
    }
}

/// Writes a picture in the format of the path's extension while its rows are made.
///
/// # Errors
/// Fails if the format cannot be written by rows, the file cannot be written, or the rows cannot be
/// made. A failed write leaves no file.
pub fn save_rows(
    path: &Path,
    depth: Depth,
    heading: &Heading,
    rows: &mut dyn RowSource,
) -> Result<()> {
    let format = PictureFormat::of(path)?;
    if !format.has_rows() {
        let error = "SGI and JPEG files can't be written while the picture is rendered in strips";
        return Err(Diagnostic::unsupported(error)
            .with_help("end the output's name in .exr, .png, .tif or .ppm"));
    }
    match format {
        PictureFormat::Exr => {
            write_whole_seekable(path, |file| exr::write_rows(heading, rows, file))
        }
        PictureFormat::Ppm => {
            write_whole_seekable(path, |file| write::ppm_rows(heading, depth, rows, file))
        }
        PictureFormat::Tiff => {
            write_whole(path, |file| tiff::write_rows(heading, depth, rows, file))
        }
        _ => write_whole(path, |file| write_png_rows(heading, depth, rows, file)),
    }
}

/// Writes a picture as PNG to a stream while its rows are made. The late entry follows the pixels.
///
/// # Errors
/// Fails if the stream does or the rows cannot be made.
pub fn write_png_rows(
    heading: &Heading,
    depth: Depth,
    rows: &mut dyn RowSource,
    to: &mut dyn Write,
) -> std::io::Result<()> {
    let size = heading.resolution;
    let encoder = write::png_encoder(to, size, depth, &heading.provenance)?;
    let mut writer = encoder.write_header()?;
    let mut stream = writer.stream_writer_with_size(1 << 18)?;
    write_levels(heading, depth, rows, &mut stream)?;
    stream.finish()?;
    if let Some(key) = heading.late {
        writer.write_text_chunk(&png::text_metadata::ITXtChunk::new(key, rows.late()))?;
    }
    Ok(writer.finish()?)
}

#[cfg(test)]
mod tests {
    use std::borrow::Cow;
    use std::path::PathBuf;

    use ::exr::prelude as exr;
    use indexmap::IndexMap;

    use super::*;
    use crate::film::{Resolution, Response};
    use crate::picture::Picture;
    use crate::picture::rows::ROWS;
    use crate::picture::{Raster, Samples};

    /// A picture of 7x37 pixels whose rows come 16 at a time.
    struct Rows {
        row: u32,
        /// The row at which the source fails.
        fails_at: u32,
    }

    const SIZE: Resolution = Resolution::of(7, 37);

    fn pixel(i: u32) -> [f32; 3] {
        [(i % 7) as f32 / 8.0, (i / 7) as f32 / 64.0, 2.0]
    }

    impl RowSource for Rows {
        fn next_rows(&mut self) -> std::io::Result<Option<Cow<'_, [[f32; 3]]>>> {
            if self.row >= self.fails_at {
                return Err(std::io::Error::other("the lens broke"));
            }
            let first = self.row;
            self.row = (first + ROWS).min(SIZE.height);
            let pixels: Vec<_> = (7 * first..7 * self.row).map(pixel).collect();
            Ok((!pixels.is_empty()).then_some(Cow::Owned(pixels)))
        }

        fn late(&self) -> String {
            "5% · late".into()
        }
    }

    fn heading() -> Heading {
        Heading {
            resolution: SIZE,
            response: Response::Linear,
            provenance: IndexMap::from([("Command".to_owned(), "ivcam room.iv".to_owned())]),
            late: Some("ivcam:error"),
        }
    }

    struct Scratch(PathBuf);

    impl Scratch {
        fn new(name: &str) -> Self {
            let name = format!("ivcam-rows-{}-{name}", std::process::id());
            Self(std::env::temp_dir().join(name))
        }
    }

    impl Drop for Scratch {
        fn drop(&mut self) {
            let _ = std::fs::remove_file(&self.0);
        }
    }

    fn saved(name: &str, depth: Depth) -> (Scratch, Vec<u8>) {
        let scratch = Scratch::new(name);
        let mut rows = Rows {
            row: 0,
            fails_at: u32::MAX,
        };
        save_rows(&scratch.0, depth, &heading(), &mut rows).unwrap();
        let bytes = std::fs::read(&scratch.0).unwrap();
        (scratch, bytes)
    }

    #[test]
    fn an_exr_by_rows_has_the_pixels_and_the_late_entry() {
        let (scratch, bytes) = saved("a.exr", Depth::Eight);
        let raster = Raster::decode(&bytes, "a.exr").unwrap();
        let Samples::F32(samples) = &raster.samples else {
            panic!("floats were written")
        };
        assert!(samples.iter().copied().eq((0..7 * 37).flat_map(pixel)));
        let image = exr::read_first_flat_layer_from_file(&scratch.0).unwrap();
        let attributes = image.layer_data.attributes.other;
        let text = |key: &str| match &attributes[&exr::Text::from(key)] {
            exr::AttributeValue::Text(text) => String::from_utf8(text.as_slice().to_vec()).unwrap(),
            other => panic!("{other:?}"),
        };
        assert_eq!(text("Command"), "ivcam room.iv");
        assert_eq!(text("ivcam:error"), "5% · late");
    }

    #[test]
    fn levels_by_rows_are_those_of_the_whole_picture() {
        let picture = Picture {
            width: 7,
            height: 37,
            pixels: (0..7 * 37).map(pixel).collect(),
            response: Response::Linear,
            provenance: IndexMap::new(),
        };
        for depth in [Depth::Eight, Depth::Sixteen] {
            for name in ["a.png", "a.tif", "a.ppm"] {
                let (_scratch, bytes) = saved(name, depth);
                let raster = Raster::decode(&bytes, name).unwrap();
                assert_eq!((raster.width, raster.height), (7, 37), "{name}");
                let levels = match raster.samples {
                    Samples::U8(levels) => levels,
                    Samples::U16(levels) => levels.iter().flat_map(|l| l.to_be_bytes()).collect(),
                    Samples::F32(_) => panic!("levels were written"),
                };
                assert!(levels == picture.levels(depth), "{name} {depth:?}");
                let late = name != "a.tif";
                let entry = match name {
                    "a.ppm" => "5% · late\n".as_bytes(),
                    _ => "5% · late".as_bytes(),
                };
                assert_eq!(bytes.windows(entry.len()).any(|part| part == entry), late);
            }
        }
    }

    #[test]
    fn rows_that_cannot_be_made_leave_no_file() {
        for name in ["broken.exr", "broken.png", "broken.ppm", "broken.tif"] {
            let scratch = Scratch::new(name);
            let mut rows = Rows {
                row: 0,
                fails_at: 16,
            };
            let error = save_rows(&scratch.0, Depth::Eight, &heading(), &mut rows).unwrap_err();
            assert!(
                error.message.contains("the lens broke"),
                "{}",
                error.message
            );
            assert!(!scratch.0.exists());
        }
    }

    #[test]
    fn formats_without_rows_are_refused() {
        for name in ["a.jpg", "a.sgi"] {
            let mut rows = Rows {
                row: 0,
                fails_at: 0,
            };
            let path = Scratch::new(name);
            let error = save_rows(&path.0, Depth::Eight, &heading(), &mut rows).unwrap_err();
            assert!(error.message.contains("strips"), "{}", error.message);
        }
    }
}
