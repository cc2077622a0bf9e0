//! Writes prescriptions as pbrt's four columns, as Zemax and CODE V files, and as ivcam's own JSON.
//!
//! JSON contains everything. The other writers refuse lenses that their format cannot represent,
//! and return a list of what they leave out. Numbers are written so that reading them back gives
//! the same double.

use std::fmt::Write as _;
use std::path::Path;

use glam::{DVec2, DVec3};
use ivcam_base::diag::{Diagnostic, Result};

use crate::prescription::about::{About, KEYS, stated_unit};
use crate::prescription::decenter::Decenter;
use crate::prescription::formats::dat::{NOMINAL_F_NUMBER, NOMINAL_FOCAL_LENGTH};
use crate::prescription::formats::write_seq::{code_v, table_lines};
use crate::prescription::glass::catalogue::Catalogue;
use crate::prescription::glass::coating::Coating;
use crate::prescription::glass::medium::{
    C_LINE, D_LINE, Dispersion, F_LINE, Formula, Medium, named_line,
};
use crate::prescription::prescription::{Iris, Prescription, StatedBeam};
use crate::prescription::surface::{Curvature, MAX_POWER, Shape, Surface};

/// A format that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum OutputFormat {
    /// pbrt's four columns, `.dat`.
    Columns,
    /// Zemax's sequential files, `.zmx`.
    Zemax,
    /// CODE V's sequence files, `.seq`.
    CodeV,
    /// ivcam's own JSON, `.json`, which contains everything.
    Json,
}

impl OutputFormat {
    /// The format with the extension of a file name.
    pub fn of(path: &Path) -> Result<Self> {
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("");
        match ending.to_ascii_lowercase().as_str() {
            "dat" => Ok(Self::Columns),
            "zmx" => Ok(Self::Zemax),
            "seq" => Ok(Self::CodeV),
            "json" => Ok(Self::Json),
            _ => Err(Diagnostic::unsupported(format!(
                "`{}` says no format that prescriptions are written in",
                path.display()
            ))
            .with_help("end the name in .dat (pbrt's four columns), .zmx, .seq or .json")),
        }
    }
}

/// A prescription as text, and what the format left out.
pub fn write(lens: &Prescription, target: OutputFormat) -> Result<(String, Vec<String>)> {
    write_at(lens, target, f64::INFINITY)
}

/// A prescription as text, with the distance of the object from the front vertex in millimeters,
/// which Zemax and CODE V keep; and what the format left out.
pub fn write_at(
    lens: &Prescription,
    target: OutputFormat,
    object: f64,
) -> Result<(String, Vec<String>)> {
    // Files have the signs of the straight axis.
    let folded = lens.has_mirrors().then(|| lens.folded());
    let written = Prescription {
        notes: notes(lens),
        ..folded.unwrap_or_else(|| lens.clone())
    };
    match target {
        OutputFormat::Columns => columns(&written),
        OutputFormat::Zemax => zemax(&with_outlined_stop(written), object),
        OutputFormat::CodeV => code_v(&with_outlined_stop(written), object),
        OutputFormat::Json => Ok((json(&written), Vec::new())),
    }
}

/// The lens with an iris that is a rectangle as the aperture of its stop, as files state it. The
/// stops of zoom positions are round.
fn with_outlined_stop(mut lens: Prescription) -> Prescription {
    let has_stops = lens.zoom.iter().any(|z| z.stop_semi_diameter.is_some());
    let (Iris::Outline { corners, rotation }, Some(stop), false) =
        (&lens.iris, lens.stop(), has_stops)
    else {
        return lens;
    };
    let mut surface = lens.surfaces[stop].clone();
    let (sin, cos) = libm::sincos(*rotation);
    let turn = DVec2::new(cos, sin);
    let place = |corner: &[f64; 2]| {
        let corner = turn.rotate(DVec2::from_array(*corner)) * surface.semi_diameter;
        DVec2::new(tidy(corner.x), tidy(corner.y))
    };
    surface.outline = Some(corners.iter().map(place).collect());
    if surface.rectangle().is_some() {
        lens.surfaces[stop] = surface;
        lens.iris = Iris::Round;
    }
    lens
}

/// The shortest decimal number near a value that counts as the same.
pub(super) fn shortest(value: f64, is_same: impl Fn(f64) -> bool) -> f64 {
    let rounded = (0..17).filter_map(|digits| format!("{value:.digits$e}").parse::<f64>().ok());
    rounded.into_iter().find(|v| is_same(*v)).unwrap_or(value)
}

/// A result of arithmetic without the digits of its rounding.
pub(super) fn tidy(value: f64) -> f64 {
    shortest(value, |v| (v - value).abs() <= 1e-12 * value.abs())
}

/// The Abbe number of a glass: the shortest that gives the same two-term formula, if it has one.
pub(super) fn abbe_number(glass: &Medium) -> Option<f64> {
    let abbe = glass.abbe()?;
    let is_same = |v: f64| Medium::from_abbe(glass.n_d, v).dispersion == glass.dispersion;
    let short = shortest(abbe, is_same);
    Some(if is_same(short) { short } else { tidy(abbe) })
}

/// The wavelengths in nanometers with their weights, the shortest first, and the index of the
/// primary one. Without stated ones they are the F, d and C lines.
pub(super) fn wavelengths(lens: &Prescription) -> (Vec<[f64; 2]>, usize) {
    let Some(primary) = lens.wavelengths_nm.first() else {
        return ([F_LINE, D_LINE, C_LINE].map(|nm| [nm, 1.0]).to_vec(), 1);
    };
    let weight = |i: usize| lens.wavelength_weights.get(i).copied().unwrap_or(1.0);
    let all = lens.wavelengths_nm.iter().enumerate();
    let mut all: Vec<[f64; 2]> = all.map(|(i, nm)| [*nm, weight(i)]).collect();
    all.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let at = all.iter().position(|[nm, _]| nm == primary);
    (all, at.unwrap_or(0))
}

/// The edge of the field that the lens states.
pub(super) enum FieldEdge {
    /// An angle in degrees.
    Angle(f64),
    /// A height in the image in millimeters.
    Height(f64),
}

impl FieldEdge {
    /// The stated edge; an angle of 0 without one, which is added to what is left out.
    pub(super) fn of(about: &About, left_out: &mut Vec<String>) -> Self {
        let angle = about.field_degrees.map(|field| 0.5 * field);
        match (angle.filter(|a| *a >= 0.0), about.image_height) {
            (None | Some(0.0), Some(height)) => Self::Height(height),
            (Some(angle), _) => Self::Angle(angle),
            (None, None) => {
                let what = "the field, which the lens does not state: it is 0";
                left_out.push(what.to_owned());
                Self::Angle(0.0)
            }
        }
    }

    /// The field at 0, 70% and 100%; that of the axis alone is a single 0.
    pub(super) fn points(&self) -> Vec<String> {
        let (Self::Angle(edge) | Self::Height(edge)) = *self;
        let all = [0.0, tidy(0.7 * edge), edge];
        let all = if edge == 0.0 { &all[..1] } else { &all };
        all.iter().map(f64::to_string).collect()
    }
}

/// The notes of a lens as it is now: lengths are in millimeters, and what a scale, a zoom position
/// or a stop has made wrong is left out.
fn notes(lens: &Prescription) -> Vec<String> {
    let optics = lens.first_order(D_LINE);
    let is_near = |stated: Option<f64>, found: Option<f64>, tolerance: f64| {
        let both = stated.zip(found);
        both.is_none_or(|(stated, found)| (found.abs() / stated - 1.0).abs() <= tolerance)
    };
    let about = About::of(lens);
    let efl = optics.focal.map(|focal| focal.efl);
    let has_its_size = is_near(about.focal_length_mm, efl, NOMINAL_FOCAL_LENGTH);
    let has_its_stop = is_near(about.f_number, optics.f_number(), NOMINAL_F_NUMBER);
    let note = |note: &String| match note.split(':').next().unwrap_or(note) {
        _ if stated_unit(note).is_some() => None,
        "focal length" | "nominal" if !has_its_size => None,
        "f-number" if !has_its_stop => None,
        "image height" => about
            .image_height
            .map(|h| format!("image height: {} mm", tidy(h))),
        _ => Some(note.clone()),
    };
    lens.notes.iter().filter_map(note).collect()
}

pub(super) fn refuse(i: usize, what: &str, format: &str) -> Box<Diagnostic> {
    Diagnostic::unsupported(format!("surface {i} {what}, which {format} can't say"))
        .with_help("write .json, which keeps everything")
}

/// pbrt's `.dat`: radius, thickness, index, aperture diameter.
fn columns(lens: &Prescription) -> Result<(String, Vec<String>)> {
    const FORMAT: &str = "a file of four columns";
    let mut text = String::new();
    for note in &lens.notes {
        let _ = writeln!(text, "# {note}");
    }
    for line in field_comments(lens) {
        let _ = writeln!(text, "# {line}");
    }
    text += "# radius thickness n_d diameter\n";
    if lens.object_medium.n_d != 1.0 {
        return Err(refuse(0, "is in a medium other than air", FORMAT));
    }
    for (i, surface) in lens.surfaces.iter().enumerate() {
        if let Some(what) = beyond_columns(surface, lens.medium_before(i)) {
            return Err(refuse(i, what, FORMAT));
        }
        let index = if surface.is_stop {
            0.0
        } else {
            surface.medium.n_d
        };
        let _ = writeln!(
            text,
            "{} {} {} {}",
            surface.curvature.radius(),
            surface.thickness,
            index,
            2.0 * surface.semi_diameter
        );
    }
    let mut left_out = Vec::new();
    if !lens.wavelengths_nm.is_empty() {
        left_out.push("the wavelengths".to_owned());
    }
    if lens.is_dispersive() {
        left_out.push("dispersion: four columns have the index at the d line alone".to_owned());
    }
    left_out.extend(beyond_surfaces(lens, false));
    Ok((text, left_out))
}

/// What four columns cannot say of a surface, behind the medium `before`.
fn beyond_columns(surface: &Surface, before: &Medium) -> Option<&'static str> {
    let found = [
        (matches!(surface.shape, Shape::ThinLens { .. }), IDEAL),
        (surface.shape != Shape::Sphere, "is not a sphere"),
        (surface.is_mirror, "is a mirror"),
        (surface.frame.is_some(), "is decentered or tilted"),
        (surface.obstruction > 0.0, "is closed in its middle"),
        (
            surface.outline.is_some(),
            "has an aperture that is not round",
        ),
        (!surface.semi_diameter.is_finite(), "has no aperture"),
        (
            surface.is_stop && !surface.is_plane(),
            "is curved and the stop",
        ),
        (
            surface.is_stop && surface.medium.n_d != before.n_d,
            "is a stop between two media",
        ),
    ];
    found
        .iter()
        .find(|(is_so, _)| *is_so)
        .map(|(_, what)| *what)
}

/// The comments for the field that a file states by numbers of its format.
fn field_comments(lens: &Prescription) -> Vec<String> {
    let about = About::of_notes(&lens.notes, 1.0);
    let field = lens.half_field.filter(|_| about.field_degrees.is_none());
    let height = lens.image_height.filter(|_| about.image_height.is_none());
    let field = field.map(|half| format!("field: {} degrees", 2.0 * half));
    let height = height.map(|height| format!("image height: {height}"));
    field.into_iter().chain(height).collect()
}

pub(super) fn beyond_surfaces(lens: &Prescription, has_zoom: bool) -> Vec<String> {
    let mut left_out = Vec::new();
    if !lens.zoom.is_empty() && !has_zoom {
        left_out.push(format!("{} zoom positions", lens.zoom.len()));
    }
    if lens.iris != Iris::Round {
        left_out.push("the shape of the iris".to_owned());
    }
    for (i, surface) in lens.surfaces.iter().enumerate() {
        if surface.outline.is_some() && surface.rectangle().is_none() {
            left_out.push(format!(
                "the outline of surface {i}, which is round in the file"
            ));
        }
    }
    if lens.focus_group.is_some() {
        left_out.push("the group that moves for focusing".to_owned());
    }
    if lens
        .surfaces
        .iter()
        .any(|s| s.coating != Coating::default())
    {
        left_out.push("coatings".to_owned());
    }
    left_out
}

fn zemax(lens: &Prescription, object: f64) -> Result<(String, Vec<String>)> {
    let mut text = String::from("VERS 140124 0 0\nMODE SEQ\n");
    let about = About::of(lens);
    let _ = writeln!(
        text,
        "NAME {}",
        about.title.as_deref().unwrap_or(&lens.name)
    );
    for note in &lens.notes {
        let _ = writeln!(text, "NOTE 0 {note}");
    }
    let mut left_out = Vec::new();
    system_lines(&mut text, lens, &FieldEdge::of(&about, &mut left_out));
    let distance = match object.is_finite() {
        true => object.to_string(),
        false => "INFINITY".to_owned(),
    };
    let _ = writeln!(text, "SURF 0\n  TYPE STANDARD\n  CURV 0\n  DISZ {distance}");
    let glasses = Catalogue::builtin();
    glass_line(&mut text, &lens.object_medium, &glasses, &mut left_out);
    let mut numbers = SurfaceNumbers::default();
    for (i, surface) in lens.surfaces.iter().enumerate() {
        let (frame, _) = surface.frame_and_gap();
        numbers.breaks(&mut text, &frame.before, 0.0);
        let own = numbers.next();
        numbers.own.push(own);
        let _ = writeln!(text, "SURF {own}");
        surface_lines(&mut text, i, surface, &glasses, &mut left_out)?;
        numbers.breaks(&mut text, &frame.after, surface.thickness);
        numbers.gaps.push(numbers.last);
    }
    let _ = writeln!(
        text,
        "SURF {}\n  TYPE STANDARD\n  CURV 0\n  DISZ 0",
        numbers.next()
    );
    configurations(&mut text, lens, &numbers);
    left_out.extend(beyond_surfaces(lens, true));
    left_out.dedup();
    Ok((text, left_out))
}

/// Writes the beam, the fields and the wavelengths.
fn system_lines(text: &mut String, lens: &Prescription, field: &FieldEdge) {
    let beam = match lens.stated_beam {
        None => "FLOA".to_owned(),
        Some(StatedBeam::EntrancePupil(diameter)) => format!("ENPD {diameter}"),
        Some(StatedBeam::FNumber(number)) => format!("FNUM {number} 0"),
    };
    let (waves, primary) = wavelengths(lens);
    let kind = match field {
        FieldEdge::Angle(_) => 0,
        FieldEdge::Height(_) => 3,
    };
    let points = field.points();
    let _ = writeln!(
        text,
        "UNIT MM X W X CM MR CPMM\n{beam}\nGCAT SCHOTT OHARA HOYA\nFTYP {kind} 0 {} {} 0 0 0",
        points.len(),
        waves.len()
    );
    let zeros = vec!["0"; points.len()].join(" ");
    let _ = writeln!(text, "XFLN {zeros}\nYFLN {}", points.join(" "));
    for (i, [nm, weight]) in waves.iter().enumerate() {
        let is_near = |um: f64| (1e3 * um - nm).abs() <= 1e-12 * nm;
        let is_same = |um: f64| is_near(um) && named_line(1e3 * um) == *nm;
        let micrometers = shortest(1e-3 * nm, is_same);
        let _ = writeln!(text, "WAVM {} {micrometers} {weight}", i + 1);
    }
    let _ = writeln!(text, "PWAV {}", primary + 1);
}

/// Writes the lines of a surface below its heading.
fn surface_lines(
    text: &mut String,
    i: usize,
    surface: &Surface,
    glasses: &Catalogue,
    left_out: &mut Vec<String>,
) -> Result<()> {
    if surface.is_stop {
        *text += "  STOP\n";
    }
    shape_lines(text, i, surface)?;
    let _ = writeln!(text, "  DISZ {}", surface.frame_and_gap().1);
    match surface.is_mirror {
        true => *text += "  GLAS MIRROR 0 0 1.5 40\n",
        false => glass_line(text, &surface.medium, glasses, left_out),
    }
    let (closed, a) = (surface.obstruction, surface.semi_diameter);
    if let Some([half, center]) = surface.rectangle() {
        if closed > 0.0 || a < surface.reach() * (1.0 - 1e-9) {
            left_out.push(format!("what limits surface {i} beside a rectangle"));
        }
        let _ = writeln!(text, "  DIAM {a} 1 0 0 1\n  SQAP {} {} 0", half.x, half.y);
        let _ = writeln!(text, "  OBDC {} {}", center.x, center.y);
        return Ok(());
    }
    let _ = match (closed > 0.0, a.is_finite()) {
        (false, true) => writeln!(text, "  DIAM {a} 1 0 0 1\n  FLAP 0 {a} 0"),
        (true, true) => writeln!(text, "  DIAM {a} 1 0 0 1\n  CLAP {closed} {a} 0"),
        (true, false) => writeln!(text, "  OBSC 0 {closed} 0"),
        (false, false) => Ok(()),
    };
    Ok(())
}

/// The numbers of surfaces in a file of Zemax, whose coordinate breaks are surfaces too.
#[derive(Default)]
struct SurfaceNumbers {
    /// The number of each surface.
    own: Vec<usize>,
    /// The number of the surface that has the gap behind each surface.
    gaps: Vec<usize>,
    last: usize,
}

impl SurfaceNumbers {
    fn next(&mut self) -> usize {
        self.last += 1;
        self.last
    }

    /// Writes a decenter with the gap behind it, if there is one, as coordinate breaks. A break
    /// has no shift along the axis: one that tilts first may do without, and otherwise the shift is
    /// the gap of another break.
    fn breaks(&mut self, text: &mut String, decenter: &Decenter, gap: f64) {
        if decenter.is_none() {
            return;
        }
        let tilts_first = decenter.shifts_across_axis_behind();
        let (shift, tilt) = match tilts_first {
            true => (decenter.shift_behind(), -decenter.inverse().tilt),
            false => (decenter.shift, decenter.tilt),
        };
        if shift.z != 0.0 {
            let _ = writeln!(
                text,
                "SURF {}\n  TYPE COORDBRK\n  DISZ {}",
                self.next(),
                shift.z
            );
        }
        let _ = writeln!(text, "SURF {}\n  TYPE COORDBRK", self.next());
        for (i, value) in [shift.x, shift.y, tilt.x, tilt.y, tilt.z]
            .into_iter()
            .enumerate()
        {
            let _ = writeln!(text, "  PARM {} {value}", i + 1);
        }
        if tilts_first {
            *text += "  PARM 6 1\n";
        }
        let _ = writeln!(text, "  DISZ {gap}");
    }
}

fn glass_line(text: &mut String, glass: &Medium, glasses: &Catalogue, left_out: &mut Vec<String>) {
    if *glass == Medium::air() {
        return;
    }
    let abbe = abbe_number(glass).unwrap_or(0.0);
    let is_same = |known: &Medium| {
        let measured_nm = known.measured_nm;
        let glass = glass.clone();
        *known
            == Medium {
                measured_nm,
                ..glass
            }
    };
    if glasses.find(&glass.name).is_some_and(is_same) {
        let _ = writeln!(text, "  GLAS {} 0 0 {} {abbe}", glass.name, glass.n_d);
        return;
    }
    if !matches!(
        glass.dispersion,
        Dispersion::None | Dispersion::Cauchy { .. }
    ) {
        left_out.push(format!(
            "the curve of the glass {} beyond n_d and V_d",
            glass.name
        ));
    }
    let _ = writeln!(text, "  GLAS ___BLANK 1 0 {} {abbe} 0 0 0 0 0 0", glass.n_d);
}

/// The reasons for which formats other than JSON refuse a surface.
pub(super) const NORMAL: &str = "is an asphere measured along a normal";
pub(super) const IDEAL: &str = "is an ideal lens";

fn shape_lines(text: &mut String, i: usize, surface: &Surface) -> Result<()> {
    const FORMAT: &str = "Zemax's file";
    let c = surface.curvature.per_mm();
    let mut put = |kind: &str, c: f64, k: f64| {
        let _ = writeln!(text, "  TYPE {kind}\n  CURV {c}");
        if k != 0.0 {
            let _ = writeln!(text, "  CONI {k}");
        }
    };
    let constant = |terms: &[f64; MAX_POWER + 1]| terms[0] != 0.0;
    match &surface.shape {
        Shape::Sphere => put("STANDARD", c, 0.0),
        Shape::Conic { k } => put("STANDARD", c, *k),
        Shape::CylinderX => put("TOROIDAL", c, 0.0),
        Shape::CylinderY => {
            put("TOROIDAL", 0.0, 0.0);
            let _ = writeln!(text, "  PARM 1 {}", surface.curvature.radius());
        }
        Shape::Asphere { terms, .. } | Shape::Toroid { terms, .. } if constant(terms) => {
            return Err(refuse(i, "has a constant term", FORMAT));
        }
        Shape::Asphere { k, terms } if is_even(terms, 16) => {
            put("EVENASPH", c, *k);
            for j in 1..=8 {
                let _ = writeln!(text, "  PARM {j} {}", terms[2 * j]);
            }
        }
        Shape::Asphere { k, terms } => {
            put("XOSPHERE", c, *k);
            let _ = writeln!(text, "  XDAT 1 {MAX_POWER}\n  XDAT 2 1");
            for power in 1..=MAX_POWER {
                let _ = writeln!(text, "  XDAT {} {}", power + 2, terms[power]);
            }
        }
        Shape::Toroid { across, k, terms } if is_even(terms, 14) => {
            put("TOROIDAL", c, *k);
            let _ = writeln!(text, "  PARM 1 {}", across.radius());
            for j in 1..=7 {
                let _ = writeln!(text, "  PARM {} {}", j + 1, terms[2 * j]);
            }
        }
        Shape::ThinLens { focal_length } => {
            put("PARAXIAL", 0.0, 0.0);
            // The second number has optical paths to the paraxial object and image.
            let _ = writeln!(text, "  PARM 1 {focal_length}\n  PARM 2 3");
        }
        Shape::Toroid { .. } => return Err(refuse(i, "is a toroid with odd terms", FORMAT)),
        Shape::NormalAsphere { .. } => return Err(refuse(i, NORMAL, FORMAT)),
    }
    Ok(())
}

pub(super) fn is_even(terms: &[f64; MAX_POWER + 1], highest: usize) -> bool {
    let mut odd = terms
        .iter()
        .enumerate()
        .filter(|(p, _)| p % 2 == 1 || *p > highest);
    odd.all(|(_, term)| *term == 0.0)
}

/// Zoom positions as configurations, in Zemax's order of operands.
fn configurations(text: &mut String, lens: &Prescription, numbers: &SurfaceNumbers) {
    if lens.zoom.is_empty() {
        return;
    }
    let current = lens.zoom.iter().position(|zoom| lens.is_at(zoom));
    let current = current.map_or(1, |position| position + 1);
    let _ = writeln!(text, "MNUM {} {current}", lens.zoom.len());
    let mut surfaces: Vec<usize> = lens
        .zoom
        .iter()
        .flat_map(|z| z.gaps.iter().map(|(i, _)| *i))
        .collect();
    surfaces.sort_unstable();
    surfaces.dedup();
    for surface in surfaces {
        for (c, position) in lens.zoom.iter().enumerate() {
            let gap = position.gaps.iter().find(|(i, _)| *i == surface);
            let gap = gap.map_or(lens.surfaces[surface].thickness, |(_, gap)| *gap);
            let _ = writeln!(
                text,
                "THIC {} {} {gap} 0 0 0 1 1 1 0 0 \"\" 0",
                numbers.gaps[surface],
                c + 1
            );
        }
    }
    let Some(stop) = lens.stop() else { return };
    for (c, position) in lens.zoom.iter().enumerate() {
        if let Some(radius) = position.stop_semi_diameter {
            let _ = writeln!(
                text,
                "SDIA {} {} {radius} 0 0 0 1 1 1 0 0 \"\" 0",
                numbers.own[stop],
                c + 1
            );
        }
    }
}

/// ivcam's own JSON, schema `ivlens-1`, with one surface in a line.
fn json(lens: &Prescription) -> String {
    let mut text = String::from("{\n");
    let mut line = |key: &str, value: String| {
        let _ = writeln!(text, " {}: {value},", quoted(key));
    };
    line("schema", quoted("ivlens-1"));
    line("name", quoted(&lens.name));
    let about = About::of(lens);
    for note in &lens.notes {
        if let Some((key, value)) = note.split_once(": ")
            && KEYS.contains(&key)
        {
            line(if key == "name" { "title" } else { key }, quoted(value));
        }
    }
    let notes: Vec<String> = about.notes.iter().map(|note| quoted(note)).collect();
    if !notes.is_empty() {
        line("note", format!("[{}]", notes.join(", ")));
    }
    line("units", quoted("mm"));
    line("n_object", number(lens.object_medium.n_d));
    if lens.object_medium.is_dispersive() {
        let fields = medium_fields(&lens.object_medium, &lens.wavelengths_nm);
        line("object_medium", object(&fields));
    }
    if let Some(height) = lens.image_height {
        line("h_max", number(height));
    }
    if let Some(half) = lens.half_field {
        line("half_field_deg", number(half));
    }
    match lens.stated_beam {
        None => {}
        Some(StatedBeam::EntrancePupil(d)) => line("entrance_pupil", number(d)),
        Some(StatedBeam::FNumber(n)) => line("image_f_number", number(n)),
    }
    if !lens.wavelengths_nm.is_empty() {
        line("wavelengths_nm", list(&lens.wavelengths_nm));
    }
    if !lens.wavelength_weights.is_empty() {
        line("wavelength_weights", list(&lens.wavelength_weights));
    }
    if let Some(iris) = iris_value(&lens.iris) {
        line("iris", iris);
    }
    if !lens.zoom.is_empty() {
        line("zoom", zoom_value(lens));
    }
    if let Some(group) = lens.focus_group {
        line("focus_group", format!("[{}, {}]", group.first, group.last));
    }
    text += " \"surfaces\": [\n";
    let row = |surface| surface_value(surface, &lens.wavelengths_nm);
    let rows: Vec<String> = lens.surfaces.iter().map(row).collect();
    text += &rows.join(",\n");
    text += "\n ]\n}\n";
    text
}

fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// The shortest decimal number that is read back as the same double.
fn number(value: f64) -> String {
    format!("{value:?}")
}

fn list(values: &[f64]) -> String {
    let words: Vec<String> = values.iter().map(|v| number(*v)).collect();
    format!("[{}]", words.join(", "))
}

fn object(fields: &[(&str, String)]) -> String {
    let words: Vec<String> = fields
        .iter()
        .map(|(k, v)| format!("{}: {v}", quoted(k)))
        .collect();
    format!("{{{}}}", words.join(", "))
}

fn surface_value(surface: &Surface, waves: &[f64]) -> String {
    let mut fields = vec![("kind", quoted(kind(surface)))];
    if surface.is_stop && kind(surface) != "stop" {
        fields.push(("stop", "true".to_owned()));
    }
    bend(&mut fields, ["R", "c"], surface.curvature);
    fields.push(("t", number(surface.thickness)));
    match surface.is_mirror {
        true => fields.push(("mirror", "true".to_owned())),
        false => fields.extend(medium_fields(&surface.medium, waves)),
    }
    if let Some(frame) = &surface.frame {
        decenter_fields(&mut fields, ["decenter", "tilt"], &frame.before);
        decenter_fields(&mut fields, ["decenter_after", "tilt_after"], &frame.after);
    }
    if surface.obstruction > 0.0 {
        fields.push(("obstruction", number(surface.obstruction)));
    }
    if surface.semi_diameter.is_finite() {
        fields.push(("semi_diameter", number(surface.semi_diameter)));
    }
    if let Some(corners) = &surface.outline {
        let corners: Vec<String> = corners.iter().map(|c| list(&c.to_array())).collect();
        fields.push(("outline", format!("[{}]", corners.join(", "))));
    }
    if surface.coating != Coating::default() {
        fields.push(("coating", quoted(surface.coating.name())));
    }
    match &surface.shape {
        Shape::Conic { k } => fields.push(("k", number(*k))),
        Shape::ThinLens { focal_length } => fields.push(("focal_length", number(*focal_length))),
        Shape::Asphere { k, terms }
        | Shape::NormalAsphere { k, terms }
        | Shape::Toroid { k, terms, .. } => {
            if let Shape::Toroid { across, .. } = &surface.shape {
                bend(&mut fields, ["R_x", "c_x"], *across);
            }
            fields.push(("k", number(*k)));
            let powers: Vec<String> = (0..=MAX_POWER)
                .filter(|p| terms[*p] != 0.0)
                .map(|p| format!("\"{p}\": {}", number(terms[p])))
                .collect();
            fields.push(("radial_poly", format!("{{{}}}", powers.join(", "))));
        }
        _ => {}
    }
    format!("  {}", object(&fields))
}

fn decenter_fields(
    fields: &mut Vec<(&str, String)>,
    names: [&'static str; 2],
    decenter: &Decenter,
) {
    for (name, v) in names.into_iter().zip([decenter.shift, decenter.tilt]) {
        if v != DVec3::ZERO {
            fields.push((name, list(&v.to_array())));
        }
    }
}

fn kind(surface: &Surface) -> &'static str {
    match &surface.shape {
        Shape::Sphere if surface.is_stop && surface.curvature.is_plane() => "stop",
        Shape::Sphere if surface.curvature.is_plane() => "plane",
        shape => shape.name(),
    }
}

/// Writes a curvature as a radius, or as a curvature if it was given as one.
fn bend(fields: &mut Vec<(&str, String)>, [radius, curvature]: [&'static str; 2], bend: Curvature) {
    if bend.is_plane() {
        fields.push((radius, "0".to_owned()));
    } else if Curvature::from_radius(bend.radius()) == bend {
        fields.push((radius, number(bend.radius())));
    } else {
        fields.push((curvature, number(bend.per_mm())));
    }
}

/// The fields of a medium. One of a changed index or Abbe number has a table, also at the lens's
/// wavelengths.
fn medium_fields(medium: &Medium, waves: &[f64]) -> Vec<(&'static str, String)> {
    let rows = |lines: &mut dyn Iterator<Item = (f64, f64)>| {
        let rows: Vec<String> = lines.map(|(nm, n)| list(&[nm, n])).collect();
        format!("[{}]", rows.join(", "))
    };
    let mut fields = Vec::new();
    if !medium.name.is_empty() {
        fields.push(("glass", quoted(&medium.name)));
    }
    fields.push(("n_d", number(medium.n_d)));
    match &medium.dispersion {
        Dispersion::None => {}
        Dispersion::Cauchy { a, b } => {
            fields.push(("V_d", number(abbe_number(medium).unwrap_or(0.0))));
            fields.push(("cauchy", list(&[*a, *b])));
        }
        Dispersion::ThreeLines { n_f, n_c, .. } => {
            fields.push(("n_F", number(*n_f)));
            fields.push(("n_C", number(*n_c)));
        }
        Dispersion::Table { lines } => {
            fields.push(("indices", rows(&mut lines.iter().copied())));
        }
        Dispersion::Scaled { .. } => {
            let lines = table_lines(medium, waves).into_iter().rev();
            fields.push(("indices", rows(&mut lines.map(|nm| (nm, medium.index(nm))))));
        }
        Dispersion::Catalogue {
            formula: Formula::Sellmeier1,
            coefficients,
        } => {
            fields.push(("sellmeier", list(&coefficients[..6])));
        }
        Dispersion::Catalogue {
            formula,
            coefficients,
        } => {
            fields.push(("formula", (*formula as u32).to_string()));
            fields.push(("coefficients", list(coefficients)));
        }
    }
    fields
}

fn iris_value(iris: &Iris) -> Option<String> {
    match iris {
        Iris::Round => None,
        Iris::Blades { count, rotation } => Some(object(&[
            ("blades", count.to_string()),
            ("rotation_deg", number(rotation.to_degrees())),
        ])),
        Iris::Outline { corners, rotation } => {
            let corners: Vec<String> = corners.iter().map(|c| list(c)).collect();
            Some(object(&[
                ("outline", format!("[{}]", corners.join(", "))),
                ("rotation_deg", number(rotation.to_degrees())),
            ]))
        }
    }
}

fn zoom_value(lens: &Prescription) -> String {
    let positions = lens.zoom.iter().map(|position| {
        let gaps: Vec<String> = position
            .gaps
            .iter()
            .map(|(i, gap)| format!("\"{i}\": {}", number(*gap)))
            .collect();
        let mut fields = vec![
            ("name", quoted(&position.name)),
            ("gaps", format!("{{{}}}", gaps.join(", "))),
        ];
        if let Some(radius) = position.stop_semi_diameter {
            fields.push(("stop", number(radius)));
        }
        object(&fields)
    });
    format!("[{}]", positions.collect::<Vec<_>>().join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lens::{Lens, LensRay, Toward, shipped_names};
    use crate::prescription::glass::medium::{C_LINE, D_LINE, F_LINE};
    use crate::prescription::prescription::ZoomPosition;
    use glam::DVec3;
    use ivcam_base::diag::{Sink, Source};
    use std::sync::Arc;

    fn again(lens: &Prescription, target: OutputFormat) -> Prescription {
        let (text, _) = write(lens, target).unwrap();
        let name = format!("{}.x", lens.name);
        let source = Arc::new(Source::new(name, text.clone().into_bytes()));
        let read = crate::prescription::formats::read(&source, &mut Sink::new());
        read.unwrap_or_else(|e| panic!("{e}\n{text}"))
    }

    fn shipped() -> impl Iterator<Item = Prescription> {
        shipped_names().map(|name| Lens::named(name).unwrap().prescription().clone())
    }

    /// Whether two prescriptions have the same focal length and the same path of a ray that passes
    /// neither through the axis nor in a plane with it, up to the rounding of radii that are
    /// written as curvatures.
    fn same_rays(a: &Prescription, b: &Prescription) -> bool {
        let [a, b] = [a, b].map(|lens| Lens::new(lens.clone()));
        let front = a.prescription().surfaces[0].semi_diameter.min(50.0);
        let ray = LensRay::new(
            DVec3::new(0.1 * front, 0.2 * front, -front),
            DVec3::new(-0.02, 0.03, 1.0),
        );
        let path = |lens: &Lens| lens.trace_path(&ray, Toward::Film, false).hits;
        let near = |(p, q): (&DVec3, &DVec3)| (*p - *q).length() < 1e-11 * front;
        let efl = a.first_order().efl() / b.first_order().efl();
        let (a, b) = (path(&a), path(&b));
        (efl - 1.0).abs() < 1e-13 && a.len() == b.len() && a.iter().zip(&b).all(near)
    }

    /// Places in the file are not part of a lens.
    fn bare(mut lens: Prescription) -> Prescription {
        for surface in &mut lens.surfaces {
            surface.span = Default::default();
        }
        lens
    }

    #[test]
    fn a_lens_written_as_json_reads_back_the_same_to_the_last_bit() {
        for lens in shipped() {
            let lens = bare(lens);
            assert_eq!(
                bare(again(&lens, OutputFormat::Json)).surfaces,
                lens.surfaces,
                "{}",
                lens.name
            );
            let read = bare(again(&lens, OutputFormat::Json));
            assert!(same_rays(&read, &lens), "{}", lens.name);
            assert_eq!(
                (&read.zoom, read.focus_group),
                (&lens.zoom, lens.focus_group)
            );
            assert_eq!(About::of(&read), About::of(&lens));
        }
        let mut lens = shipped().next().unwrap();
        lens.iris = Iris::Blades {
            count: 7,
            rotation: 0.25,
        };
        lens.surfaces[0].medium = Medium::from_lines(1.53, 1.52, 1.51);
        lens.surfaces[2].curvature = Curvature::from_curvature(0.1 / 3.0);
        let table = [(400.0, 1.53), (D_LINE, 1.52), (700.0, 1.515), (1550.0, 1.5)];
        lens.surfaces[1].medium = Medium::from_table(1.52, table);
        let schott = [2.27, -0.01, 0.01, 2e-4, -1e-5, 1e-6, 0.0, 0.0, 0.0, 0.0];
        let schott = Medium::from_formula(Formula::Schott, schott).unwrap();
        lens.surfaces[3].medium = schott.named("X");
        let read = bare(again(&lens, OutputFormat::Json));
        assert_eq!(read.surfaces, bare(lens.clone()).surfaces);
        assert!(matches!(read.iris, Iris::Blades { count: 7, .. }));
    }

    #[test]
    fn notes_are_those_of_the_lens_as_it_is_written() {
        let text = "# units: in\n# focal length: 2500 mm\n# f-number: 5\n# image height: 2\n\
                    # nominal: 2500 mm\n100 5 1.5 20\n-100 5 1 20\n0 90 0 19\n";
        let source = Arc::new(Source::new("a.dat", text.as_bytes().to_vec()));
        let read = crate::prescription::formats::read(&source, &mut Sink::new()).unwrap();
        let efl = |lens: &Prescription| lens.first_order(D_LINE).efl();
        for lens in [read.clone(), read.scaled(0.1)] {
            for target in [
                OutputFormat::Columns,
                OutputFormat::Zemax,
                OutputFormat::Json,
            ] {
                let written = again(&again(&lens, target), OutputFormat::Columns);
                assert!((efl(&written) / efl(&lens) - 1.0).abs() < 1e-12);
                let [height, own] = [&written, &lens].map(|l| About::of(l).image_height.unwrap());
                assert!((height / own - 1.0).abs() < 1e-12, "{height} {own}");
            }
        }
    }

    #[test]
    fn four_columns_read_back_the_same_where_they_can_say_it() {
        let mut written = 0;
        for lens in shipped() {
            let Ok((_, left_out)) = write(&lens, OutputFormat::Columns) else {
                continue;
            };
            assert_eq!(
                lens.is_dispersive(),
                left_out.iter().any(|l| l.contains("dispersion"))
            );
            let read = again(&lens, OutputFormat::Columns);
            for (a, b) in read.surfaces.iter().zip(&lens.surfaces) {
                assert_eq!((a.curvature, a.thickness), (b.curvature, b.thickness));
                assert_eq!((a.semi_diameter, a.is_stop), (b.semi_diameter, b.is_stop));
                assert_eq!(a.medium.n_d, b.medium.n_d);
            }
            written += 1;
        }
        assert!(written > 25, "{written}");
        let phone = Lens::named("phone").unwrap();
        let error = write(phone.prescription(), OutputFormat::Columns).unwrap_err();
        assert!(error.message.contains("is not a sphere"));
    }

    #[test]
    fn zemax_files_read_back_as_the_same_optics() {
        for lens in shipped() {
            let read = again(&lens, OutputFormat::Zemax);
            assert!(same_rays(&read, &lens), "{}", lens.name);
            assert_eq!(read.surfaces.len(), lens.surfaces.len(), "{}", lens.name);
            assert_eq!(read.stop(), lens.stop());
            for (a, b) in read.surfaces.iter().zip(&lens.surfaces) {
                assert_eq!(a.curvature.per_mm(), b.curvature.per_mm());
                assert_eq!(
                    (a.thickness, a.semi_diameter),
                    (b.thickness, b.semi_diameter)
                );
                assert_eq!(a.shape, b.shape, "{}", lens.name);
                for line in [F_LINE, D_LINE, C_LINE] {
                    let (a, b) = (a.medium.index(line), b.medium.index(line));
                    assert!((a - b).abs() < 1e-12, "{}: {a} {b}", lens.name);
                }
            }
            let gaps = |lens: &Prescription| -> Vec<_> {
                lens.zoom
                    .iter()
                    .map(|z| (z.gaps.clone(), z.stop_semi_diameter))
                    .collect()
            };
            assert_eq!(gaps(&read), gaps(&lens));
        }
    }

    #[test]
    fn code_v_files_read_back_as_the_same_optics() {
        let mut written = 0;
        for lens in shipped() {
            let Ok((_, left_out)) = write(&lens, OutputFormat::CodeV) else {
                continue;
            };
            written += 1;
            let read = again(&lens, OutputFormat::CodeV);
            assert!(same_rays(&read, &lens), "{}", lens.name);
            assert_eq!(read.surfaces.len(), lens.surfaces.len(), "{}", lens.name);
            assert_eq!(read.stop(), lens.stop());
            for (a, b) in read.surfaces.iter().zip(&lens.surfaces) {
                assert_eq!(a.curvature, b.curvature, "{}", lens.name);
                assert_eq!(a.thickness, b.thickness);
                assert_eq!(a.shape, b.shape, "{}", lens.name);
                assert_eq!(a.semi_diameter, b.semi_diameter, "{left_out:?}");
                for line in [F_LINE, D_LINE, C_LINE] {
                    let (a, b) = (a.medium.index(line), b.medium.index(line));
                    assert!((a - b).abs() < 1e-12, "{}: {a} {b}", lens.name);
                }
            }
            let gaps = |lens: &Prescription| -> Vec<_> {
                let all = lens.zoom.iter().map(|z| z.gaps.clone());
                all.collect()
            };
            assert_eq!(gaps(&read), gaps(&lens));
        }
        assert!(written > 33, "{written}");
        let mut lens = shipped().next().unwrap();
        lens.surfaces[0].shape = Shape::Asphere {
            k: 0.0,
            terms: Box::new(std::array::from_fn(|p| if p == 5 { 1e-6 } else { 0.0 })),
        };
        let error = write(&lens, OutputFormat::CodeV).unwrap_err();
        assert!(error.message.contains("odd power"), "{error}");
    }

    /// A zoom lens whose positions state only what they change.
    fn zoom_lens() -> Prescription {
        let mut lens = Prescription::new(
            "a",
            vec![
                Surface::sphere(30.0, 5.0, Medium::constant(1.6), 8.0),
                Surface::sphere(-300.0, 5.0, Medium::air(), 8.0),
                Surface::stop(3.0, Medium::air(), 5.0),
                Surface::sphere(-65.0, 2.0, Medium::constant(1.5), 8.0),
                Surface::sphere(155.0, 20.0, Medium::air(), 8.0),
            ],
        );
        let position = |gap, stop| ZoomPosition {
            name: String::new(),
            gaps: vec![gap],
            stop_semi_diameter: stop,
        };
        lens.zoom = vec![
            position((1, 6.0), Some(3.0)),
            position((1, 8.0), None),
            position((2, 8.0), Some(4.0)),
        ];
        lens
    }

    const WITH_ZOOM: [OutputFormat; 3] =
        [OutputFormat::Json, OutputFormat::Zemax, OutputFormat::CodeV];

    /// The gaps and the radius of the stop at a zoom position.
    fn setting(lens: &Prescription, position: usize) -> (Vec<f64>, f64) {
        let lens = lens.at_zoom(position).unwrap();
        let gaps = lens.surfaces.iter().map(|s| s.thickness).collect();
        (gaps, lens.surfaces[lens.stop().unwrap()].semi_diameter)
    }

    #[test]
    fn a_zoom_lens_written_at_one_position_is_the_same_at_every_other() {
        let lens = zoom_lens();
        for (target, current) in WITH_ZOOM.into_iter().flat_map(|t| [(t, 0), (t, 1), (t, 2)]) {
            let chosen = lens.at_zoom(current).unwrap();
            let read = again(&chosen, target);
            for position in 0..3 {
                let wanted = setting(&lens, position);
                assert_eq!(setting(&read, position), wanted, "{target:?} {position}");
            }
        }
        let chosen = lens.at_zoom(1).unwrap();
        let (text, _) = write(&chosen, OutputFormat::Zemax).unwrap();
        assert!(text.contains("MNUM 3 2\n"), "{text}");
    }

    #[test]
    fn a_zoom_lens_that_is_stopped_down_is_written_with_the_closed_stop() {
        let lens = zoom_lens().at_zoom(1).unwrap();
        let closed = lens.with_stop(ivcam_base::math::Mm(1.25), D_LINE).unwrap();
        for target in WITH_ZOOM {
            let read = again(&closed, target);
            let radii = [0, 1, 2].map(|position| setting(&read, position).1);
            assert_eq!(radii, [1.25; 3], "{target:?}");
        }
    }

    /// A lens of three surfaces, the second of them shifted and turned.
    fn decentered(shift: DVec3, tilt: DVec3) -> Prescription {
        let mut lens = Prescription::new(
            "a",
            vec![
                Surface::stop(8.0, Medium::air(), 5.0),
                Surface::sphere(50.0, 3.0, Medium::constant(1.6), 8.0),
                Surface::sphere(-25.0, 15.0, Medium::air(), 8.0),
            ],
        );
        let frame =
            crate::prescription::decenter::SurfaceFrame::returning(Decenter { shift, tilt });
        lens.surfaces[1].frame = frame.boxed();
        lens
    }

    #[test]
    fn a_shift_along_the_axis_is_a_part_of_the_gaps() {
        let shifted = decentered(DVec3::new(0.0, 0.0, 1.5), DVec3::ZERO);
        let mut wanted = decentered(DVec3::ZERO, DVec3::ZERO);
        wanted.surfaces[0].thickness = 9.5;
        wanted.surfaces[1].thickness = 1.5;
        let read = bare(again(&shifted, OutputFormat::Json));
        assert_eq!(read.surfaces, wanted.surfaces);
        assert_eq!(read.first_order(D_LINE), wanted.first_order(D_LINE));
        // That of the first surface moves the lens to the origin, and one of the last has no gap
        // to be a part of.
        for surface in [0, 2] {
            let mut shifted = wanted.clone();
            shifted.surfaces[surface].frame = decentered(1.5 * DVec3::Z, DVec3::ZERO).surfaces[1]
                .frame
                .clone();
            shifted.surfaces[2].thickness = 0.0;
            let mut wanted = shifted.clone();
            wanted.surfaces[surface].frame = None;
            match surface {
                0 => wanted.surfaces[0].thickness -= 1.5,
                _ => wanted.surfaces[1].thickness += 1.5,
            }
            let read = bare(again(&shifted, OutputFormat::Json));
            assert_eq!(read.surfaces, wanted.surfaces);
        }
    }

    /// The shift behind a surface that returns to the axis has a part along it.
    #[test]
    fn a_shifted_and_tilted_surface_reads_back_with_the_same_focal_length_and_rays() {
        for shift in [DVec3::new(0.0, 1.0, 0.0), DVec3::new(0.4, -1.0, 0.8)] {
            let lens = decentered(shift, DVec3::new(6.0, -3.0, 0.0));
            let lens = again(&lens, OutputFormat::Json);
            let mut plain = decentered(DVec3::ZERO, DVec3::ZERO);
            plain.surfaces[0].thickness += shift.z;
            plain.surfaces[1].thickness -= shift.z;
            let efl = lens.first_order(D_LINE).efl() / plain.first_order(D_LINE).efl();
            assert!((efl - 1.0).abs() < 1e-13, "{efl}");
            for target in WITH_ZOOM {
                let read = again(&lens, target);
                let efl = read.first_order(D_LINE).efl() / lens.first_order(D_LINE).efl();
                assert!((efl - 1.0).abs() < 1e-13, "{target:?} {efl}");
                let ray = LensRay::new(DVec3::new(1.0, 2.0, -10.0), DVec3::Z);
                let [a, b] = [&lens, &read].map(|lens| {
                    let path = Lens::new(lens.clone()).trace_path(&ray, Toward::Film, false);
                    *path.hits.last().unwrap()
                });
                assert!((a - b).length() < 1e-11, "{target:?}: {a} {b}");
            }
        }
    }

    /// The stop of 5 mm is 40 mm unfolded behind a lens of f = 52: its image is 25.8 mm wide.
    #[test]
    fn the_entrance_pupil_in_a_file_of_code_v_is_that_of_the_light_behind_a_mirror() {
        let mut mirror = Surface::sphere(0.0, 20.0, Medium::air(), 15.0);
        mirror.is_mirror = true;
        let lens = Prescription::new(
            "a",
            vec![
                Surface::sphere(50.0, 5.0, Medium::from_abbe(1.6, 50.0), 10.0),
                Surface::sphere(-80.0, 20.0, Medium::air(), 10.0),
                mirror,
                Surface::stop(5.0, Medium::air(), 5.0),
            ],
        );
        let (text, _) = write(&lens, OutputFormat::CodeV).unwrap();
        let line = text.lines().find_map(|line| line.strip_prefix("EPD "));
        let pupil = lens.first_order(D_LINE).entrance_pupil.unwrap();
        let off = line.unwrap().parse::<f64>().unwrap() / (2.0 * pupil.semi_diameter) - 1.0;
        assert!(off.abs() < 1e-11, "{text}");
        let thin = 5.0 / (1.0 - 40.0 / 52.0);
        assert!((pupil.semi_diameter / thin - 1.0).abs() < 0.2, "{pupil:?}");
    }

    /// The plane that a file of CODE V has for the axis behind a decenter is no aperture: the beam
    /// of a decentered lens is not where first-order optics has it.
    #[test]
    fn light_passes_the_planes_of_a_decentered_axis_in_a_file_of_code_v() {
        let mut lens = Prescription::new(
            "a",
            vec![
                Surface::stop(5.0, Medium::air(), 4.0),
                Surface::sphere(100.0, 4.0, Medium::constant(1.5), 20.0),
                Surface::sphere(-100.0, 90.0, Medium::air(), 20.0),
            ],
        );
        lens.surfaces[2].frame = crate::prescription::decenter::SurfaceFrame {
            before: Decenter::NONE,
            after: Decenter {
                shift: DVec3::new(0.0, 20.0, 0.0),
                ..Decenter::NONE
            },
        }
        .boxed();
        let ray = LensRay::new(DVec3::new(0.0, 0.0, -10.0), DVec3::Z);
        for lens in [lens.clone(), again(&lens, OutputFormat::CodeV)] {
            let path = Lens::new(lens).trace_path(&ray, Toward::Film, true);
            assert!(path.outcome.is_ok(), "{:?}", path.outcome);
        }
    }

    #[test]
    fn a_name_without_a_known_ending_is_refused() {
        assert_eq!(
            OutputFormat::of(Path::new("a.ZMX")).unwrap(),
            OutputFormat::Zemax
        );
        assert_eq!(
            OutputFormat::of(Path::new("a.seq")).unwrap(),
            OutputFormat::CodeV
        );
        assert!(
            OutputFormat::of(Path::new("a.len"))
                .unwrap_err()
                .message
                .contains("no format")
        );
    }

    /// Germanium is opaque in the visible; its indices are those of Burnett (2016).
    #[test]
    fn a_lens_for_the_infrared_has_its_indices_there_in_code_v() {
        let text = r#"{"schema": "ivlens-1", "wavelengths_nm": [10000, 8000, 12000], "surfaces": [
            {"R": 100, "t": 5, "glass": "GERMANIUM", "semi_diameter": 20, "stop": true},
            {"R": 150, "t": 100, "n_d": 1, "semi_diameter": 20}]}"#;
        let source = Arc::new(Source::new("ge.json", text.as_bytes().to_vec()));
        let lens = crate::prescription::formats::read(&source, &mut Sink::new()).unwrap();
        let (written, _) = write(&lens, OutputFormat::CodeV).unwrap();
        assert!(written.contains("PWL 12000 10000 8000 4000\n"), "{written}");
        let read = again(&lens, OutputFormat::CodeV);
        assert!((read.surfaces[0].medium.index(10_000.0) - 4.0042).abs() < 5e-4);
        for nm in [8000.0, D_LINE, 12_000.0] {
            let [own, other] = [&lens, &read].map(|lens| lens.first_order(nm).efl());
            assert!((own / other - 1.0).abs() < 1e-13, "{nm} nm: {own} {other}");
        }
    }

    /// A glass by Schott's formula at a wavelength that is none of the lines of tables.
    #[test]
    fn a_lens_at_its_own_wavelength_has_that_index_in_code_v() {
        let text = "{\"schema\": \"ivlens-1\", \"wavelengths_nm\": [900], \"surfaces\": [\
            {\"R\": 50, \"t\": 5, \"glass\": \"N-SF6\", \"semi_diameter\": 9, \"stop\": true},\
            {\"R\": 0, \"t\": 90, \"n_d\": 1, \"semi_diameter\": 9}]}";
        let source = Arc::new(Source::new("a.json", text.as_bytes().to_vec()));
        let lens = crate::prescription::formats::read(&source, &mut Sink::new()).unwrap();
        let read = again(&lens, OutputFormat::CodeV);
        let [own, other] = [&lens, &read].map(|lens| lens.surfaces[0].medium.index(900.0));
        assert_eq!(own, other);
    }

    #[test]
    fn a_stop_that_is_a_rectangle_is_one_again_in_zemax_and_code_v() {
        let text = "{\"schema\": \"ivlens-1\", \"surfaces\": [\
            {\"R\": 50, \"t\": 5, \"n_d\": 1.6, \"semi_diameter\": 9},\
            {\"kind\": \"stop\", \"t\": 5, \"n_d\": 1, \"outline\": [[3,2],[-3,2],[-3,-2],[3,-2]]}]}";
        let source = Arc::new(Source::new("a.json", text.as_bytes().to_vec()));
        let lens = crate::prescription::formats::read(&source, &mut Sink::new()).unwrap();
        for (target, says) in [
            (OutputFormat::Zemax, "SQAP 3 2 0"),
            (OutputFormat::CodeV, "REX 3; REY 2"),
        ] {
            let (text, left_out) = write(&lens, target).unwrap();
            assert!(text.contains(says), "{text}");
            assert!(
                !left_out.iter().any(|what| what.contains("iris")),
                "{left_out:?}"
            );
            let Iris::Outline { corners, .. } = again(&lens, target).iris else {
                panic!("the iris is round: {text}");
            };
            let half = 2.0 / f64::hypot(3.0, 2.0);
            assert!(corners.iter().all(|[_, y]| (y.abs() - half).abs() < 1e-11));
        }
    }
}
