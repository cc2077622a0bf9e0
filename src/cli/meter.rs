//! The progress of a render: a bar on a terminal, or JSON for programs.

use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use ivcam_render::render::report::percent;
use ivcam_render::render::{Counts, Progress};
use serde_json::json;

/// The least time between two lines of JSON.
const INTERVAL: Duration = Duration::from_millis(500);

/// The length of a progress bar.
const BAR_STEPS: u64 = 10_000;

/// How the progress of a render is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MeterKind {
    /// No output.
    Silent,
    /// A line that is visible only on a terminal.
    Bar,
    /// One JSON object per line.
    Json,
}

/// Shows the progress of a render.
pub(super) enum SceneMeter {
    /// A line that is visible only on a terminal.
    Bar(indicatif::ProgressBar),
    /// One JSON object per line.
    Json {
        start: Instant,
        /// When the last line was printed.
        last: Mutex<Option<Instant>>,
    },
}

/// Does some work whose length is not known. On a terminal a line says what it is and how long it
/// has taken.
pub(super) fn waiting<T>(kind: MeterKind, what: String, work: impl FnOnce() -> T) -> T {
    if kind != MeterKind::Bar || !std::io::stderr().is_terminal() {
        return work();
    }
    let line = indicatif::ProgressBar::new_spinner().with_message(what);
    if let Ok(style) = indicatif::ProgressStyle::with_template("{spinner} {msg}  {elapsed}") {
        line.set_style(style);
    }
    line.enable_steady_tick(Duration::from_millis(200));
    let done = work();
    line.finish_and_clear();
    done
}

impl SceneMeter {
    pub(super) fn new(kind: MeterKind) -> Self {
        if kind == MeterKind::Json {
            return Self::Json {
                start: Instant::now(),
                last: Mutex::new(None),
            };
        }
        let bar = if kind == MeterKind::Silent || !std::io::stderr().is_terminal() {
            indicatif::ProgressBar::hidden()
        } else {
            indicatif::ProgressBar::new(BAR_STEPS)
        };
        if let Ok(style) =
            indicatif::ProgressStyle::with_template("{bar:30} {percent}%  {elapsed}{msg}")
        {
            bar.set_style(style);
        }
        if !bar.is_hidden() {
            bar.enable_steady_tick(Duration::from_millis(200));
        }
        Self::Bar(bar)
    }

    pub(super) fn show(&self, progress: Progress) {
        match self {
            Self::Bar(bar) => {
                let part = progress.part().unwrap_or_default();
                bar.set_position((BAR_STEPS as f64 * part) as u64);
                bar.set_message(bar_message(&progress));
            }
            Self::Json { start, last } => {
                let mut last = last.lock().unwrap_or_else(|e| e.into_inner());
                if last.is_none_or(|last| last.elapsed() >= INTERVAL) {
                    *last = Some(Instant::now());
                    super::status!("{}", line(&progress, start.elapsed().as_secs_f64()));
                }
            }
        }
    }

    /// Ends the progress of a render with these numbers of rays and seconds.
    pub(super) fn finish(&self, counts: &Counts, seconds: f64) {
        match self {
            Self::Bar(bar) => bar.finish_and_clear(),
            Self::Json { .. } => {
                let all = counts.scene_rays + counts.shadow_rays;
                let line = json!({
                    "phase": "rendered",
                    "seconds": seconds,
                    "film_rays": counts.film_rays,
                    "rays_per_second": all as f64 / seconds.max(1e-9),
                });
                super::status!("{line}");
            }
        }
    }
}

/// Returns the line of JSON for the progress after some seconds.
fn line(progress: &Progress, seconds: f64) -> serde_json::Value {
    json!({
        "phase": "render",
        "seconds": seconds,
        "seconds_left": progress.seconds_left(),
        "part": progress.part(),
        "samples": progress.samples,
        "error": progress.error,
    })
}

/// Returns the text after a progress bar: the time left, and the error with the samples per pixel,
/// of which this run makes a number a second.
fn bar_message(progress: &Progress) -> String {
    let left = progress.seconds_left().map(Duration::try_from_secs_f64);
    let left = left.and_then(|left| left.ok()).map(|left| {
        let left = indicatif::HumanDuration(left);
        format!("  {left:#} left")
    });
    let error = progress.error.map(|error| {
        let (samples, error) = (progress.samples, percent(error, 2));
        let before = progress.work_before as f64 / progress.work_done.max(1) as f64;
        let rate = f64::from(samples) * (1.0 - before) / progress.elapsed.as_secs_f64().max(1e-3);
        format!("  {samples} spp, {rate:.1} a second  relative error {error}")
    });
    left.unwrap_or_default() + &error.unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_progress_has_the_time_left_once_there_is_progress() {
        // An earlier run has made 5, and this one 5 in a second.
        let progress = |work_done| Progress {
            work_done,
            work_before: 5,
            work: 40,
            work_is_known: true,
            elapsed: Duration::from_secs(1),
            samples: 4,
            error: Some(0.25),
        };
        let first = line(&progress(5), 1.0);
        assert!(first["seconds_left"].is_null());
        let later = line(&progress(10), 2.0);
        assert_eq!(later["part"], 0.25);
        assert_eq!(later["seconds_left"], 6.0);
        let unknown = Progress {
            work_is_known: false,
            ..progress(10)
        };
        let unknown = line(&unknown, 2.0);
        assert!(unknown["part"].is_null() && unknown["seconds_left"].is_null());
        assert_eq!(
            (&later["samples"], &later["error"]),
            (&json!(4), &json!(0.25))
        );
    }
}
