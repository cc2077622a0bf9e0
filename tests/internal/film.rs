//! Movies: motion blur is the average of its moments, and an interrupted movie continues.

use super::common;

use std::path::Path;

use crate::picture::Raster;
use common::{Folder, ivcam};

const SCENE: &str = r#"#Inventor V2.1 ascii
Separator {
  PointLight { location 1 2 2 intensity 0.8 }
  Material { diffuseColor 0.7 0.3 0.2 }
  Cube { width 0.5 height 0.5 depth 0.5 }
  Translation { translation 0.4 0.3 -1 }
  Material { diffuseColor 0.2 0.4 0.7 }
  Sphere { radius 0.5 }
}
"#;

/// Returns sums of brightness over the blocks of a picture, each with its pixels.
fn blocks(a: &Raster, b: &Raster) -> Vec<Vec<f64>> {
    let mut blocks = vec![Vec::new(); 24];
    for i in 0..a.pixels() {
        let (x, y) = (i as u32 % a.width, i as u32 / a.width);
        let block = (y * 4 / a.height * 6 + x * 6 / a.width) as usize;
        let bright = |r: &Raster| r.color(i).iter().map(|v| f64::from(*v)).sum::<f64>();
        blocks[block].push(bright(a) - bright(b));
    }
    blocks
}

/// Returns the mean over its standard error, or 0 if all differences are 0.
fn t_value(differences: &[f64]) -> f64 {
    let n = differences.len() as f64;
    let mean = differences.iter().sum::<f64>() / n;
    let squares: f64 = differences.iter().map(|d| (d - mean) * (d - mean)).sum();
    let error = (squares / (n * (n - 1.0))).sqrt();
    if error > 0.0 { mean / error } else { 0.0 }
}

#[test]
fn an_open_shutter_gives_the_average_of_exposures_at_its_moments() {
    let folder = Folder::new("shutter");
    let scene = folder.file("room.iv", SCENE);
    let keys = "frames 1\nshutter 1\nposition 0 0 0.3 2\nposition 1 0.3 0.3 2\n";
    let timeline = folder.file("move.film", keys);
    let common = "--lens none --size 72x48 --quiet";
    let (film, frames) = (folder.path("film.png"), folder.path("frames"));
    let shoot = format!(
        "pull-focus {scene} --animate {timeline} --samples 16 --depth 16 -o {film} \
         --folder {frames} {common}"
    );
    assert_eq!(ivcam(&shoot, &[]), 0);

    let mut exposures = Vec::new();
    for k in 0..16 {
        let x = 0.3 * (f64::from(k) + 0.5) / 16.0;
        let text = format!("#Inventor V2.1 ascii\nPerspectiveCamera {{ position {x} 0.3 2 }}\n");
        let camera = folder.file("at.dat", &text);
        let picture = folder.path(&format!("{k}.exr"));
        let seed = 1000 + k;
        let render = format!(
            "render {scene} --camera {camera} --samples 1 --seed {seed} -o {picture} {common}"
        );
        assert_eq!(ivcam(&render, &[]), 0);
        exposures.push(picture);
    }
    let sum = folder.path("sum.exr");
    let words = exposures.join(" ");
    assert_eq!(ivcam(&format!("expose --average -o {sum} {words}"), &[]), 0);

    let open = |path: &str| Raster::open(Path::new(path)).unwrap();
    let (blurred, added) = (open(&folder.path("frames/00000.png")), open(&sum));
    let blocks = blocks(&blurred, &added);
    // Of 24 blocks, one exceeds 3.7 by chance once in 200 runs; the seeds are fixed.
    for (i, block) in blocks.iter().enumerate() {
        let t = t_value(block);
        assert!(t.abs() < 3.7, "block {i} is {t} standard errors off");
    }
    // A shutter that opens for an instant gives a different picture.
    let still = open(&exposures[0]);
    let mean = |a: &Raster| {
        let far = |i: usize| (a.color(i)[0] - added.color(i)[0]).abs();
        (0..a.pixels()).map(far).sum::<f32>() / a.pixels() as f32
    };
    assert!(mean(&still) > 2.0 * mean(&blurred));
}

#[test]
fn an_interrupted_movie_renders_only_the_missing_frames() {
    let folder = Folder::new("resume");
    let (scene, film) = (folder.file("room.iv", SCENE), folder.path("film.png"));
    let line = format!(
        "pull-focus {scene} --from 1 --frames 3 --size 24x16 --samples 2 -o {film} --quiet --to"
    );
    let shoot = |to: &str| ivcam(&line, &[to, "--ease", "travel smooth"]);
    assert_eq!(shoot("3"), 0);
    let frame = |n: u32| folder.0.join(format!("film-frames/{n:05}.png"));
    let whole = std::fs::read(frame(1)).unwrap();
    std::fs::remove_file(frame(1)).unwrap();
    // An existing frame is not rendered again, whatever its content.
    let marked = std::fs::read(frame(2)).unwrap();
    std::fs::write(frame(0), &marked).unwrap();
    assert_eq!(shoot("3"), 0);
    assert_eq!(std::fs::read(frame(1)).unwrap(), whole);
    assert_eq!(std::fs::read(frame(0)).unwrap(), marked);
    // Frames of another movie are refused.
    assert_eq!(shoot("2"), 2);
}

/// A longer lens cannot focus as near.
#[test]
fn a_zoom_that_leaves_the_focus_too_near_is_refused_before_any_frame() {
    let folder = Folder::new("zoom");
    let scene = folder.file("room.iv", SCENE);
    let timeline = folder.file(
        "zoom.film",
        "frames 10\nfocus 0 0.6\nzoom 0 0.5\nzoom 9 3\n",
    );
    let [film, frames] = ["film.png", "frames"].map(|n| folder.path(n));
    let shoot = format!(
        "pull-focus {scene} --animate {timeline} -o {film} --folder {frames} --quiet \
         --lens double-gauss --size 36x24 --samples 1 --focus-method lens"
    );
    assert_eq!(ivcam(&shoot, &[]), 2);
    assert!(!Path::new(&frames).exists());
}
