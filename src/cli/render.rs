//! `ivcam [flags] scene.iv` and `ivcam render`: from words to a picture and its report.

use std::ffi::OsString;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::ArgMatches;

use super::{parsed, tell, tell_all, text};
use crate::camera::Aim;
use crate::diag::{Diagnostic, Result, Sink};
use crate::film::{FilmFormat, Metering, Resolution, Response};
use crate::lens::{Coating, FocusMethod, Iris, Movements};
use crate::math::{LengthUnit, Meters, Mm, parse_length};
use crate::picture::{Depth, PictureFormat, write_whole};
pub use crate::plan::command_line;
use crate::plan::{Era, Headlight, IdealChoice, LensChoice, Optics, Plan, Session, picture_name};
use crate::render::report::RenderReport;
use crate::render::{Exposure, Progress, Stop};
use crate::sampling::{DiscMap, Filter, Sampler, SamplerKind};
use crate::shade::Shading;

/// What a render says and where it goes, beside the plan.
pub struct Talk {
    pub output: PathBuf,
    pub report: Option<PathBuf>,
    pub threads: usize,
    pub quiet: bool,
}

impl Talk {
    pub fn of(m: &ArgMatches) -> Result<Self> {
        let output = output(m);
        PictureFormat::of(&output)?;
        writable(&output)?;
        let talk = Self::to(m, output)?;
        if let Some(report) = &talk.report {
            writable(report)?;
            if *report == talk.output {
                return Err(Diagnostic::error("the report has the picture's own name")
                    .in_file(report.display().to_string())
                    .with_help("give `--report` another name, such as report.json"));
            }
        }
        Ok(talk)
    }

    /// Of a film, whose name may end otherwise than a picture's.
    pub fn of_film(m: &ArgMatches) -> Result<Self> {
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
    pub fn on_threads<T: Send>(&self, work: impl FnOnce() -> T + Send) -> Result<T> {
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
pub fn output(m: &ArgMatches) -> PathBuf {
    let scene = Path::new(text(m, "scene").unwrap_or_default());
    text(m, "output").map_or_else(|| picture_name(scene), PathBuf::from)
}

/// Threads to use: all cores, unless said otherwise.
pub fn threads(m: &ArgMatches) -> Result<usize> {
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
pub fn writable(path: &Path) -> Result<()> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        return Err(
            Diagnostic::error(format!("there is no folder `{}`", folder.display()))
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
pub fn plan(m: &ArgMatches, era: Era) -> Result<Plan> {
    changed(m, era, Plan::of_era, None)
}

/// The same for the window.
pub fn window_plan(m: &ArgMatches, era: Era) -> Result<Plan> {
    changed(m, era, Plan::for_window, None)
}

/// The same for pictures that are frames of a film.
pub fn plan_of(m: &ArgMatches, era: Era, frame: Option<Frame>) -> Result<Plan> {
    changed(m, era, Plan::of_era, frame)
}

/// The plan that the words make of the one to start from.
fn changed(
    m: &ArgMatches,
    era: Era,
    start: fn(Era, String) -> Plan,
    frame: Option<Frame>,
) -> Result<Plan> {
    let eras = [
        ("1999", Era::Vintage),
        ("vintage", Era::Vintage),
        ("modern", Era::Modern),
    ];
    let era = named(m, "era", &eras)?.unwrap_or(era);
    let mut plan = start(era, text(m, "scene").unwrap_or_default().to_owned());
    plan.camera = text(m, "camera").map(PathBuf::from);
    plan.environment = text(m, "environment").map(PathBuf::from);
    plan.optics = optics(m)?;
    plan.focus = parsed(
        m,
        "focus",
        "a distance greater than 0, such as 1.2 or 40cm",
        distance,
    )?;
    plan.search = m
        .get_many("search")
        .into_iter()
        .flatten()
        .cloned()
        .collect();
    plan.fonts = super::fonts(m)?;
    plan.limits = super::limits(m)?;
    let maps = [
        ("polar", DiscMap::Polar),
        ("concentric", DiscMap::Concentric),
    ];
    let old_map = if era == Era::Vintage {
        DiscMap::Polar
    } else {
        DiscMap::Concentric
    };
    let map = named(m, "disc", &maps)?;
    let rear = Aim::RearElement(map.unwrap_or(old_map));
    if map.is_some() && matches!(plan.aim, Aim::RearElement(_)) {
        plan.aim = rear;
    }
    set(
        &mut plan.aim,
        named(m, "pupil", &[("rear", rear), ("exit", Aim::ExitPupil)])?,
    );
    set(
        &mut plan.dispersion,
        named(m, "dispersion", &[("on", true), ("off", false)])?,
    );
    set(
        &mut plan.sampler.kind,
        named(m, "sampler", &SamplerKind::ALL)?,
    );
    set(&mut plan.filter, named(m, "filter", &Filter::ALL)?);
    plan.adaptive = m.get_flag("adaptive");
    if plan.adaptive {
        can_adapt(&plan.sampler)?;
    }
    let count = |w: &str| w.parse().ok().filter(|n| (1..=1 << 24).contains(n));
    set(
        &mut plan.sampler.samples,
        parsed(m, "samples", "a number from 1 to 2^24", count)?,
    );
    set(
        &mut plan.sampler.seed,
        parsed(m, "seed", "a whole number", |w| w.parse().ok())?,
    );
    plan.stop = stop(m, plan.sampler.samples)?;
    let models = "a shading model: f, n, a, d, p, g or r";
    set(
        &mut plan.shading,
        parsed(m, "shading", models, Shading::named)?,
    );
    set(
        &mut plan.headlight,
        parsed(m, "headlight", "on or off", headlight)?,
    );
    set(
        &mut plan.film,
        parsed(m, "film", "a film size such as 36x24", film_size)?,
    );
    plan.movements = movements(m)?;
    if let Some((width, height)) = parsed(m, "size", "a size such as 360x240", pair::<u32>)? {
        plan.resolution = Resolution::new(width, height)?;
    }
    set(
        &mut plan.exposure,
        parsed(m, "exposure", POSITIVE, positive)?,
    );
    set(
        &mut plan.diffraction,
        named(m, "diffraction", &[("on", true), ("off", false)])?,
    );
    plan.ghosts = named(m, "ghosts", &[("on", true), ("off", false)])?.unwrap_or(false);
    plan.metering = metering(m, frame)?;
    if let Some(words) = text(m, "response") {
        plan.response = Response::open(words)?;
    }
    set(
        &mut plan.depth,
        named(m, "depth", &[("8", Depth::Eight), ("16", Depth::Sixteen)])?,
    );
    let depth = |w: &str| w.parse().ok().filter(|n| *n <= 10_000);
    plan.max_depth = parsed(m, "max-depth", "a number from 0 to 10000", depth)?;
    plan.solids = m.get_flag("solids");
    plan.handles = m.get_flag("handles");
    set(
        &mut plan.time,
        parsed(m, "scene-time", "a time in seconds", finite)?,
    );
    Ok(plan)
}

/// A film's frame: its time, and the part of it that the shutter is open.
#[derive(Clone, Copy)]
pub struct Frame {
    pub seconds: f64,
    pub open: f64,
}

/// How long a shutter is open: a time, or a part of a film's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shutter {
    Seconds(f64),
    Part(f64),
}

impl Shutter {
    /// `1/60`, `0.5s`, `20ms`; `0.5` of a frame, or `180deg` of a film camera's turning shutter.
    fn parse(word: &str) -> Option<Self> {
        let part = |part: f64| (0.0..=1.0).contains(&part).then_some(Self::Part(part));
        let bare = word.trim_end_matches('s');
        if let Some((over, under)) = bare.split_once('/') {
            return Some(Self::Seconds(positive(over)? / positive(under)?));
        }
        if let Some(degrees) = word.strip_suffix("deg") {
            return part(finite(degrees)? / 360.0);
        }
        match lasting(word) {
            Some(time) => Some(Self::Seconds(time.as_secs_f64())),
            None => part(finite(word)?),
        }
    }

    pub fn of(m: &ArgMatches) -> Result<Option<Self>> {
        let known = "a time such as 1/60 or 0.5s, nor a part of a frame such as 0.5 or 180deg";
        parsed(m, "shutter", known, Self::parse)
    }
}

/// Shutter and ISO, where a time or an ISO is given; a part of a frame alone is for the blur.
fn metering(m: &ArgMatches, frame: Option<Frame>) -> Result<Option<Metering>> {
    let iso = parsed(m, "iso", POSITIVE, positive)?;
    let white = parsed(m, "white", "a luminance in cd/m2 greater than 0", positive)?;
    let shutter = Shutter::of(m)?;
    let seconds = match (shutter, frame) {
        (Some(Shutter::Seconds(seconds)), _) => Some(seconds),
        (Some(Shutter::Part(_)), None) => {
            return Err(
                Diagnostic::error("only a film has frames to open a shutter in part of")
                    .with_help("give a time, such as `--shutter 1/60` or `--shutter 0.5s`"),
            );
        }
        (_, Some(frame)) if iso.is_some() => Some(frame.open * frame.seconds),
        _ => None,
    };
    let asked = iso.is_some() || white.is_some();
    let Some(seconds) = seconds.filter(|s| *s > 0.0) else {
        return if asked {
            Err(
                Diagnostic::error("`--iso` and `--white` need an open shutter")
                    .with_help("give its time, such as `--shutter 1/60`"),
            )
        } else {
            Ok(None)
        };
    };
    let plain = Metering::new(seconds);
    Ok(Some(Metering {
        iso: iso.unwrap_or(plain.iso),
        white: white.unwrap_or(plain.white),
        ..plain
    }))
}

/// Fewer jittered samples than were laid out leave parts of pixel and pupil out.
fn can_adapt(sampler: &Sampler) -> Result<()> {
    if sampler.kind != SamplerKind::Jittered {
        return Ok(());
    }
    let name = sampler.kind.name();
    Err(Diagnostic::error(format!(
        "`--adaptive` does not go with the sampler `{name}`"
    ))
    .with_help("choose one whose every beginning is even: `--sampler sobol`"))
}

fn set<T>(slot: &mut T, value: Option<T>) {
    if let Some(value) = value {
        *slot = value;
    }
}

/// Samples a pixel at most, where error or time are to end a render.
const MOST_SAMPLES: u32 = 65_536;

fn stop(m: &ArgMatches, samples: u32) -> Result<Stop> {
    let mut stop = Stop::after(samples);
    stop.error = parsed(
        m,
        "target-error",
        "a relative error such as 1% or 0.01",
        share,
    )?;
    stop.time = parsed(
        m,
        "time",
        "a length of time such as 30s, 500ms or 2m",
        lasting,
    )?;
    if (stop.error.is_some() || stop.time.is_some()) && text(m, "samples").is_none() {
        stop.samples = MOST_SAMPLES;
    }
    Ok(stop)
}

fn share(word: &str) -> Option<f64> {
    match word.strip_suffix('%') {
        Some(percent) => positive(percent.trim()).map(|p| p / 100.0),
        None => positive(word),
    }
}

fn lasting(word: &str) -> Option<Duration> {
    let units = [("ms", 1e-3), ("s", 1.0), ("m", 60.0), ("h", 3600.0)];
    let (number, unit) = units
        .iter()
        .find_map(|(name, unit)| Some((word.strip_suffix(name)?, *unit)))?;
    Duration::try_from_secs_f64(positive(number.trim())? * unit).ok()
}

fn optics(m: &ArgMatches) -> Result<Optics> {
    let name = text(m, "lens").unwrap_or("wide-angle");
    if name == "none" {
        tell_idle(m, &OF_A_LENS, "without a lens");
        return Ok(Optics::Pinhole);
    }
    if name == "ideal" {
        return ideal(m);
    }
    let mut lens = LensChoice::named(name);
    set(&mut lens.zoom, parsed(m, "zoom", POSITIVE, positive)?);
    lens.efl = parsed(m, "efl", "a focal length such as 20mm", focal_length)?;
    if let (Some(efl), true) = (lens.efl, text(m, "zoom").is_some()) {
        let whole = efl.0 * lens.zoom;
        let both = format!(
            "`--efl` and `--zoom` both scale the lens: it becomes {} mm",
            (whole * 1e3).round() / 1e3
        );
        tell(&Diagnostic::warning(both));
    }
    let position = |w: &str| w.parse().ok();
    lens.zoom_position = parsed(
        m,
        "zoom-position",
        "a position of the zoom, from 0",
        position,
    )?;
    set(
        &mut lens.iris,
        parsed(m, "blades", "3 to 64 blades, such as 6 or 6@15", blades)?,
    );
    lens.coating = named(m, "coating", &Coating::ALL)?;
    lens.f_number = parsed(m, "aperture", "an f-number such as f/8", f_number)?;
    let methods = [
        ("film", FocusMethod::Film),
        ("lens", FocusMethod::Lens),
        ("group", FocusMethod::Group),
        ("best", FocusMethod::Best),
    ];
    set(&mut lens.method, named(m, "focus-method", &methods)?);
    let files = m.get_many("glass-catalogue");
    lens.catalogues = files.into_iter().flatten().cloned().collect();
    Ok(Optics::Lens(lens))
}

/// A lens without faults, wide open at f/2 and of 50 mm unless said otherwise.
fn ideal(m: &ArgMatches) -> Result<Optics> {
    let heard = ["efl", "aperture", "focus"];
    let idle: Vec<&str> = OF_A_LENS
        .into_iter()
        .filter(|f| !heard.contains(f))
        .collect();
    tell_idle(m, &idle, "with an ideal lens");
    let mut choice = IdealChoice::default();
    let efl = parsed(m, "efl", "a focal length such as 20mm", focal_length)?;
    set(&mut choice.efl, efl);
    let number = parsed(m, "aperture", "an f-number such as f/8", f_number)?;
    set(&mut choice.f_number, number);
    Ok(Optics::Ideal(choice))
}

fn movements(m: &ArgMatches) -> Result<Movements> {
    let mut moved = Movements::default();
    let turn = |word: &str| {
        let degrees = finite(word.trim_end_matches("deg"))?;
        (degrees.abs() < 90.0).then(|| degrees.to_radians())
    };
    let an_angle = "an angle in degrees, less than 90, such as 8 or -5";
    set(&mut moved.tilt, parsed(m, "tilt", an_angle, turn)?);
    set(&mut moved.swing, parsed(m, "swing", an_angle, turn)?);
    let length = |word: &str| {
        let length = parse_length(word, LengthUnit::Millimeter)?;
        length.0.is_finite().then_some(length.0)
    };
    let a_length = "a length in millimeters, such as 8 or -5mm";
    set(&mut moved.rise, parsed(m, "rise", a_length, length)?);
    set(&mut moved.shift, parsed(m, "shift", a_length, length)?);
    let radius = |word: &str| match word {
        "flat" => Some(None),
        _ => length(word).filter(|r| *r != 0.0).map(Some),
    };
    let a_radius = "a length in millimeters other than 0, or flat";
    set(
        &mut moved.film_radius,
        parsed(m, "film-radius", a_radius, radius)?,
    );
    Ok(moved)
}

/// Flags that say something about a lens.
const OF_A_LENS: [&str; 9] = [
    "focus",
    "zoom",
    "efl",
    "aperture",
    "zoom-position",
    "blades",
    "focus-method",
    "pupil",
    "disc",
];

/// Says which of the flags given do nothing.
pub fn tell_idle(m: &ArgMatches, flags: &[&str], where_: &str) {
    let given = |f: &&&str| text(m, f).is_some();
    let idle: Vec<String> = flags
        .iter()
        .filter(given)
        .map(|f| format!("`--{f}`"))
        .collect();
    if let Some((last, rest)) = idle.split_last() {
        let (list, verb) = match rest {
            [] => (last.clone(), "does"),
            _ => (format!("{} and {last}", rest.join(", ")), "do"),
        };
        tell(&Diagnostic::warning(format!(
            "{where_}, {list} {verb} nothing"
        )));
    }
}

/// `f/8`, `F8` or `8`.
pub fn f_number(word: &str) -> Option<f64> {
    let bare = word.trim_start_matches(['f', 'F']).trim_start_matches('/');
    positive(bare)
}

const POSITIVE: &str = "a number greater than 0";

fn finite(word: &str) -> Option<f64> {
    word.parse().ok().filter(|x: &f64| x.is_finite())
}

fn positive(word: &str) -> Option<f64> {
    finite(word).filter(|x| *x > 0.0)
}

fn distance(word: &str) -> Option<Meters> {
    parse_length(word, LengthUnit::Meter)
        .filter(|l| l.0 > 0.0)
        .map(Meters::from)
}

fn focal_length(word: &str) -> Option<Mm> {
    parse_length(word, LengthUnit::Millimeter).filter(|l| l.0 > 0.0 && l.0.is_finite())
}

/// `6` blades, or `6@15`: turned by 15 degrees.
fn blades(word: &str) -> Option<Iris> {
    let (count, turn) = word.split_once('@').unwrap_or((word, "0"));
    let count = count.parse().ok().filter(|n| (3..=64).contains(n))?;
    let rotation = finite(turn.trim_end_matches("deg"))?.to_radians();
    Some(Iris::Blades { count, rotation })
}

fn headlight(word: &str) -> Option<Headlight> {
    match word {
        "flip" => Some(Headlight::Flipped),
        "on" => Some(Headlight::Set(true)),
        "off" => Some(Headlight::Set(false)),
        _ => None,
    }
}

fn pair<T: std::str::FromStr>(word: &str) -> Option<(T, T)> {
    let (a, b) = word.split_once(['x', 'X', '×'])?;
    Some((a.trim().parse().ok()?, b.trim().parse().ok()?))
}

fn film_size(word: &str) -> Option<FilmFormat> {
    let (width, height) = pair::<f64>(word.trim_end_matches("mm"))?;
    let fits = |x: f64| x > 0.0 && x.is_finite();
    (fits(width) && fits(height)).then_some(FilmFormat { width, height })
}

/// A flag whose value is one of a few words.
pub fn named<T: Copy>(
    m: &ArgMatches,
    flag: &str,
    values: &[(&'static str, T)],
) -> Result<Option<T>> {
    let words: Vec<&str> = values.iter().map(|(n, _)| *n).collect();
    let expects = format!("one of {}", words.join(", "));
    parsed(m, flag, &expects, |w| {
        values.iter().find(|(n, _)| *n == w).map(|(_, v)| *v)
    })
}

/// Renders and writes the picture; the exit code.
pub fn run(matches: &ArgMatches, era: Era, words: &[OsString]) -> Result<i32> {
    let talk = Talk::of(matches)?;
    let session = Session::open(plan(matches, era)?)?;
    tell_all(&session.sink);
    if session.pose.film.is_some() && !session.plan.solids {
        let of_a_camera = [&["lens"], &OF_A_LENS[..7]].concat();
        tell_idle(matches, &of_a_camera, "with the lens in the scene");
    }
    tell_headlight(&session, talk.quiet);
    if !talk.quiet {
        let choices: Vec<String> = session
            .described
            .iter()
            .map(|(k, v)| format!("{k} {v}"))
            .collect();
        super::say!("{}", choices.join(", "));
    }
    let meter = Meter::new(talk.quiet);
    let exposure = talk.on_threads(|| session.expose(&|p| meter.show(p)))?;
    meter.clear();
    tell_shortfall(&session, &exposure);

    if exposure.counts.passed == 0 {
        let none = Diagnostic::warning("no ray got through to the scene: the picture is black");
        tell(&none.with_help("the film may be too large for the lens, or the lens closed"));
    }

    let clock = Instant::now();
    let picture = session.develop(&exposure, &command_line(words));
    picture.save(&talk.output, session.plan.depth)?;
    let mut report = session.report(&exposure);
    report.picture = talk.output.display().to_string();
    report.seconds.write = clock.elapsed().as_secs_f64();
    report.total_seconds = report.seconds.total();
    tell_report(&talk, &report)?;
    Ok(0)
}

/// Says that the headlight is on without being asked for.
pub fn tell_headlight(session: &Session, quiet: bool) {
    if let Some(line) = session.headlight_notice().filter(|_| !quiet) {
        super::say!("{line}");
    }
}

/// Says how far a render got that was to reach an error and did not.
fn tell_shortfall(session: &Session, exposure: &Exposure) {
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

fn tell_report(talk: &Talk, report: &RenderReport) -> Result<()> {
    if !talk.quiet {
        super::say!("{}", report.line());
    }
    let Some(path) = &talk.report else {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::flags;

    fn planned(line: &str, frame: Option<Frame>) -> Result<Plan> {
        let words = line.split_whitespace().chain(["scene.iv"]);
        let command = clap::Command::new("ivcam").no_binary_name(true);
        let matches = command
            .args(flags::arguments(flags::RENDER))
            .arg(clap::Arg::new("scene"))
            .get_matches_from(words);
        plan_of(&matches, Era::Modern, frame)
    }

    #[test]
    fn a_shutter_is_a_time_or_a_part_of_a_frame() {
        let shutter = |word: &str| Shutter::parse(word);
        assert_eq!(shutter("1/60"), Some(Shutter::Seconds(1.0 / 60.0)));
        assert_eq!(shutter("1/60s"), Some(Shutter::Seconds(1.0 / 60.0)));
        assert_eq!(shutter("2s"), Some(Shutter::Seconds(2.0)));
        assert_eq!(shutter("20ms"), Some(Shutter::Seconds(0.02)));
        assert_eq!(shutter("0.5"), Some(Shutter::Part(0.5)));
        assert_eq!(shutter("180deg"), Some(Shutter::Part(0.5)));
        for wrong in ["1/0", "-1/60", "2", "400deg", "soon", "0/0", ""] {
            assert_eq!(shutter(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn a_time_or_an_iso_exposes_by_light_and_a_part_of_a_frame_alone_does_not() {
        let frame = Frame {
            seconds: 1.0 / 24.0,
            open: 0.5,
        };
        let metering = |line: &str, frame| planned(line, frame).unwrap().metering;
        assert_eq!(metering("", None), None);
        let still = metering("--shutter 1/60 --iso 400", None).unwrap();
        assert_eq!((still.shutter, still.iso), (1.0 / 60.0, 400.0));
        assert_eq!(metering("--shutter 1/60", None).unwrap().iso, 100.0);
        assert_eq!(metering("--shutter 0.5", Some(frame)), None);
        let film = metering("--shutter 180deg --iso 50", Some(frame)).unwrap();
        assert_eq!((film.shutter, film.iso), (1.0 / 48.0, 50.0));
        for wrong in [
            "--iso 100",
            "--shutter 0.5",
            "--shutter 1/60 --iso 0",
            "--white 5",
        ] {
            assert!(planned(wrong, None).is_err(), "{wrong}");
        }
    }
}
