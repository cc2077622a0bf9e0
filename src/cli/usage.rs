//! Explains command lines that cannot be parsed, in the style of all other messages.

use std::ffi::OsString;
use std::path::Path;

use clap::Command;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use ivcam_base::diag::{Diagnostic, nearest};

use super::vintage_help::as_typed;

/// What meters the exposure.
const METERED: &str = "`--exposure auto` meters the exposure through the lens";
/// What makes a picture black and white.
const MONO: &str = "`--response mono` keeps the luminance alone: black and white";

/// Words of other programs for what ivcam does by an option of another name.
const ELSEWHERE: [(&str, &str); 45] = [
    (
        "width",
        "`--size WIDTHxHEIGHT` sets the size of the picture",
    ),
    (
        "height",
        "`--size WIDTHxHEIGHT` sets the size of the picture",
    ),
    ("res", "`--size WIDTHxHEIGHT` sets the size of the picture"),
    (
        "sensor",
        "`--film WIDTHxHEIGHT` sets the size of the film in millimeters",
    ),
    (
        "sensor-size",
        "`--film WIDTHxHEIGHT` sets the size of the film in millimeters",
    ),
    ("crop", "`--region X,Y,W,H` renders a part of the picture"),
    ("distance", "`--focus DISTANCE` sets the distance in focus"),
    (
        "focus-distance",
        "`--focus DISTANCE` sets the distance in focus",
    ),
    (
        "focal-distance",
        "`--focus DISTANCE` sets the distance in focus",
    ),
    ("focal", "`--efl LENGTH` sets the focal length"),
    (
        "dof",
        "`--aperture F-NUMBER` and `--focus DISTANCE` decide what is sharp",
    ),
    (
        "iris",
        "`--aperture F-NUMBER` stops the lens down, `--blades N` gives its iris blades",
    ),
    (
        "bokeh",
        "`--aperture F-NUMBER` and `--blades N` decide the shape of blurred lights",
    ),
    ("pinhole", "`--lens none` is the scene's own pinhole"),
    ("perspective", "`--lens none` is the scene's own pinhole"),
    (
        "ev",
        "`--exposure FACTOR` multiplies the exposure; a stop is a factor of 2",
    ),
    ("meter", METERED),
    ("metering", METERED),
    ("auto-exposure", METERED),
    ("autoexposure", METERED),
    ("bw", MONO),
    ("monochrome", MONO),
    ("mono", MONO),
    ("black-and-white", MONO),
    (
        "grain",
        "film has no grain here (docs/guide/unsupported.md); few `--samples` leave noise, which is another thing",
    ),
    (
        "gain",
        "`--exposure FACTOR` multiplies the exposure, `--iso N` meters it",
    ),
    (
        "gamma",
        "`--response FILM` says how exposure becomes levels, such as srgb or filmic",
    ),
    (
        "tonemap",
        "`--response FILM` says how exposure becomes levels, such as srgb or filmic",
    ),
    (
        "hdri",
        "`--environment-light FILE` lights the scene by a picture of its surroundings",
    ),
    (
        "envmap",
        "`--environment-light FILE` lights the scene by a picture of its surroundings",
    ),
    (
        "sun",
        "`--sky` lights the scene by a clear sky with its sun",
    ),
    (
        "integrator",
        "`--shading MODEL` chooses how light is computed; i is path tracing",
    ),
    ("path-tracing", "`--shading i` is path tracing"),
    (
        "gi",
        "`--shading i` computes indirect light by path tracing",
    ),
    ("bounces", "`--max-depth N` limits the surfaces of a path"),
    (
        "depth-limit",
        "`--max-depth N` limits the surfaces of a path",
    ),
    ("raytrace", "`--shading r` is recursive ray tracing"),
    (
        "quality",
        "`--samples N` or `--target-error SHARE` decides how clean the picture is",
    ),
    ("passes", "`--samples N` sets the samples of a pixel"),
    ("jobs", "`--threads N` sets the number of threads"),
    (
        "verbose",
        "what is known is printed; `--report FILE.json` writes all of it",
    ),
    (
        "format",
        "the ending of the output's name says its format: `-o picture.exr`",
    ),
    (
        "fps",
        "`ivcam pull-focus --rate N` sets the frames per second of a movie",
    ),
    (
        "nogui",
        "`ivcam render` and `-batch` make a picture without a window",
    ),
    (
        "overwrite",
        "`-o FILE` writes to that name, also if the file exists",
    ),
];

/// Returns the message for arguments that clap refuses. `typed` are the arguments as the user
/// typed them.
pub(super) fn explained(
    error: &clap::Error,
    command: &Command,
    typed: &[OsString],
) -> Box<Diagnostic> {
    let text = |kind: ContextKind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(as_typed_word(text, typed)),
        Some(ContextValue::Strings(texts)) => Some(as_typed_word(&texts.join("`, `"), typed)),
        _ => None,
    };
    let named = text(ContextKind::InvalidArg).unwrap_or_default();
    match error.kind() {
        ErrorKind::UnknownArgument if is_after_dashes(&named, typed) => {
            let message = format!("`{named}` is after `--`, where no word is an option");
            Diagnostic::error(message).with_help("give options before `--`")
        }
        ErrorKind::UnknownArgument => unknown(&named, command),
        ErrorKind::InvalidSubcommand => {
            let word = text(ContextKind::InvalidSubcommand).unwrap_or_default();
            super::unknown_command(&word)
        }
        ErrorKind::MissingRequiredArgument => missing(&named, typed, command),
        ErrorKind::InvalidValue if text(ContextKind::InvalidValue).is_none_or(|v| v.is_empty()) => {
            let wants = format!("`{}` has no value", option_of(&named));
            Diagnostic::error(wants).with_help(format!("it is written `{named}`"))
        }
        ErrorKind::InvalidValue => {
            let value = text(ContextKind::InvalidValue).unwrap_or_default();
            let error = Diagnostic::error(format!("`{} {value}` is not known", option_of(&named)));
            match text(ContextKind::ValidValue) {
                Some(valid) => error.with_help(format!("it can be `{valid}`")),
                None => error,
            }
        }
        ErrorKind::ArgumentConflict => {
            let other = text(ContextKind::PriorArg).unwrap_or_default();
            let message = format!("`{named}` does not go with `{other}`");
            Diagnostic::error(message).with_help("leave one out")
        }
        ErrorKind::InvalidUtf8 => {
            let words = typed.iter().filter(|word| word.to_str().is_none());
            let words: Vec<_> = words.map(|word| format!("{word:?}")).collect();
            let message = format!("not UTF-8 in the arguments: {}", words.join(", "));
            Diagnostic::error(message).with_help("give the file a name in UTF-8")
        }
        _ => Diagnostic::error(plain(error)),
    }
}

/// Returns whether a word has the form of an option and was typed after `--`.
fn is_after_dashes(word: &str, typed: &[OsString]) -> bool {
    let mut words = typed.iter().skip_while(|typed| *typed != "--");
    word.starts_with('-') && words.any(|typed| typed == word)
}

/// Returns clap's own text without its marks and its last line.
fn plain(error: &clap::Error) -> String {
    let text = error.render().to_string();
    let first = text.split("\n\n").next().unwrap_or_default();
    first.trim_start_matches("error: ").trim_end().to_owned()
}

/// Puts today's spelling of an option back into the one that was typed.
fn as_typed_word(word: &str, typed: &[OsString]) -> String {
    as_typed(&format!("`{word}`"), typed)
        .trim_matches('`')
        .to_owned()
}

/// Returns an option without its value's name.
fn option_of(named: &str) -> &str {
    named.split([' ', '=']).next().unwrap_or(named)
}

/// Explains an argument that the command does not have.
fn unknown(word: &str, command: &Command) -> Box<Diagnostic> {
    let Some(name) = word.strip_prefix("--").map(option_of) else {
        return one_too_many(word);
    };
    let error = Diagnostic::not_found(format!("there is no option `--{name}`"));
    let known = |(other, _): &&(&str, &str)| *other == name;
    if let Some((_, help)) = ELSEWHERE.iter().find(known) {
        return error.with_help(*help);
    }
    match nearest(name, spellings(command)) {
        Some(near) => error.with_help(format!("did you mean `--{near}`?")),
        None => error.with_help(format!("`{}` lists the options", help_of(command))),
    }
}

/// Returns the command line that shows the help of a command.
fn help_of(command: &Command) -> String {
    match command.get_name() {
        "ivcam" => "ivcam render --help".to_owned(),
        name => format!("ivcam {name} --help"),
    }
}

/// Returns the long spellings of a command's options.
fn spellings(command: &Command) -> Vec<&str> {
    command.get_arguments().flat_map(spellings_of).collect()
}

/// Returns the long spellings of an option.
fn spellings_of(arg: &clap::Arg) -> impl Iterator<Item = &str> {
    let aliases = arg.get_visible_aliases().unwrap_or_default();
    arg.get_long().into_iter().chain(aliases)
}

/// Explains a word that is neither an option nor has a place.
fn one_too_many(word: &str) -> Box<Diagnostic> {
    let error = Diagnostic::error(format!("`{word}` is one word too many"));
    let ends = |endings: &[&str]| {
        let ending = Path::new(word).extension().and_then(|e| e.to_str());
        ending.is_some_and(|e| endings.contains(&e.to_ascii_lowercase().as_str()))
    };
    if word.starts_with('-') {
        let help = format!("a negative value is joined to its option, as in `--option={word}`");
        return error.with_help(help);
    }
    if ends(&["iv", "wrl", "vrml", "gz", "wrz"]) {
        return error.with_help("a command takes one scene, or a folder of scenes");
    }
    if ends(&[
        "png", "exr", "jpg", "jpeg", "tif", "tiff", "ppm", "rgb", "sgi", "glb", "x3d",
    ]) {
        return error.with_help(format!("an output is named by `-o {word}`"));
    }
    if ends(&["dat", "zmx", "seq", "len", "roa", "fx", "lhlt"]) {
        return error.with_help(format!(
            "a lens is named by `--lens {word}`, a camera by `--camera`"
        ));
    }
    error.with_help("a name with blanks is put into quotes")
}

/// Explains an argument that is not there.
fn missing(named: &str, typed: &[OsString], command: &Command) -> Box<Diagnostic> {
    let error = match named.starts_with('-') {
        true => {
            let verb = if named.contains("`, `") { "are" } else { "is" };
            Diagnostic::error(format!(
                "`{}` {verb} missing",
                named.replace("`, `", "` and `")
            ))
        }
        false => {
            let what = named.trim_matches(['<', '>', '.']).to_lowercase();
            let kind = match what.as_str() {
                "old" | "new" => " picture",
                _ => "",
            };
            Diagnostic::error(format!("no {what}{kind} is named"))
        }
    };
    let swallowed = typed.windows(2).find_map(|pair| match pair {
        [option, value] if option.to_str()?.starts_with('-') && is_scene(value) => Some(pair),
        _ => None,
    });
    match swallowed {
        Some([option, value]) => error.with_help(format!(
            "`{}` takes `{}` as its value",
            option.display(),
            value.display()
        )),
        _ => error.with_help(format!("`{}` shows the form", help_of(command))),
    }
}

/// Returns whether a word is the name of a scene, by its ending.
fn is_scene(word: &OsString) -> bool {
    let ending = Path::new(word).extension();
    ending.is_some_and(|e| e == "iv" || e == "wrl" || e == "gz")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_photographers_are_answered_by_the_option_that_does_it() {
        let command = Command::new("render");
        for (word, answer) in [
            ("--meter", "--exposure auto"),
            ("--auto-exposure", "--exposure auto"),
            ("--bw", "--response mono"),
            ("--grain=1", "unsupported.md"),
        ] {
            let help = unknown(word, &command).help.unwrap_or_default();
            assert!(help.contains(answer), "{word}: {help}");
        }
    }
}
