//! The film behind the lens, its position and its shape: tilt, swing, shift and rise, and film bent
//! to a sphere.
//!
//! A photographer moves the lens and leaves the film, so that the view stays: parallel lines that
//! face the film stay parallel. Rays are traced in lens space, where the lens stays and the film
//! moves; [`FilmPlace`] is the film there, and the transform back.

use glam::{DQuat, DVec2, DVec3};
use thiserror::Error;

use crate::diag::Diagnostic;
use crate::film::FilmFormat;

use crate::lens::lens::Lens;
use crate::lens::optics::focus::Focus;
use crate::lens::trace::meet::meet_sphere;
use crate::lens::trace::ray::LensRay;

/// How the lens is moved against the film, and how the film is bent. By default neither is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Movements {
    /// Forward about a level axis, in radians: the lens looks down, its sharp plane lies down.
    pub tilt: f64,
    /// About the upright axis, in radians: the lens looks to the right.
    pub swing: f64,
    /// Upward, in millimeters: the picture shows more of what is above.
    pub rise: f64,
    /// To the right, in millimeters.
    pub shift: f64,
    /// The radius of a spherical film, signed as in a prescription: less than 0 is hollow toward
    /// the lens. None is flat.
    pub film_radius: Option<f64>,
}

/// Why a film cannot be placed.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum PlaceFault {
    #[error("tilted so far the middle of the picture comes into focus nowhere")]
    NoFocus,
    #[error("the film reaches into the lens: {depth:.2} mm past its last vertex")]
    FilmInsideLens { depth: f64 },
    #[error("a film of radius {radius} mm does not reach its own corners, {reach:.2} mm out")]
    TooCurved { radius: f64, reach: f64 },
}

impl PlaceFault {
    pub(crate) fn diagnostic(self, lens: &str) -> Box<Diagnostic> {
        let help = match self {
            Self::NoFocus => "tilt less, or focus farther away",
            Self::FilmInsideLens { .. } => "tilt less, focus nearer, or use a smaller film",
            Self::TooCurved { .. } => "give a longer radius, or a smaller film",
        };
        Diagnostic::error(format!("`{lens}`: {self}")).with_help(help)
    }
}

/// The film in lens space. Film points are millimeters from its middle, x and y as in lens space
/// where nothing is moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmPlace {
    center: DVec3,
    /// The directions of the film's x and y, and away from the lens.
    axes: [DVec3; 3],
    curvature: f64,
    /// Turns lens space so that the film faces the camera's axis again, and then moves it, in
    /// millimeters.
    pub camera_from_lens: DQuat,
    pub offset: DVec3,
}

impl FilmPlace {
    /// A flat film across the axis.
    pub fn flat(film_z: f64) -> Self {
        Self {
            center: DVec3::new(0.0, 0.0, film_z),
            axes: [DVec3::X, DVec3::Y, DVec3::Z],
            curvature: 0.0,
            camera_from_lens: DQuat::IDENTITY,
            offset: DVec3::ZERO,
        }
    }

    /// The film of a focused lens with its movements. The lens turns about its rear principal
    /// point, and the film moves along so that the middle of the picture keeps its focus.
    pub fn new(
        lens: &Lens,
        focus: &Focus,
        movements: &Movements,
        format: FilmFormat,
    ) -> Result<Self, PlaceFault> {
        let mut this = Self::flat(focus.film_z);
        if let Some(radius) = movements.film_radius {
            let reach = format.half_diagonal();
            if !(radius.abs() > reach) {
                return Err(PlaceFault::TooCurved { radius, reach });
            }
            this.curvature = 1.0 / radius;
        }
        if movements.moves_lens() {
            this.move_lens(lens, focus, movements)?;
        }
        let rear_z = lens.length();
        let depth = this
            .landmarks(format)
            .map(|p| rear_z - p.z)
            .fold(f64::NEG_INFINITY, f64::max);
        // Without movements, focusing has checked this already.
        if !(depth < 0.0) && *movements != Movements::default() {
            return Err(PlaceFault::FilmInsideLens { depth });
        }
        Ok(this)
    }

    /// With a = cos of the whole turn and b the part of the movement along the lens's axis, the
    /// film's middle is a v + b behind the rear principal point, v being its distance along the
    /// view. The object there, u along the view, is at u/v times that in front of the lens; the
    /// lens equation with both gives v = (f − b)/(a − f/u), and f/u = 1 − f/v₀ of the lens
    /// unmoved.
    fn move_lens(
        &mut self,
        lens: &Lens,
        focus: &Focus,
        movements: &Movements,
    ) -> Result<(), PlaceFault> {
        let focal = lens.first_order().focal.ok_or(PlaceFault::NoFocus)?;
        let pivot = focal.rear_principal_plane * DVec3::Z;
        let moved = DVec3::new(movements.shift, movements.rise, 0.0);
        let turn =
            half_turned(DVec3::NEG_Y, movements.swing) * half_turned(DVec3::NEG_X, movements.tilt);
        let back = turn.inverse();
        let (a, b) = ((back * DVec3::Z).z, -(back * moved).z);
        let v = (focal.efl - b) / (a - 1.0 + focal.efl / focus.image_distance);
        if !(v.is_finite() && v * focus.image_distance > 0.0) {
            return Err(PlaceFault::NoFocus);
        }
        self.center = pivot + back * (v * DVec3::Z - moved);
        self.axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| back * axis);
        self.camera_from_lens = turn;
        self.offset = pivot + moved - turn * pivot;
        Ok(())
    }

    /// The place of a film point.
    #[inline(always)]
    pub fn point(&self, film: DVec2) -> DVec3 {
        let [x, y, z] = self.axes;
        self.center + film.x * x + film.y * y + self.sag(film) * z
    }

    /// The unit normal of the film there, toward the lens.
    #[inline(always)]
    pub(crate) fn normal(&self, film: DVec2) -> DVec3 {
        let [x, y, z] = self.axes;
        let c = self.curvature;
        c * film.x * x + c * film.y * y - (1.0 - c * self.sag(film)) * z
    }

    /// The film point that a ray from the lens falls on.
    pub(crate) fn meet(&self, ray: &LensRay) -> Option<DVec2> {
        let seen = |v: DVec3| DVec3::from_array(self.axes.map(|axis| axis.dot(v)));
        let (from, d) = (seen(ray.origin - self.center), seen(ray.direction));
        let hit = meet_sphere(self.curvature, from, d, 1.0).filter(|_| d.z > 0.0)?;
        Some(hit.point.truncate())
    }

    /// The point of the film behind a point across the axis. None beside a film that is bent.
    pub(crate) fn over(&self, across: DVec2) -> Option<DVec3> {
        let ray = LensRay {
            origin: across.extend(self.center.z),
            direction: DVec3::Z,
        };
        Some(self.point(self.meet(&ray)?))
    }

    /// The directions of the film's x and y where it is flat.
    pub(crate) fn across(&self) -> [DVec3; 2] {
        [self.axes[0], self.axes[1]]
    }

    /// Whether the film is symmetric about the axis of the lens.
    pub fn is_centered(&self) -> bool {
        self.axes[2] == DVec3::Z && self.center.truncate() == DVec2::ZERO
    }

    #[inline(always)]
    fn sag(&self, film: DVec2) -> f64 {
        let c = self.curvature;
        let r2 = film.length_squared();
        c * r2 / (1.0 + (1.0 - c * c * r2).max(0.0).sqrt())
    }

    /// The corners, the middles of the sides, and the middle.
    fn landmarks(&self, format: FilmFormat) -> impl Iterator<Item = DVec3> {
        let half = 0.5 * DVec2::new(format.width, format.height);
        let steps = [-1.0, 0.0, 1.0];
        steps
            .into_iter()
            .flat_map(move |y| steps.map(|x| self.point(half * DVec2::new(x, y))))
    }
}

impl Movements {
    /// The movements that are not 0, with a name and a value in words.
    pub(crate) fn said(&self) -> impl Iterator<Item = (&'static str, String)> {
        let degrees = |angle: f64| format!("{} degrees", (angle.to_degrees() * 1e6).round() / 1e6);
        let length = |mm: f64| format!("{mm} mm");
        let moved = [
            ("tilt", self.tilt, degrees(self.tilt)),
            ("swing", self.swing, degrees(self.swing)),
            ("rise", self.rise, length(self.rise)),
            ("shift", self.shift, length(self.shift)),
        ];
        let bent = self.film_radius.map(|r| ("film radius", r, length(r)));
        let all = moved.into_iter().chain(bent);
        all.filter(|(_, value, _)| *value != 0.0)
            .map(|(name, _, words)| (name, words))
    }

    fn moves_lens(&self) -> bool {
        [self.tilt, self.swing, self.rise, self.shift] != [0.0; 4]
    }
}

/// A rotation about a unit axis, by sine and cosine that are the same on every machine.
fn half_turned(axis: DVec3, angle: f64) -> DQuat {
    let (sin, cos) = libm::sincos(0.5 * angle);
    let v = sin * axis;
    DQuat::from_xyzw(v.x, v.y, v.z, cos)
}
