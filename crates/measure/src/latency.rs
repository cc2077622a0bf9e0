//! Measures the latency of the window: from its start with a scene to the first frame; from a
//! change to its first frame, to the first one at the resolution of the view, and to an estimated
//! error of 2%; through the engine that the window uses.
//!
//! `cargo run --release -p measure -- latency -- SCENE...` prints a table.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use ivcam::photo::{Era, Plan};
use ivcam::viewer::draft::Preview;
use ivcam::viewer::engine::{Engine, EngineOrder, News};
use ivcam::viewer::live::{LiveFrame, Request};
use ivcam::viewer::setup::Setup;
use ivcam_base::math::Mm;
use ivcam_optics::film::Resolution;

const THREADS: usize = 2;
/// The pixels of the picture in a window of the first size, 1360x860.
const VIEW: Resolution = Resolution::of(832, 554);
/// The number of changes of each kind; their median is reported.
const TIMES: usize = 5;
/// The time after which a picture that is not at 2% is abandoned.
const PATIENCE: Duration = Duration::from_secs(90);

struct Bench {
    engine: Engine,
    serial: u64,
}

impl Bench {
    fn wait<T>(&self, until: Instant, mut take: impl FnMut(News) -> Option<T>) -> Option<T> {
        while Instant::now() < until {
            for news in self.engine.news() {
                if let Some(found) = take(news) {
                    return Some(found);
                }
            }
            std::thread::sleep(Duration::from_micros(200));
        }
        None
    }

    fn open(&self, plan: Plan) -> Option<Setup> {
        self.engine.order(EngineOrder::Open(Box::new(plan)));
        let until = Instant::now() + Duration::from_secs(300);
        self.wait(until, |news| match news {
            News::Opened(opened) => Some(Some(opened.setup)),
            News::NotOpened(_, error) => {
                eprintln!("{error}");
                Some(None)
            }
            _ => None,
        })?
    }

    /// Returns the first frame of a setup that meets a condition.
    fn frame(&mut self, setup: &Setup, wanted: impl Fn(&LiveFrame) -> bool) -> Option<LiveFrame> {
        self.serial += 1;
        let serial = self.serial;
        self.engine.show(Request {
            setup: setup.clone(),
            preview: Preview::Lens,
            resolution: Some(VIEW),
            serial,
            at: Instant::now(),
        });
        self.wait(Instant::now() + PATIENCE, |news| match news {
            News::Frame(frame) if frame.serial == serial && wanted(&frame) => Some(Some(*frame)),
            News::Refused(_, error) => {
                eprintln!("{error}");
                Some(None)
            }
            _ => None,
        })?
    }

    /// Returns the median time to the first frame, and its size, over changes of one kind.
    fn first(
        &mut self,
        setup: &mut Setup,
        change: impl Fn(&mut Setup, usize),
    ) -> Option<(f64, LiveFrame)> {
        let mut frames = Vec::new();
        for i in 0..TIMES {
            change(setup, i);
            frames.push(self.frame(setup, |_| true)?);
        }
        frames.sort_by_key(|f| f.latency);
        let middle = frames.swap_remove(TIMES / 2);
        Some((middle.latency.as_secs_f64() * 1e3, middle))
    }
}

pub(crate) fn run(arguments: Vec<String>) -> ExitCode {
    println!(
        "| scene | triangles and others | opening, ms | focus, ms | camera, ms | another lens, ms | first size | full size, s | to 2%, s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for path in arguments.into_iter().map(PathBuf::from) {
        if row(&path).is_none() {
            println!(
                "| {} | could not be measured | | | | | | | |",
                path.display()
            );
        }
    }
    ExitCode::SUCCESS
}

fn row(path: &std::path::Path) -> Option<()> {
    let mut plan = Plan::of_era(Era::Modern, path);
    if let ivcam::photo::Optics::Lens(lens) = &mut plan.optics {
        lens.efl = Some(Mm(20.0));
    }
    let began = Instant::now();
    let engine = Engine::start(THREADS, Arc::new(|| ())).ok()?;
    let mut bench = Bench { engine, serial: 0 };
    let mut setup = bench.open(plan)?;
    let far = setup.focus().min(1e3);
    setup.set_focus(far);
    bench.frame(&setup, |_| true)?;
    let opening = began.elapsed().as_secs_f64() * 1e3;
    // The engine measures the speed of the scene first.
    bench.frame(&setup, |f| f.whole)?;
    let (focus, frame) = bench.first(&mut setup, |s, i| {
        s.set_focus(far * (0.9 + 0.02 * i as f64))
    })?;
    let (camera, _) = bench.first(&mut setup, |s, _| {
        let mut pose = s.pose.clone();
        pose.position += 0.01 * far * pose.direction();
        s.set_pose(&pose);
    })?;
    let names = [
        "tessar",
        "biogon",
        "double-gauss",
        "telephoto",
        "wide-angle",
    ];
    let mut own = setup.clone();
    let (lens, _) = bench.first(&mut setup, |s, i| s.choose_lens(names[i]))?;
    let whole = bench.frame(&own, |f| f.whole)?.latency.as_secs_f64();
    own.set_focus(1.01 * far);
    let good = bench.frame(&own, |f| {
        f.whole && f.error.is_ok_and(|e| e.relative_rmse <= 0.02)
    });
    let good = good.map_or(format!("> {}", PATIENCE.as_secs()), |f| {
        format!("{:.1}", f.latency.as_secs_f64())
    });
    let (triangles, quadrics, strokes) = frame.view.scene.primitives();
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let size = frame.resolution;
    println!(
        "| {name} | {} | {opening:.0} | {focus:.0} | {camera:.0} | {lens:.0} | {}x{} | {whole:.1} | {good} |",
        triangles + quadrics + strokes,
        size.width,
        size.height
    );
    Some(())
}
