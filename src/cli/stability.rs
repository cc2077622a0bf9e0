//! `ivcam stability`: extreme cases beside their known answers.

use std::io::Write;

use clap::{Arg, ArgMatches, Command};
use ivcam_base::diag::Result;

use super::{status, switch, text};
use crate::stability::{Case, lens_cases, scene_cases};

/// Returns the definition of the command.
pub(crate) fn command() -> Command {
    Command::new("stability")
        .about("Computes extreme lenses and scenes beside answers known to more digits")
        .arg(
            Arg::new("table")
                .value_name("TABLE")
                .value_parser(["lens", "scene"])
                .help("lens or scene; without one, both"),
        )
        .arg(switch("markdown", "prints tables in Markdown"))
        .arg(switch("json", "prints JSON"))
}

/// Runs the command and returns the exit code: 1 if an error is above its bound.
///
/// # Errors
/// Returns an error if the results cannot be written as JSON.
pub(crate) fn run(matches: &ArgMatches, out: &mut dyn Write) -> Result<i32> {
    let table = text(matches, "table");
    let wanted = |name: &str| table.is_none_or(|table| table == name);
    let mut tables: Vec<(&str, Vec<Case>)> = Vec::new();
    if wanted("lens") {
        tables.push(("lens", lens_cases()?));
    }
    if wanted("scene") {
        tables.push(("scene", scene_cases()?));
    }
    let failed = tables.iter().flat_map(|(_, cases)| cases);
    let failed = failed.filter(|case| !case.holds()).count();
    let result = if matches.get_flag("json") {
        let tables: serde_json::Map<String, serde_json::Value> = tables
            .iter()
            .map(|(name, cases)| ((*name).to_owned(), serde_json::json!(cases)))
            .collect();
        writeln!(out, "{:#}", serde_json::Value::Object(tables))
    } else {
        let markdown = matches.get_flag("markdown");
        tables
            .iter()
            .try_for_each(|(name, cases)| print(name, cases, markdown, out))
    };
    super::exit_code(result)?;
    if failed > 0 {
        let all: usize = tables.iter().map(|(_, cases)| cases.len()).sum();
        status!("{failed} of {all} cases have an error above their bound");
        return Ok(1);
    }
    Ok(0)
}

/// Prints the cases of one table.
fn print(name: &str, cases: &[Case], markdown: bool, out: &mut dyn Write) -> std::io::Result<()> {
    let held = cases.iter().filter(|case| case.holds()).count();
    if markdown {
        writeln!(
            out,
            "| {name} | expected | got | error | bound |\n|---|---|---|---|---|"
        )?;
    } else {
        let head = ["expected", "got", "error", "bound"];
        let [a, b, c, d] = head;
        writeln!(out, "{name:<48} {a:>18} {b:>18} {c:>8} {d:>8}")?;
    }
    for case in cases {
        let Case {
            name,
            expected,
            got,
            error,
            bound,
        } = case;
        let mark = if case.holds() { "" } else { "  FAILED" };
        if markdown {
            writeln!(
                out,
                "| {name} | {expected:.9e} | {got:.9e} | {error:.1e} | {bound:.1e}{mark} |"
            )?;
        } else {
            writeln!(
                out,
                "{name:<48} {expected:>18.9e} {got:>18.9e} {error:>8.1e} {bound:>8.1e}{mark}"
            )?;
        }
    }
    writeln!(out, "{held} of {} cases hold\n", cases.len())
}
