//! Reads the JSON of optiland: a `surface_group` of surfaces with their geometry, the material
//! behind them and perhaps an aperture. The first is the object, the last the image.
//!
//! Planes, spheres, conics, even and odd aspheres and thin lenses are read. Apertures that are
//! missing are those of the beam of `aperture` and `fields`. The places and angles of surfaces are
//! those of one space: a shifted or tilted surface is decentered alone, and behind a tilted mirror
//! the axis is reflected as light is.

use glam::{DAffine3, DMat3, DVec2, DVec3};
use ivcam_base::diag::{Result, Sink, Span};
use serde_json::Value;

use crate::prescription::clear_aperture::ClearAperture;
use crate::prescription::decenter::{Decenter, SurfaceFrame, inverse};
use crate::prescription::forbes::ForbesSet;
use crate::prescription::formats::apertures::SystemData;
use crate::prescription::formats::format::PrescriptionFormat;
use crate::prescription::formats::loose::{finite, numbers, parse};
use crate::prescription::formats::reader::{Draft, PrescriptionReader, warn_of_image_curvature};
use crate::prescription::glass::medium::Medium;
use crate::prescription::prescription::Prescription;
use crate::prescription::surface::{Curvature, MAX_POWER, Shape, Surface};

/// The greatest number of coordinate systems in each other.
const MAX_NESTING: usize = 64;

/// optiland's JSON.
pub(crate) static FORMAT: PrescriptionFormat = PrescriptionFormat {
    name: "optiland",
    recognizes: |text| text.trim_start().starts_with('{') && text.contains("\"surface_group\""),
    read,
};

fn read(file: PrescriptionReader<'_>, sink: &mut Sink) -> Result<Prescription> {
    let root = parse(file.source)?;
    let mut draft = draft(file, &root, sink)?;
    let beam = SystemData {
        object_distance: object_distance(&root),
        ..beam(&root)
    };
    close_stop(&mut draft, &root);
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
    draft.state_wavelengths(&all, &[], primary.unwrap_or(0));
}

/// The kind of the aperture of the file, and its value.
fn stated_aperture(root: &Value) -> (&str, Option<f64>) {
    let aperture = &root["aperture"];
    let kind = aperture["type"].as_str().or(aperture["ap_type"].as_str());
    let value = finite(aperture.get("value")).filter(|v| *v > 0.0);
    (kind.unwrap_or(""), value)
}

/// Gives a stop without an aperture the diameter that the file states for it.
fn close_stop(draft: &mut Draft, root: &Value) {
    let ("float_by_stop_size", Some(diameter)) = stated_aperture(root) else {
        return;
    };
    for stop in draft.lens.surfaces.iter_mut().filter(|s| s.is_stop) {
        stop.semi_diameter = stop.semi_diameter.min(0.5 * diameter);
    }
}

/// The beam of the file: its aperture and its largest field.
fn beam(root: &Value) -> SystemData {
    let (kind, value) = stated_aperture(root);
    let fields = root["fields"]["fields"].as_array();
    let heights = fields.into_iter().flatten().map(|field| {
        let part = |key: &str| finite(field.get(key)).unwrap_or(0.0);
        libm::hypot(part("x"), part("y"))
    });
    let largest = heights.reduce(f64::max);
    let field = root["fields"]["field_definition"]["field_type"].as_str();
    let field = field
        .or(root["fields"]["field_type"].as_str())
        .unwrap_or("");
    SystemData {
        entrance_diameter: value.filter(|_| kind == "EPD"),
        f_number: value.filter(|_| kind == "imageFNO"),
        object_aperture: value.filter(|_| kind == "objectNA"),
        half_field: largest.filter(|_| ["AngleField", "angle"].contains(&field)),
        image_height: largest.filter(|_| field.contains("mage")),
        object_height: largest.filter(|_| field.contains("bject") && !field.contains("ngle")),
        stated: value.map(|_| Span::at(0)),
        ..SystemData::default()
    }
}

/// The distance from the object to the first surface; none if it is infinite.
fn object_distance(root: &Value) -> Option<f64> {
    let z = |i: usize| finite(root["surface_group"]["surfaces"][i]["geometry"]["cs"].get("z"));
    Some(z(1)? - z(0)?)
}

fn draft(file: PrescriptionReader<'_>, root: &Value, sink: &mut Sink) -> Result<Draft> {
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
        let surface = surface(file, i + 1, [row, next], draft.medium(), sink)?;
        draft.push(surface, [places.next().unwrap_or(Span::at(0)); 4]);
    }
    if finite(image["geometry"].get("radius")).is_some_and(|radius| radius != 0.0) {
        warn_of_image_curvature(places.next().unwrap_or(Span::at(0)), sink);
    }
    let maps: Option<Vec<DAffine3>> = rows[1..].iter().map(place).collect();
    let is_turned = |map: &DAffine3| {
        let flat = map.translation.truncate().length() < 1e-12;
        !(flat && map.matrix3.abs_diff_eq(DMat3::IDENTITY, 1e-12))
    };
    if let Some(maps) = maps.filter(|maps| maps.iter().any(is_turned)) {
        decenter(&mut draft, &maps);
    }
    Ok(draft)
}

/// The map from a surface to the space of the file; none if its place is not stated.
fn place(row: &Value) -> Option<DAffine3> {
    let mut system = &row["geometry"]["cs"];
    let mut map = DAffine3::IDENTITY;
    for _ in 0..MAX_NESTING {
        let number = |key: &str| finite(system.get(key)).unwrap_or(0.0);
        finite(system.get("z"))?;
        let [x, y, z] = ["rx", "ry", "rz"].map(|key| number(key).to_degrees());
        let turn = |tilt: DVec3| {
            Decenter {
                tilt,
                ..Decenter::NONE
            }
            .affine()
        };
        // The turns are about fixed axes, first about x.
        let turned = turn(z * DVec3::Z) * turn(y * DVec3::Y) * turn(x * DVec3::X);
        let shift = DVec3::from_array(["x", "y", "z"].map(number));
        map = DAffine3::from_translation(shift) * turned * map;
        system = &system["reference_cs"];
        if system.is_null() {
            return Some(map);
        }
    }
    None
}

/// Gives surfaces their thicknesses and frames, from the maps from each of them and the image to
/// the space of the file.
///
/// The axis goes on straight behind every surface, as the light along it would without refraction:
/// a mirror reflects it. So the axis stays where the surfaces are, whatever folds it.
fn decenter(draft: &mut Draft, maps: &[DAffine3]) {
    let flip = DAffine3::from_scale(DVec3::new(1.0, 1.0, -1.0));
    // From the axis at the last surface, with z along the light, to the space of the file.
    let mut axis = DAffine3::from_translation(maps[0].translation.z * DVec3::Z);
    let mut facing = DAffine3::IDENTITY;
    let mut signs = 1.0;
    for (i, map) in maps.iter().enumerate() {
        let found = inverse(&axis) * *map * facing;
        let gap = found.translation.z;
        if let Some(last) = i.checked_sub(1).map(|last| &mut draft.lens.surfaces[last]) {
            last.thickness = signs * gap;
        }
        axis *= DAffine3::from_translation(gap * DVec3::Z);
        let mut before = Decenter::from_affine(&found);
        before.shift.z = 0.0;
        let Some(surface) = draft.lens.surfaces.get_mut(i) else {
            draft.pending = tidy(before);
            return;
        };
        let [front, behind] = match surface.is_mirror {
            true => [signs, -signs],
            false => [signs; 2],
        };
        let turned = |decenter: Decenter, sign: f64| match sign < 0.0 {
            true => decenter.turned_around(),
            false => decenter,
        };
        let before = tidy(before);
        surface.frame = SurfaceFrame {
            before: turned(before, front),
            after: turned(before.inverse(), behind),
        }
        .boxed();
        if surface.is_mirror {
            axis = axis * before.affine() * flip * before.inverse().affine();
            facing *= flip;
            signs = -signs;
        }
    }
}

/// A decenter without what rounding made of 0.
fn tidy(decenter: Decenter) -> Decenter {
    let clean = |v: DVec3| v.map(|v| if v.abs() < 1e-11 { 0.0 } else { v });
    Decenter {
        shift: clean(decenter.shift),
        tilt: clean(decenter.tilt),
    }
}

/// The first of two neighboring surfaces.
fn surface(
    file: PrescriptionReader<'_>,
    number: usize,
    [row, next]: [&Value; 2],
    before: &Medium,
    sink: &mut Sink,
) -> Result<Surface> {
    let z = |row: &Value| finite(row["geometry"]["cs"].get("z"));
    let apart = z(row).zip(z(next)).map(|(here, there)| there - here);
    let Some(thickness) = apart.or(finite(row.get("thickness"))) else {
        let message = format!("surface {number} has no place on the axis");
        return Err(file.fail(file.find("\"surface_group\""), message));
    };
    let radius = finite(row["aperture"].get("r_max")).filter(|r| *r > 0.0);
    let radius = radius.unwrap_or(f64::INFINITY);
    let (curvature, shape) = match thin_lens(file, number, &row["interaction_model"])? {
        Some(ideal) => (Curvature::PLANE, ideal),
        None => geometry(file, number, &row["geometry"])?,
    };
    let is_mirror = reflects(row);
    let medium = match is_mirror {
        true => before.clone(),
        false => medium(file, number, row, before)?,
    };
    let mut plane = Surface::sphere(0.0, thickness, medium, radius);
    set_aperture(&mut plane, file, number, &row["aperture"], sink);
    Ok(Surface {
        shape,
        curvature,
        is_stop: row["is_stop"] == true,
        is_mirror,
        ..plane
    })
}

/// Gives a surface the aperture of the file, if it has one.
fn set_aperture(
    surface: &mut Surface,
    file: PrescriptionReader<'_>,
    number: usize,
    aperture: &Value,
    sink: &mut Sink,
) {
    let value = |key: &str| finite(aperture.get(key)).unwrap_or(0.0);
    let pair = |x: &str, y: &str| DVec2::new(value(x), value(y));
    let kind = aperture["type"].as_str().unwrap_or("");
    let (low, high) = (pair("x_min", "y_min"), pair("x_max", "y_max"));
    let offset = pair("offset_x", "offset_y");
    let (is_ellipse, half, center) = match kind {
        "" | "RadialAperture" => {
            surface.obstruction = value("r_min");
            return;
        }
        "RectangularAperture" => (false, 0.5 * (high - low), 0.5 * (high + low)),
        "EllipticalAperture" => (true, pair("a", "b"), offset),
        "OffsetRadialAperture" if value("r_min") == 0.0 => (true, pair("r_max", "r_max"), offset),
        "PolygonAperture" => {
            let corners = numbers(aperture.get("x"))
                .into_iter()
                .zip(numbers(aperture.get("y")));
            surface.set_outline(corners.map(DVec2::from).collect());
            return;
        }
        _ => {
            let message = format!("the aperture of surface {number}, a `{kind}`, is left out");
            sink.warn(file.find(&format!("\"{kind}\"")), message)
                .help("write the lens as .json and give the surface its `outline`");
            return;
        }
    };
    surface.set_aperture(&ClearAperture {
        is_ellipse,
        half,
        center,
        rotation: 0.0,
    });
}

/// The ideal lens that a surface is; none if it refracts or reflects.
fn thin_lens(
    file: PrescriptionReader<'_>,
    number: usize,
    interaction: &Value,
) -> Result<Option<Shape>> {
    let kind = interaction["type"].as_str().unwrap_or("");
    let focal_length = finite(interaction.get("focal_length"));
    match (kind, focal_length) {
        ("" | "RefractiveReflectiveModel", _) => Ok(None),
        ("ThinLensInteractionModel", Some(focal_length)) => {
            Ok(Some(Shape::ThinLens { focal_length }))
        }
        _ => {
            let span = file.find(&format!("\"{kind}\""));
            let message = format!("surface {number} is a `{kind}`");
            Err(file.not_traced(span, message))
        }
    }
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
        "ForbesQNormalSlopeGeometry" => return forbes(file, number, geometry),
        _ => {
            let message = format!("surface {number} is a `{kind}`, which is not read");
            let help = "the geometries are Plane, StandardGeometry, EvenAsphere, OddAsphere and \
                        ForbesQNormalSlopeGeometry";
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

/// A Q-bfs asphere: its coefficients are the values of `terms`, whose keys are their numbers.
fn forbes(
    file: PrescriptionReader<'_>,
    number: usize,
    geometry: &Value,
) -> Result<(Curvature, Shape)> {
    let config = &geometry["surface_config"];
    let value = |key: &str| finite(config.get(key));
    let mut coefficients = vec![0.0; MAX_POWER];
    for (key, value) in config["terms"].as_object().into_iter().flatten() {
        let at = key.parse().unwrap_or(usize::MAX).min(MAX_POWER - 1);
        coefficients[at] += finite(Some(value)).unwrap_or(0.0);
    }
    let radius = value("norm_radius")
        .filter(|radius| *radius > 0.0)
        .unwrap_or(1.0);
    let terms = ForbesSet::Bfs.terms(&coefficients, radius).map_err(|_| {
        let message = format!("surface {number} has polynomials of too high a power");
        file.fail(file.find("\"surface_config\""), message)
    })?;
    let k = value("conic").unwrap_or(0.0);
    let curvature = Curvature::from_radius(value("radius").unwrap_or(0.0));
    Ok((curvature, Shape::NormalAsphere { k, terms }))
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
