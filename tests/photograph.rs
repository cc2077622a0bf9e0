//! Rendered pictures measured with a ruler: vignetting and blur discs agree with what the rays of
//! the same lens say. The pictures come from the whole program, scene
//! and shader and film; the numbers beside them from `lens` alone.
//!
//! Every picture is made several times with other random numbers; what is measured has a mean and
//! a standard error, and the test is how many of those the two are apart. Six standard errors of
//! eight pictures is p = 5e-4 for a single comparison, and the seeds are fixed.

use glam::{DQuat, DVec2, DVec3};
use ivcam::camera::{Aim, Camera, LensCamera};
use ivcam::film::{Film, FilmFormat, Resolution};
use ivcam::iv::Document;
use ivcam::lens::{Focus, FocusMethod, Lens, LensRay};
use ivcam::math::{Meters, Mm};
use ivcam::pose::CameraPose;
use ivcam::render::{Render, Stop};
use ivcam::sampling::{Filter, FilterTable, Sampler, SamplerKind};
use ivcam::scene::{CompileOptions, RenderScene};
use ivcam::shade::{ShadeOptions, Shader, Shading};

/// A lens in focus and the film behind it.
struct Bench {
    lens: Lens,
    focus: Focus,
    film: FilmFormat,
    size: Resolution,
}

impl Bench {
    /// `film` in millimeters, `pixels` across and down.
    fn new(lens: Lens, meters: f64, film: [f64; 2], pixels: [u32; 2]) -> Self {
        Self {
            focus: lens.focus(FocusMethod::Film, Meters(meters)).unwrap(),
            lens,
            film: FilmFormat {
                width: film[0],
                height: film[1],
            },
            size: Resolution::new(pixels[0], pixels[1]).unwrap(),
        }
    }

    fn camera(&self) -> Camera {
        let pose = CameraPose {
            position: DVec3::ZERO,
            orientation: DQuat::IDENTITY,
            ..CameraPose::view_all(Default::default(), 1.5)
        };
        let (lens, film) = (self.lens.clone(), self.film);
        let camera = LensCamera::new(lens, self.focus, film, Aim::ExitPupil, &pose);
        Camera::Lens(Box::new(camera))
    }

    fn photograph(&self, scene: &RenderScene, sampler: Sampler) -> Film {
        let shader = Shader::new(scene, Shading::Flat, ShadeOptions::default());
        let render = Render {
            shader: &shader,
            camera: &self.camera(),
            sampler,
            resolution: self.size,
            exposure: 1.0,
            stop: Stop::after(sampler.samples),
            filter: &FilterTable::new(Filter::Box),
            adaptive: false,
        };
        render.run(&|_| ()).film
    }

    /// The same picture with eight seeds.
    fn photographs(&self, scene: &RenderScene, samples: u32) -> Vec<Film> {
        let sampler = |seed| Sampler {
            kind: SamplerKind::Sobol,
            samples,
            seed,
        };
        (1..=8)
            .map(|seed| self.photograph(scene, sampler(seed)))
            .collect()
    }

    /// The exposure of a pixel.
    fn level(&self, film: &Film, x: u32, y: u32) -> f64 {
        film.pixels[(y * self.size.width + x) as usize].mean.x
    }

    /// The middle of a pixel in the upright picture, in millimeters to the right and up.
    fn place(&self, x: u32, y: u32) -> DVec2 {
        let share = |i: u32, n: u32| (f64::from(i) + 0.5) / f64::from(n) - 0.5;
        DVec2::new(
            self.film.width * share(x, self.size.width),
            -self.film.height * share(y, self.size.height),
        )
    }

    /// Light, its middle, and its mean square distance from there, around a place.
    fn disc(&self, film: &Film, around: DVec2, reach: f64) -> (f64, DVec2, f64) {
        let pixels = (0..self.size.height).flat_map(|y| (0..self.size.width).map(move |x| (x, y)));
        let near: Vec<(DVec2, f64)> = pixels
            .map(|(x, y)| (self.place(x, y), self.level(film, x, y)))
            .filter(|(p, _)| (*p - around).abs().max_element() < reach)
            .collect();
        let light: f64 = near.iter().map(|(_, l)| l).sum();
        let middle = near.iter().map(|(p, l)| *p * *l).sum::<DVec2>() / light;
        let square = |(p, l): &(DVec2, f64)| l * (*p - middle).length_squared();
        (light, middle, near.iter().map(square).sum::<f64>() / light)
    }

    /// The image of a point of the scene by rays alone: its middle and its mean square radius, in
    /// the upright picture, in millimeters. Every direction from the point counts by its solid
    /// angle and the cosine of a board across the axis.
    fn spot(&self, point: DVec3) -> (DVec2, f64) {
        let origin = 1000.0 * point;
        let pupil = self.lens.first_order().entrance_pupil.unwrap();
        const GRID: i32 = 250;
        let step = 2.2 * pupil.semi_diameter / f64::from(GRID);
        let mut hits = Vec::new();
        for j in -GRID / 2..GRID / 2 {
            for i in -GRID / 2..GRID / 2 {
                let aim = step * DVec2::new(f64::from(i) + 0.5, f64::from(j) + 0.5);
                let ray = LensRay {
                    origin: DVec3::new(origin.x, origin.y, origin.z),
                    direction: aim.extend(pupil.z) - origin,
                };
                let Ok(out) = self.lens.trace_from_scene(&ray) else {
                    continue;
                };
                let reach = (self.focus.film_z - out.origin.z) / out.direction.z;
                let at = (out.origin + reach * out.direction).truncate();
                let cos = ray.direction.normalize().z;
                hits.push((-at, cos * cos / ray.direction.length_squared()));
            }
        }
        let light: f64 = hits.iter().map(|(_, l)| l).sum();
        let middle = hits.iter().map(|(p, l)| *p * *l).sum::<DVec2>() / light;
        let square = |(p, l): &(DVec2, f64)| l * (*p - middle).length_squared();
        (middle, hits.iter().map(square).sum::<f64>() / light)
    }
}

fn scene(body: &str) -> RenderScene {
    let text = format!("#Inventor V2.1 ascii\nLightModel {{ model BASE_COLOR }}\n{body}");
    let document = Document::read_headerless("test.iv", text.into_bytes()).unwrap();
    RenderScene::compile(&document, &CompileOptions::default()).unwrap()
}

/// A white board across the axis, by its middle and its size in meters.
fn board(middle: DVec3, width: f64, height: f64) -> String {
    let DVec3 { x, y, z } = middle;
    let (w, h) = (0.5 * width, 0.5 * height);
    format!(
        "Separator {{ Material {{ diffuseColor 1 1 1 }} Translation {{ translation {x} {y} {z} }} \
         Coordinate3 {{ point [ -{w} -{h} 0, {w} -{h} 0, {w} {h} 0, -{w} {h} 0 ] }} \
         FaceSet {{ numVertices 4 }} }}\n"
    )
}

fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    (mean, (square / (n - 1.0) / n).sqrt())
}

/// Holds measured values against a number, with a slack for what is no noise.
fn agree(what: &str, measured: &[f64], expected: f64, slack: f64) {
    let (mean, error) = mean_and_error(measured);
    let off = (mean - expected).abs();
    assert!(
        off < 6.0 * error + slack,
        "{what}: {mean} \u{b1} {error} in the picture, {expected} by rays"
    );
}

/// A white board fills the view: the pixels have the irradiance of their film points. Samples are
/// independent here, so a pixel's own variance is that of its mean, and the sum over pixels is off
/// by its own standard error: 4 of them are p = 6e-5.
#[test]
fn vignetting_in_a_picture_of_a_white_field_is_that_of_the_rays() {
    for name in ["double-gauss", "wide-angle"] {
        let lens = Lens::named(name).unwrap().scaled_to(Mm(40.0)).unwrap();
        let bench = Bench::new(lens, f64::INFINITY, [36.0, 24.0], [24, 16]);
        let white = scene(&board(DVec3::new(0.0, 0.0, -50.0), 400.0, 400.0));
        let sampler = Sampler {
            kind: SamplerKind::Random,
            samples: 400,
            seed: 5,
        };
        let film = bench.photograph(&white, sampler);
        let Camera::Lens(camera) = bench.camera() else {
            unreachable!("it is made with a lens")
        };
        let (mut sum, mut variance) = (0.0, 0.0);
        for (i, pixel) in film.pixels.iter().enumerate().step_by(13) {
            let (x, y) = (i as u32 % bench.size.width, i as u32 / bench.size.width);
            // The mean over the pixel by Gauss's four points.
            let side = bench.film.width / f64::from(bench.size.width);
            let quarter = 0.5 * side / 3f64.sqrt();
            let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)];
            let light = corners.map(|(a, b)| {
                let film = bench.place(x, y) + quarter * DVec2::new(a, b);
                bench.lens.irradiance(film, bench.focus.film_z)
            });
            let exact = 0.25 * light.iter().sum::<f64>() / camera.axial_irradiance();
            assert!(
                (pixel.mean.x - exact).abs() < 0.05 * exact,
                "{name} at {x}, {y}"
            );
            sum += pixel.mean.x - exact;
            variance += pixel.variance_of_mean().x;
        }
        let z = sum / variance.sqrt();
        assert!(
            z.abs() < 4.0,
            "{name}: the picture is off by {z} deviations"
        );
    }
}

/// What the pixels and the size of the point itself add to the mean square radius of a disc.
fn added(pixel: f64, point: f64) -> f64 {
    (pixel * pixel + point * point) / 6.0
}

/// Points in front of the plane in focus. A uniform disc of diameter B has a mean square radius
/// of B²/8.
#[test]
fn blur_discs_in_a_picture_of_points_are_those_of_the_rays() {
    let lens = Lens::named("double-gauss")
        .unwrap()
        .scaled_to(Mm(50.0))
        .unwrap();
    let lens = lens.at_f_number(4.0).unwrap();
    let bench = Bench::new(lens, 2.0, [11.04, 1.2], [184, 20]);
    let efl = bench.lens.first_order().efl();
    for depth in [0.8, 1.0, 8.0] {
        let size = 0.06 * depth / efl;
        let points = [-0.09, 0.0, 0.09].map(|slope| DVec3::new(slope * depth, 0.0, -depth));
        let body: String = points.map(|p| board(p, size, size)).concat();
        let films = bench.photographs(&scene(&body), 96);
        for point in points {
            let (middle, square) = bench.spot(point);
            let discs = films.iter().map(|film| bench.disc(film, middle, 0.58));
            let discs: Vec<_> = discs.collect();
            // The point's size on the film is from its distance to the entrance pupil.
            let on_film = size / depth * (bench.focus.image_distance / 1000.0) * 1000.0;
            let own = added(0.06, on_film);
            let diameter = |square: f64| (8.0 * (square - own)).max(0.0).sqrt();
            let measured: Vec<f64> = discs.iter().map(|d| diameter(d.2)).collect();
            let exact = (8.0 * square).sqrt();
            agree(&format!("disc of {point}"), &measured, exact, 5e-3 * exact);
            let x: Vec<f64> = discs.iter().map(|d| d.1.x).collect();
            agree(&format!("middle of {point}"), &x, middle.x, 1e-3);
        }
    }
}
