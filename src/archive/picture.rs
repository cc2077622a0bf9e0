//! Makes the picture of one scene of an archive.

use std::path::Path;

use ivcam_base::diag::{Diagnostic, Result, Severity};
use ivcam_base::files::folder_of;
use ivcam_base::platform::real_path;
use ivcam_optics::picture::Picture;
use ivcam_render::render::Counts;

use crate::photo::{Denoiser, Plan, Session};

/// The result of [`make_picture`].
#[derive(Debug)]
pub(crate) struct MadePicture {
    /// Whether the scene has nothing to draw. No picture is written then.
    pub is_empty: bool,
    /// Why the picture shows nothing, if it has one color everywhere.
    pub one_color: Option<String>,
    /// The warnings about the scene and the picture.
    pub problems: Vec<Diagnostic>,
}

/// Photographs the plan's scene, and writes the picture to `output`, whose folder is created.
/// `command` is the command line for the picture's metadata. If the denoiser fails, the picture is
/// written without it.
///
/// # Errors
/// Returns an error if the scene cannot be read, the lens cannot focus, the denoiser fails, or the
/// picture cannot be written or would replace a file that the scene uses.
pub(crate) fn make_picture(
    plan: Plan,
    output: &Path,
    command: &str,
    denoiser: Option<&Denoiser>,
) -> Result<MadePicture> {
    let session = Session::open_once(plan)?;
    let is_problem = |d: &&Diagnostic| d.severity >= Severity::Warning;
    let items = session.sink.items().iter();
    let mut made = MadePicture {
        is_empty: session.draws_nothing,
        one_color: None,
        problems: items.filter(is_problem).cloned().collect(),
    };
    if made.is_empty {
        return Ok(made);
    }
    let uses = session.document.opened_files();
    if real_path(output).is_ok_and(|real| uses.contains(&real)) {
        let text = format!(
            "the scene uses `{}`, which its picture would replace",
            output.display()
        );
        return Err(Diagnostic::error(text).with_help("choose another output folder"));
    }
    let exposure = session.expose(&|_| {});
    if let Some(stopped) = &exposure.stopped {
        if exposure.is_blank() {
            return Err(session.too_late());
        }
        made.problems
            .push(*session.ended_within_pass(&exposure, stopped));
    }
    let picture = session.develop(&exposure, command);
    let warning = session.warn_if_black_or_clipped(&exposure.counts, &picture);
    made.problems.extend(warning.map(|w| *w));
    made.one_color = one_color(&session, &exposure.counts, &picture).map(|why| why.message);
    let folder = folder_of(output);
    std::fs::create_dir_all(&folder).map_err(|e| Diagnostic::io(folder.display(), &e))?;
    let (kept, denoised) = match denoiser {
        None => (picture, Ok(())),
        Some(denoiser) => session.denoised_or_kept(picture, &exposure, denoiser),
    };
    kept.save(output, session.plan.depth)?;
    denoised.map(|()| made).map_err(|error| {
        error.with_help(format!(
            "`{}` is the picture without denoising",
            output.display()
        ))
    })
}

/// Returns why a picture stands for nothing, if it has one color everywhere.
pub(crate) fn one_color(
    session: &Session,
    counts: &Counts,
    picture: &Picture,
) -> Option<Box<Diagnostic>> {
    if picture.pixels.windows(2).any(|pair| pair[0] != pair[1]) {
        return None;
    }
    let warning = session.warn_if_black_or_clipped(counts, picture);
    Some(warning.unwrap_or_else(|| Diagnostic::error("the picture has one color everywhere")))
}
