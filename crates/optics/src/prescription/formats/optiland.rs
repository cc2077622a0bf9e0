//! Reads the JSON of optiland: a `surface_group` of surfaces with their geometry, the material
//! behind them and perhaps an aperture. The first is the object, the last the image.
//!
//! Planes, spheres, conics and even and odd aspheres are read. Apertures that are missing are
//! those of the beam of `aperture` and `fields`. Shifts and tilts are refused.

use ivcam_base::diag::{Result, Sink, Span};
use serde_json::Value;

use crate::prescription::formats::apertures::Beam;
use crate::prescription::formats::format::Format;
use crate::prescription::formats::loose::{finite, numbers, parse};
use crate::prescription::formats::reader::{Draft, PrescriptionReader};
use crate::prescription::glass::medium::Medium;
use crate::prescription::prescription::Prescription;
use crate::prescription::surface::{Curvature, Shape, Surface};

/// optiland's JSON.
pub(crate) static FORMAT: Format = Format {
    name: "optiland",
    recognizes: |text| text.trim_start().starts_with('{') && text.contains("\"surface_group\""),
    read,
};

fn read(file: PrescriptionReader<'_>, sink: &mut Sink) -> Result<Prescription> {
    let root = parse(file.source)?;
    let mut draft = draft(file, &root)?;
    let beam = beam(&root);
    draft.fold();
    draft.limit(beam, sink);
    state_wavelengths(&mut draft, &root);
    file.finish(draft, sink)
}

/// Keeps the wavelengths, which have a unit and one of which is the primary one.
fn state_wavelengths(draft: &mut Draft, root: &Value) {
    let list = root["wavelengths"]["wavelengths"].as_array();
    let list = list.map_or(&[][..], |list| list);
    let nanometers = |row: &Value| {
        let unit = match row["unit"].as_str().or(row["_unit"].as_str()) {
            Some("nm") => 1.0,
            Some("mm") => 1e6,
            Some("m") => 1e9,
            _ => 1e3,
        };
        finite(row.get("value").or(row.get("_value"))).map_or(f64::NAN, |value| unit * value)
    };
    let all: Vec<f64> = list.iter().map(nanometers).collect();
    let primary = list.iter().position(|row| row["is_primary"] == true);
    draft.state_wavelengths(&all, primary.unwrap_or(0));
}

/// The beam of the file: its aperture and its largest field.
fn beam(root: &Value) -> Beam {
    let aperture = &root["aperture"];
    let kind = aperture["type"]
        .as_str()
        .or(aperture["ap_type"].as_str())
        .unwrap_or("");
    let value = finite(aperture.get("value")).filter(|v| *v > 0.0);
    let fields = root["fields"]["fields"].as_array();
    let heights = fields.into_iter().flatten().map(|field| {
        let part = |key: &str| finite(field.get(key)).unwrap_or(0.0);
        libm::hypot(part("x"), part("y"))
    });
    let largest = heights.fold(0.0, f64::max);
    let field = root["fields"]["field_definition"]["field_type"].as_str();
    let field = field
        .or(root["fields"]["field_type"].as_str())
        .unwrap_or("");
    Beam {
        entrance_diameter: value.filter(|_| kind == "EPD"),
        f_number: value.filter(|_| kind == "imageFNO"),
        half_field: match field {
            "AngleField" | "angle" => largest,
            _ => 0.0,
        },
        image_height: field.contains("mage").then_some(largest),
        stated: value.map(|_| Span::at(0)),
        ..Beam::default()
    }
}

fn draft(file: PrescriptionReader<'_>, root: &Value) -> Result<Draft> {
    let rows = root["surface_group"]["surfaces"].as_array();
    let rows = rows.map_or(&[][..], |rows| rows);
    file.check_count(rows.len())?;
    let [object, inner @ .., image] = rows else {
        let help = "optiland lists them under `surface_group`";
        return Err(file.no_surfaces(file.find("\"surface_group\""), help));
    };
    let mut draft = file.draft(root["name"].as_str());
    draft.lens.object_medium = medium(file, 0, object, &Medium::air())?;
    // The place of a surface is that of its geometry. The object comes first.
    let mut places = file.places("\"geometry\"").skip(1);
    for (i, row) in inner.iter().enumerate() {
        let next = inner.get(i + 1).unwrap_or(image);
        let surface = surface(file, i + 1, [row, next], draft.medium())?;
        draft.push(surface, [places.next().unwrap_or(Span::at(0)); 4]);
    }
    Ok(draft)
}

/// The first of two neighboring surfaces.
fn surface(
    file: PrescriptionReader<'_>,
    number: usize,
    [row, next]: [&Value; 2],
    before: &Medium,
) -> Result<Surface> {
    refuse(file, number, row)?;
    let z = |row: &Value| finite(row["geometry"]["cs"].get("z"));
    let apart = z(row).zip(z(next)).map(|(here, there)| there - here);
    let Some(thickness) = apart.or(finite(row.get("thickness"))) else {
        let message = format!("surface {number} has no place on the axis");
        return Err(file.fail(file.find("\"surface_group\""), message));
    };
    let radius = finite(row["aperture"].get("r_max")).filter(|r| *r > 0.0);
    let radius = radius.unwrap_or(f64::INFINITY);
    let (curvature, shape) = geometry(file, number, &row["geometry"])?;
    let is_mirror = reflects(row);
    let medium = match is_mirror {
        true => before.clone(),
        false => medium(file, number, row, before)?,
    };
    Ok(Surface {
        shape,
        curvature,
        obstruction: finite(row["aperture"].get("r_min")).unwrap_or(0.0),
        is_stop: row["is_stop"] == true,
        is_mirror,
        ..Surface::sphere(0.0, thickness, medium, radius)
    })
}

/// Refuses surfaces that are shifted or tilted.
fn refuse(file: PrescriptionReader<'_>, number: usize, row: &Value) -> Result<()> {
    let system = &row["geometry"]["cs"];
    for key in ["x", "y", "rx", "ry", "rz"] {
        if finite(system.get(key)).is_some_and(|v| v.abs() > 1e-12) {
            let message = format!("surface {number} is shifted or tilted (`{key}`)");
            let help = "ivcam traces lenses on one straight axis";
            return Err(file.refuse(file.find("\"surface_group\""), message, help));
        }
    }
    Ok(())
}

/// Whether a surface is a mirror.
fn reflects(row: &Value) -> bool {
    row["interaction_model"]["is_reflective"] == true
        || row["is_reflective"] == true
        || row["material_post"]["type"] == "Mirror"
        || row["material_post"] == "mirror"
}

fn geometry(
    file: PrescriptionReader<'_>,
    number: usize,
    geometry: &Value,
) -> Result<(Curvature, Shape)> {
    let kind = geometry["type"].as_str().unwrap_or("");
    // The powers of r of the coefficients are multiples of this.
    let step = match kind {
        "Plane" => return Ok((Curvature::PLANE, Shape::Sphere)),
        "StandardGeometry" => 0,
        "EvenAsphere" => 2,
        "OddAsphere" => 1,
        _ => {
            let message = format!("surface {number} is a `{kind}`, which is not read");
            let help = "the geometries are Plane, StandardGeometry, EvenAsphere and OddAsphere";
            let span = file.find(&format!("\"{kind}\""));
            return Err(file.refuse(span, message, help));
        }
    };
    let radius = finite(geometry.get("radius")).unwrap_or(0.0);
    let k = finite(geometry.get("conic")).unwrap_or(0.0);
    let listed = numbers(geometry.get("coefficients"));
    let terms = listed.into_iter().enumerate().filter(|_| step > 0);
    let terms = terms.map(|(i, value)| (step * (i + 1), value));
    let shape = Shape::from_terms(k, terms).map_err(|power| {
        let message = format!("surface {number}: the term r^{power} is of too high a power");
        file.fail(file.find("\"coefficients\""), message)
    })?;
    Ok((Curvature::from_radius(radius), shape))
}

/// The material behind a surface: an index, an index with an Abbe number, or a name. Without one it
/// is that in front of it.
fn medium(
    file: PrescriptionReader<'_>,
    number: usize,
    row: &Value,
    before: &Medium,
) -> Result<Medium> {
    let material = &row["material_post"];
    if material.is_null() {
        return Ok(before.clone());
    }
    match (finite(material.get("index")), material["name"].as_str()) {
        (Some(n_d), _) => Ok(Medium::from_index(n_d, finite(material.get("abbe")))),
        (None, Some(name)) => file.quoted_glass(name),
        (None, None) => {
            let kind = material["type"].as_str().unwrap_or("");
            let message = format!("surface {number} has a material of the kind `{kind}`");
            let help = "an index, an index with an Abbe number, or a name is read";
            let span = file.find(&format!("\"{kind}\""));
            Err(file.refuse(span, message, help))
        }
    }
}
