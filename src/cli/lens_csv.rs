//! The data sheet as CSV, one value a row, so that a spreadsheet or a program can select by column.

use std::fmt::Write as _;

use ivcam_optics::lens::{Aberrations, Fans, LensSheet, PointAberrations, PointImage, SeidelSums};

/// What a curve is over for a value that is no curve.
const NOTHING: (&str, f64) = ("", f64::NAN);

/// The rows of the table. A number that does not exist is NaN here and empty in the table.
struct Rows(String);

impl Rows {
    /// Adds a value with its unit. `place` is the height on the film and the wavelength; `over` is
    /// what the curve is over.
    fn add(&mut self, curve: &str, place: (f64, f64), over: (&str, f64), value: (f64, &str)) {
        let [height, nm, at, number] =
            [place.0, place.1, over.1, value.0].map(|v| match v.is_finite() {
                true => v.to_string(),
                false => String::new(),
            });
        let (over, unit) = (over.0, value.1);
        let _ = writeln!(self.0, "{curve},{height},{nm},{over},{at},{number},{unit}");
    }
}

/// Returns the data sheet as CSV.
pub(super) fn csv(sheet: &LensSheet, all: &Aberrations, nm: f64) -> String {
    let mut rows = Rows("curve,height_mm,wavelength_nm,over,at,value,unit\n".into());
    fields(&mut rows, sheet, nm);
    axis(&mut rows, sheet, nm);
    for point in &sheet.points {
        image(&mut rows, point, sheet);
    }
    for point in &all.points {
        for fan in &point.fans {
            fans(&mut rows, fan, point.height);
        }
        wavefront(&mut rows, point, all.wavelength_nm);
        through_focus(&mut rows, point, &all.frequencies, all.wavelength_nm);
    }
    if let Some(sums) = &all.seidel {
        seidel(&mut rows, sums, all.wavelength_nm);
    }
    rows.0
}

/// The curves over the film's height.
fn fields(rows: &mut Rows, sheet: &LensSheet, nm: f64) {
    let [f, _, c] = sheet.lines_nm;
    for row in &sheet.fields {
        let light = Some(row.relative_illumination);
        for (name, nm, value, unit) in [
            ("angle", nm, Some(row.angle_degrees), "deg"),
            ("distortion", nm, row.distortion_percent, "%"),
            ("relative_illumination", nm, light, ""),
            ("chief_ray_angle", nm, row.chief_ray_angle_degrees, "deg"),
            ("tangential_focus", nm, row.tangential_focus, "mm"),
            ("sagittal_focus", nm, row.sagittal_focus, "mm"),
            ("tangential_focus", f, row.tangential_focus_f, "mm"),
            ("sagittal_focus", f, row.sagittal_focus_f, "mm"),
            ("tangential_focus", c, row.tangential_focus_c, "mm"),
            ("sagittal_focus", c, row.sagittal_focus_c, "mm"),
            ("lateral_color", f, row.lateral_f, "mm"),
            ("lateral_color", c, row.lateral_c, "mm"),
        ] {
            let value = (value.unwrap_or(f64::NAN), unit);
            rows.add(name, (row.height, nm), ("mm", row.height), value);
        }
    }
}

/// Spherical aberration and longitudinal color.
fn axis(rows: &mut Rows, sheet: &LensSheet, nm: f64) {
    for zone in &sheet.spherical {
        let lines = [
            (sheet.lines_nm[0], zone.focus_f),
            (nm, zone.focus_d),
            (sheet.lines_nm[2], zone.focus_c),
        ];
        for (nm, focus) in lines {
            let over = ("pupil", zone.pupil);
            let value = (focus.unwrap_or(f64::NAN), "mm");
            rows.add("spherical_aberration", (0.0, nm), over, value);
        }
    }
    for row in &sheet.color {
        let (nm, value) = (row.wavelength_nm, (row.focus, "mm"));
        rows.add("longitudinal_color", (0.0, nm), ("nm", nm), value);
    }
}

/// The spot of a point, its beam and its modulation.
fn image(rows: &mut Rows, point: &PointImage, sheet: &LensSheet) {
    let place = (point.height, sheet.lines_nm[1]);
    let white = (point.height, f64::NAN);
    rows.add("spot_rms", place, NOTHING, (point.rms, "mm"));
    let area = (point.pupil_area, "of the axial beam");
    rows.add("beam_area", place, NOTHING, area);
    let (rays, waves) = (&point.geometric, &point.diffraction);
    for (i, f) in sheet.frequencies.iter().enumerate() {
        for (name, place, values) in [
            ("modulation_rays_tangential", place, &rays.tangential),
            ("modulation_rays_sagittal", place, &rays.sagittal),
            ("modulation_waves_tangential", white, &waves.tangential),
            ("modulation_waves_sagittal", white, &waves.sagittal),
        ] {
            rows.add(name, place, ("lp/mm", *f), (values[i], ""));
        }
    }
    for (spot, nm) in point.spots.iter().zip(sheet.lines_nm) {
        for (i, p) in spot.iter().enumerate() {
            let over = ("ray", i as f64);
            rows.add("spot_x", (point.height, nm), over, (p.x, "mm"));
            rows.add("spot_y", (point.height, nm), over, (p.y, "mm"));
        }
    }
}

/// The fans of a point at one wavelength.
fn fans(rows: &mut Rows, fans: &Fans, height: f64) {
    let place = (height, fans.wavelength_nm);
    let sides = [
        ("tangential", &fans.tangential),
        ("sagittal", &fans.sagittal),
    ];
    for (side, rays) in sides {
        for ray in rays {
            let over = ("pupil", ray.pupil);
            rows.add(&format!("ray_fan_{side}_x"), place, over, (ray.x, "mm"));
            rows.add(&format!("ray_fan_{side}_y"), place, over, (ray.y, "mm"));
            let waves = (ray.waves, "waves");
            rows.add(&format!("opd_fan_{side}"), place, over, waves);
        }
    }
}

/// The Strehl ratio and the wavefront of a point.
fn wavefront(rows: &mut Rows, point: &PointAberrations, nm: f64) {
    let place = (point.height, nm);
    if let Some(strehl) = point.strehl {
        rows.add("strehl", place, NOTHING, (strehl, ""));
    }
    if let Some(fit) = &point.wavefront {
        rows.add("wavefront_rms", place, NOTHING, (fit.rms, "waves"));
        for (i, value) in fit.zernike.iter().enumerate() {
            let over = ("term", (i + 1) as f64);
            rows.add("zernike_fringe", place, over, (*value, "waves"));
        }
    }
}

/// The image of a point on films in front of the film and behind it.
fn through_focus(rows: &mut Rows, point: &PointAberrations, frequencies: &[f64], nm: f64) {
    let white = (point.height, f64::NAN);
    for row in &point.through_focus {
        let over = ("mm", row.shift);
        rows.add("focus_spot_rms", (point.height, nm), over, (row.rms, "mm"));
        for (i, f) in frequencies.iter().enumerate() {
            let sides = [("tangential", &row.tangential), ("sagittal", &row.sagittal)];
            for (side, values) in sides {
                let name = format!("focus_modulation_{f}_{side}");
                rows.add(&name, white, over, (values[i], ""));
            }
        }
    }
}

/// The Seidel coefficients by surface, and their sums.
fn seidel(rows: &mut Rows, seidel: &SeidelSums, nm: f64) {
    let names = ["S1", "S2", "S3", "S4", "S5", "C1", "C2"];
    let place = (seidel.image_height, nm);
    for (i, surface) in seidel.surfaces.iter().enumerate() {
        for (name, value) in names.iter().zip(surface.values()) {
            let over = ("surface", i as f64);
            rows.add(&format!("seidel_{name}"), place, over, (value, "mm"));
        }
    }
    for (name, value) in names.iter().zip(seidel.sum.values()) {
        rows.add(&format!("seidel_{name}_sum"), place, NOTHING, (value, "mm"));
    }
}
