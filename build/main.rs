//! Turns `grammar/*.nodes` into the node catalogue's table and typed handles, and puts the lenses
//! into the program.
//!
//! The standard library alone: a fresh machine pays nothing for it. A mistake in the catalogue
//! ends the build with file, line and what is wrong. The format is on one page in
//! `grammar/README.md`.

mod lenses;
mod nodes;

use std::path::Path;

fn main() {
    lenses::embed();
    let root = std::env::var("CARGO_MANIFEST_DIR").expect("cargo sets CARGO_MANIFEST_DIR");
    let out = std::env::var("OUT_DIR").expect("cargo sets OUT_DIR");
    println!("cargo::rerun-if-changed=build");
    println!("cargo::rerun-if-changed=grammar");
    match nodes::compile(&Path::new(&root).join("grammar")) {
        Ok(code) => std::fs::write(Path::new(&out).join("catalogue.rs"), code)
            .expect("the build folder can be written"),
        Err(mistake) => {
            println!("cargo::error={mistake}");
            std::process::exit(1);
        }
    }
}
