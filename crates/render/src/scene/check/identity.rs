//! What a file is, beside what its name promises, and how much it draws.

use indexmap::IndexMap;
use ivcam_base::diag::counted;
use ivcam_inventor::iv::Document;

/// Endings of names, with the beginning and the end of the formats that they promise, as headers
/// state them.
const PROMISES: [(&str, &str, &str); 12] = [
    (".iv", "Inventor ", ""),
    (".wrl", "VRML ", ""),
    (".wrz", "VRML ", ""),
    (".vrml", "VRML ", ""),
    (".x3d", "X3D ", "XML"),
    (".x3dz", "X3D ", "XML"),
    (".x3dv", "X3D ", "utf8"),
    (".gltf", "glTF ", "0"),
    (".glb", "glTF ", "binary"),
    (".obj", "OBJ", ""),
    (".ply", "PLY ", ""),
    (".stl", "STL", ""),
];

/// The endings of the names of scene files. Each may be followed by `.gz`.
pub(super) fn endings() -> impl Iterator<Item = &'static str> {
    PROMISES.iter().map(|(ending, ..)| *ending)
}

/// Classes of shapes that are drawn exactly and have no triangles.
const ROUND: [&str; 3] = ["Sphere", "Cone", "Cylinder"];

/// Returns the ending of a file's name if the content is of another format, such as `.iv` of a
/// file of VRML 1.0, or `.gz` of a file that is not packed. A packed file need not be named so:
/// files of VRML usually are not.
pub fn unexpected_ending(path: &str, document: &Document) -> Option<&'static str> {
    let lower = path.to_ascii_lowercase();
    let name = lower.strip_suffix(".gz");
    if name.is_some() && !document.is_gzipped {
        return Some(".gz");
    }
    let name = name.unwrap_or(&lower);
    let (ending, start, end) = PROMISES.iter().find(|(e, ..)| name.ends_with(e))?;
    let format = &document.format;
    (!format.starts_with(start) || !format.ends_with(end)).then_some(ending)
}

/// Returns how a file is packed: `gzip`, or `None` if it is not.
pub fn packed(document: &Document) -> Option<&'static str> {
    document.is_gzipped.then_some("gzip")
}

/// Returns the format of a file with how it is packed and an ending that does not fit, as in
/// `VRML V1.0 ascii in gzip, named .iv`.
pub(super) fn format_text(path: &str, document: &Document) -> String {
    let packed = packed(document).map(|packed| format!(" in {packed}"));
    let ending = unexpected_ending(path, document).map(|ending| format!(", named `{ending}`"));
    let parts = [packed, ending].into_iter().flatten();
    document.format.clone() + &parts.collect::<String>()
}

/// Returns the number of shapes that are drawn exactly and so have no triangles: spheres, cones and
/// cylinders. `shapes` are the numbers of shapes by class, as of a survey.
pub fn round_solids<'a>(shapes: impl IntoIterator<Item = (&'a str, u64)>) -> u64 {
    let round = shapes
        .into_iter()
        .filter(|(class, _)| ROUND.contains(class));
    round.map(|(_, count)| count).sum()
}

/// Returns the number of round solids, as `1 round solid`, or `None` if there are none.
pub(super) fn round_text(shapes: &IndexMap<&'static str, u64>) -> Option<String> {
    let round = round_solids(shapes.iter().map(|(class, count)| (*class, *count)));
    (round > 0).then(|| counted(round as usize, "round solid"))
}

/// Returns what is drawn: `12 triangles`, `1 round solid`, or both. Round solids have no triangles.
pub(super) fn drawn_text(triangles: u64, shapes: &IndexMap<&'static str, u64>) -> String {
    let flat = counted(triangles as usize, "triangle");
    match (round_text(shapes), triangles) {
        (Some(round), 0) => round,
        (Some(round), _) => format!("{round}, {flat}"),
        (None, _) => flat,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivcam_inventor::iv::{Limits, NoFiles};
    use std::sync::Arc;

    #[test]
    fn an_ending_that_does_not_fit_the_content_is_named() {
        let read = |text: &str| {
            let bytes = text.as_bytes().to_vec();
            Document::read("a", bytes, Arc::new(NoFiles), &Limits::default()).unwrap()
        };
        let inventor = read("#Inventor V2.1 ascii\n");
        let old = read("#VRML V1.0 ascii\n");
        for (path, document, expected) in [
            ("a/b.IV", &inventor, None),
            ("b.wrl", &inventor, Some(".wrl")),
            ("b.iv", &old, Some(".iv")),
            ("b.wrl", &old, None),
            ("b.wrl.gz", &old, Some(".gz")),
            ("b.txt", &old, None),
            ("-", &old, None),
        ] {
            assert_eq!(unexpected_ending(path, document), expected, "{path}");
        }
        let mut packed = old.clone();
        packed.is_gzipped = true;
        for path in ["b.wrl", "b.wrl.gz", "b.wrz"] {
            assert_eq!(unexpected_ending(path, &packed), None, "{path}");
        }
        let text = format_text("b.iv", &packed);
        assert_eq!(text, "VRML V1.0 ascii in gzip, named `.iv`");
    }

    #[test]
    fn round_solids_are_counted_beside_triangles() {
        let drawn = |triangles, shapes: &[(&'static str, u64)]| {
            drawn_text(triangles, &shapes.iter().copied().collect())
        };
        assert_eq!(drawn(0, &[]), "0 triangles");
        assert_eq!(drawn(0, &[("Sphere", 1)]), "1 round solid");
        let both = drawn(12, &[("Cone", 1), ("Cylinder", 2), ("Cube", 1)]);
        assert_eq!(both, "3 round solids, 12 triangles");
    }
}
