//! The data of a lens as JSON. Lengths are in millimeters, z = 0 is the front vertex, and light
//! travels toward +z.

use indexmap::IndexMap;
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_optics::lens::{
    Aberrations, About, FirstOrder, Focus, Lens, LensSheet, Meridian, Prescription, Pupil, Shape,
    Surface,
};
use ivcam_optics::prescription::Focal;
use serde::Serialize;
use serde_json::Value;

use super::lens_request::{Content, LensRequest};

/// Half of the film's height in the paper's equation 7, in millimeters.
pub(super) const HALF_HEIGHT: f64 = 12.0;

/// A JSON object, whose keys keep their order.
pub(super) type Object = IndexMap<&'static str, ObjectValue>;

/// A value of an [`Object`].
#[derive(Serialize)]
#[serde(untagged)]
pub(super) enum ObjectValue {
    Value(Value),
    Object(Object),
    List(Vec<Object>),
}

/// Returns a field with a value. An infinite number and a missing one are null.
pub(super) fn field(value: impl Into<Value>) -> ObjectValue {
    ObjectValue::Value(value.into())
}

/// The output of `--json`.
#[derive(Serialize)]
struct Sheet<'a> {
    #[serde(flatten)]
    lens: Object,
    #[serde(skip_serializing_if = "Option::is_none")]
    curves: Option<&'a LensSheet>,
    #[serde(skip_serializing_if = "Option::is_none")]
    aberrations: Option<&'a Aberrations>,
}

/// Returns the data of the lens; with `--curves` also those of its data sheet.
pub(super) fn json(request: &LensRequest<'_>, _: &str) -> Result<Content> {
    let sheet = match request.matches.get_flag("curves") {
        true => request.sheet(),
        false => None,
    };
    let sheet = Sheet {
        lens: lens(&request.lens, request.focus.as_ref()),
        curves: sheet.map(|(curves, _)| curves),
        aberrations: sheet.map(|(_, aberrations)| aberrations),
    };
    pretty(&sheet)
}

/// Returns a value as JSON with line breaks. Numbers have enough digits to give the same double
/// when they are read.
pub(super) fn pretty(value: &impl Serialize) -> Result<Content> {
    let text = serde_json::to_string_pretty(value);
    let text = text.map_err(|e| Diagnostic::io("standard output", &e.into()))?;
    Ok(Content::Text(text + "\n"))
}

/// The data of a lens and its focus. Keys without a suffix repeat those that end in `_real`, which
/// are the values that `--aperture` sets and exposures use.
fn lens(lens: &Lens, focus: Option<&Focus>) -> Object {
    let prescription = lens.prescription();
    let folded = prescription.folded();
    let surfaces = &folded.surfaces;
    let (f_number, t_number) = (lens.real_f_number(), lens.t_number());
    let mut all = Object::from([
        ("name", field(lens.name())),
        ("wavelength_nm", field(lens.wavelength())),
    ]);
    all.extend(first_order(lens.first_order()));
    if !surfaces.iter().all(|s| s.shape.is_rotational()) {
        let in_x = first_order(&lens.first_order_in(Meridian::X));
        all.insert("x_plane", ObjectValue::Object(in_x));
    }
    if let Some(focus) = focus {
        all.insert("focus", ObjectValue::Object(focus_data(focus)));
    }
    let rows = surfaces.iter().map(surface).collect();
    all.extend([
        ("f_number", field(f_number)),
        ("f_number_real", field(f_number)),
        ("f_number_paraxial", field(lens.first_order().f_number())),
        ("t_number", field(t_number)),
        ("t_number_real", field(t_number)),
        ("t_number_paraxial", field(lens.paraxial_t_number())),
        ("transmittance", field(lens.axial_transmittance())),
        ("about", ObjectValue::Object(about(prescription))),
        ("surfaces", ObjectValue::List(rows)),
    ]);
    all
}

/// First-order data in one plane.
fn first_order(optics: &FirstOrder) -> Object {
    let focal = |value: fn(&Focal) -> f64| field(optics.focal.as_ref().map(value));
    let pupil = |pupil: Option<Pupil>| match pupil {
        None => ObjectValue::Value(Value::Null),
        Some(p) => ObjectValue::Object(Object::from([
            ("z", field(p.z)),
            ("semi_diameter", field(p.semi_diameter)),
        ])),
    };
    Object::from([
        ("efl", focal(|f| f.efl)),
        ("bfl", focal(|f| f.bfl)),
        ("ffl", focal(|f| f.ffl)),
        ("front_focal_point", focal(|f| f.front_focal_point)),
        ("rear_focal_point", focal(|f| f.rear_focal_point)),
        ("front_principal_plane", focal(|f| f.front_principal_plane)),
        ("rear_principal_plane", focal(|f| f.rear_principal_plane)),
        ("entrance_pupil", pupil(optics.entrance_pupil)),
        ("exit_pupil", pupil(optics.exit_pupil)),
        ("length", field(optics.length)),
        ("afocal", field(optics.focal.is_none())),
        ("power", field(optics.power)),
        ("matrix", field(optics.matrix)),
    ])
}

/// The focus, with distances in millimeters and angles in radians.
fn focus_data(focus: &Focus) -> Object {
    Object::from([
        ("distance", field(focus.distance)),
        ("film_z", field(focus.film_z)),
        ("method", field(focus.method.name())),
        ("magnification", field(focus.magnification)),
        ("height_angle", field(focus.height_angle(HALF_HEIGHT))),
        ("extension", field(focus.extension)),
    ])
}

/// The description of a lens in its file.
fn about(lens: &Prescription) -> Object {
    let about = About::of(lens);
    Object::from([
        ("title", field(about.title)),
        ("kind", field(about.kind)),
        ("year", field(about.year)),
        ("field", field(about.field)),
        ("source", field(about.source)),
        ("notes", field(about.notes)),
    ])
}

/// A surface, in the signs of files. A plane has radius 0, and a surface without an aperture no
/// semi-diameter. Only mirrors, ideal lenses, outlines, closed middles and decenters
/// say so.
fn surface(s: &Surface) -> Object {
    let glass = Some(s.medium.name.as_str()).filter(|name| !name.is_empty());
    let mut all = Object::from([
        ("kind", field(s.shape.name())),
        ("radius", field(s.curvature.radius())),
        ("thickness", field(s.thickness)),
        ("n_d", field(s.medium.n_d)),
        ("V_d", field(s.medium.abbe())),
        ("glass", field(glass)),
        ("semi_diameter", field(s.semi_diameter)),
        ("stop", field(s.is_stop)),
        ("coating", field(s.coating.name())),
    ]);
    if s.is_mirror {
        all.insert("mirror", field(true));
    }
    if let Shape::ThinLens { focal_length } = s.shape {
        all.insert("focal_length", field(focal_length));
    }
    if let Some(corners) = &s.outline {
        let corners: Vec<[f64; 2]> = corners.iter().map(|c| c.to_array()).collect();
        all.insert("outline", field(corners));
    }
    if s.obstruction > 0.0 {
        all.insert("obstruction", field(s.obstruction));
    }
    if let Some(frame) = &s.frame {
        let decenters = [
            (["decenter", "tilt"], &frame.before),
            (["decenter_after", "tilt_after"], &frame.after),
        ];
        for ([shift, tilt], decenter) in decenters.into_iter().filter(|(_, d)| !d.is_none()) {
            all.insert(shift, field(decenter.shift.to_array()));
            all.insert(tilt, field(decenter.tilt.to_array()));
        }
    }
    all
}
