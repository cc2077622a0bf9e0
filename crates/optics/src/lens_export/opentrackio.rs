//! A lens as an OpenTrackIO sample (SMPTE RIS OSVP), in JSON.
//!
//! Distortion is that of OpenLensIO: ε_u = R(r) ε_d, with the distorted point ε_d on the sensor in
//! millimeters, r its distance from the middle, and R(r) = (1 + k1 r² + k3 r⁴ + k5 r⁶)/
//! (1 + k2 r² + k4 r⁴ + k6 r⁶). The undistorted point is the tangent of the angle times the focal
//! length of the pinhole.

use ivcam_base::diag::{Diagnostic, Result};
use serde_json::json;

use crate::lens::About;
use crate::lens_export::series::{largest, odd_ratio, odd_series, ratio};
use crate::lens_export::view::{Sample, View};

/// The greatest angle for which the undistorted point is on a plane of finite size.
const STEEPEST: f64 = 1.5;

/// Distortion as R(r) and the inverse of the pinhole's focal length.
struct OpenTrackIoDistortion {
    /// The slope of the angle's tangent over the radius at the axis, per millimeter.
    slope: f64,
    /// The numerator's coefficients, then the denominator's.
    k: Vec<f64>,
    /// The root mean square residual in pixels of the undistorted picture.
    rms: f64,
    /// The greatest residual, in the same pixels.
    max: f64,
}

/// The lens as a static block and a lens block, with distortion from distorted to undistorted
/// coordinates ("Brown-Conrady D-U").
///
/// # Errors
///
/// Returns an error if no coefficients leave at most `tolerance` pixels of the undistorted picture.
pub fn opentrackio(view: &View<'_>, tolerance: f64) -> Result<String> {
    let OpenTrackIoDistortion { slope, k, rms, max } = distortion(view, tolerance)?;
    // OpenLensIO's coefficients alternate between numerator and denominator.
    let term = |i: usize| k.get(i).copied().unwrap_or(0.0);
    let radial = [term(0), term(3), term(1), term(4), term(2), term(5)];
    let (lens, frame) = (view.lens, view.frame);
    let about = About::of(lens.prescription());
    let mut block = json!({
        "pinholeFocalLength": 1.0 / slope,
        "entrancePupilOffset": (view.conjugate.film_z - view.rays.origin_z) / 1000.0,
        "distortion": [{ "model": "Brown-Conrady D-U", "radial": radial, "tangential": [0.0, 0.0] }],
        "distortionOffset": { "x": 0.0, "y": 0.0 },
        "projectionOffset": { "x": 0.0, "y": 0.0 },
    });
    let optional = [
        ("fStop", lens.real_f_number()),
        ("tStop", lens.t_number()),
        // Infinity has no number in JSON, so the distance is left out.
        (
            "focusDistance",
            Some(view.conjugate.distance / 1000.0).filter(|d| d.is_finite()),
        ),
    ];
    for (key, value) in optional {
        if let Some(value) = value {
            block[key] = json!(value);
        }
    }
    let sample = json!({
        "protocol": { "name": "OpenTrackIO", "version": [1, 0, 0] },
        "static": {
            "camera": {
                "activeSensorPhysicalDimensions": { "width": frame.film.x, "height": frame.film.y },
                "activeSensorResolution": { "width": frame.width, "height": frame.height },
            },
            "lens": {
                "model": about.title.unwrap_or_else(|| lens.name().to_owned()),
                "nominalFocalLength": lens.first_order().efl(),
            },
        },
        "lens": block,
        "custom": { "ivcam": {
            "residualRmsPixels": rms,
            "residualMaxPixels": max,
            "conditions": view.conditions(),
        } },
    });
    Ok(format!("{sample:#}\n"))
}

/// The polynomial, or else the ratio of two, whose residual is within the tolerance.
fn distortion(view: &View<'_>, tolerance: f64) -> Result<OpenTrackIoDistortion> {
    let refuse = |why: String| {
        let name = view.lens.name();
        Diagnostic::error(format!(
            "`{name}` does not fit OpenLensIO's distortion: {why}"
        ))
        .with_help("an exact map is `--export stmap`; --residual PIXELS allows a larger residual")
    };
    if view.half_field() > STEEPEST {
        let half = view.half_field().to_degrees();
        return Err(refuse(format!(
            "the field reaches {half:.2} degrees from the axis"
        )));
    }
    let density = view.frame.density();
    let point = |s: Sample| (s.radius / density, libm::tan(s.angle));
    let points: Vec<(f64, f64)> = view.samples().into_iter().map(point).collect();
    let residual = |(slope, k): (f64, Vec<f64>)| {
        let off =
            |(r, t): &(f64, f64)| ((slope * r * ratio(&k, r * r) - t) / slope * density).abs();
        let off: Vec<f64> = points.iter().map(off).collect();
        let square: f64 = off.iter().map(|o| o * o).sum();
        OpenTrackIoDistortion {
            slope,
            k,
            rms: (square / points.len() as f64).sqrt(),
            max: largest(off),
        }
    };
    let fits = [odd_series(&points, 3), odd_ratio(&points)];
    let fits: Vec<_> = fits.into_iter().flatten().map(residual).collect();
    let least = fits.iter().map(|d| d.max).fold(f64::INFINITY, f64::min);
    fits.into_iter()
        .find(|d| d.max <= tolerance)
        .ok_or_else(|| {
            refuse(format!(
                "the best coefficients leave {least:.3} pixels at most, more than {tolerance}"
            ))
        })
}
