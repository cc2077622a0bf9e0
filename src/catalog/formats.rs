//! The identifiers of formats in registries, by the headers of files.

/// Beginnings of formats as headers state them, with the identifiers of PRONOM and the media types.
///
/// The identifiers are those of PRONOM's signature file 116 whose signature fits the header. It has
/// none for the classic encoding of X3D and for versions from 4.0. PRONOM knows media types of VRML
/// and binary glTF; the others are those of IANA, which has none for Inventor and PLY.
const FORMATS: [(&str, Option<&str>, Option<&str>); 15] = [
    ("Inventor V1.", Some("fmt/832"), None),
    ("Inventor V2.", Some("fmt/833"), None),
    ("VRML V1.0 ascii", Some("fmt/93"), Some("model/vrml")),
    ("VRML V2.0 utf8", Some("fmt/94"), Some("model/vrml")),
    ("X3D V3.0 XML", Some("fmt/579"), Some("model/x3d+xml")),
    ("X3D V3.1 XML", Some("fmt/580"), Some("model/x3d+xml")),
    ("X3D V3.2 XML", Some("fmt/581"), Some("model/x3d+xml")),
    ("X3D V3.3 XML", Some("fmt/582"), Some("model/x3d+xml")),
    ("X3D V4.0 XML", None, Some("model/x3d+xml")),
    ("X3D", None, Some("model/x3d-vrml")),
    ("PLY 1.0", Some("fmt/831"), None),
    ("OBJ", Some("fmt/1210"), Some("model/obj")),
    (
        "glTF 2.0 binary",
        Some("fmt/1316"),
        Some("model/gltf-binary"),
    ),
    ("glTF 2.0", Some("fmt/1315"), Some("model/gltf+json")),
    ("STL", None, Some("model/stl")),
];

/// The identifier of gzip in PRONOM, and its media type (RFC 6713).
pub(super) const GZIP: (&str, &str) = ("x-fmt/266", "application/gzip");

fn known(format: &str) -> Option<(Option<&'static str>, Option<&'static str>)> {
    let entry = FORMATS.iter().find(|(start, ..)| format.starts_with(start));
    entry.map(|(_, pronom, media)| (*pronom, *media))
}

/// Returns the identifier of a format in PRONOM, such as `fmt/94`. STL has one for text and another
/// for binary files, which its files do not state.
pub(super) fn pronom(format: &str, is_binary: bool) -> Option<&'static str> {
    match format {
        "STL" if is_binary => Some("fmt/865"),
        "STL" => Some("x-fmt/108"),
        _ => known(format)?.0,
    }
}

/// Returns the media type of a format, such as `model/vrml`.
pub(super) fn media_type(format: &str) -> Option<&'static str> {
    known(format)?.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_format_has_the_identifiers_of_its_version() {
        for (format, id, media) in [
            ("Inventor V1.0 binary", Some("fmt/832"), None),
            ("Inventor V2.1 ascii", Some("fmt/833"), None),
            ("VRML V1.0 ascii", Some("fmt/93"), Some("model/vrml")),
            ("VRML V2.0 utf8", Some("fmt/94"), Some("model/vrml")),
            ("X3D V3.3 XML", Some("fmt/582"), Some("model/x3d+xml")),
            ("X3D V3.3 utf8", None, Some("model/x3d-vrml")),
            ("glTF 2.0", Some("fmt/1315"), Some("model/gltf+json")),
            (
                "glTF 2.0 binary",
                Some("fmt/1316"),
                Some("model/gltf-binary"),
            ),
            ("VRML V3.0 utf8", None, None),
        ] {
            assert_eq!(
                (pronom(format, false), media_type(format)),
                (id, media),
                "{format}"
            );
        }
        assert_eq!(pronom("STL", true), Some("fmt/865"));
        assert_eq!(pronom("STL", false), Some("x-fmt/108"));
    }
}
