//! Converts the table of options ([`crate::photo::options`]) to arguments of the command line.
//!
//! The 1999 program spelled long flags with one dash (`-batch`, `-camread`). clap does not support
//! such flags, so they are rewritten to the modern spelling before clap parses the command line.
//! Both spellings therefore always have the same meaning.

use std::ffi::OsString;

use clap::builder::NonEmptyStringValueParser;
use clap::{Arg, ArgAction, ArgMatches, value_parser};

use super::is_given;
pub(crate) use crate::photo::options::{DRAG, EVENT, FONTS, LIMIT, MEMORY, TIME, TOUCH, WORK};
use crate::photo::options::{GivenOptions, Opt, Takes, all, groups};

/// The options that `-h` lists. `--help` lists all.
const COMMON: [&str; 14] = [
    "lens",
    "focus",
    "efl",
    "aperture",
    "camera",
    "headlight",
    "shading",
    "samples",
    "target-error",
    "size",
    "exposure",
    "output",
    "threads",
    "quiet",
];

/// The line below the help of a command with the options of a photograph.
pub(super) const MORE: &str = "`-h` lists the common options, `--help` lists all.";

/// Returns the arguments for all options of a photograph, under headings. Today's commands accept
/// `--batch` without listing it, because only the 1999 form has a use for it.
pub fn photograph() -> impl Iterator<Item = Arg> {
    groups().iter().flat_map(|group| {
        let arguments = group.options.iter().map(|option| {
            argument(option)
                .hide(option.name == "batch")
                .hide_short_help(!COMMON.contains(&option.name))
        });
        arguments.map(|arg| arg.help_heading(group.heading))
    })
}

/// Returns the argument of one option.
pub(crate) fn argument(option: &Opt) -> Arg {
    let mut arg = Arg::new(option.name).long(option.name).help(option.help);
    if let Some(short) = letter(option) {
        arg = arg.short(short);
    }
    arg = arg.visible_aliases(option.aliases.iter().copied());
    match option.takes {
        Takes::Nothing => arg.action(ArgAction::SetTrue),
        Takes::One(name) => arg
            .value_name(name)
            .allow_hyphen_values(true)
            .value_parser(NonEmptyStringValueParser::new()),
        Takes::Maybe(name, usual) => arg
            .value_name(name)
            .num_args(0..=1)
            .require_equals(true)
            .default_missing_value(usual),
        Takes::Many(name) => arg
            .value_name(name)
            .action(ArgAction::Append)
            .value_parser(value_parser!(std::path::PathBuf)),
    }
}

/// Returns the short spelling of an option, if it has one.
fn letter(option: &Opt) -> Option<char> {
    let old = option.vintage.filter(|old| old.len() == 1)?;
    old.chars().next()
}

/// Returns the options that were given, of those that the command has.
pub fn given_options(matches: &ArgMatches) -> GivenOptions {
    let mut words = GivenOptions::default();
    for option in all() {
        // A command may have only a part of the table. clap has a value for a switch even if the
        // switch was not given.
        let given =
            matches.try_contains_id(option.name).unwrap_or(false) && is_given(matches, option.name);
        if given {
            let values = matches.get_raw(option.name).into_iter().flatten();
            words.add(option.name, values.map(OsString::from).collect());
        }
    }
    words
}

/// Finds an argument with one dash that clap would misread as a short flag with a value: `-foo`
/// does not mean a focus of `oo`. A valid value may follow the letter directly: `-f1.2`, `-j16`.
pub(crate) fn find_unknown(words: &[OsString]) -> Option<&str> {
    let takes_next = |word: &OsString| {
        let name = word.to_str().and_then(|w| w.strip_prefix("--"));
        let one = |o: &&Opt| matches!(o.takes, Takes::One(_) | Takes::Many(_));
        let named = |o: &Opt| name.is_some_and(|n| n == o.name || o.aliases.contains(&n));
        all().filter(one).any(named)
    };
    let open = words.iter().position(|w| w == "--").unwrap_or(words.len());
    let mut last: Option<&OsString> = None;
    for word in &words[..open] {
        if !last.is_some_and(takes_next)
            && let Some(text) = word.to_str()
            && is_misread(text)
        {
            return Some(text);
        }
        last = Some(word);
    }
    None
}

/// Returns whether an argument is a letter that is followed by something other than a valid value.
fn is_misread(word: &str) -> bool {
    let Some(letters) = word.strip_prefix('-').filter(|w| w.len() > 1) else {
        return false;
    };
    let (letter, rest) = letters.split_at(letters.chars().next().map_or(0, char::len_utf8));
    match letter {
        "f" | "z" | "j" => {
            !rest.starts_with(|c: char| c.is_ascii_digit() || ".=+".contains(c)) && rest != "inf"
        }
        "s" => ivcam_render::shade::Shading::named(rest.trim_start_matches('=')).is_none(),
        "o" | "e" => !rest.contains(['.', '/', '\\', '=']),
        _ => letter.starts_with(|c: char| c.is_ascii_alphabetic()),
    }
}

/// Returns all spellings of all flags, with their dashes.
pub(crate) fn spellings() -> impl Iterator<Item = String> {
    all().flat_map(|option| {
        let modern = std::iter::once(option.name).chain(option.aliases.iter().copied());
        let modern = modern.map(|name| format!("--{name}"));
        modern.chain(option.vintage.map(|old| format!("-{old}")))
    })
}

/// Rewrites the 1999 program's flags (`-batch`) to the modern spelling (`--batch`). Arguments after
/// `--` and unknown arguments are not changed. `-headlight on` becomes one argument.
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
            // Photographers write an f-number as f/2.8.
            if let Some(number) = word.to_str().and_then(|w| w.strip_prefix("-f/"))
                && !literal
            {
                return format!("--aperture=f/{number}").into();
            }
            let old = word
                .to_str()
                .and_then(|w| w.strip_prefix('-'))
                .filter(|_| !literal);
            let (old, value) = match old.and_then(|old| old.split_once('=')) {
                Some((old, value)) => (Some(old), format!("={value}")),
                None => (old, String::new()),
            };
            let found = old.and_then(|old| all().find(|o| o.vintage == Some(old) && old.len() > 1));
            found.map_or(word, |option| format!("--{}{value}", option.name).into())
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
            .args(photograph())
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
        let attached = parse("-camread=camera/cam-1.dat scene/livroom.iv");
        assert_eq!(attached.get_one::<String>("camera"), m.get_one("camera"));
    }

    #[test]
    fn both_spellings_of_every_flag_mean_the_same() {
        for flag in all().filter(|f| f.vintage.is_some()) {
            let old = flag.vintage.unwrap_or_default();
            let value = if matches!(flag.takes, Takes::One(_)) {
                " 2"
            } else {
                ""
            };
            let (a, b) = (
                parse(&format!("-{old}{value}")),
                parse(&format!("--{}{value}", flag.name)),
            );
            match flag.takes {
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
            find_unknown(&words).map(str::to_owned)
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
