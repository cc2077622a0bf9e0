//! `ivcam merge`: adds the parts of a picture.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use ivcam_base::diag::{Diagnostic, Result, counted};
use ivcam_optics::film::Response;
use ivcam_optics::picture::{Depth, Picture, PictureFormat};
use ivcam_render::render::Stopped;

use super::outputs::{picture_format, save_picture};
use super::{text, value};
use crate::compare::difference::provenance;
use crate::photo::UNFINISHED;
use crate::photo::checkpoint::Checkpoint;
use crate::photo::merge::merge;

/// Returns the definition of the command.
pub(crate) fn command() -> Command {
    Command::new("merge")
        .about("Adds the parts of a picture that `render --sample-range` or `--region` made")
        .after_help(
            "The picture has the bits of one render. Of a single checkpoint it is the picture so far:\n\n  \
             ivcam render room.iv --samples 128 --sample-range 0..64 --checkpoint a.ckpt\n  \
             ivcam render room.iv --samples 128 --sample-range 64..128 --checkpoint b.ckpt\n  \
             ivcam merge a.ckpt b.ckpt -o room.exr",
        )
        .arg(
            Arg::new("parts")
                .value_name("CHECKPOINT")
                .required(true)
                .action(ArgAction::Append)
                .num_args(1..)
                .value_parser(value_parser!(PathBuf))
                .help("checkpoints of parts with the same scene and options"),
        )
        .arg(
            value("output", "FILE", "picture to write, or a checkpoint of all parts if it ends in .ckpt").short('o').required(true),
        )
}

/// Runs the command and returns the exit code.
pub(crate) fn run(m: &ArgMatches, command: &str) -> Result<i32> {
    let paths: Vec<PathBuf> = m.get_many("parts").into_iter().flatten().cloned().collect();
    let output = Path::new(text(m, "output").unwrap_or_default());
    let is_checkpoint = output.extension() == Some(OsStr::new("ckpt"));
    let format = match is_checkpoint {
        true => None,
        false => Some(picture_format(output)?),
    };
    let mut whole = merge(&paths)?;
    let place = &whole.sums.place;
    let made = match unfinished(&whole) {
        Some(text) => text,
        None => format!("{} samples per pixel", place.done - place.first),
    };
    let parts = counted(paths.len(), "part");
    let line = format!("{}: {made}, from {parts}", output.display());
    match format {
        None => whole.write(output)?,
        Some(format) => write_picture(whole, output, format, command)?,
    }
    super::status!("{line}");
    Ok(0)
}

/// Describes what samples a picture has, if its render was to make more.
fn unfinished(whole: &Checkpoint) -> Option<String> {
    let place = &whole.sums.place;
    let planned = whole.label.described.get("samples");
    let planned = planned.and_then(|samples| samples.parse().ok());
    let is_short = place.first == 0 && planned.is_some_and(|planned| place.done < planned);
    let stopped = whole.sums.stopped();
    let stopped = stopped.or_else(|| is_short.then(|| Stopped::between_passes(place.done)));
    Some(stopped?.describe(planned.unwrap_or(place.until)))
}

/// Writes the picture of a checkpoint.
fn write_picture(
    mut whole: Checkpoint,
    output: &Path,
    format: PictureFormat,
    command: &str,
) -> Result<()> {
    let label = &whole.label;
    if !label.additions.is_empty() {
        let names = label.additions.join(" and ");
        let error = format!("the light of {names} is not in the parts");
        return Err(Diagnostic::unsupported(error).with_help(
            "merge them with `-o all.ckpt`, and give `--checkpoint all.ckpt` to the render's command",
        ));
    }
    let place = &whole.sums.place;
    if place.first > 0 {
        let error = format!("the samples 0 to {} are missing", place.first - 1);
        return Err(Diagnostic::error(error).with_help("merge the parts from the first sample on"));
    }
    let mut provenance = provenance(command);
    let mut say = |key: &str, value: String| provenance.insert(key.to_owned(), value);
    say("ivcam:error", "unknown: not measured".into());
    if let Some(text) = unfinished(&whole) {
        say(UNFINISHED, text);
    }
    let samples = place.done.to_string();
    for (key, value) in &label.described {
        let value = if key == "samples" { &samples } else { value };
        say(&format!("ivcam:{key}"), value.clone());
    }
    let response = match format {
        PictureFormat::Exr => Response::Linear,
        _ => Response::open(&label.response)?,
    };
    let depth = if label.is_deep {
        Depth::Sixteen
    } else {
        Depth::Eight
    };
    let mut picture = Picture::develop_last(whole.sums.film(), response);
    picture.provenance = provenance;
    save_picture(&picture, output, depth)
}
