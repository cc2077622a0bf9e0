//! Writes prescriptions as CODE V's sequence files.
//!
//! Every glass with a dispersion curve is written as a private glass: a table of indices over
//! wavelengths, because names need a maker that prescriptions do not state.

use std::fmt::Write as _;

use glam::DVec2;
use ivcam_base::diag::Result;

use crate::prescription::about::About;
use crate::prescription::decenter::Decenter;
use crate::prescription::formats::write::{
    FieldEdge, IDEAL, NORMAL, abbe_number, beyond_surfaces, is_even, refuse, tidy, wavelengths,
};
use crate::prescription::glass::medium::{C_LINE, D_LINE, Dispersion, F_LINE, Medium};
use crate::prescription::prescription::{Prescription, StatedBeam, ZoomPosition};
use crate::prescription::surface::{Curvature, MAX_POWER, Shape, Surface};

const FORMAT: &str = "CODE V's file";

/// The wavelengths of private glasses in nanometers: r, C, d, e, F, g and h.
const LINES: [f64; 7] = [
    706.5188, C_LINE, D_LINE, 546.074, F_LINE, 435.8343, 404.6561,
];

/// A prescription as text, and what the format leaves out. `object` is the distance of the object
/// from the front vertex in millimeters; it may be infinite.
pub(super) fn code_v(lens: &Prescription, object: f64) -> Result<(String, Vec<String>)> {
    let about = About::of(lens);
    let mut text = String::from("RDM;LEN\n");
    let title = about.title.as_deref().unwrap_or(&lens.name);
    let _ = writeln!(text, "TITLE '{}'", title.replace(['\'', '"'], " "));
    for note in &lens.notes {
        let _ = writeln!(text, "! {note}");
    }
    text += "DIM M\n";
    let mut left_out = Vec::new();
    system_lines(&mut text, lens, &FieldEdge::of(&about, &mut left_out));
    let glasses = Glasses::of(lens);
    text += &glasses.text();
    let distance = if object.is_finite() { object } else { 1e13 };
    let _ = writeln!(
        text,
        "SO 0 {distance} {}",
        glasses.word(&lens.object_medium)
    );
    for (i, surface) in lens.surfaces.iter().enumerate() {
        surface_lines(&mut text, i, surface, &glasses)?;
        frame_lines(&mut text, surface, &glasses);
    }
    text += "SI 0 0\n";
    zoom_lines(&mut text, lens);
    text += "GO\n";
    left_out.extend(glasses.left_out());
    if lens.surfaces.iter().any(|s| !s.semi_diameter.is_finite()) {
        left_out.push("that some surfaces have no aperture".to_owned());
    }
    left_out.extend(beyond_surfaces(lens, true));
    Ok((text, left_out))
}

/// Writes the wavelengths, the beam and the fields.
fn system_lines(text: &mut String, lens: &Prescription, field: &FieldEdge) {
    let (mut waves, primary) = wavelengths(lens);
    waves.reverse();
    let words = |at: usize| {
        let words: Vec<String> = waves.iter().map(|wave| wave[at].to_string()).collect();
        words.join(" ")
    };
    let reference = waves.len() - primary;
    let _ = writeln!(text, "WL {}\nREF {reference}\nWTW {}", words(0), words(1));
    // The lens has the signs of files, and first-order optics those along the light.
    let optics = lens.folded().first_order(D_LINE);
    let _ = match (lens.stated_beam, optics.entrance_pupil) {
        (Some(StatedBeam::EntrancePupil(diameter)), _) => writeln!(text, "EPD {diameter}"),
        (Some(StatedBeam::FNumber(number)), _) => writeln!(text, "FNO {number}"),
        (None, Some(pupil)) => writeln!(text, "EPD {}", tidy(2.0 * pupil.semi_diameter)),
        (None, None) => Ok(()),
    };
    let kind = match field {
        FieldEdge::Angle(_) => "YAN",
        FieldEdge::Height(_) => "YRI",
    };
    let _ = writeln!(text, "{kind} {}", field.points().join(" "));
}

fn surface_lines(text: &mut String, i: usize, surface: &Surface, glasses: &Glasses) -> Result<()> {
    let bend = surface.curvature;
    // A cylinder with power in x is flat in y.
    let in_y = match surface.shape {
        Shape::CylinderY => Curvature::PLANE,
        _ => bend,
    };
    let is_radius = |c: Curvature| Curvature::from_radius(c.radius()) == c;
    let radius = if is_radius(in_y) { in_y.radius() } else { 0.0 };
    let glass = match surface.is_mirror {
        true => "REFL".to_owned(),
        false => glasses.word(&surface.medium),
    };
    let (_, gap) = surface.frame_and_gap();
    let _ = writeln!(text, "S {radius} {gap} {glass}");
    if !is_radius(in_y) {
        let _ = writeln!(text, "  CUY {}", in_y.per_mm());
    }
    let across = |c: Curvature| match is_radius(c) {
        true => format!("RDX {}", c.radius()),
        false => format!("CUX {}", c.per_mm()),
    };
    match &surface.shape {
        Shape::Sphere => {}
        Shape::Conic { k } => {
            let _ = writeln!(text, "  CON; K {k}");
        }
        Shape::Asphere { k, terms } => {
            if !is_even(terms, MAX_POWER) || terms[0] != 0.0 || terms[2] != 0.0 {
                let what = "has a term of the second or an odd power";
                return Err(refuse(i, what, FORMAT));
            }
            let _ = write!(text, "  ASP; K {k}");
            for (j, name) in "ABCDEFGHJ".chars().enumerate() {
                if terms[4 + 2 * j] != 0.0 {
                    let _ = write!(text, "; {name} {}", terms[4 + 2 * j]);
                }
            }
            text.push('\n');
        }
        Shape::NormalAsphere { .. } => return Err(refuse(i, NORMAL, FORMAT)),
        Shape::ThinLens { .. } => return Err(refuse(i, IDEAL, FORMAT)),
        Shape::CylinderX => *text += "  CYL\n",
        Shape::CylinderY => {
            let _ = writeln!(text, "  CYL; {}", across(bend));
        }
        Shape::Toroid { k, terms, .. } if *k != 0.0 || terms.iter().any(|t| *t != 0.0) => {
            return Err(refuse(i, "is a toroid with an aspheric profile", FORMAT));
        }
        Shape::Toroid { across: x, .. } => {
            let _ = writeln!(text, "  CYL; {}", across(*x));
        }
    }
    if surface.is_stop {
        *text += "  STO\n";
    }
    aperture_lines(text, surface);
    Ok(())
}

/// Writes the apertures of a surface.
fn aperture_lines(text: &mut String, surface: &Surface) {
    // ADX and ADY would move a circle too. One that only goes around a rectangle limits nothing.
    let rectangle = surface.rectangle();
    let limits = surface.semi_diameter < surface.reach() * (1.0 - 1e-9);
    if surface.semi_diameter.is_finite() && (rectangle.is_none() || limits) {
        let _ = writeln!(text, "  CIR {}", surface.semi_diameter);
    }
    if let Some([half, center]) = rectangle {
        let _ = writeln!(text, "  REX {}; REY {}", half.x, half.y);
        if center != DVec2::ZERO {
            let _ = writeln!(text, "  ADX {}; ADY {}", center.x, center.y);
        }
    }
    if surface.obstruction > 0.0 {
        let _ = writeln!(text, "  CIR OBS {}", surface.obstruction);
    }
}

/// Writes how a surface is decentered. The axis behind it is that of a plane.
fn frame_lines(text: &mut String, surface: &Surface, glasses: &Glasses) {
    let (frame, _) = surface.frame_and_gap();
    decenter_lines(text, &frame.before);
    if has_plane_behind(surface) {
        let medium = glasses.word(&surface.medium);
        let _ = writeln!(text, "S 0 {} {medium}", surface.thickness);
        match frame.after.shifts_across_axis_behind() {
            false => decenter_lines(text, &frame.after),
            true => {
                decenter_lines(text, &frame.after.inverse());
                *text += "  REV\n";
            }
        }
    }
}

/// Writes a decenter of a surface. Turns about x and y have the opposite sign.
fn decenter_lines(text: &mut String, decenter: &Decenter) {
    let Decenter { shift, tilt } = decenter;
    let [a, b] = [tilt.x, tilt.y].map(|v| if v == 0.0 { 0.0 } else { -v });
    let names = ["XDE", "YDE", "ZDE", "ADE", "BDE", "CDE"];
    let values = [shift.x, shift.y, shift.z, a, b, tilt.z];
    for (name, value) in names
        .into_iter()
        .zip(values)
        .filter(|(_, value)| *value != 0.0)
    {
        let _ = writeln!(text, "  {name} {value}");
    }
}

/// Whether a plane is written behind a surface, for the axis there.
fn has_plane_behind(surface: &Surface) -> bool {
    surface
        .frame
        .as_ref()
        .is_some_and(|frame| !frame.after.is_none())
}

/// The number in the file of a surface.
fn number_of(lens: &Prescription, surface: usize) -> usize {
    let planes = lens.surfaces[..surface]
        .iter()
        .filter(|s| has_plane_behind(s));
    surface + 1 + planes.count()
}

fn zoom_lines(text: &mut String, lens: &Prescription) {
    if lens.zoom.is_empty() {
        return;
    }
    let _ = writeln!(text, "ZOO {}", lens.zoom.len());
    let gaps = lens
        .zoom
        .iter()
        .flat_map(|z| z.gaps.iter().map(|(i, _)| *i));
    let mut changed: Vec<usize> = gaps.collect();
    changed.sort_unstable();
    changed.dedup();
    let words = |values: Vec<String>| values.join(" ");
    for surface in changed {
        let gap = |z: &ZoomPosition| {
            let found = z.gaps.iter().find(|(i, _)| *i == surface);
            found
                .map_or(lens.surfaces[surface].thickness, |(_, gap)| *gap)
                .to_string()
        };
        let values = words(lens.zoom.iter().map(gap).collect());
        let own = number_of(lens, surface) + usize::from(has_plane_behind(&lens.surfaces[surface]));
        let _ = writeln!(text, "ZOO THI S{own} {values}");
    }
    let Some(stop) = lens.stop() else { return };
    let own = Some(lens.surfaces[stop].semi_diameter).filter(|radius| radius.is_finite());
    let radius = |z: &ZoomPosition| Some(z.stop_semi_diameter.or(own)?.to_string());
    let radii: Option<Vec<String>> = lens.zoom.iter().map(radius).collect();
    let changes = lens.zoom.iter().any(|z| z.stop_semi_diameter.is_some());
    if let Some(radii) = radii.filter(|_| changes) {
        let _ = writeln!(text, "ZOO CIR S{} {}", number_of(lens, stop), words(radii));
    }
}

/// The glasses that are written as tables, with their names.
struct Glasses {
    private: Vec<(String, Medium)>,
    /// The wavelengths of the lens in nanometers.
    waves: Vec<f64>,
}

impl Glasses {
    fn of(lens: &Prescription) -> Self {
        let mut private: Vec<(String, Medium)> = Vec::new();
        let media = lens.surfaces.iter().map(|s| &s.medium);
        for medium in std::iter::once(&lens.object_medium).chain(media) {
            let known = private.iter().any(|(_, glass)| glass == medium);
            if known || *medium == Medium::air() || by_numbers(medium).is_some() {
                continue;
            }
            let name: String = medium
                .name
                .chars()
                .filter(char::is_ascii_alphanumeric)
                .collect();
            let name = name.to_ascii_uppercase();
            // A name of digits would be read as an index and an Abbe number.
            let is_taken = private.iter().any(|(other, _)| *other == name);
            let name = match is_taken || !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
                true => format!("GLASS{}", private.len() + 1),
                false => name,
            };
            private.push((name, medium.clone()));
        }
        let waves = wavelengths(lens).0.into_iter().map(|[nm, _]| nm).collect();
        Self { private, waves }
    }

    /// The wavelengths of a glass's table, the longest first.
    fn lines(&self, glass: &Medium) -> Vec<f64> {
        table_lines(glass, &self.waves)
    }

    /// What the tables leave out of curves.
    fn left_out(&self) -> impl Iterator<Item = String> {
        let is_curve = |glass: &Medium| {
            let dispersion = &glass.dispersion;
            matches!(
                dispersion,
                Dispersion::Catalogue { .. } | Dispersion::Scaled { .. }
            )
        };
        let curves = self
            .private
            .iter()
            .filter(move |(_, glass)| is_curve(glass));
        curves.map(|(name, glass)| {
            let count = self.lines(glass).len();
            format!("the curve of the glass {name} beyond {count} wavelengths")
        })
    }

    /// The section of private glasses.
    fn text(&self) -> String {
        if self.private.is_empty() {
            return String::new();
        }
        let mut text = String::from("PRV\n");
        for (name, glass) in &self.private {
            let lines = self.lines(glass);
            let words = |values: &mut dyn Iterator<Item = f64>| {
                let words: Vec<String> = values.map(|v| v.to_string()).collect();
                words.join(" ")
            };
            let wavelengths = words(&mut lines.iter().copied());
            let indices = words(&mut lines.iter().map(|nm| glass.index(*nm)));
            let _ = writeln!(text, "  PWL {wavelengths}\n  '{name}' {indices}");
        }
        text + "END\n"
    }

    /// The word for a medium behind a surface; empty for air.
    fn word(&self, medium: &Medium) -> String {
        if *medium == Medium::air() {
            return String::new();
        }
        let private = self.private.iter().find(|(_, glass)| glass == medium);
        match private {
            Some((name, _)) => name.clone(),
            None => by_numbers(medium).unwrap_or_default(),
        }
    }
}

/// The wavelengths of a table of a glass, the longest first. Those of a curve are the lens's own,
/// and the visible lines or the one in the infrared where the glass has its index.
pub(super) fn table_lines(glass: &Medium, waves: &[f64]) -> Vec<f64> {
    let nominal = glass.nominal_nm();
    let usual = match nominal == D_LINE {
        true => LINES.to_vec(),
        false => vec![nominal],
    };
    let mut lines = match &glass.dispersion {
        Dispersion::None => vec![D_LINE],
        Dispersion::ThreeLines { .. } => vec![C_LINE, D_LINE, F_LINE],
        Dispersion::Table { lines } => lines.iter().map(|(nm, _)| *nm).collect(),
        _ => [&usual[..], waves].concat(),
    };
    lines.sort_by(|a, b| b.total_cmp(a));
    lines.dedup();
    lines
}

/// `1.5168:64.17`, for a glass of which index and Abbe number are all that is known.
fn by_numbers(medium: &Medium) -> Option<String> {
    let abbe = abbe_number(medium)?;
    let fits = (1.0..5.0).contains(&medium.n_d) && (1.0..1000.0).contains(&abbe);
    let is_cauchy = matches!(medium.dispersion, Dispersion::Cauchy { .. });
    (fits && is_cauchy).then(|| format!("{}:{abbe}", medium.n_d))
}
