//! Reads the text of PhotonsToPhotos' Optical Bench: sections of lines with tabs between values.
//!
//! `[lens data]` has the number of a surface, its radius, the thickness behind it, the index and
//! the diameter, the Abbe number, and perhaps the name of the glass. The radius `AS` is the
//! aperture stop, `FS` a field stop, `CG` a cover glass. A thickness may be a name, such as `d13`
//! or `Bf`, whose values in `[variable distances]` are the positions of a zoom or of the focus.
//! `[aspherical data]` has the number, the radius, the conic constant and the coefficients from r⁴
//! in steps of two. With the constant `AsphericalA2` they begin at r², and with
//! `AsphericalOddCount` n they begin at r³ and go in steps of one for n odd powers.

use std::iter;

use ivcam_base::diag::{Result, Sink};

use crate::prescription::formats::apertures::{F_NUMBER_TOLERANCE, SystemData, note_f_number};
use crate::prescription::formats::format::PrescriptionFormat;
use crate::prescription::formats::reader::{Draft, PrescriptionReader, SurfaceSpans, open_if_zero};
use crate::prescription::glass::medium::Medium;
use crate::prescription::prescription::{Prescription, ZoomPosition};
use crate::prescription::surface::{MAX_POWER, Shape, Surface};
use crate::prescription::text::{Word, Words, lines};

/// The text of the Optical Bench, recognized by the heading of its table.
pub(crate) static FORMAT: PrescriptionFormat = PrescriptionFormat {
    name: "Optical Bench",
    recognizes: |text| {
        let mut lines = text.lines().map(str::trim);
        lines.any(|line| line.eq_ignore_ascii_case("[lens data]"))
    },
    read,
};

/// The largest number of zoom positions.
const MAX_POSITIONS: usize = 100;

/// The sections of a file of the Optical Bench. A line is the values between its tabs, which may be
/// empty.
struct BenchReader<'a> {
    file: PrescriptionReader<'a>,
    title: Option<&'a str>,
    constants: Vec<Words<'a>>,
    variables: Vec<Words<'a>>,
    surfaces: Vec<Words<'a>>,
    aspheres: Vec<Words<'a>>,
}

/// Reads the text of the Optical Bench.
fn read(file: PrescriptionReader<'_>, sink: &mut Sink) -> Result<Prescription> {
    let reader = BenchReader::new(file);
    file.check_count(reader.surfaces.len())?;
    let mut draft = reader.draft()?;
    reader.aspheres(&mut draft.lens)?;
    let line = reader.variable("F-Number");
    if let Some(line) = line.filter(|_| draft.lens.zoom.is_empty()) {
        let mut beam = SystemData::default();
        let f_number = reader.stated("F-Number", 0).unwrap_or(0.0);
        beam.state_f_number(f_number, line[0].span);
        note_f_number(&mut draft.lens, beam, F_NUMBER_TOLERANCE);
    }
    file.finish(draft, sink)
}

/// The values of a line. A line that has lost its tabs is divided at its blanks.
fn values(line: &str, start: usize) -> Words<'_> {
    let word = |text| Word::at(line, text, start);
    match line.contains('\t') {
        true => line.split('\t').map(str::trim).map(word).collect(),
        false => line.split_whitespace().map(word).collect(),
    }
}

fn is_number(word: &Word<'_>) -> bool {
    word.text.parse::<f64>().is_ok()
}

impl<'a> BenchReader<'a> {
    /// Divides a text into its sections.
    fn new(file: PrescriptionReader<'a>) -> Self {
        let mut sections = Self {
            file,
            title: None,
            constants: Vec::new(),
            variables: Vec::new(),
            surfaces: Vec::new(),
            aspheres: Vec::new(),
        };
        let mut section = String::new();
        for (start, line) in lines(file.text()) {
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

    /// The line of a variable distance, or of another value in that section.
    fn variable(&self, name: &str) -> Option<&Words<'a>> {
        self.variables.iter().find(|line| line[0].is(name))
    }

    /// The value of a variable in a position, if it is a number.
    fn stated(&self, name: &str, position: usize) -> Option<f64> {
        let line = self.variable(name)?;
        let word = line.get(position + 1).or(line.get(1))?;
        word.text.parse().ok().filter(|v: &f64| v.is_finite())
    }

    /// A number, or the name of a variable distance in a position.
    fn value(&self, word: Word<'_>, position: usize) -> Result<f64> {
        let name = word.text;
        if let Ok(number) = name.parse::<f64>() {
            return Ok(if number.is_finite() { number } else { 0.0 });
        }
        if self.variable(name).is_none() {
            let message = format!("`{name}` is neither a number nor a variable distance");
            let help = "names such as `d13` have their values in [variable distances]";
            return Err(self.file.refuse(word.span, message, help));
        }
        let no_number = || format!("the distance `{name}` has no number");
        self.stated(name, position)
            .ok_or_else(|| self.file.fail(word.span, no_number()))
    }

    /// The lens without the polynomials of its aspheres.
    fn draft(&self) -> Result<Draft> {
        let mut draft = self.file.draft(self.title);
        for row in &self.surfaces {
            let (surface, places) = self.surface(row, draft.medium())?;
            draft.push(surface, places);
        }
        for (name, note, unit) in [
            ("Focal Length", "focal length", ""),
            ("F-Number", "f-number", ""),
            ("Angle of View", "field", " degrees"),
        ] {
            let value = self.stated(name, 0);
            let note = value.map(|value| format!("{note}: {value}{unit}"));
            draft.lens.notes.extend(note);
        }
        let height = self.stated("Image Height", 0).map(|h| 0.5 * h);
        draft.lens.image_height = height.filter(|h| *h > 0.0);
        draft.lens.zoom = self.positions()?;
        Ok(draft)
    }

    /// A row: number, radius, thickness, index, diameter, Abbe number and glass. A row without tabs
    /// that is of air has no index.
    fn surface(&self, row: &Words<'a>, before: &Medium) -> Result<(Surface, SurfaceSpans)> {
        let cell = |at: usize| row.get(at).copied().filter(|word| !word.text.is_empty());
        let (Some(number), Some(radius), Some(thickness)) = (cell(0), cell(1), cell(2)) else {
            let help = "a surface is: number, radius, thickness, index, diameter, Abbe number";
            return Err(self
                .file
                .refuse(row[0].span, "too few values in this surface", help));
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
        let diameter = diameter.map_or(Ok(0.0), |word| self.value(word, 0))?;
        let semi_diameter = 0.5 * open_if_zero(diameter);
        let surface = Surface::sphere(bend, self.value(thickness, 0)?, medium, semi_diameter);
        let surface = Surface {
            is_stop,
            span: number.span,
            ..surface
        };
        let places = [1, 2, 3, 4].map(|at| row.get(at).unwrap_or(&row[0]).span);
        Ok((surface, places))
    }

    /// The medium of an index and an Abbe number. The dispersion is that of the glass of the
    /// catalogue that the row names, if it has that index.
    fn medium(
        &self,
        index: Word<'_>,
        abbe: Option<Word<'_>>,
        glass: Option<Word<'_>>,
    ) -> Result<Medium> {
        let n_d = self.file.number(index)?;
        let abbe = abbe.map(|word| self.file.number(word)).transpose()?;
        let glasses = &self.file.options.glasses;
        let named = glass.and_then(|word| glasses.find(word.text));
        Ok(match named.filter(|glass| (glass.n_d - n_d).abs() < 1e-4) {
            Some(glass) => Medium {
                n_d,
                ..glass.clone()
            },
            None => Medium::from_index(n_d, abbe),
        })
    }

    /// The positions of the zoom or of the focus, if distances have more than one value.
    fn positions(&self) -> Result<Vec<ZoomPosition>> {
        let rows = self.surfaces.iter().enumerate();
        let varied: Vec<(usize, Word<'a>)> = rows
            .filter_map(|(i, row)| Some((i, *row.get(2).filter(|word| !is_number(word))?)))
            .collect();
        let values = |(_, name): &(usize, Word<'a>)| {
            let numbers = |line: &Words<'a>| line.iter().skip(1).filter(|w| is_number(w)).count();
            self.variable(name.text).map_or(0, numbers)
        };
        let count = varied.iter().map(values).max().unwrap_or(0);
        if count < 2 {
            return Ok(Vec::new());
        }
        let position = |position: usize| {
            let gap = |(i, name): &(usize, Word<'a>)| Ok((*i, self.value(*name, position)?));
            Ok(ZoomPosition {
                name: self.position_name(position),
                gaps: varied.iter().map(gap).collect::<Result<_>>()?,
                stop_semi_diameter: None,
            })
        };
        (0..count.min(MAX_POSITIONS)).map(position).collect()
    }

    /// The name of a position: its focal length, the distance of its object or its magnification.
    fn position_name(&self, position: usize) -> String {
        let word = |name: &str| self.variable(name)?.get(position + 1);
        let focal = word("Focal Length").filter(|word| is_number(word));
        match (focal, word("d0"), word("Magnification")) {
            (Some(f), Some(d0), _) => format!("{} mm, object at {}", f.text, d0.text),
            (Some(f), ..) => format!("{} mm", f.text),
            (None, Some(d0), _) => format!("object at {}", d0.text),
            (None, None, Some(m)) => format!("magnification {}", m.text),
            _ => format!("position {}", position + 1),
        }
    }

    /// The powers of r of the coefficients: those that are read, and then further even ones.
    fn powers(&self) -> Result<Vec<usize>> {
        let constant = |name: &str| self.constants.iter().find(|line| line[0].is(name));
        let odd = match constant("AsphericalOddCount").and_then(|line| line.get(1)) {
            Some(word) => self.file.number(*word)?.clamp(0.0, MAX_POWER as f64) as usize,
            None => 0,
        };
        let first = match constant("AsphericalA2") {
            Some(_) => 2,
            None => 4,
        };
        let even = (first..=MAX_POWER).step_by(2);
        let mut powers: Vec<usize> = (1..=odd).map(|i| 2 * i + 1).chain(even).collect();
        powers.sort_unstable();
        Ok(powers)
    }

    /// Gives the surfaces their conic constants and polynomials.
    fn aspheres(&self, lens: &mut Prescription) -> Result<()> {
        let powers = self.powers()?;
        for line in &self.aspheres {
            let same = |row: &Words<'a>| row[0].text == line[0].text;
            let Some(surface) = self.surfaces.iter().position(same) else {
                let message = format!("there is no surface `{}`", line[0].text);
                return Err(self.file.fail(line[0].span, message));
            };
            let filled = line.iter().skip(2).filter(|word| !word.text.is_empty());
            let words: Vec<Word<'a>> = filled.copied().collect();
            let numbers = self.file.numbers(&words)?;
            let Some((k, coefficients)) = numbers.split_first() else {
                continue;
            };
            let beyond = iter::repeat(MAX_POWER + 1);
            let terms = powers
                .iter()
                .copied()
                .chain(beyond)
                .zip(coefficients.iter().copied());
            lens.surfaces[surface].shape = Shape::from_terms(*k, terms).map_err(|_| {
                let message = format!("powers of r above {MAX_POWER} are not read");
                let is_wrong = |(i, value): &(usize, &f64)| {
                    powers.get(*i).is_none_or(|p| *p > MAX_POWER) && **value != 0.0
                };
                let mut wrong = coefficients.iter().enumerate();
                let at = wrong.find(is_wrong).map_or(0, |(i, _)| i + 1);
                self.file.fail(words[at].span, message)
            })?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use ivcam_base::diag::Source;

    use super::*;

    /// With 20 odd powers, from 3 to 41, between the even ones, the 19th coefficient is that of
    /// r^21.
    #[test]
    fn a_power_above_the_highest_is_refused_at_its_coefficient() {
        let read = |coefficients: usize| {
            let text = format!(
                "[constants]\nAsphericalOddCount\t20\n[lens data]\n1\t50\t5\t1.5\t20\n\
                 2\t-50\t40\t\t20\n[aspherical data]\n1\t50\t0{}",
                "\t1".repeat(coefficients)
            );
            let source = Arc::new(Source::new("a.txt", text.into_bytes()));
            crate::prescription::formats::read(&source, &mut Sink::new())
        };
        assert!(
            matches!(&read(18).unwrap().surfaces[0].shape, Shape::Asphere { terms, .. }
            if terms[1..4] == [0.0, 0.0, 1.0] && terms[MAX_POWER] == 1.0)
        );
        let error = read(19).unwrap_err();
        assert!(error.message.contains("above 20"), "{error}");
        assert_eq!(error.location().1, Some((7, 6 + 2 * 19)));
    }
}
