//! Parses the lines of a `*.nodes` file.

use super::model::{Class, DIALECTS, Field, KINDS, Part, TREATMENTS, number};

/// Parses a file and adds its classes.
///
/// # Errors
/// Returns a message with file and line for a mistake.
pub fn parse(file: &str, text: &str, classes: &mut Vec<Class>) -> Result<(), String> {
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

/// Returns the part of a line before a `#` that is not inside quotes.
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

/// Parses a class line: `Cone : Shape  in iv1 iv2 vrml1  rendered`.
fn class(place: &str, line: &str) -> Result<Class, String> {
    let (name, rest) = line.split_once(':').ok_or(format!(
        "{place}: expected `Name : Family in dialects… treatment [role]`"
    ))?;
    let words: Vec<&str> = rest.split_whitespace().collect();
    let expected = || format!("{place}: expected `Name : Family in dialects… treatment [role]`");
    let [family, "in", words @ ..] = words.as_slice() else {
        return Err(expected());
    };
    let treatments = TREATMENTS.map(|(name, _)| name);
    let at = words.iter().position(|w| treatments.contains(w));
    let Some(at) = at else {
        return Err(format!(
            "{place}: no treatment, expected one of {treatments:?}"
        ));
    };
    let (dialects, treatment) = (&words[..at], words[at]);
    let role = match &words[at + 1..] {
        [] => "",
        [role] if is_role(role, treatment) => role,
        [role] => {
            return Err(format!(
                "{place}: `{role}` is not a role of a `{treatment}` class"
            ));
        }
        _ => return Err(expected()),
    };
    for d in dialects {
        if !DIALECTS.contains(d) {
            return Err(format!(
                "{place}: unknown dialect `{d}`, expected one of {DIALECTS:?}"
            ));
        }
    }
    Ok(Class {
        name: name.trim().into(),
        family: (*family).into(),
        dialects: dialects.iter().map(|d| (*d).into()).collect(),
        treatment: treatment.into(),
        role: role.into(),
        parent: None,
        fields: Vec::new(),
        inputs: Vec::new(),
        outputs: Vec::new(),
        parts: Vec::new(),
        place: place.into(),
    })
}

/// Parses a line of a class: a field, an event or engine output, or a part of a kit.
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
        ["x3d", ..] => class.fields.push(Field {
            x3d: true,
            ..field(place, line["x3d".len()..].trim_start())?
        }),
        _ => class.fields.push(field(place, line)?),
    }
    Ok(())
}

/// Parses a field such as `SFBitMask parts  ALL  { SIDES=1 BOTTOM=2 ALL=3 }` or
/// `SFFloat height 2 (0, inf)`.
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
        x3d: false,
    })
}

/// Returns whether a class with this treatment may have this role.
fn is_role(role: &str, treatment: &str) -> bool {
    TREATMENTS
        .iter()
        .filter(|(name, _)| treatment == "abstract" || *name == treatment)
        .any(|(_, roles)| roles.contains(&role))
}
