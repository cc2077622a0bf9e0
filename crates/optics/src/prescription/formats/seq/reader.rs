//! Executes the commands of a file, one after another.

use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result, Sink, Source, Span};

use crate::prescription::formats::apertures::{Beam, fill, note_f_number};
use crate::prescription::formats::format::{Format, first_word};
use crate::prescription::formats::origin::name_of;
use crate::prescription::formats::seq::commands::{Command, commands, take_private};
use crate::prescription::glass::catalogue::Catalogue;
use crate::prescription::glass::medium::Medium;
use crate::prescription::prescription::{Prescription, ZoomPosition, check, crossings};
use crate::prescription::surface::Surface;
use crate::prescription::text::{Word, first_number, text};

/// Commands for properties that a centered refracting lens does not have.
const REFUSED: [(&str, &str); 26] = [
    ("ADE", "tilts a surface"),
    ("BDE", "tilts a surface"),
    ("CDE", "tilts a surface"),
    ("XDE", "shifts a surface"),
    ("YDE", "shifts a surface"),
    ("ZDE", "shifts a surface"),
    ("DAR", "tilts a surface"),
    ("BEN", "folds the axis"),
    ("REV", "tilts a surface"),
    ("DIF", "diffracts"),
    ("DOE", "diffracts"),
    ("HOE", "diffracts"),
    ("GRT", "is a grating"),
    ("GRO", "is a grating"),
    ("XTO", "is an x toroid"),
    ("YTO", "is a y toroid"),
    ("AAS", "is an anamorphic asphere"),
    ("XYP", "is an xy polynomial"),
    ("SPS", "is a special surface"),
    ("SPL", "is a spline surface"),
    ("ZRN", "is a Zernike surface"),
    ("UDS", "is a user-defined surface"),
    ("NSS", "is non-sequential"),
    ("GRN", "has a gradient index"),
    ("FRN", "is a Fresnel surface"),
    ("MOD", "is an ideal lens module"),
];

/// Commands that may name a surface behind them, beside those that are refused.
const OF_SURFACE: [&str; 29] = [
    "RDY", "CUY", "THI", "GLA", "RMD", "STO", "CIR", "REX", "REY", "ELX", "ELY", "SPH", "CON",
    "ASP", "CYL", "CUX", "RDX", "K", "A", "B", "C", "D", "E", "F", "G", "H", "J", "CUF", "IC",
];

/// The places of the numbers of a surface.
#[derive(Clone, Default)]
pub(super) struct Places {
    pub(super) command: Span,
    pub(super) columns: [Option<Span>; 4],
}

/// The state of reading.
pub(super) struct Reader<'a> {
    pub(super) source: &'a Arc<Source>,
    pub(super) glasses: Catalogue,
    /// Whether the first number of a surface is a radius.
    pub(super) radii: bool,
    /// The first bend of a surface that is not 0.
    pub(super) first_bend: Option<Span>,
    pub(super) unit: f64,
    pub(super) title: Option<String>,
    pub(super) beam: Beam,
    /// The place of EPD or FNO.
    stated_aperture: Option<Span>,
    pub(super) fields: Vec<f64>,
    pub(super) upper_vignetting: Vec<f64>,
    pub(super) object_medium: Medium,
    pub(super) surfaces: Vec<Surface>,
    pub(super) places: Vec<Places>,
    pub(super) zoom: Vec<ZoomPosition>,
    /// The surface that a command without one is about; none at the image.
    pub(super) current: Option<usize>,
}
/// CODE V's sequence files, recognized by their first command.
pub(crate) static FORMAT: Format = Format {
    name: "CODE V",
    recognizes: |text| COMMANDS.contains(&first_word(text).as_str()),
    read: |source, how, sink| read(source, &how.glasses, sink),
};

/// Commands that a file may begin with.
const COMMANDS: [&str; 22] = [
    "RDM", "LEN", "TIT", "TITLE", "S", "SO", "S0", "DIM", "EPD", "FNO", "NA", "NAO", "WL", "REF",
    "WTW", "INI", "YAN", "XAN", "YIM", "PRV", "IN", "RES",
];

/// Reads a decoded `.seq` file.
pub(super) fn read(
    source: &Arc<Source>,
    glasses: &Catalogue,
    sink: &mut Sink,
) -> Result<Prescription> {
    let commands = commands(text(source));
    // Private glasses may be defined after the surfaces that use them.
    let (commands, private) = take_private(commands);
    let read = |radii: bool| {
        let mut messages = Sink::new();
        messages.set_source(Some(source.clone()));
        let mut reader = Reader::new(source, glasses, radii);
        let result = reader.all(&commands, &private, &mut messages);
        let bend = reader.first_bend;
        let lens = result.and_then(|()| reader.finish(&mut messages));
        (lens, messages, bend)
    };
    let states = commands.iter().any(|command| command[0].is("RDM"));
    let (lens, messages, bend) = read(true);
    let bend = bend.filter(|_| !states);
    let Some(bend) = bend else {
        sink.extend_from(&messages);
        return lens;
    };
    let (other, other_messages, _) = read(false);
    let (radii, curvatures) = (score(&lens), score(&other));
    let taken = if radii >= curvatures {
        ("radii", lens, messages)
    } else {
        ("curvatures", other, other_messages)
    };
    let (word, lens, messages) = taken;
    let message =
        format!("nothing says whether bends are radii or curvatures: they are read as {word}");
    let help = "begin the file with `RDM` for radii or `RDM N` for curvatures";
    if (radii - curvatures).abs() < MARGIN {
        sink.warn(bend, message).help(help);
    } else {
        sink.note(bend, message).help(help);
    }
    sink.extend_from(&messages);
    lens
}

/// The lead in points from which a reading of the bends is certain: one impossible surface.
const MARGIN: i32 = 3;

/// What speaks for a reading of the bends: 3 points less for each surface that is wider than its
/// sphere, for each glass more than four times as thick as its larger radius, and for each pair of
/// neighbors that cross. A reading that gives no lens has fewer than all others.
fn score(lens: &Result<Prescription>) -> i32 {
    let Ok(lens) = lens else {
        return -10_000;
    };
    let surfaces = &lens.surfaces;
    // Semi-diameters that follow from the beam end just inside the sphere.
    let wide = |s: &&Surface| {
        s.semi_diameter.is_finite() && s.curvature.per_mm().abs() * s.semi_diameter > 0.97
    };
    let thick = |pair: &&[Surface]| {
        let radius = pair[0].curvature.radius().abs();
        let radius = radius.max(pair[1].curvature.radius().abs());
        pair[0].medium.n_d > 1.2 && radius > 0.0 && pair[0].thickness > 4.0 * radius
    };
    let wide = surfaces.iter().filter(wide).count();
    let thick = surfaces.windows(2).filter(thick).count();
    -3 * (wide + thick + crossings(lens)) as i32
}

impl<'a> Reader<'a> {
    fn new(source: &'a Arc<Source>, glasses: &Catalogue, radii: bool) -> Self {
        Self {
            source,
            glasses: glasses.clone(),
            radii,
            first_bend: None,
            unit: 1.0,
            title: None,
            beam: Beam {
                edge_share: 1.0,
                ..Beam::default()
            },
            stated_aperture: None,
            fields: Vec::new(),
            upper_vignetting: Vec::new(),
            object_medium: Medium::air(),
            surfaces: Vec::new(),
            places: Vec::new(),
            zoom: Vec::new(),
            current: None,
        }
    }

    /// Executes all commands.
    fn all(
        &mut self,
        commands: &[Command<'a>],
        private: &[Command<'a>],
        sink: &mut Sink,
    ) -> Result<()> {
        self.private_glasses(private)?;
        commands
            .iter()
            .try_for_each(|command| self.execute(command, sink))
    }

    /// An error at a place of the file.
    pub(super) fn fail(&self, span: Span, message: String) -> Box<Diagnostic> {
        Diagnostic::error(message).at(self.source, span)
    }

    /// The first argument of a command as a number.
    pub(super) fn value(&self, command: &[Word<'_>]) -> Result<f64> {
        first_number(command, self.source)
    }

    /// Executes a command.
    fn execute(&mut self, command: &[Word<'a>], sink: &mut Sink) -> Result<()> {
        let word = command[0];
        let name = word.text.to_ascii_uppercase();
        // A surface may be named behind the command.
        let refused = REFUSED.iter().find(|(refused, _)| *refused == name);
        let (about, plain) = match command {
            [_, surface, rest @ ..] if refused.is_some() || OF_SURFACE.contains(&&*name) => {
                match self.named_surfaces(*surface)? {
                    Some(about) => (about, [&command[..1], rest].concat()),
                    None => (self.current.into_iter().collect(), command.to_vec()),
                }
            }
            _ => (self.current.into_iter().collect(), command.to_vec()),
        };
        let tilts_by_nothing =
            name.ends_with("DE") && plain.get(1).is_some_and(|w| w.text.parse() == Ok(0.0));
        if let Some((_, what)) = refused
            && (self.surfaces.is_empty() || !about.is_empty())
            && !tilts_by_nothing
        {
            let surface = about.first().copied().unwrap_or(0);
            let message = format!("`{name}` {what}, at surface {}", surface + 1);
            return Err(self
                .fail(word.span, message)
                .with_help("ivcam traces lenses on one straight axis, without gratings"));
        }
        match name.as_str() {
            "RDM" => self.radii = !command.get(1).is_some_and(|w| w.is("N") || w.is("NO")),
            "TIT" | "TITLE" => self.title = command.get(1).map(|w| w.text.to_owned()),
            "DIM" => self.unit = self.dimension(command)?,
            "EPD" => {
                self.beam.entrance_diameter = Some(self.value(command)?).filter(|d| *d > 0.0);
                self.stated_aperture = Some(word.span);
            }
            "FNO" => {
                self.beam.f_number = Some(self.value(command)?).filter(|n| *n > 0.0);
                self.stated_aperture = Some(word.span);
            }
            "YAN" | "XAN" => self.fields.extend(self.list(command)?),
            "YIM" | "XIM" | "YRI" | "XRI" => {
                let heights = self.list(command)?;
                let so_far = self.beam.image_height.unwrap_or(0.0);
                let widest = heights.iter().fold(so_far, |most, h| most.max(h.abs()));
                self.beam.image_height = Some(widest);
            }
            "VUY" => self.upper_vignetting = self.list(command)?,
            "SO" | "S0" => self.object_medium = self.glass(command.get(3))?,
            "SI" => self.current = None,
            "S" => self.surface(command)?,
            "ZOO" => self.zoom(&command[1..], sink)?,
            "THI" if !self.zoom.is_empty() && plain.len() > 2 => self.zoom(command, sink)?,
            _ if let Some(Ok(number)) = name.strip_prefix('S').map(str::parse::<usize>) => {
                self.numbered_surface(number, command, sink)?;
            }
            _ => {
                let current = self.current;
                for surface in about {
                    self.current = Some(surface);
                    self.of_surface(&name, &plain, sink)?;
                }
                self.current = current;
            }
        }
        Ok(())
    }

    /// The surfaces that `S3`, `S2..5` or `SA` name; none where the word names none. The object's
    /// and the image's names are of no surface of the lens.
    pub(super) fn named_surfaces(&self, word: Word<'_>) -> Result<Option<Vec<usize>>> {
        let Some((b'S' | b's', rest)) = word.text.as_bytes().split_first() else {
            return Ok(None);
        };
        let rest = String::from_utf8_lossy(rest).to_ascii_uppercase();
        let count = self.surfaces.len();
        let (first, last) = rest.split_once("..").unwrap_or((&rest, &rest));
        let number = |text: &str| text.trim_start_matches('S').parse::<usize>().ok();
        let (first, last) = match (rest.as_str(), number(first), number(last)) {
            ("O" | "I" | "0", ..) => return Ok(Some(Vec::new())),
            ("A", ..) => (1, count),
            (_, Some(first), Some(last)) => (first, last),
            _ => return Ok(None),
        };
        if first == 0 || last > count || first > last {
            let message = format!("there is no surface `{}` so far", word.text);
            return Err(self
                .fail(word.span, message)
                .with_help("surfaces count from S1, behind the object's SO"));
        }
        Ok(Some((first - 1..last).collect()))
    }

    /// `S3`: a new surface, or, where the file has it already, that one again.
    fn numbered_surface(
        &mut self,
        number: usize,
        command: &[Word<'a>],
        sink: &mut Sink,
    ) -> Result<()> {
        let count = self.surfaces.len();
        if (1..=count).contains(&number) {
            self.current = Some(number - 1);
            if command.len() > 1 {
                let (surface, places) = self.parsed(command)?;
                self.surfaces[number - 1] = surface;
                self.places[number - 1] = places;
            }
            return Ok(());
        }
        if number != count + 1 {
            let message = format!("`{}` is surface {} of the lens", command[0].text, count + 1);
            sink.warn(command[0].span, message)
                .help("is a surface lost in front of it?");
        }
        self.surface(command)
    }

    fn list(&self, command: &[Word<'_>]) -> Result<Vec<f64>> {
        command[1..].iter().map(|w| w.number(self.source)).collect()
    }

    fn dimension(&self, command: &[Word<'_>]) -> Result<f64> {
        match command.get(1) {
            Some(w) if w.is("M") || w.is("MM") => Ok(1.0),
            Some(w) if w.is("C") || w.is("CM") => Ok(10.0),
            Some(w) if w.is("I") || w.is("IN") => Ok(25.4),
            _ => {
                let span = command.last().map_or(Span::at(0), |w| w.span);
                Err(self
                    .fail(span, "this is not a unit of `DIM`".into())
                    .with_help("M is millimeters, C centimeters, I inches"))
            }
        }
    }

    fn finish(mut self, sink: &mut Sink) -> Result<Prescription> {
        let name = self.title.take().unwrap_or_else(|| name_of(self.source));
        let mut lens = Prescription {
            object_medium: self.object_medium,
            ..Prescription::new(name, self.surfaces)
        };
        lens.zoom = self.zoom;
        let widest = self.fields.iter().map(|a| a.abs()).fold(0.0, f64::max);
        let beam = Beam {
            half_field: widest,
            edge_share: 1.0
                - self
                    .upper_vignetting
                    .last()
                    .copied()
                    .unwrap_or(0.0)
                    .clamp(0.0, 1.0),
            ..self.beam
        };
        if fill(&mut lens, beam) {
            sink.note(
                Span::at(0),
                "apertures that the file leaves out are those of its beam",
            );
        }
        if let Some(span) = self.stated_aperture {
            note_f_number(&mut lens, beam, span);
        }
        let places = self.places;
        check(&mut lens, self.source, sink, |surface, column| {
            places.get(surface).map_or(Span::at(0), |p| {
                p.columns[column as usize].unwrap_or(p.command)
            })
        })?;
        Ok(if self.unit == 1.0 {
            lens
        } else {
            lens.scaled(self.unit)
        })
    }
}
