//! The options that the user gave, with their values as text.

use std::ffi::OsString;
use std::path::PathBuf;

use ivcam_base::diag::{Diagnostic, Result};

/// The exposure of a frame of a movie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovieFrame {
    /// The duration of the frame in seconds.
    pub seconds: f64,
    /// The part of that time for which the shutter is open, from 0 to 1.
    pub open: f64,
}

/// The options that the user gave, with their values as text.
#[derive(Clone, Debug, Default)]
pub struct GivenOptions {
    values: Vec<(&'static str, Vec<OsString>)>,
    /// The frame's exposure, if the picture is a frame of a movie.
    pub frame: Option<MovieFrame>,
}

impl GivenOptions {
    /// Adds an option with its values: none for a switch, several for a repeated option.
    pub fn add(&mut self, name: &'static str, values: Vec<OsString>) {
        self.values.push((name, values));
    }

    /// Returns all options that were given, with their values.
    pub fn list(&self) -> impl Iterator<Item = (&'static str, &[OsString])> {
        self.values
            .iter()
            .map(|(name, values)| (*name, &values[..]))
    }

    /// Returns the values of an option, if it was given.
    fn get(&self, name: &str) -> Option<&[OsString]> {
        let found = self.values.iter().find(|(n, _)| *n == name);
        found.map(|(_, values)| values.as_slice())
    }

    /// Returns whether the option was given.
    pub fn has(&self, name: &str) -> bool {
        self.get(name).is_some()
    }

    /// Returns the option's last value as text.
    pub fn text(&self, name: &str) -> Option<&str> {
        self.get(name)?.last()?.to_str()
    }

    /// Returns all values of an option that may be repeated.
    pub fn paths(&self, name: &str) -> Vec<PathBuf> {
        let values = self.get(name).unwrap_or_default();
        values.iter().map(PathBuf::from).collect()
    }

    /// Returns the values of an option that may be given several times.
    pub fn texts(&self, name: &str) -> Vec<String> {
        let values = self.get(name).unwrap_or_default().iter();
        values
            .map(|value| value.to_string_lossy().into_owned())
            .collect()
    }

    /// Parses the option's value with `parse`. Returns `None` if the option was not given.
    ///
    /// # Errors
    /// Returns an error with the text `expects` if `parse` returns `None`.
    pub fn parsed<T>(
        &self,
        name: &str,
        expects: &str,
        parse: impl FnOnce(&str) -> Option<T>,
    ) -> Result<Option<T>> {
        parsed_word(name, self.text(name), expects, parse)
    }

    /// Parses the option's value as one of several names.
    ///
    /// # Errors
    /// Returns an error that lists the names if the value is none of them.
    pub fn named<T: Copy>(&self, name: &str, values: &[(&'static str, T)]) -> Result<Option<T>> {
        let words: Vec<&str> = values.iter().map(|(n, _)| *n).collect();
        let expects = format!("one of {}", words.join(", "));
        self.parsed(name, &expects, |w| {
            values.iter().find(|(n, _)| *n == w).map(|(_, v)| *v)
        })
    }

    /// Parses the option's value as `on` or `off`.
    ///
    /// # Errors
    /// Returns an error if the value is something else.
    pub fn on_or_off(&self, name: &str) -> Result<Option<bool>> {
        self.named(name, &[("on", true), ("off", false)])
    }
}

/// Parses the value of an option, if it was given.
///
/// # Errors
/// Returns an error with the text `expects` if `parse` returns `None`.
pub(crate) fn parsed_word<T>(
    name: &str,
    word: Option<&str>,
    expects: &str,
    parse: impl FnOnce(&str) -> Option<T>,
) -> Result<Option<T>> {
    let value = |word| parse(word).ok_or_else(|| invalid_value(name, word, expects));
    word.map(value).transpose()
}

/// Returns the error for an invalid value of an option.
fn invalid_value(name: &str, word: &str, expects: &str) -> Box<Diagnostic> {
    Diagnostic::error(format!("`--{name} {word}` is not {expects}"))
}
