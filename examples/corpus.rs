//! Holds the reader and the compiler against another program's answers for a folder of scenes.
//!
//! `cargo run --release --example corpus -- FOLDER [--only TEXT] [--verbose]
//! [--pictures FOLDER [--at-vertices]]`. The folder has
//! `scenes/`, `reference/*.json` (bounding box, counts), `reference/*.tri.gz` (triangles in the
//! world) and `oracle_class.tsv`; its README says what they are. Prints a row a file and the sums.

use std::collections::HashMap;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::Instant;

use glam::{DQuat, DVec3, Vec3};
use ivcam::iv::{Document, Limits};
use ivcam::pose::{CameraPose, Projection};
use ivcam::scene::{CompileOptions, OracleTriangle, Ray, RenderScene};
use ivcam::shade::{ShadeOptions, Shader, Shading};
use serde_json::Value;

#[derive(Default)]
struct Sums {
    files: usize,
    read: usize,
    boxes: usize,
    boxes_equal: usize,
    exact: usize,
    counts_equal: usize,
    sets_equal: usize,
    colors_equal: usize,
    pictures: Vec<Picture>,
}

/// How a picture of ours compares with theirs.
struct Picture {
    path: String,
    /// Share of the pixels that either shows which both show.
    overlap: f64,
    /// Mean difference in levels where both show something.
    difference: f64,
}

struct Options {
    folder: PathBuf,
    only: Option<String>,
    verbose: bool,
    pictures: Option<PathBuf>,
    at_vertices: bool,
}

fn main() {
    let options = arguments();
    let classes = tsv(&options.folder.join("oracle_class.tsv"));
    let mut paths: Vec<&String> = classes.keys().collect();
    paths.sort();
    let mut sums = Sums::default();
    println!("box: equal to 1e-4 of the diagonal; tri: count, then set, then colors");
    for path in paths {
        if options.only.as_ref().is_some_and(|o| !path.contains(o)) {
            continue;
        }
        row(&options, path, &classes[path], &mut sums);
    }
    if options.pictures.is_some() {
        picture_table(&mut sums.pictures);
    }
    println!(
        "\nread {}/{}  boxes {}/{}  exact files: counts {}/{} sets {}/{} with colors {}/{}",
        sums.read,
        sums.files,
        sums.boxes_equal,
        sums.boxes,
        sums.counts_equal,
        sums.exact,
        sums.sets_equal,
        sums.exact,
        sums.colors_equal,
        sums.exact,
    );
}

fn arguments() -> Options {
    let mut options = Options {
        folder: PathBuf::from("corpus"),
        only: None,
        verbose: false,
        pictures: None,
        at_vertices: false,
    };
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--only" => options.only = arguments.next(),
            "--at-vertices" => options.at_vertices = true,
            "--verbose" => options.verbose = true,
            "--pictures" => options.pictures = arguments.next().map(PathBuf::from),
            _ => options.folder = PathBuf::from(argument),
        }
    }
    options
}

/// First column to second, the heading left out.
fn tsv(path: &Path) -> HashMap<String, String> {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    text.lines()
        .skip(1)
        .filter_map(|line| {
            let mut columns = line.split('\t');
            Some((columns.next()?.to_owned(), columns.next()?.to_owned()))
        })
        .collect()
}

fn row(options: &Options, path: &str, class: &str, sums: &mut Sums) {
    sums.files += 1;
    let start = Instant::now();
    let scenes = options.folder.join("scenes");
    let file = scenes.join(path);
    let document = match Document::open_with(file, &[&scenes], &Limits::default()) {
        Ok(document) => document,
        Err(error) => {
            println!("UNREAD {class:12} {path}: {}", error.message);
            return;
        }
    };
    sums.read += 1;
    let read = start.elapsed();
    let reference = options
        .folder
        .join("reference")
        .join(format!("{path}.json"));
    let reference: Value = std::fs::read(&reference)
        .ok()
        .and_then(|bytes| serde_json::from_slice(&bytes).ok())
        .unwrap_or(Value::Null);
    let compile_options = CompileOptions::default();
    let start = Instant::now();
    let survey = RenderScene::survey(&document, &compile_options);
    let surveyed = start.elapsed();
    let mut notes = Vec::new();
    let diagonal = compare_boxes(&reference, &survey, sums, &mut notes);
    if reference["ok"] == true {
        let theirs = reference["triangles"].as_u64().unwrap_or(0);
        let exact = class == "exact" || class == "exact+lines/text";
        if exact {
            sums.exact += 1;
            if theirs == survey.triangles {
                sums.counts_equal += 1;
            } else {
                notes.push(format!("tri {} for {theirs}", survey.triangles));
            }
            let file = options
                .folder
                .join("reference")
                .join(format!("{path}.tri.gz"));
            compare_sets(&document, &file, diagonal, sums, &mut notes);
        }
        compare_shapes(&reference, &survey, &mut notes);
        if let Some(folder) = &options.pictures {
            let theirs = options.folder.join("reference").join(format!("{path}.png"));
            sums.pictures.extend(compare_pictures(
                &document,
                &reference,
                path,
                &theirs,
                folder,
                options.at_vertices,
            ));
        }
    }
    let ignored = survey.census.left_out();
    if options.verbose || !notes.is_empty() {
        println!(
            "{} {class:12} {path} [{:.1?} {:.1?}] {} {}",
            if notes.is_empty() { "ok    " } else { "DIFFER" },
            read,
            surveyed,
            notes.join("; "),
            ignored.join(", ")
        );
    }
}

fn point(value: &Value) -> Option<DVec3> {
    let list = value.as_array()?;
    Some(DVec3::new(
        list.first()?.as_f64()?,
        list.get(1)?.as_f64()?,
        list.get(2)?.as_f64()?,
    ))
}

fn compare_boxes(
    reference: &Value,
    survey: &ivcam::scene::Survey,
    sums: &mut Sums,
    notes: &mut Vec<String>,
) -> f64 {
    let theirs = &reference["bbox"];
    let (Some(min), Some(max)) = (point(&theirs["min"]), point(&theirs["max"])) else {
        return 1.0;
    };
    let diagonal = (max - min).length();
    sums.boxes += 1;
    let Some((our_min, our_max)) = survey.inventor_bounds else {
        notes.push("box: nothing".into());
        return diagonal;
    };
    let off = (our_min - min)
        .abs()
        .max((our_max - max).abs())
        .max_element()
        / diagonal.max(1e-30);
    if off <= 1e-4 {
        sums.boxes_equal += 1;
    } else {
        let exact = survey.bounds.map_or(f64::INFINITY, |(a, b)| {
            (a - min).abs().max((b - max).abs()).max_element() / diagonal.max(1e-30)
        });
        notes.push(format!("box off by {off:.1e} (exact box {exact:.1e})"));
    }
    diagonal
}

fn compare_shapes(reference: &Value, survey: &ivcam::scene::Survey, notes: &mut Vec<String>) {
    let Some(theirs) = reference["shapes"].as_object() else {
        return;
    };
    let mut all: Vec<(&str, u64, u64)> = Vec::new();
    for (name, count) in theirs {
        let name = name.strip_prefix("VRML").unwrap_or(name);
        let ours = survey.shapes.get(name).copied().unwrap_or(0);
        all.push((name, ours, count.as_u64().unwrap_or(0)));
    }
    let differ: Vec<String> = all
        .iter()
        .filter(|(_, a, b)| a != b)
        .map(|(n, a, b)| format!("{n} {a} for {b}"))
        .collect();
    if !differ.is_empty() {
        notes.push(format!("shapes {}", differ.join(" ")));
    }
}

fn compare_sets(
    document: &Document,
    file: &Path,
    diagonal: f64,
    sums: &mut Sums,
    notes: &mut Vec<String>,
) {
    let Some(theirs) = triangles(file) else {
        return;
    };
    let options = CompileOptions {
        origin: theirs.first().map_or(DVec3::ZERO, |t| t.position[0]),
        ignore_draw_style: true,
        ..CompileOptions::default()
    };
    let scene = match RenderScene::compile(document, &options) {
        Ok(scene) => scene,
        Err(error) => {
            notes.push(error.message.clone());
            return;
        }
    };
    let ours: Vec<OracleTriangle> = scene.triangles().collect();
    let tolerance = 1e-4 * diagonal;
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let cell = |p: DVec3| (p / (4.0 * tolerance)).floor().as_i64vec3();
    for (i, t) in theirs.iter().enumerate() {
        let key = cell(center(t)).to_array();
        cells.entry(key).or_default().push(i as u32);
    }
    let (mut missing, mut colors, mut normals) = (0, 0, 0);
    let mut first = None;
    for t in &ours {
        let at = cell(center(t));
        let mut best: Option<(u64, [i64; 3], usize, usize)> = None;
        for dx in -1..=1 {
            for dy in -1..=1 {
                for dz in -1..=1 {
                    let key = [at.x + dx, at.y + dy, at.z + dz];
                    for (k, &i) in cells.get(&key).map_or(&[][..], |v| v).iter().enumerate() {
                        let other = &theirs[i as usize];
                        if let Some(turn) = same_corners(t, other, tolerance) {
                            let score = u64::from(!same_colors(t, other, turn)) * 2
                                + u64::from(!same_normals(t, other, turn));
                            if best.is_none_or(|b| score < b.0) {
                                best = Some((score, key, k, turn));
                            }
                        }
                    }
                }
            }
        }
        match best {
            Some((score, key, k, _)) => {
                colors += usize::from(score >= 2);
                normals += usize::from(score % 2 == 1);
                if let Some(list) = cells.get_mut(&key) {
                    list.swap_remove(k);
                }
            }
            None => {
                missing += 1;
                first.get_or_insert(*t);
            }
        }
    }
    let left: usize = cells.values().map(Vec::len).sum();
    if missing == 0 && left == 0 {
        sums.sets_equal += 1;
        sums.colors_equal += usize::from(colors == 0);
    } else {
        notes.push(format!("set: {missing} not theirs, {left} not ours"));
        if let Some(t) = first {
            notes.push(format!("first {:?}", t.position.map(DVec3::as_vec3)));
        }
    }
    if colors > 0 {
        notes.push(format!("{colors} colors"));
    }
    if normals > 0 {
        notes.push(format!("{normals} normals of {}", ours.len()));
    }
}

fn center(t: &OracleTriangle) -> DVec3 {
    (t.position[0] + t.position[1] + t.position[2]) / 3.0
}

/// Which of the six orders of corners makes the triangles one.
fn same_corners(a: &OracleTriangle, b: &OracleTriangle, tolerance: f64) -> Option<usize> {
    (0..6).find(|&turn| {
        (0..3).all(|i| {
            let d = a.position[i] - b.position[ORDERS[turn][i]];
            d.abs().max_element() <= tolerance
        })
    })
}

const ORDERS: [[usize; 3]; 6] = [
    [0, 1, 2],
    [1, 2, 0],
    [2, 0, 1],
    [0, 2, 1],
    [2, 1, 0],
    [1, 0, 2],
];

fn same_colors(a: &OracleTriangle, b: &OracleTriangle, turn: usize) -> bool {
    (a.transparency - b.transparency).abs() < 0.005
        && (0..3).all(|i| {
            let d = a.diffuse[i] - b.diffuse[ORDERS[turn][i]];
            d.abs().max_element() < 0.005
        })
}

fn same_normals(a: &OracleTriangle, b: &OracleTriangle, turn: usize) -> bool {
    (0..3).all(|i| {
        let d = a.normal[i] - b.normal[ORDERS[turn][i]];
        d.abs().max_element() < 2e-3
    })
}

/// `TRI1`, a count, then 29 numbers of four bytes a triangle, little endian.
fn triangles(file: &Path) -> Option<Vec<OracleTriangle>> {
    let packed = std::fs::File::open(file).ok()?;
    let mut bytes = Vec::new();
    flate2::read::GzDecoder::new(packed)
        .read_to_end(&mut bytes)
        .ok()?;
    let records = bytes.get(8..)?;
    let word = |r: &[u8], i: usize| [r[4 * i], r[4 * i + 1], r[4 * i + 2], r[4 * i + 3]];
    let triangle = |r: &[u8]| {
        let f = |i: usize| f32::from_le_bytes(word(r, i));
        let v = |i: usize| Vec3::new(f(i), f(i + 1), f(i + 2));
        OracleTriangle {
            position: [v(0).as_dvec3(), v(3).as_dvec3(), v(6).as_dvec3()],
            normal: [v(9), v(12), v(15)],
            diffuse: [v(18), v(21), v(24)],
            transparency: f(27),
            shape: u32::from_le_bytes(word(r, 28)),
        }
    };
    Some(records.chunks_exact(116).map(triangle).collect())
}

/// The camera that the other program used.
fn camera(reference: &Value) -> Option<CameraPose> {
    let c = &reference["camera"];
    let turn = &c["orientation"];
    let axis = point(&turn["axis"])?;
    let projection = match c["heightAngle"].as_f64() {
        Some(height_angle) => Projection::Perspective { height_angle },
        None => Projection::Orthographic {
            height: c["height"].as_f64()?,
        },
    };
    Some(CameraPose {
        position: point(&c["position"])?,
        orientation: DQuat::from_axis_angle(axis.normalize_or(DVec3::Z), turn["angle"].as_f64()?),
        projection,
        ..CameraPose::view_all((DVec3::ZERO, DVec3::ONE), 1.0)
    })
}

const WIDTH: u32 = 320;
const HEIGHT: u32 = 240;

fn compare_pictures(
    document: &Document,
    reference: &Value,
    path: &str,
    theirs: &Path,
    folder: &Path,
    at_vertices: bool,
) -> Option<Picture> {
    let theirs = image::open(theirs).ok()?.to_rgb8();
    let pose = camera(reference)?;
    let options = CompileOptions {
        origin: pose.position,
        camera: Some(pose.clone()),
        needs: Shading::Phong.needs(),
        pixel_rows: HEIGHT,
        ..CompileOptions::default()
    };
    let scene = RenderScene::compile(document, &options).ok()?;
    let headlight = reference["lights"]
        .as_array()?
        .iter()
        .find(|l| l["headlight"] == true)
        .and_then(|l| point(&l["direction"]))
        .map(|d| ivcam::scene::Light::headlight(d.as_vec3()));
    let shader = Shader::new(
        &scene,
        Shading::Phong,
        ShadeOptions {
            headlight,
            backward: (pose.orientation * DVec3::Z).as_vec3(),
            at_vertices,
            ..ShadeOptions::default()
        },
    );
    let aspect = f64::from(WIDTH) / f64::from(HEIGHT);
    let mut ours = image::RgbImage::new(WIDTH, HEIGHT);
    for (x, y, pixel) in ours.enumerate_pixels_mut() {
        let sx = (2.0 * (f64::from(x) + 0.5) / f64::from(WIDTH) - 1.0) * aspect;
        let sy = 1.0 - 2.0 * (f64::from(y) + 0.5) / f64::from(HEIGHT);
        let ray = match pose.projection {
            Projection::Perspective { height_angle } => {
                let t = libm::tan(0.5 * height_angle);
                let d = pose.orientation * DVec3::new(sx * t, sy * t, -1.0);
                Ray::new(Vec3::ZERO, d.as_vec3())
            }
            Projection::Orthographic { height } => {
                let o = pose.orientation * (0.5 * height * DVec3::new(sx, sy, 0.0));
                let mut ray = Ray::new(o.as_vec3(), pose.direction().as_vec3());
                ray.t_min = f32::NEG_INFINITY;
                ray
            }
        };
        let color = shader.radiance(&ray, &mut ivcam::shade::Work::default());
        let level = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        *pixel = image::Rgb([level(color.x), level(color.y), level(color.z)]);
    }
    let (mut both, mut either, mut sum) = (0u32, 0u32, 0u64);
    for (a, b) in ours.pixels().zip(theirs.pixels()) {
        let shown = |p: &image::Rgb<u8>| p.0.iter().any(|&c| c > 0);
        either += u32::from(shown(a) || shown(b));
        if shown(a) && shown(b) {
            both += 1;
            sum += (0..3)
                .map(|i| u64::from(a.0[i].abs_diff(b.0[i])))
                .sum::<u64>();
        }
    }
    let picture = Picture {
        path: path.to_owned(),
        overlap: if either == 0 {
            1.0
        } else {
            f64::from(both) / f64::from(either)
        },
        difference: sum as f64 / f64::from(3 * both.max(1)),
    };
    if picture.overlap < 0.98 || picture.difference > 4.0 {
        let mut beside = image::RgbImage::new(2 * WIDTH, HEIGHT);
        image::imageops::replace(&mut beside, &ours, 0, 0);
        image::imageops::replace(&mut beside, &theirs, i64::from(WIDTH), 0);
        let name = path.replace('/', "_");
        let _ = std::fs::create_dir_all(folder);
        let _ = beside.save(folder.join(format!("{name}.png")));
    }
    Some(picture)
}

fn picture_table(pictures: &mut [Picture]) {
    let bad = |p: &Picture| p.overlap < 0.98 || p.difference > 4.0;
    pictures.sort_by(|a, b| {
        let score = |p: &Picture| (1.0 - p.overlap) * 50.0 + p.difference / 4.0;
        score(b).total_cmp(&score(a))
    });
    println!("\npictures, the worst first (overlap, difference in levels)");
    for p in pictures.iter().filter(|p| bad(p)) {
        println!("  {:.3} {:6.2}  {}", p.overlap, p.difference, p.path);
    }
    let good = pictures.iter().filter(|p| !bad(p)).count();
    println!("pictures alike: {good}/{}", pictures.len());
}
