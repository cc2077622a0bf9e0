//! Measures the tree of triangles beside those of Embree and TinyBVH: the same rays, one by one
//! and in packets.

use std::fmt::Write as _;
use std::hint::black_box;
use std::path::Path;

use glam::Vec3;
use ivcam::photo::{Optics, Session};
use ivcam_base::math::lanes::LANES;
use ivcam_optics::sampling::{mix, unit};
use ivcam_render::bvh::{Bvh, Ray};

use super::embree::Embree;
use super::mesh::{self, Rays};
use super::room;
use super::tinybvh::TinyBvh;

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

/// Returns a bumpy sphere of about `count` triangles, seen from outside.
fn ball(count: usize) -> Mesh {
    let eye = Vec3::new(0.3, 0.4, 4.0);
    let ray = |[x, y]: [f64; 2]| {
        let [x, y] = [3.0 * x - 1.5, 2.0 * y - 1.0].map(|k| k as f32);
        Ray::new(eye, Vec3::new(x, y, -3.0))
    };
    Mesh {
        name: "A bumpy sphere",
        triangles: mesh::ball(count),
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

/// Another program's trees over triangles.
pub(super) trait PeerTrees {
    /// The program's name and version.
    fn program(&self) -> String;

    /// The names of the ways to build and trace a tree.
    fn modes(&self) -> &'static [&'static str];

    /// Makes a tree of a mode over triangles, which is not built yet.
    fn tree(&self, mode: usize, triangles: &[[Vec3; 3]]) -> Box<dyn PeerTree + '_>;
}

/// A tree of another program.
pub(super) trait PeerTree {
    fn build(&self);

    /// Traces rays one by one, and stores their distances as [`mesh::one_by_one`] does.
    fn one_by_one(&self, rays: &Rays, distances: &mut [f32]);

    fn has_packets(&self) -> bool {
        false
    }

    /// Traces rays in packets, if there are any, and stores their distances as
    /// [`mesh::one_by_one`] does. `coherent` says that the rays of a packet go the same way.
    fn in_packets(&self, _rays: &Rays, _coherent: bool, _distances: &mut [f32]) {}
}

/// A way to trace rays, which stores their distances.
type Trace<'a> = Box<dyn Fn(&Rays, &mut [f32]) + 'a>;

/// A program's ways to trace rays through its tree: one by one, and in packets if it has any.
struct Contestant<'a> {
    name: &'static str,
    ways: Vec<Trace<'a>>,
}

/// Writes the tables, with `large` also that of ten million triangles. `embree` and `tinybvh` are
/// the paths of libraries.
pub(in super::super) fn tables(
    report: &mut String,
    scene: &Path,
    [embree, tinybvh]: [Option<&str>; 2],
    large: bool,
    clock: &dyn Fn() -> f64,
) -> Result<(), String> {
    let mut peers: Vec<Box<dyn PeerTrees>> = Vec::new();
    if let Some(path) = embree {
        peers.push(Box::new(Embree::load(path)?));
    }
    if let Some(path) = tinybvh {
        peers.push(Box::new(TinyBvh::load(path)?));
    }
    let room = room(scene).map_err(|error| error.message)?;
    report.push_str("## Rays through triangles");
    for (k, peer) in peers.iter().enumerate() {
        let joint = [", against ", " and "][k.min(1)];
        let _ = write!(report, "{joint}{}", peer.program());
    }
    let [width, height] = PICTURE;
    let _ = write!(
        report,
        "\n\nMillions of rays per second, one thread: *primary* rays of a pinhole's picture of \
         {width}x{height}, in tiles of 8x4, *shadow* rays from their hits to a light, and \
         *bounced* rays from there that a matte surface reflects. Medians of {ROUNDS} rounds in \
         which the programs take turns; builds are medians of {BUILDS}. ivcam's packets have \
         {LANES} rays."
    );
    if !peers.is_empty() {
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
    table(report, &room, &peers, clock);
    table(report, &ball(1_000_000), &peers, clock);
    if large {
        table(report, &ball(10_000_000), &peers, clock);
    }
    Ok(())
}

/// Writes the table of one mesh.
fn table(report: &mut String, mesh: &Mesh, peers: &[Box<dyn PeerTrees>], clock: &dyn Fn() -> f64) {
    let (tree, trees, builds) = built(mesh, peers, clock);
    let _ = write!(
        report,
        "\n{}, {} triangles; ivcam builds its tree in {:.3} s",
        mesh.name,
        mesh.triangles.len(),
        builds[0]
    );
    let names = || peers.iter().flat_map(|peer| peer.modes().iter().copied());
    for (name, seconds) in names().zip(&builds[1..]) {
        let _ = write!(report, ", {name} in {seconds:.3} s");
    }
    let sets = mesh.rays(&tree);
    let mut contestants = vec![Contestant {
        name: "ivcam",
        ways: vec![
            Box::new(|rays, distances| mesh::one_by_one(&tree, rays, distances)),
            Box::new(|rays, distances| mesh::in_packets(&tree, rays, distances)),
        ],
    }];
    contestants.extend(names().zip(&trees).map(|(name, tree)| {
        let mut ways: Vec<Trace<'_>> =
            vec![Box::new(|rays, distances| tree.one_by_one(rays, distances))];
        if tree.has_packets() {
            ways.push(Box::new(|rays, distances| {
                tree.in_packets(rays, rays.name != "bounced", distances);
            }));
        }
        Contestant { name, ways }
    }));
    report.push_str(
        ".\n\n| rays | program | one by one | packets | ratio, one by one | ratio, packets | differ \
         |\n|---|---|---|---|---|---|---|\n",
    );
    for set in &sets {
        let rates = rates(set, &contestants, clock);
        let differing = differing(set, &contestants);
        for ((one, rates_of_one), differing) in contestants.iter().zip(&rates).zip(differing) {
            let million = |way: usize| {
                let rate = rates_of_one.get(way).map(|rates| 1e-6 * median(rates));
                rate.map_or("–".to_owned(), |rate| format!("{rate:.2}"))
            };
            let ratio = |way: usize| {
                let theirs = rates_of_one.get(way).filter(|_| one.name != "ivcam");
                theirs.map_or("–".to_owned(), |theirs| ratio(&rates[0][way], theirs))
            };
            let _ = writeln!(
                report,
                "| {} | {} | {} | {} | {} | {} | {differing} of {} |",
                set.name,
                one.name,
                million(0),
                million(1),
                ratio(0),
                ratio(1),
                set.rays.len()
            );
        }
    }
}

/// Builds all trees in turn, and returns the last ones with the median seconds of each.
fn built<'a>(
    mesh: &Mesh,
    peers: &'a [Box<dyn PeerTrees>],
    clock: &dyn Fn() -> f64,
) -> (Bvh, Vec<Box<dyn PeerTree + 'a>>, Vec<f64>) {
    let modes = || {
        peers
            .iter()
            .flat_map(|peer| (0..peer.modes().len()).map(move |mode| (peer, mode)))
    };
    let mut seconds = vec![Vec::new(); 1 + modes().count()];
    let (mut tree, mut trees) = (Bvh::default(), Vec::new());
    for _ in 0..BUILDS {
        trees.clear();
        let start = clock();
        tree = mesh::tree(&mesh.triangles);
        seconds[0].push(clock() - start);
        for ((peer, mode), seconds) in modes().zip(&mut seconds[1..]) {
            let tree = peer.tree(mode, &mesh.triangles);
            let start = clock();
            tree.build();
            seconds.push(clock() - start);
            trees.push(tree);
        }
    }
    let seconds = seconds.iter().map(|s| median(s)).collect();
    (tree, trees, seconds)
}

/// Returns the rays per second of each contestant, of each of its ways, in each round.
fn rates(
    set: &Rays,
    contestants: &[Contestant<'_>],
    clock: &dyn Fn() -> f64,
) -> Vec<Vec<Vec<f64>>> {
    let none = |one: &Contestant<'_>| vec![Vec::new(); one.ways.len()];
    let mut rates: Vec<Vec<Vec<f64>>> = contestants.iter().map(none).collect();
    let mut distances = vec![0.0; set.rays.len()];
    for _ in 0..ROUNDS {
        let ways = contestants.iter().flat_map(|one| &one.ways);
        for (way, rates) in ways.zip(rates.iter_mut().flatten()) {
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

/// Returns for each contestant the number of rays whose distance differs from that of ivcam's ray
/// alone, in the way in which most do.
fn differing(set: &Rays, contestants: &[Contestant<'_>]) -> Vec<usize> {
    let distances = |way: &Trace<'_>| {
        let mut distances = vec![0.0; set.rays.len()];
        way(set, &mut distances);
        distances
    };
    let alone = distances(&contestants[0].ways[0]);
    let differ = |(a, b): &(&f32, &f32)| {
        let (least, greatest) = (a.min(**b), a.max(**b));
        least != greatest && !(greatest - least <= DIFFERENCE * greatest)
    };
    let of_way = |way: &Trace<'_>| alone.iter().zip(&distances(way)).filter(differ).count();
    let most = |one: &Contestant<'_>| one.ways.iter().map(of_way).max().unwrap_or(0);
    contestants.iter().map(most).collect()
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
