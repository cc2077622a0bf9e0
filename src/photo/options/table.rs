//! The table of all options, grouped under the headings of the help.

use super::option::Opt;
use super::{film, lens, light, output, path, sampling, scene};

/// The options under one heading of the help.
pub(crate) struct Group {
    /// The heading.
    pub heading: &'static str,
    /// The options in the order of the help.
    pub options: &'static [Opt],
}

/// The groups. An option may depend on an earlier one: `--zoom` changes the lens that `--lens`
/// sets.
static GROUPS: [Group; 7] = [
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
        heading: "Light from surface to surface",
        options: &path::OPTIONS,
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

/// Returns the groups in the order of the help.
pub(crate) fn groups() -> &'static [Group] {
    &GROUPS
}

/// Returns all options in the order in which they change a plan.
pub fn all() -> impl Iterator<Item = &'static Opt> {
    GROUPS.iter().flat_map(|group| group.options)
}

/// Returns the options that apply to a lens without a scene, which `ivcam lens` has.
pub fn lens_options() -> impl Iterator<Item = &'static Opt> {
    const NAMES: [&str; 9] = [
        "zoom",
        "efl",
        "zoom-position",
        "aperture",
        "coating",
        "focus",
        "focus-method",
        "glass-catalogue",
        "gap",
    ];
    all().filter(|option| NAMES.contains(&option.name))
}
