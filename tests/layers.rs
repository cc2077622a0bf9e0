//! Data flows one way: a module imports only modules above it in this table.

use std::path::{Path, PathBuf};

/// From the ground up. Nothing imports `cli`.
const ORDER: [&str; 28] = [
    "diag",
    "math",
    "spectrum",
    "sampling",
    "film",
    "picture",
    "grammar",
    "iv",
    "pose",
    "snapshot",
    "traversal",
    "geometry",
    "bvh",
    "scene",
    "shade",
    "lens",
    "camera",
    "render",
    "photo",
    "plan",
    "movie",
    "compare",
    "diagram",
    "export",
    "viewer",
    "cli",
    "main",
    "lib",
];

fn rank(module: &str) -> usize {
    ORDER
        .iter()
        .position(|m| *m == module)
        .unwrap_or_else(|| panic!("`{module}` is not in the table"))
}

fn files(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

/// Every module that a line names after `crate::`, in a path or in braces.
fn imports(line: &str) -> Vec<String> {
    let word = |s: &str| {
        s.chars()
            .take_while(|c| c.is_alphanumeric() || *c == '_')
            .collect()
    };
    line.match_indices("crate::")
        .filter(|(at, _)| !line[..*at].ends_with("($"))
        .map(|(at, m)| word(&line[at + m.len()..]))
        .filter(|w: &String| ORDER.contains(&w.as_str()))
        .collect()
}

#[test]
fn no_module_imports_one_below_it() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut all = Vec::new();
    files(&src, &mut all);
    assert!(all.len() > 10, "found only {} files", all.len());
    let mut wrong = Vec::new();
    for path in all {
        let inside = path.strip_prefix(&src).unwrap();
        let first = inside
            .components()
            .next()
            .unwrap()
            .as_os_str()
            .to_string_lossy();
        let module = first.trim_end_matches(".rs").to_owned();
        let text = std::fs::read_to_string(&path).unwrap();
        let code = text.lines().take_while(|l| !l.starts_with("#[cfg(test)]"));
        for line in code.filter(|l| !l.trim_start().starts_with("//")) {
            for import in imports(line) {
                if rank(&import) > rank(&module) {
                    wrong.push(format!("{}: {}", inside.display(), line.trim()));
                }
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "these import a module below their own:\n{}",
        wrong.join("\n")
    );
}

#[test]
fn a_braced_and_a_plain_import_are_both_seen() {
    assert_eq!(imports("use crate::lens::{Lens, Focus};"), ["lens"]);
    assert_eq!(
        imports("    let x = crate::scene::hit(crate::math::mm(1.0));"),
        ["scene", "math"]
    );
    assert_eq!(imports("use crate::ClassId;"), Vec::<String>::new());
}
