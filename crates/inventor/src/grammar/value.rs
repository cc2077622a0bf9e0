//! The values of fields, and how typed handles read them.

use std::sync::Arc;

use glam::{Mat4, Quat, Vec2, Vec3, Vec4};

use super::field::{Default, FieldDecl, FieldType};

/// A node of a `Document`, as its index in the arena.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(pub u32);

/// A rotation as the file states it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation {
    /// The axis, which may have any length.
    pub axis: Vec3,
    /// The angle in radians.
    pub angle: f32,
}

impl Rotation {
    /// The rotation by 0 about the z axis.
    pub const IDENTITY: Self = Self::new(Vec3::Z, 0.0);

    /// Creates a rotation about an axis of any length by an angle in radians.
    pub const fn new(axis: Vec3, angle: f32) -> Self {
        Self { axis, angle }
    }

    /// Creates a rotation from the axis and the angle, four numbers.
    fn from_numbers(numbers: &[f64]) -> Self {
        Self {
            axis: Vec3::new(numbers[0] as f32, numbers[1] as f32, numbers[2] as f32),
            angle: numbers[3] as f32,
        }
    }

    /// Returns the unit quaternion. An axis of length 0 gives the identity, as in Inventor.
    pub fn to_quat(self) -> Quat {
        let half = 0.5 * f64::from(self.angle);
        match self.axis.as_dvec3().try_normalize() {
            Some(axis) => {
                let v = axis * libm::sin(half);
                Quat::from_xyzw(v.x as f32, v.y as f32, v.z as f32, libm::cos(half) as f32)
            }
            None => Quat::IDENTITY,
        }
    }
}

/// The plane of the points p with p·normal = distance. The normal points into the half space that
/// is kept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// The normal, which may have any length.
    pub normal: Vec3,
    /// The product of the normal and each point of the plane.
    pub distance: f32,
}

/// The value of an `SFImage` or `SFImage3`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// The width in pixels.
    pub width: u32,
    /// The height in pixels.
    pub height: u32,
    /// The depth in pixels. It is 1 for an `SFImage`.
    pub depth: u32,
    /// The number of bytes per pixel, from 0 to 4: gray, gray and alpha, RGB or RGBA.
    pub components: u8,
    /// The pixels, in rows from the bottom up.
    pub bytes: Arc<[u8]>,
}

/// The value of an `SFEnum` or `SFBitMask`. The catalogue has the names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice(pub i32);

/// The value of an `SFTime`, in seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seconds(pub f64);

/// The handle type of a field that contains text.
pub struct Text;

/// The handle type of a field that contains a node.
pub struct NodeRefValue;

/// The handle type of a field that contains nothing and only sends events.
pub struct Trigger;

/// The value of a field.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// An `SFBool`.
    Bool(bool),
    /// An `SFInt32`, `SFShort`, `SFEnum` or `SFBitMask`.
    Int(i32),
    /// An `SFUInt32` or `SFUShort`.
    UInt(u32),
    /// An `SFFloat`.
    Float(f32),
    /// An `SFDouble`, or an `SFTime` in seconds.
    Double(f64),
    /// An `SFString` or `SFName`.
    String(Box<str>),
    /// An `SFVec2f`.
    Vec2(Vec2),
    /// An `SFVec3f` or `SFColor`.
    Vec3(Vec3),
    /// An `SFVec4f`.
    Vec4(Vec4),
    /// An `SFRotation`.
    Rotation(Rotation),
    /// An `SFMatrix` for row vectors, as Inventor writes it: the last four numbers are the
    /// translation.
    Matrix(Box<Mat4>),
    /// An `SFPlane`.
    Plane(Plane),
    /// An `SFImage` or `SFImage3`.
    Image(Box<Image>),
    /// An `SFNode` or `SFEngine`, or the head of an `SFPath`. `None` is `NULL`.
    Node(Option<NodeId>),
    /// An `SFTrigger`.
    Trigger,
    /// An `MFBool`.
    Bools(Vec<bool>),
    /// An `MFInt32`, `MFShort` or `MFEnum`, or the components of integer vectors such as `SFVec2s`
    /// and `MFVec2i32`.
    Ints(Vec<i32>),
    /// An `MFUInt32` or `MFUShort`.
    UInts(Vec<u32>),
    /// An `MFFloat`.
    Floats(Vec<f32>),
    /// An `MFDouble` or `MFTime`, or the components of an `SFVec3d` or `MFVec3d`.
    Doubles(Vec<f64>),
    /// An `MFString` or `MFName`.
    Strings(Vec<String>),
    /// An `MFVec2f`.
    Vec2s(Vec<Vec2>),
    /// An `MFVec3f` or `MFColor`.
    Vec3s(Vec<Vec3>),
    /// An `MFVec4f`.
    Vec4s(Vec<Vec4>),
    /// An `MFRotation`.
    Rotations(Vec<Rotation>),
    /// An `MFMatrix`.
    Matrices(Vec<Mat4>),
    /// An `MFPlane`.
    Planes(Vec<Plane>),
    /// An `MFNode`.
    Nodes(Vec<NodeId>),
}

impl Value {
    /// Returns whether no number in the value is NaN or infinite. Rotations, planes and integers
    /// are not checked.
    pub fn is_finite(&self) -> bool {
        match self {
            Self::Float(v) => v.is_finite(),
            Self::Double(v) => v.is_finite(),
            Self::Vec2(v) => v.is_finite(),
            Self::Vec3(v) => v.is_finite(),
            Self::Vec4(v) => v.is_finite(),
            Self::Matrix(v) => v.is_finite(),
            Self::Floats(v) => all_finite(v, |v| [*v]),
            Self::Doubles(v) => v.iter().fold(true, |all, v| all & v.is_finite()),
            Self::Vec2s(v) => all_finite(v, Vec2::to_array),
            Self::Vec3s(v) => all_finite(v, Vec3::to_array),
            Self::Vec4s(v) => all_finite(v, Vec4::to_array),
            Self::Matrices(v) => v.iter().all(|v| v.is_finite()),
            _ => true,
        }
    }

    /// Returns the memory in bytes of the value's list, or 0 for a single value. Copies of an
    /// image share its pixels.
    pub fn list_bytes(&self) -> usize {
        match self {
            Self::String(v) => v.len(),
            Self::Bools(v) => size_of_val(&v[..]),
            Self::Ints(v) => size_of_val(&v[..]),
            Self::UInts(v) => size_of_val(&v[..]),
            Self::Floats(v) => size_of_val(&v[..]),
            Self::Doubles(v) => size_of_val(&v[..]),
            Self::Strings(v) => v.iter().map(|s| size_of_val(s) + s.len()).sum(),
            Self::Vec2s(v) => size_of_val(&v[..]),
            Self::Vec3s(v) => size_of_val(&v[..]),
            Self::Vec4s(v) => size_of_val(&v[..]),
            Self::Rotations(v) => size_of_val(&v[..]),
            Self::Matrices(v) => size_of_val(&v[..]),
            Self::Planes(v) => size_of_val(&v[..]),
            Self::Nodes(v) => size_of_val(&v[..]),
            _ => 0,
        }
    }

    /// Returns the number of elements of a list, and 1 for a single value.
    pub fn list_len(&self) -> usize {
        match self {
            Self::Bools(v) => v.len(),
            Self::Ints(v) => v.len(),
            Self::UInts(v) => v.len(),
            Self::Floats(v) => v.len(),
            Self::Doubles(v) => v.len(),
            Self::Strings(v) => v.len(),
            Self::Vec2s(v) => v.len(),
            Self::Vec3s(v) => v.len(),
            Self::Vec4s(v) => v.len(),
            Self::Rotations(v) => v.len(),
            Self::Matrices(v) => v.len(),
            Self::Planes(v) => v.len(),
            Self::Nodes(v) => v.len(),
            _ => 1,
        }
    }

    /// Returns the default that the catalogue states.
    pub fn default_of(decl: &FieldDecl) -> Self {
        Self::from_default(decl.kind, &decl.default)
    }

    /// Returns the value of a field without a default: zero, `NULL`, empty or the identity.
    pub fn empty(kind: FieldType) -> Self {
        Self::from_default(kind, &Default::Nothing)
    }

    fn from_default(kind: FieldType, default: &Default) -> Self {
        let (numbers, strings): (&[f64], &[&str]) = match default {
            Default::Numbers(n) => (n, &[]),
            Default::Strings(s) => (&[], s),
            Default::Nothing => (&[], &[]),
        };
        if kind.is_multiple() {
            Self::list_of(kind, numbers, strings)
        } else {
            let text = strings.first().copied().unwrap_or_default();
            Self::single_of(kind, numbers, text)
        }
    }

    fn single_of(kind: FieldType, numbers: &[f64], text: &str) -> Self {
        use FieldType as F;
        let at = |i: usize| numbers.get(i).copied().unwrap_or(0.0);
        let f = |i: usize| at(i) as f32;
        match kind {
            F::SFBool => Self::Bool(at(0) != 0.0),
            F::SFUInt32 | F::SFUShort => Self::UInt(at(0) as u32),
            F::SFFloat => Self::Float(f(0)),
            F::SFDouble | F::SFTime => Self::Double(at(0)),
            F::SFString | F::SFName => Self::String(text.into()),
            F::SFVec2f => Self::Vec2(Vec2::new(f(0), f(1))),
            F::SFVec3f | F::SFColor => Self::Vec3(Vec3::new(f(0), f(1), f(2))),
            F::SFVec4f => Self::Vec4(Vec4::new(f(0), f(1), f(2), f(3))),
            F::SFRotation if numbers.len() < 4 => Self::Rotation(Rotation::IDENTITY),
            F::SFRotation => Self::Rotation(Rotation::from_numbers(numbers)),
            F::SFMatrix if numbers.len() < 16 => Self::Matrix(Box::new(Mat4::IDENTITY)),
            F::SFMatrix => Self::Matrix(Box::new(Mat4::from_cols_array(&std::array::from_fn(f)))),
            F::SFPlane => Self::Plane(Plane {
                normal: Vec3::new(f(0), f(1), f(2)),
                distance: f(3),
            }),
            F::SFImage | F::SFImage3 => Self::Image(Box::new(Image {
                width: 0,
                height: 0,
                depth: u32::from(kind == F::SFImage),
                components: 0,
                bytes: Arc::from([]),
            })),
            F::SFNode | F::SFPath | F::SFEngine => Self::Node(None),
            F::SFTrigger => Self::Trigger,
            F::SFVec2s | F::SFVec2i32 | F::SFVec3i32 | F::SFVec4i32 => {
                Self::Ints((0..kind.width()).map(|i| at(i) as i32).collect())
            }
            F::SFVec3d => Self::Doubles((0..3).map(at).collect()),
            // `SFInt32`, `SFShort`, `SFEnum`, `SFBitMask`.
            _ => Self::Int(at(0) as i32),
        }
    }

    fn list_of(kind: FieldType, numbers: &[f64], strings: &[&str]) -> Self {
        use FieldType as F;
        let f = |n: &f64| *n as f32;
        match kind {
            F::MFBool => Self::Bools(numbers.iter().map(|&n| n != 0.0).collect()),
            F::MFUInt32 | F::MFUShort => Self::UInts(numbers.iter().map(|&n| n as u32).collect()),
            F::MFFloat => Self::Floats(numbers.iter().map(f).collect()),
            F::MFDouble | F::MFTime | F::MFVec3d => Self::Doubles(numbers.to_vec()),
            F::MFString | F::MFName => {
                Self::Strings(strings.iter().map(|&s| s.to_owned()).collect())
            }
            F::MFVec2f => Self::Vec2s(each(numbers, |n: [f32; 2]| n.into())),
            F::MFVec3f | F::MFColor => Self::Vec3s(each(numbers, |n: [f32; 3]| n.into())),
            F::MFVec4f => Self::Vec4s(each(numbers, |n: [f32; 4]| n.into())),
            F::MFRotation => Self::Rotations(
                numbers
                    .chunks_exact(4)
                    .map(Rotation::from_numbers)
                    .collect(),
            ),
            F::MFMatrix => Self::Matrices(each(numbers, |n| Mat4::from_cols_array(&n))),
            F::MFPlane => Self::Planes(each(numbers, |[x, y, z, distance]: [f32; 4]| Plane {
                normal: Vec3::new(x, y, z),
                distance,
            })),
            F::MFNode => Self::Nodes(Vec::new()),
            // `MFInt32`, `MFShort`, `MFEnum`, `MFVec2i32` and their like.
            _ => Self::Ints(numbers.iter().map(|&n| n as i32).collect()),
        }
    }
}

/// Makes one value from each group of `N` numbers.
fn each<T, const N: usize>(numbers: &[f64], make: impl Fn([f32; N]) -> T) -> Vec<T> {
    let chunks = numbers.chunks_exact(N);
    chunks
        .map(|n| make(std::array::from_fn(|i| n[i] as f32)))
        .collect()
}

/// Reads a [`Value`] as the Rust type of a field handle.
pub trait Get {
    /// The Rust type.
    type Out<'a>;

    /// Returns the value, or `None` if it has another type. The readers of files never create such
    /// a value.
    fn from_value(value: &Value) -> Option<Self::Out<'_>>;
}

macro_rules! get_copy {
    ($($handle:ty => $out:ty, $arm:ident;)*) => { $(
        impl Get for $handle {
            type Out<'a> = $out;
            #[allow(trivial_numeric_casts)]
            fn from_value(value: &Value) -> Option<$out> {
                match value { Value::$arm(v) => Some(*v as $out), _ => None }
            }
        }
    )* };
}

macro_rules! get_plain {
    ($($handle:ty => $out:ty, $arm:ident;)*) => { $(
        impl Get for $handle {
            type Out<'a> = $out;
            fn from_value(value: &Value) -> Option<$out> {
                match value { Value::$arm(v) => Some(v.clone()), _ => None }
            }
        }
    )* };
}

macro_rules! get_slice {
    ($($handle:ty => $out:ty, $arm:ident;)*) => { $(
        impl Get for $handle {
            type Out<'a> = &'a [$out];
            fn from_value(value: &Value) -> Option<&[$out]> {
                match value { Value::$arm(v) => Some(v), _ => None }
            }
        }
    )* };
}

get_copy! {
    i32 => i32, Int; Choice => i32, Int;
    u32 => u32, UInt; f32 => f32, Float; f64 => f64, Double; Seconds => f64, Double;
}

macro_rules! get_saturated {
    ($($handle:ty, $arm:ident;)*) => { $(
        impl Get for $handle {
            type Out<'a> = $handle;
            fn from_value(value: &Value) -> Option<$handle> {
                match value {
                    Value::$arm(v) => Some((*v).clamp(<$handle>::MIN.into(), <$handle>::MAX.into()) as $handle),
                    _ => None,
                }
            }
        }
    )* };
}

get_saturated! { i16, Int; u16, UInt; }

get_plain! {
    bool => bool, Bool; Vec2 => Vec2, Vec2; Vec3 => Vec3, Vec3; Vec4 => Vec4, Vec4;
    Rotation => Rotation, Rotation; Plane => Plane, Plane; NodeRefValue => Option<NodeId>, Node;
}

get_slice! {
    [bool] => bool, Bools; [i32] => i32, Ints; [i16] => i32, Ints; [Choice] => i32, Ints;
    [u32] => u32, UInts; [u16] => u32, UInts; [f32] => f32, Floats; [f64] => f64, Doubles;
    [Seconds] => f64, Doubles; [String] => String, Strings; [Vec2] => Vec2, Vec2s;
    [Vec3] => Vec3, Vec3s; [Vec4] => Vec4, Vec4s; [Rotation] => Rotation, Rotations;
    [Mat4] => Mat4, Matrices; [Plane] => Plane, Planes; [NodeId] => NodeId, Nodes;
}

impl Get for Mat4 {
    type Out<'a> = Mat4;
    fn from_value(value: &Value) -> Option<Mat4> {
        match value {
            Value::Matrix(m) => Some(**m),
            _ => None,
        }
    }
}

impl Get for Text {
    type Out<'a> = &'a str;
    fn from_value(value: &Value) -> Option<&str> {
        match value {
            Value::String(s) => Some(s),
            _ => None,
        }
    }
}

impl Get for Image {
    type Out<'a> = &'a Image;
    fn from_value(value: &Value) -> Option<&Image> {
        match value {
            Value::Image(i) => Some(i),
            _ => None,
        }
    }
}

impl Get for Trigger {
    type Out<'a> = ();
    fn from_value(_: &Value) -> Option<()> {
        Some(())
    }
}

/// Returns whether no number is NaN or infinite. The loop has no early exit, so that the compiler
/// can use vector instructions.
fn all_finite<T, const N: usize>(values: &[T], numbers: impl Fn(&T) -> [f32; N]) -> bool {
    let each = |v: &T| numbers(v).iter().fold(true, |all, n| all & n.is_finite());
    values.iter().fold(true, |all, v| all & each(v))
}
