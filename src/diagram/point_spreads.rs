//! Draws point spread functions as a picture.

use glam::DVec3;

use crate::diag::Result;
use crate::film::Response;
use crate::lens::analysis::psf::PointSpreads;
use crate::lens::{Lens, SheetSetting};
use crate::picture::{Picture, PictureFormat};
use crate::spectrum::Spectrum;

/// The side of each image, in pixels.
const SIDE: usize = 160;
/// The gap between two images, in pixels.
const GAP: usize = 4;
/// The range of wavelengths in nanometers, sampled every 30 nm.
const FIRST: i32 = 400;
const LAST: i32 = 700;

/// Returns the images of points on the film's diagonal in white light, side by side at one scale,
/// oriented as in an upright picture above its center.
///
/// EXR holds the light per mm² of a point source of light 1. The other formats hold its 0.4th power
/// over the peak of each image, which shows the faint rings.
///
/// # Errors
/// Fails if the lens makes no image of a point, or one too blurred for the diffraction computation.
pub(crate) fn point_spreads(
    lens: &Lens,
    setting: &SheetSetting<'_>,
    format: PictureFormat,
) -> Result<Picture> {
    let PointSpreads { pitch, images, .. } = PointSpreads::of(lens, setting, &white_light(), SIDE)?;
    let width = (images.len() * (SIDE + GAP)).saturating_sub(GAP);
    let mut picture = Picture {
        width: width as u32,
        height: SIDE as u32,
        pixels: vec![[0.0; 3]; width * SIDE],
        response: Response::Linear,
        provenance: Default::default(),
    };
    for (number, image) in images.iter().enumerate() {
        let peak = image.iter().map(|v| v.max_element()).fold(1e-300, f64::max);
        for (k, value) in image.iter().enumerate() {
            // The image on the film is upside down.
            let (x, y) = (SIDE - 1 - k % SIDE, k / SIDE);
            let shown = match format {
                PictureFormat::Exr => *value,
                _ => (*value / peak)
                    .max(DVec3::ZERO)
                    .to_array()
                    .map(|v| libm::pow(v, 0.4))
                    .into(),
            };
            picture.pixels[y * width + number * (SIDE + GAP) + x] = shown.as_vec3().to_array();
        }
    }
    let scale = format!("{:.4} \u{b5}m per pixel", 1000.0 * pitch);
    picture.provenance.insert("ivcam:scale".into(), scale);
    Ok(picture)
}

/// Returns wavelengths with the color that each adds to white light, which is 1 in total.
fn white_light() -> Vec<(f64, DVec3)> {
    let spectrum = Spectrum::default();
    let lines = (FIRST..=LAST).step_by(30).map(f64::from);
    let lines: Vec<(f64, DVec3)> = lines.map(|nm| (nm, spectrum.response(nm))).collect();
    let whole: DVec3 = lines.iter().map(|(_, color)| *color).sum();
    lines
        .into_iter()
        .map(|(nm, color)| (nm, color / whole))
        .collect()
}
