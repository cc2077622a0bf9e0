//! `ivcam man` and `ivcam completions`: the manual pages and the completions of shells, from the
//! definitions of the commands.

use std::io::Write;
use std::path::Path;

use clap::{Arg, ArgMatches, Command, value_parser};
use clap_complete::Shell;
use clap_mangen::Man;
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::write_whole;

use super::{exit_code, text, value};

/// Returns the definition of `ivcam man`.
pub(super) fn man_command() -> Command {
    Command::new("man")
        .about("Writes the manual pages, one for each command")
        .arg(
            value(
                "pages",
                "FOLDER",
                "folder for the pages, such as ~/.local/share/man/man1 [the first page to standard output]",
            )
            .long("output")
            .short('o'),
        )
}

/// Returns the definition of `ivcam completions`.
pub(super) fn completions_command() -> Command {
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

/// Writes the manual pages.
///
/// # Errors
/// Fails if a page cannot be written.
pub(super) fn man(m: &ArgMatches, commands: &Command, out: &mut dyn Write) -> Result<i32> {
    let mut commands = commands.clone();
    commands.build();
    let page = |command: &Command| {
        let mut page = Vec::new();
        let rendered = Man::new(command.clone()).render(&mut page);
        rendered
            .map(|()| page)
            .map_err(|e| Diagnostic::io("manual page", &e))
    };
    let Some(folder) = text(m, "pages").map(Path::new) else {
        return exit_code(out.write_all(&page(&commands)?));
    };
    std::fs::create_dir_all(folder).map_err(|e| Diagnostic::io(folder.display(), &e))?;
    let write = |name: &str, page: &[u8]| {
        write_whole(&folder.join(format!("{name}.1")), |file| {
            file.write_all(page)
        })
    };
    write("ivcam", &page(&commands)?)?;
    for command in commands
        .get_subcommands()
        .filter(|c| c.get_name() != "help")
    {
        let name = format!("ivcam-{}", command.get_name());
        let command = command.clone().display_name(name.clone());
        write(&name, &page(&command)?)?;
    }
    Ok(0)
}

/// Writes the completions of a shell.
///
/// # Errors
/// Fails if they cannot be written.
pub(super) fn complete(m: &ArgMatches, mut commands: Command, out: &mut dyn Write) -> Result<i32> {
    let Some(shell) = m.get_one::<Shell>("shell") else {
        return Err(Diagnostic::error("no shell is named"));
    };
    let mut text = Vec::new();
    clap_complete::generate(*shell, &mut commands, "ivcam", &mut text);
    exit_code(out.write_all(&text))
}
