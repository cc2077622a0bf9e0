//! `ivcam [flags] scene.iv` and `ivcam render`: from words to a picture and its report.

use std::ffi::OsString;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::ArgMatches;

use super::{flags, parsed, tell, tell_all, text};
use crate::diag::{Diagnostic, Result, Sink};
use crate::photo::options::{MovieFrame, Needs, command_line, idle_options};
use crate::photo::{Era, Plan, Session, picture_name};
use crate::picture::{PictureFormat, write_whole};
use crate::render::report::RenderReport;
use crate::render::{Exposure, Progress};

/// Where a picture and its report go, how much is said, and on how many threads it is made.
pub(crate) struct OutputOptions {
    pub output: PathBuf,
    pub report: Option<PathBuf>,
    pub threads: usize,
    pub quiet: bool,
}

impl OutputOptions {
    pub(crate) fn of(m: &ArgMatches) -> Result<Self> {
        let output = output(m);
        PictureFormat::of(&output)?;
        writable(&output)?;
        let options = Self::to(m, output)?;
        if let Some(report) = &options.report {
            writable(report)?;
            if *report == options.output {
                return Err(Diagnostic::error("the report has the picture's own name")
                    .in_file(report.display().to_string())
                    .with_help("give `--report` another name, such as report.json"));
            }
        }
        Ok(options)
    }

    /// The same for a movie, whose name does not end as a picture's.
    pub(crate) fn of_movie(m: &ArgMatches) -> Result<Self> {
        Self::to(m, PathBuf::from(text(m, "output").unwrap_or_default()))
    }

    fn to(m: &ArgMatches, output: PathBuf) -> Result<Self> {
        Ok(Self {
            output,
            report: text(m, "report").map(PathBuf::from),
            threads: threads(m)?,
            quiet: m.get_flag("quiet"),
        })
    }

    /// Runs on this many threads.
    pub(crate) fn on_threads<T: Send>(&self, work: impl FnOnce() -> T + Send) -> Result<T> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(self.threads)
            .build();
        let pool = pool.map_err(|e| {
            Diagnostic::error(format!("cannot start {} threads: {e}", self.threads))
        })?;
        Ok(pool.install(work))
    }
}

/// Where the picture goes: what `-o` says, else a name made of the scene's.
pub(crate) fn output(m: &ArgMatches) -> PathBuf {
    let scene = Path::new(text(m, "scene").unwrap_or_default());
    text(m, "output").map_or_else(|| picture_name(scene), PathBuf::from)
}

/// Threads to use: all cores, unless said otherwise.
pub(crate) fn threads(m: &ArgMatches) -> Result<usize> {
    let here = std::thread::available_parallelism().map_or(1, usize::from);
    let count = |w: &str| w.parse().ok().filter(|n| (1..=1024).contains(n));
    let threads = parsed(m, "threads", "a number of threads from 1 to 1024", count)?;
    if let Some(many) = threads.filter(|many| *many > here) {
        let text = format!("`--threads {many}`: there are {here} cores, and more do not go faster");
        tell(&Diagnostic::warning(text));
    }
    Ok(threads.unwrap_or(here))
}

/// Whether a file can come to be there, asked before hours of work and not after.
pub(crate) fn writable(path: &Path) -> Result<()> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        return Err(
            Diagnostic::not_found(format!("there is no folder `{}`", folder.display()))
                .in_file(path.display().to_string()),
        );
    }
    if path.is_dir() {
        return Err(
            Diagnostic::error(format!("`{}` is a folder", path.display()))
                .with_help("give the output the name of a file"),
        );
    }
    Ok(())
}

/// The plan that the words ask for.
pub(crate) fn plan(m: &ArgMatches, era: Era) -> Result<Plan> {
    changed(m, era, Plan::of_era, None)
}

/// The plan that the words ask for, for the window.
#[cfg(any(feature = "viewer", all(test, feature = "panels")))]
pub(crate) fn window_plan(m: &ArgMatches, era: Era) -> Result<Plan> {
    changed(m, era, Plan::for_window, None)
}

/// The plan that the words ask for, for pictures that are frames of a movie.
pub(crate) fn movie_plan(m: &ArgMatches, era: Era, frame: MovieFrame) -> Result<Plan> {
    changed(m, era, Plan::of_era, Some(frame))
}

/// The plan that the words make of the one to start from.
fn changed(
    m: &ArgMatches,
    era: Era,
    start: fn(Era, PathBuf) -> Plan,
    frame: Option<MovieFrame>,
) -> Result<Plan> {
    let mut words = flags::words(m);
    words.frame = frame;
    let scene = text(m, "scene").unwrap_or_default();
    let mut sink = Sink::new();
    let plan = Plan::from_words(&words, era, |era| start(era, scene.into()), &mut sink);
    tell_all(&sink);
    plan
}

/// Renders and writes the picture; the exit code.
pub(crate) fn run(matches: &ArgMatches, era: Era, words: &[OsString]) -> Result<i32> {
    let options = OutputOptions::of(matches)?;
    let session = Session::open(plan(matches, era)?)?;
    tell_all(&session.sink);
    if session.pose.film.is_some() && !session.plan.solids {
        let idle = [Needs::Camera, Needs::Lens, Needs::Prescription];
        let idle = idle_options(&flags::words(matches), &idle, "with the lens in the scene");
        idle.iter().for_each(|warning| tell(warning));
    }
    tell_headlight(&session, options.quiet);
    if !options.quiet {
        let choices: Vec<String> = session
            .described
            .iter()
            .map(|(k, v)| format!("{k} {v}"))
            .collect();
        super::say!("{}", choices.join(", "));
    }
    let meter = Meter::new(options.quiet);
    let exposure = options.on_threads(|| session.expose(&|p| meter.show(p)))?;
    meter.clear();
    warn_of_shortfall(&session, &exposure);

    if exposure.counts.passed == 0 {
        let none = Diagnostic::warning("no ray got through to the scene: the picture is black");
        tell(&none.with_help("the film may be too large for the lens, or the lens closed"));
    }

    let clock = Instant::now();
    let picture = session.develop(&exposure, &command_line(words));
    picture.save(&options.output, session.plan.depth)?;
    let mut report = session.report(&exposure);
    report.picture = options.output.display().to_string();
    report.seconds.write = clock.elapsed().as_secs_f64();
    report.total_seconds = report.seconds.total();
    report_on(&options, &report)?;
    Ok(0)
}

/// Says that the headlight is on without being asked for.
pub(crate) fn tell_headlight(session: &Session, quiet: bool) {
    if let Some(line) = session.headlight_notice().filter(|_| !quiet) {
        super::say!("{line}");
    }
}

/// Warns if the target error was not reached.
fn warn_of_shortfall(session: &Session, exposure: &Exposure) {
    let reached = exposure.film.relative_rmse();
    let Some((limit, error)) = session.plan.stop.error.zip(reached) else {
        return;
    };
    if error > limit {
        let ended_by = if exposure.samples >= session.plan.stop.samples {
            "the number of samples"
        } else {
            "the time"
        };
        let said = format!(
            "the relative error is {:.3}%, not the {:.3}% asked for: {ended_by} ended the render",
            100.0 * error,
            100.0 * limit
        );
        let more = f64::from(exposure.samples) * (error / limit) * (error / limit);
        let help = format!("about {more:.0} samples a pixel reach it");
        let mut sink = Sink::new();
        sink.add(*Diagnostic::warning(said).with_help(help));
        tell_all(&sink);
    }
}

fn report_on(options: &OutputOptions, report: &RenderReport) -> Result<()> {
    if !options.quiet {
        super::say!("{}", report.line());
    }
    let Some(path) = &options.report else {
        return Ok(());
    };
    let text = serde_json::to_string_pretty(report)
        .map_err(|e| Diagnostic::error(format!("the report cannot be written: {e}")))?;
    write_whole(path, |file| writeln!(file, "{text}"))
}

/// The progress line, on a terminal only.
struct Meter {
    bar: indicatif::ProgressBar,
}

impl Meter {
    fn new(quiet: bool) -> Self {
        let bar = if quiet || !std::io::stderr().is_terminal() {
            indicatif::ProgressBar::hidden()
        } else {
            indicatif::ProgressBar::new(1)
        };
        if let Ok(style) = indicatif::ProgressStyle::with_template(
            "{bar:30} {percent}%  {elapsed}  {eta} left  {msg}",
        ) {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        Self { bar }
    }

    fn show(&self, progress: Progress) {
        self.bar.set_length(progress.tiles);
        self.bar.set_position(progress.tiles_done);
        if let Some(error) = progress.error {
            self.bar
                .set_message(format!("{} spp  relRMSE {error:.2e}", progress.samples));
        }
    }

    fn clear(&self) {
        self.bar.finish_and_clear();
    }
}
