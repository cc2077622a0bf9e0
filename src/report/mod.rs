//! What a render cost, how wrong its picture is, and what the scene did not need.
//!
//! The JSON form is an interface that other programs read: `docs/guide/machine.md`.

mod chart;

use std::fmt::Write as _;

use indexmap::IndexMap;
use serde::Serialize;

use crate::film::{ErrorEstimate, Film};
use crate::render::{Counts, Exposure};

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
pub fn count(n: u64) -> String {
    match n {
        0..1_000 => n.to_string(),
        1_000..1_000_000 => format!("{:.1}k", n as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.2}M", n as f64 / 1e6),
        _ => format!("{:.2}G", n as f64 / 1e9),
    }
}

/// How far an exposure is from a reference. Errors are over all channels of all pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Deviation {
    pub mse: f64,
    /// MSE over the squared mean of the reference.
    pub rel_mse: f64,
    /// Mean difference over the mean of the reference, with its standard error from the scatter of
    /// the pixels' differences.
    pub bias: f64,
    pub bias_error: f64,
    /// MSE of the worst 1% of pixels, over the squared mean of the reference.
    pub worst: f64,
}

impl Deviation {
    /// Holds a film against another of the same size; values are channel by channel.
    pub fn of(film: &Film, reference: &[[f64; 3]]) -> Self {
        let pixels = film.pixels.iter().zip(reference);
        let difference = |(p, r): (&crate::film::Exposed, &[f64; 3])| {
            (p.mean - glam::DVec3::from_array(*r)).to_array()
        };
        let differences: Vec<[f64; 3]> = pixels.map(difference).collect();
        let n = 3.0 * reference.len() as f64;
        let mean = reference.iter().flatten().sum::<f64>() / n;
        let square = |d: &[f64; 3]| d.iter().map(|x| x * x).sum::<f64>();
        let mse = differences.iter().map(square).sum::<f64>() / n;
        let offset = differences.iter().flatten().sum::<f64>() / n;
        // Channels of a pixel share their rays: pixels are the independent ones.
        let by_pixel = differences
            .iter()
            .map(|d| d.iter().sum::<f64>() / 3.0 - offset);
        let scatter = by_pixel.map(|x| x * x).sum::<f64>() / (n / 3.0 - 1.0).max(1.0);
        let mut squares: Vec<f64> = differences.iter().map(|d| square(d) / 3.0).collect();
        squares.sort_by(|a, b| b.total_cmp(a));
        let tail = squares.len().div_ceil(100);
        let worst = squares[..tail].iter().sum::<f64>() / tail as f64;
        Self {
            mse,
            rel_mse: mse / (mean * mean),
            bias: offset / mean,
            bias_error: (scatter / (n / 3.0)).sqrt() / mean,
            worst: worst / (mean * mean),
        }
    }
}

/// One render of a convergence table.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub method: String,
    pub samples: u32,
    /// Of rendering alone.
    pub seconds: f64,
    pub rays: u64,
    #[serde(flatten)]
    pub deviation: Deviation,
    /// 1/(relMSE · s).
    pub efficiency: f64,
    /// The relative RMSE that the render itself estimated.
    pub estimated: Option<f64>,
}

impl Row {
    pub fn new(method: &str, exposure: &Exposure, reference: &[[f64; 3]]) -> Self {
        let deviation = Deviation::of(&exposure.film, reference);
        Self {
            method: method.to_owned(),
            samples: exposure.samples,
            seconds: exposure.seconds,
            rays: exposure.counts.film_rays,
            efficiency: 1.0 / (deviation.rel_mse * exposure.seconds),
            estimated: exposure.film.relative_rmse(),
            deviation,
        }
    }
}

/// Error against samples and time, for several methods.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Convergence {
    pub scene: String,
    pub reference: String,
    pub rows: Vec<Row>,
    /// Slope of log relRMSE over log samples, method by method: −1/2 for independent samples.
    pub slopes: IndexMap<String, f64>,
}

impl Convergence {
    pub fn push(&mut self, row: Row) {
        let method = row.method.clone();
        self.rows.push(row);
        let points: Vec<(f64, f64)> = self
            .rows
            .iter()
            .filter(|r| r.method == method && r.deviation.rel_mse > 0.0)
            .map(|r| (f64::from(r.samples).ln(), 0.5 * r.deviation.rel_mse.ln()))
            .collect();
        if let Some(slope) = slope(&points) {
            self.slopes.insert(method, slope);
        }
    }

    pub fn text(&self) -> String {
        let mut out = format!("{}, against {}\n", self.scene, self.reference);
        let head = [
            "method",
            "spp",
            "seconds",
            "rays",
            "relMSE",
            "relRMSE",
            "estimated",
            "bias",
        ];
        let _ = writeln!(
            out,
            "{:<16} {:>6} {:>9} {:>8} {:>9} {:>9} {:>9} {:>20} {:>9} {:>10}",
            head[0],
            head[1],
            head[2],
            head[3],
            head[4],
            head[5],
            head[6],
            head[7],
            "worst 1%",
            "efficiency"
        );
        for r in &self.rows {
            let d = r.deviation;
            let estimated = r.estimated.map_or("-".into(), |e| format!("{e:.2e}"));
            let bias = format!("{:+.1e} ± {:.1e}", d.bias, d.bias_error);
            let _ = writeln!(
                out,
                "{:<16} {:>6} {:>9.3} {:>8} {:>9.2e} {:>9.2e} {estimated:>9} {bias:>20} {:>9.2e} {:>10.3e}",
                r.method,
                r.samples,
                r.seconds,
                count(r.rays),
                d.rel_mse,
                d.rel_mse.sqrt(),
                d.worst,
                r.efficiency
            );
        }
        for (method, slope) in &self.slopes {
            let _ = writeln!(out, "{method}: relRMSE falls as samples^{slope:.2}");
        }
        out
    }

    pub fn csv(&self) -> String {
        let mut out = String::from(
            "method,samples,seconds,rays,mse,rel_mse,bias,bias_error,worst,efficiency,estimated\n",
        );
        for r in &self.rows {
            let d = r.deviation;
            let estimated = r.estimated.map_or(String::new(), |e| e.to_string());
            let _ = writeln!(
                out,
                "{},{},{},{},{},{},{},{},{},{},{estimated}",
                r.method,
                r.samples,
                r.seconds,
                r.rays,
                d.mse,
                d.rel_mse,
                d.bias,
                d.bias_error,
                d.worst,
                r.efficiency
            );
        }
        out
    }

    /// relRMSE over seconds, both logarithmic, one line a method.
    pub fn svg(&self) -> String {
        chart::chart(self)
    }
}

/// Least squares through (x, y).
fn slope(points: &[(f64, f64)]) -> Option<f64> {
    if points.len() < 2 {
        return None;
    }
    let n = points.len() as f64;
    let (mx, my) = points
        .iter()
        .fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    let over: f64 = points.iter().map(|(x, y)| (x - mx) * (y - my)).sum();
    let under: f64 = points.iter().map(|(x, _)| (x - mx) * (x - mx)).sum();
    (under > 0.0).then(|| over / under)
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

    #[test]
    fn the_slope_of_a_power_law_is_its_exponent() {
        let points: Vec<(f64, f64)> = (0..5)
            .map(|i| (f64::from(i), 3.0 - 0.5 * f64::from(i)))
            .collect();
        assert!((slope(&points).unwrap() + 0.5).abs() < 1e-12);
        assert_eq!(slope(&points[..1]), None);
    }

    #[test]
    fn a_constant_offset_is_bias_and_nothing_else() {
        let mut film = Film::new(crate::film::Resolution {
            width: 20,
            height: 10,
        });
        film.pixels
            .iter_mut()
            .for_each(|p| p.add(glam::DVec3::splat(1.1)));
        let deviation = Deviation::of(&film, &[[1.0; 3]; 200]);
        assert!((deviation.bias - 0.1).abs() < 1e-12 && deviation.bias_error < 1e-12);
        assert!((deviation.rel_mse - 0.01).abs() < 1e-12);
    }
}
