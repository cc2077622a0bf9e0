//! Follows a bundle of rays from surface to surface.

use std::ops::Range;

use glam::DVec3;

use super::asphere::asphere;
use super::bundle::Bundle;
use super::one_by_one::{iris, iris_fill, one_by_one};
use super::quadric::quadric;
use super::sphere::{Before, approach, sphere};
use super::step::{BEND, NO_BEND, SLIGHT_BEND, Step, kind_of};
use crate::lens::lens::Lens;
use crate::lens::trace::element::Form;
use crate::lens::trace::ray::Toward;
use crate::lens::trace::tracer::Course;
use crate::math::lanes::{LANES, Lanewise, Width};

impl Lens {
    /// Traces a bundle from the film side into the scene. Rays that get through end on the front
    /// surface; of the others only [`Bundle::loss`] means anything.
    pub fn trace_bundle_from_film(&self, bundle: &mut Bundle) {
        self.trace_bundle(bundle, Toward::Scene, Width::detect());
    }

    /// Traces a bundle from the scene to the film side.
    pub fn trace_bundle_from_scene(&self, bundle: &mut Bundle) {
        self.trace_bundle(bundle, Toward::Film, Width::detect());
    }

    /// Traces with vectors of a given width, for measuring.
    pub fn trace_bundle(&self, bundle: &mut Bundle, toward: Toward, width: Width) {
        let course = &self.course(toward, true);
        width.run(Follow { course, bundle });
    }
}

/// A bundle on its way through a lens.
pub(super) struct Follow<'a, 'b> {
    pub course: &'a Course<'a>,
    pub bundle: &'b mut Bundle,
}

impl Lanewise for Follow<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        if self.course.apertures {
            follow::<true, FUSED>(self.course, self.bundle);
        } else {
            follow::<false, FUSED>(self.course, self.bundle);
        }
    }
}

#[inline(always)]
pub(super) fn follow<const STOPS: bool, const FUSED: bool>(
    course: &Course<'_>,
    bundle: &mut Bundle,
) {
    let vertex_z = stretch::<STOPS, FUSED>(course, bundle, 0..course.elements.len());
    for z in &mut bundle.z {
        *z += vertex_z;
    }
}

/// Follows rays over some of the surfaces, counted as they are met. Before the first and behind
/// the last their places are from the last vertex that they met, whose z comes back.
#[inline(always)]
pub(super) fn stretch<const STOPS: bool, const FUSED: bool>(
    course: &Course<'_>,
    bundle: &mut Bundle,
    surfaces: Range<usize>,
) -> f64 {
    let count = course.elements.len();
    let sign = if course.toward == Toward::Film {
        1.0
    } else {
        -1.0
    };
    let mut vertex_z = 0.0;
    let zero = [0.0; LANES];
    let before = &mut Before {
        f: zero,
        g: zero,
        discriminant: zero,
        cos: zero,
    };
    for i in surfaces {
        let surface = if course.toward == Toward::Film {
            i
        } else {
            count - 1 - i
        };
        let element = &course.elements[surface];
        vertex_z = element.vertex_z;
        let shift = match course.toward {
            _ if i == 0 => -vertex_z,
            Toward::Film => -course.elements[surface - 1].gap,
            Toward::Scene => element.gap,
        };
        let bend = element.bend(course.toward);
        let step = Step {
            element,
            number: (surface as u64) << 2,
            shift,
            bend,
            sign,
        };
        match &element.form {
            Form::Sphere => {
                // From far away a ray is first followed to where it is near the vertex.
                if i == 0 || (element.curvature * shift).abs() > 4.0 {
                    approach::<FUSED>(&step, bundle);
                } else {
                    bundle.z.iter_mut().for_each(|z| *z += shift);
                }
                match kind_of(bend) {
                    NO_BEND => sphere::<NO_BEND, STOPS, FUSED>(&step, bundle, before),
                    SLIGHT_BEND => sphere::<SLIGHT_BEND, STOPS, FUSED>(&step, bundle, before),
                    _ => sphere::<BEND, STOPS, FUSED>(&step, bundle, before),
                }
            }
            Form::Conic { k } => quadric::<STOPS>(&step, DVec3::new(1.0, 1.0, 1.0 + k), bundle),
            Form::Cylinder { x, y } => quadric::<STOPS>(&step, DVec3::new(*x, *y, 1.0), bundle),
            Form::Asphere(profile) => asphere::<STOPS, FUSED>(&step, profile, bundle),
            Form::Toroid { .. } => one_by_one::<STOPS>(&step, bundle),
        }
        if STOPS && element.hole.is_some() {
            iris(&step, bundle);
        } else if !STOPS && !element.edges.is_empty() {
            iris_fill(&step, bundle);
        }
    }
    vertex_z
}
