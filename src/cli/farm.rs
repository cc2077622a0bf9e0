//! `ivcam farm`: writes job files for the schedulers of farms.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::{Arg, ArgMatches, Command, value_parser};

use super::pull_focus::Film;
use super::{flags, parsed, text};
use crate::diag::{Diagnostic, Result};
use crate::farm::{Division, Scheduler, pieces, script};
use crate::files::write_whole;
use crate::movie::frames_text;
use crate::scene::check::counted;

/// Returns the definition of the command.
pub(crate) fn command() -> Command {
    let value = |name: &'static str, value: &'static str, help: &'static str| {
        Arg::new(name).long(name).value_name(value).help(help)
    };
    Command::new("farm")
        .about("Writes job files that make a movie on a farm")
        .after_help(
            "The command after `--` is that of the whole movie:\n\n  \
             ivcam farm slurm -o jobs -- pull-focus room.iv --from 1 --to 2 -o pull.mp4\n  \
             sh jobs/submit.sh",
        )
        .arg(
            Arg::new("scheduler")
                .value_name("SCHEDULER")
                .required(true)
                .value_parser(Scheduler::NAMES.map(|(name, _)| name))
                .help("openjd, slurm, hq (HyperQueue) or parallel (GNU parallel)"),
        )
        .arg(
            value("folder", "FOLDER", "folder for the job files")
                .short('o')
                .required(true),
        )
        .arg(value(
            "chunk",
            "N",
            "frames of a task [1; more if there are too many tasks]",
        ))
        .arg(value("cores", "N", "processors of a task [1]"))
        .arg(value(
            "program",
            "PATH",
            "ivcam on the machines of the farm [this program]",
        ))
        .arg(
            Arg::new("command")
                .value_name("COMMAND")
                .required(true)
                .last(true)
                .num_args(1..)
                .value_parser(value_parser!(OsString))
                .help("the command of the whole movie: pull-focus and its arguments"),
        )
}

/// Runs the command and returns the exit code.
pub(crate) fn run(m: &ArgMatches) -> Result<i32> {
    let name = text(m, "scheduler").unwrap_or_default();
    let scheduler = Scheduler::NAMES.iter().find(|(n, _)| *n == name);
    let (_, scheduler) = scheduler.ok_or_else(|| Diagnostic::not_found(name))?;
    let number = |name: &str| {
        let parse = |w: &str| w.parse().ok().filter(|n| (1..=100_000).contains(n));
        parsed(m, name, "a number from 1 to 100000", parse)
    };
    let cores = number("cores")?.unwrap_or(1);
    let chunk = number("chunk")?.map(|n| n as usize);
    let words = m.get_raw("command").into_iter().flatten();
    let words = flags::modernize(words.map(OsString::from));
    let film = Film::of_command(&words)?;
    let here = std::env::current_dir().map_err(|e| Diagnostic::io("the current folder", &e))?;
    let program = match text(m, "program") {
        Some(program) => PathBuf::from(program),
        None => std::env::current_exe().map_err(|e| Diagnostic::io("this program", &e))?,
    };
    let division = division(&film, &words, cores, &here, &program, |frames| {
        pieces(frames, chunk, scheduler.most_tasks())
    })?;
    let folder = Path::new(text(m, "folder").unwrap_or_default());
    match std::fs::create_dir(folder) {
        Err(e) if !folder.is_dir() => return Err(Diagnostic::io(folder.display(), &e)),
        _ => {}
    }
    for file in scheduler.files(&division) {
        write_whole(&folder.join(file.name), |to| {
            to.write_all(file.content.as_bytes())
        })?;
    }
    super::status!(
        "{} of {} in {}; start them there with `{}`",
        counted(division.arguments.len(), "task"),
        counted(film.frames.len(), "frame"),
        folder.display(),
        scheduler.start()
    );
    Ok(0)
}

/// Divides a movie into tasks.
fn division<'f>(
    film: &'f Film,
    words: &[OsString],
    cores: u32,
    here: &Path,
    program: &Path,
    pieces: impl Fn(&'f [u32]) -> Vec<&'f [u32]>,
) -> Result<Division> {
    let here = unicode(here.as_os_str())?;
    let program = unicode(program.as_os_str())?;
    let folder = unicode(film.folder.as_os_str())?;
    let mut task = vec![Some(program.clone()), Some("pull-focus".into())];
    let mut say = |words: [&str; 2]| task.extend(words.map(|w| Some(w.to_owned())));
    say(["--folder", &folder]);
    if let Some(length) = film.length {
        say(["--length", &length.to_string()]);
    }
    if !film.has_threads {
        say(["--threads", &cores.to_string()]);
    }
    task.extend([Some("--frames".into()), None]);
    for word in without_options(words, &["--frames", "--folder", "--length"]) {
        task.push(Some(unicode(&word)?));
    }
    let mut last = vec![Some(program), Some("frames".into())];
    if let Some(movie) = &film.movie {
        last.extend([Some("-o".into()), Some(unicode(movie.as_os_str())?)]);
    }
    last.extend([Some("--".into()), Some(folder)]);
    let purpose = match film.movie {
        Some(_) => "Makes the movie of the frames.",
        None => "Checks that all frames are done.",
    };
    Ok(Division {
        task: script(
            "Makes the frames that the first argument lists.",
            &here,
            &task,
        ),
        arguments: pieces(&film.frames).into_iter().map(range_text).collect(),
        last: film.is_whole.then(|| script(purpose, &here, &last)),
        cores,
    })
}

/// Returns frames as a value of `--frames`, for which a single number is the length of the movie.
fn range_text(frames: &[u32]) -> String {
    match frames {
        [only] => format!("{only}-{only}"),
        _ => frames_text(frames),
    }
}

/// Returns a word as Unicode.
///
/// # Errors
/// Fails if it is not, because job files are Unicode text.
fn unicode(word: &std::ffi::OsStr) -> Result<String> {
    let text = word.to_str().map(str::to_owned);
    text.ok_or_else(|| {
        let text = format!("`{}` is not Unicode, and job files are", word.display());
        Diagnostic::unsupported(text).with_help("rename the file or the folder")
    })
}

/// Returns the words of a command after its name, without some options and their values.
fn without_options(words: &[OsString], options: &[&str]) -> Vec<OsString> {
    let mut rest = Vec::new();
    let mut words = words.iter().skip(1);
    while let Some(word) = words.next() {
        let text = word.to_str().unwrap_or_default();
        if text == "--" {
            rest.push(word.clone());
            rest.extend(words.cloned());
            break;
        }
        let name = text.split('=').next().unwrap_or_default();
        if !options.contains(&name) {
            rest.push(word.clone());
        } else if name == text {
            words.next();
        }
    }
    rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_removed_with_their_values() {
        let words = "pull-focus --frames 9 a.iv --length=3 -o --folder x -- --frames";
        let words: Vec<OsString> = words.split(' ').map(OsString::from).collect();
        let rest = without_options(&words, &["--frames", "--folder", "--length"]);
        assert_eq!(rest, ["a.iv", "-o", "--", "--frames"]);
    }

    #[test]
    fn the_tasks_of_a_movie_have_its_frames_and_its_length() {
        let line = "pull-focus no-such.iv --from 1 --to 2 --frames 5 -o a.png";
        let words: Vec<OsString> = line.split(' ').map(OsString::from).collect();
        let film = Film::of_command(&words).unwrap();
        let [here, program] = ["/a b", "/bin/ivcam"].map(Path::new);
        let division =
            division(&film, &words, 2, here, program, |f| pieces(f, Some(2), 9)).unwrap();
        assert_eq!(division.arguments, ["0-1", "2-3", "4-4"]);
        let task = division.task.lines().last().unwrap();
        assert_eq!(
            task,
            "exec /bin/ivcam pull-focus --folder a-frames --length 5 --threads 2 --frames \"$1\" \
             no-such.iv --from 1 --to 2 -o a.png"
        );
        assert!(division.task.contains("cd '/a b' || exit 2"));
        let last = division.last.unwrap();
        assert!(last.ends_with("exec /bin/ivcam frames -o a.png -- a-frames\n"));
        let part = words
            .iter()
            .map(|w| if w == "5" { "1-3:2".into() } else { w.clone() });
        let part = Film::of_command(&part.collect::<Vec<_>>()).unwrap();
        assert_eq!(part.frames, [1, 3]);
        assert!(!part.is_whole);
    }
}
