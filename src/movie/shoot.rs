//! Renders the frames of a movie into a folder.
//!
//! Frames are numbered pictures. A frame appears under its name only when it is complete, and a
//! frame that exists is not rendered again, so an interrupted movie continues with the missing
//! frames.

use std::path::PathBuf;

use super::timeline::{Moment, Timeline, Travel};
use crate::diag::{Diagnostic, Result, Sink};
use crate::files::write_whole;
use crate::math::Meters;
use crate::photo::{Optics, Plan, Session};
use crate::pose::CameraPose;
use crate::render::{Exposure, Stop};
use crate::sampling::Sampler;

/// The largest number of moments that a frame with an open shutter is exposed at. Chosen by trial.
const MOST_MOMENTS: u32 = 16;
/// The file that says which movie the frames of a folder belong to, so that two do not mix.
const LABEL: &str = "film.txt";

/// A movie with its plan, timeline and folder.
pub(crate) struct Shoot {
    plan: Plan,
    timeline: Timeline,
    folder: PathBuf,
    /// The command line, for the metadata of each frame.
    command: String,
    /// The number of moments that each frame is exposed at.
    moments: u32,
}

/// A report during the rendering of frames.
pub(crate) enum Event<'a> {
    /// The scene was read, with these messages.
    Opened(&'a Sink),
    /// A frame was written.
    Frame {
        /// The number of the frame, from 0.
        number: u32,
        /// The focus distance in meters, if the timeline sets it.
        focus: Option<f64>,
        /// The time of the exposure, in seconds.
        seconds: f64,
        /// The number of frames that are still to be rendered.
        missing: usize,
    },
}

impl Shoot {
    /// Prepares a movie: checks its focus and makes the folder, or accepts a folder with frames of
    /// the same movie.
    ///
    /// # Errors
    /// Fails if the plan cannot make a movie, the lens cannot focus at a distance, or the folder
    /// has frames of another movie.
    pub(crate) fn new(
        mut plan: Plan,
        timeline: Timeline,
        folder: PathBuf,
        command: String,
    ) -> Result<Self> {
        if plan.solids {
            return Err(
                Diagnostic::unsupported("a movie can't be made with `--solids`")
                    .with_help("remove `--solids`: the pictures are the same without it"),
            );
        }
        let lens = lens_travel(&plan)?;
        let travel = |distance: f64| lens.as_ref().and_then(|l| l(distance));
        if lens.is_some() {
            timeline.check_focus(&travel, &|moment| reaches(&plan, moment))?;
        }
        apply(&mut plan, &timeline.at(0.0, &travel));
        let shoot = Self {
            moments: plan.sampler.samples.clamp(1, MOST_MOMENTS),
            plan,
            timeline,
            folder,
            command,
        };
        shoot.prepare_folder()?;
        Ok(shoot)
    }

    /// Returns the files of all frames, in order.
    pub(crate) fn frame_paths(&self) -> Vec<PathBuf> {
        (0..self.timeline.frames)
            .map(|frame| self.frame_path(frame))
            .collect()
    }

    /// Returns the numbers of the frames without a file.
    pub(crate) fn missing(&self) -> Vec<u32> {
        (0..self.timeline.frames)
            .filter(|&frame| !self.frame_path(frame).exists())
            .collect()
    }

    fn frame_path(&self, frame: u32) -> PathBuf {
        self.folder.join(format!("{frame:05}.png"))
    }

    /// Renders frames in rayon's current pool, and calls `report` after each.
    ///
    /// # Errors
    /// Fails if the scene cannot be opened, the lens cannot be focused, or a frame cannot be
    /// written.
    pub(crate) fn render(&self, frames: &[u32], report: &mut dyn FnMut(Event<'_>)) -> Result<()> {
        if frames.is_empty() {
            return Ok(());
        }
        let lens = lens_travel(&self.plan)?;
        let travel = |distance: f64| lens.as_ref().and_then(|l| l(distance));
        let mut session = Session::open(self.plan.clone())?;
        report(Event::Opened(&session.sink));
        let start = session.pose.clone();
        for (done, &number) in frames.iter().enumerate() {
            let moments = self.timeline.exposures(number, self.moments, &travel);
            let exposure = self.expose(&mut session, &start, &moments)?;
            let picture = session.develop(&exposure, &self.command);
            picture.save(&self.frame_path(number), self.plan.depth)?;
            report(Event::Frame {
                number,
                focus: moments[0].focus,
                seconds: exposure.seconds,
                missing: frames.len() - done - 1,
            });
        }
        Ok(())
    }

    /// Makes the folder, or checks that the frames in it are of this movie.
    fn prepare_folder(&self) -> Result<()> {
        let io = |e: std::io::Error| Diagnostic::io(self.folder.display(), &e);
        // Only the last folder of the path is made.
        if !self.folder.is_dir() {
            std::fs::create_dir(&self.folder).map_err(io)?;
        }
        let label = self.folder.join(LABEL);
        let mut text = String::new();
        for (key, value) in self.plan.describe() {
            text += &format!("{key} {value}\n");
        }
        text += &format!(
            "scene {}\ncamera {:?}\noptics {:?}\n{:?}\n",
            self.plan.scene.display(),
            self.plan.camera,
            self.plan.optics,
            self.timeline
        );
        match std::fs::read_to_string(&label) {
            Ok(there) if there == text => Ok(()),
            Ok(_) => Err(Diagnostic::error(format!(
                "the frames in `{}` are of another movie",
                self.folder.display()
            ))
            .with_help("give another `--folder`, or remove this one")),
            Err(_) => write_whole(&label, |file| file.write_all(text.as_bytes())),
        }
    }

    /// Exposes one frame at its moments, each with an equal part of the samples.
    fn expose(
        &self,
        session: &mut Session,
        start: &CameraPose,
        moments: &[Moment],
    ) -> Result<Exposure> {
        let mut whole: Option<Exposure> = None;
        let samples = (self.plan.sampler.samples / moments.len() as u32).max(1);
        for (i, moment) in moments.iter().enumerate() {
            let mut plan = self.plan.clone();
            apply(&mut plan, moment);
            session.change(plan, posed(start, moment))?;
            // Parts need independent random numbers, otherwise their errors are correlated.
            let seed = self.plan.sampler.seed.wrapping_add(i as u64 * 0x9e37_79b9);
            let sampler = Sampler {
                samples,
                seed,
                ..self.plan.sampler
            };
            let part = session.expose_with(sampler, Stop::after(samples), &|_| ());
            match &mut whole {
                None => whole = Some(part),
                Some(sum) => sum.join(&part),
            }
        }
        whole.ok_or_else(|| Diagnostic::error("a frame without a moment can't be exposed"))
    }
}

/// Returns the function from focus distance to the travel of the focused part, or `None` without a
/// lens.
fn lens_travel(plan: &Plan) -> Result<Option<Box<Travel<'static>>>> {
    let Optics::Lens(choice) = &plan.optics else {
        return Ok(None);
    };
    let lens = choice.open(&mut Sink::new())?;
    let method = choice.method;
    Ok(Some(Box::new(move |distance| {
        let (_, focus) = lens.focused(method, Meters(distance)).ok()?;
        Some(focus.extension)
    })))
}

/// Returns whether the lens, with its zoom at a moment, can focus at the moment's distance.
fn reaches(plan: &Plan, moment: &Moment) -> bool {
    let mut then = plan.clone();
    apply(&mut then, moment);
    match (lens_travel(&then), moment.focus) {
        (Ok(Some(travel)), Some(distance)) => travel(distance).is_some(),
        // Other errors are reported when the frame is rendered.
        _ => true,
    }
}

/// Sets a moment's values in a plan.
fn apply(plan: &mut Plan, moment: &Moment) {
    if let Some(distance) = moment.focus {
        plan.focus = Some(Meters(distance));
    }
    if let Some(time) = moment.time {
        plan.time = time;
    }
    if let Optics::Lens(lens) = &mut plan.optics {
        if let Some(zoom) = moment.zoom {
            lens.zoom = zoom;
        }
        if moment.f_number.is_some() {
            lens.f_number = moment.f_number;
        }
    }
}

/// Returns a pose with a moment's position and orientation.
fn posed(pose: &CameraPose, moment: &Moment) -> CameraPose {
    CameraPose {
        position: moment.position.unwrap_or(pose.position),
        orientation: moment.orientation.unwrap_or(pose.orientation),
        ..pose.clone()
    }
}
