//! The photograph of the window: a plan and a camera pose, and the command line that makes the same
//! picture without a window.
//!
//! Numbers are kept as the command line would read them back (a camera node holds floats, a
//! distance goes through millimeters), so that the picture shown, saved and printed is the same.

use std::path::Path;

use ivcam_base::math::{Meters, Mm};
use ivcam_inventor::pose::CameraPose;
use ivcam_optics::film::{FilmFormat, Resolution};
use ivcam_optics::lens::FocusMethod;
use ivcam_render::shade::Shading;

use crate::photo::options::command_line;
use crate::photo::{CameraChoice, CameraNode, LensChoice, Optics, Plan};

/// A photograph to be made: the state that undo restores.
#[derive(Clone, Debug, PartialEq)]
pub struct Setup {
    /// All choices of the photograph.
    pub plan: Plan,
    /// The pose of the camera.
    pub pose: CameraPose,
    /// Whether the saved picture has the size of the one in the window, instead of the plan's.
    pub as_shown: bool,
}

impl Setup {
    /// Returns the lens, if it has a prescription.
    pub(crate) fn lens(&self) -> Option<&LensChoice> {
        self.plan.lens()
    }

    /// Selects another lens, wide open. The focal length is kept if one was chosen, and so is the
    /// method of focusing.
    pub fn choose_lens(&mut self, name: &str) {
        let (method, efl) = (
            self.lens().map(|l| l.method),
            self.lens().and_then(|l| l.efl),
        );
        let mut choice = LensChoice::of_era(self.plan.era, name);
        choice.efl = efl;
        if let Some(method @ (FocusMethod::Film | FocusMethod::Lens | FocusMethod::Best)) = method {
            choice.method = method;
        }
        self.plan.optics = Optics::Lens(choice);
    }

    /// Selects a shading model. A response that is the usual one stays so.
    pub(crate) fn set_shading(&mut self, shading: Shading) {
        let plan = &mut self.plan;
        let is_usual = *plan.response.unbalanced() == plan.usual_response();
        plan.shading = shading;
        if is_usual {
            plan.response = plan.usual_response().balanced(plan.response.balance());
        }
    }

    /// Returns the focus distance in meters.
    pub fn focus(&self) -> f64 {
        let own = self.pose.focal_distance;
        let own = if own > 0.0 { own } else { f64::INFINITY };
        self.plan.focus.map_or(own, |d| d.0)
    }

    /// Sets the focus distance in meters.
    pub fn set_focus(&mut self, meters: f64) {
        if meters > 0.0 {
            self.plan.focus = Some(Meters(rounded(meters)));
        }
    }

    /// Lets the places of touches and drags stay those of the present camera when it moves.
    pub(crate) fn keep_places(&mut self) {
        let seen_from = CameraNode::from_pose(&self.fitted_pose());
        let touched = self.plan.actions.iter_mut();
        for action in touched.filter(|action| action.has_place() && action.viewer.is_none()) {
            action.viewer = Some(seen_from.pose().clone());
        }
    }

    /// Returns the pose as that of a camera of Inventor that shows the same in this picture.
    pub(crate) fn fitted_pose(&self) -> CameraPose {
        self.pose.clone().fitted(self.plan.resolution.aspect())
    }

    /// Moves the camera to the nearest pose that a camera node can represent.
    pub fn set_pose(&mut self, pose: &CameraPose) {
        self.keep_places();
        let node = CameraNode::from_pose(pose);
        self.pose = node.pose().clone();
        self.plan.view = None;
        self.plan.camera = Some(CameraChoice::Node(node));
    }

    /// States the pose as the camera of the plan, if it has none.
    pub(crate) fn keep_pose(&mut self) {
        if self.plan.camera.is_none() {
            let pose = self.pose.clone();
            self.set_pose(&pose);
        }
    }

    /// Selects another film format, with the same number of pixels, of the same shape.
    pub(crate) fn set_film(&mut self, film: FilmFormat) {
        let Resolution { width, height } = self.plan.resolution;
        let pixels = f64::from(width) * f64::from(height);
        let aspect = film.width / film.height;
        let side = |x: f64| (x.round() as u32).clamp(1, Resolution::LIMIT);
        self.plan.film = film;
        self.plan.resolution = Resolution::of(
            side((pixels * aspect).sqrt()),
            side((pixels / aspect).sqrt()),
        );
    }

    /// Sets the width of the picture in pixels, and the height that the film gives it.
    pub(crate) fn set_width(&mut self, width: u32) {
        let film = self.plan.film;
        let height = f64::from(width) * film.height / film.width;
        let height = (height.round() as u32).max(1);
        self.plan.resolution = Resolution { width, height };
    }

    /// Returns the command-line arguments that make this picture without a window.
    pub(crate) fn words(&self, output: &Path) -> Vec<String> {
        self.plan.to_args(output)
    }

    /// Returns the command line for a shell.
    pub(crate) fn command(&self, output: &Path) -> String {
        command_line(&self.words(output))
    }
}

/// Rounds a distance to five digits, as `--focus` reads them, through millimeters.
fn rounded(meters: f64) -> f64 {
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
