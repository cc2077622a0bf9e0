//! Reads the `.fx` files of crayg: sections of lines of words.
//!
//! `[Surfaces]`, or `[Elements]` in older files, has the radius (0 for a plane), the thickness, the
//! index (0 for the stop), the semi-diameter, the Abbe number, the material (UNKNOWN, AIR, or a
//! maker and a glass) and the geometry. `[Aspheric Coefficients]` has the number of a surface, from
//! 0, `k=` and the coefficients of r² to r¹⁴ as `a2=` to `a14=`. `[Variable Distances]` has
//! `Focal Length Samples:` and for a surface the thickness at each of them.

use ivcam_base::diag::{Result, Sink, Span};

use crate::prescription::formats::format::PrescriptionFormat;
use crate::prescription::formats::reader::{Draft, PrescriptionReader, SurfaceSpans};
use crate::prescription::glass::medium::Medium;
use crate::prescription::prescription::{Prescription, ZoomPosition};
use crate::prescription::surface::{Curvature, Shape, Surface};
use crate::prescription::text::{Word, lines, words};

/// crayg's files, recognized by the headings of their sections.
pub(crate) static FORMAT: PrescriptionFormat = PrescriptionFormat {
    name: "crayg",
    recognizes: |text| {
        let has = |heading: &str| {
            let mut lines = text.lines().map(str::trim);
            lines.any(|line| line.eq_ignore_ascii_case(heading))
        };
        has("[metadata]") && (has("[surfaces]") || has("[elements]"))
    },
    read,
};

/// How far the index of a named glass may be from the rounded one of its row. Rows have three
/// digits or more.
const ROUNDED: f64 = 6e-3;

/// The largest number of zoom positions.
const MAX_POSITIONS: usize = 100;

fn read(file: PrescriptionReader<'_>, sink: &mut Sink) -> Result<Prescription> {
    let mut draft = file.draft(None);
    let mut section = String::new();
    for (start, line) in lines(file.text()) {
        let data = line.split('#').next().unwrap_or("").trim_end();
        let words = words(data, start);
        let Some(first) = words.first() else { continue };
        if first.text.starts_with('[') {
            section = data.trim().to_ascii_lowercase();
            continue;
        }
        match section.as_str() {
            "[metadata]" => metadata(file, &mut draft, data),
            "[surfaces]" | "[elements]" if first.is("radius") => {}
            "[surfaces]" | "[elements]" => {
                file.check_count(draft.places.len() + 1)?;
                let (surface, places) = surface(file, &words, draft.medium(), sink)?;
                draft.push(surface, places);
            }
            "[aspheric coefficients]" => asphere(file, &mut draft, &words)?,
            "[variable distances]" => distances(file, &mut draft, &words)?,
            _ => {}
        }
    }
    let surfaces = &mut draft.lens.surfaces;
    // Some files mark the stop by nothing but a plane in air.
    if !surfaces.iter().any(|s| s.is_stop)
        && let Some(plane) = surfaces
            .iter_mut()
            .find(|s| s.is_plane() && s.medium.n_d == 1.0)
    {
        plane.is_stop = true;
    }
    file.finish(draft, sink)
}

/// Keeps a line of the metadata.
fn metadata(file: PrescriptionReader<'_>, draft: &mut Draft, line: &str) {
    let Some((key, value)) = line.split_once(':') else {
        return;
    };
    let (key, value) = (key.trim().to_ascii_lowercase(), value.trim());
    let note = match key.as_str() {
        "name" => {
            draft.lens.name = file.name(Some(value));
            return;
        }
        "focal length" => format!("focal length: {value} mm"),
        "patent" => format!("source: {value}"),
        "description" => value.to_owned(),
        _ => return,
    };
    if !value.is_empty() {
        draft.lens.notes.push(note);
    }
}

/// The surface of a row, and the places of its numbers.
fn surface(
    file: PrescriptionReader<'_>,
    row: &[Word<'_>],
    before: &Medium,
    sink: &mut Sink,
) -> Result<(Surface, SurfaceSpans)> {
    let [radius, thickness, index, semi_diameter, rest @ ..] = row else {
        let last = row.last().map_or(Span::at(0), |word| word.span);
        let message = format!("too few values in this row: {} instead of 7", row.len());
        let help =
            "a row is: radius, thickness, index, semi-diameter, Abbe number, material, geometry";
        return Err(file.refuse(Span::at(last.end as usize), message, help));
    };
    let n_d = file.number(*index)?;
    let curvature = Curvature::from_radius(file.number(*radius)?);
    let is_stop = n_d == 0.0 && curvature.is_plane();
    // The Abbe number of air may be missing.
    let abbe = rest.first().and_then(|word| word.text.parse::<f64>().ok());
    let medium = match is_stop {
        true => before.clone(),
        false => medium(file, (*index, n_d), abbe, rest.get(1), sink)?,
    };
    let shape = match rest.last() {
        Some(word) if word.is("CYLINDER_X") => Shape::CylinderX,
        Some(word) if word.is("CYLINDER_Y") => Shape::CylinderY,
        _ => Shape::Sphere,
    };
    let (thickness_value, radius_value) = (file.number(*thickness)?, file.number(*semi_diameter)?);
    let surface = Surface {
        shape,
        curvature,
        is_stop,
        span: radius.span,
        ..Surface::sphere(0.0, thickness_value, medium, radius_value)
    };
    let places = [radius, thickness, index, semi_diameter].map(|word| word.span);
    Ok((surface, places))
}

/// The medium of a row: the glass that it names, if its index is that of the row.
fn medium(
    file: PrescriptionReader<'_>,
    (place, n_d): (Word<'_>, f64),
    abbe: Option<f64>,
    named: Option<&Word<'_>>,
    sink: &mut Sink,
) -> Result<Medium> {
    let numbers = || Medium::from_index(n_d, abbe.filter(|v| *v > 0.0 && n_d > 1.0));
    let Some((_, name)) = named.and_then(|word| word.text.split_once('_')) else {
        return Ok(numbers());
    };
    match file.options.glasses.find(name) {
        Some(glass) if (glass.n_d - n_d).abs() < ROUNDED => Ok(glass.clone()),
        found => {
            let why = match found {
                Some(glass) => format!("has an n_d of {:.4}", glass.n_d),
                None => "is not in the table".to_owned(),
            };
            sink.warn(
                place.span,
                format!("the glass `{name}` {why}: the row's {n_d} is read"),
            )
            .help("more glasses: --glass-catalogue FILE.agf");
            Ok(numbers())
        }
    }
}

/// The surface with the number of a word such as `5:`.
fn number_of(file: PrescriptionReader<'_>, draft: &Draft, word: Word<'_>) -> Result<usize> {
    let number = word.text.trim_end_matches(':').parse::<usize>().ok();
    let known = number.filter(|number| *number < draft.places.len());
    known.ok_or_else(|| {
        let message = format!("there is no surface `{}`", word.text);
        file.refuse(word.span, message, "surfaces are counted from 0")
    })
}

/// `6: k=0 a4=1e-6 …`
fn asphere(file: PrescriptionReader<'_>, draft: &mut Draft, words: &[Word<'_>]) -> Result<()> {
    let number = number_of(file, draft, words[0])?;
    let (mut k, mut terms) = (0.0, Vec::new());
    for word in &words[1..] {
        let stated = word
            .text
            .split_once('=')
            .and_then(|(key, value)| Some((key.to_ascii_lowercase(), value.parse::<f64>().ok()?)));
        let power = |key: &str| key.strip_prefix('a')?.parse::<usize>().ok();
        match stated {
            Some((key, value)) if key == "k" => k = value,
            Some((key, value)) if power(&key).is_some() => {
                terms.push((power(&key).unwrap_or(0), value));
            }
            _ => {
                let message = format!("`{}` is no coefficient of an asphere", word.text);
                return Err(file.refuse(word.span, message, "they are k= and a2= to a14="));
            }
        }
    }
    let shape = Shape::from_terms(k, terms).map_err(|power| {
        file.fail(
            words[0].span,
            format!("the term r^{power} is of too high a power"),
        )
    })?;
    draft.lens.surfaces[number].shape = shape;
    Ok(())
}

/// `Focal Length Samples: 72 135` or `5: 8.78 26.15`.
fn distances(file: PrescriptionReader<'_>, draft: &mut Draft, words: &[Word<'_>]) -> Result<()> {
    if words[0].is("Focal") {
        let names = words.iter().skip(3).take(MAX_POSITIONS);
        draft.lens.zoom = names
            .map(|word| ZoomPosition {
                name: format!("{} mm", word.text),
                ..ZoomPosition::default()
            })
            .collect();
        return Ok(());
    }
    let number = number_of(file, draft, words[0])?;
    for (position, word) in draft.lens.zoom.iter_mut().zip(&words[1..]) {
        position.gaps.push((number, file.number(*word)?));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use ivcam_base::diag::Source;

    use super::*;

    const TEXT: &str = "[Metadata]\nName: invented # by nobody\nFocal Length: 50\n\n[Surfaces]\n\
        Radius Thickness IOR Housing-Radius Abbe-No Material Geometry\n\
        40 5 1.52 12 64.2 SCHOTT_N_BK7 ASPHERICAL\n-60 3 1 12 0 AIR SPHERICAL\n\
        0 2 0 8 0 AIR SPHERICAL\n70 4 1.7 10 50 SCHOTT_N_BK7 CYLINDER_Y\n0 41 1 10 0 AIR PLANAR\n\
        [Aspheric Coefficients]\n0: k=-1 a2=0 a4=1e-6\n[Variable Distances]\n\
        Focal Length Samples: 50 70\n1: 3 9\n";

    fn read_text(text: &str) -> (Result<Prescription>, Sink) {
        let mut sink = Sink::new();
        let source = Arc::new(Source::new("a.fx", text.as_bytes().to_vec()));
        (crate::prescription::formats::read(&source, &mut sink), sink)
    }

    #[test]
    fn every_section_is_read() {
        let (lens, sink) = read_text(TEXT);
        let lens = lens.unwrap();
        assert_eq!((lens.name.as_str(), lens.stop()), ("invented", Some(2)));
        assert_eq!(lens.surfaces[0].medium.name, "N-BK7");
        assert!(
            matches!(&lens.surfaces[0].shape, Shape::Asphere { k, terms } if *k == -1.0 && terms[4] == 1e-6)
        );
        assert_eq!(lens.surfaces[3].shape, Shape::CylinderY);
        assert_eq!(lens.at_zoom(1).unwrap().surfaces[1].thickness, 9.0);
        // The index of the row is not that of its glass.
        assert_eq!(lens.surfaces[3].medium.n_d, 1.7);
        let warned = |what: &str| sink.items().iter().any(|d| d.message.contains(what));
        assert!(warned("has an n_d of 1.5168"));
    }

    #[test]
    fn a_surface_that_is_not_there_and_a_word_that_is_no_number_are_named() {
        for (from, to, says, line) in [
            ("0: k=-1", "9: k=-1", "no surface `9:`", 13),
            ("a4=1e-6", "-3e-5", "`-3e-5` is no coefficient", 13),
            ("40 5 1.52", "40 d1 1.52", "`d1` is not a number", 7),
        ] {
            let error = read_text(&TEXT.replace(from, to)).0.unwrap_err();
            assert!(error.message.contains(says), "{error}");
            assert_eq!(error.location().1.unwrap().0, line, "{error}");
        }
    }
}
