//! Executes the commands of a file, one after another.

use std::collections::BTreeMap;

use ivcam_base::diag::{Result, Sink, Span};

use crate::prescription::formats::apertures::{SystemData, largest_field};
use crate::prescription::formats::commands::{Command, commands};
use crate::prescription::formats::decenters::StatedDecenter;
use crate::prescription::formats::format::{PrescriptionFormat, first_word};
use crate::prescription::formats::reader::{
    Draft, PrescriptionReader, VIGNETTING, refused, warn_of_image_curvature,
};
use crate::prescription::formats::seq::apertures::StatedAperture;
use crate::prescription::formats::seq::glasses::{glass, take_private, with_private};
use crate::prescription::prescription::{Prescription, crossings};
use crate::prescription::surface::Surface;
use crate::prescription::text::Word;

/// Commands for properties that are not traced.
const REFUSED: [(&str, &str); 14] = [
    ("diffracts", "DIF DOE HOE"),
    ("is a grating", "GRT GRO"),
    ("is an x toroid", "XTO"),
    ("is a y toroid", "YTO"),
    ("is an anamorphic asphere", "AAS"),
    ("is an xy polynomial", "XYP"),
    ("is a special surface", "SPS"),
    ("is a spline surface", "SPL"),
    ("is a Zernike surface", "ZRN"),
    ("is a user-defined surface", "UDS"),
    ("is non-sequential", "NSS"),
    ("has a gradient index", "GRN"),
    ("is a Fresnel surface", "FRN"),
    ("is an ideal lens module", "MOD"),
];

/// Commands that place a surface by another one than that in front of it.
const ELSEWHERE: [(&str, &str); 2] = [
    ("returns to the axis of another surface", "RET"),
    ("is placed from another surface", "GLB"),
];

/// Commands that change surfaces that are read.
const EDITS: [(&str, &str); 4] = [
    ("scales the lens", "SCL"),
    ("deletes", "DEL"),
    ("inserts surfaces", "INS"),
    ("turns surfaces around", "FLY"),
];

/// Pickups and solves. CODE V saves the numbers that they give with the surfaces. A solve for the
/// paraxial image (`PIM`) sets the film alone.
const FOLLOWED: [&str; 10] = [
    "PIK", "UMY", "UMX", "HMY", "HMX", "UCY", "UCX", "HCY", "HCX", "EDG",
];

/// Commands that may name a surface behind them, beside those that are refused.
const OF_SURFACE: [&str; 44] = [
    "RDY", "CUY", "THI", "GLA", "RMD", "STO", "CIR", "REX", "REY", "ELX", "ELY", "SPH", "CON",
    "ASP", "CYL", "CUX", "RDX", "K", "A", "B", "C", "D", "E", "F", "G", "H", "J", "CUF", "IC",
    "XDE", "YDE", "ZDE", "ADE", "BDE", "CDE", "DAR", "REV", "BEN", "ADX", "ADY", "ARO", "XOD",
    "YOD", "ZOD",
];

/// The state of executing the commands of a file of CODE V.
pub(super) struct SequenceReader<'a> {
    pub(super) file: PrescriptionReader<'a>,
    /// Whether the first number of a surface is a radius.
    pub(super) radii: bool,
    /// The first bend of a surface that is not 0.
    pub(super) first_bend: Option<Span>,
    beam: SystemData,
    /// The wavelengths in nanometers, and the index of the reference.
    wavelengths: (Vec<f64>, usize),
    /// The lists of fields, by their commands.
    fields: BTreeMap<String, Vec<f64>>,
    /// The weights of the wavelengths.
    weights: Vec<f64>,
    /// The first vignetting factors that are not 0.
    vignetting: Option<Span>,
    pub(super) draft: Draft,
    /// The decenters of surfaces, by their numbers from 0.
    pub(super) decenters: BTreeMap<usize, StatedDecenter>,
    /// The clear apertures of surfaces that are not round or not on the axis.
    pub(super) apertures: BTreeMap<usize, StatedAperture>,
    /// The first pickup or solve.
    followed: Option<Span>,
    /// What zoom positions change that is not read.
    pub(super) left_out: Vec<&'a str>,
    /// The surface that a command without one is about; none at the image.
    pub(super) current: Option<usize>,
}

/// CODE V's sequence files, recognized by their first command.
pub(crate) static FORMAT: PrescriptionFormat = PrescriptionFormat {
    name: "CODE V",
    recognizes: |text| COMMANDS.contains(&first_word(text).as_str()),
    read,
};

/// Commands that a file may begin with.
const COMMANDS: [&str; 22] = [
    "RDM", "LEN", "TIT", "TITLE", "S", "SO", "S0", "DIM", "EPD", "FNO", "NA", "NAO", "WL", "REF",
    "WTW", "INI", "YAN", "XAN", "YIM", "PRV", "IN", "RES",
];

/// Reads a decoded `.seq` file.
pub(super) fn read(file: PrescriptionReader<'_>, sink: &mut Sink) -> Result<Prescription> {
    // Private glasses may be defined after the surfaces that use them.
    let (commands, private) = take_private(commands(file.text(), "!"));
    let options = with_private(file, &private)?;
    let file = PrescriptionReader {
        options: &options,
        ..file
    };
    let (lens, messages, bend) = read_with_bends(file, &commands, true);
    let states = commands.iter().any(|command| command[0].is("RDM"));
    let Some(bend) = bend.filter(|_| !states) else {
        sink.extend_from(&messages);
        return lens;
    };
    let (other, other_messages, _) = read_with_bends(file, &commands, false);
    let (radii, curvatures) = (score(&lens), score(&other));
    let (word, lens, messages) = if radii >= curvatures {
        ("radii", lens, messages)
    } else {
        ("curvatures", other, other_messages)
    };
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

/// The lens with bends that are radii or curvatures, the messages about it, and the place of the
/// first bend.
fn read_with_bends(
    file: PrescriptionReader<'_>,
    commands: &[Command<'_>],
    radii: bool,
) -> (Result<Prescription>, Sink, Option<Span>) {
    let mut messages = Sink::new();
    messages.set_source(Some(file.source.clone()));
    let mut reader = SequenceReader::new(file, radii);
    let mut execute = commands.iter();
    let result = execute.try_for_each(|command| reader.execute(command, &mut messages));
    let bend = reader.first_bend;
    let lens = result.and_then(|()| reader.finish(&mut messages));
    (lens, messages, bend)
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

impl<'a> SequenceReader<'a> {
    fn new(file: PrescriptionReader<'a>, radii: bool) -> Self {
        Self {
            file,
            radii,
            first_bend: None,
            beam: SystemData::default(),
            wavelengths: (Vec::new(), 0),
            fields: BTreeMap::new(),
            weights: Vec::new(),
            vignetting: None,
            draft: file.draft(None),
            decenters: BTreeMap::new(),
            apertures: BTreeMap::new(),
            followed: None,
            left_out: Vec::new(),
            current: None,
        }
    }

    /// Executes a command.
    fn execute(&mut self, command: &[Word<'a>], sink: &mut Sink) -> Result<()> {
        let name = command[0].text.to_ascii_uppercase();
        let is_refused = refused(&REFUSED, &name).is_some();
        // A surface may be named behind the command.
        let named = match command {
            [_, surface, ..] if is_refused || OF_SURFACE.contains(&&*name) => {
                self.named_surfaces(*surface)?
            }
            _ => None,
        };
        let (about, plain) = match named {
            Some(about) => (about, [&command[..1], &command[2..]].concat()),
            None => (self.current.into_iter().collect(), command.to_vec()),
        };
        self.refuse(&name, &about, &plain)?;
        if FOLLOWED.contains(&&*name) {
            self.followed = self.followed.or(Some(command[0].span));
            return Ok(());
        }
        if self.of_lens(&name, command)? {
            self.warn_of_image(&name, command, sink);
            return Ok(());
        }
        match name.as_str() {
            "S" => self.surface(command)?,
            "ZOO" => self.zoom(&command[1..], sink)?,
            "THI" if !self.draft.lens.zoom.is_empty() && plain.len() > 2 => {
                self.zoom(command, sink)?;
            }
            _ if let Some(Ok(number)) = name.strip_prefix('S').map(str::parse::<usize>) => {
                self.numbered_surface(number, command, sink)?;
            }
            _ => {
                if about.is_empty() {
                    self.decenter_image(&name, &plain, sink);
                }
                let current = self.current;
                for surface in about {
                    self.current = Some(surface);
                    if !self.decenter(surface, &name, &plain)? {
                        self.of_surface(&name, &plain, sink)?;
                    }
                }
                self.current = current;
            }
        }
        Ok(())
    }

    /// Refuses a command for a property that is not traced. `about` are
    /// the surfaces that it is of, and `command` does not name them any more.
    fn refuse(&self, name: &str, about: &[usize], command: &[Word<'a>]) -> Result<()> {
        if let (Some(what), Some(current)) = (refused(&ELSEWHERE, name), self.current) {
            let message = format!("`{name}`: surface {} {what}", current + 1);
            let help = "state its decenter from the surface in front of it, with DAR, REV or BEN";
            return Err(self.file.refuse(command[0].span, message, help));
        }
        let turns_elsewhere = ["XOD", "YOD", "ZOD"].contains(&name) && !about.is_empty();
        if turns_elsewhere && self.file.argument(command)? != 0.0 {
            let message = format!(
                "`{name}`: surface {} turns about another point",
                about[0] + 1
            );
            let help = "state its decenter as a shift and a turn about its vertex";
            return Err(self.file.refuse(command[0].span, message, help));
        }
        if let (Some(what), true) = (refused(&EDITS, name), self.count() > 0) {
            let message = format!("`{name}` {what}, which is not read");
            let help = "let CODE V execute it, and save the lens";
            return Err(self.file.refuse(command[0].span, message, help));
        }
        let Some(what) = refused(&REFUSED, name) else {
            return Ok(());
        };
        let of_no_surface = about.is_empty() && self.count() > 0;
        if of_no_surface {
            return Ok(());
        }
        let surface = about.first().copied().unwrap_or(0) + 1;
        let message = format!("`{name}` {what}, at surface {surface}");
        Err(self.file.not_traced(command[0].span, message))
    }

    /// Executes a command about the whole lens. Returns whether it is one.
    fn of_lens(&mut self, name: &str, command: &[Word<'a>]) -> Result<bool> {
        let beam = &mut self.beam;
        let place = command[0].span;
        let list = || self.file.numbers(&command[1..]);
        match name {
            "RDM" => self.radii = !command.get(1).is_some_and(|w| w.is("N") || w.is("NO")),
            "TIT" | "TITLE" => {
                self.draft.lens.name = self.file.name(command.get(1).map(|w| w.text));
            }
            "DIM" => self.draft.unit = self.dimension(command)?,
            "EPD" => beam.state_entrance(self.file.argument(command)?, place),
            "FNO" => beam.state_f_number(self.file.argument(command)?, place),
            "NAO" | "NA" => {
                let value = Some(self.file.argument(command)?).filter(|aperture| *aperture > 0.0);
                match name {
                    "NAO" => beam.object_aperture = value,
                    _ => beam.image_aperture = value,
                }
                beam.stated = Some(place);
            }
            "WL" => self.wavelengths.0 = list()?,
            "REF" => {
                let number = self.file.argument(command)?;
                self.wavelengths.1 = (number as usize).saturating_sub(1);
            }
            "XAN" | "YAN" | "XIM" | "YIM" | "XRI" | "YRI" | "XOB" | "YOB" => {
                self.fields.insert(name.to_owned(), list()?);
            }
            "WTW" => self.weights = list()?,
            "VUX" | "VLX" | "VUY" | "VLY" => {
                let factors = list()?;
                if factors.iter().any(|factor| *factor != 0.0) {
                    self.vignetting = self.vignetting.or(Some(place));
                }
                if name == "VUY" {
                    let upper = factors.last().copied().unwrap_or(0.0);
                    beam.vignetting = upper.clamp(0.0, 1.0);
                }
            }
            "SO" | "S0" => {
                let distance = command.get(2).map(|word| self.file.number(*word));
                beam.object_distance = distance.transpose()?;
                let surface = self.count() + 1;
                self.draft.lens.object_medium = glass(self.file, command.get(3), surface)?;
            }
            "SI" => self.current = None,
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// Warns of a defocus and a curvature of the image surface.
    fn warn_of_image(&self, name: &str, command: &[Word<'a>], sink: &mut Sink) {
        let value = |i: usize| {
            let word = command.get(i).filter(|_| name == "SI")?;
            word.text.parse::<f64>().ok().filter(|value| *value != 0.0)
        };
        if let Some(defocus) = value(2) {
            let message = format!("the defocus of {defocus} at the image is left out");
            let help = format!(
                "the film stands at the best focus: `--defocus {defocus}` moves it from there"
            );
            sink.warn(command[2].span, message).help(help);
        }
        if value(1).is_some() {
            warn_of_image_curvature(command[1].span, sink);
        }
    }

    /// The surfaces that `S3`, `S2..5` or `SA` name; none where the word names none. The object's
    /// and the image's names are of no surface of the lens.
    pub(super) fn named_surfaces(&self, word: Word<'_>) -> Result<Option<Vec<usize>>> {
        let Some((b'S' | b's', rest)) = word.text.as_bytes().split_first() else {
            return Ok(None);
        };
        let rest = String::from_utf8_lossy(rest).to_ascii_uppercase();
        let count = self.count();
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
            let help = "surfaces count from S1, behind the object's SO";
            return Err(self.file.refuse(word.span, message, help));
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
        let next = self.count() + 1;
        if (1..next).contains(&number) {
            self.current = Some(number - 1);
            if command.len() > 1 {
                let (surface, places) = self.parsed(command)?;
                self.draft.lens.surfaces[number - 1] = surface;
                self.draft.places[number - 1] = places;
            }
            return Ok(());
        }
        if number != next {
            let message = format!("`{}` is surface {next} of the lens", command[0].text);
            sink.warn(command[0].span, message)
                .help("is a surface lost in front of it?");
        }
        self.surface(command)
    }

    fn dimension(&self, command: &[Word<'_>]) -> Result<f64> {
        match command.get(1) {
            Some(w) if w.is("M") || w.is("MM") => Ok(1.0),
            Some(w) if w.is("C") || w.is("CM") => Ok(10.0),
            Some(w) if w.is("I") || w.is("IN") => Ok(25.4),
            _ => {
                let span = command.last().map_or(Span::at(0), |w| w.span);
                Err(self.file.refuse(
                    span,
                    "this is not a unit of `DIM`",
                    "M is millimeters, C centimeters, I inches",
                ))
            }
        }
    }

    /// The largest field of two commands for x and y; none without them.
    fn field(&self, commands: [&str; 2]) -> Option<f64> {
        let lists = commands.map(|command| self.fields.get(command));
        let [x, y] = lists.map(|list| list.map_or(&[][..], |list| list));
        largest_field([x, y], commands == ["XAN", "YAN"])
    }

    fn finish(mut self, sink: &mut Sink) -> Result<Prescription> {
        if let Some(place) = self.followed {
            let message = "pickups and solves are not executed: the numbers of the surfaces count";
            sink.warn(place, message)
                .help("let CODE V save the lens, which writes the numbers that they give");
        }
        self.beam.half_field = self.field(["XAN", "YAN"]);
        self.beam.image_height = self.field(["XIM", "YIM"]).or(self.field(["XRI", "YRI"]));
        self.beam.object_height = self.field(["XOB", "YOB"]);
        for (surface, decenter) in &self.decenters {
            self.draft.lens.surfaces[*surface].frame = decenter.frame();
        }
        self.apply_apertures(sink);
        self.draft.fold();
        self.draft.limit(self.beam, sink);
        let (all, reference) = &self.wavelengths;
        self.draft.state_wavelengths(all, &self.weights, *reference);
        if let Some(place) = self.vignetting {
            let message = match self.draft.derived.is_empty() {
                true => "vignetting factors are left out",
                false => "of vignetting factors, the last of `VUY` alone narrows the apertures",
            };
            sink.warn(place, message).help(VIGNETTING);
        }
        self.file.finish(self.draft, sink)
    }
}
