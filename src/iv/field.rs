//! One parser a field type, over the bytes of an ASCII file.
//!
//! A parser takes a suffix of the source and returns a shorter one, so places cost nothing.
//! Numbers are scanned by hand: most of a large file is numbers.

use std::borrow::Cow;
use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3, Vec4};
use nom::bytes::complete::{take_while, take_while1};
use nom::error::{ErrorKind, ParseError};
use nom::{Err as NomErr, IResult};

use super::Value;
use super::value::{Image, Plane, Rotation};
use crate::grammar::FieldType;

/// What was wrong, and the suffix of the source where.
#[derive(Clone, Debug, PartialEq)]
pub struct Bad<'a> {
    pub at: &'a [u8],
    pub what: Cow<'static, str>,
}

impl<'a> ParseError<&'a [u8]> for Bad<'a> {
    fn from_error_kind(at: &'a [u8], kind: ErrorKind) -> Self {
        Self {
            at,
            what: kind.description().to_owned().into(),
        }
    }

    fn append(_: &'a [u8], _: ErrorKind, other: Self) -> Self {
        other
    }
}

pub type Parsed<'a, T> = IResult<&'a [u8], T, Bad<'a>>;

fn bad<'a, T>(at: &'a [u8], what: impl Into<Cow<'static, str>>) -> Parsed<'a, T> {
    Err(NomErr::Error(Bad {
        at,
        what: what.into(),
    }))
}

const SPACE: u8 = 1;
/// Ends a class's or field's name.
const ENDS_WORD: u8 = 2;
/// Ends a `DEF` name, which may hold almost anything.
const ENDS_NAME: u8 = 4;

static KINDS: [u8; 256] = {
    let mut table = [0; 256];
    let mut i = 0;
    while i <= b' ' as usize {
        table[i] = SPACE | ENDS_WORD | ENDS_NAME;
        i += 1;
    }
    table[b',' as usize] = SPACE | ENDS_WORD | ENDS_NAME;
    let stops = b"{}[]\"#";
    i = 0;
    while i < stops.len() {
        table[stops[i] as usize] = ENDS_WORD | ENDS_NAME;
        i += 1;
    }
    let stops = b"()'=~|.";
    i = 0;
    while i < stops.len() {
        table[stops[i] as usize] = ENDS_WORD;
        i += 1;
    }
    table
};

fn is(byte: u8, kind: u8) -> bool {
    KINDS[usize::from(byte)] & kind != 0
}

/// Skips white space, commas (which separate and mean nothing) and comments.
#[inline]
pub fn skip(mut input: &[u8]) -> &[u8] {
    loop {
        match input.first() {
            Some(&b) if is(b, SPACE) => input = &input[1..],
            Some(b'#') => {
                let end = input.iter().position(|b| matches!(b, b'\n' | b'\r'));
                input = &input[end.unwrap_or(input.len())..];
            }
            _ => return input,
        }
    }
}

/// The name of a class or field, or a keyword.
pub fn word(input: &[u8]) -> Parsed<'_, &[u8]> {
    take_while1(|b| !is(b, ENDS_WORD))(input)
}

/// A name after `DEF` or `USE`: `Text01-TIMER`, `name+0`, `+0`, even `a.b`.
pub fn def_name(input: &[u8]) -> Parsed<'_, &[u8]> {
    take_while1(|b| !is(b, ENDS_NAME))(input)
}

/// Text as the file has it; bytes that are not UTF-8 are Latin-1.
pub fn text(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(s) => s.to_owned(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
    }
}

// Numbers

/// Where a number ends and what it is, before rounding: digits · 10^exponent.
struct Decimal {
    length: usize,
    negative: bool,
    digits: u64,
    exponent: i32,
    /// More digits than `digits` holds.
    long: bool,
}

#[inline]
fn decimal(input: &[u8]) -> Option<Decimal> {
    let mut i = 0;
    let negative = input.first() == Some(&b'-');
    if matches!(input.first(), Some(b'-' | b'+')) {
        i = 1;
    }
    let (mut digits, mut seen, mut significant, mut exponent) = (0u64, 0usize, 0u32, 0i32);
    while let Some(d) = input
        .get(i)
        .map(|b| b.wrapping_sub(b'0'))
        .filter(|&d| d < 10)
    {
        digits = digits.wrapping_mul(10).wrapping_add(u64::from(d));
        significant += u32::from(digits != 0);
        seen += 1;
        i += 1;
    }
    if input.get(i) == Some(&b'.') {
        i += 1;
        while let Some(d) = input
            .get(i)
            .map(|b| b.wrapping_sub(b'0'))
            .filter(|&d| d < 10)
        {
            digits = digits.wrapping_mul(10).wrapping_add(u64::from(d));
            significant += u32::from(digits != 0);
            exponent -= 1;
            seen += 1;
            i += 1;
        }
    }
    if seen == 0 {
        return None;
    }
    if matches!(input.get(i), Some(b'e' | b'E')) {
        let mut k = i + 1;
        let down = input.get(k) == Some(&b'-');
        if matches!(input.get(k), Some(b'-' | b'+')) {
            k += 1;
        }
        let first = k;
        let mut e = 0i32;
        while let Some(d) = input
            .get(k)
            .map(|b| b.wrapping_sub(b'0'))
            .filter(|&d| d < 10)
        {
            e = e.saturating_mul(10).saturating_add(i32::from(d));
            k += 1;
        }
        if k > first {
            exponent = exponent.saturating_add(if down { -e } else { e });
            i = k;
        }
    }
    Some(Decimal {
        length: i,
        negative,
        digits,
        exponent,
        long: significant > 19,
    })
}

/// Powers of ten that an f64 holds exactly.
static TENS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

impl Decimal {
    /// The nearest f64, where one rounding of exact operands gives it.
    #[inline]
    fn quick(&self) -> Option<f64> {
        if self.long || self.digits >= 1 << 53 || self.exponent.unsigned_abs() > 22 {
            return None;
        }
        let ten = TENS[self.exponent.unsigned_abs() as usize];
        let n = self.digits as f64;
        let n = if self.exponent < 0 { n / ten } else { n * ten };
        Some(if self.negative { -n } else { n })
    }
}

/// `1`, `+1`, `1.`, `.5`, `-1e-3`, `nan`, `inf`.
#[inline]
pub fn float(input: &[u8]) -> Parsed<'_, f32> {
    let Some(d) = decimal(input) else {
        return odd_float(input).map(|(rest, n)| (rest, n as f32));
    };
    let rest = &input[d.length..];
    if let Some(n) = d.quick() {
        // Rounding twice goes wrong only where the f64 lies half way between two f32.
        if n.to_bits() & 0x1fff_ffff != 0x1000_0000
            && (n == 0.0 || n.abs() >= f64::from(f32::MIN_POSITIVE))
        {
            return Ok((rest, n as f32));
        }
    }
    let slow = std::str::from_utf8(&input[..d.length])
        .ok()
        .and_then(|s| s.parse().ok());
    Ok((rest, slow.unwrap_or(0.0)))
}

pub fn double(input: &[u8]) -> Parsed<'_, f64> {
    let Some(d) = decimal(input) else {
        return odd_float(input);
    };
    let rest = &input[d.length..];
    let slow = || {
        std::str::from_utf8(&input[..d.length])
            .ok()
            .and_then(|s| s.parse().ok())
    };
    Ok((rest, d.quick().or_else(slow).unwrap_or(0.0)))
}

/// Not a number, or without end, in any of the ways printf has written them.
#[cold]
fn odd_float(input: &[u8]) -> Parsed<'_, f64> {
    let (rest, token) = take_while(|b| !is(b, ENDS_NAME))(input)?;
    let lower = String::from_utf8_lossy(token).to_lowercase();
    let (negative, name) = match lower.strip_prefix('-') {
        Some(name) => (true, name),
        None => (false, lower.trim_start_matches('+')),
    };
    let n = match name {
        "inf" | "infinity" => f64::INFINITY,
        _ if name.starts_with("nan") => f64::NAN,
        _ => return bad(input, expected("a number", input)),
    };
    Ok((rest, if negative { -n } else { n }))
}

pub fn expected(what: &str, at: &[u8]) -> String {
    let token: Vec<u8> = at
        .iter()
        .copied()
        .take_while(|&b| !is(b, SPACE))
        .take(24)
        .collect();
    if token.is_empty() {
        format!("expected {what}, but the file ends")
    } else {
        format!("expected {what}, not `{}`", text(&token))
    }
}

/// Decimal, `0x` hexadecimal, or octal with a leading 0, as C has them. More than 31 bits wrap,
/// so that `0xffffffff` is −1.
#[inline]
pub fn integer(input: &[u8]) -> Parsed<'_, i64> {
    let signed = matches!(input.first(), Some(b'-' | b'+'));
    let digits = &input[usize::from(signed)..];
    let (radix, digits) = match digits {
        [b'0', b'x' | b'X', rest @ ..] => (16, rest),
        [b'0', b'0'..=b'7', ..] => (8, digits),
        _ => (10, digits),
    };
    let (mut n, mut i) = (0i64, 0);
    while let Some(d) = digits.get(i).and_then(|&b| char::from(b).to_digit(radix)) {
        n = n
            .saturating_mul(i64::from(radix))
            .saturating_add(i64::from(d));
        i += 1;
    }
    let rest = &digits[i..];
    if i == 0 || (radix != 16 && matches!(rest.first(), Some(b'.' | b'e' | b'E' | b'8' | b'9'))) {
        return match double(input) {
            Ok((rest, n)) if n.abs() < 9e15 => Ok((rest, n as i64)),
            _ => bad(input, expected("a whole number", input)),
        };
    }
    Ok((rest, if input[0] == b'-' { -n } else { n }))
}

fn int32(input: &[u8]) -> Parsed<'_, i32> {
    let (rest, n) = integer(input)?;
    if n < i64::from(i32::MIN) || n > i64::from(u32::MAX) {
        return bad(input, "this number needs more than 32 bits");
    }
    Ok((rest, n as i32))
}

fn uint32(input: &[u8]) -> Parsed<'_, u32> {
    int32(input).map(|(rest, n)| (rest, n as u32))
}

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

fn wanted<'a>(what: &str, at: &'a [u8]) -> NomErr<Bad<'a>> {
    NomErr::Error(Bad {
        at,
        what: expected(what, at).into(),
    })
}

/// A string in quotes, over as many lines as it takes, or a bare word. Of escapes, `\"` and `\\`
/// mean something; any other backslash is itself, as in the paths that people write.
pub fn string(input: &[u8]) -> Parsed<'_, String> {
    if input.first() != Some(&b'"') {
        let (rest, bare) =
            take_while1(|b| !matches!(b, 0..=b' ' | b'}' | b']' | b'"' | b','))(input)
                .map_err(|_: NomErr<Bad<'_>>| wanted("a string", input))?;
        return Ok((rest, text(bare)));
    }
    let body = &input[1..];
    let (mut i, mut plain) = (0, true);
    loop {
        match body.get(i) {
            Some(b'"') => break,
            Some(b'\\') if matches!(body.get(i + 1), Some(b'"' | b'\\')) => {
                plain = false;
                i += 2;
            }
            Some(_) => i += 1,
            None => return bad(input, "this string has no closing quote"),
        }
    }
    let raw = &body[..i];
    let rest = &body[i + 1..];
    if plain {
        return Ok((rest, text(raw)));
    }
    let mut out = Vec::with_capacity(raw.len());
    let mut bytes = raw.iter().copied().peekable();
    while let Some(b) = bytes.next() {
        match (b, bytes.peek()) {
            (b'\\', Some(&next @ (b'"' | b'\\'))) => {
                out.push(next);
                bytes.next();
            }
            _ => out.push(b),
        }
    }
    Ok((rest, text(&out)))
}

/// Named values of an enumeration or a bit mask, and how names that are gone are read.
#[derive(Clone, Copy)]
pub struct Names<'n> {
    pub names: &'n [(&'static str, i64)],
    pub old: fn(&str) -> Option<i64>,
}

impl Names<'_> {
    pub fn value(self, name: &str) -> Option<i64> {
        let exact = self.names.iter().find(|(n, _)| *n == name);
        let loose = || {
            self.names
                .iter()
                .find(|(n, _)| n.eq_ignore_ascii_case(name))
        };
        exact
            .or_else(loose)
            .map(|(_, v)| *v)
            .or_else(|| (self.old)(name))
    }

    pub fn unknown(self, name: &str) -> String {
        let all: Vec<&str> = self.names.iter().map(|(n, _)| *n).collect();
        match crate::diag::nearest(name, all.iter().copied()) {
            Some(near) => format!("`{name}` is not one of its values; did you mean `{near}`?"),
            None => format!(
                "`{name}` is not one of its values, which are {}",
                all.join(", ")
            ),
        }
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

/// Past one token: a string, something in brackets or braces, a word, or a single byte.
pub fn past_token(rest: &[u8]) -> &[u8] {
    match rest.first() {
        None => rest,
        Some(b'"') => string(rest).map_or(&[], |(rest, _)| rest),
        Some(b'{' | b'[' | b'(') => past_braces(&rest[1..]),
        _ => match def_name(rest) {
            Ok((rest, _)) => rest,
            Err(_) => &rest[1..],
        },
    }
}

/// Past the brace or bracket that closes the one already passed. Without recursion.
pub fn past_braces(mut rest: &[u8]) -> &[u8] {
    let mut depth = 1usize;
    loop {
        rest = skip(rest);
        match rest.first() {
            None => return rest,
            Some(b'"') => {
                rest = string(rest).map_or(&[], |(rest, _)| rest);
                continue;
            }
            Some(b'{' | b'[' | b'(') => depth += 1,
            Some(b'}' | b']' | b')') => depth -= 1,
            _ => {}
        }
        rest = &rest[1..];
        if depth == 0 {
            return rest;
        }
    }
}
