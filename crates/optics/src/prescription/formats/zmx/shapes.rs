//! The shapes of surfaces.

use ivcam_base::diag::{Diagnostic, Result};

use crate::prescription::forbes::ForbesSet;
use crate::prescription::formats::zmx::file::SurfaceBlock;
use crate::prescription::formats::zmx::reader::ZemaxReader;
use crate::prescription::surface::{Curvature, MAX_POWER, Shape, polynomial};
use crate::prescription::text::Word;

/// The largest number of polynomials of a Q-type asphere.
const MAX_FORBES: usize = 1000;

impl ZemaxReader<'_> {
    /// The shape of the surface of a block.
    pub(super) fn shape(&self, block: &SurfaceBlock<'_>, curvature: Curvature) -> Result<Shape> {
        let Some(kind) = block.first("TYPE") else {
            return Ok(Shape::Sphere);
        };
        let k = self.value(block, "CONI")?;
        let terms = match kind.text {
            "STANDARD" => Vec::new(),
            "EVENASPH" => self.terms(block, "PARM", |i| Some(i.saturating_mul(2)))?,
            "ODDASPHE" => self.terms(block, "PARM", Some)?,
            "XASPHERE" => self.extended(block, 2)?,
            "XOSPHERE" => self.extended(block, 1)?,
            "TOROIDAL" => return self.toroid(block, k, curvature),
            "BICONICX" => return self.biconic(block, kind, k, curvature),
            "QED_TYPE" => return self.forbes(block, k),
            "PARAXIAL" => return self.thin_lens(block),
            _ => return Err(self.unsupported(block, kind)),
        };
        match Shape::rotational(k, polynomial(terms)) {
            Shape::Conic { .. } if curvature.is_plane() => Ok(Shape::Sphere),
            shape => Ok(shape),
        }
    }

    fn unsupported(&self, block: &SurfaceBlock<'_>, kind: Word<'_>) -> Box<Diagnostic> {
        let what = match kind.text {
            "DGRATING" | "EGRATING" | "RADGRATE" | "VLS_GRAT" => "a diffraction grating",
            "BINARY_1" | "BINARY_2" | "BINARY_3" | "BINARY_4" | "HOLOGRM1" | "HOLOGRM2" => {
                "a surface that diffracts"
            }
            "PARAX_XY" => "an ideal lens of two powers",
            "BICONICX" => "a biconic with two curvatures or a conic constant",
            "NONSEQCO" => "a non-sequential part",
            "GRINSUR1" | "GRINSUR2" | "GRINSUR3" | "GRINSUR4" | "GRINSUR5" | "GRADIUM" => {
                "a gradient-index medium"
            }
            _ => "a kind that ivcam does not trace",
        };
        let message = format!("surface {} is `{}`, {what}", block.number, kind.text);
        let help = "read are STANDARD, EVENASPH, ODDASPHE, XASPHERE, XOSPHERE, TOROIDAL, QED_TYPE, \
                    PARAXIAL and plain BICONICX";
        self.file.refuse(kind.span, message, help)
    }

    /// A value such as that of `PARM 3 0.5`.
    fn parameter(
        &self,
        block: &SurfaceBlock<'_>,
        keyword: &'static str,
        number: &str,
    ) -> Result<Option<f64>> {
        let word = block.number(keyword, number);
        word.map(|word| self.file.number(word)).transpose()
    }

    /// The terms of a polynomial: powers of r with their coefficients. `power` is the power of a
    /// term with a number, or none if that is not a term.
    fn terms(
        &self,
        block: &SurfaceBlock<'_>,
        keyword: &'static str,
        power: impl Fn(usize) -> Option<usize>,
    ) -> Result<Vec<(usize, f64)>> {
        let mut terms = Vec::new();
        for (index, word) in block.numbered(keyword) {
            let value = self.file.number(word)?;
            match index.text.parse().map_or(Some(usize::MAX), &power) {
                Some(power) if power <= MAX_POWER => terms.push((power, value)),
                Some(_) if value != 0.0 => {
                    let message = format!("term {} of surface {}", index.text, block.number);
                    let message = format!("{message} is of too high a power");
                    let help = format!("powers of r go up to {MAX_POWER}");
                    return Err(self.file.refuse(word.span, message, help));
                }
                _ => {}
            }
        }
        Ok(terms)
    }

    /// XDAT 1 is the number of terms, 2 the radius they are scaled by, then one for each power
    /// of ρ = r/radius in steps of `step`.
    fn extended(&self, block: &SurfaceBlock<'_>, step: usize) -> Result<Vec<(usize, f64)>> {
        let count = self.parameter(block, "XDAT", "1")?;
        let count = count.map_or(usize::MAX, |count| count as usize);
        let mut terms = self.terms(block, "XDAT", |i| {
            let term = i.checked_sub(3).filter(|j| *j < count);
            term.map(|j| (j + 1).saturating_mul(step))
        })?;
        let radius = self.parameter(block, "XDAT", "2")?.unwrap_or(1.0);
        if let Some(word) = block.number("XDAT", "2")
            && !(radius > 0.0)
        {
            return Err(self.file.fail(word.span, "a norm radius is greater than 0"));
        }
        for (power, value) in &mut terms {
            *value /= (0..*power).fold(1.0, |scale, _| scale * radius);
        }
        Ok(terms)
    }

    /// XDAT 1 is 0 for Q-bfs and 1 for Q-con, 2 the number of polynomials, 3 the radius they are
    /// scaled by, then a coefficient for each.
    fn forbes(&self, block: &SurfaceBlock<'_>, k: f64) -> Result<Shape> {
        let value = |number: &str| self.parameter(block, "XDAT", number);
        let set = match value("1")?.unwrap_or(0.0) {
            0.0 => ForbesSet::Bfs,
            1.0 => ForbesSet::Con,
            _ => {
                let message = format!(
                    "surface {}: Q-type aspheres are of type 0 or 1",
                    block.number
                );
                return Err(self.file.fail(block.heading, message));
            }
        };
        let count = value("2")?.map_or(usize::MAX, |count| count as usize);
        let radius = value("3")?.unwrap_or(1.0);
        if !(radius > 0.0) {
            let message = "a norm radius is greater than 0";
            return Err(self.file.fail(block.heading, message));
        }
        let mut coefficients = Vec::new();
        for (index, word) in block.numbered("XDAT") {
            let number = index.text.parse::<usize>().unwrap_or(0);
            if let Some(at) = number
                .checked_sub(4)
                .filter(|at| *at < count.min(MAX_FORBES))
            {
                coefficients.resize(coefficients.len().max(at + 1), 0.0);
                coefficients[at] = self.file.number(word)?;
            }
        }
        let terms = set.terms(&coefficients, radius).map_err(|number| {
            let message = format!(
                "surface {}: polynomial {number} is of too high a power",
                block.number
            );
            let help = format!("powers of r go up to {MAX_POWER}");
            self.file.refuse(block.heading, message, help)
        })?;
        Ok(match set {
            ForbesSet::Con => Shape::rotational(k, terms),
            ForbesSet::Bfs => Shape::NormalAsphere { k, terms },
        })
    }

    /// PARM 1 is the focal length in air, and PARM 2 how Zemax computes optical paths.
    fn thin_lens(&self, block: &SurfaceBlock<'_>) -> Result<Shape> {
        let Some(focal_length) = self.parameter(block, "PARM", "1")? else {
            let message = format!("the ideal lens {} has no focal length", block.number);
            let help = "`PARM 1 50` gives it 50 of the file's units";
            return Err(self.file.refuse(block.heading, message, help));
        };
        Ok(Shape::ThinLens { focal_length })
    }

    /// PARM 1 is the radius of rotation, then the coefficients of y², y⁴, ….
    fn toroid(&self, block: &SurfaceBlock<'_>, k: f64, curvature: Curvature) -> Result<Shape> {
        let power = |i: usize| i.checked_sub(2).map(|j| (j + 1).saturating_mul(2));
        let terms = polynomial(self.terms(block, "PARM", power)?);
        for (index, value) in block.numbered("XDAT") {
            let is_term = index.text.parse::<usize>().is_ok_and(|i| i > 2);
            if is_term && self.file.number(value)? != 0.0 {
                let message = format!("surface {} is a toroid with Zernike terms", block.number);
                return Err(self.file.fail(value.span, message));
            }
        }
        let across = self.parameter(block, "PARM", "1")?.unwrap_or(0.0);
        let across = Curvature::from_radius(across);
        let plain = k == 0.0 && terms.iter().all(|t| *t == 0.0);
        Ok(match (across.is_plane(), curvature.is_plane()) {
            (true, true) if plain => Shape::Sphere,
            (true, false) if plain => Shape::CylinderX,
            _ => Shape::Toroid { across, k, terms },
        })
    }

    /// If both curvatures and conics agree, the shape is a conic of revolution. If one curvature is
    /// 0, it is a cylinder. All others are refused.
    fn biconic(
        &self,
        block: &SurfaceBlock<'_>,
        kind: Word<'_>,
        k: f64,
        curvature: Curvature,
    ) -> Result<Shape> {
        let across = self.parameter(block, "PARM", "1")?.unwrap_or(0.0);
        let across = Curvature::from_radius(across);
        let k_across = self.parameter(block, "PARM", "2")?.unwrap_or(0.0);
        // A radius and a curvature of the same sphere agree to the digits that are written.
        let same = (across.per_mm() - curvature.per_mm()).abs() <= 1e-12 * curvature.per_mm().abs()
            && k_across == k;
        match (same, across.is_plane(), k == 0.0) {
            (true, _, true) => Ok(Shape::Sphere),
            (true, _, false) => Ok(Shape::Conic { k }),
            (false, true, true) => Ok(Shape::CylinderX),
            (false, true, false) => Ok(Shape::toroid(across, k)),
            (false, false, true) if curvature.is_plane() && k_across == 0.0 => {
                Ok(Shape::toroid(across, k))
            }
            _ => Err(self.unsupported(block, kind)),
        }
    }
}
