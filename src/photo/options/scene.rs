//! Options of the scene, the camera's pose in it, and the era.

use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result, Sink};
use ivcam_base::memory::MemoryLimit;
use ivcam_base::work::WorkLimit;
use ivcam_inventor::events::{Action, ActionKind};
use ivcam_inventor::iv::Limits;
use ivcam_render::geometry::text::Fonts;

use super::given::GivenOptions;
use super::option::{Opt, Takes};
use super::values::{finite, if_any, paths, switch, unless_default};
use crate::photo::Plan;
use crate::photo::actions::{action_word, parse_drag, parse_event, parse_touch};
use crate::photo::camera_choice::CameraChoice;
use crate::photo::view::{Override, WholeView, color_word, parse_color};

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

/// The option `--work`, which every command that reads scenes has.
pub(crate) const WORK: Opt = Opt::new(
    "work",
    Takes::One("N"),
    "steps of work that a scene may cause until it can be rendered, such as 500M or 20G [1G]; a ray may take a 262,144th of them between shared parts inside each other; what is beyond is left out with a message",
)
.plan(
    |plan, words, _| {
        plan.work = work(words)?;
        Ok(())
    },
    |plan, usual| unless_default(plan.work, usual.work, |work| work.to_string()),
)
.examples(&["--work 500M", "--work 20G"]);

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

/// The option `--scene-time`, which `check` has too.
pub(crate) const TIME: Opt = Opt::new(
    "scene-time",
    Takes::One("SECONDS"),
    "the scene's own time, for engines and sensors [0]",
)
.plan(
    |plan, words, _| {
        plan.time = scene_time(words)?.unwrap_or(plan.time);
        Ok(())
    },
    |plan, usual| unless_default(plan.time, usual.time, |t| t.to_string()),
)
.examples(&["--scene-time 1.5", "--scene-time -3"]);

/// The option `--event`, which `check` has too.
pub(crate) const EVENT: Opt = Opt::new(
    "event",
    Takes::Many("NODE.EVENT=VALUE@SECONDS"),
    "sends an event to a named node, or from one of its outputs, at a time of the scene [@0s]",
)
.plan(
    |plan, words, _| {
        plan.actions = actions(words)?;
        Ok(())
    },
    |plan, _| action_words(plan, |what| matches!(what, ActionKind::Send { .. })),
)
.examples(&[
    "--event Lamp.on=FALSE",
    "--event View2.set_bind=TRUE@2s --event M.diffuseColor=1,0,0@.5s",
]);

/// The option `--touch`, which `check` has too.
pub(crate) const TOUCH: Opt = Opt::new(
    "touch",
    Takes::Many("NODE:X,Y@SECONDS"),
    "moves the pointer over a node, presses and releases it, at a time of the scene [@0s]: a sensor, an Anchor, or a shape or group beside or around one, by its name, or by its class if there is one of it; X,Y is a place in the picture from 0,0 in the upper left corner to 1,1 [the middle of the node]; a place without a node touches what is there",
)
.plan(
    |_, _, _| Ok(()), // `--event` reads all actions.
    |plan, _| action_words(plan, |what| matches!(what, ActionKind::Touch { .. })),
)
.examples(&[
    "--touch Door",
    "--touch Button@3s --touch Door:0.25,0.5@4.5s",
    "--touch 0.5,0.75@2s",
]);

/// The option `--drag`, which `check` has too.
pub(crate) const DRAG: Opt = Opt::new(
    "drag",
    Takes::Many("NODE:X,Y-X,Y@FROM..TO"),
    "presses the pointer on a node at the first place in the picture and time, moves it by way of the others, and releases it at the last; places are those of --touch, and the node may be left out",
)
.plan(
    |_, _, _| Ok(()), // `--event` reads all actions.
    |plan, _| action_words(plan, |what| matches!(what, ActionKind::Drag { .. })),
)
.examples(&[
    "--drag Slider:0.5,0.5-0.75,0.5@1s..2s",
    "--drag 0.25,0.5-0.5,0.25-0.75,0.5@1s..3.5s",
]);

pub(super) static OPTIONS: [Opt; 17] = [
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
        "the picture that a viewer of the 1990s made: model g, no lens, one sample in the middle of each pixel, the headlight, and for a scene without a camera the front, in VRML97 from 0 0 10; other options go before it",
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
        "the side to see the whole scene from: front, back, left, right, top, bottom, three-quarter, or AZIMUTH,ELEVATION in degrees; with ,z or ,-z behind it where that axis is up; standard is what a viewer shows without a camera, in VRML97 from 0 0 10; else:SIDE only if the scene has no camera [its camera, or the front, or the side that shows something and its photographs unmirrored]",
    )
    .plan(
        |plan, words, _| {
            let side = |word: &str| Override::parse(word, WholeView::named);
            if let Some(view) = words.parsed("view", "a side, such as front or 35,25", side)? {
                plan.view = Some(view);
            }
            Ok(())
        },
        |plan, _| if_any(plan.view, |view| view.word(WholeView::name)),
    )
    .examples(&["--view top", "--view 35,25", "--view else:three-quarter", "--view top,-z", "--view standard"]),
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
    TIME,
    EVENT,
    TOUCH,
    DRAG,
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
    WORK,
];

/// Returns the time of `--scene-time` in seconds.
///
/// # Errors
/// Returns an error if it is not a finite number.
pub(crate) fn scene_time(words: &GivenOptions) -> Result<Option<f64>> {
    words.parsed(TIME.name, "a time in seconds", finite)
}

/// Returns what `--event`, `--touch` and `--drag` do.
///
/// # Errors
/// Returns an error if a word is not an event, a touch or a drag.
pub(crate) fn actions(words: &GivenOptions) -> Result<Vec<Action>> {
    type ParseAction = fn(&str) -> Result<Action>;
    let kinds: [(&Opt, ParseAction); 3] = [
        (&EVENT, parse_event),
        (&TOUCH, parse_touch),
        (&DRAG, parse_drag),
    ];
    let words = kinds.iter().flat_map(|(option, parse)| {
        let given = words.texts(option.name).into_iter();
        given.map(move |word| parse(&word))
    });
    words.collect()
}

/// Warns of actions that come after the time of the scene.
pub(crate) fn warn_of_late_actions(actions: &[Action], time: f64, sink: &mut Sink) {
    for action in actions.iter().filter(|action| action.time > time) {
        let option = match action.what {
            ActionKind::Send { .. } => EVENT.name,
            ActionKind::Touch { .. } => TOUCH.name,
            _ => DRAG.name,
        };
        let (word, at) = (action_word(action), action.time);
        let text = format!("`--{option} {word}` does nothing: it comes after {time} s");
        let help = format!("`--scene-time {at}` or later shows what it does");
        sink.add(*Diagnostic::warning(text).with_help(help));
    }
}

/// Returns the words of a plan's actions of some kind.
fn action_words(plan: &Plan, is_wanted: impl Fn(&ActionKind) -> bool) -> Vec<String> {
    let wanted = plan.actions.iter().filter(|action| is_wanted(&action.what));
    wanted.map(action_word).collect()
}

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

/// Returns the work that `--work` allows a scene.
///
/// # Errors
/// Returns an error if the value is not a number of steps.
pub(crate) fn work(words: &GivenOptions) -> Result<WorkLimit> {
    let expects = "a number of steps, such as 500M or 20G";
    let limit = words.parsed(WORK.name, expects, WorkLimit::parse)?;
    Ok(limit.unwrap_or_default())
}

/// Returns the typefaces below the folders of `--fonts`.
///
/// # Errors
/// Returns an error if a folder cannot be read.
pub(crate) fn typefaces(words: &GivenOptions) -> Result<Arc<Fonts>> {
    Fonts::open(&words.paths("fonts")).map(Arc::new)
}
