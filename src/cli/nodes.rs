//! `ivcam nodes`: the node catalogue as a manual.

use std::io::Write;

use clap::{Arg, ArgMatches, Command};
use ivcam_base::diag::{Diagnostic, Result, nearest};
use ivcam_inventor::grammar::{CLASSES, Class, Default, Dialect, FieldDecl, FieldType, Treatment};

use super::{switch, text};

/// Returns the definition of the command.
pub(crate) fn command() -> Command {
    Command::new("nodes")
        .about("Describes a node class: its fields, types, defaults and file formats")
        .arg(
            Arg::new("class")
                .value_name("CLASS")
                .help("a node class; without one, lists all classes"),
        )
        .arg(switch("json", "prints JSON"))
}

/// Runs the command and returns the exit code.
pub(crate) fn run(matches: &ArgMatches, out: &mut dyn Write) -> Result<i32> {
    let classes: Vec<&Class> = match text(matches, "class") {
        None => CLASSES
            .iter()
            .filter(|c| c.treatment != Treatment::Abstract)
            .collect(),
        Some(name) => named(name)?,
    };
    let result = if matches.get_flag("json") {
        json(&classes, out)
    } else if text(matches, "class").is_none() {
        list(&classes, out)
    } else {
        classes.iter().try_for_each(|c| manual(c, out))
    };
    super::exit_code(result)
}

/// Finds the classes with a name, in any case.
fn named(name: &str) -> Result<Vec<&'static Class>> {
    let found: Vec<_> = CLASSES
        .iter()
        .filter(|c| c.name.eq_ignore_ascii_case(name))
        .collect();
    if !found.is_empty() {
        return Ok(found);
    }
    let error = Diagnostic::not_found(format!("there is no node class `{name}`"));
    Err(match nearest(name, CLASSES.iter().map(|c| c.name)) {
        Some(near) => error.with_help(format!("did you mean `{near}`?")),
        None => error.with_help("`ivcam nodes` lists them all"),
    })
}

fn list(classes: &[&Class], out: &mut dyn Write) -> std::io::Result<()> {
    let mut sorted = classes.to_vec();
    sorted.sort_by_key(|c| c.name.to_lowercase());
    for c in sorted {
        let (treatment, dialects) = (treatment(c.treatment), dialects(c.dialects).join(", "));
        writeln!(out, "{:<32} {treatment:<9} {dialects}", c.name)?;
    }
    Ok(())
}

fn manual(class: &Class, out: &mut dyn Write) -> std::io::Result<()> {
    writeln!(out, "{} : {}", class.name, class.family)?;
    writeln!(
        out,
        "  in {}; {}",
        dialects(class.dialects).join(", "),
        meaning(class.treatment)
    )?;
    for field in class.fields {
        write!(
            out,
            "  {:<12} {:<24} {}",
            field.kind.name(),
            field.name,
            default(field)
        )?;
        if !field.names.is_empty() {
            let names: Vec<&str> = field.names.iter().map(|(n, _)| *n).collect();
            write!(out, "   {{ {} }}", names.join(" "))?;
        }
        if let Some(range) = field.range {
            write!(out, "   {range}")?;
        }
        if field.x3d {
            write!(out, "   X3D only")?;
        }
        writeln!(out)?;
    }
    writeln!(out)
}

fn json(classes: &[&Class], out: &mut dyn Write) -> std::io::Result<()> {
    let field = |f: &FieldDecl| {
        serde_json::json!({
            "name": f.name, "type": f.kind.name(), "default": default(f), "range": f.range, "x3d_only": f.x3d,
            "values": f.names.iter().map(|(n, v)| (*n, *v)).collect::<indexmap::IndexMap<_, _>>(),
        })
    };
    let all: Vec<_> = classes
        .iter()
        .map(|c| {
            serde_json::json!({
                "class": c.name, "family": c.family, "dialects": dialects(c.dialects),
                "treatment": treatment(c.treatment),
                "fields": c.fields.iter().map(field).collect::<Vec<_>>(),
            })
        })
        .collect();
    writeln!(out, "{}", serde_json::to_string_pretty(&all)?)
}

fn dialects(bits: u8) -> Vec<&'static str> {
    [
        (Dialect::IV1, "Inventor 1"),
        (Dialect::IV2, "Inventor 2"),
        (Dialect::VRML1, "VRML 1.0"),
        (Dialect::VRML97, "VRML97"),
        (Dialect::COIN, "Coin"),
        (Dialect::X3D, "X3D"),
    ]
    .into_iter()
    .filter(|(bit, _)| bits & bit != 0)
    .map(|(_, name)| name)
    .collect()
}

fn treatment(treatment: Treatment) -> &'static str {
    match treatment {
        Treatment::Rendered => "rendered",
        Treatment::State => "state",
        Treatment::Group => "group",
        Treatment::Kept => "kept",
        Treatment::Abstract => "abstract",
    }
}

fn meaning(t: Treatment) -> &'static str {
    match t {
        Treatment::Rendered => "drawn",
        Treatment::State => "changes the traversal state",
        Treatment::Group => "its children are traversed",
        Treatment::Kept => "read and written back, not drawn",
        Treatment::Abstract => "a family without nodes of its own",
    }
}

/// Returns the default of a field as a file states it.
fn default(field: &FieldDecl) -> String {
    let join = |items: Vec<String>| match (field.kind.is_multiple(), items.len()) {
        (true, _) => format!("[{}]", items.join(" ")),
        _ => items.join(" "),
    };
    match &field.default {
        Default::Nothing => match field.kind {
            FieldType::SFNode | FieldType::SFPath | FieldType::SFEngine => "NULL".into(),
            kind if kind.is_multiple() => "[]".into(),
            _ => String::new(),
        },
        Default::Strings(list) => join(list.iter().map(|s| format!("{s:?}")).collect()),
        Default::Numbers(list) => join(list.iter().map(|n| number(field, *n)).collect()),
    }
}

fn number(field: &FieldDecl, n: f64) -> String {
    let name = field
        .names
        .iter()
        .find(|(_, v)| *v as f64 == n)
        .map(|(name, _)| (*name).into());
    match field.kind {
        FieldType::SFBool | FieldType::MFBool => if n == 0.0 { "FALSE" } else { "TRUE" }.into(),
        _ => name.unwrap_or_else(|| n.to_string()),
    }
}
