//! Which of several lenses an archival picture may have been taken with.
//!
//! Pose, focal length, focus and f-number are fitted once, with a pinhole or an ideal lens. Its
//! derivatives say how another lens changes them, so that each takes a few small renderings. The
//! best are then fitted fully, each by its own derivatives.

use std::collections::BTreeMap;
use std::io::Write;
use std::time::{Duration, Instant};

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::math::Mm;
use ivcam_compare::fit::{Effort, FittedModel, Half, ModelMatch};
use ivcam_compare::{Mask, PhotographFrame, Plate};
use ivcam_inventor::pose::{CameraPose, Projection};

use super::camera_fit::{CameraFit, image_distance};
use super::fit_clock::FitClock;
use crate::photo::{LensChoice, Optics, Plan, Session};

/// The name that stands for every shipped lens.
pub(crate) const ANY: &str = "any";
/// The number of standard errors up to which a lens may be as good as the best.
const APART: f64 = 2.0;
/// The least number of lenses that are fitted fully.
const FULLY: usize = 6;
/// The number of standard errors up to which further lenses are fitted fully.
const FULLY_WITHIN: f64 = 6.0;
/// The renderings of a full fit for one of a few steps: about 300 for 4.
const FULL_WORK: f64 = 75.0;
/// The f-number from which that of the ideal lens is searched for, if none is given.
const USUAL_F_NUMBER: f64 = 2.8;
/// The f-number of the lenses if a pinhole matches the picture better than an ideal lens.
const SHARP_F_NUMBER: f64 = 16.0;

/// The lenses to rank, and the picture.
pub(crate) struct LensQuestion<'a> {
    pub target: &'a Plate,
    /// The choices that all lenses share: f-number, coating and so on. A focal length is the start;
    /// without one it is that which sees what the session's camera sees.
    pub usual: &'a LensChoice,
    /// The names of the lenses.
    pub names: &'a [&'a str],
    /// The pixels of the rendering that count; `None` is all.
    pub mask: Option<Mask>,
}

/// How far a ranking is: what it does, and the time that is left of it.
pub(crate) type RankingReport<'r> = dyn FnMut(&str, Duration) + 'r;

/// A lens that was judged, with the camera that suits it best.
struct JudgedLens {
    name: String,
    fit: CameraFit,
    /// The match by a few steps.
    found: ModelMatch,
    /// The match of the full fit; `None` if there was none.
    full: Option<ModelMatch>,
}

/// The lenses, the best first.
pub(crate) struct LensRanking {
    /// Never empty.
    judged: Vec<JudgedLens>,
    /// The best match by a few steps.
    by_steps: ModelMatch,
    /// Lenses that do not light the corners of the film.
    dark: Vec<String>,
    /// Reasons for which lenses cannot be judged, each with their names.
    refused: BTreeMap<String, Vec<String>>,
    /// Lenses that the time did not suffice for.
    left: Vec<String>,
    /// Lenses that the time did not suffice to fit fully.
    unfitted: Vec<String>,
}

/// The camera that was found with a pinhole or an ideal lens.
struct Reference {
    model: FittedModel,
    residual: f64,
    border: Option<PhotographFrame>,
    /// The f-number of the ideal lens; `None` for a pinhole.
    f_number: Option<f64>,
}

/// The work on a question.
struct RankingRun<'a> {
    session: &'a mut Session,
    question: &'a LensQuestion<'a>,
    /// The session's plan and pose before the first lens.
    plan: Plan,
    pose: CameraPose,
    clock: &'a FitClock,
    base: FittedModel,
    /// The f-number that suits the picture; `None` if it is sharp everywhere.
    f_number: Option<f64>,
    /// The distance of the film from the lens at the start, in millimeters.
    image: f64,
    dark: Vec<String>,
    refused: BTreeMap<String, Vec<String>>,
}

impl LensRanking {
    /// Ranks lenses for a session that has a pinhole: finds the camera, then judges each lens. The
    /// ranking takes at most half of the plan's time limit, and the best
    /// lenses by small pictures are judged by larger ones first.
    ///
    /// # Errors
    /// Fails if no camera can be fitted, if no lens can be judged, or if the time is over
    /// before one is.
    pub(crate) fn of(
        session: &mut Session,
        question: &LensQuestion<'_>,
        report: &mut RankingReport<'_>,
    ) -> Result<Self> {
        let begun = Instant::now();
        let (plan, pose) = (session.plan.clone(), session.pose.clone());
        let whole_limit = session.plan.stop.time;
        let limit = whole_limit.map(|limit| limit / 2);
        let clock = FitClock::new(
            limit,
            session.plan.resolution,
            session.budget.stop().clone(),
        );
        let pinhole = CameraFit::of(session)?.with_mask(question.mask.clone())?;
        let reference = Reference::find(session, question, (&pinhole, &clock));
        let Reference {
            model,
            border,
            f_number,
            ..
        } = reference.map_err(|error| if clock.is_over() { too_late() } else { error })?;
        let mut run = RankingRun {
            plan,
            pose,
            session,
            question,
            clock: &clock,
            base: model,
            f_number,
            image: pinhole.efl,
            dark: Vec::new(),
            refused: BTreeMap::new(),
        };
        clock.set_limit(limit.map(|limit| limit / 2));
        let small = run.judge_small(report);
        clock.set_limit(limit);
        let mut large = run.judge_large(&small, report);
        let unfitted = run.fit_fully(&mut large, report);
        let mut ranking = run.ranking(small, large, unfitted)?;
        let rest = whole_limit.map(|limit| limit.saturating_sub(begun.elapsed()));
        let (tried, best) = (ranking.judged.len(), &mut ranking.judged[0]);
        let values = best.best_match().values.clone();
        best.fit = best
            .fit
            .clone()
            .starting_from(values, border, tried)
            .within(rest);
        Ok(ranking)
    }

    /// Returns the fit of the camera with the best lens, from the values that it was judged at, for
    /// the time that the ranking has left.
    pub(crate) fn fit(&self) -> CameraFit {
        self.judged[0].fit.clone()
    }

    /// Returns the names of the lenses that may be as good as the best, which comes first.
    pub(crate) fn as_good(&self) -> Vec<&str> {
        let is_as_good = |lens: &&JudgedLens| self.errors_of(lens) <= APART;
        let as_good = self.judged.iter().filter(is_as_good);
        as_good.map(|lens| lens.name.as_str()).collect()
    }

    /// Returns by how many standard errors a lens is worse than the best, by full fits if both have
    /// one.
    fn errors_of(&self, lens: &JudgedLens) -> f64 {
        match (&lens.full, &self.judged[0].full) {
            (Some(full), Some(best)) => full.worse_than(best),
            _ => lens.found.worse_than(&self.by_steps),
        }
    }

    /// Writes the lenses with their residuals, which of them may be as good as the first, and which
    /// were not judged.
    ///
    /// # Errors
    /// Fails if `out` cannot be written.
    pub(crate) fn report(&self, out: &mut dyn Write) -> std::io::Result<()> {
        for (i, lens) in self.judged.iter().enumerate() {
            let errors = self.errors_of(lens);
            let words = match (i, errors > APART) {
                (0, _) => "the best".to_owned(),
                (_, true) => format!("{errors:.1} standard errors worse"),
                (_, false) => format!("may be as good ({errors:.1} standard errors worse)"),
            };
            let residual = 100.0 * lens.best_match().residual();
            let steps = if lens.full.is_some() {
                ""
            } else {
                ", by a few steps"
            };
            writeln!(
                out,
                "lens       {:20} residual {residual:5.2}%, {words}{steps}",
                lens.name
            )?;
        }
        let half = "half of `--time` was over";
        let reasons = [
            (
                "not judged",
                &self.dark,
                "they leave corners of the film dark",
            ),
            ("not judged", &self.left, half),
            (
                "not fitted",
                &self.unfitted,
                "half of `--time` was over; each may be as good",
            ),
        ];
        let refused = self.refused.iter();
        let refused = refused.map(|(reason, names)| ("not judged", names, reason.as_str()));
        for (what, names, reason) in reasons.into_iter().chain(refused) {
            if !names.is_empty() {
                writeln!(out, "{what} {}: {reason}", names.join(", "))?;
            }
        }
        let (names, all) = (self.as_good(), self.judged.len());
        match names[..] {
            [best] => {
                let others = all - 1;
                writeln!(
                    out,
                    "apart      the picture distinguishes {best} from the other {others}"
                )
            }
            _ => {
                let (count, names) = (names.len(), names.join(", "));
                writeln!(
                    out,
                    "apart      the picture does not distinguish {count} of {all} lenses: {names}"
                )
            }
        }
    }
}

impl Reference {
    /// Fits the camera with a pinhole, and with an ideal lens and its focus, and returns the one
    /// that matches better.
    fn find(
        session: &mut Session,
        question: &LensQuestion<'_>,
        (pinhole, clock): (&CameraFit, &FitClock),
    ) -> Result<Self> {
        pinhole.check_aspect(question.target)?;
        let with_pinhole = Self::fit(session, question, (pinhole, clock))?;
        if !(pinhole.focus.is_finite() && pinhole.focus > 0.0) {
            return Ok(with_pinhole);
        }
        let ideal = match question.usual.f_number {
            Some(f_number) => pinhole.with_ideal_lens(f_number),
            None => pinhole.with_ideal_lens(USUAL_F_NUMBER).with_aperture()?,
        };
        let with_lens = Self::fit(session, question, (&ideal, clock))?;
        let is_better = with_lens.residual < with_pinhole.residual;
        Ok(if is_better { with_lens } else { with_pinhole })
    }

    /// Fits the camera with a pinhole or an ideal lens, and keeps the derivatives.
    fn fit(
        session: &mut Session,
        question: &LensQuestion<'_>,
        (camera, clock): (&CameraFit, &FitClock),
    ) -> Result<Self> {
        let has_to_end = || clock.is_over();
        let fit = camera.fit(question.target, &has_to_end);
        let mut draw = |values: &[f64], size: (usize, usize), half: Half| {
            camera.draw(session, clock, values, size, half)
        };
        let (mut start, border) = camera.find_start(&fit, &mut draw)?;
        if camera.has_focus() {
            start = fit.fit_model(&start, &mut draw)?.values;
            let detail = fit.fit_detail(&start, &mut draw)?;
            let is_shown = |i: usize| detail.values[i].abs() > APART * detail.error(i);
            // A focus and an f-number that the picture does not show stay those of the start.
            if (CameraFit::FOCUS..detail.values.len()).any(is_shown) {
                start = detail.values;
            }
        }
        let model = fit.fit_model(&start, &mut draw)?;
        let judged = fit.judge(&model, Effort::Large, &model.values, &mut draw)?;
        Ok(Self {
            residual: judged.residual(),
            f_number: camera.any_f_number(&model.values),
            model,
            border,
        })
    }
}

impl RankingRun<'_> {
    /// Opens a lens at the session's start; `None` if it does not light the whole film.
    ///
    /// # Errors
    /// Fails if the lens cannot be opened or fitted.
    fn open(&mut self, name: &str) -> Result<Option<CameraFit>> {
        let focus = self.plan.focus.map_or(self.pose.focal_distance, |d| d.0);
        let mut plan = self.plan.clone();
        plan.optics = Optics::Lens(LensChoice {
            name: name.to_owned(),
            efl: Some(Mm(1.0 / (1.0 / self.image + 1e-3 / focus))),
            f_number: self.question.usual.f_number.or(match self.f_number {
                Some(_) => None, // Wide open at first.
                None => Some(SHARP_F_NUMBER),
            }),
            ..self.question.usual.clone()
        });
        self.session.change(plan, self.pose.clone())?;
        if self.session.lit_radius().is_some() {
            return Ok(None);
        }
        let mut fit = CameraFit::of(self.session)?;
        if self.question.usual.f_number.is_none() && self.f_number.is_some() {
            fit = fit.with_aperture()?;
        }
        fit.with_mask(self.question.mask.clone()).map(Some)
    }

    /// Judges a lens by small pictures; `None` if it does not light the whole film.
    fn judge_from_base(&mut self, name: &str) -> Result<Option<JudgedLens>> {
        let Some(fit) = self.open(name)? else {
            return Ok(None);
        };
        let mut start = self.base.values.clone();
        start.resize(fit.count(), 0.0);
        if let Some(f_number) = self.f_number {
            fit.set_f_number(&mut start, f_number);
        }
        let found = self.judge(&fit, Effort::Small, &start)?;
        Ok(Some(JudgedLens {
            name: name.to_owned(),
            fit,
            found,
            full: None,
        }))
    }

    /// Remembers why a lens cannot be judged, in words that are the same for others.
    fn refuse(&mut self, name: &str, error: &Diagnostic) {
        let reason = error.message.replace(&format!("`{name}` "), "");
        let names = self.refused.entry(reason).or_default();
        names.push(name.to_owned());
    }

    /// Judges a lens from start values.
    fn judge(&mut self, fit: &CameraFit, effort: Effort, values: &[f64]) -> Result<ModelMatch> {
        let (session, clock) = (&mut *self.session, self.clock);
        let has_to_end = || clock.is_over();
        let mut draw = |values: &[f64], size: (usize, usize), half: Half| {
            fit.draw(session, clock, values, size, half)
        };
        let models = fit.fit(self.question.target, &has_to_end);
        models.judge(&self.base, effort, values, &mut draw)
    }

    /// Judges every lens by small pictures, and returns them with the best first.
    fn judge_small(&mut self, report: &mut RankingReport<'_>) -> Vec<JudgedLens> {
        let names = self.question.names;
        let begun = Instant::now();
        let mut judged = Vec::new();
        for (i, name) in names.iter().enumerate() {
            // What follows takes longer by the number of pixels.
            let later = names.len() as f64 + FULL_WORK * FULLY as f64; // At least.
            let left = (names.len() - i) as f64 + self.base.enlargement() * later;
            report(name, begun.elapsed().mul_f64(left / i.max(1) as f64));
            if self.clock.is_over() {
                break;
            }
            match self.judge_from_base(name) {
                Ok(Some(lens)) => judged.push(lens),
                Ok(None) => self.dark.push((*name).to_owned()),
                Err(_) if self.clock.is_over() => break,
                Err(error) => self.refuse(name, &error),
            }
        }
        sort(&mut judged);
        judged
    }

    /// Judges lenses by larger pictures, until the time is over.
    fn judge_large(
        &mut self,
        small: &[JudgedLens],
        report: &mut RankingReport<'_>,
    ) -> Vec<JudgedLens> {
        let begun = Instant::now();
        let mut judged = Vec::new();
        for (i, lens) in small.iter().enumerate() {
            let left = (small.len() - i) as f64 + FULL_WORK * FULLY as f64;
            report(&lens.name, begun.elapsed().mul_f64(left / i.max(1) as f64));
            match self.judge(&lens.fit, Effort::Large, &lens.found.values) {
                Ok(found) => judged.push(lens.with(found)),
                Err(_) if self.clock.is_over() => break,
                Err(error) => self.refuse(&lens.name, &error),
            }
        }
        sort(&mut judged);
        judged
    }

    /// Fits the best lenses fully, and those that a few steps say are nearly as good, until the
    /// time is over. Returns the names of those that were left.
    fn fit_fully(
        &mut self,
        lenses: &mut [JudgedLens],
        report: &mut RankingReport<'_>,
    ) -> Vec<String> {
        let begun = Instant::now();
        let is_near = |lens: &JudgedLens| lens.found.worse_than(&lenses[0].found) <= FULLY_WITHIN;
        let mut count = lenses.len().min(FULLY);
        count += lenses[count..].iter().filter(|l| is_near(l)).count();
        for (i, lens) in lenses[..count].iter_mut().enumerate() {
            let left = (count - i) as f64;
            report(&lens.name, begun.elapsed().mul_f64(left / i.max(1) as f64));
            let (session, clock, fit) = (&mut *self.session, self.clock, &lens.fit);
            let has_to_end = || clock.is_over();
            let mut draw = |values: &[f64], size: (usize, usize), half: Half| {
                fit.draw(session, clock, values, size, half)
            };
            let models = fit.fit(self.question.target, &has_to_end);
            let full = models.match_detail(&self.base, &lens.found.values, &mut draw);
            match full {
                Ok(full) => lens.full = Some(full),
                Err(_) if clock.is_over() => break,
                Err(error) => self.refuse(&lens.name, &error),
            }
        }
        let is_over = self.clock.is_over();
        let is_left = |lens: &&JudgedLens| is_over && lens.full.is_none();
        let left = lenses[..count].iter().filter(is_left);
        left.map(|lens| lens.name.clone()).collect()
    }

    /// Puts the lenses together: those that were judged by large pictures, or by small ones if the
    /// time did not suffice for any large one.
    fn ranking(
        self,
        small: Vec<JudgedLens>,
        large: Vec<JudgedLens>,
        unfitted: Vec<String>,
    ) -> Result<LensRanking> {
        let mut judged = if large.is_empty() { small } else { large };
        let by_steps = judged.first().map(|best| best.found.clone());
        sort(&mut judged);
        let is_known = |name: &&&str| {
            !judged.iter().any(|lens| lens.name == **name)
                && !self.dark.iter().any(|dark| dark == **name)
                && !self
                    .refused
                    .values()
                    .flatten()
                    .any(|refused| refused == **name)
        };
        let left = self.question.names.iter().filter(is_known);
        let left: Vec<String> = left.map(|name| (*name).to_owned()).collect();
        let Some(by_steps) = by_steps else {
            return Err(match left.is_empty() {
                true => no_lens(self.refused.first_key_value()),
                false => too_late(),
            });
        };
        self.session.change(self.plan, self.pose)?;
        Ok(LensRanking {
            judged,
            by_steps,
            dark: self.dark,
            refused: self.refused,
            left,
            unfitted,
        })
    }
}

impl JudgedLens {
    fn with(&self, found: ModelMatch) -> Self {
        Self {
            name: self.name.clone(),
            fit: self.fit.clone(),
            found,
            full: None,
        }
    }

    /// Returns the match of the full fit, or that by a few steps.
    fn best_match(&self) -> &ModelMatch {
        self.full.as_ref().unwrap_or(&self.found)
    }
}

/// Puts the lens with the least residual first; those that were fitted fully come before others.
fn sort(lenses: &mut [JudgedLens]) {
    let key = |lens: &JudgedLens| (lens.full.is_none(), lens.best_match().residual());
    lenses.sort_by(|a, b| {
        let ((a_steps, a), (b_steps, b)) = (key(a), key(b));
        a_steps.cmp(&b_steps).then(a.total_cmp(&b))
    });
}

fn too_late() -> Box<Diagnostic> {
    Diagnostic::error("half of `--time` was over before a lens could be judged")
        .with_help("give more time, a smaller `--size` or fewer `--samples`")
}

fn no_lens(refused: Option<(&String, &Vec<String>)>) -> Box<Diagnostic> {
    let text = match refused {
        Some((reason, names)) => format!("no lens can be judged; {}: {reason}", names.join(", ")),
        None => "no lens can be judged: all leave the corners of the film dark".to_owned(),
    };
    Diagnostic::error(text)
        .with_help("a longer `--efl` lights a larger film, and a lens has to open to `--aperture`")
}

/// Points a session with a pinhole so that it sees what a lens of a focal length does.
///
/// # Errors
/// Fails if the scene does not compile.
pub(crate) fn with_focal_length(session: &mut Session, efl: Mm) -> Result<()> {
    let (plan, mut pose) = (session.plan.clone(), session.pose.clone());
    let focus = plan.focus.map_or(pose.focal_distance, |d| d.0);
    pose.projection = Projection::Perspective {
        height_angle: 2.0 * libm::atan(0.5 * plan.film.height / image_distance(efl.0, focus)),
    };
    session.change(plan, pose)
}
