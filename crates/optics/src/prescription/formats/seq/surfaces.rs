//! The commands that make a surface or change one.

use ivcam_base::diag::{Result, Sink, Span};

use crate::prescription::formats::decenters::AxisBehind;
use crate::prescription::formats::reader::SurfaceSpans;
use crate::prescription::formats::seq::glasses::glass;
use crate::prescription::formats::seq::reader::SequenceReader;
use crate::prescription::prescription::Column;
use crate::prescription::surface::{Curvature, Shape, Surface};
use crate::prescription::text::Word;

/// The commands that decenter a surface.
const DECENTERS: [&str; 9] = [
    "XDE", "YDE", "ZDE", "ADE", "BDE", "CDE", "DAR", "REV", "BEN",
];

impl SequenceReader<'_> {
    /// The number of surfaces so far.
    pub(super) fn count(&self) -> usize {
        self.draft.places.len()
    }

    /// Executes `S`: appends a surface and makes it the current one.
    pub(super) fn surface(&mut self, command: &[Word<'_>]) -> Result<()> {
        let (surface, places) = self.parsed(command)?;
        self.current = Some(self.count());
        self.draft.push(surface, places);
        Ok(())
    }

    /// The surface that `S` describes, and the places of its numbers.
    pub(super) fn parsed(&mut self, command: &[Word<'_>]) -> Result<(Surface, SurfaceSpans)> {
        let [name, bend, thickness, rest @ ..] = command else {
            let last = command[command.len() - 1].span;
            let message = "too few numbers in this surface";
            return Err(self.file.refuse(
                Span::at(last.end as usize),
                message,
                "a surface is: S radius thickness glass",
            ));
        };
        let value = self.file.number(*bend)?;
        let curvature = if self.radii {
            Curvature::from_radius(value)
        } else {
            Curvature::from_curvature(value)
        };
        let is_mirror = rest.first().is_some_and(|word| word.is("REFL"));
        let named = rest.first().filter(|_| !is_mirror);
        let medium = glass(self.file, named, self.count() + 1)?;
        let thickness_value = self.file.number(*thickness)?;
        self.file.check_count(self.count() + 1)?;
        if value != 0.0 && self.first_bend.is_none() {
            self.first_bend = Some(bend.span);
        }
        let index = rest.first().unwrap_or(name);
        let plane = Surface::sphere(0.0, thickness_value, medium, f64::INFINITY);
        let surface = Surface {
            curvature,
            is_mirror,
            span: name.span,
            ..plane
        };
        Ok((surface, [bend.span, thickness.span, index.span, name.span]))
    }

    /// Executes a command that changes the current surface.
    pub(super) fn of_surface(
        &mut self,
        name: &str,
        command: &[Word<'_>],
        sink: &mut Sink,
    ) -> Result<()> {
        let Some(current) = self.current.filter(|s| *s < self.count()) else {
            return Ok(());
        };
        let file = self.file;
        let number = || file.argument(command);
        let surface = &mut self.draft.lens.surfaces[current];
        match name {
            "RDY" => surface.curvature = Curvature::from_radius(number()?),
            "CUY" => surface.curvature = Curvature::from_curvature(number()?),
            "THI" => surface.thickness = number()?,
            "GLA" => {
                surface.is_mirror = command.get(1).is_some_and(|w| w.is("REFL"));
                if !surface.is_mirror {
                    let medium = glass(file, command.get(1), self.draft.places.len() + 1)?;
                    surface.medium = medium;
                }
            }
            "RMD" => match command.get(1) {
                Some(word) if word.is("REFL") => surface.is_mirror = true,
                Some(word) if word.is("REFR") => surface.is_mirror = false,
                Some(word) => {
                    let message = format!("`RMD {}` of surface {}", word.text, current + 1);
                    let help = "REFL and REFR are read";
                    return Err(file.refuse(word.span, format!("{message} is not read"), help));
                }
                None => {}
            },
            // `ASP K -1 A 1e-6`, all on one line.
            "ASP" | "CON" => {
                for pair in command[1..].chunks_exact(2) {
                    let name = pair[0].text.to_ascii_uppercase();
                    self.of_surface(&name, pair, sink)?;
                }
            }
            "STO" => surface.is_stop = true,
            "CIR" => self.circle(current, command, sink)?,
            "REX" | "REY" | "ELX" | "ELY" | "ADX" | "ADY" | "ARO" => {
                self.state_aperture(current, name, command, sink)?;
            }
            "K" => {
                let k = number()?;
                surface.change_shape(|shape| shape.with_conic(k));
            }
            "CYL" => surface.shape = Shape::CylinderX,
            "CUX" => across(surface, Curvature::from_curvature(number()?)),
            "RDX" => across(surface, Curvature::from_radius(number()?)),
            "A" | "B" | "C" | "D" | "E" | "F" | "G" | "H" | "J" => {
                let power = 4 + 2 * "ABCDEFGHJ".find(name).unwrap_or(0);
                let value = number()?;
                if value != 0.0 {
                    surface.change_shape(|shape| shape.with_term(power, value));
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Executes a command that decenters a surface. Returns whether it is one.
    pub(super) fn decenter(
        &mut self,
        current: usize,
        name: &str,
        command: &[Word<'_>],
    ) -> Result<bool> {
        if !DECENTERS.contains(&name) {
            return Ok(false);
        }
        let stated = self.decenters.entry(current).or_default();
        let behind = match name {
            "DAR" => AxisBehind::Returns,
            "REV" => AxisBehind::Reverses,
            "BEN" => AxisBehind::Bends,
            _ => {
                let value = self.file.argument(command)?;
                let all = match &name[1..] == "DE" && name < "XDE" {
                    true => &mut stated.tilt,
                    false => &mut stated.shift,
                };
                match &name[..1] {
                    "A" | "X" => all.x = value,
                    "B" | "Y" => all.y = value,
                    _ => all.z = value,
                }
                return Ok(true);
            }
        };
        stated.behind = behind;
        Ok(true)
    }

    /// Warns of a command that decenters the image, which it has no surface for.
    pub(super) fn decenter_image(&self, name: &str, command: &[Word<'_>], sink: &mut Sink) {
        let is_zero = command.get(1).is_some_and(|w| w.text.parse() == Ok(0.0));
        if DECENTERS.contains(&name) && self.count() > 0 && !is_zero {
            sink.warn(
                command[0].span,
                format!("`{name}` of the image surface is left out"),
            )
            .help("tilt and shift the film instead: --tilt, --swing, --rise and --shift");
        }
    }

    /// Executes `CIR`, which gives a surface its semi-diameter, an obstruction or a hole.
    fn circle(&mut self, current: usize, command: &[Word<'_>], sink: &mut Sink) -> Result<()> {
        let numbers = command[1..]
            .iter()
            .filter(|w| w.text.parse::<f64>().is_ok());
        let numbers: Vec<&Word<'_>> = numbers.collect();
        // A hole passes light that a sequential trace does not follow: its surface is closed there.
        let is_obstruction = command.iter().any(|w| w.is("OBS") || w.is("HOL"));
        if let (true, [word]) = (is_obstruction, &numbers[..]) {
            self.draft.lens.surfaces[current].obstruction = self.file.number(**word)?;
        } else if is_obstruction {
            sink.warn(command[0].span, "an obstruction is left out");
        } else if let [word] = numbers[..] {
            let radius = self.file.number(*word)?;
            let surface = &mut self.draft.lens.surfaces[current];
            let is_edge = command.iter().any(|w| w.is("EDG"));
            if !(is_edge && surface.semi_diameter.is_finite()) {
                surface.semi_diameter = radius;
                self.draft.places[current][Column::SemiDiameter as usize] = word.span;
            }
        }
        Ok(())
    }
}

/// Gives a surface a curvature in x, as a cylinder with power in x or as a toroid.
fn across(surface: &mut Surface, across: Curvature) {
    surface.shape = match (across.is_plane(), surface.curvature.is_plane()) {
        (true, _) => Shape::CylinderX,
        (false, true) => {
            surface.curvature = across;
            Shape::CylinderY
        }
        (false, false) => Shape::toroid(across, 0.0),
    };
}
