//! Divides the command of one picture into tasks for a farm, and the step that merges their parts.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::{ArgMatches, Command};
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_optics::film::Region;
use ivcam_render::render::units::border_before;

use super::render::{check_outputs, plan};
use super::{flags, scene_argument, text};
use crate::farm::ShellWord;
use crate::photo::{Era, Plan, check_region};

/// The options of the picture's command that its tasks have values of their own for, or that only
/// the last step has.
const OWN: [&str; 12] = [
    "--region",
    "--sample-range",
    "--checkpoint",
    "--every",
    "--output",
    "-o",
    "--aov",
    "--layers",
    "--denoise",
    "--report",
    "--write-camera",
    "--tev",
];

/// A picture whose parts are made by tasks.
pub(super) struct DividedPicture {
    /// The argument of each task: its samples, or its region.
    pub arguments: Vec<String>,
    /// The folder of the parts.
    pub folder: PathBuf,
    /// The words of a task after the program and before the options of the picture.
    pub task: Vec<ShellWord>,
    /// The options that tasks do not take from the picture's command.
    pub own: &'static [&'static str],
    /// Whether the command sets the number of threads.
    pub has_threads: bool,
}

impl DividedPicture {
    /// Divides the picture of a command, `render` with its arguments, into at most a number of
    /// parts: by its samples, or by rows if it has too few samples and no diffraction, which
    /// brings light from one row to others.
    ///
    /// # Errors
    /// Fails if the command is not valid, reads its scene from standard input, does not name its
    /// picture, or does not have a fixed number of samples.
    pub(super) fn of_command(words: &[OsString], parts: usize) -> Result<Self> {
        let m = command().try_get_matches_from(words).map_err(|error| {
            let text = error.to_string();
            let text = text.trim_start_matches("error: ").trim_end();
            Diagnostic::error(format!("the command after `--`: {text}"))
        })?;
        check(&m)?;
        check_outputs(&m)?;
        let plan = plan(&m, Era::Modern)?;
        check_region(&plan)?;
        if plan.stop.error.is_some() || plan.stop.time.is_some() {
            let error = "a picture with `--target-error` or `--time` can't be divided";
            return Err(Diagnostic::unsupported(error).with_help("give `--samples` alone"));
        }
        let output = PathBuf::from(text(&m, "output").unwrap_or_default());
        let mut name = output.file_stem().unwrap_or_default().to_owned();
        name.push("-parts");
        let folder = output.with_file_name(name);
        let say = |word: &str| ShellWord::Text(word.to_owned());
        let mut task = vec![say("render")];
        let mut arguments = sample_ranges(plan.stop.samples, parts);
        if plan.diffraction && arguments.len() < 2 {
            let error = "a picture with `--diffraction on` is divided by its samples alone, and it \
                         has too few";
            return Err(Diagnostic::unsupported(error)
                .with_help("give `--samples 128` or more, or render it without a farm"));
        }
        if plan.diffraction || arguments.len() == parts {
            task.extend([say("--sample-range"), ShellWord::Argument]);
            if let Some(region) = plan.region {
                task.extend([say("--region"), say(&region.to_string())]);
            }
        } else {
            arguments = rows(&plan, parts);
            let all = format!("0..{}", plan.stop.samples);
            task.extend([
                say("--sample-range"),
                say(&all),
                say("--region"),
                ShellWord::Argument,
            ]);
        }
        Ok(Self {
            arguments,
            folder,
            task,
            own: &OWN,
            has_threads: m.contains_id("threads"),
        })
    }
}

/// Returns the definition of the command that renders one scene.
fn command() -> Command {
    let command = Command::new("render").args_override_self(true);
    command.args(flags::photograph()).arg(scene_argument())
}

/// Checks that a farm can make the picture.
fn check(m: &ArgMatches) -> Result<()> {
    let scene = text(m, "scene").unwrap_or_default();
    if scene == "-" || Path::new(scene).is_dir() {
        let error = "only the picture of one scene file can be divided";
        return Err(Diagnostic::unsupported(error).with_help("name a file"));
    }
    if text(m, "output").is_none_or(|output| output == "-") {
        let error = "the command after `--` does not name the picture's file";
        return Err(Diagnostic::error(error).with_help("add `-o FILE`"));
    }
    match ["checkpoint", "sample-range"]
        .into_iter()
        .find(|o| text(m, o).is_some())
    {
        None => Ok(()),
        Some(option) => {
            let error = format!("`--{option}` is for the tasks, which have values of their own");
            Err(Diagnostic::error(error).with_help("leave it out"))
        }
    }
}

/// Divides samples into at most a number of ranges, which end at borders of units.
fn sample_ranges(samples: u32, parts: usize) -> Vec<String> {
    let mut ranges = Vec::new();
    let mut start = 0;
    for part in 1..=parts as u64 {
        let end = (u64::from(samples) * part / parts as u64) as u32;
        let end = if part == parts as u64 {
            end
        } else {
            border_before(end)
        };
        if end > start {
            ranges.push(format!("{start}..{end}"));
            start = end;
        }
    }
    ranges
}

/// Divides the rows of a picture into at most a number of regions.
fn rows(plan: &Plan, parts: usize) -> Vec<String> {
    let all = plan.region.unwrap_or(Region::whole(plan.resolution));
    let height = all.height.div_ceil(parts as u32).next_multiple_of(8);
    let region = |top: u32| Region {
        top: all.top + top,
        height: height.min(all.height - top),
        ..all
    };
    let tops = (0..all.height).step_by(height as usize);
    tops.map(|top| region(top).to_string()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivcam_render::render::units::is_border;

    #[test]
    fn samples_are_divided_at_borders() {
        assert_eq!(
            sample_ranges(256, 4),
            ["0..64", "64..128", "128..192", "192..256"]
        );
        assert_eq!(sample_ranges(200, 3), ["0..64", "64..128", "128..200"]);
        assert_eq!(sample_ranges(100, 4), ["0..64", "64..100"]);
        assert_eq!(sample_ranges(16, 2), ["0..16"]);
        let many = sample_ranges(10_000, 16);
        assert_eq!(many.len(), 16);
        let start = |range: &String| range.split_once("..").unwrap().0.parse().unwrap();
        assert!(many.iter().all(|range| is_border(start(range))));
    }

    #[test]
    fn a_picture_with_few_samples_is_divided_by_rows() {
        let words = |line: &str| line.split(' ').map(OsString::from).collect::<Vec<_>>();
        let line = "render a.iv --size 30x50 --samples 16 -o out/a.exr --region 2,3,20,40";
        let picture = DividedPicture::of_command(&words(line), 3).unwrap();
        assert_eq!(picture.arguments, ["2,3,20,16", "2,19,20,16", "2,35,20,8"]);
        assert_eq!(picture.folder, Path::new("out/a-parts"));
        let line = "render a.iv --samples 128 -o a.exr --diffraction on";
        let picture = DividedPicture::of_command(&words(line), 3).unwrap();
        assert_eq!(picture.arguments, ["0..64", "64..128"]);
        assert_eq!(picture.task.len(), 3, "without `--region`");
        let line = "render a.iv --size 30x50 --samples 256 -o a.exr --region 2,3,20,40";
        let picture = DividedPicture::of_command(&words(line), 3).unwrap();
        assert_eq!(picture.arguments, ["0..64", "64..128", "128..256"]);
        let region = picture.task.last().unwrap();
        assert!(matches!(region, ShellWord::Text(text) if text == "2,3,20,40"));
        for (more, text) in [
            ("", "does not name the picture's file"),
            ("-o a.exr --time 3s", "can't be divided"),
            ("-o a.exr --checkpoint b", "`--checkpoint` is for the tasks"),
            ("-o a.exr --bogus", "the command after `--`"),
            ("-o a.exr --layers cryptomatte", "the file of `--aov`"),
            ("-o a.xyz", "the picture's format"),
            ("-o a.exr --diffraction on", "by its samples alone"),
        ] {
            let line = format!("render a.iv {more}");
            let error = DividedPicture::of_command(&words(line.trim()), 3)
                .err()
                .unwrap();
            assert!(error.message.contains(text), "{error}");
        }
    }
}
