//! Queries of a picture without rendering it: the point under the cursor, distances, and the
//! surface of sharp focus. A query traces one ray, so the window makes it without waiting for the
//! renderer.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use ivcam_base::diag::Diagnostic;
use ivcam_inventor::pose::CameraPose;
use ivcam_optics::film::Resolution;
use ivcam_render::bvh::Ray;
use ivcam_render::camera::{Camera, LensCamera};
use ivcam_render::scene::RenderScene;
use rayon::prelude::*;

use crate::photo::{PointerScene, VisiblePoint, visible_at};

/// A scene seen by a camera.
#[derive(Clone, Debug)]
pub struct SceneView {
    pub scene: Arc<RenderScene>,
    pub camera: Camera,
    pub pose: CameraPose,
    pub resolution: Resolution,
    /// The messages about the lens and the camera.
    pub messages: Vec<Diagnostic>,
    /// The scene as the pointer searches it, if something in it acts for the pointer.
    pub(crate) pointer: Option<Arc<PointerScene>>,
}

impl SceneView {
    /// Returns the visible point at a place of the picture; x and y are from 0 to 1.
    pub(crate) fn look(&self, x: f64, y: f64) -> Option<VisiblePoint> {
        visible_at(&self.scene, &self.camera, &self.pose, [x, y])
    }

    /// Returns the point at a place of the picture and at a depth in meters along the axis,
    /// whatever is there; `None` if no ray comes through the lens.
    pub(crate) fn at_depth(&self, x: f64, y: f64, depth: f64) -> Option<DVec3> {
        let ray = self.camera.at(x, y).ray([0.5, 0.5])?;
        let (axis, origin) = (self.pose.direction(), ray.origin + self.scene.origin);
        let along = (depth - (origin - self.pose.position).dot(axis)) / ray.direction.dot(axis);
        along.is_finite().then(|| origin + along * ray.direction)
    }

    /// Returns whether a surface lies on the way between two points of the world, or within
    /// `margin` meters beyond it.
    pub(crate) fn blocks(&self, from: DVec3, to: DVec3, margin: f64) -> bool {
        let step = to - from;
        let Some(direction) = step.try_normalize() else {
            return false;
        };
        let origin = (from - self.scene.origin).as_vec3();
        let hit = self
            .scene
            .hit_any_side(&Ray::new(origin, direction.as_vec3()));
        hit.is_some_and(|hit| f64::from(hit.t) < step.length() + margin)
    }

    /// Returns the camera if it has a real lens.
    pub(crate) fn lens_camera(&self) -> Option<&LensCamera> {
        match &self.camera {
            Camera::Lens(camera) => Some(camera),
            _ => None,
        }
    }

    /// Returns the bounding box of the scene in the world.
    pub(crate) fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let (min, max) = self.scene.bounds()?;
        let world = |v: glam::Vec3| v.as_dvec3() + self.scene.origin;
        Some((world(min), world(max)))
    }

    /// Returns distances over the whole picture, or `None` if `proceed` returned false. Uses
    /// rayon's current pool.
    pub(crate) fn depths(&self, proceed: &(dyn Fn() -> bool + Sync)) -> Option<DepthMap> {
        let Resolution { width, height } = reduced(self.resolution);
        let distance = |i: u32| {
            let x = (f64::from(i % width) + 0.5) / f64::from(width);
            let y = (f64::from(i / width) + 0.5) / f64::from(height);
            self.look(x, y)
                .map_or(f32::INFINITY, |seen| seen.distance as f32)
        };
        let rows = (0..height).into_par_iter().map(|y| {
            let row = y * width..(y + 1) * width;
            proceed().then(|| row.map(distance).collect::<Vec<f32>>())
        });
        let rows: Option<Vec<Vec<f32>>> = rows.collect();
        Some(DepthMap {
            width,
            height,
            meters: rows?.concat(),
        })
    }
}

/// Limits the resolution of a map of distances to that of the 1999 program's picture.
fn reduced(resolution: Resolution) -> Resolution {
    let most = Resolution::VINTAGE.pixels() as f64;
    let scale = (most / resolution.pixels() as f64).sqrt().min(1.0);
    let side = |n: u32| ((f64::from(n) * scale) as u32).max(1);
    Resolution::of(side(resolution.width), side(resolution.height))
}

/// A map of distances along the axis, infinite where there is no surface.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthMap {
    /// The number of columns.
    pub width: u32,
    /// The number of rows.
    pub height: u32,
    /// The distances in meters, rows from the top.
    pub meters: Vec<f32>,
}

impl DepthMap {
    /// Returns the distance at a place of the picture, from 0 to 1.
    pub(crate) fn at(&self, x: f64, y: f64) -> f64 {
        let cell = |t: f64, n: u32| ((t * f64::from(n)) as u32).min(n.saturating_sub(1)) as usize;
        let i = cell(y, self.height) * self.width as usize + cell(x, self.width);
        self.meters.get(i).map_or(f64::INFINITY, |d| f64::from(*d))
    }
}

/// The surface of sharp focus: for each height on the film, the distance at which the rays through
/// the whole pupil are closest together. The paper calls it a "spherical manifold"; here it is
/// traced through the lens.
#[derive(Clone, Debug, PartialEq)]
pub struct FocalSurface {
    /// Meters along the axis, at equal steps of film height from the axis to the corner.
    pub meters: Vec<f64>,
    half_diagonal: f64,
    film: DVec2,
}

impl FocalSurface {
    const STEPS: usize = 24;

    /// Traces the surface of a focused camera.
    pub(crate) fn of(camera: &LensCamera) -> Self {
        let half_diagonal = camera.format.half_diagonal();
        let height = |i: usize| half_diagonal * i as f64 / (Self::STEPS - 1) as f64;
        let mut meters: Vec<f64> = Vec::with_capacity(Self::STEPS);
        for i in 0..Self::STEPS {
            // Beyond the image circle no light passes, and the last distance is repeated.
            let last = meters.last().copied().unwrap_or(f64::INFINITY);
            meters.push(waist(camera, DVec2::new(height(i), 0.0)).unwrap_or(last));
        }
        let film = DVec2::new(camera.format.width, camera.format.height);
        Self {
            meters,
            half_diagonal,
            film,
        }
    }

    /// Returns the sharp distance at a place of the picture, from 0 to 1.
    pub(crate) fn at(&self, x: f64, y: f64) -> f64 {
        let height = ((DVec2::new(x, y) - 0.5) * self.film).length();
        let step = height / self.half_diagonal * (Self::STEPS - 1) as f64;
        let i = (step as usize).min(Self::STEPS - 2);
        let (a, b) = (self.meters[i], self.meters[i + 1]);
        let t = (step - i as f64).clamp(0.0, 1.0);
        // Interpolation is in diopters, in which infinity is finite.
        1.0 / ((1.0 - t) / a + t / b)
    }
}

/// Returns where the rays of a film point are closest together, in meters in front of the lens. The
/// spot in a plane at distance Z is p + Z q, so its mean square is least at −cov(p, q)/var(q).
fn waist(camera: &LensCamera, film: DVec2) -> Option<f64> {
    const GRID: usize = 12;
    let middle = |i: usize| (i as f64 + 0.5) / GRID as f64;
    let mut rays: Vec<(DVec2, DVec2)> = Vec::new();
    for j in 0..GRID {
        for i in 0..GRID {
            let path = camera.path(film, [middle(i), middle(j)]);
            let Some(out) = path.and_then(|(_, path)| path.outcome.ok()) else {
                continue;
            };
            let slope = -out.direction.truncate() / out.direction.z;
            rays.push((out.origin.truncate() + out.origin.z * slope, slope));
        }
    }
    if rays.len() < 4 {
        return None;
    }
    let n = rays.len() as f64;
    let mean = rays.iter().fold((DVec2::ZERO, DVec2::ZERO), |m, r| {
        (m.0 + r.0 / n, m.1 + r.1 / n)
    });
    let (mut along, mut spread) = (0.0, 0.0);
    for (p, q) in &rays {
        along += (p - mean.0).dot(q - mean.1);
        spread += (q - mean.1).length_squared();
    }
    let z = -along / spread;
    Some(if z > 0.0 && z < 1e9 {
        z / 1000.0
    } else {
        f64::INFINITY
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivcam_base::math::meters;
    use ivcam_inventor::pose::CameraPose;
    use ivcam_optics::film::FilmFormat;
    use ivcam_optics::lens::{FocusMethod, Lens};
    use ivcam_render::camera::Aim;

    fn camera(name: &str, f_number: f64, distance: f64) -> LensCamera {
        let lens = Lens::named(name).unwrap().at_f_number(f_number).unwrap();
        let focus = lens.focus(FocusMethod::Film, meters(distance)).unwrap();
        let pose = CameraPose::view_all(Default::default(), 1.5);
        LensCamera::new(lens, focus, FilmFormat::STANDARD, Aim::ExitPupil, &pose)
    }

    #[test]
    fn stopped_down_the_focal_surface_on_the_axis_is_the_plane_in_focus() {
        for (name, distance) in [("double-gauss", 3.0), ("telephoto", 8.0), ("tessar", 2.0)] {
            // At f/22 the telephoto's spherical aberration is still 3% of this distance.
            let surface = FocalSurface::of(&camera(name, 45.0, distance));
            let off = surface.at(0.5, 0.5) / distance - 1.0;
            assert!(off.abs() < 0.02, "{name}: {off}");
        }
    }

    /// A single lens has a strongly curved field, bent toward it.
    #[test]
    fn a_condensers_focal_surface_bends_toward_the_lens() {
        let lens = Lens::named("condenser").unwrap();
        let widest = lens.real_f_number().unwrap();
        let surface = FocalSurface::of(&camera("condenser", 8.0 * widest, 4.0));
        assert!(
            surface.at(0.0, 0.5) < 0.9 * surface.at(0.5, 0.5),
            "{surface:?}"
        );
    }
}
