//! Converts the contents of a scene to JSON, and JSON to text.

use ivcam_base::diag::Diagnostic;
use ivcam_inventor::pose::{CameraPose, Projection};
use ivcam_inventor::snapshot::SentEvent;
use ivcam_inventor::traversal::state::{LightElement, LightKind};
use serde_json::{Value as Json, json};

/// Converts an `f32` to JSON with the shortest digits that identify it.
fn plain(value: f32) -> Json {
    let text = value.to_string();
    text.parse::<f64>().map_or(Json::Null, |v| json!(v))
}

/// Converts a diagnostic to JSON, which docs/guide/machine.md describes.
pub fn diagnostic(d: &Diagnostic) -> Json {
    let (file, place) = d.location();
    json!({
        "severity": d.class(),
        "line": place.map(|p| p.0),
        "column": place.map(|p| p.1),
        "byte": d.byte(),
        "message": d.message,
        "help": d.help,
        "file": file,
        "count": d.count,
    })
}

/// Converts a light with the name of its class.
pub(super) fn light((class, light): &(String, LightElement)) -> Json {
    let mut object = json!({
        "type": class,
        "on": true,
        "intensity": plain(light.intensity),
        "color": light.color.to_array().map(plain),
    });
    if light.kind != LightKind::Directional {
        object["location"] = json!(light.position.to_array());
    }
    if light.kind != LightKind::Point {
        object["direction"] = json!(light.direction.to_array());
    }
    match light.kind {
        LightKind::Spot { drop_off, cut_off } => {
            object["dropOffRate"] = plain(drop_off);
            object["cutOffAngle"] = plain(cut_off);
        }
        LightKind::Beam {
            beam_width,
            cut_off,
        }
        | LightKind::Cone {
            inner: beam_width,
            outer: cut_off,
        } => {
            object["beamWidth"] = plain(beam_width);
            object["cutOffAngle"] = plain(cut_off);
        }
        LightKind::Directional | LightKind::Point => {}
    }
    object
}

/// Converts a camera.
pub(super) fn camera(pose: &CameraPose) -> Json {
    let (axis, angle) = pose.orientation.to_axis_angle();
    let mut object = json!({
        "type": pose.source,
        "position": pose.position.to_array(),
        "orientation": { "axis": axis.to_array(), "angle": angle },
        "near": pose.near,
        "far": pose.far,
        "focalDistance": pose.focal_distance,
    });
    match pose.projection {
        Projection::Perspective { height_angle } => object["heightAngle"] = json!(height_angle),
        Projection::Orthographic { height } => object["height"] = json!(height),
    }
    object
}

/// Returns a flat object as one line: `type PointLight, on true, …`.
pub(super) fn one_line(object: &Json) -> String {
    let parts = object.as_object().into_iter().flatten();
    parts
        .map(|(k, v)| format!("{k} {}", short(v)))
        .collect::<Vec<_>>()
        .join(", ")
}

/// Returns a value as text, with numbers to six digits, lists without brackets and strings without
/// quotes.
pub(super) fn short(value: &Json) -> String {
    match value {
        Json::Number(n) => match n.as_f64() {
            Some(v) if v != 0.0 => {
                let digits = (5.0 - v.abs().log10().floor()).clamp(0.0, 12.0) as usize;
                let text = format!("{v:.digits$}");
                match text.contains('.') {
                    true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
                    false => text,
                }
            }
            _ => n.to_string(),
        },
        Json::Array(list) => list.iter().map(short).collect::<Vec<_>>().join(" "),
        Json::Object(_) => one_line(value),
        Json::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// An event that a node sent.
pub(super) fn event(event: &SentEvent) -> Json {
    json!({
        "time": event.time,
        "node": event.node,
        "event": event.event,
        "value": event.value,
    })
}
