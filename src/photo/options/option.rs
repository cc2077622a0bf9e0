//! One entry of the table.

use super::words::Words;
use crate::diag::{Result, Sink};
use crate::photo::plan::Plan;

/// Changes a plan as the words say. It is called whether the option was given or not, in the
/// order of the table.
pub(super) type Parse = fn(&mut Plan, &Words, &mut Sink) -> Result<()>;

/// The values by which a plan differs from `usual`, its era's own; none if it does not. An empty
/// value is an option without a value.
pub(super) type Print = fn(plan: &Plan, usual: &Plan) -> Vec<String>;

/// What the metadata and the report say, if there is something to say.
pub(super) type Describe = fn(&Plan) -> Option<String>;

/// What follows an option.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Takes {
    Nothing,
    /// A value, shown by this name.
    One(&'static str),
    /// `--option=VALUE`, or nothing.
    Maybe(&'static str),
    /// A value, and the option may be repeated.
    Many(&'static str),
}

/// What an option has no effect without.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Needs {
    Nothing,
    /// A camera that has its lens of its own, not as solids of the scene.
    Camera,
    /// Such a camera with a lens, which may be the ideal one.
    Lens,
    /// A lens with a prescription.
    Prescription,
    /// A lens with a prescription whose points are sampled, in the camera or as solids.
    Pupil,
}

/// One option.
pub(crate) struct Opt {
    /// The key that code asks for, and today's long spelling.
    pub name: &'static str,
    /// The 1999 spelling, without its dash; one letter is also today's short form.
    pub vintage: Option<&'static str>,
    /// Other spellings of today.
    pub aliases: &'static [&'static str],
    pub takes: Takes,
    pub help: &'static str,
    pub needs: Needs,
    /// What the option changes in a plan, and back; none for where results go.
    pub plan: Option<(Parse, Print)>,
    pub describe: Option<Describe>,
    /// Command lines that use the option, for the test of the table.
    pub examples: &'static [&'static str],
}

impl Opt {
    pub(crate) const fn new(name: &'static str, takes: Takes, help: &'static str) -> Self {
        Self {
            name,
            vintage: None,
            aliases: &[],
            takes,
            help,
            needs: Needs::Nothing,
            plan: None,
            describe: None,
            examples: &[],
        }
    }

    pub(crate) const fn vintage(mut self, old: &'static str) -> Self {
        self.vintage = Some(old);
        self
    }

    pub(crate) const fn aliases(mut self, aliases: &'static [&'static str]) -> Self {
        self.aliases = aliases;
        self
    }

    pub(crate) const fn needs(mut self, needs: Needs) -> Self {
        self.needs = needs;
        self
    }

    pub(crate) const fn plan(mut self, parse: Parse, print: Print) -> Self {
        self.plan = Some((parse, print));
        self
    }

    pub(crate) const fn describe(mut self, describe: Describe) -> Self {
        self.describe = Some(describe);
        self
    }

    pub(crate) const fn examples(mut self, lines: &'static [&'static str]) -> Self {
        self.examples = lines;
        self
    }
}
