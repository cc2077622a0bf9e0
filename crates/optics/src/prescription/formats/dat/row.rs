//! Makes a row of a table of the cells of a line.
//!
//! Cells may be missing where a printed table has blanks: the Abbe number of air and of a named
//! glass, the index of air behind a glass and of the stop, and conic constants and coefficients at
//! the end of a line. What could be missing in two ways is refused.

use ivcam_base::diag::{Diagnostic, Result, Span};

use crate::prescription::formats::dat::columns::{self, DatColumn, FOUR, TableHeading};
use crate::prescription::formats::dat::lines::Cell;
use crate::prescription::formats::reader::{PrescriptionReader, SurfaceSpans};
use crate::prescription::glass::Medium;
use crate::prescription::surface::Shape;

/// The help of a row that cannot be read.
const ROW: &str = "a row is: radius, thickness, index, aperture diameter";

/// A row of the table. A column that the file leaves empty is `None`.
#[derive(Default)]
pub(super) struct LensRow {
    pub(super) radius: f64,
    pub(super) gap: f64,
    pub(super) index: Option<f64>,
    /// The glass that the file names in place of its index.
    pub(super) glass: Option<Medium>,
    /// Infinite if the file gives none.
    pub(super) diameter: f64,
    /// The diameter that is closed in the middle.
    pub(super) obstruction: f64,
    pub(super) is_mirror: bool,
    /// Whether a word marks the row as the stop. A row without an index is one too.
    pub(super) is_marked: bool,
    pub(super) abbe: Option<f64>,
    /// The conic constant.
    pub(super) conic: f64,
    /// Powers of the height with their coefficients.
    pub(super) terms: Vec<(usize, f64)>,
    pub(super) spans: SurfaceSpans,
}

impl LensRow {
    /// The shape of the surface.
    pub(super) fn shape(&self) -> Shape {
        let conic = Shape::Sphere.with_conic(self.conic);
        let terms = self.terms.iter();
        terms.fold(conic, |shape, &(power, value)| {
            shape.with_term(power, value)
        })
    }
}

/// The columns of a table, and what reads a line of it.
pub(super) struct RowReader<'a, 'h> {
    pub(super) file: PrescriptionReader<'a>,
    /// The heading that names the columns.
    pub(super) heading: Option<&'h TableHeading>,
    pub(super) columns: &'h [DatColumn],
    /// The refractive index in front of the row, which a mirror keeps.
    pub(super) before: f64,
}

/// Makes rows of the cells of all lines.
pub(super) fn parsed_rows(
    file: PrescriptionReader<'_>,
    lines: &[Vec<Cell<'_>>],
    heading: Option<&TableHeading>,
) -> Result<Vec<LensRow>> {
    let heading = heading.filter(|h| h.columns.len() >= 3);
    let by_value = columns::order_of_five(lines);
    if let (Some(heading), Some(first)) = (heading, lines.first()) {
        check_heading(file, heading, first)?;
    }
    let mut rows: Vec<LensRow> = Vec::with_capacity(lines.len());
    let mut before = 1.0;
    for cells in lines {
        let unnamed = by_value.filter(|_| cells.len() >= 5).unwrap_or(&FOUR);
        let reader = RowReader {
            file,
            heading,
            columns: heading.map_or(unnamed, |h| &h.columns),
            before,
        };
        let row = reader.row(cells)?;
        before = row.index.unwrap_or(before);
        rows.push(row);
    }
    // zoic writes air as an index of 0, on curved surfaces too. A stop is then a plane in air.
    if rows.iter().any(|row| row.index == Some(0.0)) {
        rows.iter_mut().for_each(|row| {
            let air = row.index.is_none_or(|n| n == 0.0);
            row.index = if air { Some(1.0) } else { row.index };
        });
    }
    Ok(rows)
}

/// Refuses a heading that names a column twice, or no index.
fn check_heading(
    file: PrescriptionReader<'_>,
    heading: &TableHeading,
    row: &[Cell<'_>],
) -> Result<()> {
    let kind = |column: &DatColumn| match column.is_aperture() {
        true => DatColumn::Diameter,
        false => *column,
    };
    let kinds: Vec<DatColumn> = heading.columns.iter().map(kind).collect();
    let repeats = |&i: &usize| {
        let counts = !matches!(kinds[i], DatColumn::Ignored | DatColumn::Unknown);
        counts && kinds[..i].contains(&kinds[i])
    };
    let span = row.first().map_or(Span::at(0), |cell| cell.word.span);
    let read = format!("it is read as {}", columns::names(&heading.columns));
    if let Some(twice) = (0..kinds.len()).find(repeats) {
        let message = format!(
            "the heading names the column of `{}` twice: {}",
            heading.words[twice],
            kinds[twice].name()
        );
        let help = format!("{read}; `diameter` and `semi-diameter` are apertures");
        return Err(file.refuse(span, message, help));
    }
    let is_known = !kinds.contains(&DatColumn::Unknown);
    if is_known && !kinds.contains(&DatColumn::Index) && heading.columns.len() == row.len() {
        let message = "the heading names no column of indices or glasses";
        let help = format!("{read}; `# radius thickness index diameter` names four");
        return Err(file.refuse(span, message, help));
    }
    Ok(())
}

/// Whether a word marks the stop.
fn is_stop(cell: &Cell<'_>) -> bool {
    let word = cell
        .word
        .text
        .trim_matches(|c: char| !c.is_ascii_alphabetic());
    ["stop", "sto", "diaphragm", "iris"]
        .iter()
        .any(|name| word.eq_ignore_ascii_case(name))
}

/// Whether a cell is one of those that stand for nothing, such as `-`.
fn is_blank(cell: &Cell<'_>) -> bool {
    let is_dash = |c| {
        matches!(
            c,
            '-' | '\u{2010}'..='\u{2015}' | '\u{2212}' | '.' | '\u{2026}'
        )
    };
    cell.number.is_none() && cell.word.text.chars().all(is_dash)
}

fn is_air(cell: &Cell<'_>) -> bool {
    matches!(cell.number, Some(0.0 | 1.0)) || cell.word.is("air") || is_blank(cell)
}

/// The radius of a plane, if a word says so.
fn is_flat(cell: &Cell<'_>) -> bool {
    let names = ["\u{221e}", "plano", "plane", "flat", "infinite"];
    let text = cell.word.text.trim_start_matches(['+', '-', '\u{2212}']);
    let is_named = names.iter().any(|name| text.eq_ignore_ascii_case(name));
    is_named || is_blank(cell) || cell.number.is_some_and(f64::is_infinite)
}

impl RowReader<'_, '_> {
    /// Makes a row of the cells of a line.
    fn row(&self, cells: &[Cell<'_>]) -> Result<LensRow> {
        if let Some(stop) = self.short_stop(cells)? {
            return Ok(stop);
        }
        let mark = cells.iter().position(is_stop);
        let in_place = self.assigned(cells, mark)?;
        let found = match (in_place, mark) {
            (Some(columns), _) => Some((cells.to_vec(), columns)),
            (None, Some(mark)) => {
                let mut others = cells.to_vec();
                others.remove(mark);
                let columns = self.assigned(&others, Some(usize::MAX))?;
                columns.map(|columns| (others, columns))
            }
            (None, None) => None,
        };
        let Some((cells, columns)) = found else {
            return Err(self.wrong_count(cells));
        };
        let mut row = LensRow {
            is_marked: mark.is_some(),
            diameter: f64::INFINITY,
            spans: [cells.first().map_or(Span::at(0), |cell| cell.word.span); 4],
            ..LensRow::default()
        };
        for (cell, column) in cells.iter().zip(columns) {
            self.read(&mut row, cell, column)?;
        }
        if row.index.is_none() && mark.is_none() {
            row.index = Some(1.0);
        }
        let is_stop = row.index == Some(0.0) && row.radius == 0.0;
        row.index = row.index.filter(|_| !is_stop);
        Ok(row)
    }

    /// The columns of the cells of a line: all, or those that are left without the ones that may be
    /// missing. None if their number fits none of these. `mark` is the cell that marks the stop.
    ///
    /// # Errors
    ///
    /// Cells that fit in two ways.
    fn assigned(&self, cells: &[Cell<'_>], mark: Option<usize>) -> Result<Option<Vec<DatColumn>>> {
        let optional = |c: &&DatColumn| matches!(c, DatColumn::Conic | DatColumn::Term(_));
        let trailing = self.columns.iter().rev().take_while(optional).count();
        let missing = |columns: &[DatColumn]| self.columns.len() - columns.len();
        let mut found: Vec<Vec<DatColumn>> = Vec::new();
        for [no_abbe, no_index] in [[false, false], [true, false], [false, true], [true, true]] {
            let is_kept = |c: &&DatColumn| match c {
                DatColumn::Abbe => !no_abbe,
                DatColumn::Index => !no_index,
                _ => true,
            };
            let columns: Vec<DatColumn> = self.columns.iter().filter(is_kept).copied().collect();
            let dropped = usize::from(no_abbe) + usize::from(no_index);
            let at_end = columns.len().checked_sub(cells.len());
            if missing(&columns) != dropped || at_end.is_none_or(|count| count > trailing) {
                continue;
            }
            let columns = columns[..cells.len()].to_vec();
            let index = columns.iter().position(|c| *c == DatColumn::Index);
            let needs_abbe = |i: usize| cells[i].number.is_some() && !is_air(&cells[i]);
            // A surface between air and air is none.
            let is_air_behind_glass = || {
                let blank = no_abbe || !self.columns.contains(&DatColumn::Abbe);
                blank && found.is_empty() && self.heading.is_some() && self.before != 1.0
            };
            let is_possible = match (no_abbe, no_index) {
                (_, true) => mark.is_some() || is_air_behind_glass(),
                (true, false) => index.is_some_and(|i| !needs_abbe(i)),
                (false, false) => true,
            };
            let fits = |mark: usize| {
                use DatColumn::{Abbe, Ignored, Index, Radius, Unknown};
                columns.get(mark).is_none_or(|column| match column {
                    Abbe => !no_index,
                    column => matches!(column, Radius | Index | Ignored | Unknown),
                })
            };
            if is_possible && mark.is_none_or(fits) {
                found.push(columns);
            }
        }
        if found.len() > 1 {
            let message = "this row may lack one cell or another";
            let help = format!(
                "write `-` for a cell without a value; the columns are read as {}",
                columns::names(self.columns)
            );
            return Err(self.file.refuse(self.end(cells), message, help));
        }
        Ok(found.pop())
    }

    /// Reads a cell of a column.
    fn read(&self, row: &mut LensRow, cell: &Cell<'_>, column: DatColumn) -> Result<()> {
        let span = cell.word.span;
        match column {
            DatColumn::Radius => {
                let is_plane = is_flat(cell) || is_stop(cell);
                row.radius = if is_plane { 0.0 } else { self.number(cell)? };
                row.spans[0] = span;
            }
            DatColumn::Gap => {
                row.gap = self.number(cell)?;
                row.spans[1] = span;
            }
            DatColumn::Index => {
                self.index(row, cell)?;
                row.spans[2] = span;
            }
            DatColumn::Abbe if is_blank(cell) || is_stop(cell) || cell.word.is("air") => {}
            DatColumn::Abbe => row.abbe = Some(self.number(cell)?).filter(|abbe| *abbe > 0.0),
            DatColumn::Diameter | DatColumn::SemiDiameter => {
                if !is_blank(cell) {
                    let half = column == DatColumn::SemiDiameter;
                    row.diameter = self.number(cell)? * if half { 2.0 } else { 1.0 };
                }
                row.spans[3] = span;
            }
            DatColumn::Obstruction | DatColumn::Conic | DatColumn::Term(_) if is_blank(cell) => {}
            DatColumn::Obstruction => row.obstruction = self.number(cell)?,
            DatColumn::Conic => row.conic = self.number(cell)?,
            DatColumn::Term(power) => match self.number(cell)? {
                0.0 => {}
                value => row.terms.push((power, value)),
            },
            DatColumn::Unknown if cell.number.is_some() => return Err(self.unknown(span)),
            DatColumn::Glass | DatColumn::Ignored | DatColumn::Unknown => {}
        }
        Ok(())
    }

    fn index(&self, row: &mut LensRow, cell: &Cell<'_>) -> Result<()> {
        row.is_mirror = cell.word.is("mirror");
        row.index = match cell.number {
            Some(_) => Some(self.number(cell)?),
            None if row.is_mirror => Some(self.before),
            None if is_stop(cell) || (row.is_marked && is_blank(cell)) => None,
            None if is_air(cell) => Some(1.0),
            None => {
                let glass = self.file.glass(cell.word.text, cell.word.span)?;
                Some(row.glass.insert(glass).n_d)
            }
        };
        Ok(())
    }

    fn number(&self, cell: &Cell<'_>) -> Result<f64> {
        match cell.number.filter(|number| number.is_finite()) {
            Some(number) => Ok(number),
            None => {
                let message = format!("`{}` is not a number", cell.word.text);
                Err(self.file.refuse(cell.word.span, message, self.help()))
            }
        }
    }

    /// A stop of three numbers, which has no radius or no index: the paper's stop has the index of
    /// the medium before it. None for any other line.
    fn short_stop(&self, cells: &[Cell<'_>]) -> Result<Option<LensRow>> {
        let aperture = self.columns.iter().find(|c| c.is_aperture());
        let numbers: Option<Vec<f64>> = cells.iter().map(|cell| cell.number).collect();
        let at = match (numbers.as_deref(), aperture) {
            _ if self.columns.len() < 4 => return Ok(None),
            (Some([_, index, _]), Some(_)) if *index == self.before => [0, 0, 1, 2],
            (Some([0.0, _, _]), Some(_)) => [0, 1, 1, 2],
            _ => return Ok(None),
        };
        let [gap, aperture_value] = [1, 3].map(|i: usize| self.number(&cells[at[i]]));
        let half = aperture == Some(&DatColumn::SemiDiameter);
        Ok(Some(LensRow {
            gap: gap?,
            diameter: aperture_value? * if half { 2.0 } else { 1.0 },
            spans: at.map(|i| cells[i].word.span),
            ..LensRow::default()
        }))
    }

    /// The error for a number in a column that is not read.
    fn unknown(&self, span: Span) -> Box<Diagnostic> {
        let unknown = self.columns.iter().position(|c| *c == DatColumn::Unknown);
        let words = self.heading.zip(unknown).map(|(h, i)| h.words[i].as_str());
        let word = words.unwrap_or_default();
        let help = match word {
            "kappa" | "\u{3ba}" => {
                "it is k in some tables and 1 + k in others: name the column `conic` and give k, \
                 which is 0 for a sphere"
            }
            _ => {
                "radius, thickness, index or glass, abbe, diameter or semi-diameter, obstruction, \
                 conic and a4, a6, … are read; other surfaces need .zmx, .seq or ivcam's JSON"
            }
        };
        self.file
            .refuse(span, format!("the column `{word}` is not read"), help)
    }

    /// The end of the last cell.
    fn end(&self, cells: &[Cell<'_>]) -> Span {
        Span::at(cells.last().map_or(0, |cell| cell.word.span.end as usize))
    }

    fn help(&self) -> String {
        match self.heading {
            Some(heading) => {
                format!(
                    "the columns are read as {}",
                    columns::names(&heading.columns)
                )
            }
            None => ROW.to_owned(),
        }
    }

    fn wrong_count(&self, cells: &[Cell<'_>]) -> Box<Diagnostic> {
        let (found, wanted) = (cells.len(), self.columns.len());
        let few = if found < wanted { "few" } else { "many" };
        let span = match cells.get(wanted) {
            Some(cell) => cell.word.span,
            None => self.end(cells),
        };
        let message = format!("too {few} numbers in this row: {found} instead of {wanted}");
        let help = match self.heading {
            Some(_) => format!("{}; write `-` for a cell without a value", self.help()),
            None => format!(
                "{ROW}; a heading may name more, such as `# radius thickness index abbe diameter`"
            ),
        };
        self.file.refuse(span, message, help)
    }
}
