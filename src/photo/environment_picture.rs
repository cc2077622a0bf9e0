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
    let coded = |level: f32| plan.light.colors.light_of(level);
    let samples: Vec<f32> = match raster.samples {
        Samples::U8(levels) => levels
            .iter()
            .map(|v| coded(f32::from(*v) / 255.0))
            .collect(),
        Samples::U16(levels) => {
            let share = |v: &u16| coded(f32::from(*v) / 65_535.0);
            levels.iter().map(share).collect()
        }
        Samples::F32(samples) => samples,
    };
    let pixels = samples
        .chunks_exact(raster.channels.max(1))
        .map(|pixel| match *pixel {
            [r, g, b, ..] => Vec3::new(r, g, b),
            [gray, ..] => Vec3::splat(gray),
            [] => Vec3::ZERO,
        });
    EnvironmentLight::new(width, height, pixels.collect()).ok_or_else(|| {
        Diagnostic::error(format!("`{name}` has no pixels")).with_help(
            "`--environment-light` needs an equirectangular picture, twice as wide as high",
        )
    })
}
