//! The warnings about options and tracks that have no effect on the frames of a movie.

use clap::ArgMatches;
use ivcam_base::diag::Diagnostic;

use crate::movie::Timeline;
use crate::photo::Optics;

/// Returns warnings about tracks that the optics do not have, and about options whose values the
/// tracks replace. A focus pull is a timeline with the track `focus` alone.
pub(super) fn movie_warnings(
    m: &ArgMatches,
    timeline: &Timeline,
    optics: &Optics,
) -> Vec<Box<Diagnostic>> {
    let tracks = [
        ("focus", "focus", !timeline.focus.is_empty()),
        ("zoom", "zoom", !timeline.zoom.is_empty()),
        ("aperture", "aperture", !timeline.aperture.is_empty()),
        ("time", "scene-time", !timeline.time.is_empty()),
    ];
    let mut warnings = Vec::new();
    let mut warn = |text: String, help: &str| {
        warnings.push(Diagnostic::warning(text).with_help(help));
    };
    for (track, option, _) in tracks.into_iter().filter(|(.., is_there)| *is_there) {
        let (name, does, sets) = match m.contains_id("animate") {
            true => (format!("the track `{track}`"), "does", "sets"),
            false => ("`--from` and `--to`".into(), "do", "set"),
        };
        if let Some(circumstance) = lacking(optics, track) {
            let text = format!("{circumstance}, {name} {does} nothing");
            warn(text, "name a lens, such as `--lens double-gauss`");
        } else if m.contains_id(option) {
            let text = format!("`--{option}` does nothing, because {name} {sets} it");
            warn(text, &format!("leave `--{option}` out"));
        }
    }
    let scales = !timeline.zoom.is_empty() && matches!(optics, Optics::Lens(_));
    if scales && m.contains_id("efl") {
        let text = "`--efl` and the track `zoom` both scale the lens";
        let help = "leave `--efl` out, or give the track factors of that focal length";
        warn(text.into(), help);
    }
    warnings
}

/// Returns why a track has no effect; `None` if it has one.
fn lacking(optics: &Optics, track: &str) -> Option<&'static str> {
    match (optics, track) {
        (_, "time") | (Optics::Lens(_), _) | (Optics::Ideal(_), "focus") => None,
        (Optics::Ideal(_), _) => Some("with an ideal lens"),
        (Optics::Pinhole, _) => Some("without a lens"),
    }
}
