//! Paraxial focusing: the position of the film, or of the lens, that brings a distance into focus.
//!
//! There are two methods, both from the paper (Kolb, Mitchell and Hanrahan, 1995). In the first,
//! the film moves, and the lens stays with its front vertex at the eye. The distance is measured
//! from the front vertex. This is the default, and what the 1999 program did. In the second, the
//! film stays and the whole lens moves (equation 5). The distance is measured from the film, as on
//! the scale of a real camera.

use ivcam_base::diag::{Diagnostic, ErrorKind};
use thiserror::Error;

use crate::prescription::first_order::{FirstOrder, Focal};

/// What moves when the lens is focused.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum FocusMethod {
    /// The film moves, by the lens equation. Distances are from the front vertex.
    #[default]
    Film,
    /// The whole lens moves, by equation 5. Distances are from the film.
    Lens,
    /// The focusing group of the prescription moves, and the film stays at its position for
    /// infinity. Distances are from the front vertex. This method needs
    /// [`Lens::focused`](crate::lens::Lens::focused), because it changes the lens.
    Group,
    /// The film moves to the smallest spot of real rays instead of the paraxial image. Distances
    /// are from the front vertex. This method needs [`Lens::focus`](crate::lens::Lens::focus),
    /// because first-order data are not enough.
    Best,
}

impl FocusMethod {
    /// The name as in options and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Film => "film",
            Self::Lens => "lens",
            Self::Group => "group",
            Self::Best => "best",
        }
    }
}

/// The focus of a lens. Lengths are in millimeters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Focus {
    /// What was moved.
    pub method: FocusMethod,
    /// The distance in focus: from the front vertex, or from the film if the lens moves. It may be
    /// infinite.
    pub distance: f64,
    /// The z of the film, from the front vertex.
    pub film_z: f64,
    /// The image height over the object height; negative if the image is upside down.
    pub magnification: f64,
    /// The distance from the rear principal plane to the film: the z of the paper's equations 6 and
    /// 7. For an afocal lens it is that of a pinhole at the front vertex with the same picture of
    /// the object.
    pub image_distance: f64,
    /// The distance by which the moving part has moved from its position for infinity: the film
    /// backward, or the lens forward (the T of equation 5). It is infinite for an afocal lens.
    pub extension: f64,
}

impl Focus {
    /// The distance of the object from the front vertex, in millimeters; it may be infinite.
    pub fn object_distance(&self) -> f64 {
        match self.method {
            FocusMethod::Lens => self.distance - self.film_z,
            _ => self.distance,
        }
    }

    /// The angle that the film's height subtends by equation 7, θ = 2 atan(h/z), in radians.
    /// `height` is half of the film's height in millimeters, 12 mm in the paper.
    pub fn height_angle(&self, height: f64) -> f64 {
        2.0 * libm::atan(height / self.image_distance.abs())
    }
}

/// The reason why a distance cannot be in focus. Distances are in millimeters, measured as the
/// focus method measures them.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum FocusFault {
    /// The distance is 0, negative or NaN.
    #[error("the focus distance is not a positive number")]
    NotADistance,
    /// The lens has no optical power, and the object is at infinity or the lens would move.
    #[error("the lens has no focal length (it is afocal)")]
    Afocal,
    /// The image is at infinity.
    #[error("the object is at the front focal point: its image is at infinity")]
    ObjectAtFocalPoint {
        /// The nearest distance that can be in focus.
        nearest: f64,
    },
    /// The image is on the object's side of the lens.
    #[error("the object is inside the front focal point: its image is virtual")]
    VirtualImage {
        /// The nearest distance that can be in focus.
        nearest: f64,
    },
    /// No position of the lens or of its focusing group brings the distance into focus.
    #[error("the object is nearer than the lens can focus")]
    TooNear {
        /// The nearest distance that can be in focus.
        nearest: f64,
    },
    /// [`FocusMethod::Group`] was asked for, but the prescription has no focusing group.
    #[error("the prescription has no focusing group")]
    NoGroup,
    /// [`FocusMethod::Best`] was asked for, but too few rays get through the lens.
    #[error("no ray gets through to find the best focus by")]
    NoRays,
    /// The image is in front of the last vertex.
    #[error("the image is inside the lens, where no film can be")]
    FilmInsideLens {
        /// The z of the image, from the front vertex.
        film_z: f64,
        /// The nearest distance whose image is behind the lens, if there is one.
        nearest: Option<f64>,
    },
}

impl FocusFault {
    /// The nearest distance that can be in focus, in millimeters, if it is known.
    pub fn nearest(self) -> Option<f64> {
        match self {
            Self::ObjectAtFocalPoint { nearest }
            | Self::VirtualImage { nearest }
            | Self::TooNear { nearest } => Some(nearest),
            Self::FilmInsideLens { nearest, .. } => nearest,
            Self::NotADistance | Self::Afocal | Self::NoGroup | Self::NoRays => None,
        }
    }

    /// The name of the fault in machine-readable output.
    pub fn kind(self) -> &'static str {
        match self {
            Self::NotADistance => "not_a_distance",
            Self::Afocal => "afocal",
            Self::ObjectAtFocalPoint { .. } => "object_at_focal_point",
            Self::VirtualImage { .. } => "virtual_image",
            Self::TooNear { .. } => "too_near",
            Self::FilmInsideLens { .. } => "film_inside_lens",
            Self::NoGroup => "no_group",
            Self::NoRays => "no_rays",
        }
    }

    /// The error message for a lens of the given name, with advice.
    pub fn diagnostic(self, lens: &str) -> Box<Diagnostic> {
        let help = match self {
            Self::NotADistance => "give a distance in meters, such as 1.2, or `inf`".to_owned(),
            Self::NoGroup => "move the film or the whole lens instead".to_owned(),
            Self::NoRays => "open the stop, or use another focus method".to_owned(),
            Self::Afocal => {
                "light from infinity leaves it parallel: give a near distance, and move the film"
                    .to_owned()
            }
            Self::FilmInsideLens {
                nearest: Some(near),
                ..
            } => {
                format!(
                    "distances up to {} focus behind the lens",
                    meters(near, f64::floor)
                )
            }
            Self::FilmInsideLens { nearest: None, .. } => {
                "no real object is imaged behind this lens".to_owned()
            }
            _ => match self.nearest() {
                Some(near) if near.is_infinite() => "only infinity works".to_owned(),
                Some(near) => {
                    format!(
                        "the nearest distance that works is {}",
                        meters(near, f64::ceil)
                    )
                }
                None => String::new(),
            },
        };
        Diagnostic::error(format!("`{lens}`: {self}"))
            .with_help(help)
            .of_kind(ErrorKind::CannotFocus)
    }
}

/// A length in millimeters as text in meters with four digits. `round` rounds to the side on which
/// the printed distance can be in focus.
fn meters(length: f64, round: fn(f64) -> f64) -> String {
    let unit = libm::pow(10.0, libm::floor(libm::log10(length.abs().max(1e-9))) - 3.0);
    format!(
        "{} m",
        (round(length / unit) * unit / 1000.0 * 1e9).round() / 1e9
    )
}

/// Focuses from first-order data alone, by moving the film or the whole lens. `distance` is in
/// millimeters. For a method that needs more than first-order data, the film is moved.
pub fn focus(optics: &FirstOrder, method: FocusMethod, distance: f64) -> Result<Focus, FocusFault> {
    if !(distance > 0.0) {
        return Err(FocusFault::NotADistance);
    }
    match (method, &optics.focal) {
        (FocusMethod::Lens, Some(focal)) => move_lens(optics, focal, distance),
        (_, Some(focal)) => move_film(optics, focal, distance),
        (FocusMethod::Lens, None) => Err(FocusFault::Afocal),
        (_, None) => move_film_of_afocal(optics, distance),
    }
}

/// Moves the film by the lens equation in Newton's form, x x' = f f'. Its distances are from the
/// focal points, so that a distance of 1e9 m still moves the film by 1e-9 mm.
fn move_film(optics: &FirstOrder, focal: &Focal, distance: f64) -> Result<Focus, FocusFault> {
    let x = distance + focal.ffl;
    let range = focal.efl * focal.front_efl;
    let nearest = nearest_for_film(focal);
    // A distance that is a few rounding errors of the sum from the focal point is at the focal
    // point.
    if x.abs() <= 4.0 * f64::EPSILON * (distance.min(1e300) + focal.ffl.abs()) {
        return Err(FocusFault::ObjectAtFocalPoint { nearest });
    }
    let extension = range / x;
    let film_z = focal.rear_focal_point + extension;
    // A relay has a real image of an object inside its front focal point.
    if x < 0.0 && film_z < optics.length {
        return Err(FocusFault::VirtualImage { nearest });
    }
    if film_z < optics.length {
        // A nearer object has its image farther back. Solve film_z = length for the distance.
        let nearest = (focal.bfl < 0.0).then(|| range / -focal.bfl - focal.ffl);
        let nearest = nearest.filter(|d| *d > 0.0);
        return Err(FocusFault::FilmInsideLens { film_z, nearest });
    }
    Ok(Focus {
        method: FocusMethod::Film,
        distance,
        film_z,
        magnification: -focal.front_efl / x,
        image_distance: focal.efl + extension,
        extension,
    })
}

/// Moves the film of a lens without power, whose images of near objects all have the same scale.
fn move_film_of_afocal(optics: &FirstOrder, distance: f64) -> Result<Focus, FocusFault> {
    if distance.is_infinite() {
        return Err(FocusFault::Afocal);
    }
    let [a, b, _, d] = optics.matrix;
    let film_z = optics.length - optics.n_image * (a * distance / optics.n_object + b) / d;
    if film_z < optics.length {
        let nearest = Some(-b * optics.n_object / a).filter(|d| *d > 0.0);
        return Err(FocusFault::FilmInsideLens { film_z, nearest });
    }
    Ok(Focus {
        method: FocusMethod::Film,
        distance,
        film_z,
        magnification: 1.0 / d,
        image_distance: distance / d.abs(),
        extension: f64::INFINITY,
    })
}

/// The nearest distance for a film that moves: a thousandth of the focal length outside the front
/// focal point.
fn nearest_for_film(focal: &Focal) -> f64 {
    (1e-3 * focal.front_efl.abs() - focal.ffl).max(0.0)
}

/// Moves the lens by the smaller root of equation 5, T² + T(2f + t − D) + f² = 0.
///
/// With b = D − t − 2f the root is 2f²/(b + √((b − 2f)(b + 2f))). The usual formula, with a
/// difference, gives exactly 0 for an object at 1e9 m. The equation is for a lens in one medium;
/// for different media f² becomes f f'.
fn move_lens(optics: &FirstOrder, focal: &Focal, distance: f64) -> Result<Focus, FocusFault> {
    let t = focal.rear_principal_plane - focal.front_principal_plane;
    let extension = if distance.is_infinite() {
        0.0
    } else {
        let (f, g) = (focal.efl, focal.front_efl);
        // x is the distance from F to the object, and T that from F' to the film. x + T = b and
        // x T = f g.
        let b = distance - t - f - g;
        let twice = 2.0 * (f * g).sqrt();
        if !(b >= twice) {
            return Err(FocusFault::TooNear {
                nearest: t + f + g + twice,
            });
        }
        2.0 * f * g / (b + ((b - twice) * (b + twice)).sqrt())
    };
    let film_z = focal.rear_focal_point + extension;
    if film_z < optics.length {
        return Err(FocusFault::FilmInsideLens {
            film_z,
            nearest: None,
        });
    }
    Ok(Focus {
        method: FocusMethod::Lens,
        distance,
        film_z,
        magnification: -extension / focal.efl,
        image_distance: focal.efl + extension,
        extension,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prescription::{Medium, Prescription, Shape, Surface};

    /// Two ideal lenses of 100 mm, 200 mm apart or a little more: by 1/s' = 1/f - 1/s twice, the
    /// image of an object 50 mm in front is 150 mm behind, in life size and upside down.
    #[test]
    fn a_relay_has_a_real_image_of_a_near_object() {
        let relay = |gap: f64| {
            let lens = |t| {
                let plane = Surface::sphere(0.0, t, Medium::air(), 20.0);
                let shape = Shape::ThinLens {
                    focal_length: 100.0,
                };
                Surface { shape, ..plane }
            };
            Prescription::new("relay", vec![lens(gap), lens(0.0)]).first_order(587.6)
        };
        assert!(relay(200.0).focal.is_none());
        for gap in [200.0, 200.001] {
            let near = focus(&relay(gap), FocusMethod::Film, 50.0).unwrap();
            assert!((near.film_z - gap - 150.0).abs() < 0.01, "{near:?}");
            assert!((near.magnification + 1.0).abs() < 1e-4, "{near:?}");
        }
        let far = focus(&relay(200.0), FocusMethod::Film, 300.0);
        let fault = FocusFault::FilmInsideLens {
            film_z: 100.0,
            nearest: Some(200.0),
        };
        assert_eq!(far, Err(fault));
        let parallel = focus(&relay(200.0), FocusMethod::Film, f64::INFINITY);
        assert_eq!(parallel, Err(FocusFault::Afocal));
    }

    #[test]
    fn the_quadratic_keeps_its_digits_at_any_distance() {
        let lens = FirstOrder::in_air(50.0, -5.0);
        // For f = 50, t = −5 and large z, the root is T = f²/b (1 + f²/b² + 2 f⁴/b⁴ + …), where
        // b = z − t − 2f.
        for z in [1e4, 1e6, 1e9, 1e12, 1e15] {
            let b: f64 = z + 5.0 - 100.0;
            let q = 2500.0 / (b * b);
            let series = 2500.0 / b * (1.0 + q + 2.0 * q * q + 5.0 * q * q * q);
            let root = focus(&lens, FocusMethod::Lens, z).unwrap().extension;
            assert!(
                (root / series - 1.0).abs() < 1e-15,
                "z = {z}: {root} {series}"
            );
        }
        let nearest = focus(&lens, FocusMethod::Lens, 195.0).unwrap();
        assert_eq!(nearest.extension, 50.0);
        let nearer = focus(&lens, FocusMethod::Lens, 194.999);
        assert_eq!(nearer, Err(FocusFault::TooNear { nearest: 195.0 }));
    }
}
