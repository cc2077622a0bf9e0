//! Finds the command that the arguments name, and runs it.

use std::ffi::OsString;
use std::io::Write as _;

use clap::{ArgMatches, Command};
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::is_output_closed;

use super::arguments::scene_argument;
use super::messages::{ERROR, exit_code, mute, print_diagnostic, set_typed};
use super::render_outputs::outputs_have_a_render;
use super::{
    catalog, check, compare, completions, converge, convert, convert_folder, expose, farm, flags,
    folder_of_scenes, frames, gallery, lens, licenses, man, merge, nodes, outputs, pull_focus,
    render, render_folder, stability, team, usage, view, vintage_help, wrong_file,
};
use crate::photo::options::command_line;
use crate::photo::{Era, Plan, Session};

/// Runs the program with its arguments, of which the first is its own name. Returns the exit code.
pub fn run(words: impl IntoIterator<Item = OsString>) -> i32 {
    let typed: Vec<OsString> = words.into_iter().collect();
    set_typed(&typed);
    // Without a handler the signal would end the program, and a limit on the size of files would
    // leave temporary files. With one, writing fails, and they are removed.
    #[cfg(unix)]
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, std::sync::Arc::default());
    if team::is_assistant() {
        mute();
    }
    let words = flags::modernize(typed.clone());
    match dispatch(&words, &typed) {
        Ok(code) => code,
        Err(error) => {
            print_diagnostic(&error);
            // `mpirun` ends all processes when one fails, and the first has yet to print the error.
            if team::is_assistant() { 0 } else { ERROR }
        }
    }
}

/// Takes the place of a standard output that is closed.
struct ClosedOutput;

impl std::io::Write for ClosedOutput {
    fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
        Err(std::io::Error::other("it is closed"))
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Returns standard output, not locked: a picture for it is written by the threads of the render.
fn standard_output() -> Box<dyn std::io::Write> {
    match is_output_closed() {
        true => Box::new(ClosedOutput),
        false => Box::new(std::io::stdout()),
    }
}

/// Opens the photograph of a command line (`ivcam render …`, or one of 1999) without rendering it.
/// Prints what the command would print before that. Returns the exit code if it cannot be opened.
///
/// # Errors
/// Returns the exit code of the command, which has printed why.
pub fn open(words: impl IntoIterator<Item = OsString>) -> std::result::Result<Session, i32> {
    with_photograph(words, render::open)
}

/// Returns the plan of a photograph's command line, as [`open`] does its session.
///
/// # Errors
/// Returns the exit code of the command, which has printed why.
pub fn plan(words: impl IntoIterator<Item = OsString>) -> std::result::Result<Plan, i32> {
    with_photograph(words, render::plan)
}

/// Does some work with the arguments of a photograph.
fn with_photograph<T>(
    words: impl IntoIterator<Item = OsString>,
    work: impl FnOnce(&ArgMatches, Era) -> Result<T>,
) -> std::result::Result<T, i32> {
    let typed: Vec<OsString> = words.into_iter().collect();
    set_typed(&typed);
    let words = flags::modernize(typed.clone());
    let opened = parsed_words(&words, &typed).and_then(|parsed| match &parsed {
        Err(code) => Ok(Err(*code)),
        Ok(matches) => match matches.subcommand() {
            None => work(matches, Era::Vintage).map(Ok),
            Some(("render", m)) => work(m, Era::Modern).map(Ok),
            Some((name, _)) => Err(Diagnostic::error(format!("`{name}` makes no photograph"))),
        },
    });
    opened.unwrap_or_else(|error| {
        print_diagnostic(&error);
        Err(ERROR)
    })
}

/// Parses the arguments. `words` are in today's spelling, `typed` are as they were typed. Returns
/// the exit code if they are answered already, such as `--help`.
fn parsed_words(
    words: &[OsString],
    typed: &[OsString],
) -> Result<std::result::Result<ArgMatches, i32>> {
    let named = words.get(1).and_then(|w| w.to_str()).unwrap_or_default();
    let is_command = commands().get_subcommands().any(|c| c.get_name() == named)
        || ["help", "--help", "-h", "--version", "-V"].contains(&named)
        || words.len() < 2;
    if !is_command {
        if vintage_help::is_asked(words) {
            let help = vintage_help::text();
            return exit_code(write!(standard_output(), "{help}")).map(Err);
        }
        check_first_word(named)?;
    }
    let modern_help = |word: &OsString| match word == "-help" {
        true => "--help".into(),
        false => word.clone(),
    };
    if !is_command || RENDERING.contains(&named) {
        if !vintage_help::is_asked(words) {
            check_flags(words)?;
        }
        vintage_help::check_values(typed.get(1..).unwrap_or_default())?;
    }
    let command = if is_command {
        commands()
    } else {
        vintage_command()
    };
    let parsed = command
        .clone()
        .try_get_matches_from(words.iter().map(modern_help));
    let matches = match parsed {
        Ok(matches) => matches,
        Err(error) => {
            if !error.use_stderr() {
                let printed = match is_output_closed() {
                    true => standard_output().write_all(b"\n"),
                    false => error.print(),
                };
                return exit_code(printed).map(Err);
            }
            let named = command.find_subcommand(named).unwrap_or(&command);
            return Err(usage::explained(&error, named, typed));
        }
    };
    match matches.subcommand() {
        None => outputs::check(&command, &matches)?,
        Some((name, m)) => {
            let named = command.find_subcommand(name);
            named.map_or(Ok(()), |named| outputs::check(named, m))?;
        }
    }
    match matches.subcommand() {
        None => outputs_have_a_render(None, &matches)?,
        Some((name, m)) => outputs_have_a_render(Some(name), m)?,
    }
    Ok(Ok(matches))
}

/// Parses the arguments and runs the command. `words` are in today's spelling, `typed` are as they
/// were typed.
fn dispatch(words: &[OsString], typed: &[OsString]) -> Result<i32> {
    let matches = match parsed_words(words, typed)? {
        Ok(matches) => matches,
        Err(code) => return Ok(code),
    };
    let result = run_command(&matches, words, &mut *standard_output());
    result.map_err(|error| {
        let m = matches.subcommand().map_or(&matches, |(_, m)| m);
        wrong_file::explained(m).unwrap_or(error)
    })
}

/// Runs the command of parsed arguments. `words` are the arguments in today's spelling.
fn run_command(
    matches: &ArgMatches,
    words: &[OsString],
    out: &mut dyn std::io::Write,
) -> Result<i32> {
    match matches.subcommand() {
        None if !matches.get_flag("batch") => view::run(matches, Era::Vintage),
        None => render::run(matches, Era::Vintage, words),
        Some(("render", m)) => match folder_of_scenes(m) {
            Some(folder) => render_folder::run(m, words, &folder),
            None => {
                render_folder::check_alone(m)?;
                render::run(m, Era::Modern, words)
            }
        },
        Some(("catalog", m)) => catalog::run(m),
        Some(("check", m)) => check::run(m, out),
        Some(("compare", m)) => compare::run(m, words, out),
        Some(("completions", m)) => completions::run(m, commands(), out),
        Some(("expose", m)) => expose::run(m, &command_line(words), out),
        Some(("farm", m)) => farm::run(m),
        Some(("frames", m)) => frames::run(m, out),
        Some(("pull-focus", m)) => pull_focus::run(m, words),
        Some(("converge", m)) => converge::run(m, out),
        Some(("convert", m)) => match folder_of_scenes(m) {
            Some(folder) => convert_folder::run(m, &folder),
            None => convert::run(m, out),
        },
        Some(("lens", m)) => lens::run(m, out),
        Some(("gallery", m)) => gallery::run(m, words),
        Some(("licenses", m)) => licenses::run(m, out),
        Some(("man", m)) => man::run(m, &commands(), out),
        Some(("merge", m)) => merge::run(m, &command_line(words)),
        Some(("nodes", m)) => nodes::run(m, out),
        Some(("stability", m)) => stability::run(m, out),
        Some(("view", m)) => view::run(m, Era::Modern),
        Some((name, _)) => Err(Diagnostic::error(format!(
            "the command `{name}` is not implemented"
        ))),
    }
}

/// The commands that have the flags of a render.
const RENDERING: [&str; 5] = ["render", "compare", "converge", "gallery", "pull-focus"];

/// Returns an error for an unknown flag with one dash, which clap would misread.
fn check_flags(words: &[OsString]) -> Result<()> {
    let Some(word) = flags::find_unknown(words.get(1..).unwrap_or_default()) else {
        return Ok(());
    };
    let error = Diagnostic::not_found(format!("there is no flag `{word}`"));
    let doubled = format!("-{word}");
    let known: Vec<String> = flags::spellings().collect();
    let known = known.iter().map(String::as_str);
    let near = known
        .clone()
        .find(|k| *k == doubled)
        .or_else(|| ivcam_base::diag::nearest(word, known));
    Err(match near {
        Some(near) => error.with_help(format!("did you mean `{near}`?")),
        None => error.with_help("`ivcam render --help` lists the flags"),
    })
}

/// Returns an error for a first argument that is neither a flag, a command nor a file. It is most
/// likely a misspelt command.
fn check_first_word(word: &str) -> Result<()> {
    let scene_like = word.starts_with('-') || word.contains(['.', '/', '\\']);
    if scene_like || std::path::Path::new(word).exists() {
        return Ok(());
    }
    let error = Diagnostic::not_found(format!("there is no command and no scene `{word}`"));
    let names = commands();
    let names = names.get_subcommands().map(clap::Command::get_name);
    Err(match ivcam_base::diag::nearest(word, names) {
        Some(near) => error.with_help(format!("did you mean `{near}`?")),
        None => error.with_help("`ivcam help` lists the commands"),
    })
}

/// Returns the error for a command that does not exist.
pub(super) fn unknown_command(name: &str) -> Box<Diagnostic> {
    let error = Diagnostic::not_found(format!("there is no command `{name}`"));
    let names = commands();
    let names = names.get_subcommands().map(clap::Command::get_name);
    match ivcam_base::diag::nearest(name, names) {
        Some(near) => error.with_help(format!("did you mean `{near}`?")),
        None => error.with_help("`ivcam help` lists the commands"),
    }
}

/// Returns the definition of `ivcam COMMAND …`.
pub(super) fn commands() -> Command {
    Command::new("ivcam")
        .version(env!("CARGO_PKG_VERSION"))
        .about("Photographs Open Inventor and VRML scenes through real lenses")
        .after_help(
            "As in 1999, without a command:\n  \
             ivcam -batch -j 16 -s r -f 1.2 -z 0.2 -camread camera/cam-1.dat scene.iv\n  \
             ivcam -batch -help     lists the spellings of 1999\n\n\
             Exit code 0: success; 1: pictures differ, a limit is exceeded, or something is lost\n\
             with --strict; 2: an error.",
        )
        .subcommand_required(true)
        .arg_required_else_help(true)
        .args_override_self(true)
        .subcommand(
            Command::new("render")
                .about("Makes the photograph of a scene through a lens")
                .args_override_self(true)
                .args(flags::photograph())
                .after_help(flags::MORE)
                .arg(render_folder::remake())
                .arg(scene_argument().help(
                    "scene file: .iv, .wrl, .x3d, .x3dv, .glb, .gltf, .obj, .ply, .stl, plain or .gz; \
                     - for standard input; or a folder, of \
                     whose scenes `-o OUT/` gets a picture each",
                )),
        )
        .subcommand(catalog::command())
        .subcommand(check::command())
        .subcommand(compare::command())
        .subcommand(converge::command())
        .subcommand(convert::command())
        .subcommand(expose::command())
        .subcommand(pull_focus::command())
        .subcommand(frames::command())
        .subcommand(gallery::command())
        .subcommand(farm::command())
        .subcommand(merge::command())
        .subcommand(lens::command())
        .subcommand(nodes::command())
        .subcommand(stability::command())
        .subcommand(view::command())
        .subcommand(licenses::command())
        .subcommand(man::command())
        .subcommand(completions::command())
}

/// Returns the definition of `ivcam [flags] scene.iv`, the command line of the 1999 program.
fn vintage_command() -> Command {
    Command::new("ivcam")
        .version(env!("CARGO_PKG_VERSION"))
        .about("Photographs a scene as the 1999 program did; see also `ivcam help`")
        .override_usage("ivcam [options] scene.iv")
        .disable_help_flag(true)
        .args_override_self(true)
        .args(flags::photograph())
        .arg(scene_argument())
}
