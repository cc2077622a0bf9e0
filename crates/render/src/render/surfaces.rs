//! The surfaces that a picture shows: what the samples of each pixel meet first.
//!
//! The samples are those of the picture, so a blurred edge is blurred here too. Surfaces behind
//! glass, in mirrors and through transparent surfaces are not looked for.

use glam::DVec3;
use ivcam_optics::film::Region;
use ivcam_optics::sampling::Sampler;
use rayon::prelude::*;

use super::batch::Batch;
use super::passes::Render;
use super::tile::Tile;
use crate::scene::Point;

/// The surfaces that the samples of one pixel meet, as sums.
#[derive(Clone, Copy, Debug, Default)]
pub struct SurfaceSum {
    /// The samples that were taken.
    pub samples: u32,
    /// The samples whose ray passed through the lens.
    pub passed: u32,
    /// The samples whose ray met a surface.
    pub met: u32,
    /// The sum of the positions, in meters from the scene's origin.
    pub position: DVec3,
    /// The sum of the unit normals, on the side that was seen.
    pub normal: DVec3,
    /// The sum of the diffuse colors with their textures.
    pub albedo: DVec3,
}

impl SurfaceSum {
    /// Adds a ray that passed through the lens, with the point that it met.
    pub(super) fn add(&mut self, point: Option<&Point<'_>>) {
        self.passed += 1;
        let Some(point) = point else { return };
        self.met += 1;
        self.position += point.position.as_dvec3();
        let seen = match point.normal.dot(point.geometric) < 0.0 {
            true => -point.normal,
            false => point.normal,
        };
        self.normal += seen.as_dvec3();
        self.albedo += point.textured(point.diffuse).as_dvec3();
    }

    /// Returns the mean of a sum over the samples that met a surface; zero if none did.
    pub fn mean(&self, sum: DVec3) -> DVec3 {
        sum / f64::from(self.met.max(1))
    }
}

impl Render<'_> {
    /// Finds the surfaces that the first samples of each pixel of a region meet, row by row, at the
    /// lens's own wavelength. Uses rayon's current pool.
    pub fn surfaces(&self, region: Region, samples: u32) -> Vec<SurfaceSum> {
        let scene = self.shader.scene();
        self.survey(region, |batch, at, sampler, _| {
            let mut sum = SurfaceSum {
                samples,
                ..SurfaceSum::default()
            };
            batch.survey(at, sampler, 0..samples, &mut |ray, hit, _| {
                sum.add(hit.map(|hit| scene.point(ray, &hit)).as_ref());
            });
            sum
        })
    }

    /// Calls `survey` for each pixel of a region with a batch of rays of the lens's own wavelength,
    /// the pixel, the sampler and the pixel's number in the region, and returns the results row by
    /// row. Uses rayon's current pool.
    pub(super) fn survey<T: Send>(
        &self,
        region: Region,
        survey: impl Fn(&mut Batch<'_>, (u32, u32), Sampler, usize) -> T + Sync,
    ) -> Vec<T> {
        let camera = self.camera.at_one_wavelength();
        let render = Render {
            camera: &camera,
            ..*self
        };
        let tiles: Vec<Tile> = Tile::inside(region).collect();
        let number = |(x, y)| ((y - region.top) * region.width + x - region.left) as usize;
        let of_tile = |tile: &Tile| -> Vec<(usize, T)> {
            let mut batch = Batch::new(&render);
            let pixel = |at| {
                (
                    number(at),
                    survey(&mut batch, at, render.sampler, number(at)),
                )
            };
            tile.pixels().map(pixel).collect()
        };
        let mut all: Vec<(usize, T)> = tiles.par_iter().flat_map_iter(of_tile).collect();
        all.sort_unstable_by_key(|(number, _)| *number);
        all.into_iter().map(|(_, value)| value).collect()
    }
}
