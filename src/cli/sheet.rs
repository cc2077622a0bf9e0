//! The output of `ivcam lens` other than the first-order data: the list of lenses, surfaces,
//! curves, drawings, data sheets and prescriptions.

use std::io::Write;
use std::path::Path;

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::write_whole;
use ivcam_optics::diagram::drawing::Drawing;
use ivcam_optics::diagram::{LensDiagram, SectionOptions, html_page, point_spreads, svg_page};
use ivcam_optics::lens::analysis::aberrations::report::Aberrations;
use ivcam_optics::lens::{
    About, Lens, LensSheet, Prescription, Shape, SheetSetting, shipped_names,
};
use ivcam_optics::picture::{Depth, PictureFormat};
use ivcam_optics::prescription::formats::write::{Target, write};
use serde::Serialize;

/// A line of the list of lenses.
#[derive(Serialize)]
struct Listed {
    name: String,
    title: Option<String>,
    kind: Option<String>,
    year: Option<String>,
    field: Option<String>,
    efl: f64,
    f_number: Option<f64>,
    source: Option<String>,
}

/// Lists the shipped lenses, by kind.
pub(crate) fn list(json: bool, out: &mut dyn Write) -> Result<i32> {
    let mut lenses = Vec::new();
    for name in shipped_names() {
        let lens = Lens::named(name)?;
        let about = About::of(lens.prescription());
        lenses.push(Listed {
            name: name.to_owned(),
            title: about.title,
            kind: about.kind,
            year: about.year,
            field: about.field,
            efl: lens.first_order().efl(),
            f_number: lens.real_f_number(),
            source: about.source,
        });
    }
    let result = if json {
        serde_json::to_writer_pretty(&mut *out, &lenses)
            .map_err(std::io::Error::from)
            .and_then(|()| writeln!(out))
    } else {
        list_text(&lenses, out)
    };
    super::exit_code(result)
}

fn list_text(lenses: &[Listed], out: &mut dyn Write) -> std::io::Result<()> {
    let mut kind = None;
    for lens in lenses {
        if kind != Some(&lens.kind) {
            let gap = if kind.is_some() { "\n" } else { "" };
            writeln!(out, "{gap}{}", lens.kind.as_deref().unwrap_or("other"))?;
            kind = Some(&lens.kind);
        }
        let or_dash = |text: &Option<String>| text.clone().unwrap_or_else(|| "-".into());
        let f_number = lens.f_number.map_or("-".into(), |n| {
            let digits = if n < 1.0 { 2 } else { 1 };
            format!("f/{n:.digits$}")
        });
        let field = or_dash(&lens.field).replace(" degrees", "\u{b0}");
        writeln!(
            out,
            "  {:<19} {:>6.1} mm  {f_number:<6} {field:<12} {:<4}  {} \u{b7} {}",
            lens.name,
            lens.efl,
            or_dash(&lens.year),
            or_dash(&lens.title),
            or_dash(&lens.source)
        )?;
    }
    Ok(())
}

/// The description of a lens in its file, for JSON.
#[derive(Serialize)]
pub(crate) struct AboutRow {
    title: Option<String>,
    kind: Option<String>,
    year: Option<String>,
    field: Option<String>,
    source: Option<String>,
    notes: Vec<String>,
}

impl AboutRow {
    pub(crate) fn of(lens: &Prescription) -> Self {
        let about = About::of(lens);
        Self {
            title: about.title,
            kind: about.kind,
            year: about.year,
            field: about.field,
            source: about.source,
            notes: about.notes,
        }
    }
}

/// A surface, for JSON. A plane has radius 0. A surface without an aperture has no semi-diameter.
#[derive(Serialize)]
pub(crate) struct SurfaceRow {
    kind: &'static str,
    radius: f64,
    thickness: f64,
    n_d: f64,
    #[serde(rename = "V_d")]
    abbe: Option<f64>,
    glass: Option<String>,
    semi_diameter: Option<f64>,
    stop: bool,
    coating: &'static str,
}

impl SurfaceRow {
    pub(crate) fn all(lens: &Prescription) -> Vec<Self> {
        let row = |s: &ivcam_optics::lens::Surface| Self {
            kind: s.shape.name(),
            radius: s.curvature.radius(),
            thickness: s.thickness,
            n_d: s.medium.n_d,
            abbe: s.medium.abbe(),
            glass: Some(s.medium.name.clone()).filter(|n| !n.is_empty()),
            semi_diameter: Some(s.semi_diameter).filter(|r| r.is_finite()),
            stop: s.is_stop,
            coating: s.coating.name(),
        };
        lens.surfaces.iter().map(row).collect()
    }
}

/// Prints the table of surfaces.
pub(crate) fn surfaces(lens: &Lens, out: &mut dyn Write) -> std::io::Result<()> {
    writeln!(
        out,
        "\n    {:>12} {:>10} {:>9} {:>6} {:>10}",
        "radius", "thickness", "n_d", "V_d", "semi-diam."
    )?;
    for (i, s) in lens.prescription().surfaces.iter().enumerate() {
        let radius = match (s.curvature.is_plane(), s.is_stop) {
            (true, true) => "stop".into(),
            (true, false) => "plane".into(),
            _ => format!("{:.4}", s.curvature.radius()),
        };
        let n = if s.medium.n_d == 1.0 {
            String::new()
        } else {
            format!("{:.5}", s.medium.n_d)
        };
        let v = s.medium.abbe().map_or(String::new(), |v| format!("{v:.1}"));
        let mut rest = s.medium.name.clone();
        if !matches!(s.shape, Shape::Sphere) {
            rest = format!("{} {rest}", s.shape.name());
        }
        let semi_diameter = match s.semi_diameter.is_finite() {
            true => format!("{:.3}", s.semi_diameter),
            false => "-".into(),
        };
        let line = format!(
            "{i:>3} {radius:>12} {:>10.4} {n:>9} {v:>6} {semi_diameter:>10}  {rest}",
            s.thickness
        );
        writeln!(out, "{}", line.trim_end())?;
    }
    Ok(())
}

/// Prints the object, the film and the reference of distortion.
fn conditions(sheet: &LensSheet, out: &mut dyn Write) -> std::io::Result<()> {
    let object = match sheet.object_distance {
        Some(mm) => format!("object {:.4} m from the front vertex", mm / 1000.0),
        None => "object at infinity".to_owned(),
    };
    let defocus = match sheet.defocus {
        0.0 => String::new(),
        mm => format!(", {mm:+.4} mm of it defocus"),
    };
    writeln!(
        out,
        "\n  {object}; film at {:.4} mm, {:+.4} mm from the paraxial image{defocus}",
        sheet.film_z, sheet.focus_shift
    )?;
    if let Some(best) = sheet.best_film_z {
        let off = sheet.film_z - best;
        match off.abs() < 1e-9 {
            true => writeln!(out, "  that is the least rms spot on the axis")?,
            false => writeln!(
                out,
                "  {off:+.4} mm from the least rms spot on the axis, which is at {best:.4} mm"
            )?,
        }
    }
    writeln!(out, "  distortion in % of {}", sheet.distortion_reference())
}

/// Prints the curves as a table over the image height.
pub(crate) fn curves(sheet: &LensSheet, out: &mut dyn Write) -> std::io::Result<()> {
    conditions(sheet, out)?;
    writeln!(
        out,
        "  {:>8} {:>7} {:>11} {:>8} {:>8} {:>10} {:>10} {:>9} {:>9}",
        "height",
        "angle",
        "distortion",
        "light",
        "at film",
        "tangential",
        "sagittal",
        "lateral F",
        "lateral C"
    )?;
    writeln!(
        out,
        "  {:>8} {:>7} {:>11} {:>8} {:>8} {:>10} {:>10} {:>9} {:>9}",
        "mm", "deg", "%", "", "deg", "mm", "mm", "\u{b5}m", "\u{b5}m"
    )?;
    let number = |v: Option<f64>, places: usize| v.map_or("-".into(), |v| format!("{v:.places$}"));
    for row in sheet.fields.iter().step_by(8) {
        writeln!(
            out,
            "  {:>8.3} {:>7.2} {:>11} {:>8.3} {:>8} {:>10} {:>10} {:>9} {:>9}",
            row.height,
            row.angle_degrees,
            number(row.distortion_percent, 3),
            row.relative_illumination,
            number(row.chief_ray_angle_degrees, 2),
            number(row.tangential_focus, 3),
            number(row.sagittal_focus, 3),
            number(row.lateral_f.map(|v| 1000.0 * v), 2),
            number(row.lateral_c.map(|v| 1000.0 * v), 2),
        )?;
    }
    breathing(sheet, out)?;
    // Of the 41 frequencies of the default, four are printed; of a list that was asked for, all up
    // to eight.
    let shown: Vec<usize> = match sheet.frequencies.first() {
        Some(0.0) => (0..sheet.frequencies.len()).step_by(10).skip(1).collect(),
        _ => (0..sheet.frequencies.len().min(8)).collect(),
    };
    let heads: Vec<String> = shown
        .iter()
        .map(|i| format!("{:>11}", format!("{} lp/mm", sheet.frequencies[*i])))
        .collect();
    writeln!(
        out,
        "\n  {:>8} {:>9} {:>7} {}",
        "height",
        "rms \u{b5}m",
        "beam",
        heads.join(" ")
    )?;
    for point in &sheet.points {
        let waves = &point.diffraction;
        let cells: Vec<String> = shown
            .iter()
            .map(|i| {
                format!(
                    "{:>11}",
                    format!("{:.2}/{:.2}", waves.tangential[*i], waves.sagittal[*i])
                )
            })
            .collect();
        writeln!(
            out,
            "  {:>8.3} {:>9.2} {:>7.3} {}",
            point.height,
            1000.0 * point.rms,
            point.pupil_area,
            cells.join(" ")
        )?;
    }
    writeln!(
        out,
        "  modulation tangential/sagittal, with the wave, in white light"
    )
}

/// Prints how the field changes with the distance in focus.
fn breathing(sheet: &LensSheet, out: &mut dyn Write) -> std::io::Result<()> {
    if sheet.breathing.is_empty() {
        return Ok(());
    }
    writeln!(
        out,
        "\n  {:>10} {:>13} {:>8} {:>9} {:>9} {:>8}",
        "focused at", "magnification", "field", "change", "moved", "f-number"
    )?;
    let number = |v: Option<f64>, places: usize| v.map_or("-".into(), |v| format!("{v:.places$}"));
    for row in &sheet.breathing {
        let distance = row.distance.map_or("infinity".into(), |mm| {
            format!("{:.3} m", (mm / 1000.0 * 1e3).round() / 1e3)
        });
        writeln!(
            out,
            "  {distance:>10} {:>13.4} {:>7}\u{b0} {:>7} % {:>6.3} mm {:>8}",
            row.magnification,
            number(row.field_degrees, 2),
            number(row.field_change_percent, 2),
            row.extension,
            number(row.working_f_number, 2),
        )?;
    }
    Ok(())
}

/// Writes the prescription in the format of the file's extension, and warns about data that the
/// format cannot express.
pub(crate) fn save_prescription(lens: &Lens, file: &str) -> Result<()> {
    let path = Path::new(file);
    let (text, left_out) = write(lens.prescription(), Target::of(path)?)?;
    for what in left_out {
        super::status!("warning: `{file}` leaves out {what}");
    }
    save(path, &text)
}

/// Draws the section with rays.
pub(crate) fn save_diagram(lens: &Lens, setting: &SheetSetting<'_>, file: &str) -> Result<()> {
    let options = SectionOptions::for_lens(lens, setting);
    save_drawing(&LensDiagram::of(lens, options).drawing(), file)
}

/// Writes a drawing in the format of the file's extension.
pub(crate) fn save_drawing(drawing: &Drawing, file: &str) -> Result<()> {
    let path = Path::new(file);
    match ending(path).as_str() {
        "svg" => save(path, &drawing.to_svg()),
        "fig" => save(path, &drawing.to_fig()),
        _ => Err(unknown("--diagram", file, ".svg or .fig (xfig)")),
    }
}

/// Writes the data sheet as one page.
pub(crate) fn save_sheet(lens: &Lens, setting: &SheetSetting<'_>, file: &str) -> Result<()> {
    let path = Path::new(file);
    let page = match ending(path).as_str() {
        "svg" => svg_page,
        "html" | "htm" => html_page,
        _ => return Err(unknown("--sheet", file, ".html or .svg")),
    };
    let (sheet, all) = Aberrations::with_sheet(lens, setting).unzip();
    save(path, &page(lens, sheet.as_ref(), all.as_ref()))
}

/// Writes the data sheet as CSV.
pub(crate) fn save_csv(lens: &Lens, setting: &SheetSetting<'_>, file: &str) -> Result<()> {
    let Some((sheet, all)) = Aberrations::with_sheet(lens, setting) else {
        return Err(
            Diagnostic::error(format!("`{}` has no image to describe", lens.name()))
                .with_help("an afocal lens, or one that lets no light through, has none"),
        );
    };
    save(
        Path::new(file),
        &super::lens_csv::csv(&sheet, Some(&all), lens.wavelength()),
    )
}

/// Prints the working f-number, Strehl ratios, wavefront errors and Seidel sums.
pub(crate) fn aberrations(all: &Aberrations, out: &mut dyn Write) -> std::io::Result<()> {
    let number = |v: Option<f64>| v.map_or("-".into(), |v| format!("{v:.3}"));
    writeln!(
        out,
        "\n  {:>8} {:>9} {:>11} {:>11}",
        "height", "Strehl", "rms waves", "P-V waves"
    )?;
    for point in &all.points {
        let fit = point.wavefront.as_ref();
        writeln!(
            out,
            "  {:>8.3} {:>9} {:>11} {:>11}",
            point.height,
            number(point.strehl),
            number(fit.map(|w| w.rms)),
            number(fit.map(|w| w.peak_to_valley)),
        )?;
    }
    if let Some(n) = all.working_f_number {
        writeln!(
            out,
            "  at {} nm; f-number of the cone on the film {n:.4}",
            all.wavelength_nm
        )?;
    }
    if let Some(seidel) = &all.seidel {
        let sums = seidel.sum.values().map(|v| format!("{:.4}", 1000.0 * v));
        writeln!(
            out,
            "  Seidel sums I to V, axial and lateral color, \u{b5}m: {}",
            sums.join(" ")
        )?;
    }
    Ok(())
}

/// Writes the images of points as a picture.
pub(crate) fn save_point_spreads(
    lens: &Lens,
    setting: &SheetSetting<'_>,
    file: &str,
) -> Result<()> {
    let path = Path::new(file);
    let picture = point_spreads(lens, setting, PictureFormat::of(path)?)?;
    picture.save(path, Depth::Eight)
}

fn ending(path: &Path) -> String {
    let ending = path.extension().and_then(|e| e.to_str());
    ending.unwrap_or("").to_ascii_lowercase()
}

fn unknown(flag: &str, file: &str, endings: &str) -> Box<Diagnostic> {
    Diagnostic::unsupported(format!("`{flag} {file}` has no known extension"))
        .with_help(format!("end the name in {endings}"))
}

fn save(path: &Path, text: &str) -> Result<()> {
    write_whole(path, |out| out.write_all(text.as_bytes()))
}
