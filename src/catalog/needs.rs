//! What a scene needs beside its own file: other files, typefaces, and the unit of its lengths.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use ivcam_base::platform::real_path;
use ivcam_inventor::grammar::class;
use ivcam_inventor::grammar::value::Value;
use ivcam_inventor::iv::Document;
use ivcam_render::geometry::text::Fonts;
use ivcam_render::scene::check::Checked;

use super::entry::{NamedTypeface, Need};
use crate::archive::name_of;

/// Endings of textures.
const TEXTURES: [&str; 17] = [
    "png", "jpg", "jpeg", "gif", "bmp", "tif", "tiff", "rgb", "rgba", "sgi", "bw", "int", "inta",
    "ppm", "tga", "hdr", "exr",
];
/// Names that ask for a kind of letters, or for none.
const GENERIC: [&str; 5] = ["", "defaultFont", "SERIF", "SANS", "TYPEWRITER"];

/// Returns the files that a scene names. Paths below `folder` are relative to it.
pub(super) fn needs(checked: &Checked, document: &Document, folder: &Path) -> Vec<Need> {
    let scenes: HashSet<PathBuf> = document
        .sources
        .iter()
        .filter_map(|source| real_path(Path::new(&source.name)).ok())
        .collect();
    let unreadable = |path: &PathBuf| {
        let opened = checked.missing.iter().flat_map(|m| &m.opened);
        opened
            .flat_map(|file| real_path(Path::new(file)))
            .any(|file| file == *path)
    };
    let opened = document.opened_files().into_iter();
    let found = opened.filter(|path| !unreadable(path)).map(|path| Need {
        kind: kind(&path, scenes.contains(&path)).to_owned(),
        state: "found".to_owned(),
        size_and_time: size_and_time(&path),
        file: inside(&path, folder),
    });
    let others = checked.missing.iter().map(|missing| Need {
        kind: match missing.diagnostic {
            Some(_) => "texture",
            None => "scene",
        }
        .to_owned(),
        state: match (missing.outside, &missing.opened) {
            (true, _) => "outside",
            (false, Some(_)) => "unreadable",
            (false, None) => "missing",
        }
        .to_owned(),
        size_and_time: None,
        file: missing.name.clone(),
    });
    found.chain(others).collect()
}

fn kind(path: &Path, is_scene: bool) -> &'static str {
    let ending = path
        .extension()
        .unwrap_or_default()
        .to_string_lossy()
        .to_lowercase();
    match is_scene {
        true => "scene",
        false if TEXTURES.contains(&&*ending) => "texture",
        false => "other",
    }
}

/// Returns a path below the folder of scenes relative to it, with `/` between its parts.
pub(super) fn inside(path: &Path, folder: &Path) -> String {
    match path.strip_prefix(folder) {
        Err(_) => path.display().to_string(),
        Ok(rest) => name_of(rest),
    }
}

/// Returns the size of a file in bytes, and the time of its last modification in seconds.
pub(super) fn size_and_time(path: &Path) -> Option<(u64, u64)> {
    let about = path.metadata().ok()?;
    let time = about.modified().ok()?.duration_since(UNIX_EPOCH);
    Some((about.len(), time.map_or(0, |time| time.as_secs())))
}

/// Returns the typefaces that a scene names, each once.
pub(super) fn typefaces(document: &Document, fonts: &Fonts) -> Vec<NamedTypeface> {
    let mut names: Vec<&str> = Vec::new();
    for node in document.descendants() {
        let field = match node.class_id() {
            Some(class::FONT | class::FONT_STYLE) => "name",
            Some(class::VRML97_FONT_STYLE) => "family",
            _ => continue,
        };
        match node.value(field) {
            Some(Value::String(name)) => names.push(name),
            Some(Value::Strings(list)) => names.extend(list.iter().map(|name| &**name)),
            _ => {}
        }
    }
    names.retain(|name| !GENERIC.contains(name));
    names.sort_unstable();
    names.dedup();
    let typeface = |name: &str| NamedTypeface {
        name: name.to_owned(),
        found: fonts.has(name),
    };
    names.into_iter().map(typeface).collect()
}

/// Returns the units of length that a scene's `Units` nodes state, or the unit that the standard of
/// its format states.
pub(super) fn units(document: &Document) -> Option<String> {
    let mut names: Vec<&str> = Vec::new();
    for node in document
        .descendants()
        .filter(|node| node.class_id() == Some(class::UNITS))
    {
        let fields = node.class().map_or(&[][..], |class| class.fields);
        let (Some(field), Some(Value::Int(value))) = (fields.first(), node.value("units")) else {
            continue;
        };
        let name = field.names.iter().find(|(_, n)| *n == i64::from(*value));
        names.extend(
            name.map(|(name, _)| *name)
                .filter(|name| !names.contains(name)),
        );
    }
    let stated = names.join(", ").to_lowercase().replace('_', " ");
    // A format's version may follow its name.
    let format = document.format.split(' ').next();
    let has_no_unit = format.is_some_and(|name| ["OBJ", "PLY", "STL"].contains(&name));
    match (stated.is_empty(), has_no_unit) {
        (false, _) => Some(format!("{stated} (Units)")),
        (true, false) => Some("meters (the format's)".to_owned()),
        (true, true) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivcam_inventor::iv::{Limits, NoFiles};
    use std::sync::Arc;

    fn read(text: &str) -> Document {
        let bytes = text.as_bytes().to_vec();
        Document::read("a", bytes, Arc::new(NoFiles), &Limits::default()).unwrap()
    }

    const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n\
        property float y\nproperty float z\nend_header\n0 0 0\n";

    #[test]
    fn units_are_those_of_the_file_or_of_its_format() {
        let inventor = "#Inventor V2.1 ascii\nCube { }\n";
        let feet =
            "#Inventor V2.1 ascii\nUnits { units FEET } Cube { } Units { units NAUTICAL_MILES }\n";
        for (text, expected) in [
            (inventor, Some("meters (the format's)")),
            (feet, Some("feet, nautical miles (Units)")),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", None),
            (PLY, None),
        ] {
            assert_eq!(units(&read(text)).as_deref(), expected, "{text}");
        }
    }

    #[test]
    fn typefaces_are_listed_by_name_and_kinds_of_letters_are_not() {
        let names = |text: &str| {
            let list = typefaces(&read(text), &Fonts::default()).into_iter();
            list.map(|face| (face.name, face.found)).collect::<Vec<_>>()
        };
        let inventor =
            "#Inventor V2.1 ascii\nFont { name \"Utopia\" } Font { } Text3 { string \"a\" }\n";
        assert_eq!(names(inventor), [("Utopia".to_owned(), false)]);
        let vrml97 = "#VRML V2.0 utf8\nShape { geometry Text { string \"a\" fontStyle FontStyle {\n\
            family [ \"Lucida\", \"SANS\" ] } } }\n";
        assert_eq!(names(vrml97), [("Lucida".to_owned(), false)]);
    }
}
