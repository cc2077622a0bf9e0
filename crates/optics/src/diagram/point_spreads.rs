//! Draws point spread functions as a picture.

use glam::{DVec2, DVec3};
use ivcam_base::diag::{Diagnostic, Result};

use crate::film::Response;
use crate::lens::analysis::psf::PointSpreads;
use crate::lens::{FieldPoint, Lens, SheetSetting};
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
pub fn point_spreads(
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

/// The columns and rows of a map of images over the film.
const CELLS: [usize; 2] = [7, 5];
/// The side of each image of a map, in pixels.
const MAP_SIDE: usize = 96;

/// Returns a map of the images of points over a film of the given sides in millimeters: 7 by 5
/// images for the middles of as many equal cells of the upright picture, all at one scale, as light
/// per mm² of a point source of light 1. A cell that no light reaches is black.
///
/// The images are computed on one meridian and turned about the axis; values between pixels are
/// interpolated linearly.
///
/// # Errors
/// Fails as [`point_spreads`] does, and for a lens without rotational symmetry.
pub fn point_spread_map(lens: &Lens, setting: &SheetSetting<'_>, film: DVec2) -> Result<Picture> {
    map_of(lens, setting, film, CELLS, MAP_SIDE, &white_light())
}

/// Returns a map with a number of columns and rows, of images of `side` pixels, from wavelengths in
/// nanometers with their colors.
fn map_of(
    lens: &Lens,
    setting: &SheetSetting<'_>,
    film: DVec2,
    [columns, rows]: [usize; 2],
    side: usize,
    colors: &[(f64, DVec3)],
) -> Result<Picture> {
    if !lens.is_rotational() {
        return Err(Diagnostic::unsupported(format!(
            "`{}` is not symmetric about its axis, so its images cannot be turned about it",
            lens.name()
        ))
        .with_help("`--psf` draws the images on one meridian"));
    }
    let cell = |x: usize, y: usize| {
        let share = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        let share = share / DVec2::new(columns as f64, rows as f64);
        (share - 0.5) * film
    };
    let mut heights: Vec<f64> = (0..columns * rows)
        .map(|k| cell(k % columns, k / columns).length())
        .collect();
    heights.sort_by(f64::total_cmp);
    heights.dedup_by(|a, b| (*a - *b).abs() < 1e-9 * film.x);
    let setting = SheetSetting {
        image_height: Some(0.5 * film.length()),
        fields: heights.into_iter().map(FieldPoint::Height).collect(),
        ..setting.clone()
    };
    let spreads = PointSpreads::of(lens, &setting, colors, side)?;
    let width = columns * side;
    let mut picture = Picture {
        width: width as u32,
        height: (rows * side) as u32,
        pixels: vec![[0.0; 3]; width * rows * side],
        response: Response::Linear,
        provenance: Default::default(),
    };
    for (k, pixel) in picture.pixels.iter_mut().enumerate() {
        let (x, y) = (k % width, k / width);
        let place = cell(x / side, y / side);
        let near = |h: &f64| (h - place.length()).abs() < 1e-6 * film.x;
        let Some(number) = spreads.heights.iter().position(near) else {
            continue;
        };
        // On the film the picture is turned by half a turn: x to the left, y upward.
        let off = DVec2::new((x % side) as f64, (y % side) as f64);
        let off = (off - 0.5 * (side - 1) as f64) * DVec2::new(-1.0, 1.0);
        let outward = (place * DVec2::new(-1.0, 1.0))
            .try_normalize()
            .unwrap_or(DVec2::Y);
        let turned = DVec2::new(off.dot(DVec2::new(outward.y, -outward.x)), off.dot(outward));
        *pixel = between(&spreads.images[number], side, turned)
            .as_vec3()
            .to_array();
    }
    let scale = format!("{:.4} \u{b5}m per pixel", 1000.0 * spreads.pitch);
    picture.provenance.insert("ivcam:scale".into(), scale);
    let cells = format!(
        "{columns} x {rows} cells of a film of {} x {} mm",
        film.x, film.y
    );
    picture.provenance.insert("ivcam:cells".into(), cells);
    Ok(picture)
}

/// Returns the value of an image at a distance from its middle, in pixels, between four pixels.
fn between(image: &[DVec3], side: usize, off: DVec2) -> DVec3 {
    let at = off + 0.5 * (side - 1) as f64;
    let low = at.floor();
    let share = at - low;
    let value = |x: f64, y: f64| {
        let inside = |v: f64| (0.0..side as f64).contains(&v);
        match inside(x) && inside(y) {
            true => image[y as usize * side + x as usize],
            false => DVec3::ZERO,
        }
    };
    let row = |y: f64| value(low.x, y).lerp(value(low.x + 1.0, y), share.x);
    row(low.y).lerp(row(low.y + 1.0), share.y)
}

/// Returns wavelengths with the color that each adds to white light, which is 1 in total.
pub fn white_light() -> Vec<(f64, DVec3)> {
    let spectrum = Spectrum::default();
    let lines = (FIRST..=LAST).step_by(30).map(f64::from);
    let lines: Vec<(f64, DVec3)> = lines.map(|nm| (nm, spectrum.response(nm))).collect();
    let whole: DVec3 = lines.iter().map(|(_, color)| *color).sum();
    lines
        .into_iter()
        .map(|(nm, color)| (nm, color / whole))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triplet at f/16 by one wavelength: the coma of the corners makes their images differ from
    /// that in the middle.
    #[test]
    fn a_map_of_images_is_symmetric_about_the_middle_and_holds_the_light_of_each_point() {
        let lens = Lens::named("cooke-triplet").unwrap();
        let lens = lens.at_f_number(16.0).unwrap();
        let film = DVec2::new(36.0, 24.0);
        let setting = SheetSetting::default();
        let green = [(550.0, DVec3::ONE)];
        const SIDE: usize = 32;
        let map = map_of(&lens, &setting, film, [3, 3], SIDE, &green).unwrap();
        let width = map.width as usize;
        assert_eq!((width, map.height as usize), (3 * SIDE, 3 * SIDE));
        let at = |x: usize, y: usize| f64::from(map.pixels[y * width + x][1]);
        let peak = map
            .pixels
            .iter()
            .map(|p| f64::from(p[1]))
            .fold(0.0, f64::max);
        for y in 0..width {
            for x in 0..width {
                let others = [at(width - 1 - x, y), at(x, width - 1 - y)];
                let same = others.iter().all(|o| (o - at(x, y)).abs() < 1e-3 * peak);
                assert!(same, "{x}, {y}");
            }
        }
        let scale = map.provenance["ivcam:scale"].split(' ').next().unwrap();
        let pixel = (scale.parse::<f64>().unwrap() / 1000.0).powi(2);
        for (column, row) in [(0, 0), (1, 1), (2, 1)] {
            let light: f64 = (0..SIDE * SIDE)
                .map(|k| at(column * SIDE + k % SIDE, row * SIDE + k / SIDE))
                .sum();
            let light = light * pixel;
            assert!((0.8..1.05).contains(&light), "{column}, {row}: {light}");
        }
    }
}
