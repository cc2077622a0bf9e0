//! Reads the JSON of optiland: a `surface_group` of surfaces with their geometry, the material
//! behind them and perhaps an aperture. The first is the object, the last the image.
//!
//! Planes, spheres, conics and even and odd aspheres are read. Apertures that are missing are
//! those of the beam of `aperture` and `fields`. Mirrors, shifts and tilts are refused.

use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result, Sink, Source, Span};
use serde_json::Value;

use crate::prescription::formats::apertures::{Beam, fill, note_f_number};
use crate::prescription::formats::format::Format;
use crate::prescription::formats::loose::{fail, finite, numbers, parse};
use crate::prescription::formats::origin::name_of;
use crate::prescription::glass::catalogue::Catalogue;
use crate::prescription::glass::medium::Medium;
use crate::prescription::prescription::{Prescription, check, check_count};
use crate::prescription::surface::{Curvature, Shape, Surface};

/// optiland's JSON.
pub(crate) static FORMAT: Format = Format {
    name: "optiland",
    recognizes: |text| text.trim_start().starts_with('{') && text.contains("\"surface_group\""),
    read: |source, how, sink| read(source, &how.glasses, sink),
};

struct Reader<'a> {
    source: &'a Arc<Source>,
    glasses: &'a Catalogue,
}

fn read(source: &Arc<Source>, glasses: &Catalogue, sink: &mut Sink) -> Result<Prescription> {
    let root = parse(source)?;
    let reader = Reader { source, glasses };
    let mut lens = reader.lens(&root)?;
    let beam = beam(&root);
    if fill(&mut lens, beam) {
        sink.note(
            Span::at(0),
            "apertures that the file leaves out are those of its beam",
        );
    }
    if beam.entrance_diameter.or(beam.f_number).is_some() {
        note_f_number(&mut lens, beam, Span::at(0));
    }
    check(&mut lens, source, sink, |surface, _| place(source, surface))?;
    Ok(lens)
}

/// The place of a surface: the n-th geometry.
fn place(source: &Arc<Source>, surface: usize) -> Span {
    let text = std::str::from_utf8(&source.bytes).unwrap_or("");
    // The object comes first.
    let mut found = text.match_indices("\"geometry\"");
    found
        .nth(surface + 1)
        .map_or(Span::at(0), |(at, word)| Span::new(at, at + word.len()))
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
        edge_share: 1.0,
    }
}

impl Reader<'_> {
    fn fail(&self, text: &str, message: String) -> Box<Diagnostic> {
        fail(self.source, text, message)
    }

    fn lens(&self, root: &Value) -> Result<Prescription> {
        let rows = root["surface_group"]["surfaces"].as_array();
        let rows = rows.map_or(&[][..], |rows| rows);
        check_count(rows.len(), self.source)?;
        let [object, inner @ .., image] = rows else {
            let message = "the file has no surfaces between object and image";
            return Err(self.fail("\"surface_group\"", message.into()));
        };
        let mut medium = self.medium(0, object, &Medium::air())?;
        let object_medium = medium.clone();
        let mut surfaces = Vec::with_capacity(inner.len());
        for (i, row) in inner.iter().enumerate() {
            let next = inner.get(i + 1).unwrap_or(image);
            let surface = self.surface(i + 1, row, next, &medium)?;
            medium = surface.medium.clone();
            surfaces.push(surface);
        }
        let name = root["name"].as_str().filter(|name| !name.is_empty());
        let name = name.map_or_else(|| name_of(self.source), str::to_owned);
        Ok(Prescription {
            object_medium,
            ..Prescription::new(name, surfaces)
        })
    }

    fn surface(
        &self,
        number: usize,
        row: &Value,
        next: &Value,
        before: &Medium,
    ) -> Result<Surface> {
        let (geometry, system) = (&row["geometry"], &row["geometry"]["cs"]);
        for key in ["x", "y", "rx", "ry", "rz"] {
            if finite(system.get(key)).is_some_and(|v| v.abs() > 1e-12) {
                let message = format!("surface {number} is shifted or tilted (`{key}`)");
                return Err(self
                    .fail("\"surface_group\"", message)
                    .with_help("ivcam traces lenses on one straight axis"));
            }
        }
        let reflects = row["interaction_model"]["is_reflective"] == true
            || row["is_reflective"] == true
            || row["material_post"]["type"] == "Mirror"
            || row["material_post"] == "mirror";
        if reflects {
            return Err(self
                .fail(
                    "\"is_reflective\": true",
                    format!("surface {number} is a mirror"),
                )
                .with_help("ivcam traces lenses that light goes straight through"));
        }
        let z = |row: &Value| finite(row["geometry"]["cs"].get("z"));
        let apart = z(row).zip(z(next)).map(|(here, there)| there - here);
        let thickness = apart.or(finite(row.get("thickness")));
        let Some(thickness) = thickness else {
            let message = format!("surface {number} has no place on the axis");
            return Err(self.fail("\"surface_group\"", message));
        };
        let aperture = &row["aperture"];
        let radius = finite(aperture.get("r_max")).filter(|r| *r > 0.0);
        let (curvature, shape) = self.geometry(number, geometry)?;
        Ok(Surface {
            shape,
            curvature,
            is_stop: row["is_stop"] == true,
            ..Surface::sphere(
                0.0,
                thickness,
                self.medium(number, row, before)?,
                radius.unwrap_or(f64::INFINITY),
            )
        })
    }

    fn geometry(&self, number: usize, geometry: &Value) -> Result<(Curvature, Shape)> {
        let kind = geometry["type"].as_str().unwrap_or("");
        let radius = finite(geometry.get("radius")).unwrap_or(0.0);
        let curvature = Curvature::from_radius(radius);
        let k = finite(geometry.get("conic")).unwrap_or(0.0);
        let first = match kind {
            "Plane" => return Ok((Curvature::PLANE, Shape::Sphere)),
            "StandardGeometry" => 0,
            "EvenAsphere" => 2,
            "OddAsphere" => 1,
            _ => {
                let message = format!("surface {number} is a `{kind}`, which is not read");
                return Err(self.fail(&format!("\"{kind}\""), message).with_help(
                    "the geometries are Plane, StandardGeometry, EvenAsphere and OddAsphere",
                ));
            }
        };
        let listed = numbers(geometry.get("coefficients"));
        let terms = listed.into_iter().enumerate().filter(|_| first > 0);
        let terms = terms.map(|(i, value)| (first * (i + 1), value));
        let shape = Shape::from_terms(k, terms).map_err(|power| {
            let message = format!("surface {number}: the term r^{power} is of too high a power");
            self.fail("\"coefficients\"", message)
        })?;
        Ok((curvature, shape))
    }

    /// The material behind a surface: an index, an index with an Abbe number, or a name.
    fn medium(&self, number: usize, row: &Value, before: &Medium) -> Result<Medium> {
        let material = &row["material_post"];
        if material.is_null() {
            return Ok(before.clone());
        }
        let kind = material["type"].as_str().unwrap_or("");
        let index = finite(material.get("index"));
        let abbe = finite(material.get("abbe")).filter(|v| *v > 0.0);
        let name = material["name"].as_str();
        match (index, abbe, name) {
            (Some(n), Some(v), _) => Ok(Medium::from_abbe(n, v)),
            (Some(n), ..) => Ok(Medium::constant(n)),
            (None, _, Some(name)) => {
                let text = format!("\"{name}\"");
                let at = self.fail(&text, String::new());
                let span = at.place.map_or(Span::at(0), |(_, span)| span);
                self.glasses.get(name, self.source, span)
            }
            _ => {
                let message = format!("surface {number} has a material of the kind `{kind}`");
                Err(self
                    .fail(&format!("\"{kind}\""), message)
                    .with_help("an index, an index with an Abbe number, or a name is read"))
            }
        }
    }
}
