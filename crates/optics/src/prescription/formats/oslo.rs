//! Reads the `.len` files of OSLO: one command a line or between semicolons, a surface after `NXT`.
//!
//! Surface 0 is the object and the last one, or the one of `END`, the image. Read: RD or CV, TH,
//! AP (a semi-diameter, perhaps after CHK), AST, AIR, GLA with a name, an index, or `MOD` and the
//! indices at the wavelengths of WV, CC, AD to AG; EBR, FNO, NAO, NA, ANG and GIH for apertures
//! that the file leaves out, RFL and RFH for mirrors, DCX to DCZ and TLA to TLC with DT, BEN and
//! RCO for decenters, PK for pickups, PU and PY for solves (`oslo_solves`), and UNI, the
//! millimeters of its unit. CVF, RDF, THF and GLF are fixed numbers and glasses. What diffracts is
//! refused by name, and so are other pickups and solves.

use std::collections::BTreeMap;

use ivcam_base::diag::{Result, Sink, Span};

use crate::prescription::formats::apertures::SystemData;
use crate::prescription::formats::commands::commands;
use crate::prescription::formats::decenters::{AxisBehind, StatedDecenter};
use crate::prescription::formats::format::PrescriptionFormat;
use crate::prescription::formats::index_table;
use crate::prescription::formats::oslo_solves::{STATE_IT, Solve, picked_surface, resolve};
use crate::prescription::formats::reader::{Draft, PrescriptionReader, open_if_zero, refused};
use crate::prescription::glass::medium::{C_LINE, D_LINE, F_LINE, Medium, named_line};
use crate::prescription::prescription::{Column, Prescription};
use crate::prescription::surface::{Curvature, Surface};
use crate::prescription::text::Word;

/// OSLO's lens files, recognized by a line that is `NXT`.
pub(crate) static FORMAT: PrescriptionFormat = PrescriptionFormat {
    name: "OSLO",
    recognizes: |text| {
        let plain = |line: &str| line.split("//").next().unwrap_or("").trim().to_owned();
        let next = |line: &str| {
            line.split(';')
                .any(|part| part.trim().eq_ignore_ascii_case("NXT"))
        };
        text.lines().map(plain).any(|line| next(&line))
    },
    read,
};

/// Commands for properties that are not traced, refused unless their
/// value is 0.
const REFUSED: [(&str, &str); 9] = [
    ("is a grating", "GSP GOR"),
    ("is an ideal lens", "PFL"),
    ("is toric", "CVX RDX"),
    ("has a gradient index", "GDT"),
    ("diffracts", "DFR DWV"),
    ("is a Zernike surface", "ZRN"),
    ("is a special surface", "SPS"),
    ("is non-sequential", "NSS"),
    ("has global coordinates", "GTO GCO"),
];

/// The state of executing the commands of a file of OSLO.
struct OsloReader<'a> {
    file: PrescriptionReader<'a>,
    /// The lens, whose first surface is the object and whose last is the image.
    draft: Draft,
    /// The wavelengths of model glasses in nanometers.
    wavelengths: Vec<f64>,
    beam: SystemData,
    /// The decenters of surfaces, by their numbers.
    decenters: BTreeMap<usize, StatedDecenter>,
    solves: Vec<Solve>,
    ended: bool,
}

fn read(file: PrescriptionReader<'_>, sink: &mut Sink) -> Result<Prescription> {
    let mut reader = OsloReader {
        file,
        draft: file.draft(None),
        // OSLO's default wavelengths.
        wavelengths: vec![D_LINE, F_LINE, C_LINE],
        beam: SystemData::default(),
        decenters: BTreeMap::new(),
        solves: Vec::new(),
        ended: false,
    };
    reader.next_surface(Span::at(0));
    let commands = commands(file.text(), "//");
    // Model glasses have an index for each wavelength, which the file may list behind them.
    if let Some(command) = commands.iter().find(|command| command[0].is("WV")) {
        let micrometers = file.numbers(&command[1..])?;
        reader.wavelengths = micrometers.iter().map(|um| named_line(1e3 * um)).collect();
        reader.draft.state_wavelengths(&reader.wavelengths, &[], 0);
    }
    for command in &commands {
        reader.execute(command, sink)?;
    }
    reader.finish(sink)
}

impl<'a> OsloReader<'a> {
    /// Adds a plane without an aperture, in air.
    fn next_surface(&mut self, span: Span) {
        let plane = Surface::sphere(0.0, 0.0, Medium::air(), f64::INFINITY);
        self.draft.push(Surface { span, ..plane }, [span; 4]);
    }

    fn execute(&mut self, command: &[Word<'a>], sink: &mut Sink) -> Result<()> {
        let word = command[0];
        let name = word.text.to_ascii_uppercase();
        self.refuse(&name, command)?;
        if self.ended {
            return Ok(());
        }
        match name.as_str() {
            "LEN" => {
                let named = command.iter().skip(1).find(|w| !w.is("NEW"));
                self.draft.lens.name = self.file.name(named.map(|w| w.text));
            }
            "UNI" => {
                let unit = self.file.argument(command)?;
                if !(unit > 0.0) {
                    let message = format!("a unit of {unit} mm is not possible");
                    return Err(self.file.fail(word.span, message));
                }
                self.draft.unit = unit;
            }
            "EBR" => {
                let radius = self.file.argument(command)?;
                self.beam.state_entrance(2.0 * radius, word.span);
            }
            "FNO" => {
                let f_number = self.file.argument(command)?;
                self.beam.state_f_number(f_number, word.span);
            }
            "NAO" | "NA" => {
                let aperture = Some(self.file.argument(command)?).filter(|value| *value > 0.0);
                match name.as_str() {
                    "NAO" => self.beam.object_aperture = aperture,
                    _ => self.beam.image_aperture = aperture,
                }
                self.beam.stated = Some(word.span);
            }
            "ANG" => self.beam.half_field = Some(self.file.argument(command)?.abs()),
            "GIH" => self.beam.image_height = Some(self.file.argument(command)?.abs()),
            "OBH" => self.beam.object_height = Some(self.file.argument(command)?.abs()),
            "NXT" => {
                self.file.check_count(self.draft.places.len())?;
                self.next_surface(word.span);
            }
            "END" => self.ended = true,
            _ => self.of_surface(&name, command, sink)?,
        }
        Ok(())
    }

    /// Refuses a command for a property that is not traced.
    fn refuse(&self, name: &str, command: &[Word<'a>]) -> Result<()> {
        let is_zero = command.get(1).is_some_and(|w| w.text.parse() == Ok(0.0));
        match refused(&REFUSED, name) {
            Some(what) if !is_zero => {
                let number = self.draft.places.len() - 1;
                let message = format!("`{name}` is not read: surface {number} {what}");
                Err(self.file.not_traced(command[0].span, message))
            }
            _ => Ok(()),
        }
    }

    /// Executes a command that changes the last surface.
    fn of_surface(&mut self, name: &str, command: &[Word<'a>], sink: &mut Sink) -> Result<()> {
        let number = || self.file.argument(command);
        let last = self.draft.places.len() - 1;
        let surface = &mut self.draft.lens.surfaces[last];
        let mut stated = command.get(1).map_or(command[0].span, |w| w.span);
        let column = match name {
            "RD" | "RDF" => {
                surface.curvature = Curvature::from_radius(number()?);
                Column::Radius
            }
            "CV" | "CVF" => {
                surface.curvature = Curvature::from_curvature(number()?);
                Column::Radius
            }
            "TH" | "THF" => {
                surface.thickness = number()?;
                Column::Thickness
            }
            "GLA" | "GLF" => {
                surface.medium = glass(self.file, &self.wavelengths, command)?;
                Column::Index
            }
            "AP" => {
                let mut words = command[1..].iter();
                let Some(word) = words.find(|w| w.text.parse::<f64>().is_ok()) else {
                    return Ok(());
                };
                surface.semi_diameter = open_if_zero(self.file.number(*word)?);
                stated = word.span;
                Column::SemiDiameter
            }
            _ if self.decenter(name, command)? || self.follows(name, command)? => return Ok(()),
            _ => return self.of_shape(name, command, sink),
        };
        self.draft.places[last][column as usize] = stated;
        Ok(())
    }

    /// Executes a command that decenters the last surface. Returns whether it is one.
    fn decenter(&mut self, name: &str, command: &[Word<'a>]) -> Result<bool> {
        let last = self.draft.places.len() - 1;
        let stated = self.decenters.entry(last).or_default();
        let all = match name {
            "TLA" | "TLB" | "TLC" => &mut stated.tilt,
            "DCX" | "DCY" | "DCZ" => &mut stated.shift,
            _ => {
                match name {
                    "BEN" => stated.behind = AxisBehind::Bends,
                    "RCO" => stated.behind = AxisBehind::Returns,
                    // -1: the tilt comes first.
                    "DT" => stated.is_tilted_first = self.file.argument(command)? < 0.0,
                    _ => return Ok(false),
                }
                let other = command
                    .get(1)
                    .and_then(|word| word.text.parse::<usize>().ok());
                if let ("RCO", Some(other)) = (name, other.filter(|other| *other != last)) {
                    let message = format!("`RCO {other}` of surface {last} is not read");
                    let help = "`RCO` of the surface itself is read: only it is decentered";
                    return Err(self.file.refuse(command[0].span, message, help));
                }
                return Ok(true);
            }
        };
        let value = self.file.argument(command)?;
        match &name[2..] {
            "A" | "X" => all.x = value,
            "B" | "Y" => all.y = value,
            _ => all.z = value,
        }
        Ok(true)
    }

    /// Executes a pickup or a solve of the last surface. Returns whether it is one.
    fn follows(&mut self, name: &str, command: &[Word<'a>]) -> Result<bool> {
        let last = self.draft.places.len() - 1;
        if let Some(solve) = Solve::of(self.file, last, command)? {
            self.solves.push(solve);
            return Ok(true);
        }
        let picked = command.get(1).map_or("", |w| w.text);
        if name != "PK" && !["PUC", "PYC", "PI", "PIC", "EC"].contains(&name) {
            return Ok(false);
        }
        if name != "PK" || !["AP", "GLA"].contains(&&*picked.to_ascii_uppercase()) {
            let message = format!("`{name} {picked}` of surface {last} is not read");
            return Err(self.file.refuse(command[0].span, message, STATE_IT));
        }
        let other = self.draft.lens.surfaces[picked_surface(self.file, last, command)?].clone();
        let surface = &mut self.draft.lens.surfaces[last];
        match picked.eq_ignore_ascii_case("AP") {
            true => surface.semi_diameter = other.semi_diameter,
            false => surface.medium = other.medium,
        }
        Ok(true)
    }

    /// Executes a command that changes the shape of the last surface, or another property that no
    /// message is about.
    fn of_shape(&mut self, name: &str, command: &[Word<'a>], sink: &mut Sink) -> Result<()> {
        let last = self.draft.places.len() - 1;
        let surface = &mut self.draft.lens.surfaces[last];
        match name {
            "AIR" => surface.medium = Medium::air(),
            "AST" => surface.is_stop = last > 0,
            "RFL" | "RFH" => surface.is_mirror = true,
            "CC" => {
                let k = self.file.argument(command)?;
                surface.change_shape(|shape| shape.with_conic(k));
            }
            "AD" | "AE" | "AF" | "AG" => {
                let order = ["AD", "AE", "AF", "AG"]
                    .iter()
                    .position(|term| *term == name);
                let value = self.file.argument(command)?;
                if value != 0.0 {
                    let power = 4 + 2 * order.unwrap_or(0);
                    surface.change_shape(|shape| shape.with_term(power, value));
                }
            }
            "ASP" => {
                let kind = command.get(1).map_or("", |w| w.text);
                let message = format!("an asphere of the kind `ASP {kind}` is not read");
                return Err(self.file.fail(command[0].span, message));
            }
            _ if name.starts_with("AP") && name.len() > 2 => {
                let message = format!("the aperture `{name}` is left out");
                sink.warn(command[0].span, message);
            }
            _ => {}
        }
        Ok(())
    }

    /// Removes the planes that have no effect on light. Between other surfaces they only lengthen
    /// the gap.
    fn remove_dummies(&mut self) {
        let surfaces = std::mem::take(&mut self.draft.lens.surfaces);
        let places = std::mem::take(&mut self.draft.places);
        for (surface, places) in surfaces.into_iter().zip(places) {
            if !surface.is_dummy(self.draft.medium()) {
                self.draft.push(surface, places);
            } else if let Some(last) = self.draft.lens.surfaces.last_mut() {
                last.thickness += surface.thickness;
            } else if let Some(distance) = &mut self.beam.object_distance {
                *distance += surface.thickness;
            }
        }
    }

    fn finish(mut self, sink: &mut Sink) -> Result<Prescription> {
        if self.draft.places.len() < 3 {
            let help = "OSLO begins each surface behind the object with `NXT`";
            return Err(self.file.no_surfaces(Span::at(0), help));
        }
        let beam = &self.beam;
        let near =
            |sine: f64| self.draft.lens.surfaces[0].thickness * sine / (1.0 - sine * sine).sqrt();
        let entrance = beam.entrance_diameter.map(|diameter| 0.5 * diameter);
        let entrance = entrance.or(beam.object_aperture.map(near));
        let wavelength = self.wavelengths.first().copied().unwrap_or(D_LINE);
        let surfaces = &mut self.draft.lens.surfaces;
        resolve(self.file, surfaces, &self.solves, entrance, wavelength)?;
        for (surface, decenter) in &self.decenters {
            self.draft.lens.surfaces[*surface].frame = decenter.frame();
        }
        self.draft.places.remove(0);
        let lens = &mut self.draft.lens;
        let object = lens.surfaces.remove(0);
        lens.object_medium = object.medium;
        self.beam.object_distance = Some(object.thickness);
        let image = lens.surfaces.pop();
        self.remove_dummies();
        if let Some(frame) = image.and_then(|image| image.frame) {
            self.draft.pending = frame.before;
        }
        self.draft.fold();
        self.draft.limit(self.beam, sink);
        self.file.finish(self.draft, sink)
    }
}

/// The medium of `GLA N-BK7`, `GLA 1.5168` or `GLA MOD name n1 n2 n3`, whose indices are those at
/// `wavelengths`, in nanometers.
fn glass(
    file: PrescriptionReader<'_>,
    wavelengths: &[f64],
    command: &[Word<'_>],
) -> Result<Medium> {
    let Some(first) = command.get(1) else {
        return Ok(Medium::air());
    };
    let (name, indices) = match first.is("MOD") {
        true => (command.get(2), command.get(3..).unwrap_or(&[])),
        false if first.text.parse::<f64>().is_ok() => (None, &command[1..]),
        false => return file.glass(first.text, first.span),
    };
    let indices = file.numbers(indices)?;
    let waves = wavelengths.iter().copied();
    let table: Vec<(f64, f64)> = waves.zip(indices.iter().copied()).collect();
    let medium = match (index_table::medium(&table), indices.first()) {
        (Some(medium), _) => medium,
        (None, Some(first)) => Medium::constant(*first),
        (None, None) => {
            let message = format!("the glass `{}` has no index", first.text);
            return Err(file.fail(first.span, message));
        }
    };
    Ok(medium.named(name.map_or("", |name| name.text)))
}
