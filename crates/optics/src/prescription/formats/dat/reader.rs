//! Reads the rows of a table and makes the lens of them.

use ivcam_base::diag::{Result, Sink, Span};

use crate::prescription::about::{About, millimeters, stated_unit};
use crate::prescription::formats::apertures::{SystemData, fill, note_f_number};
use crate::prescription::formats::dat::columns::{self, TableHeading};
use crate::prescription::formats::dat::gap::{self, Candidate, Stated};
use crate::prescription::formats::dat::lines::{Cell, lines};
use crate::prescription::formats::dat::row::{LensRow, parsed_rows};
use crate::prescription::formats::format::PrescriptionFormat;
use crate::prescription::formats::reader::{Draft, PrescriptionReader};
use crate::prescription::formats::reading::Gap;
use crate::prescription::glass::{D_LINE, Medium};
use crate::prescription::prescription::{self, Prescription};
use crate::prescription::surface::Surface;

/// The lines of a table, sorted.
struct Table<'a> {
    notes: Vec<String>,
    heading: Option<TableHeading>,
    rows: Vec<Vec<Cell<'a>>>,
}

/// The four columns of the paper and of pbrt, and those of ISET, which have a focal length above
/// them. A file in no other format is read as this.
pub(crate) static FORMAT: PrescriptionFormat = PrescriptionFormat {
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
    let unit = unit(file, &notes)?;
    let beam = beam(file, &notes, &rows, unit)?;
    let stated = Stated {
        heading: heading.as_ref().and_then(|h| h.gap),
        focal_length: stated_focal_length(&notes).map(|(f, _)| f / unit),
    };
    let Candidate { gap, mut lens } = candidate(file, &rows, &notes, beam, stated, unit, sink);
    lens.image_height = beam.image_height;
    if !heading.is_some_and(|h| h.diameters_are_certain) {
        double_semi_diameters(&mut lens, rows.first().map(|row| row.spans[3]), sink);
    }
    warn_of_focal_length(file, &lens, unit, sink);
    note_f_number(&mut lens, beam, NOMINAL_F_NUMBER);
    let derived: Vec<usize> = (0..rows.len()).filter(|&i| is_open(&rows[i])).collect();
    if !derived.is_empty() {
        let message = "apertures that the table leaves out are those of its beam";
        sink.note(rows[derived[0]].spans[3], message);
    }
    let draft = Draft {
        lens,
        places: rows.iter().map(|row| row.spans).collect(),
        derived,
        ..file.draft(None)
    };
    let lens = file.finish(draft, sink)?;
    if gap == Gap::Next {
        warn_if_a_row_is_lost(&lens, &rows, sink);
    }
    Ok(if unit == 1.0 { lens } else { lens.scaled(unit) })
}

fn is_open(row: &LensRow) -> bool {
    row.diameter.is_infinite()
}

/// The beam that the comments state, which gives rows their apertures where they have none. Its
/// lengths are in the file's unit, of `unit` millimeters.
///
/// # Errors
///
/// Returns an error if a row needs the beam and the comments do not state it.
fn beam(
    file: PrescriptionReader<'_>,
    notes: &[String],
    rows: &[LensRow],
    unit: f64,
) -> Result<SystemData> {
    let about = About::of_notes(notes, unit);
    let f_number = stated_f_number(notes);
    let beam = SystemData {
        f_number: f_number.map(|(value, _)| value),
        stated: f_number.map(|(_, note)| file.find(note)),
        half_field: about.field_degrees.map(|field| 0.5 * field.abs()),
        image_height: about.image_height.map(|height| height / unit),
        ..SystemData::default()
    };
    let has_field = beam.half_field.is_some() || beam.image_height.is_some();
    match rows.iter().find(|row| is_open(row)) {
        Some(row) if beam.f_number.is_none() || !has_field => {
            let message = "this row has no aperture, and the table does not state its beam";
            let help = "a column `diameter` or `semi-diameter` has the apertures; without one, \
                        comments above the table state the beam: `# f-number: 2.8` and \
                        `# field: 40 degrees`, the whole angle";
            Err(file.refuse(row.spans[3], message, help))
        }
        _ => Ok(beam),
    }
}

/// The lens of the rows, with the meaning of the second column that the user gives or that the
/// evidence speaks for.
fn candidate(
    file: PrescriptionReader<'_>,
    rows: &[LensRow],
    notes: &[String],
    beam: SystemData,
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
        fill(&mut lens, beam);
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
    let mut above = "";
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
            cells => {
                if table.rows.is_empty() && table.heading.is_none() {
                    table.heading = columns::heading_above(above, cells.len());
                }
                table.rows.push(line.cells);
            }
        }
        above = line.comment;
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
    let Some((stated, _)) = stated_f_number(&lens.notes) else {
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

/// The focal length in millimeters that a comment states, and the comment: `focal length: 50 mm`,
/// `EFFECTIVE FOCAL LENGTH = 50`.
fn stated_focal_length(notes: &[String]) -> Option<(f64, &str)> {
    let stated = |note: &'_ String| {
        let text = note.to_ascii_lowercase();
        let (before, after) = text.split_once("focal length")?;
        let is_another =
            before.trim_end().ends_with("back") || before.trim_end().ends_with("front");
        // A mark that closes a quotation is no unit of feet or inches.
        let is_open = |mark: &char| before.matches(*mark).count() % 2 == 1;
        let open = ['\'', '"'].into_iter().find(is_open);
        let after = open.map_or(after, |mark| after.split(mark).next().unwrap_or(after));
        let at = after.find(|c: char| c.is_ascii_digit())?;
        // Of a zoom lens, `70-200 mm`, it is the shortest.
        millimeters(&after[at..], 1.0).filter(|f| *f > 0.0 && !is_another)
    };
    notes.iter().find_map(|note| Some((stated(note)?, &**note)))
}

/// The f-number that a comment states, and the comment: `f-number: 2.8`, or else `F/2.8` among
/// other words.
fn stated_f_number(notes: &[String]) -> Option<(f64, &str)> {
    let number = |text: &str| {
        let end = text
            .find(|c: char| !matches!(c, '0'..='9' | '.'))
            .unwrap_or(text.len());
        text[..end].parse::<f64>().ok().filter(|n| *n > 0.2)
    };
    let by_key = |note: &str| number(note.strip_prefix("f-number:")?.trim());
    let in_words = |note: &str| {
        let mut words = note.split_whitespace();
        words.find_map(|word| number(word.strip_prefix("f/")?))
    };
    let found = |stated: &dyn Fn(&str) -> Option<f64>| {
        let mut notes = notes.iter();
        notes.find_map(|note| Some((stated(&note.to_ascii_lowercase())?, &**note)))
    };
    found(&by_key).or_else(|| found(&in_words))
}

/// The relative difference from a stated focal length that counts as a contradiction. Nominal focal
/// lengths are rounded.
pub(in crate::prescription::formats) const NOMINAL_FOCAL_LENGTH: f64 = 0.02;

/// The relative difference from a stated f-number that counts as a contradiction: a nominal one is
/// rounded, and apertures are often some percent wider than the beam.
pub(in crate::prescription::formats) const NOMINAL_F_NUMBER: f64 = 0.1;

/// Warns of a stated focal length that is not that of the surfaces.
fn warn_of_focal_length(
    file: PrescriptionReader<'_>,
    lens: &Prescription,
    unit: f64,
    sink: &mut Sink,
) {
    let Some((stated, note)) = stated_focal_length(&lens.notes) else {
        return;
    };
    let Some(focal) = lens.first_order(D_LINE).focal else {
        return;
    };
    let found = focal.efl * unit;
    if (found.abs() / stated - 1.0).abs() > NOMINAL_FOCAL_LENGTH {
        let message =
            format!("the table states a focal length of {stated} mm, but its rows have {found:.2}");
        sink.warn(file.find(note), message)
            .help("is a digit of a radius, thickness or index wrong? ivcam uses what the rows say");
    }
}

/// The length in millimeters of the unit that the comments state.
fn unit(file: PrescriptionReader<'_>, notes: &[String]) -> Result<f64> {
    let stated = notes
        .iter()
        .find_map(|note| Some((note, stated_unit(note)?)));
    stated.map_or(Ok(1.0), |(note, name)| file.unit(&name, file.find(note)))
}

/// Whether a comment that names no known columns is a heading all the same.
fn is_heading(comment: &str) -> bool {
    let mut words = comment.split_whitespace();
    words
        .next()
        .is_some_and(|w| w.eq_ignore_ascii_case("radius"))
        && words.next().is_some()
}

/// Makes the lens of the rows, with these thicknesses.
fn build(file: PrescriptionReader<'_>, rows: &[LensRow], gaps: &[f64]) -> Prescription {
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
            shape: row.shape(),
            is_stop: row.is_marked || row.index.is_none(),
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
fn warn_if_a_row_is_lost(lens: &Prescription, rows: &[LensRow], sink: &mut Sink) {
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
