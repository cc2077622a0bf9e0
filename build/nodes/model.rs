//! What the catalogue's files declare, and the words that they may use.

pub struct Class {
    pub name: String,
    pub family: String,
    pub dialects: Vec<String>,
    pub treatment: String,
    /// What happens when the walk meets a node of the class. Empty until [`super::inherit`] has run,
    /// if the class line does not state it.
    pub role: String,
    /// The index of the class's family, if the catalogue declares it.
    pub parent: Option<usize>,
    pub fields: Vec<Field>,
    pub inputs: Vec<(String, String)>,
    pub outputs: Vec<(String, String)>,
    pub parts: Vec<Part>,
    pub place: String,
}

/// A place in a node kit's catalogue: `part camera of transformGroup PerspectiveCamera`.
#[derive(Clone)]
pub struct Part {
    pub name: String,
    /// The part it is a child of; `this` is the kit.
    pub parent: String,
    pub before: Option<String>,
    pub class: String,
    pub list: bool,
    /// Made by the kit itself, not only when a file states it.
    pub made: bool,
}

#[derive(Clone)]
pub struct Field {
    pub kind: String,
    pub name: String,
    pub default: String,
    pub names: Vec<(String, i64)>,
    pub range: Option<String>,
}

pub const DIALECTS: [&str; 5] = ["iv1", "iv2", "vrml1", "vrml97", "coin"];
/// Every treatment with the roles that a class of it may have; the first is the usual one. An
/// abstract class may have any role, which its descendants inherit.
pub const TREATMENTS: [(&str, &[&str]); 5] = [
    ("rendered", &["shape", "appearance_and_geometry"]),
    (
        "state",
        &["property", "bindable", "light", "camera", "held"],
    ),
    (
        "group",
        &[
            "group",
            "separator",
            "transform_separator",
            "transform_group",
            "switch",
            "blinker",
            "path_switch",
            "array",
            "multiple_copy",
            "lod",
            "level_of_detail",
            "billboard",
            "file",
            "kit",
            "list_part",
        ],
    ),
    ("kept", &["kept"]),
    ("abstract", &["kept"]),
];

/// Every field type with the Rust type of its handle and the arm of `Value` that stores it.
pub const KINDS: [(&str, &str); 53] = [
    ("SFBool", "bool"),
    ("SFInt32", "i32"),
    ("SFUInt32", "u32"),
    ("SFShort", "i16"),
    ("SFUShort", "u16"),
    ("SFFloat", "f32"),
    ("SFDouble", "f64"),
    ("SFTime", "Seconds"),
    ("SFString", "Text"),
    ("SFName", "Text"),
    ("SFEnum", "Choice"),
    ("SFBitMask", "Choice"),
    ("SFVec2f", "Vec2"),
    ("SFVec3f", "Vec3"),
    ("SFVec4f", "Vec4"),
    ("SFColor", "Vec3"),
    ("SFRotation", "Rotation"),
    ("SFMatrix", "Mat4"),
    ("SFPlane", "Plane"),
    ("SFImage", "Image"),
    ("SFImage3", "Image"),
    ("SFVec2s", "[i32]"),
    ("SFVec2i32", "[i32]"),
    ("SFVec3i32", "[i32]"),
    ("SFVec4i32", "[i32]"),
    ("SFVec3d", "[f64]"),
    ("SFNode", "NodeRefValue"),
    ("SFPath", "NodeRefValue"),
    ("SFEngine", "NodeRefValue"),
    ("SFTrigger", "Trigger"),
    ("MFBool", "[bool]"),
    ("MFInt32", "[i32]"),
    ("MFUInt32", "[u32]"),
    ("MFShort", "[i16]"),
    ("MFUShort", "[u16]"),
    ("MFFloat", "[f32]"),
    ("MFDouble", "[f64]"),
    ("MFTime", "[Seconds]"),
    ("MFString", "[String]"),
    ("MFEnum", "[Choice]"),
    ("MFVec2f", "[Vec2]"),
    ("MFVec3f", "[Vec3]"),
    ("MFVec4f", "[Vec4]"),
    ("MFColor", "[Vec3]"),
    ("MFRotation", "[Rotation]"),
    ("MFMatrix", "[Mat4]"),
    ("MFPlane", "[Plane]"),
    ("MFName", "[String]"),
    ("MFVec2i32", "[i32]"),
    ("MFVec3i32", "[i32]"),
    ("MFVec4i32", "[i32]"),
    ("MFVec3d", "[f64]"),
    ("MFNode", "[NodeId]"),
];

/// Reads a decimal or hexadecimal integer.
pub fn number(text: &str) -> Option<i64> {
    match text.strip_prefix("0x") {
        Some(hex) => i64::from_str_radix(hex, 16).ok(),
        None => text.parse().ok(),
    }
}
