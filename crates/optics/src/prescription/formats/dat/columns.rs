//! The columns of a table: by the words of a heading, or by the values in them.

use crate::prescription::formats::dat::lines::Cell;
use crate::prescription::formats::reading::Gap;
use crate::prescription::surface::MAX_POWER;

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DatColumn {
    Radius,
    Gap,
    Index,
    Abbe,
    Diameter,
    SemiDiameter,
    /// The diameter that is closed in the middle.
    Obstruction,
    /// The conic constant.
    Conic,
    /// The coefficient of a power of the height in the sag.
    Term(usize),
    /// The name of a glass, which stands for the index if no other column has that.
    Glass,
    /// What is not needed: the number of a surface, or the name of a glass beside its index.
    Ignored,
    /// What an unknown word names. Numbers below it are refused.
    Unknown,
}

impl DatColumn {
    /// The name in messages.
    pub(super) fn name(self) -> String {
        match self {
            Self::Radius => "radius",
            Self::Gap => "thickness",
            Self::Index | Self::Glass => "index or glass",
            Self::Abbe => "Abbe number",
            Self::Diameter => "diameter",
            Self::SemiDiameter => "semi-diameter",
            Self::Obstruction => "obstruction",
            Self::Conic => "conic constant",
            Self::Term(power) => return format!("coefficient of r^{power}"),
            Self::Ignored => "a column that is not needed",
            Self::Unknown => "an unknown column",
        }
        .to_owned()
    }

    /// Whether the column is that of the clear apertures.
    pub(super) fn is_aperture(self) -> bool {
        matches!(self, Self::Diameter | Self::SemiDiameter)
    }
}

/// The names of columns in messages, with commas between them.
pub(super) fn names(columns: &[DatColumn]) -> String {
    let names: Vec<String> = columns.iter().map(|column| column.name()).collect();
    names.join(", ")
}

/// What a heading says.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TableHeading {
    /// The columns from left to right.
    pub(super) columns: Vec<DatColumn>,
    /// The words that name them, in small letters.
    pub(super) words: Vec<String>,
    /// What the word above the column of gaps means, if it has one meaning.
    pub(super) gap: Option<Gap>,
    /// Whether the word above the apertures says that they are diameters, or semi-diameters.
    pub(super) diameters_are_certain: bool,
}

/// Names of several words, and the word that stands for each.
const PHRASES: [(&str, &str); 11] = [
    ("conic constant", "conic"),
    ("radius of curvature", "radius"),
    ("curvature radius", "radius"),
    ("clear aperture", "aperture"),
    ("semi diameter", "semi-diameter"),
    ("semi aperture", "semi-diameter"),
    ("index of refraction", "index"),
    ("refractive index", "index"),
    ("abbe number", "abbe"),
    ("v number", "abbe"),
    ("housing radius", "semi-diameter"),
];

/// Reads a heading: words of which most name columns, among them the radius and the gap. None for
/// any other text.
pub(super) fn heading(text: &str) -> Option<TableHeading> {
    let heading = words_of_columns(text)?;
    // A sentence has words that name no column; a heading begins with one that does.
    let is_named = |column: &&DatColumn| !matches!(column, DatColumn::Ignored | DatColumn::Unknown);
    let named = heading.columns.iter().filter(is_named).count();
    (2 * named > heading.columns.len()).then_some(heading)
}

/// Reads the comment above the first row as a heading, although most of its words are unknown: it
/// begins with the radius and has as many words as the row has cells.
pub(super) fn heading_above(comment: &str, cells: usize) -> Option<TableHeading> {
    let begins = |h: &TableHeading| h.columns.len() == cells && h.columns[0] == DatColumn::Radius;
    words_of_columns(comment).filter(begins)
}

/// The columns that the words of a text name, if the radius and the gap are among them.
fn words_of_columns(text: &str) -> Option<TableHeading> {
    let mut text = text.to_ascii_lowercase();
    for (phrase, word) in PHRASES {
        text = text.replace(phrase, word);
    }
    let separates = |c: char| c.is_whitespace() || matches!(c, ',' | '/' | '|' | ';' | '#');
    let words = text.split(separates).filter(|w| !w.is_empty());
    let words: Vec<&str> = words
        .filter(|w| !w.starts_with(['(', '[']) && !w.ends_with([')', ']']))
        .collect();
    let mut columns: Vec<DatColumn> = words.iter().map(|word| column(word)).collect();
    let glass = match columns.contains(&DatColumn::Index) {
        true => DatColumn::Ignored,
        false => DatColumn::Index,
    };
    for column in columns.iter_mut().filter(|c| **c == DatColumn::Glass) {
        *column = glass;
    }
    let has = |column| columns.contains(&column);
    if !has(DatColumn::Radius) || !has(DatColumn::Gap) {
        return None;
    }
    let at = columns.iter().position(|c| *c == DatColumn::Gap)?;
    let gap = match words[at] {
        "axpos" => Some(Gap::Previous),
        "position" | "pos" | "z" => Some(Gap::Position),
        "thickness" | "thick" => Some(Gap::Next),
        _ => None,
    };
    let is_certain = |word: &&str| word.starts_with("diam") || word.starts_with("semi");
    Some(TableHeading {
        gap,
        diameters_are_certain: words.iter().any(is_certain) || has(DatColumn::SemiDiameter),
        words: words.iter().map(|word| (*word).to_owned()).collect(),
        columns,
    })
}

fn column(word: &str) -> DatColumn {
    match word.trim_matches(|c: char| !c.is_ascii_alphanumeric()) {
        "radius" | "rad" | "r" | "roc" => DatColumn::Radius,
        "thickness" | "thick" | "axpos" | "t" | "d" | "gap" | "distance" | "separation"
        | "position" | "pos" | "z" => DatColumn::Gap,
        "index" | "n" | "nd" | "n_d" | "ior" | "eta" => DatColumn::Index,
        "glass" | "material" | "medium" => DatColumn::Glass,
        "abbe" | "v" | "vd" | "v_d" | "v-no" | "vno" | "v-number" | "abbe-no" | "abbe_no"
        | "abbe-number" => DatColumn::Abbe,
        "aperture" | "ap" | "diameter" | "diam" | "dia" => DatColumn::Diameter,
        "obstruction" | "obscuration" => DatColumn::Obstruction,
        "semi-diameter" | "semi-aperture" | "semi_aperture" | "semidiameter" | "sd" | "semi_ap"
        | "housing-radius" => DatColumn::SemiDiameter,
        "conic" | "k" | "cc" | "conic-constant" => DatColumn::Conic,
        "surface" | "surf" | "srf" | "no" | "nr" | "num" | "number" | "i" | "s" | "id"
        | "element" | "group" => DatColumn::Ignored,
        other => term(other).unwrap_or(DatColumn::Unknown),
    }
}

/// `a4` is the coefficient of r⁴. `a1` and `a2` are terms of first powers in some tables and the
/// first terms of a list in others.
fn term(word: &str) -> Option<DatColumn> {
    let power = word.strip_prefix('a')?.trim_start_matches('_');
    let power: usize = power.parse().ok()?;
    (3..=MAX_POWER)
        .contains(&power)
        .then_some(DatColumn::Term(power))
}

/// The four columns of pbrt, and the two orders of five.
pub(super) const FOUR: [DatColumn; 4] = [
    DatColumn::Radius,
    DatColumn::Gap,
    DatColumn::Index,
    DatColumn::Diameter,
];
const ABBE_LAST: [DatColumn; 5] = [
    DatColumn::Radius,
    DatColumn::Gap,
    DatColumn::Index,
    DatColumn::Diameter,
    DatColumn::Abbe,
];
const ABBE_FOURTH: [DatColumn; 5] = [
    DatColumn::Radius,
    DatColumn::Gap,
    DatColumn::Index,
    DatColumn::Abbe,
    DatColumn::Diameter,
];

/// The order of five columns without a heading: the Abbe number is the column that has a value
/// from 15 to 100 in rows of glass and never elsewhere. None if that is true of both columns or of
/// neither.
pub(super) fn order_of_five(rows: &[Vec<Cell<'_>>]) -> Option<&'static [DatColumn]> {
    let numbers =
        |row: &Vec<Cell<'_>>| -> Option<Vec<f64>> { row.iter().map(|cell| cell.number).collect() };
    let rows: Vec<Vec<f64>> = rows.iter().filter_map(numbers).collect();
    let rows: Vec<&Vec<f64>> = rows.iter().filter(|row| row.len() == 5).collect();
    let is_abbe = |at: usize| {
        !rows.is_empty()
            && rows.iter().all(|row| match row[2] > 1.2 {
                true => (15.0..=100.0).contains(&row[at]),
                false => !(15.0..=100.0).contains(&row[at]),
            })
    };
    match (is_abbe(3), is_abbe(4)) {
        (true, false) => Some(&ABBE_FOURTH),
        (false, true) => Some(&ABBE_LAST),
        _ => None,
    }
}
