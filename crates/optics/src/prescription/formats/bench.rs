//! Reads the text of PhotonsToPhotos' Optical Bench: sections of lines with tabs between values.
//!
//! `[lens data]` has the number of a surface, its radius, the thickness behind it, the index and
//! the diameter, the Abbe number, and perhaps the name of the glass. The radius `AS` is the
//! aperture stop, `FS` a field stop, `CG` a cover glass. A thickness may be a name, such as `d13`
//! or `Bf`, whose values in `[variable distances]` are the positions of a zoom or of the focus.
//! `[aspherical data]` has the number, the radius, the conic constant and the coefficients from r⁴
//! in steps of two. With the constant `AsphericalA2` they begin at r², and with
//! `AsphericalOddCount` n they begin at r³ and go in steps of one for n odd powers.

use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result, Sink, Source, Span};

use crate::prescription::formats::apertures::{Beam, note_f_number};
use crate::prescription::formats::format::Format;
use crate::prescription::formats::origin::name_of;
use crate::prescription::glass::catalogue::Catalogue;
use crate::prescription::glass::medium::Medium;
use crate::prescription::prescription::{Column, Prescription, ZoomPosition, check, check_count};
use crate::prescription::surface::{MAX_POWER, Shape, Surface};
use crate::prescription::text::{Word, lines, text};

/// The text of the Optical Bench, recognized by the heading of its table.
pub(crate) static FORMAT: Format = Format {
    name: "Optical Bench",
    recognizes: |text| {
        let mut lines = text.lines().map(str::trim);
        lines.any(|line| line.eq_ignore_ascii_case("[lens data]"))
    },
    read: |source, how, sink| read(source, &how.glasses, sink),
};

/// The largest number of zoom positions.
const MAX_POSITIONS: usize = 100;

/// A line: the values between its tabs, which may be empty.
type Line<'a> = Vec<Word<'a>>;

/// The sections of a file.
#[derive(Default)]
struct Sections<'a> {
    title: Option<&'a str>,
    constants: Vec<Line<'a>>,
    variables: Vec<Line<'a>>,
    surfaces: Vec<Line<'a>>,
    aspheres: Vec<Line<'a>>,
}

struct Reader<'a> {
    source: &'a Arc<Source>,
    glasses: &'a Catalogue,
    sections: Sections<'a>,
}

/// Reads the text of the Optical Bench.
fn read(source: &Arc<Source>, glasses: &Catalogue, sink: &mut Sink) -> Result<Prescription> {
    let reader = Reader {
        source,
        glasses,
        sections: sections(text(source)),
    };
    let rows = &reader.sections.surfaces;
    check_count(rows.len(), source)?;
    let mut lens = reader.lens()?;
    reader.aspheres(&mut lens)?;
    let beam = Beam {
        f_number: reader.stated("F-Number", 0).filter(|n| *n > 0.0),
        ..Beam::default()
    };
    if let Some(line) = reader.variable("F-Number").filter(|_| lens.zoom.is_empty()) {
        note_f_number(&mut lens, beam, line[0].span);
    }
    check(&mut lens, source, sink, |surface, column| {
        let at = match column {
            Column::Radius => 1,
            Column::Thickness => 2,
            Column::Index => 3,
            Column::SemiDiameter => 4,
        };
        let row = rows.get(surface);
        row.and_then(|row| row.get(at).or(row.first()))
            .map_or(Span::at(0), |word| word.span)
    })?;
    Ok(lens)
}

/// Divides a text into its sections.
fn sections(text: &str) -> Sections<'_> {
    let mut sections = Sections::default();
    let mut section = String::new();
    for (start, line) in lines(text) {
        let trimmed = line.trim();
        if trimmed.is_empty() || trimmed.starts_with('#') {
            continue;
        }
        if trimmed.starts_with('[') {
            section = trimmed.to_ascii_lowercase();
            continue;
        }
        let values = values(line, start);
        match section.as_str() {
            "[descriptive data]" if values[0].is("title") => {
                sections.title = values.get(1).map(|word| word.text);
            }
            "[constants]" => sections.constants.push(values),
            "[variable distances]" => sections.variables.push(values),
            "[lens data]" => sections.surfaces.push(values),
            "[aspherical data]" => sections.aspheres.push(values),
            _ => {}
        }
    }
    sections
}

/// The values of a line. A line that has lost its tabs is divided at its blanks.
fn values(line: &str, start: usize) -> Line<'_> {
    let word = |piece: &'_ str| {
        (
            piece.as_ptr() as usize - line.as_ptr() as usize,
            piece.len(),
        )
    };
    let pieces: Vec<(usize, usize)> = match line.contains('\t') {
        true => line.split('\t').map(str::trim).map(word).collect(),
        false => line.split_whitespace().map(word).collect(),
    };
    let at = |(from, length): (usize, usize)| Word {
        text: &line[from..from + length],
        span: Span::new(start + from, start + from + length),
    };
    pieces.into_iter().map(at).collect()
}

impl<'a> Reader<'a> {
    fn fail(&self, span: Span, message: String) -> Box<Diagnostic> {
        Diagnostic::error(message).at(self.source, span)
    }

    /// The line of a variable distance, or of another value in that section.
    fn variable(&self, name: &str) -> Option<&Line<'a>> {
        let variables = &self.sections.variables;
        variables.iter().find(|line| line[0].is(name))
    }

    /// The value of a variable in a position, if it is a number.
    fn stated(&self, name: &str, position: usize) -> Option<f64> {
        let line = self.variable(name)?;
        let word = line.get(position + 1).or(line.get(1))?;
        word.text.parse().ok().filter(|v: &f64| v.is_finite())
    }

    /// A number, or the name of a variable distance in a position.
    fn value(&self, word: Word<'_>, position: usize) -> Result<f64> {
        if let Ok(number) = word.text.parse::<f64>() {
            return match number.is_finite() {
                true => Ok(number),
                false => Ok(0.0),
            };
        }
        if self.variable(word.text).is_none() {
            let message = format!(
                "`{}` is neither a number nor a variable distance",
                word.text
            );
            return Err(self
                .fail(word.span, message)
                .with_help("names such as `d13` have their values in [variable distances]"));
        }
        self.stated(word.text, position).ok_or_else(|| {
            self.fail(
                word.span,
                format!("the distance `{}` has no number", word.text),
            )
        })
    }

    fn lens(&self) -> Result<Prescription> {
        let mut surfaces = Vec::new();
        let mut medium = Medium::air();
        for row in &self.sections.surfaces {
            let surface = self.surface(row, &medium)?;
            medium = surface.medium.clone();
            surfaces.push(surface);
        }
        let name = self.sections.title.map(str::to_owned);
        let mut lens = Prescription::new(name.unwrap_or_else(|| name_of(self.source)), surfaces);
        for (name, note) in [("Focal Length", "focal length"), ("F-Number", "f-number")] {
            let value = self.stated(name, 0);
            lens.notes
                .extend(value.map(|value| format!("{note}: {value}")));
        }
        let field = self.stated("Angle of View", 0);
        lens.notes
            .extend(field.map(|field| format!("field: {field} degrees")));
        lens.image_height = self
            .stated("Image Height", 0)
            .map(|h| 0.5 * h)
            .filter(|h| *h > 0.0);
        lens.zoom = self.positions()?;
        Ok(lens)
    }

    /// A row: number, radius, thickness, index, diameter, Abbe number and glass. A row without tabs
    /// that is of air has no index.
    fn surface(&self, row: &Line<'a>, before: &Medium) -> Result<Surface> {
        let cell = |at: usize| row.get(at).copied().filter(|word| !word.text.is_empty());
        let (Some(number), Some(radius), Some(thickness)) = (cell(0), cell(1), cell(2)) else {
            return Err(self
                .fail(row[0].span, "too few values in this surface".into())
                .with_help(
                    "a surface is: number, radius, thickness, index, diameter, Abbe number",
                ));
        };
        let is_stop = radius.is("AS");
        let is_flat = is_stop || ["FS", "CG", "INFINITY", "INF"].iter().any(|w| radius.is(w));
        let bend = match is_flat {
            true => 0.0,
            false => self.value(radius, 0)?,
        };
        let lost_tabs = row.len() == 4;
        let (index, diameter) = match lost_tabs {
            true => (None, cell(3)),
            false => (cell(3), cell(4)),
        };
        let medium = match index {
            Some(index) => self.medium(index, cell(5), cell(6))?,
            None if is_stop || radius.is("FS") => before.clone(),
            None => Medium::air(),
        };
        let semi_diameter = match diameter {
            Some(word) => match self.value(word, 0)? {
                0.0 => f64::INFINITY,
                diameter => 0.5 * diameter,
            },
            None => f64::INFINITY,
        };
        let surface = Surface::sphere(bend, self.value(thickness, 0)?, medium, semi_diameter);
        Ok(Surface {
            is_stop,
            span: number.span,
            ..surface
        })
    }

    /// The medium of an index and an Abbe number. The dispersion is that of the glass of the
    /// catalogue that the row names, if it has that index.
    fn medium(
        &self,
        index: Word<'_>,
        abbe: Option<Word<'_>>,
        glass: Option<Word<'_>>,
    ) -> Result<Medium> {
        let n_d = index.number(self.source)?;
        let abbe = abbe.map(|word| word.number(self.source)).transpose()?;
        let named = glass.and_then(|word| self.glasses.find(word.text));
        if let Some(glass) = named.filter(|glass| (glass.n_d - n_d).abs() < 1e-4) {
            return Ok(Medium {
                n_d,
                ..glass.clone()
            });
        }
        Ok(match abbe {
            Some(abbe) if abbe > 0.0 => Medium::from_abbe(n_d, abbe),
            _ => Medium::constant(n_d),
        })
    }

    /// The positions of the zoom or of the focus, if distances have more than one value.
    fn positions(&self) -> Result<Vec<ZoomPosition>> {
        let rows = self.sections.surfaces.iter().enumerate();
        let is_name = |word: &Word<'a>| word.text.parse::<f64>().is_err();
        let varied: Vec<(usize, Word<'a>)> = rows
            .filter_map(|(i, row)| Some((i, *row.get(2).filter(|word| is_name(word))?)))
            .collect();
        let values = |name: &str| {
            let numbers = |line: &Line<'a>| line.iter().skip(1).filter(|w| !is_name(w)).count();
            self.variable(name).map_or(0, numbers)
        };
        let count = varied
            .iter()
            .map(|(_, name)| values(name.text))
            .max()
            .unwrap_or(0);
        if count < 2 {
            return Ok(Vec::new());
        }
        let position = |position: usize| {
            let gaps = varied
                .iter()
                .map(|(i, name)| Ok((*i, self.value(*name, position)?)));
            let word = |name: &str| self.variable(name)?.get(position + 1).map(|w| w.text);
            let focal = word("Focal Length").filter(|w| w.parse::<f64>().is_ok());
            let name = match (focal, word("d0"), word("Magnification")) {
                (Some(f), Some(d0), _) => format!("{f} mm, object at {d0}"),
                (Some(f), ..) => format!("{f} mm"),
                (None, Some(d0), _) => format!("object at {d0}"),
                (None, None, Some(m)) => format!("magnification {m}"),
                _ => format!("position {}", position + 1),
            };
            Ok(ZoomPosition {
                name,
                gaps: gaps.collect::<Result<_>>()?,
                stop_semi_diameter: None,
            })
        };
        (0..count.min(MAX_POSITIONS)).map(position).collect()
    }

    /// The powers of r of the coefficients.
    fn powers(&self) -> Result<Vec<usize>> {
        let constant = |name: &str| self.sections.constants.iter().find(|line| line[0].is(name));
        let odd = match constant("AsphericalOddCount").and_then(|line| line.get(1)) {
            Some(word) => word.number(self.source)?.clamp(0.0, MAX_POWER as f64) as usize,
            None => 0,
        };
        let first = if constant("AsphericalA2").is_some() {
            2
        } else {
            4
        };
        let even = (first..=MAX_POWER).step_by(2);
        let mut powers: Vec<usize> = (1..=odd).map(|i| 2 * i + 1).chain(even).collect();
        powers.sort_unstable();
        Ok(powers)
    }

    fn aspheres(&self, lens: &mut Prescription) -> Result<()> {
        let powers = self.powers()?;
        for line in &self.sections.aspheres {
            let rows = &self.sections.surfaces;
            let Some(surface) = rows.iter().position(|row| row[0].text == line[0].text) else {
                let message = format!("there is no surface `{}`", line[0].text);
                return Err(self.fail(line[0].span, message));
            };
            let filled = line.iter().skip(2).filter(|word| !word.text.is_empty());
            let numbers: Vec<(f64, Span)> = filled
                .map(|word| Ok((word.number(self.source)?, word.span)))
                .collect::<Result<_>>()?;
            let Some(((k, _), coefficients)) = numbers.split_first() else {
                continue;
            };
            let mut terms = Box::new([0.0; MAX_POWER + 1]);
            for (i, (value, span)) in coefficients.iter().enumerate() {
                match powers.get(i) {
                    Some(power) => terms[*power] = *value,
                    None if *value == 0.0 => {}
                    None => {
                        let message = format!("powers of r above {MAX_POWER} are not read");
                        return Err(self.fail(*span, message));
                    }
                }
            }
            lens.surfaces[surface].shape = match terms.iter().any(|t| *t != 0.0) {
                true => Shape::Asphere { k: *k, terms },
                false if *k != 0.0 => Shape::Conic { k: *k },
                false => Shape::Sphere,
            };
        }
        Ok(())
    }
}
