//! The renderer's thread, which receives orders and sends news. The window never waits for it.
//!
//! A new order ends the pass that is running, between two tiles. A panic ends only the work that it
//! occurred in; it is sent as news, and the next order starts from the plan. Pictures are saved by
//! threads of their own, from the plan alone, so that they are equal to those of a batch run.

use std::any::Any;
use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};

use glam::DVec3;
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_optics::picture::PictureFormat;

use super::archive::{AlignedArchive, AlignmentJob};
use super::autofocus::{Focused, focus_at};
use super::files::check_output;
use super::live::{Live, LiveFrame, Request};
use super::saving::Saving;
use super::setup::Setup;
use super::view::{DepthMap, FocalSurface};
use crate::photo::headlight::HeadlightSources;
use crate::photo::{Plan, Session};

/// An order of the window.
pub enum EngineOrder {
    /// Open a scene; the old one is kept if it cannot be opened.
    Open(Box<Plan>),
    /// Focus on a place of the picture, from 0 to 1.
    FocusAt(f64, f64),
}

/// News of the renderer.
pub enum News {
    /// A scene was opened.
    Opened(Box<Opened>),
    /// A scene cannot be opened.
    NotOpened(PathBuf, Box<Diagnostic>),
    /// A new picture of a request, which may be refined by later ones.
    Frame(Box<LiveFrame>),
    /// The distances in the picture, and the surface of sharp focus.
    Depths(Arc<DepthMap>, Option<FocalSurface>),
    /// The request cannot be shown, for example because the lens cannot focus there. The picture is
    /// kept.
    Refused(u64, Box<Diagnostic>),
    /// Autofocus has ended; `None` if there is no surface at the place.
    Focused(Option<Focused>),
    /// The archival picture that was loaded as this one has been aligned.
    Aligned(u64, Result<AlignedArchive>),
    /// A picture was saved in a file. The text is the line that a batch run would print.
    Saved(PathBuf, String),
    /// A picture cannot be saved in a file.
    NotSaved(PathBuf, Box<Diagnostic>),
    /// The renderer panicked with this message.
    Panicked(String),
}

/// A scene that was opened.
pub struct Opened {
    /// The plan, and the pose of its camera.
    pub setup: Setup,
    /// The messages about the scene.
    pub messages: Vec<Diagnostic>,
    /// The bounding box of the scene as `viewAll` sees it, in meters.
    pub bounds: Option<(DVec3, DVec3)>,
    /// The files that the scene names, such as textures.
    pub files: Vec<PathBuf>,
    /// Whether the pose was made up for the lens, because the scene has no camera.
    pub is_framed: bool,
    pub(crate) headlight: HeadlightSources,
    /// See [`Session::headlight_notice`].
    pub notice: Option<&'static str>,
}

#[derive(Default)]
struct Inbox {
    orders: VecDeque<EngineOrder>,
    /// The last request; earlier ones are replaced.
    show: Option<Request>,
    refine: bool,
    quit: bool,
}

#[derive(Default)]
struct SharedState {
    inbox: Mutex<Inbox>,
    bell: Condvar,
    /// Whether an order waits, so that the running pass is to end.
    hurry: AtomicBool,
}

impl SharedState {
    fn lock(&self) -> MutexGuard<'_, Inbox> {
        self.inbox.lock().unwrap_or_else(|e| e.into_inner())
    }
}

/// The window's handle of the renderer's thread.
pub struct Engine {
    shared: Arc<SharedState>,
    news: Receiver<News>,
    sender: Sender<News>,
    threads: usize,
    wake: Arc<dyn Fn() + Send + Sync>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Engine {
    /// Starts the thread; `wake` is called when there is news.
    ///
    /// # Errors
    /// Fails if threads cannot be started.
    pub fn start(threads: usize, wake: Arc<dyn Fn() + Send + Sync>) -> Result<Self> {
        let (sender, news) = channel();
        let shared = Arc::new(SharedState::default());
        shared.lock().refine = true;
        let mut worker = EngineWorker {
            shared: shared.clone(),
            sender: sender.clone(),
            wake: wake.clone(),
            pool: pool(threads)?,
            live: None,
            mapped: 0,
        };
        let thread = std::thread::Builder::new().name("renderer".into());
        let thread = thread
            .spawn(move || worker.run())
            .map_err(|e| Diagnostic::error(format!("cannot start the renderer: {e}")))?;
        Ok(Self {
            shared,
            news,
            sender,
            threads,
            wake,
            thread: Some(thread),
        })
    }

    /// Adds an order to those that wait.
    pub fn order(&self, order: EngineOrder) {
        self.tell(|inbox| inbox.orders.push_back(order));
    }

    /// Requests a picture in place of the last request.
    pub fn show(&self, request: Request) {
        self.tell(|inbox| inbox.show = Some(request));
    }

    /// Sets whether the picture is refined. Setting the same value again does not end the running
    /// pass.
    pub(crate) fn refine(&self, on: bool) {
        if self.shared.lock().refine != on {
            self.tell(|inbox| inbox.refine = on);
        }
    }

    fn tell(&self, change: impl FnOnce(&mut Inbox)) {
        let mut inbox = self.shared.lock();
        change(&mut inbox);
        self.shared.hurry.store(true, Ordering::Relaxed);
        self.shared.bell.notify_one();
    }

    /// Returns the news since the last call.
    pub fn news(&self) -> Vec<News> {
        self.news.try_iter().collect()
    }

    /// Aligns an archival picture with the live one.
    pub(crate) fn align(&self, job: AlignmentJob) {
        let (sender, wake, threads) = (self.sender.clone(), self.wake.clone(), self.threads);
        std::thread::spawn(move || {
            let version = job.version;
            let run = AssertUnwindSafe(|| pool(threads)?.install(|| job.run()));
            let aligned = catch_unwind(run);
            let aligned =
                aligned.unwrap_or_else(|cause| Err(Diagnostic::error(panic_message(&*cause))));
            let _ = sender.send(News::Aligned(version, aligned));
            wake();
        });
    }

    /// Renders and writes the picture of a plan, as a batch run does.
    pub(crate) fn save(&self, setup: Setup, saving: Arc<Saving>) {
        let (sender, wake, threads) = (self.sender.clone(), self.wake.clone(), self.threads);
        let budget = setup.plan.budget().stopped_by(saving.stop());
        std::thread::spawn(move || {
            let output = saving.path.clone();
            let save = || budget.during(|| save(&setup, &saving, threads));
            let made = catch_unwind(AssertUnwindSafe(save));
            let made = made.unwrap_or_else(|cause| Err(Diagnostic::error(panic_message(&*cause))));
            let _ = sender.send(match made {
                Ok(line) => News::Saved(output, line),
                Err(error) => News::NotSaved(output, error),
            });
            wake();
        });
    }
}

impl Drop for Engine {
    fn drop(&mut self) {
        self.tell(|inbox| inbox.quit = true);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn pool(threads: usize) -> Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| Diagnostic::error(format!("cannot start {threads} threads: {e}")))
}

fn save(setup: &Setup, saving: &Saving, threads: usize) -> Result<String> {
    let output = &saving.path;
    PictureFormat::of(output)?;
    let session = Session::open(setup.plan.clone())?;
    check_output(output, &session.document.opened_files())?;
    let exposure = pool(threads)?.install(|| session.expose(&|p| saving.note(p.work_done, p.work)));
    session.budget.check()?;
    let picture = session.develop(&exposure, &setup.command(output));
    picture.save(output, session.plan.depth)?;
    let mut report = session.report(&exposure);
    report.set_error(session.error_of(&picture, exposure.film.error()));
    report.picture = output.display().to_string();
    report.total_seconds = report.seconds.total();
    Ok(report.line())
}

/// Returns the message of a panic.
fn panic_message(cause: &(dyn Any + Send)) -> String {
    let message = cause
        .downcast_ref::<&str>()
        .map(|s| (*s).to_owned())
        .or_else(|| cause.downcast_ref::<String>().cloned());
    format!(
        "the renderer stopped: {}",
        message.unwrap_or_else(|| "no reason given".into())
    )
}

/// The state of the thread.
struct EngineWorker {
    shared: Arc<SharedState>,
    sender: Sender<News>,
    wake: Arc<dyn Fn() + Send + Sync>,
    pool: rayon::ThreadPool,
    live: Option<Live>,
    /// The serial number of the request whose distances were sent.
    mapped: u64,
}

/// The next task of the thread.
enum EngineTask {
    Order(EngineOrder),
    Show(Box<Request>),
    Refine,
}

impl EngineWorker {
    fn run(&mut self) {
        while let Some(task) = self.next() {
            let done = catch_unwind(AssertUnwindSafe(|| self.work(task)));
            if let Err(cause) = done {
                // The session may be inconsistent, so it is opened again.
                let plan = self.live.take().map(|live| live.setup().plan.clone());
                self.tell(News::Panicked(panic_message(&*cause)));
                let again =
                    catch_unwind(AssertUnwindSafe(|| plan.and_then(|p| Live::open(&p).ok())));
                // Refinement waits for the next request, so that the same panic does not repeat.
                self.live = again.ok().flatten();
                self.mapped = 0;
            }
        }
    }

    /// Returns an order, or else the request to be shown, or else refinement. Waits if there is
    /// none.
    fn next(&mut self) -> Option<EngineTask> {
        let shared = self.shared.clone();
        let mut inbox = shared.lock();
        loop {
            if inbox.quit {
                return None;
            }
            if let Some(order) = inbox.orders.pop_front() {
                shared
                    .hurry
                    .store(!inbox.orders.is_empty(), Ordering::Relaxed);
                return Some(EngineTask::Order(order));
            }
            shared.hurry.store(false, Ordering::Relaxed);
            if let Some(request) = inbox.show.take() {
                return Some(EngineTask::Show(Box::new(request)));
            }
            let shown = self.live.as_ref().is_some_and(|l| l.request().serial > 0);
            if shown && (inbox.refine || self.mapped != self.serial()) {
                return Some(EngineTask::Refine);
            }
            inbox = shared.bell.wait(inbox).unwrap_or_else(|e| e.into_inner());
        }
    }

    fn serial(&self) -> u64 {
        self.live.as_ref().map_or(0, |l| l.request().serial)
    }

    fn tell(&self, news: News) {
        let _ = self.sender.send(news);
        (self.wake)();
    }

    fn work(&mut self, task: EngineTask) {
        match task {
            EngineTask::Order(EngineOrder::Open(plan)) => self.open(&plan),
            EngineTask::Order(EngineOrder::FocusAt(x, y)) => {
                let found = match &mut self.live {
                    Some(live) => self.pool.install(|| focus_at(live, x, y)),
                    None => None,
                };
                self.tell(News::Focused(found));
            }
            EngineTask::Show(request) => self.show(*request),
            EngineTask::Refine => self.refine(),
        }
    }

    fn open(&mut self, plan: &Plan) {
        match self.pool.install(|| Live::open(plan)) {
            Ok(live) => {
                let opened = Opened {
                    setup: live.setup().clone(),
                    messages: live.session().sink.items().to_vec(),
                    bounds: live.session().inventor_bounds(),
                    files: live.session().document.opened_files(),
                    is_framed: plan.camera.is_none() && live.session().scene_pose(plan).is_none(),
                    headlight: live.session().headlight_sources,
                    notice: live.session().headlight_notice(),
                };
                self.live = Some(live);
                self.mapped = 0;
                self.tell(News::Opened(Box::new(opened)));
            }
            Err(error) => self.tell(News::NotOpened(plan.scene.clone(), error)),
        }
    }

    fn show(&mut self, request: Request) {
        let serial = request.serial;
        let Some(live) = &mut self.live else { return };
        if let Err(error) = live.show(request) {
            return self.tell(News::Refused(serial, error));
        }
        // The first frame is rendered even if orders wait; otherwise a fast wheel would show none.
        if let Some(frame) = self.pool.install(|| live.step(&|| true)) {
            self.tell(News::Frame(Box::new(frame)));
        }
    }

    fn refine(&mut self) {
        let Some(live) = &mut self.live else { return };
        let shared = self.shared.clone();
        let proceed = move || !shared.hurry.load(Ordering::Relaxed);
        if self.mapped != live.request().serial {
            let view = live.view().clone();
            let depths = self.pool.install(|| view.depths(&proceed));
            // A request that arrived in the meantime has a map of its own.
            let Some(depths) = depths.filter(|_| proceed()) else {
                return;
            };
            let surface = view.lens_camera().map(FocalSurface::of);
            self.mapped = live.request().serial;
            return self.tell(News::Depths(Arc::new(depths), surface));
        }
        if let Some(frame) = self.pool.install(|| live.step(&proceed)) {
            self.tell(News::Frame(Box::new(frame)));
        }
    }
}
