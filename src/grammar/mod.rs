//! The node catalogue: every node class, its fields, types, defaults and dialects, as data.
//!
//! Generated from `grammar/*.nodes`, whose format is in `grammar/README.md`. A class is found by
//! dialect and name; a field by a typed handle (`cone::BOTTOM_RADIUS`) that cannot be misspelt.

use std::collections::HashMap;
use std::marker::PhantomData;
use std::sync::OnceLock;

/// Which languages know a class, as a set of bits.
pub struct Dialect;

impl Dialect {
    pub const IV1: u8 = 1;
    pub const IV2: u8 = 2;
    pub const VRML1: u8 = 4;
    pub const VRML97: u8 = 8;
    /// Classes that only Coin and its relatives know.
    pub const COIN: u8 = 16;
}

/// What becomes of a node of a class.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Treatment {
    /// Has a picture.
    Rendered,
    /// Changes the traversal state.
    State,
    /// Has children that are walked.
    Group,
    /// Read and written back, not drawn.
    Kept,
    /// A family; no node is of it.
    Abstract,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ClassId(pub u16);

impl ClassId {
    pub fn get(self) -> &'static Class {
        &CLASSES[usize::from(self.0)]
    }
}

#[derive(Debug)]
pub struct Class {
    pub id: ClassId,
    pub name: &'static str,
    pub family: &'static str,
    /// A set of [`Dialect`] bits.
    pub dialects: u8,
    pub treatment: Treatment,
    pub fields: &'static [FieldDecl],
    /// VRML97's `eventIn`s that are not fields.
    pub inputs: &'static [(&'static str, FieldType)],
    /// The outputs of an engine; VRML97's `eventOut`s that are not fields.
    pub outputs: &'static [(&'static str, FieldType)],
    /// A node kit's parts, those of one parent in the order in which they are walked.
    pub parts: &'static [Part],
    /// Where the catalogue declares it.
    pub place: &'static str,
}

impl Class {
    pub fn field(&self, name: &str) -> Option<(usize, &'static FieldDecl)> {
        self.fields.iter().enumerate().find(|(_, f)| f.name == name)
    }

    /// Whether the class is, or descends from, the family of that name.
    pub fn is_a(&self, family: &str) -> bool {
        let mut class = self;
        loop {
            if class.name == family || class.family == family {
                return true;
            }
            match by_name(class.family, class.dialects).or_else(|| any(class.family)) {
                Some(parent) if parent.id != class.id => class = parent,
                _ => return false,
            }
        }
    }
}

#[derive(Debug)]
pub struct FieldDecl {
    pub name: &'static str,
    pub kind: FieldType,
    pub default: Default,
    /// Names of an enumeration's or bit mask's values.
    pub names: &'static [(&'static str, i64)],
    /// The legal range, for the manual and for hints.
    pub range: Option<&'static str>,
}

/// A part of a node kit. Each is also a field, an `SFNode` of the same name.
#[derive(Debug)]
pub struct Part {
    pub name: &'static str,
    /// The part it is a child of; `this` is the kit itself.
    pub parent: &'static str,
    /// The class that the kit makes where a file does not say.
    pub class: &'static str,
    /// Holds a `NodeKitListPart`.
    pub list: bool,
    /// Made by the kit itself; others come when a file states them (or a part below them).
    pub made: bool,
}

/// A default as the catalogue states it; a Boolean is 0 or 1.
#[derive(Debug)]
pub enum Default {
    Nothing,
    Numbers(&'static [f64]),
    Strings(&'static [&'static str]),
}

macro_rules! field_types {
    ($($name:ident)*) => {
        /// Inventor's field types, by Inventor's names.
        #[allow(clippy::upper_case_acronyms)]
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum FieldType { $($name),* }

        impl FieldType {
            pub const ALL: &'static [Self] = &[$(Self::$name),*];

            pub fn name(self) -> &'static str {
                match self { $(Self::$name => stringify!($name)),* }
            }

            /// By Inventor's name; the old `SFLong`, `SFULong` and theirs are the 32-bit ones.
            pub fn named(name: &str) -> Option<Self> {
                let name = match name {
                    "SFLong" => "SFInt32",
                    "MFLong" => "MFInt32",
                    "SFULong" => "SFUInt32",
                    "MFULong" => "MFUInt32",
                    other => other,
                };
                Self::ALL.iter().copied().find(|k| k.name() == name)
            }

            /// How many numbers one value has; 1 for what is not numbers.
            pub fn width(self) -> usize {
                match self.name().trim_start_matches(['S', 'M']).trim_start_matches('F') {
                    "Vec2f" | "Vec2s" | "Vec2i32" => 2,
                    "Vec3f" | "Color" | "Vec3i32" | "Vec3d" => 3,
                    "Vec4f" | "Vec4i32" | "Rotation" | "Plane" => 4,
                    "Matrix" => 16,
                    _ => 1,
                }
            }

            pub fn is_multiple(self) -> bool {
                self.name().starts_with("MF")
            }
        }
    };
}

field_types! {
    SFBool SFInt32 SFUInt32 SFShort SFUShort SFFloat SFDouble SFTime SFString SFName SFEnum SFBitMask
    SFVec2f SFVec3f SFVec4f SFVec2s SFVec2i32 SFVec3i32 SFVec4i32 SFVec3d
    SFColor SFRotation SFMatrix SFPlane SFImage SFImage3 SFNode SFPath SFEngine SFTrigger
    MFBool MFInt32 MFUInt32 MFShort MFUShort MFFloat MFDouble MFTime MFString MFName MFEnum
    MFVec2f MFVec3f MFVec4f MFVec2i32 MFVec3i32 MFVec4i32 MFVec3d
    MFColor MFRotation MFMatrix MFPlane MFNode
}

/// A field of a class whose value is read as a `T`.
pub struct Field<T: ?Sized> {
    pub class: ClassId,
    pub index: u16,
    kind: PhantomData<fn() -> Box<T>>,
}

impl<T: ?Sized> Field<T> {
    pub(crate) const fn new(class: u16, index: u16) -> Self {
        Self {
            class: ClassId(class),
            index,
            kind: PhantomData,
        }
    }

    pub fn decl(&self) -> &'static FieldDecl {
        &self.class.get().fields[usize::from(self.index)]
    }
}

impl<T: ?Sized> Clone for Field<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T: ?Sized> Copy for Field<T> {}

/// The class of that name in any of the dialects (a set of bits), the first declared winning.
pub fn by_name(name: &str, dialects: u8) -> Option<&'static Class> {
    index()
        .get(name)?
        .iter()
        .map(|id| id.get())
        .find(|c| c.dialects & dialects != 0)
}

/// The class of that name in whatever dialect knows it; people mix them.
pub fn any(name: &str) -> Option<&'static Class> {
    index().get(name)?.first().map(|id| id.get())
}

fn index() -> &'static HashMap<&'static str, Vec<ClassId>> {
    static INDEX: OnceLock<HashMap<&'static str, Vec<ClassId>>> = OnceLock::new();
    INDEX.get_or_init(|| {
        let mut map: HashMap<&'static str, Vec<ClassId>> = HashMap::new();
        for class in CLASSES {
            map.entry(class.name).or_default().push(class.id);
        }
        map
    })
}

pub mod value;

mod catalogue {
    #![allow(clippy::all)]
    #![allow(dead_code, unused_imports)]
    use super::value::{
        Choice, Image, NodeId, NodeRefValue, Plane, Rotation, Seconds, Text, Trigger,
    };
    use super::{Class, ClassId, Default, Dialect, Field, FieldDecl, FieldType, Part, Treatment};
    use glam::{Mat4, Vec2, Vec3, Vec4};

    include!(concat!(env!("OUT_DIR"), "/catalogue.rs"));
}

pub use catalogue::*;

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
    fn parts_of_a_kit_stand_in_the_order_in_which_they_are_walked() {
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
    fn a_vectors_default_is_whole_vectors() {
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
