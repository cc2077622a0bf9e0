//! `ivcam man`: the manual pages, from the definitions of the commands and the table of options.

use std::io::Write;
use std::path::Path;

use clap::{Arg, ArgMatches, Command};
use clap_mangen::Man;
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::write_whole;

use super::{exit_code, flags, text, value};
use crate::photo::options::{Takes, all};

/// Returns the definition of the command.
pub(super) fn command() -> Command {
    Command::new("man")
        .about("Writes the manual pages: `ivcam man render | man -l -`")
        .arg(
            Arg::new("page")
                .value_name("COMMAND")
                .conflicts_with("pages")
                .help("the command whose page is written to standard output [the page of ivcam]"),
        )
        .arg(
            value(
                "pages",
                "FOLDER",
                "writes all pages into this folder, such as ~/.local/share/man/man1",
            )
            .long("output")
            .short('o'),
        )
}

/// Writes the manual pages of `commands`.
///
/// # Errors
/// Fails if there is no such command, or if a page cannot be written.
pub(super) fn run(m: &ArgMatches, commands: &Command, out: &mut dyn Write) -> Result<i32> {
    let mut commands = commands.clone().disable_help_subcommand(true);
    commands.build();
    let Some(folder) = text(m, "pages").map(Path::new) else {
        let page = match text(m, "page") {
            None | Some("ivcam") => page(&commands)?,
            Some(name) => page(named(&commands, name)?)?,
        };
        return exit_code(out.write_all(&page));
    };
    std::fs::create_dir_all(folder).map_err(|e| Diagnostic::io(folder.display(), &e))?;
    for command in std::iter::once(&commands).chain(commands.get_subcommands()) {
        let path = folder.join(format!("{}.1", name_of(command)));
        let page = page(command)?;
        write_whole(&path, |file| file.write_all(&page))?;
    }
    Ok(0)
}

/// Returns the command of a name.
fn named<'a>(commands: &'a Command, name: &str) -> Result<&'a Command> {
    let found = commands.find_subcommand(name);
    found.ok_or_else(|| super::unknown_command(name))
}

/// Returns the name of a command's page.
fn name_of(command: &Command) -> String {
    match command.get_name() {
        "ivcam" => "ivcam".to_owned(),
        name => format!("ivcam-{name}"),
    }
}

/// Returns the page of a command, as the source of man's formatter.
fn page(command: &Command) -> Result<Vec<u8>> {
    let mut source = Vec::new();
    let written = write_page(command, &mut source);
    written
        .map(|()| source)
        .map_err(|e| Diagnostic::io("manual page", &e))
}

/// What a command returns to the shell.
const EXIT_STATUS: &str = "\
.SH EXIT STATUS
.TP
0
success
.TP
1
pictures differ, a limit is exceeded, or something is lost with \\fB\\-\\-strict\\fR
.TP
2
an error
";

fn write_page(command: &Command, out: &mut Vec<u8>) -> std::io::Result<()> {
    let is_root = command.get_name() == "ivcam";
    let usage = command.clone().render_usage().to_string();
    let usage = usage.trim_start_matches("Usage: ").to_owned();
    let usage = match is_root {
        true => usage + "\nivcam [OPTIONS OF 1999] SCENE",
        false => usage,
    };
    let name = name_of(command);
    let whole = command.clone().mut_args(described).override_usage(usage);
    let page =
        Man::new(whole.display_name(&name)).source(concat!("ivcam ", env!("CARGO_PKG_VERSION")));
    page.render_title(out)?;
    page.render_name_section(out)?;
    page.render_synopsis_section(out)?;
    page.render_options_section(out)?;
    if is_root {
        page.render_subcommands_section(out)?;
        write_options_of_1999(out)?;
    } else if let Some(text) = command.get_after_help().map(ToString::to_string)
        && text != flags::MORE
    {
        write_notes(out, &text)?;
    }
    out.write_all(EXIT_STATUS.as_bytes())?;
    match is_root {
        true => writeln!(out, ".SH SEE ALSO\n.B ivcam help\nlists the commands."),
        false => writeln!(out, ".SH SEE ALSO\n.BR ivcam (1)"),
    }
}

/// Returns an argument with its whole help, which names its other spellings.
fn described(arg: Arg) -> Arg {
    let arg = arg.hide_short_help(false);
    let option = all().find(|option| arg.get_id() == option.name);
    let old = option.and_then(|option| option.vintage);
    let old = old.filter(|old| old.len() > 1).map(|old| format!("-{old}"));
    let aliases = arg.get_visible_aliases().unwrap_or_default();
    let others = aliases.into_iter().map(|alias| format!("--{alias}"));
    let others: Vec<String> = others.chain(old).collect();
    match arg.get_help().map(ToString::to_string) {
        Some(help) if !others.is_empty() => arg.help(format!("{help}; also {}", others.join(", "))),
        _ => arg,
    }
}

/// Writes the section of the command line of 1999.
fn write_options_of_1999(out: &mut Vec<u8>) -> std::io::Result<()> {
    writeln!(
        out,
        ".SH OPTIONS OF 1999\nWithout a command, \\fBivcam\\fR is the program of 1999: a window, \
         or with \\fB\\-batch\\fR a picture. The options of\n.BR ivcam\\-render (1)\n\
         can be used too."
    )?;
    for (old, option) in all().filter_map(|option| Some((option.vintage?, option))) {
        let value = match option.takes {
            Takes::Nothing => String::new(),
            Takes::One(name) | Takes::Many(name) => format!(" \\fI{}\\fR", escaped(name)),
            Takes::Maybe(name, _) => format!(" [\\fI{}\\fR]", escaped(name)),
        };
        let help = escaped(option.help);
        writeln!(out, ".TP\n\\fB\\-{old}\\fR{value}\n{help}")?;
    }
    let example = "ivcam -batch -j 16 -s r -f 1.2 -z 0.2 -camread camera/cam-1.dat scene.iv";
    writeln!(out, ".PP\n.EX\n{}\n.EE", escaped(example))
}

/// Writes a text with examples, whose lines are indented, as a section.
fn write_notes(out: &mut Vec<u8>, text: &str) -> std::io::Result<()> {
    writeln!(out, ".SH NOTES")?;
    for line in text.lines().filter(|line| !line.is_empty()) {
        match line.strip_prefix("  ") {
            Some(example) => writeln!(out, ".PP\n.EX\n{}\n.EE", escaped(example))?,
            None => writeln!(out, "{}", escaped(line))?,
        }
    }
    Ok(())
}

/// Returns a line of text so that the formatter sees no request in it.
fn escaped(line: &str) -> String {
    let line = line.replace('\\', "\\e").replace('-', "\\-");
    match line.starts_with(['.', '\'']) {
        true => format!("\\&{line}"),
        false => line,
    }
}
