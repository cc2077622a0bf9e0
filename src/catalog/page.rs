//! Writes the page of a catalog, which needs neither a network nor scripts.
//!
//! The templates are `page.html` and, for each scene, `row.html`. Its script shows the scenes as a
//! grid, filters and sorts them, and shows a large picture; what it needs for that is hidden
//! without it. Every text from a file is escaped by the template, and the page runs only the script
//! and uses only the style with the hashes that it states.

use std::path::Path;

use ivcam_base::diag::{Result, counted};
use ivcam_base::files::write_whole;
use minijinja::Environment;
use minijinja::value::{Serde, Value};
use serde::Serialize;

use super::entry::Entry;
use super::heading::CatalogHeading;
use super::links::{joined, original};
use super::place;
use super::sha256::digest;
use super::template::{SCRIPT, STYLE, environment};
use crate::export::base64;

/// Where `page.html` has the scenes. Texts of files cannot contain it, because `<` is escaped.
const ROWS: &str = "<!-- rows -->";

/// The content of the page without the scenes, as the template names it.
#[derive(Serialize)]
struct CatalogPage<'a> {
    heading: &'a CatalogHeading,
    paragraphs: Vec<String>,
    style: String,
    script: String,
    /// What the page may load and run, for its Content-Security-Policy.
    policy: String,
    version: &'static str,
    count: usize,
    bytes: u64,
    triangles: u64,
    /// The number of shapes that are drawn exactly and have no triangles.
    round: u64,
    whole: usize,
    /// The labels that some scene has.
    labels: Vec<SceneLabel>,
}

/// A scene of the page: its entry, and what is derived from it.
#[derive(Serialize)]
struct SceneRow<'a> {
    file: &'a str,
    /// The address of the scene's page, and that of the scene.
    page: String,
    link: String,
    /// The address that opens the scene in the built page, if there is one.
    live: Option<String>,
    /// The path of the scene up to its name.
    folders: &'a str,
    name: &'a str,
    picture: Option<&'a str>,
    large: Option<&'a str>,
    /// What stands for the picture if there is none.
    instead: &'static str,
    labels: Vec<SceneLabel>,
    format: &'a str,
    producer: Option<&'a str>,
    converted: Vec<(&'a str, &'a str)>,
    /// Words that the filter finds and the page does not show: the classes of nodes.
    words: String,
    modified: u64,
    bytes: u64,
    nodes: usize,
    triangles: u64,
    /// The number of shapes without triangles.
    round: u64,
    problems: usize,
}

/// A mark of a scene: the word for style sheet and script, and the text for the reader.
#[derive(Serialize)]
pub(super) struct SceneLabel {
    pub name: &'static str,
    pub text: String,
}

/// Writes `index.html`. One scene after another is written, so that the page is not in memory.
///
/// # Errors
/// Returns an error if the file cannot be written.
pub(super) fn write_page(out: &Path, heading: &CatalogHeading, entries: &[Entry]) -> Result<()> {
    let templates = templates();
    let frame = render(&templates, "page.html", &frame(heading, entries));
    let (before, after) = frame
        .split_once(ROWS)
        .expect("the template has a place for rows");
    write_whole(&out.join(place::PAGE), |file| {
        file.write_all(before.as_bytes())?;
        for entry in entries {
            let row = render(&templates, "row.html", &row(heading, entry));
            file.write_all(row.as_bytes())?;
        }
        file.write_all(after.as_bytes())
    })
}

fn templates() -> Environment<'static> {
    let mut templates = environment();
    let pages = [
        ("page.html", include_str!("page.html")),
        ("row.html", include_str!("row.html")),
    ];
    for (name, text) in pages {
        templates
            .add_template(name, text)
            .expect("the template is correct");
    }
    templates
}

fn render(templates: &Environment<'_>, name: &str, content: &impl Serialize) -> String {
    let template = templates.get_template(name).expect("the template exists");
    let text = template.render(Value::from(Serde(content)));
    text.expect("the template fits its data")
}

fn frame<'a>(heading: &'a CatalogHeading, entries: &[Entry]) -> CatalogPage<'a> {
    let style = format!("{STYLE}{}", include_str!("catalog.css"));
    let script = format!("{SCRIPT}{}", include_str!("catalog.js"));
    let source = |text: &str| format!("'sha256-{}'", base64(&digest(text.as_bytes())));
    CatalogPage {
        heading,
        paragraphs: heading.paragraphs(),
        policy: format!(
            "default-src 'none'; img-src 'self' file:; style-src {}; script-src {}; \
             base-uri 'none'; form-action 'none'",
            source(&style),
            source(&script)
        ),
        style,
        script,
        version: env!("CARGO_PKG_VERSION"),
        count: entries.len(),
        bytes: entries.iter().map(|entry| entry.bytes).sum(),
        triangles: entries.iter().map(|entry| entry.triangles).sum(),
        round: entries.iter().map(Entry::round_solids).sum(),
        whole: entries
            .iter()
            .filter(|entry| entry.state == "whole")
            .count(),
        labels: summary(entries),
    }
}

/// Returns the numbers of scenes with each label.
fn summary(entries: &[Entry]) -> Vec<SceneLabel> {
    let all = [
        ("unreadable", "unreadable"),
        ("damaged", "damaged"),
        ("missing", "with missing files"),
        ("outside", "with files outside the folder"),
        ("unknown", "with unknown nodes"),
        ("empty", "with nothing to draw"),
        ("nopicture", "without a picture"),
        ("duplicate", "with equal files"),
        ("samescene", "with the same nodes as others"),
        ("alike", "that look like others"),
    ];
    let held: Vec<&str> = entries
        .iter()
        .flat_map(labels)
        .map(|label| label.name)
        .collect();
    all.into_iter()
        .map(|(name, words)| {
            (
                name,
                held.iter().filter(|held| **held == name).count(),
                words,
            )
        })
        .filter(|(_, count, _)| *count > 0)
        .map(|(name, count, words)| SceneLabel {
            name,
            text: format!("{count} {words}"),
        })
        .collect()
}

/// Returns the labels of a scene.
pub(super) fn labels(entry: &Entry) -> Vec<SceneLabel> {
    let (missing, outside, unknown) = (entry.missing.len(), entry.outside.len(), entry.unknown());
    let is = |holds: bool, name: &'static str, text: &str| {
        holds.then(|| SceneLabel {
            name,
            text: text.to_owned(),
        })
    };
    let files = counted(missing, "missing file");
    let others = counted(outside, "file") + " outside the folder";
    [
        is(entry.error.is_some(), "unreadable", "unreadable"),
        is(entry.state == "damaged", "damaged", "damaged"),
        is(missing > 0, "missing", &files),
        is(outside > 0, "outside", &others),
        is(unknown > 0, "unknown", &counted(unknown, "unknown node")),
        is(entry.is_empty(), "empty", "nothing to draw"),
        is(entry.no_picture.is_some(), "nopicture", "no picture"),
        is(
            !entry.duplicates.files.is_empty(),
            "duplicate",
            "equal file",
        ),
        is(
            !entry.same_scene.files.is_empty(),
            "samescene",
            "same nodes",
        ),
        is(!entry.alike.files.is_empty(), "alike", "looks like others"),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Returns the row of one scene.
fn row<'a>(heading: &CatalogHeading, entry: &'a Entry) -> SceneRow<'a> {
    let (folders, name) = folders_and_name(&entry.file);
    let classes = entry.classes.values().flat_map(|list| list.keys());
    SceneRow {
        file: &entry.file,
        page: joined("", &place::scene_page(&entry.file)),
        link: original(&heading.folder, &entry.file),
        live: (heading.live && entry.error.is_none()).then(|| place::live(&entry.file)),
        folders,
        name,
        picture: entry.picture.as_deref(),
        large: entry.large.as_deref(),
        instead: instead(entry),
        labels: labels(entry),
        format: entry.format.as_deref().unwrap_or("unknown"),
        producer: entry.producer.as_deref(),
        converted: entry
            .converted
            .iter()
            .map(|c| (&*c.kind, &*c.link))
            .collect(),
        words: classes.map(String::as_str).collect::<Vec<_>>().join(" "),
        modified: entry.modified,
        bytes: entry.bytes,
        nodes: entry.nodes,
        triangles: entry.triangles,
        round: entry.round_solids(),
        problems: entry.problems,
    }
}

/// Returns what stands for a picture that is not there.
pub(super) fn instead(entry: &Entry) -> &'static str {
    match (&entry.error, &entry.no_picture) {
        (Some(_), _) => "unreadable",
        (None, Some(_)) => "no picture",
        (None, None) => "nothing to draw",
    }
}

/// Divides a path before the name of the file.
pub(super) fn folders_and_name(file: &str) -> (&str, &str) {
    file.split_at(file.rfind('/').map_or(0, |slash| slash + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page(heading: &CatalogHeading, entries: &[Entry]) -> String {
        let templates = templates();
        let rows = entries
            .iter()
            .map(|e| render(&templates, "row.html", &row(heading, e)));
        let frame = render(&templates, "page.html", &frame(heading, entries));
        frame.replace(ROWS, &rows.collect::<String>())
    }

    #[test]
    fn text_from_files_cannot_become_markup() {
        let evil = "<script>alert(1)</script><!-- rows -->\"'&\u{202e}\u{7}";
        let entry = Entry {
            file: format!("a/{evil}.iv"),
            state: "damaged".to_owned(),
            format: Some(evil.to_owned()),
            producer: Some(evil.to_owned()),
            classes: [(
                "unknown".to_owned(),
                [(evil.to_owned(), 1)].into_iter().collect(),
            )]
            .into_iter()
            .collect(),
            missing: vec![evil.to_owned()],
            picture: Some(format!("pictures/a/{evil}.iv.png")),
            large: Some(format!("large/a/{evil}.iv.jpg")),
            ..Entry::default()
        };
        let heading = CatalogHeading {
            title: evil.to_owned(),
            about: Some(format!("{evil}\n\n{evil}")),
            live: true,
            folder: "../in".to_owned(),
        };
        let page = page(&heading, &[entry]);
        assert_eq!(page.matches("<script>").count(), 1, "only the page's own");
        assert!(!page.contains("alert(1)</") && !page.contains('\u{202e}'));
        assert!(!page.contains('\u{7}') && !page.contains(ROWS));
        assert!(
            page.contains(
                "&lt;script&gt;alert(1)&lt;/script&gt;&lt;!-- rows --&gt;&quot;&#39;&amp;"
            )
        );
        assert!(page.contains("href=\"../in/a/%3Cscript%3Ealert%281%29%3C/script%3E"));
        assert!(page.contains("page/index.html?scene=../files/a/%253Cscript"));
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
        let heading = CatalogHeading {
            live: true,
            ..CatalogHeading::default()
        };
        let page = page(&heading, &[unreadable, empty]);
        for part in [
            "1 unreadable</li>",
            "1 with nothing to draw</li>",
            "<span class=\"none\">nothing to draw",
            "<span class=\"none\">unreadable",
            "2 scenes, 0 B",
            "scene=../files/c.iv&amp;files",
        ] {
            assert!(page.contains(part), "{part} missing in {page}");
        }
        assert!(!page.contains("<img src") && !page.contains("scene=../files/b.iv"));
    }

    /// The hash was made by `openssl dgst -sha256 -binary | base64` of OpenSSL 3.0.
    #[test]
    fn the_policy_has_the_hashes_of_the_style_and_the_script() {
        let heading = CatalogHeading::default();
        let frame = frame(&heading, &[]);
        let page = page(&heading, &[]);
        for (tag, text) in [("style", &frame.style), ("script", &frame.script)] {
            assert!(page.contains(&format!("<{tag}>{text}</{tag}>")), "{tag}");
            let hash = base64(&digest(text.as_bytes()));
            assert!(
                page.contains(&format!("{tag}-src &#39;sha256-{hash}&#39;")),
                "{tag}"
            );
        }
        let known = "ungWv48Bz+pBQUDeXa4iI7ADYaOWF3qctBD/YfIAFa0=";
        assert_eq!(base64(&digest(b"abc")), known);
    }
}
