//! Makes the pictures of the README and the guide again with the commands that are printed beside
//! them.
//!
//! A command belongs to a picture if it is printed in the same Markdown file and its output has the
//! picture's name. A render is compared in the two rows of the picture that have the most contrast,
//! with all its samples; `WHOLE=1` compares every pixel. A drawing is compared as text. Pictures
//! are the same on every machine, so any difference is an error. `UPDATE=1` makes pictures again,
//! whole, and replaces those that differ. Ghosts and the images of points are always whole and take
//! long, so their pictures are compared only with `WHOLE` or `UPDATE`.

use std::path::{Path, PathBuf};
use std::process::Command;

use image::RgbImage;
use libtest_mimic::{Failed, Trial};

use crate::difference::Difference;

/// Pictures that no command makes, with what makes them.
const OTHERS: [(&str, &str); 6] = [
    (
        "photograph-canon-70-200.svg",
        "`measure -- profiles` draws it",
    ),
    (
        "photograph-micro-nikkor-60.svg",
        "`measure -- profiles` draws it",
    ),
    (
        "photograph-nikkor-14-30.svg",
        "`measure -- profiles` draws it",
    ),
    (
        "photograph-takumar-50.svg",
        "`measure -- profiles` draws it",
    ),
    ("window.png", "the tests of the window draw it"),
    ("figure-6.svg", "it is drawn by hand"),
];

/// The options that name a command's picture.
const OUTPUTS: [&str; 4] = ["-o", "--psf", "--diagram", "--sheet"];

/// The rows of a render that are compared.
const ROWS: u32 = 2;

/// Returns one trial for each picture, named `guide/<picture>`.
pub fn trials() -> Vec<Trial> {
    let mut files = vec![PathBuf::from("README.md")];
    let guide = std::fs::read_dir("docs/guide").unwrap();
    files.extend(guide.map(|entry| entry.unwrap().path()));
    files.retain(|file| file.extension().is_some_and(|e| e == "md"));
    files.sort();
    let mut trials = Vec::new();
    for file in files {
        let text = std::fs::read_to_string(&file).unwrap();
        let commands = commands(&text);
        for link in pictures(&text) {
            let name = base_name(link).to_owned();
            if OTHERS.iter().any(|(other, _)| *other == name) {
                continue;
            }
            let picture = file.with_file_name("").join(link);
            let made_by = commands.iter().find(|c| base_name(c.output()) == name);
            let (made_by, page) = (made_by.cloned(), file.display().to_string());
            let title = format!("guide/{name}");
            let slow = made_by.as_ref().is_some_and(Printed::is_slow) && !is_whole();
            let check = move || match made_by {
                Some(command) => command.check(&picture),
                None => Err(format!("{page} prints no command with the output `{name}`").into()),
            };
            trials.push(Trial::test(title, check).with_ignored_flag(slow));
        }
    }
    assert!(trials.len() > 15, "the pictures are not found");
    trials
}

/// Returns whether whole pictures are compared.
fn is_whole() -> bool {
    let names = ["WHOLE", "UPDATE"];
    names.iter().any(|name| std::env::var_os(name).is_some())
}

fn base_name(path: &str) -> &str {
    path.rsplit('/').next().unwrap_or(path)
}

/// Returns the targets of the links to pictures in a Markdown text.
fn pictures(text: &str) -> impl Iterator<Item = &str> {
    let targets = text.split("](").skip(1).filter_map(|t| t.split(')').next());
    targets.filter(|t| t.ends_with(".png") || t.ends_with(".svg"))
}

/// Returns the commands in a Markdown text that make a picture.
fn commands(text: &str) -> Vec<Printed> {
    let joined = text.replace("\\\n", " ");
    let words = |line: &str| -> Option<Vec<String>> {
        let line = line.trim();
        let rest = line
            .strip_prefix("cargo run --release -- ")
            .or_else(|| line.strip_prefix("ivcam "))?;
        let rest = rest.split(" # ").next().unwrap_or(rest);
        Some(rest.split_whitespace().map(str::to_owned).collect())
    };
    joined
        .lines()
        .filter_map(words)
        .filter_map(|words| {
            let option = words.iter().rposition(|w| OUTPUTS.contains(&w.as_str()))?;
            (option + 1 < words.len()).then_some(Printed { words, option })
        })
        .collect()
}

/// A command of a Markdown file.
#[derive(Clone)]
struct Printed {
    /// The arguments of the program.
    words: Vec<String>,
    /// The place of the option that names the picture.
    option: usize,
}

impl Printed {
    fn is_slow(&self) -> bool {
        let slow = |word: &String| ["--ghosts", "--psf"].contains(&word.as_str());
        self.words.iter().any(slow)
    }

    fn output(&self) -> &str {
        &self.words[self.option + 1]
    }

    /// Makes the picture again and compares it with the picture of the guide.
    fn check(&self, picture: &Path) -> Result<(), Failed> {
        let update = std::env::var_os("UPDATE").is_some();
        let file = format!("guide-{}-{}", std::process::id(), base_name(self.output()));
        let made = Path::new(env!("CARGO_TARGET_TMPDIR")).join(file);
        let is_render = self.words[0] != "lens";
        let region = match is_render && !is_whole() {
            true => Some(contrasting_rows(&open(picture)?)),
            false => None,
        };
        self.run(&made, region)?;
        let found = match picture.extension().is_some_and(|e| e == "svg") {
            true => compare_texts(picture, &made),
            false => compare_pictures(picture, &made, region),
        };
        std::fs::remove_file(&made)?;
        let frames = made.with_extension("").display().to_string() + "-frames"; // of a movie
        if Path::new(&frames).exists() {
            std::fs::remove_dir_all(frames)?;
        }
        if found.is_err() && update {
            self.run(picture, None)?;
            return Ok(());
        }
        found
    }

    /// Runs the command with another output, for the whole picture or for some of its rows.
    fn run(&self, output: &Path, region: Option<[u32; 4]>) -> Result<(), Failed> {
        let mut words = self.words.clone();
        words[self.option + 1] = output.display().to_string();
        if let Some(rows) = region {
            self.restrict(&mut words, rows)?;
        }
        let run = Command::new(env!("CARGO_BIN_EXE_ivcam"))
            .args(&words)
            .output()?;
        if run.status.success() {
            return Ok(());
        }
        let said = String::from_utf8_lossy(&run.stderr);
        Err(format!("ivcam {}: {said}", words.join(" ")).into())
    }

    /// Restricts a render to a part of its picture. The picture may itself be a region.
    fn restrict(&self, words: &mut Vec<String>, [x, y, w, h]: [u32; 4]) -> Result<(), Failed> {
        let option = words.iter().position(|word| word == "--region");
        let Some(option) = option else {
            let region = ["--region".into(), format!("{x},{y},{w},{h}")];
            words.splice(self.option..self.option, region);
            return Ok(());
        };
        let numbers: Result<Vec<u32>, _> = words[option + 1].split(',').map(str::parse).collect();
        let numbers = numbers?;
        words[option + 1] = format!("{},{},{w},{h}", numbers[0] + x, numbers[1] + y);
        Ok(())
    }
}

fn open(picture: &Path) -> Result<RgbImage, Failed> {
    match image::open(picture) {
        Ok(image) => Ok(image.to_rgb8()),
        Err(error) => Err(format!("{}: {error}", picture.display()).into()),
    }
}

/// Returns the adjacent rows that have the most contrast between neighboring pixels, as left, top,
/// width and height.
fn contrasting_rows(picture: &RgbImage) -> [u32; 4] {
    let (width, height) = picture.dimensions();
    let contrast = |top: &u32| -> u64 {
        let pairs = (*top..*top + ROWS).flat_map(|y| (1..width).map(move |x| (x, y)));
        let step = |(x, y)| {
            let (a, b) = (picture.get_pixel(x - 1, y), picture.get_pixel(x, y));
            (0..3).map(|c| u64::from(a[c].abs_diff(b[c]))).sum::<u64>()
        };
        pairs.map(step).sum()
    };
    let top = (0..=height.saturating_sub(ROWS)).max_by_key(contrast);
    [0, top.unwrap_or(0), width, ROWS.min(height)]
}

/// Compares a picture, or some of its rows, with the one that the command made.
fn compare_pictures(picture: &Path, made: &Path, region: Option<[u32; 4]>) -> Result<(), Failed> {
    let (mut old, new) = (open(picture)?, open(made)?);
    if let Some([x, y, w, h]) = region {
        old = image::imageops::crop_imm(&old, x, y, w, h).to_image();
    }
    if old.dimensions() != new.dimensions() {
        let (old, new) = (old.dimensions(), new.dimensions());
        return Err(format!("the command makes {new:?} pixels, the picture has {old:?}").into());
    }
    match Difference::between(&old, &new, 0) {
        None => Ok(()),
        Some(found) => Err(format!(
            "{} is not what its command makes: {found}; {UPDATE}",
            picture.display()
        )
        .into()),
    }
}

fn compare_texts(picture: &Path, made: &Path) -> Result<(), Failed> {
    if std::fs::read(picture)? == std::fs::read(made)? {
        return Ok(());
    }
    Err(format!(
        "{} is not what its command makes; {UPDATE}",
        picture.display()
    )
    .into())
}

const UPDATE: &str = "`UPDATE=1 cargo test --release --test files guide` makes it again";
