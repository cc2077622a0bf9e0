//! The aperture of a studio photograph, and what is added to its scene.

use ivcam_base::diag::Sink;
use ivcam_inventor::pose::CameraPose;
use ivcam_inventor::snapshot::Snapshot;
use ivcam_render::scene::Studio;

use super::plan::Plan;
use super::pose::{drawn_bounds, own_focus};

/// The circle of confusion that looks sharp, as a share of the film's diagonal.
const CONFUSION: f64 = 1.0 / 1500.0;
/// The smallest aperture of a studio photograph. Beyond it diffraction would blur a real one.
const SMALLEST: f64 = 64.0;

/// Returns what the plan adds to a scene.
pub(super) fn studio_of(plan: &Plan, snapshot: &Snapshot<'_>) -> Option<Studio> {
    plan.light.studio(|| drawn_bounds(snapshot, plan))
}

/// Returns the plan with the lens stopped down so that the studio's scene is sharp from front to
/// back; `None` if the aperture is given or the lens is wide enough.
///
/// With the focal length f and the focus at u, a point at x is a circle of f²|u − x|/(N x (u − f))
/// on the film.
pub(super) fn stopped_down(
    plan: &Plan,
    pose: &CameraPose,
    studio: Option<&Studio>,
) -> Option<Plan> {
    let (low, high) = studio.filter(|_| plan.light.studio)?.bounds;
    let choice = plan.lens().filter(|choice| choice.f_number.is_none())?;
    let lens = choice.open(&mut Sink::new()).ok()?;
    let f = lens.first_order().efl() * 1e-3;
    let u = plan.focus.unwrap_or_else(|| own_focus(pose)).0;
    let (middle, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
    let away = middle.distance(pose.position);
    let diagonal = plan.film.width.hypot(plan.film.height) * 1e-3;
    let blur = |x: f64| f * f * (u - x).abs() / (x * (u - f));
    let wide = blur((away - radius).max(0.1 * away)).max(blur(away + radius));
    let wanted = wide / (CONFUSION * diagonal);
    if !(wanted > 1.0 && wanted.is_finite()) {
        return None;
    }
    let mut stopped = plan.clone();
    // A tenth of a stop is enough, and reads well.
    let number = (10.0 * wanted.min(SMALLEST)).ceil() / 10.0;
    stopped.lens_mut()?.f_number = Some(number);
    let choice = stopped.lens()?;
    choice.open(&mut Sink::new()).is_ok().then_some(stopped)
}
