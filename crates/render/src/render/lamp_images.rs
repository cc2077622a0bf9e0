//! Where the images of small lights are on the film, so that exposures can look there on purpose.
//!
//! One of a thousand samples meets a light that covers a thousandth of a pixel, and a picture
//! of a few samples does not show that it is there. The error of such a picture is estimated by
//! exposures of the pixel most of whose samples are in a window around the light's image. A sample
//! is weighted by the density of the even samples over that of both together, so the window changes
//! the noise of an exposure and not its expectation (Veach and Guibas, "Optimally combining
//! sampling techniques for Monte Carlo rendering", 1995).
//!
//! The window is found by rays of the camera itself: through several points of the lens, the film
//! points whose rays meet the corners of the box around the light (Newton's iteration). Rays from
//! all over the window then tell how much of the light is in sight. So it does not matter what kind
//! of camera it is, and what hides a part of the light. A light that is out of focus has a wide
//! window and is left to chance, as is one whose image leaves the picture.

use glam::{DVec2, DVec3, Vec3};
use ivcam_optics::film::{Film, Region};
use ivcam_optics::sampling::{FilterTable, mix, unit};

use super::passes::Render;
use super::sample_window::SampleWindow;
use crate::bvh::Ray;
use crate::camera::Camera;
use crate::scene::SmallLight;

/// The largest number of lights whose images are searched for: those with the most effect.
const MOST: usize = 32;
/// The largest window, in pixels. In a window of more than a pixel samples are not denser, but the
/// exposures of its pixels are more.
const LARGEST: f64 = 4.0;
/// The part of the window's size that is added on each side. A window around points where rays have
/// met the light gets more: so many parts of it as are expected beyond the last point.
const MARGIN: f64 = 0.05;
const BEYOND: f64 = 3.0;
/// The number of rays that tell how much of a light is in sight.
const LOOKS: u64 = 256;
/// The largest number of steps of Newton's iteration. It squares the error with each.
const STEPS: usize = 8;
/// The last step of an iteration that has ended, at most, in pixels.
const ENDED: f64 = 1e-4;
/// The distance between film points of which a derivative is the difference, in pixels.
const DIFFERENCE: f64 = 1e-2;
/// The points of the lens through which the middle of a light is seen: its middle and its rim.
const PUPIL: [[f64; 2]; 9] = {
    let [low, middle, high] = [0.01, 0.5, 0.99];
    [
        [middle, middle],
        [low, low],
        [low, middle],
        [low, high],
        [middle, low],
        [middle, high],
        [high, low],
        [high, middle],
        [high, high],
    ]
};

/// The image of a small light.
#[derive(Clone, Debug)]
pub(super) struct LampImage {
    /// The least and the largest column and row, in pixels.
    window: [DVec2; 2],
    /// Where rays from the window have met the light.
    seen: Vec<DVec2>,
    /// The area of the film for each ray that was tried, in pixels.
    ray: f64,
    /// The square of the light's level, summed over channels.
    square: f64,
}

/// A pixel with a part of the image of a small light.
#[derive(Clone, Copy, Debug)]
pub(super) struct LampPixel {
    /// The index of the pixel in the film, row by row.
    pub pixel: u32,
    pub window: SampleWindow,
    /// The number of samples with the window that are about as precise as the pixel's own.
    pub samples: f64,
    /// The expected variance of the pixel's mean because of the light, summed over channels.
    variance: f64,
}

/// The images of the small lights of a picture.
#[derive(Clone, Debug, Default)]
pub(super) struct LampImages(Vec<LampImage>);

impl LampImages {
    /// Takes the lights whose images are found from a list.
    pub(super) fn take_from(lights: &mut Vec<SmallLight>, render: &Render<'_>) -> Self {
        let effect = |light: &SmallLight| (light.pixels * light.radiance).length_squared();
        lights.sort_by(|a, b| effect(b).total_cmp(&effect(a)));
        let camera = render.camera.at_one_wavelength();
        let mut images = Vec::new();
        let mut number = 0;
        lights.retain(|light| {
            number += 1;
            let image = (number <= MOST).then(|| LampImage::of(light, render, &camera));
            let image = image.flatten();
            let is_found = image.is_some();
            images.extend(image);
            !is_found
        });
        Self(images)
    }

    /// The pixels of a film, which is a region of the picture, with the images of lights, in their
    /// order. Of several images in a pixel the noisiest counts.
    pub(super) fn pixels(
        &self,
        (film, region): (&Film, Region),
        filter: &FilterTable,
    ) -> Vec<LampPixel> {
        let mut all: Vec<LampPixel> = Vec::new();
        for image in &self.0 {
            for (column, row) in image.reach(region, filter) {
                let pixel = (row - region.top) * region.width + column - region.left;
                let count = film.pixels[pixel as usize].count;
                let corner = DVec2::new(f64::from(column), f64::from(row));
                all.extend(image.in_pixel((pixel, corner), count, filter));
            }
        }
        all.sort_by(|a, b| {
            let noise = b.variance.total_cmp(&a.variance);
            a.pixel.cmp(&b.pixel).then(noise)
        });
        all.dedup_by_key(|lamp| lamp.pixel);
        all
    }
}

impl LampImage {
    /// Finds the image of a light by the rays of a camera of one wavelength; `None` if it is not
    /// small, not wholly in the picture, or if no ray meets the light.
    fn of(light: &SmallLight, render: &Render<'_>, camera: &Camera) -> Option<Self> {
        let size = render.resolution;
        let size = DVec2::new(f64::from(size.width), f64::from(size.height));
        let [min, max] = light.bounds;
        let middle = (0.5 * (min + max)).as_dvec3();
        let search = |pupil| FilmSearch {
            camera,
            size,
            pupil,
        };
        let place = DVec2::from(light.place).clamp(DVec2::ZERO, size);
        let center = search(PUPIL[0]).meet(middle, place)?;
        // Blades and rims hide some points of the lens.
        let of_middle = PUPIL.map(|pupil| search(pupil).meet(middle, center));
        let of_middle: Vec<DVec2> = of_middle.into_iter().flatten().collect();
        let mut corners = [center; 8];
        for (number, corner) in corners.iter_mut().enumerate() {
            let side = |axis: usize| [min, max][number >> axis & 1][axis];
            let at = Vec3::new(side(0), side(1), side(2)).as_dvec3();
            *corner = search(PUPIL[0]).meet(at, center)?;
        }
        let [blur, shape] = [
            window_around(&of_middle, MARGIN)?,
            window_around(&corners, MARGIN)?,
        ];
        let window = [0, 1].map(|end| blur[end] + shape[end] - center);
        let extent = window[1] - window[0];
        let is_inside = window[0].min_element() >= 0.0 && window[1].cmple(size).all();
        if !is_inside || !(extent.x * extent.y <= LARGEST) {
            return None;
        }
        let meets = |place: DVec2, pupil| {
            let at = place / size;
            let Some(ray) = camera.at(at.x, at.y).ray(pupil) else {
                return false;
            };
            let ray = Ray::new(ray.origin.as_vec3(), ray.direction.as_vec3());
            let share = render
                .shader
                .scene()
                .share_of_shape(&ray, light.shape, f32::INFINITY);
            share > 0.0
        };
        let (mut window, mut seen, mut ray) = (window, Vec::new(), 0.0);
        // The second time the window is hardly larger than what is seen of the light.
        for time in 0..2 {
            let extent = window[1] - window[0];
            ray = extent.x * extent.y / LOOKS as f64;
            seen = looks(window, time * LOOKS, meets);
            let margin = MARGIN + BEYOND / seen.len() as f64;
            let [min, max] = window_around(&seen, margin)?;
            window = [min.max(window[0]), max.min(window[1])];
        }
        let square = (render.exposure * light.radiance).length_squared();
        Some(Self {
            window,
            seen,
            ray,
            square,
        })
    }

    /// The columns and rows of the pixels of a region that may get the light.
    fn reach(
        &self,
        region: Region,
        filter: &FilterTable,
    ) -> impl Iterator<Item = (u32, u32)> + use<> {
        let wide = filter.radius() - 0.5;
        let side = |least: f64, most: f64, first: u32, count: u32| {
            let from = (least - wide).floor().max(f64::from(first)) as u32;
            let end = (most + wide).ceil().max(0.0) as u32;
            from..end.min(first + count)
        };
        let [min, max] = self.window;
        let columns = side(min.x, max.x, region.left, region.width);
        let rows = side(min.y, max.y, region.top, region.height);
        rows.flat_map(move |row| columns.clone().map(move |column| (column, row)))
    }

    /// What the light makes of a pixel with a number of samples; `None` if it has no part of it.
    fn in_pixel(
        &self,
        (pixel, corner): (u32, DVec2),
        count: u32,
        filter: &FilterTable,
    ) -> Option<LampPixel> {
        let [min, max] = self.window.map(|at| at - corner);
        let from = [min.x, min.y].map(|at| filter.number_at(at));
        let end = [max.x, max.y].map(|at| filter.number_at(at));
        let window = SampleWindow {
            from,
            size: [end[0] - from[0], end[1] - from[1]],
        };
        let shares = self.seen.iter().map(|at| {
            let at = *at - corner;
            self.ray * filter.share_at(at.x) * filter.share_at(at.y)
        });
        let share: f64 = shares.sum();
        if !(window.area() > 0.0 && share != 0.0) || count == 0 {
            return None;
        }
        let samples = f64::from(count);
        let share = share.abs().min(1.0);
        Some(LampPixel {
            pixel,
            window,
            samples: samples * window.area(),
            variance: self.square * share * (1.0 - share) / samples,
        })
    }
}

/// The box around film points with a margin on each side; `None` without points.
fn window_around(points: &[DVec2], margin: f64) -> Option<[DVec2; 2]> {
    let least = points.iter().copied().reduce(DVec2::min)?;
    let most = points.iter().copied().reduce(DVec2::max)?;
    let more = margin * (most - least) + ENDED;
    Some([least - more, most + more])
}

/// The places of a window from which rays through the lens meet a light. The random numbers of the
/// rays are those from a number on.
fn looks(
    [min, max]: [DVec2; 2],
    first: u64,
    meets: impl Fn(DVec2, [f64; 2]) -> bool,
) -> Vec<DVec2> {
    let number = |look: u64, axis: u64| unit(mix(4 * look + axis));
    let places = (first..first + LOOKS).map(|look| {
        let place = min + DVec2::new(number(look, 0), number(look, 1)) * (max - min);
        (place, [number(look, 2), number(look, 3)])
    });
    let seen = places.filter(|(place, pupil)| meets(*place, *pupil));
    seen.map(|(place, _)| place).collect()
}

/// A search for the film point whose ray through a point of the lens meets a point of the scene.
struct FilmSearch<'a> {
    camera: &'a Camera,
    /// The size of the picture in pixels.
    size: DVec2,
    pupil: [f64; 2],
}

impl FilmSearch<'_> {
    /// The film point in pixels.
    fn meet(&self, target: DVec3, start: DVec2) -> Option<DVec2> {
        let [right, up] = {
            let (a, b) = target.try_normalize()?.any_orthonormal_pair();
            [a, b]
        };
        // How far a ray passes from the target, across the direction to it.
        let off = |place: DVec2| {
            let at = place / self.size;
            let ray = self.camera.at(at.x, at.y).ray(self.pupil)?;
            let toward = target - ray.origin;
            let along = toward.dot(ray.direction) / ray.direction.length_squared();
            let off = toward - along * ray.direction;
            (along > 0.0).then(|| DVec2::new(off.dot(right), off.dot(up)))
        };
        let mut place = start;
        for _ in 0..STEPS {
            let here = off(place)?;
            // Toward the middle, so that the rays are on the film.
            let toward = |x: f64, size: f64| {
                if x > 0.5 * size {
                    -DIFFERENCE
                } else {
                    DIFFERENCE
                }
            };
            let step = DVec2::new(toward(place.x, self.size.x), toward(place.y, self.size.y));
            let across = (off(place + DVec2::X * step.x)? - here) / step.x;
            let down = (off(place + DVec2::Y * step.y)? - here) / step.y;
            let by_place = glam::DMat2::from_cols(across, down);
            let change = by_place.inverse() * here;
            if !change.is_finite() {
                return None;
            }
            place = (place - change).clamp(DVec2::ZERO, self.size);
            if change.length() < ENDED {
                return Some(place);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use ivcam_inventor::iv::Document;
    use ivcam_inventor::snapshot::Snapshot;
    use ivcam_optics::film::{Exposed, Resolution};
    use ivcam_optics::sampling::{Filter, Sampler, SamplerKind};

    use super::*;
    use crate::render::Stop;
    use crate::render::batch::Batch;
    use crate::render::lamp_tests::{camera, lens};
    use crate::scene::{CompileOptions, RenderScene};
    use crate::shade::{ShadeOptions, Shader, Shading};

    /// Balls in focus 2 m away, of which a bar hides most of one, and one that is out of focus. A
    /// pixel is 2.4 mm wide there.
    const LAMPS: &str = "#Inventor V2.1 ascii
Separator { Material { emissiveColor 900 500 200 }
    Translation { translation -.0113 .0052 -2 } Sphere { radius .0005 } }
Separator { Material { emissiveColor 300 300 300 }
    Translation { translation .0102 -.0061 -2 } Sphere { radius .0007 } }
Separator { Translation { translation .0097 -.0061 -1.999 }
    Cube { width .0015 height .1 depth .0001 } }
Separator { Material { emissiveColor 100 400 900 }
    Translation { translation 0 0 -4 } Cube { width .001 height .001 depth .001 } }
Separator { Material { emissiveColor .3 .2 .1 }
    Translation { translation 0 0 -6 } Cube { width 9 height 9 depth .1 } }
";

    const SEEDS: u64 = 1000;

    /// Exposures of each pixel with a lamp, with and without its window, have the same mean, and
    /// the window takes most of the noise.
    #[test]
    fn a_window_changes_the_noise_of_an_exposure_and_not_its_mean() {
        let document = Document::read_headerless("lamps.iv", LAMPS.as_bytes().to_vec()).unwrap();
        let snapshot = Snapshot::at(&document, 0.0);
        let scene = RenderScene::compile(&snapshot, &CompileOptions::default()).unwrap();
        let camera = camera(lens("double-gauss"), false);
        for filter in [Filter::Box, Filter::Mitchell] {
            let render = Render {
                shader: &Shader::new(&scene, Shading::Recursive, ShadeOptions::default()),
                camera: &camera,
                sampler: Sampler::new(SamplerKind::Sobol, 16, 3),
                resolution: Resolution::of(24, 16),
                exposure: 1.0,
                stop: Stop::after(16),
                filter: &FilterTable::new(filter),
                adaptive: false,
                team: None,
                lamps: None,
            };
            let film = render.run(&|_| ()).film;
            let mut lights = scene.small_lights([24.0, 16.0], 1.0);
            assert_eq!(lights.len(), 3);
            let images = LampImages::take_from(&mut lights, &render);
            assert_eq!(lights.len(), 1, "the one out of focus");
            let region = Region::whole(render.resolution);
            let pixels = images.pixels((&film, region), render.filter);
            assert!(pixels.len() >= 2);
            let mut noise = [0.0; 2];
            // Plain samples hit smaller windows so seldom that their scatter says little.
            for lamp in pixels.iter().filter(|lamp| lamp.window.area() > 0.02) {
                let at = (lamp.pixel % 24, lamp.pixel / 24);
                let [plain, narrow] =
                    [None, Some(lamp.window)].map(|window| exposures(&render, at, window));
                let error = ((plain.1 + narrow.1) / SEEDS as f64).sqrt();
                let z = (plain.0 - narrow.0) / error;
                assert!(z.abs() < 4.5, "{filter:?} {lamp:?}: {plain:?} {narrow:?}");
                noise[0] += plain.1;
                noise[1] += narrow.1;
            }
            assert!(noise[1] < 0.8 * noise[0], "{filter:?}: {noise:?}");
        }
    }

    /// The mean and the variance of the red level of exposures of a pixel.
    fn exposures(render: &Render<'_>, at: (u32, u32), window: Option<SampleWindow>) -> (f64, f64) {
        let mut batch = Batch::new(render);
        let levels: Vec<f64> = (0..SEEDS)
            .map(|seed| {
                let sampler = Sampler {
                    seed,
                    ..render.sampler
                };
                let mut sums = [Exposed::default()];
                batch.add_in(at, window, sampler, 0..16, &mut sums);
                batch.flush(&mut sums);
                sums[0].mean.x
            })
            .collect();
        let mean = levels.iter().sum::<f64>() / SEEDS as f64;
        let squares = levels.iter().map(|x| (x - mean).powi(2));
        (mean, squares.sum::<f64>() / (SEEDS - 1) as f64)
    }
}
