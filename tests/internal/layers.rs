//! Checks the order of folders inside each crate (`docs/architecture.md`) on the text of the
//! sources. The compiler checks the order of the crates. Imports in tests do not count.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The source folders of the workspace, and in each the folders from the ground up: a folder
/// imports only from those before it. The order of the crates is held by the compiler.
const ORDER: [(&str, &[&str]); 7] = [
    (
        "crates/base/src",
        &[
            "diag",
            "memory",
            "platform",
            "work",
            "files",
            "thread_context",
            "math",
        ],
    ),
    (
        "crates/inventor/src",
        &["grammar", "iv", "pose", "snapshot", "traversal", "events"],
    ),
    (
        "crates/optics/src",
        &[
            "spectrum",
            "sampling",
            "film",
            "picture",
            "prescription",
            "lens",
            "lens_export",
            "diagram",
        ],
    ),
    (
        "crates/compare/src",
        &[
            "plane", "contrast", "metric", "warp", "tone", "edges", "flip", "chance", "refine",
            "search", "frame", "align", "measure", "fit",
        ],
    ),
    (
        "crates/render/src",
        &[
            "team", "geometry", "bvh", "scene", "shade", "camera", "render",
        ],
    ),
    ("crates/script/src", &[]),
    (
        "src",
        &[
            "photo",
            "archive",
            "movie",
            "farm",
            "compare",
            "export",
            "catalog",
            "compare_folder",
            "stability",
            "viewer",
            "cli",
            "main",
        ],
    ),
];

/// Folders with words that their files never contain, because the folder must be usable without
/// what they name.
const NEVER: [(&str, &[&str]); 3] = [
    ("crates/render/src/geometry", &["ivcam_inventor"]),
    ("crates/render/src/bvh", &["ivcam_inventor"]),
    (
        "crates/compare/src",
        &["ivcam_optics::lens", "ivcam_optics::prescription"],
    ),
];

/// The order inside the large folders, by crate and path. An entry is a file or a folder; files
/// that are not named may be anywhere.
const INSIDE: [(&str, &str, &[&str]); 6] = [
    (
        "crates/inventor/src",
        "iv",
        &[
            "limits",
            "encoding",
            "display",
            "data_uri",
            "x3d_names",
            "declarations",
            "loader",
            "document",
            "node_fields",
            "difference",
            "read",
            "write",
        ],
    ),
    (
        "crates/inventor/src",
        "iv::read",
        &[
            "enum_names",
            "syntax_error",
            "tokens",
            "numbers",
            "values",
            "binary_values",
            "header",
            "upgrade",
            "assemble",
            "expand",
            "cycles",
            "ascii",
            "binary",
            "formats",
            "file",
            "inline",
            "open",
        ],
    ),
    (
        "crates/optics/src",
        "prescription",
        &[
            "text",
            "glass",
            "surface",
            "prescription",
            "about",
            "first_order",
            "adjust",
            "formats",
        ],
    ),
    (
        "crates/render/src",
        "scene",
        &[
            "census",
            "inventor_box",
            "options",
            "looks",
            "pixel_footprint",
            "render_scene",
            "hit",
            "point",
            "texel_footprint",
            "packets",
            "canvas",
            "shapes",
            "survey",
            "snapshot",
            "compile",
            "model",
            "check",
        ],
    ),
    (
        "src",
        "cli",
        &[
            "messages",
            "flags",
            "arguments",
            "outputs",
            "sheet",
            "render",
            "folder_mode",
            "render_folder",
            "catalog",
            "fit",
            "check",
            "compare",
            "converge",
            "convert",
            "expose",
            "frames",
            "lens",
            "nodes",
            "pull_focus",
            "farm",
            "view",
            "dispatch",
        ],
    ),
    (
        "crates/optics/src",
        "lens",
        &[
            "trace", "lens", "lanes", "library", "optics", "pupil", "analysis",
        ],
    ),
];

/// The largest number of files that may import each other in a circle; they must be in one folder.
const LARGEST_CIRCLE: usize = 3;

/// A module's path below the crate, in parts, such as `lens::pupil`.
type Module = Vec<String>;

/// The imports of every source file.
struct House {
    files: BTreeMap<Module, PathBuf>,
    /// Names that a module re-exports: (module, name) to the full path.
    handed_on: BTreeMap<(Module, String), Module>,
    /// The imports of each module: the module that defines the item and the text of the import.
    imports: BTreeMap<Module, BTreeSet<Module>>,
}

impl House {
    /// Reads the sources below a folder of the workspace.
    fn read(src: &str) -> Self {
        let src = Path::new(env!("CARGO_MANIFEST_DIR")).join(src);
        let mut files = BTreeMap::new();
        find(&src, &src, &mut files);
        let mut this = Self {
            files,
            handed_on: BTreeMap::new(),
            imports: BTreeMap::new(),
        };
        let texts: Vec<(Module, String)> = this
            .files
            .iter()
            .map(|(module, path)| {
                (
                    module.clone(),
                    code(&std::fs::read_to_string(path).unwrap()),
                )
            })
            .collect();
        for (module, text) in &texts {
            for (at, _) in text.match_indices("pub use ") {
                for path in tree(&text[at + "pub use ".len()..]) {
                    let whole = this.absolute(module, &path);
                    let name = path.last().cloned().unwrap_or_default();
                    this.handed_on.insert((module.clone(), name), whole);
                }
            }
        }
        for (module, text) in &texts {
            let found = this.imports_of(module, text);
            this.imports.insert(module.clone(), found);
        }
        this
    }

    /// Returns the path from the crate's root of a path in a module.
    fn absolute(&self, module: &Module, path: &[String]) -> Module {
        let mut base = module.clone();
        let mut rest = path;
        match rest.first().map(String::as_str) {
            Some("crate") => (base, rest) = (Vec::new(), &rest[1..]),
            Some("self") => rest = &rest[1..],
            _ => {}
        }
        while rest.first().is_some_and(|w| w == "super") {
            base.pop();
            rest = &rest[1..];
        }
        base.extend(rest.iter().cloned());
        base
    }

    /// Returns the module that defines the item of a path from the root.
    fn defines(&self, path: &[String]) -> Option<Module> {
        let mut path = path.to_vec();
        for _ in 0..8 {
            let length = (1..=path.len())
                .rev()
                .find(|n| self.files.contains_key(&path[..*n]))?;
            let (module, rest) = path.split_at(length);
            let Some(name) = rest.first() else {
                return Some(module.to_vec());
            };
            match self.handed_on.get(&(module.to_vec(), name.clone())) {
                Some(whole) if whole[..] != path[..=length] => {
                    path = whole.iter().chain(&rest[1..]).cloned().collect();
                }
                _ => return Some(module.to_vec()),
            }
        }
        None
    }

    fn imports_of(&self, module: &Module, text: &str) -> BTreeSet<Module> {
        let mut found = BTreeSet::new();
        // A re-export of a folder's `mod.rs` is not an import of its own.
        let text = text.replace("pub use ", "pub use\u{0}");
        for start in ["crate::", "super::", "self::"] {
            for (at, _) in text.match_indices(start) {
                let before = text[..at].chars().next_back().unwrap_or(' ');
                if before.is_alphanumeric() || "_:$\u{0}".contains(before) {
                    continue;
                }
                for path in tree(&text[at..]) {
                    let whole = self.absolute(module, &path);
                    if let Some(other) = self.defines(&whole).filter(|m| m != module) {
                        found.insert(other);
                    }
                }
            }
        }
        found
    }

    /// Returns the circles of files: sets in which every file reaches every other.
    fn circles(&self) -> Vec<BTreeSet<&Module>> {
        let reach: BTreeMap<&Module, BTreeSet<&Module>> =
            self.imports.keys().map(|m| (m, self.reached(m))).collect();
        let mut circles: Vec<BTreeSet<&Module>> = Vec::new();
        for (module, reached) in &reach {
            let circle: BTreeSet<&Module> = reached
                .iter()
                .filter(|m| reach.get(**m).is_some_and(|r| r.contains(*module)))
                .copied()
                .collect();
            if circle.len() > 1 && !circles.contains(&circle) {
                circles.push(circle);
            }
        }
        circles
    }

    fn reached(&self, from: &Module) -> BTreeSet<&Module> {
        let mut seen = BTreeSet::new();
        let mut waiting: Vec<&Module> = self.imports[from].iter().collect();
        while let Some(module) = waiting.pop() {
            if seen.insert(module) {
                waiting.extend(self.imports.get(module).into_iter().flatten());
            }
        }
        seen
    }

    fn folder(&self, module: &Module) -> PathBuf {
        self.files[module]
            .parent()
            .unwrap_or(Path::new(""))
            .to_owned()
    }
}

/// Returns a module's path as text.
fn name(module: &[String]) -> String {
    module.join("::")
}

/// Finds every source file below a folder by its module's path, without files of tests.
fn find(src: &Path, folder: &Path, out: &mut BTreeMap<Module, PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            find(src, &path, out);
        } else if path.extension().is_some_and(|e| e == "rs") && !path.ends_with("tests.rs") {
            let inside = path.strip_prefix(src).unwrap().with_extension("");
            let mut module: Module = inside
                .iter()
                .map(|part| part.to_string_lossy().into_owned())
                .collect();
            if module.last().is_some_and(|m| m == "mod") {
                module.pop();
            }
            out.insert(module, path);
        }
    }
}

/// Removes comments and test modules from the text of a file.
fn code(text: &str) -> String {
    let mut kept = String::new();
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        if line.starts_with("#[cfg(test)]") {
            match lines.peek() {
                Some(next) if next.trim_end().ends_with(';') => {
                    lines.next();
                    continue;
                }
                _ => break,
            }
        }
        if !line.trim_start().starts_with("//") {
            kept += line;
            kept.push('\n');
        }
    }
    kept
}

/// Returns every path of a tree such as `a::{b, c::d}` at the beginning of a text.
fn tree(text: &str) -> Vec<Vec<String>> {
    let mut paths = Vec::new();
    branch(text, &[], &mut paths);
    paths
}

/// Reads one branch and returns the rest of the text.
fn branch<'t>(text: &'t str, before: &[String], out: &mut Vec<Vec<String>>) -> &'t str {
    let mut path = before.to_vec();
    let mut rest = text.trim_start();
    loop {
        let end = rest
            .find(|c: char| !c.is_alphanumeric() && c != '_')
            .unwrap_or(rest.len());
        if end > 0 {
            path.push(rest[..end].to_owned());
            rest = &rest[end..];
        }
        match rest.strip_prefix("::") {
            Some(more) if more.starts_with('{') => {
                rest = &more[1..];
                loop {
                    rest = branch(rest, &path, out).trim_start();
                    match rest.chars().next() {
                        Some(',') => rest = rest[1..].trim_start(),
                        Some('}') => return &rest[1..],
                        _ => return rest,
                    }
                    if let Some(after) = rest.strip_prefix('}') {
                        return after;
                    }
                }
            }
            Some(more) if more.starts_with(|c: char| c.is_alphabetic() || c == '_') => rest = more,
            _ => break,
        }
    }
    path.retain(|part| part != "self" || path_is_only_self(before));
    if !path.is_empty() {
        out.push(path);
    }
    let named = rest.trim_start().strip_prefix("as ").map(str::trim_start);
    named.map_or(rest, |r| {
        r.trim_start_matches(|c: char| c.is_alphanumeric() || c == '_')
    })
}

/// Returns whether `self` is this module, at the beginning of a path; inside braces it is the path
/// before them.
fn path_is_only_self(before: &[String]) -> bool {
    before.is_empty()
}

#[test]
fn no_module_imports_one_after_it() {
    let mut wrong = Vec::new();
    for (src, order) in ORDER {
        let house = House::read(src);
        assert!(house.files.len() > 5, "{src} has few files");
        let rank = |module: &str| order.iter().position(|m| *m == module);
        for (module, imports) in house.imports.iter().filter(|(m, _)| m[0] != "lib") {
            for import in imports.iter().filter(|i| !i.is_empty()) {
                if rank(&import[0]) > rank(&module[0]) {
                    wrong.push(format!("{src}: {} imports {}", name(module), name(import)));
                }
                if !order.is_empty() && rank(&import[0]).is_none() {
                    wrong.push(format!("{src}: `{}` has no place in the order", import[0]));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "against the order:\n{}", wrong.join("\n"));
}

#[test]
fn mathematics_is_usable_without_nodes_and_comparison_without_lenses() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut wrong = Vec::new();
    for (folder, words) in NEVER {
        let mut files = BTreeMap::new();
        find(&root.join(folder), &root.join(folder), &mut files);
        assert!(files.len() > 5, "{folder} has few files");
        for path in files.values() {
            let text = code(&std::fs::read_to_string(path).unwrap());
            for word in words.iter().filter(|word| text.contains(**word)) {
                wrong.push(format!("{} contains {word}", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn no_file_of_a_large_folder_imports_one_after_it() {
    let mut wrong = Vec::new();
    for (src, folder, order) in INSIDE {
        let house = House::read(src);
        let folder: Module = folder.split("::").map(str::to_owned).collect();
        let place = |module: &Module| {
            let inside = module.strip_prefix(&folder[..])?.first()?;
            order.iter().position(|o| o == inside)
        };
        for part in order {
            let named = [&folder[..], &[(*part).to_owned()]].concat();
            assert!(
                house.files.contains_key(&named),
                "there is no {}",
                name(&named)
            );
        }
        for (module, imports) in &house.imports {
            for import in imports {
                if let (Some(here), Some(there)) = (place(module), place(import))
                    && there > here
                {
                    wrong.push(format!("{} imports {}", name(module), name(import)));
                }
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "against the order inside a folder:\n{}",
        wrong.join("\n")
    );
}

#[test]
fn files_import_each_other_only_in_small_circles_of_one_folder() {
    let mut wrong = Vec::new();
    let mut count = 0;
    for (src, _) in ORDER {
        let house = House::read(src);
        for circle in house.circles() {
            count += 1;
            let folders: BTreeSet<PathBuf> = circle.iter().map(|m| house.folder(m)).collect();
            let names: Vec<String> = circle.iter().map(|m| name(m)).collect();
            println!("{src}: {}", names.join(", "));
            if circle.len() > LARGEST_CIRCLE || folders.len() > 1 {
                wrong.push(names.join(", "));
            }
        }
    }
    println!("{count} circles");
    assert!(
        wrong.is_empty(),
        "circles of imports:\n{}",
        wrong.join("\n")
    );
}

#[test]
fn imports_are_found_in_braces_over_lines_and_in_paths() {
    let paths =
        |text: &str| -> Vec<String> { tree(text).iter().map(|path| path.join("::")).collect() };
    assert_eq!(
        paths("crate::lens::{self, Lens, trace::{Loss as L, trace}};"),
        [
            "crate::lens",
            "crate::lens::Lens",
            "crate::lens::trace::Loss",
            "crate::lens::trace::trace"
        ]
    );
    assert_eq!(paths("crate::math::mm(1.0))"), ["crate::math::mm"]);
    let test = "use crate::a::B;\n#[cfg(test)]\nmod tests {\n    use crate::c::D;\n}\n";
    assert_eq!(code(test), "use crate::a::B;\n");
}
