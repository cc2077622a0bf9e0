//! Reads the words of a command line that several commands share.

use std::sync::Arc;

use clap::{Arg, ArgAction, ArgMatches};

use super::flags;
use crate::diag::Result;
use crate::geometry::text::Fonts;
use crate::iv::Limits;
use crate::photo::options;

pub(crate) fn scene_argument() -> Arg {
    Arg::new("scene")
        .value_name("SCENE")
        .required(true)
        .help("scene file: .iv, .wrl, plain or .gz")
}

/// The limits on scenes, as `--scene-limit` changes them.
pub(crate) fn limits(matches: &ArgMatches) -> Result<Limits> {
    options::limits(&flags::words(matches))
}

/// The typefaces below the folders of `--fonts`.
pub(crate) fn fonts(matches: &ArgMatches) -> Result<Arc<Fonts>> {
    options::typefaces(&flags::words(matches))
}

/// A flag that does nothing but switch on.
pub(crate) fn switch(name: &'static str, help: &'static str) -> Arg {
    Arg::new(name)
        .long(name)
        .action(ArgAction::SetTrue)
        .help(help)
}

/// The text of a flag, if it was given.
pub(crate) fn text<'a>(matches: &'a ArgMatches, name: &str) -> Option<&'a str> {
    matches.get_one::<String>(name).map(String::as_str)
}

/// A flag's value read by `parse`, or an error that names the flag and what it expects.
pub(crate) fn parsed<T>(
    matches: &ArgMatches,
    name: &str,
    expects: &str,
    parse: impl FnOnce(&str) -> Option<T>,
) -> Result<Option<T>> {
    let Some(word) = text(matches, name) else {
        return Ok(None);
    };
    match parse(word) {
        Some(value) => Ok(Some(value)),
        None => Err(options::not_understood(name, word, expects)),
    }
}
