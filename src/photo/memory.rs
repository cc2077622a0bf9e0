//! How much memory a photograph needs for its film, and how much of the film is made at once.
//!
//! The film is the first to take memory of a plan's limit, before any file is read. The scene gets
//! what it leaves. A film that does not fit is rendered in strips where that is possible.

use ivcam_base::diag::Result;
use ivcam_base::memory::MemoryBudget;
use ivcam_optics::film::{Region, Resolution};
use ivcam_render::render::diffraction::diffraction_bytes;

use super::layer_choice::FurtherLayers;
use super::plan::{Optics, Plan};

/// The bytes of a pixel while a picture is rendered: the film's 56, as many for samples after the
/// last whole unit, and those of the error estimate. Developing and writing it take no more.
const PIXEL_BYTES: u64 = 114;
/// The bytes of a pixel in an image of the lights' ghosts, of which there are two at a time.
const GHOST_BYTES: u64 = 96;
/// The bytes of a pixel in layers of two channels, with the values that they are made of.
const PLANE_BYTES: u64 = 40;
/// The bytes of a pixel in the layers of `--aov`.
const LAYER_BYTES: u64 = 170;
/// The bytes of a pixel in mattes: two lists of at most 16 names with their shares, and as many
/// channels.
const MATTE_BYTES: u64 = 2 * (24 + 16 * (8 + 8));
/// The bytes of a pixel of the whole picture in the pilot pass of adaptive sampling.
const PILOT_BYTES: u64 = 5;
/// The largest number of pixels of a strip. Threads wait for each other once a strip, which costs
/// nothing here, and more would only take more memory.
const STRIP_PIXELS: u64 = 1 << 22;
/// The part of the memory that a strip may take, so that most is left for the scene.
const STRIP_PART: u64 = 4;

/// Returns the size of the film that a plan exposes.
fn exposed(plan: &Plan) -> Resolution {
    let all = Region::whole(plan.resolution);
    plan.region.unwrap_or(all).resolution()
}

/// Returns the bytes that a plan's film needs as a whole.
fn whole_film_bytes(plan: &Plan) -> u64 {
    let ghosts = if plan.ghosts { GHOST_BYTES } else { 0 };
    let film = exposed(plan).pixels() as u64 * (PIXEL_BYTES + ghosts);
    let diffraction = if plan.diffraction && matches!(plan.optics, Optics::Lens(_)) {
        diffraction_bytes(plan.resolution)
    } else {
        0
    };
    film.saturating_add(diffraction) + pilot_bytes(plan)
}

/// Returns the bytes that a plan's pilot pass needs.
fn pilot_bytes(plan: &Plan) -> u64 {
    match plan.adaptive {
        true => plan.resolution.pixels() as u64 * PILOT_BYTES,
        false => 0,
    }
}

/// Returns what needs the whole film of a plan at once, if anything does.
fn needs_whole_film(plan: &Plan) -> Option<&'static str> {
    let options = [
        (plan.diffraction, "`--diffraction`"),
        (plan.ghosts, "`--ghosts`"),
        (plan.stop.error.is_some(), "`--target-error`"),
        (plan.stop.time.is_some(), "`--time`"),
    ];
    let option = options.into_iter().find(|(used, _)| *used);
    plan.whole_film.or(option.map(|(_, name)| name))
}

/// Returns the largest number of pixels of a strip, or `None` if the film is rendered as a whole.
/// A film that does not fit is rendered in strips, unless something needs all of it.
pub(crate) fn strip_pixels(plan: &Plan) -> Option<usize> {
    let memory = plan.memory.bytes();
    let fits = whole_film_bytes(plan) <= memory;
    let strip = (memory / STRIP_PART / PIXEL_BYTES).min(STRIP_PIXELS);
    (!fits && needs_whole_film(plan).is_none()).then_some(strip as usize)
}

/// Returns the bytes that a plan's film needs.
pub(crate) fn film_bytes(plan: &Plan) -> u64 {
    match strip_pixels(plan) {
        None => whole_film_bytes(plan),
        Some(pixels) => pixels as u64 * PIXEL_BYTES + pilot_bytes(plan),
    }
}

/// Returns the plan's memory without that of its film. What is left is for the scene.
///
/// # Errors
/// Fails if the film does not fit.
pub(crate) fn memory_beside_film(plan: &Plan) -> Result<MemoryBudget> {
    let mut memory = MemoryBudget::new(plan.memory.bytes());
    let Resolution { width, height } = exposed(plan);
    let bytes = film_bytes(plan);
    let each = bytes / (u64::from(width) * u64::from(height)).max(1);
    let film = match strip_pixels(plan) {
        None => format!("a film of {width}x{height} pixels, at {each} bytes each,"),
        Some(_) => format!("a film of {width}x{height} pixels, in strips,"),
    };
    memory.take(film, bytes).map_err(|error| {
        let help = "`--memory SIZE` raises the limit, and `--size` makes the film smaller";
        error.with_help(match needs_whole_film(plan) {
            None => help.to_owned(),
            Some(what) => format!("{help}; {what} needs the whole film at once"),
        })
    })?;
    Ok(memory)
}

/// Takes the memory for the layers of `--aov` from what a film has left.
///
/// # Errors
/// Fails if they do not fit.
pub(crate) fn take_layers(
    memory: &mut MemoryBudget,
    resolution: Resolution,
    layers: FurtherLayers,
) -> Result<()> {
    let Resolution { width, height } = resolution;
    let further = [
        (layers.mattes, MATTE_BYTES),
        (layers.coordinates, PLANE_BYTES),
        (layers.motion.is_some(), PLANE_BYTES),
    ];
    let further = further.iter().filter(|(is_made, _)| *is_made);
    let each = LAYER_BYTES + further.map(|(_, bytes)| bytes).sum::<u64>();
    let bytes = u64::from(width) * u64::from(height) * each;
    memory.take(format!("the layers of {width}x{height} pixels"), bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photo::Era;
    use ivcam_base::memory::MemoryLimit;

    #[test]
    fn a_film_that_does_not_fit_is_an_error_that_states_its_bytes() {
        let mut plan = Plan::of_era(Era::Modern, "no-such-scene.iv");
        plan.resolution = Resolution::new(65_536, 16_384).unwrap();
        plan.memory = MemoryLimit::Bytes(4 << 30);
        let error = crate::Session::open(plan.clone()).err().expect("an error");
        assert_eq!(
            error.message,
            "a film of 65536x16384 pixels, at 114 bytes each, needs 114 GB of memory, \
             and 4.0 GB of 4.0 GB are left"
        );
        assert!(error.help.unwrap_or_default().contains("--size"));
        assert_eq!(strip_pixels(&plan), None);
        plan.whole_film = None;
        assert_eq!(strip_pixels(&plan), Some(STRIP_PIXELS as usize));
        assert!(memory_beside_film(&plan).is_ok());
        plan.diffraction = true;
        let error = memory_beside_film(&plan).unwrap_err();
        assert!(error.help.unwrap_or_default().contains("`--diffraction`"));
        plan.diffraction = false;
        plan.resolution = Resolution::VINTAGE;
        let left = memory_beside_film(&plan).unwrap().remaining();
        assert_eq!(left, (4 << 30) - 360 * 240 * 114);
        plan.diffraction = true;
        assert!(memory_beside_film(&plan).unwrap().remaining() < left);
    }
}
