//! Writes a catalog as one HTML page, which needs neither a network nor scripts.
//!
//! The template is `page.html`. Its script filters and sorts the table, and shows the controls for
//! that, which are hidden without it. Every text from a file is escaped by the template.

use ivcam_base::diag::counted;
use ivcam_base::memory::size_text;
use minijinja::value::{Serde, Value};
use serde::Serialize;

use super::entry::Entry;
use super::links::joined;
use super::template::{SCRIPT, STYLE, environment};

/// The content of the page, as the template names it.
#[derive(Serialize)]
struct CatalogPage<'a> {
    title: &'a str,
    style: &'static str,
    script: &'static str,
    version: &'static str,
    /// The labels that some scene has.
    labels: Vec<SceneLabel>,
    rows: Vec<SceneRow<'a>>,
}

/// A scene of the page: its entry, and what is derived from it.
#[derive(Serialize)]
struct SceneRow<'a> {
    #[serde(flatten)]
    entry: &'a Entry,
    /// The address of the scene.
    link: String,
    /// The path of the scene up to its name.
    folders: &'a str,
    name: &'a str,
    labels: Vec<SceneLabel>,
    /// Headings and texts of what is shown when the reader opens the details. Empty texts are not.
    details: Vec<(&'static str, String)>,
}

/// A mark of a scene: the word for style sheet and script, and the text for the reader.
#[derive(Serialize)]
struct SceneLabel {
    name: &'static str,
    text: String,
}

/// Returns the page. `folder` is the address of the folder of scenes, relative to the page.
pub(super) fn page(title: &str, folder: &str, scenes: &[Entry]) -> String {
    let page = CatalogPage {
        title: if title.is_empty() { "scenes" } else { title },
        style: STYLE,
        script: SCRIPT,
        version: env!("CARGO_PKG_VERSION"),
        labels: summary(scenes),
        rows: scenes.iter().map(|entry| row(folder, entry)).collect(),
    };
    let mut templates = environment();
    templates.add_filter("date", date);
    templates.add_filter("size_text", size_text);
    templates.add_filter("thousands", thousands);
    templates
        .render_named_str(
            "page.html",
            include_str!("page.html"),
            Value::from(Serde(&page)),
        )
        .expect("the template fits its data")
}

/// Returns the numbers of scenes with each label.
fn summary(scenes: &[Entry]) -> Vec<SceneLabel> {
    let all = [
        ("unreadable", "unreadable"),
        ("damaged", "damaged"),
        ("missing", "with missing files"),
        ("outside", "with files outside the folder"),
        ("unknown", "with unknown nodes"),
        ("empty", "with nothing to draw"),
        ("nopicture", "without a picture"),
    ];
    let held: Vec<SceneLabel> = scenes.iter().flat_map(labels).collect();
    all.into_iter()
        .map(|(name, words)| (name, held.iter().filter(|l| l.name == name).count(), words))
        .filter(|(_, count, _)| *count > 0)
        .map(|(name, count, words)| SceneLabel {
            name,
            text: format!("{count} {words}"),
        })
        .collect()
}

/// Returns the labels of a scene.
fn labels(entry: &Entry) -> Vec<SceneLabel> {
    let (missing, outside, unknown) = (entry.missing.len(), entry.outside.len(), entry.unknown());
    [
        (entry.error.is_some(), "unreadable", "unreadable".to_owned()),
        (entry.state == "damaged", "damaged", "damaged".to_owned()),
        (missing > 0, "missing", counted(missing, "missing file")),
        (
            outside > 0,
            "outside",
            counted(outside, "file") + " outside the folder",
        ),
        (unknown > 0, "unknown", counted(unknown, "unknown node")),
        (entry.is_empty(), "empty", "nothing to draw".to_owned()),
        (
            entry.no_picture.is_some(),
            "nopicture",
            "no picture".to_owned(),
        ),
    ]
    .into_iter()
    .filter(|(holds, ..)| *holds)
    .map(|(_, name, text)| SceneLabel { name, text })
    .collect()
}

/// Returns the row of one scene.
fn row<'a>(folder: &str, entry: &'a Entry) -> SceneRow<'a> {
    let start_of_name = entry.file.rfind('/').map_or(0, |slash| slash + 1);
    let (folders, name) = entry.file.split_at(start_of_name);
    SceneRow {
        entry,
        link: joined(folder, &entry.file),
        folders,
        name,
        labels: labels(entry),
        details: details(entry),
    }
}

fn details(entry: &Entry) -> Vec<(&'static str, String)> {
    let classes = |treatment: &str| {
        let list = entry.classes.get(treatment).into_iter().flatten();
        let words: Vec<String> = list.map(|(name, n)| format!("{name} {n}")).collect();
        words.join(", ")
    };
    let extent = |[x, y, z]: [f64; 3]| format!("{} × {} × {} m", short(x), short(y), short(z));
    let counts = format!(
        "{}, {}",
        counted(entry.lights, "light"),
        counted(entry.cameras, "camera")
    );
    let mut details = vec![
        ("Not read", entry.error.clone().unwrap_or_default()),
        ("No picture", entry.no_picture.clone().unwrap_or_default()),
    ];
    details.extend(entry.notes.iter().map(|note| ("Note", note.clone())));
    details.extend([
        ("Extent", entry.size.map(extent).unwrap_or_default()),
        ("Drawn", classes("drawn")),
        ("Structure", classes("structure")),
        ("Kept", classes("kept")),
        ("Unknown", classes("unknown")),
        (
            "Lights and cameras",
            if entry.error.is_none() {
                counts
            } else {
                String::new()
            },
        ),
        ("Missing", entry.missing.join(", ")),
        ("Outside", entry.outside.join(", ")),
        ("Uses", entry.uses.join(", ")),
    ]);
    details
}

/// Returns a number with its digits in groups of three: `1,234`.
fn thousands(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

/// Returns a number to three digits without zeros at its end.
fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let digits = 2 - value.abs().log10().floor() as i32;
    if !(-9..=9).contains(&digits) {
        return format!("{value:.2e}");
    }
    let text = format!("{value:.*}", digits.max(0) as usize);
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// Returns the date of a time in seconds since the beginning of 1970, as `1998-03-12` (UTC).
///
/// Days are counted in eras of 400 years from the first of March of the year 0, so that the leap
/// day is the last of its year (H. Hinnant, "chrono-compatible low-level date algorithms").
fn date(seconds: u64) -> String {
    let days = seconds / 86_400 + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1_460 + day / 36_524 - day / 146_096) / 365;
    let of_year = day - (365 * year + year / 4 - year / 100);
    let shifted = (5 * of_year + 2) / 153;
    let of_month = of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 {
        shifted + 3
    } else {
        shifted - 9
    };
    let year = 400 * era + year + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{of_month:02}")
}

#[cfg(test)]
mod tests {
    use super::super::entry::Message;
    use super::*;

    #[test]
    fn text_from_files_cannot_become_markup() {
        let evil = "<script>alert(1)</script>\"'&\u{202e}\u{7}";
        let entry = Entry {
            file: format!("a/{evil}.iv"),
            state: "damaged".to_owned(),
            format: Some(evil.to_owned()),
            producer: Some(evil.to_owned()),
            notes: vec![evil.to_owned()],
            classes: [(
                "unknown".to_owned(),
                [(evil.to_owned(), 1)].into_iter().collect(),
            )]
            .into_iter()
            .collect(),
            size: Some([1.0; 3]),
            missing: vec![evil.to_owned()],
            messages: vec![Message {
                severity: "warning".to_owned(),
                line: Some(1),
                file: Some(evil.to_owned()),
                text: evil.to_owned(),
                count: 2,
            }],
            uses: vec![evil.to_owned()],
            picture: Some(format!("pictures/a/{evil}.iv.png")),
            ..Entry::default()
        };
        let page = page(evil, "../in", &[entry]);
        assert_eq!(page.matches("<script>").count(), 1, "only the page's own");
        assert!(!page.contains("alert(1)</") && !page.contains('\u{202e}'));
        assert!(!page.contains('\u{7}'));
        assert!(page.contains("&lt;script&gt;alert(1)&lt;/script&gt;&quot;&#39;&amp;"));
        assert!(page.contains("href=\"../in/a/%3Cscript%3Ealert%281%29%3C/script%3E%22%27%26"));
    }

    #[test]
    fn an_unreadable_and_an_empty_scene_say_why_there_is_no_picture() {
        let unreadable = Entry {
            file: "b.iv".to_owned(),
            state: "unreadable".to_owned(),
            error: Some("no header".to_owned()),
            ..Entry::default()
        };
        let empty = Entry {
            file: "c.iv".to_owned(),
            state: "whole".to_owned(),
            ..Entry::default()
        };
        let page = page("", "..", &[unreadable, empty]);
        for part in [
            "1 unreadable</li>",
            "1 with nothing to draw</li>",
            "<span class=\"none\">nothing to draw",
            "<dt>Not read</dt><dd><bdi>no header",
            "2 scenes, 0 B",
        ] {
            assert!(page.contains(part), "{part} missing in {page}");
        }
        assert!(!page.contains("<img"));
    }

    #[test]
    fn numbers_are_short_and_dates_are_those_of_the_calendar() {
        let shorts = [1.0, 0.0123456, 1234.5, -2.5e-12, 1e15].map(short);
        assert_eq!(shorts, ["1", "0.0123", "1234", "-2.50e-12", "1.00e15"]);
        assert_eq!(
            [0, 1234, 1_234_567].map(thousands),
            ["0", "1,234", "1,234,567"]
        );
        // Checked with `date -u -d @N +%F`.
        for (seconds, expected) in [
            (0, "1970-01-01"),
            (951_782_399, "2000-02-28"),
            (951_782_400, "2000-02-29"),
            (1_735_689_599, "2024-12-31"),
            (4_107_542_400, "2100-03-01"),
        ] {
            assert_eq!(date(seconds), expected);
        }
    }
}
