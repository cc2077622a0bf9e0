//! A lens prepared for tracing.

use std::borrow::Cow;
use std::ops::RangeInclusive;

use glam::{DAffine3, DVec2, DVec3};
use ivcam_base::diag::Result;
use ivcam_base::math::Mm;

use crate::lens::trace::element::Element;
use crate::lens::trace::ray::{LensRay, Loss, RayPath, Toward};
use crate::lens::trace::tracer::Tracer;
use crate::prescription::decenter::SurfaceFrame;
use crate::prescription::first_order::FirstOrder;
use crate::prescription::glass::coating::Coating;
use crate::prescription::glass::medium::{C_LINE, D_LINE, F_LINE};
use crate::prescription::prescription::{Iris, Prescription};
use crate::prescription::surface::{Meridian, Surface};

/// The wavelengths of visible light, in nanometers.
pub(crate) const VISIBLE: RangeInclusive<f64> = 380.0..=780.0;

/// A prescription prepared for tracing at one wavelength.
#[derive(Clone, Debug)]
pub struct Lens {
    prescription: Prescription,
    wavelength_nm: f64,
    elements: Vec<Element>,
    first_order: FirstOrder,
    /// The map to lens space from the coordinates in which rays leave the lens, if a surface is
    /// decentered.
    film_map: Option<Box<DAffine3>>,
    /// Whether any surface reflects.
    reflects: bool,
}

impl Lens {
    /// Prepares a prescription for tracing at the d line.
    pub fn new(prescription: Prescription) -> Self {
        Self::at(prescription, D_LINE)
    }

    /// Prepares a prescription for tracing at a wavelength.
    fn at(prescription: Prescription, wavelength_nm: f64) -> Self {
        let indices = prescription.indices(wavelength_nm);
        let facings = prescription.facings();
        let mut z = 0.0;
        let mut axis = None;
        let mut elements = Vec::with_capacity(prescription.surfaces.len());
        for (i, surface) in prescription.surfaces.iter().enumerate() {
            let mut element = Element::new(surface, z, indices[i], indices[i + 1]);
            element.set_hole(match surface.is_stop {
                true => prescription.iris.outline(surface.semi_diameter),
                false => surface.outline.clone(),
            });
            element.facing = facings[i];
            advance_axis(&mut axis, &mut element, surface);
            elements.push(element);
            z += facings[i + 1] * surface.thickness;
        }
        let first_order = FirstOrder::of(&prescription, &indices, Meridian::Y);
        let reflects = |s: &Surface| s.coating != Coating::Ideal;
        Self {
            reflects: prescription.surfaces.iter().any(reflects),
            prescription,
            wavelength_nm,
            film_map: film_map(axis, &elements),
            elements,
            first_order,
        }
    }

    /// The name of the prescription.
    pub fn name(&self) -> &str {
        &self.prescription.name
    }

    /// The prescription.
    pub fn prescription(&self) -> &Prescription {
        &self.prescription
    }

    /// The wavelength at which rays are traced, in nanometers.
    pub fn wavelength(&self) -> f64 {
        self.wavelength_nm
    }

    /// The wavelengths of curves of color: the shortest that the prescription states, the lens's
    /// own, and the longest. They are the F and the C line at the ends if the prescription does
    /// not state several, or not the lens's own. Beyond the visible there is then one wavelength
    /// alone.
    pub fn spectral_lines(&self) -> [f64; 3] {
        let own = self.wavelength_nm;
        let stated = &self.prescription.wavelengths_nm;
        let [short, long] = match stated.contains(&own) && stated.len() > 1 {
            true => [f64::min, f64::max].map(|f| stated.iter().copied().fold(own, f)),
            false if VISIBLE.contains(&own) => [F_LINE, C_LINE],
            false => [own, own],
        };
        [short, own, long]
    }

    /// The lens at the primary wavelength that its file states, or as it is without one.
    pub fn at_primary_wavelength(&self) -> Self {
        match self.prescription.wavelengths_nm.first() {
            Some(nm) => self.at_wavelength(*nm),
            None => self.clone(),
        }
    }

    /// The lens at another wavelength, in nanometers.
    pub fn at_wavelength(&self, wavelength_nm: f64) -> Self {
        Self::at(self.prescription.clone(), wavelength_nm)
    }

    /// The lens with every length multiplied by a factor, as by the paper's option `-z`.
    pub fn scaled(&self, factor: f64) -> Self {
        Self::at(self.prescription.scaled(factor), self.wavelength_nm)
    }

    /// The lens scaled to a focal length; see [`Prescription::scaled_to`].
    pub fn scaled_to(&self, efl: Mm) -> Result<Self> {
        let scaled = self.prescription.scaled_to(efl, self.wavelength_nm)?;
        Ok(self.with(scaled))
    }

    /// The lens with another stop; see [`Prescription::with_stop`].
    pub fn with_stop(&self, semi_diameter: Mm) -> Result<Self> {
        let stopped = self
            .prescription
            .with_stop(semi_diameter, self.wavelength_nm)?;
        Ok(self.with(stopped))
    }

    /// The first-order data in the plane of the axis and y.
    pub fn first_order(&self) -> &FirstOrder {
        &self.first_order
    }

    /// The first-order data in a plane. The two planes differ only for cylinders and toroids.
    pub fn first_order_in(&self, plane: Meridian) -> FirstOrder {
        FirstOrder::of(
            &self.prescription,
            &self.prescription.indices(self.wavelength_nm),
            plane,
        )
    }

    /// The z of the last vertex that light meets, in millimeters from the first. It is the distance
    /// of the two, or of opposite sign if mirrors have the last one in front.
    pub fn length(&self) -> f64 {
        self.elements.last().map_or(0.0, |e| e.vertex_z)
    }

    /// The lens at one of its tabulated zoom positions, counted from 0.
    pub fn at_zoom(&self, position: usize) -> Result<Self> {
        Ok(self.with(self.prescription.at_zoom(position)?))
    }

    /// The edges of the stop's hole, if it is not round; see `trace::Element::edges`.
    pub fn iris_edges(&self) -> &[DVec2] {
        let stop = self.prescription.stop();
        stop.map_or(&[], |stop| &*self.elements[stop].edges)
    }

    /// Whether the stop's hole is round or a convex polygon around the axis, and no other surface
    /// has an outline.
    pub(crate) fn is_iris_convex(&self) -> bool {
        let is_convex = |element: &Element| match &element.hole {
            Some(corners) => corners.len() == element.edges.len(),
            None => true,
        };
        self.elements.iter().all(is_convex) && !self.has_outlines()
    }

    /// Whether the lens is symmetric about its axis.
    pub(crate) fn is_rotational(&self) -> bool {
        let mut surfaces = self.prescription.surfaces.iter();
        let is_round =
            |s: &Surface| s.shape.is_rotational() && s.frame.is_none() && s.outline.is_none();
        self.iris_edges().is_empty() && surfaces.all(is_round)
    }

    /// The lens with another iris.
    pub fn with_iris(&self, iris: Iris) -> Self {
        self.with(Prescription {
            iris,
            ..self.prescription.clone()
        })
    }

    /// The lens with this coating on every surface.
    pub fn with_coating(&self, coating: Coating) -> Self {
        self.with(self.prescription().clone().with_coating(coating))
    }

    /// Whether a surface other than the stop has a clear aperture that is not round.
    pub fn has_outlines(&self) -> bool {
        self.prescription.has_outlines()
    }

    /// Whether the middle of any surface is closed.
    pub fn is_obstructed(&self) -> bool {
        self.elements.iter().any(|e| e.obstruction > 0.0)
    }

    /// The lens without what closes the middles of its surfaces.
    pub(crate) fn unobstructed(&self) -> Cow<'_, Self> {
        if !self.is_obstructed() {
            return Cow::Borrowed(self);
        }
        let mut lens = self.clone();
        lens.elements.iter_mut().for_each(|e| e.obstruction = 0.0);
        Cow::Owned(lens)
    }

    /// The z in lens space of a plane behind the lens, in millimeters. The two differ only behind
    /// an odd number of mirrors, where z is counted from the last vertex along the light.
    pub(crate) fn straight_z(&self, z: f64) -> f64 {
        self.in_lens_space(z * DVec3::Z).z
    }

    /// The place in lens space of a point relative to the vertex of a surface, with z along the
    /// light that reaches it.
    pub(crate) fn placed(&self, surface: usize, point: DVec3) -> DVec3 {
        self.elements[surface].placed(point)
    }

    /// The place in lens space of a point behind the lens that has the coordinates in which rays
    /// leave the lens. Without decentered surfaces the two differ only behind an odd number of
    /// mirrors.
    pub fn in_lens_space(&self, p: DVec3) -> DVec3 {
        if let Some(map) = &self.film_map {
            return map.transform_point3(p);
        }
        let last = self.elements.last();
        match last.is_some_and(|e| (e.facing < 0.0) != e.is_mirror) {
            true => DVec3::new(p.x, p.y, 2.0 * self.length() - p.z),
            false => p,
        }
    }

    /// Whether any surface transmits only a part of the light, so that rays lose some of it.
    pub fn reflects(&self) -> bool {
        self.reflects
    }

    /// A lens of another prescription at the same wavelength.
    pub(crate) fn with(&self, prescription: Prescription) -> Self {
        Self::at(prescription, self.wavelength_nm)
    }

    /// Traces a ray from the scene to the film side.
    pub fn trace_from_scene(&self, ray: &LensRay) -> std::result::Result<LensRay, Loss> {
        self.tracer(Toward::Film, true).follow(*ray, |_, _| {})
    }

    /// Traces a ray from the film side into the scene.
    pub fn trace_from_film(&self, ray: &LensRay) -> std::result::Result<LensRay, Loss> {
        self.tracer(Toward::Scene, true).follow(*ray, |_, _| {})
    }

    /// Traces a ray and returns its hits. Without `apertures` nothing blocks it.
    pub fn trace_path(&self, ray: &LensRay, toward: Toward, apertures: bool) -> RayPath {
        let mut hits = Vec::with_capacity(self.elements.len());
        let outcome = self
            .tracer(toward, apertures)
            .follow(*ray, |_, hit| hits.push(hit));
        RayPath { outcome, hits }
    }

    /// The points of all surfaces that a ray from the scene hits, relative to their vertices in x
    /// and y, in millimeters. Nothing blocks it.
    pub(super) fn hits_on_surfaces(&self, ray: &LensRay) -> Vec<DVec2> {
        let mut hits = Vec::with_capacity(self.elements.len());
        let tracer = self.tracer(Toward::Film, false);
        let _ = tracer.walk(*ray, |_, _, hit| hits.push(hit.point.truncate()));
        hits
    }

    /// The surfaces prepared for tracing, from front to rear.
    pub(super) fn elements(&self) -> &[Element] {
        &self.elements
    }

    /// The tracer in a direction. Without `apertures` nothing blocks a ray.
    pub(super) fn tracer(&self, toward: Toward, apertures: bool) -> Tracer<'_> {
        Tracer {
            elements: &self.elements,
            toward,
            apertures,
        }
    }
}

/// The map to lens space from the coordinates in which rays leave the lens. `axis` is that from the
/// axis at the end of the last gap.
fn film_map(axis: Option<DAffine3>, elements: &[Element]) -> Option<Box<DAffine3>> {
    let end = elements.last().map_or(0.0, |last| last.vertex_z + last.gap);
    axis.map(|map| Box::new(map * DAffine3::from_translation(-end * DVec3::Z)))
}

/// Places an element in lens space, if it or an earlier one is decentered. `axis` is the map to
/// lens space from the axis at the element, which becomes that at the next one; none up to the
/// first decentered surface.
fn advance_axis(axis: &mut Option<DAffine3>, element: &mut Element, surface: &Surface) {
    let Some(frame) = surface
        .frame
        .as_deref()
        .copied()
        .or(axis.map(|_| SurfaceFrame::default()))
    else {
        return;
    };
    let facing = DVec3::new(1.0, 1.0, element.facing);
    let start = axis.unwrap_or_else(|| {
        DAffine3::from_translation(element.vertex_z * DVec3::Z) * DAffine3::from_scale(facing)
    });
    let place = start * frame.before.affine();
    element.place = Some(Box::new(place));
    let turn = match surface.is_mirror {
        true => DAffine3::from_scale(DVec3::new(1.0, 1.0, -1.0)),
        false => DAffine3::IDENTITY,
    };
    let gap = DAffine3::from_translation(surface.thickness * DVec3::Z);
    *axis = Some(place * turn * frame.after.affine() * gap);
}
