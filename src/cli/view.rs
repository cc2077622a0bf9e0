//! `ivcam view`, and `ivcam [flags] scene.iv` without `-batch`: the window.

use clap::{Arg, ArgMatches, Command};
use ivcam_base::diag::Result;

use super::flags;
use crate::photo::Era;

/// Returns the definition of the command.
pub(crate) fn command() -> Command {
    Command::new("view")
        .about("Composes a photograph in a window, with the real lens live on screen")
        .args_override_self(true)
        .args(flags::photograph().filter(|arg| arg.get_id() != "batch"))
        .after_help(flags::MORE)
        .arg(
            Arg::new("scene")
                .value_name("SCENE")
                .help("scene file; more may be dropped on the window"),
        )
}

/// Returns the state of the window that the arguments describe. Its picture is saved at the size
/// that is seen, unless they state one.
///
/// # Errors
/// Returns an error if a flag is invalid.
#[cfg(any(feature = "viewer", all(test, feature = "panels")))]
pub(crate) fn window_model(
    matches: &ArgMatches,
    era: Era,
) -> Result<crate::viewer::model::WindowModel> {
    let plan = super::render::window_plan(matches, era)?;
    let mut model = crate::viewer::model::WindowModel::new(plan);
    model.setup.as_shown = !matches.contains_id("size");
    Ok(model)
}

/// Opens the window, and returns the exit code when it is closed.
///
/// # Errors
/// Returns an error if a flag is invalid or if there is no display.
#[cfg(feature = "viewer")]
pub(crate) fn run(matches: &ArgMatches, era: Era) -> Result<i32> {
    let model = window_model(matches, era)?;
    let output = super::text(matches, "output").map(str::to_owned);
    let threads = super::render::threads(matches)?;
    crate::viewer::window::run(model, output, threads, |line| super::status!("{line}"))?;
    Ok(0)
}

/// Reports that the program was built without the window.
///
/// # Errors
/// Always returns an error.
#[cfg(not(feature = "viewer"))]
pub(crate) fn run(_: &ArgMatches, _: Era) -> Result<i32> {
    let error = "this ivcam was built without its window; `-batch` (or `ivcam render`) makes the picture without one";
    Err(ivcam_base::diag::Diagnostic::error(error).with_help(
        "`cargo build --release` builds it with the window, unless `--no-default-features` is said; no system package is needed",
    ))
}
