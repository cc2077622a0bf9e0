//! The declarations in the catalogue's files, and the keywords that they may use.

/// A node class.
pub struct Class {
    pub name: String,
    /// The name of the base class.
    pub family: String,
    pub dialects: Vec<String>,
    pub treatment: String,
    /// The effect of a node on traversal. If the class line does not state it, it is empty until
    /// [`super::inherit`] has run.
    pub role: String,
    /// The index of the base class, if the catalogue declares it.
    pub parent: Option<usize>,
    pub fields: Vec<Field>,
    /// The name and type of each `eventIn`.
    pub inputs: Vec<(String, String)>,
    /// The name and type of each engine output or `eventOut`.
    pub outputs: Vec<(String, String)>,
    pub parts: Vec<Part>,
    /// The file and line of the declaration.
    pub place: String,
}

/// A part of a node kit: `part camera of transformGroup PerspectiveCamera`.
#[derive(Clone)]
pub struct Part {
    pub name: String,
    /// The part that this part is a child of; `this` is the kit.
    pub parent: String,
    /// The sibling that follows this part.
    pub before: Option<String>,
    pub class: String,
    /// Whether the part contains a `NodeKitListPart`.
    pub list: bool,
    /// Whether the kit always creates the part. Other parts exist only if a file states them.
    pub made: bool,
}

/// A field of a class.
#[derive(Clone)]
pub struct Field {
    /// Inventor's name of the type.
    pub kind: String,
    pub name: String,
    /// The default as the catalogue writes it.
    pub default: String,
    /// The names and values of an enumeration or bit mask.
    pub names: Vec<(String, i64)>,
    /// The legal range.
    pub range: Option<String>,
    /// Whether only X3D has the field, of the dialects that have the class.
    pub x3d: bool,
}

/// The keywords of the dialects.
pub const DIALECTS: [&str; 6] = ["iv1", "iv2", "vrml1", "vrml97", "coin", "x3d"];

/// The treatments, each with the roles that its classes may have. The first role is the default. An
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
    ("kept", &["kept", "sensor"]),
    ("abstract", &["kept"]),
];

/// The field types, each with the Rust type of its handle.
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
