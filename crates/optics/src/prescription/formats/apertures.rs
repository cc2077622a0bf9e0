//! Clear apertures for prescriptions that list none, or only the stop or the entrance beam.
//!
//! The rule is that of design programs: the semi-diameter of a surface is the height of the
//! first-order beam on it, which is that of the marginal ray plus that of the chief ray at the edge
//! of the field.

use ivcam_base::diag::{Sink, Span};

use crate::prescription::first_order::FirstOrder;
use crate::prescription::glass::D_LINE;
use crate::prescription::prescription::{Prescription, StatedFNumber};
use crate::prescription::surface::{Meridian, Surface};

/// The relative difference of the f-numbers of a design program's file that counts as a
/// contradiction.
pub(super) const F_NUMBER_TOLERANCE: f64 = 5e-3;

/// The beam as a file describes it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SystemData {
    /// The diameter of the entrance pupil.
    pub entrance_diameter: Option<f64>,
    /// The f-number of the image.
    pub f_number: Option<f64>,
    /// The numerical aperture in front of the lens, for an object that is not at infinity.
    pub object_aperture: Option<f64>,
    /// The numerical aperture of the image.
    pub image_aperture: Option<f64>,
    /// Half of the field in degrees, if the file gives it as an angle.
    pub half_field: Option<f64>,
    /// The part of the beam's radius that vignetting takes at the edge of the field.
    pub vignetting: f64,
    /// The height of the edge of the field in the image, if the file gives it instead of an angle.
    pub image_height: Option<f64>,
    /// The height of the edge of the field on the object, if the file gives it instead of an angle.
    pub object_height: Option<f64>,
    /// The distance of the object in front of the first surface, if it is finite.
    pub object_distance: Option<f64>,
    /// The place of the f-number or of the entrance pupil in the file, if that is stated.
    pub stated: Option<Span>,
}

impl SystemData {
    /// Takes over the entrance pupil that a file states at a place; 0 states none.
    pub(super) fn state_entrance(&mut self, diameter: f64, span: Span) {
        self.entrance_diameter = Some(diameter).filter(|d| *d > 0.0);
        self.stated = Some(span);
    }

    /// Takes over the f-number that a file states at a place; 0 states none.
    pub(super) fn state_f_number(&mut self, f_number: f64, span: Span) {
        self.f_number = Some(f_number).filter(|n| *n > 0.0);
        self.stated = Some(span);
    }

    /// The beam with the entrance pupil or the f-number of the numerical aperture that it states,
    /// if it does.
    pub(super) fn with_pupil(self, lens: &Prescription) -> Self {
        let optics = lens.first_order(D_LINE);
        // Files write infinity as 1e10 or more.
        let distance = self.object_distance.filter(|d| d.abs() < 1e9);
        let of_image = || {
            let focal = optics.focal?;
            let magnification = focal.front_efl / (distance? + focal.front_focal_point);
            Some(magnification.abs() * self.image_aperture?)
        };
        let pupil = || {
            let sine = self.object_aperture.or_else(of_image)? / optics.n_object;
            let stop = optics.stop.unwrap_or(0);
            Some(2.0 * (distance? + pupil_place(lens, stop)?) * sine / (1.0 - sine * sine).sqrt())
        };
        let f_number = || self.image_aperture.map(|aperture| 0.5 / aperture);
        let pupil = pupil().filter(|d| d.is_finite() && *d > 0.0);
        let entrance_diameter = self.entrance_diameter.or(pupil);
        Self {
            entrance_diameter,
            f_number: self
                .f_number
                .or_else(|| f_number().filter(|_| entrance_diameter.is_none())),
            ..self
        }
    }

    /// The height of the object and its distance; none if one of them is not stated.
    fn object(&self) -> Option<[f64; 2]> {
        let height = self.object_height.filter(|h| *h > 0.0)?;
        let distance = self
            .object_distance
            .filter(|d| d.is_finite() && *d != 0.0)?;
        Some([height, distance])
    }

    /// The height of the edge of the field in the image: the stated one, or that of the paraxial
    /// image of the object's edge.
    pub(super) fn height_in_image(&self, lens: &Prescription) -> Option<f64> {
        let of_object = || {
            let [height, distance] = self.object()?;
            let focal = lens.first_order(D_LINE).focal?;
            Some((height * focal.front_efl / (distance + focal.front_focal_point)).abs())
        };
        self.image_height.or_else(of_object)
    }

    /// Whether the file states a field, and it is the axis alone.
    pub(super) fn is_axis_alone(&self) -> bool {
        let stated = [self.half_field, self.image_height, self.object_height];
        stated.into_iter().flatten().reduce(f64::max) == Some(0.0)
    }
}

/// The largest field of lists in x and y: a height, or an angle in degrees whose tangents in x and
/// y are those of the two; none of empty lists.
pub(super) fn largest_field([x, y]: [&[f64]; 2], is_angle: bool) -> Option<f64> {
    let at = |list: &[f64], i: usize| list.get(i).map_or(0.0, |value| value.abs());
    let points = (0..x.len().max(y.len())).map(|i| [at(x, i), at(y, i)]);
    let radius = |[x, y]: [f64; 2]| match is_angle && x > 0.0 && y > 0.0 {
        false => libm::hypot(x, y),
        true => {
            let [x, y] = [x, y].map(|angle| libm::tan(angle.min(89.9).to_radians()));
            libm::atan(libm::hypot(x, y)).to_degrees()
        }
    };
    points.map(radius).reduce(f64::max)
}

/// Fills in the semi-diameters that are not finite, except those of planes in one medium, which no
/// part of a lens has to be at. Returns the numbers of their surfaces; none if the beam is not
/// known.
pub(super) fn fill(lens: &mut Prescription, beam: SystemData) -> Vec<usize> {
    let stop = lens.stop().unwrap_or(0);
    let is_open = |&i: &usize| {
        let surface = &lens.surfaces[i];
        let is_real = i == stop || !surface.is_flat_in(lens.medium_before(i));
        is_real && !surface.semi_diameter.is_finite()
    };
    let open: Vec<usize> = (0..lens.surfaces.len()).filter(is_open).collect();
    if open.is_empty() {
        return open;
    }
    let indices = lens.indices(D_LINE);
    let optics = FirstOrder::of(lens, &indices, Meridian::Y);
    let ones = heights(lens, &indices, (1.0, 0.0));
    let entrance = beam.entrance_diameter.or_else(|| {
        let efl = optics.focal?.efl;
        Some(efl.abs() / beam.f_number?)
    });
    let marginal = match entrance {
        Some(diameter) => 0.5 * diameter,
        None => match lens.surfaces[stop].semi_diameter {
            radius if radius.is_finite() && ones[stop] != 0.0 => radius / ones[stop].abs(),
            _ => return Vec::new(),
        },
    };
    let widest = libm::tan(70_f64.to_radians());
    let tilted = heights(lens, &indices, (0.0, 1.0));
    // The chief ray goes through the center of the stop.
    let shift = -pupil_place(lens, stop).unwrap_or(0.0);
    let slope = match (beam.image_height, beam.object(), optics.focal) {
        (Some(height), _, Some(focal)) => (height / focal.efl).abs().min(widest),
        // The entrance pupil is `shift` in front of the first vertex.
        (_, Some([height, distance]), _) => (height / (distance - shift)).abs().min(widest),
        _ => libm::tan(beam.half_field.unwrap_or(0.0).clamp(0.0, 70.0).to_radians()),
    };
    for &i in &open {
        let surface = &mut lens.surfaces[i];
        let axial = (marginal * ones[i]).abs();
        let chief = (slope * (tilted[i] + shift * ones[i])).abs();
        let wide = if i == stop {
            axial
        } else {
            axial.max((1.0 - beam.vignetting) * axial + chief)
        };
        let c = surface.curvature.per_mm().abs();
        surface.semi_diameter = if c * wide > 0.98 { 0.98 / c } else { wide };
    }
    open
}

/// Notes the f-number that the file states, or that follows from its entrance pupil, if paraxial
/// rays through the apertures contradict it by more than a relative tolerance.
/// The file may mean real rays, which only `lens` can trace.
pub(super) fn note_f_number(lens: &mut Prescription, beam: SystemData, tolerance: f64) {
    let Some(span) = beam.stated else { return };
    let optics = lens.first_order(D_LINE);
    let (Some(focal), Some(found)) = (optics.focal, optics.f_number()) else {
        return;
    };
    let by_pupil = beam.entrance_diameter.map(|d| focal.efl.abs() / d);
    let stated = by_pupil.or(beam.f_number);
    let stated = stated.filter(|stated| (found / stated - 1.0).abs() > tolerance);
    lens.stated_f_number = stated.map(|value| StatedFNumber {
        value,
        span,
        tolerance,
    });
}

/// Gives a stop without an aperture that of the axial beam which the other surfaces let through,
/// with a warning: without it the lens has no f-number.
pub(super) fn close_open_stop(lens: &mut Prescription, sink: &mut Sink) {
    let Some(stop) = lens.stop() else { return };
    if lens.surfaces[stop].semi_diameter.is_finite() {
        return;
    }
    let heights = heights(lens, &lens.indices(D_LINE), (1.0, 0.0));
    let limits = lens.surfaces.iter().zip(&heights).enumerate();
    let limits = limits.map(|(i, (surface, y))| (i, surface.semi_diameter / y.abs()));
    let narrowest = limits.min_by(|a, b| a.1.total_cmp(&b.1));
    let Some((limit, entrance)) = narrowest.filter(|(_, r)| r.is_finite()) else {
        return;
    };
    let beam = entrance * heights[stop].abs();
    let radius = beam.min(lens.surfaces[stop].widest_cap());
    if radius > 0.0 {
        let message = format!(
            "the stop, surface {stop}, has no aperture: it is as wide as the beam on the axis that \
             surface {limit} lets through, {:.3} mm in diameter",
            2.0 * radius
        );
        sink.warn(lens.surfaces[stop].span, message)
            .help("give the stop a diameter, or use `--aperture`");
        lens.surfaces[stop].semi_diameter = radius;
    }
}

/// Warns of a lens without power. A telescope has none, but so has a file read wrongly.
pub(super) fn warn_if_afocal(lens: &Prescription, sink: &mut Sink) {
    let indices = lens.indices(D_LINE);
    let in_y = FirstOrder::of(lens, &indices, Meridian::Y).focal;
    if in_y
        .or(FirstOrder::of(lens, &indices, Meridian::X).focal)
        .is_some()
    {
        return;
    }
    let bends =
        |(i, s): (usize, &Surface)| s.power([indices[i], indices[i + 1]], Meridian::Y) != 0.0;
    let place = lens.surfaces.first().map_or(Span::at(0), |s| s.span);
    if lens.surfaces.iter().enumerate().any(bends) {
        sink.warn(
            place,
            "the lens is afocal, although its surfaces have power",
        )
        .help("parallel light leaves it parallel; if it is no telescope, a number is wrong");
    } else {
        sink.warn(place, "no surface of the lens has power")
            .help("check the radii and the indices: are columns swapped?");
    }
}

/// The distance of the entrance pupil behind the front vertex, which does not depend on the stop's
/// aperture; none if it is at infinity.
fn pupil_place(lens: &Prescription, stop: usize) -> Option<f64> {
    let indices = lens.indices(D_LINE);
    let [one, tilted] = [(1.0, 0.0), (0.0, 1.0)].map(|ray| heights(lens, &indices, ray)[stop]);
    (one != 0.0).then(|| tilted / one)
}

/// The heights on all surfaces of a first-order ray, which has the height y and the slope u at the
/// plane of the front vertex.
fn heights(lens: &Prescription, indices: &[f64], (mut y, u): (f64, f64)) -> Vec<f64> {
    let mut nu = u * indices[0];
    let mut heights = Vec::with_capacity(lens.surfaces.len());
    for (i, surface) in lens.surfaces.iter().enumerate() {
        heights.push(y);
        nu -= y * surface.power([indices[i], indices[i + 1]], Meridian::Y);
        y += surface.thickness * nu / indices[i + 1];
    }
    heights
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prescription::glass::Medium;

    /// A thin lens of 50 mm with its stop, 100 mm behind the object: the image has the same size,
    /// and so has the aperture.
    #[test]
    fn a_numerical_aperture_is_an_entrance_pupil() {
        let front = Surface::sphere(50.0, 1e-12, Medium::constant(1.5), f64::INFINITY);
        let rear = Surface::sphere(-50.0, 100.0, Medium::air(), f64::INFINITY);
        let front = Surface {
            is_stop: true,
            ..front
        };
        let lens = Prescription::new("a", vec![front, rear]);
        let near = SystemData {
            object_distance: Some(100.0),
            ..SystemData::default()
        };
        let wanted = 200.0 * libm::tan(libm::asin(0.1));
        for beam in [
            SystemData {
                object_aperture: Some(0.1),
                ..near
            },
            SystemData {
                image_aperture: Some(0.1),
                ..near
            },
        ] {
            let found = beam.with_pupil(&lens).entrance_diameter;
            assert!((found.unwrap() - wanted).abs() < 1e-9, "{found:?}");
        }
        let far = SystemData {
            image_aperture: Some(0.1),
            object_distance: Some(1e13),
            ..near
        };
        assert_eq!(far.with_pupil(&lens).f_number, Some(5.0));
    }

    /// A stop 20 mm behind a thin lens of 50 mm has its image 100/3 mm behind the lens.
    #[test]
    fn a_numerical_aperture_is_that_of_the_entrance_pupil_of_a_stop_without_an_aperture() {
        let free = f64::INFINITY;
        let surfaces = vec![
            Surface::sphere(50.0, 1e-12, Medium::constant(1.5), free),
            Surface::sphere(-50.0, 20.0, Medium::air(), free),
            Surface::stop(30.0, Medium::air(), free),
        ];
        let mut lens = Prescription::new("a", surfaces);
        let beam = SystemData {
            object_aperture: Some(0.1),
            object_distance: Some(100.0),
            ..SystemData::default()
        };
        let beam = beam.with_pupil(&lens);
        let tangent = libm::tan(libm::asin(0.1));
        let wanted = 2.0 * (100.0 + 100.0 / 3.0) * tangent;
        assert!((beam.entrance_diameter.unwrap() - wanted).abs() < 1e-9);
        fill(&mut lens, beam);
        let pupil = lens.first_order(D_LINE).entrance_pupil.unwrap();
        let found = pupil.semi_diameter / (100.0 + pupil.z);
        assert!((found - tangent).abs() < 1e-12, "{found}");
    }

    /// A stop 10 mm in front of a thin lens: at 45 degrees the beam is 10 mm lower there.
    #[test]
    fn a_surface_is_as_wide_as_the_beam_on_it() {
        let free = f64::INFINITY;
        let surfaces = vec![
            Surface::stop(10.0, Medium::air(), free),
            Surface::sphere(100.0, 1e-9, Medium::constant(1.5), free),
            Surface::sphere(-100.0, 0.0, Medium::air(), free),
        ];
        let mut lens = Prescription::new("a", surfaces);
        let beam = SystemData {
            entrance_diameter: Some(4.0),
            half_field: Some(45.0),
            ..SystemData::default()
        };
        assert_eq!(fill(&mut lens, beam), [0, 1, 2]);
        let radii: Vec<f64> = lens.surfaces.iter().map(|s| s.semi_diameter).collect();
        assert_eq!(radii[0], 2.0);
        assert!(
            (radii[1] - 12.0).abs() < 1e-6 && (radii[2] - 12.0).abs() < 1e-6,
            "{radii:?}"
        );
        assert!(fill(&mut lens, beam).is_empty());
        lens.surfaces[2].thickness = 50.0;
        lens.surfaces
            .push(Surface::sphere(0.0, 0.0, Medium::air(), free));
        assert!(fill(&mut lens, beam).is_empty());
    }
}
