//! Reads the picture of the light of the surroundings.

use std::path::Path;

use glam::Vec3;
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::{MAX_PICTURE, read_file};
use ivcam_base::memory::MemoryBudget;
use ivcam_optics::picture::{Raster, Samples};
use ivcam_render::shade::EnvironmentLight;

use super::plan::Plan;

/// Reads an equirectangular picture as light. Levels of 8 and 16 bits are decoded as the plan
/// decodes colors; other samples are light.
///
/// # Errors
/// Returns an error if the file cannot be read, has no pixels, or does not fit into the memory.
pub(super) fn environment_picture(path: &Path, plan: &Plan) -> Result<EnvironmentLight> {
    let name = path.display().to_string();
    let bytes = read_file(path, MAX_PICTURE)?;
    let mut memory = MemoryBudget::new(plan.memory.bytes());
    let what = format!("the light of `{name}`");
    let raster = Raster::decode_within(&bytes, &name, &mut |size| memory.take(&what, size))?;
    let (width, height) = (raster.width as usize, raster.height as usize);
    // The radiances, and the table of choices with its makings.
    memory.take(&what, (width * height) as u64 * 48)?;
    let is_coded = !matches!(raster.samples, Samples::F32(_));
    let light = |pixel: usize| {
        let color = Vec3::from(raster.color(pixel));
        match is_coded {
            true => color.map(|level| plan.light.colors.light_of(level)),
            false => color,
        }
    };
    let pixels = (0..raster.pixels()).map(light);
    EnvironmentLight::new(width, height, pixels.collect()).ok_or_else(|| {
        Diagnostic::error(format!("`{name}` has no pixels")).with_help(
            "`--environment-light` needs an equirectangular picture, twice as wide as high",
        )
    })
}
