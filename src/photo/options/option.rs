//! The entry of one option in the table.

use ivcam_base::diag::{Result, Sink};

use super::given::GivenOptions;
use crate::photo::plan::Plan;

/// Changes a plan by an option. It is called in the order of the table, whether the option was
/// given or not.
pub(super) type Parse = fn(&mut Plan, &GivenOptions, &mut Sink) -> Result<()>;

/// Returns the values of an option with which a plan differs from `usual`, the era's defaults. An
/// empty string is an option without a value.
pub(super) type Print = fn(plan: &Plan, usual: &Plan) -> Vec<String>;

/// Returns the text of an option for the metadata and the report, if it has one.
pub(super) type Describe = fn(&Plan) -> Option<String>;

/// The kind of value that an option has. The first text is the value's name in the help.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Takes {
    /// No value.
    Nothing,
    /// One value.
    One(&'static str),
    /// An optional value, written `--option=VALUE`, and the value without one.
    Maybe(&'static str, &'static str),
    /// One value; the option may be repeated.
    Many(&'static str),
}

/// The requirement without which an option has no effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum OptionNeeds {
    /// No requirement.
    Nothing,
    /// The lens belongs to the camera and is not part of the scene as solids.
    Camera,
    /// The camera is the scene's own pinhole.
    Pinhole,
    /// The camera has a lens, which may be the ideal one.
    Lens,
    /// The camera has a lens with a prescription.
    Prescription,
    /// The camera has a lens with a prescription, whose rays it traces itself: the lens is not part
    /// of the scene as solids.
    Traced,
    /// A lens with a prescription is sampled, in the camera or as solids.
    Pupil,
    /// The shading model draws lights.
    Lights,
    /// The shading model draws textures.
    Textures,
    /// The shading model follows rays from surface to surface.
    Reflections,
    /// The shading model is path tracing.
    Path,
}

/// An option.
pub struct Opt {
    /// The name, which is also today's long spelling.
    pub name: &'static str,
    /// The spelling of 1999 without its dash. A single letter is also today's short spelling.
    pub(crate) vintage: Option<&'static str>,
    /// Other long spellings of today.
    pub aliases: &'static [&'static str],
    /// The kind of value.
    pub takes: Takes,
    /// The line in the help, with the default in brackets.
    pub help: &'static str,
    /// The requirement without which the option has no effect.
    pub(crate) needs: OptionNeeds,
    /// The functions that change a plan by the option and write a plan's value. Options about the
    /// output have none.
    pub(crate) plan: Option<(Parse, Print)>,
    /// The function that describes a plan's value in the metadata and the report.
    pub(crate) describe: Option<Describe>,
    /// Command lines that use the option, for the test of the table.
    pub examples: &'static [&'static str],
}

impl Opt {
    /// Creates an option with only a name, a kind of value and a help line.
    pub(crate) const fn new(name: &'static str, takes: Takes, help: &'static str) -> Self {
        Self {
            name,
            vintage: None,
            aliases: &[],
            takes,
            help,
            needs: OptionNeeds::Nothing,
            plan: None,
            describe: None,
            examples: &[],
        }
    }

    /// Sets the spelling of 1999.
    pub(crate) const fn vintage(mut self, old: &'static str) -> Self {
        self.vintage = Some(old);
        self
    }

    /// Sets other long spellings.
    pub(crate) const fn aliases(mut self, aliases: &'static [&'static str]) -> Self {
        self.aliases = aliases;
        self
    }

    /// Sets the requirement.
    pub(crate) const fn needs(mut self, needs: OptionNeeds) -> Self {
        self.needs = needs;
        self
    }

    /// Sets the functions that change a plan and write its value.
    pub(crate) const fn plan(mut self, parse: Parse, print: Print) -> Self {
        self.plan = Some((parse, print));
        self
    }

    /// Sets the function that describes a plan's value.
    pub(crate) const fn describe(mut self, describe: Describe) -> Self {
        self.describe = Some(describe);
        self
    }

    /// Sets the example command lines.
    pub(crate) const fn examples(mut self, lines: &'static [&'static str]) -> Self {
        self.examples = lines;
        self
    }
}
