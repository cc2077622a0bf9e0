//! The help for the 1999 spellings, and messages that name the spelling that was typed.

use std::ffi::OsString;

use ivcam_base::diag::{Diagnostic, Result};

use super::flags;
use crate::photo::options::{Opt, Takes, all, groups};

/// Whether the words of the 1999 form ask for help. Words after `--` are file names.
pub(super) fn is_asked(words: &[OsString]) -> bool {
    let mut options = words.iter().take_while(|word| *word != "--");
    options.any(|word| word == "-help" || word == "--help" || word == "-h")
}

/// Returns the help of the 1999 form: every option that has a 1999 spelling, with that spelling.
pub(super) fn text() -> String {
    let mut text = String::from(
        "Photographs a scene as the program of 1999 did\n\n\
         Usage: ivcam [options] scene.iv\n       \
         ivcam -batch -j 16 -s r -f 1.2 -z 0.2 -camread camera/cam-1.dat scene.iv\n",
    );
    for group in groups() {
        let old = group
            .options
            .iter()
            .filter_map(|o| o.vintage.map(|v| (v, o)));
        let lines: Vec<String> = old.map(|(vintage, option)| line(vintage, option)).collect();
        if !lines.is_empty() {
            text += &format!("\n{}:\n{}", group.heading, lines.concat());
        }
    }
    text + "\nWithout `-batch` a window opens. Today's options can be used too:\n\
            `ivcam render --help` lists them, and `ivcam help` lists the commands.\n"
}

/// The width of the column of options. The help of a longer one begins on the next line.
const COLUMN: usize = 24;

fn line(vintage: &str, option: &Opt) -> String {
    let value = match option.takes {
        Takes::Nothing => String::new(),
        Takes::One(name) | Takes::Many(name) => format!(" {name}"),
        Takes::Maybe(name, _) => format!(" [{name}]"),
    };
    let spelling = format!("-{vintage}{value}");
    match spelling.len() < COLUMN {
        true => format!("  {spelling:<COLUMN$}{}\n", option.help),
        false => format!("  {spelling}\n  {:COLUMN$}{}\n", "", option.help),
    }
}

/// Replaces today's spelling of options in a message by the spelling that was typed, if that is
/// another one: `-j 0`, not `--samples 0`.
pub(super) fn as_typed(message: &str, words: &[OsString]) -> String {
    let mut message = message.to_owned();
    if !message.contains("--") {
        return message; // most of the messages about a scene, of which there may be many
    }
    for option in all() {
        let modern = format!("--{}", option.name);
        let mut typed = words
            .iter()
            .filter_map(|word| spelling_in(word.to_str()?, option));
        let Some(typed) = typed.next_back().filter(|typed| *typed != modern) else {
            continue;
        };
        for (before, after) in [("`", " "), ("`", "`"), ("'", " "), ("'", "'")] {
            let old = format!("{before}{modern}{after}");
            message = message.replace(&old, &format!("{before}{typed}{after}"));
        }
    }
    message
}

/// The spelling with which a word begins an option, if it does. A value may be attached to it.
fn spelling_in(word: &str, option: &Opt) -> Option<String> {
    let (name, _) = word.split_once('=').unwrap_or((word, ""));
    let modern = |name: &&str| option.name == *name || option.aliases.contains(name);
    if name.strip_prefix("--").filter(modern).is_some() {
        return Some(name.to_owned());
    }
    let vintage = format!("-{}", option.vintage?);
    let attached = vintage.len() == 2 && word.starts_with(&vintage);
    (name == vintage || attached).then_some(vintage)
}

/// Reports an option that needs a value and is followed by another option.
///
/// # Errors
/// Returns a diagnostic that names both options and the value.
pub(super) fn check_values(words: &[OsString]) -> Result<()> {
    let spellings: Vec<String> = flags::spellings().collect();
    let end = words.iter().position(|word| word == "--");
    let words = &words[..end.unwrap_or(words.len())];
    let mut pairs = words.iter().zip(words.iter().skip(1));
    while let Some((word, next)) = pairs.next() {
        let Some(text) = word.to_str() else { continue };
        let is_named = |o: &&Opt| spelling_in(text, o).is_some_and(|spelling| spelling == text);
        let Some(option) = all().find(is_named) else {
            continue;
        };
        let (Takes::One(value) | Takes::Many(value)) = option.takes else {
            continue;
        };
        if let Some(next) = next.to_str()
            && spellings.iter().any(|spelling| spelling == next)
        {
            let message = format!(
                "`{text}` wants {}, and `{next}` is an option",
                a_value(value)
            );
            return Err(Diagnostic::error(message).with_help(format!("`{text}`: {}", option.help)));
        }
        pairs.next(); // The value is no option, whatever it looks like.
    }
    Ok(())
}

/// Returns a value's name as a noun: `a distance`. Other names stand as they are: `F-NUMBER`.
fn a_value(name: &str) -> String {
    let is_word = name.len() > 1 && name.bytes().all(|b| b.is_ascii_uppercase());
    let article = match name.starts_with(['A', 'E', 'I', 'O', 'U']) {
        true => "an",
        false => "a",
    };
    match is_word {
        true => format!("{article} {}", name.to_lowercase()),
        false => format!("a value ({name})"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(line: &str) -> Vec<OsString> {
        line.split_whitespace().map(OsString::from).collect()
    }

    #[test]
    fn messages_name_the_spelling_that_was_typed() {
        for (line, expected) in [
            ("-j 0 a.iv", "`-j 0` is not"),
            ("-j0 a.iv", "`-j 0` is not"),
            ("--samples 0 a.iv", "`--samples 0` is not"),
            ("--samples=0 a.iv", "`--samples 0` is not"),
        ] {
            assert_eq!(as_typed("`--samples 0` is not", &words(line)), expected);
        }
        let clap = "a value is required for '--camera <CAMERA>'";
        let typed = as_typed(clap, &words("-camread"));
        assert_eq!(typed, "a value is required for '-camread <CAMERA>'");
    }

    #[test]
    fn an_option_in_place_of_a_value_is_reported() {
        let error = check_values(&words("-f -camread x scene.iv")).unwrap_err();
        assert_eq!(
            error.message,
            "`-f` wants a distance, and `-camread` is an option"
        );
        for good in [
            "-f 1.2 -camread x scene.iv",
            "-f -1 a.iv",
            "-batch -headlight a.iv",
            "-o -x a.iv",
            "-j16 -s r a.iv",
        ] {
            assert!(check_values(&words(good)).is_ok(), "{good}");
        }
    }

    #[test]
    fn the_help_of_1999_has_every_spelling_of_1999() {
        let text = text();
        for vintage in all().filter_map(|option| option.vintage) {
            assert!(text.contains(&format!("\n  -{vintage} ")), "-{vintage}");
        }
        assert!(!text.contains("  --"));
        let shading = format!("recursive|path\n  {:COLUMN$}how surfaces look", "");
        assert!(text.contains(&shading), "{text}");
    }
}
