//! Compiles `grammar/*.nodes` to the node catalogue's table and typed handles.
//!
//! The build script uses only the standard library. A mistake in the catalogue ends the build with
//! a message that names the file and line. `grammar/README.md` describes the format.

mod nodes;

use std::path::Path;

fn main() {
    let root = std::env::var("CARGO_MANIFEST_DIR").expect("cargo sets CARGO_MANIFEST_DIR");
    let out = std::env::var("OUT_DIR").expect("cargo sets OUT_DIR");
    println!("cargo::rerun-if-changed=build");
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
