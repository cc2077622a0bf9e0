//! Ghosts of the scene's lights on the film: two reflections inside the lens.
//!
//! A light is a point or a direction, so its ghosts can't be met from the film; rays go from the
//! light through the front of the lens by the way of every pair of surfaces, and what arrives is
//! added where it arrives. First a few rays of each pair find the part of the front that its
//! light comes through and how much that is; the rest are dealt out in proportion. Light that
//! the scene's surfaces send into the lens makes ghosts too, far fainter ones; they are left out, and
//! so is the light's own image, for Inventor's lights are not seen.
//!
//! A ray is a function of seed, light, pair and number, and all are added in that order, so the
//! film has the same bits at any number of threads.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::bvh::Ray;
use crate::camera::LensCamera;
use crate::film::{Glare, Resolution};
use crate::lens::analysis::ghosts::RGB_LINES;
use crate::lens::{GhostPair, Lens, LensRay, Toward};
use crate::sampling::mix;
use crate::scene::{Light, RenderScene};
use crate::traversal::state::LightKind;

/// Cells a side of the grid of a pair's first rays.
const PILOT: u32 = 48;
/// Rays in a pair's share at least.
const FEWEST: f64 = 256.0;

/// What makes ghosts.
pub(crate) struct Flare<'a> {
    pub scene: &'a RenderScene,
    pub camera: &'a LensCamera,
    pub resolution: Resolution,
    /// Multiplies the exposure, as that of the picture.
    pub exposure: f64,
    /// Rays for each light, in all its ghosts.
    pub rays: u32,
    pub seed: u64,
}

impl Flare<'_> {
    /// The ghosts of lights. Uses rayon's current pool.
    pub(crate) fn expose(&self, lights: &[Light]) -> Glare {
        let lenses = self.lenses();
        let pairs = self.camera.lens.ghost_pairs();
        let mut glare = Glare::new(self.resolution);
        let beams = lights
            .iter()
            .zip(0..)
            .filter_map(|(light, number)| Beam::of(self, light, mix(self.seed ^ mix(number))));
        for beam in beams {
            let way = |pair: Option<GhostPair>| {
                move |lens: &Lens, ray: &LensRay| match pair {
                    Some(pair) => lens.trace_ghost(ray, pair, Toward::Film, RGB_LINES),
                    None => direct(lens, ray),
                }
            };
            glare.of_lights += beam.pilot(&lenses, 0, &way(None)).light;
            let found: Vec<Pilot> = pairs
                .par_iter()
                .enumerate()
                .map(|(i, pair)| beam.pilot(&lenses, 1 + i as u64, &way(Some(*pair))))
                .collect();
            let light: f64 = found.iter().map(|p| p.light).sum();
            let splats: Vec<Vec<Splat>> = found
                .par_iter()
                .zip(&pairs)
                .filter(|(pilot, _)| pilot.light > 0.0)
                .map(|(pilot, pair)| {
                    let share = f64::from(self.rays) * pilot.light / light;
                    let side = share.max(FEWEST).sqrt().ceil() as u32;
                    beam.rays(&lenses, pilot, side, &way(Some(*pair)))
                })
                .collect();
            for splat in splats.iter().flatten() {
                glare.pixels[splat.pixel as usize] += splat.level.as_dvec3();
            }
        }
        glare
    }

    /// The lens at three wavelengths where that makes a difference, else once.
    fn lenses(&self) -> Vec<Lens> {
        let lens = &self.camera.lens;
        if lens.prescription().is_dispersive() {
            RGB_LINES.map(|nm| lens.at_wavelength(nm)).to_vec()
        } else {
            vec![lens.clone()]
        }
    }
}

/// The way of the light's own image.
fn direct(lens: &Lens, ray: &LensRay) -> Option<(LensRay, DVec3)> {
    let out = lens.trace_from_scene(ray).ok()?;
    Some((out, DVec3::splat(lens.transmittance(ray, Toward::Film))))
}

/// What a ray adds to a pixel.
struct Splat {
    pixel: u32,
    level: glam::Vec3,
}

/// The light of one light before the lens, over a plane through its front vertex.
struct Beam<'a> {
    flare: &'a Flare<'a>,
    light: Light,
    seed: u64,
    /// Where the light is, in lens space; none where it is a direction.
    place: Option<DVec3>,
    /// Along the light at the vertex, and across.
    along: DVec3,
    u: DVec3,
    v: DVec3,
    /// Half of the side of the square that holds the front surface.
    reach: f64,
}

/// What the first rays of a pair found.
struct Pilot {
    key: u64,
    /// The corner of the part of the plane that light comes through, and its size.
    from: DVec2,
    size: DVec2,
    /// On the film, in all channels: levels times pixels.
    light: f64,
}

type Way<'a> = &'a (dyn Fn(&Lens, &LensRay) -> Option<(LensRay, DVec3)> + Sync);

impl<'a> Beam<'a> {
    /// None for a light that shines away from the lens.
    fn of(flare: &'a Flare<'a>, light: &Light, seed: u64) -> Option<Self> {
        let camera = flare.camera;
        let is_far = light.kind == LightKind::Directional;
        let place = (!is_far).then(|| camera.lens_point(light.position.as_dvec3()));
        let along = match place {
            Some(place) => -place,
            None => camera.lens_direction(light.direction.as_dvec3()),
        };
        let along = along.try_normalize()?;
        let surfaces = &camera.lens.prescription().surfaces;
        let widest = surfaces.iter().map(|s| s.semi_diameter);
        let front = surfaces.first()?.semi_diameter;
        let reach = if front.is_finite() {
            front
        } else {
            widest.filter(|a| a.is_finite()).fold(0.0, f64::max)
        };
        let (u, v) = along.any_orthonormal_pair();
        Some(Self {
            flare,
            light: *light,
            seed,
            place,
            along,
            u,
            v,
            // The rim of a hemisphere is √2 of its radius from the vertex.
            reach: 1.42 * reach,
        })
    }

    /// A few rays over all of the front, then as many over the part that they came through.
    fn pilot(&self, lenses: &[Lens], key: u64, way: Way<'_>) -> Pilot {
        let mut found = Pilot {
            key,
            from: DVec2::splat(-self.reach),
            size: DVec2::splat(2.0 * self.reach),
            light: 0.0,
        };
        for round in 0..2 {
            let cell = found.size / f64::from(PILOT);
            let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
            found.light = 0.0;
            for i in 0..PILOT * PILOT {
                let place = self.place_of(&found, PILOT, i, round);
                self.arrive(lenses, place, way, |splat| {
                    (low, high) = (low.min(place), high.max(place));
                    found.light += f64::from(splat.level.element_sum()) * cell.x * cell.y;
                });
            }
            if !(low.x <= high.x) {
                break;
            }
            (found.from, found.size) = (low - cell, high - low + 2.0 * cell);
        }
        found
    }

    /// `side`² rays over the part of the front that a pair's light comes through.
    fn rays(&self, lenses: &[Lens], pilot: &Pilot, side: u32, way: Way<'_>) -> Vec<Splat> {
        let area = pilot.size.x * pilot.size.y / (f64::from(side) * f64::from(side));
        let mut splats = Vec::new();
        for i in 0..side * side {
            let place = self.place_of(pilot, side, i, 2);
            self.arrive(lenses, place, way, |splat| {
                let level = splat.level * area as f32;
                splats.push(Splat { level, ..splat });
            });
        }
        splats
    }

    /// A place in one cell of a grid of so many cells a side.
    fn place_of(&self, pilot: &Pilot, side: u32, cell: u32, round: u64) -> DVec2 {
        let number = u64::from(cell) << 24 | round << 20;
        let key = mix(self.seed ^ mix(pilot.key ^ number));
        let random = |key: u64| (key >> 11) as f64 / (1u64 << 53) as f64;
        let jitter = DVec2::new(random(key), random(mix(key)));
        let at = DVec2::new(f64::from(cell % side), f64::from(cell / side)) + jitter;
        pilot.from + pilot.size * at / f64::from(side)
    }

    /// Tells `each` where the light of a place on the plane arrives, as levels for each mm² of it.
    fn arrive(&self, lenses: &[Lens], place: DVec2, way: Way<'_>, mut each: impl FnMut(Splat)) {
        let origin = place.x * self.u + place.y * self.v;
        let direction = match self.place {
            Some(light) => (origin - light).normalize_or_zero(),
            None => self.along,
        };
        let ray = LensRay { origin, direction };
        let channels: &[DVec3] = match lenses.len() {
            1 => &[DVec3::ONE],
            _ => &[DVec3::X, DVec3::Y, DVec3::Z],
        };
        for (lens, channel) in lenses.iter().zip(channels) {
            let Some((out, share)) = way(lens, &ray) else {
                continue;
            };
            let Some((pixel, slant)) = self.flare.camera.pixel(&out, self.flare.resolution) else {
                continue;
            };
            let level =
                *channel * share * self.before_lens(&ray) * slant * self.level_of_irradiance();
            if level.max_element() > 0.0 {
                let level = level.as_vec3();
                each(Splat { pixel, level });
            }
        }
    }

    /// The irradiance on the plane where a ray crosses it, in radiance times steradian, where
    /// the scene does not stand in the way.
    ///
    /// A white surface under a light of color 1 has radiance 1 in Inventor's equation; it
    /// scatters evenly, so the light brings it an irradiance of π.
    fn before_lens(&self, ray: &LensRay) -> DVec3 {
        let point = self.flare.camera.world_point(ray.origin).as_vec3();
        let reaching = self.light.reach(point);
        let across = ray.direction.dot(self.along);
        if reaching.color == glam::Vec3::ZERO || across <= 0.0 {
            return DVec3::ZERO;
        }
        let limit = reaching.distance * (1.0 - 1e-5);
        let open = self
            .flare
            .scene
            .transmittance(&Ray::new(point, reaching.toward), limit);
        PI * across * f64::from(open) * reaching.color.as_dvec3()
    }

    /// Levels of a pixel for an irradiance of 1 that falls on 1 mm² of it.
    fn level_of_irradiance(&self) -> f64 {
        let camera = self.flare.camera;
        let Resolution { width, height } = self.flare.resolution;
        let pixel =
            camera.format.width * camera.format.height / (f64::from(width) * f64::from(height));
        self.flare.exposure / (camera.axial_irradiance() * pixel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Aim, Camera};
    use crate::film::FilmFormat;
    use crate::iv::Document;
    use crate::lens::{Coating, FocusMethod};
    use crate::math::Meters;
    use crate::pose::CameraPose;
    use crate::scene::CompileOptions;
    use crate::snapshot::Snapshot;

    const SIZE: Resolution = Resolution {
        width: 36,
        height: 24,
    };

    /// A lens at the scene's origin, looking along −z.
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
    ) -> Glare {
        let flare = Flare {
            scene,
            camera,
            resolution: SIZE,
            exposure: 1.0,
            rays: 20_000,
            seed: 3,
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| flare.expose(lights))
    }

    /// Off the axis, near the picture's edge.
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

    /// All pairs, by rays anywhere over the front, without finding first where the light goes.
    #[test]
    fn the_light_of_all_ghosts_is_that_of_rays_without_preference() {
        let scene = scene("Translation { translation 0 0 50 } Sphere { }");
        let camera = camera(Coating::MagnesiumFluoride);
        let ours = exposed(&scene, &camera, &[sun()], 2).sum();
        let direction = camera.lens_direction(sun().direction.as_dvec3());
        let (u, v) = direction.any_orthonormal_pair();
        let reach = 1.42 * camera.lens.prescription().surfaces[0].semi_diameter;
        let random = |key: u64| (mix(key) >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0;
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
        // An irradiance of π over the square, in levels of pixels of 1 mm².
        let known = mean * 4.0 * reach * reach * PI / camera.axial_irradiance();
        let off = ours / known - 1.0;
        assert!(
            off.abs() < 4.0 * error && error < 0.04,
            "{ours} {known} {error}"
        );
    }

    /// The sun on the axis fills the entrance pupil, and all of that is in its image.
    #[test]
    fn the_lights_own_image_has_the_light_of_the_entrance_pupil() {
        let scene = scene("Translation { translation 0 0 50 } Sphere { }");
        let camera = camera(Coating::Bare);
        let light = Light::headlight(glam::Vec3::Z);
        let ours = exposed(&scene, &camera, &[light], 2).of_lights;
        let pupil = camera.lens.axial_beam().height;
        let share = camera.lens.axial_transmittance().unwrap();
        let known = 3.0 * share * PI * (PI * pupil * pupil) / camera.axial_irradiance();
        // A grid of 48 cells a side finds the area of a disc to a hundredth.
        assert!((ours / known - 1.0).abs() < 0.01, "{ours} {known}");
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
