//! Lenses: prescriptions, first-order optics, exact tracing, focus and pupils.
//!
//! Lens space is millimeters with z = 0 at the front vertex and light travelling toward +z, to
//! the film. A [`Lens`] is a [`Prescription`] made ready for tracing. Nothing here knows about
//! scenes, pixels or samples.

pub mod about;
pub mod analysis;
pub mod as_scene;
mod beam;
pub mod breathing;
pub mod catalogue;
pub mod coating;
pub mod film_place;
pub mod first_order;
pub mod focus;
pub mod formats;
pub mod ghosts;
pub mod glass;
pub mod lanes;
pub mod prescription;
pub mod pupil;
pub mod sheet;
mod sight;
pub mod surface;
pub mod trace;
pub mod wave;

use std::path::Path;
use std::sync::Arc;

use glam::{DVec2, DVec3};

use crate::diag::{Diagnostic, Result, Sink, Source, nearest};
use crate::math::{Meters, Mm};

pub use about::About;
pub use analysis::{AxialBeam, Distortion, Spot};
pub use beam::Beam;
pub use breathing::Breath;
pub use catalogue::Catalogue;
pub use coating::Coating;
pub use film_place::{FilmPlace, Movements, PlaceFault};
pub use first_order::{FirstOrder, Focal, Plane, Pupil};
pub use focus::{Focus, FocusFault, FocusMethod};
pub use formats::Reading;
pub use ghosts::GhostPair;
pub use glass::Medium;
pub use lanes::{Bundle, LANES};
pub use prescription::{Iris, Prescription};
pub use pupil::{Aims, ExitPupil, Light, PupilTarget, PupilWindow, RearElement};
pub use surface::{Curvature, Shape, Surface};
pub use trace::{LensRay, Loss, LossKind, Toward};
pub use wave::{Openings, Wavefront};

use trace::{Course, Element};

mod shipped {
    include!(concat!(env!("OUT_DIR"), "/lenses.rs"));
}

/// A prescription made ready for tracing.
#[derive(Clone, Debug)]
pub struct Lens {
    prescription: Prescription,
    wavelength_nm: f64,
    elements: Vec<Element>,
    first_order: FirstOrder,
    /// Whether any surface does.
    reflects: bool,
}

/// A path of a ray: what became of it and every point where it met a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct RayPath {
    pub outcome: std::result::Result<LensRay, Loss>,
    /// In the order of travel; the last may be where the ray was lost.
    pub hits: Vec<DVec3>,
}

impl Lens {
    /// Makes a lens of a prescription, at the d line.
    pub fn new(prescription: Prescription) -> Self {
        Self::at(prescription, glass::D_LINE)
    }

    fn at(prescription: Prescription, wavelength_nm: f64) -> Self {
        let indices = prescription.indices(wavelength_nm);
        let mut z = 0.0;
        let mut elements = Vec::with_capacity(prescription.surfaces.len());
        for (i, surface) in prescription.surfaces.iter().enumerate() {
            let mut element = Element::new(surface, z, indices[i], indices[i + 1]);
            if surface.is_stop {
                element.set_hole(prescription.iris.outline(surface.semi_diameter));
            }
            elements.push(element);
            z += surface.thickness;
        }
        let first_order = FirstOrder::of(&prescription, &indices, Plane::Y);
        let reflects = |s: &Surface| s.coating != Coating::Ideal;
        Self {
            reflects: prescription.surfaces.iter().any(reflects),
            prescription,
            wavelength_nm,
            elements,
            first_order,
        }
    }

    /// Opens a lens by the name of a shipped one or by the path of a file.
    pub fn open(name_or_path: impl AsRef<Path>) -> Result<Self> {
        Self::open_with(name_or_path, &mut Sink::new())
    }

    /// The same, with the reader's warnings.
    pub fn open_with(name_or_path: impl AsRef<Path>, sink: &mut Sink) -> Result<Self> {
        Self::open_as(name_or_path, &Reading::default(), sink)
    }

    /// The same, with glass catalogues and habits of reading of one's own.
    pub fn open_as(name_or_path: impl AsRef<Path>, how: &Reading, sink: &mut Sink) -> Result<Self> {
        let source = source(name_or_path.as_ref())?;
        formats::read_with(&source, how, sink).map(Self::new)
    }

    /// A shipped lens by name, wherever the program runs.
    pub fn named(name: &str) -> Result<Self> {
        formats::read(&shipped_source(name)?, &mut Sink::new()).map(Self::new)
    }

    pub fn name(&self) -> &str {
        &self.prescription.name
    }

    pub fn prescription(&self) -> &Prescription {
        &self.prescription
    }

    /// The wavelength that rays are traced at, in nanometers.
    pub fn wavelength(&self) -> f64 {
        self.wavelength_nm
    }

    /// The same lens for another wavelength.
    pub fn at_wavelength(&self, wavelength_nm: f64) -> Self {
        Self::at(self.prescription.clone(), wavelength_nm)
    }

    /// The same lens with every length multiplied: the paper's `-z`.
    pub fn scaled(&self, factor: f64) -> Self {
        Self::at(self.prescription.scaled(factor), self.wavelength_nm)
    }

    /// The same lens at another focal length. An afocal lens has none to scale.
    pub fn scaled_to(&self, efl: Mm) -> Result<Self> {
        let factor = efl.0 / self.first_order.efl();
        if !(factor > 0.0 && factor.is_finite()) {
            return Err(Diagnostic::error(format!(
                "`{}` has a focal length of {} mm and can't be scaled to {} mm",
                self.name(),
                self.first_order.efl(),
                efl.0
            ))
            .with_help("scale by a factor greater than 0 instead"));
        }
        Ok(self.scaled(factor))
    }

    /// The same lens with its stop closed (or opened) to a semi-diameter in millimeters.
    pub fn with_stop(&self, semi_diameter: Mm) -> Result<Self> {
        let Some(stop) = self.first_order.stop else {
            return Err(
                Diagnostic::error(format!("`{}` has no stop to close", self.name()))
                    .with_help("give one of its surfaces an aperture"),
            );
        };
        if !(semi_diameter.0 > 0.0 && semi_diameter.0.is_finite()) {
            return Err(Diagnostic::error(format!(
                "a stop can't have a semi-diameter of {} mm",
                semi_diameter.0
            ))
            .with_help("give a length greater than 0"));
        }
        let mut prescription = self.prescription.clone();
        prescription.surfaces[stop].semi_diameter = semi_diameter.0;
        Ok(Self::at(prescription, self.wavelength_nm))
    }

    /// The same lens stopped down to an f-number: focal length over the diameter of the entrance
    /// pupil. The stop does not open wider than the prescription's.
    pub fn at_f_number(&self, f_number: f64) -> Result<Self> {
        let widest = self.first_order.f_number();
        let (Some(widest), Some(stop)) = (widest, self.first_order.stop) else {
            return Err(
                Diagnostic::error(format!("`{}` has no f-number", self.name()))
                    .with_help("an afocal lens, or one without apertures, has none"),
            );
        };
        if !(f_number.is_finite() && f_number >= widest * (1.0 - 1e-3)) {
            return Err(
                Diagnostic::error(format!("`{}` can't open to f/{f_number}", self.name()))
                    .with_help(format!("its widest is f/{widest:.2}")),
            );
        }
        let full = self.prescription.surfaces[stop].semi_diameter;
        self.with_stop(Mm(full * (widest / f_number).min(1.0)))
    }

    pub fn first_order(&self) -> &FirstOrder {
        &self.first_order
    }

    /// First-order data in the x plane, which differs for cylinders and toroids.
    pub fn first_order_in(&self, plane: Plane) -> FirstOrder {
        FirstOrder::of(
            &self.prescription,
            &self.prescription.indices(self.wavelength_nm),
            plane,
        )
    }

    /// From the first vertex to the last, in millimeters: the z of the rear vertex.
    pub fn length(&self) -> f64 {
        self.elements.last().map_or(0.0, |e| e.vertex_z)
    }

    /// Where the film goes for an object at a distance, see [`FocusMethod`]. A focusing group
    /// changes the lens itself; [`Self::focused`] gives it too.
    pub fn focus(
        &self,
        method: FocusMethod,
        distance: Meters,
    ) -> std::result::Result<Focus, FocusFault> {
        let distance = Mm::from(distance).0;
        match method {
            FocusMethod::Film | FocusMethod::Lens => {
                focus::focus(&self.first_order, method, distance)
            }
            _ if !(distance > 0.0) => Err(FocusFault::NotADistance),
            FocusMethod::Best => focus::move_film_to_best(self, distance),
            FocusMethod::Group => focus::move_group(self, distance).map(|(_, focus)| focus),
        }
    }

    /// The lens as it is when focused, and where its film is.
    pub fn focused(
        &self,
        method: FocusMethod,
        distance: Meters,
    ) -> std::result::Result<(Self, Focus), FocusFault> {
        match method {
            FocusMethod::Group if distance.0 > 0.0 => focus::move_group(self, Mm::from(distance).0),
            _ => self
                .focus(method, distance)
                .map(|focus| (self.clone(), focus)),
        }
    }

    /// The same lens at one of its tabulated zoom positions, from 0.
    pub fn at_zoom(&self, position: usize) -> Result<Self> {
        Ok(self.with(self.prescription.at_zoom(position)?))
    }

    /// The edges of the stop's hole, if it is not round; see [`trace::Element::edges`].
    pub(crate) fn iris_edges(&self) -> &[DVec2] {
        let mut edges = self.elements.iter().map(|element| &*element.edges);
        edges.find(|edges| !edges.is_empty()).unwrap_or(&[])
    }

    /// Whether light finds the same in every plane through the axis.
    pub(crate) fn is_rotational(&self) -> bool {
        let mut surfaces = self.prescription.surfaces.iter();
        self.iris_edges().is_empty() && surfaces.all(|s| s.shape.is_rotational())
    }

    /// The same lens with another hole in its stop.
    pub fn with_iris(&self, iris: Iris) -> Self {
        self.with(Prescription {
            iris,
            ..self.prescription.clone()
        })
    }

    /// Another prescription at the same wavelength.
    pub(crate) fn with(&self, prescription: Prescription) -> Self {
        Self::at(prescription, self.wavelength_nm)
    }

    /// Traces a ray from the scene to the film side.
    pub fn trace_from_scene(&self, ray: &LensRay) -> std::result::Result<LensRay, Loss> {
        self.course(Toward::Film, true).follow(*ray, |_, _| {})
    }

    /// Traces a ray from the film side into the scene.
    pub fn trace_from_film(&self, ray: &LensRay) -> std::result::Result<LensRay, Loss> {
        self.course(Toward::Scene, true).follow(*ray, |_, _| {})
    }

    /// Traces a ray and keeps its hits; `apertures` off lets it pass outside the semi-diameters.
    pub fn trace_path(&self, ray: &LensRay, toward: Toward, apertures: bool) -> RayPath {
        let mut hits = Vec::with_capacity(self.elements.len());
        let outcome = self
            .course(toward, apertures)
            .follow(*ray, |_, hit| hits.push(hit));
        RayPath { outcome, hits }
    }

    fn course(&self, toward: Toward, apertures: bool) -> Course<'_> {
        Course {
            elements: &self.elements,
            toward,
            apertures,
        }
    }
}

/// The text of a shipped lens, or of a file.
fn source(path: &Path) -> Result<Arc<Source>> {
    let word = path.to_string_lossy();
    let is_word = !word.contains(['/', '\\']);
    let is_shipped = (is_word || word.starts_with("lenses/")) && shipped_text(&word).is_some();
    if !path.exists() && (is_shipped || (is_word && !word.contains('.'))) {
        return shipped_source(&word);
    }
    let bytes = std::fs::read(path).map_err(|e| Diagnostic::io(path.display(), &e))?;
    Ok(Arc::new(Source::new(word.into_owned(), bytes)))
}

fn shipped_source(name: &str) -> Result<Arc<Source>> {
    let Some((file, text)) = shipped_text(name) else {
        let error = Diagnostic::error(format!("there is no lens named `{name}`"));
        let help = match nearest(name, shipped_names()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!(
                "there are {}",
                shipped_names().collect::<Vec<_>>().join(", ")
            ),
        };
        return Err(error.with_help(help));
    };
    let bytes = text.as_bytes().to_vec();
    Ok(Arc::new(Source::new(format!("lenses/{file}"), bytes)))
}

/// Says where the file of a lens lists its zoom positions, if it does, or begins: for a message
/// about one that is not there.
pub fn at_zoom_list(error: Box<Diagnostic>, name_or_path: impl AsRef<Path>) -> Box<Diagnostic> {
    match source(name_or_path.as_ref()) {
        Ok(source) => formats::at_zoom_list(error, &source),
        Err(_) => error,
    }
}

/// The names of the lenses in the binary, sorted.
pub fn shipped_names() -> impl Iterator<Item = &'static str> {
    shipped::LENSES.iter().map(|(file, _)| stem(file))
}

/// The file name and text of a shipped lens, by its name with or without folder and ending.
fn shipped_text(name: &str) -> Option<(&'static str, &'static str)> {
    let name = name.strip_prefix("lenses/").unwrap_or(name);
    let last = |file: &'static str| file.rsplit('/').next().unwrap_or(file);
    shipped::LENSES
        .iter()
        .find(|(file, _)| *file == name || last(file) == name || stem(file) == name)
        .copied()
}

/// `wide-angle` of `folder/wide-angle.dat`.
fn stem(file: &str) -> &str {
    let name = file.rsplit('/').next().unwrap_or(file);
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}
