//! Diffraction: spreads the light of an exposed film by the diffraction pattern of the pupil.
//!
//! The film is exposed by rays. The light at each place is then convolved with the diffraction
//! pattern of the pupil as seen from there, with iris blades and vignetting, for each wavelength.
//! The pattern is that of an aberration-free lens: aberrations and defocus blur are in the picture
//! already, from the rays. The result is accurate where one of the two, diffraction or ray blur, is
//! much larger than the other. Where they are alike, it adds their extents and has no interference
//! between them; [`ivcam_optics::lens::analysis::diffraction`] computes the exact spread of one
//! point.
//!
//! Patterns are computed at a few places of the film and interpolated between them. They end
//! where the grid of directions repeats itself, 128 Airy radii from the center, and are normalized
//! so that the light beyond is not lost. Beside the film no light is known: each pixel is divided
//! by what the pattern collects there of an even field on the film, so an even field stays even.

use std::time::{Duration, Instant};

use glam::{DMat3, DVec2, DVec3};
use ivcam_base::math::fourier::{times, transform_square};
use ivcam_base::work::StopSignal;
use ivcam_optics::film::{ErrorEstimate, ErrorUnknown, Exposed, Film, Resolution};
use ivcam_optics::lens::{Bundle, LANES, LensRay, PupilWindow};
use ivcam_optics::spectrum::Spectrum;
use rayon::prelude::*;

use crate::camera::LensCamera;

/// The numbers of places across and down the film where the pupil is sampled. No search is
/// recorded: the time grows with their product, and between the places the patterns are mixed
/// linearly.
const PLACES: [usize; 2] = [5, 4];
/// Directions across the pupil and along it.
const DIRECTIONS: usize = 256;
/// The largest and the smallest side of the transform. Between them, the pattern is as fine as the
/// pixels; the largest bounds memory and time.
const FINEST: usize = 2048;
const COARSEST: usize = 512;
/// The largest reach of a pattern in pixels. It bounds the time of the convolution.
const MOST_PIXELS: usize = 96;
/// The range of wavelengths in nm, sampled every 20 nm.
const FIRST: i32 = 400;
const LAST: i32 = 700;

/// Returns the error of a film after diffraction, from that of its rays. It is unknown: the
/// patterns mix the noise of pixels.
pub fn error_of_diffracted(
    rays: Result<ErrorEstimate, ErrorUnknown>,
) -> Result<ErrorEstimate, ErrorUnknown> {
    match rays {
        Ok(error) if error != ErrorEstimate::EXACT => Err(ErrorUnknown::Diffracted {
            rays: error.relative_rmse,
        }),
        exact_or_unknown => exact_or_unknown,
    }
}

/// Returns the film with diffraction. Only the pixels' means change; the error estimate remains
/// that of the rays.
///
/// Returns none if `stop` is set before the end.
pub fn diffract(film: &Film, camera: &LensCamera, stop: &StopSignal) -> Option<Film> {
    let size = film.resolution;
    let colors = colors();
    let places: Vec<(usize, usize)> = (0..PLACES[1])
        .flat_map(|j| (0..PLACES[0]).map(move |i| (i, j)))
        .collect();
    let parts: Vec<(PixelBox, Vec<DVec3>)> = places
        .par_iter()
        .map(|&(i, j)| spread_part((film, camera, stop), &colors, i, j))
        .collect::<Option<_>>()?;
    let mut out = film.clone();
    out.pixels.iter_mut().for_each(|p| p.mean = DVec3::ZERO);
    // Places are added in a fixed order, so that any number of threads gives the same bits.
    for (part, values) in parts {
        let mut values = values.into_iter();
        for y in part.y0..part.y1 {
            for x in part.x0..part.x1 {
                let pixel = &mut out.pixels[y * size.width as usize + x];
                pixel.mean += values.next().unwrap_or_default();
            }
        }
    }
    Some(out)
}

/// Returns about how long [`diffract`] takes on rayon's current pool for a film of a size, from the
/// time that the place in the middle takes.
pub fn diffraction_time(size: Resolution, camera: &LensCamera, stop: &StopSignal) -> Duration {
    let start = Instant::now();
    let film = Film::new(size);
    let [across, down] = PLACES;
    spread_part((&film, camera, stop), &colors(), across / 2, down / 2);
    let rounds = (across * down).div_ceil(rayon::current_num_threads());
    start.elapsed() * rounds as u32
}

/// Returns the memory in bytes that diffraction of a film of a size takes at most: a copy of the
/// film, the parts around all places, and on each thread the fields of one part.
pub fn diffraction_bytes(size: Resolution) -> u64 {
    let [width, height] = [size.width, size.height].map(u64::from);
    let reach = 2 * MOST_PIXELS as u64;
    // A place has a weight up to its neighbors on both sides.
    let part = [2 * width / PLACES[0] as u64, 2 * height / PLACES[1] as u64].map(|n| n + reach);
    let side = part[0].max(part[1]).next_power_of_two().max(FINEST as u64);
    let places = (PLACES[0] * PLACES[1]) as u64;
    let threads = (rayon::current_num_threads() as u64).min(places);
    let copy = width * height * size_of::<Exposed>() as u64;
    let parts = places * part[0] * part[1] * size_of::<DVec3>() as u64;
    // Three fields of light, their spectra of one color, and the pattern.
    let fields = 8 * side * side * size_of::<DVec2>() as u64;
    copy + parts + threads * fields
}

/// The pixels in columns `x0..x1` and rows `y0..y1` of the picture.
#[derive(Clone, Copy, Debug)]
struct PixelBox {
    x0: usize,
    x1: usize,
    y0: usize,
    y1: usize,
}

/// Returns each wavelength in nm with its contribution to red, green and blue. The sum of the
/// matrices is the identity, so that white stays white.
fn colors() -> Vec<(f64, DMat3)> {
    let spectrum = Spectrum::default();
    let lines: Vec<(f64, DMat3)> = (FIRST..=LAST)
        .step_by(20)
        .map(|nm| (f64::from(nm), spectrum.color(f64::from(nm))))
        .collect();
    let whole = lines.iter().fold(DMat3::ZERO, |sum, (_, m)| sum + *m);
    let back = whole.inverse();
    lines.into_iter().map(|(nm, m)| (nm, m * back)).collect()
}

/// Returns the weight of a place's pattern for a pixel along one axis, by linear interpolation
/// between places.
fn share(pixel: usize, count: u32, place: usize, places: usize) -> f64 {
    let at = (pixel as f64 + 0.5) / f64::from(count) * places as f64 - 0.5;
    let at = at.clamp(0.0, (places - 1) as f64);
    (1.0 - (at - place as f64).abs()).max(0.0)
}

/// Returns the light of the pixels around place (i, j), spread by the pattern there.
fn spread_part(
    (film, camera, stop): (&Film, &LensCamera, &StopSignal),
    colors: &[(f64, DMat3)],
    i: usize,
    j: usize,
) -> Option<(PixelBox, Vec<DVec3>)> {
    // A transform of the largest field takes about half a second, a color of a pattern a tenth.
    let proceed = || (!stop.is_set()).then_some(());
    proceed()?;
    let Resolution { width, height } = film.resolution;
    let at = |k: usize, n: usize| (k as f64 + 0.5) / n as f64;
    let pitch = DVec2::new(
        camera.format.width / f64::from(width),
        camera.format.height / f64::from(height),
    );
    let place = camera.film_point(at(i, PLACES[0]), at(j, PLACES[1]));
    let pattern = match SampledPupil::seen_from(camera, place) {
        Some(pupil) => pupil.pattern(pitch, colors, &proceed)?,
        None => Pattern::point(),
    };
    // The pixels that the place has a weight for.
    let span = |count: u32, place: usize, places: usize| {
        let mut all = (0..count as usize).filter(|p| share(*p, count, place, places) > 0.0);
        let first = all.next().unwrap_or(0);
        (first, all.next_back().unwrap_or(first) + 1)
    };
    let (x0, x1) = span(width, i, PLACES[0]);
    let (y0, y1) = span(height, j, PLACES[1]);
    let value = |x: usize, y: usize| {
        let weight = share(x, width, i, PLACES[0]) * share(y, height, j, PLACES[1]);
        film.pixels[y * width as usize + x].mean * weight
    };
    let reach = pattern.reach;
    let to = PixelBox {
        x0: x0.saturating_sub(reach),
        x1: (x1 + reach).min(width as usize),
        y0: y0.saturating_sub(reach),
        y1: (y1 + reach).min(height as usize),
    };
    let side = (x1 - x0).max(y1 - y0) + 2 * reach;
    let side = side.next_power_of_two();
    let channel = |c: usize| {
        let mut field = vec![DVec2::ZERO; side * side];
        for y in y0..y1 {
            for x in x0..x1 {
                field[(y - y0 + reach) * side + x - x0 + reach].x = value(x, y)[c];
            }
        }
        proceed()?;
        transform_square(&mut field, side, -1.0);
        Some(field)
    };
    let light = [channel(0)?, channel(1)?, channel(2)?];
    let spread = |out: usize| pattern.spread(&light, side, out, &proceed);
    let spread = [spread(0)?, spread(1)?, spread(2)?];
    let inside = SharesInside::of(&pattern, film.resolution);
    let mut values = Vec::new();
    for y in to.y0..to.y1 {
        for x in to.x0..to.x1 {
            // The field begins `reach` pixels before the part.
            let k = (y + reach - y0) * side + x + reach - x0;
            let value = DVec3::new(spread[0][k], spread[1][k], spread[2][k]);
            values.push(
                inside
                    .at(x, y)
                    .map_or(value, |share| share.inverse() * value),
            );
        }
    }
    Some((to, values))
}

/// The directions from which light reaches a place of the film, on a grid of direction cosines.
struct SampledPupil {
    /// Whether the lens passes light, row by row.
    open: Vec<bool>,
    /// The difference between neighboring direction cosines.
    step: f64,
}

impl SampledPupil {
    /// Traces a grid of directions from a film point. Returns `None` if the lens passes no light.
    fn seen_from(camera: &LensCamera, film: DVec2) -> Option<Self> {
        let place = camera.place();
        let origin = place.point(film);
        let [across, along] = place.across();
        let toward = across.cross(along);
        let cosines = |aim: DVec2| {
            let d = (aim.extend(camera.lens.length()) - origin).normalize();
            DVec2::new(d.dot(across), d.dot(along))
        };
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let mut include = |aim: DVec2| {
            let c = cosines(aim);
            (low, high) = (low.min(c), high.max(c));
        };
        match camera.window(film) {
            PupilWindow::Polygon(polygon) => polygon.corners().for_each(&mut include),
            PupilWindow::Disc { radius, .. } | PupilWindow::Defensive(_, radius) => (0..32)
                .for_each(|k| {
                    let (sin, cos) = libm::sincos(std::f64::consts::TAU * f64::from(k) / 32.0);
                    include(radius * DVec2::new(cos, sin));
                }),
            PupilWindow::Closed => return None,
        }
        let step = (high - low).max_element() / DIRECTIONS as f64;
        let first = 0.5 * (low + high) - 0.5 * step * (DIRECTIONS - 1) as f64;
        let mut open = Vec::with_capacity(DIRECTIONS * DIRECTIONS);
        let mut bundle = Bundle::default();
        for j in 0..DIRECTIONS {
            for chunk in 0..DIRECTIONS / LANES {
                for lane in 0..LANES {
                    let i = chunk * LANES + lane;
                    let c = first + step * DVec2::new(i as f64, j as f64);
                    let depth = (1.0 - c.length_squared()).max(0.0).sqrt();
                    let direction = c.x * across + c.y * along - depth * toward;
                    bundle.set(lane, &LensRay { origin, direction });
                }
                camera.lens.trace_bundle_from_film(&mut bundle);
                open.extend((0..LANES).map(|lane| bundle.passed(lane)));
            }
        }
        (step > 0.0 && open.contains(&true)).then_some(Self { open, step })
    }

    /// Returns the diffraction pattern on pixels of a pitch in millimeters; none if `proceed` ends
    /// the work.
    fn pattern(
        &self,
        pitch: DVec2,
        colors: &[(f64, DMat3)],
        proceed: &dyn Fn() -> Option<()>,
    ) -> Option<Pattern> {
        let mm = |nm: f64| nm * 1e-6;
        let finest = 2.0 * mm(f64::from(LAST)) / (self.step * pitch.min_element());
        let side = (finest.min(FINEST as f64) as usize).clamp(COARSEST, FINEST);
        let side = side.next_power_of_two();
        let mut field = vec![DVec2::ZERO; side * side];
        for (k, _) in self.open.iter().enumerate().filter(|(_, open)| **open) {
            field[k / DIRECTIONS * side + k % DIRECTIONS].x = 1.0;
        }
        transform_square(&mut field, side, -1.0);
        let total: f64 = field.iter().map(|u| u.length_squared()).sum();
        let light: Vec<f64> = field.iter().map(|u| u.length_squared() / total).collect();
        // The pattern repeats itself after λ / step millimeters at a distance of 1 mm.
        let period = mm(f64::from(FIRST)) / self.step;
        let reach = (0.5 * period / pitch.min_element()) as usize;
        let mut pattern = Pattern::dark(reach.clamp(1, MOST_PIXELS));
        for (nm, color) in colors {
            proceed()?;
            let taps = self.taps(&light, side, mm(*nm), pitch, pattern.reach);
            for (sum, tap) in pattern.taps.iter_mut().zip(taps) {
                *sum += *color * tap;
            }
        }
        Some(pattern)
    }

    /// Returns the share of a pixel's light of one wavelength (mm) that each pixel around it
    /// receives. The pixel is evenly lit, so every point of the pattern is divided among the four
    /// pixels around it.
    fn taps(
        &self,
        light: &[f64],
        side: usize,
        wavelength: f64,
        pitch: DVec2,
        reach: usize,
    ) -> Vec<f64> {
        let fine = wavelength / (self.step * side as f64);
        let signed = |k: usize| k as f64 - if 2 * k >= side { side as f64 } else { 0.0 };
        let count = 2 * reach + 1;
        let mut taps = vec![0.0; count * count];
        // The pixel that a line of the pattern falls on, and the share of the next one.
        let split = |k: usize, pitch: f64| {
            let at = signed(k) * fine / pitch + reach as f64;
            let first = at.floor();
            let inside = first >= 0.0 && first + 1.0 < count as f64;
            inside.then_some((first as usize, at - first))
        };
        let columns: Vec<_> = (0..side).map(|k| split(k, pitch.x)).collect();
        for (row, y) in (0..side).filter_map(|k| Some((k, split(k, pitch.y)?))) {
            for (x, value) in columns.iter().zip(&light[row * side..]) {
                let Some((i, a)) = *x else { continue };
                let (at, b) = (y.0 * count + i, y.1);
                taps[at] += value * (1.0 - a) * (1.0 - b);
                taps[at + 1] += value * a * (1.0 - b);
                taps[at + count] += value * (1.0 - a) * b;
                taps[at + count + 1] += value * a * b;
            }
        }
        let kept: f64 = taps.iter().sum();
        taps.iter().map(|tap| tap / kept).collect()
    }
}

/// A convolution kernel: the color that each pixel receives from one at the center.
struct Pattern {
    /// Pixels from the center to the edge.
    reach: usize,
    /// (2 reach + 1)² matrices of colors, row by row.
    taps: Vec<DMat3>,
}

impl Pattern {
    /// Returns a kernel of zeros.
    fn dark(reach: usize) -> Self {
        let count = 2 * reach + 1;
        Self {
            reach,
            taps: vec![DMat3::ZERO; count * count],
        }
    }

    /// Returns the kernel that changes nothing.
    fn point() -> Self {
        Self {
            reach: 0,
            taps: vec![DMat3::IDENTITY],
        }
    }

    /// Returns one channel of the convolved light, from the transforms of all three channels; none
    /// if `proceed` ends the work.
    fn spread(
        &self,
        light: &[Vec<DVec2>; 3],
        side: usize,
        out: usize,
        proceed: &dyn Fn() -> Option<()>,
    ) -> Option<Vec<f64>> {
        let count = 2 * self.reach + 1;
        let mut sum = vec![DVec2::ZERO; side * side];
        for (from, light) in light.iter().enumerate() {
            let mut field = vec![DVec2::ZERO; side * side];
            for (k, tap) in self.taps.iter().enumerate() {
                // A negative offset wraps around to the far end.
                let wrapped = |k: usize| (k + side - self.reach) % side;
                field[wrapped(k / count) * side + wrapped(k % count)].x = tap.col(from)[out];
            }
            proceed()?;
            transform_square(&mut field, side, -1.0);
            for (sum, (a, b)) in sum.iter_mut().zip(light.iter().zip(&field)) {
                *sum += times(*a, *b);
            }
        }
        transform_square(&mut sum, side, 1.0);
        let scale = 1.0 / (side * side) as f64;
        Some(sum.iter().map(|v| v.x * scale).collect())
    }
}

/// What a pattern collects at each pixel of an even field that ends at the edges of the film.
struct SharesInside {
    reach: usize,
    size: [usize; 2],
    /// Sums of the taps in the rows and columns before, with a row and a column of zeros at first.
    sums: Vec<DMat3>,
}

impl SharesInside {
    fn of(pattern: &Pattern, film: Resolution) -> Self {
        let side = 2 * pattern.reach + 2;
        let mut sums = vec![DMat3::ZERO; side * side];
        for (k, tap) in pattern.taps.iter().enumerate() {
            let at = (k / (side - 1) + 1) * side + k % (side - 1) + 1;
            sums[at] = *tap + sums[at - 1] + sums[at - side] - sums[at - side - 1];
        }
        Self {
            reach: pattern.reach,
            size: [film.width as usize, film.height as usize],
            sums,
        }
    }

    /// Returns the share for each color at a pixel; none where the whole pattern is on the film.
    fn at(&self, x: usize, y: usize) -> Option<DMat3> {
        let side = 2 * self.reach + 2;
        // Tap k brings the light of the pixel k - reach before this one.
        let taps = |at: usize, size: usize| {
            let first = (at + self.reach + 1).saturating_sub(size);
            [first, (at + self.reach + 1).min(side - 1)]
        };
        let [[x0, x1], [y0, y1]] = [taps(x, self.size[0]), taps(y, self.size[1])];
        let sum = |x: usize, y: usize| self.sums[y * side + x];
        ([x0, y0, x1, y1] != [0, 0, side - 1, side - 1])
            .then(|| sum(x1, y1) - sum(x0, y1) - sum(x1, y0) + sum(x0, y0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Aim;
    use ivcam_base::math::Meters;
    use ivcam_inventor::pose::CameraPose;
    use ivcam_optics::film::FilmFormat;
    use ivcam_optics::lens::{FocusMethod, Iris, Lens};

    fn camera(f_number: f64, iris: Iris, film: [f64; 2]) -> LensCamera {
        camera_of("cooke-triplet", f_number, iris, film)
    }

    fn camera_of(lens: &str, f_number: f64, iris: Iris, film: [f64; 2]) -> LensCamera {
        let lens = Lens::named(lens).unwrap();
        let lens = lens.at_f_number(f_number).unwrap().with_iris(iris);
        let focus = lens
            .focus(FocusMethod::Film, Meters(f64::INFINITY))
            .unwrap();
        let format = FilmFormat {
            width: film[0],
            height: film[1],
        };
        let pose = CameraPose::view_all(Default::default(), 1.5);
        LensCamera::new(lens, focus, format, Aim::ExitPupil, &pose)
    }

    /// Returns a film with one bright pixel in the middle.
    fn star(width: u32, height: u32) -> Film {
        let mut film = Film::new(Resolution::new(width, height).unwrap());
        let middle = (height / 2 * width + width / 2) as usize;
        film.pixels[middle].add(DVec3::ONE);
        film
    }

    #[test]
    fn white_stays_white_and_no_light_is_lost() {
        let camera = camera(16.0, Iris::Round, [0.36, 0.24]);
        let film = star(36, 24);
        let out = diffract(&film, &camera, &StopSignal::default()).unwrap();
        let sum: DVec3 = out.pixels.iter().map(|p| p.mean).sum();
        assert!((sum - DVec3::ONE).abs().max_element() < 0.03, "{sum}");
        let mut even = film.clone();
        even.pixels
            .iter_mut()
            .for_each(|p| p.mean = DVec3::new(0.2, 0.5, 0.3));
        let out = diffract(&even, &camera, &StopSignal::default()).unwrap();
        for (number, pixel) in out.pixels.iter().enumerate() {
            let off = (pixel.mean - DVec3::new(0.2, 0.5, 0.3)).length();
            assert!(off < 0.02, "{number}: {}", pixel.mean);
        }
    }

    /// Green is mostly light of 550 nm. The radius of the Airy disc's first dark ring is 1.22 λ N,
    /// and half of the disc's light is within 0.535 λ N (Born and Wolf, 8.5.2).
    #[test]
    fn a_star_at_f_22_is_an_airy_disc() {
        for name in ["cooke-triplet", "double-gauss"] {
            check_airy_disc(name);
        }
    }

    fn check_airy_disc(name: &str) {
        let camera = camera_of(name, 22.0, Iris::Round, [0.288, 0.192]);
        let pixel = 0.001;
        // The whole pattern is on the film.
        let out = diffract(&star(288, 192), &camera, &StopSignal::default()).unwrap();
        let radius = |k: usize| {
            let (x, y) = ((k % 288) as f64 - 144.0, (k / 288) as f64 - 96.0);
            pixel * (x * x + y * y).sqrt()
        };
        let airy = 0.55e-3 * 22.0;
        let within = |r: f64| -> f64 {
            let near = out
                .pixels
                .iter()
                .enumerate()
                .filter(|(k, _)| radius(*k) < r);
            near.map(|(_, p)| p.mean.y).sum()
        };
        let half = within(0.535 * airy);
        assert!((half - 0.5).abs() < 0.06, "{name}: {half}");
        let disc = within(1.22 * airy);
        assert!((disc - 0.838).abs() < 0.06, "{name}: {disc}");
    }

    #[test]
    fn six_blades_make_a_star_of_six_points() {
        let iris = Iris::Blades {
            count: 6,
            rotation: 0.0,
        };
        let camera = camera(22.0, iris, [0.9, 0.6]);
        let out = diffract(&star(90, 60), &camera, &StopSignal::default()).unwrap();
        // The iris has corners on ±x, so its edges face 30, 90 and 150 degrees, as the rays do.
        let at = |degrees: f64| -> f64 {
            let (sin, cos) = libm::sincos(degrees.to_radians());
            (8..20)
                .map(|r| {
                    let (x, y) = (45.0 + f64::from(r) * cos, 30.0 - f64::from(r) * sin);
                    out.pixels[y.round() as usize * 90 + x.round() as usize]
                        .mean
                        .y
                })
                .sum()
        };
        for (point, gap) in [(90.0, 60.0), (30.0, 0.0), (150.0, 120.0), (270.0, 240.0)] {
            assert!(at(point) > 3.0 * at(gap), "{} {}", at(point), at(gap));
        }
    }
}
