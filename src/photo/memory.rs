//! How much memory a photograph needs for its film.
//!
//! The film is the first to take memory of a plan's limit, before any file is read. The scene gets
//! what it leaves.

use super::plan::{Optics, Plan};
use crate::diag::Result;
use crate::film::Resolution;
use crate::memory::MemoryBudget;
use crate::render::diffraction::diffraction_bytes;

/// The bytes of a pixel while a picture is rendered, developed and written: the film, the passes
/// that are added to it, the developed picture and the written one. Measured from 3 to 12 million
/// pixels.
const PIXEL_BYTES: u64 = 114;
/// The bytes of a pixel in an image of the lights' ghosts, of which there are two at a time.
const GHOST_BYTES: u64 = 48;
/// The bytes of a pixel in the layers of `--aov`.
const LAYER_BYTES: u64 = 170;

/// Returns the bytes that a plan's film needs.
pub(crate) fn film_bytes(plan: &Plan) -> u64 {
    let Resolution { width, height } = plan.resolution;
    let ghosts = if plan.ghosts { GHOST_BYTES } else { 0 };
    let film = u64::from(width) * u64::from(height) * (PIXEL_BYTES + ghosts);
    let diffraction = if plan.diffraction && matches!(plan.optics, Optics::Lens(_)) {
        diffraction_bytes(plan.resolution)
    } else {
        0
    };
    film.saturating_add(diffraction)
}

/// Returns the plan's memory without that of its film. What is left is for the scene.
///
/// # Errors
/// Fails if the film does not fit.
pub(crate) fn memory_beside_film(plan: &Plan) -> Result<MemoryBudget> {
    let mut memory = MemoryBudget::new(plan.memory.bytes());
    let Resolution { width, height } = plan.resolution;
    let bytes = film_bytes(plan);
    let each = bytes / (u64::from(width) * u64::from(height)).max(1);
    let film = format!("a film of {width}x{height} pixels, at {each} bytes each,");
    memory.take(film, bytes).map_err(|error| {
        error.with_help("`--memory SIZE` raises the limit, and `--size` makes the film smaller")
    })?;
    Ok(memory)
}

/// Takes the memory for the layers of `--aov` from what a film has left.
///
/// # Errors
/// Fails if they do not fit.
pub(crate) fn take_layers(memory: &mut MemoryBudget, resolution: Resolution) -> Result<()> {
    let Resolution { width, height } = resolution;
    let bytes = u64::from(width) * u64::from(height) * LAYER_BYTES;
    memory.take(format!("the layers of {width}x{height} pixels"), bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::MemoryLimit;
    use crate::photo::Era;

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
        plan.resolution = Resolution::VINTAGE;
        let left = memory_beside_film(&plan).unwrap().remaining();
        assert_eq!(left, (4 << 30) - 360 * 240 * 114);
        plan.diffraction = true;
        assert!(memory_beside_film(&plan).unwrap().remaining() < left);
    }
}
