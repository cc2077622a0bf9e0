//! Plays every scene of `tests/scripts` and compares nodes with what the scene states.
//!
//! A line `# at 2.5 Ball.translation: 1 2 3` states a field at a time. A number between the dots is
//! an element of a list. Nodes are stated by class and, with a colon, by name. A line `# says:`
//! states a message; a scene without one has none.

use std::path::{Path, PathBuf};

use ivcam_inventor::events::SnapshotOptions;
use ivcam_inventor::iv::{Document, NodeId, NodeRef, Value};
use ivcam_inventor::snapshot::{NoBounds, Snapshot};
use ivcam_script::JavaScript;

/// Takes a snapshot with scripts at a time in seconds.
fn at(document: &Document, time: f64) -> Snapshot<'_> {
    let options = SnapshotOptions {
        time,
        scripts: Some(&JavaScript),
        ..SnapshotOptions::default()
    };
    Snapshot::take(document, &options, &NoBounds)
}

fn scenes() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/scripts");
    let entries = std::fs::read_dir(folder).unwrap();
    let files = entries.map(|e| e.unwrap().path());
    let mut files: Vec<PathBuf> = files
        .filter(|p| p.extension().is_some_and(|e| e == "wrl"))
        .collect();
    files.sort();
    files
}

/// Returns the value at a path such as `Root.children.0.translation`.
fn find<'a>(document: &'a Document, path: &str) -> &'a Value {
    let mut parts = path.split('.');
    let name = parts.next().unwrap();
    let mut node = document.node(document.names[name]);
    let mut value: Option<&Value> = None;
    for part in parts {
        match (part.parse::<usize>(), value) {
            (Ok(i), Some(Value::Nodes(nodes))) => {
                let id = nodes
                    .get(i)
                    .unwrap_or_else(|| panic!("no element {i} in {path}"));
                node = document.node(*id);
            }
            _ => {
                if let Some(Value::Node(Some(id))) = value {
                    node = document.node(*id);
                }
                value = Some(
                    node.value(part)
                        .unwrap_or_else(|| panic!("no `{part}` in {path}")),
                );
            }
        }
    }
    value.unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    let text = format!("{value:?}")
        .replace("Vec3(", " ")
        .replace("Vec2(", " ");
    let words = text.split(|c: char| !(c.is_ascii_alphanumeric() || "+-.".contains(c)));
    words.filter_map(|w| w.parse().ok()).collect()
}

fn describe(document: &Document, id: NodeId) -> String {
    let node = NodeRef { document, id };
    let class = document.node(id).class_name().to_owned();
    match &node.data().name {
        Some(name) => format!("{class}:{name}"),
        None => class,
    }
}

fn matches(document: &Document, value: &Value, stated: &str) -> Result<(), String> {
    let found = match value {
        Value::Nodes(nodes) => {
            let all: Vec<_> = nodes.iter().map(|n| describe(document, *n)).collect();
            all.join(" ")
        }
        Value::Strings(texts) => {
            let all: Vec<_> = texts.iter().map(|t| format!("\"{t}\"")).collect();
            all.join(" ")
        }
        Value::Image(image) => {
            let pixels = image.bytes.chunks(usize::from(image.components));
            let pixels = pixels.map(|p| {
                p.iter()
                    .fold(0_u32, |n, b| n << 8 | u32::from(*b))
                    .to_string()
            });
            let head =
                [image.width, image.height, u32::from(image.components)].map(|n| n.to_string());
            head.into_iter().chain(pixels).collect::<Vec<_>>().join(" ")
        }
        value => {
            let found = match value {
                Value::Rotation(r) => [r.axis.x, r.axis.y, r.axis.z, r.angle]
                    .map(f64::from)
                    .to_vec(),
                value => numbers(value),
            };
            let words = stated.split([' ', ',']).filter(|w| !w.is_empty());
            let wanted: Vec<f64> = words.map(|w| w.parse().unwrap()).collect();
            let near = |(a, b): (&f64, &f64)| (a - b).abs() < 2e-5;
            let same = found.len() == wanted.len() && found.iter().zip(&wanted).all(near);
            return if same {
                Ok(())
            } else {
                Err(format!("{found:?}"))
            };
        }
    };
    if found == stated { Ok(()) } else { Err(found) }
}

fn check(path: &Path) -> Vec<String> {
    let name = path.file_name().unwrap().to_string_lossy().into_owned();
    let text = std::fs::read_to_string(path).unwrap();
    let document = Document::open(path).unwrap();
    let mut wrong = Vec::new();
    let mut stated = 0;
    let mut said: Vec<String> = document
        .sink
        .items()
        .iter()
        .map(|d| d.message.clone())
        .collect();
    for line in text.lines() {
        let Some((place, value)) = line.strip_prefix("# at ").and_then(|l| l.split_once(':'))
        else {
            continue;
        };
        stated += 1;
        let (time, path) = place.split_once(' ').unwrap();
        let played = at(&document, time.parse().unwrap());
        for diagnostic in played.diagnostics() {
            if !said.contains(&diagnostic.message) {
                said.push(diagnostic.message.clone());
            }
        }
        let found = find(played.document(), path);
        if let Err(found) = matches(played.document(), found, value.trim()) {
            wrong.push(format!("{name}: at {place} is {found}"));
        }
    }
    assert!(stated > 0, "{name} states nothing");
    let mut expected: Vec<&str> = text
        .lines()
        .filter_map(|l| l.strip_prefix("# says: "))
        .collect();
    expected.sort_unstable();
    said.sort_unstable();
    if said != expected {
        wrong.push(format!("{name}: says {said:?}"));
    }
    wrong
}

#[test]
fn every_scene_with_scripts_is_at_each_time_as_it_states() {
    let scenes = scenes();
    assert!(scenes.len() >= 40, "found only {} scenes", scenes.len());
    let wrong: Vec<String> = scenes.iter().flat_map(|path| check(path)).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_scene_with_scripts_is_the_same_every_time() {
    let path = scenes()
        .into_iter()
        .find(|p| p.ends_with("random.wrl"))
        .unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let text = text.replace("out = all", "out = Math.random(); all = all");
    let read = || {
        let loader = std::sync::Arc::new(ivcam_inventor::iv::NoFiles);
        let limits = ivcam_inventor::iv::Limits::default();
        Document::read("random.wrl", text.clone().into_bytes(), loader, &limits).unwrap()
    };
    let value = || {
        let document = read();
        let played = at(&document, 0.0);
        find(played.document(), "M.transparency").clone()
    };
    let first = value();
    assert_ne!(first, Value::Float(0.0));
    assert_eq!(first, value());
}
