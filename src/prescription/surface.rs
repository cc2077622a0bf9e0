//! One surface of a lens and the gap behind it, as a prescription gives them.

use crate::diag::Span;

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
    pub const PLANE: Self = Self {
        per_mm: 0.0,
        radius: 0.0,
    };

    /// From a radius in millimeters, positive with the center on the film side; 0 is a plane.
    pub fn from_radius(radius: f64) -> Self {
        if radius == 0.0 || radius.is_infinite() {
            return Self::PLANE;
        }
        Self {
            per_mm: 1.0 / radius,
            radius,
        }
    }

    /// From a curvature per millimeter.
    pub(crate) fn from_curvature(per_mm: f64) -> Self {
        if per_mm == 0.0 {
            return Self::PLANE;
        }
        Self {
            per_mm,
            radius: 1.0 / per_mm,
        }
    }

    pub fn per_mm(self) -> f64 {
        self.per_mm
    }

    /// The radius in millimeters; 0 for a plane.
    pub fn radius(self) -> f64 {
        self.radius
    }

    pub(crate) fn is_plane(self) -> bool {
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

/// A plane through the axis. First-order data differ between the two only for cylinders and toroids.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plane {
    X,
    Y,
}

/// The highest power of r in a polynomial asphere.
pub(crate) const MAX_POWER: usize = 20;

/// The kind of a surface, apart from its curvature.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A sphere, or a plane where the curvature is 0.
    Sphere,
    /// A conic of revolution: `k` is 0 for a sphere, −1 for a paraboloid.
    Conic { k: f64 },
    /// A conic plus Σ `terms[p]` r^p, with p from 1 to 20, in millimeters^(1−p).
    Asphere {
        k: f64,
        terms: Box<[f64; MAX_POWER + 1]>,
    },
    /// A cylinder with its axis along x: power in y only.
    CylinderX,
    /// A cylinder with its axis along y: power in x only.
    CylinderY,
    /// A profile in y (curvature, conic and terms in y) turned about an axis parallel to y; the
    /// curvature across, in x, is `across`.
    Toroid {
        across: Curvature,
        k: f64,
        terms: Box<[f64; MAX_POWER + 1]>,
    },
}

impl Shape {
    /// The name of the kind, as in the JSON format.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Sphere => "sphere",
            Self::Conic { .. } => "conic",
            Self::Asphere { .. } => "asphere",
            Self::CylinderX => "cyl_x",
            Self::CylinderY => "cyl_y",
            Self::Toroid { .. } => "toroid",
        }
    }

    /// Whether the surface is symmetric about the axis.
    pub(crate) fn is_rotational(&self) -> bool {
        matches!(
            self,
            Self::Sphere | Self::Conic { .. } | Self::Asphere { .. }
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
            Self::Toroid { across, k, terms } => Self::Toroid {
                across: *across,
                k: *k,
                terms: map(terms),
            },
            other => other.clone(),
        }
    }
}

/// A surface and the gap to the next one.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    pub shape: Shape,
    pub curvature: Curvature,
    /// Distance along the axis to the next vertex; behind the last surface, to the film as the
    /// file gives it (0 where it does not).
    pub thickness: f64,
    /// What fills that gap.
    pub medium: Medium,
    /// Rays farther than this from the axis are blocked. Infinite if the file gives none.
    pub semi_diameter: f64,
    /// Whether this is the aperture stop.
    pub is_stop: bool,
    /// The coating on it.
    pub coating: Coating,
    /// Where the surface stands in the file, for messages.
    pub span: Span,
}

impl Surface {
    /// A spherical surface, or a plane with a radius of 0.
    pub fn sphere(radius: f64, thickness: f64, medium: Medium, semi_diameter: f64) -> Self {
        Self {
            shape: Shape::Sphere,
            curvature: Curvature::from_radius(radius),
            thickness,
            medium,
            semi_diameter,
            is_stop: false,
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

    pub(crate) fn is_plane(&self) -> bool {
        self.curvature.is_plane() && self.shape.is_rotational() && !self.has_terms()
    }

    fn has_terms(&self) -> bool {
        matches!(&self.shape, Shape::Asphere { terms, .. } if terms.iter().any(|t| *t != 0.0))
    }

    /// The curvature at the vertex in the plane of the axis and y, or of the axis and x.
    pub(crate) fn vertex_curvature(&self, plane: Plane) -> f64 {
        let c = self.curvature.per_mm();
        match (&self.shape, plane) {
            (Shape::CylinderX, Plane::X) | (Shape::CylinderY, Plane::Y) => 0.0,
            (Shape::Toroid { across, .. }, Plane::X) => across.per_mm(),
            (Shape::Asphere { terms, .. }, _) | (Shape::Toroid { terms, .. }, Plane::Y) => {
                c + 2.0 * terms[2]
            }
            _ => c,
        }
    }

    /// How far the surface is behind its vertex at a height in the plane of the axis and y, in
    /// millimeters; past the edge of a conic, as far as there.
    pub fn sag(&self, y: f64) -> f64 {
        let c = match self.shape {
            Shape::CylinderY => 0.0,
            _ => self.curvature.per_mm(),
        };
        let (k, terms) = match &self.shape {
            Shape::Conic { k } => (*k, None),
            Shape::Asphere { k, terms } | Shape::Toroid { k, terms, .. } => (*k, Some(terms)),
            _ => (0.0, None),
        };
        let inside = (1.0 - (1.0 + k) * c * c * y * y).max(0.0);
        let polynomial = terms.map_or(0.0, |terms| {
            let terms = terms.iter().rev();
            terms.fold(0.0, |sum, term| sum * y.abs() + term)
        });
        c * y * y / (1.0 + inside.sqrt()) + polynomial
    }

    /// The surface with every length multiplied.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        let mut shape = self.shape.map_terms(|power, term| match power {
            0 => term * factor,
            _ => term / factor.powi(power as i32 - 1),
        });
        if let Shape::Toroid { across, .. } = &mut shape {
            *across = across.scaled(factor);
        }
        Self {
            shape,
            curvature: self.curvature.scaled(factor),
            thickness: self.thickness * factor,
            semi_diameter: self.semi_diameter * factor,
            ..self.clone()
        }
    }

    /// The surface seen from the other side. Its gap and medium are not changed.
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
