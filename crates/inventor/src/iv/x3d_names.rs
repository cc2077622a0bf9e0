//! The names of X3D for fields and events that the catalogue has under VRML97's names.

/// Each class with the name in X3D and the name in VRML97.
const RENAMED: [(&str, &str, &str); 5] = [
    ("LOD", "children", "level"),
    ("Switch", "children", "choice"),
    ("Collision", "enabled", "collide"),
    // VRML97's `controlPoint` has the points themselves, and X3D's a node.
    ("NurbsCurve", "controlPoint", "coord"),
    ("NurbsPatchSurface", "controlPoint", "coord"),
];

/// Returns VRML97's name of a field or event of X3D, such as `set_choice` for `set_children`.
pub(super) fn in_vrml97(class: &str, name: &str) -> Option<Box<str>> {
    renamed(
        name,
        RENAMED.map(|(of, x3d, vrml97)| (of == class, x3d, vrml97)),
    )
}

/// Returns X3D's name of a field or event of VRML97.
pub(super) fn in_x3d(class: &str, name: &str) -> Option<Box<str>> {
    renamed(
        name,
        RENAMED.map(|(of, x3d, vrml97)| (of == class, vrml97, x3d)),
    )
}

/// Replaces the name of the field in the name of a field or event.
fn renamed(name: &str, fields: [(bool, &str, &str); 5]) -> Option<Box<str>> {
    let (_, from, to) = fields.into_iter().find(|(is_class, from, _)| {
        let field = name.strip_prefix("set_").unwrap_or(name);
        *is_class && field.strip_suffix("_changed").unwrap_or(field) == *from
    })?;
    Some(name.replace(from, to).into())
}
