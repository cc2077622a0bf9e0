//! CODE V's sequence files: commands, split by line ends and semicolons, continued by `&`.
//!
//! `S` begins a surface: radius (or curvature, after `RDM N`), thickness, glass. What follows
//! belongs to it: STO, CIR (a semi-diameter), CON and ASP with K and A to J, CYL, and RDY, CUY, THI
//! and GLA, which change it; with a surface behind the name (`CIR S3 9`, `STO S1..1`) to that one.
//! Glasses are catalogue names with their maker behind an underscore, six-digit codes (`517642`),
//! or private tables (PRV). What tilts, reflects or diffracts is refused by name.

use std::sync::Arc;

use crate::diag::{Diagnostic, Result, Sink, Source, Span};
use crate::lens::glass::catalogue::Catalogue;
use crate::lens::glass::coating::Coating;
use crate::lens::glass::medium::{C_LINE, D_LINE, F_LINE, Medium, named_line};
use crate::lens::prescription::{Prescription, ZoomPosition, check};
use crate::lens::surface::{Curvature, MAX_POWER, Shape, Surface};

use super::apertures::{Beam, fill};
use super::text::{Word, lines, text, words};

/// A command: its name and what is behind it.
type Command<'a> = Vec<Word<'a>>;

/// Commands that say what no straight lens has.
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

/// Where the numbers of a surface stand.
#[derive(Clone, Default)]
struct Places {
    command: Span,
    columns: [Option<Span>; 4],
}

/// What has been read so far.
struct Reader<'a> {
    source: &'a Arc<Source>,
    glasses: Catalogue,
    /// Whether bends are radii; none while the file has not said so.
    radii: Option<bool>,
    unit: f64,
    title: Option<String>,
    beam: Beam,
    fields: Vec<f64>,
    upper_vignetting: Vec<f64>,
    object_medium: Medium,
    surfaces: Vec<Surface>,
    places: Vec<Places>,
    zoom: Vec<ZoomPosition>,
    /// The surface that a command without one is about; none at the image.
    current: Option<usize>,
}

/// Reads a decoded `.seq` file.
pub fn read(source: &Arc<Source>, glasses: &Catalogue, sink: &mut Sink) -> Result<Prescription> {
    let mut reader = Reader {
        source,
        glasses: glasses.clone(),
        radii: None,
        unit: 1.0,
        title: None,
        beam: Beam {
            edge_share: 1.0,
            ..Beam::default()
        },
        fields: Vec::new(),
        upper_vignetting: Vec::new(),
        object_medium: Medium::air(),
        surfaces: Vec::new(),
        places: Vec::new(),
        zoom: Vec::new(),
        current: None,
    };
    let commands = commands(text(source));
    // Private glasses may stand behind the surfaces that use them.
    let (commands, private) = take_private(commands);
    reader.private_glasses(&private)?;
    for command in &commands {
        reader.obey(command, sink)?;
    }
    reader.finish(sink)
}

fn commands(text: &str) -> Vec<Command<'_>> {
    let mut commands = Vec::new();
    let mut open: Command<'_> = Vec::new();
    for (start, line) in lines(text) {
        let line = split_outside_quotes(line, '!')
            .next()
            .map_or("", |(_, l)| l);
        let (line, goes_on) = match line.trim_end().strip_suffix('&') {
            Some(line) => (line, true),
            None => (line, false),
        };
        let mut parts = split_outside_quotes(line, ';').peekable();
        while let Some((at, part)) = parts.next() {
            open.extend(words(part, start + at));
            if parts.peek().is_some() || !goes_on {
                commands.push(std::mem::take(&mut open));
            }
        }
    }
    commands.push(open);
    commands.retain(|c| !c.is_empty());
    commands
}

/// The parts of a line between separators, with the byte each begins at.
fn split_outside_quotes(line: &str, separator: char) -> impl Iterator<Item = (usize, &str)> {
    let mut quote = None;
    let mut start = 0;
    line.split(move |c: char| {
        match (quote, c) {
            (None, '\'' | '"') => quote = Some(c),
            (Some(open), c) if open == c => quote = None,
            _ => {}
        }
        c == separator && quote.is_none()
    })
    .map(move |part| {
        let at = start;
        start += part.len() + 1;
        (at, part)
    })
}

/// Takes the commands from PRV to END out.
fn take_private(commands: Vec<Command<'_>>) -> (Vec<Command<'_>>, Vec<Command<'_>>) {
    let (mut rest, mut private) = (Vec::new(), Vec::new());
    let mut inside = false;
    for command in commands {
        inside |= command[0].is("PRV");
        let ends = command[0].is("END");
        if inside {
            private.push(command)
        } else {
            rest.push(command)
        }
        inside &= !ends;
    }
    (rest, private)
}

impl<'a> Reader<'a> {
    fn fail(&self, span: Span, message: String) -> Box<Diagnostic> {
        Diagnostic::error(message).at(self.source, span)
    }

    fn value(&self, command: &[Word<'_>]) -> Result<f64> {
        match command.get(1) {
            Some(word) => word.number(self.source),
            None => {
                let message = format!("`{}` has no value", command[0].text);
                Err(self.fail(command[0].span, message))
            }
        }
    }

    /// Tables of index over wavelength, in nanometers: what is between is interpolated.
    fn private_glasses(&mut self, commands: &[Command<'_>]) -> Result<()> {
        let mut wavelengths = Vec::new();
        for command in commands {
            let numbers = || -> Result<Vec<f64>> {
                command[1..].iter().map(|w| w.number(self.source)).collect()
            };
            if command[0].is("PWL") {
                wavelengths = numbers()?;
            } else if !command[0].is("PRV") && !command[0].is("END") && command.len() > 1 {
                // 587.6 is the d line, so that a table of three lines reaches them all.
                let lines = wavelengths.iter().map(|nm| named_line(*nm));
                let table: Vec<(f64, f64)> = lines.zip(numbers()?).collect();
                let at = |nm| interpolated(&table, nm);
                let glass = match (at(F_LINE), at(D_LINE), at(C_LINE), &table[..]) {
                    (Some(f), Some(d), Some(c), _) => Medium::from_lines(f, d, c),
                    (_, Some(d), ..) => Medium::constant(d),
                    (.., [(_, n)]) => Medium::constant(*n),
                    _ => {
                        let message = format!(
                            "the glass `{}` has no index at the d line (587.56 nm)",
                            command[0].text
                        );
                        return Err(self
                            .fail(command[0].span, message)
                            .with_help("`PWL` lists the wavelengths, in nanometers"));
                    }
                };
                self.glasses.add([glass.named(command[0].text)]);
            }
        }
        Ok(())
    }

    fn obey(&mut self, command: &[Word<'a>], sink: &mut Sink) -> Result<()> {
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
            "RDM" => self.radii = Some(!command.get(1).is_some_and(|w| w.is("N") || w.is("NO"))),
            "TIT" | "TITLE" => self.title = command.get(1).map(|w| w.text.to_owned()),
            "DIM" => self.unit = self.dimension(command)?,
            "EPD" => self.beam.entrance_diameter = Some(self.value(command)?),
            "FNO" => self.beam.f_number = Some(self.value(command)?),
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
            "S" => self.surface(command, sink)?,
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
    fn named_surfaces(&self, word: Word<'_>) -> Result<Option<Vec<usize>>> {
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
                let (surface, places) = self.parsed(command, sink)?;
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
        self.surface(command, sink)
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

    fn surface(&mut self, command: &[Word<'_>], sink: &mut Sink) -> Result<()> {
        let (surface, places) = self.parsed(command, sink)?;
        self.current = Some(self.surfaces.len());
        self.surfaces.push(surface);
        self.places.push(places);
        Ok(())
    }

    fn parsed(&mut self, command: &[Word<'_>], sink: &mut Sink) -> Result<(Surface, Places)> {
        if command.len() < 3 {
            let last = command[command.len() - 1].span;
            let message = "too few numbers in this surface".to_owned();
            return Err(self
                .fail(Span::at(last.end as usize), message)
                .with_help("a surface is: S radius thickness glass"));
        }
        let bend = command[1].number(self.source)?;
        let curvature = if self.radii != Some(false) {
            Curvature::from_radius(bend)
        } else {
            Curvature::from_curvature(bend)
        };
        let medium = self.glass(command.get(3))?;
        let thickness = command[2].number(self.source)?;
        if self.radii.is_none() && bend != 0.0 {
            let message =
                "nothing says whether bends are radii or curvatures: they are read as radii";
            sink.warn(command[1].span, message)
                .help("begin the file with `RDM` for radii or `RDM N` for curvatures");
            self.radii = Some(true);
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

    fn glass(&self, word: Option<&Word<'_>>) -> Result<Medium> {
        let Some(word) = word else {
            return Ok(Medium::air());
        };
        if word.is("AIR") {
            return Ok(Medium::air());
        }
        if word.is("REFL") || word.is("REFR_REFL") {
            return Err(self.mirror(word.span, self.surfaces.len() + 1));
        }
        match fictitious(word.text) {
            Some(glass) => Ok(glass),
            None => self.glasses.get(word.text, self.source, word.span),
        }
    }

    fn mirror(&self, span: Span, surface: usize) -> Box<Diagnostic> {
        self.fail(span, format!("surface {surface} is a mirror"))
            .with_help("ivcam traces lenses that light goes straight through")
    }

    /// Commands that say something about one surface, the current one.
    fn of_surface(&mut self, name: &str, command: &[Word<'_>], sink: &mut Sink) -> Result<()> {
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

    fn last(&mut self) -> &mut Surface {
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
        let (k, mut terms) = match std::mem::replace(&mut surface.shape, Shape::Sphere) {
            Shape::Asphere { k, terms } => (k, terms),
            Shape::Conic { k } => (k, Box::new([0.0; MAX_POWER + 1])),
            _ => (0.0, Box::new([0.0; MAX_POWER + 1])),
        };
        terms[power] = value;
        surface.shape = Shape::Asphere { k, terms };
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

    /// `ZOO n`, then `ZOO THI S5 v1 v2 …`; here without the `ZOO`.
    fn zoom(&mut self, command: &[Word<'_>], sink: &mut Sink) -> Result<()> {
        let count = command.first().and_then(|w| w.text.parse::<usize>().ok());
        if let Some(count) = count {
            self.zoom = (1..=count.min(1000))
                .map(|i| ZoomPosition {
                    name: format!("position {i}"),
                    ..Default::default()
                })
                .collect();
            return Ok(());
        }
        let [what, surface, values @ ..] = command else {
            return Ok(());
        };
        let is_gap = what.is("THI");
        let changes = ["THI", "CIR", "RDY", "CUY", "GLA", "K", "STO", "EPD", "FNO"];
        if !changes.iter().any(|name| what.is(name)) {
            return Ok(());
        }
        let surfaces = self.named_surfaces(*surface)?;
        for &surface in surfaces.iter().flatten() {
            let of_stop = what.is("CIR") && self.surfaces[surface].is_stop;
            if !is_gap && !of_stop {
                continue;
            }
            for (position, value) in self.zoom.iter_mut().zip(values) {
                let value = value.number(self.source)?;
                match is_gap {
                    true => position.gaps.push((surface, value)),
                    false => position.stop_semi_diameter = Some(value),
                }
            }
            return Ok(());
        }
        if !is_gap {
            let message = format!(
                "zoom positions that change `{}` are read without it",
                what.text
            );
            sink.warn(what.span, message);
        }
        Ok(())
    }

    fn finish(mut self, sink: &mut Sink) -> Result<Prescription> {
        let name = self
            .title
            .take()
            .unwrap_or_else(|| super::origin::name_of(self.source));
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

/// `517642` is n = 1.517, V = 64.2; `500.700` the same with a dot: n = 1.500, V = 70.0.
fn fictitious(word: &str) -> Option<Medium> {
    let (index, abbe) = match word.split_once('.') {
        Some(parts) => parts,
        None if word.len() == 6 => word.split_at(3),
        None => return None,
    };
    let digits = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
    if !digits(index) || !digits(abbe) || abbe.len() < 2 {
        return None;
    }
    let n = 1.0 + format!("0.{index}").parse::<f64>().ok()?;
    let (whole, rest) = abbe.split_at(2);
    let v = format!("{whole}.{rest}").parse::<f64>().ok()?;
    Some(if v > 0.0 {
        Medium::from_abbe(n, v)
    } else {
        Medium::constant(n)
    })
}

/// Within a table, the polynomial in 1/λ² through the four wavelengths around one, or through all
/// of a shorter table.
///
/// A straight line between lines 100 nm apart errs by 3e-4 in a flint, the cubic by 1e-6.
pub(super) fn interpolated(table: &[(f64, f64)], nm: f64) -> Option<f64> {
    if let Some((_, n)) = table.iter().find(|(at, _)| *at == nm) {
        return Some(*n);
    }
    let mut near: Vec<(f64, f64)> = table.to_vec();
    near.sort_by(|a, b| (a.0 - nm).abs().total_cmp(&(b.0 - nm).abs()));
    near.dedup_by_key(|(at, _)| *at);
    let inside = near.iter().any(|(at, _)| *at < nm) && near.iter().any(|(at, _)| *at > nm);
    near.truncate(4);
    let x = |nm: f64| 1.0 / (nm * nm);
    let weight = |i: usize| -> f64 {
        let others = near.iter().enumerate().filter(|(j, _)| *j != i);
        let ratio =
            |(_, other): (usize, &(f64, f64))| (x(nm) - x(other.0)) / (x(near[i].0) - x(other.0));
        others.map(ratio).product()
    };
    inside.then(|| {
        near.iter()
            .enumerate()
            .map(|(i, (_, n))| weight(i) * n)
            .sum()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Prescription> {
        let source = Arc::new(Source::new("a.seq", text.as_bytes().to_vec()));
        read(&source, &Catalogue::builtin(), &mut Sink::new())
    }

    #[test]
    fn surfaces_are_read_in_either_mode_and_any_unit() {
        let text = |mode: &str, bend: &str| {
            format!(
                "{mode};LEN \"VERSION\"\nTITLE 'A; lens'\nDIM I\nEPD 1.0 ; YAN 0 10\nSO 0 1e14\n\
                 S {bend} 0.25 NBK7_SCHOTT\n  CIR 0.5\nS 0 0.5 517642 ! flat\n  STO; CIR 0.4\n\
                 S -{bend} &\n 2.0\n  ASP; K -1.0; A 0.5;&\n  B 0.25\n  CIR 0.6\nSI 0 0\n  XDE 0\nGO\n"
            )
        };
        for lens in [
            parse(&text("RDM", "2")).unwrap(),
            parse(&text("RDM N", ".5")).unwrap(),
        ] {
            assert_eq!((lens.name.as_str(), lens.surfaces.len()), ("A; lens", 3));
            let [first, second, third] = &lens.surfaces[..] else {
                panic!()
            };
            assert!((first.curvature.radius() - 50.8).abs() < 1e-12);
            assert_eq!(first.medium.name, "N-BK7");
            assert_eq!(lens.stop(), Some(1));
            assert_eq!(second.medium.n_d, 1.517);
            assert!((second.medium.abbe().unwrap() - 64.2).abs() < 1e-9);
            assert!(matches!(&third.shape, Shape::Asphere { k, terms }
                if *k == -1.0 && (terms[6] * 25.4_f64.powi(5) - 0.25).abs() < 1e-12));
            assert_eq!(third.thickness, 50.8);
        }
    }

    #[test]
    fn a_file_that_does_not_say_what_its_bends_are_is_told() {
        let text = "SO 0 1e9\nS .2 3 NBK7\n STO\n CIR 1\nS -.2 5\nSI 0 0\n";
        for (mode, told) in [("", 1), ("RDM\n", 0), ("RDM N\n", 0)] {
            let source = Arc::new(Source::new("a.seq", format!("{mode}{text}").into_bytes()));
            let mut sink = Sink::new();
            read(&source, &Catalogue::builtin(), &mut sink).unwrap();
            let said = sink
                .items()
                .iter()
                .filter(|d| d.message.contains("radii or curvatures"));
            assert_eq!(said.count(), told, "{mode}");
        }
    }

    #[test]
    fn a_command_goes_on_behind_an_ampersand_in_files_of_windows_too() {
        let text = "RDM\r\nSO 0 1e9\r\nS 10 &\r\n 3 NBK7\r\n STO\r\n CIR 4\r\nS -9 5\r\nSI 0 0\r\n";
        assert_eq!(parse(text).unwrap().surfaces[0].thickness, 3.0);
    }

    #[test]
    fn a_private_glass_is_its_table() {
        let lens = parse(
            "RDM\nPRV\n PWL 700 656.2725 587.5618 486.1327 400\n 'E48' 1.52 1.528 1.531 1.538&\n \
             1.55\nEND\nSO 0 1e9\nS 10 3 'E48'\n STO\n CIR 4\nS -10 5\n CIR 4\nSI 0 0\n",
        )
        .unwrap();
        assert_eq!(lens.surfaces[0].medium.n_d, 1.531);
        assert!((lens.surfaces[0].medium.abbe().unwrap() - 53.1).abs() < 1e-9);
    }

    #[test]
    fn what_can_not_be_traced_is_refused_by_name_and_place() {
        let around = |inner: &str| format!("RDM\nSO 0 1e9\nS 10 3 NBK7\n{inner}\nSI 0 0\n");
        for (inner, says, at) in [
            (" ADE 60", "`ADE` tilts", (4, 2)),
            ("S 0 2 REFL", "mirror", (4, 7)),
            (" DIF DOE", "`DIF` diffracts", (4, 2)),
            ("S 0 2 NBK77", "no glass named `NBK77`", (4, 7)),
            ("S 0", "too few", (4, 4)),
            ("S x 2", "not a number", (4, 3)),
            (" STO\nS 5 2\n STO", "second stop", (5, 3)),
        ] {
            let error = parse(&around(inner)).unwrap_err();
            assert!(error.message.contains(says), "{inner}: {}", error.message);
            assert_eq!(error.location().1, Some(at), "{inner}");
        }
    }

    #[test]
    fn a_lens_without_apertures_gets_those_of_its_beam() {
        let text = "RDM\nEPD 10\nYAN 0 5\nSO 0 1e9\nS 50 3 NBK7\n STO\nS -50 48\nSI 0 0\n";
        let lens = parse(text).unwrap();
        assert_eq!(lens.surfaces[0].semi_diameter, 5.0);
        assert!((4.5..5.5).contains(&lens.surfaces[1].semi_diameter));
    }

    /// The same lens three times: each surface with its commands, by numbers, and by commands alone.
    #[test]
    fn a_command_may_name_its_surface() {
        let plain = "RDM\nTIT 'a ! b'\nSO 0 1e9\nS 50 5 517642\n STO\n CIR 9\n ASP\n K -1\n A 1e-6\n\
                     S -80 60\n CIR 8\nSI 0 0\n";
        let numbered = "RDM\nTIT 'a ! b'\nS0 0 1e9\nS1 50 5 700300\nS2 -80 60\nSI 0 0\nSTO S1\n\
                        CIR S1..2 9\nCIR S2 8\nGLA S1 517642\nASP S1 K -1 A 1e-6\n";
        let commands = "RDM N\nTIT 'a ! b'\nSO\nS 0 1 517642\n RDY 50; THI 5; STO; CIR 9\n ASP K -1 A 1e-6\n\
                        S 0 60\n RDY -80\n CIR 8\nSI\n";
        let bare = |text| {
            let mut lens = parse(text).unwrap();
            lens.surfaces
                .iter_mut()
                .for_each(|s| s.span = Span::default());
            lens
        };
        assert_eq!(bare(numbered), bare(plain));
        assert_eq!(bare(commands), bare(plain));
        assert_eq!(bare(plain).name, "a ! b");
        for (command, says) in [
            ("CIR S3 5", "no surface `S3`"),
            ("ADE S2 5", "`ADE` tilts a surface, at surface 2"),
            ("ZOO 2\nZOO THI S7 1 2", "no surface `S7`"),
        ] {
            let error = parse(&format!("{numbered}{command}\n")).unwrap_err();
            assert!(error.message.contains(says), "{command}: {error}");
        }
        // A tilt of nothing is none.
        assert!(parse(&format!("{numbered}ADE S2 0\nXDE S1 0.0\n")).is_ok());
    }

    #[test]
    fn zoom_positions_may_change_gaps_and_the_stop() {
        let text = "RDM\nSO 0 1e9\nS 50 5 517642\n CIR 9\nS 0 2\n STO\n CIR 5\nS -80 60\n CIR 8\nSI 0 0\n\
                    ZOO 2\nZOO THI S2 2 4\nZOO CIR S2 5 4\n";
        let lens = parse(text).unwrap();
        assert_eq!(lens.zoom[1].gaps, [(1, 4.0)]);
        assert_eq!(lens.zoom[1].stop_semi_diameter, Some(4.0));
    }

    /// The lines of N-BK7 rounded as catalogues print wavelengths, and none of them in the visible.
    #[test]
    fn a_private_glass_needs_the_d_line_only() {
        let text = |table: &str| {
            format!(
                "RDM\nPRV\n{table}\nEND\nSO 0 1e9\nS 50 5 'G'\n STO\n CIR 9\nS -80 60\nSI 0 0\n"
            )
        };
        let glass = |table: &str| parse(&text(table)).map(|lens| lens.surfaces[0].medium.clone());
        let lines = glass("PWL 656.27 587.56 486.13\n'G' 1.51432 1.5168 1.52238").unwrap();
        assert_eq!(lines.n_d, 1.5168);
        assert!((lines.abbe().unwrap() - 0.5168 / 0.00806).abs() < 1e-9);
        assert_eq!(glass("PWL 587.6\n'G' 1.6").unwrap().n_d, 1.6);
        // Sparse, and without the line itself: Malitson's silica is 1.458464 there.
        let sparse =
            glass("PWL 404.7 486.1 546.1 643.8 706.5\n'G' 1.46961 1.46313 1.46008 1.45670 1.45515");
        assert!((sparse.unwrap().n_d - 1.458464).abs() < 1e-5);
        let error = glass("PWL 1550 1310\n'G' 1.44 1.45").unwrap_err();
        assert!(error.message.contains("`G` has no index"), "{error}");
    }
}
