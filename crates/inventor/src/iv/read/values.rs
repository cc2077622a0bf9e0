//! Parses the values of each field type in an ASCII file.

use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3, Vec4};
use ivcam_base::work;
use nom::branch::alt;
use nom::combinator::{cut, map_opt, opt};
use nom::multi::{fold_many0, many_till};
use nom::sequence::preceded;
use nom::{Err as NomErr, Parser};

use super::blocks::{OnProgress, OneValue, read_blocks};
use super::enum_names::EnumNames;
use super::numbers::{double, float, int32, uint32};
use super::syntax_error::{Parsed, Problem, SyntaxError, fail, or};
use super::tokens::{mark, past_list, skip, string, token, word};
use crate::grammar::FieldType;
use crate::grammar::value::{Image, Plane, Rotation, Value};
use crate::iv::encoding::{Escapes, text};

/// A value, which may be a list that ends at a mistake.
pub(super) struct Read<'a> {
    pub value: Value,
    /// The mistake that ended a list early. The values before it are kept, and the rest of the
    /// source begins after the list.
    pub mistake: Option<SyntaxError<'a>>,
}

/// Parses a value of any type. For a field of nodes it returns an empty value and reads nothing,
/// because the reader of nodes handles them. `left` is called within long lists.
pub(super) fn value<'a>(
    input: &'a [u8],
    kind: FieldType,
    names: EnumNames,
    escapes: Escapes,
    left: OnProgress<'_>,
) -> Parsed<'a, Read<'a>> {
    use FieldType as F;
    let choice = |input| enumeration(input, names);
    let string = |input| string(input, escapes);
    let list_context = (left, escapes);
    match kind {
        F::SFBool => single(input, boolean, Value::Bool),
        F::SFInt32 | F::SFShort => single(input, int32, Value::Int),
        F::SFUInt32 | F::SFUShort => single(input, uint32, Value::UInt),
        F::SFFloat => single(input, float, Value::Float),
        F::SFDouble | F::SFTime => single(input, double, Value::Double),
        F::SFString | F::SFName => single(input, string, |s| Value::String(s.into())),
        F::SFEnum => single(input, choice, Value::Int),
        F::SFBitMask => single(input, |input| bit_mask(input, names), Value::Int),
        F::SFVec2f => single(input, vec2, Value::Vec2),
        F::SFVec3f | F::SFColor => single(input, vec3, Value::Vec3),
        F::SFVec4f => single(input, vec4, Value::Vec4),
        F::SFVec2s | F::SFVec2i32 => single(input, ints::<2>, |n| Value::Ints(n.into())),
        F::SFVec3i32 => single(input, ints::<3>, |n| Value::Ints(n.into())),
        F::SFVec4i32 => single(input, ints::<4>, |n| Value::Ints(n.into())),
        F::SFVec3d => single(input, vec3d, |n| Value::Doubles(n.into())),
        F::SFRotation => single(input, rotation, Value::Rotation),
        F::SFMatrix => single(input, matrix, |m| Value::Matrix(Box::new(m))),
        F::SFPlane => single(input, plane, Value::Plane),
        F::SFImage => single(input, image::<false>, |i| Value::Image(Box::new(i))),
        F::SFImage3 => single(input, image::<true>, |i| Value::Image(Box::new(i))),
        F::SFNode | F::SFPath | F::SFEngine => single(input, nothing, |()| Value::Node(None)),
        F::MFNode => single(input, nothing, |()| Value::Nodes(Vec::new())),
        F::SFTrigger => single(input, nothing, |()| Value::Trigger),
        F::MFBool => list(input, list_context, boolean, Value::Bools),
        F::MFInt32 | F::MFShort => list(input, list_context, int32, Value::Ints),
        F::MFEnum => list(input, list_context, choice, Value::Ints),
        F::MFUInt32 | F::MFUShort => list(input, list_context, uint32, Value::UInts),
        F::MFFloat => list(input, list_context, float, Value::Floats),
        F::MFDouble | F::MFTime => list(input, list_context, double, Value::Doubles),
        F::MFString | F::MFName => list(input, list_context, string, Value::Strings),
        F::MFVec2f => list(input, list_context, vec2, Value::Vec2s),
        F::MFVec3f | F::MFColor => list(input, list_context, vec3, Value::Vec3s),
        F::MFVec4f => list(input, list_context, vec4, Value::Vec4s),
        F::MFVec2i32 => list(input, list_context, ints::<2>, |n| {
            Value::Ints(n.into_flattened())
        }),
        F::MFVec3i32 => list(input, list_context, ints::<3>, |n| {
            Value::Ints(n.into_flattened())
        }),
        F::MFVec4i32 => list(input, list_context, ints::<4>, |n| {
            Value::Ints(n.into_flattened())
        }),
        F::MFVec3d => list(input, list_context, vec3d, |n| {
            Value::Doubles(n.into_flattened())
        }),
        F::MFRotation => list(input, list_context, rotation, Value::Rotations),
        F::MFMatrix => list(input, list_context, matrix, Value::Matrices),
        F::MFPlane => list(input, list_context, plane, Value::Planes),
    }
}

/// Parses the value of a single-value field.
#[inline]
fn single<'a, T>(
    input: &'a [u8],
    one: impl Parser<&'a [u8], Output = T, Error = SyntaxError<'a>>,
    make: impl Fn(T) -> Value,
) -> Parsed<'a, Read<'a>> {
    let read = |value| Read {
        value: make(value),
        mistake: None,
    };
    one.map(read).parse(input)
}

/// The number of values after which a list looks whether reading has to end, which the reader says
/// after the list.
const TURN: usize = 1 << 16;

/// The number of values after which a list may be long enough for several threads.
const MANY: usize = 1 << 11;

/// Parses the value of a multiple-value field: `[ a, b c, ]`, or one value without brackets.
/// Several numbers without brackets are accepted too.
#[inline]
fn list<'a, T: Send>(
    input: &'a [u8],
    (left, escapes): (OnProgress<'_>, Escapes),
    one: impl OneValue<'a, T>,
    make: impl Fn(Vec<T>) -> Value,
) -> Parsed<'a, Read<'a>> {
    let read = |values, mistake| Read {
        value: make(values),
        mistake,
    };
    let Ok((rest, _)) = bracket(input) else {
        let (rest, values) = without_brackets(input, one)?;
        return Ok((rest, read(values, None)));
    };
    let (mut rest, mut values) = (rest, Vec::new());
    loop {
        if values.len() == MANY {
            rest = read_blocks(rest, left, one, &mut values);
        }
        let is_cut = values.len() % TURN == TURN - 1 && {
            left(rest.len());
            work::is_cut()
        };
        let next = skip(rest);
        match one(next) {
            Ok((after, value)) if !is_cut && after.len() < next.len() => {
                values.push(value);
                rest = after;
            }
            Err(failure @ NomErr::Failure(_)) => return Err(failure),
            _ => break,
        }
    }
    match token(mark(']')).parse(rest) {
        Ok((rest, _)) => {
            values.shrink_to_fit();
            Ok((rest, read(values, None)))
        }
        // The parser runs again to return the mistake that ended the list.
        Err(_) => {
            let mistake = token(one).parse(rest).err().map(SyntaxError::from);
            let rest = past_list(mistake.as_ref().map_or(rest, |mistake| mistake.at), escapes);
            Ok((rest, read(values, mistake)))
        }
    }
}

fn bracket(input: &[u8]) -> Parsed<'_, char> {
    mark('[').parse(input)
}

/// Parses one value, and more values as long as the next byte begins a number.
fn without_brackets<'a, T>(
    input: &'a [u8],
    mut one: impl Parser<&'a [u8], Output = T, Error = SyntaxError<'a>>,
) -> Parsed<'a, Vec<T>> {
    let (mut rest, first) = one.parse(input)?;
    let mut values = vec![first];
    loop {
        let next = skip(rest);
        if !matches!(next.first(), Some(b'0'..=b'9' | b'-' | b'+' | b'.')) {
            return Ok((rest, values));
        }
        match one.parse(next) {
            Ok((after, value)) => {
                values.push(value);
                rest = after;
            }
            Err(_) => return Ok((next, values)),
        }
    }
}

fn nothing(input: &[u8]) -> Parsed<'_, ()> {
    Ok((input, ()))
}

/// Parses a fixed number of values.
#[inline]
fn array<'a, const N: usize, T: Copy + Default>(
    input: &'a [u8],
    mut one: impl Parser<&'a [u8], Output = T, Error = SyntaxError<'a>>,
) -> Parsed<'a, [T; N]> {
    let (mut rest, mut out) = (input, [T::default(); N]);
    for value in &mut out {
        (rest, *value) = one.parse(skip(rest))?;
    }
    Ok((rest, out))
}

#[inline]
fn floats<const N: usize>(input: &[u8]) -> Parsed<'_, [f32; N]> {
    array(input, float)
}

#[inline]
fn ints<const N: usize>(input: &[u8]) -> Parsed<'_, [i32; N]> {
    array(input, int32)
}

fn vec3d(input: &[u8]) -> Parsed<'_, [f64; 3]> {
    array(input, double)
}

#[inline]
fn vec2(input: &[u8]) -> Parsed<'_, Vec2> {
    floats.map(Vec2::from_array).parse(input)
}

#[inline]
fn vec3(input: &[u8]) -> Parsed<'_, Vec3> {
    floats.map(Vec3::from_array).parse(input)
}

#[inline]
fn vec4(input: &[u8]) -> Parsed<'_, Vec4> {
    floats.map(Vec4::from_array).parse(input)
}

fn rotation(input: &[u8]) -> Parsed<'_, Rotation> {
    let rotation = |[x, y, z, angle]: [f32; 4]| Rotation::new(Vec3::new(x, y, z), angle);
    floats.map(rotation).parse(input)
}

fn plane(input: &[u8]) -> Parsed<'_, Plane> {
    let plane = |[x, y, z, distance]: [f32; 4]| Plane {
        normal: Vec3::new(x, y, z),
        distance,
    };
    floats.map(plane).parse(input)
}

fn matrix(input: &[u8]) -> Parsed<'_, Mat4> {
    floats.map(|m| Mat4::from_cols_array(&m)).parse(input)
}

fn boolean(input: &[u8]) -> Parsed<'_, bool> {
    let known = map_opt(word, |word| match word {
        b"TRUE" | b"true" | b"1" => Some(true),
        b"FALSE" | b"false" | b"0" => Some(false),
        _ => None,
    });
    or(Problem::Expected("TRUE or FALSE"), known)(input)
}

/// Parses the name of an enumeration's value, with or without quotes, or the value as a number.
fn enumeration(input: &[u8], names: EnumNames) -> Parsed<'_, i32> {
    let bare = || or(Problem::Expected("a name"), word).map(text);
    let (rest, name) = match input.first() {
        Some(b'0'..=b'9' | b'-' | b'+') => return int32(input),
        Some(b'"') => string(input, Escapes::Quote)?,
        _ => bare().parse(input)?,
    };
    match names.value(&name) {
        Some(value) => Ok((rest, value as i32)),
        None => fail(input, Problem::UnknownName(name.into(), names)),
    }
}

/// Parses a bit mask: `ALL`, `(SIDES | BOTTOM)`, `SIDES|BOTTOM`, `()`.
fn bit_mask(input: &[u8], names: EnumNames) -> Parsed<'_, i32> {
    let bit = |input| enumeration(input, names);
    let (input, open) = opt(mark('(')).parse(input)?;
    if open.is_some() {
        let bits = many_till(token(alt((mark('|').map(|_| 0), bit))), token(mark(')')));
        let union = |(bits, _): (Vec<i32>, char)| bits.into_iter().fold(0, |a, b| a | b);
        return bits.map(union).parse(input);
    }
    let (rest, first) = bit(input)?;
    let more = preceded(token(mark('|')), cut(token(bit)));
    fold_many0(more, || first, |bits, bit| bits | bit).parse(rest)
}

/// Parses an image: width, height, depth if it is three-dimensional, number of components, then one
/// number per pixel.
fn image<const SOLID: bool>(input: &[u8]) -> Parsed<'_, Image> {
    let (rest, ([width, height], depth, components)) = (
        |input| array(input, uint32),
        |input| match SOLID {
            true => token(uint32).parse(input),
            false => Ok((input, 1)),
        },
        token(uint32),
    )
        .parse(input)?;
    if components > 4 {
        return fail(input, Problem::TooManyComponents(components));
    }
    let pixels = [height, depth]
        .iter()
        .fold(u64::from(width), |n, &k| n.saturating_mul(u64::from(k)));
    // A pixel takes at least a digit and a space, so the rest of the file limits their number.
    if pixels.saturating_mul(2) > rest.len() as u64 + 1 && components > 0 {
        return fail(input, Problem::ImageTooLarge(width, height));
    }
    let count = if components == 0 { 0 } else { pixels as usize };
    let mut bytes = Vec::with_capacity(count * components as usize);
    let mut rest = rest;
    for _ in 0..count {
        let pixel: u32;
        (rest, pixel) = token(uint32).parse(rest)?;
        bytes.extend_from_slice(&pixel.to_be_bytes()[4 - components as usize..]);
    }
    let image = Image {
        width,
        height,
        depth,
        components: components as u8,
        bytes: Arc::from(bytes),
    };
    Ok((rest, image))
}
