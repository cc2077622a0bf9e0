//! Counts the scenes whose default picture is black where `--shading p` lights it.
//!
//! `cargo run --release -p measure -- unlit PROGRAM FOLDER -o FOLDER [--only TEXT]`.
//!
//! Every scene below the folder is rendered by the program's defaults and with `-s p`, 180×120
//! pixels. Model `p` has no shadows, mirrors or refraction, so what it lights and the default does
//! not is in shadow or reflects black. A file counts if more than 2% of the pixels that are lit by
//! `p` are black by default, or if its mean luminance is less than 4/5 of that by `p`. The table
//! has these files. `defaults-N.png` has the default pictures of all files, numbered as in
//! `defaults.txt`, with those of `p` beside them, and `nearly uniform` lists the files whose
//! default picture shows next to nothing: less than 1% of its pixels differ from its most frequent
//! color.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use image::RgbImage;

use super::shared::contact::ContactSheet;
use super::shared::scenes;
use super::shared::words::value_of;

const SIZE: &str = "180x120";

const SHEET: ContactSheet = ContactSheet {
    picture: (150, 100),
    pictures: 2,
    columns: 5,
    rows: 10,
};

/// The luminance, of 255 levels, from which a pixel is lit.
const LIT: f64 = 25.0;
/// The luminance below which a pixel is black.
const BLACK: f64 = 5.0;

/// The two pictures of a scene.
struct ScenePictures {
    name: String,
    by_default: RgbImage,
    by_phong: RgbImage,
}

impl ScenePictures {
    /// Returns the share of the pixels lit by model `p` that are black by default.
    fn black_share(&self) -> f64 {
        let (mut lit, mut black) = (0u32, 0u32);
        for (ours, phong) in self.by_default.pixels().zip(self.by_phong.pixels()) {
            let is_lit = luminance(phong.0) >= LIT;
            lit += u32::from(is_lit);
            black += u32::from(is_lit && luminance(ours.0) < BLACK);
        }
        f64::from(black) / f64::from(lit.max(1))
    }

    /// Returns the mean luminance of the default picture as a share of that by model `p`.
    fn luminance_share(&self) -> f64 {
        let sum = |picture: &RgbImage| picture.pixels().map(|p| luminance(p.0)).sum::<f64>();
        let phong = sum(&self.by_phong);
        if phong > 0.0 {
            sum(&self.by_default) / phong
        } else {
            1.0
        }
    }

    /// Returns the share of pixels that differ from the most frequent color.
    fn drawn_share(&self) -> f64 {
        let mut counts: HashMap<[u8; 3], u32> = HashMap::new();
        for pixel in self.by_default.pixels() {
            *counts.entry(pixel.0).or_default() += 1;
        }
        let most = counts.values().max().copied().unwrap_or(0);
        1.0 - f64::from(most) / f64::from(self.by_default.width() * self.by_default.height())
    }
}

/// Returns the luminance of a color in levels, by the weights of Rec. 601.
fn luminance([red, green, blue]: [u8; 3]) -> f64 {
    0.299 * f64::from(red) + 0.587 * f64::from(green) + 0.114 * f64::from(blue)
}

pub(crate) fn run(words: Vec<String>) -> ExitCode {
    let value = |name: &str| value_of(name, &words);
    let ([program, folder, ..], Some(out)) = (words.as_slice(), value("-o").map(PathBuf::from))
    else {
        return crate::usage("unlit");
    };
    if let Err(error) = std::fs::create_dir_all(&out) {
        eprintln!("{}: {error}", out.display());
        return ExitCode::FAILURE;
    }
    let only = value("--only").map_or("", String::as_str);
    let mut all = Vec::new();
    for file in scenes::below(Path::new(folder)) {
        let name = file.strip_prefix(folder).unwrap_or(&file);
        let name = name.display().to_string();
        if name.ends_with(".env") || !name.contains(only) {
            continue;
        }
        match shown(program, &file, name, &out) {
            Ok(shown) => all.push(shown),
            Err(message) => println!("no picture: {}: {message}", file.display()),
        }
    }
    tables(&all);
    match sheet(&all, &out) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{}: {error}", out.display());
            ExitCode::FAILURE
        }
    }
}

fn shown(program: &str, file: &Path, name: String, out: &Path) -> Result<ScenePictures, String> {
    Ok(ScenePictures {
        by_default: render(program, file, &[], &out.join("default.png"))?,
        by_phong: render(program, file, &["-s", "p"], &out.join("phong.png"))?,
        name,
    })
}

fn render(program: &str, file: &Path, words: &[&str], output: &Path) -> Result<RgbImage, String> {
    // A picture of an earlier scene must not stand for one that fails.
    let _ = std::fs::remove_file(output);
    let mut command = Command::new(program);
    command.arg("render").arg(file).args(words);
    command.args(["--size", SIZE, "-o"]).arg(output);
    let ran = command.output().map_err(|e| e.to_string())?;
    let picture = image::open(output).map_err(|_| {
        let text = String::from_utf8_lossy(&ran.stderr).into_owned();
        text.lines().next().unwrap_or("no message").to_owned()
    })?;
    Ok(picture.to_rgb8())
}

fn tables(all: &[ScenePictures]) {
    let darker = |s: &&ScenePictures| s.black_share() > 0.02 || s.luminance_share() < 0.8;
    println!("\n| darker by default than by `p` | black of what `p` lights | luminance |");
    println!("|---|---|---|");
    for shown in all.iter().filter(darker) {
        let (black, luminance) = (100.0 * shown.black_share(), 100.0 * shown.luminance_share());
        println!("| {} | {black:.1}% | {luminance:.0}% |", shown.name);
    }
    println!("\nnearly uniform:");
    for shown in all.iter().filter(|s| s.drawn_share() < 0.01) {
        println!("  {:.2}% {}", 100.0 * shown.drawn_share(), shown.name);
    }
    let black = all.iter().filter(|s| s.black_share() > 0.02).count();
    let dim = all.iter().filter(|s| s.luminance_share() < 0.8).count();
    let uniform = all.iter().filter(|s| s.drawn_share() < 0.01).count();
    println!(
        "\n{} pictures: {black} with black parts that `p` lights,",
        all.len()
    );
    println!("{dim} of less than 4/5 of the luminance, {uniform} nearly uniform");
}

fn sheet(all: &[ScenePictures], out: &Path) -> image::ImageResult<()> {
    let both = |s: &ScenePictures| vec![s.by_default.clone(), s.by_phong.clone()];
    let cells: Vec<Vec<RgbImage>> = all.iter().map(both).collect();
    let mut list = String::new();
    for (i, shown) in all.iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = writeln!(list, "{:4} {}", i + 1, shown.name);
    }
    std::fs::write(out.join("defaults.txt"), list)?;
    SHEET.write(&cells, out, "defaults").map(drop)
}
