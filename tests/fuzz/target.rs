//! The list of fuzz targets.

use super::{lenses, options, scenes, seeds, tables, words};

/// A fuzz target.
#[derive(Clone, Copy)]
pub(crate) struct Target {
    /// The name, which is also that of its folder of inputs.
    pub name: &'static str,
    /// Processes the bytes of a file and panics if the program is wrong.
    pub run: fn(&[u8]),
    /// Returns the first inputs, each with a name.
    pub seeds: fn() -> Vec<(String, Vec<u8>)>,
    /// Returns the words of the dictionary.
    pub words: fn() -> Vec<String>,
}

/// All targets.
pub(crate) const TARGETS: [Target; 12] = [
    Target {
        name: "scene",
        run: scenes::scene,
        seeds: seeds::scenes,
        words: words::catalogue,
    },
    Target {
        name: "format",
        run: scenes::scene,
        seeds: seeds::formats,
        words: words::catalogue,
    },
    Target {
        name: "picture",
        run: scenes::picture,
        seeds: seeds::scenes,
        words: words::catalogue,
    },
    Target {
        name: "texture",
        run: scenes::texture,
        seeds: seeds::pictures,
        words: words::none,
    },
    Target {
        name: "font",
        run: scenes::font,
        seeds: seeds::fonts,
        words: words::none,
    },
    Target {
        name: "lens",
        run: lenses::lens,
        seeds: seeds::lenses,
        words: words::lens_formats,
    },
    Target {
        name: "glass",
        run: lenses::glass,
        seeds: seeds::glass_catalogues,
        words: words::lens_formats,
    },
    Target {
        name: "camera",
        run: tables::camera,
        seeds: seeds::cameras,
        words: words::cameras,
    },
    Target {
        name: "timeline",
        run: tables::timeline,
        seeds: seeds::timelines,
        words: words::timelines,
    },
    Target {
        name: "film",
        run: tables::film,
        seeds: seeds::films,
        words: words::timelines,
    },
    Target {
        name: "curves",
        run: tables::curves,
        seeds: seeds::curves,
        words: words::timelines,
    },
    Target {
        name: "options",
        run: options::options,
        seeds: options::examples,
        words: options::spellings,
    },
];
