//! `ivcam frames`: lists the frames of a movie, and makes the movie of them.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::{Arg, ArgMatches, Command};
use ivcam_base::diag::{Diagnostic, Result, counted};
use serde_json::{Value as Json, json};

use super::outputs::keep_inputs;
use super::{exit_code, print_diagnostic, switch, text, value};
use crate::movie::{Container, FrameState, Frames, frames_text};

/// The frames in work or broken that the text lists one by one.
const MOST_LINES: usize = 20;

/// Returns the definition of the command.
pub(crate) fn command() -> Command {
    Command::new("frames")
        .about("Lists the frames of a movie: done, missing, broken and in work")
        .after_help(
            "Exit code 0: all frames are done; 1: some are not; 2: an error.\n\n  \
             ivcam frames pull-frames -o pull.mp4     makes the movie when all are done",
        )
        .arg(switch("json", "print one JSON object"))
        .arg(switch(
            "remove-broken",
            "remove the files of broken frames, so that they are made again",
        ))
        .arg(
            value(
                "output",
                "MOVIE",
                "make the movie if all frames are done: .mov, .mp4 or .png (animated)",
            )
            .short('o'),
        )
        .arg(
            Arg::new("folder")
                .value_name("FOLDER")
                .required(true)
                .help("folder of the frames, or the movie that is made of them"),
        )
}

/// Runs the command and returns the exit code.
pub(crate) fn run(m: &ArgMatches, out: &mut dyn Write) -> Result<i32> {
    let output = text(m, "output").map(PathBuf::from);
    let container = output.as_deref().map(Container::of).transpose()?;
    let place = Path::new(text(m, "folder").unwrap_or_default());
    let mut frames = Frames::survey(place)?;
    if m.get_flag("remove-broken") {
        frames.remove_broken()?;
    }
    let list = FrameLists::of(&frames);
    let printed = match m.get_flag("json") {
        true => writeln!(out, "{:#}", list.json(&frames)),
        false => write!(out, "{}", list.text(&frames)),
    };
    let code = exit_code(printed)?;
    let is_complete = list.done.len() == frames.states.len();
    if let Some((movie, container)) = output.zip(container) {
        if is_complete {
            keep_inputs("--output", &movie, &frames.paths())?;
            container.write(&movie, &frames.paths(), frames.rate)?;
        } else {
            let left = counted(frames.states.len() - list.done.len(), "frame");
            let text = format!("`{}` was not written: {left} not done", movie.display());
            print_diagnostic(&Diagnostic::error(text));
        }
    }
    Ok(if is_complete { code } else { 1 })
}

/// The numbers of the frames in each state.
#[derive(Default)]
struct FrameLists {
    done: Vec<u32>,
    missing: Vec<u32>,
    /// The numbers with the reasons.
    broken: Vec<(u32, String)>,
    /// The numbers with the host and the process, if the claim says them.
    in_work: Vec<(u32, Option<(String, u32)>)>,
}

impl FrameLists {
    fn of(frames: &Frames) -> Self {
        let mut lists = Self::default();
        for (number, state) in (0..).zip(&frames.states) {
            match state {
                FrameState::Done => lists.done.push(number),
                FrameState::Missing => lists.missing.push(number),
                FrameState::Broken(reason) => lists.broken.push((number, reason.clone())),
                FrameState::InWork(held) => {
                    let maker = held.maker.as_ref().map(|m| (m.host.clone(), m.pid));
                    lists.in_work.push((number, maker));
                }
            }
        }
        lists
    }

    fn text(&self, frames: &Frames) -> String {
        let mut text = format!(
            "{}: {}, {} done, {} missing, {} broken, {} in work\n",
            frames.folder.display(),
            counted(frames.states.len(), "frame"),
            self.done.len(),
            self.missing.len(),
            self.broken.len(),
            self.in_work.len()
        );
        if !self.missing.is_empty() {
            text += &format!("missing  {}\n", frames_text(&self.missing));
        }
        for (number, reason) in self.broken.iter().take(MOST_LINES) {
            text += &format!("broken   {number}  {reason}\n");
        }
        for (number, maker) in self.in_work.iter().take(MOST_LINES) {
            let by = match maker {
                Some((host, pid)) => format!("{host}, process {pid}"),
                None => "a process that is unknown".into(),
            };
            text += &format!("in work  {number}  {by}\n");
        }
        for (name, count) in [
            ("broken", self.broken.len()),
            ("in work", self.in_work.len()),
        ] {
            if count > MOST_LINES {
                text += &format!("{name}: {} more; `--json` lists all\n", count - MOST_LINES);
            }
        }
        text
    }

    fn json(&self, frames: &Frames) -> Json {
        let broken = self.broken.iter();
        let broken = broken.map(|(frame, reason)| json!({ "frame": frame, "reason": reason }));
        let in_work = self.in_work.iter().map(|(frame, maker)| {
            let (host, pid) = maker.clone().unzip();
            json!({ "frame": frame, "host": host, "pid": pid })
        });
        json!({
            "folder": frames.folder.display().to_string(),
            "frames": frames.states.len(),
            "rate": frames.rate,
            "is_complete": self.done.len() == frames.states.len(),
            "done": self.done,
            "missing": self.missing,
            "broken": broken.collect::<Vec<_>>(),
            "in_work": in_work.collect::<Vec<_>>(),
        })
    }
}
