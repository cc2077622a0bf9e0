//! Measures how often the stated 95% interval of a picture's error holds its true error, and how
//! often a picture that `--target-error` ended meets the target.
//!
//! `cargo run --release -p measure -- coverage [--seeds N] [--size WxH]
//! [--only SCENE] [--samples LIST] [--truth N] [--no-targets] [--markdown] [--path]
//! [--scenes FILE,...]`
//!
//! The true error of a picture is its relative RMSE against a picture of many more samples with
//! another seed, which adaptive sampling distributes. The squared error of that picture is
//! subtracted, as far as it is known. A cell is the percentage of held intervals or met targets,
//! and their number of the number of pictures whose error is stated or which a target ended.
//! `--path` measures the scenes of model `path`, and `--scenes` those of files, through the double
//! Gauss lens.

mod light_scenes;
mod scenes;

use std::path::PathBuf;
use std::process::ExitCode;

use ivcam::movie::expose_moments;
use ivcam::photo::{Plan, Session};
use ivcam_base::diag::Result;
use ivcam_optics::film::{ErrorEstimate, ErrorUnknown, Resolution};
use ivcam_optics::sampling::{Sampler, mix};
use ivcam_render::render::report::deviation::Deviation;
use ivcam_render::render::report::percent;
use ivcam_render::render::{Exposure, Stop};
use rayon::prelude::*;

use self::scenes::{CASES, Case};

/// Targets of `--target-error`.
const TARGETS: [f64; 3] = [0.01, 0.03, 0.1];

/// What is measured.
struct Options {
    seeds: u64,
    size: Resolution,
    only: Option<String>,
    samples: Vec<u32>,
    /// Samples per pixel of the truth.
    truth: u32,
    /// The largest number of samples per pixel of a picture with a target.
    limit: u32,
    targets: bool,
    markdown: bool,
    /// Whether the scenes are those of model `path`.
    path: bool,
    /// The files of scenes to measure instead.
    scenes: Vec<PathBuf>,
    /// Whether each row has the median ratios of the estimate and of the interval's ends.
    detail: bool,
}

impl Options {
    fn parse(words: &[String]) -> Option<Self> {
        let mut options = Self {
            seeds: 200,
            size: Resolution::of(48, 32),
            only: None,
            samples: vec![4, 8, 16, 64],
            truth: 4096,
            limit: 1024,
            targets: true,
            markdown: false,
            path: false,
            scenes: Vec::new(),
            detail: false,
        };
        let mut words = words.iter();
        while let Some(word) = words.next() {
            match word.as_str() {
                "--seeds" => options.seeds = words.next()?.parse().ok().filter(|n| *n > 0)?,
                "--only" => options.only = Some(words.next()?.clone()),
                "--truth" => options.truth = words.next()?.parse().ok().filter(|n| *n > 1)?,
                "--limit" => options.limit = words.next()?.parse().ok().filter(|n| *n > 3)?,
                "--samples" => {
                    let list = words.next()?.split(',').map(|n| n.parse().ok());
                    options.samples = list.collect::<Option<Vec<u32>>>()?;
                }
                "--size" => {
                    let (width, height) = words.next()?.split_once('x')?;
                    options.size = Resolution::of(
                        width.parse().ok().filter(|n| *n > 0)?,
                        height.parse().ok().filter(|n| *n > 0)?,
                    );
                }
                "--scenes" => {
                    options.scenes = words.next()?.split(',').map(PathBuf::from).collect();
                }
                "--no-targets" => options.targets = false,
                "--markdown" => options.markdown = true,
                "--path" => options.path = true,
                "--detail" => options.detail = true,
                _ => return None,
            }
        }
        Some(options)
    }
}

pub(crate) fn run(words: Vec<String>) -> ExitCode {
    let Some(options) = Options::parse(&words) else {
        return crate::usage("coverage");
    };
    let folder = std::env::temp_dir().join(format!("ivcam-coverage-{}", std::process::id()));
    let made = std::fs::create_dir_all(&folder).map_err(|e| e.to_string());
    let done = made.and_then(|()| table(&options, &folder));
    let _ = std::fs::remove_dir_all(&folder);
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

/// Prints the table, a row for each scene.
fn table(options: &Options, folder: &std::path::Path) -> std::result::Result<(), String> {
    let mut head = vec!["scene".to_owned(), "truth".into()];
    for how in ["even", "adaptive"] {
        head.extend(options.samples.iter().map(|n| format!("{how} {n}")));
    }
    if options.targets {
        for how in ["even", "adaptive"] {
            head.extend(TARGETS.map(|t| format!("{how} to {}", percent(t, 1))));
        }
    }
    print_row(&head, options.markdown);
    if options.markdown {
        print_row(&vec!["---".to_owned(); head.len()], true);
    }
    let given = options.scenes.iter().map(|file| Case::of_file(file));
    let cases: Vec<Case<'_>> = match (options.path, options.scenes.is_empty()) {
        (_, false) => given.collect(),
        (true, true) => light_scenes::CASES.into(),
        (false, true) => CASES.into(),
    };
    for case in &cases {
        if options.only.as_ref().is_none_or(|o| case.name.contains(o)) {
            let plans = case.plans(folder).map_err(|e| e.to_string())?;
            let row = row(case, plans, options).map_err(|e| e.message.clone())?;
            print_row(&row, options.markdown);
        }
    }
    Ok(())
}

fn print_row(cells: &[String], markdown: bool) {
    if markdown {
        println!("| {} |", cells.join(" | "));
    } else {
        let padded: Vec<String> = cells.iter().map(|c| format!("{c:<20}")).collect();
        println!("{}", padded.concat().trim_end());
    }
}

/// A scene that is ready to be exposed: a session for each moment.
struct Subject(Vec<Session>);

impl Subject {
    fn open(plans: Vec<Plan>, size: Resolution, adaptive: bool) -> Result<Self> {
        let open = |mut plan: Plan| {
            plan.resolution = size;
            plan.adaptive = adaptive;
            // The lenses of the table may see less than the cameras of the scenes, with a warning.
            Session::open(plan)
        };
        plans.into_iter().map(open).collect::<Result<_>>().map(Self)
    }

    /// Exposes the film once, at all moments, as a movie's frame is.
    fn expose(&self, seed: u64, stop: Stop) -> Option<Exposure> {
        let exposure = expose_moments(self.0.len() as u32, stop, &mut |i, stop| {
            let session = &self.0[i as usize];
            let sampler = Sampler {
                samples: stop.samples,
                seed: mix(seed).wrapping_add(u64::from(i) * 0x9e37_79b9),
                ..session.plan.pixel_sampler()
            };
            Ok(session.expose_with(sampler, stop, &|_| ()))
        });
        exposure.ok()
    }
}

/// The outcome of one picture.
struct Outcome {
    /// The true relative RMSE.
    truth: f64,
    /// The stated one and the ends of its interval; `None` if it is unknown.
    stated: Option<[f64; 3]>,
    samples: u32,
}

impl Outcome {
    fn holds(&self) -> Option<bool> {
        self.stated
            .map(|[_, low, high]| (low..=high).contains(&self.truth))
    }
}

/// A picture of many samples, to which others are compared.
struct Truth {
    pixels: Vec<[f64; 3]>,
    error: std::result::Result<ErrorEstimate, ErrorUnknown>,
}

impl Truth {
    fn expose(subject: &Subject, samples: u32) -> Option<Self> {
        let film = subject.expose(u64::MAX, Stop::after(samples))?.film;
        Some(Self {
            pixels: film.pixels.iter().map(|p| p.mean.to_array()).collect(),
            error: film.error(),
        })
    }
}

/// Exposes pictures with many seeds.
fn outcomes(subject: &Subject, truth: &Truth, seeds: u64, stop: Stop) -> Vec<Outcome> {
    let one = |seed: u64| {
        let made = subject.expose(seed, stop)?;
        let stated = made.film.error();
        let squared = Deviation::of(&made.film, &truth.pixels).rel_mse;
        let own = truth.error.map_or(0.0, |e| e.relative_rmse.powi(2));
        Some(Outcome {
            truth: (squared - own).max(0.0).sqrt(),
            stated: stated.ok().map(|e| [e.relative_rmse, e.low, e.high]),
            samples: made.samples,
        })
    };
    (0..seeds).into_par_iter().filter_map(one).collect()
}

/// Returns the cells of one scene.
fn row(case: &Case<'_>, plans: Vec<Plan>, options: &Options) -> Result<Vec<String>> {
    let even = Subject::open(plans.clone(), options.size, false)?;
    let adaptive = Subject::open(plans, options.size, true)?;
    let samples = options.truth.saturating_mul(case.truth);
    let Some(truth) = Truth::expose(&adaptive, samples) else {
        return Ok(vec![case.name.to_owned()]);
    };
    let mut cells = vec![
        case.name.to_owned(),
        truth
            .error
            .map_or_else(|e| e.to_string(), |e| percent(e.relative_rmse, 2)),
    ];
    for subject in [&even, &adaptive] {
        for samples in &options.samples {
            let all = outcomes(subject, &truth, options.seeds, Stop::after(*samples));
            cells.push(coverage_cell(&all, options.detail));
        }
    }
    if options.targets {
        for subject in [&even, &adaptive] {
            for target in TARGETS {
                let stop = Stop {
                    error: Some(target),
                    ..Stop::after(options.limit)
                };
                let all = outcomes(subject, &truth, options.seeds, stop);
                cells.push(target_cell(&all, target, options.limit));
            }
        }
    }
    Ok(cells)
}

/// Formats how many of the stated intervals hold the truth, of how many whose error is known.
fn coverage_cell(all: &[Outcome], detail: bool) -> String {
    let known: Vec<bool> = all.iter().filter_map(Outcome::holds).collect();
    let held = known.iter().filter(|held| **held).count();
    let mut text = part_of(held, known.len());
    if detail {
        let median = |of: &dyn Fn(&Outcome) -> Option<f64>| {
            let mut values: Vec<f64> = all.iter().filter_map(of).collect();
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
        };
        let ratio = |i: usize| median(&|o| o.stated.map(|s| s[i] / o.truth));
        let count = |of: &dyn Fn(&Outcome, [f64; 3]) -> bool| {
            let mut stated = all.iter().filter_map(|o| o.stated.map(|s| of(o, s)));
            stated.by_ref().filter(|yes| *yes).count()
        };
        let below = count(&|o, [_, low, _]| o.truth < low);
        let above = count(&|o, [_, _, high]| o.truth > high);
        text += &format!(
            " {:.2}<{:.2}<{:.2} {below} below, {above} above",
            ratio(1),
            ratio(0),
            ratio(2)
        );
    }
    text
}

/// Formats how many pictures meet the target, of how many that the target ended before the limit of
/// samples.
fn target_cell(all: &[Outcome], target: f64, limit: u32) -> String {
    let ended: Vec<&Outcome> = all.iter().filter(|o| o.samples < limit).collect();
    let met = ended.iter().filter(|o| o.truth <= target).count();
    part_of(met, ended.len())
}

/// Formats a part as a percentage and as two numbers.
fn part_of(part: usize, all: usize) -> String {
    match all {
        0 => "0/0".to_owned(),
        _ => format!("{:.0}% {part}/{all}", 100.0 * part as f64 / all as f64),
    }
}
