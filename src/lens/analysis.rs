//! What a lens does to a picture, computed from its rays: chief rays and distortion, irradiance
//! over the film, spots, best focus, and colour errors.
//!
//! Film points are in millimeters from the axis, on a film at a z from the front vertex. The
//! numbers are those of the ray data alone: no sampling noise, no scene.

use glam::{DVec2, DVec3};

use super::Lens;
use super::first_order::Plane;
use super::sight::Sight;
use super::trace::{LensRay, Loss, Toward};

/// Where a chief ray leaves the lens and how its image lies against two ideal projections.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distortion {
    /// The angle to the axis in scene space, in radians; more than π/2 in some fish-eyes.
    pub angle: f64,
    /// The image height over f tan θ, less 1; NaN from 90 degrees on.
    pub f_tan: f64,
    /// The image height over f θ, less 1.
    pub f_theta: f64,
}

/// A spot: where the rays of one scene point meet the film.
#[derive(Clone, Debug, PartialEq)]
pub struct Spot {
    pub points: Vec<DVec2>,
    pub centroid: DVec2,
    /// The root mean square distance from the centroid.
    pub rms: f64,
    /// The largest distance from the centroid.
    pub largest: f64,
    /// The cross-section of the beam that gets through, in mm².
    pub beam_area: f64,
    /// How far to move the film for the least `rms`, and that.
    pub best_shift: f64,
    pub best_rms: f64,
}

/// The widest beam along the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxialBeam {
    pub height: f64,
    /// What stops the next higher ray; none where nothing does.
    pub limit: Option<Loss>,
    /// The focal length over the beam's diameter.
    pub f_number: f64,
}

impl Lens {
    /// The ray from a film point that passes through the center of the stop, in scene space:
    /// its origin is on the front surface. Semi-diameters do not block it.
    pub fn chief_ray(&self, film: DVec2, film_z: f64) -> Option<LensRay> {
        let stop = self.first_order().stop?;
        let exit = self.first_order().exit_pupil;
        // Aimed at the paraxial exit pupil first, or along the axis if that is at infinity.
        let rear_z = self.length();
        let toward = exit.map_or(0.0, |p| (film_z - rear_z) / (film_z - p.z));
        let mut aim = DVec2::ZERO;
        // Out from the axis in steps, each starting from the last: a fish-eye's chief rays are
        // far from paraxial at the edge of its field.
        const STEPS: usize = 8;
        for step in 1..=STEPS {
            let share = step as f64 / STEPS as f64;
            let target = share * film;
            let grown = if step == 1 {
                target * (1.0 - toward)
            } else {
                aim * (step as f64 / (step - 1) as f64)
            };
            aim = self.aim_at_stop(target, film_z, stop, grown)?;
        }
        self.course(Toward::Scene, false)
            .follow(self.film_ray(film, film_z, aim), |_, _| {})
            .ok()
    }

    /// Newton's iteration, with differences, for the aim whose ray meets the stop's center.
    fn aim_at_stop(&self, film: DVec2, film_z: f64, stop: usize, start: DVec2) -> Option<DVec2> {
        let miss = |aim: DVec2| self.stop_hit(film, film_z, stop, aim);
        let scale = self
            .first_order()
            .exit_pupil
            .map_or(1.0, |p| p.semi_diameter)
            .max(1e-3);
        let step = 1e-5 * scale;
        let mut aim = start;
        let mut at = miss(aim)?;
        let mut stalled = 0;
        for _ in 0..60 {
            let dx = (miss(aim + step * DVec2::X)? - miss(aim - step * DVec2::X)?) / (2.0 * step);
            let dy = (miss(aim + step * DVec2::Y)? - miss(aim - step * DVec2::Y)?) / (2.0 * step);
            let determinant = dx.perp_dot(dy);
            let change = DVec2::new(at.perp_dot(dy), dx.perp_dot(at)) / determinant;
            if !change.is_finite() {
                return None;
            }
            let mut part = 1.0;
            let (next, value) = loop {
                let next = aim - part * change;
                match miss(next) {
                    Some(value) if value.length() < at.length() => break (next, value),
                    _ if part < 1e-3 => break (aim, at),
                    _ => part *= 0.5,
                }
            };
            stalled = if value.length() < 0.5 * at.length() {
                0
            } else {
                stalled + 1
            };
            (aim, at) = (next, value);
            if at == DVec2::ZERO || stalled > 2 {
                break;
            }
        }
        (at.length() < 1e-9 * scale).then_some(aim)
    }

    /// Where the ray from a film point to an aim on the rear vertex plane meets the stop.
    fn stop_hit(&self, film: DVec2, film_z: f64, stop: usize, aim: DVec2) -> Option<DVec2> {
        let mut found = None;
        let ray = self.film_ray(film, film_z, aim);
        let course = self.course(Toward::Scene, false);
        // A ray lost in front of the stop has passed it all the same.
        let _ = course.follow(ray, |surface, hit| {
            if surface == stop {
                found = Some(hit.truncate());
            }
        });
        found
    }

    fn film_ray(&self, film: DVec2, film_z: f64, aim: DVec2) -> LensRay {
        let origin = film.extend(film_z);
        LensRay {
            origin,
            direction: aim.extend(self.length()) - origin,
        }
    }

    /// The distortion at a film point on the y axis, or on the x axis.
    pub fn distortion(&self, plane: Plane, height: f64, film_z: f64) -> Option<Distortion> {
        let axis = if plane == Plane::X {
            DVec2::X
        } else {
            DVec2::Y
        };
        let chief = self.chief_ray(height * axis, film_z)?;
        let angle = angle_of(chief.direction);
        let f = self.first_order_in(plane).focal?.front_efl;
        let half_turn = std::f64::consts::FRAC_PI_2;
        let f_tan = if angle < half_turn {
            f * libm::tan(angle)
        } else {
            f64::NAN
        };
        Some(Distortion {
            angle,
            f_tan: height.abs() / f_tan.abs() - 1.0,
            f_theta: height.abs() / (f * angle).abs() - 1.0,
        })
    }

    /// The height on the y axis of the film where the chief ray of a scene angle arrives, from a
    /// height near it. At another wavelength than the film was placed for it shows lateral
    /// colour.
    pub fn image_height(&self, angle: f64, near: f64, film_z: f64) -> Option<f64> {
        let at = |h: f64| {
            let chief = self.chief_ray(DVec2::new(0.0, h), film_z)?;
            Some(angle_of(chief.direction) - angle)
        };
        let (mut a, mut b) = (near, near * (1.0 + 1e-4));
        let (mut fa, mut fb) = (at(a)?, at(b)?);
        for _ in 0..40 {
            if fb == fa || fb == 0.0 {
                break;
            }
            let next = b - fb * (b - a) / (fb - fa);
            if !next.is_finite() {
                return None;
            }
            let settled = (next - b).abs() <= 1e-15 * b.abs();
            (a, fa, b) = (b, fb, next);
            if settled {
                break;
            }
            fb = at(b)?;
        }
        Some(b)
    }

    /// The irradiance on the film from a scene of radiance 1, by equation 1: ∫ cos⁴θ / Z² over
    /// the part of the rear vertex plane that is seen.
    pub fn irradiance(&self, film: DVec2, film_z: f64) -> f64 {
        self.seen(film, film_z).0
    }

    /// The irradiance and the area of the rear vertex plane that the film point sees light
    /// through, in mm².
    pub fn seen(&self, film: DVec2, film_z: f64) -> (f64, f64) {
        let z = film_z - self.length();
        let outline = Sight::new(self).outline_points(film.extend(film_z), 1440);
        let Some((center, rims)) = outline else {
            return (0.0, 0.0);
        };
        let (mut light, mut area) = (0.0, 0.0);
        for i in 0..rims.len() {
            let (p, q) = (rims[i], rims[(i + 1) % rims.len()]);
            let twice = p.perp_dot(q).abs();
            area += 0.5 * twice;
            // The triangle from the center: Gauss's points outward along its middle line.
            let middle = 0.5 * (p + q);
            for (t, weight) in GAUSS {
                let d2 = (center + t * middle - film).length_squared();
                let cos2 = z * z / (z * z + d2);
                light += twice * weight * t * cos2 * cos2 / (z * z);
            }
        }
        (light, area)
    }

    /// The widest beam along the axis that gets through, from a ray at a time.
    pub fn axial_beam(&self) -> AxialBeam {
        let trace = |y: f64| {
            let start = self
                .prescription()
                .surfaces
                .first()
                .map_or(0.0, |s| s.thickness.abs());
            let origin = DVec3::new(0.0, y, -10.0 * (1.0 + start + self.length()));
            self.trace_from_scene(&LensRay {
                origin,
                direction: DVec3::Z,
            })
        };
        let surfaces = &self.prescription().surfaces;
        let widest = surfaces
            .iter()
            .map(|s| s.semi_diameter)
            .filter(|r| r.is_finite());
        let widest = 1.5 * widest.fold(0.0, f64::max);
        let step = widest / 512.0;
        let lost = (1..=512).find_map(|i| trace(i as f64 * step).err().map(|loss| (i, loss)));
        let (mut low, mut high, mut limit) = match lost {
            Some((i, loss)) => ((i - 1) as f64 * step, i as f64 * step, Some(loss)),
            None => (widest, widest, None),
        };
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            match trace(middle) {
                Ok(_) => low = middle,
                Err(loss) => (high, limit) = (middle, Some(loss)),
            }
        }
        AxialBeam {
            height: low,
            limit,
            f_number: self.first_order().efl().abs() / (2.0 * low),
        }
    }

    /// The spot of the point at infinity whose chief ray arrives at a film point: `grid` rays
    /// across the parallel beam each way, evenly.
    pub fn spot(&self, film: DVec2, film_z: f64, grid: usize) -> Option<Spot> {
        let chief = self.chief_ray(film, film_z)?;
        let direction = -chief.direction;
        let across = direction.any_orthonormal_vector();
        let along = direction.cross(across);
        let widest = self
            .prescription()
            .surfaces
            .iter()
            .map(|s| s.semi_diameter)
            .filter(|r| r.is_finite())
            .fold(0.0, f64::max);
        let back = 4.0 * (widest + self.length());
        let start = chief.origin - back * direction;
        let ray = |a: f64, b: f64| LensRay {
            origin: start + a * across + b * along,
            direction,
        };
        // The box around what gets through, then the grid in it.
        let mut reach = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let coarse = 160;
        let cell = 4.0 * widest / coarse as f64;
        for j in 0..=coarse {
            for i in 0..=coarse {
                let (a, b) = (
                    i as f64 * cell - 2.0 * widest,
                    j as f64 * cell - 2.0 * widest,
                );
                if self.trace_from_scene(&ray(a, b)).is_ok() {
                    reach = (reach.0.min(DVec2::new(a, b)), reach.1.max(DVec2::new(a, b)));
                }
            }
        }
        if reach.0.x > reach.1.x {
            reach = (DVec2::ZERO, DVec2::ZERO);
        }
        let (from, to) = (reach.0 - cell, reach.1 + cell);
        let step = (to - from) / grid as f64;
        let mut hits = Vec::new();
        for j in 0..grid {
            for i in 0..grid {
                let place = from + step * (DVec2::new(i as f64, j as f64) + 0.5);
                if let Ok(out) = self.trace_from_scene(&ray(place.x, place.y)) {
                    hits.push(out);
                }
            }
        }
        Some(Spot::of(&hits, film_z, step.x * step.y * hits.len() as f64))
    }

    /// Where the film is best for an object on the axis: the least root mean square spot of the
    /// rays themselves, not the paraxial image. `distance` is from the front vertex, in
    /// millimeters, and may be infinite.
    pub fn best_focus(&self, distance: f64) -> Option<f64> {
        let beam = self.axial_beam().height;
        let pupil = self.first_order().entrance_pupil;
        let pupil_z = pupil.map_or(0.0, |p| p.z);
        let mut hits = Vec::new();
        const RINGS: usize = 64;
        for i in 0..RINGS {
            // Rings of equal area, at their middles.
            let y = beam * ((i as f64 + 0.5) / RINGS as f64).sqrt();
            let ray = if distance.is_finite() {
                let origin = -distance * DVec3::Z;
                LensRay {
                    origin,
                    direction: DVec3::new(0.0, y, pupil_z) - origin,
                }
            } else {
                let far = -4.0 * (beam + self.length());
                LensRay {
                    origin: DVec3::new(0.0, y, far),
                    direction: DVec3::Z,
                }
            };
            for turned in [ray, mirrored(&ray)] {
                hits.extend(self.trace_from_scene(&turned));
            }
        }
        if hits.len() < 8 {
            return None;
        }
        let rear = self.length();
        let spot = Spot::of(&hits, rear, 0.0);
        let z = rear + spot.best_shift;
        z.is_finite().then_some(z)
    }
}

/// The same ray turned by a right angle about the axis, for lenses that differ in x and y.
fn mirrored(ray: &LensRay) -> LensRay {
    let turn = |v: DVec3| DVec3::new(v.y, v.x, v.z);
    LensRay {
        origin: turn(ray.origin),
        direction: turn(ray.direction),
    }
}

/// The angle between a ray into the scene and the axis.
fn angle_of(direction: DVec3) -> f64 {
    libm::atan2(direction.truncate().length(), -direction.z)
}

/// Six points and weights on (0, 1).
const GAUSS: [(f64, f64); 6] = [
    (0.033_765_242_898_423_99, 0.085_662_246_189_585_18),
    (0.169_395_306_766_867_74, 0.180_380_786_524_069_3),
    (0.380_690_406_958_401_55, 0.233_956_967_286_345_52),
    (0.619_309_593_041_598_5, 0.233_956_967_286_345_52),
    (0.830_604_693_233_132_3, 0.180_380_786_524_069_3),
    (0.966_234_757_101_576, 0.085_662_246_189_585_18),
];

impl Spot {
    /// The spot that rays leaving the lens make on a film.
    pub fn of(rays: &[LensRay], film_z: f64, beam_area: f64) -> Self {
        let slopes: Vec<DVec2> = rays
            .iter()
            .map(|r| r.direction.truncate() / r.direction.z)
            .collect();
        let points: Vec<DVec2> = rays
            .iter()
            .zip(&slopes)
            .map(|(r, slope)| r.origin.truncate() + (film_z - r.origin.z) * *slope)
            .collect();
        let n = points.len() as f64;
        let centroid = points.iter().sum::<DVec2>() / n;
        let mean_slope = slopes.iter().sum::<DVec2>() / n;
        let (mut square, mut largest, mut both, mut slope_square) = (0.0, 0.0f64, 0.0, 0.0);
        for (point, slope) in points.iter().zip(&slopes) {
            let (p, s) = (*point - centroid, *slope - mean_slope);
            square += p.length_squared();
            largest = largest.max(p.length());
            both += p.dot(s);
            slope_square += s.length_squared();
        }
        let best_shift = -both / slope_square;
        let least = (square - both * both / slope_square).max(0.0);
        Self {
            points,
            centroid,
            rms: (square / n).sqrt(),
            largest,
            beam_area,
            best_shift,
            best_rms: (least / n).sqrt(),
        }
    }
}
