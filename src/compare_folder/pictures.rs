//! Writes the pictures of the page: JPEG files of bounded size.

use std::path::Path;

use image::RgbImage;
use image::codecs::jpeg::JpegEncoder;
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::{folder_of, write_whole};

use super::entry::PairPictures;
use crate::compare::sheet::{FAINT, difference, level, ramp, scale_of};
use crate::compare::{Comparison, Plane, Plate};

/// The longer sides of the pictures, in pixels. Larger pictures are reduced to them.
const LARGE: usize = 1600;
const SMALL: usize = 240;
/// The quality of the JPEG files, on whose scale 100 is the best. At 92 the errors are about one
/// level; the measures are computed before.
const QUALITY: u8 = 92;

/// The folder of the pictures below that of the report.
pub(super) const FOLDER: &str = "pictures";

/// Writes the pictures of a comparison below the folder of the report. `name` is that of the new
/// picture.
///
/// # Errors
/// Returns an error if a file cannot be written.
pub(super) fn write(comparison: &Comparison, out: &Path, name: &str) -> Result<PairPictures> {
    let scale = scale_of(comparison);
    let plates = [
        comparison.new.clone(),
        over_faint(comparison, |i| comparison.old.color(i)),
        over_faint(comparison, |i| {
            ramp(f64::from(difference(comparison, i)) / scale).map(unit)
        }),
    ];
    let mut files = [const { String::new() }; 6];
    for (i, (plate, kind)) in plates.iter().zip(["new", "old", "difference"]).enumerate() {
        let large = within(plate, LARGE);
        files[i] = format!("{FOLDER}/{name}.{kind}.jpg");
        files[i + 3] = format!("{FOLDER}/{name}.{kind}.small.jpg");
        write_bytes(&out.join(&files[i + 3]), &jpeg(&within(&large, SMALL))?)?;
        write_bytes(&out.join(&files[i]), &jpeg(&large)?)?;
    }
    let [new, old, difference, a, b, c] = files;
    Ok(PairPictures {
        new,
        old,
        difference,
        small: [a, b, c],
        scale,
    })
}

/// Returns a small picture as the bytes of a JPEG file.
///
/// # Errors
/// Returns an error if it cannot be encoded.
pub(super) fn small(plate: &Plate) -> Result<Vec<u8>> {
    jpeg(&within(plate, SMALL))
}

/// Writes a file, and creates its folder.
///
/// # Errors
/// Returns an error if that is not possible.
pub(super) fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    let folder = folder_of(path);
    std::fs::create_dir_all(&folder).map_err(|e| Diagnostic::io(folder.display(), &e))?;
    write_whole(path, |file| file.write_all(bytes))
}

/// Returns a picture with the longer side of at most `side` pixels.
pub(super) fn within(plate: &Plate, side: usize) -> Plate {
    let longer = plate.width.max(plate.height);
    if longer <= side {
        return plate.clone();
    }
    let scaled = |n: usize| ((n * side) as f64 / longer as f64).round().max(1.0) as usize;
    plate.map(|plane| plane.resized(scaled(plate.width), scaled(plate.height)))
}

/// Returns a picture on the pixels of the new one, gray where pixels do not count.
fn over_faint(comparison: &Comparison, color: impl Fn(usize) -> [f32; 3]) -> Plate {
    let (width, height) = (comparison.width, comparison.height);
    let mut values = [0, 1, 2].map(|_| Vec::with_capacity(width * height));
    for i in 0..width * height {
        let color = match comparison.mask.counts[i] {
            true => color(i),
            false => FAINT.map(unit),
        };
        values.iter_mut().zip(color).for_each(|(v, c)| v.push(c));
    }
    Plate::from_planes(values.map(|values| Plane {
        width,
        height,
        values,
    }))
}

fn unit(level: u8) -> f32 {
    f32::from(level) / 255.0
}

/// Encodes a picture as JPEG.
fn jpeg(plate: &Plate) -> Result<Vec<u8>> {
    let levels = (0..plate.width * plate.height).flat_map(|i| plate.color(i).map(level));
    let size = (plate.width as u32, plate.height as u32);
    let picture = RgbImage::from_raw(size.0, size.1, levels.collect()).unwrap_or_default();
    let mut bytes = Vec::new();
    picture
        .write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, QUALITY))
        .map_err(|e| Diagnostic::error(format!("a picture of the page can't be encoded: {e}")))?;
    Ok(bytes)
}
