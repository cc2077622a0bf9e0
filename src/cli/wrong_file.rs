//! Recognizes a file that is given in the place of one of another kind.

use std::ffi::OsStr;
use std::path::Path;

use clap::ArgMatches;
use ivcam_base::diag::Diagnostic;

use crate::photo::FileKind;

/// The arguments that name one file, and what it should be.
const PLACES: [(&str, FileKind); 5] = [
    ("scene", FileKind::Scene),
    ("camera", FileKind::Scene),
    ("lens", FileKind::Lens),
    ("new", FileKind::Picture),
    ("old", FileKind::Picture),
];

/// Returns the message for a command that failed because a file is in the place of another kind.
pub(super) fn explained(matches: &ArgMatches) -> Option<Box<Diagnostic>> {
    let is_fit = matches.try_contains_id("fit").unwrap_or_default();
    let places = PLACES
        .iter()
        .filter(|(place, _)| *place != "new" || !is_fit);
    let mut wrong = places.filter_map(|(place, expected)| {
        let value = matches.try_get_raw(place).ok().flatten()?.next_back()?;
        let path = Path::new(value);
        if is_address(value) {
            let error = format!(
                "`{}` is a network address, and files are not downloaded",
                path.display()
            );
            return Some(
                Diagnostic::error(error).with_help("download it, and name the file in its place"),
            );
        }
        let found = FileKind::of(path).filter(|found| found != expected)?;
        Some(message(path, *expected, found, *place == "camera"))
    });
    wrong.next()
}

fn is_address(value: &OsStr) -> bool {
    let begins = |scheme: &str| {
        value
            .to_str()
            .is_some_and(|value| value.starts_with(scheme))
    };
    ["http://", "https://", "ftp://"].into_iter().any(begins)
}

fn message(path: &Path, expected: FileKind, found: FileKind, is_camera: bool) -> Box<Diagnostic> {
    let file = path.display();
    let is = match found {
        FileKind::Scene => "a scene or a camera",
        FileKind::Lens => "a lens",
        FileKind::Picture => "a picture",
    };
    let not = match expected {
        FileKind::Scene if is_camera => "a camera",
        FileKind::Scene => "a scene",
        FileKind::Lens => "a lens",
        FileKind::Picture => "a picture",
    };
    let help = match (found, expected) {
        (FileKind::Lens, FileKind::Picture) => format!("`ivcam lens {file}` shows it"),
        (FileKind::Lens, _) => {
            format!("`--lens {file}` photographs a scene through it, `ivcam lens {file}` shows it")
        }
        (FileKind::Picture, _) => {
            "`ivcam compare NEW OLD` compares pictures; `--environment-light FILE` lights a scene \
             by one"
                .to_owned()
        }
        (FileKind::Scene, FileKind::Picture) => {
            format!(
                "`ivcam render {file}` makes a picture; `--fit FILE.dat` finds the camera of an old one"
            )
        }
        (FileKind::Scene, _) => {
            format!("`ivcam render {file}` photographs a scene, `--camera {file}` takes its camera")
        }
    };
    Diagnostic::error(format!("`{file}` is {is}, not {not}")).with_help(help)
}
