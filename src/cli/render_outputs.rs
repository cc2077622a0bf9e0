//! Refuses options about the picture of a render in commands that make none, or several.

use clap::{Arg, ArgMatches};
use ivcam_base::diag::{Diagnostic, Result};

/// Refuses `--write-camera`, `--aov`, `--layers`, `--denoise`, `--tev`, `--checkpoint` and what
/// goes with it where no picture is rendered, and what is of one render for a movie and a
/// convergence run. Without a command the form is that of 1999.
///
/// # Errors
/// Returns an error that names the option.
pub(super) fn outputs_have_a_render(command: Option<&str>, m: &ArgMatches) -> Result<()> {
    let renders = match command {
        None => m.get_flag("batch"),
        Some(name) => name == "render",
    };
    let is_catalog = command == Some("catalog");
    for (option, help) in OF_A_RENDER {
        let renders = renders || (option == "denoise" && is_catalog);
        if !renders && m.try_contains_id(option).unwrap_or_default() {
            let error = format!("`--{option}` goes with a render, and no picture is rendered here");
            return Err(Diagnostic::error(error).with_help(help));
        }
    }
    let command = command.unwrap_or_default();
    let mut of_one = not_for(command).iter();
    match of_one.find(|(option, _)| m.try_contains_id(option).unwrap_or_default()) {
        None => Ok(()),
        Some((option, help)) => {
            let error = format!("`--{option}` is not for `ivcam {command}`");
            Err(Diagnostic::unsupported(error).with_help(*help))
        }
    }
}

const LINEAR: &str = "leave it out: the linear light on the film is compared";

/// Returns an argument that the help of a command without a picture of its own does not list if the
/// command refuses it: here, or as one of `others`.
pub(super) fn listed(arg: Arg, command: &str, others: &[&str]) -> Arg {
    let here = OF_A_RENDER.iter().chain(not_for(command));
    let mut refused = here.map(|(option, _)| option).chain(others);
    let is_refused = refused.any(|option| arg.get_id() == option);
    let is_hidden = arg.is_hide_set() || is_refused;
    arg.hide(is_hidden)
}

/// Returns the options of one render that a command does not have, with what to do instead.
fn not_for(command: &str) -> &'static [(&'static str, &'static str)] {
    match command {
        "pull-focus" => &OF_ONE_RENDER[..2],
        "converge" => &OF_ONE_RENDER,
        _ => &[],
    }
}

const RENDER: &str = "use `ivcam render` or `-batch`";

/// The options about the picture of a render, with the commands that have them.
const OF_A_RENDER: [(&str, &str); 8] = [
    (
        "write-camera",
        "use `ivcam render` or `-batch`, or the window's *Write camera*",
    ),
    ("aov", RENDER),
    ("layers", RENDER),
    ("denoise", RENDER),
    ("checkpoint", RENDER),
    ("every", RENDER),
    ("sample-range", RENDER),
    ("tev", RENDER),
];

/// The options of one render that a convergence run does not have, with what to do instead. A movie
/// does not have the first two.
const OF_ONE_RENDER: [(&str, &str); 8] = [
    (
        "report",
        "leave it out: the report is that of one picture of `ivcam render`",
    ),
    (
        "progress",
        "leave it out: a line is printed for each picture that is done",
    ),
    (
        "target-error",
        "leave it out: `--samples` is the largest number of samples",
    ),
    (
        "time",
        "leave it out: `--samples` is the largest number of samples",
    ),
    ("sampler", "name the samplers in `--methods`"),
    ("depth", LINEAR),
    ("response", LINEAR),
    ("white-balance", LINEAR),
];
