//! Zemax's sequential files: `SURF n` and indented lines of a keyword and its values.
//!
//! Read: STANDARD, EVENASPH, ODDASPHE, XASPHERE, XOSPHERE, TOROIDAL and BICONICX where it is a
//! cylinder or of revolution; glasses by name, as `___BLANK` models or as that of another surface;
//! configurations that change thicknesses or the stop, as zoom positions. What tilts, reflects or
//! diffracts is refused by name. DIAM is a semi-diameter. Dummy planes that do nothing are dropped.

use std::sync::Arc;

use crate::diag::{Diagnostic, Result, Sink, Source, Span};
use crate::lens::glass::catalogue::Catalogue;
use crate::lens::glass::coating::Coating;
use crate::lens::glass::medium::Medium;
use crate::lens::prescription::{Column, Prescription, ZoomPosition, check};
use crate::lens::surface::{Curvature, MAX_POWER, Shape, Surface};
use crate::math::LengthUnit;

use super::apertures::{Beam, fill};
use super::text::{Word, lines, text, words};

/// A line of the file: its keyword and values.
type Line<'a> = Vec<Word<'a>>;

/// Keywords of a surface, which belong to it in files that have lost their indentation too.
const OF_SURFACE: [&str; 17] = [
    "TYPE", "COMM", "CURV", "CONI", "PARM", "XDAT", "DISZ", "GLAS", "DIAM", "MEMA", "STOP", "FLAP",
    "CLAP", "OBSC", "COAT", "HIDE", "POPS",
];

/// Configurations that change a lens in a way that is not read.
const OTHER_OPERANDS: [&str; 14] = [
    "CRVT", "CONN", "GLSS", "MIND", "MABB", "STPS", "APER", "SDIA", "PAR1", "PAR2", "PAR3", "PAR4",
    "PRAM", "EDVA",
];

/// The lines of one `SURF`.
struct Block<'a> {
    number: usize,
    heading: Span,
    lines: Vec<Line<'a>>,
}

impl<'a> Block<'a> {
    fn line(&self, keyword: &str) -> Option<&[Word<'a>]> {
        self.lines
            .iter()
            .find(|l| l[0].is(keyword))
            .map(|l| &l[1..])
    }

    fn first(&self, keyword: &str) -> Option<Word<'a>> {
        self.line(keyword)?.first().copied()
    }

    /// `PARM 3 0.5` and `XDAT 3 0.5 …` as (3, 0.5).
    fn numbered(&self, keyword: &'a str) -> impl Iterator<Item = (Word<'a>, Word<'a>)> {
        let lines = self.lines.iter().filter(move |l| l[0].is(keyword));
        lines.filter_map(|l| Some((*l.get(1)?, *l.get(2)?)))
    }
}

/// A surface of the lens: its number in the file, and the gaps that lie behind it with the numbers
/// of the surfaces that they are of, its own and those of dummies that are dropped.
struct Kept {
    number: usize,
    gaps: Vec<(usize, f64)>,
}

struct Reader<'a> {
    source: &'a Arc<Source>,
    glasses: &'a Catalogue,
}

/// Reads a decoded `.zmx` file.
pub fn read(source: &Arc<Source>, glasses: &Catalogue, sink: &mut Sink) -> Result<Prescription> {
    let reader = Reader { source, glasses };
    let (header, blocks) = split(source)?;
    reader.refuse_modes(&header)?;
    let (mut lens, kept) = reader.lens(&header, &blocks, sink)?;
    lens.zoom = reader.zoom(&header, &blocks, &kept, lens.stop(), sink)?;
    let unit = reader.unit(&header)?;
    let beam = reader.beam(&header)?;
    if fill(&mut lens, beam) {
        sink.note(
            Span::at(0),
            "apertures that the file leaves out are those of its beam",
        );
    }
    check(&mut lens, source, sink, |surface, column| {
        let block = kept
            .get(surface)
            .and_then(|k| blocks.iter().find(|b| b.number == k.number));
        place(block, column)
    })?;
    Ok(if unit == 1.0 { lens } else { lens.scaled(unit) })
}

/// Everything before and behind the surfaces, and the surfaces.
fn split(source: &Arc<Source>) -> Result<(Vec<Line<'_>>, Vec<Block<'_>>)> {
    let (mut header, mut blocks) = (Vec::new(), Vec::<Block<'_>>::new());
    for (start, line) in lines(text(source)) {
        let indented = line.starts_with([' ', '\t']);
        let words = words(line, start);
        let Some(first) = words.first() else { continue };
        if first.is("SURF") {
            let number = words.get(1).and_then(|w| w.text.parse().ok());
            let number = number.ok_or_else(|| {
                Diagnostic::error("a `SURF` without a number").at(source, first.span)
            })?;
            let heading = Span {
                end: words[1].span.end,
                ..first.span
            };
            blocks.push(Block {
                number,
                heading,
                lines: Vec::new(),
            });
        } else if (indented || OF_SURFACE.iter().any(|k| first.is(k)))
            && let Some(block) = blocks.last_mut()
        {
            block.lines.push(words);
        } else {
            header.push(words);
        }
    }
    Ok((header, blocks))
}

fn place(block: Option<&Block<'_>>, column: Column) -> Span {
    let Some(block) = block else {
        return Span::at(0);
    };
    let keyword = match column {
        Column::Radius => "CURV",
        Column::Thickness => "DISZ",
        Column::Index => "GLAS",
        Column::SemiDiameter => "DIAM",
    };
    block.first(keyword).map_or(block.heading, |word| word.span)
}

impl Reader<'_> {
    fn fail(&self, span: Span, message: String) -> Box<Diagnostic> {
        Diagnostic::error(message).at(self.source, span)
    }

    fn refuse_modes(&self, header: &[Line<'_>]) -> Result<()> {
        for line in header {
            if let [keyword, mode, ..] = line[..]
                && keyword.is("MODE")
                && !mode.is("SEQ")
            {
                let message = format!("this file is in the mode `{}`", mode.text);
                return Err(self
                    .fail(mode.span, message)
                    .with_help("only sequential files (`MODE SEQ`) describe a lens"));
            }
        }
        Ok(())
    }

    fn unit(&self, header: &[Line<'_>]) -> Result<f64> {
        let Some(word) = header
            .iter()
            .find(|l| l[0].is("UNIT"))
            .and_then(|l| l.get(1))
        else {
            return Ok(1.0);
        };
        let name = word.text.to_ascii_lowercase();
        let name = if name == "meter" { "m" } else { &name };
        match LengthUnit::parse(name) {
            Some(unit) => Ok(unit.millimeters()),
            None => Err(self
                .fail(
                    word.span,
                    format!("`{}` is not a unit of length", word.text),
                )
                .with_help("MM, CM, IN or METER")),
        }
    }

    fn beam(&self, header: &[Line<'_>]) -> Result<Beam> {
        let value = |keyword: &str| match header.iter().find(|l| l[0].is(keyword)) {
            Some(line) => line.get(1).map(|w| w.number(self.source)).transpose(),
            None => Ok(None),
        };
        // FTYP 0 is a field in degrees, 2 and 3 are heights in the image; 1 is one of the object.
        let kind = |number: &str| {
            let lines = header.iter().filter(|l| l[0].is("FTYP"));
            lines
                .into_iter()
                .any(|l| l.get(1).is_some_and(|w| w.is(number)))
        };
        let fields = header.iter().filter(|l| l[0].is("YFLN") || l[0].is("XFLN"));
        let largest = fields
            .flat_map(|l| l[1..].iter())
            .filter_map(|w| w.text.parse::<f64>().ok())
            .fold(0.0, |most: f64, field| most.max(field.abs()));
        Ok(Beam {
            entrance_diameter: value("ENPD")?.filter(|d| *d > 0.0),
            f_number: value("FNUM")?.filter(|n| *n > 0.0),
            half_field: if kind("0") { largest } else { 0.0 },
            image_height: (kind("2") || kind("3")).then_some(largest),
            edge_share: 1.0,
        })
    }

    /// The lens, and what each of its surfaces is in the file.
    fn lens(
        &self,
        header: &[Line<'_>],
        blocks: &[Block<'_>],
        sink: &mut Sink,
    ) -> Result<(Prescription, Vec<Kept>)> {
        // The first is the object and the last the image.
        let [object, inner @ .., _image] = blocks else {
            return Err(self
                .fail(
                    Span::at(0),
                    "the file has no surfaces between object and image".into(),
                )
                .with_help("a Zemax file lists them as `SURF 0`, `SURF 1`, …"));
        };
        let object_medium = self.medium(object, blocks)?;
        let mut surfaces: Vec<Surface> = Vec::new();
        let mut kept: Vec<Kept> = Vec::new();
        let mut medium = object_medium.clone();
        for block in inner {
            let surface = self.surface(block, blocks, sink)?;
            let gap = (block.number, surface.thickness);
            let idle = surface.is_plane() && !surface.is_stop && surface.medium == medium;
            if idle && block.line("FLAP").is_none() && block.line("CLAP").is_none() {
                // A dummy in front does nothing; elsewhere it only lengthens the gap.
                if let (Some(last), Some(kept)) = (surfaces.last_mut(), kept.last_mut()) {
                    last.thickness += surface.thickness;
                    kept.gaps.push(gap);
                }
                continue;
            }
            medium = surface.medium.clone();
            kept.push(Kept {
                number: block.number,
                gaps: vec![gap],
            });
            surfaces.push(surface);
        }
        let words = |keyword: &str| {
            let line = header.iter().find(|l| l[0].is(keyword));
            line.map(|l| l[1..].iter().map(|w| w.text).collect::<Vec<_>>().join(" "))
        };
        let name = words("NAME").filter(|name| !name.is_empty());
        let name = name.unwrap_or_else(|| super::origin::name_of(self.source));
        let mut lens = Prescription {
            object_medium,
            ..Prescription::new(name, surfaces)
        };
        for note in header.iter().filter(|l| l[0].is("NOTE")) {
            let said = note
                .iter()
                .skip(2)
                .map(|w| w.text)
                .collect::<Vec<_>>()
                .join(" ");
            lens.notes.push(said);
        }
        Ok((lens, kept))
    }

    fn surface(&self, block: &Block<'_>, blocks: &[Block<'_>], sink: &mut Sink) -> Result<Surface> {
        let number = |keyword: &str| match block.first(keyword) {
            Some(word) => word.number(self.source),
            None => Ok(0.0),
        };
        let mut curvature = Curvature::from_curvature(number("CURV")?);
        let mut shape = self.shape(block, curvature)?;
        if let Shape::Toroid { across, k, terms } = &shape
            && curvature.is_plane()
            && *k == 0.0
            && terms.iter().all(|t| *t == 0.0)
        {
            (curvature, shape) = (*across, Shape::CylinderY);
        }
        let thickness = match block.first("DISZ") {
            Some(word) if word.is("INFINITY") => 0.0,
            Some(word) => word.number(self.source)?,
            None => 0.0,
        };
        let medium = self.medium(block, blocks)?;
        let is_stop = block.line("STOP").is_some();
        for keyword in [
            "OBSC", "OBDC", "SQAP", "SQOB", "ELAP", "ELOB", "SPID", "UDAD",
        ] {
            if let Some(line) = block.lines.iter().find(|l| l[0].is(keyword)) {
                let message = format!("the aperture `{keyword}` is read as the round one of DIAM");
                sink.warn(line[0].span, message);
            }
        }
        if let Some(inner) = block.first("CLAP")
            && inner.number(self.source)? > 0.0
        {
            sink.warn(
                inner.span,
                "a hole closed in its middle is read as open there",
            );
        }
        Ok(Surface {
            shape,
            curvature,
            thickness,
            medium,
            semi_diameter: self.semi_diameter(block)?,
            is_stop,
            coating: Coating::default(),
            span: block.heading,
        })
    }

    /// The smaller of DIAM and a clear aperture; infinite where the file has none.
    fn semi_diameter(&self, block: &Block<'_>) -> Result<f64> {
        let mut radius = f64::INFINITY;
        if let Some(word) = block.first("DIAM") {
            let value = word.number(self.source)?;
            if value != 0.0 {
                radius = value;
            }
        }
        for keyword in ["FLAP", "CLAP"] {
            if let Some(word) = block.line(keyword).and_then(|l| l.get(1)) {
                let value = word.number(self.source)?;
                if value > 0.0 {
                    radius = radius.min(value);
                }
            }
        }
        Ok(radius)
    }

    /// `GLAS N-BK7 …`, a model glass, `GLAS ___BLANK 1 0 1.5168 64.17 …`, or that of another
    /// surface: `GLAS ___BLANK 2 3 …` is the glass of surface 3.
    fn medium(&self, block: &Block<'_>, blocks: &[Block<'_>]) -> Result<Medium> {
        let Some(line) = block.line("GLAS") else {
            return Ok(Medium::air());
        };
        let Some(name) = line.first() else {
            return Ok(Medium::air());
        };
        if name.is("MIRROR") {
            let message = format!("surface {} is a mirror", block.number);
            return Err(self
                .fail(name.span, message)
                .with_help("ivcam traces lenses that light goes straight through"));
        }
        if !name.text.starts_with("___") {
            // The numbers behind a name are placeholders: the name counts.
            return self.glasses.get(name.text, self.source, name.span);
        }
        if let [_, how, other, ..] = line
            && how.is("2")
        {
            let number = other.text.parse::<usize>().ok();
            let earlier = |b: &&Block<'_>| b.number < block.number && Some(b.number) == number;
            let Some(other) = blocks.iter().find(earlier) else {
                let message = format!("there is no surface `{}` in front of this one", other.text);
                return Err(self.fail(other.span, message));
            };
            return self.medium(other, blocks);
        }
        let [_, _, _, index, rest @ ..] = line else {
            let message = format!("the model glass of surface {} has no index", block.number);
            return Err(self.fail(name.span, message));
        };
        let n_d = index.number(self.source)?;
        match rest.first() {
            Some(abbe) => Ok(match abbe.number(self.source)? {
                v if v > 0.0 => Medium::from_abbe(n_d, v),
                _ => Medium::constant(n_d),
            }),
            None => Ok(Medium::constant(n_d)),
        }
    }

    fn shape(&self, block: &Block<'_>, curvature: Curvature) -> Result<Shape> {
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
        // Numbers 1 and 2 are no terms.
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

    /// Where both curvatures and conics agree it is a conic of revolution, where one is flat a
    /// cylinder; what lies between is refused.
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

    /// The configurations, where there are two or more, as zoom positions.
    fn zoom(
        &self,
        header: &[Line<'_>],
        blocks: &[Block<'_>],
        kept: &[Kept],
        stop: Option<usize>,
        sink: &mut Sink,
    ) -> Result<Vec<ZoomPosition>> {
        let Some(at) = header.iter().position(|l| l[0].is("MNUM")) else {
            return Ok(Vec::new());
        };
        let count = header[at]
            .get(1)
            .and_then(|w| w.text.parse().ok())
            .unwrap_or(1_usize);
        if !(2..=1000).contains(&count) {
            return Ok(Vec::new());
        }
        let mut stops = vec![None; count];
        // (surface of the file, configuration, thickness)
        let mut thicknesses: Vec<(usize, usize, f64)> = Vec::new();
        let mut left_out: Vec<&str> = Vec::new();
        for line in &header[at + 1..] {
            let [operand, surface, configuration, value, ..] = line[..] else {
                continue;
            };
            let number = surface.text.parse::<usize>().ok();
            let of_stop = operand.is("SDIA") && stop.map(|s| kept[s].number) == number;
            let is_gap = operand.is("THIC");
            if !is_gap && !of_stop {
                let told = left_out.iter().any(|name| operand.is(name));
                if !told && OTHER_OPERANDS.iter().any(|name| operand.is(name)) {
                    let message = format!(
                        "configurations that change `{}` are read without it",
                        operand.text
                    );
                    sink.warn(operand.span, message);
                    left_out.push(operand.text);
                }
                continue;
            }
            let Some(number) = number.filter(|n| blocks.iter().any(|b| b.number == *n)) else {
                let message = format!("there is no surface `{}` in the file", surface.text);
                return Err(self.fail(surface.span, message));
            };
            let configuration = match configuration.text.parse::<usize>() {
                Ok(c) if (1..=count).contains(&c) => c - 1,
                _ => {
                    let message = format!("there is no configuration `{}`", configuration.text);
                    return Err(self
                        .fail(configuration.span, message)
                        .with_help(format!("`MNUM` says that there are {count}")));
                }
            };
            let value = value.number(self.source)?;
            match is_gap {
                true => thicknesses.push((number, configuration, value)),
                false => stops[configuration] = Some(value),
            }
        }
        let set = |number: usize, configuration: usize| {
            let mut found = thicknesses.iter().rev();
            found
                .find(|(n, c, _)| (*n, *c) == (number, configuration))
                .map(|(.., t)| *t)
        };
        let position = |configuration: usize| {
            let gaps = kept.iter().enumerate().filter_map(|(i, surface)| {
                let varies = |gap: &(usize, f64)| thicknesses.iter().any(|(n, ..)| *n == gap.0);
                let gap = |&(n, base): &(usize, f64)| set(n, configuration).unwrap_or(base);
                let any = surface.gaps.iter().any(varies);
                any.then(|| (i, surface.gaps.iter().map(gap).sum()))
            });
            ZoomPosition {
                name: format!("configuration {}", configuration + 1),
                gaps: gaps.collect(),
                stop_semi_diameter: stops[configuration],
            }
        };
        Ok((0..count).map(position).collect())
    }
}

fn pair<'a>(line: &Line<'a>) -> Option<(Word<'a>, Word<'a>)> {
    Some((*line.get(1)?, *line.get(2)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Prescription> {
        let source = Arc::new(Source::new("a.zmx", text.as_bytes().to_vec()));
        read(&source, &Catalogue::builtin(), &mut Sink::new())
    }

    fn file(surfaces: &str, rest: &str) -> String {
        format!(
            "VERS 1\nMODE SEQ\nNAME A lens\nNOTE 0 of no patent\nUNIT CM X\nENPD 1\n\
             SURF 0\n  TYPE STANDARD\n  DISZ INFINITY\n{surfaces}\
             SURF 9\n  TYPE STANDARD\n  CURV 0\n{rest}"
        )
    }

    #[test]
    fn surfaces_glasses_and_units_are_read() {
        let lens = parse(&file(
            "SURF 1\n  TYPE STANDARD\n  CURV 0\n  DISZ 3\n  DIAM 9\n\
             SURF 2\n  STOP\n  TYPE STANDARD\n  CURV 0.5\n  DISZ 1\n  GLAS N-BK7 0 0 1.5 40\n  DIAM 1\n\
             SURF 3\n  TYPE EVENASPH\n  CURV -0.5\n  CONI -1\n  PARM 2 0.25\n  DISZ 0.5\n  DIAM 1\n\
             SURF 4\n  TYPE XOSPHERE\n  CURV 0.1\n  GLAS ___BLANK 1 0 1.7 30\n  DISZ 1\n  DIAM 1\n  \
             XDAT 1 3\n  XDAT 2 2.0\n  XDAT 5 0.8\n\
             SURF 5\n  TYPE TOROIDAL\n  CURV 0.1\n  PARM 1 5\n  DISZ 7\n  DIAM 1\n",
            "MNUM 2 1\nTHIC 3 1 0.5 0 0\nTHIC 3 2 0.75 0 0\n",
        ))
        .unwrap();
        assert_eq!((lens.name.as_str(), lens.surfaces.len()), ("A lens", 4));
        assert_eq!(lens.notes, ["of no patent"]);
        let [first, second, third, fourth] = &lens.surfaces[..] else {
            panic!()
        };
        assert_eq!(
            (lens.stop(), first.medium.name.as_str()),
            (Some(0), "N-BK7")
        );
        assert_eq!(
            (
                first.curvature.radius(),
                first.thickness,
                first.semi_diameter
            ),
            (20.0, 10.0, 10.0)
        );
        // 0.25 cm⁻³ is 0.25e-3 mm⁻³.
        assert!(
            matches!(&second.shape, Shape::Asphere { k, terms } if *k == -1.0
            && (terms[4] - 0.25e-3).abs() < 1e-18)
        );
        assert!(
            matches!(&third.shape, Shape::Asphere { terms, .. } if (terms[3] - 1e-3).abs() < 1e-18)
        );
        assert!((third.medium.abbe().unwrap() - 30.0).abs() < 1e-9);
        assert!(matches!(&fourth.shape, Shape::Toroid { across, .. } if across.radius() == 50.0));
        assert_eq!(lens.zoom.len(), 2);
        assert_eq!(lens.zoom[1].gaps, [(1, 7.5)]);
    }

    #[test]
    fn what_can_not_be_traced_is_refused_by_name_and_line() {
        for (lines, says, line) in [
            ("  TYPE COORDBRK\n", "`COORDBRK`, a coordinate break", 11),
            ("  TYPE DGRATING\n", "grating", 11),
            ("  TYPE STANDARD\n  GLAS MIRROR 0 0 1.5 40\n", "mirror", 12),
            (
                "  TYPE STANDARD\n  GLAS N-BK77 0 0 1.5 40\n",
                "no glass named `N-BK77`",
                12,
            ),
            ("  TYPE STANDARD\n  CURV nan\n", "not a number", 12),
            (
                "  TYPE STANDARD\n  GLAS ___BLANK 1 0 0.5 40\n  DIAM 1\n",
                "less than 1",
                12,
            ),
        ] {
            let error = parse(&file(&format!("SURF 1\n{lines}"), "")).unwrap_err();
            assert!(error.message.contains(says), "{lines}: {}", error.message);
            assert_eq!(error.location().1.unwrap().0, line, "{lines}");
        }
        assert!(parse("MODE NSC\n").unwrap_err().message.contains("mode"));
        assert!(
            parse("SURF 0\n")
                .unwrap_err()
                .message
                .contains("no surfaces")
        );
    }

    /// A dummy plane divides a gap: configurations may change either part of it.
    #[test]
    fn a_gap_of_a_configuration_counts_the_dummies_in_it() {
        let glass = "TYPE STANDARD\n  GLAS N-BK7 0 0 1.5 40";
        let lens = parse(&file(
            &format!(
                "SURF 1\n  {glass}\n  CURV 0.5\n  DISZ 1\n  DIAM 1\n\
                 SURF 2\n  TYPE STANDARD\n  CURV 0\n  DISZ 2\n  DIAM 1\n\
                 SURF 3\n  TYPE STANDARD\n  CURV 0\n  DISZ 4\n  DIAM 1\n\
                 SURF 4\n  STOP\n  TYPE STANDARD\n  CURV 0\n  DISZ 3\n  DIAM 1\n"
            ),
            "MNUM 2 1\nMOFF 0 1 \"\" 0\nTHIC 2 1 2 0 0\nTHIC 2 2 5 0 0\nSDIA 4 2 0.5 0 0\n",
        ))
        .unwrap();
        assert_eq!(lens.surfaces.len(), 3);
        assert_eq!(lens.surfaces[1].thickness, 60.0);
        let gaps: Vec<_> = lens.zoom.iter().map(|z| z.gaps.clone()).collect();
        assert_eq!(gaps, [[(1, 60.0)], [(1, 90.0)]]);
        assert_eq!(lens.zoom[1].stop_semi_diameter, Some(5.0));
        for (line, says) in [
            ("THIC 17 1 2 0", "no surface `17`"),
            ("THIC 4 3 2 0", "no configuration `3`"),
        ] {
            let surfaces = format!("SURF 4\n  {glass}\n  CURV 0.5\n  DIAM 1\n");
            let error = parse(&file(&surfaces, &format!("MNUM 2 1\n{line}\n"))).unwrap_err();
            assert!(error.message.contains(says), "{error}");
        }
    }

    #[test]
    fn a_glass_may_be_that_of_another_surface() {
        let text = |other: u32| {
            file(
                &format!(
                    "SURF 1\n  STOP\n  CURV 0.5\n  GLAS ___BLANK 1 0 1.7 30\n  DIAM 1\n\
                     SURF 2\n  CURV 0.1\n  DIAM 1\n\
                     SURF 3\n  CURV 0.1\n  GLAS ___BLANK 2 {other} 1.5 40\n  DIAM 1\n"
                ),
                "",
            )
        };
        assert_eq!(parse(&text(1)).unwrap().surfaces[2].medium.n_d, 1.7);
        assert!(
            parse(&text(3))
                .unwrap_err()
                .message
                .contains("no surface `3`")
        );
    }

    #[test]
    fn a_file_without_indentation_is_the_same_lens() {
        let text = file(
            "SURF 1\n  STOP\n  TYPE EVENASPH\n  CURV 0.5\n  PARM 2 0.1\n  GLAS N-BK7\n  DIAM 1\n",
            "MNUM 1 1\n",
        );
        let bare = |text: &str| {
            let mut lens = parse(text).unwrap();
            lens.surfaces
                .iter_mut()
                .for_each(|s| s.span = Span::default());
            lens
        };
        assert_eq!(bare(&text.replace("\n  ", "\n")), bare(&text));
    }

    #[test]
    fn a_biconic_that_bends_in_x_only_is_a_cylinder() {
        let surface = "SURF 1\n  STOP\n  TYPE BICONICX\n  CURV 0\n  PARM 1 5\n  DIAM 1\n";
        let lens = parse(&file(surface, "")).unwrap();
        assert_eq!(lens.surfaces[0].shape, Shape::CylinderY);
        assert_eq!(lens.surfaces[0].curvature.radius(), 50.0);
        let both = surface.replace("CURV 0", "CURV 0.1");
        assert!(
            parse(&file(&both, ""))
                .unwrap_err()
                .message
                .contains("BICONICX")
        );
    }
}
