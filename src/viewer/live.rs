//! The picture that refines as you look: small at once, then whole, then better without end.
//!
//! It is made by `render` as a batch picture is, a pass at a time, and differs from it in two
//! choices: exposure is applied where the picture is shown, and the scene stays as compiled while
//! the camera moves.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::diag::Result;
use crate::film::{ErrorEstimate, Film, Resolution};
use crate::photo::{Optics, Plan, Session};
use crate::render::tile::Tile;
use crate::render::{Counts, Render, Stop};
use crate::sampling::FilterTable;
use crate::shade::Shading;

use super::draft::{self, Preview};
use super::setup::Setup;
use super::view::View;

/// The time that rays of a first frame may take: of the 50 ms to a first frame, what the lens,
/// the window and a loaded machine leave.
const FIRST: Duration = Duration::from_millis(16);
/// Film rays a second until a scene has been measured.
const GUESS: f64 = 150_000.0;
/// Samples a pixel added in one pass at most.
const LONGEST_PASS: u32 = 16;
/// How long the camera must stand before the scene is compiled anew around it.
const STANDING: Duration = Duration::from_millis(600);

/// What the window wants to see.
#[derive(Clone, Debug)]
pub(crate) struct Asked {
    pub setup: Setup,
    pub preview: Preview,
    /// Counts what was asked.
    pub serial: u64,
    /// When.
    pub at: Instant,
}

/// The picture so far.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    /// Of what was asked.
    pub serial: u64,
    pub resolution: Resolution,
    /// Exposures at exposure 1, rows from the top.
    pub pixels: Vec<[f32; 3]>,
    /// What shutter, ISO and aperture multiply the exposures by; 1 without a metering.
    pub metered: f64,
    /// Whether it has all its pixels.
    pub whole: bool,
    pub samples: u32,
    pub error: Option<ErrorEstimate>,
    pub counts: Counts,
    /// Rays from the film a second.
    pub rate: f64,
    /// From asking to here.
    #[cfg_attr(
        not(feature = "tools"),
        expect(dead_code, reason = "`measure latency` reads it")
    )]
    pub latency: Duration,
    pub view: Arc<View>,
}

/// A film that is being exposed.
struct Exposing {
    resolution: Resolution,
    /// Of the picture's sides.
    divisor: u32,
    tiles: Vec<Tile>,
    film: Film,
    samples: u32,
    counts: Counts,
}

impl Exposing {
    fn new(whole: Resolution, divisor: u32) -> Self {
        let side = |n: u32| n.div_ceil(divisor);
        let resolution = Resolution {
            width: side(whole.width),
            height: side(whole.height),
        };
        Self {
            resolution,
            divisor,
            tiles: Tile::all(resolution),
            film: Film::new(resolution),
            samples: 0,
            counts: Counts::default(),
        }
    }
}

/// A session on screen.
pub(crate) struct Live {
    session: Session,
    asked: Asked,
    view: Arc<View>,
    exposing: Exposing,
    /// Film rays a second, measured.
    rate: f64,
}

impl Live {
    /// Opens a plan's scene. The lens comes with the first [`Live::show`], so that one that can't
    /// focus there does not keep the scene away.
    ///
    /// # Errors
    /// A scene that can't be read or compiled, or a camera file without a camera.
    pub(crate) fn open(plan: &Plan) -> Result<Self> {
        let mut bare = plan.clone();
        bare.optics = Optics::Pinhole;
        bare.shading = compiled_for(plan.shading);
        let session = Session::open(bare)?;
        let setup = Setup {
            plan: plan.clone(),
            pose: session.pose.clone(),
        };
        let asked = Asked {
            setup,
            preview: Preview::Lens,
            serial: 0,
            at: Instant::now(),
        };
        Ok(Self {
            view: Arc::new(view(&session, &asked)),
            exposing: Exposing::new(plan.resolution, 1),
            rate: GUESS,
            session,
            asked,
        })
    }

    pub(crate) fn setup(&self) -> &Setup {
        &self.asked.setup
    }

    pub(crate) fn session(&self) -> &Session {
        &self.session
    }

    pub(crate) fn view(&self) -> &Arc<View> {
        &self.view
    }

    pub(crate) fn asked(&self) -> &Asked {
        &self.asked
    }

    /// Starts on what is asked for. The old picture stays where it can't be made.
    ///
    /// # Errors
    /// A lens that can't be opened or can't focus there.
    pub(crate) fn show(&mut self, asked: Asked) -> Result<()> {
        let plan = &asked.setup.plan;
        let before = self.asked.setup.clone();
        self.session.aim(as_shown(plan), asked.setup.pose.clone())?;
        let compiled = |plan: &Plan| (plan.time, plan.resolution, compiled_for(plan.shading));
        if compiled(plan) != compiled(&before.plan)
            && let Err(fault) = self.session.compile(compiled_for(plan.shading))
        {
            let _ = self.session.aim(as_shown(&before.plan), before.pose);
            return Err(fault);
        }
        self.view = Arc::new(view(&self.session, &asked));
        self.exposing = Exposing::new(plan.resolution, self.first_divisor(plan.resolution));
        self.asked = asked;
        Ok(())
    }

    /// The least reduction whose rays fit into a first frame.
    fn first_divisor(&self, whole: Resolution) -> u32 {
        let affordable = self.rate * FIRST.as_secs_f64();
        (1..64)
            .find(|d| whole.pixels() as f64 / f64::from(d * d) <= affordable)
            .unwrap_or(64)
    }

    /// One more pass, unless `goes_on` says no. Uses rayon's current pool.
    pub(crate) fn step(&mut self, goes_on: &(dyn Fn() -> bool + Sync)) -> Option<Frame> {
        self.compile_where_it_stands();
        let exposing = &mut self.exposing;
        if exposing.samples > 0 && exposing.divisor > 1 {
            *exposing = Exposing::new(self.view.resolution, exposing.divisor / 2);
        }
        let done = exposing.samples;
        let end = done + done.clamp(1, LONGEST_PASS);
        let clock = Instant::now();
        let render = Render {
            shader: &self.session.shader(),
            camera: &self.view.camera,
            sampler: self.session.plan.sampler,
            resolution: exposing.resolution,
            exposure: 1.0,
            stop: Stop::after(end),
            filter: &FilterTable::new(self.session.plan.filter),
            adaptive: false,
        };
        let counts = render.pass(&exposing.tiles, &mut exposing.film, done..end, &|_| {
            goes_on()
        })?;
        let seconds = clock.elapsed().as_secs_f64().max(1e-6);
        let rate = (counts.film_rays + counts.error_rays) as f64 / seconds;
        self.rate = if self.rate == GUESS {
            rate
        } else {
            0.7 * self.rate + 0.3 * rate
        };
        exposing.counts.add(&counts);
        exposing.samples = end;
        Some(self.frame())
    }

    /// Once the camera stands still, the scene is compiled around it, as a batch render does, if
    /// that was quick before: levels of detail and billboards then look at this camera.
    fn compile_where_it_stands(&mut self) {
        let away = !self.session.is_compiled_from_here();
        let quick = self.session.seconds.compile < 0.3;
        if !(away && quick && self.exposing.divisor == 1 && self.asked.at.elapsed() > STANDING) {
            return;
        }
        // What compiled before from elsewhere and does not now stays as it was.
        let shading = compiled_for(self.asked.setup.plan.shading);
        if self.session.compile(shading).is_ok() {
            self.view = Arc::new(view(&self.session, &self.asked));
            self.exposing = Exposing::new(self.view.resolution, 1);
        }
    }

    fn frame(&self) -> Frame {
        let film = &self.exposing.film;
        Frame {
            serial: self.asked.serial,
            resolution: film.resolution,
            pixels: film
                .pixels
                .iter()
                .map(|p| p.mean.as_vec3().to_array())
                .collect(),
            metered: self.session.exposure_factor(),
            whole: self.exposing.divisor == 1,
            samples: self.exposing.samples,
            error: film.error(),
            counts: self.exposing.counts,
            rate: self.rate,
            latency: self.asked.at.elapsed(),
            view: self.view.clone(),
        }
    }

    /// Aims somewhere else for a moment, as focusing does.
    pub(super) fn with_focus<T>(
        &mut self,
        meters: f64,
        work: impl FnOnce(&Session) -> T,
    ) -> Option<T> {
        let mut setup = self.asked.setup.clone();
        setup.set_focus(meters);
        self.session.aim(as_shown(&setup.plan), setup.pose).ok()?;
        let made = work(&self.session);
        let setup = self.asked.setup.clone();
        let _ = self.session.aim(as_shown(&setup.plan), setup.pose);
        Some(made)
    }
}

/// The shading that a scene is compiled for: one that needs all that others do, but for models that
/// need other shapes.
fn compiled_for(shading: Shading) -> Shading {
    if shading.needs().facets {
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

fn view(session: &Session, asked: &Asked) -> View {
    let pose = session.pose.clone();
    View {
        camera: draft::camera(&session.camera, &pose, session.scene.origin, asked.preview),
        scene: session.scene.clone(),
        pose,
        resolution: session.plan.resolution,
    }
}
