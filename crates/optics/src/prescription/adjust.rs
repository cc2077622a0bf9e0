//! Prescriptions with another focal length or another stop.

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::math::Mm;

use crate::prescription::about::About;
use crate::prescription::first_order::FirstOrder;
use crate::prescription::glass::medium::D_LINE;
use crate::prescription::prescription::Prescription;
use crate::prescription::surface::Meridian;

/// The largest factor of a scale, and one over the smallest. A lens of 100 mm would be as large as
/// the orbit of Earth.
const LARGEST_FACTOR: f64 = 1e12;

impl Prescription {
    /// The first-order data in the plane of the axis and y at a wavelength.
    pub(crate) fn first_order(&self, wavelength_nm: f64) -> FirstOrder {
        FirstOrder::of(self, &self.indices(wavelength_nm), Meridian::Y)
    }

    /// Scales the lens to a focal length at a wavelength.
    ///
    /// # Errors
    ///
    /// Returns an error for an afocal lens, which has no focal length, and for a factor that is
    /// negative or beyond 1e12.
    pub fn scaled_to(&self, efl: Mm, wavelength_nm: f64) -> Result<Self> {
        let old = self.first_order(wavelength_nm).efl();
        let factor = efl.0 / old;
        if !(1.0 / LARGEST_FACTOR..=LARGEST_FACTOR).contains(&factor) {
            return Err(Diagnostic::error(format!(
                "`{}` has a focal length of {old} mm and can't be scaled to {} mm",
                self.name, efl.0
            ))
            .with_help("scale by a factor greater than 0 instead"));
        }
        Ok(self.scaled(factor))
    }

    /// Scales the lens to the nominal focal length that its file states, if it does.
    ///
    /// # Errors
    ///
    /// Returns an error for an afocal lens, which has no focal length.
    pub(crate) fn at_nominal_size(self) -> Result<Self> {
        let Some(nominal) = About::of(&self).nominal_mm else {
            return Ok(self);
        };
        let mut lens = self.scaled_to(Mm(nominal), D_LINE)?;
        for note in &mut lens.notes {
            if note.starts_with("focal length: ") {
                *note = format!("focal length: {nominal} mm");
            }
        }
        Ok(lens)
    }

    /// Closes (or opens) the stop to a semi-diameter, in all zoom positions. Without a marked stop
    /// it is the surface that limits an axial beam at the wavelength.
    ///
    /// # Errors
    ///
    /// Returns an error if the lens has no stop, or if the length is not greater than 0.
    pub fn with_stop(&self, semi_diameter: Mm, wavelength_nm: f64) -> Result<Self> {
        let Some(stop) = self.first_order(wavelength_nm).stop else {
            return Err(
                Diagnostic::error(format!("`{}` has no stop to close", self.name))
                    .with_help("give one of its surfaces an aperture"),
            );
        };
        if !(semi_diameter.0 > 0.0 && semi_diameter.0.is_finite()) {
            return Err(Diagnostic::error(format!(
                "a stop can't have a semi-diameter of {} mm",
                semi_diameter.0
            ))
            .with_help("give a length greater than 0"));
        }
        let mut stopped = self.clone();
        stopped.surfaces[stop].semi_diameter = semi_diameter.0;
        for position in &mut stopped.zoom {
            position.stop_semi_diameter = None;
        }
        stopped.stated_beam = None;
        Ok(stopped)
    }
}
