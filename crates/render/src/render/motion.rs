//! How far each pixel moves until a later time, and the texture coordinates that it shows.

use glam::{DVec2, DVec3};
use ivcam_optics::film::{Region, Resolution};

use super::batch::Batch;
use super::passes::Render;
use crate::bvh::{Hit, Ray};
use crate::camera::{Camera, ChiefRayGrid};
use crate::scene::RenderScene;

/// The distance in meters at which what is behind the scene is.
const FAR: f64 = 1e7;

/// A scene and its camera at a later time.
#[derive(Clone, Copy)]
pub struct LaterMoment<'a> {
    /// The scene, with the primitives of the present one.
    pub scene: &'a RenderScene,
    /// The camera, in the space of that scene.
    pub camera: &'a Camera,
}

/// A mean of values of two dimensions over some samples.
#[derive(Clone, Copy, Default)]
struct PlaneMean {
    sum: DVec2,
    count: u32,
}

impl PlaneMean {
    fn add(&mut self, value: DVec2) {
        self.sum += value;
        self.count += 1;
    }

    fn mean(self) -> DVec2 {
        self.sum / f64::from(self.count.max(1))
    }
}

impl Render<'_> {
    /// Returns the mean texture coordinates that the first samples of each pixel of a region meet,
    /// row by row, at the lens's own wavelength; zero where there is no surface. Uses rayon's
    /// current pool.
    pub fn coordinates(&self, region: Region, samples: u32) -> Vec<DVec2> {
        let scene = self.shader.scene();
        self.survey(region, |batch: &mut Batch<'_>, at, sampler, _| {
            let mut mean = PlaneMean::default();
            batch.survey(at, sampler, 0..samples, &mut |ray, hit, _| {
                if let Some(hit) = hit {
                    mean.add(scene.coordinates_at(ray, &hit).as_dvec2());
                }
            });
            mean.mean()
        })
    }

    /// Returns how far what each pixel of a region shows moves in the picture until a later time,
    /// in pixels to the right and down: the mean over the first samples, row by row, at the lens's
    /// own wavelength. A point moves as its chief ray does. What leaves the picture by more than
    /// half of its size has no place and does not count. Uses rayon's current pool.
    pub fn motion(&self, region: Region, samples: u32, later: LaterMoment<'_>) -> Vec<DVec2> {
        let scene = self.shader.scene();
        let grids = [self.camera, later.camera].map(ChiefRayGrid::new);
        let stands = grids[0] == grids[1] && scene.origin == later.scene.origin;
        let Resolution { width, height } = self.resolution;
        let size = DVec2::new(f64::from(width), f64::from(height));
        let points = |ray: &Ray, hit: Option<Hit>| match hit {
            Some(hit) => scene.moved(ray, &hit, later.scene),
            None => {
                let far: DVec3 = ray.direction.as_dvec3().normalize_or_zero() * FAR;
                [ray.origin.as_dvec3() + far + scene.origin; 2]
            }
        };
        self.survey(region, |batch: &mut Batch<'_>, at, sampler, _| {
            let near = (DVec2::new(f64::from(at.0), f64::from(at.1)) + 0.5) / size;
            let mut mean = PlaneMean::default();
            batch.survey(at, sampler, 0..samples, &mut |ray, hit, _| {
                let [now, then] = points(ray, hit);
                if stands && now == then {
                    return mean.add(DVec2::ZERO);
                }
                let now = grids[0].place(now - scene.origin, near.to_array());
                let place = now.unwrap_or(near.to_array());
                let then = grids[1].place(then - later.scene.origin, place);
                if let (Some(now), Some(then)) = (now, then) {
                    mean.add((DVec2::from_array(then) - DVec2::from_array(now)) * size);
                }
            });
            mean.mean()
        })
    }
}
