//! Renders the frames of a movie into a folder.
//!
//! Frames are numbered pictures. A picture appears under its name only when it is whole, so a
//! frame that is there is not rendered again: an interrupted movie goes on where it stopped.

use std::path::PathBuf;

use super::timeline::{Moment, Timeline, Travel};
use crate::diag::{Diagnostic, Result, Sink};
use crate::math::Meters;
use crate::photo::{Optics, Plan, Session};
use crate::picture::write_whole;
use crate::pose::CameraPose;
use crate::render::{Exposure, Stop};
use crate::sampling::Sampler;

/// Moments at most over which one frame with an open shutter is exposed.
const MOST_MOMENTS: u32 = 16;
/// The file that says which movie the frames of a folder belong to, so that two do not mix.
const LABEL: &str = "film.txt";

/// A movie to be rendered.
pub(crate) struct Shoot {
    plan: Plan,
    timeline: Timeline,
    folder: PathBuf,
    /// The command line, for the metadata of each frame.
    command: String,
    /// Moments over which each frame is exposed.
    moments: u32,
}

/// What happens while frames are rendered.
pub(crate) enum Event<'a> {
    /// The scene is read; these are the messages about it.
    Opened(&'a Sink),
    /// A frame is written, so many are still missing.
    Frame {
        number: u32,
        /// The distance in focus in meters, where the timeline sets it.
        focus: Option<f64>,
        seconds: f64,
        missing: usize,
    },
}

impl Shoot {
    /// A movie with its folder made, or found with frames of this movie in it.
    ///
    /// # Errors
    /// A plan that no movie can be made of, a distance at which the lens cannot focus, a folder
    /// with the frames of another movie.
    pub(crate) fn new(
        mut plan: Plan,
        timeline: Timeline,
        folder: PathBuf,
        command: String,
    ) -> Result<Self> {
        if plan.solids {
            return Err(Diagnostic::error("a film can't be made with `--solids`")
                .with_help("leave it out: the pictures are the same without"));
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

    /// The files of all frames, in order.
    pub(crate) fn frame_paths(&self) -> Vec<PathBuf> {
        (0..self.timeline.frames)
            .map(|frame| self.frame_path(frame))
            .collect()
    }

    /// The frames that are not there.
    pub(crate) fn missing(&self) -> Vec<u32> {
        (0..self.timeline.frames)
            .filter(|&frame| !self.frame_path(frame).exists())
            .collect()
    }

    fn frame_path(&self, frame: u32) -> PathBuf {
        self.folder.join(format!("{frame:05}.png"))
    }

    /// Renders frames, on rayon's current threads.
    ///
    /// # Errors
    /// What opening the scene, moving the lens or writing a frame brings.
    pub(crate) fn render(&self, frames: &[u32], happened: &mut dyn FnMut(Event<'_>)) -> Result<()> {
        if frames.is_empty() {
            return Ok(());
        }
        let lens = lens_travel(&self.plan)?;
        let travel = |distance: f64| lens.as_ref().and_then(|l| l(distance));
        let mut session = Session::open(self.plan.clone())?;
        happened(Event::Opened(&session.sink));
        let start = session.pose.clone();
        for (done, &number) in frames.iter().enumerate() {
            let moments = self.timeline.exposures(number, self.moments, &travel);
            let exposure = self.expose(&mut session, &start, &moments)?;
            let picture = session.develop(&exposure, &self.command);
            picture.save(&self.frame_path(number), self.plan.depth)?;
            happened(Event::Frame {
                number,
                focus: moments[0].focus,
                seconds: exposure.seconds,
                missing: frames.len() - done - 1,
            });
        }
        Ok(())
    }

    /// Makes the folder, or sees that the frames in it are of this film.
    fn prepare_folder(&self) -> Result<()> {
        let io = |e: std::io::Error| Diagnostic::io(self.folder.display(), &e);
        // One folder of its own, beside the film; its parents are the user's to make.
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
                "the frames in `{}` are of another film",
                self.folder.display()
            ))
            .with_help("give another `--folder`, or remove this one")),
            Err(_) => write_whole(&label, |file| file.write_all(text.as_bytes())),
        }
    }

    /// Exposes one frame over its moments, each for an equal part of the samples.
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
            // Each part has its own random numbers, or their errors would add up.
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

/// How far the focused part moves for a distance; nothing for a pinhole.
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

/// Whether the lens, zoomed as it is at a moment, can focus there.
fn reaches(plan: &Plan, moment: &Moment) -> bool {
    let mut then = plan.clone();
    apply(&mut then, moment);
    match (lens_travel(&then), moment.focus) {
        (Ok(Some(travel)), Some(distance)) => travel(distance).is_some(),
        // Other faults are reported when the frame is rendered.
        _ => true,
    }
}

/// Puts a moment's values into a plan.
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

fn posed(pose: &CameraPose, moment: &Moment) -> CameraPose {
    CameraPose {
        position: moment.position.unwrap_or(pose.position),
        orientation: moment.orientation.unwrap_or(pose.orientation),
        ..pose.clone()
    }
}
