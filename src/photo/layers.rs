//! The layers of a picture: what each pixel shows, what its samples cost, and how wrong it is.

use indexmap::IndexMap;
use ivcam_base::diag::Result;
use ivcam_optics::picture::{ChannelImage, Picture};
use ivcam_render::render::{Exposure, SurfaceSum};

use super::memory::take_layers;
use super::session::Session;

/// The depth of a pixel that meets no surface, in meters. Programs that composite pictures take it
/// for a far background, and infinity for an error.
const FAR: f64 = 1e10;
/// The largest number of samples by which surfaces are found. More do not change what a pixel
/// shows by as much as the picture's noise.
pub(super) const MOST_SAMPLES: u32 = 256;

impl Session {
    /// Takes the memory for the picture's surfaces and layers, before the render.
    ///
    /// # Errors
    /// Fails if they do not fit.
    pub fn take_layers(&mut self) -> Result<()> {
        let size = self.region().resolution();
        take_layers(&mut self.memory, size, self.plan.layers)
    }

    /// Returns what the first samples of each pixel of an exposure meet, at most 256. Uses rayon's
    /// current pool.
    pub fn surfaces_of(&self, exposure: &Exposure) -> Vec<SurfaceSum> {
        self.surfaces(exposure.samples.min(MOST_SAMPLES))
    }

    /// Returns the layers of an exposure, with the developed picture in R, G and B:
    ///
    /// | channels | meaning |
    /// |---|---|
    /// | `A` | the share of the samples through the lens that meet a surface |
    /// | `Z` | the depth along the viewing direction, in meters |
    /// | `P.X`, `P.Y`, `P.Z` | the position in the scene, in meters |
    /// | `N.X`, `N.Y`, `N.Z` | the normal on the side that is seen |
    /// | `albedo.R` … | the diffuse color with its texture |
    /// | `error.R` … | the standard error of the picture |
    /// | `samples.Y` | the samples taken for the picture |
    /// | `lost.Y` | the share of the samples whose ray was lost in the lens |
    ///
    /// Surfaces are means over the samples that meet one, by the picture's first samples, at most
    /// 256, at the lens's own wavelength. Depth, position and normal are those of the first
    /// surface, transparent or not.
    pub fn layers(
        &self,
        exposure: &Exposure,
        picture: &Picture,
        surfaces: &[SurfaceSum],
    ) -> ChannelImage {
        let film = &exposure.film;
        let mut image = ChannelImage {
            width: picture.width,
            height: picture.height,
            channels: IndexMap::new(),
            provenance: picture.provenance.clone(),
        };
        let share = |part: u32, of: u32| f64::from(part) / f64::from(of.max(1));
        let position = |s: &SurfaceSum| s.mean(s.position) + self.scene.origin;
        let depth = |s: &SurfaceSum| {
            let view = position(s) - self.pose.position;
            view.dot(self.pose.direction())
        };
        image.add(["R", "G", "B"], |i| picture.pixels[i].map(f64::from));
        image.add(["A"], |i| [share(surfaces[i].met, surfaces[i].passed)]);
        image.add(["Z"], |i| match surfaces[i].met {
            0 => [FAR],
            _ => [depth(&surfaces[i])],
        });
        image.add(["P.X", "P.Y", "P.Z"], |i| match surfaces[i].met {
            0 => [0.0; 3],
            _ => position(&surfaces[i]).to_array(),
        });
        image.add(["N.X", "N.Y", "N.Z"], |i| {
            surfaces[i].normal.normalize_or_zero().to_array()
        });
        image.add(["albedo.R", "albedo.G", "albedo.B"], |i| {
            surfaces[i].mean(surfaces[i].albedo).to_array()
        });
        image.add(["error.R", "error.G", "error.B"], |i| {
            film.standard_error(i).to_array()
        });
        image.add(["samples.Y"], |i| [f64::from(film.samples(i))]);
        image.add(["lost.Y"], |i| {
            [1.0 - share(surfaces[i].passed, surfaces[i].samples)]
        });
        image
    }
}
