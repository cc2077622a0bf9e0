//! Measuring programs: `cargo run --release -p measure -- NAME ARGUMENTS`.
//!
//! Their external inputs (oracle tables, scene folders, other programs) are arguments.

mod against;
mod align;
mod conversions;
mod corpus;
mod coverage;
mod damage;
mod faults;
mod hostile;
#[cfg(feature = "panels")]
mod latency;
mod left_out;
mod optics;
mod optics_aberrations;
mod paper_claims;
mod paper_numbers;
mod paper_page;
mod profiles;
mod pupils;
mod readall;
mod resume;
mod roundtrip;
mod rover;
mod scaling;
mod shared;
mod speed;
mod stops;
mod suite;
mod unlit;
mod viewers;

use std::process::ExitCode;

/// A measuring program: its name, its arguments in one line, and its function.
type Tool = (&'static str, &'static str, fn(Vec<String>) -> ExitCode);

const TOOLS: &[Tool] = &[
    (
        "against",
        "FOLDER PROGRAM [--least BYTES] [--rows]",
        against::run,
    ),
    (
        "align",
        "PICTURE PICTURE... [--scans EACH] [--unrelated PAIRS] [--size PIXELS] [--rows]",
        align::run,
    ),
    (
        "conversions",
        "PROGRAM FOLDER [--only TEXT] [--keep FOLDER]",
        conversions::run,
    ),
    (
        "corpus",
        "FOLDER [--only NAME] [--verbose] [--pictures FOLDER]",
        corpus::run,
    ),
    (
        "coverage",
        "[--seeds N] [--size WxH] [--only SCENE] [--samples LIST] [--truth N] [--limit N] \
         [--no-targets] [--markdown] [--path] [--scenes FILE,...] [--detail]",
        coverage::run,
    ),
    (
        "damage",
        "FOLDER [--each N] [--only TEXT] [--seconds S] [--mb MB]",
        damage::run,
    ),
    ("faults", "PROGRAM [--kills N]", faults::run),
    ("hostile", "PROGRAM [--all] [--only NAME]", hostile::run),
    #[cfg(feature = "panels")]
    ("latency", "SCENE...", latency::run),
    (
        "optics",
        "FOLDER [PART...] [--markdown], or REFERENCE.json [--markdown]",
        optics::run,
    ),
    ("paper-claims", "[FILE]", paper_claims::run),
    ("profiles", "PROFILES.json [--svg FOLDER]", profiles::run),
    ("pupils", "", pupils::run),
    ("readall", "FOLDER... [-q]", readall::run),
    (
        "roundtrip",
        "FOLDER [--only NAME] [--keep FOLDER]",
        roundtrip::run,
    ),
    ("resume", "PROGRAM [--kills N]", resume::run),
    ("rover", "-o FOLDER [--columns N]", rover::run),
    ("scaling", "", scaling::run),
    (
        "speed",
        "[--only PART] [--large] [--room FILE] [--peer COMMAND] [--embree LIBRARY] [--tinybvh LIBRARY]",
        speed::run,
    ),
    ("stops", "PROGRAM [--moments N] [--only NAME]", stops::run),
    (
        "suite",
        "PROGRAM FOLDER [--only TEXT] [--keep FOLDER]",
        suite::run,
    ),
    (
        "unlit",
        "PROGRAM FOLDER -o FOLDER [--only TEXT]",
        unlit::run,
    ),
    (
        "viewers",
        "PROGRAM CORPUS -o FOLDER [--coin PROGRAM] [--view3dscene PROGRAM] [--only TEXT] \
         [--least SSIM]",
        viewers::run,
    ),
];

/// Prints the arguments of a program. The exit code is 2.
fn usage(name: &str) -> ExitCode {
    if let Some((name, arguments, _)) = TOOLS.iter().find(|tool| tool.0 == name) {
        eprintln!("usage: measure {name} {arguments}");
    }
    ExitCode::from(2)
}

/// Runs the program that the first argument names. The exit code is 2 if there is none of that
/// name.
fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_default();
    if let Some((.., program)) = TOOLS.iter().find(|tool| tool.0 == name) {
        return program(arguments.collect());
    }
    eprintln!("usage: measure NAME ARGUMENTS, where NAME is one of");
    for (name, arguments, _) in TOOLS {
        eprintln!("  {name} {arguments}");
    }
    ExitCode::from(2)
}
