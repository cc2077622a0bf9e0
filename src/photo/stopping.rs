//! Ends a render when the scene's account says so.

use std::time::Duration;

use ivcam_base::diag::Diagnostic;
use ivcam_base::work::{Cut, StopCause, StopSignal};
use ivcam_render::render::{Keeper, StateView, Stopped};

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

    /// Returns the warning that the time of `--time` ended within a pass.
    pub fn ended_within_pass(&self, stopped: &Stopped) -> Box<Diagnostic> {
        let all = self.plan.stop.samples;
        let text = format!("the time ended within a pass: {}", stopped.describe(all));
        Diagnostic::warning(text)
            .with_help("give `--time` a longer time, or `--size` a smaller size")
    }
}
