//! Movies: motion blur is the average of its moments, and an interrupted movie continues.

use std::path::Path;

use common::{Folder, ivcam};
use ivcam_optics::picture::Raster;

use super::common;

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
    for choice in [
        "--scene-time 1",
        "--tilt 2",
        "--backdrop 2",
        "--headlight off",
        "--event PointLight.on=FALSE",
    ] {
        let words = ["3", "--ease", "travel smooth"]
            .into_iter()
            .chain(choice.split(' '));
        assert_eq!(ivcam(&line, &words.collect::<Vec<_>>()), 2, "{choice}");
    }
}

#[test]
fn a_movie_replaces_no_file_of_its_own_and_a_changed_texture_is_refused() {
    let folder = Folder::new("own");
    let texture = folder.0.join("tex.png");
    let paint = |level: u8| {
        let picture = image::RgbImage::from_pixel(2, 2, image::Rgb([level; 3]));
        picture.save(&texture).unwrap();
    };
    paint(10);
    let textured = SCENE.replace("Cube", "Texture2 { filename \"tex.png\" } Cube");
    let (scene, frames) = (folder.file("room.iv", &textured), folder.path("frames"));
    let line = format!(
        "pull-focus {scene} --from 1 --to 3 --length 2 --size 18x12 --samples 1 --quiet \
         --folder {frames} -o"
    );
    let movie = folder.path("movie.png");
    let frame = format!("{frames}/00001.png");
    assert_eq!(ivcam(&line, &[texture.to_str().unwrap()]), 2);
    assert_eq!(ivcam(&line, &[&frame]), 2);
    assert_eq!(ivcam(&line, &[&movie]), 0);
    assert_eq!(ivcam(&format!("frames {frames} -o {frame}"), &[]), 2);
    assert_eq!(Raster::open(&texture).unwrap().width, 2);
    // All frames are done.
    paint(20);
    assert_eq!(ivcam(&line, &[&movie]), 2);
}

#[test]
fn a_blurred_frame_states_its_first_moment() {
    let folder = Folder::new("first");
    let scene = folder.file("room.iv", SCENE);
    let keys = "frames 1\nshutter 0.5\ntime 0 4\ntime 1 6\n";
    let timeline = folder.file("move.film", keys);
    let frames = folder.path("frames");
    let shoot = format!(
        "pull-focus {scene} --animate {timeline} --samples 2 --lens none --size 18x12 --quiet \
         --folder {frames} --frames 0-0"
    );
    assert_eq!(ivcam(&shoot, &[]), 0);
    let file = std::fs::File::open(folder.0.join("frames/00000.png")).unwrap();
    let reader = png::Decoder::new(std::io::BufReader::new(file))
        .read_info()
        .unwrap();
    let texts = reader
        .info()
        .utf8_text
        .iter()
        .map(|text| (&*text.keyword, text.get_text().unwrap()));
    let texts: std::collections::HashMap<&str, String> = texts.collect();
    // Of two moments in half of the frame's time, the first is at an eighth.
    assert_eq!(texts["ivcam:scene-time"], "4.25");
    assert_eq!(texts["ivcam:shutter"], "0.5");
    assert_eq!(texts["ivcam:samples"], "2");
}

/// Names with what ffmpeg reads as a pattern or a protocol.
#[test]
fn ffmpeg_writes_a_movie_of_any_name() {
    if !crate::movie::has_ffmpeg() {
        return;
    }
    let folder = Folder::new("names");
    let scene = folder.file("room.iv", SCENE);
    let line = format!(
        "pull-focus {scene} --from 1 --to 3 --length 2 --size 18x12 --samples 1 --quiet -o"
    );
    for name in ["100%.mp4", "take:1.mov", "-%03d.mp4"] {
        let movie = folder.path(name);
        assert_eq!(ivcam(&line, &[&movie]), 0, "{name}");
        assert!(Path::new(&movie).exists(), "{name}");
    }
}

#[test]
fn several_runs_divide_a_movie_and_make_the_same_frames_as_one() {
    let folder = Folder::new("divide");
    let scene = folder.file("room.iv", SCENE);
    let line = format!(
        "pull-focus {scene} --from 1 --to 3 --length 12 --size 18x12 --samples 2 --quiet \
         --threads 1 --folder"
    );
    let (shared, alone) = (folder.path("shared"), folder.path("alone"));
    assert_eq!(ivcam(&line, &[&alone, "--frames", "0-11"]), 0);
    let lists = ["0-11", "0-11:1", "11-11,0-10"];
    let runs = lists.map(|list| {
        let (line, shared) = (line.clone(), shared.clone());
        std::thread::spawn(move || ivcam(&line, &[&shared, "--frames", list]))
    });
    for run in runs {
        assert_eq!(run.join().unwrap(), 0);
    }

    let log = std::fs::read_to_string(folder.0.join("shared/film.log")).unwrap();
    for frame in 0..12 {
        for verb in ["begins", "writes"] {
            let line = format!(" {verb} frame {frame}");
            let count = log.lines().filter(|l| l.ends_with(&line)).count();
            assert_eq!(count, 1, "{line}\n{log}");
        }
        let picture =
            |folder: &str| Raster::open(&Path::new(folder).join(format!("{frame:05}.png")));
        assert_eq!(picture(&shared).unwrap(), picture(&alone).unwrap());
    }
    let names = std::fs::read_dir(&shared).unwrap().count();
    assert_eq!(names, 12 + 3, "frames, film.txt, files.txt and film.log");
}

#[test]
fn frames_are_listed_and_broken_ones_are_made_again() {
    let folder = Folder::new("list");
    let (scene, frames) = (folder.file("room.iv", SCENE), folder.path("pull-frames"));
    let line = format!(
        "pull-focus {scene} --from 1 --to 3 --length 6 --size 18x12 --samples 1 --quiet \
         --folder {frames} --frames"
    );
    let (movie, list) = (folder.path("pull.png"), format!("frames {frames}"));
    assert_eq!(ivcam(&line, &["0-5:2"]), 0);
    let exists = |n: u32| Path::new(&frames).join(format!("{n:05}.png")).exists();
    assert_eq!(
        [0, 1, 2, 3, 4, 5].map(exists),
        [true, false, true, false, true, false]
    );
    assert_eq!(ivcam(&list, &["-o", &movie]), 1);
    assert!(!Path::new(&movie).exists());

    assert_eq!(ivcam(&line, &["1,3,5"]), 0);
    let path = |n: u32| folder.0.join(format!("pull-frames/{n:05}.png"));
    let whole = std::fs::read(path(2)).unwrap();
    let picture = Raster::open(&path(2)).unwrap();
    // One is cut off, one is damaged inside, and two have another size, of which one is the first.
    std::fs::write(path(2), &whole[..whole.len() - 20]).unwrap();
    let mut damaged = std::fs::read(path(3)).unwrap();
    let middle = damaged.windows(4).position(|w| w == b"IDAT").unwrap() + 8;
    damaged[middle] ^= 0x55;
    std::fs::write(path(3), damaged).unwrap();
    image::RgbImage::new(2, 2).save(path(0)).unwrap();
    image::RgbImage::new(2, 3).save(path(4)).unwrap();
    let broken = || -> Vec<bool> {
        let survey = crate::movie::Frames::survey(&folder.0.join("pull.mov")).unwrap();
        let is_broken = |state| matches!(state, &crate::movie::FrameState::Broken(_));
        survey.states.iter().map(is_broken).collect()
    };
    assert_eq!(broken(), [true, false, true, true, true, false]);
    // Without the size in the label, the most common one decides.
    let label = folder.0.join("pull-frames/film.txt");
    let text = std::fs::read_to_string(&label).unwrap();
    std::fs::write(&label, text.replace("size 18x12\n", "")).unwrap();
    assert_eq!(broken(), [true, false, true, true, true, false]);
    std::fs::write(&label, text).unwrap();

    assert_eq!(ivcam(&list, &["--json", "--remove-broken"]), 1);
    assert_eq!(ivcam(&line, &["0-5"]), 0);
    assert_eq!(Raster::open(&path(2)).unwrap(), picture);
    assert_eq!(ivcam(&list, &["-o", &movie]), 0);
    assert!(Path::new(&movie).exists());
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
