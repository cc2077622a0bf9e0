//! Writes a catalog as one HTML page, which needs neither a network nor scripts.
//!
//! The script filters and sorts the table, and shows the controls for that, which are hidden
//! without it. Every text from a file goes through [`EscapedText`], which escapes it.

use std::fmt::{self, Write};

use ivcam_base::diag::counted;
use ivcam_base::memory::size_text;

use super::entry::{Entry, Message};
use super::links::joined;

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// The headings of the columns, and whether a column is sorted as numbers.
const COLUMNS: [(&str, bool); 8] = [
    ("Picture", false),
    ("Scene", false),
    ("Format", false),
    ("Modified", true),
    ("Size", true),
    ("Nodes", true),
    ("Triangles", true),
    ("Problems", true),
];

/// A text that displays escaped for HTML, between tags and in quoted attributes.
///
/// Control characters are left out, and so are the characters that change the direction of text,
/// with which a name could disguise what follows it.
struct EscapedText<'t>(&'t str);

impl fmt::Display for EscapedText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for c in self.0.chars() {
            match c {
                '&' => f.write_str("&amp;")?,
                '<' => f.write_str("&lt;")?,
                '>' => f.write_str("&gt;")?,
                '"' => f.write_str("&quot;")?,
                '\'' => f.write_str("&#39;")?,
                '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{200e}' | '\u{200f}' => {}
                c if c.is_control() => f.write_char(' ')?,
                c => f.write_char(c)?,
            }
        }
        Ok(())
    }
}

/// A label that marks a scene: the word for the script, and the words for the reader.
type ColumnLabel = (&'static str, &'static str);

/// All labels, in the order of the summary.
const LABELS: [ColumnLabel; 7] = [
    ("unreadable", "unreadable"),
    ("damaged", "damaged"),
    ("missing", "with missing files"),
    ("outside", "with files outside the folder"),
    ("unknown", "with unknown nodes"),
    ("empty", "with nothing to draw"),
    ("nopicture", "without a picture"),
];

/// Returns the labels of a scene.
fn labels(entry: &Entry) -> Vec<ColumnLabel> {
    let holds = [
        entry.error.is_some(),
        entry.state == "damaged",
        !entry.missing.is_empty(),
        !entry.outside.is_empty(),
        entry.unknown() > 0,
        entry.is_empty(),
        entry.no_picture.is_some(),
    ];
    let pairs = LABELS.into_iter().zip(holds);
    pairs
        .filter(|(_, holds)| *holds)
        .map(|(label, _)| label)
        .collect()
}

/// Returns the page. `folder` is the address of the folder of scenes, relative to the page.
pub(super) fn page(title: &str, folder: &str, scenes: &[Entry]) -> String {
    let mut out = String::new();
    write_page(&mut out, title, folder, scenes).expect("writing to a string does not fail");
    out
}

fn write_page(out: &mut String, title: &str, folder: &str, scenes: &[Entry]) -> fmt::Result {
    let title = match title.is_empty() {
        true => "scenes",
        false => title,
    };
    write!(
        out,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <title>Catalog of {title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n",
        title = EscapedText(title)
    )?;
    write_summary(out, title, scenes)?;
    out.write_str("<table id=\"scenes\">\n<thead><tr>")?;
    for (heading, is_number) in COLUMNS {
        let class = if is_number { " class=\"number\"" } else { "" };
        write!(out, "<th scope=\"col\"{class}>{heading}</th>")?;
    }
    out.write_str("</tr></thead>\n<tbody>\n")?;
    scenes
        .iter()
        .try_for_each(|entry| write_row(out, folder, entry))?;
    write!(
        out,
        "</tbody>\n</table>\n<footer>Made by ivcam {}. The same data are in \
         <a href=\"catalog.json\">catalog.json</a>.</footer>\n\
         <script>\n{SCRIPT}</script>\n</body>\n</html>\n",
        env!("CARGO_PKG_VERSION")
    )
}

/// Writes the heading, the numbers of scenes with each label, and the controls for the script.
fn write_summary(out: &mut String, title: &str, scenes: &[Entry]) -> fmt::Result {
    let bytes = scenes.iter().map(|entry| entry.bytes).sum();
    let triangles: u64 = scenes.iter().map(|entry| entry.triangles).sum();
    write!(
        out,
        "<header>\n<h1>{}</h1>\n<p>{} scene{}, {}, {} triangles. \
         {} read without damage.</p>\n",
        EscapedText(title),
        thousands(scenes.len() as u64),
        if scenes.len() == 1 { "" } else { "s" },
        size_text(bytes),
        thousands(triangles),
        thousands(scenes.iter().filter(|entry| entry.state == "whole").count() as u64),
    )?;
    out.write_str("<ul class=\"labels\" id=\"labels\">\n")?;
    for label in LABELS {
        let count = scenes.iter().filter(|e| labels(e).contains(&label)).count();
        if count > 0 {
            let (name, words) = label;
            writeln!(
                out,
                "<li class=\"label {name}\" data-label=\"{name}\">{count} {words}</li>"
            )?;
        }
    }
    out.write_str(
        "</ul>\n<div id=\"controls\" hidden>\n\
         <label>Filter <input type=\"search\" id=\"filter\" autocomplete=\"off\" \
         placeholder=\"name, format, producer, class…\"></label>\n\
         <label>Sort by <select id=\"order\"></select></label>\n\
         <span id=\"shown\" role=\"status\"></span>\n</div>\n</header>\n",
    )
}

/// Writes the row of one scene.
fn write_row(out: &mut String, folder: &str, entry: &Entry) -> fmt::Result {
    let names: Vec<&str> = labels(entry).iter().map(|(name, _)| *name).collect();
    let link = joined(folder, &entry.file);
    writeln!(out, "<tr data-labels=\"{}\">", names.join(" "))?;
    write_picture(out, entry, &link)?;
    let (folders, name) = match entry.file.rsplit_once('/') {
        Some((folders, name)) => (format!("{folders}/"), name),
        None => (String::new(), &*entry.file),
    };
    write!(
        out,
        "<td class=\"scene\" data-value=\"{file}\"><a class=\"name\" href=\"{link}\"><bdi>\
         <span class=\"folder\">{folders}</span>{name}</bdi></a>",
        file = EscapedText(&entry.file),
        link = EscapedText(&link),
        folders = EscapedText(&folders),
        name = EscapedText(name)
    )?;
    write_labels(out, entry)?;
    if let Some(producer) = &entry.producer {
        write!(
            out,
            "<p class=\"producer\"><bdi>{}</bdi></p>",
            EscapedText(producer)
        )?;
    }
    write_converted(out, entry)?;
    write_details(out, entry)?;
    out.write_str("</td>\n")?;
    let format = entry.format.as_deref().unwrap_or("unknown");
    let mut cell = |heading: &str, value: &dyn fmt::Display, text: &str, class: &str| {
        writeln!(
            out,
            "<td class=\"{class}\" data-heading=\"{heading}\" data-value=\"{value}\">{text}</td>"
        )
    };
    let escaped = EscapedText(format).to_string();
    cell("Format", &escaped, &escaped, "format")?;
    let date = date(entry.modified);
    cell("Modified", &entry.modified, &date, "number date")?;
    cell("Size", &entry.bytes, &size_text(entry.bytes), "number")?;
    let nodes = entry.nodes as u64;
    cell("Nodes", &nodes, &thousands(nodes), "number")?;
    cell(
        "Triangles",
        &entry.triangles,
        &thousands(entry.triangles),
        "number",
    )?;
    let problems = entry.problems as u64;
    cell("Problems", &problems, &thousands(problems), "number")?;
    out.write_str("</tr>\n")
}

fn write_picture(out: &mut String, entry: &Entry, link: &str) -> fmt::Result {
    out.write_str("<td class=\"picture\">")?;
    match &entry.picture {
        Some(picture) => write!(
            out,
            "<a href=\"{}\"><img src=\"{}\" alt=\"Picture of {}\" loading=\"lazy\" \
             width=\"160\" height=\"120\"></a>",
            EscapedText(link),
            EscapedText(&joined("", picture)),
            EscapedText(&entry.file)
        )?,
        None => {
            let why = match (&entry.error, &entry.no_picture) {
                (Some(_), _) => "unreadable",
                (None, Some(_)) => "no picture",
                (None, None) => "nothing to draw",
            };
            write!(out, "<span class=\"none\">{why}</span>")?;
        }
    }
    out.write_str("</td>\n")
}

fn write_labels(out: &mut String, entry: &Entry) -> fmt::Result {
    let labels = labels(entry);
    if labels.is_empty() {
        return Ok(());
    }
    out.write_str("<ul class=\"labels\">")?;
    for (name, words) in labels {
        let words = match name {
            "missing" => counted(entry.missing.len(), "missing file"),
            "outside" => counted(entry.outside.len(), "file") + " outside the folder",
            "unknown" => counted(entry.unknown(), "unknown node"),
            "empty" => "nothing to draw".to_owned(),
            "nopicture" => "no picture".to_owned(),
            _ => words.to_owned(),
        };
        write!(out, "<li class=\"label {name}\">{words}</li>")?;
    }
    out.write_str("</ul>")
}

fn write_converted(out: &mut String, entry: &Entry) -> fmt::Result {
    if entry.converted.is_empty() {
        return Ok(());
    }
    out.write_str("<p class=\"converted\">Also as")?;
    for file in &entry.converted {
        write!(
            out,
            " <a href=\"{}\">{}</a>",
            EscapedText(&file.link),
            EscapedText(&file.kind)
        )?;
    }
    out.write_str("</p>")
}

/// Writes what is shown when the reader opens a scene's details.
fn write_details(out: &mut String, entry: &Entry) -> fmt::Result {
    out.write_str("<details><summary>Details</summary><dl>")?;
    let mut item = |heading: &str, text: &str| match text.is_empty() {
        true => Ok(()),
        false => write!(
            out,
            "<dt>{heading}</dt><dd><bdi>{}</bdi></dd>",
            EscapedText(text)
        ),
    };
    item("Not read", entry.error.as_deref().unwrap_or_default())?;
    item(
        "No picture",
        entry.no_picture.as_deref().unwrap_or_default(),
    )?;
    entry.notes.iter().try_for_each(|note| item("Note", note))?;
    if let Some([x, y, z]) = entry.size {
        item(
            "Extent",
            &format!("{} × {} × {} m", short(x), short(y), short(z)),
        )?;
    }
    for (heading, class) in [
        ("Drawn", "drawn"),
        ("Structure", "structure"),
        ("Kept", "kept"),
        ("Unknown", "unknown"),
    ] {
        let list = entry.classes.get(class).into_iter().flatten();
        let words: Vec<String> = list.map(|(name, n)| format!("{name} {n}")).collect();
        item(heading, &words.join(", "))?;
    }
    if entry.error.is_none() {
        let (lights, cameras) = (entry.lights, entry.cameras);
        let words = [counted(lights, "light"), counted(cameras, "camera")];
        item("Lights and cameras", &words.join(", "))?;
    }
    item("Missing", &entry.missing.join(", "))?;
    item("Outside", &entry.outside.join(", "))?;
    item("Uses", &entry.uses.join(", "))?;
    out.write_str("</dl>")?;
    write_messages(out, entry)?;
    out.write_str("</details>")
}

fn write_messages(out: &mut String, entry: &Entry) -> fmt::Result {
    if entry.messages.is_empty() || entry.error.is_some() {
        return Ok(());
    }
    out.write_str("<ol class=\"messages\">")?;
    for message in &entry.messages {
        let Message {
            severity,
            line,
            file,
            text,
            count,
        } = message;
        write!(out, "<li><b>{}</b> ", EscapedText(severity))?;
        if let Some(file) = file {
            write!(out, "<bdi>{}</bdi>, ", EscapedText(file))?;
        }
        if let Some(line) = line {
            write!(out, "line {line}: ")?;
        }
        write!(out, "<bdi>{}</bdi>", EscapedText(text))?;
        if *count > 1 {
            write!(out, " ({count} times)")?;
        }
        out.write_str("</li>")?;
    }
    let listed: usize = entry.messages.iter().map(|m| m.count).sum();
    if listed < entry.problems {
        write!(out, "<li>and {} more</li>", entry.problems - listed)?;
    }
    out.write_str("</ol>")
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
