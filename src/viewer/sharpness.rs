//! Depth of field of a thick lens, and the focus wheel.

use ivcam_optics::film::FilmFormat;
use ivcam_optics::lens::Lens;
use ivcam_render::camera::LensCamera;

/// The range of acceptable sharpness, in meters on the scale of the focus distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DepthOfField {
    pub near: f64,
    pub far: f64,
    /// The nearest focus distance whose far limit is infinity.
    pub hyperfocal: f64,
    /// The diameter of acceptable blur, in millimeters on the film.
    pub circle: f64,
}

/// Returns the usual circle of confusion: 1/1500 of the film's diagonal, 0.029 mm for 36×24.
pub(crate) fn circle_of_confusion(film: FilmFormat) -> f64 {
    film.half_diagonal() / 750.0
}

/// A focused lens, described by its focal points and its exit pupil, for the size of a point's
/// blur.
///
/// With x' the image behind the rear focal point (x x' = f f') and the film at x'₀, the cone from
/// the exit pupil of diameter D a distance a in front of the focal point makes a disc of D |x'₀ −
/// x'| / (x' + a) on the film. This holds for a thick lens: principal planes may be crossed, and
/// pupils need not be in them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Blur {
    diameter: f64,
    pupil_to_focus: f64,
    /// The product f f', in mm².
    range: f64,
    ffl: f64,
    /// The position of the film from the rear focal point, in mm.
    film: f64,
}

impl Blur {
    /// Returns `None` if the lens has no focal length, or its exit pupil is at infinity.
    pub(crate) fn of(lens: &Lens, film_z: f64) -> Option<Self> {
        let focal = lens.first_order().focal?;
        let pupil = lens.first_order().exit_pupil?;
        Some(Self {
            diameter: 2.0 * pupil.semi_diameter,
            pupil_to_focus: focal.rear_focal_point - pupil.z,
            range: focal.efl * focal.front_efl,
            ffl: focal.ffl,
            film: film_z - focal.rear_focal_point,
        })
    }

    /// Returns the diameter of the disc in millimeters, for a point at a distance in meters from
    /// the front vertex.
    #[cfg(test)]
    pub(crate) fn at(&self, meters: f64) -> f64 {
        let image = self.image(meters);
        self.diameter * (self.film - image).abs() / (image + self.pupil_to_focus).abs()
    }

    fn image(&self, meters: f64) -> f64 {
        if meters.is_finite() {
            self.range / (1000.0 * meters + self.ffl)
        } else {
            0.0
        }
    }

    /// Returns the distance of the object for an image position behind the focal point; infinity if
    /// there is no real object.
    fn object(&self, image: f64) -> f64 {
        if image > 0.0 {
            ((self.range / image - self.ffl) / 1000.0).max(0.0)
        } else {
            f64::INFINITY
        }
    }

    /// Returns the distance whose point has a disc of a diameter in millimeters, with the film
    /// focused for `meters`: behind it for a positive disc, in front for a negative one.
    pub(crate) fn beside(&self, meters: f64, disc: f64) -> f64 {
        let film = self.image(meters);
        let shift = disc * (film + self.pupil_to_focus) / (self.diameter + disc);
        self.object(film - shift)
    }

    /// Returns the range of distances whose blur is at most a diameter in millimeters.
    pub(crate) fn depth_of_field(&self, circle: f64) -> DepthOfField {
        let (d, a) = (self.diameter, self.pupil_to_focus);
        let far = (d * self.film - circle * a) / (d + circle);
        let near = if d > circle {
            (d * self.film + circle * a) / (d - circle)
        } else {
            f64::INFINITY
        };
        DepthOfField {
            near: if near.is_finite() {
                self.object(near)
            } else {
                0.0
            },
            far: self.object(far),
            hyperfocal: self.object(circle * a / d),
            circle,
        }
    }
}

/// Returns the depth of field of a camera. Distances are from the front vertex.
pub(crate) fn depth_of_field(camera: &LensCamera) -> Option<DepthOfField> {
    let blur = Blur::of(&camera.lens, camera.focus.film_z)?;
    Some(blur.depth_of_field(circle_of_confusion(camera.format)))
}

/// The farthest finite distance on the wheel, in meters.
const FARTHEST: f64 = 10_000.0;

/// Turns the focus wheel by radians, at a speed in radians per second, and returns the new
/// distance.
///
/// The plane moves by a fraction of its distance, so its speed grows with the distance. As in 1999,
/// it grows faster than in proportion when the wheel is turned fast (the paper, Focus Wheel).
/// Beyond the end of the scale is infinity.
pub(crate) fn wheel(distance: f64, radians: f64, speed: f64) -> f64 {
    let from = if distance.is_finite() {
        distance
    } else {
        FARTHEST
    };
    let share = 0.35 * radians * (1.0 + 0.15 * speed.abs().min(40.0));
    let there = from * libm::exp(share.clamp(-3.0, 3.0));
    if there >= FARTHEST && radians > 0.0 {
        f64::INFINITY
    } else {
        there.max(1e-4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivcam_base::math::meters;
    use ivcam_optics::lens::FocusMethod;

    fn blur(name: &str, f_number: f64, distance: f64) -> Blur {
        let lens = Lens::named(name).unwrap().at_f_number(f_number).unwrap();
        let focus = lens.focus(FocusMethod::Film, meters(distance)).unwrap();
        Blur::of(&lens, focus.film_z).unwrap()
    }

    #[test]
    fn the_blur_at_the_limits_is_the_circle_of_confusion() {
        for (name, n) in [
            ("double-gauss", 4.0),
            ("telephoto", 8.0),
            ("wide-angle", 5.6),
        ] {
            let blur = blur(name, n, 3.0);
            let field = blur.depth_of_field(0.03);
            assert!(field.near < 3.0 && 3.0 < field.far, "{name} {field:?}");
            assert!((blur.at(field.near) - 0.03).abs() < 1e-9, "{name}");
            assert!((blur.at(field.far) - 0.03).abs() < 1e-9, "{name}");
            assert!(blur.at(3.0) < 1e-9);
            for disc in [-0.1, 0.05] {
                let there = blur.beside(3.0, disc);
                assert!((blur.at(there) - disc.abs()).abs() < 1e-9, "{name} {disc}");
                assert_eq!(there > 3.0, disc > 0.0);
            }
        }
    }

    #[test]
    fn focused_at_the_hyperfocal_distance_everything_behind_is_sharp() {
        let field = blur("double-gauss", 8.0, 5.0).depth_of_field(0.03);
        // The textbook formula is f²/(N c) + f, from a principal plane near the lens: 100 mm at
        // f/8.
        assert!((field.hyperfocal - 42.2).abs() < 1.5, "{field:?}");
        let there = blur("double-gauss", 8.0, field.hyperfocal).depth_of_field(0.03);
        assert!(there.far > 1e4, "{there:?}");
        assert!((there.near / field.hyperfocal - 0.5).abs() < 0.01);
    }

    #[test]
    fn the_wheel_moves_by_fractions_of_the_distance_and_faster_when_turned_fast() {
        let step = |d: f64, v: f64| wheel(d, 0.1, v) - d;
        assert!((step(10.0, 0.0) / step(1.0, 0.0) - 10.0).abs() < 1e-9);
        assert!(step(1.0, 10.0) > 2.0 * step(1.0, 0.0));
        assert_eq!(wheel(9_990.0, 0.5, 0.0), f64::INFINITY);
        assert!(wheel(f64::INFINITY, -0.1, 0.0) < FARTHEST);
        let back = wheel(wheel(2.0, 0.3, 0.0), -0.3, 0.0);
        assert!((back - 2.0).abs() < 1e-12);
    }
}
