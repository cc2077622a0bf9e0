//! What the readers of all formats share: messages with a place, numbers, glasses and units, and
//! the surfaces that have been read so far.
//!
//! Nothing here knows a format. Lengths are in the unit of the file until
//! [`PrescriptionReader::finish`] converts them to millimeters.

use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result, Sink, Source, Span, nearest};
use ivcam_base::math::LengthUnit;

use crate::prescription::about::About;
use crate::prescription::decenter::{Decenter, SurfaceFrame};
use crate::prescription::formats::apertures::{
    F_NUMBER_TOLERANCE, SystemData, fill, note_f_number,
};
use crate::prescription::formats::reading::Reading;
use crate::prescription::glass::{D_LINE, Medium, named_line};
use crate::prescription::prescription::{Column, Prescription, StatedBeam, check, check_count};
use crate::prescription::surface::Surface;
use crate::prescription::text::{self, Word};

/// The places of the numbers of a surface, in the order of [`Column`].
pub(super) type SurfaceSpans = [Span; 4];

/// A file that is being read, with the options of reading.
#[derive(Clone, Copy)]
pub(crate) struct PrescriptionReader<'a> {
    /// The decoded file.
    pub source: &'a Arc<Source>,
    /// The glasses that the file may name, and what the file does not state.
    pub options: &'a Reading,
}

/// A prescription of which surfaces are still being read.
pub(super) struct Draft {
    /// What has been read so far.
    pub lens: Prescription,
    /// The places of the numbers of each surface of `lens`.
    pub places: Vec<SurfaceSpans>,
    /// The length of the file's unit in millimeters.
    pub unit: f64,
    /// The decenter of the axis behind the last surface, for the next surface.
    pub pending: Decenter,
    /// The surfaces whose apertures are those of the beam, because the file leaves them out.
    pub derived: Vec<usize>,
}

impl<'a> PrescriptionReader<'a> {
    /// The text of the file.
    pub(super) fn text(self) -> &'a str {
        text::text(self.source)
    }

    /// An error at a place of the file.
    pub(super) fn fail(self, span: Span, message: impl Into<String>) -> Box<Diagnostic> {
        Diagnostic::error(message).at(self.source, span)
    }

    /// An error at a place of the file, with what to do about it.
    pub(super) fn refuse(
        self,
        span: Span,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Box<Diagnostic> {
        self.fail(span, message).with_help(help)
    }

    /// The error for a mirror. `what` names the surface.
    pub(super) fn mirror(self, span: Span, what: impl std::fmt::Display) -> Box<Diagnostic> {
        let message = format!("{what} is a mirror");
        let help = "ivcam traces lenses that light goes straight through";
        self.refuse(span, message, help)
    }

    /// The error for a property that is not traced.
    pub(super) fn not_traced(self, span: Span, message: String) -> Box<Diagnostic> {
        let help = "ivcam traces glass, mirrors and ideal thin lenses: put the surfaces of a real lens \
                    in the place of others";
        self.refuse(span, message, help)
    }

    /// The error for a file without surfaces of a lens.
    pub(super) fn no_surfaces(self, span: Span, help: &str) -> Box<Diagnostic> {
        let message = "the file has no surfaces between object and image";
        self.refuse(span, message, help)
    }

    /// The places of a text in the file.
    pub(super) fn places(self, text: &'a str) -> impl Iterator<Item = Span> + use<'a> {
        let found = self.text().match_indices(text);
        found.map(|(at, text)| Span::new(at, at + text.len()))
    }

    /// The first place of a text in the file, or the beginning of the file.
    pub(super) fn find(self, text: &str) -> Span {
        let at = self.text().find(text).unwrap_or(0);
        Span::new(at, at + text.len())
    }

    /// Reads a word as a finite number.
    pub(super) fn number(self, word: Word<'_>) -> Result<f64> {
        word.number(self.source)
    }

    /// Reads words as finite numbers.
    pub(super) fn numbers(self, words: &[Word<'_>]) -> Result<Vec<f64>> {
        words.iter().map(|word| self.number(*word)).collect()
    }

    /// Reads the first argument of a command as a finite number.
    pub(super) fn argument(self, command: &[Word<'_>]) -> Result<f64> {
        match command.get(1) {
            Some(word) => self.number(*word),
            None => {
                let message = format!("`{}` has no value", command[0].text);
                Err(self.fail(command[0].span, message))
            }
        }
    }

    /// The glass with a name, or one that takes its place.
    pub(super) fn glass(self, name: &str, span: Span) -> Result<Medium> {
        self.options.glasses.get(name, self.source, span)
    }

    /// The glass with a name that the file has in quotes.
    pub(super) fn quoted_glass(self, name: &str) -> Result<Medium> {
        self.glass(name, self.find(&format!("\"{name}\"")))
    }

    /// The millimeters of a unit of length, whose name may be in capitals.
    pub(super) fn unit(self, name: &str, span: Span) -> Result<f64> {
        match LengthUnit::parse(&name.to_ascii_lowercase()) {
            Some(unit) => Ok(unit.millimeters()),
            None => {
                let message = format!("`{name}` is not a unit of length");
                Err(self.refuse(span, message, "mm, cm, in or m"))
            }
        }
    }

    /// Refuses a file of too many surfaces.
    pub(super) fn check_count(self, surfaces: usize) -> Result<()> {
        check_count(surfaces, self.source)
    }

    /// The name that the file states, or without one the name of the file.
    pub(super) fn name(self, stated: Option<&str>) -> String {
        let stated = stated.filter(|name| !name.is_empty());
        stated.map_or_else(|| name_of(self.source), str::to_owned)
    }

    /// A lens without surfaces, in air.
    pub(super) fn draft(self, name: Option<&str>) -> Draft {
        Draft {
            lens: Prescription::new(self.name(name), Vec::new()),
            places: Vec::new(),
            unit: 1.0,
            pending: Decenter::NONE,
            derived: Vec::new(),
        }
    }

    /// Checks a lens whose surfaces are all read, and converts it to millimeters.
    pub(super) fn finish(self, draft: Draft, sink: &mut Sink) -> Result<Prescription> {
        let Draft {
            mut lens,
            places,
            unit,
            pending,
            derived,
        } = draft;
        if !pending.is_none() {
            sink.warn(Span::at(0), "the decenter of the image surface is left out")
                .help("tilt and shift the film instead: --tilt, --swing, --rise and --shift");
        }
        let place = |surface: usize, column: Column| {
            let found = places.get(surface);
            found.map_or(Span::at(0), |places| places[column as usize])
        };
        check(&mut lens, self.source, sink, place, &derived)?;
        warn_of_indices(&lens, sink);
        let mut lens = if unit == 1.0 { lens } else { lens.scaled(unit) };
        // A comment's height must follow the lens when that is scaled.
        let noted = || About::of_notes(&lens.notes, 1.0).image_height;
        lens.image_height = lens.image_height.or_else(noted);
        Ok(lens)
    }
}

impl Draft {
    /// Adds a surface behind the others, on the axis as it is there.
    pub(super) fn push(&mut self, mut surface: Surface, places: SurfaceSpans) {
        let pending = std::mem::take(&mut self.pending);
        if !pending.is_none() {
            let frame = surface
                .frame
                .take()
                .map_or_else(SurfaceFrame::default, |frame| *frame);
            let before = pending.then(&frame.before);
            surface.frame = SurfaceFrame { before, ..frame }.boxed();
        }
        self.lens.surfaces.push(surface);
        self.places.push(places);
    }

    /// Turns the signs of the file behind mirrors into those of a [`Prescription`], and shifts
    /// along the axis into parts of the gaps. Its surfaces and zoom positions are all read.
    pub(super) fn fold(&mut self) {
        if self.lens.has_mirrors() {
            self.lens = self.lens.folded();
        }
        self.lens.shifts_to_gaps();
    }

    /// The medium behind the last surface, which is in front of the next.
    pub(super) fn medium(&self) -> &Medium {
        self.lens.medium_before(self.lens.surfaces.len())
    }

    /// Gives surfaces without an aperture that of the beam, and keeps its field, and an f-number
    /// that contradicts the apertures.
    pub(super) fn limit(&mut self, beam: SystemData, sink: &mut Sink) {
        let beam = beam.with_pupil(&self.lens);
        if beam.object_aperture.is_some() && beam.entrance_diameter.is_none() {
            let message = "the numerical aperture of the object is left out: the object or the \
                           entrance pupil is at infinity";
            sink.warn(beam.stated.unwrap_or(Span::at(0)), message)
                .help("state the entrance pupil or the f-number in its place");
        }
        self.derived = fill(&mut self.lens, beam);
        if !self.derived.is_empty() {
            let message = "apertures that the file leaves out are those of its beam";
            sink.note(Span::at(0), message);
        }
        let pupil = beam.entrance_diameter.map(StatedBeam::EntrancePupil);
        self.lens.stated_beam = pupil.or(beam.f_number.map(StatedBeam::FNumber));
        note_f_number(&mut self.lens, beam, F_NUMBER_TOLERANCE);
        self.state_field(beam, sink);
    }

    /// Keeps the field of a beam. That of an object height is the height of its image, and one of 0
    /// is an angle of 0.
    pub(super) fn state_field(&mut self, beam: SystemData, sink: &mut Sink) {
        let stated = |value: &f64| *value > 0.0 && value.is_finite();
        let axis = Some(0.0).filter(|_| beam.is_axis_alone());
        self.lens.half_field = beam.half_field.filter(stated).or(axis);
        let height = beam.height_in_image(&self.lens).filter(stated);
        self.lens.image_height = self.lens.image_height.or(height);
        let is_lost = beam.object_height.is_some_and(|h| h > 0.0) && height.is_none();
        if is_lost && self.lens.half_field.is_none() {
            let message = "the file states its field as a height of the object, which has no image";
            sink.warn(Span::at(0), message)
                .help("give the object a distance in the file, or give `--film`");
        }
    }

    /// Keeps wavelengths in nanometers, of which `primary` is the index of the first in rank, with
    /// their weights, if the file states any. Those that are not possible are left out.
    pub(super) fn state_wavelengths(&mut self, all: &[f64], weights: &[f64], primary: usize) {
        let possible = |&i: &usize| (100.0..=100_000.0).contains(&all[i]);
        let mut ranked: Vec<usize> = (0..all.len()).filter(possible).collect();
        ranked.sort_by_key(|i| *i != primary);
        let lens = &mut self.lens;
        lens.wavelengths_nm = ranked.iter().map(|&i| named_line(all[i])).collect();
        let weight = |&i: &usize| weights.get(i).copied().unwrap_or(1.0);
        lens.wavelength_weights = match weights.is_empty() {
            true => Vec::new(),
            false => ranked.iter().map(weight).collect(),
        };
    }
}

/// Warns of a curvature of the image surface.
pub(super) fn warn_of_image_curvature(place: Span, sink: &mut Sink) {
    let message = "the curvature of the image surface is left out";
    sink.warn(place, message)
        .help("curve the film instead: `ivcam render --film-radius`");
}

/// Warns of a wavelength of the file, or of the d line without one, at which the index of a glass
/// is not to be relied on.
fn warn_of_indices(lens: &Prescription, sink: &mut Sink) {
    let all = match lens.wavelengths_nm.is_empty() {
        true => &[D_LINE],
        false => &lens.wavelengths_nm[..],
    };
    if let Some((place, message)) = all.iter().find_map(|nm| lens.doubtful_index(*nm)) {
        sink.warn(place, message)
            .help("state the wavelengths of the lens, and the index of the glass at them");
    }
}

/// The help for vignetting factors.
pub(super) const VIGNETTING: &str = "the semi-diameters limit the beam at the edge of the field: give the surfaces those of the \
     vignetted lens";

/// `wide-angle` of `some/folder/wide-angle.dat`.
fn name_of(source: &Source) -> String {
    let name = source.name.rsplit(['/', '\\']).next();
    let name = name.unwrap_or(&source.name);
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    stem.to_owned()
}

/// The help for an unknown word: the nearest of the known ones, or all of them. `what` is what the
/// words are, in the plural.
pub(super) fn spelling(word: &str, what: &str, known: &[&str]) -> String {
    match nearest(word, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("the {what} are {}", known.join(", ")),
    }
}

/// What a command says of a surface that is refused. A row of the table has that and the commands
/// that say it.
pub(super) fn refused(table: &[(&'static str, &str)], command: &str) -> Option<&'static str> {
    let says = |(_, commands): &&(&str, &str)| commands.split(' ').any(|c| c == command);
    table.iter().find(says).map(|(what, _)| *what)
}

/// A semi-diameter or diameter of a format in which 0 does not limit the beam.
pub(super) fn open_if_zero(length: f64) -> f64 {
    if length == 0.0 { f64::INFINITY } else { length }
}
