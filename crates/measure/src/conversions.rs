//! Converts every scene below a folder to every format, reads the results, and compares pictures.
//!
//! `cargo run --release -p measure -- conversions PROGRAM FOLDER [--only TEXT] [--keep FOLDER]`.
//!
//! The pictures are by model `p` without a lens, from the camera of the scene, on one gray, with
//! 160×120 pixels, 4 samples and 16 bits. Round shapes are divided to 0.0005 of their size. Each
//! pair gets the first of these results that holds:
//!
//! * *equal*: all pixels have the same bits.
//! * *rounded*: no channel of a pixel differs by more than a level of 255.
//! * *edges*: each pixel lies, within a level, among the 3×3 pixels around it in the other picture,
//!   but for at most one in a thousand: triangles have other edges than spheres.
//! * *light lost*: the report names a loss of light, and the pictures by model `flat`, which no
//!   light enters, are one of the above.
//! * *explained*: the report names a loss that can change a picture (`SEEN`).
//! * *unlit*: the pictures by model `flat` are one of the first three. `docs/guide/convert.md` says
//!   how light differs without a loss: ambient light, and where the viewer of highlights is.
//! * *unexplained*: none of these.
//!
//! *refused* are files that are written and cannot be read. The exit code is 1 if a pair is
//! unexplained or refused.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use image::{ImageBuffer, Rgb};
use ivcam::photo::{Era, Optics, Plan, Session};
use serde_json::Value;

use super::shared::scenes;
use super::shared::words::value_of;

/// A picture with 16 bits for each channel.
type Picture = ImageBuffer<Rgb<u16>, Vec<u16>>;

/// The formats, by the words of `--to` and the endings of the files.
const FORMATS: [(&str, &str); 8] = [
    // The ending of a VRML97 scene is `wrl`.
    ("ascii", "iv"),
    ("binary", "iv"),
    ("inventor", "iv"),
    ("vrml97", "wrl"),
    ("x3d", "x3d"),
    ("glb", "glb"),
    ("obj", "obj"),
    ("ply", "ply"),
];

/// The results of a pair, in the order of the table.
const RESULTS: [&str; 9] = [
    "equal",
    "rounded",
    "edges",
    "light lost",
    "explained",
    "unlit",
    "unexplained",
    "refused",
    "nothing to draw",
];

const LIGHT: usize = 3;
const EXPLAINED: usize = 4;
const UNLIT: usize = 5;
const UNEXPLAINED: usize = 6;
const REFUSED: usize = 7;
const EMPTY: usize = 8;

/// What the program says of a scene without shapes.
const NOTHING: &str = "nothing to draw was found";

/// Losses of light: model `flat` does not show them.
const OF_LIGHT: &[&str] = &[
    "ambient-color",
    "ambient-light",
    "headlight",
    "light",
    "light-ambient",
    "light-falloff",
    "light-radius",
    "light-range",
    "light-scope",
    "lit-lines",
    "shading",
    "spot-falloff",
];

/// Other losses that can change a picture from the same camera on the same ground.
const SEEN: &[&str] = &[
    "billboard",
    "clip-plane",
    "color-range",
    "deep-texture",
    "environment-texture",
    "file",
    "fog",
    "further-texture",
    "levels",
    "line-pattern",
    "line-width",
    "lines-and-points",
    "on-top",
    "one-sided",
    "point-size",
    "polygon-offset",
    "routes",
    "screen-aligned",
    "script-interfaces",
    "texture",
    "texture-blend",
    "texture-filter",
    "texture-matrix",
    "texture-repeat",
    "unknown-fields",
    "vertex-colors",
    "vertex-opacity",
    "x3d-class",
];

/// A level of 255, in the numbers of 16 bits.
const LEVEL: u16 = 257;

/// What the measurement needs for every file.
struct Conversions {
    program: String,
    /// The folder of the written files.
    folder: PathBuf,
}

/// The results by format, and the losses of the pairs that are explained.
#[derive(Default)]
struct ConversionCounts {
    counts: BTreeMap<(usize, usize), usize>,
    losses: BTreeMap<(usize, String), usize>,
    files: usize,
}

pub(crate) fn run(words: Vec<String>) -> ExitCode {
    let value = |name: &str| value_of(name, &words);
    let [program, scenes_folder, ..] = words.as_slice() else {
        return crate::usage("conversions");
    };
    let of_process = || {
        let name = format!("ivcam-conversions-{}", std::process::id());
        std::env::temp_dir().join(name)
    };
    let measurement = Conversions {
        program: program.clone(),
        folder: value("--keep").map_or_else(of_process, PathBuf::from),
    };
    let only = value("--only").map_or("", String::as_str);
    let mut sums = ConversionCounts::default();
    for (number, file) in scenes::below(Path::new(scenes_folder)).iter().enumerate() {
        let name = file.display().to_string();
        if !name.ends_with(".env") && name.contains(only) {
            let folder = measurement.folder.join(format!("{number:04}"));
            measurement.file(file, &folder, &mut sums);
        }
    }
    if value("--keep").is_none() {
        // A folder that cannot be removed stays among the temporary files.
        let _ = std::fs::remove_dir_all(&measurement.folder);
    }
    sums.print();
    match sums.is_good() {
        true => ExitCode::SUCCESS,
        false => ExitCode::FAILURE,
    }
}

impl Conversions {
    /// Compares the pictures of a file with those of its conversions.
    fn file(&self, file: &Path, folder: &Path, sums: &mut ConversionCounts) {
        let mut plan = Plan::of_era(Era::Modern, file);
        plan.optics = Optics::Pinhole;
        // Files that cannot be read are not the subject here.
        let Ok(session) = Session::open(plan) else {
            return;
        };
        let is_vrml97 = session.document.is_vrml97();
        let Ok(camera) = session.camera_file() else {
            return;
        };
        drop(session);
        let camera_file = folder.join("camera.iv");
        if let Err(error) =
            std::fs::create_dir_all(folder).and_then(|()| std::fs::write(&camera_file, camera))
        {
            eprintln!("{}: {error}", folder.display());
            return;
        }
        sums.files += 1;
        let original = self.picture(file, folder, "p");
        for (index, (format, ending)) in FORMATS.iter().enumerate() {
            let keeps = *format == "ascii" && is_vrml97;
            let ending = if keeps { "wrl" } else { ending };
            let output = folder.join(format!("{format}.{ending}"));
            let (result, note) = match (&original, self.converted(file, format, &output)) {
                (Err(_), _) => (EMPTY, String::new()),
                (_, Err(message)) if message == NOTHING => (EMPTY, String::new()),
                (_, Err(message)) => (REFUSED, message),
                (Ok(original), Ok(losses)) => {
                    self.judged((file, original), (&output, folder), &losses)
                }
            };
            *sums.counts.entry((index, result)).or_default() += 1;
            match result {
                LIGHT | EXPLAINED => *sums.losses.entry((index, note)).or_default() += 1,
                UNLIT.. if result != EMPTY => {
                    println!("{format} {} {}: {note}", RESULTS[result], file.display())
                }
                _ => {}
            }
        }
    }

    /// Returns the result of a pair, and what explains it or what is wrong.
    fn judged(
        &self,
        (file, original): (&Path, &Picture),
        (output, folder): (&Path, &Path),
        losses: &[String],
    ) -> (usize, String) {
        let again = match self.picture(output, folder, "p") {
            Ok(picture) => picture,
            Err(message) => return (REFUSED, message),
        };
        let difference = PairDifference::of(original, &again);
        if let Some(result) = difference.result() {
            return (result, String::new());
        }
        let of = |codes: &[&str]| {
            let found = losses.iter().filter(|loss| codes.contains(&loss.as_str()));
            found.cloned().collect::<Vec<_>>().join(" ")
        };
        let (light, seen) = (of(OF_LIGHT), of(SEEN));
        let flat = |file: &Path| self.picture(file, folder, "f").ok();
        let pair = flat(file).zip(flat(output));
        let is_flat_equal =
            pair.is_some_and(|(a, b)| PairDifference::of(&a, &b).result().is_some());
        if !light.is_empty() && is_flat_equal {
            return (LIGHT, light);
        }
        if !seen.is_empty() {
            return (EXPLAINED, [light, seen].join(" ").trim().to_owned());
        }
        let result = if is_flat_equal { UNLIT } else { UNEXPLAINED };
        (
            result,
            format!("{difference}; losses: {}", losses.join(" ")),
        )
    }

    /// Converts a file, and returns the codes of the losses.
    fn converted(&self, file: &Path, format: &str, output: &Path) -> Result<Vec<String>, String> {
        let report = output.with_extension("json");
        let mut command = Command::new(&self.program);
        command
            .arg("convert")
            .arg(file)
            .args(["--to", format, "-o"]);
        command.arg(output).arg("--report").arg(&report);
        let options = ["--tolerance", "0.0005", "--animate", "0", "--keep-origin"];
        let ran = command
            .args(options)
            .args(["--time", "60s", "--force"])
            .output();
        let ran = ran.map_err(|e| e.to_string())?;
        let text = String::from_utf8_lossy(&ran.stderr).into_owned();
        if text.contains(NOTHING) {
            return Err(NOTHING.into());
        }
        if !ran.status.success() {
            let error = text.lines().find(|line| line.starts_with("error"));
            return Err(error.unwrap_or("no message").to_owned());
        }
        let text = std::fs::read_to_string(&report).map_err(|e| e.to_string())?;
        let report: Value = serde_json::from_str(&text).map_err(|e| e.to_string())?;
        let losses = report["losses"].as_array().into_iter().flatten();
        let mut codes: Vec<String> = losses
            .filter_map(|loss| loss["feature"].as_str().map(str::to_owned))
            .collect();
        codes.sort();
        codes.dedup();
        Ok(codes)
    }

    /// Takes a picture by a model, or returns the first line of what the program says.
    fn picture(&self, file: &Path, folder: &Path, model: &str) -> Result<Picture, String> {
        let picture = folder.join("picture.png");
        // A picture of another file must not stand for one that fails.
        let _ = std::fs::remove_file(&picture);
        let mut command = Command::new(&self.program);
        command.arg("render").arg(file).arg("--camera");
        command.arg(folder.join("camera.iv")).args(["-s", model]);
        command.args(["--lens", "none", "--size", "160x120", "--samples", "4"]);
        command.args(["--depth", "16", "--background", "#406080", "-o"]);
        let ran = command.arg(&picture).output().map_err(|e| e.to_string())?;
        let made = image::open(&picture).map_err(|_| {
            let text = String::from_utf8_lossy(&ran.stderr).into_owned();
            text.lines().next().unwrap_or("no message").to_owned()
        })?;
        Ok(made.to_rgb16())
    }
}

/// How far two pictures of the same size differ.
#[derive(Clone, Copy, Debug)]
struct PairDifference {
    /// The largest difference of a channel, of 65535.
    most: u16,
    /// The share of pixels that are not among those around them in the other picture.
    beyond: f64,
}

impl std::fmt::Display for PairDifference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (levels, share) = (f64::from(self.most) / f64::from(LEVEL), 100.0 * self.beyond);
        write!(
            f,
            "up to {levels:.0} levels, {share:.1}% of the pixels beyond edges"
        )
    }
}

impl PairDifference {
    fn of(a: &Picture, b: &Picture) -> Self {
        let pairs = a.as_raw().iter().zip(b.as_raw());
        let most = pairs.map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0);
        let mut beyond = 0;
        for (x, y, pixel) in a.enumerate_pixels() {
            let other = b.get_pixel(x, y);
            let is_beyond = !is_among(pixel, b, (x, y)) || !is_among(other, a, (x, y));
            beyond += u32::from(is_beyond);
        }
        Self {
            most,
            beyond: f64::from(beyond) / f64::from((a.width() * a.height()).max(1)),
        }
    }

    /// The number of the result, if the pictures are the same but for rounding and edges.
    fn result(self) -> Option<usize> {
        match self {
            Self { most: 0, .. } => Some(0),
            Self { most: ..=LEVEL, .. } => Some(1),
            Self { beyond, .. } if beyond <= 0.001 => Some(2),
            _ => None,
        }
    }
}

/// Whether each channel of a pixel is, within a level, among those of the 3×3 pixels around a
/// place.
fn is_among(pixel: &Rgb<u16>, picture: &Picture, (x, y): (u32, u32)) -> bool {
    let near = |at: u32, size: u32| at.saturating_sub(1)..=(at + 1).min(size - 1);
    let rows = near(y, picture.height());
    let around =
        rows.flat_map(|y| near(x, picture.width()).map(move |x| picture.get_pixel(x, y).0));
    let around: Vec<[u16; 3]> = around.collect();
    (0..3).all(|channel| {
        let channels = || around.iter().map(|p| p[channel]);
        let least = channels().min().unwrap_or(0).saturating_sub(LEVEL);
        let most = channels().max().unwrap_or(0).saturating_add(LEVEL);
        (least..=most).contains(&pixel.0[channel])
    })
}

impl ConversionCounts {
    fn count(&self, format: usize, result: usize) -> usize {
        self.counts.get(&(format, result)).copied().unwrap_or(0)
    }

    fn is_good(&self) -> bool {
        (0..FORMATS.len()).all(|f| self.count(f, UNEXPLAINED) + self.count(f, REFUSED) == 0)
    }

    fn print(&self) {
        println!("\n| format | {} |", RESULTS.join(" | "));
        println!("|---|{}", "---|".repeat(RESULTS.len()));
        for (index, (format, _)) in FORMATS.iter().enumerate() {
            let counts = (0..RESULTS.len()).map(|r| self.count(index, r).to_string());
            let counts = counts.collect::<Vec<_>>().join(" | ");
            println!("| {format} | {counts} |");
        }
        println!("\n{} files; losses that explain, by format:", self.files);
        for ((format, codes), count) in &self.losses {
            println!("  {} {count} {codes}", FORMATS[*format].0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(of: impl Fn(u32) -> u16) -> Picture {
        Picture::from_fn(40, 30, |x, _| Rgb([of(x); 3]))
    }

    #[test]
    fn a_moved_edge_is_an_edge_and_a_darker_surface_is_not() {
        let step = |at: u32, light: u16| picture(move |x| if x < at { 0 } else { light });
        let result = |a: &Picture, b: &Picture| PairDifference::of(a, b).result();
        let original = step(20, 60_000);
        assert_eq!(result(&original, &original), Some(0));
        assert_eq!(result(&original, &step(20, 60_200)), Some(1));
        assert_eq!(result(&original, &step(21, 60_000)), Some(2));
        assert_eq!(result(&original, &step(23, 60_000)), None);
        assert_eq!(result(&original, &step(20, 59_000)), None);
    }
}
