//! `ivcam pull-focus`: a film, frame by frame.
//!
//! Frames are pictures with numbers in a folder. One that is there is whole (a picture appears
//! under its name only then) and is not made again, so that a film that was stopped goes on. At
//! the end the frames become a film: by ffmpeg where there is one, else an animated PNG.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::{Arg, ArgMatches, Command};

use super::render::{Frame, Shutter, Talk, plan_of};
use super::{flags, parsed, scene_argument, tell_all, text};
use crate::anim::{Ease, Moment, Timeline, Travel};
use crate::diag::{Diagnostic, Result, Source};
use crate::math::{LengthUnit, Meters, parse_length};
use crate::picture::write_whole;
use crate::plan::{Era, Optics, Plan, Session};
use crate::pose::CameraPose;
use crate::raster::{Raster, Samples};
use crate::render::{Exposure, Stop};
use crate::sampling::Sampler;

/// Parts that an open shutter's time is cut into, at most.
const MOST_PARTS: u32 = 16;
/// What the frames in a folder are, so that two films do not mix.
const LABEL: &str = "film.txt";

pub fn command() -> Command {
    let value = |name: &'static str, value: &'static str, help: &'static str| {
        Arg::new(name).long(name).value_name(value).help(help)
    };
    Command::new("pull-focus")
        .about("Makes a film that pulls focus, or follows a timeline")
        .args(flags::arguments(flags::RENDER))
        .mut_arg("output", |arg| {
            arg.value_name("FILM")
                .help("film to write: .mov, .mp4 or .png (animated) [the scene's name, .mov and .mp4; .png without ffmpeg]")
        })
        .arg(value("from", "DISTANCE", "focus of the first frame").conflicts_with("animate"))
        .arg(value("to", "DISTANCE", "focus of the last frame").conflicts_with("animate"))
        .arg(value("frames", "N", "how many [200]").conflicts_with("animate"))
        .arg(value(
            "ease",
            "WORDS",
            "even in distance, diopters or travel; linear or smooth [distance linear; to or from infinity, diopters]",
        ))
        .arg(value(
            "animate",
            "FILE",
            "a timeline instead: focus, zoom, aperture, camera, time",
        ))
        .arg(value("rate", "N", "frames a second [24]"))
        .arg(value(
            "folder",
            "FOLDER",
            "where the frames go [the film's name with -frames]",
        ))
        .arg(scene_argument())
}

/// A film on its way.
struct Shoot {
    plan: Plan,
    timeline: Timeline,
    folder: PathBuf,
    talk: Talk,
    command: String,
    /// Of every frame with an open shutter.
    parts: u32,
}

/// Runs the command; the number is the exit code.
pub fn run(m: &ArgMatches, words: &[OsString]) -> Result<i32> {
    let timeline = timeline(m)?;
    let frame = Frame {
        seconds: 1.0 / timeline.rate,
        open: timeline.shutter,
    };
    let mut plan = plan_of(m, Era::Modern, Some(frame))?;
    if plan.solids {
        return Err(Diagnostic::error("a film can't be made with `--solids`")
            .with_help("leave it out: the pictures are the same without"));
    }
    let films = films(m)?;
    let talk = Talk::of_film(m)?;
    let folder = text(m, "folder").map_or_else(
        || {
            let stem = films[0].file_stem().unwrap_or_default().to_string_lossy();
            films[0].with_file_name(format!("{stem}-frames"))
        },
        PathBuf::from,
    );
    let lens = lens_travel(&plan)?;
    let travel = |distance: f64| lens.as_ref().and_then(|l| l(distance));
    if lens.is_some() {
        timeline.check_focus(&travel, &|moment| reaches(&plan, moment))?;
    }
    apply(&mut plan, &timeline.at(0.0, &travel));
    let shoot = Shoot {
        parts: plan.sampler.samples.clamp(1, MOST_PARTS),
        command: super::render::command_line(words),
        plan,
        timeline,
        folder,
        talk,
    };
    shoot.prepare_folder()?;
    shoot.frames(&travel)?;
    for film in &films {
        shoot.assemble(film)?;
    }
    Ok(0)
}

fn timeline(m: &ArgMatches) -> Result<Timeline> {
    let mut timeline = if let Some(path) = text(m, "animate") {
        let bytes = std::fs::read(path).map_err(|e| Diagnostic::io(path, &e))?;
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
        let frames = parsed(m, "frames", "a number of frames", |w| w.parse().ok())?;
        let known = "of distance, diopters, travel and linear, smooth";
        let ease = parsed(m, "ease", known, Ease::parse)?.unwrap_or_default();
        Timeline::pull_focus(meters("from")?, meters("to")?, frames.unwrap_or(200), ease)?
    };
    let rate = |w: &str| w.parse().ok().filter(|r| (0.1..=1000.0).contains(r));
    if let Some(rate) = parsed(m, "rate", "frames a second, from 0.1 to 1000", rate)? {
        timeline.rate = rate;
    }
    match Shutter::of(m)? {
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

/// The films to write: what `-o` names, else a .mov and an .mp4, or an animated PNG where no
/// ffmpeg is there to make them.
///
/// # Errors
/// A name that ends otherwise.
fn films(m: &ArgMatches) -> Result<Vec<PathBuf>> {
    if let Some(output) = text(m, "output") {
        let film = PathBuf::from(output);
        let end = film.extension().unwrap_or_default().to_ascii_lowercase();
        return if end == "png" || ((end == "mov" || end == "mp4") && has_ffmpeg()) {
            Ok(vec![film])
        } else if end == "mov" || end == "mp4" {
            Err(
                Diagnostic::error(format!("there is no ffmpeg to write `{output}`")).with_help(
                    format!(
                        "install ffmpeg, or give `-o {}` for an animated PNG: it has the same \
                         frames, and a film can be made of them later",
                        film.with_extension("png").display()
                    ),
                ),
            )
        } else {
            Err(
                Diagnostic::error(format!("cannot tell the film's format from `{output}`"))
                    .with_help("end its name in .mov, .mp4 or .png (animated)"),
            )
        };
    }
    let scene = Path::new(text(m, "scene").unwrap_or_default());
    let name = scene.file_stem().unwrap_or_default().to_string_lossy();
    let stem = name.trim_end_matches(".iv").to_owned();
    let ends: &[&str] = if has_ffmpeg() {
        &["mov", "mp4"]
    } else {
        &["png"]
    };
    let named = |end: &&str| PathBuf::from(format!("{stem}.{end}"));
    Ok(ends.iter().map(named).collect())
}

/// How far the focused part moves for a distance; nothing for a pinhole.
fn lens_travel(plan: &Plan) -> Result<Option<Box<Travel<'static>>>> {
    let Optics::Lens(choice) = &plan.optics else {
        return Ok(None);
    };
    let lens = choice.open(&mut crate::diag::Sink::new())?;
    let method = choice.method;
    Ok(Some(Box::new(move |distance| {
        let (_, focus) = lens.focused(method, Meters(distance)).ok()?;
        Some(focus.extension)
    })))
}

/// Whether the lens, zoomed as it is at a moment, can focus there.
fn reaches(plan: &Plan, moment: &Moment) -> bool {
    let mut then = plan.clone();
    apply(&mut then, moment);
    match (lens_travel(&then), moment.focus) {
        (Ok(Some(travel)), Some(distance)) => travel(distance).is_some(),
        // What else is wrong is told when the frame is made.
        _ => true,
    }
}

/// Puts a moment's values into a plan.
fn apply(plan: &mut Plan, moment: &Moment) {
    if let Some(distance) = moment.focus {
        plan.focus = Some(Meters(distance));
    }
    if let Some(time) = moment.time {
        plan.time = time;
    }
    if let Optics::Lens(lens) = &mut plan.optics {
        if let Some(zoom) = moment.zoom {
            lens.zoom = zoom;
        }
        if moment.f_number.is_some() {
            lens.f_number = moment.f_number;
        }
    }
}

fn posed(pose: &CameraPose, moment: &Moment) -> CameraPose {
    CameraPose {
        position: moment.position.unwrap_or(pose.position),
        orientation: moment.orientation.unwrap_or(pose.orientation),
        ..pose.clone()
    }
}

impl Shoot {
    fn frame_path(&self, frame: u32) -> PathBuf {
        self.folder.join(format!("{frame:05}.png"))
    }

    /// Makes the folder, or sees that the frames in it are of this film.
    fn prepare_folder(&self) -> Result<()> {
        let io = |e: std::io::Error| Diagnostic::io(self.folder.display(), &e);
        // One folder of its own, beside the film; its parents are the user's to make.
        if !self.folder.is_dir() {
            std::fs::create_dir(&self.folder).map_err(io)?;
        }
        let label = self.folder.join(LABEL);
        let mut text = String::new();
        for (key, value) in self.plan.describe() {
            text += &format!("{key} {value}\n");
        }
        text += &format!(
            "scene {}\ncamera {:?}\noptics {:?}\n{:?}\n",
            self.plan.scene.display(),
            self.plan.camera,
            self.plan.optics,
            self.timeline
        );
        match std::fs::read_to_string(&label) {
            Ok(there) if there == text => Ok(()),
            Ok(_) => Err(Diagnostic::error(format!(
                "the frames in `{}` are of another film",
                self.folder.display()
            ))
            .with_help("give another `--folder`, or remove this one")),
            Err(_) => write_whole(&label, |file| file.write_all(text.as_bytes())),
        }
    }

    /// Makes the frames that are not there.
    fn frames(&self, travel: &Travel<'_>) -> Result<()> {
        let missing: Vec<u32> = (0..self.timeline.frames)
            .filter(|&f| !self.frame_path(f).exists())
            .collect();
        let there = self.timeline.frames as usize - missing.len();
        if there > 0 && !self.talk.quiet {
            super::say!("{there} frames are there already");
        }
        if missing.is_empty() {
            return Ok(());
        }
        let mut session = Session::open(self.plan.clone())?;
        tell_all(&session.sink);
        let standing = session.pose.clone();
        let start = Instant::now();
        for (done, &frame) in missing.iter().enumerate() {
            let moments = self.timeline.exposures(frame, self.parts, travel);
            let exposure = self.expose(&mut session, &standing, &moments)?;
            let picture = session.develop(&exposure, &self.command);
            picture.save(&self.frame_path(frame), self.plan.depth)?;
            let left = start.elapsed() / (done as u32 + 1) * (missing.len() - done - 1) as u32;
            if !self.talk.quiet {
                let focus = moments[0].focus.map(|d| format!("  focus {d:.3} m"));
                super::say!(
                    "frame {frame} of {}{}  {:.1} s  {} left",
                    self.timeline.frames,
                    focus.unwrap_or_default(),
                    exposure.seconds,
                    duration(left)
                );
            }
        }
        Ok(())
    }

    /// Exposes a film over the moments, each for an equal part of the samples.
    fn expose(
        &self,
        session: &mut Session,
        standing: &CameraPose,
        moments: &[Moment],
    ) -> Result<Exposure> {
        let mut whole: Option<Exposure> = None;
        let samples = (self.plan.sampler.samples / moments.len() as u32).max(1);
        for (i, moment) in moments.iter().enumerate() {
            let mut plan = self.plan.clone();
            apply(&mut plan, moment);
            session.change(plan, posed(standing, moment))?;
            // Each part has its own random numbers, or their errors would add up.
            let seed = self.plan.sampler.seed.wrapping_add(i as u64 * 0x9e37_79b9);
            let sampler = Sampler {
                samples,
                seed,
                ..self.plan.sampler
            };
            let part = self
                .talk
                .on_threads(|| session.expose_with(sampler, Stop::after(samples), &|_| ()))?;
            match &mut whole {
                None => whole = Some(part),
                Some(sum) => sum.join(&part),
            }
        }
        whole.ok_or_else(|| Diagnostic::error("a frame without a moment can't be exposed"))
    }

    /// The film from its frames.
    fn assemble(&self, film: &Path) -> Result<()> {
        let end = film
            .extension()
            .unwrap_or_default()
            .to_string_lossy()
            .to_lowercase();
        match end.as_str() {
            "png" => self.animated_png(film)?,
            _ => self.by_ffmpeg(film, &end)?,
        }
        if !self.talk.quiet {
            super::say!("{} frames in {}", self.timeline.frames, film.display());
        }
        Ok(())
    }

    fn by_ffmpeg(&self, film: &Path, end: &str) -> Result<()> {
        let name = film.file_name().unwrap_or_default().to_string_lossy();
        let beside = film.with_file_name(format!(".{name}.{}.tmp.{end}", std::process::id()));
        let output = std::process::Command::new("ffmpeg")
            .args(["-y", "-loglevel", "error", "-framerate"])
            .arg(self.timeline.rate.to_string())
            .arg("-i")
            .arg(self.folder.join("%05d.png"))
            // H.264 in 4:2:0 wants even sides.
            .args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2"])
            .args(["-c:v", "libx264", "-crf", "14", "-pix_fmt", "yuv420p"])
            .arg(&beside)
            .output()
            .map_err(|e| Diagnostic::io("ffmpeg", &e))?;
        if output.status.success() {
            return std::fs::rename(&beside, film).map_err(|e| Diagnostic::io(film.display(), &e));
        }
        let _ = std::fs::remove_file(&beside);
        let said = String::from_utf8_lossy(&output.stderr);
        let last = said
            .lines()
            .last()
            .unwrap_or("it does not say why")
            .to_owned();
        Err(
            Diagnostic::error(format!("ffmpeg can't write `{}`: {last}", film.display()))
                .with_help(format!("the frames are in `{}`", self.folder.display())),
        )
    }

    fn animated_png(&self, film: &Path) -> Result<()> {
        let paths: Vec<PathBuf> = (0..self.timeline.frames)
            .map(|f| self.frame_path(f))
            .collect();
        animated_png(film, &paths, self.timeline.rate)
    }
}

/// Writes frames of one size as an animated PNG, over and over.
fn animated_png(film: &Path, frames: &[PathBuf], rate: f64) -> Result<()> {
    let rasters = frames.iter().map(|path| Raster::open(path));
    let mut rasters = rasters.collect::<Result<Vec<_>>>()?.into_iter();
    let Some(first) = rasters.next() else {
        return Err(Diagnostic::error("a film needs a frame"));
    };
    // A delay is a fraction of two 16-bit numbers.
    let (over, under) = if rate.fract() == 0.0 && rate <= 65_535.0 {
        (1, rate as u16)
    } else {
        (1000, (1000.0 * rate).min(65_535.0) as u16)
    };
    write_whole(film, |file| {
        let mut encoder = png::Encoder::new(file, first.width, first.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_animated(frames.len() as u32, 0)?;
        encoder.set_frame_delay(over, under)?;
        let mut writer = encoder.write_header().map_err(of_the_file)?;
        let size = (first.width, first.height);
        let mut write = |raster: &Raster| {
            writer
                .write_image_data(&levels(raster))
                .map_err(of_the_file)
        };
        write(&first)?;
        for raster in rasters {
            if (raster.width, raster.height) != size {
                return Err(std::io::Error::other("the frames differ in size"));
            }
            write(&raster)?;
        }
        writer.finish().map_err(of_the_file)
    })
}

/// What went wrong with the file itself, such as a full disk, as it is.
fn of_the_file(error: png::EncodingError) -> std::io::Error {
    match error {
        png::EncodingError::IoError(error) => error,
        other => other.into(),
    }
}

/// Red, green and blue in 8 bits.
fn levels(raster: &Raster) -> Vec<u8> {
    match &raster.samples {
        Samples::U8(levels) if raster.channels == 3 => levels.clone(),
        _ => (0..raster.pixels())
            .flat_map(|i| raster.color(i))
            .map(|v| (255.0 * v.clamp(0.0, 1.0)).round() as u8)
            .collect(),
    }
}

fn has_ffmpeg() -> bool {
    let run = std::process::Command::new("ffmpeg")
        .arg("-version")
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .status();
    run.is_ok_and(|s| s.success())
}

fn duration(time: Duration) -> String {
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
    fn an_animated_png_has_its_frames_and_its_rate() {
        let folder = std::env::temp_dir().join(format!("ivcam-film-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let paths: Vec<PathBuf> = (0..3).map(|i| folder.join(format!("{i}.png"))).collect();
        for (i, path) in paths.iter().enumerate() {
            image::RgbImage::from_pixel(4, 2, image::Rgb([i as u8 * 100; 3]))
                .save(path)
                .unwrap();
        }
        let film = folder.join("film.png");
        animated_png(&film, &paths, 24.0).unwrap();
        let file = std::io::BufReader::new(std::fs::File::open(&film).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let frames = reader.info().animation_control.unwrap().num_frames;
        let mut pixels = vec![0; 4 * 2 * 3];
        let mut seen = Vec::new();
        for _ in 0..frames {
            reader.next_frame(&mut pixels).unwrap();
            seen.push(pixels[0]);
            assert_eq!(reader.info().frame_control.unwrap().delay_den, 24);
        }
        assert_eq!(seen, [0, 100, 200]);
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn time_left_is_told_in_words_of_its_size() {
        let tell = |s| duration(Duration::from_secs(s));
        assert_eq!(
            [tell(7), tell(600), tell(7260)],
            ["7 s", "10 min", "2 h 1 min"]
        );
    }
}
