//! The convergence table: the error of renders against their samples and run time.

use std::fmt::Write as _;

use indexmap::IndexMap;
use serde::Serialize;

use super::account::{count, percent};
use super::deviation::Deviation;
use super::peers::Peer;
use super::slope::Slope;
use crate::render::exposure::Exposure;

/// One render of a convergence table.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// The name of the sampling method.
    pub method: String,
    /// Samples per pixel.
    pub samples: u32,
    /// Seconds of rendering, without reading and writing.
    pub seconds: f64,
    /// Seconds of processors, summed over threads; `None` if the system does not say.
    pub processor_seconds: Option<f64>,
    /// Rays that left the film.
    pub rays: u64,
    /// The deviation of the picture from the reference.
    #[serde(flatten)]
    pub deviation: Deviation,
    /// 1/(relMSE · seconds).
    pub efficiency: f64,
    /// The relative RMSE that the render estimated from its own samples; `None` if it is unknown.
    pub estimated: Option<f64>,
}

/// The exponents with which a method's relative RMSE falls: −1/2 for independent samples.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Slopes {
    /// Over samples per pixel.
    pub samples: Option<Slope>,
    /// Over seconds of the clock.
    pub seconds: Option<Slope>,
    /// Over seconds of processors.
    pub processor_seconds: Option<Slope>,
}

impl Row {
    /// Compares an exposure with a reference picture.
    pub fn new(method: &str, exposure: &Exposure, reference: &[[f64; 3]]) -> Self {
        let deviation = Deviation::of(&exposure.film, reference);
        Self {
            method: method.to_owned(),
            samples: exposure.samples,
            seconds: exposure.spent.seconds,
            processor_seconds: exposure.spent.processor_seconds,
            rays: exposure.counts.film_rays,
            efficiency: 1.0 / (deviation.rel_mse * exposure.spent.seconds),
            estimated: exposure.film.relative_rmse(),
            deviation,
        }
    }
}

/// A table of error against samples and time, for several methods.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Convergence {
    /// The name of the scene file.
    pub scene: String,
    /// A description of the reference picture.
    pub reference: String,
    /// The renders in the order in which they were added.
    pub rows: Vec<Row>,
    /// The slope of log relRMSE over log samples for each method; −1/2 for independent samples.
    pub slopes: IndexMap<String, f64>,
    /// The slopes over samples and times with their uncertainty, of methods and peers.
    pub fits: IndexMap<String, Slopes>,
    /// The curves of other programs.
    pub peers: Vec<Peer>,
}

impl Convergence {
    /// Adds a row and updates the slopes of its method.
    pub fn push(&mut self, row: Row) {
        let method = row.method.clone();
        self.rows.push(row);
        let rows = || self.rows.iter().filter(|r| r.method == method);
        let over = |x: fn(&Row) -> Option<f64>| {
            Slope::of(rows().filter_map(|r| Some((x(r)?, r.deviation.rel_mse.sqrt()))))
        };
        let slopes = Slopes {
            samples: over(|r| Some(f64::from(r.samples))),
            seconds: over(|r| Some(r.seconds)),
            processor_seconds: over(|r| r.processor_seconds),
        };
        if let Some(slope) = slopes.samples {
            self.slopes.insert(method.clone(), slope.exponent);
            self.fits.insert(method, slopes);
        }
    }

    /// Sets the curves of other programs.
    pub fn set_peers(&mut self, peers: Vec<Peer>) {
        for peer in &peers {
            let rows = || peers.iter().filter(|p| p.method == peer.method);
            let over = |x: fn(&Peer) -> Option<f64>| {
                Slope::of(rows().filter_map(|p| Some((x(p)?, p.rel_rmse))))
            };
            let slopes = Slopes {
                samples: over(|p| p.samples),
                seconds: over(|p| p.seconds),
                processor_seconds: over(|p| p.processor_seconds),
            };
            self.fits.insert(peer.method.clone(), slopes);
        }
        self.peers = peers;
    }

    /// Returns the table as text in columns.
    pub fn text(&self) -> String {
        let mut out = format!("{}, against {}\n", self.scene, self.reference);
        let _ = writeln!(
            out,
            "{:<16} {:>6} {:>9} {:>9} {:>8} {:>9} {:>9} {:>9} {:>20} {:>9} {:>10}",
            "method",
            "spp",
            "seconds",
            "processor",
            "rays",
            "relMSE",
            "relRMSE",
            "estimated",
            "bias",
            "worst 1%",
            "efficiency"
        );
        for r in &self.rows {
            let d = r.deviation;
            let estimated = r.estimated.map_or("unknown".into(), |e| percent(e, 3));
            let bias = format!("{:+.1e} ± {:.1e}", d.bias, d.bias_error);
            let _ = writeln!(
                out,
                "{:<16} {:>6} {:>9.3} {:>9} {:>8} {:>9.2e} {:>9} {estimated:>9} {bias:>20} {:>9.2e} {:>10.3e}",
                r.method,
                r.samples,
                r.seconds,
                seconds(r.processor_seconds),
                count(r.rays),
                d.rel_mse,
                percent(d.rel_mse.sqrt(), 3),
                d.worst,
                r.efficiency
            );
        }
        for p in &self.peers {
            let samples = p.samples.map_or("-".into(), |n| n.to_string());
            let _ = writeln!(
                out,
                "{:<16} {samples:>6} {:>9} {:>9} {:>8} {:>9.2e} {:>9}",
                p.method,
                seconds(p.seconds),
                seconds(p.processor_seconds),
                "-",
                p.rel_rmse * p.rel_rmse,
                percent(p.rel_rmse, 3)
            );
        }
        for (method, slopes) in &self.fits {
            let named = [
                ("samples", slopes.samples),
                ("seconds", slopes.seconds),
                ("processor seconds", slopes.processor_seconds),
            ];
            let text = |(name, slope): (&str, Option<Slope>)| {
                slope.map(|slope| format!("{name}^({})", slope.text()))
            };
            let all: Vec<String> = named.into_iter().filter_map(text).collect();
            if !all.is_empty() {
                let _ = writeln!(out, "{method}: relRMSE falls as {}", all.join(", "));
            }
        }
        out
    }

    /// Returns the table as comma-separated values with a header line.
    pub fn csv(&self) -> String {
        let mut out = String::from(
            "method,samples,seconds,rays,mse,rel_mse,bias,bias_error,worst,efficiency,estimated,\
             processor_seconds\n",
        );
        for r in &self.rows {
            let d = r.deviation;
            let optional = |v: Option<f64>| v.map_or(String::new(), |v| v.to_string());
            let [estimated, processor] = [r.estimated, r.processor_seconds].map(optional);
            let _ = writeln!(
                out,
                "{},{},{},{},{},{},{},{},{},{},{estimated},{processor}",
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
}

/// Formats seconds with three decimals.
fn seconds(seconds: Option<f64>) -> String {
    seconds.map_or("-".into(), |s| format!("{s:.3}"))
}
