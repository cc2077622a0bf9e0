//! What a field holds, and how a typed handle reads it.

use std::sync::Arc;

use glam::{Mat4, Quat, Vec2, Vec3, Vec4};

use super::field::{Default, FieldDecl, FieldType};

/// A node of a `Document`, by its place in the arena.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(pub u32);

/// Axis and angle (radians) as the file has them; the axis need not be of length 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation {
    pub axis: Vec3,
    pub angle: f32,
}

impl Rotation {
    pub const IDENTITY: Self = Self {
        axis: Vec3::Z,
        angle: 0.0,
    };

    fn of(numbers: &[f64]) -> Self {
        Self {
            axis: Vec3::new(numbers[0] as f32, numbers[1] as f32, numbers[2] as f32),
            angle: numbers[3] as f32,
        }
    }

    /// Returns the unit quaternion; an axis of no length turns nothing, as in Inventor.
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

/// The points p with p·normal = distance, normal pointing into the kept half space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    pub normal: Vec3,
    pub distance: f32,
}

/// An `SFImage` (depth 1) or `SFImage3`: rows from the bottom up, `components` bytes a pixel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    pub width: u32,
    pub height: u32,
    pub depth: u32,
    pub components: u8,
    pub bytes: Arc<[u8]>,
}

/// The value of an `SFEnum` or `SFBitMask`; the names are in the catalogue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice(pub i32);

/// An `SFTime`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seconds(pub f64);

/// Handle types of fields that hold text, a node, or nothing at all.
pub struct Text;
pub struct NodeRefValue;
pub struct Trigger;

/// The value of a field.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    Bool(bool),
    /// `SFInt32`, `SFShort`, `SFEnum` and `SFBitMask`.
    Int(i32),
    /// `SFUInt32`, `SFUShort`.
    UInt(u32),
    Float(f32),
    /// `SFDouble` and `SFTime`.
    Double(f64),
    /// `SFString`, `SFName`.
    String(Box<str>),
    Vec2(Vec2),
    /// `SFVec3f`, `SFColor`.
    Vec3(Vec3),
    Vec4(Vec4),
    Rotation(Rotation),
    /// Row vectors, as Inventor writes it: the last four numbers are the translation.
    Matrix(Box<Mat4>),
    Plane(Plane),
    Image(Box<Image>),
    /// `SFNode`, `SFEngine`, `SFPath` (its head): `None` is `NULL`.
    Node(Option<NodeId>),
    Trigger,
    Bools(Vec<bool>),
    /// `MFInt32`, `MFShort`, `MFEnum`; also `SFVec2s`, `SFVec2i32` and theirs, number by number.
    Ints(Vec<i32>),
    UInts(Vec<u32>),
    Floats(Vec<f32>),
    /// `MFDouble`, `MFTime`; also `SFVec3d` and `MFVec3d`, number by number.
    Doubles(Vec<f64>),
    /// `MFString`, `MFName`.
    Strings(Vec<String>),
    Vec2s(Vec<Vec2>),
    Vec3s(Vec<Vec3>),
    Vec4s(Vec<Vec4>),
    Rotations(Vec<Rotation>),
    Matrices(Vec<Mat4>),
    Planes(Vec<Plane>),
    Nodes(Vec<NodeId>),
}

impl Value {
    /// Whether no number in it is NaN or infinite.
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

    /// The default that the catalogue states.
    pub(crate) fn default_of(decl: &FieldDecl) -> Self {
        Self::from_default(decl.kind, &decl.default)
    }

    /// The value a field of this type has where nothing states one: zeros, nothing, empty.
    pub(crate) fn empty(kind: FieldType) -> Self {
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
            F::SFRotation => Self::Rotation(Rotation::of(numbers)),
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
            F::MFRotation => Self::Rotations(numbers.chunks_exact(4).map(Rotation::of).collect()),
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

/// Makes a value of each N numbers.
fn each<T, const N: usize>(numbers: &[f64], make: impl Fn([f32; N]) -> T) -> Vec<T> {
    let chunks = numbers.chunks_exact(N);
    chunks
        .map(|n| make(std::array::from_fn(|i| n[i] as f32)))
        .collect()
}

/// Reads a [`Value`] as the Rust type of a field handle. `None`: the value is of another type,
/// which a reader that follows the catalogue never makes.
pub trait Get {
    type Out<'a>;
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
    i32 => i32, Int; i16 => i16, Int; Choice => i32, Int;
    u32 => u32, UInt; u16 => u16, UInt; f32 => f32, Float; f64 => f64, Double; Seconds => f64, Double;
}

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

/// Whether no number is infinite or NaN. Neither branches nor sums depend on the element before, so
/// that the compiler can use vector instructions.
fn all_finite<T, const N: usize>(values: &[T], numbers: impl Fn(&T) -> [f32; N]) -> bool {
    let each = |v: &T| numbers(v).iter().fold(true, |all, n| all & n.is_finite());
    values.iter().fold(true, |all, v| all & each(v))
}
