//! ISET's lenses as JSON: `surfaces` of `radius`, `thickness`, `ior` and `semi_aperture`.
//!
//! A stop has the index 0 and the radius 0; the aperture is a semi-diameter here, and a diameter
//! in ISET's `.dat` files, which are pbrt's four columns under a line with the focal length.

use std::sync::Arc;

use serde_json::Value;

use crate::diag::{Diagnostic, Result, Sink, Source, Span};
use crate::lens::glass::Medium;
use crate::lens::prescription::{Column, Prescription, check};
use crate::lens::surface::{Shape, Surface};

use super::json::{Places, parse};

/// Whether a JSON text is one of these: it speaks of `semi_aperture`, and of no schema.
pub fn is_iset(text: &str) -> bool {
    text.contains("\"semi_aperture\"") && !text.contains("\"schema\"")
}

pub fn read(source: &Arc<Source>, sink: &mut Sink) -> Result<Prescription> {
    let root = parse(source)?;
    let places = Places::new(source);
    let rows = root.get("surfaces").and_then(Value::as_array);
    let rows = rows.ok_or_else(|| {
        Diagnostic::error("there is no list of `surfaces`").at(source, Span::at(0))
    })?;
    let mut medium = Medium::air();
    let mut surfaces = Vec::with_capacity(rows.len());
    for (i, row) in rows.iter().enumerate() {
        let value = |key: &str| -> Result<f64> {
            row.get(key).and_then(Value::as_f64).ok_or_else(|| {
                Diagnostic::error(format!("surface {i} has no number `{key}`"))
                    .at(source, places.object(i))
                    .with_help("a surface has radius, thickness, ior and semi_aperture")
            })
        };
        let (radius, index) = (value("radius")?, value("ior")?);
        let is_stop = radius == 0.0 && index == 0.0;
        if !is_stop {
            medium = Medium::constant(index);
        }
        let k = row.get("conic").and_then(Value::as_f64).unwrap_or(0.0);
        let surface = Surface::sphere(
            radius,
            value("thickness")?,
            medium.clone(),
            value("semi_aperture")?,
        );
        surfaces.push(Surface {
            is_stop,
            span: places.object(i),
            shape: if k == 0.0 {
                Shape::Sphere
            } else {
                Shape::Conic { k }
            },
            ..surface
        });
    }
    let name = root.get("name").and_then(Value::as_str).map(str::trim);
    let name = name.filter(|n| !n.is_empty());
    let name = name.map_or_else(|| super::name_of(source), str::to_owned);
    let mut lens = Prescription::new(name, surfaces);
    super::dat::adopt_a_stop(&mut lens);
    check(&mut lens, source, sink, |surface, column| match column {
        Column::Radius => places.value(surface, &["\"radius\""]),
        Column::Thickness => places.value(surface, &["\"thickness\""]),
        Column::Index => places.value(surface, &["\"ior\""]),
        Column::SemiDiameter => places.value(surface, &["\"semi_aperture\""]),
    })?;
    Ok(lens)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(index: &str) -> Result<Prescription> {
        let text = format!(
            r#"{{"name": " A lens ", "surfaces": [
            {{"ior": {index}, "radius": 50, "semi_aperture": 9, "thickness": 3}},
            {{"ior": 0.0, "radius": 0.0, "semi_aperture": 5, "thickness": 0}},
            {{"ior": 1.0, "radius": -50, "semi_aperture": 9, "thickness": 0}}]}}"#
        );
        assert!(is_iset(&text));
        read(
            &Arc::new(Source::new("a.json", text.into_bytes())),
            &mut Sink::new(),
        )
    }

    #[test]
    fn apertures_are_semi_diameters_and_the_stop_keeps_its_medium() {
        let lens = read_text("1.5").unwrap();
        assert_eq!((lens.name.as_str(), lens.stop()), ("A lens", Some(1)));
        assert_eq!(lens.surfaces[0].semi_diameter, 9.0);
        assert_eq!(lens.surfaces[1].medium.n_d, 1.5);
    }

    #[test]
    fn a_bad_index_is_named_by_line_and_column() {
        let error = read_text("0.5").unwrap_err();
        assert_eq!(error.location().1, Some((2, 21)), "{error}");
        assert!(
            read_text("\"glass\"")
                .unwrap_err()
                .message
                .contains("`ior`")
        );
    }
}
