//! Reads the picture of the light of the surroundings.

use std::path::Path;

use glam::Vec3;
use ivcam_base::diag::{Diagnostic, Result, Sink, counted};
use ivcam_base::files::{MAX_PICTURE, read_file};
use ivcam_base::memory::MemoryBudget;
use ivcam_optics::picture::{Raster, Samples};
use ivcam_render::shade::EnvironmentLight;

use super::plan::Plan;

/// The help of messages about a picture that is no light of surroundings.
const NEEDS: &str = "`--environment-light` needs an equirectangular picture of amounts of light, twice as wide as high";

/// Reads an equirectangular picture as light. Levels of 8 and 16 bits are decoded as the plan
/// decodes colors; other samples are light. Negative numbers count as 0, and a pixel with a number
/// that is not finite is black; a warning says how many pixels have either. Another warns of a
/// picture that is not twice as wide as high.
///
/// # Errors
/// Returns an error if the file cannot be read, has no pixels, or does not fit into the memory.
pub(super) fn environment_picture(
    path: &Path,
    plan: &Plan,
    sink: &mut Sink,
) -> Result<EnvironmentLight> {
    let name = path.display().to_string();
    let bytes = read_file(path, MAX_PICTURE)?;
    let mut memory = MemoryBudget::new(plan.memory.bytes());
    let what = format!("the light of `{name}`");
    let raster = Raster::decode_within(&bytes, &name, &mut |size| memory.take(&what, size))?;
    let (width, height) = (raster.width as usize, raster.height as usize);
    // The radiances, and the table of choices with its makings.
    memory.take(&what, (width * height) as u64 * 48)?;
    let is_coded = !matches!(raster.samples, Samples::F32(_));
    let mut broken = 0;
    let light = |pixel: usize| {
        let color = Vec3::from(raster.color(pixel));
        if !color.is_finite() || color.min_element() < 0.0 {
            broken += 1;
        }
        if !color.is_finite() {
            return Vec3::ZERO;
        }
        let color = color.max(Vec3::ZERO);
        match is_coded {
            true => color.map(|level| plan.light.colors.light_of(level)),
            false => color,
        }
    };
    let pixels = (0..raster.pixels()).map(light).collect();
    let light = EnvironmentLight::new(width, height, pixels)
        .ok_or_else(|| Diagnostic::error(format!("`{name}` has no pixels")).with_help(NEEDS))?;
    if broken > 0 {
        let text = format!(
            "`{name}` has {} with numbers that are negative or not finite; negative numbers count \
             as 0, and a pixel with others as black",
            counted(broken, "pixel")
        );
        sink.add(*Diagnostic::warning(text).with_help(NEEDS));
    }
    if width.abs_diff(2 * height) > 1 {
        let text = format!(
            "`{name}` of {width}x{height} pixels is stretched around the scene, because it is not \
             twice as wide as high"
        );
        sink.add(*Diagnostic::warning(text).with_help(NEEDS));
    }
    Ok(light)
}
