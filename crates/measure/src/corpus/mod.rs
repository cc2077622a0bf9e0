//! Compares the reader and the compiler with another program's results for a folder of scenes.
//!
//! `cargo run --release -p measure -- corpus -- FOLDER [--only TEXT]
//! [--verbose] [--pictures FOLDER] [--fonts FOLDER]`.
//!
//! The folder has `scenes/`, `reference/*.json` (bounding box, counts), `reference/*.tri.gz`
//! (triangles in world space), `reference/*.png` and `oracle_class.tsv`, which its README
//! describes. The program prints a row for each file that differs and the sums. `--pictures` prints
//! the tables of `docs/accuracy.md`, and writes pictures that differ side by side: `--shading p`,
//! `--shading g --handles`, and the other program's.

mod pictures;
mod sets;

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;
use ivcam_inventor::events::SnapshotOptions;
use ivcam_inventor::iv::{Document, Limits};
use ivcam_render::geometry::text::Fonts;
use ivcam_render::scene::{CompileOptions, RenderScene, snapshot};
use serde_json::Value;

use self::pictures::Pictures;

#[derive(Default)]
struct Sums {
    files: usize,
    read: usize,
    boxes: usize,
    exact: usize,
    /// Counts by default, and with `--handles`, which the other program always draws.
    readings: [Equal; 2],
    pictures: Vec<Pictures>,
}

/// Numbers of files that agree with the other program's results.
#[derive(Default)]
struct Equal {
    boxes: usize,
    counts: usize,
    sets: usize,
    colors: usize,
}

struct Options {
    folder: PathBuf,
    only: Option<String>,
    verbose: bool,
    pictures: Option<PathBuf>,
    fonts: Arc<Fonts>,
}

pub(crate) fn run(arguments: Vec<String>) -> ExitCode {
    let options = options(arguments);
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
        pictures::table(&mut sums.pictures, |path| cause(path).to_owned());
    }
    println!(
        "\nread {} of {}\n\n| | by default | with `--handles` |\n|---|---|---|",
        sums.read, sums.files
    );
    let row = |name: &str, of: usize, equal: fn(&Equal) -> usize| {
        let [plain, handles] = [0, 1].map(|i| equal(&sums.readings[i]));
        println!("| {name} of {of} | {plain} | {handles} |");
    };
    row("boxes", sums.boxes, |e| e.boxes);
    row("exact files: counts", sums.exact, |e| e.counts);
    row("exact files: triangles", sums.exact, |e| e.sets);
    row("exact files: colors too", sums.exact, |e| e.colors);
    ExitCode::SUCCESS
}

fn options(arguments: Vec<String>) -> Options {
    let mut options = Options {
        folder: PathBuf::from("corpus"),
        only: None,
        verbose: false,
        pictures: None,
        fonts: Arc::default(),
    };
    let mut fonts = Vec::new();
    let mut arguments = arguments.into_iter();
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--only" => options.only = arguments.next(),
            "--verbose" => options.verbose = true,
            "--pictures" => options.pictures = arguments.next().map(PathBuf::from),
            "--fonts" => fonts.extend(arguments.next()),
            _ => options.folder = PathBuf::from(argument),
        }
    }
    match Fonts::open(&fonts) {
        Ok(found) => options.fonts = Arc::new(found),
        Err(error) => eprintln!("{}", error.render(false)),
    }
    options
}

/// Reads a table from the first column to the second, without the heading.
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

/// Returns why a file's picture differs, from the list beside this program: the end of its path, a
/// tab, and a cause of `docs/accuracy.md`.
fn cause(path: &str) -> &'static str {
    include_str!("causes.tsv")
        .lines()
        .filter_map(|line| line.split_once('\t'))
        .find(|(end, _)| path.ends_with(end))
        .map_or("unexplained", |(_, cause)| cause)
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
    let compile = CompileOptions {
        fonts: options.fonts.clone(),
        ..CompileOptions::default()
    };
    let handles = SnapshotOptions {
        handles: true,
        ..SnapshotOptions::default()
    };
    let start = Instant::now();
    let plain = snapshot(&document, &SnapshotOptions::default(), &compile);
    let survey = RenderScene::survey(&plain, &compile);
    let surveyed = start.elapsed();
    let mut notes = Vec::new();
    let exact = reference["ok"] == true && class.starts_with("exact");
    sums.boxes += usize::from(reference["bbox"]["max"].is_array());
    sums.exact += usize::from(exact);
    let handles = snapshot(&document, &handles, &compile);
    let readings = [
        ("", &plain, &survey),
        (
            "with handles: ",
            &handles,
            &RenderScene::survey(&handles, &compile),
        ),
    ];
    for ((prefix, reading, survey), equal) in readings.into_iter().zip(&mut sums.readings) {
        let mut news = Vec::new();
        let diagonal = compare_boxes(&reference, survey, equal, &mut news);
        if exact {
            let theirs = reference["triangles"].as_u64().unwrap_or(0);
            if theirs == survey.triangles {
                equal.counts += 1;
            } else {
                news.push(format!("tri {} for {theirs}", survey.triangles));
            }
            let file = options
                .folder
                .join("reference")
                .join(format!("{path}.tri.gz"));
            sets::compare_sets((reading, &compile), &file, diagonal, equal, &mut news);
        }
        notes.extend(news.into_iter().map(|n| format!("{prefix}{n}")));
    }
    if reference["ok"] == true {
        compare_shapes(&reference, &survey, &mut notes);
        if let Some(folder) = &options.pictures {
            let theirs = options.folder.join("reference").join(format!("{path}.png"));
            sums.pictures.extend(pictures::compare(
                &document, &compile, &reference, path, &theirs, folder,
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
    survey: &ivcam_render::scene::Survey,
    equal: &mut Equal,
    notes: &mut Vec<String>,
) -> f64 {
    let theirs = &reference["bbox"];
    let (Some(min), Some(max)) = (point(&theirs["min"]), point(&theirs["max"])) else {
        return 1.0;
    };
    let diagonal = (max - min).length();
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
        equal.boxes += 1;
    } else {
        let exact = survey.bounds.map_or(f64::INFINITY, |(a, b)| {
            (a - min).abs().max((b - max).abs()).max_element() / diagonal.max(1e-30)
        });
        notes.push(format!("box off by {off:.1e} (exact box {exact:.1e})"));
    }
    diagonal
}

fn compare_shapes(
    reference: &Value,
    survey: &ivcam_render::scene::Survey,
    notes: &mut Vec<String>,
) {
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
