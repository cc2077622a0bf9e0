//! Writes a report as one HTML page, which needs neither a network nor scripts.
//!
//! The template is `page.html`. The catalog's script filters and sorts the table, and `page.js`
//! shows a pair in large. Every text from a file is escaped by the template.

use minijinja::value::{Serde, Value};
use serde::Serialize;
use serde_json::Value as Json;

use super::entry::{PairEntry, PairVerdict, ReportData, UnpairedFile};
use super::options::FolderOptions;
use super::pairing::PairedBy;
use crate::catalog::{SCRIPT, STYLE, environment, original};
use crate::compare::sheet::number;
use crate::compare::{METRICS, Metric, probability};

/// The measures that the table has in any case.
const USUAL: [&str; 5] = ["ssim", "flip", "psnr", "edge", "edge-match"];

/// The content of the page, as the template names it.
#[derive(Serialize)]
struct ReportPage<'a> {
    title: String,
    style: String,
    script: String,
    version: &'static str,
    data: &'a ReportData,
    /// The column and the direction of the first order, for the script.
    sort: String,
    columns: Vec<TableColumn>,
    /// The labels that some pair has.
    labels: Vec<PairLabel>,
    rows: Vec<PairRow<'a>>,
    /// The pictures without a partner, by folder.
    unpaired: [UnpairedList<'a>; 2],
}

/// A measure of the table.
#[derive(Serialize)]
struct TableColumn {
    heading: &'static str,
    /// `smallest` or `largest`.
    worst: &'static str,
}

/// The pictures of one folder without a partner.
#[derive(Serialize)]
struct UnpairedList<'a> {
    heading: &'static str,
    folder: &'a str,
    files: &'a [UnpairedFile],
}

/// A pair of the page: its entry, and what is derived from it.
#[derive(Serialize)]
struct PairRow<'a> {
    #[serde(flatten)]
    entry: &'a PairEntry,
    /// The addresses of the two files.
    links: [String; 2],
    labels: Vec<PairLabel>,
    cells: Vec<TableCell>,
    /// The end of the scale of the difference, as text.
    scale: String,
    /// Headings and texts of what is shown when the reader opens the details.
    details: Vec<(&'static str, String)>,
}

/// A measure of a pair.
#[derive(Serialize)]
struct TableCell {
    heading: &'static str,
    /// The value for the script; empty if it does not exist.
    value: String,
    text: String,
    is_exceeded: bool,
}

/// A mark of a pair: the word for style sheet and script, and the text for the reader.
#[derive(Clone, PartialEq, Serialize)]
struct PairLabel {
    name: &'static str,
    text: String,
}

/// Returns the page.
pub(super) fn page(data: &ReportData, options: &FolderOptions) -> String {
    let columns = columns(options);
    let place = columns.iter().position(|m| m.name == options.sort.name);
    // The pictures and the names are before the measures.
    let sort = format!(
        "{} {}",
        place.unwrap_or_default() + 2,
        !options.sort.more_is_better
    );
    let mut pairs: Vec<&PairEntry> = data.pairs.iter().collect();
    pairs.sort_by(|a, b| badness(options.sort, b).total_cmp(&badness(options.sort, a)));
    let rows: Vec<PairRow<'_>> = pairs.iter().map(|pair| row(data, pair, &columns)).collect();
    let name = |path: &std::path::Path| {
        let name = path.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    };
    let page = ReportPage {
        title: format!("{} and {}", name(&options.new), name(&options.old)),
        style: format!("{STYLE}{}", include_str!("page.css")),
        script: format!("{SCRIPT}{}", include_str!("page.js")),
        version: env!("CARGO_PKG_VERSION"),
        data,
        sort,
        columns: columns.iter().map(|metric| column(metric)).collect(),
        labels: summary(&rows),
        rows,
        unpaired: [
            (
                "New pictures without a partner",
                &data.folders[0],
                &data.unpaired_new,
            ),
            (
                "Old pictures without a partner",
                &data.folders[1],
                &data.unpaired_old,
            ),
        ]
        .map(|(heading, folder, files)| UnpairedList {
            heading,
            folder,
            files,
        }),
    };
    let mut templates = environment();
    templates.add_filter("joined", |file: &str, folder: &str| original(folder, file));
    templates
        .render_named_str(
            "page.html",
            include_str!("page.html"),
            Value::from(Serde(&page)),
        )
        .expect("the template fits its data")
}

/// Returns the measures of the table: the usual ones, and those that order or limit the pairs.
fn columns(options: &FolderOptions) -> Vec<&'static Metric> {
    let is_shown = |metric: &&Metric| {
        USUAL.contains(&metric.name)
            || metric.name == options.sort.name
            || options.limits.iter().any(|l| l.metric.name == metric.name)
    };
    METRICS.iter().filter(is_shown).collect()
}

fn column(metric: &Metric) -> TableColumn {
    TableColumn {
        heading: heading(metric),
        worst: match metric.more_is_better {
            true => "smallest",
            false => "largest",
        },
    }
}

fn heading(metric: &Metric) -> &'static str {
    match metric.name {
        "mse" => "MSE",
        "psnr" => "PSNR",
        "ssim" => "SSIM",
        "flip" => "FLIP",
        "edge" => "Edges",
        "edge95" => "Edges, 95%",
        "edge-match" => "Matched",
        "unmatched-mse" => "MSE, tones unmatched",
        "unmatched-psnr" => "PSNR, tones unmatched",
        other => other,
    }
}

/// Returns a number that is larger the worse a pair is. What does not exist is the worst.
fn badness(metric: &Metric, pair: &PairEntry) -> f64 {
    let value = pair.value(metric);
    match (value.is_nan(), metric.more_is_better) {
        (true, _) => f64::INFINITY,
        (false, true) => -value,
        (false, false) => value,
    }
}

/// Returns the numbers of pairs with each label.
fn summary(rows: &[PairRow<'_>]) -> Vec<PairLabel> {
    let all = [
        ("failed", "not compared"),
        ("exceeded", "beyond a limit"),
        ("within", "within the limits"),
        ("compared", "compared"),
        ("bypicture", "paired by picture"),
        ("list", "paired by a list"),
        ("mirrored", "mirrored"),
    ];
    let held: Vec<&PairLabel> = rows.iter().flat_map(|row| &row.labels).collect();
    let counts = all.map(|(name, words)| {
        let count = held.iter().filter(|label| label.name == name).count();
        (name, count, words)
    });
    let present = counts.into_iter().filter(|(_, count, _)| *count > 0);
    present
        .map(|(name, count, words)| PairLabel {
            name,
            text: format!("{count} {words}"),
        })
        .collect()
}

/// Returns the labels of a pair.
fn labels(pair: &PairEntry) -> Vec<PairLabel> {
    let exceeded = pair.limits_exceeded.iter().map(|e| e.metric);
    let verdict = match pair.verdict {
        PairVerdict::Failed => "not compared".to_owned(),
        PairVerdict::Exceeded => {
            let names: Vec<&str> = exceeded.collect();
            format!("beyond the limit: {}", names.join(", "))
        }
        PairVerdict::Within => "within the limits".to_owned(),
        PairVerdict::Compared => "compared".to_owned(),
    };
    let alignment = pair
        .comparison
        .as_ref()
        .map(|c| &c["alignment"]["mirrored"]);
    [
        (true, pair.verdict.name(), verdict),
        (
            pair.paired_by == PairedBy::Picture,
            "bypicture",
            "paired by picture".to_owned(),
        ),
        (
            pair.paired_by == PairedBy::List,
            "list",
            "paired by a list".to_owned(),
        ),
        (
            alignment == Some(&Json::Bool(true)),
            "mirrored",
            "mirrored".to_owned(),
        ),
    ]
    .into_iter()
    .filter(|(holds, ..)| *holds)
    .map(|(_, name, text)| PairLabel { name, text })
    .collect()
}

/// Returns the row of one pair.
fn row<'a>(data: &ReportData, entry: &'a PairEntry, columns: &[&Metric]) -> PairRow<'a> {
    let scale = entry.pictures.as_ref().map_or(1.0, |p| p.scale);
    PairRow {
        entry,
        links: [
            original(&data.folders[0], &entry.new),
            original(&data.folders[1], &entry.old),
        ],
        labels: labels(entry),
        cells: columns.iter().map(|metric| cell(entry, metric)).collect(),
        scale: number(scale),
        details: details(entry),
    }
}

fn cell(entry: &PairEntry, metric: &Metric) -> TableCell {
    let value = entry.value(metric);
    TableCell {
        heading: heading(metric),
        value: match value {
            v if v.is_nan() => String::new(),
            v if v.is_infinite() => "Infinity".to_owned(),
            v => v.to_string(),
        },
        text: text_of(metric, value),
        is_exceeded: entry
            .limits_exceeded
            .iter()
            .any(|e| e.metric == metric.name),
    }
}

/// Returns a value with its unit.
fn text_of(metric: &Metric, value: f64) -> String {
    match metric.name {
        _ if value.is_nan() => "–".to_owned(),
        "psnr" | "unmatched-psnr" if value.is_infinite() => "∞ dB".to_owned(),
        "psnr" | "unmatched-psnr" => format!("{value:.2} dB"),
        "edge" | "edge95" => format!("{value:.2} px"),
        "edge-match" => format!("{:.1}%", 100.0 * value),
        "mse" | "unmatched-mse" => format!("{value:.6}"),
        _ => format!("{value:.4}"),
    }
}

fn details(pair: &PairEntry) -> Vec<(&'static str, String)> {
    let null = Json::Null;
    let comparison = pair.comparison.as_ref().unwrap_or(&null);
    let paired = match (pair.paired_by, pair.pairing_chance) {
        (PairedBy::Name, _) => "by name".to_owned(),
        (PairedBy::List, _) => "by a list".to_owned(),
        (PairedBy::Picture, chance) => format!(
            "by picture; any of the tried pairs agrees as well by chance with a probability of \
             at most {}",
            probability(chance.unwrap_or_default())
        ),
    };
    let exceeded = pair.limits_exceeded.iter();
    let limits = exceeded.map(|e| format!("{} is {}, the limit is {}", e.metric, e.value, e.limit));
    let pixels = comparison["pixels"].as_u64().map(|pixels| {
        format!(
            "{pixels} of {}×{}",
            comparison["width"], comparison["height"]
        )
    });
    let all = METRICS.iter().filter(|_| pair.comparison.is_some());
    let measures =
        all.map(|metric| format!("{} {}", metric.name, text_of(metric, pair.value(metric))));
    let list = [
        ("Not compared", pair.error.clone().unwrap_or_default()),
        ("What to do", pair.help.clone().unwrap_or_default()),
        ("Limits", limits.collect::<Vec<_>>().join("; ")),
        ("Paired", paired),
        (
            "Old picture",
            alignment(&comparison["alignment"], &pair.registration),
        ),
        ("Tones", tones(&comparison["tones"])),
        ("Pixels", pixels.unwrap_or_default()),
        ("Measures", measures.collect::<Vec<_>>().join(", ")),
    ];
    list.into_iter()
        .filter(|(_, text)| !text.is_empty())
        .collect()
}

/// Describes where the old picture lies.
fn alignment(alignment: &Json, registration: &str) -> String {
    let number = |value: &Json| value.as_f64().unwrap_or_default();
    match (registration, alignment) {
        ("resize", _) => "resized".to_owned(),
        (_, Json::Null) => String::new(),
        (_, found) => format!(
            "{}aligned: shift {:+.2} {:+.2} px, scale {:.4}, rotation {:+.3} degrees; by chance \
             with a probability of at most {}",
            match found["mirrored"] == true {
                true => "mirrored and ",
                false => "",
            },
            number(&found["shift"][0]),
            number(&found["shift"][1]),
            number(&found["scale"]),
            number(&found["rotation"]),
            probability(number(&found["chance"]))
        ),
    }
}

/// Describes the curves that were fitted to the old picture's tones.
fn tones(tones: &Json) -> String {
    let Some(curves) = tones.as_array() else {
        return String::new();
    };
    let text = |tone: &Json| {
        let [gain, offset, gamma] =
            ["gain", "offset", "gamma"].map(|name| tone[name].as_f64().unwrap_or_default());
        format!("gain {gain:.3}, offset {offset:+.3}, gamma {gamma:.3}")
    };
    let mut texts: Vec<String> = curves.iter().map(text).collect();
    texts.dedup();
    texts.join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::{Matching, MetricLimit, Selection};
    use crate::compare_folder::Photographs;
    use crate::photo::{Era, Plan};

    fn options(sort: &str) -> FolderOptions {
        FolderOptions {
            new: "n".into(),
            old: "<o>".into(),
            out: "r".into(),
            registration: None,
            matching: Matching::Picture,
            selection: Selection::default(),
            pixels_per_degree: 67.0,
            limits: vec![MetricLimit {
                metric: Metric::named("ssim").unwrap(),
                value: 0.9,
            }],
            sort: Metric::named(sort).unwrap(),
            pairs: None,
            by_name: false,
            force: false,
            threads: 1,
            words: Vec::new(),
            photographs: Photographs {
                plan: Plan::of_era(Era::Modern, ""),
                given: Json::Null,
                uses: Vec::new(),
            },
        }
    }

    fn pair(name: &str, values: &[(&str, Option<f64>)]) -> PairEntry {
        let mut entry: PairEntry = serde_json::from_value(serde_json::json!({
            "new": name, "old": format!("{name}.old"), "paired_by": "picture",
            "pairing_chance": 1e-9, "registration": "align", "verdict": "failed",
            "error": null, "help": null, "measures": {}, "pictures": null,
            "comparison": { "pixels": 9 }, "stamps": [
                { "bytes": 1, "modified": 2 }, { "bytes": 1, "modified": 2 }
            ],
        }))
        .unwrap();
        let values = values.iter().map(|(name, v)| ((*name).to_owned(), *v));
        entry.measures = values.collect();
        entry.judge(&options("ssim").limits);
        entry
    }

    fn data(pairs: Vec<PairEntry>) -> ReportData {
        ReportData {
            ivcam: String::new(),
            options: Vec::new(),
            limits: Vec::new(),
            is_complete: true,
            folders: ["../n".to_owned(), "../o".to_owned()],
            tried: 0,
            search: Default::default(),
            beside_scenes: 0,
            pairs,
            unpaired_new: Vec::new(),
            unpaired_old: Vec::new(),
        }
    }

    #[test]
    fn names_and_messages_cannot_become_markup() {
        let evil = "<script>alert(1)</script>\"'&\u{202e}\u{7}";
        let mut failed = pair(evil, &[]);
        failed.error = Some(evil.to_owned());
        failed.help = Some(evil.to_owned());
        let mut data = data(vec![failed]);
        data.unpaired_old = vec![UnpairedFile {
            file: evil.to_owned(),
            small: Some(evil.to_owned()),
            error: Some(evil.to_owned()),
            note: Some(evil.to_owned()),
        }];
        let page = page(&data, &options("ssim"));
        assert_eq!(page.matches("<script>").count(), 1, "only the page's own");
        assert!(!page.contains("alert(1)</") && !page.contains('\u{202e}'));
        assert!(page.contains("href=\"../n/%3Cscript%3Ealert%281%29%3C/script%3E%22%27%26"));
        assert!(page.contains("n and &lt;o&gt;"));
    }

    #[test]
    fn the_worst_is_first_and_equal_pictures_are_the_best() {
        let pairs = || {
            data(vec![
                pair(
                    "good",
                    &[
                        ("ssim", Some(0.99)),
                        ("psnr", Some(40.0)),
                        ("mse", Some(1e-4)),
                    ],
                ),
                pair(
                    "same",
                    &[("ssim", Some(1.0)), ("psnr", None), ("mse", Some(0.0))],
                ),
                pair("none", &[("ssim", None), ("psnr", None)]),
                pair(
                    "bad",
                    &[("ssim", Some(0.5)), ("psnr", Some(9.0)), ("mse", Some(0.1))],
                ),
            ])
        };
        for sort in ["ssim", "psnr"] {
            let page = page(&pairs(), &options(sort));
            let place = |name: &str| {
                page.find(&format!("alt=\"New: {name}\""))
                    .or_else(|| page.find(&format!("data-value=\"{name}\"")))
            };
            let places = ["none", "bad", "good", "same"].map(|name| place(name).unwrap());
            assert!(places.is_sorted(), "{sort}: {places:?}");
        }
        let page = page(&pairs(), &options("psnr"));
        assert!(page.contains("∞ dB") && page.contains("2 beyond a limit</li>"));
        assert!(page.contains("2 within the limits</li>"));
    }
}
