//! The data sheet of a lens: everything that its curves and tables show, computed from rays.
//!
//! Lengths are millimeters, heights are on the film; the object is at infinity. Where the lens is
//! not rotational the meridian of y is shown.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use serde::Serialize;

use super::about::About;
use super::first_order::Plane;
use super::glass::{C_LINE, D_LINE, F_LINE};
use super::trace::{LensRay, Toward};
use super::{Lens, RayPath};

/// Steps of the curves over the film's height.
const STEPS: usize = 20;
/// Rays across a beam, each way.
const GRID: usize = 64;
/// Points of the curves over frequency.
const FREQUENCIES: usize = 40;
/// Heights whose spots, modulation and pupils are shown, as shares of the full one.
const SHOWN: [f64; 4] = [0.0, 0.5, 0.7, 1.0];

/// The curves of a lens.
#[derive(Clone, Debug, Serialize)]
pub struct LensSheet {
    /// Where the film is, from the front vertex: best focus of the axis by real rays.
    pub film_z: f64,
    /// From the paraxial focus to there.
    pub focus_shift: f64,
    /// Half of the film's diagonal, and the angle that arrives there, in degrees.
    pub image_height: f64,
    pub half_field_degrees: f64,
    /// Distortion is against f tan θ, or f θ for fields past 120 degrees.
    pub projection: &'static str,
    /// Whether the glasses have indices at other lines than d.
    pub dispersive: bool,
    pub fields: Vec<FieldRow>,
    pub spherical: Vec<Zone>,
    pub color: Vec<ColorRow>,
    pub points: Vec<PointImage>,
    /// Line pairs a millimeter.
    pub frequencies: Vec<f64>,
}

/// What happens at a height on the film.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct FieldRow {
    pub height: f64,
    pub angle_degrees: f64,
    pub distortion_percent: Option<f64>,
    pub relative_illumination: f64,
    /// Where fans along and across the meridian focus, from the film.
    pub tangential_focus: Option<f64>,
    pub sagittal_focus: Option<f64>,
    /// How far the chief rays of the F and C lines are from that of the d line.
    pub lateral_f: Option<f64>,
    pub lateral_c: Option<f64>,
}

/// Where rays of a zone of the pupil cross the axis, from the film.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Zone {
    /// Over the height of the widest beam.
    pub pupil: f64,
    pub focus_f: Option<f64>,
    pub focus_d: Option<f64>,
    pub focus_c: Option<f64>,
}

/// The paraxial focus at a wavelength, from that of the d line.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ColorRow {
    pub wavelength_nm: f64,
    pub focus: f64,
}

/// The image of a point at infinity.
#[derive(Clone, Debug, Serialize)]
pub struct PointImage {
    pub height: f64,
    pub angle_degrees: f64,
    /// The root mean square radius at the d line.
    pub rms: f64,
    /// Where rays of the F, d and C lines arrive, from the centroid of the d line.
    #[serde(skip)]
    pub spots: [Vec<DVec2>; 3],
    /// The beam that gets through, seen along it, over the radius of the axial one.
    pub pupil: Vec<[f64; 2]>,
    /// Its area over that of the axial one.
    pub pupil_area: f64,
    /// Modulation over the sheet's frequencies, of lines across the meridian and along it; by
    /// rays alone, and with the wave.
    pub geometric: Modulation,
    pub diffraction: Modulation,
}

#[derive(Clone, Debug, Default, Serialize)]
pub struct Modulation {
    pub tangential: Vec<f64>,
    pub sagittal: Vec<f64>,
}

impl LensSheet {
    /// None for an afocal lens, or one that lets no light through.
    pub fn of(lens: &Lens) -> Option<Self> {
        let paraxial = lens.first_order().focal?.rear_focal_point;
        let film_z = lens.best_focus(f64::INFINITY).unwrap_or(paraxial);
        let about = About::of(lens.prescription());
        let image_height = full_height(lens, &about, film_z)?;
        let lines = [F_LINE, lens.wavelength(), C_LINE].map(|nm| lens.at_wavelength(nm));
        let half = angle_at(lens, image_height, film_z).unwrap_or(0.0);
        let projection = if half > 60f64.to_radians() {
            "f θ"
        } else {
            "f tan θ"
        };
        let mut this = Self {
            film_z,
            focus_shift: film_z - paraxial,
            image_height,
            half_field_degrees: half.to_degrees(),
            projection,
            dispersive: lens.prescription().is_dispersive(),
            fields: Vec::new(),
            spherical: zones(&lines, film_z),
            color: color(lens),
            points: Vec::new(),
            frequencies: frequencies(image_height),
        };
        this.fields = this.field_rows(lens, &lines);
        let beams: Vec<_> = SHOWN
            .iter()
            .filter_map(|share| Beam::of(lens, share * image_height, film_z))
            .collect();
        let axial = beams.first()?.outline_radius();
        this.points = beams
            .iter()
            .filter_map(|b| b.image(&lines, axial, &this))
            .collect();
        Some(this)
    }

    fn field_rows(&self, lens: &Lens, lines: &[Lens; 3]) -> Vec<FieldRow> {
        let center = lens.irradiance(DVec2::ZERO, self.film_z);
        let bent = |height: f64| {
            let distortion = lens.distortion(Plane::Y, height, self.film_z)?;
            let against = match self.projection {
                "f θ" => distortion.f_theta,
                _ => distortion.f_tan,
            };
            Some((distortion.angle, 1.0 + against))
        };
        // A film off the paraxial focus is a little larger as a whole: that is no distortion.
        let scale = bent(1e-4 * self.image_height).map_or(1.0, |(_, scale)| scale);
        let row = |i: usize| {
            let height = self.image_height * i as f64 / STEPS as f64;
            let film = DVec2::new(0.0, height);
            let distortion = bent(height);
            let percent = distortion.map(|(_, bent)| 100.0 * (bent / scale - 1.0));
            let angle = if i == 0 {
                0.0
            } else {
                distortion.map_or(f64::NAN, |(angle, _)| angle)
            };
            let lateral = |line: &Lens| {
                let there = line.image_height(angle, height, self.film_z)?;
                Some(there - height).filter(|d| d.is_finite() && d.abs() < 0.2 * height.max(1e-9))
            };
            let (tangential_focus, sagittal_focus) = close_foci(lens, film, self.film_z);
            FieldRow {
                height,
                angle_degrees: angle.to_degrees(),
                distortion_percent: if i == 0 {
                    Some(0.0)
                } else {
                    percent.filter(|p| p.is_finite())
                },
                relative_illumination: lens.irradiance(film, self.film_z) / center,
                tangential_focus,
                sagittal_focus,
                lateral_f: if i == 0 {
                    Some(0.0)
                } else {
                    lateral(&lines[0])
                },
                lateral_c: if i == 0 {
                    Some(0.0)
                } else {
                    lateral(&lines[2])
                },
            }
        };
        (0..=STEPS).map(row).collect()
    }
}

fn angle_at(lens: &Lens, height: f64, film_z: f64) -> Option<f64> {
    Some(lens.distortion(Plane::Y, height, film_z)?.angle).filter(|a| a.is_finite())
}

/// The film's half diagonal: as the file says it, or where the stated field arrives, or as far
/// as there is light.
fn full_height(lens: &Lens, about: &About, film_z: f64) -> Option<f64> {
    let center = lens.irradiance(DVec2::ZERO, film_z);
    if !(center > 0.0) {
        return None;
    }
    let lit = |h: f64| {
        lens.irradiance(DVec2::new(0.0, h), film_z) > 0.02 * center
            && angle_at(lens, h, film_z).is_some()
    };
    let efl = lens.first_order().efl().abs();
    let half = about
        .field_degrees
        .map(|f| 0.5 * f.to_radians())
        .filter(|f| *f > 0.0);
    let wanted = |h: f64| match (about.image_height, half) {
        (Some(height), _) => h <= height,
        (None, Some(half)) => angle_at(lens, h, film_z).is_some_and(|a| a <= half),
        (None, None) => true,
    };
    let step = efl / 24.0;
    let border = |fails: &dyn Fn(f64) -> bool| {
        let first = (1..=96).map(|i| f64::from(i) * step).find(|h| fails(*h));
        let Some(mut high) = first else {
            return 96.0 * step;
        };
        let mut low = high - step;
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if fails(middle) {
                high = middle
            } else {
                low = middle
            }
        }
        low
    };
    // Whether there is light takes many rays: it is looked at where the film is to end.
    let height = border(&|h| !wanted(h) || angle_at(lens, h, film_z).is_none());
    let height = if height > 0.0 && lit(height) {
        height
    } else {
        border(&|h| !lit(h)).min(height)
    };
    Some(if height > 0.0 { height } else { 0.01 * efl })
}

fn color(lens: &Lens) -> Vec<ColorRow> {
    let focus = |nm: f64| {
        lens.at_wavelength(nm)
            .first_order()
            .focal
            .map(|f| f.rear_focal_point)
    };
    let Some(d) = focus(D_LINE) else {
        return Vec::new();
    };
    (0..=30)
        .map(|i| 400.0 + 10.0 * f64::from(i))
        .filter_map(|wavelength_nm| {
            Some(ColorRow {
                wavelength_nm,
                focus: focus(wavelength_nm)? - d,
            })
        })
        .collect()
}

fn zones(lines: &[Lens; 3], film_z: f64) -> Vec<Zone> {
    let beam = lines[1].axial_beam().height;
    let focus = |lens: &Lens, pupil: f64| {
        if pupil == 0.0 {
            return lens
                .first_order()
                .focal
                .map(|f| f.rear_focal_point - film_z);
        }
        let start = 0.5 * beam + 1.0 + 4.0 * lens.length();
        let ray = LensRay {
            origin: DVec3::new(0.0, pupil * beam, -start),
            direction: DVec3::Z,
        };
        let out = lens.trace_path(&ray, Toward::Film, false).outcome.ok()?;
        let z = out.origin.z - out.origin.y / out.direction.y * out.direction.z;
        Some(z - film_z).filter(|z| z.is_finite())
    };
    (0..=20)
        .map(|i| f64::from(i) / 20.0)
        .map(|pupil| Zone {
            pupil,
            focus_f: focus(&lines[0], pupil),
            focus_d: focus(&lines[1], pupil),
            focus_c: focus(&lines[2], pupil),
        })
        .collect()
}

/// Where two rays close to the chief ray meet, from the film: above and below it, and beside it.
fn close_foci(lens: &Lens, film: DVec2, film_z: f64) -> (Option<f64>, Option<f64>) {
    let Some(chief) = lens.chief_ray(film, film_z) else {
        return (None, None);
    };
    let d = -chief.direction;
    let up = DVec3::new(0.0, d.z, -d.y);
    let aside = DVec3::X;
    let pupil = lens
        .first_order()
        .entrance_pupil
        .map_or(1.0, |p| p.semi_diameter);
    let step = 1e-3 * pupil;
    let trace = |offset: DVec3| {
        let ray = LensRay {
            origin: chief.origin + offset - 10.0 * pupil * d,
            direction: d,
        };
        lens.trace_path(&ray, Toward::Film, false).outcome.ok()
    };
    let crossing = |offset: DVec3, axis: DVec3| {
        let (a, b) = (trace(offset)?, trace(-offset)?);
        // Along z: where the two are at the same place across.
        let slope = |r: &LensRay| r.direction.dot(axis) / r.direction.z;
        let at = |r: &LensRay| r.origin.dot(axis) + (film_z - r.origin.z) * slope(r);
        let z = (at(&b) - at(&a)) / (slope(&a) - slope(&b));
        Some(z).filter(|z| z.is_finite())
    };
    (
        crossing(step * up, DVec3::Y),
        crossing(step * aside, DVec3::X),
    )
}

/// Frequencies up to a fine one for the film: 60 line pairs a millimeter on 43 mm.
fn frequencies(height: f64) -> Vec<f64> {
    let finest = 60.0 * 21.6 / height.max(1e-3);
    let power = libm::pow(10.0, libm::floor(libm::log10(finest)));
    let finest = [1.0, 2.0, 4.0, 6.0, 8.0, 10.0]
        .map(|m| m * power)
        .into_iter()
        .min_by(|a, b| {
            (a / finest - 1.0)
                .abs()
                .total_cmp(&(b / finest - 1.0).abs())
        })
        .unwrap_or(finest);
    (0..=FREQUENCIES)
        .map(|i| finest * i as f64 / FREQUENCIES as f64)
        .collect()
}

/// The parallel beam that arrives at a height, with two directions across it.
struct Beam<'a> {
    lens: &'a Lens,
    height: f64,
    film_z: f64,
    start: DVec3,
    d: DVec3,
    /// Across the meridian, and in it.
    u: DVec3,
    v: DVec3,
    /// The box around what gets through.
    low: DVec2,
    high: DVec2,
}

impl<'a> Beam<'a> {
    fn of(lens: &'a Lens, height: f64, film_z: f64) -> Option<Self> {
        let chief = lens.chief_ray(DVec2::new(0.0, height), film_z)?;
        let d = -chief.direction;
        let mut this = Self {
            lens,
            height,
            film_z,
            start: chief.origin,
            d,
            u: DVec3::X,
            v: DVec3::new(0.0, d.z, -d.y),
            low: DVec2::INFINITY,
            high: DVec2::NEG_INFINITY,
        };
        // Coarsely over the whole front, then again over the box that was found.
        let surfaces = &lens.prescription().surfaces;
        let reach = surfaces
            .iter()
            .map(|s| s.semi_diameter)
            .filter(|r| r.is_finite());
        let reach = DVec2::splat(1.6 * reach.fold(0.0, f64::max));
        let (mut from, mut to) = (-reach, reach);
        for _ in 0..4 {
            let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
            let step = (to - from) / 48.0;
            for j in 0..=48 {
                for i in 0..=48 {
                    let p = from + step * DVec2::new(f64::from(i), f64::from(j));
                    if this.trace(lens, p).outcome.is_ok() {
                        (low, high) = (low.min(p), high.max(p));
                    }
                }
            }
            if low.x > high.x {
                // Between the points of the grid: nearer to the chief ray.
                (from, to) = (0.15 * from, 0.15 * to);
                continue;
            }
            (from, to) = (low - step, high + step);
            (this.low, this.high) = (from, to);
        }
        (this.low.x < this.high.x).then_some(this)
    }

    fn trace(&self, lens: &Lens, place: DVec2) -> RayPath {
        lens.trace_path(&self.ray(place), Toward::Film, true)
    }

    fn ray(&self, place: DVec2) -> LensRay {
        let surfaces = &self.lens.prescription().surfaces;
        let back = 4.0 * surfaces[0].semi_diameter.min(1e6) + self.lens.length();
        let origin = self.start + place.x * self.u + place.y * self.v - back * self.d;
        LensRay {
            origin,
            direction: self.d,
        }
    }

    fn passes(&self, place: DVec2) -> bool {
        self.trace(self.lens, place).outcome.is_ok()
    }

    /// The outline of what gets through, around a point that does.
    fn outline(&self) -> Vec<DVec2> {
        let middle = 0.5 * (self.low + self.high);
        let Some(inside) = self.inside(middle) else {
            return Vec::new();
        };
        let far = (self.high - self.low).length();
        (0..96)
            .map(|i| {
                let angle = TAU * f64::from(i) / 96.0;
                let way = DVec2::new(libm::cos(angle), libm::sin(angle));
                let (mut near, mut out) = (0.0, far);
                for _ in 0..18 {
                    let half = 0.5 * (near + out);
                    if self.passes(inside + half * way) {
                        near = half
                    } else {
                        out = half
                    }
                }
                inside + near * way
            })
            .collect()
    }

    fn inside(&self, middle: DVec2) -> Option<DVec2> {
        if self.passes(middle) {
            return Some(middle);
        }
        let size = self.high - self.low;
        let grid = (0..=12).flat_map(|j| (0..=12).map(move |i| (f64::from(i), f64::from(j))));
        let mut found = (DVec2::ZERO, 0.0);
        for (i, j) in grid {
            let p = self.low + size * DVec2::new(i, j) / 12.0;
            if self.passes(p) {
                found = (found.0 + p, found.1 + 1.0);
            }
        }
        let center = found.0 / found.1;
        (found.1 > 0.0 && self.passes(center)).then_some(center)
    }

    /// The radius of a circle as large as the beam.
    fn outline_radius(&self) -> f64 {
        (polygon_area(&self.outline()) / (0.5 * TAU)).sqrt()
    }

    fn image(&self, lines: &[Lens; 3], axial: f64, sheet: &LensSheet) -> Option<PointImage> {
        let rays = self.rays(&lines[1])?;
        let centroid = rays.centroid();
        let spots = [0, 1, 2].map(|i| match i {
            1 => rays.spot(centroid),
            _ => self
                .rays(&lines[i])
                .map_or_else(Vec::new, |r| r.spot(centroid)),
        });
        let square = |p: &DVec2| p.length_squared();
        let rms = (spots[1].iter().map(square).sum::<f64>() / spots[1].len() as f64).sqrt();
        let outline = self.outline();
        let nm = self.lens.wavelength();
        Some(PointImage {
            height: self.height,
            angle_degrees: libm::acos(self.d.z.clamp(-1.0, 1.0)).to_degrees(),
            rms,
            geometric: geometric(&spots[1], &sheet.frequencies),
            diffraction: rays.diffraction(centroid, self.film_z, nm, &sheet.frequencies),
            spots,
            pupil: outline.iter().map(|p| (*p / axial).to_array()).collect(),
            pupil_area: polygon_area(&outline) / (0.5 * TAU * axial * axial),
        })
    }

    /// A grid of rays across the beam.
    fn rays(&self, lens: &Lens) -> Option<Rays> {
        let step = (self.high - self.low) / GRID as f64;
        let indices = lens.prescription().indices(lens.wavelength());
        let mut cells = vec![None; GRID * GRID];
        for j in 0..GRID {
            for i in 0..GRID {
                let place = self.low + step * (DVec2::new(i as f64, j as f64) + 0.5);
                let ray = self.ray(place);
                let path = lens.trace_path(&ray, Toward::Film, true);
                let Ok(out) = path.outcome else { continue };
                if !(out.direction.z > 1e-3) {
                    continue;
                }
                let mut from = ray.origin;
                let mut optical = 0.0;
                for (hit, n) in path.hits.iter().zip(&indices) {
                    // Signed, as a ray may run backwards between surfaces that cross.
                    let leg = (*hit - from).length().copysign((*hit - from).z);
                    optical += n * if from == ray.origin {
                        (*hit - from).length()
                    } else {
                        leg
                    };
                    from = *hit;
                }
                let reach = (self.film_z - out.origin.z) / out.direction.z;
                cells[j * GRID + i] = Some(Arrival {
                    at: (out.origin + reach * out.direction).truncate(),
                    last: out.origin,
                    direction: out.direction,
                    optical,
                });
            }
        }
        let rays = Rays {
            cells,
            n: indices[indices.len() - 1],
        };
        (rays.cells.iter().flatten().count() > 8).then_some(rays)
    }
}

/// A ray at the film.
#[derive(Clone, Copy)]
struct Arrival {
    at: DVec2,
    last: DVec3,
    direction: DVec3,
    /// The optical path to the last surface.
    optical: f64,
}

struct Rays {
    /// Row by row; none where the ray is lost.
    cells: Vec<Option<Arrival>>,
    /// The index in front of the film.
    n: f64,
}

impl Rays {
    fn centroid(&self) -> DVec2 {
        let (sum, count) = self
            .cells
            .iter()
            .flatten()
            .fold((DVec2::ZERO, 0.0), |(sum, count), r| {
                (sum + r.at, count + 1.0)
            });
        sum / count
    }

    fn spot(&self, centroid: DVec2) -> Vec<DVec2> {
        self.cells
            .iter()
            .flatten()
            .map(|r| r.at - centroid)
            .collect()
    }

    /// The modulation of the wave: its phase over the pupil, correlated with itself.
    ///
    /// The phase is the optical path to the foot of the perpendicular from the image point, a
    /// reference sphere of infinite radius. A shift of the pupil by Δ in direction cosines is the
    /// frequency nΔ/λ (Hopkins); directions are taken as linear over the grid.
    fn diffraction(&self, image: DVec2, film_z: f64, nm: f64, at: &[f64]) -> Modulation {
        let wavelength = nm * 1e-6;
        let image = image.extend(film_z);
        let phase: Vec<Option<f64>> = self
            .cells
            .iter()
            .map(|cell| {
                let r = cell.as_ref()?;
                let path = r.optical + self.n * (image - r.last).dot(r.direction);
                Some(TAU * path / wavelength)
            })
            .collect();
        let total = phase.iter().flatten().count() as f64;
        // Between cells the phase is linear, which is the transverse aberration there.
        let curve = |stride: usize, scale: f64| -> Vec<f64> {
            let shifted = |i: usize, k: usize| {
                let in_row = stride != 1 || i % GRID + k < GRID;
                phase
                    .get(i + k * stride)
                    .copied()
                    .flatten()
                    .filter(|_| in_row)
            };
            let at_frequency = |f: &f64| {
                let shift = f * wavelength / (self.n * scale);
                let (k, part) = (shift as usize, shift.fract());
                let mut sum = DVec2::ZERO;
                for (i, phase) in phase.iter().enumerate() {
                    let Some(a) = phase else { continue };
                    let (b, weight) = match (shifted(i, k), shifted(i, k + 1)) {
                        (Some(b), Some(c)) => (b + part * (c - b), 1.0),
                        (Some(b), None) => (b, 1.0 - part),
                        (None, Some(c)) => (c, part),
                        (None, None) => continue,
                    };
                    sum += weight * DVec2::new(libm::cos(a - b), libm::sin(a - b));
                }
                sum.length() / total
            };
            at.iter().map(at_frequency).collect()
        };
        Modulation {
            tangential: curve(GRID, self.cosine_step(1)),
            sagittal: curve(1, self.cosine_step(0)),
        }
    }

    /// How far the direction cosine along an axis changes from a cell to the next: the slope of
    /// the line through all.
    fn cosine_step(&self, axis: usize) -> f64 {
        let place = |i: usize| if axis == 0 { i % GRID } else { i / GRID } as f64;
        let all: Vec<(f64, f64)> = self
            .cells
            .iter()
            .enumerate()
            .filter_map(|(i, cell)| Some((place(i), cell.as_ref()?.direction[axis])))
            .collect();
        let n = all.len() as f64;
        let mean = all
            .iter()
            .fold((0.0, 0.0), |m, p| (m.0 + p.0 / n, m.1 + p.1 / n));
        let (mut xy, mut xx) = (0.0, 0.0);
        for (x, y) in all {
            xy += (x - mean.0) * (y - mean.1);
            xx += (x - mean.0) * (x - mean.0);
        }
        (xy / xx).abs()
    }
}

/// The modulation of lines by the spot alone.
fn geometric(spot: &[DVec2], at: &[f64]) -> Modulation {
    let curve = |axis: usize| -> Vec<f64> {
        at.iter()
            .map(|f| {
                let sum = spot.iter().fold(DVec2::ZERO, |sum, p| {
                    let phase = TAU * f * p[axis];
                    sum + DVec2::new(libm::cos(phase), libm::sin(phase))
                });
                sum.length() / spot.len() as f64
            })
            .collect()
    };
    Modulation {
        tangential: curve(1),
        sagittal: curve(0),
    }
}

fn polygon_area(corners: &[DVec2]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    let twice: f64 = corners.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum();
    0.5 * twice.abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet(name: &str) -> (Lens, LensSheet) {
        let lens = Lens::named(name).unwrap();
        let sheet = LensSheet::of(&lens).unwrap();
        (lens, sheet)
    }

    /// The triplet at f/32 is a clear circular pupil without aberration to speak of: the
    /// modulation is (2/π)(acos s − s √(1 − s²)), s = λ N ν.
    #[test]
    fn a_lens_stopped_down_has_the_modulation_of_a_clear_circle() {
        let lens = Lens::named("cooke-triplet")
            .unwrap()
            .at_f_number(32.0)
            .unwrap();
        let sheet = LensSheet::of(&lens).unwrap();
        for (f, m) in sheet
            .frequencies
            .iter()
            .zip(&sheet.points[0].diffraction.tangential)
        {
            let s = (D_LINE * 1e-6 * 32.0 * f).min(1.0);
            let ideal = 2.0 / std::f64::consts::PI * (libm::acos(s) - s * (1.0 - s * s).sqrt());
            assert!((m - ideal).abs() < 0.02, "{f} lp/mm: {m} against {ideal}");
        }
    }

    #[test]
    fn an_aberrated_lens_has_the_same_modulation_by_rays_and_by_waves_at_low_frequencies() {
        let (_, sheet) = sheet("angenieux-50");
        let point = &sheet.points[0];
        for i in 1..6 {
            let (a, b) = (point.geometric.sagittal[i], point.diffraction.sagittal[i]);
            assert!((a - b).abs() < 0.06, "{}: {a} {b}", sheet.frequencies[i]);
        }
    }

    #[test]
    fn the_field_of_a_sheet_is_the_stated_one() {
        for (name, half) in [
            ("double-gauss", 22.0),
            ("biogon", 45.0),
            ("wide-angle", 38.0),
        ] {
            let (_, sheet) = sheet(name);
            assert!((sheet.half_field_degrees - half).abs() < 0.5, "{name}");
            assert!((sheet.fields[0].relative_illumination - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn curves_of_every_shipped_lens_are_finite() {
        for name in super::super::shipped_names() {
            let (lens, sheet) = sheet(name);
            assert!(
                sheet.points.len() >= 3,
                "{name}: {} points",
                sheet.points.len()
            );
            let json = serde_json::to_string(&sheet).unwrap();
            assert!(sheet.points.iter().all(|p| p.rms.is_finite()), "{name}");
            // A lost row or a wrong digit shows here: designers leave less than this.
            let efl = lens.first_order().efl();
            let small = sheet.points.iter().take(3).all(|p| p.rms < 6e-3 * efl);
            assert!(small, "{name}: spots larger than any design's");
            assert!(json.len() > 5000, "{name}");
        }
    }
}
