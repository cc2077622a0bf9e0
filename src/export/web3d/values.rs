//! Writes values of fields as attributes of XML.

use std::fmt::Write;

use ivcam_base::work::until_stopped;
use ivcam_inventor::grammar::FieldType;
use ivcam_inventor::grammar::value::{Image, Value};

/// The number of characters after which a list continues on a new line.
const LINE: usize = 100;

/// Returns the text of a value that holds no nodes, escaped for an attribute in single quotes.
pub(super) fn attribute(value: &Value, kind: FieldType) -> String {
    match value {
        Value::Bool(b) => b.to_string(),
        Value::Int(n) => n.to_string(),
        Value::UInt(n) => n.to_string(),
        Value::Float(n) => float(f64::from(*n), n),
        Value::Double(n) => float(*n, n),
        Value::String(s) => escaped(s),
        Value::Vec2(v) => floats(&v.to_array()),
        Value::Vec3(v) => floats(&v.to_array()),
        Value::Vec4(v) => floats(&v.to_array()),
        Value::Rotation(r) => floats(&[r.axis.x, r.axis.y, r.axis.z, r.angle]),
        Value::Image(image) => pixels(image),
        Value::Bools(l) => list(l.iter().map(bool::to_string)),
        Value::Ints(l) => list(l.iter().map(i32::to_string)),
        Value::UInts(l) => list(l.iter().map(u32::to_string)),
        Value::Floats(l) => list(l.iter().map(|n| float(f64::from(*n), n))),
        Value::Doubles(l) => list(l.chunks(kind.width().max(1)).map(doubles)),
        Value::Strings(l) => escaped(&quoted(l)),
        Value::Vec2s(l) => list(l.iter().map(|v| floats(&v.to_array()))),
        Value::Vec3s(l) => list(l.iter().map(|v| floats(&v.to_array()))),
        Value::Vec4s(l) => list(l.iter().map(|v| floats(&v.to_array()))),
        Value::Rotations(l) => list(
            l.iter()
                .map(|r| floats(&[r.axis.x, r.axis.y, r.axis.z, r.angle])),
        ),
        // VRML97 has no other types, and nodes are elements.
        _ => String::new(),
    }
}

/// Returns the shortest text that reads back as the same number. XML has names for the numbers that
/// are not finite, but X3D has no use for them.
fn float(value: f64, shortest: &(impl std::fmt::Display + std::fmt::LowerExp)) -> String {
    match value.abs() {
        size if !size.is_finite() => "0".to_owned(),
        size if size == 0.0 || (1e-5..1e9).contains(&size) => shortest.to_string(),
        _ => format!("{shortest:e}"),
    }
}

fn floats(numbers: &[f32]) -> String {
    let words: Vec<String> = numbers.iter().map(|n| float(f64::from(*n), n)).collect();
    words.join(" ")
}

fn doubles(numbers: &[f64]) -> String {
    let words: Vec<String> = numbers.iter().map(|n| float(*n, n)).collect();
    words.join(" ")
}

/// Joins the items of a list, with line breaks where lines would become long.
fn list(items: impl Iterator<Item = String>) -> String {
    let mut out = String::new();
    let mut line = 0;
    for item in until_stopped(items) {
        if line > 0 {
            out.push(if line > LINE { '\n' } else { ' ' });
            line = if line > LINE { 0 } else { line };
        }
        line += item.len() + 1;
        out += &item;
    }
    out
}

/// Returns the strings of a list in double quotes.
fn quoted(strings: &[String]) -> String {
    let quote = |s: &String| format!("\"{}\"", s.replace('\\', "\\\\").replace('"', "\\\""));
    strings.iter().map(quote).collect::<Vec<_>>().join(" ")
}

/// Returns the size of an image, the number of its components, and its pixels.
fn pixels(image: &Image) -> String {
    let mut out = format!("{} {} {}", image.width, image.height, image.components);
    let size = usize::from(image.components);
    for (i, pixel) in image.bytes.chunks(size.max(1)).enumerate() {
        out.push(if i % 8 == 0 { '\n' } else { ' ' });
        out += "0x";
        for byte in pixel {
            let _ = write!(out, "{byte:02X}");
        }
    }
    out
}

/// Escapes a text for an attribute in single quotes. The line breaks of a script stay line breaks.
/// Characters that XML cannot hold become spaces.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '\'' => out += "&apos;",
            '\n' => out += "&#10;",
            '\r' => out += "&#13;",
            '\t' => out += "&#9;",
            '\0'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn values_are_those_of_the_xml_encoding() {
        let strings = vec!["a \"b\" \\".to_owned(), "<c>&'\n".to_owned()];
        let image = Image {
            width: 2,
            height: 1,
            depth: 1,
            components: 3,
            bytes: vec![1, 2, 255, 0, 0, 9].into(),
        };
        for (value, kind, text) in [
            (Value::Bool(true), FieldType::SFBool, "true"),
            (Value::Float(0.1), FieldType::SFFloat, "0.1"),
            (Value::Float(1e-7), FieldType::SFFloat, "1e-7"),
            (Value::Float(f32::NAN), FieldType::SFFloat, "0"),
            (Value::Double(0.1), FieldType::SFTime, "0.1"),
            (
                Value::Vec3s(vec![Vec3::X, Vec3::Y]),
                FieldType::MFVec3f,
                "1 0 0 0 1 0",
            ),
            (
                Value::Strings(strings),
                FieldType::MFString,
                "\"a \\\"b\\\" \\\\\" \"&lt;c&gt;&amp;&apos;&#10;\"",
            ),
            (
                Value::Image(Box::new(image)),
                FieldType::SFImage,
                "2 1 3\n0x0102FF 0x000009",
            ),
        ] {
            assert_eq!(attribute(&value, kind), text);
        }
        let long = attribute(&Value::Ints(vec![-1; 100]), FieldType::MFInt32);
        assert_eq!(long.split_whitespace().count(), 100);
        assert!(long.lines().all(|line| line.len() < 110) && long.contains('\n'));
    }
}
