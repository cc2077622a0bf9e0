//! The image of a point by diffraction: point spread and modulation at one wavelength.
//!
//! The field near an image point is a sum of plane waves, one for every direction that the lens
//! lets through (Debye's integral): U(x) = ∫ a(d) exp(i k (W(d) + n d·x)) dd, with W the optical
//! path to the foot of the perpendicular from the image point and the integral over direction
//! cosines. Directions, paths and the pupil's shape are those of traced rays. It holds where the
//! image is many wavelengths from the pupil and the pupil many wavelengths wide, which is any
//! camera.
//!
//! The pupil is divided into cells, and over a cell the phase is approximated as linear in the
//! direction: its slope is the point where the cell's ray lands. The integral over a cell is then a
//! plane wave whose amplitude falls off as sin(t)/t away from that point, so light goes only where
//! rays go, and the grid does not repeat the image. The curvature of the phase inside a cell is
//! neglected; with `Wavefront::cells_needed` cells it is a quarter of a radian at most.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::lens::analysis::beam::Beam;
use crate::lens::lens::Lens;
use crate::lens::trace::ray::LensRay;

/// The number of parts along each side into which a cell at the edge of the pupil is divided.
const PARTS: u32 = 8;
/// The greatest error of the phase at a cell's corner by its neglected curvature, in radians. The
/// number of cells along a side is proportional to the inverse of its root, so a quarter of the
/// value doubles that number. `a_blurred_image_has_no_copies_beside_it` tests that the value is
/// small enough for ten waves of defocus.
const MAX_PHASE_ERROR: f64 = 0.25;

/// The wavefront at an image point, as a grid of plane waves.
#[derive(Clone, Debug)]
pub struct Wavefront {
    /// The number of cells along each side.
    grid: usize,
    /// The plane waves, row by row; none where no light gets through.
    cells: Vec<Option<Wave>>,
    /// 2π n / λ, per millimeter.
    wave_number: f64,
}

/// The plane wave of one cell.
#[derive(Clone, Copy, Debug)]
struct Wave {
    /// The share of the cell that gets through.
    open: f64,
    /// The direction cosines along the film's x and y.
    direction: DVec2,
    /// The phase at the image point, in radians.
    phase: f64,
    /// The point where the cell's ray lands, relative to the image point, in millimeters.
    landing: DVec2,
    /// The cell's width and height in direction cosines.
    size: DVec2,
    /// The cell's area in direction cosines.
    area: f64,
}

/// The shares of the cells of a grid across a beam that get through the lens. They are used for all
/// wavelengths, which neglects the movement of the pupil's rim by dispersion.
#[derive(Clone, Debug)]
pub struct Openings {
    /// The number of cells along each side.
    grid: usize,
    /// The shares, row by row.
    shares: Vec<f64>,
}

impl Openings {
    /// Measures the shares by rays.
    pub fn of(lens: &Lens, beam: &Beam<'_>, grid: usize) -> Self {
        let (low, high) = beam.bounds();
        let step = (high - low) / grid as f64;
        let place = |x: f64, y: f64| low + step * DVec2::new(x, y);
        let corners: Vec<DVec2> = (0..=grid)
            .flat_map(|j| (0..=grid).map(move |i| (i, j)))
            .map(|(i, j)| place(i as f64, j as f64))
            .collect();
        let corners = beam.passing(lens, &corners);
        let share = |k: usize| {
            let (i, j) = (k % grid, k / grid);
            let at = j * (grid + 1) + i;
            let around = [at, at + 1, at + grid + 1, at + grid + 2].map(|c| corners[c]);
            match around.iter().filter(|p| **p).count() {
                0 => 0.0,
                4 => 1.0,
                _ => open_share(lens, beam, place(i as f64, j as f64), step),
            }
        };
        Self {
            grid,
            shares: (0..grid * grid).map(share).collect(),
        }
    }
}

impl Wavefront {
    /// The wavefront of a beam at the point `image` on the film. The point is the reference of the
    /// phase. If another point of the film is used, the image is shifted, so all wavelengths must
    /// use the same. Returns none if no light gets through.
    pub fn of(lens: &Lens, beam: &Beam<'_>, openings: &Openings, image: DVec3) -> Option<Self> {
        let grid = openings.grid;
        let indices = lens.prescription().indices(lens.wavelength());
        let n = indices[indices.len() - 1];
        let wave_number = TAU * n / (lens.wavelength() * 1e-6);
        let shares = openings.shares.iter();
        let open = shares.enumerate().filter(|(_, open)| **open > 0.0);
        let open: Vec<(usize, f64)> = open.map(|(k, open)| (k, *open)).collect();
        let grid_places = beam.grid(grid);
        let places: Vec<DVec2> = open.iter().map(|(k, _)| grid_places[*k]).collect();
        let mut cells = vec![None; grid * grid];
        let arrivals = beam.arrivals(lens, &places, &indices, image);
        for ((k, open), found) in open.into_iter().zip(arrivals) {
            cells[k] = found.map(|(out, path)| Wave {
                open,
                direction: out.direction.truncate(),
                phase: path * wave_number / n,
                landing: (out.at_z(image.z) - image).truncate(),
                size: DVec2::ZERO,
                area: 0.0,
            });
        }
        let mut this = Self {
            grid,
            cells,
            wave_number,
        };
        this.measure_cells();
        let light: f64 = this.waves().map(|w| w.open).sum();
        (light > 0.0).then_some(this)
    }

    /// The number of cells along each side of the grid for which the phase error is at most
    /// [`MAX_PHASE_ERROR`] at the lens's wavelength. It follows from the differences between the
    /// landing points and directions of neighboring rays.
    pub(crate) fn cells_needed(lens: &Lens, beam: &Beam<'_>, film_z: f64) -> usize {
        const RAYS: usize = 48;
        let rays = beam.trace(lens, &beam.grid(RAYS));
        let apart = |a: &LensRay, b: &LensRay| {
            let landing = a.at_z(film_z) - b.at_z(film_z);
            (landing.dot(a.direction - b.direction)).abs()
        };
        let neighbor = |k: usize, next: usize| rays.get(next)?.as_ref().zip(rays[k].as_ref());
        let across = (0..rays.len()).filter(|k| k % RAYS + 1 < RAYS);
        let pairs = across.filter_map(|k| neighbor(k, k + 1));
        let pairs = pairs.chain((0..rays.len()).filter_map(|k| neighbor(k, k + RAYS)));
        let largest = pairs.map(|(a, b)| apart(a, b)).fold(0.0, f64::max);
        let wave_number = TAU / (lens.wavelength() * 1e-6);
        // (x δd/2)²/2 of a phase with curvature x/δd, along both axes.
        let radians = 2.0 * wave_number * largest / 8.0;
        (RAYS as f64 * (radians / MAX_PHASE_ERROR).sqrt()).ceil() as usize
    }

    /// Computes the sizes and areas of the cells from the directions of their neighbors.
    fn measure_cells(&mut self) {
        let grid = self.grid;
        let direction = |cells: &[Option<Wave>], i: usize, j: usize| {
            cells[j * grid + i].as_ref().map(|w| w.direction)
        };
        let slope = |cells: &[Option<Wave>], i: usize, j: usize, along_x: bool| {
            let k = if along_x { i } else { j };
            let at = |k: usize| match along_x {
                true => direction(cells, k, j),
                false => direction(cells, i, k),
            };
            let before = k.checked_sub(1).and_then(at).map(|d| (d, 1.0));
            let after = (k + 1 < grid)
                .then(|| at(k + 1))
                .flatten()
                .map(|d| (d, 1.0));
            let here = (at(k)?, 0.0);
            let (a, b) = (before.unwrap_or(here), after.unwrap_or(here));
            (a.1 + b.1 > 0.0).then(|| (b.0 - a.0) / (a.1 + b.1))
        };
        let sizes: Vec<(DVec2, f64)> = (0..grid * grid)
            .map(|c| {
                let (i, j) = (c % grid, c / grid);
                let x = slope(&self.cells, i, j, true).unwrap_or_default();
                let y = slope(&self.cells, i, j, false).unwrap_or_default();
                (DVec2::new(x.x, y.y), x.perp_dot(y).abs())
            })
            .collect();
        for (cell, (size, area)) in self.cells.iter_mut().zip(sizes) {
            if let Some(wave) = cell {
                (wave.size, wave.area) = (size, area);
            }
        }
    }

    /// The plane waves of all cells that light gets through.
    fn waves(&self) -> impl Iterator<Item = &Wave> {
        self.cells.iter().flatten()
    }

    /// The point spread over a square of `side`² points that are `pitch` millimeters apart, row by
    /// row upward, with the image point in the middle. The values are per square millimeter, and
    /// their integral over the whole film is 1.
    pub fn point_spread(&self, side: usize, pitch: f64) -> Vec<f64> {
        let light: f64 = self.waves().map(|w| w.open).sum();
        let mut field = WaveField::dark(side);
        for wave in self.waves().filter(|w| w.open > 0.0) {
            // Every open cell has the same flux; its amplitude is the root of the flux over its
            // area.
            let amplitude = wave.open * (wave.area / light).sqrt();
            let [xs, ys] = [0, 1].map(|axis| self.along(wave, axis, side, pitch));
            field.add(amplitude * phasor(wave.phase), &xs, &ys);
        }
        let per_area = self.wave_number * self.wave_number / (TAU * TAU);
        let parts = field.real.iter().zip(&field.imaginary);
        let light = parts.map(|(a, b)| f64::from(a * a + b * b));
        light.map(|light| per_area * light).collect()
    }

    /// The factor of a cell's wave at points along an axis of the film.
    fn along(&self, wave: &Wave, axis: usize, side: usize, pitch: f64) -> WaveField {
        let start = -0.5 * (side as f64 - 1.0) * pitch;
        let turn = self.wave_number * wave.direction[axis];
        // The phase changes by 2t from one end of a cell to the other.
        let half = 0.5 * self.wave_number * wave.size[axis];
        let from_landing = half * (start - wave.landing[axis]);
        let mut line = WaveField::default();
        let (mut wave, step) = (phasor(turn * start), phasor(turn * pitch));
        let (mut spread, spread_step) = (phasor(from_landing), phasor(half * pitch));
        for i in 0..side {
            let t = from_landing + i as f64 * half * pitch;
            let share = if t.abs() > 1e-4 { spread.y / t } else { 1.0 };
            line.real.push((share * wave.x) as f32);
            line.imaginary.push((share * wave.y) as f32);
            (wave, spread) = (wave.rotate(step), spread.rotate(spread_step));
        }
        line
    }

    /// The optical transfer function at a frequency in cycles per millimeter along the film's x
    /// axis (0) or y axis (1), as a complex number. It is the autocorrelation of the pupil, shifted
    /// by the frequency (Hopkins), over its area. Directions are approximated as linear over the
    /// grid.
    pub fn transfer(&self, frequency: f64, axis: usize) -> DVec2 {
        let shift = frequency * TAU / (self.wave_number * self.cosine_step(axis));
        let (k, part) = (shift as usize, shift.fract());
        let stride = if axis == 0 { 1 } else { self.grid };
        let shifted = |i: usize, k: usize| {
            let in_row = axis == 1 || i % self.grid + k < self.grid;
            let wave = self.cells.get(i + k * stride)?.as_ref()?;
            (in_row && wave.open > 0.0).then_some(wave)
        };
        let mut sum = DVec2::ZERO;
        let mut light = 0.0;
        for (i, cell) in self.cells.iter().enumerate() {
            let Some(a) = cell else { continue };
            // The open part of a cell covers all of itself, but only a share of another cell's.
            light += a.open;
            let open_at_k = |b: &Wave| if k == 0 { 1.0 } else { b.open };
            // The phase between two cells is interpolated linearly.
            let (phase, open) = match (shifted(i, k), shifted(i, k + 1)) {
                (Some(b), Some(c)) => (
                    b.phase + part * (c.phase - b.phase),
                    open_at_k(b) + part * (c.open - open_at_k(b)),
                ),
                (Some(b), None) => (b.phase, (1.0 - part) * open_at_k(b)),
                (None, Some(c)) => (c.phase, part * c.open),
                (None, None) => continue,
            };
            sum += a.open * open * phasor(a.phase - phase);
        }
        sum / light
    }

    /// The wavefront at the point behind the image point by a distance along the axis, in
    /// millimeters.
    pub(crate) fn shifted(&self, distance: f64) -> Self {
        let mut this = self.clone();
        for wave in this.cells.iter_mut().flatten() {
            let along = (1.0 - wave.direction.length_squared()).sqrt();
            wave.phase += self.wave_number * along * distance;
            wave.landing += distance / along * wave.direction;
        }
        this
    }

    /// The Strehl ratio: the peak of the point spread over that of the same waves in phase.
    pub fn strehl(&self) -> f64 {
        const SIDE: usize = 121;
        let light: f64 = self.waves().map(|w| w.open).sum();
        let amplitude = |w: &Wave| w.open * (w.area / light).sqrt();
        let perfect: f64 = self.waves().map(amplitude).sum();
        let open = || self.waves().filter(|w| w.open > 0.0);
        let low = open().fold(DVec2::INFINITY, |b, w| b.min(w.direction));
        let high = open().fold(DVec2::NEG_INFINITY, |b, w| b.max(w.direction));
        // The finest structure of the image, in which the peak cannot be missed.
        let fine = TAU / (self.wave_number * (high - low).max_element());
        let square: f64 = open().map(|w| w.open * w.landing.length_squared()).sum();
        let reach = 2.0 * (square / light).sqrt();
        let pitch = (0.25 * fine).max((2.0 * reach / SIDE as f64).min(0.5 * fine));
        let spread = self.point_spread(SIDE, pitch);
        let best = (0..spread.len()).max_by(|a, b| spread[*a].total_cmp(&spread[*b]));
        let cell = |i: usize| (i as f64 - 0.5 * (SIDE as f64 - 1.0)) * pitch;
        let mut place = best.map_or(DVec2::ZERO, |k| DVec2::new(cell(k % SIDE), cell(k / SIDE)));
        let at = |place: DVec2| {
            let field = self.waves().map(|w| {
                let turn = self.wave_number * w.direction.dot(place);
                let off = 0.5 * self.wave_number * w.size * (place - w.landing);
                let share = |t: f64| {
                    if t.abs() > 1e-4 {
                        libm::sin(t) / t
                    } else {
                        1.0
                    }
                };
                amplitude(w) * share(off.x) * share(off.y) * phasor(w.phase + turn)
            });
            field.sum::<DVec2>().length_squared()
        };
        // The peak may be a pitch away from the brightest point of the grid.
        let mut step = pitch;
        for _ in 0..12 {
            for axis in [DVec2::X, DVec2::Y] {
                let [a, b, c] = [-1.0, 0.0, 1.0].map(|s| at(place + s * step * axis));
                let bend = a - 2.0 * b + c;
                let turn = match bend < 0.0 {
                    true => (0.5 * (a - c) / bend).clamp(-1.0, 1.0),
                    false => (c - a).signum(),
                };
                if at(place + turn * step * axis) > b {
                    place += turn * step * axis;
                }
            }
            step *= 0.6;
        }
        (at(place) / (perfect * perfect)).min(1.0)
    }

    /// The change of the direction cosine along an axis from one cell to the next: the slope of the
    /// regression line through all cells.
    fn cosine_step(&self, axis: usize) -> f64 {
        let place = |i: usize| match axis {
            0 => (i % self.grid) as f64,
            _ => (i / self.grid) as f64,
        };
        let all = || {
            let cells = self.cells.iter().enumerate();
            cells.filter_map(|(i, cell)| {
                let wave = cell.as_ref().filter(|w| w.open > 0.0)?;
                Some(DVec2::new(place(i), wave.direction[axis]))
            })
        };
        let mean = all().sum::<DVec2>() / all().count() as f64;
        let (xy, xx) = all().fold((0.0, 0.0), |(xy, xx), p| {
            let off = p - mean;
            (xy + off.x * off.y, xx + off.x * off.x)
        });
        (xy / xx).abs()
    }
}

/// Complex numbers. Their parts are separate so that many are computed at once. They have single
/// precision: the error of the sum of 1e5 waves is 1e-4 of the peak's amplitude, or 1e-8 of its
/// intensity.
#[derive(Clone, Debug, Default)]
struct WaveField {
    real: Vec<f32>,
    imaginary: Vec<f32>,
}

impl WaveField {
    /// A square of zeros.
    fn dark(side: usize) -> Self {
        let zeros = vec![0.0; side * side];
        Self {
            real: zeros.clone(),
            imaginary: zeros,
        }
    }

    /// Adds the outer product of two lines, along x and along y, times a factor.
    fn add(&mut self, factor: DVec2, xs: &Self, ys: &Self) {
        let side = xs.real.len();
        let rows = self.real.chunks_mut(side);
        for (j, (real, imaginary)) in rows.zip(self.imaginary.chunks_mut(side)).enumerate() {
            let y = DVec2::new(ys.real[j].into(), ys.imaginary[j].into());
            let lead = factor.rotate(y).as_vec2();
            let xs = xs.real.iter().zip(&xs.imaginary);
            for ((re, im), (x, y)) in real.iter_mut().zip(imaginary).zip(xs) {
                *re += lead.x * x - lead.y * y;
                *im += lead.x * y + lead.y * x;
            }
        }
    }
}

/// The share of a cell at the edge of the pupil that gets through.
fn open_share(lens: &Lens, beam: &Beam<'_>, corner: DVec2, step: DVec2) -> f64 {
    let share = |k: u32| (f64::from(k) + 0.5) / f64::from(PARTS);
    let parts = (0..PARTS).flat_map(|j| (0..PARTS).map(move |i| DVec2::new(share(i), share(j))));
    let parts: Vec<DVec2> = parts.map(|part| corner + part * step).collect();
    let passed = beam.passing(lens, &parts).into_iter().filter(|p| *p);
    passed.count() as f64 / f64::from(PARTS * PARTS)
}

/// The complex number of absolute value 1 with an angle in radians.
fn phasor(angle: f64) -> DVec2 {
    let (sin, cos) = libm::sincos(angle);
    DVec2::new(cos, sin)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prescription::{Curvature, Iris, Medium, Prescription, Shape, Surface};

    const NM: f64 = 550.0;

    /// A plane and a hyperboloid: a point at infinity on the axis has a perfect image (Descartes).
    fn perfect(f_number: f64, iris: Iris) -> Lens {
        let glass = Medium::constant(1.5);
        let stop = Surface::stop(1.0, Medium::air(), 25.0 / f_number);
        let plane = Surface::sphere(0.0, 10.0, glass, 30.0);
        let mut last = Surface::sphere(-25.0, 0.0, Medium::air(), 30.0);
        last.shape = Shape::Conic { k: -2.25 };
        last.curvature = Curvature::from_radius(-25.0);
        let mut prescription = Prescription::new("perfect", vec![stop, plane, last]);
        prescription.iris = iris;
        Lens::new(prescription).at_wavelength(NM)
    }

    fn waves(lens: &Lens, grid: usize) -> Wavefront {
        let film_z = lens.first_order().focal.unwrap().rear_focal_point;
        let beam = Beam::of(lens, 0.0, film_z, f64::INFINITY).unwrap();
        let open = Openings::of(lens, &beam, grid);
        Wavefront::of(lens, &beam, &open, film_z * DVec3::Z).unwrap()
    }

    /// 2 J₁(v)/v.
    fn jinc(v: f64) -> f64 {
        if v == 0.0 { 1.0 } else { 2.0 * libm::j1(v) / v }
    }

    /// The intensity of the image by a circular pupil with a central obstruction, which is a share
    /// of its radius (Born and Wolf, 8.6.2). Its integral is 1.
    fn annular(radius: f64, cosine: f64, obstruction: f64) -> f64 {
        let k = TAU / (NM * 1e-6);
        let e = obstruction * obstruction;
        let v = k * cosine * radius;
        let field = jinc(v) - e * jinc(obstruction * v);
        k * k * cosine * cosine / (2.0 * TAU * (1.0 - e)) * field * field
    }

    /// The point spread along a line from its peak.
    fn profile(waves: &Wavefront, pitch: f64) -> Vec<f64> {
        const SIDE: usize = 121;
        let spread = waves.point_spread(SIDE, pitch);
        spread[SIDE * (SIDE / 2) + SIDE / 2..][..=SIDE / 2].to_vec()
    }

    fn rim_sine(lens: &Lens, height: f64) -> f64 {
        let ray =
            crate::lens::LensRay::new(DVec3::new(0.0, height * (1.0 - 1e-12), -10.0), DVec3::Z);
        -lens.trace_from_scene(&ray).unwrap().direction.y
    }

    #[test]
    fn a_clear_circular_pupil_makes_the_airy_pattern() {
        for f_number in [8.0, 22.0] {
            let lens = perfect(f_number, Iris::Round);
            let cosine = 1.0 / (2.0 * f_number);
            let airy = 0.609_83 * NM * 1e-6 / cosine;
            let pitch = airy / 24.0;
            let line = profile(&waves(&lens, 96), pitch);
            // The pattern is that of the rim's ray as it leaves the lens.
            let sine = rim_sine(&lens, 25.0 / f_number);
            let peak = annular(0.0, sine, 0.0);
            assert!(
                (line[0] / peak - 1.0).abs() < 0.01,
                "f/{f_number}: {}",
                line[0] / peak
            );
            let dark = (1..36)
                .min_by(|a, b| line[*a].total_cmp(&line[*b]))
                .unwrap();
            let (a, b, c) = (line[dark - 1], line[dark], line[dark + 1]);
            // The vertex of the parabola through three points.
            let zero = pitch * (dark as f64 + 0.5 * (a - c) / (a - 2.0 * b + c));
            let expected = 0.609_83 * NM * 1e-6 / sine;
            assert!(
                (zero / expected - 1.0).abs() < 0.01,
                "f/{f_number}: {zero} {expected}"
            );
            for (i, value) in line.iter().enumerate() {
                let exact = annular(pitch * i as f64, sine, 0.0);
                assert!(
                    (value - exact).abs() < 0.01 * peak,
                    "f/{f_number} at {i}: {value} {exact}"
                );
            }
        }
    }

    /// A shift of the reference only shifts the image, and the peak is found wherever it is.
    #[test]
    fn the_strehl_ratio_does_not_depend_on_the_point_of_reference() {
        let lens = Lens::named("biotar").unwrap().at_f_number(8.0).unwrap();
        let film_z = lens.first_order().focal.unwrap().rear_focal_point;
        let beam = Beam::of(&lens, 10.0, film_z, f64::INFINITY).unwrap();
        let open = Openings::of(&lens, &beam, 64);
        let strehl = |x: f64, y: f64| {
            let image = DVec3::new(x, 10.0 + y, film_z);
            Wavefront::of(&lens, &beam, &open, image).unwrap().strehl()
        };
        let shifts = [
            [0.0, -1e-3],
            [0.7e-3, 1.3e-3],
            [2e-3, -2.9e-3],
            [-5e-3, 4e-3],
        ];
        let center = strehl(0.0, 0.0);
        for [x, y] in shifts {
            let shifted = strehl(x, y);
            assert!(
                (shifted - center).abs() < 1e-3,
                "{shifted} {center} {x} {y}"
            );
        }
    }

    /// A perfect lens of f/10 whose pupil is a ring with this share of its radius closed.
    fn ring_lens(closed: f64) -> Lens {
        // The outline runs along a circle, and back along a smaller one.
        let ring = |radius: f64, sense: f64| {
            (0..=180).map(move |i| {
                let (sin, cos) = libm::sincos(sense * TAU * f64::from(i) / 180.0);
                [radius * cos, radius * sin]
            })
        };
        let iris = Iris::Outline {
            corners: ring(0.999, 1.0).chain(ring(closed, -1.0)).collect(),
            rotation: 0.0,
        };
        perfect(10.0, iris)
    }

    /// The area that two circles have in common.
    fn common_area(a: f64, b: f64, apart: f64) -> f64 {
        let (small, large) = (a.min(b), a.max(b));
        if apart >= a + b {
            return 0.0;
        }
        if apart <= large - small {
            return 0.5 * TAU * small * small;
        }
        let segment = |r: f64, chord: f64| {
            r * r * libm::acos(chord / r) - chord * (r * r - chord * chord).sqrt()
        };
        let chord = (apart * apart + a * a - b * b) / (2.0 * apart);
        segment(a, chord) + segment(b, apart - chord)
    }

    /// The modulation of a ring is the area that it has in common with itself, shifted.
    #[test]
    fn the_modulation_of_a_ring_is_the_autocorrelation_of_its_area() {
        // The cells of a thin ring are as wide as a sixth of it.
        for (closed, bound) in [(1e-3, 0.003), (0.3, 0.004), (0.6, 0.005), (0.8, 0.01)] {
            let lens = ring_lens(closed);
            let waves = waves(&lens, 64);
            let sine = rim_sine(&lens, 0.9989 * 2.5);
            let closed = closed / 0.999;
            let ideal = |apart: f64| {
                let [whole, mixed, inner] = [(1.0, 1.0), (1.0, closed), (closed, closed)]
                    .map(|(a, b)| common_area(a, b, apart));
                (whole - 2.0 * mixed + inner) / (0.5 * TAU * (1.0 - closed * closed))
            };
            assert_eq!(waves.transfer(0.0, 0), DVec2::X);
            for apart in [0.01, 0.03, 0.1, 0.2, 0.5, 1.0, 1.5] {
                let found = waves.transfer(apart * sine / (NM * 1e-6), 0).length();
                let exact = ideal(apart);
                let off = (found - exact).abs();
                assert!(off < bound, "{closed} {apart}: {found} {exact}");
            }
        }
    }

    #[test]
    fn an_obstructed_pupil_makes_the_annular_pattern() {
        let lens = ring_lens(0.5);
        let sine = rim_sine(&lens, 0.9989 * 2.5);
        let peak = annular(0.0, sine, 0.5 / 0.999);
        let pitch = 0.2e-3;
        for (i, value) in profile(&waves(&lens, 112), pitch).iter().enumerate() {
            let exact = annular(pitch * i as f64, sine, 0.5 / 0.999);
            assert!((value - exact).abs() < 0.01 * peak, "{i}: {value} {exact}");
        }
    }

    /// The intensity of the image by a uniform pupil with straight edges, whose integral is 1. By
    /// Gauss's theorem the field is a sum over the edges. `q` is the wave number times the place.
    fn polygon_light(corners: &[DVec2], q: DVec2, wave_number: f64) -> f64 {
        let mut field = DVec2::ZERO;
        for (i, a) in corners.iter().enumerate() {
            let edge = corners[(i + 1) % corners.len()] - *a;
            let t = 0.5 * q.dot(edge);
            let along = if t == 0.0 { 1.0 } else { libm::sin(t) / t };
            field += q.perp_dot(edge) * along * phasor(q.dot(*a + 0.5 * edge));
        }
        let area = crate::lens::analysis::beam::polygon_area(corners);
        let scale = wave_number / (TAU * q.length_squared());
        scale * scale * field.length_squared() / area
    }

    /// The edges of opposite blades diffract light perpendicular to them: a hexagon has six rays.
    /// Along them and between them the light agrees with the integral over a hexagon within 2%.
    #[test]
    fn straight_blades_make_the_rays_of_their_polygon() {
        let iris = Iris::Blades {
            count: 6,
            rotation: 0.0,
        };
        let lens = perfect(16.0, iris);
        // A line upward crosses an edge at √3/2 of the corners' distance.
        let edge = 0.75f64.sqrt();
        let sine = rim_sine(&lens, 25.0 / 16.0 * edge) / edge;
        let corner = |i: u32| phasor(TAU * f64::from(i) / 6.0) * sine;
        let corners: Vec<DVec2> = (0..6).map(corner).collect();
        let waves = waves(&lens, 96);
        const SIDE: usize = 101;
        let pitch = 1.5e-3;
        let k = TAU / (NM * 1e-6);
        let spread = waves.point_spread(SIDE, pitch);
        let along = |degrees: f64| -> [f64; 2] {
            let (sin, cos) = libm::sincos(degrees.to_radians());
            let mut sums = [0.0; 2];
            for r in 12..46 {
                let place = |v: f64| (v * f64::from(r)).round();
                let (x, y) = (place(cos), place(sin));
                let at = |v: f64| (v as isize + SIDE as isize / 2) as usize;
                sums[0] += spread[at(y) * SIDE + at(x)];
                sums[1] += polygon_light(&corners, k * pitch * DVec2::new(x, y), k);
            }
            sums
        };
        // Corners on ±x, so edges face 30, 90 and 150 degrees.
        for degrees in [0.0, 30.0, 60.0, 90.0, 45.0] {
            let [computed, exact] = along(degrees);
            assert!(
                (computed / exact - 1.0).abs() < 0.02,
                "{degrees}: {computed} {exact}"
            );
        }
    }

    /// With ten waves of defocus the light fills the cone of the rays evenly, a disc whose radius
    /// is 4 λ N for each wave, and nothing else of a square three times as wide. A grid of plane
    /// waves that is too coarse for that square repeats the disc in it.
    #[test]
    fn a_blurred_image_has_no_copies_beside_it() {
        let (f_number, waves_out) = (10.0, 10.0);
        let airy = NM * 1e-6 * f_number;
        let lens = perfect(f_number, Iris::Round);
        let film_z =
            lens.first_order().focal.unwrap().rear_focal_point + waves_out * 8.0 * airy * f_number;
        let beam = Beam::of(&lens, 0.0, film_z, f64::INFINITY).unwrap();
        let grid = Wavefront::cells_needed(&lens, &beam, film_z);
        assert!((16..64).contains(&grid), "{grid}");
        let open = Openings::of(&lens, &beam, 64);
        let waves = Wavefront::of(&lens, &beam, &open, film_z * DVec3::Z).unwrap();
        let disc = 4.0 * airy * waves_out;
        let (side, pitch) = (240, 0.5 * airy);
        let mut rings = [0.0; 3];
        for (k, light) in waves.point_spread(side, pitch).iter().enumerate() {
            let at = |i: usize| (i as f64 - 0.5 * (side as f64 - 1.0)) * pitch;
            let r = DVec2::new(at(k % side), at(k / side)).length();
            let ring = if r < 0.5 * disc {
                0
            } else if r < disc + 6.0 * airy {
                1
            } else {
                2
            };
            rings[ring] += light * pitch * pitch;
        }
        assert!((rings[0] - 0.25).abs() < 0.02, "{rings:?}");
        // The rim diffracts 1 to 2% of the light beyond six Airy radii.
        assert!((rings[0] + rings[1] - 1.0).abs() < 0.03, "{rings:?}");
        assert!(rings[2] < 0.02, "{rings:?}");
    }

    #[test]
    fn a_point_spread_contains_all_light_and_defocus_moves_it_out_of_the_middle() {
        let lens = perfect(10.0, Iris::Round);
        let sharp = waves(&lens, 96);
        let (side, pitch) = (120, 1.2e-3);
        let whole = |w: &Wavefront| -> f64 {
            let spread = w.point_spread(side, pitch);
            spread.iter().sum::<f64>() * pitch * pitch
        };
        assert!((whole(&sharp) - 1.0).abs() < 0.03, "{}", whole(&sharp));
        // One wave of defocus is 8 λ N², for which the intensity in the middle is 0: sinc²(π).
        let film_z = lens.first_order().focal.unwrap().rear_focal_point + 8.0 * NM * 1e-6 * 100.0;
        let beam = Beam::of(&lens, 0.0, film_z, f64::INFINITY).unwrap();
        let open = Openings::of(&lens, &beam, 96);
        let blurred = Wavefront::of(&lens, &beam, &open, film_z * DVec3::Z).unwrap();
        let [a, b] = [&sharp, &blurred].map(|w| w.point_spread(1, pitch)[0]);
        assert!(b < 0.01 * a, "{a} {b}");
    }
}
