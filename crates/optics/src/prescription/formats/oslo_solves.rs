//! Numbers of a file of OSLO that follow from others: pickups (`PK`) and solves (`PU`, `PY`).
//!
//! They are resolved when the whole file is read, from surface to surface, because a pickup may be
//! of a number that follows from a solve. Angles and heights are those of the marginal paraxial ray
//! at the first wavelength.

use ivcam_base::diag::{Result, Span};

use crate::prescription::formats::reader::PrescriptionReader;
use crate::prescription::surface::{Curvature, Surface};
use crate::prescription::text::Word;

/// The help for a pickup or solve that is not read.
pub(super) const STATE_IT: &str = "state the number itself (RD, CV or TH) in its place";

/// What a number of a surface follows from.
#[derive(Clone, Copy)]
enum NumberSource {
    /// That of another surface, times a sign, plus a constant.
    Pickup { of: usize, sign: f64, constant: f64 },
    /// The angle or the height of the marginal ray behind the surface.
    Solve(f64),
}

/// A curvature or a thickness that follows from other numbers.
pub(super) struct Solve {
    surface: usize,
    is_thickness: bool,
    source: NumberSource,
    span: Span,
}

impl Solve {
    /// The solve of a command of a surface; none if it is no pickup of a curvature or a thickness
    /// and no solve.
    pub(super) fn of(
        file: PrescriptionReader<'_>,
        surface: usize,
        command: &[Word<'_>],
    ) -> Result<Option<Self>> {
        let kind = command.iter().take(2).map(|w| w.text.to_ascii_uppercase());
        let kind: Vec<String> = kind.collect();
        let picked = |sign| -> Result<NumberSource> {
            let constant = command.get(3).map(|word| file.number(*word)).transpose()?;
            Ok(NumberSource::Pickup {
                of: picked_surface(file, surface, command)?,
                sign,
                constant: constant.unwrap_or(0.0),
            })
        };
        let (is_thickness, source) = match [&*kind[0], kind.get(1).map_or("", |w| w)] {
            ["PK", "CV"] => (false, picked(1.0)?),
            ["PK", "CVM"] => (false, picked(-1.0)?),
            ["PK", "TH"] => (true, picked(1.0)?),
            ["PK", "THM"] => (true, picked(-1.0)?),
            ["PU", _] => (false, NumberSource::Solve(file.argument(command)?)),
            ["PY", _] => (true, NumberSource::Solve(file.argument(command)?)),
            _ => return Ok(None),
        };
        Ok(Some(Self {
            surface,
            is_thickness,
            source,
            span: command[0].span,
        }))
    }
}

/// The surface that a pickup names: a negative number counts back from its own surface.
pub(super) fn picked_surface(
    file: PrescriptionReader<'_>,
    surface: usize,
    command: &[Word<'_>],
) -> Result<usize> {
    let number = command
        .get(2)
        .and_then(|word| word.text.parse::<i64>().ok());
    let of = number.map(|n| if n < 0 { surface as i64 + n } else { n });
    let of = of.and_then(|of| usize::try_from(of).ok());
    of.filter(|of| *of < surface).ok_or_else(|| {
        let message = format!("the pickup of surface {surface} is of no surface in front of it");
        file.refuse(command[0].span, message, STATE_IT)
    })
}

/// Gives surfaces the numbers that follow from others. The first is the object, and `entrance` the
/// radius of the entrance beam at the next, if the file states it.
pub(super) fn resolve(
    file: PrescriptionReader<'_>,
    surfaces: &mut [Surface],
    solves: &[Solve],
    entrance: Option<f64>,
    wavelength_nm: f64,
) -> Result<()> {
    let Some(object) = surfaces.first().filter(|_| !solves.is_empty()) else {
        return Ok(());
    };
    // A solve for 0 is the same for every beam.
    let mut y = entrance.unwrap_or(1.0);
    let mut u = if object.thickness == 0.0 {
        0.0
    } else {
        y / object.thickness
    };
    let mut n = object.medium.index(wavelength_nm);
    for i in 1..surfaces.len() {
        let behind = match surfaces[i].is_mirror {
            true => -n,
            false => surfaces[i].medium.index(wavelength_nm).copysign(n),
        };
        let bend = |u_behind: f64| (n * u - behind * u_behind) / (y * (behind - n));
        if let Some(c) = solved(file, surfaces, solves, (i, false), entrance, bend)? {
            surfaces[i].curvature = Curvature::from_curvature(c);
        }
        u = (n * u - y * surfaces[i].curvature.per_mm() * (behind - n)) / behind;
        let gap = |height: f64| (height - y) / u;
        if let Some(t) = solved(file, surfaces, solves, (i, true), entrance, gap)? {
            surfaces[i].thickness = t;
        }
        y += surfaces[i].thickness * u;
        n = behind;
    }
    Ok(())
}

/// The curvature or the thickness of a surface that follows from others, if it does. `solution` is
/// that of a solve for a value.
fn solved(
    file: PrescriptionReader<'_>,
    surfaces: &[Surface],
    solves: &[Solve],
    (surface, is_thickness): (usize, bool),
    entrance: Option<f64>,
    solution: impl Fn(f64) -> f64,
) -> Result<Option<f64>> {
    let is_it = |s: &&Solve| (s.surface, s.is_thickness) == (surface, is_thickness);
    let Some(solve) = solves.iter().rev().find(is_it) else {
        return Ok(None);
    };
    let value = match solve.source {
        NumberSource::Pickup { of, sign, constant } => {
            let other = &surfaces[of];
            let own = if is_thickness {
                other.thickness
            } else {
                other.curvature.per_mm()
            };
            sign * own + constant
        }
        NumberSource::Solve(value) if value == 0.0 || entrance.is_some() => solution(value),
        NumberSource::Solve(_) => f64::NAN,
    };
    if !value.is_finite() {
        let message = format!("the solve of surface {surface} has no solution for the stated beam");
        return Err(file.refuse(solve.span, message, STATE_IT));
    }
    Ok(Some(value))
}
