//! One parser a field type, over the bytes of an ASCII file.
//!
//! A parser takes a suffix of the source and returns a shorter one, so places cost nothing.
//! Numbers are scanned by hand: most of a large file is numbers.

use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3, Vec4};
use nom::Err as NomErr;

use super::enum_names::Names;
use super::numbers::{double, float, int32, uint32};
use super::tokens::{Bad, Parsed, bad, expected, past_token, skip, string, wanted, word};
use crate::grammar::FieldType;
use crate::grammar::value::{Image, Plane, Rotation, Value};
use crate::iv::encoding::text;

#[inline]
fn floats<const N: usize>(input: &[u8]) -> Parsed<'_, [f32; N]> {
    let mut out = [0.0; N];
    let mut rest = input;
    for n in &mut out {
        (rest, *n) = float(skip(rest))?;
    }
    Ok((rest, out))
}

fn rotation(input: &[u8]) -> Parsed<'_, Rotation> {
    let (rest, [x, y, z, angle]) = floats(input)?;
    Ok((
        rest,
        Rotation {
            axis: Vec3::new(x, y, z),
            angle,
        },
    ))
}

fn plane(input: &[u8]) -> Parsed<'_, Plane> {
    let (rest, [x, y, z, distance]) = floats(input)?;
    Ok((
        rest,
        Plane {
            normal: Vec3::new(x, y, z),
            distance,
        },
    ))
}

fn matrix(input: &[u8]) -> Parsed<'_, Mat4> {
    floats::<16>(input).map(|(rest, m)| (rest, Mat4::from_cols_array(&m)))
}

fn boolean(input: &[u8]) -> Parsed<'_, bool> {
    let (rest, token) = word(input).map_err(|_| wanted("TRUE or FALSE", input))?;
    match token {
        b"TRUE" | b"true" | b"1" => Ok((rest, true)),
        b"FALSE" | b"false" | b"0" => Ok((rest, false)),
        _ => bad(input, expected("TRUE or FALSE", input)),
    }
}

fn enumeration<'a>(input: &'a [u8], names: Names<'_>) -> Parsed<'a, i32> {
    if matches!(input.first(), Some(b'0'..=b'9' | b'-' | b'+')) {
        return int32(input);
    }
    let quoted = input.first() == Some(&b'"');
    let (rest, token) = if quoted {
        string(input)?
    } else {
        let (rest, token) = word(input).map_err(|_| wanted("a name", input))?;
        (rest, text(token))
    };
    match names.value(&token) {
        Some(v) => Ok((rest, v as i32)),
        None => bad(input, names.unknown(&token)),
    }
}

/// `ALL`, `(SIDES | BOTTOM)`, `SIDES|BOTTOM`, `()`.
fn bit_mask<'a>(input: &'a [u8], names: Names<'_>) -> Parsed<'a, i32> {
    let Some((b'(', mut rest)) = input.split_first() else {
        let (mut rest, mut bits) = enumeration(input, names)?;
        while let Some((b'|', after)) = skip(rest).split_first() {
            let (next, bit) = enumeration(skip(after), names)?;
            (rest, bits) = (next, bits | bit);
        }
        return Ok((rest, bits));
    };
    let mut bits = 0;
    loop {
        rest = skip(rest);
        match rest.first() {
            Some(b')') => return Ok((&rest[1..], bits)),
            Some(b'|') => rest = &rest[1..],
            _ => {
                let (next, bit) = enumeration(rest, names)?;
                (rest, bits) = (next, bits | bit);
            }
        }
    }
}

/// Width, height, (depth,) components, then one number a pixel.
fn image(input: &[u8], solid: bool) -> Parsed<'_, Image> {
    let (mut rest, mut size) = (input, [1u32; 3]);
    for n in size.iter_mut().take(if solid { 3 } else { 2 }) {
        (rest, *n) = uint32(skip(rest))?;
    }
    let components;
    (rest, components) = uint32(skip(rest))?;
    if components > 4 {
        return bad(
            input,
            format!("a pixel has 0 to 4 components, not {components}"),
        );
    }
    let [width, height, depth] = size;
    let pixels = u64::from(width) * u64::from(height) * u64::from(if solid { depth } else { 1 });
    // A pixel takes at least a digit and a space; a promise beyond the file's end is a lie.
    if pixels * 2 > rest.len() as u64 + 1 && components > 0 {
        return bad(
            input,
            format!(
                "a picture of {}x{} pixels does not fit in the rest of the file",
                width.cast_signed(),
                height.cast_signed()
            ),
        );
    }
    let count = if components == 0 { 0 } else { pixels as usize };
    let mut bytes = Vec::with_capacity(count * components as usize);
    for _ in 0..count {
        let pixel;
        (rest, pixel) = uint32(skip(rest))?;
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

/// A value as far as it could be read.
pub struct Read<'a> {
    pub value: Value,
    pub rest: &'a [u8],
    /// Something in a list was wrong; the values before it stand, and `rest` is past the list.
    pub bad: Option<Bad<'a>>,
}

/// Reads a value of any type but those that hold nodes.
pub fn value<'a>(input: &'a [u8], kind: FieldType, names: Names<'_>) -> Result<Read<'a>, Bad<'a>> {
    use FieldType as F;
    let one = |parsed: Parsed<'a, Value>| match parsed {
        Ok((rest, value)) => Ok(Read {
            value,
            rest,
            bad: None,
        }),
        Err(NomErr::Error(b) | NomErr::Failure(b)) => Err(b),
        Err(NomErr::Incomplete(_)) => Err(Bad {
            at: input,
            what: "the file ends".into(),
        }),
    };
    macro_rules! sf {
        ($parser:expr, $make:expr) => {
            one($parser.map(|(rest, v)| (rest, $make(v))))
        };
    }
    macro_rules! mf {
        ($arm:ident, $parser:expr) => {{
            let (values, rest, bad) = list(input, $parser)?;
            Ok(Read {
                value: Value::$arm(values),
                rest,
                bad,
            })
        }};
    }
    match kind {
        F::SFBool => sf!(boolean(input), Value::Bool),
        F::SFInt32 | F::SFShort => sf!(int32(input), Value::Int),
        F::SFUInt32 | F::SFUShort => sf!(uint32(input), Value::UInt),
        F::SFFloat => sf!(float(input), Value::Float),
        F::SFDouble | F::SFTime => sf!(double(input), Value::Double),
        F::SFString | F::SFName => sf!(string(input), |s: String| Value::String(s.into())),
        F::SFEnum => sf!(enumeration(input, names), Value::Int),
        F::SFBitMask => sf!(bit_mask(input, names), Value::Int),
        F::SFVec2f => sf!(floats(input), |v| Value::Vec2(Vec2::from_array(v))),
        F::SFVec3f | F::SFColor => sf!(floats(input), |v| Value::Vec3(Vec3::from_array(v))),
        F::SFVec4f => sf!(floats(input), |v| Value::Vec4(Vec4::from_array(v))),
        F::SFVec2s | F::SFVec2i32 | F::SFVec3i32 | F::SFVec4i32 => {
            sf!(several(input, kind.width(), int32), Value::Ints)
        }
        F::SFVec3d => sf!(several(input, 3, double), Value::Doubles),
        F::SFRotation => sf!(rotation(input), Value::Rotation),
        F::SFMatrix => sf!(matrix(input), |m| Value::Matrix(Box::new(m))),
        F::SFPlane => sf!(plane(input), Value::Plane),
        F::SFImage => sf!(image(input, false), |i| Value::Image(Box::new(i))),
        F::SFImage3 => sf!(image(input, true), |i| Value::Image(Box::new(i))),
        F::SFNode | F::SFPath | F::SFEngine => Ok(Read {
            value: Value::Node(None),
            rest: input,
            bad: None,
        }),
        F::MFNode => Ok(Read {
            value: Value::Nodes(Vec::new()),
            rest: input,
            bad: None,
        }),
        F::SFTrigger => Ok(Read {
            value: Value::Trigger,
            rest: input,
            bad: None,
        }),
        F::MFBool => mf!(Bools, boolean),
        F::MFInt32 | F::MFShort => mf!(Ints, int32),
        F::MFEnum => mf!(Ints, |i| enumeration(i, names)),
        F::MFUInt32 | F::MFUShort => mf!(UInts, uint32),
        F::MFFloat => mf!(Floats, float),
        F::MFDouble | F::MFTime => mf!(Doubles, double),
        F::MFString | F::MFName => mf!(Strings, string),
        F::MFVec2f => mf!(Vec2s, |i| floats(i).map(|(r, v)| (r, Vec2::from_array(v)))),
        F::MFVec3f | F::MFColor => mf!(Vec3s, |i| floats(i).map(|(r, v)| (r, Vec3::from_array(v)))),
        F::MFVec4f => mf!(Vec4s, |i| floats(i).map(|(r, v)| (r, Vec4::from_array(v)))),
        F::MFVec2i32 | F::MFVec3i32 | F::MFVec4i32 | F::MFVec3d => flat(input, kind),
        F::MFRotation => mf!(Rotations, rotation),
        F::MFMatrix => mf!(Matrices, matrix),
        F::MFPlane => mf!(Planes, plane),
    }
}

fn several<'a, T>(
    input: &'a [u8],
    count: usize,
    one: impl Fn(&'a [u8]) -> Parsed<'a, T>,
) -> Parsed<'a, Vec<T>> {
    let mut rest = input;
    let mut out = Vec::with_capacity(count);
    for _ in 0..count {
        let (next, n) = one(skip(rest))?;
        out.push(n);
        rest = next;
    }
    Ok((rest, out))
}

/// Vectors that a [`Value`] keeps number by number.
fn flat(input: &[u8], kind: FieldType) -> Result<Read<'_>, Bad<'_>> {
    let width = kind.width();
    if kind == FieldType::MFVec3d {
        let (values, rest, bad) = list(input, |i| several(i, width, double))?;
        return Ok(Read {
            value: Value::Doubles(values.concat()),
            rest,
            bad,
        });
    }
    let (values, rest, bad) = list(input, |i| several(i, width, int32))?;
    Ok(Read {
        value: Value::Ints(values.concat()),
        rest,
        bad,
    })
}

type List<'a, T> = (Vec<T>, &'a [u8], Option<Bad<'a>>);

/// `[ a, b c, ]`, or one value without brackets. Several without brackets are taken too, where
/// the next thing is plainly a number.
fn list<'a, T>(
    input: &'a [u8],
    one: impl Fn(&'a [u8]) -> Parsed<'a, T>,
) -> Result<List<'a, T>, Bad<'a>> {
    let mut values = Vec::new();
    let Some((b'[', mut rest)) = input.split_first() else {
        let mut rest = input;
        loop {
            match one(rest) {
                Ok((next, v)) => {
                    values.push(v);
                    rest = next;
                }
                Err(_) if !values.is_empty() => return Ok((values, rest, None)),
                Err(e) => return Err(unwrap(e, input)),
            }
            let next = skip(rest);
            if !matches!(next.first(), Some(b'0'..=b'9' | b'-' | b'+' | b'.')) {
                return Ok((values, rest, None));
            }
            rest = next;
        }
    };
    loop {
        rest = skip(rest);
        if rest.first() == Some(&b']') {
            values.shrink_to_fit();
            return Ok((values, &rest[1..], None));
        }
        match one(rest) {
            Ok((next, v)) => {
                values.push(v);
                rest = next;
            }
            Err(e) => {
                let bad = unwrap(e, rest);
                return Ok((values, past_list(bad.at), Some(bad)));
            }
        }
    }
}

fn unwrap<'a>(error: NomErr<Bad<'a>>, at: &'a [u8]) -> Bad<'a> {
    match error {
        NomErr::Error(b) | NomErr::Failure(b) => b,
        NomErr::Incomplete(_) => Bad {
            at,
            what: "the file ends".into(),
        },
    }
}

/// Past the `]` that closes the list we are in; a `}` before it means that there is none.
fn past_list(mut rest: &[u8]) -> &[u8] {
    loop {
        rest = skip(rest);
        match rest.first() {
            None | Some(b'}') => return rest,
            Some(b']') => return &rest[1..],
            _ => rest = past_token(rest),
        }
    }
}
