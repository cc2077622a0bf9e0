//! `--checkpoint`, `--every` and `--sample-range`, and what a signal does to a render.

use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;
#[cfg(not(target_family = "wasm"))]
use std::sync::atomic::AtomicBool;
use std::sync::atomic::AtomicUsize;
use std::time::Duration;

use clap::ArgMatches;
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::InputRecord;
use ivcam_base::work::StopSignal;
use ivcam_optics::film::Exposed;
use ivcam_render::render::units::{border_after, border_before, is_border, pieces};
use ivcam_render::render::{PicturePlace, Stopped, Sums};
#[cfg(not(target_family = "wasm"))]
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
#[cfg(not(target_family = "wasm"))]
use signal_hook::flag;

use super::{parsed, print_diagnostic, text};
use crate::photo::checkpoint::{Checkpoint, Label, Watch};
use crate::photo::options::duration;
use crate::photo::{Plan, Session};

/// The time between two checkpoints, unless `--every` says another.
const EVERY: Duration = Duration::from_secs(60);

/// Which samples a render makes, and where its state is kept.
pub(crate) struct Keeping {
    /// The file of the checkpoint.
    pub path: Option<PathBuf>,
    every: Duration,
    /// Whether it is not printed from where the render continues.
    quiet: bool,
    /// The files that the run reads, which a checkpoint names.
    record: InputRecord,
    /// The numbers of the samples, if they are a part.
    pub samples: Option<Range<u32>>,
}

impl Keeping {
    /// Reads the options.
    ///
    /// # Errors
    /// Returns an error if an option is invalid or lacks another.
    pub(super) fn of(m: &ArgMatches) -> Result<Self> {
        let path = text(m, "checkpoint").map(PathBuf::from);
        let expects = "a length of time such as 60s or 5m";
        let every = parsed(m, "every", expects, duration)?;
        let samples = parsed(m, "sample-range", "a range such as 64..128", range)?;
        for (option, is_given) in [
            ("every", every.is_some()),
            ("sample-range", samples.is_some()),
        ] {
            if is_given && path.is_none() {
                let error = format!("`--{option}` needs the file of `--checkpoint`");
                return Err(Diagnostic::error(error).with_help("add `--checkpoint FILE`"));
            }
        }
        Ok(Self {
            record: InputRecord::begin(),
            path,
            every: every.unwrap_or(EVERY),
            quiet: m.get_flag("quiet"),
            samples,
        })
    }

    /// Checks that a plan has the samples of the range.
    ///
    /// # Errors
    /// Returns an error if it does not, or if the range does not begin and end with units.
    pub(super) fn check(&self, plan: &Plan) -> Result<()> {
        let Some(Range { start, end }) = self.samples else {
            return Ok(());
        };
        let error =
            |text: String| Diagnostic::error(format!("`--sample-range {start}..{end}` {text}"));
        let all = plan.stop.samples;
        if start >= end {
            let what = if start > end {
                "goes backwards"
            } else {
                "is empty"
            };
            return Err(
                error(what.into()).with_help("it has the first sample and the one after the last")
            );
        }
        if plan.stop.error.is_some() || plan.stop.time.is_some() {
            let help = "leave `--target-error` and `--time` out: the parts need a fixed number";
            return Err(error("has a fixed number of samples".into()).with_help(help));
        }
        if end > all {
            let help = format!("`--samples {end}` has them");
            return Err(error(format!("ends after the {all} samples of a pixel")).with_help(help));
        }
        for (number, is_allowed) in [
            (start, is_border(start)),
            (end, is_border(end) || end == all),
        ] {
            if !is_allowed {
                let (before, after) = (border_before(number), border_after(number).min(all));
                return Err(
                    error(format!("cuts a unit of samples at {number}")).with_help(format!(
                        "the nearest numbers are {before} and {after}; units have 64 samples, from \
                     1024 on an eighth of a power of two"
                    )),
                );
            }
        }
        Ok(())
    }

    /// Takes the memory for the films of the units of a range that does not begin with the first
    /// sample.
    ///
    /// # Errors
    /// Returns an error if they do not fit.
    pub(super) fn take_memory(&self, session: &mut Session) -> Result<()> {
        let Some(samples) = self.samples.as_ref().filter(|range| range.start > 0) else {
            return Ok(());
        };
        let films = pieces(samples).count() as u64;
        let pixels = session.region().resolution().pixels() as u64;
        let what = format!("the films of {films} units of samples");
        let bytes = (films - 1) * pixels * size_of::<Exposed>() as u64;
        let help = "divide the samples into more ranges, or the picture by `--region`";
        session
            .memory
            .take(what, bytes)
            .map_err(|e| e.with_help(help))
    }

    /// Returns the sums of the checkpoint if there is one, and what keeps the new ones. From now on
    /// a signal stops the render, and a second one ends the program.
    ///
    /// # Errors
    /// Returns an error if the checkpoint cannot be read or is of another picture.
    pub(super) fn begin(&self, session: &Session) -> Result<(Option<Sums>, Watch)> {
        let mut sums = None;
        let file = match &self.path {
            None => None,
            Some(path) => {
                let label = session.label(&self.record.inputs());
                if path.exists() {
                    sums = Some(self.continued(path, &label, session)?);
                }
                Some((path.clone(), label, self.every))
            }
        };
        let signals = watch_signals(session.budget.stop())?;
        Ok((sums, Watch::new(file, signals, print_diagnostic)))
    }

    /// Reads the checkpoint from which the render continues.
    fn continued(&self, path: &std::path::Path, label: &Label, session: &Session) -> Result<Sums> {
        let there = Checkpoint::read(path)?;
        let mut differences = there.label.differences(label, ["there", "here"]);
        let place = &there.sums.place;
        let last = session.plan.stop.samples;
        let own = self.samples.clone().unwrap_or(0..last);
        let region = session.region();
        if place.region != region {
            differences.push(format!(
                "region is {} there and {region} here",
                place.region
            ));
        }
        if place.first != own.start {
            let first = place.first;
            differences.push(format!(
                "its samples begin with {first}, and these with {}",
                own.start
            ));
        }
        if place.end > own.end {
            let text = format!(
                "it has {} samples, and {} are asked for",
                place.end, own.end
            );
            differences.push(text);
        }
        if differences.is_empty() {
            if !self.quiet {
                super::status!("{}: {}", path.display(), where_it_is(place));
            }
            return Ok(there.sums);
        }
        let error = format!(
            "`{}` is a checkpoint of another picture: {}",
            path.display(),
            differences.join("; ")
        );
        let help = "give `--checkpoint` another name, or remove the file to begin again";
        let is_same = |name: &str| there.label.facts.get(name) == label.facts.get(name);
        let help = match is_same("arithmetic") {
            true => help.to_owned(),
            false => format!("{help}; `--arithmetic portable` makes processors agree"),
        };
        Err(Diagnostic::error(error).with_help(help))
    }

    /// Returns the warning for a render that a signal has stopped.
    pub(super) fn interrupted(&self, stopped: &Stopped, all: u32) -> Box<Diagnostic> {
        let text = format!("the render was interrupted: {}", stopped.describe(all));
        let help = match &self.path {
            Some(_) => "the same command continues it",
            None => "with `--checkpoint FILE` the same command would continue it",
        };
        Diagnostic::warning(text).with_help(help)
    }
}

/// Says what a checkpoint has.
fn where_it_is(place: &PicturePlace) -> String {
    let samples = format!(
        "continues after {} samples per pixel",
        place.done - place.first
    );
    match place.is_even() {
        true => samples,
        false => format!("{samples}, and some of {} more", place.end - place.done),
    }
}

/// Reads a range such as `64..128`.
fn range(word: &str) -> Option<Range<u32>> {
    let (start, end) = word.split_once("..")?;
    Some(start.parse().ok()?..end.parse().ok()?)
}

/// Returns a variable that the first SIGINT, SIGTERM or SIGHUP, which comes when a terminal closes,
/// sets to its number; it also ends the work of the scene. A second one ends the program at once. A
/// signal that the program was started to ignore, as behind `nohup` or `trap ''`, stays ignored.
#[cfg(not(target_family = "wasm"))]
fn watch_signals(stop: &StopSignal) -> Result<Arc<AtomicUsize>> {
    let number = Arc::new(AtomicUsize::new(0));
    let came = Arc::new(AtomicBool::new(false));
    let ignored = ignored_signals();
    let is_heard = |signal: &i32| ignored >> (signal - 1) & 1 == 0;
    for signal in [SIGINT, SIGTERM, SIGHUP].into_iter().filter(is_heard) {
        // The order matters: the first signal finds the flag unset, and then sets it.
        let registered = flag::register_conditional_shutdown(signal, 128 + signal, came.clone())
            .and_then(|_| flag::register(signal, came.clone()))
            .and_then(|_| flag::register(signal, stop.flag()))
            .and_then(|_| flag::register_usize(signal, number.clone(), signal as usize));
        registered.map_err(|e| Diagnostic::io("signals", &e))?;
    }
    Ok(number)
}

/// Returns the signals that the process ignores, as bits from signal 1 on; none where the system
/// has no `/proc`.
#[cfg(not(target_family = "wasm"))]
fn ignored_signals() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.unwrap_or_default()
}

/// Returns a variable that stays 0, because no signals come.
#[cfg(target_family = "wasm")]
fn watch_signals(_: &StopSignal) -> Result<Arc<AtomicUsize>> {
    Ok(Arc::default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photo::Era;

    #[test]
    fn a_range_of_samples_begins_and_ends_with_units() {
        let mut plan = Plan::of_era(Era::Modern, "a.iv");
        plan.stop.samples = 200;
        let check = |word: &str, plan: &Plan| {
            let keeping = Keeping {
                path: None,
                every: EVERY,
                quiet: false,
                record: InputRecord::default(),
                samples: range(word),
            };
            assert!(keeping.samples.is_some());
            keeping.check(plan).err().map(|e| e.message.clone())
        };
        for word in ["0..64", "64..192", "128..200", "0..200"] {
            assert_eq!(check(word, &plan), None);
        }
        for (word, text) in [
            ("64..0", "goes backwards"),
            ("64..64", "is empty"),
            ("0..256", "ends after the 200 samples"),
            ("0..100", "cuts a unit of samples at 100"),
            ("10..64", "cuts a unit of samples at 10"),
        ] {
            let error = check(word, &plan).unwrap_or_default();
            assert!(error.contains(text), "{error}");
        }
        plan.stop.error = Some(0.1);
        assert!(check("0..64", &plan).is_some());
        assert_eq!(range("5"), None);
        assert_eq!(range("-1..5"), None);
    }
}
