//! `ivcam convert`: converts a scene to Inventor V2.1 (ASCII or binary) or VRML97.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};

use super::outputs::{FORCE, is_forced, is_standard_stream, keep_inputs};
use super::{print_diagnostic, print_warnings, switch, text};
use crate::diag::{Diagnostic, Result};
use crate::iv::{Document, Format};

/// Returns the definition of the command.
pub(crate) fn command() -> Command {
    let path = |name: &'static str| Arg::new(name).value_parser(value_parser!(PathBuf));
    Command::new("convert")
        .about("Converts a scene file: any version of Inventor to V2.1, VRML97 to VRML97")
        .arg(
            path("scene")
                .value_name("SCENE")
                .required(true)
                .help("scene file: .iv, .wrl, plain or .gz; - for standard input"),
        )
        .arg(
            path("output")
                .short('o')
                .long("output")
                .value_name("FILE")
                .help("the file to write; standard output if not given"),
        )
        .arg(
            Arg::new("to")
                .long("to")
                .value_name("FORMAT")
                .value_parser(["ascii", "binary"])
                .default_value("ascii")
                .help("text, or Inventor's binary format"),
        )
        .arg(switch(
            FORCE,
            "lets the output replace the scene that is read",
        ))
        .arg(
            path("search")
                .long("search")
                .value_name("FOLDER")
                .action(ArgAction::Append)
                .help("searches this folder too for files of the scene, and opens files below it"),
        )
        .arg(
            path("contain")
                .long("contain")
                .value_name("FOLDER")
                .help("opens files of the scene only below this folder and those of --search [the scene's project]"),
        )
        .arg(super::flags::argument(&super::flags::LIMIT))
}

/// Runs the command and returns the exit code.
pub(crate) fn run(matches: &ArgMatches, out: &mut dyn Write) -> Result<i32> {
    let Some(scene) = matches.get_one::<PathBuf>("scene") else {
        return Err(Diagnostic::error("no scene was given"));
    };
    let output = matches.get_one::<PathBuf>("output");
    let output = output.filter(|path| !is_standard_stream(path));
    let (search, contain) = super::readable_folders(matches);
    let document = Document::open_or_stdin(scene, &search, contain, &super::limits(matches)?)?;
    print_warnings(&document.sink);
    let format = match text(matches, "to") {
        Some("binary") => Format::Binary,
        _ => Format::Ascii,
    };
    if let Some(output) = output {
        check_ending(output, document.written_endings(format))?;
        if !is_forced(matches) {
            keep_inputs("--output", output, &document.opened_files())?;
        }
    }
    for loss in document.losses(format) {
        print_diagnostic(&Diagnostic::warning(loss).in_file(scene.display().to_string()));
    }
    let bytes = document.write(format);
    match output {
        None => super::exit_code(out.write_all(&bytes).and_then(|()| out.flush())),
        Some(path) => {
            crate::files::write_whole(path, |file| file.write_all(&bytes))?;
            Ok(0)
        }
    }
}

/// Refuses a name that promises another format than the one that is written.
fn check_ending(output: &Path, endings: &[&str]) -> Result<()> {
    let ending = output.extension().unwrap_or_default().to_string_lossy();
    if endings.iter().any(|e| ending.eq_ignore_ascii_case(e)) {
        return Ok(());
    }
    let path = output.display();
    let known: Vec<String> = endings.iter().map(|e| format!("`.{e}`")).collect();
    Err(
        Diagnostic::unsupported(format!("`{path}` does not name the format that is written"))
            .with_help(format!("end the output's name in {}", known.join(" or "))),
    )
}
