//! Embeds every prescription under `lenses/` in the library, as a table of names and texts.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Writes the table `LENSES` to `lenses.rs` in the build folder.
fn main() {
    let root = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").expect("set by cargo"));
    let folder = root.join("lenses");
    let mut files = Vec::new();
    collect(&folder, &mut files);
    files.sort();
    let mut table = String::from("pub(crate) static LENSES: &[(&str, &str)] = &[\n");
    for file in &files {
        let name = file
            .strip_prefix(&folder)
            .unwrap_or(file)
            .to_string_lossy()
            .replace('\\', "/");
        let _ = writeln!(
            table,
            "    ({name:?}, include_str!({:?})),",
            file.display().to_string()
        );
    }
    table.push_str("];\n");
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("set by cargo")).join("lenses.rs");
    std::fs::write(out, table).expect("OUT_DIR can be written");
}

/// Adds every prescription below a folder, and makes cargo run the build script again when a folder
/// changes.
fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    println!("cargo:rerun-if-changed={}", folder.display());
    let Ok(entries) = std::fs::read_dir(folder) else {
        return;
    };
    for path in entries.flatten().map(|entry| entry.path()) {
        let ending = path.extension().and_then(|e| e.to_str());
        if path.is_dir() {
            collect(&path, files);
        } else if matches!(ending, Some("dat" | "json" | "zmx" | "seq")) {
            files.push(path);
        }
    }
}
