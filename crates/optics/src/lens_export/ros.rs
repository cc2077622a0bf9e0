//! A calibration as ROS reads it: `camera_info` in YAML.

use std::fmt::Write as _;

use crate::lens_export::fit::Chosen;
use crate::lens_export::view::{View, identifier};

/// The calibration of a picture as YAML for `camera_info_manager`.
pub fn ros(view: &View<'_>, chosen: &Chosen) -> String {
    let fit = &chosen.fit;
    let mut text = String::new();
    for line in view.conditions() {
        let _ = writeln!(text, "# {line}");
    }
    let _ = writeln!(
        text,
        "# residual of the model: {:.5} pixels rms, {:.5} at most",
        fit.rms, fit.max
    );
    let (f, middle) = (fit.focal, view.frame.middle());
    let (cx, cy) = (middle.x, middle.y);
    let _ = writeln!(text, "image_width: {}", view.frame.width);
    let _ = writeln!(text, "image_height: {}", view.frame.height);
    // ROS allows letters, digits and underscores in the name of a camera.
    let _ = writeln!(text, "camera_name: {}", identifier(view.lens.name()));
    text += &matrix("camera_matrix", 3, &[f, 0.0, cx, 0.0, f, cy, 0.0, 0.0, 1.0]);
    let _ = writeln!(text, "distortion_model: {}", fit.model.ros_name());
    text += &matrix("distortion_coefficients", 1, &fit.coefficients());
    let unit = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    text += &matrix("rectification_matrix", 3, &unit);
    let projection = [f, 0.0, cx, 0.0, 0.0, f, cy, 0.0, 0.0, 0.0, 1.0, 0.0];
    text += &matrix("projection_matrix", 3, &projection);
    text
}

fn matrix(name: &str, rows: usize, values: &[f64]) -> String {
    let data: Vec<String> = values.iter().map(|v| format!("{v:?}")).collect();
    let columns = values.len() / rows;
    format!(
        "{name}:\n  rows: {rows}\n  cols: {columns}\n  data: [{}]\n",
        data.join(", ")
    )
}
