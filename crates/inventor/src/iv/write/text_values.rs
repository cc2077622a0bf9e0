//! Writes field values as text. Numbers have the shortest text that reads back as the same number.

use std::fmt::Write as _;

use ivcam_base::work::until_stopped;

use super::spelling::{bit_names, enumeration};
use crate::grammar::FieldType;
use crate::grammar::value::{Image, Rotation, Value};

/// Returns a value that contains no nodes as text.
pub(crate) fn value_text(value: &Value, kind: FieldType) -> String {
    let mut text = String::new();
    put(&mut text, 0, value, kind, &[]);
    text
}

/// Appends a value that contains no nodes.
pub(super) fn put(
    out: &mut String,
    indent: usize,
    value: &Value,
    kind: FieldType,
    names: &[(&str, i64)],
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
        Value::String(s) => out.push_str(&quoted(s)),
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
        Value::Strings(l) => list(out, indent, l, 1, |out, s| out.push_str(&quoted(s))),
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

fn integer(out: &mut String, n: i32) {
    let _ = write!(out, "{n}");
}

/// Appends the shortest text that reads back as the same number.
fn float(out: &mut String, n: f32) {
    let plain = n == 0.0 || (1e-5..1e9).contains(&n.abs());
    let _ = match n {
        n if n.is_nan() => write!(out, "nan"),
        n if plain || n.is_infinite() => write!(out, "{n}"),
        n => write!(out, "{n:e}"),
    };
}

/// Appends the shortest text that reads back as the same number.
fn double(out: &mut String, n: f64) {
    let plain = n == 0.0 || (1e-5..1e15).contains(&n.abs());
    let _ = match n {
        n if n.is_nan() => write!(out, "nan"),
        n if plain || n.is_infinite() => write!(out, "{n}"),
        n => write!(out, "{n:e}"),
    };
}

fn numbers<T>(out: &mut String, list: &[T], one: impl Fn(&mut String, &T)) {
    for (i, n) in until_stopped(list.iter()).enumerate() {
        if i > 0 {
            out.push(' ');
        }
        one(out, n);
    }
}

fn floats(out: &mut String, list: &[f32]) {
    numbers(out, list, |out, n| float(out, *n));
}

fn rotation(r: &Rotation) -> [f32; 4] {
    [r.axis.x, r.axis.y, r.axis.z, r.angle]
}

/// Appends a list in brackets with `in_line` values per line, or a single value without brackets.
pub(super) fn list<T>(
    out: &mut String,
    indent: usize,
    list: &[T],
    in_line: usize,
    one: impl Fn(&mut String, &T),
) {
    if let [value] = list {
        return one(out, value);
    }
    out.push_str("[ ");
    for (i, value) in until_stopped(list.iter()).enumerate() {
        if i > 0 {
            out.push(',');
            if i % in_line == 0 {
                out.push('\n');
                out.extend(std::iter::repeat_n("  ", indent + 1));
            } else {
                out.push(' ');
            }
        }
        one(out, value);
    }
    out.push_str(" ]");
}

fn image(out: &mut String, image: &Image, solid: bool) {
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

/// Quotes a string. A backslash is doubled only if the reader would otherwise treat it as an
/// escape.
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
