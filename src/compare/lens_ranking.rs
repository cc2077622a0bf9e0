//! Which of the shipped lenses an archival picture may have been taken with.

use std::io::Write;
use std::time::Instant;

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::math::Mm;
use ivcam_compare::Plate;
use ivcam_compare::fit::ModelMatch;
use ivcam_inventor::pose::Projection;
use ivcam_optics::lens::shipped_names;

use super::camera_fit::CameraFit;
use crate::photo::{LensChoice, Optics, Session};

/// The name that stands for every shipped lens.
pub(crate) const ANY: &str = "any";
/// The number of standard errors up to which a lens may be as good as the best.
const APART: f64 = 2.0;
/// The number of lenses that are listed in any case.
const LISTED: usize = 5;

/// A lens that was tried, with the camera that suits it best.
struct TriedLens {
    choice: LensChoice,
    found: ModelMatch,
}

/// The lenses that were tried, the best first.
pub(crate) struct LensRanking {
    tried: Vec<TriedLens>,
    /// Lenses that could not be tried, each with the reason.
    refused: Vec<(&'static str, Box<Diagnostic>)>,
    /// The number of lenses that the time did not suffice for.
    left: usize,
}

impl LensRanking {
    /// Tries every shipped lens at the focal length of the session's lens, with its other choices:
    /// fits the camera by small pictures, and ranks the lenses by the residuals. `report` is called
    /// with the name and the share of the work that is done. Half of the plan's time limit is kept
    /// for the fit that follows; lenses that are left then are not tried.
    ///
    /// # Errors
    /// Fails if no lens can be tried.
    pub(crate) fn of(
        session: &mut Session,
        target: &Plate,
        report: &mut dyn FnMut(&str, f64),
    ) -> Result<Self> {
        let (plan, pose) = (session.plan.clone(), session.pose.clone());
        let Optics::Lens(usual) = &plan.optics else {
            return Err(Diagnostic::error("no lens is to be found"));
        };
        let names: Vec<_> = shipped_names().collect();
        let (begun, limit) = (Instant::now(), plan.stop.time.map(|time| time / 2));
        let stop = session.budget.stop().clone();
        let mut left = 0;
        let (mut tried, mut refused) = (Vec::<TriedLens>::new(), Vec::new());
        for (i, name) in names.iter().copied().enumerate() {
            if stop.is_set() || limit.is_some_and(|limit| begun.elapsed() > limit) && i > 0 {
                left = names.len() - i;
                break;
            }
            report(name, i as f64 / names.len() as f64);
            let choice = LensChoice {
                name: name.to_owned(),
                ..usual.clone()
            };
            let mut plan = plan.clone();
            plan.optics = Optics::Lens(choice.clone());
            let best = tried
                .iter()
                .min_by(|a, b| a.found.residual().total_cmp(&b.found.residual()));
            let near = best.map(|best| best.found.values.as_slice());
            let judged = session
                .change(plan, pose.clone())
                .and_then(|()| CameraFit::of(session)?.judge(session, target, near));
            match judged {
                Ok(found) => tried.push(TriedLens { choice, found }),
                Err(error) => refused.push((name, error)),
            }
        }
        tried.sort_by(|a, b| a.found.residual().total_cmp(&b.found.residual()));
        if let Some(best) = tried.first() {
            let mut plan = plan;
            plan.optics = Optics::Lens(best.choice.clone());
            session.change(plan, pose)?;
            return Ok(Self {
                tried,
                refused,
                left,
            });
        }
        let (_, error) = refused.swap_remove(0);
        Err(error)
    }

    /// Writes the best lenses with their residuals, and which of them may be as good as the first.
    ///
    /// # Errors
    /// Fails if `out` cannot be written.
    pub(crate) fn report(&self, out: &mut dyn Write) -> std::io::Result<()> {
        let best = &self.tried[0];
        let mut left_out = 0;
        for (i, lens) in self.tried.iter().enumerate() {
            let worse = lens.found.worse_than(&best.found);
            let is_apart = worse > APART;
            if is_apart && i >= LISTED {
                left_out += 1;
                continue;
            }
            let words = match (i, is_apart) {
                (0, _) => "the best".to_owned(),
                (_, true) => format!("{worse:.1} standard errors worse"),
                (_, false) => format!("may be as good ({worse:.1} standard errors worse)"),
            };
            let residual = 100.0 * lens.found.residual();
            let name = &lens.choice.name;
            writeln!(
                out,
                "lens       {name:20} residual {residual:5.2}%, {words}"
            )?;
        }
        if left_out > 0 {
            writeln!(out, "           {left_out} others match worse")?;
        }
        if self.left > 0 {
            let left = self.left;
            writeln!(out, "           {left} were not tried: the time was over")?;
        }
        for (name, error) in &self.refused {
            writeln!(out, "           {name} was not tried: {}", error.message)?;
        }
        Ok(())
    }
}

/// Returns the focal length of a lens that sees what the camera of a session's scene sees, for a
/// film; `None` for an orthographic camera.
pub(crate) fn focal_length_of(session: &Session) -> Option<Mm> {
    match session.pose.projection {
        Projection::Perspective { height_angle } => Some(Mm(
            0.5 * session.plan.film.height / libm::tan(0.5 * height_angle)
        )),
        Projection::Orthographic { .. } => None,
    }
}
