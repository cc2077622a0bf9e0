//! Converts values of fields to data that `prelude.js` makes values from, and back.
//!
//! The data of a value is an array of its numbers, of its strings, or of its nodes' indices, where
//! -1 is `NULL`.

use std::sync::Arc;

use boa_engine::object::builtins::JsArray;
use boa_engine::{Context, JsResult, JsString, JsValue, js_string};
use ivcam_inventor::grammar::FieldType;
use ivcam_inventor::grammar::FieldType as F;
use ivcam_inventor::grammar::value::Image;
use ivcam_inventor::iv::{NodeId, Value};
use ivcam_inventor::snapshot::engines::convert::{from_numbers, numbers};

use super::meter::{MAX_LIST, Meter};

/// Returns the name that scripts have for a type, or `None` if they have none.
pub(super) fn script_type(kind: FieldType) -> Option<&'static str> {
    Some(match kind {
        F::SFShort | F::SFUShort | F::SFUInt32 | F::SFEnum | F::SFBitMask => "SFInt32",
        F::MFShort | F::MFUShort | F::MFUInt32 | F::MFEnum => "MFInt32",
        F::SFName => "SFString",
        F::MFName => "MFString",
        F::SFBool | F::SFInt32 | F::SFFloat | F::SFDouble | F::SFTime | F::SFString => kind.name(),
        F::SFVec2f | F::SFVec3f | F::SFColor | F::SFRotation | F::SFImage | F::SFNode => {
            kind.name()
        }
        F::MFBool | F::MFInt32 | F::MFFloat | F::MFDouble | F::MFTime | F::MFString => kind.name(),
        F::MFVec2f | F::MFVec3f | F::MFColor | F::MFRotation | F::MFNode => kind.name(),
        _ => return None,
    })
}

/// Returns the data of a value.
pub(super) fn to_data(value: &Value, context: &mut Context) -> JsArray {
    let items: Vec<JsValue> = match value {
        Value::String(text) => vec![js_string!(&**text).into()],
        Value::Strings(texts) => texts
            .iter()
            .map(|t| js_string!(t.as_str()).into())
            .collect(),
        Value::Node(node) => vec![node.map_or(-1.0, |n| f64::from(n.0)).into()],
        Value::Nodes(nodes) => nodes.iter().map(|n| f64::from(n.0).into()).collect(),
        Value::Image(image) => {
            let head = [image.width, image.height, u32::from(image.components)];
            let pixels = image
                .bytes
                .chunks_exact(usize::from(image.components.max(1)));
            let pixels = pixels.map(|p| p.iter().fold(0_u32, |sum, b| sum << 8 | u32::from(*b)));
            head.into_iter()
                .chain(pixels)
                .map(|n| f64::from(n).into())
                .collect()
        }
        value => {
            let (numbers, _) = numbers(value).unwrap_or_default();
            let is_short = !matches!(value, Value::Double(_) | Value::Doubles(_));
            let number = |n: f64| if is_short { shortest(n) } else { n };
            numbers.into_iter().map(|n| number(n).into()).collect()
        }
    };
    JsArray::from_iter(items, context)
}

/// Returns the number with the fewest digits that an `f32` is nearest to, as a script would state
/// it: 0.1 and not 0.10000000149.
fn shortest(number: f64) -> f64 {
    if number.fract() == 0.0 {
        return number;
    }
    let text = (number as f32).to_string();
    text.parse().unwrap_or(number)
}

/// Makes a value from its data. Numbers that are not finite become 0.
pub(super) fn from_data(
    data: &JsValue,
    kind: FieldType,
    meter: &Meter,
    context: &mut Context,
) -> JsResult<Value> {
    let items = items(data, meter, context)?;
    let texts = || items.iter().map(text);
    Ok(match kind {
        F::SFString | F::SFName => Value::String(texts().next().unwrap_or_default().into()),
        F::MFString | F::MFName => Value::Strings(texts().collect()),
        F::SFNode => Value::Node(items.first().and_then(node)),
        F::MFNode => Value::Nodes(items.iter().filter_map(node).collect()),
        F::SFImage => image(&items),
        _ => {
            let all: Vec<f64> = items.iter().map(finite).collect();
            from_numbers(&all, kind).unwrap_or_else(|| Value::empty(kind))
        }
    })
}

/// Returns the elements of an array.
pub(super) fn items(
    data: &JsValue,
    meter: &Meter,
    context: &mut Context,
) -> JsResult<Vec<JsValue>> {
    let Some(object) = data.as_object() else {
        return Ok(Vec::new());
    };
    let array = JsArray::from_object(object)?;
    let length = array.length(context)?;
    // A list has up to four numbers for each element.
    if length > 4 * MAX_LIST as u64 {
        return meter.stop(format!("a list has more than {MAX_LIST} elements"));
    }
    (0..length).map(|i| array.get(i, context)).collect()
}

/// Returns a string, or nothing if the value is none.
pub(super) fn text(value: &JsValue) -> String {
    let text: Option<JsString> = value.as_string();
    text.map_or_else(String::new, |t| t.to_std_string_lossy())
}

/// Returns a node. `NULL` is -1.
pub(super) fn node(value: &JsValue) -> Option<NodeId> {
    let index = value.as_number().filter(|n| *n >= 0.0 && n.is_finite())?;
    Some(NodeId(index as u32))
}

fn finite(value: &JsValue) -> f64 {
    let number = value.as_number().unwrap_or(0.0);
    if number.is_finite() { number } else { 0.0 }
}

/// Makes an image. Pixels that are missing are black.
fn image(items: &[JsValue]) -> Value {
    let at = |i: usize| items.get(i).map_or(0.0, finite);
    let size = |i: usize| at(i).clamp(0.0, 4096.0) as u32;
    let (width, height, components) = (size(0), size(1), at(2).clamp(0.0, 4.0) as u8);
    let count = (width as usize * height as usize).min(MAX_LIST);
    let pixel = |i: usize| at(3 + i).rem_euclid(4_294_967_296.0) as u32;
    let bytes = (0..count).flat_map(|i| {
        let bytes = pixel(i).to_be_bytes();
        bytes.into_iter().skip(4 - usize::from(components))
    });
    let bytes: Vec<u8> = bytes.collect();
    let whole = bytes.len() == width as usize * height as usize * usize::from(components);
    let (width, height) = if whole { (width, height) } else { (0, 0) };
    Value::Image(Box::new(Image {
        width,
        height,
        depth: 1,
        components,
        bytes: Arc::from(if whole { bytes } else { Vec::new() }),
    }))
}
