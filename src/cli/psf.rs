//! `ivcam lens NAME --psf FILE`: the images of points by light as a wave, in white light.

use std::path::Path;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::diag::{Diagnostic, Result};
use crate::film::Response;
use crate::lens::analysis::sheet::LensSheet;
use crate::lens::{Beam, Focus, FocusMethod, Lens, Openings, Wavefront};
use crate::picture::{Depth, Picture, PictureFormat};
use crate::spectrum::Spectrum;

/// Heights on the film, as shares of half of its diagonal.
const HEIGHTS: [f64; 4] = [0.0, 0.5, 0.7, 1.0];
/// Pixels on a side of each image, and between them.
const SIDE: usize = 160;
const GAP: usize = 4;
/// Wavelengths, every 30 nm.
const FIRST: i32 = 400;
const LAST: i32 = 700;
/// Plane waves across a beam, each way: as fine as the pupil's shape is drawn, and as many as a
/// minute of work pays for.
const GRID: (usize, usize) = (64, 512);

/// Writes the images of points on the film's diagonal, side by side and at one scale, as they
/// lie in an upright picture above its middle. EXR holds the light per mm² of a point of light 1;
/// the other formats its 0.4th power over the peak of each image, which shows the faint rings.
pub fn save(lens: &Lens, focus: Option<&Focus>, file: &str) -> Result<()> {
    let path = Path::new(file);
    let format = PictureFormat::of(path)?;
    let Some(sheet) = LensSheet::of(lens) else {
        return Err(
            Diagnostic::error(format!("`{}` makes no image of a point", lens.name()))
                .with_help("an afocal lens, or one that lets no light through, has none"),
        );
    };
    let (film_z, distance) = match focus {
        None => (sheet.film_z, f64::INFINITY),
        Some(f) if f.method == FocusMethod::Lens => (f.film_z, f.distance - f.film_z),
        Some(f) => (f.film_z, f.distance),
    };
    let beams: Vec<Beam<'_>> = HEIGHTS
        .iter()
        .filter_map(|share| Beam::of(lens, share * sheet.image_height, film_z, distance))
        .collect();
    let points: Vec<Point<'_>> = beams
        .iter()
        .filter_map(|b| Point::of(lens, b, film_z))
        .collect();
    let half = points.iter().map(Point::half).fold(0.0, f64::max);
    let pitch = 2.0 * half / SIDE as f64;
    let colors = colors();
    let openings: Vec<Openings> = points
        .par_iter()
        .map(|p| p.openings(lens))
        .collect::<Result<_>>()?;
    let jobs: Vec<(usize, usize)> = (0..points.len())
        .flat_map(|p| (0..colors.len()).map(move |c| (p, c)))
        .collect();
    let spreads: Vec<Vec<f64>> = jobs
        .par_iter()
        .map(|&(p, c)| points[p].spread(lens, colors[c].0, &openings[p], pitch))
        .collect();
    let mut picture = Picture {
        width: (points.len() * (SIDE + GAP)).saturating_sub(GAP) as u32,
        height: SIDE as u32,
        pixels: Vec::new(),
        response: Response::Linear,
        provenance: Default::default(),
    };
    picture.pixels = vec![[0.0; 3]; picture.width as usize * SIDE];
    let mut light = vec![vec![DVec3::ZERO; SIDE * SIDE]; points.len()];
    for (&(p, c), spread) in jobs.iter().zip(&spreads) {
        for (sum, value) in light[p].iter_mut().zip(spread) {
            *sum += colors[c].1 * *value;
        }
    }
    for (p, light) in light.iter().enumerate() {
        let peak = light.iter().map(|v| v.max_element()).fold(1e-300, f64::max);
        for (k, value) in light.iter().enumerate() {
            // The film is upside down: its rows from below are the picture's from above.
            let (x, y) = (SIDE - 1 - k % SIDE, k / SIDE);
            let shown = match format {
                PictureFormat::Exr => *value,
                _ => (*value / peak)
                    .max(DVec3::ZERO)
                    .to_array()
                    .map(|v| libm::pow(v, 0.4))
                    .into(),
            };
            let at = y * picture.width as usize + p * (SIDE + GAP) + x;
            picture.pixels[at] = shown.as_vec3().to_array();
        }
    }
    let micrometers = format!("{:.4} \u{b5}m a pixel", 1000.0 * pitch);
    picture.provenance.insert("ivcam:scale".into(), micrometers);
    picture.save(path, Depth::Eight)
}

/// What each wavelength adds to white light; together 1.
fn colors() -> Vec<(f64, DVec3)> {
    let spectrum = Spectrum::default();
    let lines = (FIRST..=LAST).step_by(30).map(f64::from);
    let lines: Vec<(f64, DVec3)> = lines.map(|nm| (nm, spectrum.answer(nm))).collect();
    let whole: DVec3 = lines.iter().map(|(_, color)| *color).sum();
    lines
        .into_iter()
        .map(|(nm, color)| (nm, color / whole))
        .collect()
}

/// A point's image as rays see it.
struct Point<'a> {
    beam: &'a Beam<'a>,
    middle: DVec3,
    rms: f64,
    /// The direction cosines that the beam covers.
    span: f64,
}

impl<'a> Point<'a> {
    fn of(lens: &Lens, beam: &'a Beam<'a>, film_z: f64) -> Option<Self> {
        const RAYS: usize = 48;
        let (low, high) = beam.bounds();
        let step = (high - low) / RAYS as f64;
        let grid = (0..RAYS * RAYS).map(|k| DVec2::new((k % RAYS) as f64, (k / RAYS) as f64));
        let rays: Vec<(DVec2, DVec2)> = grid
            .filter_map(|at| {
                let out = beam.trace(lens, low + step * (at + 0.5))?;
                Some((out.at_z(film_z).truncate(), out.direction.truncate()))
            })
            .collect();
        let count = rays.len() as f64;
        let middle = rays.iter().map(|(p, _)| *p).sum::<DVec2>() / count;
        let square: f64 = rays
            .iter()
            .map(|(p, _)| (*p - middle).length_squared())
            .sum();
        let bounds = |pick: fn(DVec2, DVec2) -> DVec2, start: DVec2| {
            rays.iter().fold(start, |b, (_, d)| pick(b, *d))
        };
        let span = bounds(DVec2::max, DVec2::NEG_INFINITY) - bounds(DVec2::min, DVec2::INFINITY);
        (count > 8.0 && span.min_element() > 0.0).then(|| Self {
            beam,
            middle: middle.extend(film_z),
            rms: (square / count).sqrt(),
            span: span.max_element(),
        })
    }

    /// Half of the picture that shows it: several Airy discs, or the spot.
    fn half(&self) -> f64 {
        let airy = 1.22 * 550e-6 / self.span;
        (5.0 * airy).max(3.0 * self.rms)
    }

    fn openings(&self, lens: &Lens) -> Result<Openings> {
        let violet = lens.at_wavelength(f64::from(FIRST));
        let grid = Wavefront::cells_needed(&violet, self.beam, self.middle.z);
        if grid > GRID.1 {
            return Err(Diagnostic::error(format!(
                "the image {:.2} mm from the axis is too unsharp to be drawn as a wave: it takes {grid} \
                 plane waves across the pupil, and {} is the most",
                self.middle.truncate().length(),
                GRID.1
            ))
            .with_help("stop the lens down, or focus nearer to the point"));
        }
        Ok(Openings::of(lens, self.beam, grid.max(GRID.0)))
    }

    fn spread(&self, lens: &Lens, nm: f64, openings: &Openings, pitch: f64) -> Vec<f64> {
        let line = lens.at_wavelength(nm);
        let waves = Wavefront::of(&line, self.beam, openings, self.middle);
        waves.map_or_else(|| vec![0.0; SIDE * SIDE], |w| w.point_spread(SIDE, pitch))
    }
}
