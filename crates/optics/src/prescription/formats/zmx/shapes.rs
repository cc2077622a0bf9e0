//! The shapes of surfaces.

use ivcam_base::diag::{Diagnostic, Result};

use crate::prescription::formats::zmx::file::{Block, pair};
use crate::prescription::formats::zmx::reader::Reader;
use crate::prescription::surface::{Curvature, MAX_POWER, Shape};
use crate::prescription::text::Word;

impl Reader<'_> {
    /// The shape of the surface of a block.
    pub(super) fn shape(&self, block: &Block<'_>, curvature: Curvature) -> Result<Shape> {
        let Some(kind) = block.first("TYPE") else {
            return Ok(Shape::Sphere);
        };
        let k = match block.first("CONI") {
            Some(word) => word.number(self.source)?,
            None => 0.0,
        };
        let mut terms = Box::new([0.0; MAX_POWER + 1]);
        match kind.text {
            "STANDARD" => {}
            "EVENASPH" => self.terms(block, "PARM", &mut terms, |i| Some(2 * i))?,
            "ODDASPHE" => self.terms(block, "PARM", &mut terms, Some)?,
            "XASPHERE" => self.extended(block, &mut terms, 2)?,
            "XOSPHERE" => self.extended(block, &mut terms, 1)?,
            "TOROIDAL" => return self.toroid(block, k, curvature, terms),
            "BICONICX" => return self.biconic(block, kind, k, curvature),
            _ => return Err(self.unsupported(block, kind)),
        }
        Ok(if terms.iter().any(|t| *t != 0.0) {
            Shape::Asphere { k, terms }
        } else if k != 0.0 && !curvature.is_plane() {
            Shape::Conic { k }
        } else {
            Shape::Sphere
        })
    }

    fn unsupported(&self, block: &Block<'_>, kind: Word<'_>) -> Box<Diagnostic> {
        let what = match kind.text {
            "COORDBRK" => "a coordinate break: it tilts or shifts what follows",
            "DGRATING" | "EGRATING" | "RADGRATE" | "VLS_GRAT" => "a diffraction grating",
            "BINARY_1" | "BINARY_2" | "BINARY_3" | "BINARY_4" | "HOLOGRM1" | "HOLOGRM2" => {
                "a surface that diffracts"
            }
            "PARAXIAL" | "PARAX_XY" => "an ideal lens without a shape",
            "BICONICX" => "a biconic with two curvatures or a conic constant",
            "NONSEQCO" => "a non-sequential part",
            "GRINSUR1" | "GRINSUR2" | "GRINSUR3" | "GRINSUR4" | "GRINSUR5" | "GRADIUM" => {
                "a gradient-index medium"
            }
            _ => "a kind that ivcam does not trace",
        };
        let message = format!("surface {} is `{}`, {what}", block.number, kind.text);
        self.fail(kind.span, message).with_help(
            "read are STANDARD, EVENASPH, ODDASPHE, XASPHERE, XOSPHERE, TOROIDAL and plain BICONICX",
        )
    }

    fn terms(
        &self,
        block: &Block<'_>,
        keyword: &str,
        terms: &mut [f64; MAX_POWER + 1],
        power: impl Fn(usize) -> Option<usize>,
    ) -> Result<()> {
        for (index, value) in block
            .lines
            .iter()
            .filter(|l| l[0].is(keyword))
            .filter_map(pair)
        {
            let value_number = value.number(self.source)?;
            let power = index.text.parse().ok().and_then(&power);
            match power.and_then(|p: usize| terms.get_mut(p)) {
                Some(term) => *term = value_number,
                None if value_number == 0.0 => {}
                None => {
                    let message = format!("term {} of surface {}", index.text, block.number);
                    return Err(self
                        .fail(value.span, format!("{message} is of too high a power"))
                        .with_help(format!("powers of r go up to {MAX_POWER}")));
                }
            }
        }
        Ok(())
    }

    /// XDAT 1 is the number of terms, 2 the radius they are scaled by, then one for each power
    /// of ρ = r/radius in steps of `step`.
    fn extended(
        &self,
        block: &Block<'_>,
        terms: &mut [f64; MAX_POWER + 1],
        step: usize,
    ) -> Result<()> {
        let count = block.numbered("XDAT").find(|(i, _)| i.text == "1");
        let count = match count {
            Some((_, word)) => word.number(self.source)? as usize,
            None => usize::MAX,
        };
        self.terms(block, "XDAT", terms, |i| {
            let term = i.checked_sub(3).filter(|j| *j < count);
            term.map(|j| (j + 1) * step).or(Some(0))
        })?;
        let radius = block.numbered("XDAT").find(|(i, _)| i.text == "2");
        let radius = match radius {
            Some((_, word)) => match word.number(self.source)? {
                r if r > 0.0 => r,
                _ => return Err(self.fail(word.span, "a norm radius is greater than 0".into())),
            },
            None => 1.0,
        };
        // Numbers 1 and 2 are not terms.
        terms[0] = 0.0;
        let mut scale = 1.0;
        for term in &mut terms[1..] {
            scale *= radius;
            *term /= scale;
        }
        Ok(())
    }

    /// PARM 1 is the radius of rotation, then the coefficients of y², y⁴, ….
    fn toroid(
        &self,
        block: &Block<'_>,
        k: f64,
        curvature: Curvature,
        mut terms: Box<[f64; MAX_POWER + 1]>,
    ) -> Result<Shape> {
        self.terms(block, "PARM", &mut terms, |i| {
            Some(i.checked_sub(1).map_or(0, |j| 2 * j))
        })?;
        terms[0] = 0.0;
        for (index, value) in block.numbered("XDAT") {
            let is_term = index.text.parse::<usize>().is_ok_and(|i| i > 2);
            if is_term && value.number(self.source)? != 0.0 {
                let message = format!("surface {} is a toroid with Zernike terms", block.number);
                return Err(self.fail(value.span, message));
            }
        }
        let across = match block.numbered("PARM").find(|(i, _)| i.text == "1") {
            Some((_, word)) => Curvature::from_radius(word.number(self.source)?),
            None => Curvature::PLANE,
        };
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
        block: &Block<'_>,
        kind: Word<'_>,
        k: f64,
        curvature: Curvature,
    ) -> Result<Shape> {
        let parameter = |number: &str| {
            let found = block.numbered("PARM").find(|(i, _)| i.text == number);
            found.map_or(Ok(0.0), |(_, word)| word.number(self.source))
        };
        let across = Curvature::from_radius(parameter("1")?);
        let k_across = parameter("2")?;
        // A radius and a curvature of the same sphere agree to the digits that are written.
        let same = (across.per_mm() - curvature.per_mm()).abs() <= 1e-12 * curvature.per_mm().abs()
            && k_across == k;
        let toroid = || Shape::Toroid {
            across,
            k,
            terms: Box::new([0.0; MAX_POWER + 1]),
        };
        match (same, across.is_plane(), k == 0.0) {
            (true, _, true) => Ok(Shape::Sphere),
            (true, _, false) => Ok(Shape::Conic { k }),
            (false, true, true) => Ok(Shape::CylinderX),
            (false, true, false) => Ok(toroid()),
            (false, false, true) if curvature.is_plane() && k_across == 0.0 => Ok(toroid()),
            _ => Err(self.unsupported(block, kind)),
        }
    }
}
