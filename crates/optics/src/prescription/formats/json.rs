//! ivcam's own full prescription, as JSON (schema `ivlens-1`): everything a [`Prescription`]
//! carries.
//!
//! ```json
//! {"schema": "ivlens-1", "name": "…", "units": "mm", "n_object": 1.0, "surfaces": [
//!   {"kind": "sphere", "R": 50.0, "t": 3.0, "n_d": 1.5, "V_d": 60.0, "semi_diameter": 12.0}, …]}
//! ```
//!
//! Kinds: sphere, plane, stop, conic, asphere, cyl_x, cyl_y, toroid. An asphere has the conic
//! constant `k` and `radial_poly`, powers of r with their coefficients, or `A4_A6_..`, a list
//! from r^4 in steps of two. A toroid has `R_x` across. `n_F` and `n_C` give dispersion, or `V_d`,
//! or `sellmeier` (K1 L1 K2 L2 K3 L3 in µm²), or `formula` (numbered as in `.agf` files) with
//! `coefficients`, or `indices`, a list of pairs of wavelengths in nm and indices, or a `glass`
//! named without an index. A missing `semi_diameter` does not limit. A surface with `mirror`
//! reflects; behind it thicknesses and radii have the signs of a straight z axis. `obstruction` is
//! the radius that is closed in the middle of a surface. `decenter` in mm and `tilt` in degrees,
//! each [x, y, z], are those of the surface against the axis in front of it, `decenter_after` and
//! `tilt_after` those of the axis behind it against the surface; see [`Decenter`].
//! `h_max` is half of the film's diagonal, `half_field_deg` half of the field. `entrance_pupil` or
//! `image_f_number`, `wavelengths_nm`, the primary one first, and `wavelength_weights` are those of
//! a file of a design program; apertures decide what is traced.
//! `coating` is none, mgf2 or ideal. It belongs to a surface or, beside `surfaces`, to all surfaces
//! without one.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};
use ivcam_base::diag::{Diagnostic, Result, Sink, Span};
use serde::Deserialize;
use serde::de::value::MapDeserializer;
use serde_json::{Map, Value};

use crate::prescription::about::KEYS;
use crate::prescription::decenter::{Decenter, SurfaceFrame};
use crate::prescription::formats::format::PrescriptionFormat;
use crate::prescription::formats::index_table;
use crate::prescription::formats::json_text::{JsonPlaces, parse};
use crate::prescription::formats::origin::at_zoom_list;
use crate::prescription::formats::reader::{PrescriptionReader, spelling};
use crate::prescription::glass::coating::Coating;
use crate::prescription::glass::medium::{D_LINE, Dispersion, Formula, Medium};
use crate::prescription::prescription::{FocusGroup, Iris, Prescription, StatedBeam, ZoomPosition};
use crate::prescription::surface::{Curvature, MAX_POWER, Shape, Surface, polynomial};

const KINDS: [&str; 10] = [
    "sphere",
    "plane",
    "stop",
    "conic",
    "asphere",
    "normal_asphere",
    "cyl_x",
    "cyl_y",
    "toroid",
    "thin_lens",
];

/// The names of the fields of [`SurfaceFields`], and of those that are read in another way. There
/// are lists beside them that begin with `A4`.
const FIELDS: &str = "i kind R radius c curvature t thickness n_d n V_d n_F n_C glass cauchy \
                      sellmeier formula coefficients indices semi_diameter a obstruction stop mirror k radial_poly R_x c_x \
                      coating decenter tilt decenter_after tilt_after focal_length outline";

/// The names of the fields of [`LensFields`], and of those beside them; the design data of
/// [`KEYS`] may follow.
const LENS_FIELDS: &str = "schema title note order surfaces units n_object object_medium h_max half_field_deg \
                           entrance_pupil image_f_number wavelengths_nm wavelength_weights coating \
                           iris zoom focus_group";

/// The names of the fields of [`IrisFields`] and of [`ZoomFields`].
const IRIS_FIELDS: &str = "blades outline rotation_deg";
const ZOOM_FIELDS: &str = "name gaps stop";

/// The most unknown fields of an object that are named. Each is searched for in the whole file.
const MOST_UNKNOWN: usize = 20;

/// The names of the fields of each column of the table.
const COLUMNS: [&[&str]; 4] = [
    &["R", "radius", "c"],
    &["t", "thickness"],
    &["n_d", "n"],
    &["semi_diameter", "a"],
];

/// ivcam's own JSON, schema `ivlens-1`.
pub(crate) static FORMAT: PrescriptionFormat = PrescriptionFormat {
    name: "JSON",
    recognizes: |text| text.trim_start().starts_with('{'),
    read,
};

/// A file of the schema `ivlens-1`, without its design data.
#[derive(Default, Deserialize)]
#[serde(default)]
struct LensFields {
    units: Option<String>,
    n_object: Option<f64>,
    object_medium: Option<Map<String, Value>>,
    h_max: Option<f64>,
    half_field_deg: Option<f64>,
    entrance_pupil: Option<f64>,
    image_f_number: Option<f64>,
    wavelengths_nm: Vec<f64>,
    wavelength_weights: Vec<f64>,
    coating: Option<Value>,
    iris: Option<IrisFields>,
    zoom: Option<Vec<ZoomFields>>,
    focus_group: Option<Value>,
}

/// The shape of the hole in the stop.
#[derive(Default, Deserialize)]
#[serde(default)]
struct IrisFields {
    blades: Option<u64>,
    outline: Vec<[f64; 2]>,
    rotation_deg: f64,
}

/// `{"name": "14 mm", "gaps": {"4": 1.5}, "stop": 5.6}`
#[derive(Default, Deserialize)]
#[serde(default)]
struct ZoomFields {
    name: String,
    gaps: BTreeMap<String, Value>,
    stop: Option<f64>,
}

/// The fields of a surface. Some have two names, of which the first counts.
#[derive(Default, Deserialize)]
#[serde(default)]
struct SurfaceFields {
    kind: Option<String>,
    #[serde(rename = "R")]
    r: Option<f64>,
    radius: Option<f64>,
    c: Option<f64>,
    curvature: Option<f64>,
    t: Option<f64>,
    thickness: Option<f64>,
    n_d: Option<f64>,
    n: Option<f64>,
    #[serde(rename = "V_d")]
    abbe: Option<f64>,
    #[serde(rename = "n_F")]
    n_f: Option<f64>,
    #[serde(rename = "n_C")]
    n_c: Option<f64>,
    glass: Option<String>,
    cauchy: Option<Vec<f64>>,
    sellmeier: Option<Vec<f64>>,
    formula: Option<f64>,
    coefficients: Option<Vec<f64>>,
    indices: Option<Vec<(f64, f64)>>,
    semi_diameter: Option<f64>,
    a: Option<f64>,
    obstruction: Option<f64>,
    stop: Option<bool>,
    mirror: Option<bool>,
    k: Option<f64>,
    /// The coefficients of r^4, r^6 and so on.
    #[serde(rename = "A4")]
    even_terms: Option<Vec<f64>>,
    radial_poly: Option<BTreeMap<String, f64>>,
    #[serde(rename = "R_x")]
    radius_x: Option<f64>,
    #[serde(rename = "c_x")]
    curvature_x: Option<f64>,
    coating: Option<Value>,
    decenter: Option<[f64; 3]>,
    tilt: Option<[f64; 3]>,
    decenter_after: Option<[f64; 3]>,
    tilt_after: Option<[f64; 3]>,
    focal_length: Option<f64>,
    outline: Option<Vec<[f64; 2]>>,
}

/// Why a field has no effect beside the others of a surface.
const FLAT: &str = "a surface of this kind has no curvature";
const NO_PROFILE: &str = "a surface of this kind has no aspheric profile";
const OF_TOROID: &str = "it is that of a toroid";

/// A field of a surface, whether it is there and has no effect, and why.
type IdleField = (&'static str, fn(&SurfaceFields) -> bool, &'static str);

/// The fields that may have no effect.
const IDLE: [IdleField; 17] = [
    ("R", |s| s.is_flat() && is_given(s.r), FLAT),
    ("radius", |s| s.is_flat() && is_given(s.radius), FLAT),
    ("c", |s| s.is_flat() && is_given(s.c), FLAT),
    ("curvature", |s| s.is_flat() && is_given(s.curvature), FLAT),
    ("k", |s| s.has_no_profile() && is_given(s.k), NO_PROFILE),
    (
        "radial_poly",
        |s| s.has_no_profile() && s.radial_poly.is_some(),
        NO_PROFILE,
    ),
    (
        "A4_A6_..",
        |s| s.has_no_profile() && s.even_terms.is_some(),
        NO_PROFILE,
    ),
    (
        "R_x",
        |s| !s.is(&["toroid"]) && is_given(s.radius_x),
        OF_TOROID,
    ),
    (
        "c_x",
        |s| !s.is(&["toroid"]) && is_given(s.curvature_x),
        OF_TOROID,
    ),
    (
        "focal_length",
        |s| !s.is(&["thin_lens"]) && s.focal_length.is_some(),
        "it is that of a `thin_lens`",
    ),
    (
        "n_F",
        |s| s.n_f.is_some() && s.n_c.is_none(),
        "there is no `n_C`",
    ),
    (
        "n_C",
        |s| s.n_c.is_some() && s.n_f.is_none(),
        "there is no `n_F`",
    ),
    (
        "cauchy",
        |s| s.cauchy.as_ref().is_some_and(|k| k.len() != 2),
        "it has two coefficients",
    ),
    (
        "sellmeier",
        |s| s.sellmeier.as_ref().is_some_and(|k| k.len() != 6),
        "it has six coefficients",
    ),
    (
        "formula",
        |s| s.formula.is_some() && !s.has_coefficients(),
        "there are no `coefficients`",
    ),
    (
        "coefficients",
        |s| s.formula.is_none() && s.has_coefficients(),
        "there is no `formula`",
    ),
    (
        "indices",
        |s| s.indices.as_ref().is_some_and(|pairs| pairs.len() < 2),
        "a curve has two pairs or more",
    ),
];

impl SurfaceFields {
    fn is(&self, kinds: &[&str]) -> bool {
        kinds.contains(&self.kind.as_deref().unwrap_or(""))
    }

    fn is_flat(&self) -> bool {
        self.is(&["plane", "thin_lens"])
    }

    fn has_no_profile(&self) -> bool {
        self.is(&["cyl_x", "cyl_y", "thin_lens"])
    }

    fn has_coefficients(&self) -> bool {
        self.coefficients.as_ref().is_some_and(|k| !k.is_empty())
    }
}

/// Whether a number is there and is not 0, which is that of a field that is not there.
fn is_given(value: Option<f64>) -> bool {
    value.is_some_and(|v| v != 0.0 && v.is_finite())
}

/// The fields of an object that are not known.
fn unknown<'a>(object: &'a Value, known: &[&str]) -> impl Iterator<Item = &'a str> {
    let names = object.as_object().into_iter().flatten();
    let names = names.map(|(name, _)| name.as_str());
    names.filter(|name| !known.contains(name))
}

/// The name of a field of the wrong type, and the type that it should have.
type WrongField<'a> = (&'a str, String);

/// Reads the fields of an object. A field whose name begins with `A4` is `A4`.
fn fields<'a, T: Deserialize<'a>>(
    object: &'a Map<String, Value>,
) -> std::result::Result<T, WrongField<'a>> {
    let mut last = "";
    let fields = object.iter().map(|(name, value)| {
        last = name;
        let is_even = name.starts_with("A4");
        (if is_even { "A4" } else { name.as_str() }, value)
    });
    T::deserialize(MapDeserializer::new(fields)).map_err(|error: serde_json::Error| {
        let text = error.to_string();
        let expected = match text.rsplit_once("expected ") {
            Some((_, "f64")) => "a number",
            Some((_, "u64")) => "a whole number",
            Some((_, "a sequence")) => "a list",
            Some((_, "a boolean")) => "true or false",
            Some((_, what)) if what == "a map" || what.starts_with("struct") => "an object",
            Some((_, what)) => what,
            None => "allowed twice",
        };
        (last, expected.to_owned())
    })
}

/// Reads a prescription of schema `ivlens-1`.
fn read(file: PrescriptionReader<'_>, sink: &mut Sink) -> Result<Prescription> {
    let root = parse(file.source)?;
    let reader = LensJsonReader {
        file,
        places: JsonPlaces::new(file.source),
    };
    reader.lens(&root, sink)
}

/// A file of the schema `ivlens-1`, with the places of its surfaces.
struct LensJsonReader<'a> {
    file: PrescriptionReader<'a>,
    places: JsonPlaces,
}

impl LensJsonReader<'_> {
    /// An error about a surface, or about the whole lens.
    fn fail(&self, surface: Option<usize>, message: impl Into<String>) -> Box<Diagnostic> {
        let span = surface.map_or(Span::at(0), |i| self.places.object(i));
        self.file.fail(span, message)
    }

    fn lens(&self, root: &Value, sink: &mut Sink) -> Result<Prescription> {
        let schema = root.get("schema").and_then(Value::as_str);
        if let Some(schema) = schema.filter(|schema| *schema != "ivlens-1") {
            let message = format!("the schema `{schema}` is not `ivlens-1`");
            return Err(self.fail(None, message));
        }
        let Some(rows) = root.get("surfaces").and_then(Value::as_array) else {
            let help = "ivcam reads JSON prescriptions of schema `ivlens-1`";
            let message = "there is no list of `surfaces`";
            return Err(self.file.refuse(Span::at(0), message, help));
        };
        let stated = self.lens_fields(root)?;
        let unit = stated.units.as_deref().unwrap_or("mm");
        let unit = self.file.unit(unit, Span::at(0))?;
        let mut draft = self.file.draft(root.get("name").and_then(Value::as_str));
        draft.lens.object_medium = self.object_medium(&stated)?;
        let coating = self.coating(stated.coating.as_ref(), None)?;
        let coating = coating.unwrap_or_default();
        self.file.check_count(rows.len())?;
        if schema.is_none() {
            self.refuse_foreign(root, rows)?;
        }
        self.warn_of_unknown_lens_fields(root, sink);
        for (i, row) in rows.iter().enumerate() {
            let surface = self.surface(i, row, draft.medium(), coating)?;
            self.warn_of_unknown_fields(i, row, sink);
            self.warn_of_idle_fields(i, row, sink)?;
            draft.push(surface, self.places.columns(i, COLUMNS));
        }
        draft.lens.notes = notes(root);
        draft.lens.image_height = stated.h_max.filter(|h| *h > 0.0);
        draft.lens.half_field = stated.half_field_deg.filter(|a| *a >= 0.0);
        let positive = |value: Option<f64>| value.filter(|v| *v > 0.0);
        let pupil = positive(stated.entrance_pupil).map(StatedBeam::EntrancePupil);
        let beam = pupil.or(positive(stated.image_f_number).map(StatedBeam::FNumber));
        draft.lens.stated_beam = beam;
        draft.state_wavelengths(&stated.wavelengths_nm, &stated.wavelength_weights, 0);
        draft.lens.iris = self.iris(stated.iris.unwrap_or_default())?;
        draft.lens.zoom = self.zoom(stated.zoom.unwrap_or_default(), rows.len())?;
        draft.lens.focus_group = self.focus_group(stated.focus_group, rows.len())?;
        draft.fold();
        if unit != 1.0 {
            draft.lens = draft.lens.scaled(unit);
        }
        self.file.finish(draft, sink)
    }

    /// The fields of the lens apart from its surfaces and its design data.
    fn lens_fields(&self, root: &Value) -> Result<LensFields> {
        let empty = Map::new();
        fields(root.as_object().unwrap_or(&empty)).map_err(|(name, expected)| {
            let span = self.file.find(&format!("\"{name}\""));
            let message = format!("`{name}` can't be read: something in it is not {expected}");
            self.file.fail(span, message)
        })
    }

    fn object_medium(&self, stated: &LensFields) -> Result<Medium> {
        let medium = match stated.n_object {
            Some(n) if !(n >= 0.999) => {
                return Err(self.fail(None, format!("`n_object` is {n}, less than 1")));
            }
            Some(n) => Medium::constant(n),
            None => Medium::air(),
        };
        match &stated.object_medium {
            Some(row) => self.medium(0, &self.fields(0, row)?, &medium, false),
            None => Ok(medium),
        }
    }

    /// The fields of a surface.
    fn fields(&self, i: usize, row: &Map<String, Value>) -> Result<SurfaceFields> {
        fields(row).map_err(|(name, expected)| {
            let value = row.get(name).unwrap_or(&Value::Null);
            let message = format!("surface {i}: `{name}` is {value}, which is not {expected}");
            self.file.fail(self.places.value(i, &[name]), message)
        })
    }

    /// Refuses a list of surfaces of another program: a surface that has no thickness or no index
    /// under a name that is known here. The stop may do without, and so may the last of several; a
    /// single surface may do without one of them.
    fn refuse_foreign(&self, root: &Value, rows: &[Value]) -> Result<()> {
        let checked = rows.len().saturating_sub(1).max(1);
        for (i, row) in rows.iter().take(checked).enumerate() {
            let has = |keys: &[&str]| keys.iter().any(|key| row.get(key).is_some());
            let is_stop = row.get("kind").and_then(Value::as_str) == Some("stop");
            let missing = match (
                has(&["t", "thickness"]),
                has(&["n_d", "n", "glass", "mirror"]),
            ) {
                (true, true) => continue,
                (true, false) | (false, true) if rows.len() == 1 => continue,
                _ if is_stop || !row.is_object() => continue,
                (false, false) => "neither a thickness `t` nor an index `n_d`",
                (false, true) => "no thickness `t`",
                (true, false) => "no index `n_d` and no `glass`",
            };
            let error = self.fail(Some(i), format!("surface {i} has {missing}"));
            return Err(error.with_help(match foreign(root) {
                Some(name) => format!("this seems to be a file of {name}, which is not read"),
                None => "ivcam reads JSON of the schema `ivlens-1`, ISET, rayoptics and optiland"
                    .to_owned(),
            }));
        }
        Ok(())
    }

    fn surface(&self, i: usize, row: &Value, before: &Medium, coating: Coating) -> Result<Surface> {
        let Some(row) = row.as_object() else {
            return Err(self.fail(Some(i), format!("surface {i} is not an object")));
        };
        let fields = self.fields(i, row)?;
        let kind = fields.kind.as_deref();
        if let Some(kind) = kind.filter(|k| !KINDS.contains(k)) {
            let message = format!("surface {i} is of the unknown kind `{kind}`");
            let error = self.fail(Some(i), message);
            return Err(error.with_help(spelling(kind, "kinds", &KINDS)));
        }
        let is_stop = kind == Some("stop") || fields.stop == Some(true);
        let radius = fields.r.or(fields.radius).map(Curvature::from_radius);
        let curvature = fields.c.or(fields.curvature).map(Curvature::from_curvature);
        let curvature = match radius.or(curvature) {
            _ if matches!(kind, Some("plane" | "thin_lens")) => Curvature::PLANE,
            Some(curvature) => curvature,
            None if kind.is_none_or(|k| k == "stop") => Curvature::PLANE,
            None => return Err(self.fail(Some(i), format!("surface {i} has no radius `R`"))),
        };
        let thickness = fields.t.or(fields.thickness).unwrap_or(0.0);
        let is_mirror = fields.mirror == Some(true);
        let medium = match is_mirror {
            true => before.clone(),
            false => self.medium(i, &fields, before, is_stop)?,
        };
        let mut semi_diameter = fields.semi_diameter.or(fields.a).unwrap_or(f64::INFINITY);
        let mut plane = Surface::sphere(0.0, 0.0, Medium::air(), semi_diameter);
        if let Some(corners) = &fields.outline {
            plane.set_outline(corners.iter().copied().map(DVec2::from_array).collect());
            semi_diameter = semi_diameter.min(plane.semi_diameter);
        }
        Ok(Surface {
            shape: self.shape(i, &fields)?,
            curvature,
            obstruction: fields.obstruction.unwrap_or(0.0),
            is_stop,
            is_mirror,
            frame: frame(&fields).boxed(),
            coating: self
                .coating(fields.coating.as_ref(), Some(i))?
                .unwrap_or(coating),
            span: self.places.object(i),
            outline: plane.outline,
            ..Surface::sphere(0.0, thickness, medium, semi_diameter)
        })
    }

    /// Warns of unknown fields of a surface, which are probably misspelt.
    fn warn_of_unknown_fields(&self, i: usize, row: &Value, sink: &mut Sink) {
        let known: Vec<&str> = FIELDS.split(' ').collect();
        for name in unknown(row, &known).filter(|name| !name.starts_with("A4")) {
            let message = format!("surface {i}: there is no field `{name}`; it is not read");
            sink.warn(self.places.value(i, &[name]), message)
                .help(spelling(name, "fields", &known));
        }
    }

    /// Warns of unknown fields beside the surfaces, of the iris and of zoom positions.
    fn warn_of_unknown_lens_fields(&self, root: &Value, sink: &mut Sink) {
        let own: Vec<&str> = LENS_FIELDS.split(' ').chain(KEYS).collect();
        let iris = root.get("iris").map(|iris| (iris, IRIS_FIELDS));
        let zoom = root.get("zoom").and_then(Value::as_array);
        let zoom = zoom.into_iter().flatten().map(|zoom| (zoom, ZOOM_FIELDS));
        let inner = iris.into_iter().chain(zoom);
        let inner = inner.map(|(object, names)| (object, names.split(' ').collect()));
        for (object, known) in std::iter::once((root, own)).chain(inner) {
            for name in unknown(object, &known).take(MOST_UNKNOWN) {
                let message = format!("there is no field `{name}`; it is not read");
                sink.warn(self.file.find(&format!("\"{name}\"")), message)
                    .help(spelling(name, "fields", &known));
            }
        }
    }

    /// Warns of fields that have no effect beside the others of a surface.
    fn warn_of_idle_fields(&self, i: usize, row: &Value, sink: &mut Sink) -> Result<()> {
        let Some(row) = row.as_object() else {
            return Ok(());
        };
        let fields = self.fields(i, row)?;
        for (name, _, why) in IDLE.iter().filter(|(_, is_idle, _)| is_idle(&fields)) {
            let message = format!("surface {i}: `{name}` is not read: {why}");
            sink.warn(self.places.value(i, &[name]), message);
        }
        Ok(())
    }

    /// The medium behind a surface. A stop without an index, or with 0, keeps the medium in front
    /// of it, and a glass that has only a name is looked up in the catalogue.
    fn medium(
        &self,
        i: usize,
        fields: &SurfaceFields,
        before: &Medium,
        is_stop: bool,
    ) -> Result<Medium> {
        let n_d = fields.n_d.or(fields.n);
        if let (None, Some(name)) = (n_d, &fields.glass) {
            return self.file.glass(name, self.places.value(i, &["glass"]));
        }
        if n_d.is_none_or(|n| n == 0.0) && is_stop {
            return Ok(before.clone());
        }
        let n_d = n_d.unwrap_or(1.0);
        let mut medium = match (fields.n_f, fields.n_c) {
            (Some(n_f), Some(n_c)) => Medium::from_lines(n_f, n_d, n_c),
            _ => Medium::from_index(n_d, fields.abbe),
        };
        if let Some([a, b]) = fields.cauchy.as_deref() {
            medium.dispersion = Dispersion::Cauchy { a: *a, b: *b };
        }
        let table = fields.indices.as_deref().filter(|pairs| pairs.len() > 1);
        if let Some(glass) = table.and_then(index_table::medium) {
            // A table that does not reach the d line has no index there.
            let stated = fields.n_d.or(fields.n);
            medium = match stated.filter(|_| glass.doubt_at(D_LINE).is_some()) {
                Some(n_d) => Medium { n_d, ..glass },
                None => glass,
            };
        }
        if let Some((formula, k)) = self.curve(i, fields)? {
            let k = std::array::from_fn(|j| k.get(j).copied().unwrap_or(0.0));
            if let Some(glass) = Medium::from_formula(formula, k) {
                medium = Medium { n_d, ..glass };
            }
        }
        Ok(medium.named(fields.glass.as_deref().unwrap_or("")))
    }

    /// The formula of a surface's glass, and its coefficients.
    fn curve<'f>(
        &self,
        i: usize,
        fields: &'f SurfaceFields,
    ) -> Result<Option<(Formula, &'f [f64])>> {
        let listed = fields.coefficients.as_deref().unwrap_or(&[]);
        let sellmeier = fields.sellmeier.as_deref().filter(|k| k.len() == 6);
        let formula = fields.formula.map(|n| Formula::from_number(n as u32));
        match formula {
            Some(Some(formula)) if !listed.is_empty() => Ok(Some((formula, listed))),
            Some(None) => {
                let message = format!("surface {i} names no known dispersion formula");
                Err(self.fail(Some(i), message))
            }
            _ => Ok(sellmeier.map(|k| (Formula::Sellmeier1, k))),
        }
    }

    fn shape(&self, i: usize, fields: &SurfaceFields) -> Result<Shape> {
        let k = fields.k.unwrap_or(0.0);
        let terms = self.terms(i, fields)?;
        Ok(match fields.kind.as_deref() {
            Some("thin_lens") => {
                let Some(focal_length) = fields.focal_length else {
                    let message = format!("surface {i} is an ideal lens without `focal_length`");
                    return Err(self.fail(Some(i), message));
                };
                Shape::ThinLens { focal_length }
            }
            Some("cyl_x") => Shape::CylinderX,
            Some("cyl_y") => Shape::CylinderY,
            Some("toroid") => {
                let across = match fields.curvature_x {
                    Some(c) => Curvature::from_curvature(c),
                    None => Curvature::from_radius(fields.radius_x.unwrap_or(0.0)),
                };
                Shape::Toroid { across, k, terms }
            }
            Some("normal_asphere") => match (1..=MAX_POWER).step_by(2).find(|p| terms[*p] != 0.0) {
                None => Shape::NormalAsphere { k, terms },
                Some(odd) => {
                    let message = format!("surface {i}: the term r^{odd} has an odd power");
                    let help = "a `normal_asphere` has even powers of r";
                    return Err(self.fail(Some(i), message).with_help(help));
                }
            },
            _ => Shape::rotational(k, terms),
        })
    }

    /// The coefficients of the powers of r: the list of even ones from r^4, and those that are
    /// given by their powers.
    fn terms(&self, i: usize, fields: &SurfaceFields) -> Result<Box<[f64; MAX_POWER + 1]>> {
        let even = fields.even_terms.iter().flatten().copied();
        let mut terms: Vec<(usize, f64)> = (4..).step_by(2).zip(even).collect();
        for (power, value) in fields.radial_poly.iter().flatten() {
            let Ok(power) = power.parse() else {
                let message = format!("surface {i}: `{power}` is not a power of r");
                return Err(self.fail(Some(i), message));
            };
            terms.push((power, *value));
        }
        if let Some((power, _)) = terms.iter().find(|(power, _)| *power > MAX_POWER) {
            let message = format!("surface {i}: the term r^{power} can't be used");
            let help = format!("powers of r go from 1 to {MAX_POWER}");
            return Err(self.fail(Some(i), message).with_help(help));
        }
        Ok(polynomial(terms))
    }

    /// The coating of a surface, or of all surfaces without one of their own.
    fn coating(&self, word: Option<&Value>, surface: Option<usize>) -> Result<Option<Coating>> {
        let Some(word) = word else {
            return Ok(None);
        };
        match word.as_str().and_then(Coating::named) {
            Some(coating) => Ok(Some(coating)),
            None => Err(self
                .fail(surface, format!("{word} is not a coating"))
                .with_help("coatings are \"none\", \"mgf2\" and \"ideal\"")),
        }
    }

    fn zoom(&self, list: Vec<ZoomFields>, count: usize) -> Result<Vec<ZoomPosition>> {
        let position = |ZoomFields { name, gaps, stop }| {
            let gap = |(surface, gap): (&String, &Value)| {
                let number = surface.parse().ok().filter(|i: &usize| *i < count);
                let message = match (number, gap.as_f64()) {
                    (Some(number), Some(gap)) => return Ok((number, gap)),
                    (None, _) => format!("there is no surface `{surface}`"),
                    _ => format!("the gap behind surface {surface} is {gap}, not a number"),
                };
                let message = format!("zoom position `{name}`: {message}");
                Err(at_zoom_list(Diagnostic::error(message), self.file.source))
            };
            let mut gaps: Vec<(usize, f64)> = gaps.iter().map(gap).collect::<Result<_>>()?;
            gaps.sort_by_key(|(surface, _)| *surface);
            Ok(ZoomPosition {
                name,
                gaps,
                stop_semi_diameter: stop,
            })
        };
        list.into_iter().map(position).collect()
    }

    /// `"focus_group": [first, last]`
    fn focus_group(&self, stated: Option<Value>, count: usize) -> Result<Option<FocusGroup>> {
        let Some(stated) = stated else {
            return Ok(None);
        };
        match <[f64; 2]>::deserialize(&stated).map(|ends| ends.map(|end| end as usize)) {
            Ok([first, last]) if first <= last && last < count => {
                Ok(Some(FocusGroup { first, last }))
            }
            _ => {
                let message = "`focus_group` is not the first and the last of some surfaces";
                Err(self.file.fail(self.file.find("\"focus_group\""), message))
            }
        }
    }

    fn iris(&self, iris: IrisFields) -> Result<Iris> {
        let rotation = iris.rotation_deg.to_radians();
        match (iris.blades.map(u32::try_from), iris.outline.len()) {
            (Some(Ok(count @ 3..=1000)), _) => Ok(Iris::Blades { count, rotation }),
            (Some(_), _) => {
                let count = iris.blades.unwrap_or(0);
                let message = format!("an iris of {count} blades can't be made");
                Err(self.fail(None, message).with_help("give 3 blades or more"))
            }
            (None, 0) => Ok(Iris::Round),
            (None, 1 | 2) => {
                let message = "the outline of the iris has less than 3 corners";
                Err(self.fail(None, message))
            }
            (None, _) => Ok(Iris::Outline {
                corners: iris.outline,
                rotation,
            }),
        }
    }
}

/// How a surface is decentered.
fn frame(fields: &SurfaceFields) -> SurfaceFrame {
    let decenter = |shift: Option<[f64; 3]>, tilt: Option<[f64; 3]>| Decenter {
        shift: shift.map_or(DVec3::ZERO, DVec3::from_array),
        tilt: tilt.map_or(DVec3::ZERO, DVec3::from_array),
    };
    SurfaceFrame {
        before: decenter(fields.decenter, fields.tilt),
        after: decenter(fields.decenter_after, fields.tilt_after),
    }
}

/// The program whose JSON this seems to be, by the names of its fields.
fn foreign(root: &Value) -> Option<&'static str> {
    const SIGNS: [(&str, &str); 6] = [
        ("d_next", "DeepLens"),
        ("mat2", "DeepLens"),
        ("roc", "DeepLens"),
        ("radiusOfCurvature", "a web lens editor"),
        ("semiDiameter", "a web lens editor"),
        ("refractive_index", "another program"),
    ];
    let rows = root.get("surfaces")?.as_array()?;
    let has = |key: &str| rows.iter().any(|row| row.get(key).is_some());
    SIGNS
        .iter()
        .find(|(key, _)| has(key))
        .map(|(_, name)| *name)
}

/// The design data of the file, as comments of a `.dat` file.
fn notes(root: &Value) -> Vec<String> {
    let stated = |key: &str| root.get(key).and_then(Value::as_str).map(str::to_owned);
    let title = stated("title").map(|title| format!("name: {title}"));
    let others = KEYS.iter().skip(1);
    let others = others.filter_map(|key| stated(key).map(|value| format!("{key}: {value}")));
    let list = root.get("note").and_then(Value::as_array);
    let listed = list.into_iter().flatten().filter_map(Value::as_str);
    let named = title.into_iter().chain(others).chain(stated("note"));
    named.chain(listed.map(str::to_owned)).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use ivcam_base::diag::Source;

    use super::*;
    use crate::prescription::formats::reading::Reading;

    fn parse(text: &str) -> Result<Prescription> {
        let source = &Arc::new(Source::new("a.json", text.as_bytes().to_vec()));
        let options = &Reading::default();
        read(PrescriptionReader { source, options }, &mut Sink::new())
    }

    #[test]
    fn all_kinds_of_surface_are_read() {
        let lens = parse(
            r#"{"schema": "ivlens-1", "name": "zoo", "n_object": 1.33, "surfaces": [
              {"kind": "plane", "R": 0, "t": 1, "n_d": 1.5, "semi_diameter": 9},
              {"kind": "asphere", "R": 9, "t": 1, "n_d": 1, "semi_diameter": 3, "k": -1,
               "radial_poly": {"3": 0.5}},
              {"kind": "asphere", "R": 9, "t": 1, "n_d": 1.5, "V_d": 60, "A4_A6_..": [1, 2]},
              {"kind": "stop", "t": 1, "semi_diameter": 3},
              {"kind": "cyl_x", "R": 9, "t": 1, "n_d": 1.4},
              {"kind": "toroid", "R": 9, "R_x": 8, "t": 1, "n_d": 1}]}"#,
        )
        .unwrap();
        assert_eq!(lens.object_medium.n_d, 1.33);
        assert!(
            matches!(&lens.surfaces[1].shape, Shape::Asphere { terms, k } if terms[3] == 0.5 && *k == -1.0)
        );
        assert!(matches!(&lens.surfaces[2].shape, Shape::Asphere { terms, .. } if terms[6] == 2.0));
        assert_eq!((lens.stop(), lens.surfaces[3].medium.n_d), (Some(3), 1.5));
        assert_eq!(lens.surfaces[4].semi_diameter, f64::INFINITY);
        assert!(matches!(lens.surfaces[5].shape, Shape::Toroid { .. }));
    }

    #[test]
    fn a_field_that_has_no_effect_is_named() {
        let warned = |text: &str| {
            let source = &Arc::new(Source::new("a.json", text.as_bytes().to_vec()));
            let (options, mut sink) = (&Reading::default(), Sink::new());
            read(PrescriptionReader { source, options }, &mut sink).unwrap();
            let found = sink.items().iter().map(|d| d.message.clone());
            found.filter(|m| m.contains("not read")).collect::<Vec<_>>()
        };
        let row = r#""t": 1, "n_d": 1.5, "a": 9"#;
        for (name, fields) in [
            ("R", r#""kind": "plane", "R": -25"#),
            ("k", r#""kind": "cyl_x", "R": 9, "k": 1"#),
            (
                "radial_poly",
                r#""kind": "cyl_x", "R": 9, "radial_poly": {"4": 1}"#,
            ),
            ("n_F", r#""R": 9, "n_F": 1.6"#),
            ("cauchy", r#""R": 9, "cauchy": [1.5]"#),
            ("sellmeier", r#""R": 9, "sellmeier": [1, 2, 3, 4, 5]"#),
            ("formula", r#""R": 9, "formula": 2"#),
            ("coefficients", r#""R": 9, "coefficients": [2]"#),
            ("indices", r#""R": 9, "indices": [[500, 1.6]]"#),
            (
                "focal_length",
                r#""kind": "toroid", "R": 9, "focal_length": 50"#,
            ),
            ("R_x", r#""R": 9, "R_x": 9"#),
        ] {
            let found = warned(&format!(r#"{{"surfaces": [{{{fields}, {row}}}]}}"#));
            assert_eq!(found.len(), 1, "{fields}: {found:?}");
            assert!(
                found[0].starts_with(&format!("surface 0: `{name}` is not read")),
                "{found:?}"
            );
        }
        for (name, beside) in [
            ("wavelength_nm", r#""wavelength_nm": [900]"#),
            ("focusgroup", r#""focusgroup": [0, 0]"#),
            ("blade", r#""iris": {"blade": 6}"#),
            ("gap", r#""zoom": [{"name": "a", "gap": {"0": 1}}]"#),
        ] {
            let found = warned(&format!(r#"{{"surfaces": [{{"R": 9, {row}}}], {beside}}}"#));
            assert_eq!(
                found,
                [format!("there is no field `{name}`; it is not read")]
            );
        }
        let whole = r#"{"schema": "ivlens-1", "name": "a", "title": "b", "year": "1900", "note": ["c"],
            "units": "mm", "n_object": 1, "h_max": 9, "half_field_deg": 5, "entrance_pupil": 3,
            "wavelengths_nm": [550], "wavelength_weights": [1], "coating": "none",
            "iris": {"blades": 6, "rotation_deg": 5}, "zoom": [{"name": "x", "gaps": {"0": 1}, "stop": 1}],
            "focus_group": [0, 0], "surfaces": [{"kind": "plane", "R": 0, "k": 0, "t": 1, "n_d": 1.5, "a": 9}]}"#;
        assert_eq!(warned(whole), [""; 0]);
    }

    #[test]
    fn a_table_of_the_infrared_leaves_the_stated_index_at_the_d_line() {
        let row = r#""R": 9, "t": 1, "a": 9, "indices": [[1310, 1.45], [1550, 1.44]]"#;
        let index = |more: &str, nm: f64| {
            let lens = parse(&format!(r#"{{"surfaces": [{{{row}{more}}}]}}"#)).unwrap();
            lens.surfaces[0].medium.index(nm)
        };
        assert_eq!(index(r#", "n_d": 1.47"#, 587.5618), 1.47);
        assert_eq!(index(r#", "n_d": 1.47"#, 1550.0), 1.44);
    }

    #[test]
    fn a_bad_value_is_named_by_line_and_column() {
        for (text, at) in [
            ("{\"surfaces\": [", (1, 14)),
            ("{\"surfaces\": []}", (1, 1)),
            (
                "{\"surfaces\": [\n{\"R\": 5, \"n_d\": 0.5, \"a\": 2}]}",
                (2, 17),
            ),
            (
                "{\"surfaces\": [\n{\"R\": 5, \"n_d\": 1.5, \"a\": -2}]}",
                (2, 27),
            ),
            (
                "{\"surfaces\": [\n{\"kind\": \"spere\", \"t\": 5}]}",
                (2, 1),
            ),
            ("{\"surfaces\": [\n{\"R\": \"5\", \"n\": 2}]}", (2, 7)),
            ("{\"surfaces\": [\n{\"R\": NaN, \"a\": 2}]}", (2, 7)),
            (
                "{\"surfaces\": [\n{\"R\": 5, \"n\": 2}],\n\"zoom\": [{\"gaps\": {\"1\": 2}}]}",
                (3, 1),
            ),
            (
                "{\"surfaces\": [\n{\"R\": 5, \"n\": 2}],\n\"focus_group\": [0, 1]}",
                (3, 1),
            ),
        ] {
            let error = parse(text).unwrap_err();
            assert_eq!(error.location().1, Some(at), "{text}: {error}");
        }
    }

    /// `FIELDS` has the names of all fields of a surface: none of them may be a list of an object.
    #[test]
    fn a_field_of_another_type_is_named() {
        for field in FIELDS.split(' ').filter(|field| *field != "i") {
            let text =
                format!("{{\"schema\": \"ivlens-1\", \"surfaces\": [\n{{\"{field}\": [{{}}]}}]}}");
            let error = parse(&text).unwrap_err();
            assert!(error.message.contains("[{}]"), "{field}: {error}");
            assert_eq!(error.location().1.unwrap().0, 2, "{field}: {error}");
        }
        for (field, says) in [
            (
                "\"zoom\": 5",
                "`zoom` can't be read: something in it is not a list",
            ),
            ("\"iris\": 5", "is not an object"),
            ("\"iris\": {\"blades\": 7.5}", "is not a whole number"),
            (
                "\"units\": 1",
                "`units` can't be read: something in it is not a string",
            ),
        ] {
            let error = parse(&format!("{{\"surfaces\": [],\n{field}}}")).unwrap_err();
            assert!(error.message.contains(says), "{error}");
            assert_eq!(error.location().1, Some((2, 1)), "{error}");
        }
    }
}
