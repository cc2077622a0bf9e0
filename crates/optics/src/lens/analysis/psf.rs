//! Point spreads: images of points at several heights of the film, computed by diffraction.

use glam::{DVec2, DVec3};
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::work::Budget;
use rayon::prelude::*;

use crate::lens::analysis::beam::Beam;
use crate::lens::analysis::diffraction::{Openings, Wavefront};
use crate::lens::analysis::sheet::SheetSetting;
use crate::lens::lens::Lens;

/// The least and the greatest number of plane waves along each side of the grid across a beam. The
/// shape of the pupil needs the least number, and the greatest bounds the time to about a minute.
const GRID: (usize, usize) = (64, 512);

/// The images of points on the film's diagonal, all at one scale.
#[derive(Clone, Debug)]
pub struct PointSpreads {
    /// The size of a pixel, in millimeters.
    pub pitch: f64,
    /// The height on the film of each image, in millimeters.
    pub heights: Vec<f64>,
    /// The colors of each image per square millimeter from a point source of color 1. Rows have
    /// rising y, and the pixels of a row rising x, both in lens space.
    pub images: Vec<Vec<DVec3>>,
}

impl PointSpreads {
    /// Computes images of `side` by `side` pixels from wavelengths, in nanometers, and the color
    /// that each adds. The setting has the object, the film and the heights.
    ///
    /// # Errors
    ///
    /// Returns an error if the lens makes no image, or if an image is too blurred to compute: it
    /// would need more than 512 plane waves across the pupil.
    pub fn of(
        lens: &Lens,
        setting: &SheetSetting<'_>,
        colors: &[(f64, DVec3)],
        side: usize,
    ) -> Result<Self> {
        let at = setting.conjugate(lens).zip(setting.full_height(lens));
        let Some((conjugate, image_height)) = at else {
            return Err(
                Diagnostic::error(format!("`{}` makes no image of a point", lens.name()))
                    .with_help("an afocal lens, or one that lets no light through, has none"),
            );
        };
        let (film_z, distance) = (conjugate.film_z, conjugate.distance);
        let beams: Vec<Beam<'_>> = setting
            .heights(lens, image_height, film_z)
            .into_iter()
            .filter_map(|height| Beam::of(lens, height, film_z, distance))
            .collect();
        let points: Vec<PsfPoint<'_>> = beams
            .iter()
            .filter_map(|b| PsfPoint::of(lens, b, film_z))
            .collect();
        let half = points.iter().map(PsfPoint::half).fold(0.0, f64::max);
        let pitch = 2.0 * half / side as f64;
        let shortest = colors
            .iter()
            .map(|(nm, _)| *nm)
            .fold(f64::INFINITY, f64::min);
        let account = Budget::current();
        let openings: Vec<Openings> = points
            .par_iter()
            .map(|p| account.during(|| p.openings(lens, shortest)))
            .collect::<Result<_>>()?;
        let jobs: Vec<(usize, usize)> = (0..points.len())
            .flat_map(|p| (0..colors.len()).map(move |c| (p, c)))
            .collect();
        let spreads: Vec<Vec<f64>> = jobs
            .par_iter()
            .map(|&(p, c)| {
                let spread = || points[p].spread(lens, colors[c].0, &openings[p], (side, pitch));
                account.during(spread)
            })
            .collect();
        let mut images = vec![vec![DVec3::ZERO; side * side]; points.len()];
        for (&(p, c), spread) in jobs.iter().zip(&spreads) {
            for (sum, value) in images[p].iter_mut().zip(spread) {
                *sum += colors[c].1 * *value;
            }
        }
        let heights = points.iter().map(|p| p.beam.height).collect();
        Ok(Self {
            pitch,
            heights,
            images,
        })
    }
}

/// The image of a point by rays. Lengths are in millimeters.
struct PsfPoint<'a> {
    beam: &'a Beam<'a>,
    /// The centroid of the spot, in lens space.
    center: DVec3,
    /// The root mean square radius of the spot.
    rms: f64,
    /// The range of direction cosines that the beam covers.
    span: f64,
}

impl<'a> PsfPoint<'a> {
    /// The image by a grid of rays; none if too few get through.
    fn of(lens: &Lens, beam: &'a Beam<'a>, film_z: f64) -> Option<Self> {
        const RAYS: usize = 48;
        let rays: Vec<(DVec2, DVec2)> = beam
            .trace(lens, &beam.grid(RAYS))
            .into_iter()
            .flatten()
            .map(|out| (out.at_z(film_z).truncate(), out.direction.truncate()))
            .collect();
        let count = rays.len() as f64;
        let center = rays.iter().map(|(p, _)| *p).sum::<DVec2>() / count;
        let square: f64 = rays
            .iter()
            .map(|(p, _)| (*p - center).length_squared())
            .sum();
        let bounds = |pick: fn(DVec2, DVec2) -> DVec2, start: DVec2| {
            rays.iter().fold(start, |b, (_, d)| pick(b, *d))
        };
        let span = bounds(DVec2::max, DVec2::NEG_INFINITY) - bounds(DVec2::min, DVec2::INFINITY);
        (count > 8.0 && span.min_element() > 0.0).then(|| Self {
            beam,
            center: center.extend(film_z),
            rms: (square / count).sqrt(),
            span: span.max_element(),
        })
    }

    /// Half of the side of a square that shows the image: five Airy radii, or three times the
    /// radius of the spot.
    fn half(&self) -> f64 {
        let airy = 1.22 * 550e-6 / self.span;
        (5.0 * airy).max(3.0 * self.rms)
    }

    /// The open shares of the pupil's cells, on a grid that is fine enough for the shortest
    /// wavelength.
    fn openings(&self, lens: &Lens, shortest: f64) -> Result<Openings> {
        let shortest = lens.at_wavelength(shortest);
        let grid = Wavefront::cells_needed(&shortest, self.beam, self.center.z);
        if grid > GRID.1 {
            return Err(Diagnostic::error(format!(
                "the image {:.2} mm from the axis is too blurred to compute its diffraction: it needs \
                 {grid} plane waves across the pupil, and the limit is {}",
                self.center.truncate().length(),
                GRID.1
            ))
            .with_help("stop the lens down, or focus nearer to the point"));
        }
        Ok(Openings::of(lens, self.beam, grid.max(GRID.0)))
    }

    /// The point spread at a wavelength in nanometers.
    fn spread(
        &self,
        lens: &Lens,
        nm: f64,
        openings: &Openings,
        (side, pitch): (usize, f64),
    ) -> Vec<f64> {
        let line = lens.at_wavelength(nm);
        let waves = Wavefront::of(&line, self.beam, openings, self.center);
        waves.map_or_else(|| vec![0.0; side * side], |w| w.point_spread(side, pitch))
    }
}
