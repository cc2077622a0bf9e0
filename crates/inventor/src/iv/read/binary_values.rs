//! Parses the values of the binary formats, which consist of big-endian words in the layout of XDR.
//!
//! A string is its length and its bytes, padded to a multiple of four. Each function is a nom
//! parser of the rest of the file.

use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3, Vec4};
use nom::Parser;
use nom::bytes::complete::{tag, take};
use nom::multi::{count, fill, many_till};
use nom::number::complete::be_u32;
use nom::sequence::pair;

use super::blocks::OnProgress;
use super::enum_names::EnumNames;
use super::syntax_error::{Parsed, Problem, SyntaxError, fail, or};
use super::tokens::is_word;
use crate::grammar::FieldType;
use crate::grammar::value::{Image, Plane, Rotation, Value};
use crate::iv::encoding::text;

/// The number of values of a list after which its progress is reported.
const PART: usize = 1 << 18;
/// The number of words in which a name is searched for after an image. Only flags and counts may
/// precede it, of which there are at most a few for each open group.
const LOOKAHEAD: usize = 256;

/// The parameters of the parser of a value, in addition to its type.
pub(super) struct Context<'a, 'r> {
    /// Is called within long lists.
    pub left: OnProgress<'r>,
    /// The names of an enumeration's values.
    pub names: EnumNames,
    /// Whether images have one word per pixel, as before V2.1, and not one byte per component.
    pub wide_pixels: bool,
    /// The names that the enumeration does not have. Their values are read as 0.
    pub mistakes: Vec<SyntaxError<'a>>,
}

/// Parses a value of any type. For a field of nodes it returns an empty value and reads nothing,
/// because the reader of nodes handles them.
pub(super) fn value<'a>(
    input: &'a [u8],
    kind: FieldType,
    context: &mut Context<'a, '_>,
) -> Parsed<'a, Value> {
    use FieldType as F;
    let (wide, left) = (context.wide_pixels, context.left);
    let mut named = |input: &'a [u8]| enumeration(input, context);
    match kind {
        F::SFBool => read(word(input), |n| Value::Bool(n != 0)),
        F::SFInt32 | F::SFShort => read(int(input), Value::Int),
        F::SFUInt32 | F::SFUShort => read(word(input), Value::UInt),
        F::SFFloat => read(float(input), Value::Float),
        F::SFDouble | F::SFTime => read(double(input), Value::Double),
        F::SFString | F::SFName => read(string(input), |s| Value::String(s.into())),
        F::SFEnum => read(named(input), Value::Int),
        F::SFBitMask => read(bit_mask(input, named), Value::Int),
        F::SFVec2f => read(floats(input), |v| Value::Vec2(Vec2::from_array(v))),
        F::SFVec3f | F::SFColor => read(floats(input), |v| Value::Vec3(Vec3::from_array(v))),
        F::SFVec4f => read(floats(input), |v| Value::Vec4(Vec4::from_array(v))),
        F::SFVec2s | F::SFVec2i32 | F::SFVec3i32 | F::SFVec4i32 => {
            read(count(int, kind.width()).parse(input), Value::Ints)
        }
        F::SFVec3d => read(count(double, 3).parse(input), Value::Doubles),
        F::SFRotation => read(floats(input), |r| Value::Rotation(rotation(r))),
        F::SFMatrix => read(floats(input), |m| Value::Matrix(Box::new(matrix(m)))),
        F::SFPlane => read(floats(input), |p| Value::Plane(plane(p))),
        F::SFImage => read(image(input, false, wide), |i| Value::Image(Box::new(i))),
        F::SFImage3 => read(image(input, true, wide), |i| Value::Image(Box::new(i))),
        F::SFNode | F::SFPath | F::SFEngine => Ok((input, Value::Node(None))),
        F::MFNode => Ok((input, Value::Nodes(Vec::new()))),
        F::SFTrigger => Ok((input, Value::Trigger)),
        F::MFBool => read(tuples(input, left, |[n]| n != 0), Value::Bools),
        F::MFInt32 | F::MFShort => read(tuples(input, left, |[n]| n as i32), Value::Ints),
        F::MFEnum => read(list(input, named), Value::Ints),
        F::MFUInt32 | F::MFUShort => read(tuples(input, left, |[n]| n), Value::UInts),
        F::MFFloat => read(tuples(input, left, |[n]| f32::from_bits(n)), Value::Floats),
        F::MFDouble | F::MFTime => read(
            tuples(input, left, |[a, b]| double_from_words(a, b)),
            Value::Doubles,
        ),
        F::MFString | F::MFName => read(list(input, string), Value::Strings),
        F::MFVec2f => read(float_tuples(input, left, Vec2::from_array), Value::Vec2s),
        F::MFVec3f | F::MFColor => read(float_tuples(input, left, Vec3::from_array), Value::Vec3s),
        F::MFVec4f => read(float_tuples(input, left, Vec4::from_array), Value::Vec4s),
        F::MFVec2i32 => read(int_tuples::<2>(input, left), Value::Ints),
        F::MFVec3i32 => read(int_tuples::<3>(input, left), Value::Ints),
        F::MFVec4i32 => read(int_tuples::<4>(input, left), Value::Ints),
        F::MFVec3d => {
            let vector = |[a, b, c, d, e, f]: [u32; 6]| {
                [
                    double_from_words(a, b),
                    double_from_words(c, d),
                    double_from_words(e, f),
                ]
            };
            read(tuples(input, left, vector), |v| {
                Value::Doubles(v.into_flattened())
            })
        }
        F::MFRotation => read(float_tuples(input, left, rotation), Value::Rotations),
        F::MFMatrix => read(float_tuples(input, left, matrix), Value::Matrices),
        F::MFPlane => read(float_tuples(input, left, plane), Value::Planes),
    }
}

/// Converts the result of a parser to a [`Value`].
fn read<'a, T>(parsed: Parsed<'a, T>, make: impl Fn(T) -> Value) -> Parsed<'a, Value> {
    parsed.map(|(rest, value)| (rest, make(value)))
}

/// Parses a word of four bytes.
pub(super) fn word(input: &[u8]) -> Parsed<'_, u32> {
    or(Problem::CutOff, be_u32)(input)
}

/// Parses a word as a signed number.
pub(super) fn int(input: &[u8]) -> Parsed<'_, i32> {
    word.map(u32::cast_signed).parse(input)
}

fn float(input: &[u8]) -> Parsed<'_, f32> {
    word.map(f32::from_bits).parse(input)
}

fn double(input: &[u8]) -> Parsed<'_, f64> {
    pair(word, word)
        .map(|(high, low)| double_from_words(high, low))
        .parse(input)
}

/// Returns the number that two words encode.
fn double_from_words(high: u32, low: u32) -> f64 {
    f64::from_bits(u64::from(high) << 32 | u64::from(low))
}

/// Parses bytes and the padding to a multiple of four. The padding may be missing at the end of the
/// file.
fn padded(input: &[u8], promised: usize) -> Parsed<'_, &[u8]> {
    let left = input.len();
    let (rest, bytes) = or(Problem::MissingBytes { promised, left }, take(promised))(input)?;
    let padding = promised.next_multiple_of(4) - promised;
    let (rest, _) = take(padding.min(rest.len()))(rest)?;
    Ok((rest, bytes))
}

/// Parses the bytes of an image. SGI's library writes nothing after them, Coin pads them to a
/// multiple of four. The padding is skipped if the file can be read on only after it.
fn unpadded(input: &[u8], promised: usize) -> Parsed<'_, &[u8]> {
    let (after_padding, bytes) = padded(input, promised)?;
    let after_bytes = &input[bytes.len()..];
    let is_padded = !continues(after_bytes) && continues(after_padding);
    Ok((
        if is_padded {
            after_padding
        } else {
            after_bytes
        },
        bytes,
    ))
}

/// Returns whether bytes can follow the value of a field: flags and counts, and then a name or the
/// end of the file. From a wrong offset a small word is a large one, which no count can be.
fn continues(mut rest: &[u8]) -> bool {
    for _ in 0..LOOKAHEAD {
        let Ok((after, number)) = word.map(|n| n as usize).parse(rest) else {
            return rest.is_empty();
        };
        if after.get(..number).is_some_and(is_word) {
            return true;
        }
        if number > after.len() / 4 {
            return false;
        }
        rest = after;
    }
    false
}

/// Parses a length and that many bytes of text.
pub(super) fn string(input: &[u8]) -> Parsed<'_, String> {
    let (rest, length) = word(input)?;
    let (rest, bytes) = padded(rest, length as usize)?;
    Ok((rest, text(bytes)))
}

/// Parses the number of items of at least `size` bytes that follow. It fails if the rest of the
/// file is too short for them.
pub(super) fn checked_count(input: &[u8], size: usize) -> Parsed<'_, usize> {
    let (rest, count) = word.map(|n| n as usize).parse(input)?;
    if count.saturating_mul(size) > rest.len() {
        return fail(input, Problem::MissingValues(count));
    }
    Ok((rest, count))
}

/// Parses a count and that many values of at least four bytes each.
pub(super) fn list<'a, T>(
    input: &'a [u8],
    one: impl FnMut(&'a [u8]) -> Parsed<'a, T>,
) -> Parsed<'a, Vec<T>> {
    let (rest, length) = checked_count(input, 4)?;
    count(one, length).parse(rest)
}

/// Parses a count and that many values of `N` words each. It checks the length only once for all
/// values, which is faster than a parser per value.
fn tuples<'a, const N: usize, T>(
    input: &'a [u8],
    left: OnProgress<'_>,
    one: impl Fn([u32; N]) -> T,
) -> Parsed<'a, Vec<T>> {
    let (rest, length) = checked_count(input, 4 * N)?;
    let (rest, bytes) = take(4 * N * length)(rest)?;
    let tuple = |bytes: &[u8]| {
        let word = |i: usize| u32::from_be_bytes(std::array::from_fn(|k| bytes[4 * i + k]));
        one(std::array::from_fn(word))
    };
    let mut values = Vec::with_capacity(length);
    for part in bytes.chunks(4 * N * PART) {
        values.extend(part.chunks_exact(4 * N).map(&tuple));
        left(rest.len() + 4 * N * (length - values.len()));
    }
    Ok((rest, values))
}

fn float_tuples<'a, const N: usize, T>(
    input: &'a [u8],
    left: OnProgress<'_>,
    one: impl Fn([f32; N]) -> T,
) -> Parsed<'a, Vec<T>> {
    tuples(
        input,
        left,
        |words: [u32; N]| one(words.map(f32::from_bits)),
    )
}

fn int_tuples<'a, const N: usize>(input: &'a [u8], left: OnProgress<'_>) -> Parsed<'a, Vec<i32>> {
    let (rest, tuples) = tuples(input, left, |words: [u32; N]| words.map(u32::cast_signed))?;
    Ok((rest, tuples.into_flattened()))
}

fn floats<const N: usize>(input: &[u8]) -> Parsed<'_, [f32; N]> {
    let mut out = [0.0; N];
    let (rest, ()) = fill(float, &mut out).parse(input)?;
    Ok((rest, out))
}

fn rotation([x, y, z, angle]: [f32; 4]) -> Rotation {
    Rotation::new(Vec3::new(x, y, z), angle)
}

fn plane([x, y, z, distance]: [f32; 4]) -> Plane {
    Plane {
        normal: Vec3::new(x, y, z),
        distance,
    }
}

fn matrix(columns: [f32; 16]) -> Mat4 {
    Mat4::from_cols_array(&columns)
}

/// Parses the name of an enumeration's value, or the value as text. An unknown name is added to the
/// mistakes, and reading continues.
fn enumeration<'a>(input: &'a [u8], context: &mut Context<'a, '_>) -> Parsed<'a, i32> {
    let (rest, name) = string(input)?;
    let value = context.names.value(&name).or_else(|| name.parse().ok());
    if value.is_none() {
        let problem = Problem::UnknownName(name.into(), context.names);
        context.mistakes.push(SyntaxError { at: input, problem });
    }
    Ok((rest, value.unwrap_or(0) as i32))
}

/// Parses names up to a word of 0.
fn bit_mask<'a>(input: &'a [u8], bit: impl FnMut(&'a [u8]) -> Parsed<'a, i32>) -> Parsed<'a, i32> {
    let (rest, (bits, _)) = many_till(bit, tag(&[0; 4][..])).parse(input)?;
    Ok((rest, bits.into_iter().fold(0, |union, bit| union | bit)))
}

/// Parses an image: width, height, depth if it is three-dimensional, number of components, pixels.
fn image(input: &[u8], solid: bool, wide_pixels: bool) -> Parsed<'_, Image> {
    let (rest, (width, height)) = pair(word, word).parse(input)?;
    let (rest, depth) = if solid { word(rest)? } else { (rest, 1) };
    let (rest, components) = word(rest)?;
    if components > 4 {
        return fail(rest, Problem::TooManyComponents(components));
    }
    let pixels = [width, height, depth]
        .iter()
        .try_fold(1u64, |n, &k| n.checked_mul(u64::from(k)));
    let bytes_of = |pixel: u32| {
        let bytes = pixels.and_then(|n| n.checked_mul(u64::from(pixel)));
        bytes
            .and_then(|n| usize::try_from(n).ok())
            .unwrap_or(usize::MAX)
    };
    let (rest, bytes) = if !wide_pixels {
        let (rest, bytes) = unpadded(rest, bytes_of(components))?;
        (rest, Arc::from(bytes))
    } else if bytes_of(components) == 0 {
        (rest, Arc::from([]))
    } else {
        let (rest, words) = padded(rest, bytes_of(4))?;
        let bytes = match components {
            1 => last_bytes::<1>(words),
            2 => last_bytes::<2>(words),
            3 => last_bytes::<3>(words),
            _ => last_bytes::<4>(words),
        };
        (rest, bytes)
    };
    let image = Image {
        width,
        height,
        depth,
        components: components as u8,
        bytes,
    };
    Ok((rest, image))
}

/// Returns the last `N` bytes of each word.
fn last_bytes<const N: usize>(words: &[u8]) -> Arc<[u8]> {
    let words = words.chunks_exact(4);
    let pixels = words.map(|w| std::array::from_fn(|i| w[4 - N + i]));
    pixels.collect::<Vec<[u8; N]>>().into_flattened().into()
}
