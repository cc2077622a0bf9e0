//! `ivcam lens`: prints the data of a lens or traces rays through it, as text or JSON.
//!
//! Lengths are in millimeters, z = 0 is the front vertex, and light travels toward +z. JSON numbers
//! have enough digits to give the same double when they are read.

use std::io::Write;
use std::path::Path;

use clap::{Arg, ArgAction, ArgMatches, Command};
use ivcam_base::diag::{Diagnostic, Result, Sink, counted};
use ivcam_base::files::write_whole;
use ivcam_optics::lens::analysis::aberrations::report::Aberrations;
use ivcam_optics::lens::{
    About, Coating, FieldPoint, FirstOrder, Focus, Lens, LensSheet, Plane, Pupil, SheetSetting,
};
use ivcam_render::camera::{film_plane, lens_in_scene};
use serde::Serialize;

use super::sheet::{AboutRow, SurfaceRow};
use super::{flags, print_diagnostic};
use crate::photo::{LensChoice, options};

/// Half of the film's height in the paper's equation 7, in millimeters.
const HALF_HEIGHT: f64 = 12.0;

/// Returns the definition of the command.
pub(crate) fn command() -> Command {
    let value = |name: &'static str, value: &'static str, help: &'static str| {
        Arg::new(name)
            .long(name)
            .value_name(value)
            .help(help)
            .allow_hyphen_values(true)
    };
    Command::new("lens")
        .about("Prints the data of a lens, or traces rays through it")
        .arg(
            Arg::new("lens")
                .value_name("LENS")
                .help("a shipped lens or a file; without one, lists the shipped lenses"),
        )
        .arg(
            Arg::new("json")
                .long("json")
                .help("prints JSON")
                .action(ArgAction::SetTrue),
        )
        .args(options::lens_options().map(flags::argument))
        .mut_arg("zoom", |arg| arg.visible_alias("scale"))
        .mut_arg("efl", |arg| arg.conflicts_with("zoom"))
        .mut_arg("focus", |arg| {
            arg.help("focus, in meters from the front vertex (or `inf`)")
        })
        .arg(value(
            "wavelength",
            "NM",
            "the wavelength in nanometers; default the d line",
        ))
        .arg(value(
            "write",
            "FILE",
            "write the prescription: .dat (pbrt's four columns), .zmx, .seq or .json",
        ))
        .arg(value(
            "diagram",
            "FILE",
            "draw the section with rays: .svg or .fig (xfig)",
        ))
        .arg(value(
            "sheet",
            "FILE",
            "write the data sheet as one page: .html or .svg",
        ))
        .arg(value(
            "csv",
            "FILE",
            "write the curves, fans, coefficients and spots as CSV, one value a row",
        ))
        .arg(value(
            "psf",
            "FILE",
            "draw the images of points with diffraction: .png, .exr or another picture format",
        ))
        .arg(value(
            "defocus",
            "MM",
            "shifts the film of the data sheet away from the lens by this many millimeters",
        ))
        .arg(value(
            "fields",
            "LIST",
            "the points of the data sheet on the film's diagonal: heights in mm, 70% or 20deg [0,50%,70%,100%]",
        ))
        .arg(value(
            "frequencies",
            "LIST",
            "the frequencies of the modulation, in line pairs per millimeter",
        ))
        .arg(value(
            "film",
            "WxH",
            "the film of the data sheet, or its diagonal, in millimeters [the stated field of the lens]",
        ))
        .arg(super::switch(
            "curves",
            "with --json: the data sheet's curves and aberrations too",
        ))
        .arg(value(
            "as-scene",
            "FILE.iv",
            "write the lens as solids of a scene, with the film behind it (--focus), in meters",
        ))
        .arg(value(
            "trace",
            "RAYS.json",
            "trace a list of rays (`-` reads standard input)",
        ))
        .args(super::lens_export::arguments())
}

/// Runs the command and returns the exit code.
pub(crate) fn run(matches: &ArgMatches, out: &mut dyn Write) -> Result<i32> {
    let text = |name: &str| matches.get_one::<String>(name).map(String::as_str);
    let Some(name) = text("lens") else {
        return without_lens(matches, out);
    };
    let mut sink = Sink::new();
    let (choice, distance) =
        LensChoice::from_options(name, &flags::given_options(matches), &mut sink)?;
    let opened = choice.open(&mut sink);
    sink.items().iter().for_each(super::print_diagnostic);
    let mut lens = opened?;
    if let Some(nm) = text("wavelength") {
        lens = lens.at_wavelength(wavelength(positive(nm, "wavelength")?)?);
    }
    let unfocused = lens.clone();
    let mut focus = None;
    if let Some(distance) = distance {
        let focused = lens.focused(choice.method, distance);
        let (moved, found) = focused.map_err(|fault| fault.diagnostic(lens.name()))?;
        (lens, focus) = (moved, Some(found));
    }
    let film_z = focus.as_ref().map(|f| f.film_z);
    if let Some(file) = text("trace") {
        return super::trace_rays::run(&lens, film_z, file, text("diagram"), out);
    }
    if let Some(file) = text("as-scene") {
        return save_scene(&lens, film_z, file);
    }
    let mut setting = setting(matches)?;
    (setting.unfocused, setting.focus) = (Some(&unfocused), focus.as_ref());
    if let dark @ 1.. = setting.dark_fields(&lens) {
        let (dark, all) = (counted(dark, "point"), setting.fields.len());
        let text = format!("no light gets through the lens to {dark} of the {all} of `--fields`");
        print_diagnostic(&Diagnostic::warning(text));
    }
    if text("export").is_some() {
        let sides = match text("film").map(film_sides).transpose()? {
            Some(Film::Sides(sides)) => Some(sides),
            _ => None,
        };
        return super::lens_export::run(&lens, &choice, &setting, sides, matches, out);
    }
    if let Some(file) = text("csv") {
        super::sheet::save_csv(&lens, &setting, file)?;
    }
    let files = ["write", "diagram", "sheet", "csv", "psf"].map(text);
    if let [Some(file), ..] = files {
        super::sheet::save_prescription(&lens, file)?;
    }
    if let [_, Some(file), ..] = files {
        super::sheet::save_diagram(&lens, &setting, file)?;
    }
    if let [_, _, Some(file), ..] = files {
        super::sheet::save_sheet(&lens, &setting, file)?;
    }
    if let [.., Some(file)] = files {
        super::sheet::save_point_spreads(&lens, &setting, file)?;
    }
    if files.iter().any(Option::is_some) && !matches.get_flag("json") {
        return Ok(0);
    }
    let result = if matches.get_flag("json") {
        let mut sheet = Sheet::of(&lens, focus.as_ref());
        if matches.get_flag("curves") {
            (sheet.curves, sheet.aberrations) = Aberrations::with_sheet(&lens, &setting).unzip();
        }
        serde_json::to_writer_pretty(&mut *out, &sheet).map_err(std::io::Error::from)
    } else {
        write_text(&lens, focus.as_ref(), out)
            .and_then(|()| writeln!(out))
            .and_then(|()| super::sheet::surfaces(&lens, out))
            .and_then(|()| match Aberrations::with_sheet(&lens, &setting) {
                Some((sheet, all)) => {
                    super::sheet::curves(&sheet, out)?;
                    super::sheet::aberrations(&all, out)
                }
                None => Ok(()),
            })
    };
    super::exit_code(result.and_then(|()| writeln!(out)))
}

/// Lists the shipped lenses; `--export` needs one.
fn without_lens(matches: &ArgMatches, out: &mut dyn Write) -> Result<i32> {
    if matches.contains_id("export") {
        return Err(Diagnostic::error("`--export` needs a lens")
            .with_help("`ivcam lens` lists the lenses that come with the program"));
    }
    super::sheet::list(matches.get_flag("json"), out)
}

/// The conditions of the data sheet, without the focus.
fn setting(matches: &ArgMatches) -> Result<SheetSetting<'static>> {
    let text = |name: &str| matches.get_one::<String>(name).map(String::as_str);
    let mut setting = SheetSetting::default();
    if let Some(value) = text("defocus") {
        let wanted = "a length in millimeters, such as 0.05 or -0.1mm";
        setting.defocus = parse(value.trim_end_matches("mm"), "defocus", wanted)?;
        if !(setting.defocus.abs() < 1e6) {
            return Err(invalid_value("defocus", value, wanted));
        }
    }
    if let Some(value) = text("film") {
        setting.image_height = Some(match film_sides(value)? {
            Film::Diagonal(diagonal) => 0.5 * diagonal,
            Film::Sides([width, height]) => 0.5 * width.hypot(height),
        });
    }
    if let Some(value) = text("frequencies") {
        let wanted = "up to 400 numbers of line pairs per millimeter, such as 10,20,40";
        let all = list(value, |word| positive(word, "frequencies").ok());
        let mut all = all.ok_or_else(|| invalid_value("frequencies", value, wanted))?;
        all.sort_by(f64::total_cmp);
        all.dedup();
        setting.frequencies = all;
    }
    if let Some(value) = text("fields") {
        let wanted =
            "up to 400 heights in mm (10), shares (70%) or angles (20deg), such as 0,50%,100%";
        let all = list(value, field_point);
        setting.fields = all.ok_or_else(|| invalid_value("fields", value, wanted))?;
    }
    Ok(setting)
}

/// The film of `--film`, in millimeters.
enum Film {
    Diagonal(f64),
    Sides([f64; 2]),
}

fn film_sides(value: &str) -> Result<Film> {
    let wanted = "a film size in millimeters such as 36x24, or the diagonal alone";
    let invalid = || invalid_value("film", value, wanted);
    let sides: Vec<f64> = value
        .trim_end_matches("mm")
        .split(['x', 'X', '×'])
        .map(|side| positive(side.trim(), "film"))
        .collect::<Result<_>>()
        .map_err(|_| invalid())?;
    match sides[..] {
        [diagonal] => Ok(Film::Diagonal(diagonal)),
        [width, height] => Ok(Film::Sides([width, height])),
        _ => Err(invalid()),
    }
}

/// Parses a list of 1 to 400 words with commas between them.
fn list<T>(value: &str, word: impl Fn(&str) -> Option<T>) -> Option<Vec<T>> {
    let all: Vec<T> = value
        .split(',')
        .map(|w| word(w.trim()))
        .collect::<Option<_>>()?;
    (all.len() <= 400).then_some(all)
}

/// Parses a place on the film's diagonal: `10` or `10mm`, `70%`, or `20deg`.
fn field_point(word: &str) -> Option<FieldPoint> {
    let number = |text: &str| text.parse().ok().filter(|v: &f64| (0.0..1e6).contains(v));
    if let Some(share) = word.strip_suffix('%') {
        return Some(FieldPoint::Share(0.01 * number(share)?));
    }
    if let Some(angle) = word.strip_suffix("deg") {
        return Some(FieldPoint::Angle(number(angle)?.to_radians()));
    }
    number(word.trim_end_matches("mm")).map(FieldPoint::Height)
}

/// Writes the lens as solids, with the film in focus. Without a distance the focus is at infinity.
fn save_scene(lens: &Lens, film_z: Option<f64>, file: &str) -> Result<i32> {
    let at_infinity = || lens.first_order().focal.map(|f| f.rear_focal_point);
    let Some(film_z) = film_z.or_else(at_infinity) else {
        return Err(Diagnostic::error(format!(
            "`{}` has no focal point for the film",
            lens.name()
        )));
    };
    let scene = lens_in_scene(lens, &film_plane(lens, film_z), None)?;
    write_whole(Path::new(file), |to| to.write_all(scene.as_bytes()))?;
    Ok(0)
}

pub(super) fn invalid_value(flag: &str, value: &str, wanted: &str) -> Box<Diagnostic> {
    Diagnostic::error(format!("`--{flag} {value}` is invalid")).with_help(format!("give {wanted}"))
}

fn parse<T: std::str::FromStr>(value: &str, flag: &str, wanted: &str) -> Result<T> {
    value
        .parse()
        .map_err(|_| invalid_value(flag, value, wanted))
}

pub(super) fn positive(value: &str, flag: &str) -> Result<f64> {
    let number: f64 = parse(value, flag, "a number greater than 0")?;
    if number > 0.0 && number.is_finite() {
        Ok(number)
    } else {
        Err(invalid_value(flag, value, "a number greater than 0"))
    }
}

pub(super) fn wavelength(nm: f64) -> Result<f64> {
    if (100.0..=100_000.0).contains(&nm) {
        return Ok(nm);
    }
    Err(
        Diagnostic::error(format!("a wavelength of {nm} nm can't be traced"))
            .with_help("wavelengths are in nanometers; visible light is 380 to 750"),
    )
}

/// The output of `--json`.
#[derive(Serialize)]
struct Sheet<'a> {
    name: &'a str,
    wavelength_nm: f64,
    #[serde(flatten)]
    optics: Optics,
    #[serde(skip_serializing_if = "Option::is_none")]
    x_plane: Option<Optics>,
    #[serde(skip_serializing_if = "Option::is_none")]
    focus: Option<FocusSheet>,
    /// The f-number by real rays: the one that `--aperture` sets and exposures use.
    f_number: Option<f64>,
    f_number_real: Option<f64>,
    f_number_paraxial: Option<f64>,
    /// The f-number by real rays divided by the square root of the transmittance on the axis.
    t_number: Option<f64>,
    t_number_real: Option<f64>,
    t_number_paraxial: Option<f64>,
    transmittance: Option<f64>,
    about: AboutRow,
    surfaces: Vec<SurfaceRow>,
    #[serde(skip_serializing_if = "Option::is_none")]
    curves: Option<LensSheet>,
    #[serde(skip_serializing_if = "Option::is_none")]
    aberrations: Option<Aberrations>,
}

/// First-order data in one plane. Values at infinity are null.
#[derive(Serialize)]
struct Optics {
    efl: Option<f64>,
    bfl: Option<f64>,
    ffl: Option<f64>,
    front_focal_point: Option<f64>,
    rear_focal_point: Option<f64>,
    front_principal_plane: Option<f64>,
    rear_principal_plane: Option<f64>,
    entrance_pupil: Option<PupilSheet>,
    exit_pupil: Option<PupilSheet>,
    length: f64,
    afocal: bool,
    power: f64,
    matrix: [f64; 4],
}

#[derive(Serialize)]
struct PupilSheet {
    z: f64,
    semi_diameter: f64,
}

/// The focus, with distances in millimeters.
#[derive(Serialize)]
struct FocusSheet {
    distance: Option<f64>,
    film_z: f64,
    method: &'static str,
    magnification: f64,
    height_angle: f64,
    extension: f64,
}

impl Optics {
    fn of(optics: &FirstOrder) -> Self {
        let focal = optics.focal;
        let pupil = |p: Option<Pupil>| {
            p.map(|p| PupilSheet {
                z: p.z,
                semi_diameter: p.semi_diameter,
            })
        };
        Self {
            efl: focal.map(|f| f.efl),
            bfl: focal.map(|f| f.bfl),
            ffl: focal.map(|f| f.ffl),
            front_focal_point: focal.map(|f| f.front_focal_point),
            rear_focal_point: focal.map(|f| f.rear_focal_point),
            front_principal_plane: focal.map(|f| f.front_principal_plane),
            rear_principal_plane: focal.map(|f| f.rear_principal_plane),
            entrance_pupil: pupil(optics.entrance_pupil),
            exit_pupil: pupil(optics.exit_pupil),
            length: optics.length,
            afocal: focal.is_none(),
            power: optics.power,
            matrix: optics.matrix,
        }
    }
}

impl<'a> Sheet<'a> {
    fn of(lens: &'a Lens, focus: Option<&Focus>) -> Self {
        let rotational = lens
            .prescription()
            .surfaces
            .iter()
            .all(|s| s.shape.is_rotational());
        Self {
            name: lens.name(),
            wavelength_nm: lens.wavelength(),
            optics: Optics::of(lens.first_order()),
            x_plane: (!rotational).then(|| Optics::of(&lens.first_order_in(Plane::X))),
            focus: focus.map(|focus| FocusSheet {
                distance: focus.distance.is_finite().then_some(focus.distance),
                film_z: focus.film_z,
                method: focus.method.name(),
                magnification: focus.magnification,
                height_angle: focus.height_angle(HALF_HEIGHT),
                extension: focus.extension,
            }),
            f_number: lens.real_f_number(),
            f_number_real: lens.real_f_number(),
            f_number_paraxial: lens.first_order().f_number(),
            t_number: lens.t_number(),
            t_number_real: lens.t_number(),
            t_number_paraxial: lens.paraxial_t_number(),
            transmittance: lens.axial_transmittance(),
            about: AboutRow::of(lens.prescription()),
            surfaces: SurfaceRow::all(lens.prescription()),
            curves: None,
            aberrations: None,
        }
    }
}

fn write_text(lens: &Lens, focus: Option<&Focus>, out: &mut dyn Write) -> std::io::Result<()> {
    let optics = lens.first_order();
    let about = About::of(lens.prescription());
    let title = about
        .title
        .map_or(String::new(), |title| format!("  {title}"));
    writeln!(out, "{}{title}", lens.name())?;
    let facts = [about.kind, about.year, about.field, about.source];
    let facts: Vec<String> = facts.into_iter().flatten().collect();
    for note in std::iter::once(facts.join(" \u{b7} ")).chain(about.notes) {
        if !note.is_empty() {
            writeln!(out, "  {note}")?;
        }
    }
    match optics.focal {
        None => {
            writeln!(out, "  afocal: parallel light leaves parallel")?;
            let turned = optics.matrix[3] * optics.n_object / optics.n_image;
            writeln!(out, "  angular magnification  {turned:>12.4}")?;
        }
        Some(focal) => {
            writeln!(out, "  focal length           {:>12.4} mm", focal.efl)?;
            writeln!(out, "  back focal length      {:>12.4} mm", focal.bfl)?;
            writeln!(out, "  front focal length     {:>12.4} mm", focal.ffl)?;
            writeln!(
                out,
                "  front principal plane  {:>12.4} mm",
                focal.front_principal_plane
            )?;
            writeln!(
                out,
                "  rear principal plane   {:>12.4} mm",
                focal.rear_principal_plane
            )?;
        }
    }
    let pupils = [
        ("entrance pupil", optics.entrance_pupil),
        ("exit pupil", optics.exit_pupil),
    ];
    for (name, pupil) in pupils {
        match pupil {
            Some(p) => writeln!(
                out,
                "  {name:<22} {:>12.4} mm  semi-diameter {:.4} mm",
                p.z, p.semi_diameter
            )?,
            None => writeln!(out, "  {name:<22} at infinity")?,
        }
    }
    if let Some(n) = lens.real_f_number() {
        writeln!(out, "  f-number, real rays    {n:>12.4}")?;
        if let Some(n) = optics.f_number() {
            writeln!(out, "  f-number, paraxial     {n:>12.4}")?;
        }
        t_numbers(lens, out)?;
    }
    write!(out, "  length                 {:>12.4} mm", optics.length)?;
    if !lens.prescription().is_dispersive() {
        write!(
            out,
            "\n  colour                 none: the source gives indices at the d line alone"
        )?;
    }
    if let Some(focus) = focus {
        let angle = focus.height_angle(HALF_HEIGHT).to_degrees();
        writeln!(
            out,
            "\n  focused at {} m ({} moved)",
            focus.distance / 1000.0,
            focus.method.name()
        )?;
        writeln!(out, "  film at                {:>12.4} mm", focus.film_z)?;
        writeln!(
            out,
            "  magnification          {:>12.6}",
            focus.magnification
        )?;
        write!(out, "  height angle           {angle:>12.4} degrees")?;
    }
    Ok(())
}

/// Prints the T-number of the lens, and those with other coatings.
fn t_numbers(lens: &Lens, out: &mut dyn Write) -> std::io::Result<()> {
    let number = |lens: &Lens| Some((lens.t_number()?, lens.axial_transmittance()?));
    let Some((own, share)) = number(lens) else {
        return Ok(());
    };
    let others = [Coating::MagnesiumFluoride, Coating::Bare];
    let others = others.map(|coating| {
        let (t, share) = number(&lens.with_coating(coating)).unwrap_or((f64::NAN, f64::NAN));
        format!("{} {t:.2} ({:.1}%)", coating.name(), 100.0 * share)
    });
    writeln!(
        out,
        "  T-number, real rays    {own:>12.4}     {:.1}% gets through; coated {}",
        100.0 * share,
        others.join(", ")
    )?;
    match lens.paraxial_t_number() {
        Some(t) => writeln!(out, "  T-number, paraxial     {t:>12.4}"),
        None => Ok(()),
    }
}
