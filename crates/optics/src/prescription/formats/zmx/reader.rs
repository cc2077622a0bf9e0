//! Reads the lens from the lines of a file.

use glam::{DVec2, DVec3};
use ivcam_base::diag::{Result, Sink, Span};

use crate::prescription::clear_aperture::ClearAperture;
use crate::prescription::decenter::{Decenter, SurfaceFrame};
use crate::prescription::formats::apertures::{SystemData, largest_field};
use crate::prescription::formats::format::{PrescriptionFormat, first_word};
use crate::prescription::formats::reader::{
    Draft, PrescriptionReader, VIGNETTING, open_if_zero, warn_of_image_curvature,
};
use crate::prescription::formats::zmx::file::{SurfaceBlock, split};
use crate::prescription::glass::medium::Medium;
use crate::prescription::prescription::Prescription;
use crate::prescription::surface::{Curvature, Shape, Surface};
use crate::prescription::text::{Word, Words};

/// A surface of the lens: its number in the file, and the gaps that lie behind it with the numbers
/// of the surfaces that they are of, its own and those of dummies that are dropped.
pub(super) struct Kept {
    pub(super) number: usize,
    pub(super) gaps: Vec<(usize, f64)>,
}

/// A file of Zemax, divided into its header and its surfaces.
pub(super) struct ZemaxReader<'a> {
    pub(super) file: PrescriptionReader<'a>,
    /// The lines before and behind the surfaces.
    pub(super) header: Vec<Words<'a>>,
    /// The surfaces, of which the first is the object and the last the image.
    pub(super) blocks: Vec<SurfaceBlock<'a>>,
}

/// Zemax's sequential files, recognized by their first keyword or two numbered surfaces.
pub(crate) static FORMAT: PrescriptionFormat = PrescriptionFormat {
    name: "Zemax",
    recognizes: |text| {
        let begins = |key: &str| text.lines().any(|line| line.trim_start().starts_with(key));
        (begins("SURF 0") && begins("SURF 1"))
            || ["VERS", "MODE", "SURF", "UNIT"].contains(&first_word(text).as_str())
    },
    read,
};

/// Reads a decoded `.zmx` file.
pub(super) fn read(file: PrescriptionReader<'_>, sink: &mut Sink) -> Result<Prescription> {
    let (header, blocks) = split(file)?;
    file.check_count(blocks.len())?;
    let reader = ZemaxReader {
        file,
        header,
        blocks,
    };
    reader.refuse_modes()?;
    let (mut draft, kept) = reader.draft(sink)?;
    draft.lens.zoom = reader.zoom(&kept, draft.lens.stop(), sink)?;
    draft.fold();
    draft.unit = reader.unit()?;
    let mut beam = reader.beam(&kept)?;
    beam.stated = beam.stated.filter(|_| draft.lens.zoom.is_empty());
    draft.limit(beam, sink);
    reader.state_wavelengths(&mut draft);
    reader.warn_of_vignetting(sink);
    file.finish(draft, sink)
}

/// Breaks the axis by a decenter and then by the gap of the surface of a number.
fn advance(
    draft: &mut Draft,
    kept: &mut Vec<Kept>,
    decenter: &Decenter,
    (number, gap): (usize, f64),
    span: Span,
) {
    let before = draft.lens.surfaces.len();
    let is_part = draft.break_axis(decenter, gap, span);
    let gaps = vec![(number, gap)];
    if draft.lens.surfaces.len() > before {
        kept.push(Kept { number, gaps });
    } else if let (true, Some(last)) = (is_part, kept.last_mut()) {
        last.gaps.extend(gaps);
    }
}

/// The decenter of the numbers of a coordinate break: shifts in x and y, the angles about x, y and
/// z, and the order.
fn decenter([dx, dy, tx, ty, tz, order]: [f64; 6]) -> Decenter {
    let (shift, tilt) = (DVec3::new(dx, dy, 0.0), DVec3::new(tx, ty, tz));
    match order == 0.0 {
        true => Decenter { shift, tilt },
        // The tilts about z, y and x come first, and then the shift.
        false => Decenter {
            shift: -shift,
            tilt: -tilt,
        }
        .inverse(),
    }
}

/// The texts of words with blanks between them.
fn joined(words: &[Word<'_>]) -> String {
    let texts: Vec<&str> = words.iter().map(|word| word.text).collect();
    texts.join(" ")
}

impl ZemaxReader<'_> {
    /// The first line of the header with a keyword.
    fn line(&self, keyword: &str) -> Option<&Words<'_>> {
        self.header.iter().find(|line| line[0].is(keyword))
    }

    /// The first value of a line of a surface; 0 without that line.
    pub(super) fn value(&self, block: &SurfaceBlock<'_>, keyword: &str) -> Result<f64> {
        let word = block.first(keyword);
        word.map_or(Ok(0.0), |word| self.file.number(word))
    }

    fn refuse_modes(&self) -> Result<()> {
        for line in &self.header {
            if let [keyword, mode, ..] = line[..]
                && keyword.is("MODE")
                && !mode.is("SEQ")
            {
                let message = format!("this file is in the mode `{}`", mode.text);
                let help = "only sequential files (`MODE SEQ`) describe a lens";
                return Err(self.file.refuse(mode.span, message, help));
            }
        }
        Ok(())
    }

    fn unit(&self) -> Result<f64> {
        let Some(word) = self.line("UNIT").and_then(|line| line.get(1)) else {
            return Ok(1.0);
        };
        let name = if word.is("METER") { "m" } else { word.text };
        let unit = self.file.unit(name, word.span);
        unit.map_err(|error| error.with_help("MM, CM, IN or METER"))
    }

    /// A count on the `FTYP` line: its third value is that of the fields, its fourth that of the
    /// wavelengths. The lists have room for more.
    fn counted(&self, at: usize) -> Option<usize> {
        let word = self.line("FTYP")?.get(at)?;
        word.text.parse().ok().filter(|count| *count > 0)
    }

    /// Keeps the wavelengths of the `WAVM` lines, each with its number, micrometers and weight.
    fn state_wavelengths(&self, draft: &mut Draft) {
        let lines = self.header.iter().filter(|line| line[0].is("WAVM"));
        let number = |word: Option<&Word<'_>>| word?.text.parse::<f64>().ok();
        let (all, weights): (Vec<f64>, Vec<f64>) = lines
            .filter_map(|line| {
                let weight = number(line.get(3)).unwrap_or(1.0);
                Some((1e3 * number(line.get(2))?, weight))
            })
            .unzip();
        let count = self.counted(4).unwrap_or(all.len()).min(all.len());
        let primary = self
            .line("PWAV")
            .and_then(|line| line.get(1)?.text.parse().ok());
        let primary = primary.map_or(0, |number: usize| number.saturating_sub(1));
        draft.state_wavelengths(&all[..count], &weights[..count], primary);
    }

    /// Warns of vignetting factors, which narrow the beams of a design program at the edge of the
    /// field. Here the apertures do.
    fn warn_of_vignetting(&self, sink: &mut Sink) {
        const FACTORS: [&str; 5] = ["VDXN", "VDYN", "VCXN", "VCYN", "VANN"];
        let is_set = |word: &Word<'_>| word.text.parse::<f64>().is_ok_and(|v| v != 0.0);
        let count = self.counted(3).unwrap_or(usize::MAX);
        let sets = |line: &&Words<'_>| {
            let is_factor = FACTORS.iter().any(|name| line[0].is(name));
            is_factor && line[1..].iter().take(count).any(is_set)
        };
        let set: Vec<&Words<'_>> = self.header.iter().filter(sets).collect();
        if let Some(first) = set.first() {
            let names: Vec<&str> = set.iter().map(|line| line[0].text).collect();
            let message = format!("vignetting factors are left out: {}", names.join(", "));
            sink.warn(first[0].span, message).help(VIGNETTING);
        }
    }

    fn beam(&self, kept: &[Kept]) -> Result<SystemData> {
        let value = |keyword: &str| {
            let word = self.line(keyword).and_then(|line| line.get(1));
            word.map(|word| self.file.number(*word)).transpose()
        };
        // FTYP 0 is a field in degrees, 1 a height of the object; 2 and 3 are heights in the image.
        let kind = |number: &str| {
            let mut lines = self.header.iter().filter(|l| l[0].is("FTYP"));
            lines.any(|l| l.get(1).is_some_and(|w| w.is(number)))
        };
        let largest = self.largest_field(kind("0"));
        let mut lines = self.header.iter();
        let kinds = ["ENPD", "FNUM", "OBNA"];
        let aperture = lines.find(|l| kinds.iter().any(|kind| l[0].is(kind)));
        Ok(SystemData {
            entrance_diameter: value("ENPD")?.filter(|d| *d > 0.0),
            f_number: value("FNUM")?.filter(|n| *n > 0.0),
            object_aperture: value("OBNA")?.filter(|aperture| *aperture > 0.0),
            half_field: largest.filter(|_| kind("0")),
            image_height: largest.filter(|_| kind("2") || kind("3")),
            object_height: largest.filter(|_| kind("1")),
            object_distance: self.object_distance(kept)?,
            stated: aperture.map(|line| line[0].span),
            ..SystemData::default()
        })
    }

    /// The largest field of `XFLN` and `YFLN`: a height, or an angle in degrees; none without them.
    fn largest_field(&self, is_angle: bool) -> Option<f64> {
        let count = self.counted(3).unwrap_or(usize::MAX);
        let values = |keyword: &str| {
            let words = self.line(keyword).map_or(&[][..], |line| &line[1..]);
            let numbers = words
                .iter()
                .take(count)
                .map(|w| w.text.parse().unwrap_or(0.0));
            numbers.collect::<Vec<f64>>()
        };
        let (x, y) = (values("XFLN"), values("YFLN"));
        largest_field([&x, &y], is_angle)
    }

    /// The distance from the object to the first surface that is kept, behind dummies; none if it
    /// is infinite.
    fn object_distance(&self, kept: &[Kept]) -> Result<Option<f64>> {
        let first = kept.first().map_or(usize::MAX, |kept| kept.number);
        let mut sum = 0.0;
        for block in self.blocks.iter().take_while(|block| block.number < first) {
            if block.first("DISZ").is_some_and(|word| word.is("INFINITY")) {
                return Ok(None);
            }
            sum += self.value(block, "DISZ")?;
        }
        Ok(Some(sum))
    }

    /// The lens, and the surface of the file for each of its surfaces.
    fn draft(&self, sink: &mut Sink) -> Result<(Draft, Vec<Kept>)> {
        let [object, inner @ .., image] = &self.blocks[..] else {
            let help = "a Zemax file lists them as `SURF 0`, `SURF 1`, …";
            return Err(self.file.no_surfaces(Span::at(0), help));
        };
        let name = self.line("NAME").map(|line| joined(&line[1..]));
        let mut draft = self.file.draft(name.as_deref());
        draft.lens.object_medium = self.medium(object)?;
        let mut kept: Vec<Kept> = Vec::new();
        for block in inner {
            if self.break_axis(block, &mut draft, &mut kept)? {
                continue;
            }
            let surface = self.surface(block, draft.medium(), sink)?;
            let gap = (block.number, surface.thickness);
            let idle = surface.is_idle(draft.medium()) && !surface.is_stop;
            let is_broken = !draft.pending.is_none();
            let limits = |keyword: &&str| block.line(keyword).is_some();
            if !idle
                || surface.obstruction > 0.0
                || surface.outline.is_some()
                || ["FLAP", "CLAP"].iter().any(limits)
            {
                kept.push(Kept {
                    number: block.number,
                    gaps: vec![gap],
                });
                draft.push(surface, block.places());
            } else if is_broken {
                let span = block.heading;
                let gap = surface.thickness;
                advance(
                    &mut draft,
                    &mut kept,
                    &Decenter::NONE,
                    (block.number, gap),
                    span,
                );
            } else if let (Some(last), Some(kept)) =
                (draft.lens.surfaces.last_mut(), kept.last_mut())
            {
                // A dummy in front has no effect. Elsewhere it only lengthens the gap.
                last.thickness += surface.thickness;
                kept.gaps.push(gap);
            }
        }
        draft.pending = draft.pending.then(&self.frame(image)?.before);
        if self.value(image, "CURV")? != 0.0 {
            let [place, ..] = image.places();
            warn_of_image_curvature(place, sink);
        }
        let notes = self.header.iter().filter(|line| line[0].is("NOTE"));
        let text = |note: &Words<'_>| joined(note.get(2..).unwrap_or(&[]));
        draft.lens.notes = notes.map(text).collect();
        Ok((draft, kept))
    }

    /// Breaks the axis if a block is a coordinate break. Returns whether it is one.
    fn break_axis(
        &self,
        block: &SurfaceBlock<'_>,
        draft: &mut Draft,
        kept: &mut Vec<Kept>,
    ) -> Result<bool> {
        if !block.first("TYPE").is_some_and(|kind| kind.is("COORDBRK")) {
            return Ok(false);
        }
        let mut parameters = [0.0; 6];
        for (number, value) in block.numbered("PARM") {
            let number = number.text.parse::<usize>().unwrap_or(0);
            if let Some(slot) = number.checked_sub(1).and_then(|i| parameters.get_mut(i)) {
                *slot = self.file.number(value)?;
            }
        }
        let gap = (block.number, self.thickness(block)?);
        advance(draft, kept, &decenter(parameters), gap, block.heading);
        Ok(true)
    }

    /// The decenters that a surface has itself: `SCBD 1` in front of it and `SCBD 2` behind it,
    /// each with its order, whether it follows another tilt, and the numbers of a coordinate break.
    fn frame(&self, block: &SurfaceBlock<'_>) -> Result<SurfaceFrame> {
        let mut frame = SurfaceFrame::default();
        for line in block.lines.iter().filter(|line| line[0].is("SCBD")) {
            let [keyword, side, order, how, values @ ..] = &line[..] else {
                continue;
            };
            if self.file.number(*how)? != 0.0 {
                let message = format!("a tilt of surface {} follows another one", block.number);
                let help = "state its angles and shifts, or use coordinate breaks";
                return Err(self.file.refuse(keyword.span, message, help));
            }
            let mut parameters = [0.0; 6];
            for (slot, value) in parameters.iter_mut().take(5).zip(values) {
                *slot = self.file.number(*value)?;
            }
            parameters[5] = self.file.number(*order)?;
            match side.is("1") {
                true => frame.before = decenter(parameters),
                false => frame.after = decenter(parameters),
            }
        }
        Ok(frame)
    }

    /// The distance to the next surface, which is 0 if it is infinite.
    fn thickness(&self, block: &SurfaceBlock<'_>) -> Result<f64> {
        match block.first("DISZ") {
            Some(word) if word.is("INFINITY") => Ok(0.0),
            _ => self.value(block, "DISZ"),
        }
    }

    /// The surface of a block, behind the medium `before`.
    fn surface(
        &self,
        block: &SurfaceBlock<'_>,
        before: &Medium,
        sink: &mut Sink,
    ) -> Result<Surface> {
        let mut curvature = Curvature::from_curvature(self.value(block, "CURV")?);
        let mut shape = self.shape(block, curvature)?;
        if let Shape::ThinLens { .. } = shape {
            curvature = Curvature::PLANE;
        }
        if let Shape::Toroid { across, k, terms } = &shape
            && curvature.is_plane()
            && *k == 0.0
            && terms.iter().all(|t| *t == 0.0)
        {
            (curvature, shape) = (*across, Shape::CylinderY);
        }
        let thickness = self.thickness(block)?;
        let is_mirror = block.first("GLAS").is_some_and(|name| name.is("MIRROR"));
        let medium = match is_mirror {
            true => before.clone(),
            false => self.medium(block)?,
        };
        self.warn_of_apertures(block, sink)?;
        let mut plane = Surface::sphere(0.0, thickness, medium, self.semi_diameter(block)?);
        if let Some(aperture) = self.aperture(block)? {
            plane.set_aperture(&aperture);
        }
        Ok(Surface {
            shape,
            curvature,
            obstruction: self.obstruction(block)?,
            is_stop: block.line("STOP").is_some(),
            is_mirror,
            frame: self.frame(block)?.boxed(),
            span: block.heading,
            ..plane
        })
    }

    /// A clear aperture that is a rectangle (SQAP), an ellipse (ELAP) or a circle off the axis
    /// (CLAP with OBDC); none for a round one on the axis.
    fn aperture(&self, block: &SurfaceBlock<'_>) -> Result<Option<ClearAperture>> {
        let pair = |keyword: &str| -> Result<Option<[f64; 2]>> {
            match block.line(keyword) {
                Some([x, y, ..]) => Ok(Some([self.file.number(*x)?, self.file.number(*y)?])),
                _ => Ok(None),
            }
        };
        let center = pair("OBDC")?.map_or(DVec2::ZERO, DVec2::from_array);
        let (rectangle, ellipse) = (pair("SQAP")?, pair("ELAP")?);
        let circle = pair("CLAP")?.filter(|[inner, _]| *inner == 0.0 && center != DVec2::ZERO);
        let half = rectangle
            .or(ellipse)
            .or(circle.map(|[_, outer]| [outer; 2]));
        let half = half
            .map(DVec2::from_array)
            .filter(|half| half.min_element() > 0.0);
        Ok(half.map(|half| ClearAperture {
            is_ellipse: rectangle.is_none(),
            half,
            center,
            rotation: 0.0,
        }))
    }

    /// Warns of apertures that are read as another one.
    fn warn_of_apertures(&self, block: &SurfaceBlock<'_>, sink: &mut Sink) -> Result<()> {
        let is_off_axis = self.aperture(block)?.is_some();
        for keyword in ["OBDC", "SQOB", "ELOB", "SPID", "UDAD", "USAP", "USOB"] {
            let found = block.lines.iter().find(|l| l[0].is(keyword));
            if let Some(line) = found.filter(|_| keyword != "OBDC" || !is_off_axis) {
                let message = format!("the aperture `{keyword}` is read as the round one of DIAM");
                sink.warn(line[0].span, message)
                    .help("write the lens as .json and give the surface its `outline`");
            }
        }
        if let Some(inner) = block.first("OBSC")
            && self.file.number(inner)? > 0.0
        {
            let message = "an obstruction that is open in its middle is left out";
            sink.warn(inner.span, message);
        }
        Ok(())
    }

    /// The radius that is closed: the inner one of a clear aperture, or the outer one of an
    /// obstruction that is not a ring.
    fn obstruction(&self, block: &SurfaceBlock<'_>) -> Result<f64> {
        let inner = self.value(block, "CLAP")?;
        let [closed_from, closed_to] = match block.line("OBSC") {
            Some([from, to, ..]) => [self.file.number(*from)?, self.file.number(*to)?],
            _ => [0.0; 2],
        };
        Ok(if closed_from > 0.0 {
            inner
        } else {
            inner.max(closed_to)
        })
    }

    /// The smaller of DIAM and a clear aperture; infinite where the file has none.
    fn semi_diameter(&self, block: &SurfaceBlock<'_>) -> Result<f64> {
        let mut radius = open_if_zero(self.value(block, "DIAM")?);
        for keyword in ["FLAP", "CLAP"] {
            if let Some(word) = block.line(keyword).and_then(|l| l.get(1)) {
                let value = self.file.number(*word)?;
                if value > 0.0 {
                    radius = radius.min(value);
                }
            }
        }
        Ok(radius)
    }

    /// `GLAS N-BK7 …`, a model glass, `GLAS ___BLANK 1 0 1.5168 64.17 …`, or that of another
    /// surface: `GLAS ___BLANK 2 3 …` is the glass of surface 3.
    fn medium(&self, block: &SurfaceBlock<'_>) -> Result<Medium> {
        let line = block.line("GLAS").unwrap_or(&[]);
        let Some(name) = line.first() else {
            return Ok(Medium::air());
        };
        if !name.text.starts_with("___") {
            // The numbers behind a name are placeholders: the name counts.
            return self.file.glass(name.text, name.span);
        }
        if let [_, how, other, ..] = line
            && how.is("2")
        {
            let number = other.text.parse::<usize>().ok();
            let earlier =
                |b: &&SurfaceBlock<'_>| b.number < block.number && Some(b.number) == number;
            let Some(other) = self.blocks.iter().find(earlier) else {
                let message = format!("there is no surface `{}` in front of this one", other.text);
                return Err(self.file.fail(other.span, message));
            };
            return self.medium(other);
        }
        let [_, _, _, index, rest @ ..] = line else {
            let message = format!("the model glass of surface {} has no index", block.number);
            return Err(self.file.fail(name.span, message));
        };
        let n_d = self.file.number(*index)?;
        let abbe = rest.first().map(|word| self.file.number(*word));
        Ok(Medium::from_index(n_d, abbe.transpose()?))
    }
}
