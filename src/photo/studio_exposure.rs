//! The exposure of a studio photograph.

use ivcam_render::bvh::Ray;
use ivcam_render::shade::{Shading, Work};

use super::session::Session;
use super::view::rays_over;

/// The rays across and down that meter the exposure.
const GRID: (u32, u32) = (36, 24);
/// The paths of each ray.
const PATHS: u16 = 16;
/// The level that the brightest tenth of the scene gets, unless paper would be brighter than white.
const BRIGHT: f64 = 0.8;

impl Session {
    /// Meters the exposure of a studio: the brightest tenth of what is seen of the scene gets
    /// [`BRIGHT`], or less if the brightest tenth of the paper would exceed 1. It is a function of
    /// the plan and the scene.
    pub(crate) fn meter_studio(&mut self) {
        if !self.plan.light.studio || self.plan.shading != Shading::Path {
            return;
        }
        let shader = self.shader();
        let (mut work, mut levels) = (Work::default(), [Vec::new(), Vec::new()]);
        for ray in rays_over(&self.camera, GRID, &[[0.5; 2]]) {
            let Some(hit) = self.scene.hit(&ray) else {
                continue;
            };
            let is_paper = self.scene.surface(&hit).class == "Studio";
            let mut sum = 0.0;
            for path in 0..PATHS {
                // Paths with other random numbers along nearly the same ray.
                let scale = 1.0 + f32::from(path) * 1e-3;
                let ray = Ray::new(ray.origin, scale * ray.direction);
                sum += f64::from(shader.radiance(&ray, &mut work).max_element());
            }
            levels[usize::from(is_paper)].push(sum / f64::from(PATHS));
        }
        let [scene, paper] = levels.map(|mut levels| {
            levels.sort_by(f64::total_cmp);
            levels.get(levels.len() * 9 / 10).copied().unwrap_or(0.0)
        });
        let bright = (scene / BRIGHT).max(paper);
        if bright > 1e-6 {
            self.metered = (1.0 / bright).clamp(0.1, 100.0);
        }
    }
}
