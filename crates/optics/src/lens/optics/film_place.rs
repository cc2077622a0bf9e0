//! The position and the shape of the film behind the lens: tilt, swing, shift and rise, and film
//! bent to a sphere.
//!
//! A photographer moves the lens and leaves the film where it is, so that the perspective does not
//! change: parallel lines that face the film stay parallel. Rays are traced in lens space, where
//! the lens is fixed and the film moves. [`FilmPlace`] is the film in lens space, with the
//! transform back.

use glam::{DQuat, DVec2, DVec3};
use ivcam_base::diag::Diagnostic;
use thiserror::Error;

use crate::film::FilmFormat;
use crate::lens::lens::Lens;
use crate::lens::optics::focus::Focus;
use crate::lens::trace::intersect::intersect_sphere;
use crate::lens::trace::ray::LensRay;
use crate::prescription::first_order::FirstOrder;

/// The movements of the lens relative to the film, and the curvature of the film. The default has
/// no movement and a flat film.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Movements {
    /// The rotation of the lens forward about a horizontal axis, in radians: the lens points down,
    /// and the plane of sharp focus tilts toward the ground.
    pub tilt: f64,
    /// The rotation of the lens about the vertical axis, in radians: the lens points to the right.
    pub swing: f64,
    /// The displacement of the lens upward, in millimeters: the picture shows more of what is
    /// above.
    pub rise: f64,
    /// The displacement of the lens to the right, in millimeters.
    pub shift: f64,
    /// The radius of a spherical film in millimeters, signed as in a prescription: a film with a
    /// negative radius is hollow toward the lens. None is a flat film.
    pub film_radius: Option<f64>,
}

/// The reason why a film cannot be placed.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum PlaceFault {
    /// The lens is tilted so far that no film position brings the middle of the picture into focus.
    #[error("tilted so far that the middle of the picture is nowhere in focus")]
    NoFocus,
    /// A part of the film would be in front of the last vertex of the lens.
    #[error("the film reaches into the lens: {depth:.2} mm past its last vertex")]
    FilmInsideLens {
        /// The greatest distance of the film in front of the last vertex, in millimeters.
        depth: f64,
    },
    /// The radius of a spherical film is less than half of its diagonal.
    #[error("a film of radius {radius} mm does not reach its own corners, {reach:.2} mm out")]
    TooCurved {
        /// The radius of the film, in millimeters.
        radius: f64,
        /// Half of the film's diagonal, in millimeters.
        reach: f64,
    },
}

impl PlaceFault {
    /// The error message for a lens of the given name, with advice.
    pub fn diagnostic(self, lens: &str) -> Box<Diagnostic> {
        let help = match self {
            Self::NoFocus => "tilt less, or focus farther away",
            Self::FilmInsideLens { .. } => "tilt less, focus nearer, or use a smaller film",
            Self::TooCurved { .. } => "give a longer radius, or a smaller film",
        };
        Diagnostic::error(format!("`{lens}`: {self}")).with_help(help)
    }
}

/// The film in lens space. Film points are in millimeters from its middle; without movements, their
/// x and y are those of lens space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmPlace {
    /// The middle of the film, in millimeters.
    center: DVec3,
    /// The unit vectors along the film's x and y, and away from the lens.
    axes: [DVec3; 3],
    /// The curvature of the film, per millimeter; 0 for a flat film.
    curvature: f64,
    /// The rotation of lens space after which the film is perpendicular to the camera's axis.
    pub camera_from_lens: DQuat,
    /// The translation that follows the rotation, in millimeters.
    pub offset: DVec3,
}

impl FilmPlace {
    /// A flat film perpendicular to the axis at a z, in millimeters.
    pub fn flat(film_z: f64) -> Self {
        Self {
            center: DVec3::new(0.0, 0.0, film_z),
            axes: [DVec3::X, DVec3::Y, DVec3::Z],
            curvature: 0.0,
            camera_from_lens: DQuat::IDENTITY,
            offset: DVec3::ZERO,
        }
    }

    /// The film of a focused lens with its movements. The lens rotates about its rear principal
    /// point, and the film moves along the view so that the middle of the picture stays in focus.
    ///
    /// # Errors
    ///
    /// Returns a [`PlaceFault`] if there is no such position, or if it is not behind the lens.
    pub fn new(
        lens: &Lens,
        focus: &Focus,
        movements: &Movements,
        format: FilmFormat,
    ) -> Result<Self, PlaceFault> {
        Self::behind(lens.first_order(), lens.length(), focus, movements, format)
    }

    /// The film of [`Self::new`] for a lens that is known by its first-order data and the z of its
    /// last vertex, in millimeters.
    ///
    /// # Errors
    ///
    /// Those of [`Self::new`].
    pub fn behind(
        optics: &FirstOrder,
        rear_z: f64,
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
            this.move_lens(optics, focus, movements)?;
        }
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

    /// Moves the lens, or rather the film relative to the lens.
    ///
    /// Let a be the cosine of the whole rotation, b the component of the displacement along the
    /// lens's axis, and v the distance of the film's middle along the view. Along the lens's axis
    /// the middle is a v + b behind the rear principal point. An object at the distance u along the
    /// view is u/v times as far in front of the lens. The lens equation for both gives v = (f −
    /// b)/(a − f/u), and f/u = 1 − f/v₀, where v₀ is the image distance of the lens before it is
    /// moved.
    fn move_lens(
        &mut self,
        optics: &FirstOrder,
        focus: &Focus,
        movements: &Movements,
    ) -> Result<(), PlaceFault> {
        let focal = optics.focal.ok_or(PlaceFault::NoFocus)?;
        let pivot = focal.rear_principal_plane * DVec3::Z;
        let moved = DVec3::new(movements.shift, movements.rise, 0.0);
        let turn = rotation(DVec3::NEG_Y, movements.swing) * rotation(DVec3::NEG_X, movements.tilt);
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

    /// The position of a film point in lens space, in millimeters.
    #[inline(always)]
    pub fn point(&self, film: DVec2) -> DVec3 {
        let [x, y, z] = self.axes;
        self.center + film.x * x + film.y * y + self.sag(film) * z
    }

    /// The unit normal of the film at a film point, toward the lens.
    #[inline(always)]
    pub fn normal(&self, film: DVec2) -> DVec3 {
        let [x, y, z] = self.axes;
        let c = self.curvature;
        c * film.x * x + c * film.y * y - (1.0 - c * self.sag(film)) * z
    }

    /// The film point that a ray from the lens hits; none if it misses.
    pub fn intersect(&self, ray: &LensRay) -> Option<DVec2> {
        let to_film = |v: DVec3| DVec3::from_array(self.axes.map(|axis| axis.dot(v)));
        let (from, d) = (to_film(ray.origin - self.center), to_film(ray.direction));
        let hit = intersect_sphere(self.curvature, from, d, 1.0).filter(|_| d.z > 0.0)?;
        Some(hit.point.truncate())
    }

    /// The point of the film on the line parallel to the axis through the given x and y of lens
    /// space; none if a bent film does not reach that line.
    pub(crate) fn over(&self, across: DVec2) -> Option<DVec3> {
        let ray = LensRay::new(across.extend(self.center.z), DVec3::Z);
        Some(self.point(self.intersect(&ray)?))
    }

    /// The unit vectors along the x and y of a flat film.
    pub fn across(&self) -> [DVec3; 2] {
        [self.axes[0], self.axes[1]]
    }

    /// Whether the film is symmetric about the axis of the lens.
    pub fn is_centered(&self) -> bool {
        self.axes[2] == DVec3::Z && self.center.truncate() == DVec2::ZERO
    }

    /// The distance of a film point from the tangent plane at the film's middle, away from the
    /// lens.
    #[inline(always)]
    fn sag(&self, film: DVec2) -> f64 {
        let c = self.curvature;
        let r2 = film.length_squared();
        c * r2 / (1.0 + (1.0 - c * c * r2).max(0.0).sqrt())
    }

    /// The corners, the middles of the sides, and the middle, in lens space.
    fn landmarks(&self, format: FilmFormat) -> impl Iterator<Item = DVec3> {
        let half = 0.5 * DVec2::new(format.width, format.height);
        let steps = [-1.0, 0.0, 1.0];
        steps
            .into_iter()
            .flat_map(move |y| steps.map(|x| self.point(half * DVec2::new(x, y))))
    }
}

impl Movements {
    /// The movements that are not 0, each with its name and its value with a unit.
    pub fn described(&self) -> impl Iterator<Item = (&'static str, String)> {
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
            .map(|(name, _, text)| (name, text))
    }

    /// Whether the lens is moved.
    fn moves_lens(&self) -> bool {
        [self.tilt, self.swing, self.rise, self.shift] != [0.0; 4]
    }
}

/// A rotation about a unit axis by an angle in radians. Its sine and cosine are the same on every
/// machine.
fn rotation(axis: DVec3, angle: f64) -> DQuat {
    let (sin, cos) = libm::sincos(0.5 * angle);
    let v = sin * axis;
    DQuat::from_xyzw(v.x, v.y, v.z, cos)
}
