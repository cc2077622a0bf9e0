//! Reads ISET's lenses in JSON: `surfaces` of `radius`, `thickness`, `ior` and `semi_aperture`.
//!
//! A stop has the index 0 and the radius 0; the aperture is a semi-diameter here, and a diameter
//! in ISET's `.dat` files, which are pbrt's four columns under a line with the focal length.
//!
//! Its `omni` camera writes lengths as pairs for x and y, indices as two lists, wavelengths and
//! values, and a transformation of each surface: pairs of equals, indices over the lines of the
//! Abbe number and transformations that do nothing are read, others are refused.

use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result, Sink, Source, Span};
use serde_json::Value;

use crate::prescription::formats::format::Format;
use crate::prescription::formats::index_table::interpolated;
use crate::prescription::formats::json::{Places, parse};
use crate::prescription::glass::medium::{C_LINE, D_LINE, F_LINE, Medium};
use crate::prescription::prescription::{Column, Prescription, check, check_count};
use crate::prescription::surface::{Shape, Surface};
/// ISET's JSON.
pub(crate) static FORMAT: Format = Format {
    name: "JSON of ISET",
    recognizes: |text| text.trim_start().starts_with('{') && is_iset(text),
    read: |source, _, sink| read(source, sink),
};

/// Whether a JSON text is in this format: it has the key `semi_aperture`, and no schema.
pub(crate) fn is_iset(text: &str) -> bool {
    text.contains("\"semi_aperture\"") && !text.contains("\"schema\"")
}

/// Reads a prescription in ISET's JSON.
fn read(source: &Arc<Source>, sink: &mut Sink) -> Result<Prescription> {
    let root = parse(source)?;
    let places = Places::new(source);
    let rows = root.get("surfaces").and_then(Value::as_array);
    let rows = rows.ok_or_else(|| {
        Diagnostic::error("there is no list of `surfaces`").at(source, Span::at(0))
    })?;
    check_count(rows.len(), source)?;
    let mut medium = Medium::air();
    let mut surfaces = Vec::with_capacity(rows.len());
    for (number, row) in rows.iter().enumerate() {
        let row = Row {
            source,
            places: &places,
            number,
            row,
        };
        surfaces.push(row.surface(&mut medium)?);
    }
    let name = root.get("name").and_then(Value::as_str).map(str::trim);
    let name = name.filter(|n| !n.is_empty());
    let name = name.map_or_else(
        || crate::prescription::formats::origin::name_of(source),
        str::to_owned,
    );
    let microlenses = root.get("microlens").and_then(Value::as_object);
    if microlenses.is_some_and(|m| !m.is_empty()) {
        sink.warn(Span::at(0), "the array of microlenses is left out");
    }
    let mut lens = Prescription::new(name, surfaces);
    crate::prescription::formats::dat::adopt_a_stop(&mut lens);
    check(&mut lens, source, sink, |surface, column| match column {
        Column::Radius => places.value(surface, &["\"radius\""]),
        Column::Thickness => places.value(surface, &["\"thickness\""]),
        Column::Index => places.value(surface, &["\"ior\""]),
        Column::SemiDiameter => places.value(surface, &["\"semi_aperture\""]),
    })?;
    Ok(lens)
}

/// One of the `surfaces`.
struct Row<'a> {
    source: &'a Arc<Source>,
    places: &'a Places,
    number: usize,
    row: &'a Value,
}

impl Row<'_> {
    fn refuse(&self, key: &str, what: &str) -> Box<Diagnostic> {
        let span = self.places.value(self.number, &[&format!("\"{key}\"")]);
        Diagnostic::error(format!("surface {} {what}", self.number)).at(self.source, span)
    }

    /// A number, which may be given for x and y; none if the key is missing.
    fn maybe(&self, key: &str) -> Result<Option<f64>> {
        match self.row.get(key).map(flat).as_deref() {
            Some([x, rest @ ..]) if rest.iter().all(|y| y == x) => Ok(Some(*x)),
            Some([_, ..]) => Err(self.refuse(key, "is not of revolution: its `x` and `y` differ")),
            _ => Ok(None),
        }
    }

    fn value(&self, key: &str) -> Result<f64> {
        self.maybe(key)?.ok_or_else(|| {
            Diagnostic::error(format!("surface {} has no number `{key}`", self.number))
                .at(self.source, self.places.object(self.number))
                .with_help("a surface has radius, thickness, ior and semi_aperture")
        })
    }

    /// Makes the surface. `medium` is the medium in front of it, and is replaced by the one behind
    /// it.
    fn surface(&self, medium: &mut Medium) -> Result<Surface> {
        let radius = self.value("radius")?;
        let glass = match self.row.get("ior").and_then(over_wavelengths) {
            Some(glass) => glass,
            None => Medium::constant(self.value("ior")?),
        };
        let is_stop = radius == 0.0 && glass.n_d == 0.0;
        if !is_stop {
            *medium = glass;
        }
        self.refuse_unsupported()?;
        let k = match self.maybe("conic_constant")? {
            Some(k) => k,
            None => self.maybe("conic")?.unwrap_or(0.0),
        };
        let surface = Surface::sphere(
            radius,
            self.value("thickness")?,
            medium.clone(),
            self.value("semi_aperture")?,
        );
        Ok(Surface {
            is_stop,
            span: self.places.object(self.number),
            shape: if k == 0.0 {
                Shape::Sphere
            } else {
                Shape::Conic { k }
            },
            ..surface
        })
    }

    fn refuse_unsupported(&self) -> Result<()> {
        let turned = self.row.get("transform").map(flat).unwrap_or_default();
        let identity = |(at, x): (usize, &f64)| *x == if at % 5 == 0 { 1.0 } else { 0.0 };
        if !turned.iter().enumerate().all(identity) {
            return Err(self.refuse(
                "transform",
                "is shifted or tilted, which ivcam does not trace",
            ));
        }
        for key in ["aspheric_coefficients", "asphericCoefficients"] {
            let coefficients = self.row.get(key).map(flat).unwrap_or_default();
            if coefficients.iter().any(|a| *a != 0.0) {
                return Err(self.refuse(
                    key,
                    "is a polynomial asphere, which is read from other formats only",
                ));
            }
        }
        Ok(())
    }
}

/// The numbers in a value, including those in nested lists.
fn flat(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(list) => list.iter().flat_map(flat).collect(),
        other => other.as_f64().into_iter().collect(),
    }
}

/// `[[400, 700], [1.52, 1.50]]`: wavelengths in nanometers and the indices there.
fn over_wavelengths(value: &Value) -> Option<Medium> {
    let [wavelengths, indices] = &value.as_array()?[..] else {
        return None;
    };
    let (wavelengths, indices) = (flat(wavelengths), flat(indices));
    if wavelengths.len() != indices.len() {
        return None;
    }
    let table: Vec<(f64, f64)> = wavelengths.into_iter().zip(indices).collect();
    let (first, same) = (
        table.first()?.1,
        table.iter().all(|(_, n)| *n == table[0].1),
    );
    let at = |nm| interpolated(&table, nm);
    match (at(F_LINE), at(D_LINE), at(C_LINE)) {
        _ if same => Some(Medium::constant(first)),
        (Some(f), Some(d), Some(c)) => Some(Medium::from_lines(f, d, c)),
        (_, Some(d), _) => Some(Medium::constant(d)),
        _ => None,
    }
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

    /// The omni camera's pairs, lists over wavelengths and transformations.
    #[test]
    fn pairs_of_equals_are_a_surface_of_revolution() {
        let text = |radius: &str, shift: &str| {
            format!(
                r#"{{"surfaces": [
                {{"ior": [[400, 500, 600, 700], [1.5, 1.5, 1.5, 1.5]], "radius": {radius},
                  "semi_aperture": [9, 9], "thickness": 3, "conic_constant": [-1, -1],
                  "transform": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[{shift},0,0,1]]}},
                {{"ior": [[400, 700], [1, 1]], "radius": [-50, -50], "semi_aperture": 9,
                  "thickness": 0, "conic_constant": []}}], "microlens": {{}}}}"#
            )
        };
        let read = |text: String| {
            let source = Arc::new(Source::new("a.json", text.into_bytes()));
            read(&source, &mut Sink::new())
        };
        let lens = read(text("[50, 50]", "0")).unwrap();
        assert_eq!(lens.surfaces[0].curvature.radius(), 50.0);
        assert_eq!(lens.surfaces[0].medium, Medium::constant(1.5));
        assert_eq!(lens.surfaces[0].shape, Shape::Conic { k: -1.0 });
        let error = read(text("[50, 40]", "0")).unwrap_err();
        assert!(
            error.message.contains("surface 0 is not of revolution"),
            "{error}"
        );
        let error = read(text("50", "2")).unwrap_err();
        assert!(error.message.contains("surface 0 is shifted"), "{error}");
    }
}
