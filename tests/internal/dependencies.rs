//! Compares src/cli/dependencies.tsv with Cargo.lock. With `UPDATE=1` it writes the table.

use std::collections::BTreeMap;
use std::process::Command;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
const TABLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/src/cli/dependencies.tsv");

/// A package of Cargo.lock: its file's SHA-256, and the packages that it depends on.
#[derive(Default)]
struct Package {
    hash: String,
    needs: Vec<String>,
}

#[test]
fn the_table_of_dependencies_has_every_package_of_the_lock_file() {
    let locked = locked();
    let is_update = std::env::var_os("UPDATE").is_some();
    let parts = if is_update { parts() } else { written_parts() };
    let rows = locked.iter().map(|(package, Package { hash, needs })| {
        let (name, version) = package.split_once(' ').unwrap();
        let part = if is_update { "unused" } else { "missing" };
        let none = (part.to_owned(), String::new());
        let (part, license) = parts.get(package).unwrap_or(&none);
        let needs = needs.join(",");
        format!("{name}\t{version}\t{part}\t{license}\t{hash}\t{needs}\n")
    });
    let table: String = rows.collect();
    if is_update {
        std::fs::write(TABLE, &table).unwrap();
    }
    assert!(
        !table.contains("\tmissing\t") && table == std::fs::read_to_string(TABLE).unwrap(),
        "the table is not that of Cargo.lock; `UPDATE=1 cargo test -p ivcam --lib dependencies` \
         writes it"
    );
}

#[test]
fn the_page_of_dependencies_says_what_each_direct_one_is_for() {
    let page = std::fs::read_to_string(format!("{ROOT}/docs/dependencies.md")).unwrap();
    let table = page.split("## Held back").next().unwrap();
    let is_own = |name: &str| name.starts_with("ivcam") || name == "measure";
    let locked = locked();
    let own = locked
        .iter()
        .filter(|(package, _)| is_own(package.split(' ').next().unwrap()));
    let needed = own.flat_map(|(_, package)| &package.needs);
    let mut names: Vec<&str> = needed.filter_map(|need| need.split(' ').next()).collect();
    names.retain(|name| !is_own(name));
    names.sort_unstable();
    names.dedup();
    for name in &names {
        assert!(
            table.contains(&format!("`{name}`")),
            "{name} is not on the page"
        );
    }
    let rows = table.lines().filter(|line| line.starts_with("| `"));
    let cells = rows.flat_map(|row| row.split('|').nth(1).unwrap().split(", "));
    for cell in cells {
        let name = cell.trim().trim_matches('`');
        assert!(names.contains(&name), "{name} is no dependency any more");
    }
}

/// Reads the packages of Cargo.lock by name and version.
fn locked() -> BTreeMap<String, Package> {
    let lock = std::fs::read_to_string(format!("{ROOT}/Cargo.lock")).unwrap();
    let mut packages: Vec<(String, Package)> = Vec::new();
    for block in lock.split("[[package]]\n").skip(1) {
        let value = |key: &str| {
            let mut lines = block.lines();
            let line = lines.find_map(|line| line.strip_prefix(&format!("{key} = \"")));
            line.unwrap_or_default().trim_end_matches('"').to_owned()
        };
        let needs = block.lines().filter_map(|line| line.strip_prefix(" \""));
        let package = Package {
            hash: value("checksum"),
            needs: needs
                .map(|n| n.trim_end_matches("\",").to_owned())
                .collect(),
        };
        packages.push((format!("{} {}", value("name"), value("version")), package));
    }
    // Where there is one version of a package, the lock file does not state it.
    let full = |need: &String| {
        let is_it = |known: &&String| known.split_once(' ').is_some_and(|(n, _)| n == need);
        let mut known = packages.iter().map(|(name, _)| name);
        known.find(is_it).unwrap_or(need).clone()
    };
    let with_versions = packages.iter().map(|(name, package)| {
        let needs = package.needs.iter().map(full).collect();
        let hash = package.hash.clone();
        (name.clone(), Package { hash, needs })
    });
    with_versions.collect()
}

/// Returns the part of the program and the license of each package, as the table has them.
fn written_parts() -> BTreeMap<String, (String, String)> {
    let table = std::fs::read_to_string(TABLE).unwrap_or_default();
    let rows = table.lines().filter_map(|line| {
        let cells: Vec<&str> = line.split('\t').collect();
        let [name, version, part, license, ..] = cells[..] else {
            return None;
        };
        Some((
            format!("{name} {version}"),
            (part.to_owned(), license.to_owned()),
        ))
    });
    rows.collect()
}

/// Asks cargo for the part of the program and the license of each package.
fn parts() -> BTreeMap<String, (String, String)> {
    const PROGRAM: [&str; 5] = [
        "-p",
        "ivcam",
        "--no-default-features",
        "-e",
        "normal,no-proc-macro",
    ];
    let features = |features: &str| [&PROGRAM[..], &["--features", features]].concat().join(" ");
    let questions = [
        ("program", PROGRAM.join(" ")),
        ("scripts", features("scripts")),
        ("window", features("viewer")),
        ("wayland", features("wayland")),
        ("mpi", features("mpi")),
        ("building", "--workspace --all-features -e all".to_owned()),
    ];
    let mut parts = BTreeMap::new();
    for (part, question) in questions {
        let run = Command::new("cargo")
            .current_dir(ROOT)
            .args("tree --locked --target all --prefix none --format {p}\t{l}".split(' '))
            .args(question.split(' '))
            .output()
            .unwrap();
        assert!(
            run.status.success(),
            "{}",
            String::from_utf8_lossy(&run.stderr)
        );
        for line in String::from_utf8_lossy(&run.stdout).lines() {
            let (package, license) = line.split_once('\t').unwrap_or_default();
            let mut words = package.split(' ');
            let (Some(name), Some(version)) = (words.next(), words.next()) else {
                continue;
            };
            let license = license.trim_end_matches(" (*)").replace('/', " OR ");
            let package = format!("{name} {}", version.trim_start_matches('v'));
            let new = (part.to_owned(), license);
            parts.entry(package).or_insert(new);
        }
    }
    parts
}
