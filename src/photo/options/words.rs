//! What the user typed, by option, before it means anything.

use std::ffi::OsString;
use std::path::PathBuf;

use crate::diag::{Diagnostic, Result};

/// A movie's frame: its time, and the share of it for which the shutter is open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovieFrame {
    pub seconds: f64,
    pub open: f64,
}

/// The values of the options that were given.
#[derive(Clone, Debug, Default)]
pub struct Words {
    values: Vec<(&'static str, Vec<OsString>)>,
    /// The frame, where the picture is one of a movie.
    pub frame: Option<MovieFrame>,
}

impl Words {
    /// Adds an option with its values: none for a switch, several where it was repeated.
    pub fn add(&mut self, name: &'static str, values: Vec<OsString>) {
        self.values.push((name, values));
    }

    fn get(&self, name: &str) -> Option<&[OsString]> {
        let found = self.values.iter().find(|(n, _)| *n == name);
        found.map(|(_, values)| values.as_slice())
    }

    /// Whether the option was given.
    pub fn has(&self, name: &str) -> bool {
        self.get(name).is_some()
    }

    /// The option's value as text.
    pub fn text(&self, name: &str) -> Option<&str> {
        self.get(name)?.last()?.to_str()
    }

    /// All values of an option that may be repeated.
    pub fn paths(&self, name: &str) -> Vec<PathBuf> {
        let values = self.get(name).unwrap_or_default();
        values.iter().map(PathBuf::from).collect()
    }

    /// The option's value read by `parse`, or an error that says what the option expects.
    pub fn parsed<T>(
        &self,
        name: &str,
        expects: &str,
        parse: impl FnOnce(&str) -> Option<T>,
    ) -> Result<Option<T>> {
        let Some(word) = self.text(name) else {
            return Ok(None);
        };
        match parse(word) {
            Some(value) => Ok(Some(value)),
            None => Err(not_understood(name, word, expects)),
        }
    }

    /// The option's value as one of a few words.
    pub fn named<T: Copy>(&self, name: &str, values: &[(&'static str, T)]) -> Result<Option<T>> {
        let words: Vec<&str> = values.iter().map(|(n, _)| *n).collect();
        let expects = format!("one of {}", words.join(", "));
        self.parsed(name, &expects, |w| {
            values.iter().find(|(n, _)| *n == w).map(|(_, v)| *v)
        })
    }

    /// The option's value as `on` or `off`.
    pub fn on_or_off(&self, name: &str) -> Result<Option<bool>> {
        self.named(name, &[("on", true), ("off", false)])
    }
}

/// A value that is not what an option expects.
pub(crate) fn not_understood(name: &str, word: &str, expects: &str) -> Box<Diagnostic> {
    Diagnostic::error(format!("`--{name} {word}` is not {expects}"))
}
