//! Writes field values as text. Numbers have the shortest text that reads back as the same number.

use std::fmt::{LowerExp, Write as _};

use ivcam_base::work::until_stopped;

use super::output::PieceWriter;
use super::spelling::{bit_names, enumeration};
use crate::grammar::FieldType;
use crate::grammar::value::{Image, Rotation, Value};
use crate::iv::encoding::Escapes;

/// Returns a value that contains no nodes as text.
pub(crate) fn value_text(value: &Value, kind: FieldType) -> String {
    let mut bytes = Vec::new();
    let mut out = PieceWriter::to(&mut bytes);
    put(&mut out, 0, value, kind, &[], Escapes::QuoteAndBackslash);
    out.finish().expect("memory takes all bytes");
    String::from_utf8(bytes).expect("pieces of text")
}

/// Appends a value that contains no nodes.
pub(super) fn put(
    out: &mut PieceWriter<'_>,
    indent: usize,
    value: &Value,
    kind: FieldType,
    names: &[(&str, i64)],
    escapes: Escapes,
) {
    match value {
        Value::Bool(b) => out.push_str(boolean(*b)),
        Value::Int(n) => match kind {
            FieldType::SFEnum => out.push_str(&enumeration(*n, names)),
            FieldType::SFBitMask => out.push_str(&bit_mask(*n, names)),
            _ => integer(out, *n),
        },
        Value::UInt(n) => {
            let _ = write!(out, "{n:#x}");
        }
        Value::Float(n) => float(out, *n),
        Value::Double(n) => double(out, *n),
        Value::String(s) if kind == FieldType::SFEnum => out.push_str(s),
        Value::String(s) => out.push_str(&string(s, escapes)),
        Value::Vec2(v) => floats(out, &v.to_array()),
        Value::Vec3(v) => floats(out, &v.to_array()),
        Value::Vec4(v) => floats(out, &v.to_array()),
        Value::Rotation(r) => floats(out, &rotation(r)),
        Value::Matrix(m) => floats(out, &m.to_cols_array()),
        Value::Plane(p) => floats(out, &[p.normal.x, p.normal.y, p.normal.z, p.distance]),
        Value::Image(i) => image(out, i, kind == FieldType::SFImage3),
        Value::Node(_) => out.push_str("NULL"),
        Value::Nodes(_) => out.push_str("[ ]"),
        Value::Trigger => {}
        Value::Bools(l) => list(out, indent, l, 16, |out, b| out.push_str(boolean(*b))),
        Value::Ints(l) if !kind.is_multiple() => numbers(out, l, |out, n| integer(out, *n)),
        Value::Ints(l) if kind.width() > 1 => {
            let tuples: Vec<&[i32]> = l.chunks(kind.width()).collect();
            list(out, indent, &tuples, 4, |out, t| {
                numbers(out, t, |out, n| integer(out, *n))
            });
        }
        Value::Ints(l) if kind == FieldType::MFEnum => {
            list(out, indent, l, 4, |out, n| {
                out.push_str(&enumeration(*n, names))
            });
        }
        Value::Ints(l) => list(out, indent, l, 16, |out, n| integer(out, *n)),
        Value::UInts(l) => list(out, indent, l, 8, |out, n| {
            let _ = write!(out, "{n:#x}");
        }),
        Value::Floats(l) => list(out, indent, l, 8, |out, n| float(out, *n)),
        Value::Doubles(l) if !kind.is_multiple() => numbers(out, l, |out, n| double(out, *n)),
        Value::Doubles(l) if kind.width() > 1 => {
            let tuples: Vec<&[f64]> = l.chunks(kind.width()).collect();
            list(out, indent, &tuples, 1, |out, t| {
                numbers(out, t, |out, n| double(out, *n))
            });
        }
        Value::Doubles(l) => list(out, indent, l, 8, |out, n| double(out, *n)),
        Value::Strings(l) if kind == FieldType::MFEnum => {
            list(out, indent, l, 4, |out, s| out.push_str(s));
        }
        Value::Strings(l) => list(out, indent, l, 1, |out, s| {
            out.push_str(&string(s, escapes))
        }),
        Value::Vec2s(l) => list(out, indent, l, 4, |out, v| floats(out, &v.to_array())),
        Value::Vec3s(l) => list(out, indent, l, 1, |out, v| floats(out, &v.to_array())),
        Value::Vec4s(l) => list(out, indent, l, 1, |out, v| floats(out, &v.to_array())),
        Value::Rotations(l) => list(out, indent, l, 1, |out, r| floats(out, &rotation(r))),
        Value::Matrices(l) => list(out, indent, l, 1, |out, m| floats(out, &m.to_cols_array())),
        Value::Planes(l) => list(out, indent, l, 1, |out, p| {
            floats(out, &[p.normal.x, p.normal.y, p.normal.z, p.distance]);
        }),
    }
}

fn boolean(b: bool) -> &'static str {
    if b { "TRUE" } else { "FALSE" }
}

fn integer(out: &mut PieceWriter<'_>, n: i32) {
    out.push_str(itoa::Buffer::new().format(n));
}

fn float(out: &mut PieceWriter<'_>, n: f32) {
    number(out, n, n == 0.0 || (1e-5..1e9).contains(&n.abs()));
}

fn double(out: &mut PieceWriter<'_>, n: f64) {
    number(out, n, n == 0.0 || (1e-5..1e15).contains(&n.abs()));
}

/// Appends the shortest text that reads back as the same number, without an exponent if `plain`.
fn number<N>(out: &mut PieceWriter<'_>, n: N, plain: bool)
where
    N: zmij::Float + LowerExp + Into<f64> + Copy,
{
    if plain {
        out.push_str(without_fraction(zmij::Buffer::new().format_finite(n)));
    } else if n.into().is_nan() {
        out.push_str("nan");
    } else {
        let _ = write!(out, "{n:e}");
    }
}

/// Returns a number without the fraction `.0` of whole numbers.
fn without_fraction(text: &str) -> &str {
    text.strip_suffix(".0").unwrap_or(text)
}

fn numbers<T>(out: &mut PieceWriter<'_>, list: &[T], one: impl Fn(&mut PieceWriter<'_>, &T)) {
    for (i, n) in until_stopped(list.iter()).enumerate() {
        if i > 0 {
            out.push_str(" ");
        }
        one(out, n);
    }
}

fn floats(out: &mut PieceWriter<'_>, list: &[f32]) {
    numbers(out, list, |out, n| float(out, *n));
}

fn rotation(r: &Rotation) -> [f32; 4] {
    [r.axis.x, r.axis.y, r.axis.z, r.angle]
}

/// Appends a list in brackets with `in_line` values per line, or a single value without brackets.
pub(super) fn list<T>(
    out: &mut PieceWriter<'_>,
    indent: usize,
    list: &[T],
    in_line: usize,
    one: impl Fn(&mut PieceWriter<'_>, &T),
) {
    if let [value] = list {
        return one(out, value);
    }
    out.push_str("[ ");
    for (i, value) in until_stopped(list.iter()).enumerate() {
        if i > 0 {
            if i % in_line == 0 {
                out.push_str(",\n");
                out.indent(indent + 1);
            } else {
                out.push_str(", ");
            }
        }
        one(out, value);
    }
    out.push_str(" ]");
}

fn image(out: &mut PieceWriter<'_>, image: &Image, solid: bool) {
    let _ = write!(out, "{} {}", image.width, image.height);
    if solid {
        let _ = write!(out, " {}", image.depth);
    }
    let _ = write!(out, " {}", image.components);
    for (i, pixel) in image
        .bytes
        .chunks(usize::from(image.components.max(1)))
        .enumerate()
    {
        out.push_str(if i % 8 == 0 { "\n 0x" } else { " 0x" });
        for byte in pixel {
            let _ = write!(out, "{byte:02x}");
        }
    }
}

/// Returns a string as text. Where a backslash is no escape, a string in quotes cannot end in one.
/// Such a string is written without quotes, or with a blank at its end.
pub(super) fn string(text: &str, escapes: Escapes) -> String {
    match escapes {
        Escapes::Quote if !text.ends_with('\\') => format!("\"{}\"", text.replace('"', "\\\"")),
        Escapes::Quote if is_bare(text) => format!("{text} "),
        Escapes::Quote => format!("\"{} \"", text.replace('"', "\\\"")),
        Escapes::QuoteAndBackslash => quoted(text),
    }
}

/// Returns whether a string must be written with a blank at its end.
pub(super) fn needs_blank(text: &str, escapes: Escapes) -> bool {
    escapes == Escapes::Quote && text.ends_with('\\') && !is_bare(text)
}

/// Returns whether a string can be written without quotes.
fn is_bare(text: &str) -> bool {
    let is_plain = |c: char| c.is_alphanumeric() || "\\/:._-+".contains(c);
    text.chars().all(is_plain)
}

/// Quotes a string of VRML97. A backslash is doubled only if the reader would otherwise treat it as
/// an escape.
pub(super) fn quoted(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 2);
    out.push('"');
    let mut chars = text.chars().peekable();
    while let Some(c) = chars.next() {
        match (c, chars.peek()) {
            ('"', _) => out.push_str("\\\""),
            ('\\', None | Some('"' | '\\')) => out.push_str("\\\\"),
            _ => out.push(c),
        }
    }
    out.push('"');
    out
}

fn bit_mask(n: i32, names: &[(&str, i64)]) -> String {
    match bit_names(n, names).as_slice() {
        [one] => one.clone(),
        several => format!("({})", several.join(" | ")),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn numbers_read_back_and_are_as_short_as_those_of_the_standard_library(
            bits: u32,
            exponent in -70i32..70,
            fraction: u64,
        ) {
            let single = f32::from_bits(bits);
            let text = value_text(&Value::Float(single), FieldType::SFFloat);
            let shortest = [single.to_string(), format!("{single:e}")].map(|text| text.len());
            let again: f32 = text.parse().expect("a number");
            prop_assert!(again.to_bits() == bits || single.is_nan());
            prop_assert!(shortest.contains(&text.len()));
            let double = (1.0 + fraction as f64 * 2f64.powi(-64)) * 2f64.powi(exponent);
            let text = value_text(&Value::Double(double), FieldType::SFDouble);
            let shortest = [double.to_string(), format!("{double:e}")].map(|text| text.len());
            prop_assert_eq!(text.parse(), Ok(double));
            prop_assert!(shortest.contains(&text.len()));
        }
    }
}
