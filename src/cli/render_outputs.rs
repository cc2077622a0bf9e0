//! Refuses options about the picture of a render in commands that make none, or several.

use clap::ArgMatches;
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
    const RENDER: &str = "use `ivcam render` or `-batch`";
    let helps = [
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
    for (option, help) in helps {
        let renders = renders || (option == "denoise" && is_catalog);
        if !renders && m.try_contains_id(option).unwrap_or_default() {
            let error = format!("`--{option}` goes with a render, and no picture is rendered here");
            return Err(Diagnostic::error(error).with_help(help));
        }
    }
    let (command, of_one) = match command {
        Some(name @ "pull-focus") => (name, &OF_ONE_RENDER[..2]),
        Some(name @ "converge") => (name, &OF_ONE_RENDER[..]),
        _ => return Ok(()),
    };
    match of_one.iter().find(|(option, _)| m.contains_id(option)) {
        None => Ok(()),
        Some((option, help)) => {
            let error = format!("`--{option}` is not for `ivcam {command}`");
            Err(Diagnostic::unsupported(error).with_help(*help))
        }
    }
}

/// The options of one render that a convergence run does not have, with what to do instead. A movie
/// does not have the first two.
const OF_ONE_RENDER: [(&str, &str); 5] = [
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
];
