//! Compares the events of a traversal of every scene under `tests/graph` with the file beside it.
//!
//! A scene shows one fact and states it. `UPDATE=1` rewrites the events; read them before they are
//! committed.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use ivcam_inventor::iv::{Document, NodeRef};
use ivcam_inventor::snapshot::Snapshot;
use ivcam_inventor::traversal::state::{LightElement, State};
use ivcam_inventor::traversal::{Visitor, WalkOptions, walk};

#[test]
fn every_walk_makes_the_events_beside_its_scene() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/graph");
    let mut scenes = Vec::new();
    find(&root, &mut scenes);
    scenes.sort();
    assert!(!scenes.is_empty(), "no scenes in {}", root.display());
    let wrong: Vec<String> = scenes
        .iter()
        .filter_map(|scene| Some(format!("{}: {}", scene.display(), compare(scene).err()?)))
        .collect();
    assert!(
        wrong.is_empty(),
        "{}",
        wrong.join(
            "
"
        )
    );
}

fn find(folder: &Path, scenes: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            find(&path, scenes);
        } else if path.extension().is_some_and(|e| e == "iv" || e == "wrl") {
            scenes.push(path);
        }
    }
}

#[derive(Default)]
struct Events(String);

/// Formats numbers with two decimals, and no sign on zero.
fn number(value: f64) -> String {
    let text = format!("{:.2}", value + 0.0);
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "0".into()
    } else {
        text.into()
    }
}

fn triple(values: [f64; 3]) -> String {
    values.map(number).join(" ")
}

impl<'a> Visitor<'a> for Events {
    fn shape(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        let m = state.world_from_object;
        let origin = m.transform_point3(glam::DVec3::ZERO);
        let x = m.transform_vector3(glam::DVec3::X);
        let color = state.material.diffuse_at(0).as_dvec3();
        let _ = write!(
            self.0,
            "{} at {} x-axis {} diffuse {}",
            node.class_name(),
            triple(origin.to_array()),
            triple(x.to_array()),
            triple(color.to_array())
        );
        let through = state.material.transparency_at(0);
        if through > 0.0 {
            let _ = write!(self.0, " transparency {}", number(f64::from(through)));
        }
        if state.is_unlit() {
            self.0.push_str(" unlit");
        }
        if !state.lights.is_empty() {
            let _ = write!(self.0, " lights {}", state.lights.backward().count());
        }
        self.0.push('\n');
    }

    fn light(&mut self, _node: NodeRef<'a>, light: &LightElement, _state: &State<'a>) {
        let at = triple(light.position.to_array());
        let _ = writeln!(self.0, "light {:?} at {at}", light.kind);
    }
}

fn compare(scene: &Path) -> Result<(), String> {
    let document = Document::open(scene).map_err(|e| e.message)?;
    let mut events = Events::default();
    let snapshot = Snapshot::at(&document, 0.0);
    walk(&snapshot, &WalkOptions::default(), &mut events);
    let expected = scene.with_extension("txt");
    if std::env::var_os("UPDATE").is_some() {
        std::fs::write(&expected, &events.0).map_err(|e| e.to_string())?;
        return Ok(());
    }
    let wanted = std::fs::read_to_string(&expected).map_err(|e| e.to_string())?;
    if wanted == events.0 {
        Ok(())
    } else {
        Err(format!("wanted\n{wanted}got\n{}", events.0))
    }
}
