//! The commands that make a surface or change one.

use ivcam_base::diag::{Diagnostic, Result, Sink, Span};

use crate::prescription::formats::seq::reader::{Places, Reader};
use crate::prescription::glass::coating::Coating;
use crate::prescription::prescription::check_count;
use crate::prescription::surface::{Curvature, MAX_POWER, Shape, Surface};
use crate::prescription::text::Word;

impl Reader<'_> {
    /// Executes `S`: appends a surface and makes it the current one.
    pub(super) fn surface(&mut self, command: &[Word<'_>]) -> Result<()> {
        let (surface, places) = self.parsed(command)?;
        self.current = Some(self.surfaces.len());
        self.surfaces.push(surface);
        self.places.push(places);
        Ok(())
    }

    /// The surface that `S` describes, and the places of its numbers.
    pub(super) fn parsed(&mut self, command: &[Word<'_>]) -> Result<(Surface, Places)> {
        if command.len() < 3 {
            let last = command[command.len() - 1].span;
            let message = "too few numbers in this surface".to_owned();
            return Err(self
                .fail(Span::at(last.end as usize), message)
                .with_help("a surface is: S radius thickness glass"));
        }
        let bend = command[1].number(self.source)?;
        let curvature = if self.radii {
            Curvature::from_radius(bend)
        } else {
            Curvature::from_curvature(bend)
        };
        let medium = self.glass(command.get(3))?;
        let thickness = command[2].number(self.source)?;
        check_count(self.surfaces.len() + 1, self.source)?;
        if bend != 0.0 && self.first_bend.is_none() {
            self.first_bend = Some(command[1].span);
        }
        let places = Places {
            command: command[0].span,
            columns: [
                Some(command[1].span),
                Some(command[2].span),
                command.get(3).map(|w| w.span),
                None,
            ],
        };
        let surface = Surface {
            shape: Shape::Sphere,
            curvature,
            thickness,
            medium,
            semi_diameter: f64::INFINITY,
            is_stop: false,
            coating: Coating::default(),
            span: command[0].span,
        };
        Ok((surface, places))
    }

    /// The error for a mirror.
    pub(super) fn mirror(&self, span: Span, surface: usize) -> Box<Diagnostic> {
        self.fail(span, format!("surface {surface} is a mirror"))
            .with_help("ivcam traces lenses that light goes straight through")
    }

    /// Executes a command that changes the current surface.
    pub(super) fn of_surface(
        &mut self,
        name: &str,
        command: &[Word<'_>],
        sink: &mut Sink,
    ) -> Result<()> {
        let Some(current) = self.current.filter(|s| *s < self.surfaces.len()) else {
            return Ok(());
        };
        match name {
            "RDY" => self.last().curvature = Curvature::from_radius(self.value(command)?),
            "CUY" => self.last().curvature = Curvature::from_curvature(self.value(command)?),
            "THI" => self.last().thickness = self.value(command)?,
            "GLA" => self.last().medium = self.glass(command.get(1))?,
            "RMD" if command.get(1).is_some_and(|w| w.is("REFL")) => {
                return Err(self.mirror(command[1].span, current + 1));
            }
            // `ASP K -1 A 1e-6`, all on one line.
            "ASP" | "CON" => {
                for pair in command[1..].chunks_exact(2) {
                    let name = pair[0].text.to_ascii_uppercase();
                    self.of_surface(&name, pair, sink)?;
                }
            }
            "STO" => self.last().is_stop = true,
            "CIR" => {
                let words: Vec<&Word<'_>> = command[1..]
                    .iter()
                    .filter(|w| w.text.parse::<f64>().is_ok())
                    .collect();
                if command.iter().any(|w| w.is("OBS")) {
                    sink.warn(command[0].span, "an obscuration is left out");
                } else if let [word] = words[..] {
                    let radius = word.number(self.source)?;
                    let is_edge = command.iter().any(|w| w.is("EDG"));
                    let known = self.last().semi_diameter.is_finite();
                    if !(is_edge && known) {
                        self.last().semi_diameter = radius;
                        self.places[current].columns[3] = Some(word.span);
                    }
                }
            }
            "REX" | "REY" | "ELX" | "ELY" => {
                sink.warn(
                    command[0].span,
                    format!("the aperture `{name}` is left out"),
                );
            }
            "K" => {
                let value = self.value(command)?;
                self.set_conic(value);
            }
            "CYL" => self.last().shape = Shape::CylinderX,
            "CUX" | "RDX" => self.across(name, command)?,
            "A" | "B" | "C" | "D" | "E" | "F" | "G" | "H" | "J" => {
                let order = "ABCDEFGHJ".find(name).unwrap_or(0);
                let value = self.value(command)?;
                self.set_term(4 + 2 * order, value, command[0].span)?;
            }
            _ => {}
        }
        Ok(())
    }

    /// The current surface, or the last one if there is none.
    pub(super) fn last(&mut self) -> &mut Surface {
        let last = self.surfaces.len() - 1;
        &mut self.surfaces[self.current.unwrap_or(last).min(last)]
    }

    fn set_conic(&mut self, value: f64) {
        let surface = self.last();
        surface.shape = match std::mem::replace(&mut surface.shape, Shape::Sphere) {
            Shape::Asphere { terms, .. } => Shape::Asphere { k: value, terms },
            Shape::Sphere | Shape::Conic { .. } if value != 0.0 => Shape::Conic { k: value },
            other => other,
        };
    }

    fn set_term(&mut self, power: usize, value: f64, span: Span) -> Result<()> {
        if power > MAX_POWER {
            return match value {
                0.0 => Ok(()),
                _ => Err(self.fail(span, format!("the term r^{power} is of too high a power"))),
            };
        }
        if value == 0.0 {
            return Ok(());
        }
        let surface = self.last();
        surface.shape =
            std::mem::replace(&mut surface.shape, Shape::Sphere).with_term(power, value);
        Ok(())
    }

    /// The curvature across, of a cylinder with power in x.
    fn across(&mut self, name: &str, command: &[Word<'_>]) -> Result<()> {
        let value = self.value(command)?;
        let across = match name {
            "RDX" => Curvature::from_radius(value),
            _ => Curvature::from_curvature(value),
        };
        let surface = self.last();
        surface.shape = match (across.is_plane(), surface.curvature.is_plane()) {
            (true, _) => Shape::CylinderX,
            (false, true) => {
                surface.curvature = across;
                Shape::CylinderY
            }
            (false, false) => Shape::Toroid {
                across,
                k: 0.0,
                terms: Box::new([0.0; MAX_POWER + 1]),
            },
        };
        Ok(())
    }
}
