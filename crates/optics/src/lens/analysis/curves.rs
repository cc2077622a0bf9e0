//! The curves of a data sheet: distortion, illumination, field curvature, color and spherical
//! aberration.
//!
//! Lengths are in millimeters, heights are on the film, and angles are in radians. A [`Conjugate`]
//! is an object plane with the film's position.

use glam::{DVec2, DVec3};
use ivcam_base::work::Budget;
use rayon::prelude::*;
use serde::Serialize;

use crate::lens::lens::{Lens, VISIBLE};
use crate::lens::optics::chief_ray::angle_of;
use crate::lens::optics::focus::{FocusMethod, focus};
use crate::lens::trace::ray::{LensRay, Toward};

/// The number of steps of the curves over the film's height.
const STEPS: usize = 40;

/// An object plane and a film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conjugate {
    /// The distance of the object plane in front of the first vertex; it may be infinite.
    pub distance: f64,
    /// The z of the film, from the front vertex.
    pub film_z: f64,
}

/// What distortion is measured against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ProjectionLaw {
    /// The image height is proportional to the tangent of the angle.
    Tangent,
    /// The image height is proportional to the angle.
    Angle,
    /// The image height is proportional to the height of the object.
    ObjectHeight,
}

impl ProjectionLaw {
    /// The name in the data sheet.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Tangent => "f tan θ",
            Self::Angle => "f θ",
            Self::ObjectHeight => "m y",
        }
    }
}

/// What distortion is measured against, with its scale.
#[derive(Clone, Copy, Debug)]
pub(super) struct DistortionReference {
    conjugate: Conjugate,
    pub(super) law: ProjectionLaw,
    /// What the chief ray of the film's middle has of it, if the lens is decentered.
    center: DVec2,
    /// The scale of the image near the axis: millimeters per unit of the tangent, per radian, or
    /// per millimeter of the object. Off the paraxial focus the image as a whole has another
    /// scale than at it, which is not distortion.
    pub(super) scale: Option<f64>,
}

impl DistortionReference {
    /// The height on the film over what it is proportional to, counted from the film's middle.
    fn local_scale(&self, chief: &LensRay, height: f64) -> Option<f64> {
        let reference = self.conjugate.reference(chief, self.law)? - self.center;
        Some(height / reference.length()).filter(|s| s.is_finite())
    }

    /// The distortion as a share, at the height at which a chief ray arrives.
    pub(super) fn distortion(&self, chief: &LensRay, height: f64) -> Option<f64> {
        if height == 0.0 {
            return Some(0.0);
        }
        let local = self.local_scale(chief, height)?;
        Some(local / self.scale? - 1.0)
    }
}

/// The properties of the image at a height on the film. Lengths are in millimeters.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct FieldRow {
    /// The height on the film.
    pub height: f64,
    /// The angle of the chief ray in the scene, in degrees.
    pub angle_degrees: f64,
    /// The distortion relative to `LensSheet::projection`.
    pub distortion_percent: Option<f64>,
    /// The irradiance over that on the axis.
    pub relative_illumination: f64,
    /// The angle between the chief ray and the axis where it arrives on the film, in degrees.
    /// Positive: the ray travels away from the axis.
    pub chief_ray_angle_degrees: Option<f64>,
    /// The distance from the film to the focus of rays in the meridian near the chief ray.
    pub tangential_focus: Option<f64>,
    /// The distance from the film to the focus of rays across the meridian near the chief ray.
    pub sagittal_focus: Option<f64>,
    /// `tangential_focus` at the F line.
    pub tangential_focus_f: Option<f64>,
    /// `sagittal_focus` at the F line.
    pub sagittal_focus_f: Option<f64>,
    /// `tangential_focus` at the C line.
    pub tangential_focus_c: Option<f64>,
    /// `sagittal_focus` at the C line.
    pub sagittal_focus_c: Option<f64>,
    /// The image height at the F line minus that at the d line.
    pub lateral_f: Option<f64>,
    /// The image height at the C line minus that at the d line.
    pub lateral_c: Option<f64>,
}

/// The distances from the film at which rays of a zone of the pupil cross the axis, in millimeters.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Zone {
    /// The height of the rays in front of the lens, over that of the widest beam.
    pub pupil: f64,
    /// The distance at the F line.
    pub focus_f: Option<f64>,
    /// The distance at the d line.
    pub focus_d: Option<f64>,
    /// The distance at the C line.
    pub focus_c: Option<f64>,
}

/// The paraxial focus at a wavelength.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ColorRow {
    /// The wavelength in nanometers.
    pub wavelength_nm: f64,
    /// The distance from the focus of the lens's own wavelength, in millimeters.
    pub focus: f64,
}

/// Half of the film's diagonal, or what takes its place in the scales of a film of 0: that of a
/// normal lens of this focal length.
pub(super) fn typical_height(lens: &Lens, image_height: f64) -> f64 {
    match image_height {
        0.0 => 0.43 * lens.first_order().efl().abs(),
        height => height,
    }
}

impl Conjugate {
    /// The angle of a chief ray in the scene, if the object is at infinity; otherwise the height at
    /// which the ray meets the object plane. Returns none if it meets no object.
    fn object(&self, chief: &LensRay) -> Option<f64> {
        match self.distance.is_infinite() {
            true => Some(angle_of(chief.direction)),
            false => self.object_point(chief).map(|point| point.y),
        }
    }

    /// The point at which a chief ray meets the object plane.
    fn object_point(&self, chief: &LensRay) -> Option<DVec2> {
        let d = chief.direction;
        let far = (-self.distance - chief.origin.z) / d.z;
        let point = (chief.origin + far * d).truncate();
        (far > 0.0 && point.is_finite()).then_some(point)
    }

    /// What the image is proportional to in a projection, of a chief ray, in x and y.
    fn reference(&self, chief: &LensRay, law: ProjectionLaw) -> Option<DVec2> {
        let angle = angle_of(chief.direction);
        let length = match law {
            ProjectionLaw::ObjectHeight => return self.object_point(chief),
            ProjectionLaw::Tangent if angle < std::f64::consts::FRAC_PI_2 => libm::tan(angle),
            ProjectionLaw::Tangent => return None,
            ProjectionLaw::Angle => angle,
        };
        Some(length * chief.direction.truncate().normalize_or_zero())
    }

    /// The projection that distortion is measured against, on a film that ends at a height.
    pub(super) fn projection(&self, lens: &Lens, image_height: f64) -> DistortionReference {
        let chief = |height| lens.chief_ray(DVec2::new(0.0, height), self.film_z);
        let half = chief(image_height).map_or(0.0, |chief| angle_of(chief.direction));
        let law = match self.distance.is_finite() {
            _ if half > 60f64.to_radians() => ProjectionLaw::Angle,
            true => ProjectionLaw::ObjectHeight,
            false => ProjectionLaw::Tangent,
        };
        let reference = |height| chief(height).and_then(|chief| self.reference(&chief, law));
        let is_decentered = lens.prescription().is_decentered();
        let mut projection = DistortionReference {
            conjugate: *self,
            law,
            center: reference(0.0)
                .filter(|_| is_decentered)
                .unwrap_or(DVec2::ZERO),
            scale: None,
        };
        let near = 1e-4 * typical_height(lens, image_height);
        projection.scale = chief(near).and_then(|chief| projection.local_scale(&chief, near));
        projection
    }

    /// The distortion of the data sheet as a share, at the end of a film.
    pub fn distortion(&self, lens: &Lens, image_height: f64) -> Option<f64> {
        let chief = lens.chief_ray(DVec2::new(0.0, image_height), self.film_z)?;
        self.projection(lens, image_height)
            .distortion(&chief, image_height)
    }

    /// The z of the paraxial image of the object.
    pub(super) fn paraxial_image(&self, lens: &Lens) -> Option<f64> {
        let optics = lens.first_order();
        let Some(focal) = optics.focal else {
            let focus = focus(optics, FocusMethod::Film, self.distance).ok();
            return focus.map(|focus| focus.film_z);
        };
        let x = self.distance + focal.ffl;
        Some(focal.rear_focal_point + focal.efl * focal.front_efl / x).filter(|z| z.is_finite())
    }

    /// The tangential and the sagittal focus at a film point, from the film: the points at which
    /// two rays on either side of the chief ray intersect.
    fn close_foci(&self, lens: &Lens, film: DVec2) -> (Option<f64>, Option<f64>) {
        let film_z = self.film_z;
        let Some(chief) = lens.chief_ray(film, film_z) else {
            return (None, None);
        };
        let d = -chief.direction;
        let up = DVec3::new(0.0, d.z, -d.y);
        let aside = DVec3::X;
        let pupil = lens
            .first_order()
            .entrance_pupil
            .map_or(1.0, |p| p.semi_diameter);
        let step = 1e-3 * pupil;
        let source = self.distance.is_finite().then(|| {
            let far = (-self.distance - chief.origin.z) / chief.direction.z;
            chief.origin + far * chief.direction
        });
        let trace = |offset: DVec3| {
            let through = chief.origin + offset;
            let ray = match source {
                Some(origin) => LensRay::new(origin, through - origin),
                None => LensRay::new(through - 10.0 * pupil * d, d),
            };
            lens.trace_path(&ray, Toward::Film, false).outcome.ok()
        };
        let crossing = |offset: DVec3, axis: DVec3| {
            let (a, b) = (trace(offset)?, trace(-offset)?);
            // The z at which the two rays have the same coordinate along `axis`.
            let slope = |r: &LensRay| r.direction.dot(axis) / r.direction.z;
            let at = |r: &LensRay| r.origin.dot(axis) + (film_z - r.origin.z) * slope(r);
            let z = (at(&b) - at(&a)) / (slope(&a) - slope(&b));
            Some(z).filter(|z| z.is_finite())
        };
        (
            crossing(step * up, DVec3::Y),
            crossing(step * aside, DVec3::X),
        )
    }

    /// The curves over the film's height. `lines` are the lens at the F line, at its own wavelength
    /// and at the C line.
    pub(super) fn field_rows(
        &self,
        lines: &[Lens; 3],
        image_height: f64,
        projection: &DistortionReference,
    ) -> Vec<FieldRow> {
        let lens = &lines[1];
        let center = lens.irradiance(DVec2::ZERO, self.film_z);
        let row = |i: usize| {
            let height = image_height * i as f64 / STEPS as f64;
            let film = DVec2::new(0.0, height);
            let chief = lens.chief_ray(film, self.film_z);
            let arriving = chief.and_then(|chief| {
                let back = LensRay::new(chief.origin + chief.direction, -chief.direction);
                lens.trace_path(&back, Toward::Film, false).outcome.ok()
            });
            let distortion = chief.and_then(|chief| projection.distortion(&chief, height));
            let object = chief.and_then(|chief| self.object(&chief));
            let lateral = |line: &Lens| {
                let object = object?;
                let error = |chief: &LensRay| Some(self.object(chief)? - object);
                let there = line.height_where(height, self.film_z, error)?;
                Some(there - height).filter(|d| d.is_finite() && d.abs() < 0.2 * height.max(1e-9))
            };
            let at_axis = |value: f64, other: Option<f64>| if i == 0 { Some(value) } else { other };
            let foci = lines.each_ref().map(|line| self.close_foci(line, film));
            FieldRow {
                height,
                angle_degrees: match i {
                    0 if !lens.prescription().is_decentered() => 0.0,
                    _ => chief.map_or(f64::NAN, |chief| angle_of(chief.direction).to_degrees()),
                },
                distortion_percent: at_axis(0.0, distortion.map(|share| 100.0 * share)),
                relative_illumination: lens.irradiance(film, self.film_z) / center,
                chief_ray_angle_degrees: arriving
                    .map(|out| libm::atan2(out.direction.y, out.direction.z).to_degrees()),
                tangential_focus: foci[1].0,
                sagittal_focus: foci[1].1,
                tangential_focus_f: foci[0].0,
                sagittal_focus_f: foci[0].1,
                tangential_focus_c: foci[2].0,
                sagittal_focus_c: foci[2].1,
                lateral_f: at_axis(0.0, lateral(&lines[0])),
                lateral_c: at_axis(0.0, lateral(&lines[2])),
            }
        };
        let account = Budget::current();
        let steps = if image_height == 0.0 { 0 } else { STEPS };
        let rows = (0..=steps).into_par_iter();
        rows.map(|i| account.during(|| row(i))).collect()
    }

    /// The longitudinal color from 400 to 700 nm, or beyond the visible between the wavelengths of
    /// the prescription.
    pub(super) fn color(&self, lens: &Lens) -> Vec<ColorRow> {
        let focus = |nm: f64| self.paraxial_image(&lens.at_wavelength(nm));
        let [short, own, long] = lens.spectral_lines();
        let [low, high] = match VISIBLE.contains(&own) {
            true => [400.0, 700.0],
            false => [short, long],
        };
        let Some(own) = focus(own).filter(|_| low < high) else {
            return Vec::new();
        };
        (0..=30)
            .map(|i| low + (high - low) / 30.0 * f64::from(i))
            .filter_map(|wavelength_nm| {
                Some(ColorRow {
                    wavelength_nm,
                    focus: focus(wavelength_nm)? - own,
                })
            })
            .collect()
    }

    /// The longitudinal spherical aberration of the lens at three wavelengths.
    pub(super) fn zones(&self, lines: &[Lens; 3]) -> Vec<Zone> {
        let beam = lines[1].beam_height(self.distance);
        let focus = |lens: &Lens, pupil: f64| {
            if pupil == 0.0 {
                return self.paraxial_image(lens).map(|z| z - self.film_z);
            }
            let ray = lens.axial_ray(self.distance, pupil * beam);
            let out = lens.trace_path(&ray, Toward::Film, false).outcome.ok()?;
            let z = out.origin.z - out.origin.y / out.direction.y * out.direction.z;
            Some(z - self.film_z).filter(|z| z.is_finite())
        };
        (0..=20)
            .map(|i| f64::from(i) / 20.0)
            .map(|pupil| Zone {
                pupil,
                focus_f: focus(&lines[0], pupil),
                focus_d: focus(&lines[1], pupil),
                focus_c: focus(&lines[2], pupil),
            })
            .collect()
    }
}
