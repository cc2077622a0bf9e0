//! Options of the scene, the camera's pose in it, and the era.

use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::memory::MemoryLimit;
use ivcam_inventor::iv::Limits;
use ivcam_inventor::pose::ViewDirection;
use ivcam_render::geometry::text::Fonts;

use super::given::GivenOptions;
use super::option::{Opt, Takes};
use super::values::{finite, if_any, paths, set, switch, unless_default};
use crate::photo::camera_choice::CameraChoice;
use crate::photo::view::{Override, color_word, parse_color};

/// The option `--scene-limit`, which every command that reads scenes has.
pub(crate) const LIMIT: Opt = Opt::new(
    "scene-limit",
    Takes::Many("NAME=N"),
    "raises or lowers a limit on the scene: bytes of a file [512M], nodes [10000000], copies by protos [1000000], depth [1000000], files that it includes [1000], include-depth [32], visits in traversing it [300000, or twice its nodes], primitives [16000000]",
)
.plan(
    |plan, words, _| {
        plan.limits = limits(words)?;
        Ok(())
    },
    |plan, usual| {
        let own = plan.limits.entries().into_iter().zip(usual.limits.entries());
        own.filter(|(own, usual)| own != usual)
            .map(|((name, n), _)| format!("{name}={n}"))
            .collect()
    },
)
.examples(&["--scene-limit bytes=2G", "--scene-limit nodes=7 --scene-limit visits=90k"]);

/// The option `--memory`, which every command that reads scenes has.
pub(crate) const MEMORY: Opt = Opt::new(
    "memory",
    Takes::One("SIZE"),
    "memory for a scene, its textures and its film, such as 4GB, or 80% of the machine's [50%]; parts that do not fit are left out with a message",
)
.plan(
    |plan, words, _| {
        plan.memory = memory(words)?;
        Ok(())
    },
    |plan, usual| unless_default(plan.memory, usual.memory, |m| m.to_string()),
)
.examples(&["--memory 4GB", "--memory 80%", "--memory 1536MB"]);

/// The option `--fonts`, which every command that draws text has.
pub(crate) const FONTS: Opt = Opt::new(
    "fonts",
    Takes::Many("FOLDER"),
    "typefaces (.otf, .ttf, .ttc) below this folder go before the shipped ones, by name or as the usual stand-in (Nimbus Roman for Times), and whatever their names for letters that a text's own typeface lacks",
)
.plan(
    |plan, words, _| {
        plan.fonts = typefaces(words)?;
        Ok(())
    },
    |plan, _| paths(plan.fonts.folders()),
)
.examples(&["--fonts films", "--fonts films --fonts lenses"]);

pub(super) static OPTIONS: [Opt; 13] = [
    Opt::new(
        "era",
        Takes::One("1999|modern"),
        "which program's choices to start from [`ivcam …`: 1999, `ivcam render`: modern]",
    )
    .plan(
        |_, _, _| Ok(()), // `Plan::from_options` reads the era first.
        |_, _| Vec::new(), // The form of the command determines the era.
    )
    .describe(|plan| Some(plan.era.name().to_owned()))
    .examples(&["--era 1999", "--era modern", "--era vintage -j 4"]),
    Opt::new(
        "look",
        Takes::One("viewer"),
        "the picture that a viewer of the 1990s made: model g, no lens, the headlight, and the front of a scene without a camera; other options go before it",
    )
    .plan(
        |_, _, _| Ok(()), // `Plan::from_options` reads it before all others.
        |_, _| Vec::new(), // The options that it stands for are written.
    )
    .examples(&["--look viewer", "--look viewer -s d", "--look viewer --lens ideal"]),
    Opt::new(
        "camera",
        Takes::One("FILE"),
        "camera to use: a file with a camera node (camera/FORMAT.md), or the node itself",
    )
    .vintage("camread")
    .plan(
        |plan, words, _| {
            let word = words.text("camera").map(str::as_ref);
            plan.camera = word.map(CameraChoice::parse).transpose()?;
            Ok(())
        },
        |plan, _| plan.camera.iter().map(CameraChoice::word).collect(),
    )
    .examples(&["--camera camera/cam-1.dat", "--camera OrthographicCamera{}"]),
    Opt::new(
        "view",
        Takes::One("SIDE"),
        "the side to see the whole scene from: front, back, left, right, top, bottom, three-quarter, or AZIMUTH,ELEVATION in degrees; else:SIDE only if the scene has no camera [its camera, or the front, or the side that shows something]",
    )
    .plan(
        |plan, words, _| {
            let side = |word: &str| Override::parse(word, ViewDirection::named);
            plan.view = words.parsed("view", "a side, such as front or 35,25", side)?;
            Ok(())
        },
        |plan, _| if_any(plan.view, |view| view.word(ViewDirection::name)),
    )
    .examples(&["--view top", "--view 35,25", "--view else:three-quarter"]),
    Opt::new(
        "background",
        Takes::One("COLOR"),
        "what is behind everything: a color as #rrggbb or R,G,B from 0 to 1, or black, white, gray, neutral; else:COLOR only if the scene has no Background [its Background, or black]",
    )
    .plan(
        |plan, words, _| {
            let color = |word: &str| Override::parse(word, parse_color);
            plan.background = words.parsed("background", "a color, such as #8090a0", color)?;
            Ok(())
        },
        |plan, _| if_any(plan.background, |color| color.word(color_word)),
    )
    .examples(&["--background white", "--background #8090a0", "--background else:0.4,0.4,0.5"]),
    Opt::new(
        "environment",
        Takes::One("FILE"),
        "SceneViewer environment file: camera, fog, lights, headlight",
    )
    .vintage("e")
    .plan(
        |plan, words, _| {
            plan.environment = words.text("environment").map(Into::into);
            Ok(())
        },
        |plan, _| paths(plan.environment.as_slice()),
    )
    .examples(&["-e a.env", "--environment room/b.env"]),
    Opt::new(
        "scene-time",
        Takes::One("SECONDS"),
        "the scene's own time, for engines and sensors [0]",
    )
    .plan(
        |plan, words, _| {
            let time = words.parsed("scene-time", "a time in seconds", finite)?;
            set(&mut plan.time, time);
            Ok(())
        },
        |plan, usual| unless_default(plan.time, usual.time, |t| t.to_string()),
    )
    .examples(&["--scene-time 1.5", "--scene-time -3"]),
    Opt::new(
        "handles",
        Takes::Nothing,
        "draws the handles of draggers and manipulators: the parts that the file gives them, or plain ones",
    )
    .plan(
        |plan, words, _| {
            plan.handles = words.has("handles");
            Ok(())
        },
        |plan, _| switch(plan.handles),
    )
    .examples(&["--handles"]),
    Opt::new(
        "search",
        Takes::Many("FOLDER"),
        "searches this folder too for files of the scene, and opens files below it",
    )
    .plan(
        |plan, words, _| {
            plan.search = words.paths("search");
            Ok(())
        },
        |plan, _| paths(&plan.search),
    )
    .examples(&["--search a", "--search a --search b/c"]),
    Opt::new(
        "contain",
        Takes::One("FOLDER"),
        "opens files of the scene only below this folder and those of --search [the scene's project]",
    )
    .plan(
        |plan, words, _| {
            plan.contain = words.text("contain").map(Into::into);
            Ok(())
        },
        |plan, _| paths(plan.contain.as_slice()),
    )
    .examples(&["--contain .", "--contain a/b --search c"]),
    FONTS,
    LIMIT,
    MEMORY,
];

/// Returns the limits on scenes that `--scene-limit` sets.
///
/// # Errors
/// Returns an error if a value is not the name of a limit and a number.
pub(crate) fn limits(words: &GivenOptions) -> Result<Limits> {
    let mut limits = Limits::default();
    for word in words.paths("scene-limit") {
        let word = word.to_string_lossy();
        limits.set(&word).ok_or_else(|| {
            Diagnostic::error(format!(
                "`--scene-limit {word}` is not a limit and a number"
            ))
            .with_help(format!(
                "such as `bytes=2G`; the limits are {}",
                Limits::NAMES.join(", ")
            ))
        })?;
    }
    Ok(limits)
}

/// Returns the memory that `--memory` allows a scene.
///
/// # Errors
/// Returns an error if the value is neither a size nor a share.
pub(crate) fn memory(words: &GivenOptions) -> Result<MemoryLimit> {
    let expects =
        "a size with a unit, such as 4GB, or a share of the machine's memory, such as 50%";
    let limit = words.parsed(MEMORY.name, expects, MemoryLimit::parse)?;
    Ok(limit.unwrap_or_default())
}

/// Returns the typefaces below the folders of `--fonts`.
///
/// # Errors
/// Returns an error if a folder cannot be read.
pub(crate) fn typefaces(words: &GivenOptions) -> Result<Arc<Fonts>> {
    Fonts::open(&words.paths("fonts")).map(Arc::new)
}
