//! Options of the output. They do not change a plan; `cli::render` reads them.

use super::option::{Opt, Takes};

pub(super) static OPTIONS: [Opt; 5] = [
    Opt::new(
        "output",
        Takes::One("FILE"),
        "picture to write: .png, .exr or .ppm [the scene's name with .png]",
    )
    .vintage("o"),
    Opt::new("batch", Takes::Nothing, "renders without a window").vintage("batch"),
    Opt::new("threads", Takes::One("N"), "threads to use [all cores]"),
    Opt::new(
        "report",
        Takes::One("FILE.json"),
        "writes time, error, and what was left out as JSON",
    ),
    Opt::new(
        "quiet",
        Takes::Nothing,
        "prints no progress and no summary; warnings and errors are still printed",
    ),
];
