//! Compiles `*.nodes` files to Rust: the class table, class identifiers and field handles.

mod emit;
mod inherit;
mod model;
mod parse;

use std::path::Path;

/// Compiles all `*.nodes` files in a folder and returns the Rust code.
///
/// # Errors
/// Returns a message with file and line for a file that cannot be read or has a mistake.
pub fn compile(folder: &Path) -> Result<String, String> {
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .map_err(|e| format!("{}: {e}", folder.display()))?
        .filter_map(|entry| entry.ok().map(|e| e.path()))
        .filter(|path| path.extension().is_some_and(|e| e == "nodes"))
        .collect();
    files.sort();
    let mut classes = Vec::new();
    for file in files {
        let text =
            std::fs::read_to_string(&file).map_err(|e| format!("{}: {e}", file.display()))?;
        let name = file
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        parse::parse(&format!("grammar/{name}"), &text, &mut classes)?;
    }
    inherit::inherit(&mut classes)?;
    emit::emit(&classes)
}
