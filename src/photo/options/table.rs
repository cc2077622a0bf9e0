//! The options under their headings.

use super::option::Opt;
use super::{film, lens, light, output, sampling, scene};

/// Options under one heading of the help.
pub(crate) struct Group {
    pub heading: &'static str,
    pub options: &'static [Opt],
}

/// An option may read what one above it has set: `--zoom` changes the lens that `--lens` names.
static GROUPS: [Group; 6] = [
    Group {
        heading: "Lens",
        options: &lens::OPTIONS,
    },
    Group {
        heading: "Scene and camera",
        options: &scene::OPTIONS,
    },
    Group {
        heading: "Light and shading",
        options: &light::OPTIONS,
    },
    Group {
        heading: "Sampling",
        options: &sampling::OPTIONS,
    },
    Group {
        heading: "Film",
        options: &film::OPTIONS,
    },
    Group {
        heading: "Output",
        options: &output::OPTIONS,
    },
];

pub(crate) fn groups() -> &'static [Group] {
    &GROUPS
}

/// Every option, in the order in which they change a plan.
pub(crate) fn all() -> impl Iterator<Item = &'static Opt> {
    GROUPS.iter().flat_map(|group| group.options)
}
