//! The live picture: coarse at first, then at the resolution of the view, then refined without end.
//!
//! It is rendered as a batch picture is, a pass at a time, with two differences: the exposure
//! factor is applied when the picture is shown, and the scene is not recompiled while the camera
//! moves.

use std::sync::Arc;
use std::time::{Duration, Instant};

use ivcam_base::diag::Result;
use ivcam_optics::film::{ErrorEstimate, ErrorUnknown, Film, Region, Resolution};
use ivcam_optics::sampling::FilterTable;
use ivcam_render::render::{Counts, Render, Stop};
use ivcam_render::shade::Shading;

use super::draft::{self, Preview};
use super::setup::Setup;
use super::view::SceneView;
use crate::photo::{Optics, Plan, PointerScene, Session};

/// The time for the rays of a first frame: the part of 50 ms that the lens, the window and a busy
/// machine leave.
const FIRST: Duration = Duration::from_millis(16);
/// Film rays per second, assumed before a scene has been measured.
const GUESS: f64 = 150_000.0;
/// The largest number of samples per pixel added in one pass. It bounds the time between two
/// frames.
const LONGEST_PASS: u32 = 16;
/// The longest time of a pass that adds more than one sample per pixel, in seconds. Large views are
/// slow, and a longer pass would hide the progress.
const PATIENCE: f64 = 1.0;
/// The time that the camera must be still before the scene is recompiled around it, and a studio
/// metered.
const STANDING: Duration = Duration::from_millis(600);

/// The number of lit pixels, of the eight around a black one, from which a channel is filled. At
/// the edge of a shape before a black background, most pixels have fewer around them.
const FILLED_FROM: usize = 6;

/// A request of the window for a picture.
#[derive(Clone, Debug)]
pub struct Request {
    /// The photograph to be shown.
    pub setup: Setup,
    /// The camera that shows it.
    pub preview: Preview,
    /// The pixels of the view; the plan's own resolution if `None`.
    pub resolution: Option<Resolution>,
    /// The serial number of the request.
    pub serial: u64,
    /// The time of the request.
    pub at: Instant,
}

/// The picture so far, for display.
#[derive(Clone, Debug)]
pub struct LiveFrame {
    /// The serial number of the request.
    pub serial: u64,
    /// The size in pixels.
    pub resolution: Resolution,
    /// Exposures at exposure 1, rows from the top.
    pub pixels: Vec<[f32; 3]>,
    /// The factor on exposures from shutter, ISO and aperture, and from the meter; 1 without them.
    pub metered: f64,
    /// The factor that `--exposure` would have to be given for what the meter chose; 1 without it.
    pub auto_exposure: f64,
    /// Whether it has the resolution of the view.
    pub whole: bool,
    /// Samples per pixel.
    pub samples: u32,
    /// The last estimate of the error, or why it is unknown.
    pub error: std::result::Result<ErrorEstimate, ErrorUnknown>,
    /// The rays that were traced for it.
    pub counts: Counts,
    /// Rays from the film per second.
    pub rate: f64,
    /// The time from the request to this frame.
    pub latency: Duration,
    /// The scene and the camera that it shows.
    pub view: Arc<SceneView>,
}

/// A film that is being exposed.
struct Exposing {
    resolution: Resolution,
    /// The divisor of the picture's sides.
    divisor: u32,
    film: Film,
    samples: u32,
    /// The last estimate of the error, and the number of samples at which it was made.
    error: (std::result::Result<ErrorEstimate, ErrorUnknown>, u32),
    counts: Counts,
}

impl Exposing {
    fn new(whole: Resolution, divisor: u32) -> Self {
        let side = |n: u32| n.div_ceil(divisor);
        let resolution = Resolution::of(side(whole.width), side(whole.height));
        Self {
            resolution,
            divisor,
            film: Film::new(resolution),
            samples: 0,
            error: (Err(ErrorUnknown::NotMeasured), 0),
            counts: Counts::default(),
        }
    }
}

/// A session on screen.
pub(crate) struct Live {
    session: Session,
    request: Request,
    view: Arc<SceneView>,
    /// The scene as the pointer searches it, at the time of the request.
    pointer: Option<Arc<PointerScene>>,
    exposing: Exposing,
    /// The measured number of film rays per second.
    rate: f64,
    /// The serial number of the request that the exposure is metered for.
    metered: u64,
}

impl Live {
    /// Opens a plan's scene. The lens is opened with the first [`Live::show`], so that the scene is
    /// shown even if the lens cannot focus.
    ///
    /// # Errors
    /// Fails if the scene cannot be read or compiled, or a camera file has no camera.
    pub(crate) fn open(plan: &Plan) -> Result<Self> {
        let mut bare = plan.clone();
        bare.optics = Optics::Pinhole;
        bare.metering = None; // a pinhole has no aperture that exposes
        bare.shading = compiled_for(plan.shading);
        let session = Session::open_framed(bare, plan)?;
        let setup = Setup {
            plan: plan.clone(),
            pose: session.pose.clone(),
            as_shown: false,
        };
        let request = Request {
            setup,
            preview: Preview::Lens,
            resolution: None,
            serial: 0,
            at: Instant::now(),
        };
        let pointer = session.pointer_scene().map(Arc::new);
        Ok(Self {
            view: Arc::new(view(&session, &request, &pointer)),
            pointer,
            exposing: Exposing::new(plan.resolution, 1),
            rate: GUESS,
            metered: 0,
            session,
            request,
        })
    }

    /// Returns the setup of the current request.
    pub(crate) fn setup(&self) -> &Setup {
        &self.request.setup
    }

    /// Returns the session that renders.
    pub(crate) fn session(&self) -> &Session {
        &self.session
    }

    /// Returns the view for queries of the current picture.
    pub(crate) fn view(&self) -> &Arc<SceneView> {
        &self.view
    }

    /// Returns the current request.
    pub(crate) fn request(&self) -> &Request {
        &self.request
    }

    /// Starts a request. The old picture is kept if it fails.
    ///
    /// # Errors
    /// Fails if the lens cannot be opened or focused.
    pub(crate) fn show(&mut self, mut request: Request) -> Result<()> {
        let before = self.request.setup.clone();
        let world = |plan: &Plan| (plan.time, plan.actions.clone());
        let plays = world(&request.setup.plan) != world(&before.plan);
        // The scene's own camera may move with time, and an `Anchor` may lead to another one.
        if plays && request.setup.plan.camera.is_none() {
            let own = self.session.scene_pose(&request.setup.plan);
            request.setup.pose = own.unwrap_or(request.setup.pose);
        }
        let plan = &request.setup.plan;
        self.session
            .aim(as_shown(plan), request.setup.pose.clone())?;
        let compiled = |plan: &Plan| {
            let shading = compiled_for(plan.shading);
            (world(plan), plan.resolution, shading, plan.light.clone())
        };
        if compiled(plan) != compiled(&before.plan)
            && let Err(fault) = self.session.compile(compiled_for(plan.shading))
        {
            let _ = self.session.aim(as_shown(&before.plan), before.pose);
            return Err(fault);
        }
        if plays {
            self.pointer = self.session.pointer_scene().map(Arc::new);
        }
        self.view = Arc::new(view(&self.session, &request, &self.pointer));
        let whole = self.view.resolution;
        self.exposing = Exposing::new(whole, self.first_divisor(whole));
        let is_first = self.request.serial == 0;
        self.request = request;
        if is_first {
            self.meter();
        }
        Ok(())
    }

    /// Returns the smallest divisor whose rays fit into a first frame.
    fn first_divisor(&self, whole: Resolution) -> u32 {
        let affordable = self.rate * FIRST.as_secs_f64();
        (1..64)
            .find(|d| whole.pixels() as f64 / f64::from(d * d) <= affordable)
            .unwrap_or(64)
    }

    /// Returns the number of samples after the next pass: twice as many as before, within
    /// [`PATIENCE`].
    fn samples_after_pass(&self) -> u32 {
        let done = self.exposing.samples;
        let affordable = self.rate * PATIENCE / self.exposing.resolution.pixels() as f64;
        done + done.min(affordable as u32).clamp(1, LONGEST_PASS)
    }

    /// Renders one more pass, or returns `None` if `proceed` returned false. Uses rayon's current
    /// pool.
    pub(crate) fn step(&mut self, proceed: &(dyn Fn() -> bool + Sync)) -> Option<LiveFrame> {
        if self.exposing.divisor == 1 && self.request.at.elapsed() > STANDING {
            self.recompile_if_away();
            self.meter();
        }
        if self.exposing.samples > 0 && self.exposing.divisor > 1 {
            self.exposing = Exposing::new(self.view.resolution, self.exposing.divisor / 2);
        }
        let (done, end) = (self.exposing.samples, self.samples_after_pass());
        let exposing = &mut self.exposing;
        let clock = Instant::now();
        let render = Render {
            shader: &self.session.shader(),
            camera: &self.view.camera,
            sampler: self.session.plan.pixel_sampler(),
            resolution: exposing.resolution,
            exposure: 1.0,
            stop: Stop::after(end),
            filter: &FilterTable::new(self.session.plan.filter),
            adaptive: false,
            team: None,
            lamps: None,
        };
        // An abandoned pass leaves some tiles with other samples than the rest, so it gets a copy.
        let whole = Region::whole(exposing.resolution);
        let mut film = exposing.film.clone();
        let counts = render.pass(whole, &mut film, done..end, &|_| proceed())?;
        exposing.film = film;
        let seconds = clock.elapsed().as_secs_f64().max(1e-6);
        let rate = (counts.film_rays + counts.error_rays) as f64 / seconds;
        self.rate = if self.rate == GUESS {
            rate
        } else {
            0.7 * self.rate + 0.3 * rate
        };
        exposing.counts.add(&counts);
        exposing.samples = end;
        // The error of a single sample is not shown, and later it is estimated after half as many
        // more samples: the estimates take a tenth of the time at most.
        let is_due = end > 1 && 2 * end >= 3 * exposing.error.1;
        if is_due && proceed() {
            let (squared_error, counts) = render.measure(&exposing.film, whole, false);
            exposing.film.squared_error = squared_error;
            exposing.counts.add(&counts);
            exposing.error = (exposing.film.error(), end);
        }
        Some(self.frame())
    }

    /// Meters the exposure for the present request, once, if it is metered.
    fn meter(&mut self) {
        if self.metered != self.request.serial {
            self.metered = self.request.serial;
            self.session.meter();
        }
    }

    /// Recompiles the scene around the camera, as a batch render does, if compiling is fast. Levels
    /// of detail and billboards then suit this camera.
    fn recompile_if_away(&mut self) {
        let quick = self.session.seconds.compile < 0.3;
        if self.session.is_compiled_from_here() || !quick {
            return;
        }
        // A scene that cannot be recompiled is kept.
        let shading = compiled_for(self.request.setup.plan.shading);
        if self.session.compile(shading).is_ok() {
            self.view = Arc::new(view(&self.session, &self.request, &self.pointer));
            self.exposing = Exposing::new(self.view.resolution, 1);
        }
    }

    fn frame(&self) -> LiveFrame {
        let film = &self.exposing.film;
        let means = film.pixels.iter().map(|p| p.mean.as_vec3().to_array());
        let mut pixels: Vec<[f32; 3]> = means.collect();
        if self.exposing.samples == 1 {
            fill_lost(&mut pixels, film.resolution.width as usize);
        }
        LiveFrame {
            serial: self.request.serial,
            resolution: film.resolution,
            pixels,
            metered: self.session.exposure_factor(),
            auto_exposure: self.session.stated_exposure(),
            whole: self.exposing.divisor == 1,
            samples: self.exposing.samples,
            error: self.exposing.error.0,
            counts: self.exposing.counts,
            rate: self.rate,
            latency: self.request.at.elapsed(),
            view: self.view.clone(),
        }
    }

    /// Runs a function with another focus, as autofocus does.
    pub(super) fn with_focus<T>(
        &mut self,
        meters: f64,
        work: impl FnOnce(&Session) -> T,
    ) -> Option<T> {
        let mut setup = self.request.setup.clone();
        setup.set_focus(meters);
        self.session.aim(as_shown(&setup.plan), setup.pose).ok()?;
        let made = work(&self.session);
        let setup = self.request.setup.clone();
        let _ = self.session.aim(as_shown(&setup.plan), setup.pose);
        Some(made)
    }
}

/// Fills channels that are black in a single pixel with the mean of their neighbors. With one
/// sample, a channel is black if its only ray was lost in the lens, and the picture would be full
/// of black and colored dots.
fn fill_lost(pixels: &mut [[f32; 3]], width: usize) {
    let before = pixels.to_vec();
    let height = before.len() / width.max(1);
    for y in 1..height.saturating_sub(1) {
        for x in 1..width.saturating_sub(1) {
            for channel in 0..3 {
                if before[y * width + x][channel] != 0.0 {
                    continue;
                }
                let around = (y - 1..=y + 1).flat_map(|y| (x - 1..=x + 1).map(move |x| (x, y)));
                let lit = around
                    .map(|(x, y)| before[y * width + x][channel])
                    .filter(|v| *v != 0.0);
                let (count, sum) = lit.fold((0, 0.0), |(n, sum), v| (n + 1, sum + v));
                if count >= FILLED_FROM {
                    pixels[y * width + x][channel] = sum / count as f32;
                }
            }
        }
    }
}

/// Returns the shading that a scene is compiled for: one with the needs of all models, except for
/// those that need other shapes or decoded colors.
fn compiled_for(shading: Shading) -> Shading {
    if shading.needs().facets || shading == Shading::Path {
        shading
    } else {
        Shading::Recursive
    }
}

fn as_shown(plan: &Plan) -> Plan {
    Plan {
        exposure: 1.0,
        ..plan.clone()
    }
}

fn view(session: &Session, request: &Request, pointer: &Option<Arc<PointerScene>>) -> SceneView {
    let pose = session.pose.clone();
    SceneView {
        camera: draft::camera(
            &session.camera,
            &pose,
            session.scene.origin,
            request.preview,
        ),
        scene: session.scene.clone(),
        pose,
        messages: session.camera_messages(),
        pointer: pointer.clone(),
        resolution: request.resolution.unwrap_or(session.plan.resolution),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_single_black_pixels_are_filled() {
        let (lit, black) = ([0.5, 0.25, 1.0], [0.0; 3]);
        // A black dot at (1, 1), and a black half of the picture from column 4.
        let mut pixels: Vec<[f32; 3]> = (0..7 * 5)
            .map(|i| if i % 7 >= 4 || i == 8 { black } else { lit })
            .collect();
        fill_lost(&mut pixels, 7);
        assert_eq!(pixels[8], lit);
        pixels[16] = [0.5, 0.0, 1.0];
        fill_lost(&mut pixels, 7);
        assert_eq!(pixels[16], lit);
        assert!(pixels.iter().skip(4).step_by(7).all(|p| *p == black));
        fill_lost(&mut [], 0);
    }
}
