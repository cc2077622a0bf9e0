//! Ghosts of the scene's lights on the film: two reflections inside the lens.
//!
//! A light is a point or a direction, so a ray from the film never hits it. Rays are traced from
//! the light through the front of the lens, with a reflection at each surface of a pair, and added
//! to the film where they arrive. For each pair of surfaces, a few pilot rays find the region of
//! the front that its light comes through and the amount of that light; the other rays are
//! distributed in proportion. Ghosts of the scene's surfaces are much fainter and are left out. So
//! is the light's own image, because Inventor's lights are not visible.
//!
//! A ray is a function of seed, light, pair and number, and all rays are added in that order, so
//! the film has the same bits at any number of threads.

use std::f64::consts::PI;

use glam::{DVec2, DVec3, Vec3};
use ivcam_inventor::traversal::state::LightKind;
use ivcam_optics::film::{GhostImage, Resolution};
use ivcam_optics::lens::analysis::ghosts::RGB_LINES;
use ivcam_optics::lens::{GhostPair, Lens, LensRay, Toward};
use ivcam_optics::sampling::{mix, unit};
use rayon::prelude::*;

use crate::bvh::Ray;
use crate::camera::LensCamera;
use crate::scene::{Light, RenderScene, SHADOW_END};

/// Cells on a side of the grid of pilot rays. A grid of 48 measures the area of a disc to 1%.
const PILOT_GRID: u32 = 48;
/// The smallest number of rays for a pair that has light, a grid of 16 by 16. No search is
/// recorded: it bounds the noise of faint ghosts, and costs time for each pair. The mean does not
/// depend on it.
const FEWEST_RAYS: f64 = 256.0;

/// The settings for rendering the ghosts of lights.
pub struct GhostRender<'a> {
    /// The scene, which casts shadows on the front of the lens.
    pub scene: &'a RenderScene,
    /// The camera whose lens reflects the light.
    pub camera: &'a LensCamera,
    /// The size of the picture in pixels.
    pub resolution: Resolution,
    /// The multiplier on the exposure, the same as the picture's.
    pub exposure: f64,
    /// Rays per light, for all its ghosts together.
    pub rays: u32,
    /// The seed of the random numbers.
    pub seed: u64,
}

impl GhostRender<'_> {
    /// Exposes the ghosts of lights; none if `proceed` returns false meanwhile. Uses rayon's
    /// current pool.
    pub fn expose(
        &self,
        lights: &[Light],
        proceed: &(dyn Fn() -> bool + Sync),
    ) -> Option<GhostImage> {
        let lenses = self.lenses();
        let pairs = self.camera.lens.ghost_pairs();
        let mut ghosts = GhostImage::new(self.resolution);
        let beams = lights.iter().zip(0..).filter_map(|(light, number)| {
            IncidentBeam::of(self, light, mix(self.seed ^ mix(number)))
        });
        for beam in beams {
            let path = |pair: Option<GhostPair>| {
                move |lens: &Lens, ray: &LensRay| match pair {
                    Some(pair) => lens.trace_ghost(ray, pair, Toward::Film, RGB_LINES),
                    None => direct_path(lens, ray),
                }
            };
            ghosts.of_lights += beam.find_region(&lenses, 0, &path(None)).light;
            let regions = pairs.par_iter().enumerate().map(|(i, pair)| {
                let region = || beam.find_region(&lenses, 1 + i as u64, &path(Some(*pair)));
                proceed().then(region)
            });
            let regions: Vec<FrontRegion> = regions.collect::<Option<_>>()?;
            let light: f64 = regions.iter().map(|r| r.light).sum();
            let lit = regions.par_iter().zip(&pairs);
            let splats = lit
                .filter(|(region, _)| region.light > 0.0)
                .map(|(region, pair)| {
                    let share = f64::from(self.rays) * region.light / light;
                    let side = share.max(FEWEST_RAYS).sqrt().ceil() as u32;
                    proceed().then(|| beam.splats(&lenses, region, side, &path(Some(*pair))))
                });
            let splats: Vec<Vec<Splat>> = splats.collect::<Option<_>>()?;
            for splat in splats.iter().flatten() {
                ghosts.add(splat.pixel, splat.level, splat.squared_error);
            }
        }
        proceed().then_some(ghosts)
    }

    /// Returns the lens at one wavelength per channel if its glass is dispersive, otherwise once.
    fn lenses(&self) -> Vec<Lens> {
        let lens = &self.camera.lens;
        if lens.prescription().is_dispersive() {
            RGB_LINES.map(|nm| lens.at_wavelength(nm)).to_vec()
        } else {
            vec![lens.clone()]
        }
    }
}

/// Traces a ray through the lens without reflections, as for the light's own image.
fn direct_path(lens: &Lens, ray: &LensRay) -> Option<(LensRay, DVec3)> {
    let out = lens.trace_from_scene(ray).ok()?;
    Some((out, DVec3::splat(lens.transmittance(ray, Toward::Film))))
}

/// The level that a ray adds to a pixel.
struct Splat {
    pixel: u32,
    level: Vec3,
    /// The ray's share of the variance of the pixel's level, by channel.
    squared_error: Vec3,
}

/// Estimates the variances of the levels that a block of two by two cells adds to pixels, from the
/// levels with the signs of a chessboard, which are in place of the squared errors. Each cell has
/// one random point, and the points are independent. So the variance of the sum of the levels in a
/// pixel is that of the sum with signs. The mean of the latter is near 0, and its square estimates
/// the variance. At the edge of a ghost the mean is not 0, and the estimate is too large.
fn estimate_errors(block: &mut [Splat]) {
    for k in 0..block.len() {
        let pixel = block[k].pixel;
        let (before, rest) = block.split_at_mut(k);
        let same = rest.iter().filter(|splat| splat.pixel == pixel);
        let signed: Vec3 = same.map(|splat| splat.squared_error).sum();
        rest[0].squared_error = match before.iter().any(|splat| splat.pixel == pixel) {
            true => Vec3::ZERO,
            false => signed * signed,
        };
    }
}

/// One light's rays before the lens, as they cross a plane through the lens's front vertex. Lengths
/// and directions are in lens space, in millimeters.
struct IncidentBeam<'a> {
    render: &'a GhostRender<'a>,
    light: Light,
    seed: u64,
    /// The light's position; `None` for a directional light.
    position: Option<DVec3>,
    /// The direction of the light at the vertex, normal to the plane.
    along: DVec3,
    /// Two axes of the plane.
    u: DVec3,
    v: DVec3,
    /// Half of the side of the square that holds the front surface.
    reach: f64,
}

/// The region of the plane before the lens that the light of a pair comes through.
struct FrontRegion {
    /// A number that makes the pair's random numbers differ from other pairs'.
    key: u64,
    /// The corner with the smallest coordinates.
    from: DVec2,
    size: DVec2,
    /// The light on the film in all channels, in levels times pixels.
    light: f64,
}

/// Traces a ray through a lens; returns the ray at the film and the share of its light in red,
/// green and blue.
type LensPath<'a> = &'a (dyn Fn(&Lens, &LensRay) -> Option<(LensRay, DVec3)> + Sync);

impl<'a> IncidentBeam<'a> {
    /// Returns `None` for a light whose direction at the vertex is not defined.
    fn of(render: &'a GhostRender<'a>, light: &Light, seed: u64) -> Option<Self> {
        let camera = render.camera;
        let is_far = light.kind == LightKind::Directional;
        let position = (!is_far).then(|| camera.lens_point(light.position.as_dvec3()));
        let along = match position {
            Some(position) => -position,
            None => camera.lens_direction(light.direction.as_dvec3()),
        };
        let along = along.try_normalize()?;
        let prescription = camera.lens.prescription();
        let front = prescription.surfaces.first()?.semi_diameter;
        let reach = match front.is_finite() {
            true => front,
            false => prescription.widest_semi_diameter(),
        };
        let (u, v) = along.any_orthonormal_pair();
        Some(Self {
            render,
            light: *light,
            seed,
            position,
            along,
            u,
            v,
            // The rim of a hemisphere is √2 radii from its vertex.
            reach: 1.42 * reach,
        })
    }

    /// Finds the region of a path by a grid of rays over the whole front, then measures its light
    /// by the same number of rays over the region.
    fn find_region(&self, lenses: &[Lens], key: u64, path: LensPath<'_>) -> FrontRegion {
        let mut region = FrontRegion {
            key,
            from: DVec2::splat(-self.reach),
            size: DVec2::splat(2.0 * self.reach),
            light: 0.0,
        };
        for round in 0..2 {
            let cell = region.size / f64::from(PILOT_GRID);
            let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
            region.light = 0.0;
            for i in 0..PILOT_GRID * PILOT_GRID {
                if self.render.scene.is_stopped() {
                    break;
                }
                let point = self.point_in_cell(&region, PILOT_GRID, i, round);
                self.trace(lenses, point, path, |splat| {
                    (low, high) = (low.min(point), high.max(point));
                    region.light += f64::from(splat.level.element_sum()) * cell.x * cell.y;
                });
            }
            if !(low.x <= high.x) {
                break;
            }
            (region.from, region.size) = (low - cell, high - low + 2.0 * cell);
        }
        region
    }

    /// Traces `side`² rays over the region of a pair.
    fn splats(
        &self,
        lenses: &[Lens],
        region: &FrontRegion,
        side: u32,
        path: LensPath<'_>,
    ) -> Vec<Splat> {
        let area = region.size.x * region.size.y / (f64::from(side) * f64::from(side));
        let mut splats = Vec::new();
        let blocks = side.div_ceil(2);
        for block in 0..blocks * blocks {
            if self.render.scene.is_stopped() {
                break;
            }
            let start = splats.len();
            let two = |from: u32| (2 * from..side).take(2);
            for [x, y] in two(block / blocks).flat_map(|y| two(block % blocks).map(move |x| [x, y]))
            {
                let sign = if (x + y) % 2 == 0 { 1.0 } else { -1.0 };
                let point = self.point_in_cell(region, side, y * side + x, 2);
                self.trace(lenses, point, path, |splat| {
                    let level = splat.level * area as f32;
                    let squared_error = sign * level;
                    splats.push(Splat {
                        level,
                        squared_error,
                        ..splat
                    });
                });
            }
            estimate_errors(&mut splats[start..]);
        }
        splats
    }

    /// Returns a random point in one cell of a grid with `side` cells on a side.
    fn point_in_cell(&self, region: &FrontRegion, side: u32, cell: u32, round: u64) -> DVec2 {
        let number = u64::from(cell) << 24 | round << 20;
        let key = mix(self.seed ^ mix(region.key ^ number));
        let jitter = DVec2::new(unit(key), unit(mix(key)));
        let at = DVec2::new(f64::from(cell % side), f64::from(cell / side)) + jitter;
        region.from + region.size * at / f64::from(side)
    }

    /// Traces the light through a point of the plane, and calls `each` with the pixels that it
    /// reaches. Their levels are per mm² of the plane.
    fn trace(
        &self,
        lenses: &[Lens],
        point: DVec2,
        path: LensPath<'_>,
        mut each: impl FnMut(Splat),
    ) {
        let origin = point.x * self.u + point.y * self.v;
        let direction = match self.position {
            Some(light) => (origin - light).normalize_or_zero(),
            None => self.along,
        };
        let ray = LensRay { origin, direction };
        let channels: &[DVec3] = match lenses.len() {
            1 => &[DVec3::ONE],
            _ => &[DVec3::X, DVec3::Y, DVec3::Z],
        };
        for (lens, channel) in lenses.iter().zip(channels) {
            let Some((out, share)) = path(lens, &ray) else {
                continue;
            };
            let Some((pixel, slant)) = self.render.camera.pixel(&out, self.render.resolution)
            else {
                continue;
            };
            let level = *channel
                * share
                * self.irradiance_before_lens(&ray)
                * slant
                * self.level_of_irradiance();
            if level.max_element() > 0.0 {
                each(Splat {
                    pixel,
                    level: level.as_vec3(),
                    squared_error: Vec3::ZERO,
                });
            }
        }
    }

    /// Returns the irradiance on the plane where a ray crosses it, in radiance times steradian. It
    /// is 0 where the scene blocks the light.
    ///
    /// A white surface under a light of color 1 has radiance 1 in Inventor's equation. It is
    /// Lambertian, so the light's irradiance on it is π.
    fn irradiance_before_lens(&self, ray: &LensRay) -> DVec3 {
        let point = self.render.camera.world_point(ray.origin).as_vec3();
        let reaching = self.light.reach(point);
        let across = ray.direction.dot(self.along);
        if reaching.color == Vec3::ZERO || across <= 0.0 {
            return DVec3::ZERO;
        }
        let limit = reaching.distance * SHADOW_END;
        let open = self
            .render
            .scene
            .transmittance(&Ray::new(point, reaching.toward), limit);
        PI * across * f64::from(open) * reaching.color.as_dvec3()
    }

    /// Returns the level of a pixel for an irradiance of 1 on 1 mm² of it.
    fn level_of_irradiance(&self) -> f64 {
        let camera = self.render.camera;
        let Resolution { width, height } = self.render.resolution;
        let pixel =
            camera.format.width * camera.format.height / (f64::from(width) * f64::from(height));
        self.render.exposure / (camera.axial_irradiance() * pixel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Aim, Camera};
    use crate::scene::CompileOptions;
    use ivcam_base::math::Meters;
    use ivcam_inventor::iv::Document;
    use ivcam_inventor::pose::CameraPose;
    use ivcam_inventor::snapshot::Snapshot;
    use ivcam_optics::film::FilmFormat;
    use ivcam_optics::lens::{Coating, FocusMethod};

    const SIZE: Resolution = Resolution::of(36, 24);

    /// Returns a camera at the scene's origin that looks along −z.
    fn camera(coating: Coating) -> LensCamera {
        let lens = Lens::named("double-gauss").unwrap().with_coating(coating);
        let focus = lens
            .focus(FocusMethod::Film, Meters(f64::INFINITY))
            .unwrap();
        let pose = CameraPose::view_all(Default::default(), 1.5);
        let film = FilmFormat::STANDARD;
        let camera = LensCamera::new(lens, focus, film, Aim::ExitPupil, &pose);
        let level = CameraPose {
            position: DVec3::ZERO,
            orientation: glam::DQuat::IDENTITY,
            ..pose
        };
        match Camera::Lens(Box::new(camera)).posed(&level, DVec3::ZERO) {
            Camera::Lens(camera) => *camera,
            Camera::Pinhole(_) | Camera::Ideal(_) | Camera::Film(_) => {
                unreachable!("it was a lens")
            }
        }
    }

    fn scene(text: &str) -> RenderScene {
        let document = Document::read_headerless("scene.iv", text.into()).unwrap();
        RenderScene::compile(&Snapshot::at(&document, 0.0), &CompileOptions::default()).unwrap()
    }

    fn exposed(
        scene: &RenderScene,
        camera: &LensCamera,
        lights: &[Light],
        threads: usize,
    ) -> GhostImage {
        exposed_with(scene, camera, lights, threads, 3)
    }

    fn exposed_with(
        scene: &RenderScene,
        camera: &LensCamera,
        lights: &[Light],
        threads: usize,
        seed: u64,
    ) -> GhostImage {
        let render = GhostRender {
            scene,
            camera,
            resolution: SIZE,
            exposure: 1.0,
            rays: 20_000,
            seed,
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let exposed = || render.expose(lights, &|| true);
        pool.build().unwrap().install(exposed).unwrap()
    }

    /// Returns a distant light off the axis, near the picture's edge.
    fn sun() -> Light {
        Light::headlight(glam::Vec3::new(0.12, -0.06, 1.0))
    }

    #[test]
    fn ghosts_have_the_same_bits_at_any_number_of_threads() {
        let scene = scene("Translation { translation 0 0 50 } Sphere { }");
        let camera = camera(Coating::Bare);
        let one = exposed(&scene, &camera, &[sun()], 1);
        assert!(one.sum() > 0.0);
        assert_eq!(exposed(&scene, &camera, &[sun()], 3), one);
    }

    /// The scatter of sixteen images with different seeds. The estimate is 1.35 times as large,
    /// because of cells at the edges of ghosts.
    #[test]
    fn the_error_of_ghosts_is_the_scatter_of_images_with_other_seeds() {
        let scene = scene("Translation { translation 0 0 50 } Sphere { }");
        let camera = camera(Coating::MagnesiumFluoride);
        let images: Vec<GhostImage> = (0..16)
            .map(|seed| exposed_with(&scene, &camera, &[sun()], 2, seed))
            .collect();
        let n = images.len() as f64;
        let stated = images.iter().map(|image| image.squared_error().0);
        let stated = stated.sum::<f64>() / n;
        let scatter = (0..SIZE.pixels()).map(|i| {
            let mean = images.iter().map(|image| image.pixels[i]).sum::<DVec3>() / n;
            let off = |image: &GhostImage| (image.pixels[i] - mean).length_squared();
            images.iter().map(off).sum::<f64>() / (n - 1.0)
        });
        let ratio = stated / scatter.sum::<f64>();
        assert!((1.0..1.5).contains(&ratio), "{ratio}");
    }

    /// Compares with the light of all pairs by rays evenly distributed over the front.
    #[test]
    fn the_light_of_all_ghosts_is_that_of_evenly_distributed_rays() {
        let scene = scene("Translation { translation 0 0 50 } Sphere { }");
        let camera = camera(Coating::MagnesiumFluoride);
        let found = exposed(&scene, &camera, &[sun()], 2).sum();
        let direction = camera.lens_direction(sun().direction.as_dvec3());
        let (u, v) = direction.any_orthonormal_pair();
        let reach = 1.42 * camera.lens.prescription().surfaces[0].semi_diameter;
        let random = |key: u64| unit(mix(key)) * 2.0 - 1.0;
        let n = 8_000u64;
        let (mut sum, mut squares) = (0.0, 0.0);
        for i in 0..n {
            let origin = reach * (random(2 * i) * u + random(2 * i + 1) * v);
            let ray = LensRay { origin, direction };
            let mut light = 0.0;
            for pair in camera.lens.ghost_pairs() {
                let ghost = camera.lens.trace_ghost(&ray, pair, Toward::Film, RGB_LINES);
                if let Some((out, share)) = ghost
                    && camera.pixel(&out, SIZE).is_some()
                {
                    light += share.element_sum();
                }
            }
            sum += light;
            squares += light * light;
        }
        let n = n as f64;
        let mean = sum / n;
        let error = ((squares / n - mean * mean) / n).sqrt() / mean;
        // The irradiance is π over the square, and the levels are those of pixels of 1 mm².
        let known = mean * 4.0 * reach * reach * PI / camera.axial_irradiance();
        let off = found / known - 1.0;
        assert!(
            off.abs() < 4.0 * error && error < 0.04,
            "{found} {known} {error}"
        );
    }

    /// The sun on the axis fills the entrance pupil, and all of that light is in its image.
    #[test]
    fn the_lights_own_image_has_the_light_of_the_entrance_pupil() {
        let scene = scene("Translation { translation 0 0 50 } Sphere { }");
        let camera = camera(Coating::Bare);
        let light = Light::headlight(glam::Vec3::Z);
        let found = exposed(&scene, &camera, &[light], 2).of_lights;
        let pupil = camera.lens.axial_beam().height;
        let share = camera.lens.axial_transmittance().unwrap();
        let known = 3.0 * share * PI * (PI * pupil * pupil) / camera.axial_irradiance();
        // A grid of 48×48 cells measures the area of a disc to 1%.
        assert!((found / known - 1.0).abs() < 0.01, "{found} {known}");
    }

    #[test]
    fn a_light_behind_a_wall_or_behind_the_camera_has_no_ghosts() {
        let open = scene("Translation { translation 0 0 50 } Cube { }");
        let walled = scene("Translation { translation 0 0 -5 } Cube { width 9 height 9 depth .1 }");
        let camera = camera(Coating::Bare);
        let lamp = Light {
            kind: LightKind::Point,
            position: glam::Vec3::new(0.3, 0.2, -8.0),
            ..sun()
        };
        assert!(exposed(&open, &camera, &[lamp], 1).sum() > 0.0);
        assert_eq!(exposed(&walled, &camera, &[lamp], 1).sum(), 0.0);
        let away = Light::headlight(glam::Vec3::NEG_Z);
        assert_eq!(exposed(&open, &camera, &[away], 1).sum(), 0.0);
        let ideal = self::camera(Coating::Ideal);
        assert_eq!(exposed(&open, &ideal, &[lamp], 1).sum(), 0.0);
    }
}
