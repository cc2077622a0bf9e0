//! Reads the `.fx` files of lensoptics: the radius, the thickness (or the three of a zoom with
//! slashes between them), the material, for a glass its index and Abbe number, and the
//! semi-diameter.
//!
//! The material is `air`, `iris`, or any word before an index. With `cx_` before it the surface is
//! a cylinder with power in x. Behind the semi-diameter may be `#!aspheric=k,A4,A6,A8,A10`.
//! Comments begin with `#` or `//`, and `#!scale 0.5` scales the rows below it.

use ivcam_base::diag::{Result, Sink, Span};

use crate::prescription::formats::format::PrescriptionFormat;
use crate::prescription::formats::reader::{Draft, PrescriptionReader};
use crate::prescription::glass::medium::Medium;
use crate::prescription::prescription::{Prescription, ZoomPosition};
use crate::prescription::surface::{Shape, Surface};
use crate::prescription::text::{Word, lines, words};

/// lensoptics' files, recognized by their rows: those of air have no index, and those of glass have
/// it behind a word.
pub(crate) static FORMAT: PrescriptionFormat = PrescriptionFormat {
    name: "lensoptics",
    recognizes: |text| {
        let has = |is_row: &dyn Fn(&[&str]) -> bool| {
            text.lines().any(|line| {
                let data = line.split("//").next().unwrap_or("");
                let data = data.split('#').next().unwrap_or("");
                is_row(&data.split_whitespace().collect::<Vec<&str>>())
            })
        };
        has(
            &|row| matches!(row, [r, gap, what, a] if is_row(r, gap) && is_open(what) && is_number(a)),
        ) && has(&|row| {
            matches!(row, [r, gap, glass, n, v, a, ..]
                    if is_row(r, gap) && !is_number(glass) && !is_open(glass)
                        && [n, v, a].into_iter().all(|word| is_number(word)))
        })
    },
    read,
};

fn is_number(word: &str) -> bool {
    word.parse::<f64>().is_ok()
}

/// Whether two words are a radius and one or several thicknesses.
fn is_row(radius: &str, gap: &str) -> bool {
    is_number(radius) && gap.split('/').all(is_number)
}

/// Whether a word stands for air or the stop.
fn is_open(word: &str) -> bool {
    ["air", "iris", "cx_air"].contains(&&*word.to_ascii_lowercase())
}

/// The names of the three positions of a zoom.
const POSITIONS: [&str; 3] = ["short", "middle", "long"];

fn read(file: PrescriptionReader<'_>, sink: &mut Sink) -> Result<Prescription> {
    let mut draft = file.draft(None);
    let mut scale = 1.0;
    for (start, line) in lines(file.text()) {
        if line.starts_with("#!scale") {
            if let Some(word) = words(line, start).get(1) {
                scale = file.number(*word)?;
            }
            continue;
        }
        let (data, comment) = match line.split_once('#') {
            Some((data, comment)) => (data, comment),
            None => (line, ""),
        };
        let data = data.split("//").next().unwrap_or("");
        let row = words(data, start);
        if row.is_empty() {
            let note = comment.trim().trim_start_matches('#').trim();
            draft
                .lens
                .notes
                .extend((!note.is_empty()).then(|| note.to_owned()));
            continue;
        }
        file.check_count(draft.places.len() + 1)?;
        surface(file, &mut draft, &row, scale)?;
        if let Some(list) = comment.strip_prefix("!aspheric=") {
            let place = Span::new(start, start + line.len());
            let surface = draft.lens.surfaces.len() - 1;
            draft.lens.surfaces[surface].shape = asphere(file, list, scale, place)?;
        }
    }
    // The comments of a column's names are no notes of the lens.
    draft.lens.notes.retain(|note| !note.contains("radius"));
    file.finish(draft, sink)
}

/// Adds the surface of a row.
fn surface(
    file: PrescriptionReader<'_>,
    draft: &mut Draft,
    row: &[Word<'_>],
    scale: f64,
) -> Result<()> {
    let [radius, gap, material, rest @ ..] = row else {
        return Err(too_few(file, row));
    };
    let lower = material.text.to_ascii_lowercase();
    let is_cylinder = lower.starts_with("cx_");
    let (medium, size) = match lower.trim_start_matches("cx_") {
        "air" => (Medium::air(), rest.first()),
        "iris" => (draft.medium().clone(), rest.first()),
        _ => {
            let [index, abbe, size, ..] = rest else {
                return Err(too_few(file, row));
            };
            let (n_d, abbe) = (file.number(*index)?, file.number(*abbe)?);
            // `abbe` stands for a glass without a name.
            let name = lower.trim_start_matches("cx_").trim_start_matches("abbe");
            let medium = Medium::from_index(n_d, Some(abbe)).named(name.to_ascii_uppercase());
            (medium, Some(size))
        }
    };
    let size = size.ok_or_else(|| too_few(file, row))?;
    let gaps: Vec<f64> = gap
        .text
        .split('/')
        .map(|text| file.number(Word { text, ..*gap }).map(|mm| scale * mm))
        .collect::<Result<_>>()?;
    let surface = Surface {
        shape: match is_cylinder {
            true => Shape::CylinderY,
            false => Shape::Sphere,
        },
        is_stop: lower == "iris",
        span: radius.span,
        ..Surface::sphere(
            scale * file.number(*radius)?,
            gaps[0],
            medium,
            scale * file.number(*size)?,
        )
    };
    if gaps.len() > 1 {
        let number = draft.places.len();
        let zoom = &mut draft.lens.zoom;
        let names = POSITIONS.iter().skip(zoom.len());
        zoom.extend(names.map(|name| ZoomPosition {
            name: (*name).to_owned(),
            ..ZoomPosition::default()
        }));
        for (position, gap) in zoom.iter_mut().zip(&gaps) {
            position.gaps.push((number, *gap));
        }
    }
    draft.push(surface, [radius, gap, material, size].map(|word| word.span));
    Ok(())
}

fn too_few(file: PrescriptionReader<'_>, row: &[Word<'_>]) -> Box<ivcam_base::diag::Diagnostic> {
    let last = row.last().map_or(Span::at(0), |word| word.span);
    let message = format!("too few values in this row: {}", row.len());
    let help = "a row is: radius, thickness, `air` or `iris`, semi-diameter; or radius, thickness, glass, \
                index, Abbe number, semi-diameter";
    file.refuse(Span::at(last.end as usize), message, help)
}

/// The conic constant and the coefficients of r⁴ to r¹⁰.
fn asphere(file: PrescriptionReader<'_>, list: &str, scale: f64, place: Span) -> Result<Shape> {
    let stated = list.split([',', ' ', '\t']).filter(|text| !text.is_empty());
    let numbers: Vec<f64> = stated
        .map(|text| file.number(Word { text, span: place }))
        .collect::<Result<_>>()?;
    let k = numbers.first().copied().unwrap_or(0.0);
    let terms = numbers.iter().skip(1).zip((4..).step_by(2));
    // A coefficient of r^p is of a length to the power 1 − p.
    let terms = terms.map(|(value, power)| (power, value / scale.powi(power as i32 - 1)));
    let shape = Shape::from_terms(k, terms);
    shape.map_err(|power| file.fail(place, format!("the term r^{power} is of too high a power")))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use ivcam_base::diag::Source;

    use super::*;
    use crate::prescription::surface::Curvature;

    fn read_text(text: &str) -> Result<Prescription> {
        let source = Arc::new(Source::new("a.fx", text.as_bytes().to_vec()));
        crate::prescription::formats::read(&source, &mut Sink::new())
    }

    #[test]
    fn every_kind_of_row_is_read() {
        let lens = read_text(
            "# own design\n#!scale 2\n30 3 abbe 1.6 60 9\t#!aspheric=-1,1e-5\n-45 0.5/4/8 air 9\n\
             100000 2 IRIS 5\n\n// between\n60 1.5 cx_BK7 1.517 64 7 // glued\n-60 21 cx_air 7\n",
        )
        .unwrap();
        assert_eq!(
            (lens.notes[0].as_str(), lens.stop()),
            ("own design", Some(2))
        );
        let numbers = |i: usize| {
            let s = &lens.surfaces[i];
            (s.curvature.radius(), s.thickness, s.semi_diameter)
        };
        assert_eq!(
            (numbers(0), numbers(1)),
            ((60.0, 6.0, 18.0), (-90.0, 1.0, 18.0))
        );
        // z in units of half the size: 2 a (r/2)^4.
        assert!(
            matches!(&lens.surfaces[0].shape, Shape::Asphere { k, terms } if *k == -1.0
                && (terms[4] - 1e-5 / 8.0).abs() < 1e-20)
        );
        assert_eq!(lens.at_zoom(2).unwrap().surfaces[1].thickness, 16.0);
        assert_eq!((lens.zoom.len(), lens.zoom[1].name.as_str()), (3, "middle"));
        assert_eq!(lens.surfaces[3].shape, Shape::CylinderY);
        assert_eq!(lens.surfaces[3].medium.name, "BK7");
        assert_eq!(lens.surfaces[3].curvature, Curvature::from_radius(120.0));
    }

    #[test]
    fn a_short_row_and_a_word_that_is_no_number_are_named() {
        for (row, says) in [
            ("30 3 abbe 1.6 60", "too few values"),
            ("30 3/x air 9", "`x` is not"),
        ] {
            let error =
                read_text(&format!("30 3 abbe 1.6 60 9\n{row}\n-30 20 air 9\n")).unwrap_err();
            assert!(error.message.contains(says), "{error}");
            assert_eq!(error.location().1.unwrap().0, 2, "{error}");
        }
    }
}
