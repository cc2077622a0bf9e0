//! Pictures that are made in parts by programs that share no memory, such as the workers of a web
//! page. A part is a region of the film; its sums go from one program to another as bytes.

use std::sync::{Mutex, PoisonError};

use ivcam_base::diag::{Diagnostic, ErrorKind, Result, Sink};
use ivcam_optics::film::{Film, Region};
use ivcam_render::render::{Exposure, Keeper, StateView, Stop, Sums, Task};

use super::plan::Plan;
use super::session::Session;

/// Keeps the sums of a part when its samples are finished.
#[derive(Default)]
struct KeptSums(Mutex<Option<Vec<u8>>>);

impl Keeper for KeptSums {
    fn is_stopped(&self) -> bool {
        false
    }

    fn is_due(&self) -> bool {
        false
    }

    fn keep(&self, state: &StateView<'_, '_>) {
        let mut bytes = Vec::new();
        let written = state.write(&mut bytes).ok().map(|()| bytes);
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = written;
    }
}

/// Reads the sums of a part.
fn sums_of(bytes: &[u8]) -> Result<Sums> {
    Sums::read(&mut &bytes[..], bytes.len() as u64).map_err(|e| {
        Diagnostic::error(format!("the sums of a part are damaged: {e}"))
            .of_kind(ErrorKind::Damaged)
    })
}

impl Session {
    /// Aims at the scene as it is compiled with the lens, the camera and the exposure of another
    /// plan for the same files. Parts that depend on the camera (levels of detail, billboards) stay
    /// as they are, so the picture is a preview.
    ///
    /// # Errors
    /// Returns an error if the lens cannot focus, or if the plans differ in more than that. The
    /// session is then unchanged.
    pub fn preview(&mut self, plan: Plan) -> Result<()> {
        let pose = match &plan.camera {
            Some(choice) if plan.view.is_none() => choice.pose(&mut Sink::new())?,
            None if plan.view == self.plan.view && self.plan.camera.is_none() => self.pose.clone(),
            _ => {
                return Err(Diagnostic::unsupported(
                    "the camera is found with the scene",
                ));
            }
        };
        let is_same_scene = plan.scene == self.plan.scene
            && plan.shading == self.plan.shading
            && plan.light == self.plan.light
            && plan.time == self.plan.time
            && plan.actions == self.plan.actions;
        if !is_same_scene || pose.film.is_some() || self.pose.film.is_some() {
            return Err(Diagnostic::unsupported("the scene is compiled otherwise"));
        }
        self.aim(plan, pose)
    }

    /// Adds samples to a region of the picture, up to a number per pixel. `sums` are the bytes that
    /// an earlier call returned for the region; none begins with the first sample. Returns the sums
    /// as bytes, and the film of the region, which has no estimate of its error. Uses rayon's
    /// current pool.
    ///
    /// With adaptive sampling every region makes the pilot pass of the whole picture.
    ///
    /// # Errors
    /// Fails if the sums are damaged or of another region, or if the work was canceled.
    pub fn expose_part(
        &self,
        region: Region,
        samples: u32,
        sums: Option<&[u8]>,
    ) -> Result<(Vec<u8>, Film)> {
        region.check(self.plan.resolution)?;
        let sums = sums.map(sums_of).transpose()?;
        let fits = |sums: &Sums| sums.place.region == region && sums.place.done <= samples;
        if sums.as_ref().is_some_and(|sums| !fits(sums)) {
            return Err(Diagnostic::error("the sums are those of another part"));
        }
        let kept = KeptSums::default();
        let task = Task {
            samples: Some(0..samples),
            sums,
            keepers: &[&kept],
        };
        let sampler = self.plan.pixel_sampler();
        // A part has no error of its own, so it is never the whole of what the render stops after.
        let stop = Stop::after(self.plan.stop.samples.max(samples) + 1);
        let exposure = self.with_render(sampler, stop, |r| r.run_inside(region, task, &|_| {}));
        self.budget.check()?;
        let bytes = kept.0.into_inner().unwrap_or_else(PoisonError::into_inner);
        let lost = || Diagnostic::error("the sums of the part could not be written");
        Ok((bytes.ok_or_else(lost)?, exposure.film))
    }

    /// Joins the sums of all regions, which have the same samples, and estimates the error. An
    /// exposure with all samples of the plan has the bits of [`Session::expose`], ghosts included;
    /// one with fewer has no ghosts. Uses rayon's current pool.
    ///
    /// # Errors
    /// Fails if the sums are damaged, or are not those of the whole picture.
    pub fn join_parts<'a>(&self, parts: impl IntoIterator<Item = &'a [u8]>) -> Result<Exposure> {
        let parts: Vec<Sums> = parts.into_iter().map(sums_of).collect::<Result<_>>()?;
        let gap = || Diagnostic::error("the parts are not those of one whole picture");
        let first = parts.first().ok_or_else(gap)?;
        let (whole, samples) = (self.region(), first.place.done);
        let pixels = |sums: &Sums| sums.place.region.resolution().pixels();
        let is_part = |sums: &Sums| sums.place.is_even() && sums.place.done == samples;
        let sum: usize = parts.iter().map(pixels).sum();
        if !parts.iter().all(is_part) || sum != whole.resolution().pixels() {
            return Err(gap());
        }
        let mut sums = first.on(whole);
        parts[1..].iter().for_each(|part| sums.lay(part));
        let task = Task {
            sums: Some(sums),
            ..Task::default()
        };
        let (sampler, stop) = (self.plan.pixel_sampler(), Stop::after(samples));
        let exposure = match samples >= self.plan.stop.samples {
            true => self.expose_task(task, &|_| {}),
            false => self.with_render(sampler, stop, |r| r.run_inside(whole, task, &|_| {})),
        };
        self.budget.check()?;
        Ok(exposure)
    }
}
