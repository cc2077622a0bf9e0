//! Reads tables of four columns: radius, thickness, index and aperture diameter, one surface in a
//! line.
//!
//! The paper prints such a table, and pbrt's `.dat` files are such tables. A stop is a row with
//! radius 0 and index 0, or as the paper prints it, a row without a radius (`10.353 1.000 39.8`).
//! Radius 0 with an index is a plane. A stop takes the medium in front of it, so one in a fluid
//! stays in it (pbrt assumes air). `#` starts a comment; header words are skipped; commas count as
//! blanks.
//!
//! Where the heading of the table names a fifth column `V_d` (`Vd`, `V-no`, `abbe`), as the last or
//! before the aperture, glasses have an Abbe number there.
//! A comment `units: cm` (mm, cm, in or m) scales all lengths.
//!
//! Kolb's and CS348b's older files have the distance from the previous vertex in the second column.
//! They say `axpos` above it, or begin with a distance of 0, which no lens has.

use std::sync::Arc;

use nom::Parser;
use nom::bytes::complete::{take_till, take_till1, take_while};
use nom::character::complete::{char, one_of};
use nom::combinator::{consumed, eof, opt};
use nom::multi::{many_till, many0};
use nom::sequence::{preceded, terminated};

use crate::diag::{Diagnostic, Result, Sink, Source, Span};
use crate::math::LengthUnit;
use crate::prescription::about::About;
use crate::prescription::first_order::FirstOrder;
use crate::prescription::formats::format::Format;
use crate::prescription::glass::{D_LINE, Medium};
use crate::prescription::prescription::{Column, Prescription, check};
use crate::prescription::surface::{Plane, Surface};
use crate::prescription::text::{Failure, Word};

/// A line of the file.
struct Line<'a> {
    /// The text before `#`.
    data: &'a str,
    /// The words of that text.
    cells: Vec<Cell<'a>>,
    /// The text after `#`.
    comment: &'a str,
}

/// A word of a line, and its value if it is a number.
struct Cell<'a> {
    word: Word<'a>,
    number: Option<f64>,
}

/// A row of the table. A column that the file leaves empty is `None`.
struct Row {
    radius: f64,
    thickness: f64,
    index: Option<f64>,
    diameter: f64,
    abbe: Option<f64>,
    spans: [Span; 4],
}
/// The four columns of the paper and of pbrt, and those of ISET, which have a focal length above
/// them. A file in no other format is read as this.
pub(crate) static FORMAT: Format = Format {
    name: "four columns",
    recognizes: |_| true,
    read: |source, how, sink| read(source, how.position_first, sink),
};

/// Reads a table of four or five columns.
///
/// # Errors
///
/// Returns an error if a row does not consist of numbers, if a number is out of range, or if there
/// is no surface.
pub(crate) fn read(
    source: &Arc<Source>,
    position_first: Option<bool>,
    sink: &mut Sink,
) -> Result<Prescription> {
    let text = String::from_utf8_lossy(&source.bytes);
    let mut notes = Vec::new();
    let mut rows: Vec<Row> = Vec::new();
    let mut abbe = None;
    for line in lines(&text) {
        if is_heading(line.comment) {
            abbe = abbe_column(line.comment).or(abbe);
        } else if !line.comment.is_empty() {
            notes.push(line.comment.to_owned());
        }
        let cells = line.cells;
        let numbers = cells.iter().filter(|cell| cell.number.is_some()).count();
        let is_header = numbers == 0 && rows.is_empty();
        if cells.is_empty() || is_header {
            abbe = abbe_column(line.data).or(abbe);
            continue;
        }
        if cells.len() == 1 && numbers == 1 && rows.is_empty() {
            notes.push(format!("focal length as listed: {}", cells[0].word.text));
            continue;
        }
        let before = rows.iter().rev().find_map(|r| r.index).unwrap_or(1.0);
        rows.push(row(source, cells, before, abbe)?);
    }
    let positions = position_first.unwrap_or_else(|| says_positions(&text, &rows));
    if positions {
        let note = "the second column is read as the distance from the vertex before";
        sink.note(rows.first().map_or(Span::at(0), |r| r.spans[1]), note);
        for i in 0..rows.len() {
            rows[i].thickness = rows.get(i + 1).map_or(0.0, |next| next.thickness);
        }
    }
    let mut lens = build(source, &rows, notes);
    lens.image_height = About::of(&lens).image_height;
    check(&mut lens, source, sink, |surface, column| {
        rows.get(surface)
            .map_or(Span::at(0), |row| row.spans[column as usize])
    })?;
    warn_if_a_row_is_lost(&lens, &rows, sink);
    match unit(&text, source)? {
        1.0 => Ok(lens),
        unit => Ok(lens.scaled(unit)),
    }
}

/// The length in millimeters of the unit that a comment such as `units: cm` names.
fn unit(text: &str, source: &Arc<Source>) -> Result<f64> {
    let Some(at) = text.find("# units:") else {
        return Ok(1.0);
    };
    let stated = text[at + 8..].lines().next().unwrap_or("");
    match LengthUnit::parse(stated.trim()) {
        Some(unit) => Ok(unit.millimeters()),
        None => {
            let message = format!("`{}` is not a unit of length", stated.trim());
            Err(Diagnostic::error(message)
                .at(source, Span::new(at, at + 8 + stated.len()))
                .with_help("mm, cm, in or m"))
        }
    }
}

/// The column of the Abbe number in a heading, from 0, if it is the fourth or fifth.
fn abbe_column(heading: &str) -> Option<usize> {
    const NAMES: [&str; 6] = ["v_d", "vd", "v-no", "v", "abbe", "abbe-no"];
    let blank = |c: char| c.is_whitespace() || c == ',' || c == '#';
    let words = heading.split(blank).filter(|w| !w.is_empty());
    let at = words
        .map(str::to_ascii_lowercase)
        .position(|w| NAMES.contains(&w.as_str()));
    at.filter(|at| *at == 3 || *at == 4)
}

/// Whether a comment names the columns.
fn is_heading(comment: &str) -> bool {
    let mut words = comment.split_whitespace();
    words
        .next()
        .is_some_and(|w| w.eq_ignore_ascii_case("radius"))
        && words.next().is_some()
}

/// Whether the second column is the distance from the previous vertex: the header says so, or the
/// first distance is 0 and the last is not.
fn says_positions(text: &str, rows: &[Row]) -> bool {
    let mut words = text.lines().take(20).flat_map(str::split_whitespace);
    if words.any(|w| w.trim_start_matches('#').eq_ignore_ascii_case("axpos")) {
        return true;
    }
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else {
        return false;
    };
    let glass = first.index.is_some_and(|n| n > 1.2);
    rows.len() > 1 && first.thickness == 0.0 && last.thickness != 0.0 && glass
}

fn lines(text: &str) -> Vec<Line<'_>> {
    let lines = many_till(line(text), eof).parse(text);
    lines.map_or(Vec::new(), |(_, (lines, _))| lines)
}

/// A parser of a line: cells between blanks, a comment, and the end of the line, each of which may
/// be missing. `text` is the whole file, in which the cells have their places.
fn line<'a>(text: &'a str) -> impl Parser<&'a str, Output = Line<'a>, Error = Failure<'a>> {
    let blank = || take_while(|c| is_blank(c) && !is_line_end(c));
    let cell = take_till1(|c| is_blank(c) || c == '#').map(|cell: &'a str| Cell {
        word: Word::at(text, cell, 0),
        number: cell.parse().ok(),
    });
    let cells = terminated(many0(preceded(blank(), cell)), blank());
    let comment = preceded(char('#'), take_till(is_line_end));
    (consumed(cells), opt(comment), opt(one_of("\r\n"))).map(|((data, cells), comment, _)| Line {
        data,
        cells,
        comment: comment.unwrap_or("").trim(),
    })
}

fn is_blank(c: char) -> bool {
    c.is_whitespace() || c == ','
}

fn is_line_end(c: char) -> bool {
    matches!(c, '\r' | '\n')
}

/// Makes a row of the cells of a line. `before` is the refractive index in front of it, and `abbe`
/// the column of the Abbe number.
fn row(
    source: &Arc<Source>,
    mut cells: Vec<Cell<'_>>,
    before: f64,
    abbe: Option<usize>,
) -> Result<Row> {
    let fail = |span, message: String| Diagnostic::error(message).at(source, span);
    let mut values = Vec::with_capacity(4);
    for Cell { word, number } in &cells {
        match number {
            Some(value) if value.is_finite() => values.push(*value),
            Some(value) if value.is_infinite() && values.is_empty() => values.push(0.0),
            _ => {
                return Err(fail(word.span, format!("`{}` is not a number", word.text))
                    .with_help("a row is: radius, thickness, index, aperture diameter"));
            }
        }
    }
    let abbe = match abbe {
        Some(at) if values.len() == 5 => {
            cells.remove(at);
            Some(values.remove(at)).filter(|v| *v > 0.0)
        }
        _ => None,
    };
    let spans = |order: [usize; 4]| order.map(|i| cells[i].word.span);
    match values[..] {
        [radius, thickness, index, diameter] => Ok(Row {
            radius,
            thickness,
            // A stop with an index of 0 does not change the medium.
            index: (index != 0.0 || radius != 0.0).then_some(index),
            diameter,
            abbe,
            spans: spans([0, 1, 2, 3]),
        }),
        // The paper's stop has no radius, and the index of the medium before it.
        [thickness, index, diameter] if index == before => Ok(Row {
            radius: 0.0,
            thickness,
            index: None,
            diameter,
            abbe,
            spans: spans([0, 0, 1, 2]),
        }),
        // A stop with a radius of 0 and no index.
        [0.0, thickness, diameter] => Ok(Row {
            radius: 0.0,
            thickness,
            index: None,
            diameter,
            abbe,
            spans: spans([0, 1, 1, 2]),
        }),
        _ => {
            let last = cells.last().map_or(Span::at(0), |cell| cell.word.span);
            let (few, span) = if values.len() < 4 {
                ("too few", Span::at(last.end as usize))
            } else {
                ("too many", cells[4].word.span)
            };
            let message = format!("{few} numbers in this row: {} instead of 4", values.len());
            Err(fail(span, message)
                .with_help("a row is: radius, thickness, index, aperture diameter"))
        }
    }
}

fn build(source: &Source, rows: &[Row], notes: Vec<String>) -> Prescription {
    let mut medium = Medium::air();
    let mut surfaces = Vec::with_capacity(rows.len());
    for row in rows {
        let is_stop = row.index.is_none();
        if let Some(index) = row.index {
            medium = match row.abbe {
                Some(abbe) => Medium::from_abbe(index, abbe),
                None => Medium::constant(index),
            };
        }
        let surface = Surface::sphere(
            row.radius,
            row.thickness,
            medium.clone(),
            0.5 * row.diameter,
        );
        surfaces.push(Surface {
            is_stop,
            span: row.spans[0],
            ..surface
        });
    }
    let mut lens = Prescription {
        notes,
        ..Prescription::new(crate::prescription::formats::name_of(source), surfaces)
    };
    adopt_a_stop(&mut lens);
    lens
}

/// Marks a plane with the same medium on both sides as the stop, if the table has no stop and only
/// one such plane: such a plane can only limit the beam.
pub(super) fn adopt_a_stop(lens: &mut Prescription) {
    if lens.stop().is_some() {
        return;
    }
    let idle = |i: &usize| {
        let surface = &lens.surfaces[*i];
        surface.is_plane() && surface.medium == *lens.medium_before(*i)
    };
    let mut candidates = (0..lens.surfaces.len()).filter(idle);
    if let (Some(stop), None) = (candidates.next(), candidates.next()) {
        lens.surfaces[stop].is_stop = true;
    }
}

/// Warns if the last thickness, which is the distance to the film in a printed table, differs from
/// the back focal distance by more than 5% of the focal length: a row or a digit is then probably
/// missing, as in the table of the 1999 paper.
fn warn_if_a_row_is_lost(lens: &Prescription, rows: &[Row], sink: &mut Sink) {
    let indices = lens.indices(D_LINE);
    let Some(focal) = FirstOrder::of(lens, &indices, Plane::Y).focal else {
        return;
    };
    let Some(last) = rows.last() else { return };
    let (printed, efl, bfl) = (last.thickness, focal.efl, focal.bfl);
    if printed != 0.0 && (printed - bfl).abs() > 0.05 * efl.abs() {
        sink.warn(
            last.spans[Column::Thickness as usize],
            format!(
                "the last thickness is {printed}, but the rows above it focus {bfl:.3} behind \
                 the lens (focal length {efl:.2})"
            ),
        )
        .help("a row or a digit of the table may be lost; ivcam uses what the rows say");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> (Result<Prescription>, Sink) {
        let source = Arc::new(Source::new("a.dat", text.as_bytes().to_vec()));
        let mut sink = Sink::new();
        sink.set_source(Some(source.clone()));
        let result = read(&source, None, &mut sink);
        (result, sink)
    }

    fn place(error: &Diagnostic) -> (u32, u32) {
        error.location().1.unwrap()
    }

    #[test]
    fn a_stop_may_be_written_in_three_ways_and_keeps_its_medium() {
        for stop in ["0 1 0 8", "1 1.33 8", "0 1 8"] {
            let text = format!("# eye\nradius thick n ap\n10 2 1.33 9\n{stop}\n-10 20 1 9\n");
            let lens = parse(&text).0.unwrap();
            assert_eq!(lens.stop(), Some(1), "{stop}");
            assert_eq!(lens.surfaces[1].medium.n_d, 1.33);
            assert_eq!(lens.surfaces[1].thickness, 1.0);
            assert_eq!(lens.surfaces[1].semi_diameter, 4.0);
            assert_eq!(lens.notes, ["eye"]);
        }
    }

    #[test]
    fn a_comment_may_name_the_unit() {
        let lens = |unit: &str| parse(&format!("# units: {unit}\n5 0.3 1.5 2\n-5 0 1 2\n")).0;
        assert_eq!(lens("cm").unwrap().surfaces[0].thickness, 3.0);
        assert_eq!(lens("in").unwrap().surfaces[1].semi_diameter, 25.4);
        let error = lens("ells").unwrap_err();
        assert_eq!(
            (place(&error), &*error.message),
            ((1, 1), "`ells` is not a unit of length")
        );
    }

    #[test]
    fn the_older_order_gives_the_same_lens() {
        let now = "50 3 1.5 20\n0 2 0 8\n-50 0 1 20\n";
        let old = "50 0 1.5 20\n0 3 0 8\n-50 2 1 20\n";
        let gaps = |text: &str| -> Vec<f64> {
            parse(text)
                .0
                .unwrap()
                .surfaces
                .iter()
                .map(|s| s.thickness)
                .collect()
        };
        assert_eq!(gaps(old), gaps(now));
        assert_eq!(gaps(&format!("# radius axpos N ap\n{old}")), gaps(now));
        // A stop that touches the first surface does not make it an older file.
        assert_eq!(
            gaps("0 0 0 8\n50 3 1.5 20\n-50 90 1 20\n"),
            [0.0, 3.0, 90.0]
        );
    }

    #[test]
    fn a_fifth_column_that_is_announced_is_the_abbe_number() {
        let text = "# radius thickness n_d aperture V_d\n50 3 1.5168 20 64.17\n-50 0 1 20\n";
        let lens = parse(text).0.unwrap();
        assert!((lens.surfaces[0].medium.abbe().unwrap() - 64.17).abs() < 1e-9);
        assert!(!lens.surfaces[1].medium.is_dispersive());
    }

    #[test]
    fn the_abbe_number_may_stand_before_the_aperture() {
        let lens = parse(
            "# radius thickness ior v-no aperture\n50 3 1.5168 64.17 20\n0 1 0 0 8\n-50 0 1 0 20\n",
        );
        let lens = lens.0.unwrap();
        assert!((lens.surfaces[0].medium.abbe().unwrap() - 64.17).abs() < 1e-9);
        let halves: Vec<f64> = lens.surfaces.iter().map(|s| s.semi_diameter).collect();
        assert_eq!(halves, [10.0, 4.0, 10.0]);
    }

    #[test]
    fn radius_0_with_an_index_is_a_plane() {
        let lens = parse("0 5 1.5 20\n0 1 0 8\n-50 0 1 20\n").0.unwrap();
        assert!(lens.surfaces[0].is_plane() && !lens.surfaces[0].is_stop);
        assert_eq!(lens.stop(), Some(1));
    }

    #[test]
    fn a_bad_row_is_named_by_line_and_column() {
        for (text, at, says) in [
            ("", (1, 1), "no surfaces"),
            ("10 2 1.5 9\n20 3 1.5\n", (2, 9), "too few"),
            ("10 2 1.5 9 7\n", (1, 12), "too many"),
            ("10 2 1.5 9\n10 2 x 9\n", (2, 6), "`x` is not a number"),
            ("10 2 NaN 9\n", (1, 6), "not a number"),
            ("10 2 1.5 -9\n", (1, 10), "not greater than 0"),
            ("10 1.5 0.9 9\n", (1, 8), "less than 1"),
            ("10 2 1.5 9\n0 1 0 5\n0 1 0 5\n", (3, 1), "second stop"),
            ("0 1 0 5\n", (1, 1), "nothing else"),
            (
                "10 -2 1.5 9\n0 1 0 5\n-10 0 1 9\n20 0 1 5",
                (1, 4),
                "backwards through glass",
            ),
        ] {
            let error = parse(text).0.unwrap_err();
            assert!(error.message.contains(says), "{text}: {}", error.message);
            assert_eq!(place(&error), at, "{text}");
        }
    }

    #[test]
    fn an_aperture_wider_than_its_sphere_is_clamped_with_a_warning() {
        let (lens, sink) = parse("10 2 1.5 30\n0 1 0 5\n-10 0 1 9\n");
        assert_eq!(lens.unwrap().surfaces[0].semi_diameter, 10.0);
        assert!(sink.items()[0].message.contains("more than its radius"));
    }

    /// The last thickness of a singlet of 100 mm, right and wrong.
    #[test]
    fn a_last_thickness_that_is_not_the_back_focus_is_warned_of() {
        let table = |last: f64| format!("50 0.001 1.5 10\n0 {last} 1 10\n");
        assert!(
            !parse(&table(100.0))
                .1
                .items()
                .iter()
                .any(|d| d.message.contains("focus"))
        );
        assert!(
            parse(&table(60.0))
                .1
                .items()
                .iter()
                .any(|d| d.message.contains("focus"))
        );
    }
}
