//! `ivcam compare SCENE PICTURE --fit FILE.dat`: finds the camera pose of an archival picture.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::ArgMatches;
use ivcam_base::diag::{Diagnostic, Result, Severity};
use ivcam_base::files::write_whole;
use ivcam_optics::lens::shipped_names;

use super::messages::print_first;
use super::{exit_code, print_warnings, render, text};
use crate::compare::camera_fit::{CameraFit, FoundCamera, check_plan};
use crate::compare::fit::FitStep;
use crate::compare::lens_ranking::{ANY, LensQuestion, LensRanking, with_focal_length};
use crate::compare::{Mask, Plate, Selection};
use crate::photo::{Era, LensChoice, Optics, Plan, Session};

/// Fits the camera to the selected pixels, writes it to `file`, and returns it with its rendering.
/// A refused camera is left in a file beside it.
///
/// # Errors
/// Returns an error if an option or the scene is invalid, if the fit fails, or if a file cannot be
/// written.
pub(crate) fn run(
    matches: &ArgMatches,
    (target, selection): (&Plate, &Selection),
    file: &Path,
    out: &mut dyn Write,
) -> Result<FoundCamera> {
    let mut plan = render::plan(matches, Era::Modern)?;
    plan.scene = text(matches, "new").unwrap_or_default().into();
    check_plan(&plan)?;
    let quiet = matches.get_flag("quiet");
    let usual = take_any(&mut plan)?;
    let mut session = Session::open(plan)?;
    print_warnings(&session.sink);
    let bar = progress_bar(quiet);
    let size = session.plan.resolution;
    let size = (size.width as usize, size.height as usize);
    let mask = selection.of(size, text(matches, "new").unwrap_or_default())?;
    let mut fit = match &usual {
        None => CameraFit::of(&session)?.with_mask(mask)?,
        Some(usual) => {
            let ranking = rank(&mut session, (target, mask), usual, &bar)?;
            exit_code(ranking.report(out))?;
            ranking.fit()
        }
    };
    if matches.get_flag("fit-aperture") {
        fit = fit.with_aperture()?;
    }
    let said = session.sink.items().len();
    let clock = Instant::now();
    let best_so_far = best_so_far(file);
    let mut is_kept = false;
    let mut report = |step: &FitStep<'_>, left: Duration| {
        // Every improvement is kept, so that an interrupted fit leaves its best camera. Where no
        // file can be beside `file`, which may be a device, none is kept.
        let text = fit.camera_text(step.values);
        is_kept = write_whole(&best_so_far, |f| f.write_all(text.as_bytes())).is_ok();
        let (width, height) = step.size;
        let residual = 100.0 * step.cost.max(0.0).sqrt();
        let line = format!(
            "{width}x{height}: residual {residual:.1}%, about {} left",
            minutes(left)
        );
        let taken = clock.elapsed();
        let done = taken.div_duration_f64((taken + left).max(Duration::from_millis(1)));
        bar.set_position((1000.0 * done) as u64);
        bar.set_message(line.clone());
        if step.size_finished && !quiet {
            bar.suspend(|| super::status!("{line}"));
        }
    };
    let found = fit.search(&mut session, target, &mut report);
    bar.finish_and_clear();
    let news = session.sink.items()[said..].iter();
    print_first(news.filter(|d| d.severity >= Severity::Warning));
    let written = found.and_then(|found| {
        write_whole(file, |f| f.write_all(found.camera.file.as_bytes()))?;
        Ok(found)
    });
    let found = match written {
        Err(mut error) if is_kept => {
            let kept = format!(
                "the camera where the fit ended is in {}",
                best_so_far.display()
            );
            let help = error
                .help
                .take()
                .map_or(kept.clone(), |help| format!("{help}; {kept}"));
            return Err(error.with_help(help));
        }
        written => written?,
    };
    // The fit may have ended before its first improvement.
    let _ = std::fs::remove_file(&best_so_far);
    exit_code(found.camera.report(out))?;
    exit_code(writeln!(out, "camera     {}", file.display()))?;
    Ok(found)
}

/// Returns the file that has the best camera while a fit goes on.
fn best_so_far(file: &Path) -> PathBuf {
    let mut name = file.as_os_str().to_os_string();
    name.push(".part");
    name.into()
}

/// Replaces the lens of a plan by a pinhole if it stands for every shipped one, and returns what
/// they share.
///
/// # Errors
/// Fails for `--zoom`, because the lenses get the same focal length.
fn take_any(plan: &mut Plan) -> Result<Option<LensChoice>> {
    let Some(usual) = plan.lens().filter(|lens| lens.name == ANY).cloned() else {
        return Ok(None);
    };
    if usual.zoom != 1.0 {
        let error = Diagnostic::unsupported("`--zoom` has no effect with `--lens any`");
        return Err(error.with_help("`--efl` is the focal length to start from, of every lens"));
    }
    plan.optics = Optics::Pinhole;
    plan.distortion = [0.0; 2];
    Ok(Some(usual))
}

/// Ranks the shipped lenses, starting from the focal length that they share.
fn rank(
    session: &mut Session,
    (target, mask): (&Plate, Option<Mask>),
    usual: &LensChoice,
    bar: &indicatif::ProgressBar,
) -> Result<LensRanking> {
    if let Some(efl) = usual.efl {
        with_focal_length(session, efl)?;
    }
    let names: Vec<&str> = shipped_names().collect();
    let question = LensQuestion {
        target,
        usual,
        names: &names,
        mask,
    };
    let mut report = |name: &str, left: Duration| {
        bar.set_message(format!("trying {name}, about {} left", minutes(left)));
    };
    bar.set_message("finding the camera with a pinhole");
    LensRanking::of(session, &question, &mut report)
}

/// Returns a progress bar of a thousand parts, on a terminal only.
fn progress_bar(quiet: bool) -> indicatif::ProgressBar {
    if quiet || !std::io::stderr().is_terminal() {
        return indicatif::ProgressBar::hidden();
    }
    let bar = indicatif::ProgressBar::new(1000);
    if let Ok(style) = indicatif::ProgressStyle::with_template("{bar:30} {percent}%  {msg}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

/// Returns a length of time as minutes and seconds.
fn minutes(time: Duration) -> String {
    let seconds = time.as_secs_f64().round() as u64;
    format!("{}:{:02}", seconds / 60, seconds % 60)
}
