//! The columns of a table: by the words of a heading, or by the values in them.

use crate::prescription::formats::dat::lines::Cell;
use crate::prescription::formats::format::Gap;

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Column {
    Radius,
    Gap,
    Index,
    Abbe,
    Diameter,
    SemiDiameter,
    /// The diameter that is closed in the middle.
    Obstruction,
    /// The name of a glass, which stands for the index if no other column has that.
    Glass,
    /// A word or number that is not read.
    Ignored,
}

/// What a heading says.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Heading {
    /// The columns from left to right.
    pub(super) columns: Vec<Column>,
    /// What the word above the column of gaps means, if it has one meaning.
    pub(super) gap: Option<Gap>,
    /// Whether the word above the apertures says that they are diameters, or semi-diameters.
    pub(super) diameters_are_certain: bool,
}

/// Names of several words, and the word that stands for each.
const PHRASES: [(&str, &str); 10] = [
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

/// Reads a heading: words that name at least the radius and the gap. None for any other text.
pub(super) fn heading(text: &str) -> Option<Heading> {
    let mut text = text.to_ascii_lowercase();
    for (phrase, word) in PHRASES {
        text = text.replace(phrase, word);
    }
    let separates = |c: char| c.is_whitespace() || matches!(c, ',' | '/' | '|' | ';' | '#');
    let words = text.split(separates).filter(|w| !w.is_empty());
    let words: Vec<&str> = words
        .filter(|w| !w.starts_with(['(', '[']) && !w.ends_with([')', ']']))
        .collect();
    let mut columns: Vec<Column> = words.iter().map(|word| column(word)).collect();
    // A sentence has words that name no column; a heading begins with one that does.
    let named = columns.iter().filter(|c| **c != Column::Ignored).count();
    let glass = match columns.contains(&Column::Index) {
        true => Column::Ignored,
        false => Column::Index,
    };
    for column in columns.iter_mut().filter(|c| **c == Column::Glass) {
        *column = glass;
    }
    let has = |column| columns.contains(&column);
    if !has(Column::Radius) || !has(Column::Gap) || 2 * named <= columns.len() {
        return None;
    }
    let at = columns.iter().position(|c| *c == Column::Gap)?;
    let gap = match words[at] {
        "axpos" => Some(Gap::Previous),
        "position" | "pos" | "z" => Some(Gap::Position),
        "thickness" | "thick" => Some(Gap::Next),
        _ => None,
    };
    let is_certain = |word: &&str| word.starts_with("diam") || word.starts_with("semi");
    Some(Heading {
        gap,
        diameters_are_certain: words.iter().any(is_certain) || has(Column::SemiDiameter),
        columns,
    })
}

fn column(word: &str) -> Column {
    match word.trim_matches(|c: char| !c.is_ascii_alphanumeric()) {
        "radius" | "rad" | "r" | "roc" => Column::Radius,
        "thickness" | "thick" | "axpos" | "t" | "d" | "gap" | "distance" | "separation"
        | "position" | "pos" | "z" => Column::Gap,
        "index" | "n" | "nd" | "n_d" | "ior" | "eta" => Column::Index,
        "glass" | "material" | "medium" => Column::Glass,
        "abbe" | "v" | "vd" | "v_d" | "v-no" | "vno" | "v-number" | "abbe-no" | "abbe_no"
        | "abbe-number" => Column::Abbe,
        "aperture" | "ap" | "diameter" | "diam" | "dia" => Column::Diameter,
        "obstruction" | "obscuration" => Column::Obstruction,
        "semi-diameter" | "semi-aperture" | "semi_aperture" | "semidiameter" | "sd" | "semi_ap"
        | "housing-radius" => Column::SemiDiameter,
        _ => Column::Ignored,
    }
}

/// The four columns of pbrt, and the two orders of five.
pub(super) const FOUR: [Column; 4] = [Column::Radius, Column::Gap, Column::Index, Column::Diameter];
const ABBE_LAST: [Column; 5] = [
    Column::Radius,
    Column::Gap,
    Column::Index,
    Column::Diameter,
    Column::Abbe,
];
const ABBE_FOURTH: [Column; 5] = [
    Column::Radius,
    Column::Gap,
    Column::Index,
    Column::Abbe,
    Column::Diameter,
];

/// The order of five columns without a heading: the Abbe number is the column that has a value
/// from 15 to 100 in rows of glass and never elsewhere. None if that is true of both columns or of
/// neither.
pub(super) fn order_of_five(rows: &[Vec<Cell<'_>>]) -> Option<&'static [Column]> {
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
