//! Reads the `.len` files of OSLO: one command a line or between semicolons, a surface after `NXT`.
//!
//! Surface 0 is the object and the last one, or the one of `END`, the image. Read: RD or CV, TH,
//! AP (a semi-diameter, perhaps after CHK), AST, AIR, GLA with a name, an index, or `MOD` and the
//! indices at the wavelengths of WV, CC, AD to AG; EBR, FNO, ANG and GIH for apertures that the
//! file leaves out, and UNI, the millimeters of its unit. What tilts, reflects or diffracts is
//! refused by name.

use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result, Sink, Source, Span};

use crate::prescription::formats::apertures::{Beam, fill, note_f_number};
use crate::prescription::formats::format::Format;
use crate::prescription::formats::index_table::interpolated;
use crate::prescription::formats::origin::name_of;
use crate::prescription::glass::catalogue::Catalogue;
use crate::prescription::glass::medium::{C_LINE, D_LINE, F_LINE, Medium, named_line};
use crate::prescription::prescription::{Column, Prescription, check, check_count};
use crate::prescription::surface::{Curvature, Shape, Surface};
use crate::prescription::text::{Word, first_number, lines, text, words};

/// OSLO's lens files, recognized by a line that is `NXT`.
pub(crate) static FORMAT: Format = Format {
    name: "OSLO",
    recognizes: |text| {
        let plain = |line: &str| line.split("//").next().unwrap_or("").trim().to_owned();
        let next = |line: &str| {
            line.split(';')
                .any(|part| part.trim().eq_ignore_ascii_case("NXT"))
        };
        text.lines().map(plain).any(|line| next(&line))
    },
    read: |source, how, sink| read(source, &how.glasses, sink),
};

/// Commands for properties that a centered refracting lens does not have, refused unless their
/// value is 0.
const REFUSED: [(&str, &str); 21] = [
    ("RFL", "reflects"),
    ("RFH", "reflects"),
    ("TLA", "is tilted"),
    ("TLB", "is tilted"),
    ("TLC", "is tilted"),
    ("DCX", "is decentered"),
    ("DCY", "is decentered"),
    ("DCZ", "is decentered"),
    ("BEN", "folds the axis"),
    ("GSP", "is a grating"),
    ("GOR", "is a grating"),
    ("PFL", "is an ideal lens"),
    ("CVX", "is toric"),
    ("RDX", "is toric"),
    ("GDT", "has a gradient index"),
    ("DFR", "diffracts"),
    ("DWV", "diffracts"),
    ("ZRN", "is a Zernike surface"),
    ("SPS", "is a special surface"),
    ("NSS", "is non-sequential"),
    ("GTO", "has global coordinates"),
];

/// The place of a surface's numbers.
#[derive(Clone, Copy, Default)]
struct Places {
    surface: Span,
    columns: [Option<Span>; 4],
}

struct Reader<'a> {
    source: &'a Arc<Source>,
    glasses: &'a Catalogue,
    name: Option<&'a str>,
    /// The surfaces with the object's.
    surfaces: Vec<Surface>,
    places: Vec<Places>,
    wavelengths: Vec<f64>,
    unit: f64,
    beam: Beam,
    stated_aperture: Option<Span>,
    ended: bool,
}

fn read(source: &Arc<Source>, glasses: &Catalogue, sink: &mut Sink) -> Result<Prescription> {
    let mut reader = Reader {
        source,
        glasses,
        name: None,
        surfaces: vec![plain(Span::at(0))],
        places: vec![Places::default()],
        // OSLO's default wavelengths, in nanometers.
        wavelengths: vec![D_LINE, F_LINE, C_LINE],
        unit: 1.0,
        beam: Beam {
            edge_share: 1.0,
            ..Beam::default()
        },
        stated_aperture: None,
        ended: false,
    };
    let commands = commands(text(source));
    // Model glasses have an index for each wavelength, which the file may list behind them.
    if let Some(command) = commands.iter().find(|command| command[0].is("WV")) {
        let numbers = command[1..].iter().map(|word| word.number(source));
        reader.wavelengths = numbers
            .map(|um| um.map(|um| named_line(1e3 * um)))
            .collect::<Result<_>>()?;
    }
    for command in &commands {
        reader.execute(command, sink)?;
    }
    reader.finish(sink)
}

/// The commands of a text. `//` begins a comment.
fn commands(text: &str) -> Vec<Vec<Word<'_>>> {
    let mut commands = Vec::new();
    for (start, line) in lines(text) {
        let data = line.split("//").next().unwrap_or("");
        let mut at = start;
        for part in data.split(';') {
            commands.push(words(part, at));
            at += part.len() + 1;
        }
    }
    commands.retain(|command| !command.is_empty());
    commands
}

/// A plane without an aperture, in air.
fn plain(span: Span) -> Surface {
    Surface {
        span,
        ..Surface::sphere(0.0, 0.0, Medium::air(), f64::INFINITY)
    }
}

impl<'a> Reader<'a> {
    fn fail(&self, span: Span, message: String) -> Box<Diagnostic> {
        Diagnostic::error(message).at(self.source, span)
    }

    fn value(&self, command: &[Word<'_>]) -> Result<f64> {
        first_number(command, self.source)
    }

    fn execute(&mut self, command: &[Word<'a>], sink: &mut Sink) -> Result<()> {
        let word = command[0];
        let name = word.text.to_ascii_uppercase();
        let refused = REFUSED.iter().find(|(refused, _)| *refused == name);
        let is_zero = command.get(1).is_some_and(|w| w.text.parse() == Ok(0.0));
        if let Some((_, what)) = refused
            && !is_zero
        {
            let number = self.surfaces.len() - 1;
            let message = format!("`{name}` is not read: surface {number} {what}");
            return Err(self
                .fail(word.span, message)
                .with_help("ivcam traces lenses on one straight axis, without gratings"));
        }
        if self.ended {
            return Ok(());
        }
        match name.as_str() {
            "LEN" => {
                let named = command.iter().skip(1).find(|w| !w.is("NEW"));
                self.name = named.map(|w| w.text).filter(|name| !name.is_empty());
            }
            "UNI" => {
                self.unit = self.value(command)?;
                if !(self.unit > 0.0) {
                    let message = format!("a unit of {} mm is not possible", self.unit);
                    return Err(self.fail(word.span, message));
                }
            }
            "EBR" => {
                self.beam.entrance_diameter = Some(2.0 * self.value(command)?).filter(|d| *d > 0.0);
                self.stated_aperture = Some(word.span);
            }
            "FNO" => {
                self.beam.f_number = Some(self.value(command)?).filter(|n| *n > 0.0);
                self.stated_aperture = Some(word.span);
            }
            "ANG" => self.beam.half_field = self.value(command)?.abs(),
            "GIH" => self.beam.image_height = Some(self.value(command)?.abs()),
            "NXT" => {
                check_count(self.surfaces.len(), self.source)?;
                self.surfaces.push(plain(word.span));
                self.places.push(Places {
                    surface: word.span,
                    ..Places::default()
                });
            }
            "END" => self.ended = true,
            _ => self.of_surface(&name, command, sink)?,
        }
        Ok(())
    }

    /// Executes a command that changes the last surface.
    fn of_surface(&mut self, name: &str, command: &[Word<'a>], sink: &mut Sink) -> Result<()> {
        let last = self.surfaces.len() - 1;
        let place = |column: Column, places: &mut Vec<Places>| {
            let span = command.get(1).map_or(command[0].span, |w| w.span);
            places[last].columns[column as usize] = Some(span);
        };
        match name {
            "RD" => {
                self.surfaces[last].curvature = Curvature::from_radius(self.value(command)?);
                place(Column::Radius, &mut self.places);
            }
            "CV" => {
                self.surfaces[last].curvature = Curvature::from_curvature(self.value(command)?);
                place(Column::Radius, &mut self.places);
            }
            "TH" => {
                self.surfaces[last].thickness = self.value(command)?;
                place(Column::Thickness, &mut self.places);
            }
            "AIR" => self.surfaces[last].medium = Medium::air(),
            "GLA" | "GLF" => {
                self.surfaces[last].medium = self.glass(command)?;
                place(Column::Index, &mut self.places);
            }
            "AST" => self.surfaces[last].is_stop = last > 0,
            "AP" => {
                let numbers = command[1..].iter().find(|w| w.text.parse::<f64>().is_ok());
                if let Some(word) = numbers {
                    let radius = word.number(self.source)?;
                    self.surfaces[last].semi_diameter = match radius {
                        0.0 => f64::INFINITY,
                        radius => radius,
                    };
                    self.places[last].columns[Column::SemiDiameter as usize] = Some(word.span);
                }
            }
            "CC" => {
                let k = self.value(command)?;
                let shape = &mut self.surfaces[last].shape;
                *shape = match std::mem::replace(shape, Shape::Sphere) {
                    Shape::Asphere { terms, .. } => Shape::Asphere { k, terms },
                    _ if k != 0.0 => Shape::Conic { k },
                    other => other,
                };
            }
            "AD" | "AE" | "AF" | "AG" => {
                let power = match name {
                    "AD" => 4,
                    "AE" => 6,
                    "AF" => 8,
                    _ => 10,
                };
                self.term(power, self.value(command)?);
            }
            "ASP" => {
                let kind = command.get(1).map_or("", |w| w.text);
                let message = format!("an asphere of the kind `ASP {kind}` is not read");
                return Err(self.fail(command[0].span, message));
            }
            _ if name.starts_with("AP") && name.len() > 2 => {
                let message = format!("the aperture `{name}` is left out");
                sink.warn(command[0].span, message);
            }
            _ => {}
        }
        Ok(())
    }

    fn term(&mut self, power: usize, value: f64) {
        if value == 0.0 {
            return;
        }
        let last = self.surfaces.len() - 1;
        let shape = &mut self.surfaces[last].shape;
        *shape = std::mem::replace(shape, Shape::Sphere).with_term(power, value);
    }

    /// `GLA N-BK7`, `GLA 1.5168`, `GLA MOD name n1 n2 n3`.
    fn glass(&self, command: &[Word<'a>]) -> Result<Medium> {
        let Some(first) = command.get(1) else {
            return Ok(Medium::air());
        };
        let indices = |words: &[Word<'a>]| -> Result<Vec<f64>> {
            words.iter().map(|word| word.number(self.source)).collect()
        };
        let (name, indices) = match first.is("MOD") {
            true => (command.get(2), indices(command.get(3..).unwrap_or(&[]))?),
            false if first.text.parse::<f64>().is_ok() => (None, indices(&command[1..])?),
            false => return self.glasses.get(first.text, self.source, first.span),
        };
        let waves = self.wavelengths.iter().copied();
        let table: Vec<(f64, f64)> = waves.zip(indices.iter().copied()).collect();
        let at = |nm| interpolated(&table, nm);
        let medium = match (at(F_LINE), at(D_LINE), at(C_LINE), &indices[..]) {
            (Some(f), Some(d), Some(c), _) => Medium::from_lines(f, d, c),
            (_, Some(d), ..) => Medium::constant(d),
            (.., [first, ..]) => Medium::constant(*first),
            _ => {
                let message = format!("the glass `{}` has no index", first.text);
                return Err(self.fail(first.span, message));
            }
        };
        Ok(match name {
            Some(name) => medium.named(name.text),
            None => medium,
        })
    }

    /// Removes the planes that have no effect on light. Between other surfaces they only lengthen
    /// the gap.
    fn remove_dummies(&mut self, object: &Medium) {
        let all = std::mem::take(&mut self.surfaces);
        let mut places = Vec::new();
        for (surface, place) in all.into_iter().zip(&self.places) {
            let before = self.surfaces.last().map_or(object, |last| &last.medium);
            if surface.is_dummy(before) {
                if let Some(last) = self.surfaces.last_mut() {
                    last.thickness += surface.thickness;
                }
                continue;
            }
            self.surfaces.push(surface);
            places.push(*place);
        }
        self.places = places;
    }

    fn finish(mut self, sink: &mut Sink) -> Result<Prescription> {
        if self.surfaces.len() < 3 {
            let message = "the file has no surfaces between object and image";
            return Err(self
                .fail(Span::at(0), message.into())
                .with_help("OSLO begins each surface behind the object with `NXT`"));
        }
        let object = self.surfaces.remove(0);
        self.surfaces.pop();
        self.places.remove(0);
        self.remove_dummies(&object.medium);
        let name = self
            .name
            .map_or_else(|| name_of(self.source), str::to_owned);
        let mut lens = Prescription {
            object_medium: object.medium,
            ..Prescription::new(name, self.surfaces)
        };
        if fill(&mut lens, self.beam) {
            sink.note(
                Span::at(0),
                "apertures that the file leaves out are those of its beam",
            );
        }
        if let Some(span) = self.stated_aperture {
            note_f_number(&mut lens, self.beam, span);
        }
        let places = self.places;
        check(&mut lens, self.source, sink, |surface, column| {
            places.get(surface).map_or(Span::at(0), |p| {
                p.columns[column as usize].unwrap_or(p.surface)
            })
        })?;
        Ok(match self.unit {
            1.0 => lens,
            unit => lens.scaled(unit),
        })
    }
}
