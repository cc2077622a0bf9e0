//! A calibration as OpenCV's `FileStorage` reads it, in YAML.

use std::fmt::Write as _;

use crate::lens_export::fit::Chosen;
use crate::lens_export::view::View;

/// The calibration of a picture as YAML for OpenCV.
///
/// `camera_matrix`, `distortion_coefficients`, `image_width` and `image_height` have the names of
/// OpenCV's own calibration program. The coefficients of `brown` and `rational` are for
/// `cv::projectPoints`, those of `fisheye` for `cv::fisheye::projectPoints`.
pub fn opencv(view: &View<'_>, chosen: &Chosen) -> String {
    let fit = &chosen.fit;
    let mut text = String::from("%YAML:1.0\n---\n");
    for line in view.conditions() {
        let _ = writeln!(text, "# {line}");
    }
    let (f, middle) = (fit.focal, view.frame.middle());
    let _ = writeln!(text, "lens: {}", serde_json::Value::from(view.lens.name()));
    let _ = writeln!(text, "image_width: {}", view.frame.width);
    let _ = writeln!(text, "image_height: {}", view.frame.height);
    let matrix = [f, 0.0, middle.x, 0.0, f, middle.y, 0.0, 0.0, 1.0];
    text += &opencv_matrix("camera_matrix", 3, &matrix);
    let _ = writeln!(text, "distortion_model: {}", fit.model.name());
    let coefficients = fit.coefficients();
    text += &opencv_matrix("distortion_coefficients", coefficients.len(), &coefficients);
    let _ = writeln!(text, "residual_rms_pixels: {:?}", fit.rms);
    let _ = writeln!(text, "residual_max_pixels: {:?}", fit.max);
    text += "# The residual of each model over the picture, in pixels.\nmodels:\n";
    for (model, fit) in &chosen.all {
        let name = model.name();
        let _ = match fit {
            Ok(fit) => writeln!(
                text,
                "   {name}: {{ fits: 1, rms: {:?}, max: {:?} }}",
                fit.rms, fit.max
            ),
            Err(reason) => writeln!(text, "   {name}: {{ fits: 0, reason: \"{reason}\" }}"),
        };
    }
    text
}

/// A matrix of doubles.
fn opencv_matrix(name: &str, rows: usize, values: &[f64]) -> String {
    let data: Vec<String> = values.iter().map(|v| format!("{v:?}")).collect();
    format!(
        "{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {}\n   dt: d\n   data: [ {} ]\n",
        values.len() / rows,
        data.join(", ")
    )
}
