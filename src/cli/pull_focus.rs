//! `ivcam pull-focus`: renders a movie frame by frame.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::{ArgMatches, Command};
use ivcam_base::diag::{Diagnostic, Result, Source, counted};
use ivcam_base::files::{MAX_TEXT, read_file};
use ivcam_base::math::{LengthUnit, Meters, parse_length};
use ivcam_optics::picture::PictureFormat;

use super::movie_warnings::movie_warnings;
use super::outputs::{check_picture_space, keep_inputs};
use super::render::{OutputOptions, movie_plan};
use super::render_outputs::{listed, outputs_have_a_render};
use super::{flags, parsed, print_diagnostic, print_warnings, scene_argument, text, value};
use crate::movie::{
    Container, Ease, RATES, RATES_TEXT, Shoot, ShootEvent, Timeline, folder_beside, has_ffmpeg,
    parse_frames,
};
use crate::photo::options::{MovieFrame, Shutter, command_line, duration};
use crate::photo::{Era, Plan, free_name};

/// The time after which a claim expires that is not refreshed, unless `--claim-expiry` says it.
const EXPIRY: Duration = Duration::from_secs(60);
/// The shortest expiry. A shared folder may show a refresh this late.
const SHORTEST_EXPIRY: Duration = Duration::from_secs(1);
/// The longest expiry.
const LONGEST_EXPIRY: Duration = Duration::from_secs(3600);

/// Returns the definition of the command.
pub(crate) fn command() -> Command {
    Command::new("pull-focus")
        .about("Renders a movie that pulls focus or follows a timeline")
        .args(flags::photograph().map(|arg| listed(arg, "pull-focus", &[])))
        .after_help(flags::MORE)
        .mut_arg("output", |arg| {
            arg.value_name("MOVIE")
                .help("movie to write: .mov, .mp4 or .png (animated) [the scene's name, .mov and .mp4; .png without ffmpeg]")
        })
        .arg(value("from", "DISTANCE", "focus of the first frame").conflicts_with("animate"))
        .arg(value("to", "DISTANCE", "focus of the last frame").conflicts_with("animate"))
        .arg(value("length", "N", "number of frames of the focus pull [200]").conflicts_with("animate"))
        .arg(value(
            "frames",
            "FRAMES",
            "the frames to make, without the movie: 0-99, 0-198:2 or 3,7,20-29 [all]; a number is \
             `--length`",
        ))
        .arg(value(
            "ease",
            "WORDS",
            "even in distance, diopters or travel; linear or smooth [distance linear; to or from infinity, diopters]",
        ).conflicts_with("animate"))
        .arg(value(
            "animate",
            "FILE",
            "a timeline instead: focus, zoom, aperture, camera, time",
        ))
        .arg(value("rate", "N", "frames per second [24]"))
        .arg(value(
            "folder",
            "FOLDER",
            "folder for the frames [the movie's name with -frames]",
        ))
        .arg(value(
            "claim-expiry",
            "TIME",
            "a frame that another process claims is made again if the claim is not refreshed for \
             this time [60s]",
        ))
        .arg(scene_argument())
}

/// The movie that a command makes, for those who divide it.
pub(crate) struct MovieFilm {
    /// The frames to make.
    pub frames: Vec<u32>,
    /// Whether these are all frames of the movie.
    pub is_whole: bool,
    /// The number of frames of a focus pull.
    pub length: Option<u32>,
    /// The folder of the frames.
    pub folder: PathBuf,
    /// The movie that `-o` names.
    pub movie: Option<PathBuf>,
    /// Whether the command says the number of threads.
    pub has_threads: bool,
}

impl MovieFilm {
    /// Returns the movie of a command, `pull-focus` with its arguments.
    ///
    /// # Errors
    /// Fails if the command is not valid, or reads its scene from standard input.
    pub(crate) fn of_command(words: &[OsString]) -> Result<Self> {
        let m = command().try_get_matches_from(words).map_err(|error| {
            let text = error.to_string();
            let text = text.trim_start_matches("error: ").trim_end();
            Diagnostic::error(format!("the command after `--`: {text}"))
        })?;
        outputs_have_a_render(Some("pull-focus"), &m)?;
        if text(&m, "scene") == Some("-") {
            let text = "the machines of a farm can't read a scene from standard input";
            return Err(Diagnostic::unsupported(text).with_help("name a file"));
        }
        let (timeline, wanted) = timeline(&m)?;
        plan_of(&m, &timeline)?;
        let movie = text(&m, "output").map(PathBuf::from);
        if let Some(movie) = &movie {
            Container::check_ending(movie)?;
        }
        let frames = match wanted {
            FrameSelection::Movie => (0..timeline.frames).collect(),
            FrameSelection::Frames(numbers) => numbers,
        };
        Ok(Self {
            is_whole: frames.len() == timeline.frames as usize,
            frames,
            length: (!m.contains_id("animate")).then_some(timeline.frames),
            folder: text(&m, "folder").map_or_else(|| frames_folder(&m, &[]), PathBuf::from),
            movie,
            has_threads: m.contains_id("threads"),
        })
    }
}

/// The frames that `--frames` asks for.
enum FrameSelection {
    /// All frames, and the movie of them.
    Movie,
    /// Only the frames with these numbers.
    Frames(Vec<u32>),
}

/// Runs the command and returns the exit code.
pub(crate) fn run(m: &ArgMatches, words: &[OsString]) -> Result<i32> {
    let (timeline, wanted) = timeline(m)?;
    let plan = plan_of(m, &timeline)?;
    let movies = match &wanted {
        FrameSelection::Movie => movies(m)?,
        FrameSelection::Frames(_) => Vec::new(),
    };
    let expiry = parsed(
        m,
        "claim-expiry",
        "a time from 1s to 1h, such as 60s or 10m",
        |word| duration(word).filter(|time| (SHORTEST_EXPIRY..=LONGEST_EXPIRY).contains(time)),
    )?;
    let options = OutputOptions::of_movie(m)?;
    let folder = text(m, "folder").map_or_else(|| frames_folder(m, &movies), PathBuf::from);
    let (frames, rate) = (timeline.frames, timeline.rate);
    let picture = (plan.resolution, plan.depth);
    let shoot = Shoot::new(plan, timeline, folder.clone(), command_line(words))?;
    let numbers: Vec<u32> = match wanted {
        FrameSelection::Movie => (0..frames).collect(),
        FrameSelection::Frames(numbers) => numbers,
    };
    let left = shoot.missing(&numbers).len() as u64;
    check_picture_space(&folder, PictureFormat::Png, picture, left)?;
    let keep = |inputs: &[PathBuf]| {
        let mut movies = movies.iter();
        movies.try_for_each(|(movie, _)| keep_inputs("--output", movie, inputs))
    };
    keep(&shoot.frame_paths())?;
    render(&shoot, &numbers, expiry.unwrap_or(EXPIRY), &options, &keep)?;
    for (movie, container) in &movies {
        container.write(movie, &shoot.frame_paths(), rate)?;
        if !options.quiet {
            super::status!("{frames} frames in {}", movie.display());
        }
    }
    if movies.is_empty() && !options.quiet {
        super::status!(
            "{} of {frames} in {}; `ivcam frames` lists them and makes the movie",
            counted(numbers.len(), "frame"),
            folder.display()
        );
    }
    Ok(0)
}

/// Returns the plan of the frames, and prints what has no effect on them.
fn plan_of(m: &ArgMatches, timeline: &Timeline) -> Result<Plan> {
    let frame = MovieFrame {
        seconds: 1.0 / timeline.rate,
        open: timeline.shutter,
    };
    let plan = movie_plan(m, Era::Modern, frame)?;
    let warnings = movie_warnings(m, timeline, &plan.optics);
    warnings
        .iter()
        .for_each(|warning| print_diagnostic(warning));
    Ok(plan)
}

/// Returns the folder of the frames if `--folder` does not name it.
fn frames_folder(m: &ArgMatches, movies: &[(PathBuf, Container)]) -> PathBuf {
    match (movies, text(m, "output")) {
        ([(movie, _), ..], _) => folder_beside(movie),
        ([], Some(output)) => folder_beside(Path::new(output)),
        // Several processes share the folder, so its name depends on nothing else.
        ([], None) => folder_beside(Path::new(&movie_stem(m))),
    }
}

/// Renders the frames that are missing, and prints a line for each. `keep` refuses movies that
/// would replace one of some files.
fn render(
    shoot: &Shoot,
    frames: &[u32],
    expiry: Duration,
    options: &OutputOptions,
    keep: &(dyn Fn(&[PathBuf]) -> Result<()> + Sync),
) -> Result<()> {
    let missing = shoot.missing(frames);
    let there = frames.len() - missing.len();
    if there > 0 && !options.quiet {
        let verb = if there == 1 { "exists" } else { "exist" };
        super::status!("{} {verb} already", counted(there, "frame"));
    }
    let start = Instant::now();
    let mut done = 0;
    let mut handle = |event: ShootEvent<'_>| {
        if let ShootEvent::Frame {
            number,
            shortfall: Some(error),
            ..
        } = &event
        {
            warn_of_shortfall(*number, error);
        }
        match event {
            ShootEvent::Opened(session) => {
                keep(&session.document.opened_files())?;
                print_warnings(&session.sink);
                if session.plan.meters && !options.quiet {
                    let exposure = session.stated_exposure();
                    super::status!("exposure {exposure} (metered for the first frame)");
                }
            }
            _ if options.quiet => {}
            ShootEvent::Frame {
                number,
                focus,
                seconds,
                ..
            } => {
                done += 1;
                // Other processes may make some of them.
                let left = shoot.missing(&missing).len();
                let focus = focus.map(|d| format!("  focus {d:.3} m"));
                super::status!(
                    "frame {number}{}  {seconds:.1} s  {left} left, {}",
                    focus.unwrap_or_default(),
                    time_text(start.elapsed() / done * left as u32)
                );
            }
            ShootEvent::Waiting(frames) => super::status!(
                "waiting for {} that other processes make",
                counted(frames, "frame")
            ),
        }
        Ok(())
    };
    options.on_threads(|| shoot.render(&missing, expiry, &mut handle))?
}

/// Warns that a frame may not meet the target error.
fn warn_of_shortfall(number: u32, error: &str) {
    let text = format!("frame {number} may not meet the target: its relative error is {error}");
    let help = "raise `--samples`, which is the limit of a frame's samples";
    print_diagnostic(&Diagnostic::warning(text).with_help(help));
}

/// Returns the timeline, and which of its frames to make.
fn timeline(m: &ArgMatches) -> Result<(Timeline, FrameSelection)> {
    let list = text(m, "frames").filter(|word| word.parse::<u32>().is_err());
    let wanted = list.map(parse_frames).transpose()?;
    let timeline = whole_timeline(m, list.is_none())?;
    let Some(numbers) = wanted else {
        return Ok((timeline, FrameSelection::Movie));
    };
    let beyond = numbers.last().filter(|last| **last >= timeline.frames);
    if let Some(beyond) = beyond {
        let last = timeline.frames - 1;
        let text = format!("there is no frame {beyond}: the frames of this movie are 0 to {last}");
        let help = match m.contains_id("animate") {
            true => "the timeline says how many frames there are",
            false => "`--length` says how many frames there are, 200 without it",
        };
        return Err(Diagnostic::error(text).with_help(help));
    }
    Ok((timeline, FrameSelection::Frames(numbers)))
}

/// Returns the timeline. `--frames` may be its length.
fn whole_timeline(m: &ArgMatches, frames_is_length: bool) -> Result<Timeline> {
    let mut timeline = if let Some(path) = text(m, "animate") {
        if frames_is_length && m.contains_id("frames") {
            let text = "the timeline says how many frames there are, and `--frames` with one number \
                        says it too";
            return Err(Diagnostic::error(text).with_help("give a range, such as `--frames 7-7`"));
        }
        let bytes = read_file(Path::new(path), MAX_TEXT)?;
        Timeline::read(&Arc::new(Source::new(path, bytes)))?
    } else {
        let meters = |name: &str| {
            let far = |w: &str| parse_length(w, LengthUnit::Meter).filter(|d| d.0 > 0.0);
            parsed(m, name, "a distance such as 1.2 or 40cm", far)?
                .map(|d| Meters::from(d).0)
                .ok_or_else(|| {
                    Diagnostic::error(format!("`--{name}` is missing"))
                        .with_help("give `--from` and `--to`, or `--animate FILE`")
                })
        };
        let count = |name: &str| parsed(m, name, "a number of frames", |w| w.parse().ok());
        let frames = match count("length")? {
            Some(_) if frames_is_length && m.contains_id("frames") => {
                let text = "`--frames` with one number is the same as `--length`";
                return Err(Diagnostic::error(text)
                    .with_help("give one of them, or a range of frames such as `--frames 7-7`"));
            }
            None if frames_is_length => count("frames")?,
            length => length,
        };
        let known = "one of the words distance, diopters or travel, with or without linear or \
                     smooth, such as `diopters smooth`";
        let ease = parsed(m, "ease", known, Ease::parse)?.unwrap_or_default();
        Timeline::pull_focus(meters("from")?, meters("to")?, frames.unwrap_or(200), ease)?
    };
    let rate = |w: &str| w.parse().ok().filter(|r| RATES.contains(r));
    let expects = format!("frames a second, {RATES_TEXT}");
    if let Some(rate) = parsed(m, "rate", &expects, rate)? {
        timeline.rate = rate;
    }
    match Shutter::of(&flags::given_options(m))? {
        None => {}
        Some(Shutter::Part(part)) => timeline.shutter = part,
        Some(Shutter::Seconds(time)) if time * timeline.rate <= 1.0 + 1e-9 => {
            timeline.shutter = (time * timeline.rate).min(1.0);
        }
        Some(Shutter::Seconds(time)) => {
            return Err(Diagnostic::error(format!(
                "a shutter can't be open for {time} s of a frame of 1/{} s",
                timeline.rate
            ))
            .with_help("give a shorter time, or fewer frames a second"));
        }
    }
    Ok(timeline)
}

/// Returns the movies to write: the value of `-o`, or else a .mov and an .mp4, or an animated PNG
/// if ffmpeg is not installed. A name made up here gets a number if a movie has it, so that no
/// movie is replaced that the user has not named.
///
/// # Errors
/// Returns an error if the name has an unknown extension.
fn movies(m: &ArgMatches) -> Result<Vec<(PathBuf, Container)>> {
    if let Some(output) = text(m, "output") {
        let movie = PathBuf::from(output);
        let container = Container::of(&movie)?;
        return Ok(vec![(movie, container)]);
    }
    let stem = movie_stem(m);
    let kinds: &[_] = if has_ffmpeg() {
        &[("mov", Container::Mov), ("mp4", Container::Mp4)]
    } else {
        &[("png", Container::AnimatedPng)]
    };
    let is_taken = |path: &Path| {
        let mut movies = kinds.iter().map(|(end, _)| path.with_extension(end));
        movies.any(|movie| movie.symlink_metadata().is_ok())
    };
    let free = free_name(Path::new(&format!("{stem}.{}", kinds[0].0)), is_taken);
    let named = |(end, container): &(&str, Container)| (free.with_extension(end), *container);
    Ok(kinds.iter().map(named).collect())
}

/// Returns the name of a movie, without an ending, that is named after its scene.
fn movie_stem(m: &ArgMatches) -> String {
    let scene = Path::new(text(m, "scene").unwrap_or_default());
    let name = scene.file_stem().unwrap_or_default().to_string_lossy();
    name.trim_end_matches(".iv").to_owned()
}

fn time_text(time: Duration) -> String {
    match time.as_secs() {
        s if s < 100 => format!("{s} s"),
        s if s < 6000 => format!("{} min", (s + 30) / 60),
        s => format!("{} h {} min", s / 3600, s % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn remaining_time_is_printed_in_suitable_units() {
        let text = |s| time_text(Duration::from_secs(s));
        assert_eq!(
            [text(7), text(600), text(7260)],
            ["7 s", "10 min", "2 h 1 min"]
        );
    }
}
