//! `ivcam completions`: the completions of shells, from the definitions of the commands and the
//! table of options.
//!
//! clap's generators know neither options such as `-camread` nor a command line without a command.
//! Both are added here to the text that they generate.

use std::io::Write;

use clap::builder::PossibleValuesParser;
use clap::{Arg, ArgMatches, Command, value_parser};
use clap_complete::Shell;
use ivcam_base::diag::{Diagnostic, Result};

use super::exit_code;
use crate::photo::options::all;

/// Returns the definition of the command.
pub(super) fn command() -> Command {
    Command::new("completions")
        .about("Writes the completions of a shell to standard output")
        .arg(
            Arg::new("shell")
                .value_name("SHELL")
                .required(true)
                .value_parser(value_parser!(Shell))
                .help("bash, zsh, fish, elvish or powershell"),
        )
}

/// Writes the completions of `commands` for a shell.
///
/// # Errors
/// Fails if they cannot be written.
pub(super) fn run(m: &ArgMatches, commands: Command, out: &mut dyn Write) -> Result<i32> {
    let Some(shell) = m.get_one::<Shell>("shell") else {
        return Err(Diagnostic::error("no shell is named"));
    };
    let names = commands.get_subcommands().map(Command::get_name);
    let names: Vec<String> = names.map(str::to_owned).collect();
    let names = PossibleValuesParser::new(names);
    let mut whole = commands
        .mut_subcommands(|command| command.mut_args(with_words))
        .mut_subcommand("man", |man| {
            man.mut_arg("page", |page| page.value_parser(names))
        });
    let mut text = Vec::new();
    clap_complete::generate(*shell, &mut whole, "ivcam", &mut text);
    let text = with_1999(*shell, &String::from_utf8_lossy(&text));
    exit_code(out.write_all(text.as_bytes()))
}

/// Returns an argument whose value's name is a list of words, such as `on|off`, with these words as
/// its values. If a file can be the value too, the shell completes files.
fn with_words(arg: Arg) -> Arg {
    let name = arg.get_value_names().and_then(|names| names.first());
    let Some(name) = name else { return arg };
    let parts = name.split('|').map(str::to_owned);
    let is_word = |part: &String| part.bytes().all(|b| !b.is_ascii_uppercase());
    let (words, others): (Vec<String>, Vec<String>) = parts.partition(is_word);
    if words.len() < 2 || others.iter().any(|part| part == "FILE") {
        return arg;
    }
    arg.value_parser(PossibleValuesParser::new(words))
}

/// Adds the spellings of 1999, and the command line without a command, which has the options of
/// `ivcam render`.
fn with_1999(shell: Shell, text: &str) -> String {
    let lines = text.lines().flat_map(|line| match shell {
        Shell::Bash => vec![bash_line(line)],
        Shell::Zsh => zsh_lines(line),
        Shell::Fish => vec![fish_line(line)],
        _ => vec![line.to_owned()],
    });
    let text = lines.collect::<Vec<_>>().join("\n") + "\n";
    match shell {
        Shell::Bash => text + BASH,
        Shell::Fish => text + FISH,
        _ => text,
    }
}

/// Returns the spellings of 1999 that are longer than a letter, with those of today.
fn spellings() -> impl Iterator<Item = (&'static str, &'static str)> {
    let long = |old: &&str| old.len() > 1;
    all().filter_map(move |option| Some((option.vintage.filter(long)?, option.name)))
}

/// Runs the function that clap generates as if `render` were typed.
const BASH: &str = r#"
_ivcam_1999() {
    if [[ "${COMP_WORDS[1]}" == -* ]]; then
        local -a COMP_WORDS=("$1" render "${COMP_WORDS[@]:1}")
        local COMP_CWORD=$((COMP_CWORD + 1))
    fi
    _ivcam "$@"
}
complete -F _ivcam_1999 -o bashdefault -o default ivcam
"#;

fn bash_line(line: &str) -> String {
    let add = |line: String, (old, name): (&str, &str)| {
        line.replace(&format!(" --{name} "), &format!(" -{old} --{name} "))
            .replace(&format!(" --{name})"), &format!(" --{name}|-{old})"))
    };
    spellings().fold(line.to_owned(), add)
}

fn zsh_lines(line: &str) -> Vec<String> {
    if line.starts_with("    local context curcontext") {
        return vec![line.to_owned(), ZSH.to_owned()];
    }
    let old = spellings().filter_map(|(old, name)| {
        let rest = line.strip_prefix(&format!("'--{name}"))?;
        let rest = rest.strip_prefix('=').unwrap_or(rest);
        rest.starts_with('[').then(|| format!("'-{old}{rest}"))
    });
    let old: Vec<String> = old.collect();
    std::iter::once(line.to_owned()).chain(old).collect()
}

/// Inserts `render` before the options of a command line without a command.
const ZSH: &str = r#"    if [[ "$words[2]" == -* ]]; then
        words=("$words[1]" render "${words[@]:1}")
        (( CURRENT += 1 ))
    fi"#;

/// The condition of a command line without a command.
const FISH: &str = r#"
function __fish_ivcam_1999
    set -l words (commandline -opc) (commandline -ct)
    string match -q -- '-*' "$words[2]"
end
"#;

fn fish_line(line: &str) -> String {
    let add = |line: String, (old, name): (&str, &str)| {
        line.replace(&format!(" -l {name} "), &format!(" -o {old} -l {name} "))
    };
    let render = "\"__fish_ivcam_using_subcommand render";
    spellings()
        .fold(line.to_owned(), add)
        .replace(render, &format!("{render}; or __fish_ivcam_1999"))
}
