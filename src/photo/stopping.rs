//! Ends a render when the scene's account says so.

use std::time::Duration;

use ivcam_base::diag::Diagnostic;
use ivcam_base::work::{Cut, StopCause, StopSignal};
use ivcam_render::render::{Exposure, Keeper, StateView, Stopped};

use super::session::Session;

/// The time after the end of `--time` at which work is abandoned that did not end by itself. A
/// render ends between two passes, whose length it expects from those before.
pub(super) const GRACE: Duration = Duration::from_millis(500);

/// Stops a render after a signal.
pub(super) struct StopKeeper(pub StopSignal);

impl Keeper for StopKeeper {
    fn is_stopped(&self) -> bool {
        self.0.is_set()
    }

    fn is_due(&self) -> bool {
        false
    }

    fn keep(&self, _: &StateView<'_, '_>) {}
}

impl Session {
    /// Returns the error that no part of the picture was finished in the time of `--time`.
    pub fn too_late(&self) -> Box<Diagnostic> {
        self.budget.refusal(Cut::Stopped(StopCause::Time))
    }

    /// Returns the warning that the time of `--time` ended within a pass of an exposure.
    pub fn ended_within_pass(&self, exposure: &Exposure, stopped: &Stopped) -> Box<Diagnostic> {
        if stopped.samples == 0 && stopped.part < 1.0 {
            let opening = self.opening.unwrap_or_default().as_secs_f64();
            return black_part(stopped.part, opening, exposure.spent.seconds);
        }
        let all = self.plan.stop.samples;
        let text = format!("the time ended within a pass: {}", stopped.describe(all));
        Diagnostic::warning(text)
            .with_help("give `--time` a longer time, or `--size` a smaller size")
    }
}

/// Returns the warning that the first pass was ended after a part of the picture, which took some
/// seconds besides those for opening.
fn black_part(part: f64, opening: f64, seconds: f64) -> Box<Diagnostic> {
    let black = (100.0 - 100.0 * part).ceil().clamp(1.0, 99.0);
    // A tenth more, because parts of a picture take different times.
    let needed = 1.1 * (opening + seconds / part);
    let needed = match needed < 10.0 {
        true => (10.0 * needed).ceil() / 10.0,
        false => needed.ceil(),
    };
    Diagnostic::warning(format!(
        "{black}% of the picture is black, because the time ended within the first pass, which \
         needs about {needed} s"
    ))
    .with_help(format!(
        "give `--time {needed}s`, or `--size` a smaller size"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_first_pass_that_is_cut_says_what_is_black_and_the_time_that_it_needs() {
        let warning = black_part(0.72, 1.0, 36.0);
        assert!(
            warning
                .message
                .starts_with("28% of the picture is black, because ")
        );
        assert!(
            warning.message.ends_with("needs about 57 s"),
            "{}",
            warning.message
        );
        assert!(
            warning
                .help
                .iter()
                .any(|help| help.contains("`--time 57s`"))
        );
        let warning = black_part(0.9999, 0.0, 2.0);
        assert!(warning.message.starts_with("1% of the picture"));
        assert!(warning.message.ends_with("needs about 2.3 s"));
    }
}
