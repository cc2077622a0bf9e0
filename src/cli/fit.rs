//! `ivcam compare SCENE PICTURE --fit FILE.dat`: finds the camera pose of an archival picture.

use std::io::Write;
use std::path::Path;

use clap::ArgMatches;

use super::{exit_code, print_warnings, render, text};
use crate::compare::Plate;
use crate::compare::camera_fit::CameraFit;
use crate::diag::{Diagnostic, Result};
use crate::photo::{Era, Session};
use crate::picture::write_whole;

/// Fits the camera, writes it to `file`, and returns the best rendering.
///
/// # Errors
/// Returns an error if an option or the scene is invalid, if the fit fails, or if a file cannot be
/// written.
pub(crate) fn run(
    matches: &ArgMatches,
    target: &Plate,
    file: &Path,
    out: &mut dyn Write,
) -> Result<Plate> {
    let mut plan = render::plan(matches, Era::Modern)?;
    plan.scene = text(matches, "new").unwrap_or_default().into();
    if plan.solids {
        return Err(
            Diagnostic::unsupported("a camera can't be fitted with `--solids`")
                .with_help("leave it out: the picture is the same without it"),
        );
    }
    let quiet = matches.get_flag("quiet");
    let mut session = Session::open(plan)?;
    print_warnings(&session.sink);
    let fit = CameraFit::of(&session)?;
    let mut progress = |(width, height): (usize, usize), cost: f64| {
        if !quiet {
            super::status!("{width}x{height}: remaining error {:.4}", cost.sqrt());
        }
    };
    let found = fit.search(&mut session, target, &mut progress)?;
    let text = fit.camera_text(&found.fitted);
    write_whole(file, |f| f.write_all(text.as_bytes()))?;
    exit_code(fit.report(&found.fitted, out))?;
    exit_code(writeln!(out, "camera     {}", file.display()))?;
    Ok(found.rendering)
}
