//! `ivcam [flags] scene.iv` and `ivcam render`: renders a picture and writes its report.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use clap::ArgMatches;
use ivcam_base::diag::{Diagnostic, Result, Sink};
use ivcam_base::files::{NameClaim, write_whole};
use ivcam_base::math::use_portable_arithmetic;
use ivcam_base::thread_context::ThreadContext;
use ivcam_base::work::StopCause;
use ivcam_inventor::iv::Document;
use ivcam_optics::film::{ErrorEstimate, ErrorUnknown};
use ivcam_optics::picture::{Depth, Picture, PictureFormat};
use ivcam_render::camera::{Aim, Camera};
use ivcam_render::render::report::{RenderReport, count, error_text, percent};
use ivcam_render::render::{Counts, Exposure, Keeper, Task};
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::announcement::announcement;
use super::keeping::Keeping;
use super::meter::{MeterKind, SceneMeter, waiting};
use super::outputs::{
    check_picture_space, claimed_name, is_standard_stream, keep_inputs, picture_format,
    save_picture, save_picture_rows,
};
use super::tev::TevView;
use super::{flags, parsed, print_diagnostic, print_warnings, team, text};
use crate::photo::options::{MovieFrame, OptionNeeds, command_line, idle_options};
use crate::photo::{Denoiser, Era, FurtherLayers, Plan, Session, picture_name};

/// The options of the output.
pub(crate) struct OutputOptions {
    /// The file of the picture or movie.
    pub output: PathBuf,
    /// The file of the report.
    pub report: Option<PathBuf>,
    /// The file of the picture's layers.
    pub layers: Option<PathBuf>,
    /// The layers in this file that are made only if they are asked for.
    pub further_layers: FurtherLayers,
    /// The program that denoises the picture.
    pub denoiser: Option<Denoiser>,
    /// The file that the camera in use is written to.
    pub camera: Option<PathBuf>,
    /// The number of threads to render with.
    pub threads: usize,
    /// Whether progress and summary are not printed.
    pub quiet: bool,
    /// How progress is shown.
    pub meter: MeterKind,
    /// The viewer that shows the picture while it is made.
    pub tev: Option<TevView>,
    /// Which samples are made, and where the state of the render is kept.
    pub keeping: Keeping,
    /// Whether the picture is written. A part of its samples need not be.
    pub writes_picture: bool,
    /// The claim of the picture's name, if the user has not named it.
    _claim: Option<NameClaim>,
}

impl OutputOptions {
    /// Reads the options of a picture.
    ///
    /// # Errors
    /// Returns an error if an option is invalid or if a file cannot be created.
    pub(crate) fn of(m: &ArgMatches) -> Result<Self> {
        let (output, claim) = output(m);
        picture_format(&output)?;
        let options = Self::to(m, output)?;
        Ok(Self {
            _claim: claim,
            ..options
        })
    }

    /// Reads the options of a movie, whose name has other extensions than that of a picture.
    ///
    /// # Errors
    /// Returns an error if an option is invalid.
    pub(crate) fn of_movie(m: &ArgMatches) -> Result<Self> {
        Self::to(m, PathBuf::from(text(m, "output").unwrap_or_default()))
    }

    fn to(m: &ArgMatches, output: PathBuf) -> Result<Self> {
        set_arithmetic(m)?;
        Ok(Self {
            tev: tev(m, &output)?,
            output,
            report: text(m, "report").map(PathBuf::from),
            layers: layers(m)?,
            further_layers: further_layers(m)?,
            denoiser: denoiser(m)?,
            camera: text(m, "write-camera").map(PathBuf::from),
            threads: threads(m)?,
            quiet: m.get_flag("quiet"),
            meter: meter_kind(m)?,
            writes_picture: text(m, "sample-range").is_none() || text(m, "output").is_some(),
            keeping: Keeping::of(m)?,
            _claim: None,
        })
    }

    /// Refuses to replace a file that the scene names, such as a texture.
    fn keep(&self, scene: &Document) -> Result<()> {
        let inputs = scene.opened_files();
        let report = self.report.iter().map(|path| ("--report", path));
        let camera = self.camera.iter().map(|path| ("--write-camera", path));
        let layers = self.layers.iter().map(|path| ("--aov", path));
        let checkpoint = self.keeping.path.iter().map(|path| ("--checkpoint", path));
        let outputs = std::iter::once(("--output", &self.output));
        outputs
            .chain(checkpoint)
            .chain(report)
            .chain(layers)
            .chain(camera)
            .try_for_each(|(option, path)| keep_inputs(option, path, &inputs))
    }

    /// Checks that the picture has room on its disk.
    ///
    /// # Errors
    /// Returns an error if it has not.
    fn check_space(&self, plan: &Plan) -> Result<()> {
        let region = plan.region.map(|region| region.resolution());
        let size = (region.unwrap_or(plan.resolution), plan.depth);
        let format = picture_format(&self.output)?;
        let has_no_depth = matches!(format, PictureFormat::Exr | PictureFormat::Jpeg);
        if has_no_depth && plan.depth == Depth::Sixteen {
            let output = self.output.display();
            let text = format!("`--depth 16` has no effect on `{output}`");
            let warning = Diagnostic::warning(text);
            let help =
                "a JPEG has 8 bits per channel, an EXR 32; PNG, TIFF, PPM and SGI have either";
            print_diagnostic(&warning.with_help(help));
        }
        check_picture_space(&self.output, format, size, 1)
    }

    /// Runs `work` on a pool with this number of threads.
    ///
    /// # Errors
    /// Returns an error if the threads cannot be started.
    pub(crate) fn on_threads<T: Send>(&self, work: impl FnOnce() -> T + Send) -> Result<T> {
        on_threads(self.threads, work)
    }
}

/// Runs `work` on a pool with a number of threads.
///
/// # Errors
/// Returns an error if the threads cannot be started.
pub(crate) fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> Result<T> {
    if cfg!(target_family = "wasm") {
        return Ok(work()); // Rayon works on the only thread.
    }
    let pool = pool(threads)?;
    let context = ThreadContext::current();
    Ok(pool.install(|| context.during(work)))
}

/// Returns a pool with a number of threads: that of the last call, if it has as many. The system
/// has spread its threads over the processors already, where new ones share a processor at first.
///
/// # Errors
/// Returns an error if the threads cannot be started.
fn pool(threads: usize) -> Result<Arc<ThreadPool>> {
    static LAST: Mutex<Option<Arc<ThreadPool>>> = Mutex::new(None);
    let mut last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
    let same = |pool: &&Arc<ThreadPool>| pool.current_num_threads() == threads;
    if let Some(pool) = last.as_ref().filter(same) {
        return Ok(Arc::clone(pool));
    }
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    let pool =
        pool.map_err(|e| Diagnostic::error(format!("cannot start {threads} threads: {e}")))?;
    Ok(Arc::clone(last.insert(Arc::new(pool))))
}

/// Returns the picture's file: what `-o` names, else the scene's name with `.png`, with a number
/// where that exists or is claimed, so that no picture is replaced that the user has not named.
/// A name without an ending is one of a PNG in the 1999 form.
fn output(m: &ArgMatches) -> (PathBuf, Option<NameClaim>) {
    let scene = Path::new(text(m, "scene").unwrap_or_default());
    let Some(name) = text(m, "output").map(PathBuf::from) else {
        let name = picture_name(scene);
        return match team::is_assistant() {
            true => (name, None),
            false => claimed_name(&name),
        };
    };
    match m.get_flag("batch") && name.extension().is_none() && !is_standard_stream(&name) {
        true => (name.with_extension("png"), None),
        false => (name, None),
    }
}

/// Checks the files that a render writes, and the layers in them.
///
/// # Errors
/// Returns an error if an ending or a layer is unknown, or if layers have no file.
pub(super) fn check_outputs(m: &ArgMatches) -> Result<()> {
    picture_format(&output(m).0)?;
    layers(m)?;
    further_layers(m)?;
    Ok(())
}

/// Returns the file of `--aov`.
///
/// # Errors
/// Returns an error if its ending is not `.exr`, the only format that holds layers.
fn layers(m: &ArgMatches) -> Result<Option<PathBuf>> {
    let Some(path) = text(m, "aov").map(PathBuf::from) else {
        return Ok(None);
    };
    if path
        .extension()
        .is_none_or(|e| !e.eq_ignore_ascii_case("exr"))
    {
        let message = format!("`--aov {}`: layers are written as OpenEXR", path.display());
        return Err(Diagnostic::error(message).with_help("end the name in .exr"));
    }
    Ok(Some(path))
}

/// Returns the layers of `--layers`.
///
/// # Errors
/// Returns an error if one is unknown, or if there is no file that they go to.
fn further_layers(m: &ArgMatches) -> Result<FurtherLayers> {
    let Some(words) = text(m, "layers") else {
        return Ok(FurtherLayers::default());
    };
    let layers = FurtherLayers::read(words).ok_or_else(|| {
        Diagnostic::error(format!("`--layers {words}`: unknown layers")).with_help(format!(
            "choose from {}, separated by commas",
            FurtherLayers::WORDS
        ))
    })?;
    let (problem, help) = if text(m, "aov").is_none() {
        ("they go to the file of `--aov`", "add `--aov FILE.exr`")
    } else if text(m, "sample-range").is_some() {
        let problem = "they are made of all samples, and `--sample-range` makes a part of them";
        (problem, "leave out one of the two")
    } else {
        return Ok(layers);
    };
    Err(Diagnostic::error(format!("`--layers {words}`: {problem}")).with_help(help))
}

/// Returns the denoiser of `--denoise`. Only the process that writes the picture looks for it.
///
/// # Errors
/// Returns an error if it cannot be run.
pub(crate) fn denoiser(m: &ArgMatches) -> Result<Option<Denoiser>> {
    let program = text(m, "denoise").filter(|_| !team::is_assistant());
    program
        .map(|program| Denoiser::find(Path::new(program)))
        .transpose()
}

/// Returns the connection to the viewer of `--tev`, from the process that writes the picture.
///
/// # Errors
/// Returns an error if there is no such viewer.
fn tev(m: &ArgMatches, output: &Path) -> Result<Option<TevView>> {
    let address = text(m, "tev").filter(|_| !team::is_assistant());
    let name = output.display().to_string();
    address
        .map(|address| TevView::connect(address, name))
        .transpose()
}

/// Returns how progress is shown, by `--progress` and `--quiet`.
///
/// # Errors
/// Returns an error if the value of `--progress` is unknown.
fn meter_kind(m: &ArgMatches) -> Result<MeterKind> {
    let kind = |word: &str| match word {
        "bar" if m.get_flag("quiet") => Some(MeterKind::Silent),
        "bar" => Some(MeterKind::Bar),
        "json" => Some(MeterKind::Json),
        _ => None,
    };
    let given = parsed(m, "progress", "bar or json", kind)?;
    Ok(given.or_else(|| kind("bar")).unwrap_or(MeterKind::Bar))
}

/// Obeys `--arithmetic`.
///
/// # Errors
/// Returns an error if its value is unknown.
pub(super) fn set_arithmetic(m: &ArgMatches) -> Result<()> {
    let is_portable = |word: &str| match word {
        "fast" => Some(false),
        "portable" => Some(true),
        _ => None,
    };
    if parsed(m, "arithmetic", "fast or portable", is_portable)? == Some(true) {
        use_portable_arithmetic();
    }
    Ok(())
}

/// Returns the number of threads. The default is the number of cores.
///
/// # Errors
/// Returns an error if the option is invalid.
pub(crate) fn threads(m: &ArgMatches) -> Result<usize> {
    let here = std::thread::available_parallelism().map_or(1, usize::from);
    let here = team::share_of_cores(here);
    let count = |w: &str| w.parse().ok().filter(|n| (1..=1024).contains(n));
    let threads = parsed(m, "threads", "a number of threads from 1 to 1024", count)?;
    if let Some(many) = threads.filter(|many| *many > here) {
        let text =
            format!("`--threads {many}`: there are {here} cores, and more threads are not faster");
        print_diagnostic(&Diagnostic::warning(text));
    }
    Ok(threads.unwrap_or(here))
}

/// Returns the plan that the arguments describe.
///
/// # Errors
/// Returns an error if an option is invalid.
pub(crate) fn plan(m: &ArgMatches, era: Era) -> Result<Plan> {
    changed(m, era, Plan::of_era, None)
}

/// Returns the plan that the arguments describe, for the window.
///
/// # Errors
/// Returns an error if an option is invalid.
#[cfg(any(feature = "viewer", all(test, feature = "panels")))]
pub(crate) fn window_plan(m: &ArgMatches, era: Era) -> Result<Plan> {
    let plan = changed(m, era, Plan::for_window, None)?;
    refuse_region(&plan)?;
    Ok(plan)
}

/// Returns the plan that the arguments describe, for the frames of a movie.
///
/// # Errors
/// Returns an error if an option is invalid.
pub(crate) fn movie_plan(m: &ArgMatches, era: Era, frame: MovieFrame) -> Result<Plan> {
    changed(m, era, Plan::of_era, Some(frame))
}

/// Refuses `--region` for commands that need the whole picture.
///
/// # Errors
/// Returns an error if the plan has a region.
pub(crate) fn refuse_region(plan: &Plan) -> Result<()> {
    if plan.region.is_none() {
        return Ok(());
    }
    Err(
        Diagnostic::unsupported("`--region` is for `ivcam render` and `ivcam pull-focus` only")
            .with_help("leave it out: this command needs the whole picture"),
    )
}

/// Applies the arguments to the plan that `start` returns.
fn changed(
    m: &ArgMatches,
    era: Era,
    start: fn(Era, PathBuf) -> Plan,
    frame: Option<MovieFrame>,
) -> Result<Plan> {
    let mut words = flags::given_options(m);
    words.frame = frame;
    let scene = text(m, "scene").unwrap_or_default();
    let mut sink = Sink::new();
    let plan = Plan::from_options(&words, era, |era| start(era, scene.into()), &mut sink);
    print_warnings(&sink);
    plan
}

/// Runs the command and returns the exit code.
///
/// # Errors
/// Returns an error if an option or a file is invalid, or if a file cannot be written.
pub(crate) fn run(matches: &ArgMatches, era: Era, words: &[OsString]) -> Result<i32> {
    team::run(
        || opened(matches, era),
        |options, session| finish(matches, words, &options, &session),
    )
}

/// Opens the scene of a picture that is not written here, and prints what is wrong with it. The
/// session keeps its nodes.
///
/// # Errors
/// Returns an error if an option or a file is invalid.
pub(crate) fn open(m: &ArgMatches, era: Era) -> Result<Session> {
    set_arithmetic(m)?;
    let session = Session::open(plan(m, era)?)?;
    print_warnings(&session.sink);
    print_notices(&session, m.get_flag("quiet"));
    Ok(session)
}

/// Warns of options about levels that are given for an EXR, which has exposures.
fn warn_of_exposures(m: &ArgMatches, options: &OutputOptions) -> Result<()> {
    let given = ["response", "white-balance"].map(|name| (m.contains_id(name), name));
    let given = given.into_iter().filter(|(is_given, _)| *is_given);
    let given: Vec<String> = given.map(|(_, name)| format!("`--{name}`")).collect();
    let is_exr = picture_format(&options.output)? == PictureFormat::Exr;
    if given.is_empty() || !is_exr || !options.writes_picture {
        return Ok(());
    }
    let (names, output) = (given.join(" and "), options.output.display());
    let verb = if given.len() == 1 { "is" } else { "are" };
    let text = format!("{names} {verb} only noted in `{output}`: an EXR has exposures, not levels");
    let help = format!("`ivcam expose {output} -o PICTURE.png` makes a picture with these levels");
    print_diagnostic(&Diagnostic::warning(text).with_help(help));
    Ok(())
}

/// Reads the arguments and opens the scene.
fn opened(matches: &ArgMatches, era: Era) -> Result<(OutputOptions, Session)> {
    let options = OutputOptions::of(matches)?;
    let mut plan = plan(matches, era)?;
    plan.whole_film = match picture_format(&options.output)?.has_rows() {
        _ if options.layers.is_some() => Some("`--aov`"),
        _ if options.denoiser.is_some() => Some("`--denoise`"),
        _ if options.tev.is_some() => Some("`--tev`"),
        _ if options.keeping.path.is_some() => Some("`--checkpoint`"),
        false => Some("a JPEG or SGI file"),
        true => None,
    };
    plan.layers = options.further_layers;
    options.keeping.check(&plan)?;
    let reading = format!("reading {}", plan.scene.display());
    let open = || options.on_threads(|| Session::open_once(plan));
    let mut session = waiting(options.meter, reading, open)??;
    if options.layers.is_some() || options.denoiser.is_some() {
        session.take_layers()?;
    }
    options.keeping.take_memory(&mut session)?;
    print_warnings(&session.sink);
    options.keep(&session.document)?;
    options.check_space(&session.plan)?;
    warn_of_exposures(matches, &options)?;
    Ok((options, session))
}

/// Renders the picture and writes it. Returns the exit code.
fn finish(
    matches: &ArgMatches,
    words: &[OsString],
    options: &OutputOptions,
    session: &Session,
) -> Result<i32> {
    if session.pose.film.is_some() && !session.plan.solids {
        let idle = [
            OptionNeeds::Camera,
            OptionNeeds::Lens,
            OptionNeeds::Prescription,
            OptionNeeds::Traced,
        ];
        let idle = idle_options(
            &flags::given_options(matches),
            &idle,
            "with the lens in the scene",
            "leave it out; the scene has the lens and the film as solids",
        );
        idle.iter().for_each(|warning| print_diagnostic(warning));
    }
    if let Some(path) = &options.camera {
        let text = session.camera_file()?;
        write_whole(path, |file| file.write_all(text.as_bytes()))?;
        let warning = session.focus_beyond_camera_file();
        warning.iter().for_each(|warning| print_diagnostic(warning));
    }
    print_notices(session, options.quiet);
    if !options.quiet {
        let scene = &session.plan.scene;
        super::status!("{}", announcement(scene, &session.described));
        let choices: Vec<String> = session
            .described
            .iter()
            .map(|(k, v)| match k == "exposure" && session.plan.meters {
                true => format!("{k} {v} (metered)"),
                false => format!("{k} {v}"),
            })
            .collect();
        super::print_wrapped(&choices.join(", "));
    }
    let command = command_line(words);
    let (mut report, counts, code) = match session.is_in_strips() {
        false => render_whole(session, options, &command)?,
        true => {
            let (report, counts) = render_in_strips(session, options, &command)?;
            (report, counts, 0)
        }
    };
    if options.writes_picture {
        report.picture = options.output.display().to_string();
    }
    report.total_seconds = report.seconds.total();
    report_on(options, &report)?;
    if !options.quiet {
        report_lost_rays(session, &counts);
    }
    Ok(code)
}

/// Renders the picture until a signal stops it, and writes it. Returns the report, the numbers of
/// rays and the exit code.
fn render_whole(
    session: &Session,
    options: &OutputOptions,
    command: &str,
) -> Result<(RenderReport, Counts, i32)> {
    let (sums, watch) = options.keeping.begin(session)?;
    let mut keepers: Vec<&dyn Keeper> = vec![&watch];
    if let Some(tev) = &options.tev {
        tev.begin(session.region().resolution());
        keepers.push(tev);
    }
    let task = Task {
        samples: options.keeping.samples.clone(),
        sums,
        keepers: &keepers,
    };
    let meter = SceneMeter::new(options.meter);
    let exposure = options.on_threads(|| session.expose_task(task, &|p| meter.show(p)))?;
    meter.finish(&exposure.counts, exposure.spent.seconds);
    let mut code = 0;
    match &exposure.stopped {
        None => warn_of_shortfall(session, &exposure, options.denoiser.is_some()),
        Some(stopped) => {
            let is_late = session.budget.stop().cause() == Some(StopCause::Time);
            if is_late && exposure.is_blank() {
                return Err(session.too_late());
            }
            let all = session.plan.stop.samples;
            let warning = match is_late {
                true => session.ended_within_pass(&exposure, stopped),
                false => options.keeping.interrupted(stopped, all),
            };
            print_diagnostic(&warning);
            code = if is_late { 0 } else { watch.exit_code() };
        }
    }
    let clock = Instant::now();
    let has_picture = options.writes_picture && !exposure.is_blank();
    let mut report = session.report(&exposure);
    let counts = exposure.counts;
    if has_picture {
        let writing = format!("writing {}", options.output.display());
        let write = || write_picture(session, options, exposure, command);
        report.set_error(waiting(options.meter, writing, write)?);
    }
    watch.result()?;
    if let Some(denoiser) = options.denoiser.as_ref().filter(|_| has_picture) {
        report.plan.insert("denoise".into(), denoiser.name());
        report.set_error(Err(ErrorUnknown::Denoised));
    }
    report.seconds.write = clock.elapsed().as_secs_f64();
    Ok((report, counts, code))
}

/// Writes the picture of an exposure, with its layers. Returns its error.
fn write_picture(
    session: &Session,
    options: &OutputOptions,
    exposure: Exposure,
    command: &str,
) -> Result<std::result::Result<ErrorEstimate, ErrorUnknown>> {
    let (counts, is_finished) = (exposure.counts, exposure.stopped.is_none());
    let error = exposure.film.error();
    let warn = |picture: &Picture| {
        if let Some(warning) = session.warn_without_diffraction(picture) {
            print_diagnostic(&warning);
        }
        let warning = session.warn_if_black_or_clipped(&counts, picture);
        if is_finished {
            warning.iter().for_each(|warning| print_diagnostic(warning));
            print_glow(session, options, picture);
        }
    };
    if options.layers.is_none() && options.denoiser.is_none() {
        let picture = session.develop_last(exposure, command);
        warn(&picture);
        options.on_threads(|| save(session, options, &picture))??;
        return Ok(session.error_of(&picture, error));
    }
    let picture = session.develop(&exposure, command);
    warn(&picture);
    options.on_threads(|| write_layers(session, options, &exposure, &picture))??;
    Ok(session.error_of(&picture, error))
}

/// Writes a picture to the output and shows it in tev.
fn save(session: &Session, options: &OutputOptions, picture: &Picture) -> Result<()> {
    let saved = save_picture(picture, &options.output, session.plan.depth);
    if let Some(tev) = &options.tev {
        tev.show(picture);
    }
    saved
}

/// Writes the picture, denoised if that was asked for, and its layers, which are those of the
/// picture before. If the denoiser fails, the picture is written without it.
fn write_layers(
    session: &Session,
    options: &OutputOptions,
    exposure: &Exposure,
    picture: &Picture,
) -> Result<()> {
    let surfaces = session.surfaces_of(exposure);
    let denoiser = options.denoiser.as_ref();
    match denoiser.map(|denoiser| session.denoised(picture, &surfaces, denoiser)) {
        None => save(session, options, picture)?,
        Some(Ok(clean)) => save(session, options, &clean)?,
        Some(Err(error)) => {
            save(session, options, picture)?;
            let output = options.output.display();
            return Err(error.with_help(format!("`{output}` is the picture without denoising")));
        }
    }
    match &options.layers {
        Some(path) => {
            let mut image = session.layers(exposure, picture, &surfaces);
            let warning = session.add_further_layers(exposure, &mut image)?;
            warning.iter().for_each(|warning| print_diagnostic(warning));
            image.save(path)
        }
        None => Ok(()),
    }
}

/// Renders a picture whose film does not fit into memory, and writes each strip when it is
/// finished.
fn render_in_strips(
    session: &Session,
    options: &OutputOptions,
    command: &str,
) -> Result<(RenderReport, Counts)> {
    let meter = SceneMeter::new(options.meter);
    let made = options.on_threads(|| {
        let depth = session.plan.depth;
        session.expose_in_strips(command, &|p| meter.show(p), |heading, rows| {
            save_picture_rows(&options.output, depth, heading, rows)
        })
    })??;
    let counts = made.summary.counts;
    let report = session.report_of(&made.summary);
    meter.finish(&counts, report.seconds.render);
    if let Some(warning) = session.warn_if_black_or_clipped(&counts, &made.sample) {
        print_diagnostic(&warning);
    }
    print_glow(session, options, &made.sample);
    Ok((report, counts))
}

/// Prints the session's notices.
pub(crate) fn print_notices(session: &Session, quiet: bool) {
    for line in session.notices().into_iter().filter(|_| !quiet) {
        super::status!("{line}");
    }
}

/// Says how many rays passed if fewer than half did, and which option loses none.
fn report_lost_rays(session: &Session, counts: &Counts) {
    let aimed_at_rear = matches!(session.plan.aim, Aim::RearElement(_));
    let share = counts.passed_share();
    if !matches!(session.camera, Camera::Lens(_)) || !aimed_at_rear || share >= 0.5 || share == 0.0
    {
        return;
    }
    super::status!(
        "{:.1}% of the rays passed through the lens, {} of {}; `--pupil exit` aims only where light \
         passes",
        100.0 * share,
        count(counts.passed),
        count(counts.film_rays)
    );
}

/// Prints the shading model in which the luminous shapes of a dark picture would shine.
fn print_glow(session: &Session, options: &OutputOptions, picture: &Picture) {
    let notice = session.glow_notice(picture).filter(|_| !options.quiet);
    if let Some(line) = notice {
        super::status!("{line}");
    }
}

/// Warns if the target error, which is that of the picture before denoising, was not reached.
fn warn_of_shortfall(session: &Session, exposure: &Exposure, is_denoised_later: bool) {
    let Some(limit) = session.plan.stop.error else {
        return;
    };
    let is_met = |error: ErrorEstimate| error.high <= limit;
    let ended_by = if exposure.film.error_of_samples().is_ok_and(is_met) {
        "the target without the noise of ghosts"
    } else if exposure.samples >= session.plan.stop.samples {
        "the number of samples"
    } else {
        "the time"
    };
    let target = percent(limit, 3);
    let subject = match is_denoised_later {
        true => "error before denoising",
        false => "error",
    };
    let (message, help) = match exposure.film.error() {
        Ok(error) if is_met(error) => return,
        Ok(error) => {
            let factor = error.high / limit;
            let more = f64::from(exposure.samples) * factor * factor;
            (
                format!(
                    "the relative {subject} is {}, so the target of {target} may not be met: \
                     {ended_by} ended the render",
                    error_text(&error)
                ),
                format!("about {more:.0} samples per pixel reach it"),
            )
        }
        Err(reason) => (
            format!(
                "the {subject} is unknown, so the target of {target} may not be met: {reason}; \
                 {ended_by} ended the render"
            ),
            "more samples per pixel may find what is rare".to_owned(),
        ),
    };
    let mut sink = Sink::new();
    sink.add(*Diagnostic::warning(message).with_help(help));
    print_warnings(&sink);
}

/// Prints the summary and writes the report.
fn report_on(options: &OutputOptions, report: &RenderReport) -> Result<()> {
    if !options.quiet {
        super::print_wrapped(&report.line());
    }
    let Some(path) = &options.report else {
        return Ok(());
    };
    let text = serde_json::to_string_pretty(report)
        .map_err(|e| Diagnostic::error(format!("the report cannot be written: {e}")))?;
    write_whole(path, |file| writeln!(file, "{text}"))
}
