//! Measures the tree of triangles beside Embree's: the same rays, one by one and in packets.

use std::fmt::Write as _;
use std::hint::black_box;
use std::path::Path;

use glam::Vec3;
use ivcam::photo::{Optics, Session};
use ivcam_base::math::lanes::LANES;
use ivcam_optics::sampling::{mix, unit};
use ivcam_render::bvh::{Bvh, Ray};

use super::embree::{Embree, MODES, Scene};
use super::mesh::{self, Rays};
use super::room;

/// The rounds, in each of which every program traces all rays.
const ROUNDS: usize = 9;
/// The builds of each tree, in turn.
const BUILDS: usize = 3;
/// The least processor time of one measurement in seconds, whose clock may have steps of 4 ms.
const LEAST: f64 = 0.2;
/// The size of the picture whose rays are traced.
const PICTURE: [u32; 2] = [720, 480];
/// The relative difference from which two distances count as different.
const DIFFERENCE: f32 = 1e-4;

/// Triangles with a camera and a light.
struct Mesh {
    name: &'static str,
    triangles: Vec<[Vec3; 3]>,
    /// The rays of the camera, in the order of [`pixels`].
    primary: Vec<Ray>,
    light: Vec3,
}

/// Returns the middles of pixels, each from 0 to 1. 32 of them are 8 by 4 pixels, the first and the
/// second 16 of which are 4 by 4, so that packets of all sizes hold neighbors.
fn pixels() -> impl Iterator<Item = [f64; 2]> {
    let [width, height] = PICTURE;
    (0..width * height).map(move |i| {
        let (tile, half) = (i / 32, i / 16 % 2);
        let x = tile % (width / 8) * 8 + 4 * half + i % 4;
        let y = tile / (width / 8) * 4 + i / 4 % 4;
        [(x, width), (y, height)].map(|(at, size)| (f64::from(at) + 0.5) / f64::from(size))
    })
}

/// Returns the room and its camera, in the space of the compiled scene.
fn room(scene: &Path) -> ivcam_base::diag::Result<Mesh> {
    let session = Session::open(room::plan(scene, Optics::Pinhole))?;
    let compiled = &session.scene;
    let triangles = compiled.triangles();
    let ray = |[x, y]: [f64; 2]| {
        let ray = session.camera.at(x, y).ray([0.5; 2])?;
        Some(Ray::new(ray.origin.as_vec3(), ray.direction.as_vec3()))
    };
    Ok(Mesh {
        name: "The room",
        triangles: triangles
            .map(|t| t.position.map(|p| (p - compiled.origin).as_vec3()))
            .collect(),
        primary: pixels().filter_map(ray).collect(),
        light: compiled.lights().first().map_or(Vec3::Y, |l| l.position),
    })
}

/// Returns the bumpy sphere, seen from outside.
fn ball() -> Mesh {
    let eye = Vec3::new(0.3, 0.4, 4.0);
    let ray = |[x, y]: [f64; 2]| {
        let [x, y] = [3.0 * x - 1.5, 2.0 * y - 1.0].map(|k| k as f32);
        Ray::new(eye, Vec3::new(x, y, -3.0))
    };
    Mesh {
        name: "A bumpy sphere",
        triangles: mesh::ball(1_000_000),
        primary: pixels().map(ray).collect(),
        light: Vec3::new(3.0, 5.0, 3.0),
    }
}

impl Mesh {
    /// Returns the camera's rays, rays from their hits to the light, and rays from there that are
    /// reflected by a matte surface.
    fn rays(&self, tree: &Bvh) -> [Rays; 3] {
        let (mut shadow, mut bounced) = (Vec::new(), Vec::new());
        let mut state = 1;
        let mut random = || {
            state = mix(state);
            unit(state)
        };
        for ray in &self.primary {
            let Some((t, _, triangle)) = mesh::nearest(tree, ray) else {
                continue;
            };
            let [a, b, c] = self.triangles[triangle as usize];
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let normal = if normal.dot(ray.direction) > 0.0 {
                -normal
            } else {
                normal
            };
            let from = ray.at(t) + 1e-4 * t * normal;
            let mut to_light = Ray::new(from, self.light - from);
            to_light.t_max = 1.0;
            shadow.push(to_light);
            let z = 2.0 * random() - 1.0;
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * random());
            let r = (1.0 - z * z).sqrt();
            let on_sphere = Vec3::new((r * cos) as f32, (r * sin) as f32, z as f32);
            bounced.push(Ray::new(from, (normal + on_sphere).normalize_or(normal)));
        }
        let kind = |name, any, rays| Rays { name, any, rays };
        [
            kind("primary", false, self.primary.clone()),
            kind("shadow", true, shadow),
            kind("bounced", false, bounced),
        ]
    }
}

/// A way to trace rays, which stores their distances.
type Trace<'a> = Box<dyn Fn(&Rays, &mut [f32]) + 'a>;

/// Writes the tables. `library` is the path of Embree's.
pub(in super::super) fn tables(
    report: &mut String,
    scene: &Path,
    library: Option<&str>,
    clock: &dyn Fn() -> f64,
) {
    let embree = match library.map(Embree::load).transpose() {
        Ok(embree) => embree,
        Err(error) => return eprintln!("{error}"),
    };
    let room = match room(scene) {
        Ok(room) => room,
        Err(error) => return eprintln!("{}", error.message),
    };
    report.push_str("## Rays through triangles");
    if let Some(embree) = &embree {
        let _ = write!(report, ", against Embree {}", embree.version());
    }
    let [width, height] = PICTURE;
    let _ = write!(
        report,
        "\n\nMillions of rays per second, one thread: *primary* rays of a pinhole's picture of \
         {width}x{height}, in tiles of 8x4, *shadow* rays from their hits to a light, and \
         *bounced* rays from there that a matte surface reflects. Medians of {ROUNDS} rounds in \
         which the programs take turns; builds are medians of {BUILDS}."
    );
    if embree.is_some() {
        let _ = write!(
            report,
            " Ratios above 1 mean that ivcam is faster; they are medians, and the least and the \
             greatest of a round. Embree builds with medium quality, its default, unless the table \
             says otherwise, and its packets of primary and shadow rays are marked as coherent. \
             *differ* counts rays whose distances differ by more than {DIFFERENCE:.0e} of them, or \
             that only one program finds blocked, of all ways of tracing the one that differs most \
             from ivcam's one by one."
        );
    }
    report.push('\n');
    for mesh in [room, ball()] {
        table(report, &mesh, embree.as_ref(), clock);
    }
}

/// Writes the table of one mesh.
fn table(report: &mut String, mesh: &Mesh, embree: Option<&Embree>, clock: &dyn Fn() -> f64) {
    let (tree, scenes, builds) = built(mesh, embree, clock);
    let _ = write!(
        report,
        "\n{}, {} triangles; ivcam builds its tree in {:.3} s",
        mesh.name,
        mesh.triangles.len(),
        builds[0]
    );
    for (mode, seconds) in MODES.iter().zip(&builds[1..]) {
        let _ = write!(report, ", Embree ({}) in {seconds:.3} s", mode.name);
    }
    let sets = mesh.rays(&tree);
    let mut ways: Vec<Trace<'_>> = vec![
        Box::new(|rays, distances| mesh::one_by_one(&tree, rays, distances)),
        Box::new(|rays, distances| mesh::in_packets(&tree, rays, distances)),
    ];
    for scene in &scenes {
        ways.push(Box::new(|rays, distances| {
            scene.one_by_one(rays, distances)
        }));
        ways.push(Box::new(|rays, distances| {
            scene.in_packets(rays, rays.name != "bounced", distances);
        }));
    }
    let rates = sets.each_ref().map(|set| rates(set, &ways, clock));
    let Some(embree) = embree else {
        let _ = writeln!(
            report,
            ".\n\n| rays | one by one | packets of {LANES} |\n|---|---|---|"
        );
        for (set, rates) in sets.iter().zip(&rates) {
            let [one, packets] = [0, 1].map(|way| 1e-6 * median(&rates[way]));
            let _ = writeln!(report, "| {} | {one:.2} | {packets:.2} |", set.name);
        }
        return;
    };
    let packet = embree.packet();
    let _ = writeln!(
        report,
        ".\n\n| rays | Embree | one by one | packets of {packet} | ivcam, one by one | packets of \
         {LANES} | ratio, one by one | ratio, packets | differ |\n|---|---|---|---|---|---|---|---|---|"
    );
    for (set, rates) in sets.iter().zip(&rates) {
        let differing = differing(set, &ways);
        for (k, mode) in MODES.iter().enumerate() {
            let theirs = 2 + 2 * k;
            let million = |way: usize| 1e-6 * median(&rates[way]);
            let _ = writeln!(
                report,
                "| {} | {} | {:.2} | {:.2} | {:.2} | {:.2} | {} | {} | {} of {} |",
                set.name,
                mode.name,
                million(theirs),
                million(theirs + 1),
                million(0),
                million(1),
                ratio(&rates[0], &rates[theirs]),
                ratio(&rates[1], &rates[theirs + 1]),
                differing[1]
                    .max(differing[theirs])
                    .max(differing[theirs + 1]),
                set.rays.len()
            );
        }
    }
}

/// Builds all trees in turn, and returns the last ones with the median seconds of each.
fn built<'a>(
    mesh: &Mesh,
    embree: Option<&'a Embree>,
    clock: &dyn Fn() -> f64,
) -> (Bvh, Vec<Scene<'a>>, Vec<f64>) {
    let mut seconds = [const { Vec::new() }; 1 + MODES.len()];
    let (mut tree, mut scenes) = (Bvh::default(), Vec::new());
    for _ in 0..BUILDS {
        scenes.clear();
        let start = clock();
        tree = mesh::tree(&mesh.triangles);
        seconds[0].push(clock() - start);
        let Some(embree) = embree else { continue };
        for (mode, seconds) in MODES.into_iter().zip(&mut seconds[1..]) {
            let scene = embree.scene(&mesh.triangles, mode);
            let start = clock();
            scene.build();
            seconds.push(clock() - start);
            scenes.push(scene);
        }
    }
    let seconds = seconds.iter().filter(|s| !s.is_empty());
    (tree, scenes, seconds.map(|s| median(s)).collect())
}

/// Returns the rays per second of each way in each round.
fn rates(set: &Rays, ways: &[Trace<'_>], clock: &dyn Fn() -> f64) -> Vec<Vec<f64>> {
    let mut rates = vec![Vec::new(); ways.len()];
    let mut distances = vec![0.0; set.rays.len()];
    for _ in 0..ROUNDS {
        for (way, rates) in ways.iter().zip(&mut rates) {
            let (start, mut calls) = (clock(), 0.0);
            let seconds = loop {
                way(set, black_box(&mut distances));
                calls += 1.0;
                let seconds = clock() - start;
                if seconds > LEAST {
                    break seconds;
                }
            };
            rates.push(calls * set.rays.len() as f64 / seconds);
        }
    }
    rates
}

/// Returns for each way the number of rays whose distance differs from the first way's.
fn differing(set: &Rays, ways: &[Trace<'_>]) -> Vec<usize> {
    let distances = ways.iter().map(|way| {
        let mut distances = vec![0.0; set.rays.len()];
        way(set, &mut distances);
        distances
    });
    let all: Vec<Vec<f32>> = distances.collect();
    let differ = |(a, b): &(&f32, &f32)| {
        let (least, greatest) = (a.min(**b), a.max(**b));
        least != greatest && !(greatest - least <= DIFFERENCE * greatest)
    };
    let of_one = |one: &Vec<f32>| all[0].iter().zip(one).filter(differ).count();
    all.iter().map(of_one).collect()
}

/// Returns the median of the ratios of each round, the least and the greatest, as text.
pub(crate) fn ratio(ours: &[f64], theirs: &[f64]) -> String {
    let mut ratios: Vec<f64> = ours.iter().zip(theirs).map(|(a, b)| a / b).collect();
    ratios.sort_by(f64::total_cmp);
    let [least, greatest] = [0, ratios.len() - 1].map(|k| ratios[k]);
    format!("{:.2} ({least:.2} to {greatest:.2})", median(&ratios))
}

/// Returns the median, the upper one of an even number.
pub(crate) fn median(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
