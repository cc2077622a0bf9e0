//! `ivcam farm`: writes job files for the schedulers of farms.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::{Arg, ArgMatches, Command, value_parser};
use ivcam_base::diag::{Diagnostic, Result, counted};
use ivcam_base::files::write_whole;

use super::farm_picture::DividedPicture;
use super::pull_focus::MovieFilm;
use super::{flags, parsed, text, value};
use crate::farm::{Division, LOG, Scheduler, ShellWord, pieces, script};
use crate::movie::frames_text;

/// Returns the definition of the command.
pub(crate) fn command() -> Command {
    Command::new("farm")
        .about("Writes job files that make a movie or one picture on a farm")
        .after_help(
            "The command after `--` is that of the whole movie or picture:\n\n  \
             ivcam farm slurm -o jobs -- pull-focus room.iv --from 1 --to 2 -o pull.mp4\n  \
             ivcam farm slurm -o jobs --parts 8 -- render room.iv --samples 1024 -o room.exr\n  \
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
        .arg(value(
            "parts",
            "N",
            "tasks of a picture: ranges of its samples, or rows if it has fewer than 64 each [8]",
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
                .help("the command of the whole: pull-focus or render, and its arguments"),
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
    let here = std::env::current_dir().map_err(|e| Diagnostic::io("the current folder", &e))?;
    let program = match text(m, "program") {
        Some(program) => PathBuf::from(program),
        None => std::env::current_exe().map_err(|e| Diagnostic::io("this program", &e))?,
    };
    let place = FarmFolder {
        here: unicode(here.as_os_str())?,
        program: unicode(program.as_os_str())?,
        cores,
    };
    let most = scheduler.most_tasks();
    let folder = Path::new(text(m, "folder").unwrap_or_default());
    refuse_other_job(folder, *scheduler)?;
    let is_picture = is_picture(m, &words)?;
    let (division, count) = if is_picture {
        let parts = number("parts")?.unwrap_or(8) as usize;
        let picture = DividedPicture::of_command(&words, parts.min(most))?;
        create_folder(&picture.folder)?;
        let count = counted(picture.arguments.len(), "part");
        (division_of_picture(picture, &words, place)?, count)
    } else {
        let film = MovieFilm::of_command(&words)?;
        let division = division(&film, &words, place, |frames| pieces(frames, chunk, most))?;
        (division, counted(film.frames.len(), "frame"))
    };
    create_folder(folder)?;
    let log = folder.join(LOG);
    if log.exists() {
        std::fs::remove_file(&log).map_err(|e| Diagnostic::io(log.display(), &e))?;
    }
    for file in scheduler.files(&division) {
        write_whole(&folder.join(file.name), |to| {
            to.write_all(file.content.as_bytes())
        })?;
    }
    super::status!(
        "{} of {} in {}; start them there with `{}`",
        counted(division.arguments.len(), "task"),
        count,
        folder.display(),
        scheduler.start()
    );
    Ok(0)
}

/// Returns whether the whole is a picture, not a movie, and checks that the options fit it.
///
/// # Errors
/// Fails if its command is neither, or if an option has no effect on it.
fn is_picture(m: &ArgMatches, words: &[OsString]) -> Result<bool> {
    let name = words.first().map(|word| word.to_string_lossy());
    let (idle, whole) = match name.as_deref() {
        Some(whole @ "render") => ("chunk", whole),
        Some(whole @ "pull-focus") => ("parts", whole),
        name => {
            let name = name.unwrap_or_default();
            let text = format!("`{name}` makes neither a movie nor a picture");
            return Err(Diagnostic::unsupported(text)
                .with_help("begin the words after `--` with `pull-focus` or `render`"));
        }
    };
    if m.contains_id(idle) {
        let error = format!("`--{idle}` does nothing with `{whole}`");
        return Err(Diagnostic::error(error).with_help("leave it out"));
    }
    Ok(whole == "render")
}

/// Refuses a folder with the job files of another scheduler, which would start the tasks of this
/// job.
fn refuse_other_job(folder: &Path, scheduler: Scheduler) -> Result<()> {
    let others = Scheduler::NAMES.map(|(_, other)| other.start_file());
    let mut others = others
        .iter()
        .filter(|file| **file != scheduler.start_file());
    let Some(other) = others.find(|file| folder.join(file).exists()) else {
        return Ok(());
    };
    let other = folder.join(other);
    let text = format!("`{}` is of a job for another scheduler", other.display());
    Err(Diagnostic::error(text).with_help("remove it, or give `-o` another folder"))
}

/// Where and how the tasks run.
struct FarmFolder {
    /// The folder in which the command was given.
    here: String,
    /// The program on the machines of the farm.
    program: String,
    /// The number of processors of a task.
    cores: u32,
}

/// Creates a folder that may exist.
fn create_folder(folder: &Path) -> Result<()> {
    match std::fs::create_dir(folder) {
        Err(e) if !folder.is_dir() => Err(Diagnostic::io(folder.display(), &e)),
        _ => Ok(()),
    }
}

/// Divides a movie into tasks.
fn division<'f>(
    film: &'f MovieFilm,
    words: &[OsString],
    place: FarmFolder,
    pieces: impl Fn(&'f [u32]) -> Vec<&'f [u32]>,
) -> Result<Division> {
    let folder = unicode(film.folder.as_os_str())?;
    let program = ShellWord::Text(place.program);
    let mut task = vec![program.clone(), "pull-focus".into()];
    // A value may begin with a dash.
    task.push(ShellWord::Text(format!("--folder={folder}")));
    if let Some(length) = film.length {
        task.extend(["--length".into(), ShellWord::Text(length.to_string())]);
    }
    if !film.has_threads {
        task.extend(["--threads".into(), ShellWord::Text(place.cores.to_string())]);
    }
    task.extend(["--frames".into(), ShellWord::Argument]);
    for word in without_options(words, &["--frames", "--folder", "--length"]) {
        task.push(ShellWord::Text(unicode(&word)?));
    }
    let mut last = vec![program, "frames".into()];
    if let Some(movie) = &film.movie {
        let movie = unicode(movie.as_os_str())?;
        last.push(ShellWord::Text(format!("--output={movie}")));
    }
    last.extend(["--".into(), ShellWord::Text(folder)]);
    let purpose = match film.movie {
        Some(_) => "Makes the movie of the frames.",
        None => "Checks that all frames are done.",
    };
    let of_task = "Makes the frames that the first argument lists.";
    Ok(Division {
        task: script(of_task, &place.here, &[task]),
        arguments: pieces(&film.frames).into_iter().map(range_text).collect(),
        last: film.is_whole.then(|| script(purpose, &place.here, &[last])),
        cores: place.cores,
    })
}

/// Divides a picture into tasks.
fn division_of_picture(
    picture: DividedPicture,
    words: &[OsString],
    place: FarmFolder,
) -> Result<Division> {
    let folder = unicode(picture.folder.as_os_str())?;
    let file = |name: &str| format!("{folder}/{name}.ckpt");
    let program = ShellWord::Text(place.program);
    let mut task = vec![program.clone()];
    task.extend(picture.task);
    // A value may begin with a dash.
    task.push(ShellWord::Around(
        format!("--checkpoint={folder}/"),
        ".ckpt".into(),
    ));
    let threads = ["--threads".into(), ShellWord::Text(place.cores.to_string())];
    if !picture.has_threads {
        task.extend(threads.clone());
    }
    for word in without_options(words, picture.own) {
        task.push(ShellWord::Text(unicode(&word)?));
    }
    let all = |option: &str| ShellWord::Text(format!("{option}={}", file("all")));
    let mut merge = vec![
        program.clone(),
        "merge".into(),
        all("--output"),
        "--".into(),
    ];
    merge.extend(
        picture
            .arguments
            .iter()
            .map(|name| ShellWord::Text(file(name))),
    );
    let mut last = vec![program, "render".into(), all("--checkpoint")];
    if !picture.has_threads {
        last.extend(threads);
    }
    for word in words.iter().skip(1) {
        last.push(ShellWord::Text(unicode(word)?));
    }
    let of_task = "Makes the part of the picture that the first argument names.";
    let of_last = "Adds the parts, and writes the picture with its error.";
    Ok(Division {
        task: script(of_task, &place.here, &[task]),
        arguments: picture.arguments,
        last: Some(script(of_last, &place.here, &[merge, last])),
        cores: place.cores,
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

/// The options of pictures whose value can only be attached, by `=`.
const ATTACHED: [&str; 1] = ["--denoise"];

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
        // The value of a short option may follow its letter directly.
        let is_attached = !text.starts_with("--")
            && text
                .get(..2)
                .is_some_and(|short| text != short && options.contains(&short));
        if options.contains(&text) {
            if !ATTACHED.contains(&text) {
                words.next();
            }
        } else if !options.contains(&name) && !is_attached {
            rest.push(word.clone());
        }
    }
    rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_removed_with_their_values() {
        let words = "pull-focus --frames 9 a.iv --length=3 -o --folder x -rx -r y -- --frames";
        let words: Vec<OsString> = words.split(' ').map(OsString::from).collect();
        let rest = without_options(&words, &["--frames", "--folder", "--length", "-r"]);
        assert_eq!(rest, ["a.iv", "-o", "--", "--frames"]);
        let words = ["render", "a.iv", "--denoise", "-o", "a.exr", "--denoise=b"].map(Into::into);
        assert_eq!(without_options(&words, &["--denoise", "-o"]), ["a.iv"]);
    }

    fn place() -> FarmFolder {
        FarmFolder {
            here: "/a b".into(),
            program: "/bin/ivcam".into(),
            cores: 2,
        }
    }

    #[test]
    fn the_last_step_of_a_picture_adds_the_parts_of_the_tasks() {
        let line = "render a.iv --samples 128 -o x/a.exr --aov l.exr --layers uv -f 2";
        let words: Vec<OsString> = line.split(' ').map(OsString::from).collect();
        let picture = DividedPicture::of_command(&words, 2).unwrap();
        let division = division_of_picture(picture, &words, place()).unwrap();
        assert_eq!(division.arguments, ["0..64", "64..128"]);
        let task = "exec /bin/ivcam render --sample-range \"$1\" --checkpoint=x/a-parts/\"$1\".ckpt \
                    --threads 2 a.iv --samples 128 -f 2\n";
        assert!(division.task.ends_with(task), "{}", division.task);
        let last = "/bin/ivcam merge --output=x/a-parts/all.ckpt -- x/a-parts/0..64.ckpt \
                    x/a-parts/64..128.ckpt || exit\n\
                    exec /bin/ivcam render --checkpoint=x/a-parts/all.ckpt --threads 2 a.iv \
                    --samples 128 -o x/a.exr --aov l.exr --layers uv -f 2\n";
        let own = division.last.unwrap();
        assert!(own.ends_with(last), "{own}");
    }

    #[test]
    fn the_tasks_of_a_movie_have_its_frames_and_its_length() {
        let line = "pull-focus no-such.iv --from 1 --to 2 --frames 5 -o a.png";
        let words: Vec<OsString> = line.split(' ').map(OsString::from).collect();
        let film = MovieFilm::of_command(&words).unwrap();
        let division = division(&film, &words, place(), |f| pieces(f, Some(2), 9)).unwrap();
        assert_eq!(division.arguments, ["0-1", "2-3", "4-4"]);
        let task = division.task.lines().last().unwrap();
        assert_eq!(
            task,
            "exec /bin/ivcam pull-focus --folder=a-frames --length 5 --threads 2 --frames \"$1\" \
             no-such.iv --from 1 --to 2 -o a.png"
        );
        assert!(division.task.contains("cd '/a b' || exit 2"));
        let last = division.last.unwrap();
        assert!(last.ends_with("exec /bin/ivcam frames --output=a.png -- a-frames\n"));
        let part = words
            .iter()
            .map(|w| if w == "5" { "1-3:2".into() } else { w.clone() });
        let part = MovieFilm::of_command(&part.collect::<Vec<_>>()).unwrap();
        assert_eq!(part.frames, [1, 3]);
        assert!(!part.is_whole);
        let refused = [words, vec!["--denoise".into()]].concat();
        let error = MovieFilm::of_command(&refused).err().unwrap();
        assert!(error.message.contains("`--denoise`"), "{error}");
    }
}
