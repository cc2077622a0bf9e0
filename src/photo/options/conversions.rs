//! Converts given options to a plan, and a plan to arguments and to text for metadata.

use std::ffi::OsStr;
use std::path::Path;
#[cfg(feature = "panels")]
use std::path::PathBuf;

use indexmap::IndexMap;
use ivcam_base::diag::{Diagnostic, Result, Sink};
use ivcam_base::math::Meters;
use ivcam_optics::sampling::SamplerKind;
use ivcam_render::shade::Shading;

use super::given::GivenOptions;
use super::option::{Opt, OptionNeeds, Takes};
use super::scene::warn_of_late_actions;
use super::table::all;
use super::table::lens_options;
#[cfg(feature = "panels")]
use crate::photo::output_files::files_in;
use crate::photo::plan::{Era, LensChoice, Optics, PictureLook, Plan};

impl Plan {
    /// Creates a plan from the given options. `start` returns the plan to change for an era, which
    /// is `era` unless the options name another one. Options without effect give a warning.
    ///
    /// # Errors
    /// Returns an error if the value of an option is invalid.
    pub fn from_options(
        words: &GivenOptions,
        era: Era,
        start: impl FnOnce(Era) -> Self,
        sink: &mut Sink,
    ) -> Result<Self> {
        let era = words.named("era", &Era::NAMES)?.unwrap_or(era);
        let mut plan = start(era);
        if let Some(look) = words.named("look", &PictureLook::NAMES)? {
            look.choose(&mut plan);
        }
        for (parse, _) in all().filter_map(|option| option.plan) {
            parse(&mut plan, words, sink)?;
        }
        check_equal_samples(&plan, words, sink)?;
        // The frames of a movie may have later times.
        if words.frame.is_none() {
            warn_of_late_actions(&plan.actions, plan.time, sink);
        }
        let (lacking, circumstance, help) = lacking_by_optics(&plan);
        let by_optics = idle_options(words, lacking, circumstance, help);
        let circumstance = format!("with model {}", plan.shading.name());
        let by_model = lacking_by_model(plan.shading)
            .filter_map(|(lacking, help)| idle_options(words, &[lacking], &circumstance, help));
        for warning in by_optics.into_iter().chain(by_model) {
            sink.add(*warning);
        }
        Ok(plan)
    }

    /// Returns the arguments of the command line that renders this plan without a window. Options
    /// with the era's default values are left out.
    pub fn to_args(&self, output: &Path) -> Vec<String> {
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
            words.extend(spelled(option, &spelling, values));
        }
        words.push(self.scene.display().to_string());
        words
    }

    /// Returns the words after `ivcam lens` for the lens of this plan at its focal length, aperture
    /// and focus. Returns none without a prescription.
    pub fn to_lens_args(&self) -> Option<Vec<String>> {
        let usual = Self::of_era(self.era, &self.scene);
        let mut words = vec![self.lens()?.name.clone()];
        for option in lens_options() {
            let values = option.plan.map(|(_, print)| print(self, &usual));
            let spelling = format!("--{}", option.name);
            words.extend(spelled(option, &spelling, values.unwrap_or_default()));
        }
        Some(words)
    }

    /// Returns the existing files that the plan names: the scene, and values of options, whatever
    /// they mean by it.
    #[cfg(feature = "panels")]
    pub(crate) fn named_files(&self) -> Vec<PathBuf> {
        let usual = Self::of_era(self.era, &self.scene);
        let prints = all().filter_map(|option| option.plan);
        let values = prints.flat_map(|(_, print)| print(self, &usual));
        let named = values.map(PathBuf::from).chain([self.scene.clone()]);
        named.flat_map(|value| files_in(&value)).collect()
    }

    /// Returns the options whose values differ from the era's defaults, with their values.
    pub(crate) fn given(&self) -> IndexMap<String, String> {
        let usual = Self::of_era(self.era, &self.scene);
        let mut given = IndexMap::from([("era".to_owned(), self.era.name().to_owned())]);
        for option in all() {
            let values = option.plan.map(|(_, print)| print(self, &usual));
            if let Some(values) = values.filter(|values| !values.is_empty()) {
                given.insert(option.name.to_owned(), values.join(" "));
            }
        }
        given
    }

    /// Returns the choices that determine the picture, for its metadata and the report.
    pub fn describe(&self) -> IndexMap<String, String> {
        all()
            .filter_map(|option| Some((option.name.to_owned(), option.describe?(self)?)))
            .collect()
    }
}

impl LensChoice {
    /// Creates the choice of a lens from its name and the given options. Returns it with the
    /// distance to focus at.
    ///
    /// # Errors
    /// Returns an error if the value of an option is invalid.
    pub fn from_options(
        name: &str,
        words: &GivenOptions,
        sink: &mut Sink,
    ) -> Result<(Self, Option<Meters>)> {
        let mut plan = Plan::of_era(Era::Modern, "");
        plan.optics = Optics::Lens(Self::named(name));
        for (parse, _) in lens_options().filter_map(|option| option.plan) {
            parse(&mut plan, words, sink)?;
        }
        let choice = plan.lens().cloned();
        Ok((choice.unwrap_or_else(|| Self::named(name)), plan.focus))
    }
}

/// Returns the words of an option with its values, which are empty for a switch.
fn spelled(option: &Opt, spelling: &str, values: Vec<String>) -> Vec<String> {
    let words = values.into_iter().flat_map(|value| match option.takes {
        _ if value.is_empty() => vec![spelling.to_owned()],
        Takes::Maybe(..) => vec![format!("{spelling}={value}")],
        _ if reads_as_option(&value) => vec![format!("{spelling}={value}")],
        _ => vec![spelling.to_owned(), value],
    });
    words.collect()
}

/// Refuses `--target-error` where all samples of a pixel are the same ray, which have no noise to
/// measure, and warns of samples that only repeat the first. By model `i` each has a random path,
/// and with an open shutter other moments.
fn check_equal_samples(plan: &Plan, words: &GivenOptions, sink: &mut Sink) -> Result<()> {
    let is_open = words.frame.is_some_and(|frame| frame.open > 0.0);
    let are_equal = plan.sampler == SamplerKind::Center
        && plan.optics == Optics::Pinhole
        && plan.shading != Shading::Path
        && !is_open;
    if !are_equal || plan.stop.samples == 1 {
        return Ok(());
    }
    let text = "without a lens, all samples of a pixel by `--sampler center` are equal";
    let help = "`--samples 1` alone makes the same picture";
    if plan.stop.error.is_some() {
        let error = format!("{text}, so `--target-error` has no noise to measure");
        return Err(Diagnostic::unsupported(error).with_help(help));
    }
    sink.add(*Diagnostic::warning(format!("{text}: one is enough")).with_help(help));
    Ok(())
}

/// Returns the requirements of options that a plan's lens does not meet, with the words that
/// describe why, and what to do.
fn lacking_by_optics(plan: &Plan) -> (&'static [OptionNeeds], &'static str, &'static str) {
    use OptionNeeds::{Lens, Pinhole, Prescription, Pupil, Traced};
    const A_LENS: &str = "leave it out, or name a lens, such as `--lens double-gauss`";
    match plan.optics {
        Optics::Lens(_) if plan.solids => (
            &[Traced, Pinhole],
            "with the lens as solids",
            "leave it out, or `--solids`",
        ),
        Optics::Lens(_) => (
            &[Pinhole],
            "with a lens",
            "leave it out, or give `--lens none`",
        ),
        Optics::Ideal(_) => (
            &[Pinhole, Prescription, Traced, Pupil],
            "with an ideal lens",
            A_LENS,
        ),
        Optics::Pinhole => (
            &[Lens, Prescription, Traced, Pupil],
            "without a lens",
            A_LENS,
        ),
    }
}

/// Returns the requirements of options that a shading model does not meet, each with what to do.
fn lacking_by_model(shading: Shading) -> impl Iterator<Item = (OptionNeeds, &'static str)> {
    let needs = shading.needs();
    let lacking = [
        (
            shading != Shading::Path,
            OptionNeeds::Path,
            "`--shading path` uses such options",
        ),
        (
            !needs.secondary,
            OptionNeeds::Reflections,
            "`--shading recursive` and `--shading path` follow light from surface to surface",
        ),
        (
            !needs.lights,
            OptionNeeds::Lights,
            "leave it out, or give a model with lights, such as `--shading phong`",
        ),
        (
            !needs.textures,
            OptionNeeds::Textures,
            "leave it out, or give a model with textures, such as `--shading flat`",
        ),
    ];
    let lacking = lacking.into_iter().filter(|(is_lacking, ..)| *is_lacking);
    lacking.map(|(_, lacking, help)| (lacking, help))
}

/// Returns a warning about given options that have no effect, because a requirement in `lacking` is
/// not met. `circumstance` describes why, and `help` says what to do.
pub(crate) fn idle_options(
    words: &GivenOptions,
    lacking: &[OptionNeeds],
    circumstance: &str,
    help: &'static str,
) -> Option<Box<Diagnostic>> {
    let idle: Vec<String> = all()
        .filter(|option| lacking.contains(&option.needs) && words.has(option.name))
        // What is turned off has no effect anywhere.
        .filter(|option| words.text(option.name) != Some("off"))
        .map(|option| format!("`--{}`", option.name))
        .collect();
    let (last, rest) = idle.split_last()?;
    let (list, verb) = match rest {
        [] => (last.clone(), "does"),
        _ => (format!("{} and {last}", rest.join(", ")), "do"),
    };
    let warning = Diagnostic::warning(format!("{circumstance}, {list} {verb} nothing"));
    Some(warning.with_help(help))
}

/// Returns a command line of these arguments, quoted for a shell. The first argument, the program's
/// name, becomes `ivcam`.
pub fn command_line<W: AsRef<OsStr>>(words: &[W]) -> String {
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

/// Returns whether a word that follows an option would be read as another option: it begins with a
/// hyphen and is no negative number.
fn reads_as_option(value: &str) -> bool {
    let rest = value.strip_prefix('-');
    rest.is_some_and(|rest| !rest.starts_with(|c: char| c.is_ascii_digit() || c == '.'))
}
