//! The account of one render.

use std::fmt::Write as _;

use indexmap::IndexMap;
use serde::Serialize;

use crate::film::{ErrorEstimate, Film};
use crate::render::exposure::Counts;

/// Seconds of each phase of a render.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Seconds {
    pub read: f64,
    pub compile: f64,
    /// Preparing the lens: focus, exposure, pupil.
    pub pupil: f64,
    pub render: f64,
    pub write: f64,
}

impl Seconds {
    pub fn total(&self) -> f64 {
        self.read + self.compile + self.pupil + self.render + self.write
    }
}

/// The account of one render.
#[derive(Clone, Debug, Serialize)]
pub struct RenderReport {
    pub ivcam: &'static str,
    pub scene: String,
    pub picture: String,
    /// Every choice that went into the picture.
    pub plan: IndexMap<String, String>,
    pub seconds: Seconds,
    pub total_seconds: f64,
    pub samples: u32,
    pub film_rays: u64,
    pub scene_rays: u64,
    pub shadow_rays: u64,
    pub error_rays: u64,
    pub passed_share: f64,
    /// Estimated root mean square error over the picture's mean; `null` for a black picture.
    pub relative_rmse: Option<f64>,
    /// Where the true one lies 95 times in 100.
    pub relative_rmse_low: Option<f64>,
    pub relative_rmse_high: Option<f64>,
    /// The light of ghosts over that of the picture, and over that of the lights' own images.
    pub ghosts_of_picture: Option<f64>,
    pub ghosts_of_lights: Option<f64>,
    pub primitives: u64,
    /// What was not read, built or traced, and why.
    pub left_out: Vec<String>,
}

impl RenderReport {
    pub fn set_error(&mut self, error: Option<ErrorEstimate>) {
        self.relative_rmse = error.map(|e| e.relative_rmse);
        self.relative_rmse_low = error.map(|e| e.low);
        self.relative_rmse_high = error.map(|e| e.high);
    }

    pub fn set_glare(&mut self, film: &Film) {
        let Some(glare) = &film.glare else { return };
        let picture = 3.0 * film.mean() * film.pixels.len() as f64;
        let over = |whole: f64| Some(glare.sum() / whole).filter(|share| share.is_finite());
        self.ghosts_of_picture = over(picture);
        self.ghosts_of_lights = over(glare.of_lights);
    }

    pub fn set_counts(&mut self, counts: &Counts) {
        self.film_rays = counts.film_rays;
        self.scene_rays = counts.scene_rays;
        self.shadow_rays = counts.shadow_rays;
        self.error_rays = counts.error_rays;
        self.passed_share = counts.passed_share();
    }

    /// The line at the end of a render.
    pub fn line(&self) -> String {
        let mut line = format!("{}  {:.2} s", self.picture, self.total_seconds);
        let s = &self.seconds;
        let _ = write!(
            line,
            " (read {:.2}, compile {:.2}, pupil {:.2}, render {:.2}, write {:.2})",
            s.read, s.compile, s.pupil, s.render, s.write
        );
        let _ = write!(
            line,
            "  {} spp  {} rays, {} in the scene, {} to lights",
            self.samples,
            count(self.film_rays),
            count(self.scene_rays),
            count(self.shadow_rays)
        );
        let _ = write!(line, "  {:.1}% through the lens", 100.0 * self.passed_share);
        let bounds = self.relative_rmse_low.zip(self.relative_rmse_high);
        match self.relative_rmse.zip(bounds) {
            Some((e, (low, high))) => {
                let _ = write!(line, "  relRMSE {e:.2e} ({low:.1e} to {high:.1e})");
            }
            None => line.push_str("  relRMSE unknown (black)"),
        }
        if let Some(share) = self.ghosts_of_picture {
            let _ = write!(
                line,
                "  ghosts {:.3}% of the picture's light",
                100.0 * share
            );
        }
        if let Some(share) = self.ghosts_of_lights {
            let _ = write!(line, ", {:.3}% of the lights'", 100.0 * share);
        }
        if !self.left_out.is_empty() {
            let _ = write!(line, "  left out: {}", self.left_out.join(", "));
        }
        line
    }
}

/// 1234567 as `1.23M`.
pub(crate) fn count(n: u64) -> String {
    match n {
        0..1_000 => n.to_string(),
        1_000..1_000_000 => format!("{:.1}k", n as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.2}M", n as f64 / 1e6),
        _ => format!("{:.2}G", n as f64 / 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_rays_are_short() {
        assert_eq!(
            [count(7), count(1_382_400), count(2_500_000_000)],
            ["7", "1.38M", "2.50G"]
        );
    }
}
