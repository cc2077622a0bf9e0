//! Options of the output. They do not change a plan; `cli::render` reads them.

use super::option::{Opt, Takes};

pub(super) static OPTIONS: [Opt; 15] = [
    Opt::new(
        "output",
        Takes::One("FILE"),
        "picture to write: .png, .exr, .tif, .jpg, .rgb, .sgi or .ppm; - for standard output as PNG [the scene's name with .png, and a number if that exists]",
    )
    .vintage("o"),
    Opt::new(
        "write-camera",
        Takes::One("FILE"),
        "writes the camera in use, with its focus, as a file for --camera",
    )
    .vintage("camwrite"),
    Opt::new(
        "aov",
        Takes::One("FILE.exr"),
        "writes the picture with layers: depth, position, normal, albedo, standard error, samples, lost rays",
    ),
    Opt::new(
        "layers",
        Takes::One("LIST"),
        "further layers in the file of --aov: cryptomatte, mattes of objects and materials; uv, texture coordinates; motion, pixels until 1/24 s later, motion:TIME in another time",
    ),
    Opt::new(
        "denoise",
        Takes::Maybe("PROGRAM", "oidnDenoise"),
        "denoises the picture by Intel Open Image Denoise, whose program is to be installed; its error is then unknown",
    ),
    Opt::new("batch", Takes::Nothing, "renders without a window").vintage("batch"),
    Opt::new(
        "checkpoint",
        Takes::One("FILE"),
        "keeps the state of the render in this file, also after SIGINT, SIGTERM and SIGHUP, and continues from it if it exists",
    ),
    Opt::new(
        "every",
        Takes::One("LENGTH"),
        "time between two checkpoints [60s]",
    ),
    Opt::new(
        "sample-range",
        Takes::One("A..B"),
        "renders only the samples from A to before B, for `ivcam merge`; multiples of 64 up to 1024; a picture only with -o",
    ),
    Opt::new("threads", Takes::One("N"), "threads to use [all cores]"),
    Opt::new(
        "arithmetic",
        Takes::One("fast|portable"),
        "portable: the same bits on every x86-64 processor, slower [fast]",
    ),
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
    Opt::new(
        "progress",
        Takes::One("bar|json"),
        "json: one JSON object per line on standard error, also with --quiet [bar]",
    ),
    Opt::new(
        "tev",
        Takes::One("HOST:PORT"),
        "shows the picture in the viewer tev while it is made; tev listens on 127.0.0.1:14158",
    ),
];
