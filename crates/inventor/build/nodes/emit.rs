//! Writes the catalogue as Rust code.

use std::collections::{HashMap, HashSet};

use super::model::{Class, Field, KINDS, number};

/// Returns the module name of each class: `indexed_face_set` for `IndexedFaceSet`. A second class
/// with the same name has its first dialect as a prefix: `vrml97_cone`.
fn modules(classes: &[Class]) -> Result<Vec<String>, String> {
    let mut seen = HashMap::new();
    let mut out = Vec::new();
    for class in classes {
        let mut module = snake(&class.name);
        if KEYWORDS.contains(&module.as_str()) {
            module.push_str("_node");
        }
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

/// Class names that are not used as module names, because they are or look like keywords of Rust.
const KEYWORDS: [&str; 5] = ["box", "switch", "loop", "in", "type"];

/// Converts a name to snake case.
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
    out
}

/// Returns the table of classes, their identifiers, and a module of field handles for each class.
///
/// # Errors
/// Returns a message if two classes have the same module name, or if a default is wrong.
pub fn emit(classes: &[Class]) -> Result<String, String> {
    let modules = modules(classes)?;
    let mut table = String::from(
        "/// All classes of the catalogue. A `ClassId` is an index into this table.\n\
         pub static CLASSES: &[Class] = &[\n",
    );
    let mut ids = String::from(
        "/// The identifiers of all classes.\npub mod class {\n    use super::ClassId;\n",
    );
    let mut handles = String::new();
    for (i, (class, module)) in classes.iter().zip(&modules).enumerate() {
        table.push_str(&table_entry(i, class)?);
        ids.push_str(&format!(
            "    /// The class `{}`{}.\n    pub const {}: ClassId = ClassId({i});\n",
            class.name,
            languages(class),
            module.to_uppercase()
        ));
        let constants = constants(i, class);
        if !constants.is_empty() {
            handles.push_str(&format!(
                "/// The fields of `{}`{}.\npub mod {module} {{\n    use super::*;\n{constants}}}\n",
                class.name,
                languages(class)
            ));
        }
    }
    Ok(format!("{table}];\n\n{ids}}}\n\n{handles}"))
}

/// Returns the formats that have a class as text for documentation, such as ` of VRML 1.0`.
fn languages(class: &Class) -> String {
    let names: Vec<&str> = class
        .dialects
        .iter()
        .map(|dialect| match dialect.as_str() {
            "iv1" => "Inventor V1.0",
            "iv2" => "Inventor V2",
            "vrml1" => "VRML 1.0",
            "vrml97" => "VRML97",
            "x3d" => "X3D",
            _ => "Coin",
        })
        .collect();
    match names.as_slice() {
        [] => String::new(),
        [one] => format!(" of {one}"),
        [rest @ .., last] => format!(" of {} and {last}", rest.join(", ")),
    }
}

/// Returns the entry of a class in the table.
fn table_entry(i: usize, class: &Class) -> Result<String, String> {
    let dialects: Vec<String> = class
        .dialects
        .iter()
        .map(|d| format!("Dialect::{}", d.to_uppercase()))
        .collect();
    let mut fields = String::new();
    for f in &class.fields {
        fields.push_str(&format!(
            "        FieldDecl {{ name: {:?}, kind: FieldType::{}, default: {}, names: &{:?}, range: {:?}, x3d: {} }},\n",
            f.name, f.kind, default(class, f)?, f.names, f.range, f.x3d
        ));
    }
    let events = |list: &[(String, String)]| -> String {
        list.iter()
            .map(|(n, k)| format!("({n:?}, FieldType::{k}), "))
            .collect()
    };
    let parts: String = class
        .parts
        .iter()
        .map(|p| {
            format!(
                "        KitPart {{ name: {:?}, parent: {:?}, class: {:?}, list: {}, made: {} }},\n",
                p.name, p.parent, p.class, p.list, p.made
            )
        })
        .collect();
    Ok(format!(
        "    Class {{ id: ClassId({i}), name: {:?}, family: {:?}, parent: {}, dialects: {}, treatment: Treatment::{}, role: Role::{}, place: {:?}, fields: &[\n{fields}    ], inputs: &[{}], outputs: &[{}], parts: &[\n{parts}    ] }},\n",
        class.name,
        class.family,
        class
            .parent
            .map_or("None".into(), |p| format!("Some(ClassId({p}))")),
        if dialects.is_empty() {
            "0".into()
        } else {
            dialects.join(" | ")
        },
        camel(&class.treatment),
        camel(&class.role),
        class.place,
        events(&class.inputs),
        events(&class.outputs),
    ))
}

/// Returns the handles of a class's fields, and constants for the values of its enumerations.
fn constants(i: usize, class: &Class) -> String {
    let mut out = String::new();
    let mut taken = HashSet::new();
    for (k, field) in class.fields.iter().enumerate() {
        let handle = KINDS
            .iter()
            .find(|(n, _)| *n == field.kind)
            .map_or("", |(_, h)| h);
        let name = snake(&field.name).to_uppercase();
        let mut constant = name.clone();
        if !taken.insert(constant.clone()) {
            constant.insert_str(0, "CAPITAL_"); // a Calculator has both `a` and `A`
        }
        out.push_str(&format!(
            "    /// {}\n    pub const {constant}: Field<{handle}> = Field::new({i}, {k});\n",
            field_doc(field)
        ));
        for (word, value) in &field.names {
            let constant = word.to_uppercase().replace('-', "_");
            out.push_str(&format!(
                "    /// The value `{word}` of the field `{}`.\n    \
                 pub const {name}_{constant}: i32 = {value};\n",
                field.name
            ));
        }
    }
    out
}

/// Returns the documentation of a field: its name, type, default and legal range.
fn field_doc(field: &Field) -> String {
    let default = match field.default.as_str() {
        "" => "It has no default value in the catalogue.".to_owned(),
        text => format!("The default is `{text}`."),
    };
    let range = match &field.range {
        Some(range) => format!(" The legal range is `{range}`."),
        None => String::new(),
    };
    let only = if field.x3d { " in X3D" } else { "" };
    format!(
        "The field `{}` of type `{}`{only}. {default}{range}",
        field.name, field.kind
    )
}

/// Converts a name to camel case: `LevelOfDetail` for `level_of_detail`.
fn camel(words: &str) -> String {
    words
        .split('_')
        .flat_map(|word| {
            let (first, rest) = word.split_at(word.len().min(1));
            [first.to_uppercase(), rest.to_owned()]
        })
        .collect()
}

/// Returns a default as a constant expression of type `Default`.
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

/// Returns the quoted strings of a text, or its words if it has no quotes.
fn strings(text: &str) -> Vec<String> {
    if !text.contains('"') {
        return text.split_whitespace().map(Into::into).collect();
    }
    text.split('"').skip(1).step_by(2).map(Into::into).collect()
}

/// Returns the numbers of a default, or `None` if a word is not a number.
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
