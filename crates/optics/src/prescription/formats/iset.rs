//! Reads ISET's lenses in JSON: `surfaces` of `radius`, `thickness`, `ior` and `semi_aperture`.
//!
//! A stop has the index 0 and the radius 0; the aperture is a semi-diameter here, and a diameter
//! in ISET's `.dat` files, which are pbrt's four columns under a line with the focal length.
//!
//! Its `omni` camera writes lengths as pairs for x and y, indices as two lists, wavelengths and
//! values, and a transformation of each surface: pairs of equals, indices over the lines of the
//! Abbe number and transformations that do nothing are read, others are refused.

use ivcam_base::diag::{Diagnostic, Result, Sink, Span};
use serde_json::Value;

use crate::prescription::formats::dat::adopt_a_stop;
use crate::prescription::formats::format::PrescriptionFormat;
use crate::prescription::formats::index_table;
use crate::prescription::formats::json_text::{JsonPlaces, parse};
use crate::prescription::formats::reader::PrescriptionReader;
use crate::prescription::glass::medium::Medium;
use crate::prescription::prescription::Prescription;
use crate::prescription::surface::{Shape, Surface};

/// ISET's JSON.
pub(crate) static FORMAT: PrescriptionFormat = PrescriptionFormat {
    name: "JSON of ISET",
    recognizes: |text| text.trim_start().starts_with('{') && is_iset(text),
    read,
};

/// Whether a JSON text is in this format: it has the key `semi_aperture`, and no schema.
fn is_iset(text: &str) -> bool {
    text.contains("\"semi_aperture\"") && !text.contains("\"schema\"")
}

/// Reads a prescription in ISET's JSON.
fn read(file: PrescriptionReader<'_>, sink: &mut Sink) -> Result<Prescription> {
    let root = parse(file.source)?;
    let places = JsonPlaces::new(file.source);
    let Some(rows) = root.get("surfaces").and_then(Value::as_array) else {
        return Err(file.fail(Span::at(0), "there is no list of `surfaces`"));
    };
    file.check_count(rows.len())?;
    let name = root.get("name").and_then(Value::as_str).map(str::trim);
    let mut draft = file.draft(name);
    for (number, row) in rows.iter().enumerate() {
        let row = IsetSurface {
            file,
            places: &places,
            number,
            row,
        };
        let surface = row.surface(draft.medium())?;
        let columns: [&[&str]; 4] = [&["radius"], &["thickness"], &["ior"], &["semi_aperture"]];
        draft.push(surface, places.columns(number, columns));
    }
    let microlenses = root.get("microlens").and_then(Value::as_object);
    if microlenses.is_some_and(|m| !m.is_empty()) {
        sink.warn(Span::at(0), "the array of microlenses is left out");
    }
    adopt_a_stop(&mut draft.lens);
    file.finish(draft, sink)
}

/// One of the `surfaces`.
struct IsetSurface<'a> {
    file: PrescriptionReader<'a>,
    places: &'a JsonPlaces,
    number: usize,
    row: &'a Value,
}

impl IsetSurface<'_> {
    fn refuse(&self, key: &str, what: &str) -> Box<Diagnostic> {
        let span = self.places.value(self.number, &[key]);
        self.file
            .fail(span, format!("surface {} {what}", self.number))
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
            let message = format!("surface {} has no number `{key}`", self.number);
            let help = "a surface has radius, thickness, ior and semi_aperture";
            let span = self.places.object(self.number);
            self.file.refuse(span, message, help)
        })
    }

    /// Makes the surface behind a medium.
    fn surface(&self, before: &Medium) -> Result<Surface> {
        let radius = self.value("radius")?;
        let glass = match self.row.get("ior").and_then(over_wavelengths) {
            Some(glass) => glass,
            None => Medium::constant(self.value("ior")?),
        };
        let is_stop = radius == 0.0 && glass.n_d == 0.0;
        let medium = if is_stop { before.clone() } else { glass };
        self.refuse_unsupported()?;
        let k = match self.maybe("conic_constant")? {
            Some(k) => k,
            None => self.maybe("conic")?.unwrap_or(0.0),
        };
        let (thickness, aperture) = (self.value("thickness")?, self.value("semi_aperture")?);
        Ok(Surface {
            is_stop,
            span: self.places.object(self.number),
            shape: Shape::Sphere.with_conic(k),
            ..Surface::sphere(radius, thickness, medium, aperture)
        })
    }

    fn refuse_unsupported(&self) -> Result<()> {
        let turned = self.row.get("transform").map(flat).unwrap_or_default();
        let identity = |(at, x): (usize, &f64)| *x == if at % 5 == 0 { 1.0 } else { 0.0 };
        if !turned.iter().enumerate().all(identity) {
            let what = "is shifted or tilted, which ivcam does not trace";
            return Err(self.refuse("transform", what));
        }
        for key in ["aspheric_coefficients", "asphericCoefficients"] {
            let coefficients = self.row.get(key).map(flat).unwrap_or_default();
            if coefficients.iter().any(|a| *a != 0.0) {
                let what = "is a polynomial asphere, which is read from other formats only";
                return Err(self.refuse(key, what));
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
    let first = *indices.first()?;
    if indices.iter().all(|n| *n == first) {
        return Some(Medium::constant(first));
    }
    let table: Vec<(f64, f64)> = wavelengths.into_iter().zip(indices).collect();
    index_table::medium(&table)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use ivcam_base::diag::Source;

    use super::*;
    use crate::prescription::formats::reading::Reading;

    fn read_text(index: &str) -> Result<Prescription> {
        let text = format!(
            r#"{{"name": " A lens ", "surfaces": [
            {{"ior": {index}, "radius": 50, "semi_aperture": 9, "thickness": 3}},
            {{"ior": 0.0, "radius": 0.0, "semi_aperture": 5, "thickness": 0}},
            {{"ior": 1.0, "radius": -50, "semi_aperture": 9, "thickness": 0}}]}}"#
        );
        assert!(is_iset(&text));
        read_json(text)
    }

    fn read_json(text: String) -> Result<Prescription> {
        let source = &Arc::new(Source::new("a.json", text.into_bytes()));
        let options = &Reading::default();
        read(PrescriptionReader { source, options }, &mut Sink::new())
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
        let lens = read_json(text("[50, 50]", "0")).unwrap();
        assert_eq!(lens.surfaces[0].curvature.radius(), 50.0);
        assert_eq!(lens.surfaces[0].medium, Medium::constant(1.5));
        assert_eq!(lens.surfaces[0].shape, Shape::Conic { k: -1.0 });
        let error = read_json(text("[50, 40]", "0")).unwrap_err();
        assert!(
            error.message.contains("surface 0 is not of revolution"),
            "{error}"
        );
        let error = read_json(text("50", "2")).unwrap_err();
        assert!(error.message.contains("surface 0 is shifted"), "{error}");
    }
}
