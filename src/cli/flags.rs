//! The one table of flags: every logical flag once, with all its spellings.
//!
//! The 1999 program spelled long flags with one dash (`-batch`, `-camread`). clap has no such
//! flags, so whole words are rewritten to the modern spelling before clap sees them; the two can
//! therefore not drift apart.

use std::ffi::OsString;

use clap::{Arg, ArgAction, value_parser};

/// One logical flag.
pub struct Flag {
    /// The key that code asks for, and the modern long spelling.
    pub name: &'static str,
    /// The 1999 spelling, without its dash; one letter is also clap's short form.
    pub vintage: Option<&'static str>,
    /// Other modern spellings.
    pub aliases: &'static [&'static str],
    pub value: Takes,
    pub help: &'static str,
}

/// What follows a flag.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Takes {
    Nothing,
    /// A value, shown by this name.
    One(&'static str),
    /// `--flag=VALUE`, or nothing.
    Maybe(&'static str),
    /// A value, and the flag may be repeated.
    Many(&'static str),
}

const fn flag(name: &'static str, value: Takes, help: &'static str) -> Flag {
    Flag {
        name,
        vintage: None,
        aliases: &[],
        value,
        help,
    }
}

const fn vintage(name: &'static str, old: &'static str, value: Takes, help: &'static str) -> Flag {
    Flag {
        name,
        vintage: Some(old),
        aliases: &[],
        value,
        help,
    }
}

/// How much a scene may ask for; every command that reads scenes takes it.
pub const LIMIT: Flag = flag(
    "scene-limit",
    Takes::Many("NAME=N"),
    "raises or lowers a limit on the scene: bytes of a file [512M], nodes [10000000], copies by protos [1000000], depth [1000000], files it names [1000], include-depth [32], visits on the way through it [300000, or twice its nodes], primitives [16000000]",
);

/// Typefaces of the user's own; every command that sets text takes it.
pub const FONTS: Flag = flag(
    "fonts",
    Takes::Many("FOLDER"),
    "typefaces (.otf, .ttf, .ttc) below this folder go before the shipped ones, by name or as the usual stand-in: Nimbus Roman for Times",
);

/// The same flag under one more modern name.
const fn also(aliases: &'static [&'static str], flag: Flag) -> Flag {
    Flag { aliases, ..flag }
}

/// What a render takes, in either spelling.
pub const RENDER: &[Flag] = &[
    vintage(
        "focus",
        "f",
        Takes::One("DISTANCE"),
        "distance in focus, from the camera; a bare number is meters [the scene camera's focalDistance]",
    ),
    vintage(
        "zoom",
        "z",
        Takes::One("FACTOR"),
        "scales the lens by this factor; the lenses shipped are about 100 mm [1]",
    ),
    flag(
        "efl",
        Takes::One("LENGTH"),
        "scales the lens to this focal length, such as 20mm; --zoom then scales on from there",
    ),
    vintage(
        "output",
        "o",
        Takes::One("FILE"),
        "picture to write: .png, .exr or .ppm [the scene's name with .png]",
    ),
    vintage(
        "headlight",
        "headlight",
        Takes::Maybe("on|off"),
        "flips the headlight on the camera, as a flash, or sets it [1999: off; now: on where the scene has no light]",
    ),
    vintage("batch", "batch", Takes::Nothing, "renders without a window"),
    vintage(
        "camera",
        "camread",
        Takes::One("FILE"),
        "camera to use: a file with a camera node (camera/FORMAT.md), or the node itself",
    ),
    vintage(
        "shading",
        "s",
        Takes::One("MODEL"),
        "f flat, n normal, a ambient, d diffuse, p Phong, g as OpenGL draws (gl), r recursive [r]",
    ),
    vintage(
        "samples",
        "j",
        Takes::One("N"),
        "samples a pixel [1999: 1, now: 16]",
    ),
    vintage(
        "environment",
        "e",
        Takes::One("FILE"),
        "SceneViewer environment file: camera, fog, lights, headlight",
    ),
    flag(
        "lens",
        Takes::One("LENS"),
        "lens by name or prescription file; ideal has no faults, none is the scene's own pinhole [wide-angle]",
    ),
    also(
        &["f-number"],
        flag(
            "aperture",
            Takes::One("F-NUMBER"),
            "stops the lens down, such as f/8 or 8 [full aperture]",
        ),
    ),
    flag(
        "zoom-position",
        Takes::One("N"),
        "a tabulated position of a zoom lens, from 0",
    ),
    flag(
        "blades",
        Takes::One("N[@DEGREES]"),
        "iris of 3 to 64 straight blades, turned by an angle [round]",
    ),
    flag(
        "coating",
        Takes::One("none|mgf2|ideal"),
        "on every glass surface: none (Fresnel's loss), a quarter wave of MgF2, or ideal [the prescription's, else ideal]",
    ),
    flag(
        "ghosts",
        Takes::One("on|off"),
        "reflections of the scene's lights inside the lens, by its coatings [off]",
    ),
    also(
        &["focus-by"],
        flag(
            "focus-method",
            Takes::One("METHOD"),
            "what moves: film (distance from the front vertex), lens (from the film), group, or best: the film to the least spot [film]",
        ),
    ),
    flag(
        "era",
        Takes::One("1999|modern"),
        "which program's choices to start from [`ivcam …`: 1999, `ivcam render`: modern]",
    ),
    flag(
        "size",
        Takes::One("WxH"),
        "picture size in pixels [360x240]",
    ),
    flag(
        "film",
        Takes::One("WxH"),
        "film size in millimeters [36x24]",
    ),
    flag(
        "tilt",
        Takes::One("DEGREES"),
        "tilts the lens forward against the film: the sharp plane lies down [0]",
    ),
    flag(
        "swing",
        Takes::One("DEGREES"),
        "swings the lens to the right against the film [0]",
    ),
    flag(
        "rise",
        Takes::One("LENGTH"),
        "raises the lens against the film, such as 8mm; falls if negative [0]",
    ),
    flag(
        "shift",
        Takes::One("LENGTH"),
        "shifts the lens to the right against the film, such as 8mm [0]",
    ),
    flag(
        "film-radius",
        Takes::One("LENGTH"),
        "film bent to a sphere; less than 0 is hollow toward the lens [flat]",
    ),
    flag(
        "sampler",
        Takes::One("NAME"),
        "jittered, random, sobol, blue or golden [1999: jittered, now: sobol]",
    ),
    flag(
        "filter",
        Takes::One("NAME"),
        "how a pixel weighs the light around it: box, gaussian, blackman-harris or mitchell [box]",
    ),
    flag(
        "adaptive",
        Takes::Nothing,
        "sends the samples where a first look, an eighth of them, finds noise; the picture stays unbiased",
    ),
    flag(
        "disc",
        Takes::One("polar|concentric"),
        "map from samples to the lens [1999: polar, now: concentric]",
    ),
    flag(
        "pupil",
        Takes::One("rear|exit"),
        "where on the lens to aim: rear element or exit pupil [1999: rear, now: exit]",
    ),
    flag(
        "glass-catalogue",
        Takes::Many("FILE.agf"),
        "glasses that the prescription may name; may be repeated",
    ),
    flag(
        "dispersion",
        Takes::One("on|off"),
        "whether glass with dispersion parts colors [1999: off, now: on]",
    ),
    flag("seed", Takes::One("N"), "seed of all random numbers [0]"),
    flag("threads", Takes::One("N"), "threads to use [all cores]"),
    flag(
        "exposure",
        Takes::One("FACTOR"),
        "multiplies the exposure; 1 renders white on the axis as white [1]",
    ),
    flag(
        "shutter",
        Takes::One("TIME"),
        "exposes by the lens's light instead: open for 1/60, 0.5s …; of a film's frame also 0.5 or 180deg, for its blur",
    ),
    flag(
        "iso",
        Takes::One("N"),
        "speed of the film, with --shutter [100]",
    ),
    flag(
        "white",
        Takes::One("CD/M2"),
        "luminance of Inventor's white, with --shutter [25424: sunny 16]",
    ),
    flag(
        "diffraction",
        Takes::One("on|off"),
        "spreads the light by the diffraction of the pupil, blades and all [off]",
    ),
    flag(
        "response",
        Takes::One("FILM"),
        "how exposure becomes levels: linear, srgb, reversal, negative,paper, or files of density curves [linear]",
    ),
    flag(
        "depth",
        Takes::One("8|16"),
        "bits a channel in PNG and PPM [8]",
    ),
    flag(
        "max-depth",
        Takes::One("N"),
        "reflections and refractions in a row, for model r [5; with --solids: 64]",
    ),
    flag(
        "solids",
        Takes::Nothing,
        "puts the lens into the scene as solid glass, as the paper first meant to, and exposes the film behind it",
    ),
    flag(
        "target-error",
        Takes::One("SHARE"),
        "stops when the estimated relative error is at most this, such as 1%; --samples is then a limit [65536]",
    ),
    flag(
        "time",
        Takes::One("LENGTH"),
        "stops in time for this, such as 30s; whole passes, at least one; --samples is then a limit [65536]",
    ),
    flag(
        "scene-time",
        Takes::One("SECONDS"),
        "the scene's own time, for engines and sensors [0]",
    ),
    flag(
        "handles",
        Takes::Nothing,
        "draws the handles of draggers and manipulators: the parts that the file gives them, or plain ones",
    ),
    flag(
        "search",
        Takes::Many("FOLDER"),
        "also look here for files that the scene names",
    ),
    FONTS,
    LIMIT,
    flag(
        "report",
        Takes::One("FILE.json"),
        "writes time, error, and what was left out as JSON",
    ),
    flag(
        "quiet",
        Takes::Nothing,
        "no progress and no summary; problems are still told",
    ),
];

/// clap's arguments for a part of the table.
pub fn arguments(table: &'static [Flag]) -> impl Iterator<Item = Arg> {
    table.iter().map(|flag| {
        let mut arg = Arg::new(flag.name).long(flag.name).help(flag.help);
        if let Some(short) = flag
            .vintage
            .filter(|v| v.len() == 1)
            .and_then(|v| v.chars().next())
        {
            arg = arg.short(short);
        }
        arg = arg.visible_aliases(flag.aliases.iter().copied());
        match flag.value {
            Takes::Nothing => arg.action(ArgAction::SetTrue),
            Takes::One(name) => arg.value_name(name).allow_hyphen_values(true),
            Takes::Maybe(name) => arg
                .value_name(name)
                .num_args(0..=1)
                .require_equals(true)
                .default_missing_value("flip"),
            Takes::Many(name) => arg
                .value_name(name)
                .action(ArgAction::Append)
                .value_parser(value_parser!(std::path::PathBuf)),
        }
    })
}

/// A word of one dash that clap would take apart into a letter and its value, though it is no such
/// thing: `-foo` is not a focus of `oo`. Values that look like one may hang on: `-f1.2`, `-j16`.
pub fn unknown(words: &[OsString]) -> Option<&str> {
    let takes_next = |word: &OsString| {
        let name = word.to_str().and_then(|w| w.strip_prefix("--"));
        let one = |f: &&Flag| matches!(f.value, Takes::One(_) | Takes::Many(_));
        let named = |f: &&Flag| name.is_some_and(|n| n == f.name || f.aliases.contains(&n));
        RENDER.iter().filter(one).any(|f| named(&f))
    };
    let open = words.iter().position(|w| w == "--").unwrap_or(words.len());
    let mut last: Option<&OsString> = None;
    for word in &words[..open] {
        if !last.is_some_and(takes_next)
            && let Some(text) = word.to_str()
            && slurred(text)
        {
            return Some(text);
        }
        last = Some(word);
    }
    None
}

/// Whether a word is a known letter with something behind it that is no value of it.
fn slurred(word: &str) -> bool {
    let Some(letters) = word.strip_prefix('-').filter(|w| w.len() > 1) else {
        return false;
    };
    let (letter, rest) = letters.split_at(letters.chars().next().map_or(0, char::len_utf8));
    match letter {
        "f" | "z" | "j" => {
            !rest.starts_with(|c: char| c.is_ascii_digit() || ".=+".contains(c)) && rest != "inf"
        }
        "s" => crate::shade::Shading::named(rest.trim_start_matches('=')).is_none(),
        "o" | "e" => !rest.contains(['.', '/', '\\', '=']),
        _ => letter.starts_with(|c: char| c.is_ascii_alphabetic()),
    }
}

/// Every spelling of every flag, with its dashes.
pub fn spellings() -> impl Iterator<Item = String> {
    RENDER.iter().flat_map(|f| {
        let modern = std::iter::once(f.name).chain(f.aliases.iter().copied());
        let modern = modern.map(|name| format!("--{name}"));
        modern.chain(f.vintage.map(|old| format!("-{old}")))
    })
}

/// Rewrites the 1999 program's one-dash words (`-batch`) to the modern spelling (`--batch`).
/// Words after `--` and everything unknown stay as they are. `-headlight on` becomes one word.
pub fn modernize(words: impl IntoIterator<Item = OsString>) -> Vec<OsString> {
    let mut out: Vec<OsString> = Vec::new();
    for word in modern_spellings(words) {
        match out.last_mut() {
            Some(last) if *last == "--headlight" && (word == "on" || word == "off") => {
                last.push("=");
                last.push(word);
            }
            _ => out.push(word),
        }
    }
    out
}

fn modern_spellings(words: impl IntoIterator<Item = OsString>) -> Vec<OsString> {
    let mut literal = false;
    words
        .into_iter()
        .map(|word| {
            literal |= word == "--";
            let old = word
                .to_str()
                .and_then(|w| w.strip_prefix('-'))
                .filter(|_| !literal);
            let found = old.and_then(|old| {
                RENDER
                    .iter()
                    .find(|f| f.vintage == Some(old) && old.len() > 1)
            });
            found.map_or(word, |f| format!("--{}", f.name).into())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(line: &str) -> clap::ArgMatches {
        let words = modernize(line.split_whitespace().map(OsString::from));
        clap::Command::new("ivcam")
            .no_binary_name(true)
            .args(arguments(RENDER))
            .arg(Arg::new("scene"))
            .try_get_matches_from(words)
            .unwrap()
    }

    #[test]
    fn the_papers_own_line_parses() {
        let line = "-batch -j 16 -s r -f 1.2 -z 0.2 -camread camera/cam-1.dat scene/livroom.iv";
        let m = parse(line);
        assert!(m.get_flag("batch"));
        for (name, value) in [
            ("samples", "16"),
            ("shading", "r"),
            ("focus", "1.2"),
            ("zoom", "0.2"),
            ("camera", "camera/cam-1.dat"),
            ("scene", "scene/livroom.iv"),
        ] {
            assert_eq!(m.get_one::<String>(name).unwrap(), value);
        }
    }

    #[test]
    fn both_spellings_of_every_flag_mean_the_same() {
        for flag in RENDER.iter().filter(|f| f.vintage.is_some()) {
            let old = flag.vintage.unwrap_or_default();
            let value = if matches!(flag.value, Takes::One(_)) {
                " 2"
            } else {
                ""
            };
            let (a, b) = (
                parse(&format!("-{old}{value}")),
                parse(&format!("--{}{value}", flag.name)),
            );
            match flag.value {
                Takes::Nothing => assert!(a.get_flag(flag.name) && b.get_flag(flag.name)),
                _ => {
                    let get = |m: &clap::ArgMatches| m.get_one::<String>(flag.name).cloned();
                    assert!(get(&a).is_some() && get(&a) == get(&b), "{}", flag.name);
                }
            }
        }
    }

    #[test]
    fn the_headlight_flips_or_is_set() {
        assert_eq!(
            parse("-headlight x.iv")
                .get_one::<String>("headlight")
                .unwrap(),
            "flip"
        );
        assert_eq!(
            parse("--headlight=off x.iv")
                .get_one::<String>("headlight")
                .unwrap(),
            "off"
        );
    }

    #[test]
    fn a_slip_is_not_taken_apart_but_a_value_may_hang_on_its_letter() {
        let unknown_in = |line: &str| {
            let words = modernize(line.split_whitespace().map(OsString::from));
            unknown(&words).map(str::to_owned)
        };
        for slip in [
            "-foo", "-samples", "-output", "-zoom", "-jitter", "-quiet", "-efl",
        ] {
            assert_eq!(unknown_in(&format!("{slip} a.iv")).as_deref(), Some(slip));
        }
        for good in [
            "-f1.2 -j16 -z.2 -sr -s n -oa.png -finf",
            "-batch -camread a.dat -headlight",
            "--focus -1 -o -x -- -foo",
        ] {
            assert_eq!(unknown_in(good), None, "{good}");
        }
    }

    #[test]
    fn the_headlight_takes_its_word_as_the_next_one_too() {
        for line in [
            "--headlight on a.iv",
            "-headlight on a.iv",
            "--headlight=on a.iv",
        ] {
            let m = parse(line);
            assert_eq!(m.get_one::<String>("headlight").unwrap(), "on");
            assert_eq!(m.get_one::<String>("scene").unwrap(), "a.iv");
        }
    }
}
