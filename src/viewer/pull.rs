//! A focus pull: two focus distances, and how far its preview is.

use crate::movie::{Ease, Timeline};

/// Frames per second of the movie.
pub(super) const RATE: f64 = 24.0;

/// The focus pull of the window.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FocusPull {
    /// The focus of the first and of the last frame in meters, if they are set.
    pub keys: [Option<f64>; 2],
    /// The time that it takes.
    pub seconds: f64,
    /// The time at which the preview began, and the focus that it set last.
    pub(super) preview: Option<(f64, f64)>,
}

impl Default for FocusPull {
    fn default() -> Self {
        Self {
            keys: [None; 2],
            seconds: 4.0,
            preview: None,
        }
    }
}

impl FocusPull {
    /// Returns whether the preview runs.
    pub(crate) fn is_shown(&self) -> bool {
        self.preview.is_some()
    }

    /// Returns the number of frames of the movie.
    pub(super) fn frames(&self) -> u32 {
        (self.seconds * RATE).round().max(2.0) as u32
    }

    /// Returns the pull as the movie makes it, if both ends are set.
    pub(super) fn timeline(&self) -> Option<Timeline> {
        let [Some(from), Some(to)] = self.keys else {
            return None;
        };
        Timeline::pull_focus(from, to, self.frames(), Ease::default()).ok()
    }
}
