//! Finds files that a scene names and that cannot be read.

use std::collections::HashSet;

use ivcam_base::diag::{Diagnostic, ErrorKind, Severity, excerpt, excerpt_path};
use ivcam_base::memory::MemoryBudget;
use ivcam_inventor::grammar::{class, inline, sound, www_inline};
use ivcam_inventor::iv::{Document, NodeId, NodeRef};
use ivcam_inventor::snapshot::Snapshot;

use crate::scene::looks::{FileField, PANORAMA, PICTURES, TextureFiles, shows_picture};
use crate::scene::options::CompileOptions;

/// A file that a scene names and that cannot be read.
pub struct Missing {
    /// The name in the scene.
    pub name: String,
    /// The reason. It is `None` for an included scene, which was reported when the document was
    /// read.
    pub diagnostic: Option<Box<Diagnostic>>,
    /// Whether the file is there, and outside the folders that may be read.
    pub outside: bool,
    /// The name of the file that was opened, if it is there and is no picture that can be read.
    pub opened: Option<String>,
}

/// The fields that name an included scene.
const INCLUDED: [FileField; 2] = [
    FileField::One(www_inline::NAME),
    FileField::Several(inline::URL),
];

/// Returns the name of a file, of which only the beginning if it is a URI with the bytes of a file
/// or longer than a name can be.
fn shortened(name: &str) -> String {
    let scheme = name.get(..5);
    match scheme.is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:")) {
        true => excerpt(name).into_owned(),
        false => excerpt_path(name).into_owned(),
    }
}

/// Returns the files that nodes name and that cannot be read. They are included scenes, which
/// reading the document has reported, and textures, which it has not opened.
pub fn missing(snapshot: &Snapshot<'_>, options: &CompileOptions) -> Vec<Missing> {
    let document = snapshot.document();
    let mut missing: Vec<Missing> = Vec::new();
    let sounds = sounds(document);
    for index in 0..document.nodes.len() {
        let id = NodeId(index as u32);
        let node = document.node(id);
        let Some(class) = node.known_class().filter(|_| !document.is_template(id)) else {
            continue;
        };
        let pictures: Vec<&[FileField]> = match class.id {
            class if shows_picture(class) && !sounds.contains(&id) => vec![&PICTURES],
            class::BACKGROUND | class::VRML97_BACKGROUND => PANORAMA.chunks(1).collect(),
            class::FILE | class::WWW_INLINE | class::INLINE
                if !document.included.contains_key(&id)
                    && node.find(inline::LOAD) != Some(false) =>
            {
                missing.extend(included(node));
                continue;
            }
            _ => continue,
        };
        // Pictures are not kept.
        let mut files = TextureFiles::new(&options.texture_folders);
        let mut memory = MemoryBudget::new(options.memory);
        for fields in pictures {
            let names = fields.iter().flat_map(|field| field.names(node));
            if class.id == class::TEXTURE3 {
                missing.extend(names.filter_map(|name| {
                    let error = files.file(node, name, options.colors, &mut memory).err()?;
                    let error = match node.source() {
                        Some(source) => error.at(source, node.span()),
                        None => error,
                    };
                    Some(picture(node, name, error))
                }));
            } else if let Err(error) = files.of_fields(node, fields, options.colors, &mut memory) {
                let name = names.into_iter().next().unwrap_or_default();
                missing.push(picture(node, name, error));
            }
        }
    }
    missing.sort_by(|a, b| a.name.cmp(&b.name));
    missing.dedup_by(|later, first| {
        let same = later.name == first.name;
        if let (true, Some(diagnostic), Some(_)) = (same, &mut first.diagnostic, &later.diagnostic)
        {
            diagnostic.count += 1;
        }
        same
    });
    missing
}

/// Returns the nodes that are sources of sound. A `MovieTexture` may be one.
pub(super) fn sounds(document: &Document) -> HashSet<NodeId> {
    let nodes = (0..document.nodes.len()).map(|index| document.node(NodeId(index as u32)));
    let sounds = nodes.filter(|node| node.class_id() == Some(class::SOUND));
    sounds
        .flat_map(|node| node.get_nodes(sound::SOURCE).iter().copied())
        .collect()
}

/// Returns the files of a node that includes a scene, and does not.
fn included(node: NodeRef<'_>) -> impl Iterator<Item = Missing> {
    // A file that can be read but is not included includes itself or is not a scene.
    let names = INCLUDED
        .into_iter()
        .flat_map(move |field| field.names(node));
    names
        .filter(|name| !name.starts_with('<'))
        .filter_map(move |name| {
            let error = node.document.load_beside(node.id, name).err()?;
            Some(Missing {
                name: shortened(name),
                diagnostic: None,
                outside: error.kind == ErrorKind::OutsideFolder,
                opened: None,
            })
        })
}

/// Returns the picture of a node that cannot be read.
fn picture(node: NodeRef<'_>, name: &str, error: Box<Diagnostic>) -> Missing {
    let opened = node.document.load_beside(node.id, name).ok();
    Missing {
        name: shortened(name),
        opened: opened.map(|(file, _)| file),
        outside: error.kind == ErrorKind::OutsideFolder,
        diagnostic: Some(error.at_most(Severity::Warning)),
    }
}
