//! Reads the models of ray-optics (`.roa`): JSON of its objects, with `Infinity` for planes.
//!
//! `ifcs` are the interfaces with their profiles and apertures, `gaps` the distances and media
//! behind them; the first is the object, the last the image. Spheres, conics and polynomials in r
//! are read, mirrors, and decentered interfaces. Gratings are refused. A thin lens, which
//! ray-optics traces as a hologram of two points, is read as an ideal one.

use glam::{DVec2, DVec3};
use ivcam_base::diag::{Diagnostic, Result, Sink, Span};
use serde_json::Value;

use crate::prescription::clear_aperture::ClearAperture;
use crate::prescription::decenter::SurfaceFrame;
use crate::prescription::formats::apertures::{F_NUMBER_TOLERANCE, SystemData, note_f_number};
use crate::prescription::formats::decenters::{AxisBehind, StatedDecenter};
use crate::prescription::formats::format::PrescriptionFormat;
use crate::prescription::formats::loose::{finite, numbers, parse};
use crate::prescription::formats::reader::{Draft, PrescriptionReader, warn_of_image_curvature};
use crate::prescription::glass::medium::{D_LINE, Formula, Medium};
use crate::prescription::prescription::Prescription;
use crate::prescription::surface::{Curvature, Shape, Surface};

/// ray-optics' models.
pub(crate) static FORMAT: PrescriptionFormat = PrescriptionFormat {
    name: "ray-optics",
    recognizes: |text| {
        text.trim_start().starts_with('{')
            && text.contains("\"optical_model\"")
            && text.contains("\"seq_model\"")
    },
    read,
};

/// A model of ray-optics.
struct RayOpticsReader<'a> {
    file: PrescriptionReader<'a>,
    /// The attributes of the model.
    model: &'a Value,
}

fn read(file: PrescriptionReader<'_>, sink: &mut Sink) -> Result<Prescription> {
    let root = parse(file.source)?;
    let model = attributes(&root["optical_model"]);
    let reader = RayOpticsReader { file, model };
    let mut draft = reader.draft(sink)?;
    draft.fold();
    if let Some(beam) = reader.beam() {
        let beam = beam.with_pupil(&draft.lens);
        note_f_number(&mut draft.lens, beam, F_NUMBER_TOLERANCE);
    }
    draft.state_field(reader.field(), sink);
    reader.state_wavelengths(&mut draft);
    let stated = attributes(&model["system_spec"])["_dimensions"].as_str();
    let unit = stated.unwrap_or("mm");
    draft.unit = file.unit(unit, file.find(unit))?;
    file.finish(draft, sink)
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

/// The first number that an object has under one of these names.
fn first(values: &Value, keys: &[&str]) -> Option<f64> {
    keys.iter().find_map(|key| finite(values.get(*key)))
}

impl RayOpticsReader<'_> {
    /// An error at the first place of a text in the file.
    fn fail(&self, text: &str, message: String) -> Box<Diagnostic> {
        self.file.fail(self.file.find(text), message)
    }

    fn draft(&self, sink: &mut Sink) -> Result<Draft> {
        let sequence = attributes(&self.model["seq_model"]);
        let list = |key: &str| sequence[key].as_array().map_or(&[][..], |list| list);
        let (interfaces, gaps) = (list("ifcs"), list("gaps"));
        self.file.check_count(interfaces.len())?;
        let [_object, inner @ .., image] = interfaces else {
            let message = "the model has no interfaces between object and image";
            return Err(self.fail("\"ifcs\"", message.into()));
        };
        let (few, many) = (gaps.len(), interfaces.len());
        if few < many - 1 {
            let message = format!("{few} gaps are too few for {many} interfaces");
            return Err(self.fail("\"gaps\"", message));
        }
        let title = attributes(&self.model["system_spec"])["title"].as_str();
        let mut draft = self.file.draft(title);
        draft.lens.object_medium = self.medium(attributes(&gaps[0]))?;
        let stop = sequence["stop_surface"].as_u64();
        // The object comes first.
        let mut places = self.file.places("\"interact_mode\"").skip(1);
        for (number, interface) in (1..).zip(inner) {
            let surface = self.surface(number, interface, attributes(&gaps[number]))?;
            if let Shape::ThinLens { .. } = surface.shape {
                let message = format!("the thin lens {number} is traced as an ideal one");
                sink.warn(self.file.find("\"ThinLens\""), message).help(
                    "ray-optics traces a hologram, which has aberrations for all but two points",
                );
            }
            let surface = Surface {
                is_stop: stop == Some(number as u64),
                ..surface
            };
            draft.push(surface, [places.next().unwrap_or(Span::at(0)); 4]);
        }
        let image = attributes(self.profile_of(attributes(image)));
        if first(image, &["cv"]).is_some_and(|curvature| curvature != 0.0) {
            warn_of_image_curvature(self.file.find("\"ifcs\""), sink);
        }
        Ok(draft)
    }

    /// The profile of an interface.
    fn profile_of<'a>(&'a self, values: &'a Value) -> &'a Value {
        match values["profile_id"].as_str() {
            Some(id) => &self.model["profile_dict"][id],
            None => &values["profile"],
        }
    }

    fn surface(&self, number: usize, interface: &Value, gap: &Value) -> Result<Surface> {
        let values = attributes(interface);
        self.refuse(number, class(interface), values)?;
        let profile = self.profile_of(values);
        let (curvature, shape) = match class(interface) {
            "ThinLens" => (Curvature::PLANE, thin_lens(values)),
            _ => self.profile(number, profile)?,
        };
        let listed = values["clear_apertures"].as_array();
        let other = listed.into_iter().flatten().find_map(aperture);
        let radius = |is_obscuration: bool| {
            let mut all = listed.into_iter().flatten().map(attributes);
            let found = all.find(|a| (a["is_obscuration"] == true) == is_obscuration);
            found.and_then(|aperture| finite(aperture.get("radius")))
        };
        let (clear, obstruction) = (radius(false), radius(true).unwrap_or(0.0));
        let clear = clear.or(finite(values.get("max_aperture")));
        let radius = clear.filter(|r| *r > 0.0).unwrap_or(f64::INFINITY);
        let thickness = finite(gap.get("thi")).unwrap_or(0.0);
        let mut plane = Surface::sphere(0.0, thickness, self.medium(gap)?, radius);
        if let Some(aperture) = other {
            plane.set_aperture(&aperture);
        }
        Ok(Surface {
            shape,
            curvature,
            obstruction,
            is_mirror: values["interact_mode"] == "reflect",
            frame: self.frame(values)?,
            ..plane
        })
    }

    /// Refuses interfaces that are no surface of glass on the axis.
    fn refuse(&self, number: usize, class: &str, values: &Value) -> Result<()> {
        if class == "ThinLens" {
            return Ok(());
        }
        if class != "Surface" {
            let message = format!("interface {number} is a `{class}`, not a surface of glass");
            let help = "put the surfaces of a real lens in its place";
            return Err(self.fail(&format!("\"{class}\""), message).with_help(help));
        }
        if !values["phase_element"].is_null() {
            let message = format!("interface {number} diffracts");
            return Err(self.fail("\"phase_element\"", message));
        }
        Ok(())
    }

    /// The frame of an interface; none if it is not decentered.
    fn frame(&self, values: &Value) -> Result<Option<Box<SurfaceFrame>>> {
        let stated = attributes(&values["decenter"]);
        let vector = |key: &str| match numbers(stated.get(key))[..] {
            [x, y, z] => DVec3::new(x, y, z),
            _ => DVec3::ZERO,
        };
        let behind = match stated["dtype"].as_str().or(stated["_dtype"].as_str()) {
            None if stated.is_null() => return Ok(None),
            Some("decenter") => AxisBehind::Follows,
            Some("reverse") => AxisBehind::Reverses,
            Some("dec and return") => AxisBehind::Returns,
            Some("bend") => AxisBehind::Bends,
            _ => {
                let message = format!("a decenter of the kind {} is not read", stated["dtype"]);
                return Err(self.fail("\"DecenterData\"", message));
            }
        };
        let stated = StatedDecenter {
            shift: vector("dec"),
            tilt: vector("euler"),
            behind,
            ..StatedDecenter::default()
        };
        Ok(stated.frame())
    }

    fn profile(&self, number: usize, profile: &Value) -> Result<(Curvature, Shape)> {
        let values = attributes(profile);
        let curvature = Curvature::from_curvature(first(values, &["cv"]).unwrap_or(0.0));
        let mut k = first(values, &["cc"]).unwrap_or(0.0);
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
        let kind = class(&gap["medium"]);
        let values = attributes(&gap["medium"]);
        let mut names = ["gname", "label", "name", "_label"].iter();
        let name = names.find_map(|key| values[*key].as_str());
        let name = name.filter(|name| !name.is_empty());
        let index = first(values, &["n", "_n"]);
        match (index, name) {
            _ if kind == "Air" => Ok(Medium::air()),
            (None, None) if kind.is_empty() => Ok(Medium::air()),
            (Some(n_d), _) => {
                let medium = Medium::from_index(n_d, first(values, &["v", "_v"]));
                Ok(medium.named(name.unwrap_or("")))
            }
            (None, None) => {
                let message =
                    format!("a medium of the kind `{kind}` has neither an index nor a name");
                Err(self.fail(&format!("\"{kind}\""), message))
            }
            (None, Some(name)) => {
                if let Some(glass) = self.file.options.glasses.find(name) {
                    return Ok(glass.clone());
                }
                match by_coefficients(kind, &numbers(values.get("coefs"))) {
                    Some(glass) => Ok(glass.named(name)),
                    None => self.file.quoted_glass(name),
                }
            }
        }
    }

    /// The widest field, which is an angle in the scene or a height on the film.
    fn field(&self) -> SystemData {
        let field = attributes(&attributes(&self.model["optical_spec"])["field_of_view"]);
        let key = ["key", "_key"]
            .iter()
            .find_map(|key| field[*key].as_array());
        let is = |word: &str| key.is_some_and(|key| key.iter().any(|k| k == word));
        let points = field["fields"].as_array().map_or(&[][..], |list| list);
        let size = |point: &Value| {
            let part = |keys: &[&str]| first(attributes(point), keys).unwrap_or(0.0);
            libm::hypot(part(&["_x", "x"]), part(&["_y", "y"]))
        };
        let largest = points.iter().map(size).reduce(f64::max);
        let gaps = &attributes(&self.model["seq_model"])["gaps"];
        let widest = match field["is_relative"] == true {
            true => largest
                .zip(first(field, &["_value", "value"]))
                .map(|(f, whole)| f * whole),
            false => largest,
        };
        SystemData {
            half_field: widest.filter(|_| is("object") && is("angle")),
            image_height: widest.filter(|_| is("image") && is("height")),
            object_height: widest.filter(|_| is("object") && is("height")),
            object_distance: finite(attributes(&gaps[0]).get("thi")),
            ..SystemData::default()
        }
    }

    /// Keeps the wavelengths of the spectral region.
    fn state_wavelengths(&self, draft: &mut Draft) {
        let region = attributes(&attributes(&self.model["optical_spec"])["spectral_region"]);
        let all = numbers(region.get("wavelengths"));
        let reference = region["reference_wvl"].as_u64().unwrap_or(0);
        draft.state_wavelengths(&all, &[], reference as usize);
    }

    /// The aperture that the model states, in image or object space.
    fn beam(&self) -> Option<SystemData> {
        let pupil = attributes(&attributes(&self.model["optical_spec"])["pupil"]);
        let value = finite(pupil.get("value")).filter(|v| *v > 0.0)?;
        let key = ["key", "_key"]
            .iter()
            .find_map(|key| pupil[*key].as_array())?;
        let kind = key.last()?.as_str()?;
        let is_object = key.iter().any(|word| word == "object");
        let beam = SystemData {
            stated: Some(Span::at(0)),
            object_distance: self.field().object_distance,
            ..SystemData::default()
        };
        match kind {
            "NA" if is_object => Some(SystemData {
                object_aperture: Some(value),
                ..beam
            }),
            "NA" => Some(SystemData {
                image_aperture: Some(value),
                ..beam
            }),
            "f/#" if !is_object => Some(SystemData {
                f_number: Some(value),
                ..beam
            }),
            "pupil" | "epd" if is_object => Some(SystemData {
                entrance_diameter: Some(value),
                ..beam
            }),
            _ => None,
        }
    }
}

/// A clear aperture that is a rectangle, an ellipse, or a circle off the axis; none for others.
fn aperture(value: &Value) -> Option<ClearAperture> {
    let values = attributes(value);
    let number = |key: &str| finite(values.get(key)).unwrap_or(0.0);
    let center = DVec2::new(number("x_offset"), number("y_offset"));
    let half = match class(value) {
        _ if values["is_obscuration"] == true => return None,
        "Circular" if center != DVec2::ZERO => DVec2::splat(number("radius")),
        "Rectangular" | "Elliptical" => DVec2::new(number("x_half_width"), number("y_half_width")),
        _ => return None,
    };
    (half.min_element() > 0.0).then(|| ClearAperture {
        is_ellipse: class(value) != "Rectangular",
        half,
        center,
        rotation: number("rotation").to_radians(),
    })
}

/// The shape of a thin lens, which is a plane if it has no power.
fn thin_lens(values: &Value) -> Shape {
    match first(values, &["_power", "power"]) {
        None | Some(0.0) => Shape::Sphere,
        Some(power) => Shape::ThinLens {
            focal_length: 1.0 / power,
        },
    }
}

/// A glass of a maker's formula: Schott and Ohara list K1 to K3 before L1 to L3, Hoya and
/// Sumita the coefficients of Schott's older formula, Hikari those of the longer one.
fn by_coefficients(kind: &str, listed: &[f64]) -> Option<Medium> {
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
