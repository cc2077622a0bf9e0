//! Arguments that several commands share, and functions that parse them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches, value_parser};
use ivcam_base::diag::Result;
use ivcam_base::memory::MemoryLimit;
use ivcam_base::work::Allowance;
use ivcam_inventor::iv::Limits;
use ivcam_render::geometry::text::Fonts;

use super::flags;
use crate::photo::options;

/// Returns whether the user gave an argument, which may have a default.
pub(crate) fn is_given(matches: &ArgMatches, name: &str) -> bool {
    matches.value_source(name) == Some(ValueSource::CommandLine)
}

/// Returns the argument for the scene file.
pub(crate) fn scene_argument() -> Arg {
    Arg::new("scene").value_name("SCENE").required(true).help(
        "scene file: .iv, .wrl, .x3d, .x3dv, .glb, .gltf, .obj, .ply, .stl, plain or .gz; - for \
              standard input",
    )
}

/// Returns the arguments that say what a scene may read; [`readable_folders`] returns their values.
pub(crate) fn reading_arguments() -> [Arg; 2] {
    let folder = |name: &'static str| {
        let argument = Arg::new(name).long(name).value_name("FOLDER");
        argument.value_parser(value_parser!(PathBuf))
    };
    [
        folder("search")
            .action(ArgAction::Append)
            .help("searches this folder too for files of the scene, and opens files below it"),
        folder("contain").help(
            "opens files of the scene only below this folder and those of --search [the scene's project]",
        ),
    ]
}

/// Returns the folders of `--search` and that of `--contain`, which say what a scene may read.
pub(crate) fn readable_folders(matches: &ArgMatches) -> (Vec<&Path>, Option<&Path>) {
    let search = matches.get_many::<PathBuf>("search");
    (
        search.into_iter().flatten().map(PathBuf::as_path).collect(),
        matches.get_one::<PathBuf>("contain").map(PathBuf::as_path),
    )
}

/// Returns the folder of scenes, if the argument `scene` names a folder.
pub(crate) fn folder_of_scenes(m: &ArgMatches) -> Option<PathBuf> {
    let scene = m.try_get_raw("scene").ok().flatten()?.next()?;
    Some(PathBuf::from(scene)).filter(|path| path.is_dir())
}

/// Returns whether the new side of a comparison is a folder.
pub(crate) fn compares_folder(m: &ArgMatches) -> bool {
    let new = m.try_get_raw("new").ok().flatten();
    new.and_then(|mut words| words.next())
        .is_some_and(|new| Path::new(new).is_dir())
}

/// Returns the limits on scenes that `--scene-limit` sets.
///
/// # Errors
/// Returns an error if a value is not the name of a limit and a number.
pub(crate) fn limits(matches: &ArgMatches) -> Result<Limits> {
    options::limits(&flags::given_options(matches))
}

/// Returns the memory that `--memory` allows a scene.
///
/// # Errors
/// Returns an error if the value is neither a size nor a share.
pub(crate) fn memory(matches: &ArgMatches) -> Result<MemoryLimit> {
    options::memory(&flags::given_options(matches))
}

/// Returns the argument for the time that each scene of a folder may take.
pub(crate) fn time_for_each(help: &'static str) -> Arg {
    value("time", "LENGTH", help)
}

/// Returns what each of several scenes that are read at the same time may take.
///
/// # Errors
/// Returns an error if the value of `--memory`, `--work` or `--time` is invalid.
pub(crate) fn allowance(matches: &ArgMatches, at_once: usize) -> Result<Allowance> {
    let time = match matches.try_get_one::<String>("time") {
        Ok(_) => parsed(
            matches,
            "time",
            "a length of time such as 30s or 2m",
            options::duration,
        )?,
        Err(_) => None,
    };
    Ok(Allowance {
        memory: memory(matches)?.for_each_of(at_once).bytes(),
        work: options::work(&flags::given_options(matches))?,
        time,
    })
}

/// Returns the typefaces below the folders of `--fonts`.
///
/// # Errors
/// Returns an error if a folder cannot be read.
pub(crate) fn fonts(matches: &ArgMatches) -> Result<Arc<Fonts>> {
    options::typefaces(&flags::given_options(matches))
}

/// Returns an option with a value, which help names.
pub(crate) fn value(name: &'static str, value: &'static str, help: &'static str) -> Arg {
    Arg::new(name).long(name).value_name(value).help(help)
}

/// Returns a flag without a value.
pub(crate) fn switch(name: &'static str, help: &'static str) -> Arg {
    Arg::new(name)
        .long(name)
        .action(ArgAction::SetTrue)
        .help(help)
}

/// Returns the text of a flag, if it was given.
pub(crate) fn text<'a>(matches: &'a ArgMatches, name: &str) -> Option<&'a str> {
    matches.get_one::<String>(name).map(String::as_str)
}

/// Parses a flag's value with `parse`. Returns `None` if the flag was not given.
///
/// # Errors
/// Returns an error with the flag's name and the text `expects` if `parse` returns `None`.
pub(crate) fn parsed<T>(
    matches: &ArgMatches,
    name: &str,
    expects: &str,
    parse: impl FnOnce(&str) -> Option<T>,
) -> Result<Option<T>> {
    let word = text(matches, name);
    options::parsed_word(name, word, expects, parse)
}
