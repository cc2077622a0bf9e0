//! The preview of a focus pull, and the command that makes its movie.

use std::path::Path;

use super::model::WindowModel;
use super::pull::RATE;
use crate::photo::Era;
use crate::photo::options::command_line;

impl WindowModel {
    /// Sets the focus of the first (0) or last (1) frame of the focus pull to the present one.
    pub(crate) fn set_pull_key(&mut self, end: usize) {
        self.pull.keys[end] = Some(self.setup.focus());
    }

    /// Starts the preview of the focus pull, or ends it.
    pub(crate) fn preview_pull(&mut self) {
        self.pull.preview = match (self.pull.preview, self.pull.timeline()) {
            (None, Some(_)) => Some((self.now, self.setup.focus())),
            (None, None) => {
                self.status = "set the focus of both ends, A and B, before the preview".into();
                None
            }
            (Some(_), _) => None,
        };
    }

    /// Focuses where the preview of the focus pull is, and returns whether it continues. It ends
    /// when the focus is changed by other means.
    pub(crate) fn continue_pull(&mut self) -> bool {
        let Some((start, focus)) = self.pull.preview.take() else {
            return false;
        };
        let Some(timeline) = self.pull.timeline() else {
            return false;
        };
        let is_first = self.now == start;
        if !is_first && self.setup.focus() != focus {
            return false;
        }
        let last = f64::from(timeline.frames - 1);
        let frame = ((self.now - start) * RATE).min(last);
        if let Some(there) = timeline.at(frame, &|_| None).focus {
            self.edit("focus pull", |s| s.set_focus(there));
        }
        if frame < last {
            self.pull.preview = Some((start, self.setup.focus()));
        }
        frame < last
    }

    /// Returns the command that makes the movie of the focus pull, if both ends are set.
    pub(crate) fn pull_command(&self) -> Option<String> {
        let [Some(from), Some(to)] = self.pull.keys else {
            return None;
        };
        let mut setup = self.to_save();
        (setup.plan.era, setup.plan.focus) = (Era::Modern, None);
        let movie = Path::new(&self.output).with_extension("mov");
        let mut words = setup.words(&movie);
        let meters = |distance: f64| match distance.is_finite() {
            true => format!("{distance}m"),
            false => "inf".into(),
        };
        let pull = [
            "pull-focus",
            "--from",
            &meters(from),
            "--to",
            &meters(to),
            "--length",
        ];
        let pull = pull.map(str::to_owned).into_iter();
        words.splice(1..2, pull.chain([self.pull.frames().to_string()]));
        Some(command_line(&words))
    }
}
