//! Fields of node classes: types, declarations, and typed handles.

use std::marker::PhantomData;

use super::class_id::ClassId;

#[derive(Debug)]
pub struct FieldDecl {
    pub name: &'static str,
    pub kind: FieldType,
    pub default: Default,
    /// The names of an enumeration's or bit mask's values.
    pub names: &'static [(&'static str, i64)],
    /// The legal range, for the manual and for hints.
    pub range: Option<&'static str>,
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

            /// Finds a type by Inventor's name. `SFLong`, `SFULong` and their lists are the 32-bit
            /// types.
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

            /// Returns how many numbers one value has, or 1 if it has none.
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

    pub(crate) fn decl(&self) -> &'static FieldDecl {
        &self.class.get().fields[usize::from(self.index)]
    }
}

impl<T: ?Sized> Clone for Field<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T: ?Sized> Copy for Field<T> {}
