//! Renders the frames of a movie into a folder.
//!
//! Frames are numbered pictures. A frame appears under its name only when it is complete, and a
//! frame that exists is not rendered again, so an interrupted movie continues with the missing
//! frames. A frame in work is claimed, so several processes on a shared folder divide the movie.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use ivcam_base::diag::{Diagnostic, Result, Sink};
use ivcam_base::files::{Claims, InputRecord};
use ivcam_base::math::Meters;
use ivcam_inventor::pose::CameraPose;
use ivcam_optics::sampling::Sampler;
use ivcam_render::render::Exposure;
use ivcam_render::render::report::stated_error;

use super::frames::{claim_name, frame_path, is_whole};
use super::journal::Journal;
use super::label::{PARTS, check_files, label, label_folder};
use super::moments::{expose_moments, share};
use super::timeline::{Moment, Timeline, Travel};
use crate::photo::{Optics, Plan, Session};

/// The largest number of moments that a frame with an open shutter is exposed at. No search is
/// recorded: a smaller number shows fast motion as separate images, and a larger one repeats the
/// preparation of a moment more often. docs/guide/film.md states it.
const MOST_MOMENTS: u32 = 16;
/// The time after which frames that others are making are examined again. It is short beside the
/// time of a frame, and long beside that of the examination.
const POLL: Duration = Duration::from_millis(500);

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
pub(crate) enum ShootEvent<'a> {
    /// The scene was read.
    Opened(&'a Session),
    /// A frame was written.
    Frame {
        /// The number of the frame, from 0.
        number: u32,
        /// The focus distance in meters, if the timeline sets it.
        focus: Option<f64>,
        /// The time of the exposure, in seconds.
        seconds: f64,
        /// The error of the frame, if it may be above the target; if there is one.
        shortfall: Option<String>,
    },
    /// All frames are done or in work elsewhere. The process waits for this number of frames.
    Waiting(usize),
}

/// What is called for each report. An error ends the rendering.
pub(crate) type ShootReport<'a> = dyn FnMut(ShootEvent<'_>) -> Result<()> + 'a;

/// The frames of a movie, at most, whose scenes decide where a camera has to stand that the scene
/// does not have.
const FRAMED_FRAMES: u32 = 16;

/// What the frames of a process share.
struct MovieSession {
    session: Session,
    /// The camera's pose in the scene.
    start: CameraPose,
    lens: Option<Box<Travel<'static>>>,
    journal: Journal,
}

impl MovieSession {
    fn open(shoot: &Shoot, report: &mut ShootReport<'_>) -> Result<Self> {
        let record = InputRecord::begin();
        let mut session = Session::open(shoot.plan.clone())?;
        let mut inputs = record.inputs();
        let parts = crc32fast::hash(session.compiled().as_bytes());
        inputs.insert(PARTS.into(), BTreeSet::from([parts.into()]));
        check_files(&shoot.folder, &inputs)?;
        let start = session.pose.clone();
        let lens = lens_travel(&shoot.plan)?;
        if shoot.plan.meters {
            // The first frame decides for all, also for those that other processes make.
            let travel = |distance: f64| lens.as_ref().and_then(|l| l(distance));
            shoot.set(&mut session, &start, &shoot.timeline.at(0.0, &travel))?;
            session.meter();
        }
        report(ShootEvent::Opened(&session))?;
        Ok(Self {
            start,
            lens,
            journal: Journal::of(&shoot.folder),
            session,
        })
    }
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
        let step = timeline.frames.div_ceil(FRAMED_FRAMES).max(1);
        let frames = (0..timeline.frames).step_by(step as usize);
        let times = frames.map(|frame| timeline.at(f64::from(frame), &travel).time);
        plan.framed_over = times.flatten().collect();
        apply(&mut plan, &timeline.at(0.0, &travel));
        let shoot = Self {
            moments: plan.pixel_sampler().samples.clamp(1, MOST_MOMENTS),
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
            .map(|frame| frame_path(&self.folder, frame))
            .collect()
    }

    /// Returns those of some frames that are not done.
    pub(crate) fn missing(&self, frames: &[u32]) -> Vec<u32> {
        let missing = |frame: &u32| !self.is_done(*frame);
        frames.iter().copied().filter(missing).collect()
    }

    fn is_done(&self, frame: u32) -> bool {
        is_whole(&frame_path(&self.folder, frame))
    }

    /// Renders frames in rayon's current pool, except those that other processes render, and calls
    /// `report` after each. Returns when all are done. The claim of another process expires when it
    /// has not been refreshed for the time that it states; those of this process state `expiry`.
    /// The scene is opened even if all frames are done, to compare its files with theirs.
    ///
    /// # Errors
    /// Fails if the scene cannot be opened or has changed, the lens cannot be focused, a frame
    /// cannot be written, or `report` fails.
    pub(crate) fn render(
        &self,
        frames: &[u32],
        expiry: Duration,
        report: &mut ShootReport<'_>,
    ) -> Result<()> {
        let mut claims = Claims::new(&self.folder, expiry);
        let mut studio = MovieSession::open(self, report)?;
        let clock = Instant::now();
        let mut left = frames.to_vec();
        let mut is_waiting = false;
        loop {
            let mut elsewhere = Vec::new();
            for number in left {
                let name = claim_name(number);
                if self.is_done(number) {
                    claims.forget(&name);
                    continue;
                }
                let Some(claim) = claims.claim(&name, clock.elapsed())? else {
                    elsewhere.push(number);
                    continue;
                };
                // Another process may have finished it before this one had the claim.
                if !self.is_done(number) {
                    self.make(number, claim.is_taken_over(), &mut studio, report)?;
                }
                claim.finish();
                is_waiting = false;
            }
            left = elsewhere;
            if left.is_empty() {
                return Ok(());
            }
            if !is_waiting {
                report(ShootEvent::Waiting(left.len()))?;
                is_waiting = true;
            }
            std::thread::sleep(POLL);
        }
    }

    /// Renders and writes one frame.
    fn make(
        &self,
        number: u32,
        is_taken_over: bool,
        studio: &mut MovieSession,
        report: &mut ShootReport<'_>,
    ) -> Result<()> {
        let path = frame_path(&self.folder, number);
        let word = if is_taken_over {
            "takes over"
        } else {
            "begins"
        };
        studio.journal.write(word, number);
        let travel = |distance: f64| studio.lens.as_ref().and_then(|l| l(distance));
        let moments = self.timeline.exposures(number, self.moments, &travel);
        let exposure = self.expose(&mut studio.session, &studio.start, &moments)?;
        let mut picture = studio.session.develop(&exposure, &self.command);
        if self.timeline.shutter > 0.0 {
            let shutter = picture.provenance.entry("ivcam:shutter".into());
            shutter.or_insert_with(|| self.timeline.shutter.to_string());
        }
        // While this process was stopped, its claim may have expired.
        if self.is_done(number) {
            studio.journal.write("discards", number);
            return Ok(());
        }
        picture.save(&path, self.plan.depth)?;
        studio.journal.write("writes", number);
        report(ShootEvent::Frame {
            number,
            focus: moments[0].focus,
            seconds: exposure.spent.seconds,
            shortfall: self.shortfall(&exposure),
        })
    }

    /// Returns the error of a frame that may be above the target.
    fn shortfall(&self, exposure: &Exposure) -> Option<String> {
        let target = self.plan.stop.error?;
        let error = exposure.film.error();
        let is_met = error.is_ok_and(|e| e.high <= target);
        (!is_met).then(|| stated_error(error))
    }

    /// Makes the folder, or checks that the frames in it are of this movie.
    fn prepare_folder(&self) -> Result<()> {
        let text = label(&self.plan, &self.timeline)?;
        // Only the last folder of the path is made.
        match std::fs::create_dir(&self.folder) {
            Err(e) if !self.folder.is_dir() => Err(Diagnostic::io(self.folder.display(), &e)),
            _ => label_folder(&self.folder, &text),
        }
    }

    /// Changes a session to what a moment shows.
    fn set(&self, session: &mut Session, start: &CameraPose, moment: &Moment) -> Result<()> {
        let mut plan = self.plan.clone();
        apply(&mut plan, moment);
        // Events may move the scene's own camera, or bind another.
        let own = moment.time.and_then(|_| session.scene_pose(&plan));
        let pose = posed(own.as_ref().unwrap_or(start), moment);
        session.change(plan, pose)
    }

    /// Exposes one frame at its moments. The first is exposed last, so that the session is then at
    /// the one that the frame's metadata state.
    fn expose(
        &self,
        session: &mut Session,
        start: &CameraPose,
        moments: &[Moment],
    ) -> Result<Exposure> {
        let parts = moments.len() as u32;
        expose_moments(parts, self.plan.stop, &mut |turn, stop| {
            let i = (turn + 1) % parts;
            self.set(session, start, &moments[i as usize])?;
            // Parts need independent random numbers, otherwise their errors are correlated.
            let seed = self.plan.seed.wrapping_add(u64::from(i) * 0x9e37_79b9);
            let whole = self.plan.pixel_sampler();
            let sampler = Sampler {
                samples: share(whole.samples, turn, parts),
                seed,
                ..whole
            };
            Ok(session.expose_with(sampler, stop, &|_| ()))
        })
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
