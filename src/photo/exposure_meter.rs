//! The meter of the exposure: that of a studio photograph, and that of `--exposure auto`.

use ivcam_base::diag::Diagnostic;
use ivcam_render::bvh::Ray;
use ivcam_render::shade::{Shading, Work};

use super::picture_hint::rounded;
use super::session::Session;
use super::view::rays_over;

/// The rays across and down that meter the exposure.
const GRID: (u32, u32) = (36, 24);
/// The paths of each place of the grid.
const PATHS: u16 = 16;
/// The points of the lens across and down that a place's paths pass with `--exposure auto`.
const ACROSS: u16 = 4;
/// The level that the brightest tenth of the scene gets, unless paper would be brighter than white.
const BRIGHT: f64 = 0.8;
/// The least exposure that is metered. Less counts as black.
const BLACK: f64 = 1e-6;
/// The warning of a meter that sees nothing but black.
const UNLIT: &str = "`--exposure auto` meters no light of the scene: the exposure is 1";

impl Session {
    /// Returns whether the exposure is that of a studio, which is always metered.
    fn is_studio(&self) -> bool {
        self.plan.light.studio && self.plan.shading == Shading::Path
    }

    /// Returns the factor of the exposure of a studio or of `--exposure auto`; 1 without them.
    pub(super) fn metered_factor(&self) -> f64 {
        match self.is_studio() || self.plan.meters {
            true => self.metered,
            false => 1.0,
        }
    }

    /// Meters the exposure of a studio or of `--exposure auto`: the brightest tenth of what is seen
    /// of the scene gets [`BRIGHT`], or less if the brightest tenth of the paper would exceed 1. It
    /// is a function of the plan and the scene.
    ///
    /// A studio's factor, from 0.1 to 100, is that for the radiance along the rays through the
    /// middle of the lens. That of `--exposure auto` is that for the exposure of the film, with
    /// what the lens and the shutter make of it; it has two digits, so that it can be typed.
    pub(crate) fn meter(&mut self) {
        self.metered = 1.0;
        let is_studio = self.is_studio();
        if is_studio || self.plan.meters {
            let bright = self.brightest(is_studio);
            if bright > BLACK {
                self.metered = match is_studio {
                    true => (1.0 / bright).clamp(0.1, 100.0),
                    false => rounded(1.0 / (bright * self.level_of_white())),
                };
            } else if self.plan.meters && !self.sink.has(UNLIT) {
                let help = "turn the camera to what is lit, or give `--exposure` a number";
                self.sink.add(*Diagnostic::warning(UNLIT).with_help(help));
            }
        }
        self.state_metered();
    }

    /// Returns the exposure that the brightest tenth of the scene and of the paper ask for: at its
    /// inverse neither is too bright.
    fn brightest(&self, is_studio: bool) -> f64 {
        let shader = self.shader();
        let (mut work, mut levels) = (Work::default(), [Vec::new(), Vec::new()]);
        let places = match is_studio {
            true => {
                let middles = rays_over(&self.camera, GRID, &[[0.5; 2]]);
                middles
                    .map(|ray| vec![(ray, 1.0); usize::from(PATHS)])
                    .collect()
            }
            false => self.paths_of_places(),
        };
        for rays in places {
            let Some(hit) = rays.iter().find_map(|(ray, _)| self.scene.hit(ray)) else {
                continue;
            };
            let is_paper = self.scene.surface(&hit).class == "Studio";
            let mut sum = 0.0;
            for (path, (ray, weight)) in (0u16..).zip(&rays) {
                // Paths with other random numbers along nearly the same ray.
                let scale = 1.0 + f32::from(path) * 1e-3;
                let ray = Ray::new(ray.origin, scale * ray.direction);
                sum += weight * f64::from(shader.radiance(&ray, &mut work).max_element());
            }
            levels[usize::from(is_paper)].push(sum / f64::from(PATHS));
        }
        let [scene, paper] = levels.map(|mut levels| {
            levels.sort_by(f64::total_cmp);
            levels.get(levels.len() * 9 / 10).copied().unwrap_or(0.0)
        });
        (scene / BRIGHT).max(paper)
    }

    /// Returns the rays from each place of the grid through points all over the lens, with the
    /// weight of their light in the exposure.
    fn paths_of_places(&self) -> Vec<Vec<(Ray, f64)>> {
        let middle = |i: u16, all: u16| (f64::from(i) + 0.5) / f64::from(all);
        let point = |path: u16| [path % ACROSS, path / ACROSS].map(|i| middle(i, ACROSS));
        let (columns, rows) = GRID;
        let places = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
        let rays = |(column, row): (u32, u32)| {
            let [x, y] =
                [(column, columns), (row, rows)].map(|(i, all)| middle(i as u16, all as u16));
            let at = self.camera.at(x, y);
            let through = (0..PATHS).filter_map(|path| at.ray(point(path)));
            let ray = |ray: ivcam_render::camera::CameraRay| {
                let [origin, direction] = [ray.origin, ray.direction].map(|v| v.as_vec3());
                (Ray::new(origin, direction), ray.weight)
            };
            through.map(ray).collect()
        };
        places.map(rays).collect()
    }

    /// Returns the factor that `--exposure` would have to be given for this exposure.
    pub(crate) fn stated_exposure(&self) -> f64 {
        match self.plan.meters && !self.is_studio() {
            true => self.metered,
            false => self.plan.exposure,
        }
    }

    /// Puts the metered factor into the choices of the photograph.
    pub(super) fn state_metered(&mut self) {
        if self.plan.meters {
            let stated = self.stated_exposure().to_string();
            self.described.insert("exposure".into(), stated);
        }
    }

    /// Returns a command line with the metered factor in place of `auto`.
    pub(super) fn with_metered_exposure(&self, command: &str) -> String {
        let mut command = command.to_owned();
        if self.plan.meters {
            for separator in [' ', '='] {
                let metered = format!("--exposure{separator}{}", self.stated_exposure());
                command = command.replace(&format!("--exposure{separator}auto"), &metered);
            }
        }
        command
    }
}
