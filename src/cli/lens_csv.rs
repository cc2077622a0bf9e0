//! The data sheet as CSV, one value a row, so that a spreadsheet or a program can select by column.

use std::fmt::Write as _;

use ivcam_optics::lens::LensSheet;
use ivcam_optics::lens::analysis::aberrations::report::Aberrations;
use ivcam_optics::prescription::glass::medium::{C_LINE, F_LINE};

/// The rows of the table.
struct Rows(String);

impl Rows {
    /// Adds a value. `at` is what the curve is over, with its unit in `over`.
    fn add(&mut self, curve: &str, place: (f64, f64), over: &str, at: f64, value: (f64, &str)) {
        let (height, nm) = place;
        let number = |v: f64| {
            if v.is_finite() {
                v.to_string()
            } else {
                String::new()
            }
        };
        let (height, nm, at) = (number(height), number(nm), number(at));
        let (value, unit) = (number(value.0), value.1);
        let _ = writeln!(self.0, "{curve},{height},{nm},{over},{at},{value},{unit}");
    }
}

/// Returns the data sheet as CSV.
pub(super) fn csv(sheet: &LensSheet, all: Option<&Aberrations>, wavelength_nm: f64) -> String {
    let mut rows = Rows("curve,height_mm,wavelength_nm,over,at,value,unit\n".into());
    fields(&mut rows, sheet, wavelength_nm);
    let axis = |nm| (0.0, nm);
    for zone in &sheet.spherical {
        for (nm, focus) in [
            (F_LINE, zone.focus_f),
            (wavelength_nm, zone.focus_d),
            (C_LINE, zone.focus_c),
        ] {
            let value = (focus.unwrap_or(f64::NAN), "mm");
            rows.add("spherical_aberration", axis(nm), "pupil", zone.pupil, value);
        }
    }
    for row in &sheet.color {
        let value = (row.focus, "mm");
        rows.add(
            "longitudinal_color",
            axis(row.wavelength_nm),
            "nm",
            row.wavelength_nm,
            value,
        );
    }
    for point in &sheet.points {
        let place = (point.height, wavelength_nm);
        rows.add("spot_rms", place, "", f64::NAN, (point.rms, "mm"));
        rows.add(
            "beam_area",
            place,
            "",
            f64::NAN,
            (point.pupil_area, "of the axial beam"),
        );
        for (i, f) in sheet.frequencies.iter().enumerate() {
            let white = (point.height, f64::NAN);
            for (name, place, of) in [
                ("modulation_rays", place, &point.geometric),
                ("modulation_waves", white, &point.diffraction),
            ] {
                let tangential = (of.tangential[i], "");
                rows.add(
                    &format!("{name}_tangential"),
                    place,
                    "lp/mm",
                    *f,
                    tangential,
                );
                rows.add(
                    &format!("{name}_sagittal"),
                    place,
                    "lp/mm",
                    *f,
                    (of.sagittal[i], ""),
                );
            }
        }
        for (spot, nm) in point.spots.iter().zip([F_LINE, wavelength_nm, C_LINE]) {
            for (i, p) in spot.iter().enumerate() {
                rows.add("spot_x", (point.height, nm), "ray", i as f64, (p.x, "mm"));
                rows.add("spot_y", (point.height, nm), "ray", i as f64, (p.y, "mm"));
            }
        }
    }
    if let Some(all) = all {
        aberrations(&mut rows, all);
    }
    rows.0
}

/// The curves over the film's height.
fn fields(rows: &mut Rows, sheet: &LensSheet, wavelength_nm: f64) {
    let (f, c) = (F_LINE, C_LINE);
    for row in &sheet.fields {
        let or_nan = |v: Option<f64>| v.unwrap_or(f64::NAN);
        for (name, nm, value, unit) in [
            ("angle", wavelength_nm, row.angle_degrees, "deg"),
            (
                "distortion",
                wavelength_nm,
                or_nan(row.distortion_percent),
                "%",
            ),
            (
                "relative_illumination",
                wavelength_nm,
                row.relative_illumination,
                "",
            ),
            (
                "chief_ray_angle",
                wavelength_nm,
                or_nan(row.chief_ray_angle_degrees),
                "deg",
            ),
            (
                "tangential_focus",
                wavelength_nm,
                or_nan(row.tangential_focus),
                "mm",
            ),
            (
                "sagittal_focus",
                wavelength_nm,
                or_nan(row.sagittal_focus),
                "mm",
            ),
            ("tangential_focus", f, or_nan(row.tangential_focus_f), "mm"),
            ("sagittal_focus", f, or_nan(row.sagittal_focus_f), "mm"),
            ("tangential_focus", c, or_nan(row.tangential_focus_c), "mm"),
            ("sagittal_focus", c, or_nan(row.sagittal_focus_c), "mm"),
            ("lateral_color", f, or_nan(row.lateral_f), "mm"),
            ("lateral_color", c, or_nan(row.lateral_c), "mm"),
        ] {
            rows.add(name, (row.height, nm), "mm", row.height, (value, unit));
        }
    }
}

/// Fans, wavefronts, images through focus and Seidel coefficients.
fn aberrations(rows: &mut Rows, all: &Aberrations) {
    let nm = all.wavelength_nm;
    for point in &all.points {
        for fan in &point.fans {
            let place = (point.height, fan.wavelength_nm);
            for (side, rays) in [("tangential", &fan.tangential), ("sagittal", &fan.sagittal)] {
                for ray in rays {
                    let name = format!("ray_fan_{side}");
                    rows.add(
                        &format!("{name}_x"),
                        place,
                        "pupil",
                        ray.pupil,
                        (ray.x, "mm"),
                    );
                    rows.add(
                        &format!("{name}_y"),
                        place,
                        "pupil",
                        ray.pupil,
                        (ray.y, "mm"),
                    );
                    let name = format!("opd_fan_{side}");
                    rows.add(&name, place, "pupil", ray.pupil, (ray.waves, "waves"));
                }
            }
        }
        let place = (point.height, nm);
        if let Some(strehl) = point.strehl {
            rows.add("strehl", place, "", f64::NAN, (strehl, ""));
        }
        if let Some(fit) = &point.wavefront {
            rows.add("wavefront_rms", place, "", f64::NAN, (fit.rms, "waves"));
            for (i, value) in fit.zernike.iter().enumerate() {
                let term = (i + 1) as f64;
                rows.add("zernike_fringe", place, "term", term, (*value, "waves"));
            }
        }
        for row in &point.through_focus {
            rows.add("focus_spot_rms", place, "mm", row.shift, (row.rms, "mm"));
            for (i, f) in all.frequencies.iter().enumerate() {
                let white = (point.height, f64::NAN);
                let name = format!("focus_modulation_{f}_tangential");
                rows.add(&name, white, "mm", row.shift, (row.tangential[i], ""));
                let name = format!("focus_modulation_{f}_sagittal");
                rows.add(&name, white, "mm", row.shift, (row.sagittal[i], ""));
            }
        }
    }
    let Some(sums) = &all.seidel else { return };
    let names = ["S1", "S2", "S3", "S4", "S5", "C1", "C2"];
    let place = (sums.image_height, nm);
    for (i, surface) in sums.surfaces.iter().enumerate() {
        for (name, value) in names.iter().zip(surface.values()) {
            rows.add(
                &format!("seidel_{name}"),
                place,
                "surface",
                i as f64,
                (value, "mm"),
            );
        }
    }
    for (name, value) in names.iter().zip(sums.sum.values()) {
        rows.add(
            &format!("seidel_{name}_sum"),
            place,
            "",
            f64::NAN,
            (value, "mm"),
        );
    }
}
