//! Fits a camera to an archival picture.
//!
//! The fit starts from a camera and a lens, and refines position, orientation, focal length and
//! focus until the rendering of the scene matches the picture best.

use std::io::Write;
use std::time::{Duration, Instant};

use glam::{DQuat, DVec3};
use ivcam_base::diag::{Diagnostic, Result, Sink};
use ivcam_base::math::{Meters, Mm};
use ivcam_compare::fit::{BlurParameter, Fit, FitStep, Fitted, Half, Renderer, out_of_time};
use ivcam_compare::{CHANCE_LIMIT, Mask, PhotographFrame, Plane, Plate, best, probability};
use ivcam_inventor::pose::{CameraPose, Projection, axis_angle};
use ivcam_optics::film::Resolution;
use ivcam_render::render::Exposure;
use serde::Serialize;

use super::fit_clock::FitClock;
use crate::photo::{IdealChoice, Optics, Plan, Session};

/// The start of a camera fit.
///
/// The parameters are shift and rotation in the start's own frame, then the logarithm of the image
/// distance of a thin lens, the relative change of the focus in diopters, and the logarithm of the
/// f-number. With the image distance held, focus changes only the blur; otherwise a longer focal
/// length and a nearer focus would enlarge the picture alike.
#[derive(Clone)]
pub(crate) struct CameraFit {
    plan: Plan,
    pose: CameraPose,
    /// The focal length in millimeters; for a pinhole, the one that gives its height angle.
    pub(super) efl: f64,
    /// The focus distance in meters.
    pub(super) focus: f64,
    /// The diameter of the entrance pupil in millimeters; `None` for a pinhole.
    opening: Option<f64>,
    /// Whether the f-number is fitted.
    fits_aperture: bool,
    /// The pixels of the rendering that count; `None` is all.
    mask: Option<Mask>,
    /// Values to start from, and a border of the target; `None` searches for them.
    first: Option<(Vec<f64>, Option<PhotographFrame>)>,
    /// The number of lenses that were tried.
    tried: usize,
    /// The time that the whole fit may take.
    limit: Option<Duration>,
}

/// The result of a camera fit, with the rendering of the found camera.
pub(crate) struct FoundCamera {
    pub camera: FittedCamera,
    pub rendering: Plate,
}

/// The camera that a fit found. Each error is a standard error, with a focus and an f-number that
/// the picture does not determine anywhere in their intervals. It is infinite (`null` in JSON) if
/// it is not known. If the fit ended early it includes what was left to go.
#[derive(Clone, Debug, Serialize)]
pub struct FittedCamera {
    /// The position in meters.
    pub position: [f64; 3],
    /// The orientation as a quaternion x, y, z, w.
    pub orientation: [f64; 4],
    /// The vertical angle of view in radians, for an image at the focal length.
    pub height_angle: f64,
    /// The focal length in millimeters.
    pub efl: f64,
    /// The error of `efl`.
    pub efl_error: f64,
    /// The focal length of the start in millimeters.
    pub start_efl: f64,
    /// The focus distance in meters.
    pub focus: f64,
    /// The error of `focus`, infinite if `focus_range` reaches infinity; `None` if the focus was
    /// not fitted.
    pub focus_error: Option<f64>,
    /// The nearest and the farthest focus within one standard error, in meters; `None` if the focus
    /// was not fitted or its error is not known. The farthest may be infinite (`null` in JSON).
    pub focus_range: Option<[f64; 2]>,
    /// What the picture does not determine, of `focus` and `f_number`: their errors are mostly
    /// those of the intervals in which they were searched.
    pub undetermined: Vec<&'static str>,
    /// The focus distance of the start in meters.
    pub start_focus: f64,
    /// The f-number; `None` if it was not fitted.
    pub f_number: Option<f64>,
    /// The error of `f_number`.
    pub f_number_error: Option<f64>,
    /// The radial distortion of a pinhole, k₁ and k₂ of OpenCV's camera model; `None` if it was not
    /// fitted.
    pub distortion: Option<[f64; 2]>,
    /// The error of k₁; k₂ is the start's.
    pub distortion_error: Option<f64>,
    /// The distance from the start's position in meters.
    pub moved: f64,
    /// The error of `moved`.
    pub moved_error: f64,
    /// The angle from the start's orientation in radians.
    pub turned: f64,
    /// The error of `turned`.
    pub turned_error: f64,
    /// The robust root mean square of the residuals of local contrast; NaN (`null` in JSON) if no
    /// rendering was possible.
    pub residual: f64,
    /// An upper bound on the probability that a picture of something else agrees as well.
    pub chance: f64,
    /// The number of renderings.
    pub renders: usize,
    /// Whether the time ended before the fit had converged at every size.
    pub ended_early: bool,
    /// The camera as an Inventor file, with the options of the lens in a comment.
    pub file: String,
}

/// Finds the camera of an archival picture, from the camera and the lens of a session. The
/// session's scene is rendered many times. `report` is called after each improvement. A canceled
/// budget of the session ends the fit with an error.
///
/// # Errors
/// Fails for `--solids`, a region, an ideal lens, an orthographic camera and a lens without a
/// positive focal length, if the target's aspect differs from the rendering's, if the start cannot
/// be rendered, and if a picture of something else may agree as well.
pub fn fit_camera(
    session: &mut Session,
    target: &Plate,
    report: &mut dyn FnMut(&FitStep<'_>),
) -> Result<(FittedCamera, Plate)> {
    check_plan(&session.plan)?;
    let fit = CameraFit::of(session)?;
    let found = fit.search(session, target, &mut |step, _| report(step))?;
    Ok((found.camera, found.rendering))
}

/// Finds the camera as [`fit_camera`] does, and the f-number of its lens from what is out of focus.
///
/// # Errors
/// Fails as [`fit_camera`] does, and for a pinhole.
pub fn fit_camera_and_aperture(
    session: &mut Session,
    target: &Plate,
    report: &mut dyn FnMut(&FitStep<'_>),
) -> Result<(FittedCamera, Plate)> {
    check_plan(&session.plan)?;
    let fit = CameraFit::of(session)?.with_aperture()?;
    let found = fit.search(session, target, &mut |step, _| report(step))?;
    Ok((found.camera, found.rendering))
}

/// Refuses the options that a fit does not have.
///
/// # Errors
/// Fails for `--solids` and a region.
pub(crate) fn check_plan(plan: &Plan) -> Result<()> {
    let (name, help) = match (plan.solids, plan.region) {
        (false, None) => return Ok(()),
        (true, _) => (
            "--solids",
            "leave it out: the picture is the same without it",
        ),
        (false, Some(_)) => ("--region", "leave it out: a fit needs the whole picture"),
    };
    Err(Diagnostic::unsupported(format!("a camera can't be fitted with `{name}`")).with_help(help))
}

/// The step of the logarithm of the f-number: a sixth of a blur disc.
const APERTURE_STEP: f64 = 0.15;
/// The interval of the relative change of the focus in diopters: from nearly infinity to a quarter
/// of the start's distance.
const FOCUS_RANGE: [f64; 2] = [-0.999, 3.0];
/// The interval of the logarithm of the f-number over the start's: a twentieth to twenty times.
const APERTURE_RANGE: [f64; 2] = [-3.0, 3.0];
/// The share of the standard error of a uniform distribution over its interval above which a value
/// is not determined. The picture then has less information about it than the interval.
const UNDETERMINED: f64 = 0.7;
/// The ratio of a focus or an f-number to the lower end of the interval of its standard error from
/// which on this interval is printed.
const ROUGH: f64 = 1.25;
/// The factors of the focal length from which a fit is tried, with the distance in proportion.
const FACTORS: [f64; 5] = [1.0, 0.6, 0.77, 1.3, 1.7];

/// Renders parameters, and returns the seconds of the exposure too. Pictures of all sizes have the
/// same number of samples per pixel.
fn render(
    session: &mut Session,
    start: &CameraFit,
    values: &[f64],
    (width, height): (usize, usize),
    half: Half,
) -> Result<(Plate, f64)> {
    let mut plan = start.plan.clone();
    if half == Half::Second {
        plan.seed = plan.seed.wrapping_add(0x9e37_79b9);
    }
    plan.resolution = Resolution::new(width as u32, height as u32)?;
    let (efl, focus) = start.optics(values);
    plan.distortion = start.distortion(values);
    let f_number = start.f_number(values);
    match &mut plan.optics {
        Optics::Lens(lens) => {
            lens.f_number = f_number.or(lens.f_number);
            lens.efl = Some(Mm(efl));
            lens.zoom = 1.0;
            plan.focus = Some(Meters(focus));
        }
        Optics::Ideal(lens) => {
            lens.f_number = f_number.unwrap_or(lens.f_number);
            lens.efl = Mm(efl);
            plan.focus = Some(Meters(focus));
        }
        Optics::Pinhole => {}
    }
    let pose = start.pose_at(values);
    session.change(plan, pose)?;
    let exposure = session.expose(&|_| ());
    Ok((plate(&exposure, session), exposure.spent.seconds))
}

/// Returns the levels of an exposure.
fn plate(exposure: &Exposure, session: &Session) -> Plate {
    let Resolution { width, height } = exposure.film.resolution;
    let levels = exposure.film.pixels.iter();
    let levels = levels.map(|exposed| session.plan.response.levels(exposed.mean.to_array()));
    let levels: Vec<[f64; 3]> = levels.collect();
    let level = |c: usize| {
        Plane::from_fn(width as usize, height as usize, |x, y| {
            levels[y * width as usize + x][c] as f32
        })
    };
    Plate::from_planes([level(0), level(1), level(2)])
}

impl CameraFit {
    /// The index of the focus among the parameters of a lens, and of the distortion among those of
    /// a pinhole.
    pub(super) const FOCUS: usize = 7;

    /// Starts from a session's camera and lens.
    ///
    /// # Errors
    /// Fails for an ideal lens, an orthographic camera, and a lens without a positive focal length.
    pub(crate) fn of(session: &Session) -> Result<Self> {
        let (mut plan, pose) = (session.plan.clone(), session.pose.clone());
        let focus = plan.focus.map_or(pose.focal_distance, |d| d.0);
        let mut opening = None;
        let efl = match (&plan.optics, pose.projection) {
            (Optics::Lens(choice), _) => {
                let lens = choice.open(&mut Sink::new())?;
                let efl = lens.first_order().efl();
                opening = lens.real_f_number().map(|n| efl / n);
                efl
            }
            (Optics::Ideal(_), _) => {
                return Err(Diagnostic::error("an ideal lens can't be fitted")
                    .with_help("give a real lens, or `--lens none`"));
            }
            (Optics::Pinhole, Projection::Perspective { height_angle }) => {
                0.5 * plan.film.height / libm::tan(0.5 * height_angle)
            }
            (Optics::Pinhole, Projection::Orthographic { .. }) => {
                return Err(
                    Diagnostic::error("an orthographic camera has no focal length to fit")
                        .with_help("start from a PerspectiveCamera, or give a `--lens`"),
                );
            }
        };
        if !efl.is_finite() || efl <= 0.0 {
            return Err(Diagnostic::error(
                "a lens without a positive focal length can't be fitted",
            ));
        }
        // `--time` limits the fit and not each of its renderings.
        let limit = plan.stop.time.take();
        if limit.is_some() && plan.stop.error.is_none() {
            plan.stop.samples = plan.pixel_sampler().samples;
        }
        Ok(Self {
            plan,
            pose,
            efl,
            focus,
            opening,
            fits_aperture: false,
            mask: None,
            first: None,
            tried: 1,
            limit,
        })
    }

    /// Fits the f-number too.
    ///
    /// # Errors
    /// Fails for a pinhole.
    pub(crate) fn with_aperture(mut self) -> Result<Self> {
        if self.opening.is_none() {
            return Err(Diagnostic::error("a pinhole has no aperture to fit")
                .with_help("give a `--lens`, or leave out `--fit-aperture`"));
        }
        if !std::mem::replace(&mut self.fits_aperture, true)
            && let Some((values, _)) = &mut self.first
        {
            values.push(0.0);
        }
        Ok(self)
    }

    /// Returns a fit with an ideal lens in place of a pinhole, with the same image distance.
    pub(super) fn with_ideal_lens(&self, f_number: f64) -> Self {
        let mut plan = self.plan.clone();
        let efl = 1.0 / (1.0 / self.efl + 1e-3 / self.focus);
        plan.optics = Optics::Ideal(IdealChoice {
            efl: Mm(efl),
            f_number,
        });
        Self {
            plan,
            efl,
            opening: Some(efl / f_number),
            ..self.clone()
        }
    }

    /// Fits only the pixels of the rendering that count.
    ///
    /// # Errors
    /// Fails if the mask has another size than the rendering, or if no pixel counts.
    pub(crate) fn with_mask(mut self, mask: Option<Mask>) -> Result<Self> {
        let Resolution { width, height } = self.plan.resolution;
        if let Some(mask) = &mask {
            mask.check(width as usize, height as usize)?;
        }
        self.mask = mask;
        Ok(self)
    }

    /// Starts from values and the target's border, without a search. So many lenses were tried to
    /// find the values, which counts in the probability of an agreement by chance.
    pub(super) fn starting_from(
        self,
        values: Vec<f64>,
        border: Option<PhotographFrame>,
        tried: usize,
    ) -> Self {
        Self {
            first: Some((values, border)),
            tried,
            ..self
        }
    }

    /// Ends within a time.
    pub(super) fn within(self, limit: Option<Duration>) -> Self {
        Self { limit, ..self }
    }

    /// Returns the number of parameters.
    pub(super) fn count(&self) -> usize {
        self.steps().len()
    }

    /// Returns the index of the f-number among the parameters, if it is fitted.
    fn aperture_index(&self) -> Option<usize> {
        let index = Self::FOCUS + usize::from(self.has_focus());
        self.fits_aperture.then_some(index)
    }

    /// Returns the fitted f-number; `None` if it is not fitted.
    fn f_number(&self, values: &[f64]) -> Option<f64> {
        let change = values.get(self.aperture_index()?)?;
        Some(self.efl / self.opening? * libm::exp(*change))
    }

    /// Returns the f-number, fitted or not; `None` for a pinhole.
    pub(super) fn any_f_number(&self, values: &[f64]) -> Option<f64> {
        let start = self.opening.map(|opening| self.efl / opening);
        self.f_number(values).or(start)
    }

    /// Sets the f-number among the parameters, if it is fitted, as far as the lens opens.
    pub(super) fn set_f_number(&self, values: &mut [f64], f_number: f64) {
        if let (Some(index), Some(opening)) = (self.aperture_index(), self.opening) {
            values[index] = libm::log(f_number * opening / self.efl).clamp(0.0, APERTURE_RANGE[1]);
        }
    }

    /// Returns whether the focus is fitted: that of a lens with a finite focus distance.
    pub(super) fn has_focus(&self) -> bool {
        self.opening.is_some() && self.focus.is_finite() && self.focus > 0.0
    }

    /// Returns whether k₁ of a pinhole's distortion is fitted: if the start has a distortion.
    fn is_distorted(&self) -> bool {
        self.plan.optics == Optics::Pinhole && self.plan.distortion != [0.0; 2]
    }

    /// Returns the parameter of the focus, if it is fitted.
    fn focus_parameter<'v>(&self, values: &'v [f64]) -> Option<&'v f64> {
        values.get(Self::FOCUS).filter(|_| self.has_focus())
    }

    /// Returns what is added to the start's k₁.
    fn distortion_change(&self, values: &[f64]) -> f64 {
        let change = values.get(Self::FOCUS).filter(|_| self.is_distorted());
        change.copied().unwrap_or_default()
    }

    /// Returns for each parameter a change that moves the picture by about half a pixel, or blurs
    /// it by one.
    fn steps(&self) -> Vec<f64> {
        let across = f64::from(self.plan.resolution.width);
        let pixel = self.plan.film.width / across;
        let turn = 0.5 * pixel / self.efl;
        let far = self.subject_distance();
        let shift = turn * far;
        let roll = 1.0 / across;
        let blur = self
            .opening
            .map_or(1.0, |opening| pixel * 1e3 * far / (self.efl * opening));
        let mut steps = vec![shift, shift, 2.0 * shift, turn, turn, roll, roll];
        steps.extend(self.has_focus().then_some(blur.clamp(0.02, 0.5)));
        steps.extend(self.fits_aperture.then_some(APERTURE_STEP));
        if self.is_distorted() {
            let film = self.plan.film;
            let corner = 0.5 * film.width.hypot(film.height) / self.efl;
            steps.push(turn / (corner * corner * corner));
        }
        steps
    }

    /// Returns the distance of what the start looks at, in meters.
    fn subject_distance(&self) -> f64 {
        // A lens that is focused at infinity photographs what the camera's pose looks at.
        let far = [self.focus, self.pose.focal_distance, 10.0];
        let far = far.into_iter().find(|d| d.is_finite() && *d > 0.0);
        far.unwrap_or(10.0).max(0.01)
    }

    /// Returns the focal length in millimeters and the focus distance in meters.
    fn optics(&self, values: &[f64]) -> (f64, f64) {
        let Some(focus) = self.focus_parameter(values) else {
            return (self.efl * libm::exp(values[6]), self.focus);
        };
        let focus = self.focus / (1.0 + focus);
        let film = libm::exp(values[6]) * image_distance(self.efl, self.focus);
        (1.0 / (1.0 / film + 1e-3 / focus), focus)
    }

    /// Returns the nearest and the farthest focus in meters within one standard error, if that is
    /// known.
    fn focus_range(&self, values: &[f64], fitted: &Fitted) -> Option<[f64; 2]> {
        let change = self.focus_parameter(values)?;
        let error = Some(fitted.error(Self::FOCUS)).filter(|error| error.is_finite())?;
        let [low, high] = FOCUS_RANGE;
        let far = match change - error {
            least if least > low => self.focus / (1.0 + least),
            _ => f64::INFINITY,
        };
        Some([self.focus / (1.0 + (change + error).min(high)), far])
    }

    /// Returns the derivatives of the logarithm of the focal length by the parameters.
    fn focal_length_gradient(&self, values: &[f64]) -> Vec<(usize, f64)> {
        let (efl, focus) = self.optics(values);
        let near = 1e-3 * efl / focus;
        match self.focus_parameter(values) {
            Some(change) => vec![(6, 1.0 - near), (Self::FOCUS, -near / (1.0 + change))],
            None => vec![(6, 1.0)],
        }
    }

    /// Returns k₁ and k₂ of a pinhole's distortion.
    fn distortion(&self, values: &[f64]) -> [f64; 2] {
        let [k1, k2] = self.plan.distortion;
        [k1 + self.distortion_change(values), k2]
    }

    /// Returns the camera pose of parameters. Its focal distance is finite, as in a file: with the
    /// focus at infinity it is the start's.
    fn pose_at(&self, values: &[f64]) -> CameraPose {
        let shift = DVec3::new(values[0], values[1], values[2]);
        let turn = DVec3::new(values[3], values[4], values[5]);
        let mut pose = self.pose.clone();
        pose.position += self.pose.orientation * shift;
        pose.orientation = (self.pose.orientation * turned(turn)).normalize();
        let (efl, focus) = self.optics(values);
        if focus.is_finite() {
            pose.focal_distance = focus;
        }
        pose.projection = Projection::Perspective {
            height_angle: 2.0 * libm::atan(0.5 * self.plan.film.height / efl),
        };
        pose
    }

    /// Guesses rotation and focal length by aligning the picture with the start's rendering. A
    /// border that the alignment leaves out is returned too, in the target's pixels.
    fn guess(
        &self,
        target: &Plate,
        draw: &mut Renderer<'_>,
    ) -> Option<(Vec<f64>, Option<PhotographFrame>)> {
        let Resolution { width, height } = self.plan.resolution;
        let shrink = (f64::from(width.max(height)) / 180.0).max(1.0);
        let small = |n: u32| (f64::from(n) / shrink).round().max(1.0) as usize;
        let size = (small(width), small(height));
        let mut values = vec![0.0; self.count()];
        let new = draw(&values, size, Half::First).ok()?;
        let old = target.map(|p| p.resized(size.0, size.1));
        let found = best(&new, &old)?.alignment;
        if found.mirrored {
            return None;
        }
        let pixels = self.efl / self.plan.film.width * size.0 as f64;
        values[3] = -libm::atan(found.shift[1] / pixels);
        values[4] = -libm::atan(found.shift[0] / pixels);
        values[5] = -found.rotation.to_radians();
        values[6] = -libm::log(found.scale);
        let is_alike = found.chance <= CHANCE_LIMIT;
        let frame = found.photograph.filter(|_| is_alike);
        let whole = |n: usize| (n as f64 * target.width as f64 / size.0 as f64).round() as usize;
        let frame = frame.map(|frame| PhotographFrame {
            left: whole(frame.left),
            top: whole(frame.top),
            width: whole(frame.width),
            height: whole(frame.height),
        });
        Some((values, frame))
    }

    /// Returns a fit of this start, which ends with its best values when it has to.
    pub(super) fn fit<'a>(
        &'a self,
        target: &'a Plate,
        has_to_end: &'a dyn Fn() -> bool,
    ) -> Fit<'a> {
        let Resolution { width, height } = self.plan.resolution;
        Fit {
            target,
            sizes: Fit::pyramid((width as usize, height as usize)),
            steps: self.steps(),
            blur: self.blur(),
            mask: self.mask.as_ref(),
            has_to_end,
        }
    }

    /// Renders parameters, if there is time for that.
    ///
    /// # Errors
    /// Fails if the time is over, or if the parameters cannot be rendered.
    pub(super) fn draw(
        &self,
        session: &mut Session,
        clock: &FitClock,
        values: &[f64],
        size: (usize, usize),
        half: Half,
    ) -> Result<Plate> {
        if clock.is_over() {
            return Err(out_of_time());
        }
        let begun = Instant::now();
        let (drawn, exposure) = render(session, self, values, size, half)?;
        clock.add(size, begun, exposure);
        Ok(drawn)
    }

    /// Finds values to start from: those of the start, or a guess by alignment, at the distance
    /// that small pictures agree with best. A border of the target is returned too.
    ///
    /// # Errors
    /// Fails if the start cannot be rendered.
    pub(super) fn find_start(
        &self,
        fit: &Fit<'_>,
        draw: &mut Renderer<'_>,
    ) -> Result<(Vec<f64>, Option<PhotographFrame>)> {
        let mut first = vec![0.0; self.count()];
        let mut border = None;
        let before = fit.cost_of(&first, draw)?;
        if let Some((guess, frame)) = self.guess(fit.target, draw) {
            border = frame.filter(|_| self.mask.is_none());
            if fit.cost_of(&guess, draw).is_ok_and(|c| c < before) {
                first = guess;
            }
        }
        let starts = FACTORS.map(|factor| self.along_the_axis(&first, factor));
        Ok((fit.best_start(&starts, draw).unwrap_or(first), border))
    }

    /// Finds the camera whose rendering matches the target best. `report` receives every step that
    /// improves it, and roughly the time left.
    ///
    /// # Errors
    /// Fails if the target's aspect differs from the rendering's, or if the start cannot be
    /// rendered.
    pub(crate) fn search(
        &self,
        session: &mut Session,
        target: &Plate,
        report: &mut dyn FnMut(&FitStep<'_>, Duration),
    ) -> Result<FoundCamera> {
        let size = self.plan.resolution;
        self.check_aspect(target)?;
        let stop = session.budget.stop().clone();
        let clock = FitClock::new(self.limit, size, stop);
        let has_to_end = || clock.is_over();
        let fit = self.fit(target, &has_to_end);
        let mut renders = 0;
        let mut draw = |values: &[f64], size: (usize, usize), half: Half| {
            let drawn = self.draw(session, &clock, values, size, half);
            renders += usize::from(drawn.is_ok());
            drawn
        };
        let (first, border) = match &self.first {
            Some(found) => found.clone(),
            None => self.find_start(&fit, &mut draw)?,
        };
        let mut report_step = |step: &FitStep<'_>| {
            report(step, clock.left(step.renders_left, step.pixels_left));
        };
        let fitted = fit.run(&first, &mut draw, &mut report_step)?;
        if let Some(border) = border {
            session.sink.add(*has_border(border));
        }
        let whole = (size.width as usize, size.height as usize);
        let (rendering, _) = render(session, self, &fitted.values, whole, Half::First)?;
        if let Some(lit) = session.lit_radius().filter(|_| self.mask.is_none()) {
            session.sink.add(*has_dark_corners(lit));
        }
        let mut camera = self.camera(&fitted);
        camera.renders = renders + 1;
        camera.chance = (self.tried as f64 * fit.chance(&fitted.values, &rendering)).min(1.0);
        if camera.chance > CHANCE_LIMIT {
            return Err(unlike(camera.chance));
        }
        Ok(FoundCamera { camera, rendering })
    }

    /// Returns the parameters that change only blur.
    fn blur(&self) -> Vec<BlurParameter> {
        let focus = self.has_focus().then_some((Self::FOCUS, FOCUS_RANGE));
        let aperture = self.aperture_index().map(|index| (index, APERTURE_RANGE));
        let all = focus.into_iter().chain(aperture);
        all.map(|(index, range)| BlurParameter { index, range })
            .collect()
    }

    /// Returns parameters with the focal length times a factor and the camera farther from what it
    /// looks at by the same factor, which then has the same size in the picture. A fit by steps
    /// follows this valley of similar pictures slowly.
    fn along_the_axis(&self, values: &[f64], factor: f64) -> Vec<f64> {
        let mut moved = values.to_vec();
        moved[2] += (factor - 1.0) * self.subject_distance();
        moved[6] += libm::log(factor);
        if self.has_focus() {
            moved[Self::FOCUS] = (1.0 + moved[Self::FOCUS]) / factor - 1.0;
        }
        moved
    }

    /// Checks that the target has the rendering's aspect.
    pub(super) fn check_aspect(&self, target: &Plate) -> Result<()> {
        let size = self.plan.resolution;
        let height = target.height as f64 * f64::from(size.width) / target.width as f64;
        if (height - f64::from(size.height)).abs() <= 1.0 {
            return Ok(());
        }
        Err(Diagnostic::error(format!(
            "the picture is {}x{}, the rendering {}x{}: their aspects differ",
            target.width, target.height, size.width, size.height
        ))
        .with_help(format!(
            "give `--size {}x{}`, and `--film` if the film had another aspect",
            size.width,
            height.round()
        )))
    }

    /// Returns a camera file of parameters, with the lens options in a comment.
    pub(crate) fn camera_text(&self, values: &[f64]) -> String {
        let pose = self.pose_at(values);
        let (efl, focus) = self.optics(values);
        let (axis, angle) = axis_angle(pose.orientation);
        let Projection::Perspective { height_angle } = pose.projection else {
            return String::new(); // `pose_at` always returns a perspective camera.
        };
        let lens = match &self.plan.optics {
            Optics::Pinhole if self.is_distorted() => {
                let [k1, k2] = self.distortion(values);
                format!("--lens none --distortion {k1:.6},{k2}")
            }
            Optics::Pinhole | Optics::Ideal(_) => "--lens none".to_owned(),
            Optics::Lens(lens) => {
                let aperture = self.f_number(values).or(lens.f_number);
                let aperture = aperture.map(|n| format!(" --aperture {n:.3}"));
                let aperture = aperture.unwrap_or_default();
                let focus = if focus.is_infinite() {
                    " --focus inf"
                } else {
                    ""
                };
                format!("--lens {} --efl {efl:.4}mm{aperture}{focus}", lens.name)
            }
        };
        let p = pose.position;
        format!(
            "#Inventor V2.1 ascii\n# Fitted by `ivcam compare --fit`; render with {lens}\n\
             PerspectiveCamera {{\n  position {:.6} {:.6} {:.6}\n  \
             orientation {:.8} {:.8} {:.8} {:.8}\n  nearDistance {}\n  farDistance {}\n  \
             heightAngle {height_angle:.8}\n  focalDistance {:.6}\n}}\n",
            p.x, p.y, p.z, axis.x, axis.y, axis.z, angle, pose.near, pose.far, pose.focal_distance
        )
    }

    /// Returns the camera of fitted parameters.
    fn camera(&self, fitted: &Fitted) -> FittedCamera {
        let v = &fitted.values;
        let error = |i: usize| fitted.error(i);
        let length = |a: f64, b: f64, c: f64| (a * a + b * b + c * c).sqrt();
        let focus_range = self.focus_range(v, fitted);
        let undetermined = self.blur().into_iter().filter(|blur| {
            let error = error(blur.index);
            error.is_finite() && error > UNDETERMINED * blur.variance_about(v[blur.index]).sqrt()
        });
        let (efl, focus) = self.optics(v);
        let pose = self.pose_at(v);
        let height_angle = match pose.projection {
            Projection::Perspective { height_angle } => height_angle,
            Projection::Orthographic { .. } => f64::NAN, // `pose_at` returns none.
        };
        FittedCamera {
            position: pose.position.to_array(),
            orientation: pose.orientation.to_array(),
            height_angle,
            efl,
            efl_error: efl * fitted.error_of(&self.focal_length_gradient(v)),
            start_efl: self.efl,
            focus,
            focus_error: self.has_focus().then(|| match focus_range {
                Some([_, far]) if far.is_finite() => {
                    focus * error(Self::FOCUS) / (1.0 + v[Self::FOCUS])
                }
                _ => f64::INFINITY,
            }),
            focus_range,
            undetermined: undetermined
                .map(|blur| match blur.index == Self::FOCUS && self.has_focus() {
                    true => "focus",
                    false => "f_number",
                })
                .collect(),
            start_focus: self.focus,
            f_number: self.f_number(v),
            f_number_error: self
                .aperture_index()
                .and_then(|i| Some(self.f_number(v)? * error(i))),
            distortion: self.is_distorted().then(|| self.distortion(v)),
            distortion_error: self.is_distorted().then(|| error(Self::FOCUS)),
            moved: length(v[0], v[1], v[2]),
            moved_error: length(error(0), error(1), error(2)),
            turned: length(v[3], v[4], v[5]),
            turned_error: length(error(3), error(4), error(5)),
            residual: fitted.cost.max(0.0).sqrt(),
            chance: 1.0,
            renders: fitted.renders,
            ended_early: fitted.ended_early,
            file: self.camera_text(v),
        }
    }
}

impl FittedCamera {
    /// Writes the result, each value with its standard error.
    ///
    /// # Errors
    /// Fails if `out` cannot be written.
    pub(crate) fn report(&self, out: &mut dyn Write) -> std::io::Result<()> {
        writeln!(
            out,
            "moved      {:.1} mm{}",
            1000.0 * self.moved,
            in_brackets(1000.0 * self.moved_error, 1)
        )?;
        writeln!(
            out,
            "turned     {:.3} degrees{}",
            self.turned.to_degrees(),
            in_brackets(self.turned_error.to_degrees(), 3)
        )?;
        writeln!(
            out,
            "focal      {:.3} mm{}, was {:.3} mm",
            self.efl,
            in_brackets(self.efl_error, 3),
            self.start_efl
        )?;
        if let Some(error) = self.focus_error {
            let bracket = match self.focus_range {
                Some([near, _]) if error.is_finite() && self.focus < ROUGH * near => {
                    in_brackets(error, 3)
                }
                Some([near, far]) if far.is_finite() => format!(" ({near:.2} m to {far:.2} m)"),
                Some([near, _]) => format!(" ({near:.2} m to infinity)"),
                None => String::new(),
            };
            writeln!(
                out,
                "focus      {:.3} m{bracket}, was {:.3} m",
                self.focus, self.start_focus
            )?;
        }
        if let (Some(n), Some(error)) = (self.f_number, self.f_number_error) {
            let e = error / n; // of the logarithm
            let bracket = match e.is_finite() && e > libm::log(ROUGH) {
                true => format!(" (f/{:.2} to f/{:.2})", n * libm::exp(-e), n * libm::exp(e)),
                false => in_brackets(error, 2),
            };
            writeln!(out, "aperture   f/{n:.2}{bracket}")?;
        }
        if let (Some([k1, k2]), Some(error)) = (self.distortion, self.distortion_error) {
            writeln!(out, "distortion {k1:.5}{}, {k2}", in_brackets(error, 5))?;
        }
        if self.residual.is_finite() {
            writeln!(out, "residual   {:.1}%", 100.0 * self.residual)?;
        }
        if self.ended_early {
            writeln!(
                out,
                "ended      by `--time`; this is the best camera so far{}",
                match self.moved_error.is_finite() {
                    true => ", and the known errors include what was left to go",
                    false => "",
                }
            )?;
        }
        for name in &self.undetermined {
            let name = name.replace('_', "-");
            writeln!(
                out,
                "open       the {name}: the blur of this picture hardly depends on it, so it may be \
                 elsewhere within its error; the other errors include that"
            )?;
        }
        let unknown = self.unknown_errors();
        if !unknown.is_empty() {
            let why = match self.ended_early {
                true => "the time was too short to find them",
                false => {
                    "the noise of the renderings hides what the picture determines; more `--samples` may help"
                }
            };
            let names = unknown.join(", ");
            writeln!(out, "errors     are not known of {names}: {why}")?;
        }
        writeln!(
            out,
            "agreement  a picture of something else agrees as well with a probability of at most {}",
            probability(self.chance)
        )?;
        writeln!(out, "renders    {}", self.renders)
    }

    /// Returns the names of the numbers that were fitted and whose errors are not known.
    fn unknown_errors(&self) -> Vec<&'static str> {
        let errors = [
            ("position", Some(self.moved_error)),
            ("rotation", Some(self.turned_error)),
            ("focal length", Some(self.efl_error)),
            (
                "focus",
                self.focus_error.filter(|_| self.focus_range.is_none()),
            ),
            ("f-number", self.f_number_error),
            ("distortion", self.distortion_error),
        ];
        let unknown = errors
            .into_iter()
            .filter(|(_, e)| e.is_some_and(f64::is_infinite));
        unknown.map(|(name, _)| name).collect()
    }
}

/// Returns the error of a fit whose picture may show something else.
fn unlike(chance: f64) -> Box<Diagnostic> {
    // A bound is rounded up, so that one above the limit is not printed as the limit.
    let digit = libm::pow(10.0, libm::log10(chance).floor() - 1.0);
    let chance = (chance / digit).ceil() * digit;
    Diagnostic::error(format!(
        "the picture seems to show something else: an unrelated picture agrees as well with a \
         probability of up to {chance:.1e}, and the limit is {CHANCE_LIMIT:.1e}"
    ))
    .with_help(
        "check the picture and the start: a camera that is far off finds no way, and \
         `ivcam render` shows what it sees",
    )
}

/// Returns the image distance in millimeters of a thin lens with a focal length in millimeters,
/// focused at a distance in meters.
pub(super) fn image_distance(efl: f64, focus: f64) -> f64 {
    1.0 / (1.0 / efl - 1e-3 / focus)
}

/// Returns the warning that the whole picture was fitted, and the photograph is only a part of it.
fn has_border(frame: PhotographFrame) -> Box<Diagnostic> {
    let PhotographFrame {
        left,
        top,
        width,
        height,
    } = frame;
    Diagnostic::warning(format!(
        "the old picture seems to have a border, which was fitted as a part of the photograph: that \
         is about {width}x{height} pixels from {left},{top}"
    ))
    .with_help(
        "cut the photograph out of the old picture, because a fit needs the whole frame; `--mask` \
         leaves a border out if the film was as large as the scan",
    )
}

/// Returns the warning that corners were fitted to which the lens gives no light beyond a distance
/// from the middle of the film, in millimeters.
fn has_dark_corners(lit: f64) -> Box<Diagnostic> {
    Diagnostic::warning(format!(
        "the lens leaves corners of the film dark: its light ends {lit:.1} mm from the middle, and \
         the fitted place may be off by several of its errors"
    ))
    .with_help("leave the corners and the falloff toward them out by `--mask` or `--crop`")
}

/// Returns a standard error in brackets, or nothing if it is unknown.
fn in_brackets(error: f64, decimals: usize) -> String {
    match error.is_finite() {
        true => format!(" (± {error:.decimals$})"),
        false => String::new(),
    }
}

/// Returns the rotation about a vector by its length in radians.
fn turned(vector: DVec3) -> DQuat {
    let angle = vector.length();
    match vector.try_normalize() {
        Some(axis) => {
            let v = axis * libm::sin(0.5 * angle);
            DQuat::from_xyzw(v.x, v.y, v.z, libm::cos(0.5 * angle))
        }
        None => DQuat::IDENTITY,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::folder::Folder;
    use crate::photo::{CameraNode, Era};

    #[test]
    fn the_file_of_a_lens_focused_at_infinity_reads_back_and_states_the_focus() {
        let folder = Folder::new("fit-infinity");
        let scene = "#Inventor V2.1 ascii\nPerspectiveCamera { focalDistance 2 } Cube { }\n";
        let mut plan = Plan::of_era(Era::Modern, folder.file("cube.iv", scene));
        plan.focus = Some(Meters(f64::INFINITY));
        let session = Session::open(plan).expect("the scene is whole");
        let fit = CameraFit::of(&session).expect("the lens has a focal length");
        let text = fit.camera_text(&vec![0.0; fit.count()]);
        assert!(text.contains("mm --focus inf\n"), "{text}");
        let node = CameraNode::read(&text).expect("the file has a camera");
        assert_eq!(node.pose().focal_distance, 2.0, "{text}");
    }

    #[test]
    fn a_turn_is_written_as_its_axis_and_angle() {
        let vector = DVec3::new(0.3, -0.2, 0.9);
        let (axis, angle) = axis_angle(turned(vector));
        assert!((axis * angle - vector).length() < 1e-12);
        assert_eq!(axis_angle(DQuat::IDENTITY).1, 0.0);
    }

    /// Returns a fitted camera whose errors are not known.
    fn unknown() -> FittedCamera {
        FittedCamera {
            position: [0.0; 3],
            orientation: [0.0, 0.0, 0.0, 1.0],
            height_angle: 0.6,
            efl: 50.0,
            efl_error: f64::INFINITY,
            start_efl: 50.0,
            focus: 1.0,
            focus_error: None,
            focus_range: None,
            undetermined: Vec::new(),
            start_focus: 1.0,
            f_number: None,
            f_number_error: None,
            distortion: None,
            distortion_error: None,
            moved: 0.0,
            moved_error: f64::INFINITY,
            turned: 0.0,
            turned_error: f64::INFINITY,
            residual: f64::NAN,
            chance: 1e-9,
            renders: 7,
            ended_early: false,
            file: String::new(),
        }
    }

    fn said(found: &FittedCamera) -> String {
        let mut out = Vec::new();
        found.report(&mut out).unwrap();
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn errors_that_a_fit_had_no_time_for_are_not_blamed_on_noise() {
        let mut found = unknown();
        assert!(said(&found).contains("noise"));
        found.ended_early = true;
        let late = said(&found);
        assert!(late.contains("the time was too short"), "{late}");
        assert!(
            !late.contains("noise") && !late.contains("include"),
            "{late}"
        );
    }

    #[test]
    fn a_fit_names_each_number_whose_error_is_not_known() {
        let found = FittedCamera {
            moved_error: 0.004,
            turned_error: 0.001,
            focus_error: Some(f64::INFINITY),
            ..unknown()
        };
        let said = said(&found);
        assert!(said.contains("not known of focal length, focus:"), "{said}");
        assert!(!said.contains("not known of position"), "{said}");
    }

    #[test]
    fn a_focus_that_the_picture_does_not_determine_is_said_with_its_interval() {
        let found = FittedCamera {
            moved_error: 0.004,
            turned_error: 0.001,
            efl_error: 0.2,
            focus: 0.97,
            focus_error: Some(f64::INFINITY),
            focus_range: Some([0.62, f64::INFINITY]),
            undetermined: vec!["focus"],
            ..unknown()
        };
        let rough = said(&found);
        assert!(
            rough.contains("focus      0.970 m (0.62 m to infinity)"),
            "{rough}"
        );
        assert!(rough.contains("open       the focus:"), "{rough}");
        assert!(!rough.contains("not known"), "{rough}");
        let sharp = said(&FittedCamera {
            focus_error: Some(0.05),
            focus_range: Some([0.92, 1.02]),
            undetermined: Vec::new(),
            ..found
        });
        assert!(sharp.contains("focus      0.970 m (± 0.050)"), "{sharp}");
    }

    #[test]
    fn a_refused_fit_states_a_probability_above_the_limit() {
        let text = unlike(1.0001e-3).to_string();
        assert!(text.contains("1.1e-3, and the limit is 1.0e-3"), "{text}");
    }
}
