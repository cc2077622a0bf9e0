//! The data of a lens as text: first-order data, surfaces, curves and aberrations.

use ivcam_base::diag::Result;
use ivcam_optics::lens::{Aberrations, About, Coating, Focus, Lens, LensSheet, Shape};

use super::lens_json::HALF_HEIGHT;
use super::lens_request::{Content, LensRequest};

/// The widths of the table of surfaces.
const SURFACE: [usize; 6] = [3, 12, 10, 9, 6, 10];
/// The widths of the table over the image height.
const CURVE: [usize; 9] = [10, 7, 11, 8, 8, 10, 10, 9, 9];
/// The widths of the table of points: height, spot, beam, and a modulation for each frequency.
const POINT: [usize; 4] = [10, 9, 7, 11];
/// The widths of the table of breathing.
const BREATHING: [usize; 6] = [12, 13, 8, 9, 9, 8];
/// The widths of the table of aberrations.
const ABERRATION: [usize; 4] = [10, 9, 11, 11];

/// Text that grows by lines.
#[derive(Default)]
struct Page(String);

impl Page {
    fn line(&mut self, text: impl AsRef<str>) {
        self.0 += text.as_ref();
        self.0.push('\n');
    }

    /// Adds the heads of a table, which are separated by `|`.
    fn heads(&mut self, widths: &[usize], heads: &str) {
        self.row(widths, heads.split('|'));
    }

    /// Adds a named number with the text behind it, which begins with its unit.
    fn number(&mut self, name: &str, value: f64, rest: &str) {
        self.line(format!("  {name:<22} {value:>12.4}{rest}"));
    }

    fn row<T: AsRef<str>>(&mut self, widths: &[usize], cells: impl IntoIterator<Item = T>) {
        self.line(row(widths, cells));
    }
}

/// Returns cells aligned to the right of their columns. Further columns are as wide as the last.
fn row<T: AsRef<str>>(widths: &[usize], cells: impl IntoIterator<Item = T>) -> String {
    let widths = widths.iter().chain(widths.last().into_iter().cycle());
    let cells = cells.into_iter().zip(widths);
    let cells = cells.map(|(cell, &width)| format!("{:>width$}", cell.as_ref()));
    cells.collect::<Vec<_>>().join(" ")
}

/// Returns a number with decimal places, or a dash if there is none.
fn cell(value: impl Into<Option<f64>>, places: usize) -> String {
    let value = value.into();
    value.map_or("-".into(), |value| format!("{value:.places$}"))
}

/// Returns all data of the lens as text.
pub(super) fn text(request: &LensRequest<'_>) -> Result<Content> {
    let lens = &request.lens;
    let mut page = Page::default();
    heading(&mut page, lens);
    first_order(&mut page, lens);
    f_numbers(&mut page, lens);
    page.number("length", lens.length(), " mm");
    if !lens.prescription().is_dispersive() {
        page.line("  color                  none: the source gives indices at the d line alone");
    }
    if let Some(focus) = &request.focus {
        focus_data(&mut page, focus);
    }
    surfaces(&mut page, lens);
    if let Some((sheet, all)) = request.sheet() {
        conditions(&mut page, sheet);
        curves(&mut page, sheet);
        breathing(&mut page, sheet);
        points(&mut page, sheet);
        aberrations(&mut page, all);
    }
    page.line("");
    Ok(Content::Text(page.0))
}

/// Adds the names of the lens and what its file says of it.
fn heading(page: &mut Page, lens: &Lens) {
    let about = About::of(lens.prescription());
    let title = about.title.map(|title| format!("  {title}"));
    page.line(format!("{}{}", lens.name(), title.unwrap_or_default()));
    let facts = [about.kind, about.year, about.field, about.source];
    let facts: Vec<String> = facts.into_iter().flatten().collect();
    for note in std::iter::once(facts.join(" \u{b7} ")).chain(about.notes) {
        if !note.is_empty() {
            page.line(format!("  {note}"));
        }
    }
}

/// Adds focal lengths, principal planes and pupils.
fn first_order(page: &mut Page, lens: &Lens) {
    let optics = lens.first_order();
    if let Some(focal) = optics.focal {
        page.number("focal length", focal.efl, " mm");
        page.number("back focal length", focal.bfl, " mm");
        page.number("front focal length", focal.ffl, " mm");
        page.number("front principal plane", focal.front_principal_plane, " mm");
        page.number("rear principal plane", focal.rear_principal_plane, " mm");
    } else {
        page.line("  afocal: parallel light leaves parallel");
        let magnification = optics.matrix[3] * optics.n_object / optics.n_image;
        page.number("angular magnification", magnification, "");
    }
    let pupils = [
        ("entrance pupil", optics.entrance_pupil),
        ("exit pupil", optics.exit_pupil),
    ];
    for (name, pupil) in pupils {
        if let Some(p) = pupil {
            let size = format!(" mm  semi-diameter {:.4} mm", p.semi_diameter);
            page.number(name, p.z, &size);
        } else {
            page.line(format!("  {name:<22} at infinity"));
        }
    }
}

/// Adds the f-numbers and the T-numbers, with those of other coatings.
fn f_numbers(page: &mut Page, lens: &Lens) {
    let Some(f_number) = lens.real_f_number() else {
        return;
    };
    page.number("f-number, real rays", f_number, "");
    if let Some(f_number) = lens.first_order().f_number() {
        page.number("f-number, paraxial", f_number, "");
    }
    let Some(t) = lens.t_number() else {
        return;
    };
    // The coating makes no difference to the f-number.
    let percent = |t: f64| 100.0 * (f_number / t) * (f_number / t);
    let others = [Coating::MagnesiumFluoride, Coating::Bare].map(|coating| {
        let t = lens.with_coating(coating).t_number().unwrap_or(f64::NAN);
        let percent = percent(t);
        format!("{} {t:.2} ({percent:.1}%)", coating.name())
    });
    let others = others.join(", ");
    let percent = percent(t);
    let rest = format!("     {percent:.1}% gets through; coated {others}");
    page.number("T-number, real rays", t, &rest);
    if let Some(t) = lens.paraxial_t_number() {
        page.number("T-number, paraxial", t, "");
    }
}

fn focus_data(page: &mut Page, focus: &Focus) {
    let (distance, method) = (focus.distance / 1000.0, focus.method.name());
    page.line(format!("  focused at {distance} m ({method} moved)"));
    page.number("film at", focus.film_z, " mm");
    let magnification = focus.magnification;
    page.line(format!("  magnification          {magnification:>12.6}"));
    let angle = focus.height_angle(HALF_HEIGHT).to_degrees();
    page.number("height angle", angle, " degrees");
}

/// Adds the table of surfaces.
fn surfaces(page: &mut Page, lens: &Lens) {
    page.line("");
    page.heads(&SURFACE, "|radius|thickness|n_d|V_d|semi-diam.");
    for (i, s) in lens.prescription().folded().surfaces.iter().enumerate() {
        let radius = match (s.curvature.is_plane(), s.is_stop) {
            (true, true) => "stop".into(),
            (true, false) => "plane".into(),
            _ => cell(s.curvature.radius(), 4),
        };
        let n = Some(s.medium.n_d).filter(|n| *n != 1.0);
        let cells = [
            i.to_string(),
            radius,
            cell(s.thickness, 4),
            n.map_or(String::new(), |n| cell(n, 5)),
            s.medium.abbe().map_or(String::new(), |v| cell(v, 1)),
            cell(Some(s.semi_diameter).filter(|r| r.is_finite()), 3),
        ];
        let shape = match s.shape {
            Shape::Sphere => String::new(),
            Shape::ThinLens { focal_length } => {
                format!("ideal, f = {} mm ", cell(focal_length, 4).trim())
            }
            _ => format!("{} ", s.shape.name()),
        };
        let medium = match s.is_mirror {
            true => "mirror",
            false => &s.medium.name,
        };
        let outline = match &s.outline {
            Some(corners) => format!("  open within a polygon of {} corners", corners.len()),
            None => String::new(),
        };
        let closed = match s.obstruction > 0.0 {
            true => format!("  closed to {}", cell(s.obstruction, 3).trim()),
            false => String::new(),
        };
        let line = format!("{}  {shape}{medium}{closed}{outline}", row(&SURFACE, cells));
        page.line(line.trim_end());
        if let Some(frame) = &s.frame {
            page.line(format!("      {}", frame.description()));
        }
    }
    if lens.prescription().is_decentered() {
        page.line(
            "  the first-order data are those of the unfolded axis, along which thicknesses count;",
        );
        page.line("  the curves are those of points on the y axis of the film");
    }
}

/// Adds the object, the film and the reference of distortion.
fn conditions(page: &mut Page, sheet: &LensSheet) {
    let object = match sheet.object_distance {
        Some(mm) => format!("object {:.4} m from the front vertex", mm / 1000.0),
        None => "object at infinity".to_owned(),
    };
    let defocus = match sheet.defocus {
        0.0 => String::new(),
        mm => format!(", {mm:+.4} mm of it defocus"),
    };
    page.line(format!(
        "\n  {object}; film at {:.4} mm, {:+.4} mm from the paraxial image{defocus}",
        sheet.film_z, sheet.focus_shift
    ));
    if let Some(best) = sheet.best_film_z {
        let off = sheet.film_z - best;
        page.line(match off.abs() < 1e-9 {
            true => "  that is the least rms spot on the axis".to_owned(),
            false => format!(
                "  {off:+.4} mm from the least rms spot on the axis, which is at {best:.4} mm"
            ),
        });
    }
    let reference = sheet.distortion_reference();
    page.line(format!("  distortion in % of {reference}"));
}

/// Adds the curves as a table over the image height.
fn curves(page: &mut Page, sheet: &LensSheet) {
    // Wavelengths that are not lines have three or more digits and a unit.
    let [short, _, long] = sheet.line_names();
    let color = match short.len() == 1 && long.len() == 1 {
        true => [short, long].map(|name| format!("lateral {name}")),
        false => {
            page.heads(&CURVE, "|||||||lateral|lateral");
            [short, long]
        }
    };
    page.heads(
        &CURVE,
        &format!(
            "height|angle|distortion|light|at film|tangential|sagittal|{}|{}",
            color[0], color[1]
        ),
    );
    page.heads(&CURVE, "mm|deg|%||deg|mm|mm|\u{b5}m|\u{b5}m");
    for row in sheet.fields.iter().step_by(8) {
        let cells = [
            cell(row.height, 3),
            cell(row.angle_degrees, 2),
            cell(row.distortion_percent, 3),
            cell(row.relative_illumination, 3),
            cell(row.chief_ray_angle_degrees, 2),
            cell(row.tangential_focus, 3),
            cell(row.sagittal_focus, 3),
            cell(row.lateral_f.map(|v| 1000.0 * v), 2),
            cell(row.lateral_c.map(|v| 1000.0 * v), 2),
        ];
        page.row(&CURVE, cells);
    }
}

/// Adds the table of how the field changes with the distance in focus.
fn breathing(page: &mut Page, sheet: &LensSheet) {
    if sheet.breathing.is_empty() {
        return;
    }
    page.line("");
    page.heads(
        &BREATHING,
        "focused at|magnification|field|change|moved|f-number",
    );
    for row in &sheet.breathing {
        let meters = |mm: f64| format!("{:.3} m", (mm / 1000.0 * 1e3).round() / 1e3);
        let cells = [
            row.distance.map_or("infinity".into(), meters),
            cell(row.magnification, 4),
            cell(row.field_degrees, 2) + "\u{b0}",
            cell(row.field_change_percent, 2) + " %",
            cell(row.extension, 3) + " mm",
            cell(row.working_f_number, 2),
        ];
        page.row(&BREATHING, cells);
    }
}

/// Adds the spots and the modulation of points.
fn points(page: &mut Page, sheet: &LensSheet) {
    // Of the 41 frequencies of the default, four are printed; of a list that was asked for, all up
    // to eight.
    let shown: Vec<usize> = match sheet.frequencies.first() {
        Some(0.0) => (0..sheet.frequencies.len()).step_by(10).skip(1).collect(),
        _ => (0..sheet.frequencies.len().min(8)).collect(),
    };
    page.line("");
    let frequencies = shown.iter().map(|i| sheet.frequencies[*i]);
    let frequencies: String = frequencies.map(|f| format!("|{f} lp/mm")).collect();
    page.heads(&POINT, &format!("height|rms \u{b5}m|beam{frequencies}"));
    for point in &sheet.points {
        let places = [
            cell(point.height, 3),
            cell(1000.0 * point.rms, 2),
            cell(point.pupil_area, 3),
        ];
        let waves = &point.diffraction;
        let modulation =
            |i: &usize| format!("{:.2}/{:.2}", waves.tangential[*i], waves.sagittal[*i]);
        let modulations = shown.iter().map(modulation);
        page.row(&POINT, places.into_iter().chain(modulations));
    }
    page.line("  modulation tangential/sagittal, with the wave, in white light");
    let all = sheet.frequencies.len();
    if sheet.frequencies.first() != Some(&0.0) && shown.len() < all {
        let count = shown.len();
        page.line(format!(
            "  the first {count} of {all} frequencies; --csv FILE has all"
        ));
    }
}

/// Adds Strehl ratios, wavefront errors, the working f-number and Seidel sums.
fn aberrations(page: &mut Page, all: &Aberrations) {
    page.line("");
    page.heads(&ABERRATION, "height|Strehl|rms waves|P-V waves");
    for point in &all.points {
        let fit = point.wavefront.as_ref();
        let cells = [
            cell(point.height, 3),
            cell(point.strehl, 3),
            cell(fit.map(|w| w.rms), 3),
            cell(fit.map(|w| w.peak_to_valley), 3),
        ];
        page.row(&ABERRATION, cells);
    }
    if let Some(n) = all.working_f_number {
        let nm = all.wavelength_nm;
        page.line(format!(
            "  at {nm} nm; f-number of the cone on the film {n:.4}"
        ));
    }
    if let Some(seidel) = &all.seidel {
        let sums = seidel.sum.values().map(|v| format!("{:.4}", 1000.0 * v));
        let sums = sums.join(" ");
        page.line(format!(
            "  Seidel sums I to V, axial and lateral color, \u{b5}m: {sums}"
        ));
    }
}
