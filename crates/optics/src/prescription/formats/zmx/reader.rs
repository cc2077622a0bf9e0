//! Reads the lens from the lines of a file.

use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result, Sink, Source, Span};
use ivcam_base::math::LengthUnit;

use crate::prescription::formats::apertures::{Beam, fill, note_f_number};
use crate::prescription::formats::format::{Format, first_word};
use crate::prescription::formats::origin::name_of;
use crate::prescription::formats::zmx::file::{Block, Line, place, split};
use crate::prescription::glass::catalogue::Catalogue;
use crate::prescription::glass::coating::Coating;
use crate::prescription::glass::medium::Medium;
use crate::prescription::prescription::{Prescription, check, check_count};
use crate::prescription::surface::{Curvature, Shape, Surface};

/// A surface of the lens: its number in the file, and the gaps that lie behind it with the numbers
/// of the surfaces that they are of, its own and those of dummies that are dropped.
pub(super) struct Kept {
    pub(super) number: usize,
    pub(super) gaps: Vec<(usize, f64)>,
}

/// The source of a file, and the glasses that it may name.
pub(super) struct Reader<'a> {
    pub(super) source: &'a Arc<Source>,
    pub(super) glasses: &'a Catalogue,
}
/// Zemax's sequential files, recognized by their first keyword or two numbered surfaces.
pub(crate) static FORMAT: Format = Format {
    name: "Zemax",
    recognizes: |text| {
        let begins = |key: &str| text.lines().any(|line| line.trim_start().starts_with(key));
        (begins("SURF 0") && begins("SURF 1"))
            || ["VERS", "MODE", "SURF", "UNIT"].contains(&first_word(text).as_str())
    },
    read: |source, how, sink| read(source, &how.glasses, sink),
};

/// Reads a decoded `.zmx` file.
pub(super) fn read(
    source: &Arc<Source>,
    glasses: &Catalogue,
    sink: &mut Sink,
) -> Result<Prescription> {
    let reader = Reader { source, glasses };
    let (header, blocks) = split(source)?;
    check_count(blocks.len(), source)?;
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
    let aperture = header.iter().find(|l| l[0].is("ENPD") || l[0].is("FNUM"));
    if let Some(line) = aperture.filter(|_| lens.zoom.is_empty()) {
        note_f_number(&mut lens, beam, line[0].span);
    }
    check(&mut lens, source, sink, |surface, column| {
        let block = kept
            .get(surface)
            .and_then(|k| blocks.iter().find(|b| b.number == k.number));
        place(block, column)
    })?;
    Ok(if unit == 1.0 { lens } else { lens.scaled(unit) })
}

impl Reader<'_> {
    /// An error at a place of the file.
    pub(super) fn fail(&self, span: Span, message: String) -> Box<Diagnostic> {
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

    /// The lens, and the surface of the file for each of its surfaces.
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
                // A dummy in front has no effect. Elsewhere it only lengthens the gap.
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
        let name = name.unwrap_or_else(|| name_of(self.source));
        let mut lens = Prescription {
            object_medium,
            ..Prescription::new(name, surfaces)
        };
        for note in header.iter().filter(|l| l[0].is("NOTE")) {
            let text = note
                .iter()
                .skip(2)
                .map(|w| w.text)
                .collect::<Vec<_>>()
                .join(" ");
            lens.notes.push(text);
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
}
