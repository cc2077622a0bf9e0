//! What the window photographs: a plan and where the camera stands, and the command line that
//! makes the same picture without a window.
//!
//! Numbers are kept as the command line would read them back (a camera node holds floats, a
//! distance goes through millimeters), so that what is shown, saved and printed is one thing.

use std::path::Path;

use crate::film::{FilmFormat, Resolution};
use crate::lens::FocusMethod;
use crate::math::{Meters, Mm};
use crate::photo::options::command_line;
use crate::photo::{CameraChoice, CameraNode, LensChoice, Optics, Plan};
use crate::pose::CameraPose;

/// A photograph to be made. Undo goes from one to another.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Setup {
    pub plan: Plan,
    pub pose: CameraPose,
}

impl Setup {
    /// The lens, if it has a prescription.
    pub(crate) fn lens(&self) -> Option<&LensChoice> {
        self.plan.lens()
    }

    /// Another lens, wide open and in its own size; how it focuses stays.
    pub(crate) fn choose_lens(&mut self, name: &str) {
        let method = self.lens().map(|l| l.method);
        let mut choice = LensChoice::named(name);
        if let Some(method @ (FocusMethod::Film | FocusMethod::Lens | FocusMethod::Best)) = method {
            choice.method = method;
        }
        self.plan.optics = Optics::Lens(choice);
    }

    /// The distance in focus, in meters.
    pub(crate) fn focus(&self) -> f64 {
        let own = self.pose.focal_distance;
        let own = if own > 0.0 { own } else { f64::INFINITY };
        self.plan.focus.map_or(own, |d| d.0)
    }

    pub(crate) fn set_focus(&mut self, meters: f64) {
        if meters > 0.0 {
            self.plan.focus = Some(Meters(settled(meters)));
        }
    }

    /// Puts the camera elsewhere, to the nearest place that a camera node can say.
    pub(crate) fn set_pose(&mut self, pose: &CameraPose) {
        let node = CameraNode::of(pose);
        self.pose = node.pose().clone();
        self.plan.camera = Some(CameraChoice::Node(node));
    }

    /// Another film, with pixels as many and as square as before.
    pub(crate) fn set_film(&mut self, film: FilmFormat) {
        let Resolution { width, height } = self.plan.resolution;
        let pixels = f64::from(width) * f64::from(height);
        let aspect = film.width / film.height;
        let side = |x: f64| (x.round() as u32).clamp(1, Resolution::LIMIT);
        self.plan.film = film;
        self.plan.resolution = Resolution {
            width: side((pixels * aspect).sqrt()),
            height: side((pixels / aspect).sqrt()),
        };
    }

    /// The words that make this picture without a window.
    pub(crate) fn words(&self, output: &Path) -> Vec<String> {
        self.plan.to_words(output)
    }

    /// The same as one line for a shell.
    pub(crate) fn command(&self, output: &Path) -> String {
        command_line(&self.words(output))
    }
}

/// Five digits of a distance, as `--focus` reads them: meters are made of millimeters there.
fn settled(meters: f64) -> f64 {
    if !meters.is_finite() {
        return meters;
    }
    let unit = libm::pow(10.0, 4.0 - libm::floor(libm::log10(meters)));
    let mut here = (meters * unit).round() / unit;
    for _ in 0..4 {
        here = Meters::from(Mm::from(Meters(here))).0;
    }
    here
}
