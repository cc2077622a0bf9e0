//! Reads the models of ray-optics (`.roa`): JSON of its objects, with `Infinity` for planes.
//!
//! `ifcs` are the interfaces with their profiles and apertures, `gaps` the distances and media
//! behind them; the first is the object, the last the image. Spheres, conics and polynomials in r
//! are read. Mirrors, thin lenses and decentered interfaces are refused.

use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result, Sink, Source, Span};
use ivcam_base::math::LengthUnit;
use serde_json::Value;

use crate::prescription::formats::apertures::{Beam, note_f_number};
use crate::prescription::formats::format::Format;
use crate::prescription::formats::loose::{fail, finite, numbers, parse};
use crate::prescription::formats::origin::name_of;
use crate::prescription::glass::catalogue::Catalogue;
use crate::prescription::glass::medium::{D_LINE, Formula, Medium};
use crate::prescription::prescription::{Prescription, check, check_count};
use crate::prescription::surface::{Curvature, Shape, Surface};

/// ray-optics' models.
pub(crate) static FORMAT: Format = Format {
    name: "ray-optics",
    recognizes: |text| {
        text.trim_start().starts_with('{')
            && text.contains("\"optical_model\"")
            && text.contains("\"seq_model\"")
    },
    read: |source, how, sink| read(source, &how.glasses, sink),
};

struct Reader<'a> {
    source: &'a Arc<Source>,
    glasses: &'a Catalogue,
    /// The attributes of the model.
    model: &'a Value,
}

fn read(source: &Arc<Source>, glasses: &Catalogue, sink: &mut Sink) -> Result<Prescription> {
    let root = parse(source)?;
    let model = attributes(&root["optical_model"]);
    let reader = Reader {
        source,
        glasses,
        model,
    };
    let mut lens = reader.lens()?;
    if let Some(beam) = reader.beam() {
        note_f_number(&mut lens, beam, Span::at(0));
    }
    check(&mut lens, source, sink, |surface, _| place(source, surface))?;
    let stated = attributes(&model["system_spec"])["_dimensions"].as_str();
    let unit = stated.unwrap_or("mm").to_ascii_lowercase();
    let unit = match unit.as_str() {
        "inches" => "in",
        other => other,
    };
    match LengthUnit::parse(unit).map(LengthUnit::millimeters) {
        Some(1.0) => Ok(lens),
        Some(unit) => Ok(lens.scaled(unit)),
        None => Err(fail(
            source,
            unit,
            format!("`{unit}` is not a unit of length"),
        )),
    }
}

/// The attributes of an object, which older files have in the object itself.
fn attributes(value: &Value) -> &Value {
    value.get("attributes").unwrap_or(value)
}

/// The name of the class of an object.
fn class(value: &Value) -> &str {
    let class = value.get("__instance_type__").and_then(|list| list.get(1));
    class.and_then(Value::as_str).unwrap_or("")
}

/// The place of an interface: the n-th that the file lists.
fn place(source: &Arc<Source>, surface: usize) -> Span {
    let text = std::str::from_utf8(&source.bytes).unwrap_or("");
    // The object comes first.
    let mut modes = text.match_indices("\"interact_mode\"");
    modes
        .nth(surface + 1)
        .map_or(Span::at(0), |(at, word)| Span::new(at, at + word.len()))
}

impl Reader<'_> {
    fn fail(&self, text: &str, message: String) -> Box<Diagnostic> {
        fail(self.source, text, message)
    }

    fn lens(&self) -> Result<Prescription> {
        let sequence = attributes(&self.model["seq_model"]);
        let list = |key: &str| sequence[key].as_array().map_or(&[][..], |list| list);
        let (interfaces, gaps) = (list("ifcs"), list("gaps"));
        check_count(interfaces.len(), self.source)?;
        let [_object, inner @ .., _image] = interfaces else {
            let message = "the model has no interfaces between object and image";
            return Err(self.fail("\"ifcs\"", message.into()));
        };
        if gaps.len() < interfaces.len() - 1 {
            let message = format!(
                "{} gaps are too few for {} interfaces",
                gaps.len(),
                interfaces.len()
            );
            return Err(self.fail("\"gaps\"", message));
        }
        let object_medium = self.medium(attributes(&gaps[0]))?;
        let mut surfaces = Vec::with_capacity(inner.len());
        let stop = sequence["stop_surface"].as_u64();
        for (i, interface) in inner.iter().enumerate() {
            let number = i + 1;
            let surface = self.surface(number, interface, attributes(&gaps[number]))?;
            surfaces.push(Surface {
                is_stop: stop == Some(number as u64),
                ..surface
            });
        }
        let title = attributes(&self.model["system_spec"])["title"].as_str();
        let name = title.filter(|title| !title.is_empty());
        let name = name.map_or_else(|| name_of(self.source), str::to_owned);
        Ok(Prescription {
            object_medium,
            ..Prescription::new(name, surfaces)
        })
    }

    fn surface(&self, number: usize, interface: &Value, gap: &Value) -> Result<Surface> {
        let values = attributes(interface);
        if class(interface) != "Surface" {
            let what = class(interface);
            let message = format!("interface {number} is a `{what}`, not a surface of glass");
            return Err(self.fail(&format!("\"{what}\""), message));
        }
        if values["interact_mode"] == "reflect" {
            return Err(self
                .fail("\"reflect\"", format!("interface {number} is a mirror"))
                .with_help("ivcam traces lenses that light goes straight through"));
        }
        if !values["decenter"].is_null() {
            let message = format!("interface {number} is decentered or tilted");
            return Err(self.fail("\"DecenterData\"", message));
        }
        let profile = match values["profile_id"].as_str() {
            Some(id) => &self.model["profile_dict"][id],
            None => &values["profile"],
        };
        let (curvature, shape) = self.profile(number, profile)?;
        let clear = values["clear_apertures"].as_array();
        let clear = clear.and_then(|list| finite(attributes(list.first()?).get("radius")));
        let radius = clear.or(finite(values.get("max_aperture")));
        Ok(Surface {
            shape,
            curvature,
            ..Surface::sphere(
                0.0,
                finite(gap.get("thi")).unwrap_or(0.0),
                self.medium(gap)?,
                radius.filter(|r| *r > 0.0).unwrap_or(f64::INFINITY),
            )
        })
    }

    fn profile(&self, number: usize, profile: &Value) -> Result<(Curvature, Shape)> {
        let values = attributes(profile);
        let curvature = Curvature::from_curvature(finite(values.get("cv")).unwrap_or(0.0));
        let mut k = finite(values.get("cc")).unwrap_or(0.0);
        let coefficients = numbers(values.get("coefs"));
        let powers: Box<dyn Iterator<Item = usize>> = match class(profile) {
            "Spherical" => return Ok((curvature, Shape::Sphere)),
            "Conic" => Box::new(std::iter::empty()),
            "EvenPolynomial" => Box::new((2..).step_by(2)),
            "RadialPolynomial" => {
                // Its `ec` is 1 + k.
                k = finite(values.get("ec")).map_or(k, |ec| ec - 1.0);
                Box::new(1..)
            }
            other => {
                let message =
                    format!("interface {number} has the profile `{other}`, which is not read");
                return Err(self.fail(&format!("\"{other}\""), message).with_help(
                    "the profiles are Spherical, Conic, EvenPolynomial and RadialPolynomial",
                ));
            }
        };
        let shape = Shape::from_terms(k, powers.zip(coefficients)).map_err(|power| {
            let message = format!("interface {number}: the term r^{power} is of too high a power");
            self.fail("\"coefs\"", message)
        })?;
        Ok((curvature, shape))
    }

    /// The medium of a gap: air, an index with an Abbe number, a glass by name, or one by the
    /// coefficients that the file has of it.
    fn medium(&self, gap: &Value) -> Result<Medium> {
        let medium = &gap["medium"];
        let values = attributes(medium);
        let name = ["gname", "label", "name", "_label"]
            .iter()
            .find_map(|key| values[*key].as_str());
        let name = name.filter(|name| !name.is_empty());
        let index = ["n", "_n"].iter().find_map(|key| finite(values.get(*key)));
        let kind = class(medium);
        if kind == "Air" || (kind.is_empty() && name.is_none() && index.is_none()) {
            return Ok(Medium::air());
        }
        if let Some(n_d) = index {
            let abbe = ["v", "_v"].iter().find_map(|key| finite(values.get(*key)));
            let medium = match abbe.filter(|v| *v > 0.0) {
                Some(abbe) => Medium::from_abbe(n_d, abbe),
                None => Medium::constant(n_d),
            };
            return Ok(medium.named(name.unwrap_or("")));
        }
        let Some(name) = name else {
            let message = format!("a medium of the kind `{kind}` has neither an index nor a name");
            return Err(self.fail(&format!("\"{kind}\""), message));
        };
        if let Some(glass) = self.glasses.find(name) {
            return Ok(glass.clone());
        }
        match self.by_coefficients(kind, &numbers(values.get("coefs"))) {
            Some(glass) => Ok(glass.named(name)),
            None => {
                let text = format!("\"{name}\"");
                let at = self.fail(&text, String::new());
                let span = at.place.map_or(Span::at(0), |(_, span)| span);
                self.glasses.get(name, self.source, span)
            }
        }
    }

    /// A glass of a maker's formula: Schott and Ohara list K1 to K3 before L1 to L3, Hoya and
    /// Sumita the coefficients of Schott's older formula, Hikari those of the longer one.
    fn by_coefficients(&self, kind: &str, listed: &[f64]) -> Option<Medium> {
        let mut k = [0.0; 10];
        let formula = match (kind, listed) {
            ("SchottGlass" | "OharaGlass" | "CDGMGlass", [k1, k2, k3, l1, l2, l3]) => {
                k[..6].copy_from_slice(&[*k1, *l1, *k2, *l2, *k3, *l3]);
                Formula::Sellmeier1
            }
            ("HoyaGlass" | "SumitaGlass", [..]) if listed.len() == 6 => {
                k[..6].copy_from_slice(listed);
                Formula::Schott
            }
            ("HikariGlass", [..]) if listed.len() == 9 => {
                k[..9].copy_from_slice(listed);
                Formula::Extended3
            }
            _ => return None,
        };
        Medium::from_formula(formula, k).filter(|m| (1.2..4.0).contains(&m.index(D_LINE)))
    }

    /// The aperture that the model states, in image or object space.
    fn beam(&self) -> Option<Beam> {
        let pupil = attributes(&attributes(&self.model["optical_spec"])["pupil"]);
        let value = finite(pupil.get("value")).filter(|v| *v > 0.0)?;
        let key = ["key", "_key"]
            .iter()
            .find_map(|key| pupil[*key].as_array())?;
        let kind = key.last()?.as_str()?;
        let is_object = key.iter().any(|word| word == "object");
        let beam = Beam::default();
        match kind {
            "f/#" if !is_object => Some(Beam {
                f_number: Some(value),
                ..beam
            }),
            "pupil" | "epd" if is_object => Some(Beam {
                entrance_diameter: Some(value),
                ..beam
            }),
            _ => None,
        }
    }
}
