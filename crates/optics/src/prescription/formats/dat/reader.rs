//! Reads the rows of a table and makes the lens of them.

use ivcam_base::diag::{Diagnostic, Result, Sink, Span};

use crate::prescription::about::About;
use crate::prescription::formats::dat::columns::{self, Column, FOUR, Heading};
use crate::prescription::formats::dat::gap::{self, Candidate, Stated};
use crate::prescription::formats::dat::lines::{Cell, lines};
use crate::prescription::formats::format::{Format, Gap};
use crate::prescription::formats::reader::{Draft, Places, PrescriptionReader};
use crate::prescription::glass::{D_LINE, Medium};
use crate::prescription::prescription::{self, Prescription};
use crate::prescription::surface::Surface;

/// The help of a row that cannot be read.
const ROW: &str = "a row is: radius, thickness, index, aperture diameter";

/// The lines of a table, sorted.
struct Table<'a> {
    notes: Vec<String>,
    heading: Option<Heading>,
    rows: Vec<Vec<Cell<'a>>>,
}

/// A row of the table. A column that the file leaves empty is `None`.
struct Row {
    radius: f64,
    gap: f64,
    index: Option<f64>,
    /// The glass that the file names in place of its index.
    glass: Option<Medium>,
    diameter: f64,
    /// The diameter that is closed in the middle.
    obstruction: f64,
    is_mirror: bool,
    abbe: Option<f64>,
    spans: Places,
}

/// The four columns of the paper and of pbrt, and those of ISET, which have a focal length above
/// them. A file in no other format is read as this.
pub(crate) static FORMAT: Format = Format {
    name: "four columns",
    recognizes: |_| true,
    read,
};

/// Reads a table. Without an option for the meaning of the second column it is decided by evidence.
///
/// # Errors
///
/// Returns an error if a row does not consist of numbers, if a number is out of range, or if there
/// is no surface.
pub(super) fn read(file: PrescriptionReader<'_>, sink: &mut Sink) -> Result<Prescription> {
    let Table {
        notes,
        heading,
        rows,
    } = table(file.text());
    file.check_count(rows.len())?;
    let rows = parsed_rows(file, &rows, heading.as_ref())?;
    let unit = unit(file)?;
    let stated = Stated {
        heading: heading.as_ref().and_then(|h| h.gap),
        focal_length: stated_focal_length(&notes).map(|f| f / unit),
    };
    let Candidate { gap, mut lens } = candidate(file, &rows, &notes, stated, unit, sink);
    lens.image_height = About::of(&lens).image_height;
    if !heading.is_some_and(|h| h.diameters_are_certain) {
        double_semi_diameters(&mut lens, rows.first().map(|row| row.spans[3]), sink);
    }
    let draft = Draft {
        lens,
        places: rows.iter().map(|row| row.spans).collect(),
        ..file.draft(None)
    };
    let lens = file.finish(draft, sink)?;
    if gap == Gap::Next {
        warn_if_a_row_is_lost(&lens, &rows, sink);
    }
    Ok(if unit == 1.0 { lens } else { lens.scaled(unit) })
}

/// The lens of the rows, with the meaning of the second column that the user gives or that the
/// evidence speaks for.
fn candidate(
    file: PrescriptionReader<'_>,
    rows: &[Row],
    notes: &[String],
    stated: Stated,
    unit: f64,
    sink: &mut Sink,
) -> Candidate {
    let column: Vec<f64> = rows.iter().map(|row| row.gap).collect();
    let make = |gap| {
        let mut lens = build(file, rows, &gap::thicknesses(&column, gap));
        if lens.has_mirrors() {
            lens = lens.folded();
        }
        lens.notes = notes.to_vec();
        Candidate { gap, lens }
    };
    match (file.options.gap, rows) {
        (Some(gap), _) => make(gap),
        (None, []) => make(Gap::Next),
        // Evidence is of gaps that are positive.
        (None, rows) if rows.iter().any(|row| row.is_mirror) => make(Gap::Next),
        (None, [first, ..]) => {
            let candidates = gap::possible(&column).into_iter().map(make).collect();
            let decision = gap::decide(candidates, &column, stated);
            report(&decision, stated, first.spans[1], unit, sink);
            decision.taken
        }
    }
}

/// Divides the lines of a text into comments, a heading and rows.
fn table(text: &str) -> Table<'_> {
    let mut table = Table {
        notes: Vec::new(),
        heading: None,
        rows: Vec::new(),
    };
    for line in lines(text) {
        match columns::heading(line.comment) {
            Some(heading) => table.heading = Some(heading),
            None if line.comment.is_empty() || is_heading(line.comment) => {}
            None => table.notes.push(line.comment.to_owned()),
        }
        let numbers = line.cells.iter().filter(|c| c.number.is_some()).count();
        match &line.cells[..] {
            [] => {}
            _ if numbers == 0 && table.rows.is_empty() => {
                table.heading = columns::heading(line.data).or(table.heading);
            }
            [cell] if numbers == 1 && table.rows.is_empty() => {
                let note = format!("focal length as listed: {}", cell.word.text);
                table.notes.push(note);
            }
            _ => table.rows.push(line.cells),
        }
    }
    table
}

/// Reports the decision: that the column is not the usual one, and what else it may mean.
fn report(decision: &gap::Decision, stated: Stated, place: Span, unit: f64, sink: &mut Sink) {
    let Candidate { gap, lens } = &decision.taken;
    let read = format!("the second column is read as {}", gap.meaning());
    if let Some(rival) = &decision.rival {
        let efl = |lens: &Prescription| match lens.first_order(D_LINE).focal {
            Some(focal) => format!("focal length {:.2} mm", focal.efl * unit),
            None => "afocal".to_owned(),
        };
        let other = format!("it may be {} ({})", rival.gap.meaning(), efl(&rival.lens));
        let help = format!(
            "`--gap {}` or `--gap {}` decides",
            gap.name(),
            rival.gap.name()
        );
        sink.warn(place, format!("{read} ({}); {other}", efl(lens)))
            .help(help);
    } else if *gap != Gap::Next {
        sink.note(place, read);
    } else if stated.heading.is_some_and(|heading| heading != *gap) {
        sink.note(
            place,
            format!("{read}, against its heading: so the surfaces fit"),
        );
    }
}

/// Takes apertures for semi-diameters if the file states an f-number and they would otherwise give
/// one that is twice as large.
fn double_semi_diameters(lens: &mut Prescription, place: Option<Span>, sink: &mut Sink) {
    let Some(stated) = stated_f_number(&lens.notes) else {
        return;
    };
    let Some(found) = lens.first_order(D_LINE).f_number() else {
        return;
    };
    // The largest aperture of a file with diameters gives the stated number within a tenth.
    if (1.7..=2.4).contains(&(found / stated)) {
        let message = format!(
            "the apertures are read as semi-diameters: the file states f/{stated}, and as \
             diameters they would give f/{found:.2}"
        );
        sink.warn(place.unwrap_or(Span::at(0)), message)
            .help("name the column `diameter` or `semi-diameter` above the table");
        for surface in &mut lens.surfaces {
            surface.semi_diameter *= 2.0;
        }
    }
}

/// The focal length that a comment states: `focal length: 50 mm`, `EFFECTIVE FOCAL LENGTH = 50`.
fn stated_focal_length(notes: &[String]) -> Option<f64> {
    let stated = |note: &String| {
        let note = note.to_ascii_lowercase();
        let (before, after) = note.split_once("focal length")?;
        let is_another =
            before.trim_end().ends_with("back") || before.trim_end().ends_with("front");
        let number = after
            .split(|c: char| !matches!(c, '0'..='9' | '.'))
            .find_map(|word| word.parse::<f64>().ok());
        number.filter(|f| *f > 0.0 && !is_another)
    };
    notes.iter().find_map(stated)
}

/// The f-number that a comment states: `f-number: 2.8`, or `F/2.8` among other words.
fn stated_f_number(notes: &[String]) -> Option<f64> {
    let number = |text: &str| {
        let end = text
            .find(|c: char| !matches!(c, '0'..='9' | '.'))
            .unwrap_or(text.len());
        text[..end].parse::<f64>().ok().filter(|n| *n > 0.2)
    };
    let stated = |note: &String| {
        let note = note.to_ascii_lowercase();
        let mut words = note.split_whitespace();
        let in_words = words.find_map(|word| number(word.strip_prefix("f/")?));
        in_words.or_else(|| number(note.strip_prefix("f-number:")?.trim()))
    };
    notes.iter().find_map(stated)
}

/// The length in millimeters of the unit that a comment such as `units: cm` names.
fn unit(file: PrescriptionReader<'_>) -> Result<f64> {
    let Some(at) = file.text().find("# units:") else {
        return Ok(1.0);
    };
    let stated = file.text()[at + 8..].lines().next().unwrap_or("");
    file.unit(stated.trim(), Span::new(at, at + 8 + stated.len()))
}

/// Whether a comment that names no known columns is a heading all the same.
fn is_heading(comment: &str) -> bool {
    let mut words = comment.split_whitespace();
    words
        .next()
        .is_some_and(|w| w.eq_ignore_ascii_case("radius"))
        && words.next().is_some()
}

/// Makes rows of the cells of all lines.
fn parsed_rows(
    file: PrescriptionReader<'_>,
    lines: &[Vec<Cell<'_>>],
    heading: Option<&Heading>,
) -> Result<Vec<Row>> {
    let named = heading.map_or(&[][..], |h| &h.columns);
    let by_value = columns::order_of_five(lines);
    let mut rows: Vec<Row> = Vec::with_capacity(lines.len());
    let mut before = 1.0;
    for cells in lines {
        let columns = match cells.len() {
            n if n == named.len() && n >= 4 => named,
            5 => by_value.unwrap_or(&FOUR),
            _ => &FOUR,
        };
        let row = row(file, cells, before, columns)?;
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

/// A number of a row, with the column that it is of.
struct Value {
    column: Column,
    number: f64,
    /// The glass whose index the number is.
    glass: Option<Medium>,
    span: Span,
    is_mirror: bool,
}

/// Makes a row of the cells of a line. `before` is the refractive index in front of it.
fn row(
    file: PrescriptionReader<'_>,
    cells: &[Cell<'_>],
    before: f64,
    columns: &[Column],
) -> Result<Row> {
    let mut values = values(file, cells, before, columns)?;
    let abbe = values.iter().rfind(|v| v.column == Column::Abbe);
    let abbe = abbe.map(|v| v.number).filter(|abbe| *abbe > 0.0);
    let obstruction = values.iter().find(|v| v.column == Column::Obstruction);
    let obstruction = obstruction.map_or(0.0, |v| v.number);
    values.retain(|v| !matches!(v.column, Column::Abbe | Column::Obstruction));
    let at = |columns: &[Column]| values.iter().position(|v| columns.contains(&v.column));
    let named = (
        at(&[Column::Radius]),
        at(&[Column::Gap]),
        at(&[Column::Index]),
        at(&[Column::Diameter, Column::SemiDiameter]),
    );
    let numbers: Vec<f64> = values.iter().map(|v| v.number).collect();
    // Which of the values are the radius, the gap, the index and the diameter.
    let (at, is_stop) = match (named, &numbers[..]) {
        // A stop with an index of 0 does not change the medium.
        ((Some(r), Some(t), Some(n), Some(d)), [_, _, _, _]) => {
            ([r, t, n, d], numbers[n] == 0.0 && numbers[r] == 0.0)
        }
        // The paper's stop has no radius, and the index of the medium before it.
        (_, [_, index, _]) if *index == before => ([0, 0, 1, 2], true),
        // A stop with a radius of 0 and no index.
        (_, [0.0, _, _]) => ([0, 1, 1, 2], true),
        _ => return Err(wrong_count(file, &values)),
    };
    let [radius, gap, index, aperture] = at.map(|i| values[i].number);
    let glass = values.iter().find_map(|v| v.glass.clone());
    let is_mirror = values.iter().any(|v| v.is_mirror);
    let is_half = values.iter().any(|v| v.column == Column::SemiDiameter);
    Ok(Row {
        radius: if is_stop { 0.0 } else { radius },
        gap,
        index: (!is_stop).then_some(index),
        glass,
        diameter: if is_half { 2.0 * aperture } else { aperture },
        obstruction,
        is_mirror,
        abbe,
        spans: at.map(|i| values[i].span),
    })
}

/// The numbers of a row. A row of another length than the columns is a stop without some of them:
/// its numbers count as radii. `before` is the index in front of it, which a mirror keeps.
fn values(
    file: PrescriptionReader<'_>,
    cells: &[Cell<'_>],
    before: f64,
    columns: &[Column],
) -> Result<Vec<Value>> {
    let in_order = cells.len() == columns.len();
    let mut values = Vec::with_capacity(cells.len());
    for (i, cell) in cells.iter().enumerate() {
        let column = if in_order { columns[i] } else { Column::Radius };
        let mut glass = None;
        let is_mirror = column == Column::Index && cell.word.is("mirror");
        let number = match cell.number {
            _ if column == Column::Ignored => continue,
            Some(number) if number.is_finite() => number,
            Some(number) if number.is_infinite() && i == 0 => 0.0,
            None if is_mirror => before,
            None if cell.word.is("air") && column == Column::Index => 1.0,
            None if column == Column::Index => {
                let named = file.glass(cell.word.text, cell.word.span)?;
                glass.insert(named).n_d
            }
            _ => {
                let message = format!("`{}` is not a number", cell.word.text);
                return Err(file.refuse(cell.word.span, message, ROW));
            }
        };
        values.push(Value {
            column,
            number,
            glass,
            span: cell.word.span,
            is_mirror,
        });
    }
    Ok(values)
}

fn wrong_count(file: PrescriptionReader<'_>, values: &[Value]) -> Box<Diagnostic> {
    let last = values.last().map_or(Span::at(0), |value| value.span);
    let (few, span) = match values.get(4) {
        Some(fifth) => ("too many", fifth.span),
        None if values.len() < 4 => ("too few", Span::at(last.end as usize)),
        None => ("too many", last),
    };
    let message = format!("{few} numbers in this row: {} instead of 4", values.len());
    file.refuse(
        span,
        message,
        format!("{ROW}; a heading may name more, such as `# radius thickness index abbe diameter`"),
    )
}

/// Makes the lens of the rows, with these thicknesses.
fn build(file: PrescriptionReader<'_>, rows: &[Row], gaps: &[f64]) -> Prescription {
    let mut draft = file.draft(None);
    for (row, gap) in rows.iter().zip(gaps) {
        let medium = match (&row.glass, row.index) {
            (Some(glass), _) => glass.clone(),
            (None, Some(index)) => Medium::from_index(index, row.abbe),
            (None, None) => draft.medium().clone(),
        };
        let surface = Surface::sphere(row.radius, *gap, medium, 0.5 * row.diameter);
        let surface = Surface {
            obstruction: 0.5 * row.obstruction,
            is_stop: row.index.is_none(),
            is_mirror: row.is_mirror,
            span: row.spans[0],
            ..surface
        };
        draft.push(surface, row.spans);
    }
    adopt_a_stop(&mut draft.lens);
    draft.lens
}

/// Marks a plane with the same medium on both sides as the stop, if the table has no stop and only
/// one such plane: such a plane can only limit the beam.
pub(in crate::prescription::formats) fn adopt_a_stop(lens: &mut Prescription) {
    if lens.stop().is_some() {
        return;
    }
    let idle = |i: &usize| {
        let surface = &lens.surfaces[*i];
        surface.is_idle(lens.medium_before(*i)) && surface.obstruction == 0.0
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
    let Some(focal) = lens.first_order(D_LINE).focal else {
        return;
    };
    let Some(last) = rows.last() else { return };
    let printed = match (lens.has_mirrors(), lens.surfaces.last()) {
        (true, Some(surface)) => surface.thickness,
        _ => last.gap,
    };
    let (efl, bfl) = (focal.efl, focal.bfl);
    if printed != 0.0 && (printed - bfl).abs() > 0.05 * efl.abs() {
        sink.warn(
            last.spans[prescription::Column::Thickness as usize],
            format!(
                "the last thickness is {printed}, but the rows above it focus {bfl:.3} behind \
                 the lens (focal length {efl:.2})"
            ),
        )
        .help("a row or a digit of the table may be lost; ivcam uses what the rows say");
    }
}
