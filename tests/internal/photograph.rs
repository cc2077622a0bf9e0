//! Compares distortion, vignetting, blur discs, the limits of the depth of field, and the sharp
//! plane of a tilted lens in rendered pictures with rays of the same lens. The pictures come from
//! the whole program, with scene, shader and film; the expected numbers from `lens` alone.
//!
//! Every picture is rendered with several seeds. A measurement has a mean and a standard error, and
//! the test limits their ratio. Six standard errors of eight pictures are p = 5e-4 for a single
//! comparison, and the seeds are fixed.

use glam::{DQuat, DVec2, DVec3};
use ivcam_base::math::{Meters, Mm};
use ivcam_inventor::iv::Document;
use ivcam_inventor::pose::CameraPose;
use ivcam_inventor::snapshot::Snapshot;
use ivcam_optics::film::{Film, FilmFormat, Resolution};
use ivcam_optics::lens::{FilmPlace, Focus, FocusMethod, Lens, LensRay, Meridian, Movements};
use ivcam_optics::sampling::{Filter, FilterTable, Sampler, SamplerKind};
use ivcam_render::camera::{Aim, Camera, LensCamera};
use ivcam_render::render::{Render, Stop};
use ivcam_render::scene::{CompileOptions, RenderScene};
use ivcam_render::shade::{ShadeOptions, Shader, Shading};

/// A lens in focus and the film behind it.
struct Bench {
    lens: Lens,
    focus: Focus,
    film: FilmFormat,
    size: Resolution,
    moved: Movements,
}

impl Bench {
    /// Builds the bench; `film` is in millimeters, `pixels` across and down.
    fn new(lens: Lens, meters: f64, film: [f64; 2], pixels: [u32; 2]) -> Self {
        Self {
            focus: lens.focus(FocusMethod::Film, Meters(meters)).unwrap(),
            lens,
            film: FilmFormat {
                width: film[0],
                height: film[1],
            },
            size: Resolution::new(pixels[0], pixels[1]).unwrap(),
            moved: Movements::default(),
        }
    }

    fn camera(&self) -> Camera {
        let pose = CameraPose {
            position: DVec3::ZERO,
            orientation: DQuat::IDENTITY,
            ..CameraPose::view_all(Default::default(), 1.5)
        };
        let (lens, film) = (self.lens.clone(), self.film);
        let place = FilmPlace::new(&lens, &self.focus, &self.moved, film).unwrap();
        let camera = LensCamera::with_film(lens, self.focus, place, film, Aim::ExitPupil, &pose);
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
            team: None,
            lamps: None,
        };
        render.run(&|_| ()).film
    }

    /// Renders the picture with eight seeds.
    fn photographs(&self, scene: &RenderScene, samples: u32) -> Vec<Film> {
        let sampler = |seed| Sampler::new(SamplerKind::Sobol, samples, seed);
        (1..=8)
            .map(|seed| self.photograph(scene, sampler(seed)))
            .collect()
    }

    /// Returns the exposure of a pixel.
    fn level(&self, film: &Film, x: u32, y: u32) -> f64 {
        film.pixels[(y * self.size.width + x) as usize].mean.x
    }

    /// Returns the center of a pixel in the upright picture, in millimeters to the right and up.
    fn place(&self, x: u32, y: u32) -> DVec2 {
        let share = |i: u32, n: u32| (f64::from(i) + 0.5) / f64::from(n) - 0.5;
        DVec2::new(
            self.film.width * share(x, self.size.width),
            -self.film.height * share(y, self.size.height),
        )
    }

    /// Returns the light around a place, its centroid, and its mean square distance from there.
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

    /// Returns the centroid and the mean square radius of the image of a scene point by rays alone,
    /// in the upright picture, in millimeters. A direction from the point is weighted by its solid
    /// angle and the cosine at a board across the axis.
    fn spot(&self, point: DVec3) -> (DVec2, f64) {
        let origin = 1000.0 * point;
        let pupil = self.lens.first_order().entrance_pupil.unwrap();
        const GRID: i32 = 250;
        let step = 2.2 * pupil.semi_diameter / f64::from(GRID);
        let mut hits = Vec::new();
        for j in -GRID / 2..GRID / 2 {
            for i in -GRID / 2..GRID / 2 {
                let aim = step * DVec2::new(f64::from(i) + 0.5, f64::from(j) + 0.5);
                let ray = LensRay::new(
                    DVec3::new(origin.x, origin.y, origin.z),
                    aim.extend(pupil.z) - origin,
                );
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
    RenderScene::compile(&Snapshot::at(&document, 0.0), &CompileOptions::default()).unwrap()
}

/// Returns a white board across the axis, by its center and its size in meters.
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

/// Compares measured values with a number, with a tolerance for systematic differences.
fn agree(what: &str, measured: &[f64], expected: f64, slack: f64) {
    let (mean, error) = mean_and_error(measured);
    let off = (mean - expected).abs();
    assert!(
        off < 6.0 * error + slack,
        "{what}: {mean} \u{b1} {error} in the picture, {expected} by rays"
    );
}

/// A white board fills the view, so pixels have the irradiance of their film points. The samples
/// are independent, so a pixel's variance is that of its mean. The sum over pixels is compared with
/// 4 of its standard errors, p = 6e-5.
#[test]
fn vignetting_in_a_picture_of_a_white_field_is_that_of_the_rays() {
    for name in ["double-gauss", "wide-angle"] {
        let lens = Lens::named(name).unwrap().scaled_to(Mm(40.0)).unwrap();
        let bench = Bench::new(lens, f64::INFINITY, [36.0, 24.0], [24, 16]);
        let white = scene(&board(DVec3::new(0.0, 0.0, -50.0), 400.0, 400.0));
        let sampler = Sampler::new(SamplerKind::Random, 400, 5);
        let film = bench.photograph(&white, sampler);
        let Camera::Lens(camera) = bench.camera() else {
            unreachable!("it is made with a lens")
        };
        let (mut sum, mut variance) = (0.0, 0.0);
        for (i, pixel) in film.pixels.iter().enumerate().step_by(13) {
            let (x, y) = (i as u32 % bench.size.width, i as u32 / bench.size.width);
            // The mean over the pixel is by Gauss's four points.
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

/// Returns the contribution of the pixels and of the point's size to the mean square radius of a
/// disc.
fn added(pixel: f64, point: f64) -> f64 {
    (pixel * pixel + point * point) / 6.0
}

/// The points are in front of the plane in focus. A uniform disc of diameter B has a mean square
/// radius of B²/8.
#[test]
fn blur_discs_in_a_picture_of_points_are_those_of_the_rays() {
    for name in ["double-gauss", "takumar-50"] {
        check_blur_discs(name);
    }
}

fn check_blur_discs(name: &str) {
    let lens = Lens::named(name).unwrap().scaled_to(Mm(50.0)).unwrap();
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
            // The point's size on the film follows from its distance to the entrance pupil.
            let on_film = size / depth * (bench.focus.image_distance / 1000.0) * 1000.0;
            let own = added(0.06, on_film);
            let diameter = |square: f64| (8.0 * (square - own)).max(0.0).sqrt();
            let measured: Vec<f64> = discs.iter().map(|d| diameter(d.2)).collect();
            let exact = (8.0 * square).sqrt();
            let what = format!("{name}, disc of {point}");
            agree(&what, &measured, exact, 5e-3 * exact);
            let x: Vec<f64> = discs.iter().map(|d| d.1.x).collect();
            agree(&format!("{name}, middle of {point}"), &x, middle.x, 1e-3);
        }
    }
}

/// Returns the diameter of a uniform disc with a mean square radius.
fn diameter(square: f64) -> f64 {
    (8.0 * square).max(0.0).sqrt()
}

/// A grid of distant points is photographed through lenses of over 2% distortion at the edge. The
/// displacement of a point's image from that of a pinhole is the distortion of the chief ray that
/// arrives there. The centroid of an asymmetric image is off by a part of its size, at f/32 less
/// than a fiftieth of a pixel, which is the tolerance.
#[test]
fn distortion_in_a_picture_of_a_grid_is_that_of_the_rays() {
    for name in ["canon-14", "nikkor-14-30"] {
        check_distortion(name);
    }
}

fn check_distortion(name: &str) {
    let lens = Lens::named(name).unwrap().scaled_to(Mm(14.0)).unwrap();
    let lens = lens.at_f_number(32.0).unwrap();
    let pixel = 0.16;
    let bench = Bench::new(lens, f64::INFINITY, [24.0, 24.0], [150, 150]);
    let efl = bench.lens.first_order().efl();
    let depth = 1000.0;
    let grid: Vec<DVec2> = [-9.0, -4.5, 0.0, 4.5, 9.0]
        .into_iter()
        .flat_map(|x| [-9.0, 0.0, 4.5].map(|y| DVec2::new(x, y)))
        .filter(|at| at.length() > 0.0)
        .collect();
    // The direction that the chief ray of each place comes from.
    let points: Vec<(DVec2, f64, DVec3)> = grid
        .iter()
        .map(|at| {
            let height = at.length();
            let bent = bench
                .lens
                .distortion(Meridian::Y, height, bench.focus.film_z);
            let bent = bent.unwrap();
            let slope = libm::tan(bent.angle) / height;
            let point = DVec3::new(at.x * slope, at.y * slope, -1.0) * depth;
            (*at, bent.f_tan, point)
        })
        .collect();
    let size = pixel * depth / efl;
    let body: String = points.iter().map(|(.., p)| board(*p, size, size)).collect();
    let films = bench.photographs(&scene(&body), 24);
    let mut most: f64 = 0.0;
    for (at, bent, point) in points {
        let slack = 0.02 * pixel / at.length();
        // A pinhole's image is at the height of its direction.
        let straight = efl.abs() * point.truncate().length() / depth;
        let measured = films.iter().map(|film| {
            let (_, middle, _) = bench.disc(film, at, 1.2);
            middle.length() / straight - 1.0
        });
        agree(
            &format!("{name} at {at}"),
            &measured.collect::<Vec<_>>(),
            bent,
            slack,
        );
        most = most.max(bent.abs());
    }
    assert!(most > 0.02, "{name} bends by {most} only");
}

/// The nearest and the farthest depth with the allowed blur disc are measured in pictures of points
/// near them. By rays, it is the distance where the spot is that large; by first-order optics it is
/// D s / (D ± c / m) from the entrance pupil of diameter D, with m the scale of the plane in focus.
#[test]
fn the_limits_of_the_depth_of_field_in_pictures_are_those_of_the_rays() {
    let circle = 0.05;
    let lens = Lens::named("double-gauss").unwrap().scaled_to(Mm(50.0));
    let lens = lens.unwrap().at_f_number(11.0).unwrap();
    let bench = Bench::new(lens, 2.0, [0.25, 0.25], [25, 25]);
    let pixel = 0.01;
    let first = bench.lens.first_order();
    let (focal, pupil) = (first.focal.unwrap(), first.entrance_pupil.unwrap());
    let scale = focal.efl.abs() / (2000.0 + focal.front_focal_point);
    let (sharp, opening) = (2000.0 + pupil.z, 2.0 * pupil.semi_diameter);
    for (what, sign) in [("near", 1.0), ("far", -1.0)] {
        let formula = sharp * opening / (opening + sign * circle / scale) - pupil.z;
        let by_rays = |depth: f64| diameter(bench.spot(DVec3::new(0.0, 0.0, -depth)).1);
        let rays = limit(
            |depth| by_rays(depth) - circle,
            [0.8, 1.25].map(|f| f * 1e-3 * formula),
        );
        assert!(
            (rays / (1e-3 * formula) - 1.0).abs() < 0.03,
            "{what}: {rays} {formula}"
        );
        // The diameter is linear in 1/depth.
        let depths = [0.97, 1.03].map(|f| f * rays);
        let measured = depths.map(|depth| {
            let size = pixel * depth * 1000.0 / focal.efl;
            let point = board(DVec3::new(0.0, 0.0, -depth), 1e-3 * size, 1e-3 * size);
            let films = bench.photographs(&scene(&point), 192);
            let on_film = pixel * bench.focus.image_distance / focal.efl;
            let own = added(pixel, on_film);
            let discs = films
                .iter()
                .map(|film| bench.disc(film, DVec2::ZERO, 0.12).2);
            discs
                .map(|square| diameter(square - own))
                .collect::<Vec<f64>>()
        });
        let found = measured[0].iter().zip(&measured[1]).map(|(a, b)| {
            let part = (circle - a) / (b - a);
            1.0 / (1.0 / depths[0] + part * (1.0 / depths[1] - 1.0 / depths[0]))
        });
        agree(
            &format!("{what} limit"),
            &found.collect::<Vec<_>>(),
            rays,
            2e-3 * rays,
        );
    }
}

/// Returns the root of a function whose signs at the ends differ.
fn limit(f: impl Fn(f64) -> f64, [mut a, mut b]: [f64; 2]) -> f64 {
    let sign = f(a).signum();
    assert!(f(b).signum() != sign, "both ends have one sign");
    for _ in 0..14 {
        let middle = 0.5 * (a + b);
        *if f(middle).signum() == sign {
            &mut a
        } else {
            &mut b
        } = middle;
    }
    0.5 * (a + b)
}

/// The points are on the plane of the hinge rule, from 2.6 to 8 meters away. Through the tilted
/// lens all are dots; through the straight lens only the one in the middle is. A dot as wide as a
/// pixel covers one or two: its square radius is off by at most p²/6, the diameter of its blur by
/// √(4/3) p.
#[test]
fn a_picture_of_the_tilted_plane_through_a_tilted_lens_is_sharp_all_over() {
    for name in ["biogon", "double-gauss"] {
        check_tilted_plane(name);
    }
}

fn check_tilted_plane(name: &str) {
    let lens = Lens::named(name).unwrap().at_f_number(22.0).unwrap();
    let pixel = 0.03;
    let mut bench = Bench::new(lens, 4.0, [0.6, 24.0], [20, 800]);
    let straight = bench.moved;
    bench.moved.tilt = 8f64.to_radians();
    let focal = bench.lens.first_order().focal.unwrap();
    let place = FilmPlace::new(&bench.lens, &bench.focus, &bench.moved, bench.film).unwrap();
    let ups = [-10.0, -5.0, 0.0, 5.0, 10.0];
    let points = ups.map(|up| {
        // The ray continues through the principal points, by the lens equation.
        let film = place.point(DVec2::new(0.0, -up)) - focal.rear_principal_plane * DVec3::Z;
        let u = 1.0 / (1.0 / focal.efl - 1.0 / film.z);
        let object = focal.front_principal_plane * DVec3::Z - film * (u / film.z);
        1e-3 * (place.camera_from_lens * object + place.offset)
    });
    let dots: String = points
        .iter()
        .map(|p| board(*p, -3e-4 * p.z, -3e-4 * p.z))
        .collect();
    let picture = scene(&dots);
    let discs = |bench: &Bench| -> Vec<f64> {
        let films = bench.photographs(&picture, 48);
        let size = |up: f64| {
            let at = DVec2::new(0.0, up);
            // The straight lens displaces a dot by up to half a millimeter.
            let discs = films
                .iter()
                .map(|film| bench.disc(film, at, 2.4).2 - added(pixel, 3e-4 * focal.efl));
            discs.map(diameter).sum::<f64>() / films.len() as f64
        };
        ups.iter().map(|up| size(*up)).collect()
    };
    let tilted = discs(&bench);
    bench.moved = straight;
    let flat = discs(&bench);
    println!("{points:?} {tilted:?} {flat:?}");
    let ruler = (4.0f64 / 3.0).sqrt() * pixel;
    let is_sharp = tilted.iter().all(|size| *size < ruler);
    assert!(is_sharp, "{name}: {tilted:?}");
    for end in [0, ups.len() - 1] {
        assert!(flat[end] > 1.5 * pixel, "{name}: {flat:?}");
    }
}
