//! The convergence table: the error of renders against their samples and run time.

use std::fmt::Write as _;

use indexmap::IndexMap;
use serde::Serialize;

use super::account::{count, percent};
use super::chart::chart;
use super::deviation::Deviation;
use crate::render::exposure::Exposure;

/// One render of a convergence table.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Row {
    /// The name of the sampling method.
    pub method: String,
    /// Samples per pixel.
    pub samples: u32,
    /// Seconds of rendering, without reading and writing.
    pub seconds: f64,
    /// Rays that left the film.
    pub rays: u64,
    #[serde(flatten)]
    pub deviation: Deviation,
    /// 1/(relMSE · seconds).
    pub efficiency: f64,
    /// The relative RMSE that the render estimated from its own samples.
    pub estimated: Option<f64>,
}

impl Row {
    /// Compares an exposure with a reference picture.
    pub(crate) fn new(method: &str, exposure: &Exposure, reference: &[[f64; 3]]) -> Self {
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

/// A table of error against samples and time, for several methods.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct Convergence {
    /// The name of the scene file.
    pub scene: String,
    /// A description of the reference picture.
    pub reference: String,
    pub rows: Vec<Row>,
    /// The slope of log relRMSE over log samples for each method; −1/2 for independent samples.
    pub slopes: IndexMap<String, f64>,
}

impl Convergence {
    /// Adds a row and updates the slope of its method.
    pub(crate) fn push(&mut self, row: Row) {
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

    /// Returns the table as text in columns.
    pub(crate) fn text(&self) -> String {
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
            let estimated = r.estimated.map_or("-".into(), |e| percent(e, 3));
            let bias = format!("{:+.1e} ± {:.1e}", d.bias, d.bias_error);
            let _ = writeln!(
                out,
                "{:<16} {:>6} {:>9.3} {:>8} {:>9.2e} {:>9} {estimated:>9} {bias:>20} {:>9.2e} {:>10.3e}",
                r.method,
                r.samples,
                r.seconds,
                count(r.rays),
                d.rel_mse,
                percent(d.rel_mse.sqrt(), 3),
                d.worst,
                r.efficiency
            );
        }
        for (method, slope) in &self.slopes {
            let _ = writeln!(out, "{method}: relRMSE falls as samples^{slope:.2}");
        }
        out
    }

    /// Returns the table as comma-separated values with a header line.
    pub(crate) fn csv(&self) -> String {
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

    /// Returns a chart of relRMSE over seconds as SVG, both axes logarithmic, one line per method.
    pub(crate) fn svg(&self) -> String {
        chart(self)
    }
}

/// Returns the slope of the least-squares line through points (x, y).
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
    fn the_slope_of_a_power_law_is_its_exponent() {
        let points: Vec<(f64, f64)> = (0..5)
            .map(|i| (f64::from(i), 3.0 - 0.5 * f64::from(i)))
            .collect();
        assert!((slope(&points).unwrap() + 0.5).abs() < 1e-12);
        assert_eq!(slope(&points[..1]), None);
    }
}
