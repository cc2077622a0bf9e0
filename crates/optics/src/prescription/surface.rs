//! A surface of a prescription and the gap behind it.

use glam::DVec2;
use ivcam_base::diag::Span;

use crate::prescription::decenter::SurfaceFrame;
use crate::prescription::glass::coating::Coating;
use crate::prescription::glass::medium::Medium;

/// The curvature of a surface, stored as it was given: as a radius or as a curvature.
///
/// A plane has curvature 0; its radius is written as 0 too, as in the files. Keeping the radius
/// as typed lets first-order optics divide by it in extended precision, and a writer print it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Curvature {
    per_mm: f64,
    radius: f64,
}

impl Curvature {
    /// The curvature of a plane.
    pub const PLANE: Self = Self {
        per_mm: 0.0,
        radius: 0.0,
    };

    /// The curvature of a radius in millimeters, which is positive if the center is on the film
    /// side. A radius of 0 is a plane.
    pub fn from_radius(radius: f64) -> Self {
        if radius == 0.0 || radius.is_infinite() {
            return Self::PLANE;
        }
        Self {
            per_mm: 1.0 / radius,
            radius,
        }
    }

    /// The curvature of a number per millimeter.
    pub fn from_curvature(per_mm: f64) -> Self {
        if per_mm == 0.0 {
            return Self::PLANE;
        }
        Self {
            per_mm,
            radius: 1.0 / per_mm,
        }
    }

    /// The curvature per millimeter.
    pub fn per_mm(self) -> f64 {
        self.per_mm
    }

    /// The radius in millimeters; 0 for a plane.
    pub fn radius(self) -> f64 {
        self.radius
    }

    /// Whether it is the curvature of a plane.
    pub fn is_plane(self) -> bool {
        self.per_mm == 0.0
    }

    fn scaled(self, factor: f64) -> Self {
        Self::from_radius(self.radius * factor)
    }

    fn reversed(self) -> Self {
        Self {
            per_mm: -self.per_mm,
            radius: -self.radius,
        }
    }
}

/// A plane through the axis. First-order data differ between the two only for cylinders and
/// toroids.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meridian {
    /// The plane of the axis and x.
    X,
    /// The plane of the axis and y.
    Y,
}

/// The highest power of r in a polynomial asphere.
pub const MAX_POWER: usize = 20;

/// The kind of a surface, apart from its curvature.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Shape {
    /// A sphere, or a plane if the curvature is 0.
    Sphere,
    /// A conic of revolution.
    Conic {
        /// The conic constant: 0 for a sphere, −1 for a paraboloid.
        k: f64,
    },
    /// A conic plus a polynomial in the distance r from the axis.
    Asphere {
        /// The conic constant.
        k: f64,
        /// The coefficients of r^p, with p from 1 to 20, in millimeters^(1−p).
        terms: Box<[f64; MAX_POWER + 1]>,
    },
    /// A conic plus a polynomial in r that is measured along the normal of the conic, as Forbes's
    /// Q-bfs are: along the axis it is the polynomial over the cosine of the normal's angle.
    NormalAsphere {
        /// The conic constant.
        k: f64,
        /// The coefficients of r^p, with p even from 2 to 20, in millimeters^(1−p).
        terms: Box<[f64; MAX_POWER + 1]>,
    },
    /// A cylinder with its axis along x. It has power in y only.
    CylinderX,
    /// A cylinder with its axis along y. It has power in x only.
    CylinderY,
    /// A profile in y, rotated about an axis parallel to y.
    Toroid {
        /// The curvature in x.
        across: Curvature,
        /// The conic constant of the profile.
        k: f64,
        /// The coefficients of y^p in the profile, in millimeters^(1−p).
        terms: Box<[f64; MAX_POWER + 1]>,
    },
    /// An ideal thin lens in the plane of the vertex. It changes the slope of a ray from the axis,
    /// times the index, by −1/f times the height, so that every point has a sharp image.
    ThinLens {
        /// The focal length in air in millimeters, negative for one that diverges. It is not 0.
        focal_length: f64,
    },
}

impl Shape {
    /// The shape of a conic constant and of terms, each a power of r and its coefficient.
    ///
    /// # Errors
    ///
    /// The first power above [`MAX_POWER`] whose coefficient is not 0.
    pub(crate) fn from_terms(
        k: f64,
        terms: impl IntoIterator<Item = (usize, f64)>,
    ) -> Result<Self, usize> {
        let mut terms: Vec<(usize, f64)> = terms.into_iter().collect();
        terms.retain(|(_, value)| *value != 0.0);
        match terms.iter().find(|(power, _)| *power > MAX_POWER) {
            Some((power, _)) => Err(*power),
            None => Ok(Self::rotational(k, polynomial(terms))),
        }
    }

    /// The simplest shape of a conic constant and the coefficients of a polynomial in r.
    pub(crate) fn rotational(k: f64, terms: Box<[f64; MAX_POWER + 1]>) -> Self {
        if terms.iter().any(|term| *term != 0.0) {
            Self::Asphere { k, terms }
        } else {
            Self::Sphere.with_conic(k)
        }
    }

    /// The shape with another coefficient of r^`power`, which is at most [`MAX_POWER`].
    pub(crate) fn with_term(self, power: usize, value: f64) -> Self {
        let (k, mut terms) = match self {
            Self::Asphere { k, terms } => (k, terms),
            Self::Conic { k } => (k, Box::new([0.0; MAX_POWER + 1])),
            _ => (0.0, Box::new([0.0; MAX_POWER + 1])),
        };
        terms[power] = value;
        Self::Asphere { k, terms }
    }

    /// The shape with another conic constant. Cylinders and toroids keep theirs, and so does a
    /// conic if the new one is 0.
    pub(crate) fn with_conic(self, k: f64) -> Self {
        match self {
            Self::Asphere { terms, .. } => Self::Asphere { k, terms },
            Self::NormalAsphere { terms, .. } => Self::NormalAsphere { k, terms },
            Self::Sphere | Self::Conic { .. } if k != 0.0 => Self::Conic { k },
            other => other,
        }
    }

    /// A toroid with this curvature in x, whose profile is a conic.
    pub(crate) fn toroid(across: Curvature, k: f64) -> Self {
        let terms = Box::new([0.0; MAX_POWER + 1]);
        Self::Toroid { across, k, terms }
    }

    /// The name of the kind, as in the JSON format.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Sphere => "sphere",
            Self::Conic { .. } => "conic",
            Self::Asphere { .. } => "asphere",
            Self::NormalAsphere { .. } => "normal_asphere",
            Self::CylinderX => "cyl_x",
            Self::CylinderY => "cyl_y",
            Self::Toroid { .. } => "toroid",
            Self::ThinLens { .. } => "thin_lens",
        }
    }

    /// Whether the surface is symmetric about the axis.
    pub fn is_rotational(&self) -> bool {
        !matches!(
            self,
            Self::CylinderX | Self::CylinderY | Self::Toroid { .. }
        )
    }

    fn map_terms(&self, f: impl Fn(usize, f64) -> f64) -> Self {
        let map = |terms: &[f64; MAX_POWER + 1]| {
            Box::new(std::array::from_fn(|power| f(power, terms[power])))
        };
        match self {
            Self::Asphere { k, terms } => Self::Asphere {
                k: *k,
                terms: map(terms),
            },
            Self::NormalAsphere { k, terms } => Self::NormalAsphere {
                k: *k,
                terms: map(terms),
            },
            Self::Toroid { across, k, terms } => Self::Toroid {
                across: *across,
                k: *k,
                terms: map(terms),
            },
            other => other.clone(),
        }
    }
}

/// The coefficients of a polynomial whose terms are powers of r, at most [`MAX_POWER`], with their
/// coefficients. The last of several terms of one power counts.
pub(crate) fn polynomial(
    terms: impl IntoIterator<Item = (usize, f64)>,
) -> Box<[f64; MAX_POWER + 1]> {
    let mut coefficients = Box::new([0.0; MAX_POWER + 1]);
    for (power, value) in terms {
        coefficients[power] = value;
    }
    coefficients
}

/// A surface and the gap to the next one.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// The kind of the surface.
    pub shape: Shape,
    /// The curvature at the vertex, without polynomial terms.
    pub curvature: Curvature,
    /// The distance along the axis to the next vertex, in millimeters. Behind the last surface it
    /// is the distance to the film if the file gives it, and 0 otherwise.
    pub thickness: f64,
    /// The medium in that gap.
    pub medium: Medium,
    /// The distance from the axis beyond which rays are blocked, in millimeters. It is infinite if
    /// the file gives none.
    pub semi_diameter: f64,
    /// The distance from the axis within which rays are blocked, in millimeters; 0 for none. It is
    /// that of a central obstruction, or of the hole in a mirror.
    pub obstruction: f64,
    /// The corners of a clear aperture that is not round, in millimeters from the axis; none for a
    /// round one. Rays outside of it are blocked, and those beyond the semi-diameter. That of a
    /// stop is the prescription's [`Iris`](crate::prescription::Iris) instead.
    pub outline: Option<Box<[DVec2]>>,
    /// Whether this is the aperture stop.
    pub is_stop: bool,
    /// Whether the surface reflects light. The medium behind it is then that in front of it, and
    /// the surfaces behind it are given as [`Prescription`](crate::prescription::Prescription)
    /// says.
    pub is_mirror: bool,
    /// How the surface is decentered and tilted; none on the axis of its neighbors.
    pub frame: Option<Box<SurfaceFrame>>,
    /// The coating of the surface.
    pub coating: Coating,
    /// The place of the surface in the file, for messages.
    pub span: Span,
}

impl Surface {
    /// The largest semi-diameter of a sphere or an ellipsoid of revolution, in millimeters: that of
    /// its equator. It is infinite for other shapes.
    pub(crate) fn widest_cap(&self) -> f64 {
        let k = match self.shape {
            Shape::Sphere => 0.0,
            Shape::Conic { k } if k > -1.0 => k,
            _ => return f64::INFINITY,
        };
        1.0 / (self.curvature.per_mm().abs() * (1.0 + k).sqrt())
    }

    /// A spherical surface, or a plane with a radius of 0.
    pub fn sphere(radius: f64, thickness: f64, medium: Medium, semi_diameter: f64) -> Self {
        Self {
            shape: Shape::Sphere,
            curvature: Curvature::from_radius(radius),
            thickness,
            medium,
            semi_diameter,
            obstruction: 0.0,
            outline: None,
            is_stop: false,
            is_mirror: false,
            frame: None,
            coating: Coating::default(),
            span: Span::default(),
        }
    }

    /// A flat stop in a medium.
    pub fn stop(thickness: f64, medium: Medium, semi_diameter: f64) -> Self {
        Self {
            is_stop: true,
            ..Self::sphere(0.0, thickness, medium, semi_diameter)
        }
    }

    /// Whether the surface is a plane. An ideal lens is none.
    pub(crate) fn is_plane(&self) -> bool {
        let is_ideal = matches!(self.shape, Shape::ThinLens { .. });
        self.curvature.is_plane() && self.shape.is_rotational() && !self.has_terms() && !is_ideal
    }

    /// Whether this is a plane without an aperture in one medium, given the medium before it. Such
    /// a plane has no effect on light.
    pub fn is_dummy(&self, before: &Medium) -> bool {
        let is_open = self.semi_diameter == f64::INFINITY && self.obstruction == 0.0;
        let is_open = is_open && self.outline.is_none();
        self.is_idle(before) && is_open && !self.is_stop
    }

    /// Whether this is a plane that neither refracts nor reflects nor tilts the axis, given the
    /// medium before it.
    pub(crate) fn is_idle(&self, before: &Medium) -> bool {
        self.is_flat_in(before) && self.frame.is_none()
    }

    /// Whether this is a plane that neither refracts nor reflects, given the medium before it. It
    /// may tilt the axis.
    pub(crate) fn is_flat_in(&self, before: &Medium) -> bool {
        self.is_plane() && !self.is_mirror && self.medium == *before
    }

    /// The step of the index that bends a ray, given the indices in front of the surface and behind
    /// it. That of a mirror is from n to −n.
    pub(crate) fn index_step(&self, [before, behind]: [f64; 2]) -> f64 {
        if self.is_mirror {
            -2.0 * before
        } else {
            behind - before
        }
    }

    /// The power per millimeter in a plane with the axis, given the indices in front of the surface
    /// and behind it: the change of the index times the slope of a first-order ray, over −1 times
    /// its height.
    pub(crate) fn power(&self, indices: [f64; 2], plane: Meridian) -> f64 {
        match self.shape {
            Shape::ThinLens { focal_length } => 1.0 / focal_length,
            _ => self.index_step(indices) * self.vertex_curvature(plane),
        }
    }

    /// How the surface is decentered, and the gap behind it along its own axis: 0 if the axis
    /// behind it is another one.
    pub(crate) fn frame_and_gap(&self) -> (SurfaceFrame, f64) {
        let frame = self.frame.as_deref().copied().unwrap_or_default();
        let gap = if frame.after.is_none() {
            self.thickness
        } else {
            0.0
        };
        (frame, gap)
    }

    /// Replaces the shape by another one that is made of it.
    pub(crate) fn change_shape(&mut self, change: impl FnOnce(Shape) -> Shape) {
        self.shape = change(std::mem::replace(&mut self.shape, Shape::Sphere));
    }

    fn has_terms(&self) -> bool {
        matches!(&self.shape, Shape::Asphere { terms, .. } | Shape::NormalAsphere { terms, .. }
            if terms.iter().any(|t| *t != 0.0))
    }

    /// The curvature at the vertex in the plane of the axis and y, or of the axis and x.
    pub(crate) fn vertex_curvature(&self, plane: Meridian) -> f64 {
        let c = self.curvature.per_mm();
        match (&self.shape, plane) {
            (Shape::CylinderX, Meridian::X) | (Shape::CylinderY, Meridian::Y) => 0.0,
            (Shape::Toroid { across, .. }, Meridian::X) => across.per_mm(),
            (Shape::Asphere { terms, .. } | Shape::NormalAsphere { terms, .. }, _)
            | (Shape::Toroid { terms, .. }, Meridian::Y) => c + 2.0 * terms[2],
            _ => c,
        }
    }

    /// The sag in millimeters: the distance of the surface behind its vertex, at a height in the
    /// plane of the axis and y. Beyond the edge of a conic the conic's part is that of a parabola.
    pub fn sag(&self, y: f64) -> f64 {
        let c = match self.shape {
            Shape::CylinderY => 0.0,
            _ => self.curvature.per_mm(),
        };
        let (k, terms) = match &self.shape {
            Shape::Conic { k } => (*k, None),
            Shape::Asphere { k, terms }
            | Shape::NormalAsphere { k, terms }
            | Shape::Toroid { k, terms, .. } => (*k, Some(terms)),
            _ => (0.0, None),
        };
        let inside = (1.0 - (1.0 + k) * c * c * y * y).max(0.0);
        let polynomial = terms.map_or(0.0, |terms| {
            let terms = terms.iter().rev();
            terms.fold(0.0, |sum, term| sum * y.abs() + term)
        });
        let polynomial = match &self.shape {
            Shape::NormalAsphere { .. } if inside > 0.0 => {
                polynomial * ((1.0 - k * c * c * y * y) / inside).sqrt()
            }
            _ => polynomial,
        };
        c * y * y / (1.0 + inside.sqrt()) + polynomial
    }

    /// The surface with every length multiplied by a factor.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        let mut shape = self.shape.map_terms(|power, term| match power {
            0 => term * factor,
            _ => term / factor.powi(power as i32 - 1),
        });
        match &mut shape {
            Shape::Toroid { across, .. } => *across = across.scaled(factor),
            Shape::ThinLens { focal_length } => *focal_length *= factor,
            _ => {}
        }
        Self {
            shape,
            curvature: self.curvature.scaled(factor),
            thickness: self.thickness * factor,
            semi_diameter: self.semi_diameter * factor,
            obstruction: self.obstruction * factor,
            outline: self
                .outline
                .as_ref()
                .map(|corners| corners.iter().map(|corner| *corner * factor).collect()),
            frame: self
                .frame
                .as_ref()
                .map(|frame| Box::new(frame.scaled(factor))),
            ..self.clone()
        }
    }

    /// The surface as seen from the other side. Its gap, medium and frame are not changed.
    pub(crate) fn reversed(&self) -> Self {
        let mut shape = self.shape.map_terms(|_, term| -term);
        if let Shape::Toroid { across, .. } = &mut shape {
            *across = across.reversed();
        }
        Self {
            shape,
            curvature: self.curvature.reversed(),
            ..self.clone()
        }
    }
}
