//! The fields of node classes: their types, declarations and typed handles.

use std::marker::PhantomData;

use super::class_id::ClassId;

/// The declaration of a field in the catalogue.
#[derive(Debug)]
pub struct FieldDecl {
    /// The name of the field in files.
    pub name: &'static str,
    /// The type of its values.
    pub kind: FieldType,
    /// The default.
    pub default: Default,
    /// The names and values of an enumeration or bit mask.
    pub names: &'static [(&'static str, i64)],
    /// The legal range as text, for the manual. Values outside it are accepted.
    pub range: Option<&'static str>,
    /// Whether X3D has the field and VRML97, which has the class, does not.
    pub x3d: bool,
}

/// A default as the catalogue states it.
#[derive(Debug)]
pub enum Default {
    /// Zero, an empty list, `NULL` or the identity, depending on the type.
    Nothing,
    /// The numbers of all values one after another. A Boolean is 0 or 1.
    Numbers(&'static [f64]),
    /// The strings.
    Strings(&'static [&'static str]),
}

macro_rules! field_types {
    ($($name:ident)*) => {
        /// The type of a field, by Inventor's name. `SF` types have one value and `MF` types a
        /// list.
        #[allow(clippy::upper_case_acronyms)]
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum FieldType {
            $(#[doc = concat!("Inventor's type `", stringify!($name), "`.")] $name),*
        }

        impl FieldType {
            /// All field types.
            pub const ALL: &'static [Self] = &[$(Self::$name),*];

            /// Returns Inventor's name of the type.
            pub fn name(self) -> &'static str {
                match self { $(Self::$name => stringify!($name)),* }
            }

            /// Finds a type by Inventor's name. The old names `SFLong`, `SFULong`, `MFLong` and
            /// `MFULong` mean the 32-bit types. X3D's types of colors with alpha and of matrices
            /// are Inventor's types of four numbers and of matrices.
            pub fn named(name: &str) -> Option<Self> {
                let name = match name {
                    "SFLong" => "SFInt32",
                    "MFLong" => "MFInt32",
                    "SFULong" => "SFUInt32",
                    "MFULong" => "MFUInt32",
                    "SFColorRGBA" => "SFVec4f",
                    "MFColorRGBA" => "MFVec4f",
                    "SFMatrix4f" => "SFMatrix",
                    "MFMatrix4f" => "MFMatrix",
                    other => other,
                };
                Self::ALL.iter().copied().find(|k| k.name() == name)
            }

            /// Returns the number of numbers in one value, or 1 if the value has no numbers.
            pub fn width(self) -> usize {
                match self.name().trim_start_matches(['S', 'M']).trim_start_matches('F') {
                    "Vec2f" | "Vec2s" | "Vec2i32" => 2,
                    "Vec3f" | "Color" | "Vec3i32" | "Vec3d" => 3,
                    "Vec4f" | "Vec4i32" | "Rotation" | "Plane" => 4,
                    "Matrix" => 16,
                    _ => 1,
                }
            }

            /// Returns whether a field of this type has a list of values.
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

/// A typed handle of a field, whose value is read as a `T`.
pub struct Field<T: ?Sized> {
    /// The class that declares the field.
    pub class: ClassId,
    /// The index of the field among the fields of the class.
    pub index: u16,
    kind: PhantomData<fn() -> Box<T>>,
}

impl<T: ?Sized> Field<T> {
    /// Creates a handle from the indices of the class and the field.
    pub(crate) const fn new(class: u16, index: u16) -> Self {
        Self {
            class: ClassId(class),
            index,
            kind: PhantomData,
        }
    }

    /// Returns the field's declaration in the catalogue.
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
