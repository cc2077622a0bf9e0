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
//! `coefficients`, or a `glass` named without an index. A missing `semi_diameter` does not limit.
//! `coating` is none, mgf2 or ideal. It belongs to a surface or, beside `surfaces`, to all surfaces
//! without one.

use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result, Sink, Source, Span, nearest};
use ivcam_base::math::LengthUnit;
use serde_json::{Map, Value};

use crate::prescription::formats::format::Format;
use crate::prescription::glass::catalogue::Catalogue;
use crate::prescription::glass::coating::Coating;
use crate::prescription::glass::medium::{Dispersion, Formula, Medium};
use crate::prescription::prescription::{
    Column, FocusGroup, Iris, Prescription, ZoomPosition, check, check_count,
};
use crate::prescription::surface::{Curvature, MAX_POWER, Shape, Surface};

const KINDS: [&str; 8] = [
    "sphere", "plane", "stop", "conic", "asphere", "cyl_x", "cyl_y", "toroid",
];

/// Fields of a surface, beside lists that begin with `A4`, and which of them are numbers.
const FIELDS: [(&str, bool); 26] = [
    ("i", false),
    ("kind", false),
    ("R", true),
    ("radius", true),
    ("c", true),
    ("curvature", true),
    ("t", true),
    ("thickness", true),
    ("n_d", true),
    ("n", true),
    ("V_d", true),
    ("n_F", true),
    ("n_C", true),
    ("glass", false),
    ("cauchy", false),
    ("sellmeier", false),
    ("formula", true),
    ("coefficients", false),
    ("semi_diameter", true),
    ("a", true),
    ("stop", false),
    ("k", true),
    ("radial_poly", false),
    ("R_x", true),
    ("c_x", true),
    ("coating", false),
];
/// ivcam's own JSON, schema `ivlens-1`.
pub(crate) static FORMAT: Format = Format {
    name: "JSON",
    recognizes: |text| text.trim_start().starts_with('{'),
    read: |source, how, sink| read(source, &how.glasses, sink),
};

/// Reads a prescription of schema `ivlens-1`.
fn read(source: &Arc<Source>, glasses: &Catalogue, sink: &mut Sink) -> Result<Prescription> {
    let root = parse(source)?;
    let places = Places::new(source);
    let reader = Reader {
        source,
        places: &places,
        glasses,
    };
    let mut lens = reader.lens(&root, sink)?;
    check(&mut lens, source, sink, |surface, column| {
        places.of(surface, column)
    })?;
    Ok(lens)
}

/// Parses a JSON text.
pub(super) fn parse(source: &Arc<Source>) -> Result<Value> {
    serde_json::from_slice(&source.bytes).map_err(|error| {
        let offset = offset_of(&source.bytes, error.line(), error.column());
        let rest = source.bytes.get(offset..).unwrap_or_default();
        let no_number = ["NaN", "Infinity", "-Infinity", "nan", "inf", "-inf"]
            .into_iter()
            .find(|word| rest.starts_with(word.as_bytes()));
        let message = match no_number {
            Some(word) => format!("`{word}` is not a number"),
            None => format!("this is not valid JSON: {}", reason(&error)),
        };
        Diagnostic::error(message).at(source, Span::at(offset))
    })
}

/// The message of serde_json without its position, because the diagnostic has its own.
fn reason(error: &serde_json::Error) -> String {
    let text = error.to_string();
    text.rsplit_once(" at line")
        .map_or(text.clone(), |(reason, _)| reason.to_owned())
}

fn offset_of(bytes: &[u8], line: usize, column: usize) -> usize {
    let start: usize = bytes
        .split_inclusive(|&b| b == b'\n')
        .take(line.saturating_sub(1))
        .map(<[u8]>::len)
        .sum();
    (start + column.saturating_sub(1)).min(bytes.len())
}

struct Reader<'a> {
    source: &'a Arc<Source>,
    places: &'a Places,
    glasses: &'a Catalogue,
}

impl Reader<'_> {
    fn fail(&self, surface: Option<usize>, message: String) -> Box<Diagnostic> {
        let span = surface.map_or(Span::at(0), |i| self.places.object(i));
        Diagnostic::error(message).at(self.source, span)
    }

    fn lens(&self, root: &Value, sink: &mut Sink) -> Result<Prescription> {
        let schema = root.get("schema").and_then(Value::as_str);
        if schema.is_some_and(|s| s != "ivlens-1") {
            let message = format!("the schema `{}` is not `ivlens-1`", schema.unwrap_or(""));
            return Err(self.fail(None, message));
        }
        let rows = root
            .get("surfaces")
            .and_then(Value::as_array)
            .ok_or_else(|| {
                self.fail(None, "there is no list of `surfaces`".into())
                    .with_help("ivcam reads JSON prescriptions of schema `ivlens-1`")
            })?;
        let unit = match root.get("units").and_then(Value::as_str) {
            None => 1.0,
            Some(name) => LengthUnit::parse(name)
                .ok_or_else(|| {
                    self.fail(None, format!("`{name}` is not a unit of length"))
                        .with_help("mm, cm, in or m")
                })?
                .millimeters(),
        };
        let mut medium = match number(root, &["n_object"]) {
            Some(n) if n >= 0.999 && n.is_finite() => Medium::constant(n),
            Some(n) => return Err(self.fail(None, format!("`n_object` is {n}, less than 1"))),
            None => Medium::air(),
        };
        if let Some(row) = root.get("object_medium") {
            medium = self.medium(0, row, &medium, false)?;
        }
        let object_medium = medium.clone();
        let coating = self.coating(root, None)?.unwrap_or_default();
        check_count(rows.len(), self.source)?;
        if schema.is_none() {
            self.refuse_foreign(root, rows)?;
        }
        let mut surfaces = Vec::with_capacity(rows.len());
        for (i, row) in rows.iter().enumerate() {
            let surface = self.surface(i, row, &medium, coating)?;
            self.warn_of_unknown_fields(i, row, sink);
            medium = surface.medium.clone();
            surfaces.push(surface);
        }
        let name = root.get("name").and_then(Value::as_str);
        let name = name.map_or_else(
            || crate::prescription::formats::origin::name_of(self.source),
            str::to_owned,
        );
        let mut lens = Prescription {
            object_medium,
            ..Prescription::new(name, surfaces)
        };
        lens.notes = notes(root);
        lens.image_height = number(root, &["h_max"]).filter(|h| *h > 0.0);
        lens.iris = self.iris(root)?;
        lens.zoom = self.zoom(root, lens.surfaces.len())?;
        lens.focus_group = focus_group(root, lens.surfaces.len());
        if root.get("focus_group").is_some_and(|g| !g.is_null()) && lens.focus_group.is_none() {
            let message = "`focus_group` is not the first and the last of some surfaces";
            let key = "\"focus_group\"".as_bytes();
            let mut windows = self.source.bytes.windows(key.len());
            let at = windows.position(|w| w == key).unwrap_or(0);
            return Err(Diagnostic::error(message).at(self.source, Span::new(at, at + key.len())));
        }
        Ok(if unit == 1.0 { lens } else { lens.scaled(unit) })
    }

    /// Refuses a list of surfaces of another program: a surface, other than the stop and the last,
    /// that has no thickness or no index under a name that is known here.
    fn refuse_foreign(&self, root: &Value, rows: &[Value]) -> Result<()> {
        let inner = rows.len().saturating_sub(1);
        for (i, row) in rows.iter().take(inner).enumerate() {
            let has = |keys: &[&str]| keys.iter().any(|key| row.get(key).is_some());
            let is_stop = row.get("kind").and_then(Value::as_str) == Some("stop");
            let missing = match (has(&["t", "thickness"]), has(&["n_d", "n", "glass"])) {
                (true, true) => continue,
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
        let Some(row_map) = row.as_object() else {
            return Err(self.fail(Some(i), format!("surface {i} is not an object")));
        };
        let kind = row.get("kind").and_then(Value::as_str);
        if let Some(kind) = kind.filter(|k| !KINDS.contains(k)) {
            let help = match nearest(kind, KINDS) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("the kinds are {}", KINDS.join(", ")),
            };
            let message = format!("surface {i} is of the unknown kind `{kind}`");
            return Err(self.fail(Some(i), message).with_help(help));
        }
        self.check_numbers(i, row_map)?;
        let is_stop = kind == Some("stop") || row.get("stop") == Some(&Value::Bool(true));
        let curvature = match (
            number(row, &["R", "radius"]),
            number(row, &["c", "curvature"]),
        ) {
            _ if kind == Some("plane") => Curvature::PLANE,
            (Some(radius), _) => Curvature::from_radius(radius),
            (None, Some(c)) => Curvature::from_curvature(c),
            (None, None) if kind.is_none_or(|k| k == "stop") => Curvature::PLANE,
            (None, None) => {
                return Err(self.fail(Some(i), format!("surface {i} has no radius `R`")));
            }
        };
        let medium = self.medium(i, row, before, is_stop)?;
        let semi_diameter = match row.get("semi_diameter").or(row.get("a")) {
            None | Some(Value::Null) => f64::INFINITY,
            Some(value) => value.as_f64().unwrap_or(f64::NAN),
        };
        Ok(Surface {
            shape: self.shape(i, kind, row_map)?,
            curvature,
            thickness: number(row, &["t", "thickness"]).unwrap_or(0.0),
            medium,
            semi_diameter,
            is_stop,
            coating: self.coating(row, Some(i))?.unwrap_or(coating),
            span: self.places.object(i),
        })
    }

    /// Warns of a number in quotes, which would otherwise be ignored.
    fn check_numbers(&self, i: usize, row: &Map<String, Value>) -> Result<()> {
        for (name, value) in row {
            let is_list = ["sellmeier", "coefficients", "cauchy"].contains(&name.as_str());
            let right = match value {
                Value::Null => true,
                Value::Array(list) if is_list || name.starts_with("A4") => {
                    list.iter().all(Value::is_number)
                }
                value if FIELDS.contains(&(name.as_str(), true)) => value.is_number(),
                _ => true,
            };
            if !right {
                let span = self.places.value(i, &[&format!("\"{name}\"")]);
                let message = format!("surface {i}: `{name}` is {value}, which is not a number");
                return Err(Diagnostic::error(message).at(self.source, span));
            }
        }
        Ok(())
    }

    /// `"zoom": [{"name": "14 mm", "gaps": {"4": 1.5}, "stop": 5.6}, …]`
    fn zoom(&self, root: &Value, count: usize) -> Result<Vec<ZoomPosition>> {
        let list = root.get("zoom").and_then(Value::as_array);
        let mut positions = Vec::new();
        for position in list.into_iter().flatten() {
            let stated = |key: &str| position.get(key).and_then(Value::as_str).unwrap_or("");
            let name = stated("name").to_owned();
            let mut gaps = Vec::new();
            let listed = position.get("gaps").and_then(Value::as_object);
            for (surface, gap) in listed.into_iter().flatten() {
                let number = surface.parse().ok().filter(|i: &usize| *i < count);
                let (Some(number), Some(gap)) = (number, gap.as_f64()) else {
                    let message = match number {
                        None => format!("there is no surface `{surface}`"),
                        Some(_) => {
                            format!("the gap behind surface {surface} is {gap}, not a number")
                        }
                    };
                    let message = format!("zoom position `{name}`: {message}");
                    let error = Diagnostic::error(message).at(self.source, Span::at(0));
                    return Err(crate::prescription::formats::origin::at_zoom_list(
                        error,
                        self.source,
                    ));
                };
                gaps.push((number, gap));
            }
            gaps.sort_by_key(|(surface, _)| *surface);
            positions.push(ZoomPosition {
                name,
                gaps,
                stop_semi_diameter: number(position, &["stop"]),
            });
        }
        Ok(positions)
    }

    /// Warns of an unknown field, which is probably misspelt.
    fn warn_of_unknown_fields(&self, i: usize, row: &Value, sink: &mut Sink) {
        let fields = FIELDS.map(|(name, _)| name);
        let names = row.as_object().into_iter().flatten().map(|(name, _)| name);
        for name in names {
            if fields.contains(&name.as_str()) || name.starts_with("A4") {
                continue;
            }
            let span = self.places.value(i, &[&format!("\"{name}\"")]);
            let message = format!("surface {i}: there is no field `{name}`; it is not read");
            let help = match nearest(name, fields) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("the fields are {}", fields.join(", ")),
            };
            let warning = Diagnostic::warning(message).at(self.source, span);
            sink.add(*warning.with_help(help));
        }
    }

    /// The medium behind a surface. A stop without an index, or with 0, keeps the medium in front
    /// of it, and a glass that has only a name is looked up in the catalogue.
    fn medium(&self, i: usize, row: &Value, before: &Medium, is_stop: bool) -> Result<Medium> {
        let n_d = number(row, &["n_d", "n"]);
        let name = row.get("glass").and_then(Value::as_str);
        if let (None, Some(name)) = (n_d, name) {
            let span = self.places.value(i, &["\"glass\""]);
            return self.glasses.get(name, self.source, span);
        }
        if n_d.is_none_or(|n| n == 0.0) && is_stop {
            return Ok(before.clone());
        }
        let n_d = n_d.unwrap_or(1.0);
        let lines = (number(row, &["n_F"]), number(row, &["n_C"]));
        let mut medium = match (lines, number(row, &["V_d"])) {
            ((Some(n_f), Some(n_c)), _) => Medium::from_lines(n_f, n_d, n_c),
            (_, Some(abbe)) if abbe > 0.0 => Medium::from_abbe(n_d, abbe),
            _ => Medium::constant(n_d),
        };
        if let [a, b] = numbers(row.get("cauchy"))[..] {
            medium.dispersion = Dispersion::Cauchy { a, b };
        }
        let sellmeier = numbers(row.get("sellmeier"));
        let listed = numbers(row.get("coefficients"));
        let formula = number(row, &["formula"]).map(|n| Formula::from_number(n as u32));
        let curve = match formula {
            Some(Some(formula)) if !listed.is_empty() => Some((formula, listed)),
            Some(None) => {
                let message = format!("surface {i} names no known dispersion formula");
                return Err(self.fail(Some(i), message));
            }
            _ if sellmeier.len() == 6 => Some((Formula::Sellmeier1, sellmeier)),
            _ => None,
        };
        if let Some((formula, k)) = curve {
            let k = std::array::from_fn(|j| k.get(j).copied().unwrap_or(0.0));
            if let Some(glass) = Medium::from_formula(formula, k) {
                medium = Medium { n_d, ..glass };
            }
        }
        Ok(match name {
            Some(name) => medium.named(name),
            None => medium,
        })
    }

    fn shape(&self, i: usize, kind: Option<&str>, row: &Map<String, Value>) -> Result<Shape> {
        let k = row.get("k").and_then(Value::as_f64).unwrap_or(0.0);
        let terms = self.terms(i, row)?;
        let has_terms = terms.iter().any(|t| *t != 0.0);
        Ok(match kind {
            Some("cyl_x") => Shape::CylinderX,
            Some("cyl_y") => Shape::CylinderY,
            Some("toroid") => {
                let value = |key: &str| row.get(key).and_then(Value::as_f64);
                let across = match value("c_x") {
                    Some(c) => Curvature::from_curvature(c),
                    None => Curvature::from_radius(value("R_x").unwrap_or(0.0)),
                };
                Shape::Toroid { across, k, terms }
            }
            _ if has_terms => Shape::Asphere { k, terms },
            _ if k != 0.0 => Shape::Conic { k },
            _ => Shape::Sphere,
        })
    }

    fn terms(&self, i: usize, row: &Map<String, Value>) -> Result<Box<[f64; MAX_POWER + 1]>> {
        let mut terms = Box::new([0.0; MAX_POWER + 1]);
        for (j, value) in numbers(even_terms(row)).into_iter().enumerate() {
            match terms.get_mut(4 + 2 * j) {
                Some(term) => *term = value,
                None => return Err(self.too_high(i, 4 + 2 * j)),
            }
        }
        let radial = row.get("radial_poly").and_then(Value::as_object);
        for (power, value) in radial.into_iter().flatten() {
            let Ok(power) = power.parse::<usize>() else {
                let message = format!("surface {i}: `{power}` is not a power of r");
                return Err(self.fail(Some(i), message));
            };
            match (terms.get_mut(power), value.as_f64()) {
                (Some(term), Some(value)) => *term = value,
                _ => return Err(self.too_high(i, power)),
            }
        }
        Ok(terms)
    }

    fn too_high(&self, i: usize, power: usize) -> Box<Diagnostic> {
        self.fail(
            Some(i),
            format!("surface {i}: the term r^{power} can't be used"),
        )
        .with_help(format!("powers of r go from 1 to {MAX_POWER}"))
    }

    /// The coating of a surface, or of all surfaces without one of their own.
    fn coating(&self, row: &Value, surface: Option<usize>) -> Result<Option<Coating>> {
        let Some(word) = row.get("coating") else {
            return Ok(None);
        };
        match word.as_str().and_then(Coating::named) {
            Some(coating) => Ok(Some(coating)),
            None => Err(self
                .fail(surface, format!("{word} is not a coating"))
                .with_help("coatings are \"none\", \"mgf2\" and \"ideal\"")),
        }
    }

    fn iris(&self, root: &Value) -> Result<Iris> {
        let Some(iris) = root.get("iris") else {
            return Ok(Iris::Round);
        };
        let rotation = number(iris, &["rotation_deg"]).unwrap_or(0.0).to_radians();
        if let Some(count) = iris.get("blades").and_then(Value::as_u64) {
            return match u32::try_from(count) {
                Ok(count @ 3..=1000) => Ok(Iris::Blades { count, rotation }),
                _ => Err(self
                    .fail(None, format!("an iris of {count} blades can't be made"))
                    .with_help("give 3 blades or more")),
            };
        }
        let corners: Vec<[f64; 2]> = iris
            .get("outline")
            .and_then(Value::as_array)
            .into_iter()
            .flatten()
            .filter_map(|corner| <[f64; 2]>::try_from(numbers(Some(corner))).ok())
            .collect();
        match corners.len() {
            0 => Ok(Iris::Round),
            1 | 2 => Err(self.fail(
                None,
                "the outline of the iris has less than 3 corners".into(),
            )),
            _ => Ok(Iris::Outline { corners, rotation }),
        }
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
    let others = crate::prescription::about::KEYS.iter().skip(1);
    let others = others.filter_map(|key| stated(key).map(|value| format!("{key}: {value}")));
    let list = root.get("note").and_then(Value::as_array);
    let listed = list.into_iter().flatten().filter_map(Value::as_str);
    let named = title.into_iter().chain(others).chain(stated("note"));
    named.chain(listed.map(str::to_owned)).collect()
}

/// The list of even coefficients from r^4. Its name may end with dots.
fn even_terms(row: &Map<String, Value>) -> Option<&Value> {
    row.iter()
        .find(|(key, _)| key.starts_with("A4"))
        .map(|(_, value)| value)
}

fn number(value: &Value, keys: &[&str]) -> Option<f64> {
    keys.iter().find_map(|key| value.get(key)?.as_f64())
}

fn numbers(value: Option<&Value>) -> Vec<f64> {
    let list = value.and_then(Value::as_array);
    list.into_iter()
        .flatten()
        .filter_map(Value::as_f64)
        .collect()
}

/// `"focus_group": [first, last]`
fn focus_group(root: &Value, count: usize) -> Option<FocusGroup> {
    let [first, last]: [f64; 2] = numbers(root.get("focus_group")).try_into().ok()?;
    let (first, last) = (first as usize, last as usize);
    (first <= last && last < count).then_some(FocusGroup { first, last })
}

/// Where each surface's object stands in the text, found without a second parser: the n-th `{`
/// after `"surfaces"` at the depth of the list.
pub(super) struct Places {
    objects: Vec<(usize, usize)>,
    bytes: Arc<Source>,
}

impl Places {
    /// Finds the objects in a JSON text.
    pub(super) fn new(source: &Arc<Source>) -> Self {
        let bytes = &source.bytes;
        let key = b"\"surfaces\"";
        let from = bytes
            .windows(key.len())
            .position(|w| w == key)
            .unwrap_or(bytes.len());
        let (mut depth, mut in_string, mut escaped) = (0, false, false);
        let mut objects = Vec::new();
        let mut begin = 0;
        for (i, &b) in bytes.iter().enumerate().skip(from + key.len()) {
            match b {
                _ if escaped => escaped = false,
                b'\\' if in_string => escaped = true,
                b'"' => in_string = !in_string,
                _ if in_string => {}
                b'{' | b'[' => {
                    if depth == 1 {
                        begin = i;
                    }
                    depth += 1;
                }
                b'}' | b']' => {
                    depth -= 1;
                    match depth {
                        1 => objects.push((begin, i + 1)),
                        d if d <= 0 => break,
                        _ => {}
                    }
                }
                _ => {}
            }
        }
        Self {
            objects,
            bytes: source.clone(),
        }
    }

    /// The place at which the object of a surface begins.
    pub(super) fn object(&self, surface: usize) -> Span {
        let (from, _) = self.objects.get(surface).copied().unwrap_or((0, 0));
        Span::new(from, from + 1)
    }

    /// The value of a column of a surface, or the whole object where it has none.
    fn of(&self, surface: usize, column: Column) -> Span {
        let keys: &[&str] = match column {
            Column::Radius => &["\"R\"", "\"radius\"", "\"c\""],
            Column::Thickness => &["\"t\"", "\"thickness\""],
            Column::Index => &["\"n_d\"", "\"n\""],
            Column::SemiDiameter => &["\"semi_diameter\"", "\"a\""],
        };
        self.value(surface, keys)
    }

    /// The value of the first of these keys, in quotes, that a surface has.
    pub(super) fn value(&self, surface: usize, keys: &[&str]) -> Span {
        let (from, to) = self.objects.get(surface).copied().unwrap_or((0, 0));
        let text = &self.bytes.bytes[from..to];
        for key in keys {
            let found = text.windows(key.len()).position(|w| w == key.as_bytes());
            let Some(at) = found.map(|at| at + key.len()) else {
                continue;
            };
            let rest = text[at..].iter();
            let skip = rest
                .take_while(|b| b.is_ascii_whitespace() || **b == b':')
                .count();
            let length = text[at + skip..]
                .iter()
                .take_while(|b| !b.is_ascii_whitespace() && !b",}]".contains(b))
                .count();
            return Span::new(from + at + skip, from + at + skip + length);
        }
        self.object(surface)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Prescription> {
        let source = Arc::new(Source::new("a.json", text.as_bytes().to_vec()));
        read(&source, &Catalogue::builtin(), &mut Sink::new())
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
                "{\"surfaces\": [\n{\"kind\": \"spere\", \"R\": 5}]}",
                (2, 1),
            ),
            ("{\"surfaces\": [\n{\"R\": \"5\", \"a\": 2}]}", (2, 7)),
            ("{\"surfaces\": [\n{\"R\": NaN, \"a\": 2}]}", (2, 7)),
            (
                "{\"surfaces\": [\n{\"R\": 5, \"a\": 2}],\n\"zoom\": [{\"gaps\": {\"1\": 2}}]}",
                (3, 1),
            ),
            (
                "{\"surfaces\": [\n{\"R\": 5, \"a\": 2}],\n\"focus_group\": [0, 1]}",
                (3, 1),
            ),
        ] {
            let error = parse(text).unwrap_err();
            assert_eq!(error.location().1, Some(at), "{text}: {error}");
        }
    }
}
