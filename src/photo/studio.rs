//! The camera and the exposure of a studio photograph.

use ivcam_base::diag::Sink;
use ivcam_inventor::pose::CameraPose;
use ivcam_inventor::snapshot::Snapshot;
use ivcam_render::bvh::Ray;
use ivcam_render::scene::Studio;
use ivcam_render::shade::{Shading, Work};

use super::plan::Plan;
use super::pose::{inventor_bounds, own_focus};
use super::session::Session;
use super::view::rays_over;

/// The circle of confusion that looks sharp, as a share of the film's diagonal.
const CONFUSION: f64 = 1.0 / 1500.0;
/// The smallest aperture of a studio photograph. Beyond it diffraction would blur a real one.
const SMALLEST: f64 = 64.0;
/// The rays across and down that meter the exposure.
const GRID: (u32, u32) = (36, 24);
/// The paths of each ray.
const PATHS: u16 = 16;
/// The level that the brightest tenth of the scene gets.
const BRIGHT: f64 = 0.8;

/// Returns what the plan adds to a scene.
pub(super) fn studio_of(plan: &Plan, snapshot: &Snapshot<'_>) -> Option<Studio> {
    match plan.light.adds_to_scene() {
        true => plan.light.studio(inventor_bounds(snapshot, plan)),
        false => None,
    }
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

impl Session {
    /// Meters the exposure of a studio: the brightest tenth of what is seen of the scene gets
    /// [`BRIGHT`]. It is a function of the plan and the scene.
    pub(super) fn meter_studio(&mut self) {
        if !self.plan.light.studio || self.plan.shading != Shading::Path {
            return;
        }
        let shader = self.shader();
        let (mut work, mut levels) = (Work::default(), Vec::new());
        for ray in rays_over(&self.camera, GRID, &[[0.5; 2]]) {
            let Some(hit) = self.scene.hit(&ray) else {
                continue;
            };
            if self.scene.surface(&hit).class == "Studio" {
                continue;
            }
            let mut sum = 0.0;
            for path in 0..PATHS {
                // Paths with other random numbers along nearly the same ray.
                let scale = 1.0 + f32::from(path) * 1e-3;
                let ray = Ray::new(ray.origin, scale * ray.direction);
                sum += f64::from(shader.radiance(&ray, &mut work).max_element());
            }
            levels.push(sum / f64::from(PATHS));
        }
        levels.sort_by(f64::total_cmp);
        let bright = levels.get(levels.len() * 9 / 10).copied().unwrap_or(0.0);
        if bright > 1e-6 {
            self.metered = (BRIGHT / bright).clamp(0.1, 100.0);
        }
    }
}
