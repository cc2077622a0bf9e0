//! `ivcam licenses`: what the program is made of, as a list or as a CycloneDX document.
//!
//! The crates are those of `dependencies.tsv`, which the test `dependencies` compares with
//! Cargo.lock and writes.

use std::fmt::Write as _;
use std::io::Write;

use clap::{ArgMatches, Command};
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_optics::lens::{About, Lens, shipped_names};
use ivcam_render::geometry::text::LICENSE as TYPEFACES_LICENSE;
use serde_json::{Value, json};

use super::{exit_code, switch};

/// The crates of Cargo.lock: name, version, part, license, SHA-256 of the crate's file, and the
/// crates that it depends on.
const CRATES: &str = include_str!("dependencies.tsv");

/// The license of ivcam itself.
const OWN: &str = env!("CARGO_PKG_LICENSE");

/// The typefaces in the program: name, version, license, and its SPDX identifier if it has one.
const TYPEFACES: [(&str, &str, &str, Option<&str>); 2] = [
    (
        "TeX Gyre Termes, Heros and Cursor (parts, renamed)",
        "2.004",
        "GUST Font License",
        None,
    ),
    (
        "DejaVu (parts, renamed)",
        "2.37",
        "Bitstream Vera",
        Some("Bitstream-Vera"),
    ),
];

/// Returns the definition of the command.
pub(super) fn command() -> Command {
    Command::new("licenses")
        .about("Lists the crates, typefaces and lenses in the program, with their licenses and sources")
        .arg(
            switch("sbom", "writes the list as JSON for other programs (CycloneDX 1.5)")
                .conflicts_with("texts"),
        )
        .arg(switch(
            "texts",
            "prints the licenses of ivcam and of its typefaces in full",
        ))
}

/// Prints the list.
///
/// # Errors
/// Fails if the output cannot be written, or if a shipped lens cannot be opened.
pub(super) fn run(m: &ArgMatches, out: &mut dyn Write) -> Result<i32> {
    let text = if m.get_flag("sbom") {
        let text = serde_json::to_string_pretty(&bill_of_materials());
        text.map_err(|e| Diagnostic::error(format!("the list cannot be written: {e}")))? + "\n"
    } else if m.get_flag("texts") {
        [
            include_str!("../../LICENSE-MIT"),
            include_str!("../../LICENSE-APACHE"),
            TYPEFACES_LICENSE,
        ]
        .join("\n\n")
    } else {
        list()?
    };
    exit_code(out.write_all(text.as_bytes()))
}

/// A crate that is compiled into the program.
struct ProgramCrate {
    name: &'static str,
    version: &'static str,
    license: &'static str,
    /// SHA-256 of the crate's file, or nothing if the crate is ivcam's own.
    hash: &'static str,
    /// Names and versions of the crates that this one may depend on.
    needs: &'static str,
}

impl ProgramCrate {
    /// Returns the name by which other lists know the crate.
    fn url(&self) -> String {
        format!("pkg:cargo/{}@{}", self.name, self.version)
    }
}

/// Returns the crates in this program. Some of them are only part of it on other systems.
fn components() -> impl Iterator<Item = ProgramCrate> {
    let is_built = |part: &str| match part {
        "program" => true,
        "window" => cfg!(feature = "viewer"),
        "wayland" => cfg!(feature = "wayland"),
        "scripts" => cfg!(feature = "scripts"),
        "mpi" => cfg!(feature = "mpi"),
        _ => false,
    };
    CRATES.lines().filter_map(move |line| {
        let mut cells = line.split('\t');
        let mut cell = || cells.next().unwrap_or_default();
        let (name, version, part) = (cell(), cell(), cell());
        let (license, hash, needs) = (cell(), cell(), cell());
        is_built(part).then_some(ProgramCrate {
            name,
            version,
            license,
            hash,
            needs,
        })
    })
}

/// Returns the list as text.
fn list() -> Result<String> {
    let mut text = format!("ivcam {}: {OWN}\n\n", env!("CARGO_PKG_VERSION"));
    let _ = writeln!(text, "Crates, also those for other systems:");
    for component in components().filter(|c| !c.hash.is_empty()) {
        let name = format!("{} {}", component.name, component.version);
        let _ = writeln!(text, "  {name:<40} {}", component.license);
    }
    let _ = writeln!(text, "\nTypefaces (`--texts` prints the licenses):");
    for (name, version, license, _) in TYPEFACES {
        let name = format!("{name} {version}");
        let _ = writeln!(text, "  {name:<58} {license}");
    }
    let _ = writeln!(text, "\nLenses, whose numbers are facts published in:");
    for name in shipped_names() {
        let about = About::of(Lens::named(name)?.prescription());
        let _ = writeln!(text, "  {name:<19} {}", about.source.unwrap_or_default());
    }
    text += "\nGlasses: data sheets of Schott, Ohara, Hoya, CDGM and Hikari, as refractiveindex.info \
             (public domain) has them\nFilms: made up for ivcam\n";
    Ok(text)
}

/// Returns the list as a CycloneDX document.
fn bill_of_materials() -> Value {
    let all: Vec<ProgramCrate> = components().collect();
    let known: Vec<String> = all.iter().map(ProgramCrate::url).collect();
    let (own, others): (Vec<&ProgramCrate>, Vec<&ProgramCrate>) =
        all.iter().partition(|component| component.name == "ivcam");
    let crates = others.iter().map(|component| {
        let mut value = described(component, "library");
        if !component.hash.is_empty() {
            value["hashes"] = json!([{ "alg": "SHA-256", "content": component.hash }]);
        }
        value
    });
    let typefaces = TYPEFACES.iter().map(|(name, version, license, id)| {
        let license = match id {
            Some(id) => json!({ "id": id }),
            None => json!({ "name": license }),
        };
        json!({
            "type": "data", "name": name, "version": version, "licenses": [{ "license": license }]
        })
    });
    let depends = all.iter().map(|component| {
        let needed = component.needs.split(',').map(|need| {
            let (name, version) = need.split_once(' ').unwrap_or_default();
            format!("pkg:cargo/{name}@{version}")
        });
        let needed: Vec<String> = needed.filter(|url| known.contains(url)).collect();
        json!({ "ref": component.url(), "dependsOn": needed })
    });
    json!({
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": { "component": own.first().map(|own| described(own, "application")) },
        "components": crates.chain(typefaces).collect::<Vec<_>>(),
        "dependencies": depends.collect::<Vec<_>>(),
    })
}

/// Returns the CycloneDX entry of a crate.
fn described(component: &ProgramCrate, kind: &str) -> Value {
    json!({
        "type": kind,
        "bom-ref": component.url(),
        "name": component.name,
        "version": component.version,
        "purl": component.url(),
        "licenses": [{ "expression": component.license }],
    })
}
