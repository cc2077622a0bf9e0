//! Compares the paper's first approach, a lens made of solids in the scene, with its second, a lens
//! in the camera. Film and lens are the same; the light is computed by different code.

use std::path::Path;

use common::{Folder, ivcam};
use glam::{DVec2, DVec3};
use ivcam_base::math::{Meters, Mm};
use ivcam_inventor::iv::Document;
use ivcam_inventor::snapshot::Snapshot;
use ivcam_optics::lens::{FocusMethod, Lens, LensRay, RearElement};
use ivcam_optics::picture::Raster;
use ivcam_optics::sampling::{DiscMap, Sampler, SamplerKind};
use ivcam_render::bvh::Ray;
use ivcam_render::camera::{film_plane, lens_in_scene};
use ivcam_render::scene::{CompileOptions, RenderScene};
use ivcam_render::shade::{ShadeOptions, Shader, Shading};

use super::common;

/// Boards of several grays at 2 m, and a black wall behind.
const BOARDS: &str = "LightModel { model BASE_COLOR }
Separator { Material { diffuseColor 0.1 0.1 0.1 } Translation { translation 0 0 -3 } Cube { width 9 height 9 depth 0.1 } }
Separator { Material { diffuseColor 0.9 0.9 0.9 } Translation { translation -0.3 0.1 -2 } Cube { width 0.5 height 0.6 depth 0.1 } }
Separator { Material { diffuseColor 0.5 0.5 0.5 } Translation { translation 0.4 -0.2 -2 } Cube { width 0.4 height 0.5 depth 0.1 } }
";

const COLUMNS: u32 = 18;
const ROWS: u32 = 12;
const SAMPLES: u32 = 64;

struct Bench {
    lens: Lens,
    film_z: f64,
    radius: f64,
    boards: RenderScene,
    boards_and_lens: RenderScene,
}

impl Bench {
    fn new() -> Self {
        let lens = Lens::named("double-gauss").expect("it is shipped");
        let lens = lens.scaled_to(Mm(50.0)).expect("it has a focal length");
        let focus = lens.focus(FocusMethod::Film, Meters(2.0));
        let film = film_plane(&lens, 0.0);
        let solids = lens_in_scene(&lens, &film, None);
        let solids = solids.expect("its surfaces are spheres");
        let body = solids.split_once('\n').expect("a header").1;
        let header = "#Inventor V2.1 ascii\n";
        Self {
            film_z: focus.expect("2 m is in its reach").film_z,
            radius: RearElement::new(&lens, DiscMap::Concentric).radius,
            boards: compiled(&format!("{header}{BOARDS}")),
            boards_and_lens: compiled(&format!("{header}{BOARDS}{body}")),
            lens,
        }
    }

    /// Returns the origin, direction and weight of a ray from a point of the film to a point of the
    /// rear element.
    fn film_ray(&self, pixel: u32, index: u32, seed: u64) -> (DVec3, DVec3, f64) {
        let sampler = Sampler::new(SamplerKind::Random, SAMPLES, seed);
        let at = sampler.pixel(u64::from(pixel), [pixel, 0]).sample(index);
        let x = (f64::from(pixel % COLUMNS) + at.film[0]) / f64::from(COLUMNS);
        let y = (f64::from(pixel / COLUMNS) + at.film[1]) / f64::from(ROWS);
        let film = DVec2::new(36.0 * (0.5 - x), 24.0 * (y - 0.5)).extend(self.film_z);
        let (u, v) = (at.pupil[0], std::f64::consts::TAU * at.pupil[1]);
        let aim = self.radius * u.sqrt() * DVec2::new(v.cos(), v.sin());
        let direction = (aim.extend(self.lens.length()) - film).normalize();
        (film, direction, direction.z.powi(4))
    }

    /// Returns the mean and its variance for every pixel.
    fn picture(&self, light: impl Fn(DVec3, DVec3) -> f64, seed: u64) -> Vec<(f64, f64)> {
        let pixel = |p| {
            let n = f64::from(SAMPLES);
            let (mut sum, mut squares) = (0.0, 0.0);
            for index in 0..SAMPLES {
                let (film, direction, weight) = self.film_ray(p, index, seed);
                let value = weight * light(film, direction);
                sum += value;
                squares += value * value;
            }
            let mean = sum / n;
            (mean, (squares / n - mean * mean).max(0.0) / (n - 1.0))
        };
        (0..COLUMNS * ROWS).map(pixel).collect()
    }

    fn by_camera(&self, film: DVec3, direction: DVec3) -> f64 {
        let ray = LensRay::new(film, direction);
        match self.lens.trace_from_film(&ray) {
            Ok(out) => radiance(&self.boards, 1e-3 * out.origin, out.direction),
            Err(_) => 0.0,
        }
    }

    fn by_solids(&self, film: DVec3, direction: DVec3) -> f64 {
        radiance(&self.boards_and_lens, 1e-3 * film, direction)
    }
}

fn compiled(text: &str) -> RenderScene {
    let document = Document::read_headerless("lens.iv", text.as_bytes().to_vec());
    let document = document.expect("it is well formed");
    let snapshot = Snapshot::at(&document, 0.0);
    RenderScene::compile(&snapshot, &CompileOptions::default()).expect("it compiles")
}

fn radiance(scene: &RenderScene, origin: DVec3, direction: DVec3) -> f64 {
    let options = ShadeOptions {
        max_depth: 64,
        ..ShadeOptions::default()
    };
    let shader = Shader::new(scene, Shading::Recursive, options);
    let ray = Ray::new(origin.as_vec3(), direction.as_vec3());
    f64::from(shader.radiance(&ray, &mut Default::default()).x)
}

#[test]
fn a_lens_of_solids_makes_the_camera_model_s_picture_within_the_statistical_error() {
    let bench = Bench::new();
    let camera = bench.picture(|f, d| bench.by_camera(f, d), 1);
    let solids = bench.picture(|f, d| bench.by_solids(f, d), 2);
    let (mut chi, mut lit, mut sum) = (0.0, 0.0, (0.0, 0.0, 0.0));
    for ((a, va), (b, vb)) in camera.iter().zip(&solids) {
        sum = (sum.0 + a, sum.1 + b, sum.2 + va + vb);
        if va + vb > 0.0 {
            chi += (a - b) * (a - b) / (va + vb);
            lit += 1.0;
        }
    }
    assert!(lit > 150.0, "only {lit} pixels got light");
    // The sum of all pixels tests the bias of the whole picture; 3.9 deviations are p = 1e-4.
    let z = (sum.0 - sum.1) / sum.2.sqrt();
    assert!(z.abs() < 3.9, "the pictures differ by {z} deviations");
    // χ² of the pixels is normalized by Wilson and Hilferty's cube root.
    let cube = ((chi / lit).cbrt() - (1.0 - 2.0 / (9.0 * lit))) / (2.0 / (9.0 * lit)).sqrt();
    assert!(cube < 3.9, "χ² {chi} of {lit} pixels, {cube} deviations");
}

/// With the same rays in both, the difference is rounding: single precision in the scene, double in
/// the lens. It moves a ray by micrometers in the scene, and so changes the result only at edges.
#[test]
fn the_same_rays_bring_the_same_light_but_for_edges() {
    let bench = Bench::new();
    let (mut rays, mut through, mut unlike) = (0, 0, 0);
    for pixel in 0..COLUMNS * ROWS {
        for index in 0..SAMPLES {
            let (film, direction, _) = bench.film_ray(pixel, index, 3);
            let (a, b) = (
                bench.by_camera(film, direction),
                bench.by_solids(film, direction),
            );
            rays += 1;
            through += i32::from(a > 0.0);
            unlike += i32::from((a - b).abs() > 1e-6);
        }
    }
    assert!(through > 2000, "{through} of {rays} rays passed");
    assert!(unlike * 1000 < rays, "{unlike} of {rays} rays differ");
}

/// Returns the brightness of each block of 6 by 6 pixels.
fn blocks(path: &str) -> Vec<f64> {
    let picture = Raster::open(Path::new(path)).expect("it was just rendered");
    let (across, down) = (picture.width as usize / 6, picture.height as usize / 6);
    let mut sums = vec![0.0; across * down];
    for i in 0..picture.pixels() {
        let (x, y) = (i % picture.width as usize, i / picture.width as usize);
        let level = f64::from(picture.color(i).iter().sum::<f32>());
        sums[y / 6 * across + x / 6] += level / 108.0;
    }
    sums
}

fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    (mean, squares / (n * (n - 1.0)))
}

/// Runs the command line with and without `--solids`. Four pictures each, with independent random
/// numbers, give the error.
#[test]
fn the_picture_rendered_with_solids_is_the_camera_s_within_the_statistical_error() {
    let folder = Folder::new("solids");
    let camera = "PerspectiveCamera { position 0.1 0.2 0.3 orientation 0 1 0 0.1 }\n";
    let lamp = "PointLight { location 1 2 2 }\n";
    let lit = BOARDS
        .split_once('\n')
        .expect("its first line is the light model")
        .1;
    let scene = folder.file(
        "a.iv",
        &format!("#Inventor V2.1 ascii\n{camera}{lamp}{lit}"),
    );
    let shoot = |solids: &str, seed: u32| {
        let picture = folder.path(&format!("{seed}{solids}.exr"));
        let line = format!(
            "render {scene} --lens double-gauss --efl 50mm --focus 2 --pupil rear --size 36x24 \
             --samples 32 --quiet --seed {seed} -o {picture} {solids}"
        );
        assert_eq!(ivcam(&line, &[]), 0);
        blocks(&picture)
    };
    let camera: Vec<_> = (0..4).map(|seed| shoot("", seed)).collect();
    let solids: Vec<_> = (4..8).map(|seed| shoot("--solids", seed)).collect();
    let of =
        |all: &[Vec<f64>], i: usize| mean_and_error(&all.iter().map(|b| b[i]).collect::<Vec<_>>());
    let (mut squares, mut bright) = (0.0, 0.0);
    let count = camera[0].len();
    for i in 0..count {
        let ((a, va), (b, vb)) = (of(&camera, i), of(&solids, i));
        bright += a / count as f64;
        // For t with 6 degrees of freedom, the mean of the square is 6/4,
        squares += (a - b) * (a - b) / (va + vb).max(1e-12) / count as f64;
    }
    assert!(bright > 0.05, "a black picture tests nothing: {bright}");
    // and that of the fourth power is 3·36/(4·2).
    let spread = ((13.5 - 2.25) / count as f64).sqrt();
    assert!(
        squares < 1.5 + 3.7 * spread,
        "mean t² {squares}, of {count} blocks"
    );

    // With the same random numbers, only rounding differs, which changes the result at edges.
    let (same, solid) = (shoot("", 9), shoot("--solids", 9));
    let apart = same.iter().zip(&solid).map(|(a, b)| (a - b).abs());
    let apart = apart.fold(0.0, f64::max);
    assert!(apart < 0.002, "a block differs by {apart}");
}
