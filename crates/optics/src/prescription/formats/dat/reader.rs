//! Reads the rows of a table and makes the lens of them.

use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result, Sink, Source, Span};
use ivcam_base::math::LengthUnit;

use crate::prescription::about::About;
use crate::prescription::first_order::FirstOrder;
use crate::prescription::formats::dat::columns::{self, Column, FOUR, Heading};
use crate::prescription::formats::dat::gap::{self, Candidate, Stated};
use crate::prescription::formats::dat::lines::{Cell, lines};
use crate::prescription::formats::format::{Format, Gap};
use crate::prescription::formats::name_of;
use crate::prescription::glass::{D_LINE, Medium};
use crate::prescription::prescription::{self, Prescription, check, check_count};
use crate::prescription::surface::{Plane, Surface};

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
    diameter: f64,
    abbe: Option<f64>,
    spans: [Span; 4],
}

/// The four columns of the paper and of pbrt, and those of ISET, which have a focal length above
/// them. A file in no other format is read as this.
pub(crate) static FORMAT: Format = Format {
    name: "four columns",
    recognizes: |_| true,
    read: |source, how, sink| read(source, how.gap, sink),
};

/// Reads a table. Without a meaning of the second column it is decided by evidence.
///
/// # Errors
///
/// Returns an error if a row does not consist of numbers, if a number is out of range, or if there
/// is no surface.
pub(super) fn read(
    source: &Arc<Source>,
    forced: Option<Gap>,
    sink: &mut Sink,
) -> Result<Prescription> {
    let text = String::from_utf8_lossy(&source.bytes);
    let Table {
        notes,
        heading,
        rows,
    } = table(&text);
    check_count(rows.len(), source)?;
    let rows = parsed_rows(source, &rows, heading.as_ref())?;
    let unit = unit(&text, source)?;
    let column: Vec<f64> = rows.iter().map(|row| row.gap).collect();
    let make = |gap| Candidate {
        gap,
        lens: build(
            source,
            &rows,
            &gap::thicknesses(&column, gap),
            notes.clone(),
        ),
    };
    let place = rows.first().map_or(Span::at(0), |row| row.spans[1]);
    let taken = match (forced, &rows[..]) {
        (Some(gap), _) => make(gap),
        (None, []) => make(Gap::Next),
        (None, _) => {
            let stated = Stated {
                heading: heading.as_ref().and_then(|h| h.gap),
                focal_length: stated_focal_length(&notes).map(|f| f / unit),
            };
            let candidates = gap::possible(&column).into_iter().map(make).collect();
            let decision = gap::decide(candidates, &column, stated);
            report(&decision, stated, place, unit, sink);
            decision.taken
        }
    };
    let Candidate { gap, mut lens } = taken;
    lens.image_height = About::of(&lens).image_height;
    if !heading.as_ref().is_some_and(|h| h.diameters_are_certain) {
        double_semi_diameters(&mut lens, rows.first().map(|row| row.spans[3]), sink);
    }
    check(&mut lens, source, sink, |surface, column| {
        rows.get(surface)
            .map_or(Span::at(0), |row| row.spans[column as usize])
    })?;
    if gap == Gap::Next {
        warn_if_a_row_is_lost(&lens, &rows, sink);
    }
    Ok(if unit == 1.0 { lens } else { lens.scaled(unit) })
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
    let efl = |lens: &Prescription| {
        let optics = FirstOrder::of(lens, &lens.indices(D_LINE), Plane::Y);
        match optics.focal {
            Some(focal) => format!("focal length {:.2} mm", focal.efl * unit),
            None => "afocal".to_owned(),
        }
    };
    if let Some(rival) = &decision.rival {
        let message = format!(
            "the second column is read as {} ({}); it may be {} ({})",
            gap.meaning(),
            efl(lens),
            rival.gap.meaning(),
            efl(&rival.lens)
        );
        sink.warn(place, message).help(format!(
            "`--gap {}` or `--gap {}` decides",
            gap.name(),
            rival.gap.name()
        ));
    } else if *gap != Gap::Next {
        let note = format!("the second column is read as {}", gap.meaning());
        sink.note(place, note);
    } else if stated.heading.is_some_and(|heading| heading != *gap) {
        let note = format!(
            "the second column is read as {}, against its heading: so the surfaces fit",
            gap.meaning()
        );
        sink.note(place, note);
    }
}

/// Takes apertures for semi-diameters if the file states an f-number and they would otherwise give
/// one that is twice as large.
fn double_semi_diameters(lens: &mut Prescription, place: Option<Span>, sink: &mut Sink) {
    let Some(stated) = stated_f_number(&lens.notes) else {
        return;
    };
    let indices = lens.indices(D_LINE);
    let Some(found) = FirstOrder::of(lens, &indices, Plane::Y).f_number() else {
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
    source: &Arc<Source>,
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
        let row = row(source, cells, before, columns)?;
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

/// Makes a row of the cells of a line. `before` is the refractive index in front of it.
fn row(source: &Arc<Source>, cells: &[Cell<'_>], before: f64, columns: &[Column]) -> Result<Row> {
    let mut values: Vec<(f64, Span)> = Vec::with_capacity(4);
    let (mut abbe, mut half) = (None, 1.0);
    let in_order = cells.len() == columns.len();
    for (i, cell) in cells.iter().enumerate() {
        let column = if in_order { columns[i] } else { Column::Radius };
        if in_order && column == Column::Ignored {
            continue;
        }
        let value = match cell.number {
            Some(value) if value.is_finite() => value,
            Some(value) if value.is_infinite() && i == 0 => 0.0,
            None if cell.word.is("air") && column == Column::Index => 1.0,
            _ => {
                let message = format!("`{}` is not a number", cell.word.text);
                return Err(Diagnostic::error(message)
                    .at(source, cell.word.span)
                    .with_help(ROW));
            }
        };
        match column {
            Column::Abbe if in_order => abbe = Some(value).filter(|v| *v > 0.0),
            _ => values.push((value, cell.word.span)),
        }
        if column == Column::SemiDiameter {
            half = 2.0;
        }
    }
    let made = |at: [usize; 4], gap: f64, radius: f64, index: Option<f64>, diameter: f64| Row {
        radius,
        gap,
        index,
        diameter: half * diameter,
        abbe,
        spans: at.map(|i| values[i].1),
    };
    if in_order && values.len() == 4 {
        let at = |kinds: &[Column]| {
            let kept = columns
                .iter()
                .filter(|c| !matches!(c, Column::Ignored | Column::Abbe));
            kept.into_iter().position(|c| kinds.contains(c))
        };
        let places = [
            at(&[Column::Radius]),
            at(&[Column::Gap]),
            at(&[Column::Index]),
            at(&[Column::Diameter, Column::SemiDiameter]),
        ];
        if let [Some(r), Some(t), Some(n), Some(d)] = places {
            let [radius, gap, index, diameter] = [r, t, n, d].map(|i| values[i].0);
            // A stop with an index of 0 does not change the medium.
            let index = (index != 0.0 || radius != 0.0).then_some(index);
            return Ok(made([r, t, n, d], gap, radius, index, diameter));
        }
    }
    match values.iter().map(|(v, _)| *v).collect::<Vec<f64>>()[..] {
        // The paper's stop has no radius, and the index of the medium before it.
        [gap, index, diameter] if index == before => {
            Ok(made([0, 0, 1, 2], gap, 0.0, None, diameter))
        }
        // A stop with a radius of 0 and no index.
        [0.0, gap, diameter] => Ok(made([0, 1, 1, 2], gap, 0.0, None, diameter)),
        _ => Err(wrong_count(source, &values)),
    }
}

fn wrong_count(source: &Arc<Source>, values: &[(f64, Span)]) -> Box<Diagnostic> {
    let last = values.last().map_or(Span::at(0), |(_, span)| *span);
    let (few, span) = if values.len() < 4 {
        ("too few", Span::at(last.end as usize))
    } else {
        ("too many", values.get(4).map_or(last, |(_, span)| *span))
    };
    let message = format!("{few} numbers in this row: {} instead of 4", values.len());
    Diagnostic::error(message)
        .at(source, span)
        .with_help(format!(
            "{ROW}; a heading may name more, such as `# radius thickness index abbe diameter`"
        ))
}

/// Makes the lens of the rows, with these thicknesses.
fn build(source: &Source, rows: &[Row], gaps: &[f64], notes: Vec<String>) -> Prescription {
    let mut medium = Medium::air();
    let mut surfaces = Vec::with_capacity(rows.len());
    for (row, gap) in rows.iter().zip(gaps) {
        let is_stop = row.index.is_none();
        if let Some(index) = row.index {
            medium = match row.abbe {
                Some(abbe) => Medium::from_abbe(index, abbe),
                None => Medium::constant(index),
            };
        }
        let surface = Surface::sphere(row.radius, *gap, medium.clone(), 0.5 * row.diameter);
        surfaces.push(Surface {
            is_stop,
            span: row.spans[0],
            ..surface
        });
    }
    let mut lens = Prescription {
        notes,
        ..Prescription::new(name_of(source), surfaces)
    };
    adopt_a_stop(&mut lens);
    lens
}

/// Marks a plane with the same medium on both sides as the stop, if the table has no stop and only
/// one such plane: such a plane can only limit the beam.
pub(in crate::prescription::formats) fn adopt_a_stop(lens: &mut Prescription) {
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
    let (printed, efl, bfl) = (last.gap, focal.efl, focal.bfl);
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
