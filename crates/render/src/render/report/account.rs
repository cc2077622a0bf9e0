//! The report of one render: time, rays, error and parts of the scene left out.

use std::fmt::Write as _;

use indexmap::IndexMap;
use ivcam_optics::film::{ErrorEstimate, ErrorUnknown, Film};
use serde::Serialize;

use crate::render::exposure::Counts;

/// Seconds of each phase of a render.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct StageSeconds {
    /// Reading the scene file and the files it names.
    pub read: f64,
    /// Compiling the scene.
    pub compile: f64,
    /// Preparing the lens: focus, exposure, pupil.
    pub pupil: f64,
    /// Tracing and shading rays.
    pub render: f64,
    /// Writing the picture.
    pub write: f64,
}

impl StageSeconds {
    /// Returns the sum of all phases.
    pub fn total(&self) -> f64 {
        self.read + self.compile + self.pupil + self.render + self.write
    }
}

/// The report of one render. The JSON form has these names.
#[derive(Clone, Debug, Default, Serialize)]
pub struct RenderReport {
    /// The version of the program.
    pub ivcam: &'static str,
    /// The scene file.
    pub scene: String,
    /// The picture file.
    pub picture: String,
    /// Every option that the picture was made with, by name.
    pub plan: IndexMap<String, String>,
    /// Seconds of each phase.
    pub seconds: StageSeconds,
    /// Seconds of all phases.
    pub total_seconds: f64,
    /// Seconds of processors that rendering took, summed over threads; `null` if the system does
    /// not say.
    pub processor_seconds: Option<f64>,
    /// Samples per pixel.
    pub samples: u32,
    /// Rays that left the film for the picture.
    pub film_rays: u64,
    /// Rays traced through the scene.
    pub scene_rays: u64,
    /// Rays toward lights.
    pub shadow_rays: u64,
    /// Rays that left the film for the error estimate.
    pub error_rays: u64,
    /// The share of the film's rays that passed through the lens.
    pub passed_share: f64,
    /// Estimated root mean square error over the picture's mean; `null` if it is unknown.
    pub relative_rmse: Option<f64>,
    /// The lower end of the 95% confidence interval of `relative_rmse`.
    pub relative_rmse_low: Option<f64>,
    /// The upper end of the 95% confidence interval of `relative_rmse`.
    pub relative_rmse_high: Option<f64>,
    /// Why the error is unknown; `null` if it is known.
    pub error_unknown: Option<String>,
    /// The light of ghosts over the light of the picture.
    pub ghosts_of_picture: Option<f64>,
    /// The light of ghosts over the light of the lights' own images.
    pub ghosts_of_lights: Option<f64>,
    /// Primitives in the compiled scene, as stored.
    pub primitives: u64,
    /// Primitives of the scene, each as often as it is drawn.
    pub primitives_drawn: u64,
    /// Parts of the scene that are stored once and drawn many times, and glyphs of long texts.
    pub shared_parts: u64,
    /// The number of times that these are drawn.
    pub shared_uses: u64,
    /// The parts of the scene that were not read, built or traced, each with the reason.
    pub left_out: Vec<String>,
}

impl RenderReport {
    /// Sets the estimated error and its interval.
    pub fn set_error(&mut self, error: std::result::Result<ErrorEstimate, ErrorUnknown>) {
        self.error_unknown = error.err().map(|reason| reason.to_string());
        let error = error.ok();
        self.relative_rmse = error.map(|e| e.relative_rmse);
        self.relative_rmse_low = error.map(|e| e.low);
        self.relative_rmse_high = error.map(|e| e.high);
    }

    /// Sets the shares of ghosts, if the film has any.
    pub fn set_ghosts(&mut self, film: &Film) {
        let Some(ghosts) = &film.ghosts else { return };
        let over = |whole: f64| Some(ghosts.sum() / whole).filter(|share| share.is_finite());
        self.ghosts_of_picture = over(film.sum());
        self.ghosts_of_lights = over(ghosts.of_lights);
    }

    /// Sets the numbers of rays.
    pub fn set_counts(&mut self, counts: &Counts) {
        self.film_rays = counts.film_rays;
        self.scene_rays = counts.scene_rays;
        self.shadow_rays = counts.shadow_rays;
        self.error_rays = counts.error_rays;
        self.passed_share = counts.passed_share();
    }

    /// Returns the line that the program prints at the end of a render.
    pub fn line(&self) -> String {
        let mut line = format!("{}  {:.2} s", self.picture, self.total_seconds);
        let s = &self.seconds;
        let _ = write!(
            line,
            " (read {:.2}, compile {:.2}, pupil {:.2}, render {:.2}, write {:.2})",
            s.read, s.compile, s.pupil, s.render, s.write
        );
        if let Some(processor) = self.processor_seconds {
            let _ = write!(line, "  processor {processor:.2} s");
        }
        let _ = write!(
            line,
            "  {} spp  {} rays, {} in the scene, {} to lights",
            self.samples,
            count(self.film_rays),
            count(self.scene_rays),
            count(self.shadow_rays)
        );
        if self.film_rays > 0 {
            let _ = write!(line, "  {:.1}% through the lens", 100.0 * self.passed_share);
        }
        let bounds = self.relative_rmse_low.zip(self.relative_rmse_high);
        match self.relative_rmse.zip(bounds) {
            Some((relative_rmse, (low, high))) => {
                let error = ErrorEstimate {
                    relative_rmse,
                    low,
                    high,
                };
                let _ = write!(line, "  relative error {}", error_text(&error));
            }
            None => {
                let reason = self.error_unknown.as_deref().unwrap_or("not measured");
                let _ = write!(line, "  error unknown: {reason}");
            }
        }
        let share = |share: f64, whole: &str| format!("{:.3}% of {whole} light", 100.0 * share);
        let ghosts: Vec<String> = [
            self.ghosts_of_picture
                .map(|part| share(part, "the picture's")),
            self.ghosts_of_lights.map(|part| share(part, "the lights'")),
        ]
        .into_iter()
        .flatten()
        .collect();
        if !ghosts.is_empty() {
            let _ = write!(line, "  ghosts {}", ghosts.join(", "));
        }
        if self.shared_uses > 0 {
            let _ = write!(
                line,
                "  {} primitives stored as {}: {} parts drawn {} times",
                count(self.primitives_drawn),
                count(self.primitives),
                count(self.shared_parts),
                count(self.shared_uses)
            );
        }
        if !self.left_out.is_empty() {
            let _ = write!(line, "  left out: {}", self.left_out.join(", "));
        }
        line
    }
}

/// Formats a count with three digits or so and a suffix: 1234567 becomes `1.23M`.
pub fn count(n: u64) -> String {
    match n {
        0..1_000 => n.to_string(),
        1_000..1_000_000 => format!("{:.1}k", n as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.2}M", n as f64 / 1e6),
        _ => format!("{:.2}G", n as f64 / 1e9),
    }
}

/// Formats an error and its interval: `2.30% (2.1% to 2.5%)`.
pub fn error_text(error: &ErrorEstimate) -> String {
    if *error == ErrorEstimate::EXACT {
        return "0 (the picture is exact: there is nothing to see)".to_owned();
    }
    let [low, high] = [error.low, error.high].map(|e| percent(e, 2));
    format!("{} ({low} to {high})", percent(error.relative_rmse, 3))
}

/// Formats an error, or why it is unknown, for the metadata of a picture.
pub fn stated_error(error: std::result::Result<ErrorEstimate, ErrorUnknown>) -> String {
    match error {
        Ok(error) => error_text(&error),
        Err(reason) => format!("unknown: {reason}"),
    }
}

/// Formats a share as a percentage with at least `digits` significant digits: 0.0230 becomes
/// `2.30%`.
pub fn percent(share: f64, digits: i32) -> String {
    let percent = 100.0 * share;
    if percent == 0.0 || !percent.is_finite() {
        return format!("{percent}%");
    }
    let before_point = libm::log10(percent.abs()).floor() as i32 + 1;
    let decimals = (digits - before_point).clamp(0, 12) as usize;
    format!("{percent:.decimals$}%")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ghosts_over_a_black_picture_are_named_in_the_line() {
        let line = |of_picture: Option<f64>, of_lights: Option<f64>| {
            let report = RenderReport {
                ghosts_of_picture: of_picture,
                ghosts_of_lights: of_lights,
                ..RenderReport::default()
            };
            report.line()
        };
        let black = line(None, Some(5e-4));
        assert!(
            black.ends_with("  ghosts 0.050% of the lights' light"),
            "{black}"
        );
        let lit = line(Some(0.02), Some(5e-4));
        let both = "  ghosts 2.000% of the picture's light, 0.050% of the lights' light";
        assert!(lit.ends_with(both), "{lit}");
    }

    #[test]
    fn a_share_is_a_percentage_with_its_significant_digits() {
        let text = [1.08, 0.0230, 0.00456, 12.5, 0.0].map(|share| percent(share, 3));
        assert_eq!(text, ["108%", "2.30%", "0.456%", "1250%", "0%"]);
        assert_eq!(percent(f64::INFINITY, 3), "inf%");
    }

    #[test]
    fn numbers_of_rays_are_short() {
        assert_eq!(
            [count(7), count(1_382_400), count(2_500_000_000)],
            ["7", "1.38M", "2.50G"]
        );
    }
}
