//! A plan from words, and words, metadata and report from a plan.

use std::ffi::OsStr;
use std::path::Path;

use indexmap::IndexMap;

use super::lens::for_a_lens_alone;
use super::option::{Needs, Takes};
use super::table::all;
use super::words::Words;
use crate::diag::{Diagnostic, Result, Sink};
use crate::math::Meters;
use crate::photo::plan::{Era, LensChoice, Optics, Plan};

impl Plan {
    /// The plan that the words make of the one that `start` gives for an era. The words may name
    /// another era than `era`.
    ///
    /// # Errors
    /// A word that is not understood.
    pub fn from_words(
        words: &Words,
        era: Era,
        start: impl FnOnce(Era) -> Self,
        sink: &mut Sink,
    ) -> Result<Self> {
        let era = words.named("era", &Era::NAMES)?.unwrap_or(era);
        let mut plan = start(era);
        for (parse, _) in all().filter_map(|option| option.plan) {
            parse(&mut plan, words, sink)?;
        }
        let idle = match plan.optics {
            Optics::Lens(_) => None,
            Optics::Ideal(_) => idle_options(
                words,
                &[Needs::Prescription, Needs::Pupil],
                "with an ideal lens",
            ),
            Optics::Pinhole => idle_options(
                words,
                &[Needs::Lens, Needs::Prescription, Needs::Pupil],
                "without a lens",
            ),
        };
        if let Some(warning) = idle {
            sink.add(*warning);
        }
        Ok(plan)
    }

    /// The command line, word by word, that makes this plan's picture without a window. Options
    /// with the era's own values are left out.
    pub fn to_words(&self, output: &Path) -> Vec<String> {
        let usual = Self::of_era(self.era, &self.scene);
        let form = match self.era {
            Era::Vintage => "--batch",
            Era::Modern => "render",
        };
        let mut words = vec!["ivcam".to_owned(), form.to_owned()];
        for option in all() {
            let values = match option.plan {
                Some((_, print)) => print(self, &usual),
                None if option.name == "output" => vec![output.display().to_string()],
                None => Vec::new(),
            };
            let letter = option.vintage.filter(|old| old.len() == 1);
            let spelling = match (self.era, letter) {
                (Era::Vintage, Some(letter)) => format!("-{letter}"),
                _ => format!("--{}", option.name),
            };
            for value in values {
                match option.takes {
                    _ if value.is_empty() => words.push(spelling.clone()),
                    Takes::Maybe(_) => words.push(format!("{spelling}={value}")),
                    _ => words.extend([spelling.clone(), value]),
                }
            }
        }
        words.push(self.scene.display().to_string());
        words
    }

    /// The choices that make the picture what it is, for its metadata and the report.
    pub fn describe(&self) -> IndexMap<String, String> {
        all()
            .filter_map(|option| Some((option.name.to_owned(), option.describe?(self)?)))
            .collect()
    }
}

impl LensChoice {
    /// The lens of a name as the words change it, and the distance that it is to focus at.
    ///
    /// # Errors
    /// A word that is not understood.
    pub fn from_words(
        name: &str,
        words: &Words,
        sink: &mut Sink,
    ) -> Result<(Self, Option<Meters>)> {
        let mut plan = Plan::of_era(Era::Modern, "");
        plan.optics = Optics::Lens(Self::named(name));
        for (parse, _) in for_a_lens_alone().filter_map(|option| option.plan) {
            parse(&mut plan, words, sink)?;
        }
        let choice = plan.lens().cloned();
        Ok((choice.unwrap_or_else(|| Self::named(name)), plan.focus))
    }
}

/// A warning about the options given that have no effect, for lack of what they need.
pub(crate) fn idle_options(
    words: &Words,
    lacking: &[Needs],
    circumstance: &str,
) -> Option<Box<Diagnostic>> {
    let idle: Vec<String> = all()
        .filter(|option| lacking.contains(&option.needs) && words.has(option.name))
        .map(|option| format!("`--{}`", option.name))
        .collect();
    let (last, rest) = idle.split_last()?;
    let (list, verb) = match rest {
        [] => (last.clone(), "does"),
        _ => (format!("{} and {last}", rest.join(", ")), "do"),
    };
    Some(Diagnostic::warning(format!(
        "{circumstance}, {list} {verb} nothing"
    )))
}

/// A command line of these words, quoted where a shell would need it. The first word is the
/// program, by whatever name.
pub(crate) fn command_line<W: AsRef<OsStr>>(words: &[W]) -> String {
    let quote = |w: &W| {
        let w = w.as_ref().to_string_lossy();
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+@".contains(c);
        if !w.is_empty() && w.chars().all(plain) {
            w.into_owned()
        } else {
            format!("'{}'", w.replace('\'', "'\\''"))
        }
    };
    let rest = words.iter().skip(1).map(quote);
    std::iter::once("ivcam".to_owned())
        .chain(rest)
        .collect::<Vec<_>>()
        .join(" ")
}
