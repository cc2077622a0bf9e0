//! Reads the lenses of LensHH (`.lhlt`): JSON of `Surfaces` with `Radius`, `Thickness` and
//! `Material`, of which the first is the object and the last the image.
//!
//! Planes, spheres, conics and even aspheres are read, and mirrors. Semi-diameters that the program
//! computes (`Auto`) are those of the beam.

use ivcam_base::diag::{Result, Sink, Span};
use serde_json::Value;

use crate::prescription::formats::apertures::SystemData;
use crate::prescription::formats::format::PrescriptionFormat;
use crate::prescription::formats::loose::{finite, numbers, parse};
use crate::prescription::formats::reader::{Draft, PrescriptionReader, open_if_zero};
use crate::prescription::glass::Medium;
use crate::prescription::prescription::Prescription;
use crate::prescription::surface::{Curvature, Shape, Surface};

/// LensHH's lenses.
pub(crate) static FORMAT: PrescriptionFormat = PrescriptionFormat {
    name: "LensHH",
    recognizes: |text| {
        let has = |key: &str| text.contains(key);
        text.trim_start().starts_with('{') && has("\"Surfaces\"") && has("\"SemiDiameterMode\"")
    },
    read,
};

fn read(file: PrescriptionReader<'_>, sink: &mut Sink) -> Result<Prescription> {
    let root = parse(file.source)?;
    let rows = root["Surfaces"].as_array().map_or(&[][..], |rows| rows);
    file.check_count(rows.len())?;
    let [object, inner @ .., _image] = rows else {
        return Err(file.no_surfaces(
            file.find("\"Surfaces\""),
            "LensHH lists them under `Surfaces`",
        ));
    };
    let mut draft = file.draft(root["Title"].as_str());
    draft.lens.object_medium = medium(file, object)?;
    // The object comes first.
    let mut places = file.places("\"Radius\"").skip(1);
    for (number, row) in (1..).zip(inner) {
        let place = places.next().unwrap_or(Span::at(0));
        let surface = surface(file, (number, place), row, draft.medium())?;
        match draft.lens.surfaces.last_mut() {
            Some(last) if surface.is_dummy(&last.medium) => last.thickness += surface.thickness,
            None if surface.is_dummy(&draft.lens.object_medium) => {}
            _ => draft.push(surface, [place; 4]),
        }
    }
    draft.fold();
    draft.limit(beam(&root, object), sink);
    state_wavelengths(&mut draft, &root);
    file.finish(draft, sink)
}

fn surface(
    file: PrescriptionReader<'_>,
    (number, place): (usize, Span),
    row: &Value,
    before: &Medium,
) -> Result<Surface> {
    let value = |key: &str| finite(row.get(key)).unwrap_or(0.0);
    let terms = match row["Type"].as_str() {
        Some("Standard") => Vec::new(),
        Some("EvenAsphere") => numbers(row.get("AsphericCoefficients")),
        kind => {
            let message = format!("surface {number} is a `{}`", kind.unwrap_or(""));
            return Err(file.refuse(place, message, "read are `Standard` and `EvenAsphere`"));
        }
    };
    let terms = (2..).step_by(2).zip(terms);
    let shape = Shape::from_terms(value("Conic"), terms).map_err(|power| {
        let message = format!("surface {number}: the term r^{power} is of too high a power");
        file.fail(place, message)
    })?;
    let curvature = Curvature::from_radius(value("Radius"));
    let is_mirror = is_mirror(row);
    let medium = match is_mirror {
        true => before.clone(),
        false => medium(file, row)?,
    };
    let semi_diameter = match row["SemiDiameterMode"] == "Fixed" {
        true => open_if_zero(value("SemiDiameter")),
        false => f64::INFINITY,
    };
    Ok(Surface {
        shape: match shape {
            Shape::Conic { .. } if curvature.is_plane() => Shape::Sphere,
            shape => shape,
        },
        curvature,
        obstruction: value("InnerRadius").max(value("ObscurationRadius")),
        is_stop: row["IsStop"] == true,
        is_mirror,
        span: place,
        ..Surface::sphere(0.0, value("Thickness"), medium, semi_diameter)
    })
}

fn is_mirror(row: &Value) -> bool {
    let name = row["Material"].as_str();
    name.is_some_and(|name| name.eq_ignore_ascii_case("mirror"))
}

fn medium(file: PrescriptionReader<'_>, row: &Value) -> Result<Medium> {
    match row["Material"].as_str().filter(|name| !name.is_empty()) {
        Some(name) => file.quoted_glass(name),
        None => Ok(Medium::air()),
    }
}

/// The aperture and the largest field.
fn beam(root: &Value, object: &Value) -> SystemData {
    let aperture = &root["Aperture"];
    let value = finite(aperture.get("Value")).filter(|value| *value > 0.0);
    let has_kind = |kind: &str| value.filter(|_| aperture["Type"] == kind);
    let fields = root["Fields"].as_array().into_iter().flatten();
    let sizes = fields.map(|field| {
        let part = |key: &str| finite(field.get(key)).unwrap_or(0.0);
        libm::hypot(part("X"), part("Y"))
    });
    let largest = sizes.reduce(f64::max);
    let kind = root["FieldType"].as_str().unwrap_or("");
    let is = |word: &str| kind.contains(word);
    SystemData {
        entrance_diameter: has_kind("EPD"),
        f_number: has_kind("FNumber"),
        half_field: largest.filter(|_| is("Angle")),
        image_height: largest.filter(|_| is("Image")),
        object_height: largest.filter(|_| is("Object") && is("Height")),
        object_distance: finite(object.get("Thickness")),
        stated: value.map(|_| Span::at(0)),
        ..SystemData::default()
    }
}

/// Keeps the wavelengths, which are in micrometers.
fn state_wavelengths(draft: &mut Draft, root: &Value) {
    let list = root["Wavelengths"].as_array().map_or(&[][..], |list| list);
    let nanometers = |row: &Value| finite(row.get("Value")).map_or(f64::NAN, |um| 1e3 * um);
    let all: Vec<f64> = list.iter().map(nanometers).collect();
    let primary = list.iter().position(|row| row["IsPrimary"] == true);
    draft.state_wavelengths(&all, &[], primary.unwrap_or(0));
}
