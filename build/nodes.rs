//! Reads `*.nodes` files and writes Rust: the class table, class ids, field handles.

use std::collections::{HashMap, HashSet};
use std::fmt::Write as _;
use std::path::Path;

struct Class {
    name: String,
    family: String,
    dialects: Vec<String>,
    treatment: String,
    fields: Vec<Field>,
    inputs: Vec<(String, String)>,
    outputs: Vec<(String, String)>,
    parts: Vec<Part>,
    place: String,
}

/// A place in a node kit's catalogue: `part camera of transformGroup PerspectiveCamera`.
#[derive(Clone)]
struct Part {
    name: String,
    /// The part it is a child of; `this` is the kit.
    parent: String,
    before: Option<String>,
    class: String,
    list: bool,
    /// Made by the kit itself, not only when a file states it.
    made: bool,
}

#[derive(Clone)]
struct Field {
    kind: String,
    name: String,
    default: String,
    names: Vec<(String, i64)>,
    range: Option<String>,
}

const DIALECTS: [&str; 5] = ["iv1", "iv2", "vrml1", "vrml97", "coin"];
const TREATMENTS: [&str; 5] = ["rendered", "state", "group", "kept", "abstract"];

/// Every field type with the Rust type of its handle and the arm of `Value` that stores it.
const KINDS: [(&str, &str); 53] = [
    ("SFBool", "bool"),
    ("SFInt32", "i32"),
    ("SFUInt32", "u32"),
    ("SFShort", "i16"),
    ("SFUShort", "u16"),
    ("SFFloat", "f32"),
    ("SFDouble", "f64"),
    ("SFTime", "Seconds"),
    ("SFString", "Text"),
    ("SFName", "Text"),
    ("SFEnum", "Choice"),
    ("SFBitMask", "Choice"),
    ("SFVec2f", "Vec2"),
    ("SFVec3f", "Vec3"),
    ("SFVec4f", "Vec4"),
    ("SFColor", "Vec3"),
    ("SFRotation", "Rotation"),
    ("SFMatrix", "Mat4"),
    ("SFPlane", "Plane"),
    ("SFImage", "Image"),
    ("SFImage3", "Image"),
    ("SFVec2s", "[i32]"),
    ("SFVec2i32", "[i32]"),
    ("SFVec3i32", "[i32]"),
    ("SFVec4i32", "[i32]"),
    ("SFVec3d", "[f64]"),
    ("SFNode", "NodeRefValue"),
    ("SFPath", "NodeRefValue"),
    ("SFEngine", "NodeRefValue"),
    ("SFTrigger", "Trigger"),
    ("MFBool", "[bool]"),
    ("MFInt32", "[i32]"),
    ("MFUInt32", "[u32]"),
    ("MFShort", "[i16]"),
    ("MFUShort", "[u16]"),
    ("MFFloat", "[f32]"),
    ("MFDouble", "[f64]"),
    ("MFTime", "[Seconds]"),
    ("MFString", "[String]"),
    ("MFEnum", "[Choice]"),
    ("MFVec2f", "[Vec2]"),
    ("MFVec3f", "[Vec3]"),
    ("MFVec4f", "[Vec4]"),
    ("MFColor", "[Vec3]"),
    ("MFRotation", "[Rotation]"),
    ("MFMatrix", "[Mat4]"),
    ("MFPlane", "[Plane]"),
    ("MFName", "[String]"),
    ("MFVec2i32", "[i32]"),
    ("MFVec3i32", "[i32]"),
    ("MFVec4i32", "[i32]"),
    ("MFVec3d", "[f64]"),
    ("MFNode", "[NodeId]"),
];

pub fn compile(folder: &Path) -> Result<String, String> {
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .map_err(|e| format!("{}: {e}", folder.display()))?
        .filter_map(|entry| entry.ok().map(|e| e.path()))
        .filter(|path| path.extension().is_some_and(|e| e == "nodes"))
        .collect();
    files.sort();
    let mut classes = Vec::new();
    for file in files {
        let text =
            std::fs::read_to_string(&file).map_err(|e| format!("{}: {e}", file.display()))?;
        let name = file
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        parse(&format!("grammar/{name}"), &text, &mut classes)?;
    }
    inherit(&mut classes)?;
    write(&classes)
}

fn parse(file: &str, text: &str, classes: &mut Vec<Class>) -> Result<(), String> {
    for (index, line) in text.lines().enumerate() {
        let place = format!("{file}:{}", index + 1);
        let line = strip_comment(line);
        if line.trim().is_empty() {
            continue;
        }
        if line.starts_with([' ', '\t']) {
            let class = classes
                .last_mut()
                .ok_or(format!("{place}: a field before any class"))?;
            member(&place, line.trim(), class)?;
        } else {
            classes.push(class(&place, line.trim())?);
        }
    }
    Ok(())
}

/// Cuts at a `#` that is not inside quotes.
fn strip_comment(line: &str) -> &str {
    let mut quoted = false;
    for (i, c) in line.char_indices() {
        match c {
            '"' => quoted = !quoted,
            '#' if !quoted => return &line[..i],
            _ => {}
        }
    }
    line
}

/// `Cone : Shape  in iv1 iv2 vrml1  rendered`
fn class(place: &str, line: &str) -> Result<Class, String> {
    let (name, rest) = line
        .split_once(':')
        .ok_or(format!("{place}: expected `Name : Family in … treatment`"))?;
    let words: Vec<&str> = rest.split_whitespace().collect();
    let [family, "in", dialects @ .., treatment] = words.as_slice() else {
        return Err(format!(
            "{place}: expected `Name : Family in dialects… treatment`"
        ));
    };
    for d in dialects {
        if !DIALECTS.contains(d) {
            return Err(format!(
                "{place}: unknown dialect `{d}`, expected one of {DIALECTS:?}"
            ));
        }
    }
    if !TREATMENTS.contains(treatment) {
        let expected = format!("expected one of {TREATMENTS:?}");
        return Err(format!(
            "{place}: unknown treatment `{treatment}`, {expected}"
        ));
    }
    Ok(Class {
        name: name.trim().into(),
        family: (*family).into(),
        dialects: dialects.iter().map(|d| (*d).into()).collect(),
        treatment: (*treatment).into(),
        fields: Vec::new(),
        inputs: Vec::new(),
        outputs: Vec::new(),
        parts: Vec::new(),
        place: place.into(),
    })
}

/// A line of a class: a field, an event or engine output, or a part of a kit.
fn member(place: &str, line: &str, class: &mut Class) -> Result<(), String> {
    let words: Vec<&str> = line.split_whitespace().collect();
    match words.as_slice() {
        [word @ ("in" | "out"), kind, name] => {
            if !KINDS.iter().any(|(k, _)| k == kind) {
                return Err(format!("{place}: unknown field type `{kind}`"));
            }
            let events = match *word {
                "in" => &mut class.inputs,
                _ => &mut class.outputs,
            };
            events.push(((*name).to_owned(), (*kind).to_owned()));
        }
        [word @ ("part" | "list"), name, "of", parent, rest @ ..] => {
            let (before, of) = match rest {
                ["before", sibling, of] => (Some((*sibling).to_owned()), of),
                [of] => (None, of),
                _ => {
                    return Err(format!(
                        "{place}: expected `{word} name of parent [before sibling] Class[?]`"
                    ));
                }
            };
            class.parts.push(Part {
                name: (*name).to_owned(),
                parent: (*parent).to_owned(),
                before,
                class: of.trim_end_matches('?').to_owned(),
                list: *word == "list",
                made: !of.ends_with('?'),
            });
            class.fields.push(field(place, &format!("SFNode {name}"))?);
        }
        _ => class.fields.push(field(place, line)?),
    }
    Ok(())
}

/// `SFBitMask parts  ALL  { SIDES=1 BOTTOM=2 ALL=3 }` or `SFFloat height 2 (0, inf)`
fn field(place: &str, line: &str) -> Result<Field, String> {
    let (kind, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    if !KINDS.iter().any(|(k, _)| *k == kind) {
        return Err(format!("{place}: unknown field type `{kind}`"));
    }
    let rest = rest.trim();
    let (name, rest) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
    if name.is_empty() {
        return Err(format!("{place}: a field needs a name"));
    }
    let mut default = rest.trim().to_owned();
    let mut names = Vec::new();
    let mut range = None;
    if let Some(open) = default.find('{') {
        let list = default[open + 1..].trim().trim_end_matches('}').to_owned();
        for (i, word) in list.split_whitespace().enumerate() {
            let (word, number) = match word.split_once('=') {
                Some((w, n)) => (
                    w,
                    number(n).ok_or(format!("{place}: bad value in `{word}`"))?,
                ),
                None => (word, i as i64),
            };
            names.push((word.to_owned(), number));
        }
        default.truncate(open);
    } else if let Some(open) = default.rfind(" (").or_else(|| default.rfind(" [0"))
        && default[open..].contains(',')
    {
        range = Some(default[open + 1..].to_owned());
        default.truncate(open);
    }
    let default = default.trim().to_owned();
    Ok(Field {
        kind: kind.into(),
        name: name.into(),
        default,
        names,
        range,
    })
}

fn number(text: &str) -> Option<i64> {
    match text.strip_prefix("0x") {
        Some(hex) => i64::from_str_radix(hex, 16).ok(),
        None => text.parse().ok(),
    }
}

/// Puts the fields of a declared family in front of a class's own; a field of the same name is
/// replaced in place. Families may come in any order.
fn inherit(classes: &mut [Class]) -> Result<(), String> {
    let by_name: HashMap<String, usize> = classes
        .iter()
        .enumerate()
        .rev()
        .map(|(i, c)| (c.name.clone(), i))
        .collect();
    let own: Vec<Vec<Field>> = classes.iter().map(|c| c.fields.clone()).collect();
    let events: Vec<_> = classes
        .iter()
        .map(|c| (c.inputs.clone(), c.outputs.clone()))
        .collect();
    let own_parts: Vec<Vec<Part>> = classes.iter().map(|c| c.parts.clone()).collect();
    for i in 0..classes.len() {
        let mut chain = vec![i];
        while let Some(&next) = by_name.get(&classes[chain[chain.len() - 1]].family) {
            if chain.contains(&next) {
                if next == chain[chain.len() - 1] {
                    break;
                }
                return Err(format!("{}: a family inherits itself", classes[i].place));
            }
            chain.push(next);
        }
        let mut all: Vec<Field> = Vec::new();
        let (mut inputs, mut outputs, mut parts) = (Vec::new(), Vec::new(), Vec::new());
        for &class in chain.iter().rev() {
            inputs.extend(events[class].0.clone());
            outputs.extend(events[class].1.clone());
            insert_parts(&mut parts, &own_parts[class]);
            for field in &own[class] {
                match all.iter_mut().find(|f| f.name == field.name) {
                    Some(old) => *old = field.clone(),
                    None => all.push(field.clone()),
                }
            }
        }
        classes[i].fields = all;
        classes[i].inputs = inputs;
        classes[i].outputs = outputs;
        classes[i].parts = parts;
    }
    Ok(())
}

/// Adds a kit's own parts to those of its family, from the last, so that the sibling a part
/// stands before is already there. A part of the same name is replaced in place.
fn insert_parts(parts: &mut Vec<Part>, own: &[Part]) {
    for part in own.iter().rev() {
        if let Some(old) = parts.iter_mut().find(|p| p.name == part.name) {
            *old = part.clone();
            continue;
        }
        let sibling = part.before.as_ref();
        let at = sibling.and_then(|s| parts.iter().position(|p| p.name == *s));
        parts.insert(at.unwrap_or(parts.len()), part.clone());
    }
}

/// The module name of each class: `IndexedFaceSet` is `indexed_face_set`; a second entry of the
/// same name is prefixed by its first dialect, `vrml97_cone`.
fn modules(classes: &[Class]) -> Result<Vec<String>, String> {
    let mut seen = HashMap::new();
    let mut out = Vec::new();
    for class in classes {
        let mut module = snake(&class.name);
        if seen.contains_key(&module) {
            module = format!("{}_{module}", class.dialects.first().map_or("", |d| d));
        }
        if let Some(other) = seen.insert(module.clone(), &class.place) {
            return Err(format!(
                "{}: `{}` is already at {other}",
                class.place, class.name
            ));
        }
        out.push(module);
    }
    Ok(out)
}

fn snake(name: &str) -> String {
    let chars: Vec<char> = name.chars().collect();
    let mut out = String::new();
    for (i, &c) in chars.iter().enumerate() {
        let after_lower = i > 0 && (chars[i - 1].is_lowercase() || chars[i - 1].is_ascii_digit());
        let ends_acronym = i > 0
            && chars[i - 1].is_uppercase()
            && chars.get(i + 1).is_some_and(|n| n.is_lowercase());
        if c.is_uppercase() && (after_lower || ends_acronym) {
            out.push('_');
        }
        out.extend(c.to_lowercase());
    }
    if ["box", "switch", "loop", "in", "type"].contains(&out.as_str()) {
        out.push_str("_node");
    }
    out
}

fn write(classes: &[Class]) -> Result<String, String> {
    let modules = modules(classes)?;
    let mut table = String::from("pub static CLASSES: &[Class] = &[\n");
    let mut ids = String::from(
        "/// The id of every class, for `match`.\npub mod class {\n    use super::ClassId;\n",
    );
    let mut handles = String::new();
    for (i, (class, module)) in classes.iter().zip(&modules).enumerate() {
        let dialects: Vec<String> = class
            .dialects
            .iter()
            .map(|d| format!("Dialect::{}", d.to_uppercase()))
            .collect();
        let dialects = if dialects.is_empty() {
            "0".into()
        } else {
            dialects.join(" | ")
        };
        writeln!(
            table,
            "    Class {{ id: ClassId({i}), name: {:?}, family: {:?}, dialects: {dialects}, treatment: Treatment::{}, place: {:?}, fields: &[",
            class.name, class.family, camel(&class.treatment), class.place
        )
        .expect("a string can be written");
        writeln!(
            ids,
            "    pub const {}: ClassId = ClassId({i});",
            module.to_uppercase()
        )
        .expect("a string can be written");
        let mut consts = String::new();
        let mut taken = HashSet::new();
        for (k, field) in class.fields.iter().enumerate() {
            let handle = KINDS
                .iter()
                .find(|(n, _)| *n == field.kind)
                .map(|(_, h)| *h)
                .unwrap_or("");
            let default = default(class, field)?;
            writeln!(
                table,
                "        FieldDecl {{ name: {:?}, kind: FieldType::{}, default: {default}, names: &{:?}, range: {:?} }},",
                field.name, field.kind, field.names, field.range
            )
            .expect("a string can be written");
            let mut constant = snake(&field.name).trim_end_matches("_node").to_uppercase();
            if !taken.insert(constant.clone()) {
                constant.insert_str(0, "CAPITAL_"); // a Calculator has both `a` and `A`
            }
            writeln!(
                consts,
                "    pub const {constant}: Field<{handle}> = Field::new({i}, {k});"
            )
            .expect("a string can be written");
            for (name, value) in &field.names {
                let constant = snake(&field.name).to_uppercase();
                writeln!(
                    consts,
                    "    pub const {constant}_{}: i32 = {value};",
                    name.to_uppercase().replace('-', "_")
                )
                .expect("a string can be written");
            }
        }
        let events = |list: &[(String, String)]| -> String {
            list.iter()
                .map(|(n, k)| format!("({n:?}, FieldType::{k}), "))
                .collect()
        };
        writeln!(
            table,
            "    ], inputs: &[{}], outputs: &[{}], parts: &[",
            events(&class.inputs),
            events(&class.outputs)
        )
        .expect("a string can be written");
        for p in &class.parts {
            writeln!(
                table,
                "        Part {{ name: {:?}, parent: {:?}, class: {:?}, list: {}, made: {} }},",
                p.name, p.parent, p.class, p.list, p.made
            )
            .expect("a string can be written");
        }
        table.push_str("    ] },\n");
        if !consts.is_empty() {
            writeln!(
                handles,
                "/// Fields of `{}`.\npub mod {module} {{\n    use super::*;\n{consts}}}",
                class.name
            )
            .expect("a string can be written");
        }
    }
    table.push_str("];\n");
    ids.push_str("}\n");
    Ok(format!("{table}\n{ids}\n{handles}"))
}

fn camel(word: &str) -> String {
    let mut chars = word.chars();
    chars
        .next()
        .map(|c| c.to_uppercase().chain(chars).collect())
        .unwrap_or_default()
}

/// A default as a constant expression of `Default`.
fn default(class: &Class, field: &Field) -> Result<String, String> {
    let text = field.default.as_str();
    let bad = || format!("{}: bad default `{text}` for `{}`", class.place, field.name);
    let kind = field.kind.as_str();
    if let Some(element) = kind.strip_prefix("MF") {
        let inner = text.trim_start_matches('[').trim_end_matches(']').trim();
        if matches!(element, "Node") {
            return Ok("Default::Nothing".into());
        }
        if matches!(element, "String" | "Name") {
            let list: Vec<String> = strings(inner).iter().map(|s| format!("{s:?}")).collect();
            return Ok(format!("Default::Strings(&[{}])", list.join(", ")));
        }
        let list = numbers(field, inner).ok_or_else(bad)?;
        return Ok(format!("Default::Numbers(&{list:?})"));
    }
    match kind {
        "SFString" | "SFName" => Ok(format!(
            "Default::Strings(&[{:?}])",
            strings(text).first().cloned().unwrap_or_default()
        )),
        "SFNode" | "SFPath" | "SFEngine" | "SFTrigger" | "SFImage" | "SFImage3" => {
            Ok("Default::Nothing".into())
        }
        "SFEnum" | "SFBitMask" => {
            let mut bits = 0;
            for word in text.split(['|', ' ', '(', ')']).filter(|w| !w.is_empty()) {
                let named = field.names.iter().find(|(n, _)| n == word).map(|(_, v)| *v);
                bits |= named.or_else(|| number(word)).ok_or_else(bad)?;
            }
            Ok(format!("Default::Numbers(&[{bits} as f64])"))
        }
        _ => {
            let list = numbers(field, text).ok_or_else(bad)?;
            let want = match kind {
                "SFVec2f" | "SFVec2s" | "SFVec2i32" => 2,
                "SFVec3f" | "SFColor" | "SFVec3i32" | "SFVec3d" => 3,
                "SFVec4f" | "SFRotation" | "SFPlane" | "SFVec4i32" => 4,
                "SFMatrix" => 16,
                _ => 1,
            };
            if list.len() != want {
                return Err(bad());
            }
            Ok(format!("Default::Numbers(&{list:?})"))
        }
    }
}

fn strings(text: &str) -> Vec<String> {
    if !text.contains('"') {
        return text.split_whitespace().map(Into::into).collect();
    }
    text.split('"').skip(1).step_by(2).map(Into::into).collect()
}

fn numbers(field: &Field, text: &str) -> Option<Vec<f64>> {
    text.split([' ', ',', '\t'])
        .filter(|w| !w.is_empty())
        .map(|word| match word {
            "TRUE" => Some(1.0),
            "FALSE" => Some(0.0),
            _ => match field.names.iter().find(|(n, _)| n == word) {
                Some((_, v)) => Some(*v as f64),
                None => word.parse().ok().or_else(|| number(word).map(|n| n as f64)),
            },
        })
        .collect()
}
