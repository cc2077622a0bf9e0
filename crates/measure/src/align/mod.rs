//! `measure align`: synthetic scans whose place is known, against what `compare --align` finds, and
//! pairs of different pictures, which it has to refuse.

mod scans;

use std::process::ExitCode;

use glam::DVec2;
use ivcam::compare::{Alignment, Options, Plate, Registration, compare};
use rayon::prelude::*;

use scans::{Border, Resampler, Scan, ScanPlace, ScanRandom, divisible, reduced};

/// The longer side of the new pictures, in pixels, at least, if `--size` does not say it.
const LEAST: usize = 240;
/// The longer side, in pixels, of what a picture is reduced from, at most.
const FINEST: usize = 720;

/// A new picture and the larger one that it was reduced from.
struct ScanSubject {
    name: String,
    source: Plate,
    fine: usize,
    new: Plate,
}

/// A scan and what was found.
struct Trial {
    scan: Scan,
    name: String,
    found: Result<FoundPlace, String>,
}

struct FoundPlace {
    alignment: Alignment,
    /// The errors of shift along x and y, scale and rotation, in their stated standard errors.
    sigmas: [f64; 4],
    /// The largest error at a corner of the new picture, in its pixels.
    corner: f64,
}

pub(super) fn run(arguments: Vec<String>) -> ExitCode {
    let (mut each, mut unrelated, mut least) = (30, 600, LEAST);
    let mut rows = false;
    let mut files = Vec::new();
    let mut words = arguments.into_iter();
    while let Some(word) = words.next() {
        match word.as_str() {
            "--scans" => each = number(words.next(), each),
            "--unrelated" => unrelated = number(words.next(), unrelated),
            "--size" => least = number(words.next(), least).clamp(16, FINEST),
            "--rows" => rows = true,
            _ => files.push(word),
        }
    }
    let mut subjects = Vec::new();
    for file in &files {
        match Plate::open(file) {
            Ok(source) => subjects.push(ScanSubject::new(file, &source, least)),
            Err(error) => {
                eprintln!("{error}");
                return ExitCode::from(2);
            }
        }
    }
    if subjects.len() < 2 {
        return crate::usage("align");
    }
    let trials: Vec<Trial> = (0..subjects.len() * each)
        .into_par_iter()
        .map(|i| trial(&subjects[i % subjects.len()], i / subjects.len(), i))
        .collect();
    if rows {
        trials.iter().for_each(print_row);
    }
    print_table(&trials);
    print_unrelated(&subjects, unrelated);
    ExitCode::SUCCESS
}

/// Returns a number of the command line, or the usual one if it is none.
fn number(word: Option<String>, usual: usize) -> usize {
    word.and_then(|n| n.parse().ok()).unwrap_or(usual)
}

impl ScanSubject {
    fn new(file: &str, source: &Plate, least: usize) -> Self {
        let fine = (source.width.max(source.height) / least).clamp(1, FINEST / least);
        let source = divisible(source, fine);
        let name = std::path::Path::new(file).file_stem();
        Self {
            name: name.unwrap_or_default().to_string_lossy().into_owned(),
            new: reduced(&source, fine),
            source,
            fine,
        }
    }

    /// Makes a scan by random numbers. Every other number has a border.
    fn scan(&self, number: usize, seed: usize) -> (Scan, Plate) {
        let mut random = ScanRandom(seed as u64);
        let border = match number % 2 {
            0 => Border::None,
            _ => Border::ALL[1 + random.below(Border::ALL.len() - 1)],
        };
        let resampler = Resampler::ALL[random.below(Resampler::ALL.len())];
        let size = (self.new.width, self.new.height);
        let scan = Scan::random(size, border, resampler, &mut random);
        let old = scan.make(&self.source, self.fine as f64, &mut random);
        (scan, old)
    }
}

/// Returns the options of `compare --align`.
fn options() -> Options {
    Options {
        registration: Registration::Align,
        ..Options::default()
    }
}

fn trial(subject: &ScanSubject, number: usize, seed: usize) -> Trial {
    let (scan, old) = subject.scan(number, seed);
    let found = compare(&subject.new, &old, &options()).map_err(|e| e.to_string());
    let found = found.and_then(|c| c.alignment.ok_or_else(|| "no alignment".to_owned()));
    Trial {
        name: subject.name.clone(),
        found: found.map(|a| FoundPlace::of(a, scan.place, &subject.new)),
        scan,
    }
}

impl FoundPlace {
    fn of(alignment: Alignment, truth: ScanPlace, new: &Plate) -> Self {
        let found = ScanPlace {
            turn: alignment.rotation.to_radians(),
            scale: alignment.scale,
            shift: DVec2::from(alignment.shift),
        };
        let half = 0.5 * DVec2::new(new.width as f64, new.height as f64);
        let across = DVec2::new(half.x, -half.y);
        let corners = [half, -half, across, -across];
        let off = |c: &DVec2| {
            let there = found.apply(truth.inverse(*c));
            if alignment.mirrored {
                f64::INFINITY
            } else {
                there.distance(*c)
            }
        };
        let turn = (alignment.rotation - truth.turn.to_degrees() + 180.0).rem_euclid(360.0) - 180.0;
        let shift = (found.shift - truth.shift) / alignment.shift_error;
        Self {
            sigmas: [
                shift.x,
                shift.y,
                (found.scale - truth.scale) / alignment.scale_error,
                turn / alignment.rotation_error,
            ],
            corner: corners.iter().map(off).fold(0.0, f64::max),
            alignment,
        }
    }

    /// Returns whether every corner is within a pixel and a half of its place.
    fn is_right(&self) -> bool {
        self.corner < 1.5
    }
}

fn print_row(trial: &Trial) {
    let s = &trial.scan;
    let made = format!(
        "{} {:?} {:?} scale {:.4} turn {:+.2} gamma {:.2} last {} noise {:.3} grain {:.3} blur {:.2} jpeg {:?}",
        trial.name,
        s.border,
        s.resampler,
        s.place.scale,
        s.place.turn.to_degrees(),
        s.gamma,
        s.is_curved_last,
        s.noise,
        s.grain,
        s.blur,
        s.jpeg
    );
    match &trial.found {
        Ok(f) => println!(
            "{made}: corner {:.3} px, sigmas {:+.1} {:+.1} {:+.1} {:+.1}, errors {:.3} {:.5} {:.4}, chance {:.0e}, {}x{}, {:?}",
            f.corner,
            f.sigmas[0],
            f.sigmas[1],
            f.sigmas[2],
            f.sigmas[3],
            f.alignment.shift_error,
            f.alignment.scale_error,
            f.alignment.rotation_error,
            f.alignment.chance,
            s.size.0,
            s.size.1,
            f.alignment
                .photograph
                .map(|p| (p.left, p.top, p.width, p.height)),
        ),
        Err(why) => println!("{made}: {}", why.lines().next().unwrap_or_default()),
    }
}

fn print_table(trials: &[Trial]) {
    println!(
        "| scans | number | accepted | right | shift within 2σ | scale | rotation | corner, median | 95% |\n\
         |---|---|---|---|---|---|---|---|---|"
    );
    let row = |name: &str, of: &dyn Fn(&Trial) -> bool| {
        let chosen: Vec<&Trial> = trials.iter().filter(|t| of(t)).collect();
        let found: Vec<&FoundPlace> = chosen
            .iter()
            .filter_map(|t| t.found.as_ref().ok())
            .collect();
        let right: Vec<&&FoundPlace> = found.iter().filter(|f| f.is_right()).collect();
        if right.is_empty() {
            return;
        }
        let within = |which: &[usize]| {
            let all = right
                .iter()
                .flat_map(|f| which.iter().map(|i| f.sigmas[*i]));
            let near = all.filter(|s| s.abs() <= 2.0).count();
            100.0 * near as f64 / (which.len() * right.len()) as f64
        };
        let mut corners: Vec<f64> = right.iter().map(|f| f.corner).collect();
        corners.sort_by(f64::total_cmp);
        println!(
            "| {name} | {} | {} | {} | {:.0}% | {:.0}% | {:.0}% | {:.3} px | {:.3} px |",
            chosen.len(),
            found.len(),
            right.len(),
            within(&[0, 1]),
            within(&[2]),
            within(&[3]),
            corners[corners.len() / 2],
            corners[corners.len() * 95 / 100],
        );
    };
    row("all", &|_| true);
    row("without a border", &|t| t.scan.border == Border::None);
    row("with a border", &|t| t.scan.border != Border::None);
    for border in &Border::ALL[1..] {
        row(&format!("{border:?}").to_lowercase(), &|t| {
            t.scan.border == *border
        });
    }
    for resampler in Resampler::ALL {
        row(&format!("{resampler:?}").to_lowercase(), &|t| {
            t.scan.resampler == resampler
        });
    }
    row("curve before the blur", &|t| !t.scan.is_curved_last);
    row("curve after the blur", &|t| t.scan.is_curved_last);
    row("no JPEG", &|t| t.scan.jpeg.is_none());
    row("JPEG below 70", &|t| t.scan.jpeg.is_some_and(|q| q < 70));
}

/// Aligns scans of other pictures, and prints how many are accepted.
fn print_unrelated(subjects: &[ScanSubject], pairs: usize) {
    let count = subjects.len();
    let accepted: Vec<String> = (0..pairs)
        .into_par_iter()
        .filter_map(|i| {
            let new = i % count;
            let other = (new + 1 + i / count % (count - 1)) % count;
            let (scan, old) = subjects[other].scan(i / count, i);
            let found = compare(&subjects[new].new, &old, &options()).ok()?;
            let chance = found.alignment.map_or(1.0, |a| a.chance);
            let (new, old) = (&subjects[new].name, &subjects[other].name);
            Some(format!("{new} and {old}, {:?}: {chance:.0e}", scan.border))
        })
        .collect();
    println!("\nunrelated pairs: {pairs}, accepted {}", accepted.len());
    accepted.iter().for_each(|line| println!("  {line}"));
}
