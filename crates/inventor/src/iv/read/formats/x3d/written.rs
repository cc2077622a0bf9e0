//! Writes values of attributes as the classic encoding has them.

use crate::grammar::FieldType;

/// Appends a value of a type.
pub(super) fn put(out: &mut Vec<u8>, kind: FieldType, value: &str) {
    match kind {
        FieldType::SFString | FieldType::SFName => put_string(out, &value.replace("\\\"", "\"")),
        FieldType::MFString | FieldType::MFName => {
            out.push(b'[');
            match is_strings(value) {
                true => out.extend_from_slice(value.as_bytes()),
                false => put_string(out, value.trim()),
            }
            out.push(b']');
        }
        _ if value.contains(['{', '}', '[', ']', '"', '#']) => put_string(out, value),
        kind if is_copied(kind) => out.extend_from_slice(value.as_bytes()),
        _ => {
            out.push(b'[');
            out.extend_from_slice(value.as_bytes());
            out.push(b']');
        }
    }
}

/// Returns whether a text is a list of strings in quotes.
fn is_strings(text: &str) -> bool {
    let (mut is_quoted, mut is_escaped) = (false, false);
    for c in text.chars() {
        match c {
            '"' if !is_escaped => is_quoted = !is_quoted,
            _ if !(is_quoted || c.is_ascii_whitespace() || c == ',') => return false,
            _ => {}
        }
        is_escaped = is_quoted && c == '\\' && !is_escaped;
    }
    !is_quoted
}

/// Returns whether a value is written as the attribute has it, so that their bytes are the same.
pub(super) fn is_copied(kind: FieldType) -> bool {
    !kind.is_multiple() && !matches!(kind, FieldType::SFString | FieldType::SFName)
}

/// Appends a string in quotes.
pub(super) fn put_string(out: &mut Vec<u8>, text: &str) {
    out.push(b'"');
    for byte in text.bytes() {
        if matches!(byte, b'"' | b'\\') {
            out.push(b'\\');
        }
        out.push(byte);
    }
    out.push(b'"');
}

/// Returns the value of a declared field without a value.
pub(super) fn empty(kind: FieldType) -> &'static str {
    match kind {
        _ if kind.is_multiple() => "[]",
        FieldType::SFNode => "NULL",
        FieldType::SFString => "\"\"",
        FieldType::SFBool => "FALSE",
        FieldType::SFRotation => "0 0 1 0",
        _ => match kind.width() {
            16 => "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1",
            4 => "0 0 0 0",
            3 => "0 0 0",
            2 => "0 0",
            _ if kind == FieldType::SFImage => "0 0 0",
            _ => "0",
        },
    }
}

/// Returns a name as the classic encoding may have it: bytes that end a name there become `_`.
pub(super) fn name(text: &str) -> String {
    let legal = |c: char| match c {
        '\0'..=' '
        | ','
        | '{'
        | '}'
        | '['
        | ']'
        | '"'
        | '#'
        | '('
        | ')'
        | '\''
        | '='
        | '~'
        | '|'
        | '.' => '_',
        c => c,
    };
    match text.is_empty() {
        true => "_".into(),
        false => text.chars().map(legal).collect(),
    }
}
