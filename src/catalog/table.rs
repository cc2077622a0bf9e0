//! Writes a catalog as a table of comma-separated values.

use std::path::Path;

use ivcam_base::diag::Result;
use ivcam_base::files::write_whole;

use super::entry::{Entry, Others};
use super::numbers::date;
use super::place;
use crate::archive::csv::row;

/// The columns of the table.
const COLUMNS: [&str; 29] = [
    "file",
    "sha256",
    "bytes",
    "modified",
    "format",
    "pronom",
    "units",
    "state",
    "error",
    "producer",
    "nodes",
    "triangles",
    "width_m",
    "height_m",
    "depth_m",
    "lights",
    "cameras",
    "problems",
    "uses",
    "missing",
    "outside",
    "typefaces",
    "duplicates",
    "same_scene",
    "alike",
    "page",
    "packed",
    "unexpected_ending",
    "round_solids",
];

/// Writes `catalog.csv`, with a row for each scene.
///
/// # Errors
/// Returns an error if the file cannot be written.
pub(super) fn write_table(out: &Path, entries: &[Entry]) -> Result<()> {
    write_whole(&out.join(place::TABLE), |file| {
        file.write_all(row(COLUMNS).as_bytes())?;
        let mut rows = entries.iter().map(|entry| row(fields(entry)));
        rows.try_for_each(|row| file.write_all(row.as_bytes()))
    })
}

/// Returns the fields of a row, in the order of [`COLUMNS`].
fn fields(entry: &Entry) -> [String; COLUMNS.len()] {
    let text = |text: &Option<String>| harmless(text.as_deref().unwrap_or_default());
    let list = |names: &[String]| harmless(&names.join("; "));
    let others = |others: &Others| {
        let more = if others.more { "; …" } else { "" };
        harmless(&(others.files.join("; ") + more))
    };
    let edge = |i: usize| {
        entry
            .size
            .map_or_else(String::new, |size| size[i].to_string())
    };
    let typefaces: Vec<String> = entry
        .typefaces
        .iter()
        .map(|face| face.name.clone())
        .collect();
    [
        harmless(&entry.file),
        entry.sha256.clone(),
        entry.bytes.to_string(),
        date(entry.modified),
        text(&entry.format),
        text(&entry.pronom),
        text(&entry.units),
        entry.state.clone(),
        text(&entry.error),
        text(&entry.producer),
        entry.nodes.to_string(),
        entry.triangles.to_string(),
        edge(0),
        edge(1),
        edge(2),
        entry.lights.to_string(),
        entry.cameras.to_string(),
        entry.problems.to_string(),
        list(&entry.uses),
        list(&entry.missing),
        list(&entry.outside),
        list(&typefaces),
        others(&entry.duplicates),
        others(&entry.same_scene),
        others(&entry.alike),
        harmless(&place::scene_page(&entry.file)),
        text(&entry.packed),
        text(&entry.unexpected_ending),
        entry.round_solids().to_string(),
    ]
}

/// Returns a text that a spreadsheet shows and does not compute: one that begins like a formula
/// gets an apostrophe before it.
fn harmless(text: &str) -> String {
    match text.starts_with(['=', '+', '-', '@', '\t', '\r']) {
        true => format!("'{text}"),
        false => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::archive::csv::rows;

    #[test]
    fn a_row_has_all_columns_and_no_formula() {
        let entry = Entry {
            file: "=1+1,\"a\"\n.iv".to_owned(),
            producer: Some("@SUM(A1)".to_owned()),
            missing: vec!["-a.rgb".to_owned(), "b.rgb".to_owned()],
            size: Some([1.0, 0.5, -0.0]),
            duplicates: Others {
                files: vec!["c".to_owned()],
                more: true,
            },
            ..Entry::default()
        };
        let table = row(COLUMNS) + &row(fields(&entry));
        let read = rows(&table);
        let value = |name: &str| {
            let column = COLUMNS.iter().position(|column| *column == name).unwrap();
            read[1].fields[column].clone()
        };
        assert_eq!((read.len(), read[1].fields.len()), (2, COLUMNS.len()));
        assert_eq!(value("file"), "'=1+1,\"a\"\n.iv");
        assert_eq!(value("producer"), "'@SUM(A1)");
        assert_eq!(value("missing"), "'-a.rgb; b.rgb");
        assert_eq!(
            (value("height_m"), value("duplicates")),
            ("0.5".to_owned(), "c; …".to_owned())
        );
    }
}
