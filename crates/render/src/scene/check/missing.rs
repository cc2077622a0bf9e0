//! Finds files that a scene names and that cannot be read.

use ivcam_base::diag::{Diagnostic, ErrorKind, Severity, excerpt, excerpt_path};
use ivcam_base::memory::MemoryBudget;
use ivcam_inventor::grammar::{class, inline, www_inline};
use ivcam_inventor::iv::NodeId;
use ivcam_inventor::snapshot::Snapshot;

use crate::scene::looks::{FileField, PANORAMA, PICTURES, TextureFiles};
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
    for index in 0..document.nodes.len() {
        let id = NodeId(index as u32);
        let node = document.node(id);
        let Some(class) = node.known_class().filter(|_| !document.is_template(id)) else {
            continue;
        };
        let pictures: Vec<&[FileField]> = match class.id {
            class::TEXTURE2 | class::TEXTURE3 | class::IMAGE | class::IMAGE_TEXTURE => {
                vec![&PICTURES]
            }
            class::BACKGROUND | class::VRML97_BACKGROUND => PANORAMA.chunks(1).collect(),
            class::FILE | class::WWW_INLINE | class::INLINE
                if !document.included.contains_key(&id) =>
            {
                for field in INCLUDED {
                    // A file that can be read but is not included includes itself or is not a
                    // scene.
                    let names = field.names(node).filter(|n| !n.starts_with('<'));
                    missing.extend(names.filter_map(|name| {
                        let error = document.load_beside(id, name).err()?;
                        Some(Missing {
                            name: shortened(name),
                            diagnostic: None,
                            outside: error.kind == ErrorKind::OutsideFolder,
                            opened: None,
                        })
                    }));
                }
                continue;
            }
            _ => continue,
        };
        for fields in pictures {
            // Pictures are not kept.
            let mut files = TextureFiles::new(&options.texture_folders, options.colors);
            let mut memory = MemoryBudget::new(options.memory);
            if let Err(diagnostic) = files.of_fields(node, fields, &mut memory) {
                let mut names = fields.iter().flat_map(|field| field.names(node));
                let name = names.next().unwrap_or_default();
                let opened = document.load_beside(id, name).ok();
                missing.push(Missing {
                    name: shortened(name),
                    opened: opened.map(|(file, _)| file),
                    outside: diagnostic.kind == ErrorKind::OutsideFolder,
                    diagnostic: Some(diagnostic.at_most(Severity::Warning)),
                });
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
