//! Adds to each class the fields, events, parts and role that it inherits from its family.

use std::collections::HashMap;

use super::model::{Class, Field, Part, TREATMENTS};

/// Inserts the members of a declared family before a class's own. A field with the same name
/// replaces the inherited one in its position. Families may be declared in any order.
///
/// # Errors
/// Returns a message if a family inherits from itself.
pub fn inherit(classes: &mut [Class]) -> Result<(), String> {
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
    let stated: Vec<String> = classes.iter().map(|c| c.role.clone()).collect();
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
        classes[i].parent = chain.get(1).copied();
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
        if classes[i].dialects.iter().any(|d| METADATA.contains(&&**d)) {
            all.push(metadata());
        }
        classes[i].fields = all;
        classes[i].inputs = inputs;
        classes[i].outputs = outputs;
        classes[i].parts = parts;
        let role = chain.iter().map(|&c| &stated[c]).find(|r| !r.is_empty());
        classes[i].role = role_of(&classes[i].treatment, role);
    }
    Ok(())
}

/// The dialects whose classes have a field `metadata` in X3D.
const METADATA: [&str; 2] = ["vrml97", "x3d"];

/// Returns the field that X3D gives every node.
fn metadata() -> Field {
    Field {
        kind: "SFNode".into(),
        name: "metadata".into(),
        default: String::new(),
        names: Vec::new(),
        range: None,
        x3d: true,
    }
}

/// Returns the role of a class. It is the role that the class or its nearest family states, if its
/// treatment allows that role, and otherwise the default of the treatment.
fn role_of(treatment: &str, stated: Option<&String>) -> String {
    let (_, roles) = TREATMENTS[TREATMENTS
        .iter()
        .position(|t| t.0 == treatment)
        .unwrap_or(0)];
    match stated {
        Some(role) if treatment == "abstract" || roles.contains(&role.as_str()) => role.clone(),
        _ => roles[0].to_owned(),
    }
}

/// Adds a kit's own parts to those of its family. The last part is added first, so that the sibling
/// after a part is already in the list. A part with the same name is replaced in its position.
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
