//! A lens as an entry for Lensfun's database, in XML: distortion, lateral color and vignetting.
//!
//! Lensfun's unit of radius is half of the shorter side of the film for distortion and lateral
//! color, and half of the diagonal for vignetting.

use std::fmt::Write as _;

use glam::DVec2;
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::escaped;

use crate::lens::About;
use crate::lens_export::chief_rays::ChiefRays;
use crate::lens_export::series::{largest, odd_series, powers};
use crate::lens_export::view::{CHANNELS, Sample, View};

/// The number of radii at which lateral color and illumination are computed.
const STEPS: usize = 32;
/// Half of the diagonal of film of 36 by 24 mm, in millimeters: the crop factor 1.
const FULL_FRAME: f64 = 21.633_307_652_783_937;
/// The distance in meters that Lensfun's database has for infinity.
const FAR: f64 = 1000.0;

/// Distortion in Lensfun's form, with its residual.
struct LensfunDistortion {
    /// The type of the lens: what the undistorted radius is proportional to.
    projection: &'static str,
    /// The attributes of the model.
    attributes: String,
    rms: f64,
    max: f64,
}

/// The entry of a lens.
///
/// # Errors
///
/// Returns an error if no model of distortion leaves at most `tolerance` pixels.
pub fn lensfun(view: &View<'_>, tolerance: f64) -> Result<String> {
    let (lens, frame) = (view.lens, view.frame);
    let all = distortions(view);
    let least = all.iter().map(|d| d.max).fold(f64::INFINITY, f64::min);
    let Some(distortion) = all.into_iter().find(|d| d.max <= tolerance) else {
        return Err(Diagnostic::error(format!(
            "`{}` does not fit Lensfun's models of distortion: the best leaves {least:.3} pixels at \
             most, more than {tolerance}",
            lens.name()
        ))
        .with_help("--residual PIXELS allows a larger residual"));
    };
    let focal = format!("{:.4}", lens.first_order().efl());
    let title = About::of(lens.prescription())
        .title
        .unwrap_or_else(|| lens.name().to_owned());
    let mut notes = view.conditions();
    notes.push(format!(
        "distortion: residual {:.5} pixels rms, {:.5} at most",
        distortion.rms, distortion.max
    ));
    let mut calibration = format!(
        "      <distortion focal=\"{focal}\" {}/>\n",
        distortion.attributes
    );
    if let Some((attributes, max)) = lateral_color(view) {
        let _ = writeln!(
            calibration,
            "      <tca model=\"poly3\" focal=\"{focal}\" {attributes}/>"
        );
        notes.push(format!(
            "lateral color: red, green and blue are {} nm, residual {max:.5} pixels at most",
            CHANNELS.map(|nm| nm.to_string()).join(", ")
        ));
    }
    if let (Some((attributes, max)), Some(n)) = (vignetting(view), lens.real_f_number()) {
        let distance = view.conjugate.distance / 1000.0;
        let distance = if distance.is_finite() { distance } else { FAR };
        let _ = writeln!(
            calibration,
            "      <vignetting model=\"pa\" focal=\"{focal}\" aperture=\"{n:.4}\" \
             distance=\"{distance}\" {attributes}/>"
        );
        notes.push(format!(
            "vignetting: residual {:.3}% of the light on the axis",
            100.0 * max
        ));
    }
    let comments: Vec<String> = notes
        .iter()
        .map(|n| format!("  <!-- {} -->", comment(n)))
        .collect();
    let name = element_text(lens.name());
    let (title, crop) = (element_text(&title), FULL_FRAME / frame.corner());
    let sides = [frame.film.x, frame.film.y];
    let aspect = sides[0].max(sides[1]) / sides[0].min(sides[1]);
    Ok(format!(
        "<lensdatabase version=\"1\">\n{}\n  <mount>\n    <name>ivcam {name}</name>\n  </mount>\n  \
         <camera>\n    <maker>ivcam</maker>\n    <model>{name}</model>\n    \
         <mount>ivcam {name}</mount>\n    <cropfactor>{crop:.6}</cropfactor>\n  </camera>\n  \
         <lens>\n    <maker>ivcam</maker>\n    <model>{title}</model>\n    \
         <mount>ivcam {name}</mount>\n    <cropfactor>{crop:.6}</cropfactor>\n    \
         <aspect-ratio>{aspect:.6}</aspect-ratio>\n    <type>{}</type>\n    <calibration>\n\
         {calibration}    </calibration>\n  </lens>\n</lensdatabase>\n",
        comments.join("\n"),
        distortion.projection
    ))
}

/// The models of distortion: those of the tangent first, and the even polynomial before Hugin's.
fn distortions(view: &View<'_>) -> Vec<LensfunDistortion> {
    let unit = 0.5 * view.frame.film.min_element();
    let pixels = unit * view.frame.density();
    let samples = view.samples();
    let mut all = Vec::new();
    for projection in ["rectilinear", "fisheye"] {
        let is_tangent = projection == "rectilinear";
        if is_tangent && view.half_field() > 1.5 {
            continue;
        }
        let x = |s: &Sample| {
            if is_tangent {
                libm::tan(s.angle)
            } else {
                s.angle
            }
        };
        let points: Vec<(f64, f64)> = samples.iter().map(|s| (x(s), s.radius / pixels)).collect();
        let model = |(attributes, distorted): (String, Box<dyn Fn(f64) -> f64>)| {
            let off = points
                .iter()
                .map(|(x, y)| (distorted(*x) - y).abs() * pixels);
            let off: Vec<f64> = off.collect();
            let square: f64 = off.iter().map(|o| o * o).sum();
            LensfunDistortion {
                projection,
                attributes,
                rms: (square / off.len() as f64).sqrt(),
                max: largest(off),
            }
        };
        all.extend(
            [poly5(&points), ptlens(&points)]
                .into_iter()
                .flatten()
                .map(model),
        );
    }
    all
}

/// The attributes of a model, and the distorted radius over the tangent or the angle.
type RadiusModel = (String, Box<dyn Fn(f64) -> f64>);

/// r_d = r_u (1 + k1 r_u² + k2 r_u⁴).
fn poly5(points: &[(f64, f64)]) -> Option<RadiusModel> {
    let (a, k) = odd_series(points, 2)?;
    let (k1, k2) = (k[0] / (a * a), k[1] / (a * a * a * a));
    let distorted = move |x: f64| {
        let u = a * x;
        u * (1.0 + k1 * u * u + k2 * u * u * u * u)
    };
    Some((
        format!("model=\"poly5\" k1=\"{k1:.12}\" k2=\"{k2:.12}\""),
        Box::new(distorted),
    ))
}

/// Hugin's r_d = r_u (a r_u³ + b r_u² + c r_u + 1 − a − b − c).
fn ptlens(points: &[(f64, f64)]) -> Option<RadiusModel> {
    let p = powers(points, &[1, 2, 3, 4])?;
    // With r_u = s x the scale s solves s − p2/s − p3/s² − p4/s³ = p1, which is near p1.
    let mut s = p[0];
    for _ in 0..50 {
        let off = s - p[1] / s - p[2] / (s * s) - p[3] / (s * s * s) - p[0];
        let slope = 1.0 + p[1] / (s * s) + 2.0 * p[2] / (s * s * s) + 3.0 * p[3] / (s * s * s * s);
        s -= off / slope;
    }
    let (a, b, c) = (p[3] / (s * s * s * s), p[2] / (s * s * s), p[1] / (s * s));
    let distorted = move |x: f64| {
        let u = s * x;
        u * (a * u * u * u + b * u * u + c * u + 1.0 - a - b - c)
    };
    let attributes = format!("model=\"ptlens\" a=\"{a:.12}\" b=\"{b:.12}\" c=\"{c:.12}\"");
    s.is_finite()
        .then(|| (attributes, Box::new(distorted) as Box<dyn Fn(f64) -> f64>))
}

/// The radii of red and blue over that of green as polynomials of green's, and the greatest
/// residual in pixels; none without dispersion.
fn lateral_color(view: &View<'_>) -> Option<(String, f64)> {
    if !view.lens.prescription().is_dispersive() {
        return None;
    }
    let unit = 0.5 * view.frame.film.min_element();
    let rays = |nm: f64| {
        let line = view.lens.at_wavelength(nm);
        ChiefRays::of(&line, view.conjugate, view.rays.reach).ok()
    };
    let [red, green, blue] = CHANNELS.map(rays);
    let green = green?;
    let mut residuals = Vec::new();
    let mut attributes = Vec::new();
    for (letter, other) in [("r", red?), ("b", blue?)] {
        let point = |i: usize| {
            let radius = green.reach * i as f64 / STEPS as f64;
            Some((radius / unit, other.radius(green.angle(radius))? / unit))
        };
        let points: Vec<(f64, f64)> = (1..=STEPS).filter_map(point).collect();
        let p = powers(&points, &[1, 2, 3])?;
        for (x, y) in &points {
            let off = x * (p[0] + x * (p[1] + x * p[2])) - y;
            residuals.push(off.abs() * unit * view.frame.density());
        }
        for (name, value) in [("v", p[0]), ("c", p[1]), ("b", p[2])] {
            attributes.push(format!("{name}{letter}=\"{value:.12}\""));
        }
    }
    let max = largest(residuals);
    max.is_finite().then(|| (attributes.join(" "), max))
}

/// The illumination over that of the axis, 1 + k1 r² + k2 r⁴ + k3 r⁶, and the greatest residual.
fn vignetting(view: &View<'_>) -> Option<(String, f64)> {
    let light = |r: f64| {
        view.lens
            .irradiance(DVec2::new(0.0, r), view.conjugate.film_z)
    };
    let center = light(0.0);
    let point = |i: usize| {
        let radius = view.rays.reach * i as f64 / STEPS as f64;
        (radius / view.frame.corner(), light(radius) / center - 1.0)
    };
    let points: Vec<(f64, f64)> = (1..=STEPS).map(point).collect();
    let k = powers(&points, &[2, 4, 6])?;
    let off = |(x, y): &(f64, f64)| {
        let square = x * x;
        (square * (k[0] + square * (k[1] + square * k[2])) - y).abs()
    };
    let max = largest(points.iter().map(off));
    let attributes = format!("k1=\"{:.9}\" k2=\"{:.9}\" k3=\"{:.9}\"", k[0], k[1], k[2]);
    max.is_finite().then_some((attributes, max))
}

/// A text for an XML comment, which must not have two hyphens in a row.
fn comment(text: &str) -> String {
    let mut text = text.replace(is_foreign, "");
    while text.contains("--") {
        text = text.replace("--", "- -");
    }
    text
}

/// A text for the inside of an XML element.
fn element_text(text: &str) -> String {
    escaped(&text.replace(is_foreign, ""))
}

/// Whether XML cannot contain a character, not even as a reference, or would not keep it.
fn is_foreign(c: char) -> bool {
    c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_have_no_two_hyphens_and_texts_no_control_characters() {
        for hyphens in 2..9 {
            let text = comment(&format!("a{}b", "-".repeat(hyphens)));
            assert!(!text.contains("--"), "{text}");
            assert_eq!(text.matches('-').count(), hyphens);
        }
        assert_eq!(
            element_text("a\u{1}\n<b>\u{ffff} & c"),
            "a&lt;b&gt; &amp; c"
        );
    }
}
