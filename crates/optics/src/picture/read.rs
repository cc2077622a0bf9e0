//! Reads picture files: PNG, JPEG, TIFF, GIF, BMP, PNM, TGA, SGI, EXR and Radiance HDR.
//!
//! Textures, archival pictures and exposures are decoded here without conversion. For an animated
//! file, the first frame is read.

use std::io::{BufRead, Cursor, Read, Seek, SeekFrom};
use std::path::Path;

use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageFormat};
use ivcam_base::diag::{Diagnostic, ErrorKind, Result};
use ivcam_base::files::{MAX_PICTURE, read_file};
use ivcam_base::work::{Budget, Cut, StopSignal};

use super::raster::{Raster, Samples, check_size};
use super::{exr, jpeg, sgi, tiff};

impl Raster {
    /// Reads a file of any known format. The content determines the format; only for TGA, which has
    /// no signature, the name does. A picture whose file states how it has to be turned
    /// (`Orientation` of EXIF and TIFF) is turned.
    ///
    /// # Errors
    /// Fails if the file cannot be read, or is not a picture.
    pub fn open(path: &Path) -> Result<Self> {
        let bytes = read_file(path, MAX_PICTURE)?;
        Self::decode_upright(&bytes, &path.to_string_lossy())
    }

    /// Decodes a file's bytes as [`Raster::open`] does.
    ///
    /// # Errors
    /// Fails if the bytes are not a picture, or one that is broken or too large.
    pub fn decode_upright(bytes: &[u8], name: &str) -> Result<Self> {
        Self::decode_oriented(bytes, name, OrientationUse::Applied, &mut |_| Ok(()))
    }

    /// Decodes a file's bytes, as a texture has them: pixels are not turned. `name` is for messages
    /// and for formats without a signature.
    ///
    /// # Errors
    /// Fails if the bytes are not a picture, or one that is broken or too large.
    pub fn decode(bytes: &[u8], name: &str) -> Result<Self> {
        Self::decode_within(bytes, name, &mut |_| Ok(()))
    }

    /// Decodes a file's bytes as [`Raster::decode`] does. `ask` gets the bytes of memory that
    /// decoding needs, from the file's header, before they are allocated.
    ///
    /// # Errors
    /// Returns the errors of [`Raster::decode`] and of `ask`.
    pub fn decode_within(
        bytes: &[u8],
        name: &str,
        ask: &mut dyn FnMut(u64) -> Result<()>,
    ) -> Result<Self> {
        Self::decode_oriented(bytes, name, OrientationUse::Ignored, ask)
    }

    fn decode_oriented(
        bytes: &[u8],
        name: &str,
        orientation_use: OrientationUse,
        ask: &mut dyn FnMut(u64) -> Result<()>,
    ) -> Result<Self> {
        let decoded = if bytes.starts_with(&sgi::MAGIC) {
            sgi::decode(bytes, ask)
        } else if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
            exr::decode(bytes, ask)
        } else {
            decode_other(bytes, name, orientation_use, ask)
        };
        decoded.map_err(|mut e| {
            if e.kind != ErrorKind::Limit {
                e.message = format!("`{name}`: {}", e.message);
            }
            e.in_file(name)
        })
    }
}

/// What becomes of the orientation that a file states.
#[derive(Clone, Copy, PartialEq, Eq)]
enum OrientationUse {
    Ignored,
    Applied,
}

/// The largest number of bytes that a decoder may allocate for any picture, and for each pixel.
const DECODER_BASE: u64 = 16 << 20;
const DECODER_PIXEL: u64 = 32;

/// Decodes the formats that the `image` crate reads.
fn decode_other(
    bytes: &[u8],
    name: &str,
    orientation_use: OrientationUse,
    ask: &mut dyn FnMut(u64) -> Result<()>,
) -> Result<Raster> {
    let by_content = match tiff::is_big(bytes) {
        true => Some(ImageFormat::Tiff),
        false => image::guess_format(bytes).ok(),
    };
    let by_name = || ImageFormat::from_path(name).ok();
    // Only TGA has no signature; a file of any other format is recognized by its content.
    let format = by_content.or_else(|| by_name().filter(|f| *f == ImageFormat::Tga));
    let Some(format) = format else {
        return Err(
            Diagnostic::error("this is not a picture in a known format").with_help(
                "known are png, jpeg, tiff, gif, bmp, pnm, tga, sgi (rgb, rgba, bw), exr and hdr",
            ),
        );
    };
    let (mut picture, orientation) = match format {
        ImageFormat::Jpeg if !jpeg::has_end(bytes) => decode_without_end(bytes, ask)?,
        ImageFormat::Tiff => decode_tiff(bytes, ask)?,
        _ => decode_format(bytes, format, ask)?,
    };
    if orientation_use == OrientationUse::Applied {
        picture.apply_orientation(orientation);
    }
    // The decoder adds alpha to every GIF, but only one with a transparent color has any.
    if format == ImageFormat::Gif
        && let DynamicImage::ImageRgba8(frame) = &picture
        && frame.pixels().all(|p| p.0[3] == u8::MAX)
    {
        return Ok(from_image(DynamicImage::ImageRgb8(picture.to_rgb8())));
    }
    Ok(from_image(picture))
}

/// The kinds of TIFF that are read.
const TIFFS_READ: &str = "TIFFs are read as gray or RGB of 8 or 16 bits, as RGB in floating point, \
                          and with a palette of 256 colors: save it so";

/// Decodes a file of a known format, and returns the orientation that it states too.
fn decode_format(
    bytes: &[u8],
    format: ImageFormat,
    ask: &mut dyn FnMut(u64) -> Result<()>,
) -> Result<(DynamicImage, Orientation)> {
    let unreadable = |e: image::ImageError| {
        let account = Budget::current();
        match account.stop().cause() {
            Some(cause) => account.refusal(Cut::Stopped(cause)),
            None if format == ImageFormat::Tiff => {
                Diagnostic::error(e.to_string()).with_help(TIFFS_READ)
            }
            None => Diagnostic::error(e.to_string()),
        }
    };
    let reader = || image::ImageReader::with_format(Stoppable::new(bytes), format);
    let (width, height) = reader().into_dimensions().map_err(unreadable)?;
    check_size(width as usize, height as usize)?;
    let mut reader = reader();
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(1 << 16);
    limits.max_image_height = Some(1 << 16);
    // A GIF's frame may be larger than the picture that its header states.
    limits.max_alloc = Some(DECODER_BASE + DECODER_PIXEL * u64::from(width) * u64::from(height));
    reader.limits(limits);
    let mut decoder = reader.into_decoder().map_err(unreadable)?;
    // A picture whose EXIF data are damaged is as it is stored.
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    ask(decoder.total_bytes())?;
    let picture = DynamicImage::from_decoder(decoder).map_err(unreadable)?;
    check_size(picture.width() as usize, picture.height() as usize)?;
    // The decoder takes integers for floating-point numbers.
    if format == ImageFormat::Tiff
        && matches!(
            picture,
            DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_)
        )
        && tiff::first_short(bytes, tiff::SAMPLE_FORMAT) != Some(tiff::FLOATING_POINT)
    {
        let error = Diagnostic::unsupported("a TIFF with integers of 32 bits is not read");
        return Err(error.with_help(TIFFS_READ));
    }
    Ok((picture, orientation))
}

/// Decodes a TIFF file. Its decoder knows no palettes, so one with a palette is decoded as the
/// numbers of its colors.
fn decode_tiff(
    bytes: &[u8],
    ask: &mut dyn FnMut(u64) -> Result<()>,
) -> Result<(DynamicImage, Orientation)> {
    let Some((gray, palette)) = tiff::without_palette(bytes) else {
        return decode_format(bytes, ImageFormat::Tiff, ask);
    };
    let (picture, orientation) = decode_format(&gray, ImageFormat::Tiff, ask)?;
    let DynamicImage::ImageLuma8(numbers) = picture else {
        let error = Diagnostic::unsupported("a TIFF with a palette has more than 8 bits");
        return Err(error.with_help(TIFFS_READ));
    };
    ask(3 * numbers.len() as u64)?;
    let color = |x, y| image::Rgb(palette[usize::from(numbers.get_pixel(x, y).0[0])]);
    let picture = image::RgbImage::from_fn(numbers.width(), numbers.height(), color);
    Ok((DynamicImage::ImageRgb8(picture), orientation))
}

/// Decodes a JPEG file without an end marker. Its decoder completes what is missing without an
/// error, so other bytes are appended: if they change the picture, the file is cut.
fn decode_without_end(
    bytes: &[u8],
    ask: &mut dyn FnMut(u64) -> Result<()>,
) -> Result<(DynamicImage, Orientation)> {
    let mut followed_by = |more: &[u8]| {
        let bytes = [bytes, more, &jpeg::END].concat();
        decode_format(&bytes, ImageFormat::Jpeg, ask)
    };
    let picture = followed_by(&[])?;
    if followed_by(&[0xaa; 64])? == picture {
        return Ok(picture);
    }
    let error = Diagnostic::error("this JPEG is cut: rows or scans at its end are missing");
    let error = error.of_kind(ErrorKind::Damaged);
    Err(error.with_help("its transfer may have been interrupted: get the file again"))
}

/// The bytes of a picture for a decoder. Reading fails once the work of this thread has to end,
/// which ends a decoder that reads while it decodes.
struct Stoppable<'a> {
    bytes: Cursor<&'a [u8]>,
    stop: StopSignal,
}

/// The most bytes that a decoder gets at once. Those of a PNG may expand a thousand times.
const PIECE: usize = 16 << 10;

impl<'a> Stoppable<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Self {
            bytes: Cursor::new(bytes),
            stop: Budget::current().stop().clone(),
        }
    }

    fn check(&self) -> std::io::Result<()> {
        match self.stop.is_set() {
            true => Err(std::io::Error::other("the work has to end")),
            false => Ok(()),
        }
    }
}

impl Read for Stoppable<'_> {
    fn read(&mut self, to: &mut [u8]) -> std::io::Result<usize> {
        self.check()?;
        let most = to.len().min(PIECE);
        self.bytes.read(&mut to[..most])
    }
}

impl BufRead for Stoppable<'_> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        self.check()?;
        let rest = self.bytes.fill_buf()?;
        Ok(&rest[..rest.len().min(PIECE)])
    }

    fn consume(&mut self, count: usize) {
        self.bytes.consume(count);
    }
}

impl Seek for Stoppable<'_> {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.bytes.seek(to)
    }
}

/// Converts to a raster in the file's own precision.
fn from_image(picture: DynamicImage) -> Raster {
    let (width, height) = (picture.width(), picture.height());
    let channels = usize::from(picture.color().channel_count());
    let samples = match picture {
        DynamicImage::ImageLuma8(p) => Samples::U8(p.into_raw()),
        DynamicImage::ImageLumaA8(p) => Samples::U8(p.into_raw()),
        DynamicImage::ImageRgb8(p) => Samples::U8(p.into_raw()),
        DynamicImage::ImageRgba8(p) => Samples::U8(p.into_raw()),
        DynamicImage::ImageLuma16(p) => Samples::U16(p.into_raw()),
        DynamicImage::ImageLumaA16(p) => Samples::U16(p.into_raw()),
        DynamicImage::ImageRgb16(p) => Samples::U16(p.into_raw()),
        DynamicImage::ImageRgba16(p) => Samples::U16(p.into_raw()),
        DynamicImage::ImageRgb32F(p) => Samples::F32(p.into_raw()),
        DynamicImage::ImageRgba32F(p) => Samples::F32(p.into_raw()),
        other => {
            return Raster {
                width,
                height,
                channels: 4,
                samples: Samples::F32(other.into_rgba32f().into_raw()),
            };
        }
    };
    Raster {
        width,
        height,
        channels,
        samples,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encoded(format: ImageFormat) -> Vec<u8> {
        let picture = image::RgbImage::from_fn(3, 2, |x, y| image::Rgb([x as u8 * 80, 0, y as u8]));
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn the_content_decides_and_the_name_only_for_tga() {
        let formats = [
            (ImageFormat::Png, "a.txt"),
            (ImageFormat::Bmp, "a.png"),
            (ImageFormat::Tiff, "a"),
            (ImageFormat::Pnm, "a.jpg"),
            (ImageFormat::Tga, "a.tga"),
        ];
        for (format, name) in formats {
            let raster = Raster::decode(&encoded(format), name).unwrap();
            assert_eq!((raster.width, raster.height), (3, 2), "{format:?}");
            assert_eq!(raster.color(5), [160.0 / 255.0, 0.0, 1.0 / 255.0]);
        }
    }

    /// Radiance's format has 8 bits of a mantissa, so powers of two are exact.
    #[test]
    fn a_radiance_picture_has_its_light() {
        let light = [[8.0, 0.5, 0.25], [1024.0, 512.0, 256.0]];
        let picture = image::Rgb32FImage::from_fn(2, 1, |x, _| image::Rgb(light[x as usize]));
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, ImageFormat::Hdr).unwrap();
        let raster = Raster::decode(&bytes.into_inner(), "sky.hdr").unwrap();
        assert!(matches!(raster.samples, Samples::F32(_)));
        assert_eq!([raster.color(0), raster.color(1)], light);
    }

    #[test]
    fn decoding_ends_with_the_account_of_the_thread() {
        let picture = image::GrayImage::new(1000, 1000);
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, ImageFormat::Png).unwrap();
        let bytes = bytes.into_inner();
        let account = Budget::unlimited();
        account.during(|| {
            assert!(Raster::decode(&bytes, "a.png").is_ok());
            // The signal comes between the header and the pixels.
            let mut cancel = |_| {
                account.stop().cancel();
                Ok(())
            };
            let error = Raster::decode_within(&bytes, "a.png", &mut cancel).expect_err("ended");
            assert_eq!(error.message, "the work was canceled");
        });
    }

    #[test]
    fn a_gif_with_a_frame_far_larger_than_itself_is_refused() {
        let mut bytes = encoded(ImageFormat::Gif);
        let frame = bytes
            .iter()
            .position(|byte| *byte == b',')
            .expect("a frame");
        bytes[frame + 5..frame + 9].fill(0x20);
        let error = Raster::decode(&bytes, "a.gif").expect_err("too large");
        assert!(error.message.contains("limit"), "{}", error.message);
    }

    #[test]
    fn a_gif_has_alpha_only_if_it_has_a_transparent_color() {
        let opaque = Raster::decode(&encoded(ImageFormat::Gif), "a.gif").unwrap();
        assert_eq!(opaque.channels, 3);
        let picture = image::RgbaImage::from_fn(3, 2, |x, _| match x {
            0 => image::Rgba([0, 0, 0, 0]),
            _ => image::Rgba([9, 9, 9, 255]),
        });
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, ImageFormat::Gif).unwrap();
        let raster = Raster::decode(&bytes.into_inner(), "a.gif").unwrap();
        assert_eq!(raster.channels, 4);
        assert_eq!([raster.alpha(0), raster.alpha(1)], [0.0, 1.0]);
    }

    #[test]
    fn a_file_that_is_not_a_picture_is_refused_with_a_list_of_formats() {
        let error = Raster::decode(b"#Inventor V2.1 ascii\n", "room.iv").unwrap_err();
        assert!(error.message.contains("room.iv"));
        assert!(error.help.unwrap_or_default().contains("sgi"));
        assert!(Raster::open(Path::new("no/such/file.png")).is_err());
    }

    #[test]
    fn a_broken_file_of_any_format_is_an_error_and_not_a_panic() {
        for format in [ImageFormat::Png, ImageFormat::Bmp, ImageFormat::Tiff] {
            let whole = encoded(format);
            for cut in [4, 20, whole.len() / 2] {
                assert!(Raster::decode(&whole[..cut], "x").is_err(), "{format:?}");
            }
        }
    }

    /// Scans of few colors, with levels of 16 bits and, as some programs have written them, of 8.
    #[test]
    fn a_tiff_with_a_palette_has_its_colors() {
        for (scale, is_big_endian) in [(257, false), (1, false), (257, true)] {
            let two = |n: u16| match is_big_endian {
                true => n.to_be_bytes(),
                false => n.to_le_bytes(),
            };
            let four = |n: u32| match is_big_endian {
                true => n.to_be_bytes(),
                false => n.to_le_bytes(),
            };
            let mut bytes = if is_big_endian {
                b"MM".to_vec()
            } else {
                b"II".to_vec()
            };
            bytes.extend(two(42));
            bytes.extend(four(8));
            let entries = [
                (0x0100u16, 3),
                (0x0101, 1),
                (0x0102, 8),
                (0x0103, 1),
                (0x0106, 3),
                (0x0111, 134),
                (0x0115, 1),
                (0x0116, 1),
                (0x0117, 3),
            ];
            bytes.extend(two(entries.len() as u16 + 1));
            for (tag, value) in entries {
                bytes.extend([two(tag), two(3)].concat());
                bytes.extend(four(1));
                bytes.extend([two(value), two(0)].concat());
            }
            bytes.extend([two(0x0140), two(3)].concat());
            bytes.extend([four(768), four(138), four(0)].concat());
            // The directory ends here, and the strip and the map follow.
            bytes.resize(134, 0);
            bytes.extend([0, 7, 255, 0]);
            for channel in 0..3u16 {
                for i in 0..256u16 {
                    let level = if channel == 1 {
                        255 - i
                    } else {
                        i / (channel + 1)
                    };
                    bytes.extend(two(level * scale));
                }
            }
            let raster = Raster::decode(&bytes, "scan.tif").unwrap();
            let Samples::U8(levels) = &raster.samples else {
                panic!("{:?}", raster.samples);
            };
            assert_eq!(levels, &[0, 255, 0, 7, 248, 2, 255, 0, 85]);
        }
    }

    /// A scan that its camera or scanner says to turn by 90 degrees clockwise (EXIF 2.3, table 6).
    #[test]
    fn an_archival_picture_is_turned_as_its_file_states_and_a_texture_is_not() {
        let mut bytes = Cursor::new(Vec::new());
        let picture = image::RgbImage::from_fn(16, 8, |x, _| image::Rgb([x as u8 * 16; 3]));
        let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 100);
        let exif = b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";
        image::ImageEncoder::set_exif_metadata(&mut encoder, exif.to_vec()).unwrap();
        encoder.encode_image(&picture).unwrap();
        let bytes = bytes.into_inner();
        let stored = Raster::decode(&bytes, "a.jpg").unwrap();
        assert_eq!((stored.width, stored.height), (16, 8));
        let path = std::env::temp_dir().join(format!("ivcam-turned-{}.jpg", std::process::id()));
        std::fs::write(&path, bytes).unwrap();
        let turned = Raster::open(&path).unwrap();
        std::fs::remove_file(path).unwrap();
        assert_eq!((turned.width, turned.height), (8, 16));
        assert_eq!(turned.color(15 * 8), stored.color(7 * 16 + 15));
    }

    /// An interrupted transfer leaves the beginning of a file.
    #[test]
    fn a_jpeg_that_is_cut_is_refused_and_one_without_its_end_marker_is_not() {
        let picture = image::RgbImage::from_fn(64, 64, |x, y| {
            image::Rgb([(x * y) as u8, (7 * x) as u8, (9 * y) as u8])
        });
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, ImageFormat::Jpeg).unwrap();
        let bytes = bytes.into_inner();
        let whole = Raster::decode(&bytes, "a.jpg").unwrap();
        let without_end = Raster::decode(&bytes[..bytes.len() - 2], "a.jpg").unwrap();
        assert_eq!(without_end, whole);
        for cut in [bytes.len() / 2, bytes.len() - 20] {
            let error = Raster::decode(&bytes[..cut], "a.jpg").unwrap_err();
            assert!(error.message.contains("is cut"), "{}", error.message);
        }
        let more = [&bytes[..], b"what a camera appends"].concat();
        assert_eq!(Raster::decode(&more, "a.jpg").unwrap(), whole);
    }

    #[test]
    fn an_exr_is_read_with_the_values_written() {
        let path = std::env::temp_dir().join(format!("ivcam-raster-{}.exr", std::process::id()));
        let pixels = vec![[0.0, 0.5, 7.0], [1e-3, -1.0, 0.25]];
        let picture = crate::picture::Picture {
            width: 2,
            height: 1,
            pixels: pixels.clone(),
            response: crate::film::Response::Linear,
            provenance: indexmap::IndexMap::new(),
        };
        picture.save(&path, crate::picture::Depth::Eight).unwrap();
        let raster = Raster::open(&path).unwrap();
        std::fs::remove_file(path).unwrap();
        assert_eq!([raster.color(0), raster.color(1)].to_vec(), pixels);
        assert!(matches!(raster.samples, Samples::F32(_)));
    }
}
