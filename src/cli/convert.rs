//! `ivcam convert`: writes a scene as ASCII or binary V2.1, from anything that is read.

use std::io::Write;
use std::path::PathBuf;

use clap::{Arg, ArgMatches, Command, value_parser};

use super::{tell, tell_all, text};
use crate::diag::{Diagnostic, Result};
use crate::iv::{Document, Format};

pub(crate) fn command() -> Command {
    let path = |name: &'static str| Arg::new(name).value_parser(value_parser!(PathBuf));
    Command::new("convert")
        .about("Writes a scene file anew: any version and form to Inventor V2.1, VRML97 to VRML97")
        .arg(
            path("scene")
                .value_name("SCENE")
                .required(true)
                .help("scene file: .iv, .wrl, plain or .gz"),
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
                .value_name("FORM")
                .value_parser(["ascii", "binary"])
                .default_value("ascii")
                .help("text, or Inventor's binary form"),
        )
        .arg(super::flags::argument(&super::flags::LIMIT))
}

pub(crate) fn run(matches: &ArgMatches, out: &mut dyn Write) -> Result<i32> {
    let Some(scene) = matches.get_one::<PathBuf>("scene") else {
        return Err(Diagnostic::error("no scene was given"));
    };
    let document = Document::open_with(scene, &[], &super::limits(matches)?)?;
    tell_all(&document.sink);
    let format = match text(matches, "to") {
        Some("binary") => Format::Binary,
        _ => Format::Ascii,
    };
    for loss in document.losses(format) {
        tell(&Diagnostic::warning(loss).in_file(scene.display().to_string()));
    }
    let bytes = document.write(format);
    match matches.get_one::<PathBuf>("output") {
        None => super::written(out.write_all(&bytes).and_then(|()| out.flush())),
        Some(path) => {
            crate::picture::write_whole(path, |file| file.write_all(&bytes))?;
            Ok(0)
        }
    }
}
