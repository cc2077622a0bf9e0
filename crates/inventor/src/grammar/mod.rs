//! The node catalogue: every node class with its fields, types, defaults and dialects, as data.
//!
//! The catalogue is generated from `grammar/*.nodes`; `grammar/README.md` describes their format. A
//! class is found by its name and dialect, and a field by a typed handle such as
//! `cone::BOTTOM_RADIUS`.

mod catalogue;
mod class_id;
mod defaults;
mod entry;
mod field;
pub mod value;

pub use catalogue::*;
pub use class_id::ClassId;
pub(crate) use defaults::default_value;
pub use entry::{Class, Dialect, KitPart, Role, Treatment, any, by_name};
pub use field::{Default, Field, FieldDecl, FieldType};
pub use value::{
    Choice, Image, NodeId, NodeRefValue, Plane, Rotation, Seconds, Text, Trigger, Value,
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_name_is_another_class_in_another_dialect() {
        let inventor = by_name("Cone", Dialect::IV2).expect("Inventor has cones");
        let vrml97 = by_name("Cone", Dialect::VRML97).expect("VRML97 has cones");
        assert!(inventor.field("parts").is_some() && inventor.field("side").is_none());
        assert!(vrml97.field("parts").is_none() && vrml97.field("side").is_some());
    }

    #[test]
    fn a_family_gives_its_fields_to_its_members() {
        let camera = any("PerspectiveCamera").expect("in the catalogue");
        assert!(camera.field("nearDistance").is_some() && camera.is_a("Camera"));
    }

    #[test]
    fn parts_of_a_kit_are_in_the_order_of_traversal() {
        let kit = any("ShapeKit").expect("in the catalogue");
        let of_top: Vec<_> = kit
            .parts
            .iter()
            .filter(|p| p.parent == "topSeparator")
            .map(|p| p.name)
            .collect();
        let place = |name| of_top.iter().position(|p| *p == name);
        assert!(place("appearance") < place("transform"));
        assert!(place("transform") < place("coordinate3"));
        assert!(place("coordinate3") < place("childList"));
        assert!(place("childList") < place("shapeSeparator"));
        assert_eq!(of_top.last(), Some(&"shapeSeparator"));
    }

    #[test]
    fn the_default_of_a_vector_field_consists_of_complete_vectors() {
        for class in CLASSES {
            for field in class.fields {
                if let Default::Numbers(numbers) = field.default {
                    assert_eq!(
                        numbers.len() % field.kind.width(),
                        0,
                        "{}.{}",
                        class.name,
                        field.name
                    );
                }
            }
        }
    }
}
