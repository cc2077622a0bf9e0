//! Compares `ivcam render --look viewer` with the pictures of other viewers.
//!
//! `cargo run --release -p measure -- viewers PROGRAM CORPUS -o FOLDER [--coin PROGRAM]
//! [--view3dscene PROGRAM] [--only TEXT] [--least SSIM]`.
//!
//! CORPUS has `manifest.tsv`, `scenes/` and `reference/` with archived pictures of Coin and its
//! answers as JSON, which its README describes. `--coin` takes a program of the form `PROGRAM
//! -headlight on -s WxH -png FILE SCENE`, which draws files that have no archived picture, or one
//! without a headlight because the scene has lights. `--view3dscene` draws files of VRML that have
//! a camera; it needs an X server (`DISPLAY`). Each pair of pictures, 320×240, is compared by the
//! structural similarity of `ivcam compare`, without fitting tones or places. The table has the
//! pairs below `--least`, worst first; `pairs-N.png` has all of them in the same order: ivcam's
//! picture, the other's, and their difference.
mod peers;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use image::{Rgb, RgbImage};
use ivcam::compare::{self, Matching, Plate};

use self::peers::{CorpusScene, PictureSource};
use super::shared::contact::ContactSheet;
use super::shared::words::value_of;

/// The width and height of the pictures, those of the archived ones.
const SIZE: (u32, u32) = (320, 240);

/// The seconds after which another program is ended.
const SECONDS: &str = "120";

const SHEET: ContactSheet = ContactSheet {
    picture: (240, 180),
    pictures: 3,
    columns: 2,
    rows: 6,
};

struct ViewersOptions {
    ivcam: PathBuf,
    corpus: PathBuf,
    out: PathBuf,
    coin: Option<PathBuf>,
    view3dscene: Option<PathBuf>,
    only: String,
    /// The structural similarity below which a pair is in the table.
    least: f64,
}

impl ViewersOptions {
    fn parse(words: &[String]) -> Option<Self> {
        let value = |name: &str| value_of(name, words);
        let path = |name: &str| value(name).map(PathBuf::from);
        let [ivcam, corpus, ..] = words else {
            return None;
        };
        Some(Self {
            ivcam: ivcam.into(),
            corpus: corpus.into(),
            out: path("-o")?,
            coin: path("--coin"),
            view3dscene: path("--view3dscene"),
            only: value("--only").cloned().unwrap_or_default(),
            least: value("--least").map_or(Some(0.98), |v| v.parse().ok())?,
        })
    }
}

/// The comparison of two pictures of a scene.
struct PicturePair {
    scene: String,
    peer: PictureSource,
    ssim: f64,
    /// The peak signal-to-noise ratio in decibels.
    psnr: f64,
    pictures: [PathBuf; 2],
}

pub(crate) fn run(words: Vec<String>) -> ExitCode {
    let Some(options) = ViewersOptions::parse(&words) else {
        return crate::usage("viewers");
    };
    let mut pairs = Vec::new();
    for scene in peers::scenes(&options.corpus) {
        if scene.name.contains(&options.only) {
            pairs.extend(compare_scene(&options, &scene));
        }
    }
    pairs.sort_by(|a, b| a.ssim.total_cmp(&b.ssim));
    sums(&pairs, options.least);
    table(&pairs, options.least);
    match sheet(&pairs, &options.out) {
        Ok(pages) => println!("\n{pages} pages in {}", options.out.display()),
        Err(error) => {
            eprintln!("{}: {error}", options.out.display());
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}

/// Makes a scene's pictures and compares them, one pair for each other program that draws it.
fn compare_scene(options: &ViewersOptions, scene: &CorpusScene) -> Vec<PicturePair> {
    let mut pairs = Vec::new();
    for (peer, theirs) in scene.pictures(options) {
        let ours = file(&options.out, "ivcam", peer, &scene.name);
        if !photograph(options, scene, peer, &ours) {
            println!("no picture by ivcam: {}", scene.name);
            continue;
        }
        match measures(&ours, &theirs) {
            Ok((ssim, psnr)) => pairs.push(PicturePair {
                scene: scene.name.clone(),
                peer,
                ssim,
                psnr,
                pictures: [ours, theirs],
            }),
            Err(message) => println!("{}, {}: {message}", scene.name, peer.name()),
        }
    }
    pairs
}

/// Returns the place of a picture, and makes its folder.
fn file(out: &Path, by: &str, peer: PictureSource, scene: &str) -> PathBuf {
    let file = out.join(by).join(peer.name()).join(format!("{scene}.png"));
    if let Some(folder) = file.parent() {
        // A folder that cannot be made is reported by who writes into it.
        let _ = std::fs::create_dir_all(folder);
    }
    file
}

/// Renders a scene by ivcam with what the other program shows where the scene states nothing, and
/// returns whether there is a picture.
fn photograph(
    options: &ViewersOptions,
    scene: &CorpusScene,
    peer: PictureSource,
    output: &Path,
) -> bool {
    let mut command = Command::new(&options.ivcam);
    command.arg("render").arg(&scene.file);
    command.args(["--look", "viewer", "--quiet", "--size"]);
    command.arg(format!("{}x{}", SIZE.0, SIZE.1));
    command.arg("-o").arg(output);
    command.arg("--search").arg(options.corpus.join("scenes"));
    match peer {
        // Coin shows a world without a Viewpoint whole, not from 0 0 10.
        PictureSource::Archive | PictureSource::Coin => command.args(["--view", "else:front"]),
        // It lights every point, and its ground has the level 26.
        PictureSource::View3dscene => command.args(["-s", "p", "--background", "else:#1a1a1a"]),
    };
    if peer == PictureSource::Archive {
        command.args(["--headlight", if scene.headlight { "on" } else { "off" }]);
    }
    // A picture of an earlier run must not stand for one that fails now.
    let _ = std::fs::remove_file(output);
    let _ = command.output();
    output.exists()
}

/// Returns the structural similarity and the peak signal-to-noise ratio of two pictures.
fn measures(ours: &Path, theirs: &Path) -> Result<(f64, f64), String> {
    let open = |path: &Path| Plate::open(path).map_err(|e| e.message.clone());
    let options = compare::Options {
        matching: Matching::None,
        ..compare::Options::default()
    };
    let compared = compare::compare(&open(ours)?, &open(theirs)?, &options);
    let measures = compared.map_err(|e| e.message.clone())?.measures;
    Ok((measures.ssim, measures.psnr))
}

fn sums(pairs: &[PicturePair], least: f64) {
    let mut by_peer: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for pair in pairs {
        by_peer.entry(pair.peer.name()).or_default().push(pair.ssim);
    }
    println!("\n| pictures by | number | median SSIM | at least {least} |\n|---|---|---|---|");
    for (peer, values) in by_peer {
        let good = values.iter().filter(|v| **v >= least).count();
        let (count, median) = (values.len(), values[values.len() / 2]);
        println!("| {peer} | {count} | {median:.3} | {good} |");
    }
}

/// Prints the pairs below a structural similarity, with their numbers on the sheet.
fn table(pairs: &[PicturePair], least: f64) {
    println!("\n| | file | pictures by | SSIM | PSNR | cause |\n|---|---|---|---|---|---|");
    for (i, pair) in pairs.iter().enumerate().filter(|(_, p)| p.ssim < least) {
        let (number, scene, peer) = (i + 1, &pair.scene, pair.peer.name());
        let (ssim, psnr, cause) = (pair.ssim, pair.psnr, pair.peer.cause(scene));
        println!("| {number} | {scene} | {peer} | {ssim:.3} | {psnr:.1} | {cause} |");
    }
}

fn sheet(pairs: &[PicturePair], out: &Path) -> image::ImageResult<usize> {
    let open = |pair: &PicturePair| {
        let [ours, theirs] = &pair.pictures;
        let (ours, theirs) = (image::open(ours)?.to_rgb8(), image::open(theirs)?.to_rgb8());
        let difference = difference(&ours, &theirs);
        Ok(vec![ours, theirs, difference])
    };
    let cells: image::ImageResult<Vec<Vec<RgbImage>>> = pairs.iter().map(open).collect();
    SHEET.write(&cells?, out, "pairs")
}

/// Returns the absolute difference of each channel.
fn difference(ours: &RgbImage, theirs: &RgbImage) -> RgbImage {
    RgbImage::from_fn(ours.width(), ours.height(), |x, y| {
        let (a, b) = (ours.get_pixel(x, y), theirs.get_pixel_checked(x, y));
        let b = b.copied().unwrap_or(Rgb([0; 3]));
        Rgb([0, 1, 2].map(|c| a.0[c].abs_diff(b.0[c])))
    })
}
