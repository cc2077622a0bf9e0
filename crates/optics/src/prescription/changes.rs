//! Changes of single numbers of a prescription, for optimizers and tolerances.

use ivcam_base::diag::{Diagnostic, Result};

use crate::prescription::glass::medium::D_LINE;
use crate::prescription::prescription::Prescription;
use crate::prescription::surface::{Curvature, Shape};

/// A number of a surface. Radii and thicknesses have the signs of files: behind mirrors those of a
/// straight axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Quantity {
    /// The radius of curvature in millimeters; 0 for a plane.
    Radius,
    /// The curvature per millimeter.
    Curvature,
    /// The thickness behind the surface in millimeters.
    Thickness,
    /// The index `n_d` of the medium behind it. The Abbe number stays, and n − 1 changes by the
    /// same factor at each wavelength.
    Index,
    /// The Abbe number of that medium. The index stays, and n − n_d changes by the same factor at
    /// each wavelength. A glass that is opaque at the d line has none.
    Abbe,
    /// The conic constant.
    Conic,
    /// The semi-diameter in millimeters.
    SemiDiameter,
}

impl Quantity {
    /// All quantities, with the names that ivcam's JSON has for them.
    pub const ALL: [(&'static str, Self); 7] = [
        ("R", Self::Radius),
        ("c", Self::Curvature),
        ("t", Self::Thickness),
        ("n_d", Self::Index),
        ("V_d", Self::Abbe),
        ("k", Self::Conic),
        ("semi_diameter", Self::SemiDiameter),
    ];

    /// The quantity with a name.
    pub fn named(name: &str) -> Option<Self> {
        let found = Self::ALL.iter().find(|(known, _)| *known == name);
        found.map(|(_, quantity)| *quantity)
    }
}

/// Another value for a number of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// The number of the surface, from 0.
    pub surface: usize,
    /// What changes.
    pub quantity: Quantity,
    /// The new value.
    pub value: f64,
}

impl Prescription {
    /// The lens with other values.
    ///
    /// # Errors
    ///
    /// Returns an error if a surface is not there, or a value is not possible.
    pub fn with_changes(&self, changes: &[Change]) -> Result<Self> {
        let mut lens = match self.has_mirrors() {
            true => self.folded(),
            false => self.clone(),
        };
        for change in changes {
            lens.change(change)?;
        }
        Ok(match self.has_mirrors() {
            true => lens.folded(),
            false => lens,
        })
    }

    /// The value of a number of a surface, in the signs of files; none if it has none.
    pub fn value_of(&self, surface: usize, quantity: Quantity) -> Option<f64> {
        let sign = self.facings();
        let found = self.surfaces.get(surface)?;
        Some(match quantity {
            Quantity::Radius => sign[surface] * found.curvature.radius(),
            Quantity::Curvature => sign[surface] * found.curvature.per_mm(),
            Quantity::Thickness => sign[surface + 1] * found.thickness,
            Quantity::Index => found.medium.n_d,
            Quantity::Abbe if found.medium.doubt_at(D_LINE).is_some() => return None,
            Quantity::Abbe => found.medium.abbe()?,
            Quantity::Conic => match &found.shape {
                Shape::Sphere => 0.0,
                Shape::Conic { k }
                | Shape::Asphere { k, .. }
                | Shape::NormalAsphere { k, .. }
                | Shape::Toroid { k, .. } => *k,
                _ => return None,
            },
            Quantity::SemiDiameter => found.semi_diameter,
        })
    }

    /// Makes a change, in the signs of files.
    fn change(&mut self, change: &Change) -> Result<()> {
        let Change {
            surface: number,
            quantity,
            value,
        } = *change;
        let count = self.surfaces.len();
        let Some(surface) = self.surfaces.get_mut(number) else {
            let message = format!("there is no surface {number}: the lens has {count}");
            return Err(Diagnostic::error(message).with_help("surfaces count from 0"));
        };
        let is_possible = match quantity {
            Quantity::Index => value >= 1.0,
            Quantity::Abbe | Quantity::SemiDiameter => value > 0.0,
            _ => true,
        };
        if !(value.is_finite() && is_possible) {
            let name = Quantity::ALL.iter().find(|(_, known)| *known == quantity);
            let name = name.map_or("", |(name, _)| name);
            let message = format!("{value} is not possible for `{name}` of surface {number}");
            return Err(Diagnostic::error(message));
        }
        let bends = matches!(
            quantity,
            Quantity::Radius | Quantity::Curvature | Quantity::Conic
        );
        if bends && matches!(surface.shape, Shape::ThinLens { .. }) {
            let message = format!("surface {number} is an ideal lens, which has no shape");
            return Err(Diagnostic::error(message).with_help("change the thicknesses around it"));
        }
        match quantity {
            Quantity::Radius => surface.curvature = Curvature::from_radius(value),
            Quantity::Curvature => surface.curvature = Curvature::from_curvature(value),
            Quantity::Thickness => surface.thickness = value,
            Quantity::Index => surface.medium = surface.medium.with_n_d(value),
            Quantity::Abbe => {
                surface.medium = surface.medium.with_abbe(value).ok_or_else(|| {
                    let message = format!("the glass of surface {number} has no Abbe number");
                    Diagnostic::error(message).with_help("it is opaque at the d line")
                })?;
            }
            Quantity::Conic => surface.change_shape(|shape| match shape {
                Shape::Conic { .. } | Shape::Sphere => Shape::Sphere.with_conic(value),
                other => other.with_conic(value),
            }),
            Quantity::SemiDiameter => surface.semi_diameter = value,
        }
        Ok(())
    }
}
