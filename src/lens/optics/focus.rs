//! Where the film goes, or the lens, to bring a distance into focus: the paraxial answers.
//!
//! Two methods, both from the paper. The film moves and the lens stays with its front vertex at
//! the eye (the default, and what the 1999 program did): the distance is from the front vertex.
//! Or the film stays and the whole lens moves (Kolb's quadratic, equation 5): the distance is
//! from the film, as on the scale of a real camera.

use thiserror::Error;

use crate::diag::{Diagnostic, ErrorKind};
use crate::prescription::first_order::{FirstOrder, Focal};

/// What moves when the lens is focused.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FocusMethod {
    /// The film, by the lens equation; distances are from the front vertex.
    #[default]
    Film,
    /// The whole lens, by equation 5; distances are from the film.
    Lens,
    /// The focusing group of the prescription; the film stays where infinity has it, and
    /// distances are from the front vertex. Only [`Lens::focused`](crate::lens::Lens::focused) can do it.
    Group,
    /// The film, to the least spot of real rays instead of the paraxial image; distances are
    /// from the front vertex. It needs rays too: [`Lens::focused`](crate::lens::Lens::focused).
    Best,
}

impl FocusMethod {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Film => "film",
            Self::Lens => "lens",
            Self::Group => "group",
            Self::Best => "best",
        }
    }
}

/// A lens in focus. Millimeters, z from the front vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Focus {
    pub method: FocusMethod,
    /// From the front vertex (film moved) or from the film (lens moved); infinite is legal.
    pub distance: f64,
    pub film_z: f64,
    /// Image height over object height, negative where the image is upside down.
    pub magnification: f64,
    /// From the rear principal plane to the film: the z of the paper's equations 6 and 7.
    pub image_distance: f64,
    /// How far the focused part has moved from its place at infinity: the film backward, or the
    /// lens forward (the T of equation 5).
    pub extension: f64,
}

impl Focus {
    /// The height angle of the whole film by equation 7, θ = 2 atan(h/z), in radians; `height`
    /// is half of the film's height, 12 mm in the paper.
    pub(crate) fn height_angle(&self, height: f64) -> f64 {
        2.0 * libm::atan(height / self.image_distance.abs())
    }
}

/// Why a distance cannot be in focus. Distances are in millimeters, counted as they were given.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum FocusFault {
    #[error("the focus distance is not a positive number")]
    NotADistance,
    #[error("the lens has no focal length (it is afocal)")]
    Afocal,
    #[error("the object is at the front focal point: its image is at infinity")]
    ObjectAtFocalPoint { nearest: f64 },
    #[error("the object is inside the front focal point: its image is virtual")]
    VirtualImage { nearest: f64 },
    #[error("the object is nearer than the lens can be moved for")]
    TooNear { nearest: f64 },
    #[error("the prescription has no focusing group")]
    NoGroup,
    #[error("no rays get through to focus by")]
    NoRays,
    #[error("the image is inside the lens: the film would stand in the glass")]
    FilmInsideLens { film_z: f64, nearest: Option<f64> },
}

impl FocusFault {
    /// The nearest distance that does focus, in millimeters, where there is one.
    pub fn nearest(self) -> Option<f64> {
        match self {
            Self::ObjectAtFocalPoint { nearest }
            | Self::VirtualImage { nearest }
            | Self::TooNear { nearest } => Some(nearest),
            Self::FilmInsideLens { nearest, .. } => nearest,
            Self::NotADistance | Self::Afocal | Self::NoGroup | Self::NoRays => None,
        }
    }

    /// One word for the machine-readable face.
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

    pub(crate) fn diagnostic(self, lens: &str) -> Box<Diagnostic> {
        let help = match self {
            Self::NotADistance => "give a distance in meters, such as 1.2, or `inf`".to_owned(),
            Self::NoGroup => "move the film or the whole lens instead".to_owned(),
            Self::NoRays => "open the stop, or focus by the paraxial image".to_owned(),
            Self::Afocal => "an afocal lens makes no image on a film".to_owned(),
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

/// Millimeters as meters with four digits, rounded to the side on which the printed distance works.
fn meters(length: f64, round: fn(f64) -> f64) -> String {
    let unit = libm::pow(10.0, libm::floor(libm::log10(length.abs().max(1e-9))) - 3.0);
    format!(
        "{} m",
        (round(length / unit) * unit / 1000.0 * 1e9).round() / 1e9
    )
}

/// Focuses from first-order data alone, moving the film or the whole lens. A method that needs
/// more than those moves the film.
pub(crate) fn focus(
    optics: &FirstOrder,
    method: FocusMethod,
    distance: f64,
) -> Result<Focus, FocusFault> {
    if !(distance > 0.0) {
        return Err(FocusFault::NotADistance);
    }
    let focal = optics.focal.ok_or(FocusFault::Afocal)?;
    match method {
        FocusMethod::Lens => move_lens(optics, &focal, distance),
        _ => move_film(optics, &focal, distance),
    }
}

/// The lens equation in Newton's form, x x' = f f': counted from the focal points, so that a
/// distance of 1e9 m still moves the film by its 1e-9 mm.
fn move_film(optics: &FirstOrder, focal: &Focal, distance: f64) -> Result<Focus, FocusFault> {
    let x = distance + focal.ffl;
    let range = focal.efl * focal.front_efl;
    let nearest = nearest_for_film(focal);
    // A few rounding errors of the sum from the focal point is the focal point.
    if x.abs() <= 4.0 * f64::EPSILON * (distance.min(1e300) + focal.ffl.abs()) {
        return Err(FocusFault::ObjectAtFocalPoint { nearest });
    }
    if x < 0.0 {
        return Err(FocusFault::VirtualImage { nearest });
    }
    let extension = range / x;
    let film_z = focal.rear_focal_point + extension;
    if film_z < optics.length {
        // Moving the object nearer moves the image back; solve film_z = length for the distance.
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

/// Just outside the front focal point, by a thousandth of the focal length.
fn nearest_for_film(focal: &Focal) -> f64 {
    (1e-3 * focal.front_efl.abs() - focal.ffl).max(0.0)
}

/// Equation 5, T² + T(2f + t − D) + f² = 0, by its smaller root.
///
/// With b = D − t − 2f the root is 2f²/(b + √((b − 2f)(b + 2f))); the plain difference gives
/// exactly 0 for an object at 1e9 m. Written for a lens in one medium, as in the paper; indices
/// that differ enter as f f'.
fn move_lens(optics: &FirstOrder, focal: &Focal, distance: f64) -> Result<Focus, FocusFault> {
    let t = focal.rear_principal_plane - focal.front_principal_plane;
    let extension = if distance.is_infinite() {
        0.0
    } else {
        let (f, g) = (focal.efl, focal.front_efl);
        // From F to the object plus from F' to the film: x + T with x T = f g.
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

    /// A lens in air with its front principal plane at the origin.
    fn lens_of(f: f64, t: f64) -> FirstOrder {
        FirstOrder {
            length: 0.0,
            n_object: 1.0,
            n_image: 1.0,
            matrix: [1.0, 0.0, -1.0 / f, 1.0],
            power: 1.0 / f,
            focal: Some(Focal {
                efl: f,
                front_efl: f,
                bfl: t + f,
                ffl: -f,
                front_focal_point: -f,
                rear_focal_point: t + f,
                front_principal_plane: 0.0,
                rear_principal_plane: t,
            }),
            stop: None,
            entrance_pupil: None,
            exit_pupil: None,
        }
    }

    /// The exact roots, to 40 digits, of T² + T(2f + t − z) + f² for f = 50, t = −5.
    #[test]
    fn the_quadratic_keeps_its_digits_at_any_distance() {
        let lens = lens_of(50.0, -5.0);
        // For large z, T = f²/b (1 + f²/b² + 2 f⁴/b⁴ + …) with b = z − t − 2f.
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
