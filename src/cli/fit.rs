//! `ivcam compare SCENE PICTURE --fit FILE.dat`: where the camera stood for an archival picture.

use std::io::Write;
use std::path::Path;

use clap::ArgMatches;

use super::{render, tell_all, text, written};
use crate::compare::Plate;
use crate::compare::camera_fit::CameraFit;
use crate::diag::{Diagnostic, Result};
use crate::photo::{Era, Session};
use crate::picture::write_whole;

/// Fits, writes the camera, and gives the best rendering.
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
                .with_help("leave it out: the picture is the same without"),
        );
    }
    let quiet = matches.get_flag("quiet");
    let mut session = Session::open(plan)?;
    tell_all(&session.sink);
    let fit = CameraFit::of(&session)?;
    let mut tell = |(width, height): (usize, usize), cost: f64| {
        if !quiet {
            super::say!("{width}x{height}: {:.4} left", cost.sqrt());
        }
    };
    let found = fit.search(&mut session, target, &mut tell)?;
    let text = fit.camera_text(&found.fitted);
    write_whole(file, |f| f.write_all(text.as_bytes()))?;
    written(fit.report(&found.fitted, out))?;
    written(writeln!(out, "camera     {}", file.display()))?;
    Ok(found.rendering)
}
