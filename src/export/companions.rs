//! The files that a scene still names after it was rewritten: textures, inlined scenes and
//! external prototypes.
//!
//! A rewritten scene keeps its addresses. So the files are carried along into the folder of the
//! output, to the places where the addresses lead, and what cannot be carried is a loss.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use ivcam_base::files::{MAX_PICTURE, folder_of, read_file};
use ivcam_base::platform::real_path;
use ivcam_inventor::grammar::value::Value;
use ivcam_inventor::iv::{Document, Node};
use ivcam_render::scene::model::Place;

use super::conversion::Conversion;

/// The most names in a list that may be addresses of one file.
const ADDRESSES: usize = 8;

impl Conversion {
    /// Adds the files that the output still names to those beside it, unless it is in the
    /// folder of the scene. `rewritten` are scenes that are converted to their own names.
    pub(crate) fn carry_files(
        &mut self,
        document: &Document,
        [scene, output]: [&Path; 2],
        rewritten: &BTreeSet<PathBuf>,
    ) {
        if !self.keeps_addresses {
            return;
        }
        let to = folder_of(output);
        let Ok(from) = real_path(&folder_of(scene)) else {
            return;
        };
        if real_path(&to).is_ok_and(|to| to == from) {
            return;
        }
        for (file, name) in named_files(document, scene) {
            if rewritten.contains(&file) {
                continue;
            }
            let result = match file.strip_prefix(&from) {
                Ok(below) => carried(&file, below, &to),
                Err(_) => Err("it is outside the scene's folder".to_owned()),
            };
            match result {
                Ok(Some(beside)) => self.beside.push(beside),
                Ok(None) => {}
                Err(why) => {
                    let text = format!("`{name}` is not carried along: {why}");
                    self.losses.add("file", text, Place::default(), 1);
                }
            }
        }
    }
}

/// Returns the name and bytes of a file that is to be beside an output, or `None` if it is there.
fn carried(
    file: &Path,
    below: &Path,
    to: &Path,
) -> std::result::Result<Option<(String, Vec<u8>)>, String> {
    let bytes = read_file(file, MAX_PICTURE).map_err(|e| e.message)?;
    let there = to.join(below);
    if !there.exists() {
        return Ok(Some((below.to_string_lossy().into_owned(), bytes)));
    }
    match read_file(&there, MAX_PICTURE) {
        Ok(same) if same == bytes => Ok(None),
        _ => Err(format!("`{}` is another file", there.display())),
    }
}

/// Returns the files that a scene and the files in it name, by their canonical paths, with the name
/// of each. The scene itself is not among them.
fn named_files(document: &Document, scene: &Path) -> BTreeMap<PathBuf, String> {
    let folders: Vec<PathBuf> = (document.sources.iter().enumerate())
        .map(|(i, source)| match i {
            0 => folder_of(scene),
            _ => folder_of(Path::new(&*source.name)),
        })
        .collect();
    let mut files = BTreeMap::new();
    for path in document.opened_files() {
        files.insert(path.clone(), path.display().to_string());
    }
    for node in &document.nodes {
        let Some(folder) = folders.get(node.source as usize) else {
            continue;
        };
        for name in strings(node).filter(|name| !name.is_empty()) {
            let file = folder.join(name);
            if file.is_file()
                && let Ok(path) = real_path(&file)
            {
                files.insert(path, name.to_owned());
            }
        }
    }
    if let Ok(own) = real_path(scene) {
        files.remove(&own);
    }
    files
}

/// Returns the strings of a node that may be addresses.
fn strings(node: &Node) -> impl Iterator<Item = &str> {
    node.fields.iter().flat_map(|field| -> Vec<&str> {
        match &field.value {
            Value::String(name) => vec![name],
            Value::Strings(names) if names.len() <= ADDRESSES => {
                names.iter().map(String::as_str).collect()
            }
            _ => Vec::new(),
        }
    })
}
