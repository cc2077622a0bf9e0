//! Damages every scene below a folder, and reads, compiles, inspects and writes the result.
//!
//! `cargo run --release -p measure -- damage -- FOLDER [--each N]
//! [--only TEXT] [--seconds S] [--mb M]`.
//!
//! Every file, in its original form and as written by ivcam in ASCII and in binary, is damaged in N
//! ways (default 8): bits inverted, the end cut off, words exchanged, numbers made huge, pieces
//! removed or duplicated. The exit code is 1 if one panics, takes more than S seconds of the clock
//! (default 10), or makes the process use more than M megabytes (default 3,500). The damage is the
//! same in every run.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use glam::Vec3;
use ivcam_inventor::events::SnapshotOptions;
use ivcam_inventor::iv::{Document, FolderLoader, Format, Limits};
use ivcam_optics::sampling::mix;
use ivcam_render::bvh::Ray;
use ivcam_render::scene::{CompileOptions, RenderScene};

use super::shared::pictures::peak_kilobytes;
use super::shared::scenes;
use super::shared::words::value_of;

/// A random number generator with a seed.
struct Dice(u64);

impl Dice {
    /// Returns a number below `n`, which must not be 0.
    fn below(&mut self, n: usize) -> usize {
        self.0 = mix(self.0);
        (self.0 >> 11) as usize % n
    }
}

pub(crate) fn run(arguments: Vec<String>) -> ExitCode {
    let option = |name: &str| value_of(name, &arguments);
    let number = |name, otherwise: f64| -> f64 {
        let value = option(name).and_then(|v| v.parse().ok());
        value.unwrap_or(otherwise)
    };
    let Some(folder) = arguments.first() else {
        return crate::usage("damage");
    };
    let (seconds, megabytes) = (number("--seconds", 10.0), number("--mb", 3500.0));
    let mut files = scenes::below(Path::new(folder));
    if let Some(only) = option("--only") {
        files.retain(|f| f.to_string_lossy().contains(only.as_str()));
    }
    std::panic::set_hook(Box::new(|_| {})); // Panics are reported below, with the file.
    let mut tally = Tally::default();
    for file in &files {
        for (form, whole) in forms(file) {
            for seed in 0..number("--each", 8.0) as u64 {
                let bytes = damaged(whole.clone(), mix(seed ^ mix(whole.len() as u64)));
                let name = format!("{} {form} {seed}", file.display());
                tally.try_one(file, &name, bytes, seconds);
            }
        }
        if peak_megabytes() > megabytes {
            println!("{}: {:.0} MB", file.display(), peak_megabytes());
            tally.failed += 1;
            break;
        }
    }
    tally.print();
    ExitCode::from(u8::from(tally.failed > 0))
}

#[derive(Default)]
struct Tally {
    tried: usize,
    read: usize,
    failed: usize,
    total: f64,
    slowest: (f64, String),
}

impl Tally {
    fn try_one(&mut self, file: &Path, name: &str, bytes: Vec<u8>, seconds: f64) {
        let start = Instant::now();
        let result = catch_unwind(AssertUnwindSafe(|| use_up(file, bytes)));
        let spent = start.elapsed().as_secs_f64();
        self.tried += 1;
        self.total += spent;
        match result {
            Ok(read) => self.read += usize::from(read),
            Err(panic) => {
                let text = panic.downcast_ref::<String>().map(String::as_str);
                let text = text.or(panic.downcast_ref::<&str>().copied());
                println!("{name}: panic: {}", text.unwrap_or("?"));
                self.failed += 1;
            }
        }
        if spent > seconds {
            println!("{name}: {spent:.1} s");
            self.failed += 1;
        }
        if spent > self.slowest.0 {
            self.slowest = (spent, name.to_string());
        }
    }

    fn print(&self) {
        println!(
            "{} damaged documents, {} of them read; {} failed; {:.1} s, the slowest {:.2} s ({}); peak {:.0} MB",
            self.tried,
            self.read,
            self.failed,
            self.total,
            self.slowest.0,
            self.slowest.1,
            peak_megabytes()
        );
    }
}

/// Returns the forms of a file: the original, and as written in either format.
fn forms(file: &Path) -> Vec<(&'static str, Vec<u8>)> {
    let mut forms = Vec::new();
    forms.extend(std::fs::read(file).ok().map(|bytes| ("itself", bytes)));
    if let Ok(document) = Document::open(file) {
        forms.push(("ascii", document.write(Format::Ascii)));
        if !document.is_vrml97() {
            forms.push(("binary", document.write(Format::Binary)));
        }
    }
    forms.retain(|(_, bytes)| bytes.len() > 40);
    forms
}

/// Processes a document as the program does, and returns whether it could be read.
fn use_up(file: &Path, bytes: Vec<u8>) -> bool {
    let limits = Limits::default();
    let loader = Arc::new(FolderLoader::new(file, &[], limits.bytes));
    let Ok(document) = Document::read("damaged.iv", bytes, loader.clone(), &limits) else {
        return false;
    };
    let said: usize = document
        .sink
        .items()
        .iter()
        .map(|d| d.render(false).len())
        .sum();
    let options = CompileOptions::default();
    let snapshot = ivcam_render::scene::snapshot(&document, &SnapshotOptions::default(), &options);
    let survey = RenderScene::survey(&snapshot, &options);
    if let Ok(scene) = RenderScene::compile(&snapshot, &options) {
        let (min, max) = scene.bounds().unwrap_or((Vec3::ZERO, Vec3::ONE));
        for i in 0..64u8 {
            let at = min + (max - min) * Vec3::new(f32::from(i % 8), f32::from(i / 8), 0.0) / 8.0;
            let ray = Ray::new(at.with_z(max.z + 1.0), Vec3::new(1e-3, 0.0, -1.0));
            if let Some(hit) = scene.hit(&ray) {
                std::hint::black_box(scene.point(&ray, &hit).diffuse);
            }
        }
    }
    for format in [Format::Ascii, Format::Binary] {
        let written = document.write(format);
        let _ = Document::read("again.iv", written, loader.clone(), &limits);
    }
    std::hint::black_box((said, survey.triangles));
    true
}

/// Damages a file in one to four places after the header.
fn damaged(mut bytes: Vec<u8>, seed: u64) -> Vec<u8> {
    const HEADER: usize = 24;
    let mut dice = Dice(seed);
    for _ in 0..1 + dice.below(4) {
        if bytes.len() <= HEADER + 16 {
            break;
        }
        let body = bytes.len() - HEADER - 16;
        let at = HEADER + dice.below(body);
        match dice.below(8) {
            0 => bytes[at] ^= 1 << dice.below(8),
            1 => bytes.truncate(at),
            2 => swap_words(&mut bytes, at, HEADER + dice.below(body)),
            3 => huge(&mut bytes, at, &mut dice),
            4 => drop(bytes.drain(at..(at + 1 + dice.below(64)).min(bytes.len()))),
            5 => {
                let from = HEADER + dice.below(body);
                let end = (from + dice.below(4000)).min(bytes.len());
                let piece = bytes[from..end].to_vec();
                drop(bytes.splice(at..at, piece));
            }
            6 => bytes[at..at + 16].fill([0, 0xff, b'{', b'}', b'['][dice.below(5)]),
            _ => bytes[at] = dice.below(256) as u8,
        }
    }
    bytes
}

/// Returns the word that a byte is in.
fn word(bytes: &[u8], at: usize) -> std::ops::Range<usize> {
    let is_space = |b: &u8| b.is_ascii_whitespace();
    let start = bytes[..at].iter().rposition(is_space).map_or(0, |i| i + 1);
    let end = bytes[at..].iter().position(is_space);
    start.min(at)..end.map_or(bytes.len(), |n| at + n)
}

fn swap_words(bytes: &mut Vec<u8>, one: usize, other: usize) {
    let (a, b) = (word(bytes, one.min(other)), word(bytes, one.max(other)));
    if a.end > b.start || a.len() > 1000 || b.len() > 1000 || a.start < 24 {
        return;
    }
    let (first, second) = (bytes[a.clone()].to_vec(), bytes[b.clone()].to_vec());
    drop(bytes.splice(b, first));
    drop(bytes.splice(a, second));
}

/// Writes a number that is too large: as four bytes, like counts in binary files, or as a word.
fn huge(bytes: &mut Vec<u8>, at: usize, dice: &mut Dice) {
    const NUMBERS: [u32; 5] = [u32::MAX, 0x7fff_ffff, 0x4000_0000, 0x00ff_ffff, 0xffff_0000];
    let number = NUMBERS[dice.below(NUMBERS.len())];
    let text = bytes[24..].iter().take(400).all(|b| b.is_ascii());
    if !text {
        let at = at / 4 * 4 + dice.below(4);
        bytes[at..at + 4].copy_from_slice(&number.to_be_bytes());
        return;
    }
    let digits = bytes[at..].iter().position(u8::is_ascii_digit);
    let Some(start) = digits.map(|n| at + n) else {
        return;
    };
    let rest = bytes[start..].iter().position(|b| !b.is_ascii_digit());
    let end = rest.map_or(bytes.len(), |n| start + n);
    drop(bytes.splice(start..end, number.to_string().into_bytes()));
}

/// Returns the peak memory of the process, if the system provides it.
fn peak_megabytes() -> f64 {
    peak_kilobytes().unwrap_or(0) as f64 / 1e3
}
