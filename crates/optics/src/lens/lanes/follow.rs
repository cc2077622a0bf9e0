//! Follows a bundle of rays from surface to surface.

use std::ops::Range;

use ivcam_base::math::lanes::{SimdKernel, Width, dispatch};

use crate::lens::lanes::asphere::asphere;
use crate::lens::lanes::bundle::Bundle;
use crate::lens::lanes::iris::{block_at_iris, block_at_obstruction, note_iris_fill};
use crate::lens::lanes::quadric::quadric;
use crate::lens::lanes::singly::cross_singly;
use crate::lens::lanes::sphere::{CrossingTerms, approach, sphere};
use crate::lens::lanes::step::{LARGE_STEP, LaneStep, SAME_INDEX, SLIGHT_STEP, kind_of};
use crate::lens::lanes::toroid::toroid;
use crate::lens::lanes::transmittances::Transmittances;
use crate::lens::lens::Lens;
use crate::lens::trace::element::{Element, Form};
use crate::lens::trace::ray::Toward;
use crate::lens::trace::tracer::Tracer;

impl Lens {
    /// Traces a bundle from the film side into the scene. Rays that get through have their origin
    /// on the front surface. For lost rays only [`Bundle::loss`] is meaningful.
    pub fn trace_bundle_from_film(&self, bundle: &mut Bundle) {
        self.trace_bundle(bundle, Toward::Scene, Width::detect());
    }

    /// Traces a bundle from the film side into the scene as if no aperture blocked it. A ray is
    /// lost only if it misses a surface or is totally reflected.
    pub fn trace_bundle_unblocked(&self, bundle: &mut Bundle) {
        dispatch(Follow {
            tracer: &self.tracer(Toward::Scene, false),
            bundle,
            transmittances: None,
        });
    }

    /// Traces a bundle from the film side into the scene, and measures the shares of light that the
    /// surfaces transmit.
    pub fn trace_bundle_transmitted(
        &self,
        bundle: &mut Bundle,
        transmittances: &mut Transmittances,
    ) {
        dispatch(Follow {
            tracer: &self.tracer(Toward::Scene, true),
            bundle,
            transmittances: Some(transmittances),
        });
    }

    /// Traces a bundle in either direction, with vectors of a given width.
    pub fn trace_bundle(&self, bundle: &mut Bundle, toward: Toward, width: Width) {
        let tracer = &self.tracer(toward, true);
        width.run(Follow {
            tracer,
            bundle,
            transmittances: None,
        });
    }
}

/// The kernel that traces a bundle through a lens.
pub(super) struct Follow<'a, 'b> {
    pub tracer: &'a Tracer<'a>,
    pub bundle: &'b mut Bundle,
    /// Receives the shares of light that the surfaces transmit.
    pub transmittances: Option<&'b mut Transmittances>,
}

impl SimdKernel for Follow<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        if self.tracer.apertures {
            follow::<true, FUSED>(self.tracer, self.bundle, self.transmittances);
        } else {
            follow::<false, FUSED>(self.tracer, self.bundle, self.transmittances);
        }
    }
}

/// Traces a bundle through all surfaces. With `STOPS`, apertures block rays; without, fills are
/// noted.
#[inline(always)]
pub(super) fn follow<const STOPS: bool, const FUSED: bool>(
    tracer: &Tracer<'_>,
    bundle: &mut Bundle,
    mut transmittances: Option<&mut Transmittances>,
) {
    if let Some(transmittances) = &mut transmittances {
        transmittances.start();
    }
    let all = 0..tracer.elements.len();
    let vertex_z = stretch::<STOPS, FUSED>(tracer, bundle, all, transmittances);
    for z in &mut bundle.z {
        *z += vertex_z;
    }
}

/// The number of surfaces after which a bundle ends if all its rays are lost. Usual lenses have
/// fewer; in one of hundreds of surfaces most rays are lost soon.
const LOST_AFTER: usize = 32;

/// Moves rays into the coordinates of a surface if it is decentered, by `shift` along the axis and
/// then into its frame. Returns the shift that is left.
#[inline(always)]
fn enter(element: &Element, toward: Toward, bundle: &mut Bundle, shift: f64) -> f64 {
    let Some(frame) = &element.frame else {
        return shift;
    };
    bundle.z.iter_mut().for_each(|z| *z += shift);
    bundle.map(frame.entering(toward));
    0.0
}

/// Makes positions relative to the vertex of a surface, to which it is `along` from the last one.
/// Rays from far away are first moved to their points nearest the vertex.
#[inline(always)]
fn move_to_vertex<const FUSED: bool>(
    step: &LaneStep<'_>,
    is_first: bool,
    along: f64,
    bundle: &mut Bundle,
) {
    if is_first || (step.element.curvature * along).abs() > 4.0 {
        approach::<FUSED>(step, bundle);
    } else {
        bundle.z.iter_mut().for_each(|z| *z += step.shift);
    }
}

/// Traces rays through some of the surfaces, which are counted in the order of travel. Between
/// calls the positions are relative to the vertex of the last surface, along the axis that the rays
/// leave it along. The z of that vertex is returned.
#[inline(always)]
pub(super) fn stretch<const STOPS: bool, const FUSED: bool>(
    tracer: &Tracer<'_>,
    bundle: &mut Bundle,
    surfaces: Range<usize>,
    mut transmittances: Option<&mut Transmittances>,
) -> f64 {
    let mut vertex_z = 0.0;
    let terms = &mut CrossingTerms::zero();
    for i in surfaces {
        let (surface, along) = tracer.leg(i);
        let element = &tracer.elements[surface];
        let shift = enter(element, tracer.toward, bundle, along);
        vertex_z = element.vertex_z;
        let refraction = element.refraction(tracer.toward);
        let step = LaneStep {
            element,
            per_clear: 1.0 / element.clear,
            number: (surface as u64) << 2,
            shift,
            refraction,
            sign: tracer.toward.sign(),
        };
        match &element.form {
            _ if element.is_mirror => {
                cross_singly::<STOPS>(&step, tracer.toward, bundle, &mut terms.cos);
            }
            Form::ThinLens { .. } => {
                cross_singly::<STOPS>(&step, tracer.toward, bundle, &mut terms.cos);
            }
            Form::Sphere => {
                move_to_vertex::<FUSED>(&step, i == 0, along, bundle);
                match kind_of(refraction) {
                    SAME_INDEX => sphere::<SAME_INDEX, STOPS, FUSED>(&step, bundle, terms),
                    SLIGHT_STEP => sphere::<SLIGHT_STEP, STOPS, FUSED>(&step, bundle, terms),
                    _ => sphere::<LARGE_STEP, STOPS, FUSED>(&step, bundle, terms),
                }
            }
            Form::Quadric(weights) => {
                move_to_vertex::<FUSED>(&step, i == 0, along, bundle);
                quadric::<STOPS, FUSED>(&step, *weights, bundle, terms);
                if transmittances.is_some() {
                    terms.divide_cosines();
                }
            }
            Form::Asphere(profile) => {
                asphere::<STOPS, FUSED>(&step, profile, bundle, terms);
                if transmittances.is_some() {
                    terms.divide_cosines();
                }
            }
            Form::Toroid { .. } => toroid::<STOPS>(&step, bundle, &mut terms.cos),
        }
        if let Some(transmittances) = &mut transmittances {
            transmittances.cross::<FUSED>(&step, &terms.cos);
        }
        match STOPS {
            true => {
                block_at_obstruction(&step, bundle);
                block_at_iris(&step, bundle);
            }
            false => note_iris_fill(&step, bundle),
        }
        if let Some(frame) = &element.frame {
            bundle.map(frame.leaving(tracer.toward));
        }
        if i % LOST_AFTER == LOST_AFTER - 1 && bundle.lost.iter().all(|lost| *lost != 0.0) {
            break;
        }
    }
    vertex_z
}
