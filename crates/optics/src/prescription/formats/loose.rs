//! JSON with `Infinity`, as Python writes it.

use std::sync::Arc;

use ivcam_base::diag::{Result, Source};
use serde_json::Value;

use crate::prescription::formats::json_text;

/// A number this large stands for infinity. No length of a lens is.
const ENDLESS: f64 = 1e300;

/// Parses a JSON text in which numbers may be `Infinity`. They become numbers that [`finite`]
/// recognizes, and places in messages stay those of the text.
///
/// # Errors
///
/// Returns an error at the place where the text is not JSON.
pub(super) fn parse(source: &Arc<Source>) -> Result<Value> {
    const WORD: &[u8] = b"Infinity";
    let mut bytes = source.bytes.clone();
    let (mut in_string, mut escaped, mut at) = (false, false, 0);
    while at < bytes.len() {
        match bytes[at] {
            _ if escaped => escaped = false,
            b'\\' if in_string => escaped = true,
            b'"' => in_string = !in_string,
            b'I' if !in_string && bytes[at..].starts_with(WORD) => {
                bytes[at..at + WORD.len()].copy_from_slice(b"1.0e+300");
                at += WORD.len();
                continue;
            }
            _ => {}
        }
        at += 1;
    }
    let changed = Arc::new(Source::new(source.name.clone(), bytes));
    json_text::parse(&changed).map_err(|mut error| {
        if let Some((place, _)) = &mut error.place {
            *place = source.clone();
        }
        error
    })
}

/// A number that is not infinite.
pub(super) fn finite(value: Option<&Value>) -> Option<f64> {
    value?.as_f64().filter(|v| v.abs() < ENDLESS)
}

/// The numbers of a list, or of an array as `json_tricks` writes those of numpy.
pub(super) fn numbers(value: Option<&Value>) -> Vec<f64> {
    let list = value.and_then(|v| v.get("__ndarray__").unwrap_or(v).as_array());
    list.into_iter()
        .flatten()
        .filter_map(Value::as_f64)
        .collect()
}
