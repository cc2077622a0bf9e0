//! The design data of a lens, from the `key: value` comments above the table of its file.
//!
//! ```text
//! # name: Double Gauss
//! # kind: normal
//! # year: 1950
//! # field: 44 degrees
//! # focal length: 100.7 mm
//! # nominal: 50 mm
//! # f-number: 2
//! # source: US 2,673,491 (A. W. Tronnier)
//! ```
//!
//! Lengths are in millimeters if they have no unit; the height of the image is then in the unit of
//! the file.

use ivcam_base::math::LengthUnit;

use crate::prescription::prescription::Prescription;

/// The keys that are read; the first is the title of the design.
pub(crate) const KEYS: [&str; 9] = [
    "name",
    "kind",
    "year",
    "field",
    "focal length",
    "nominal",
    "f-number",
    "image height",
    "source",
];

/// The design data of a lens. A field is none if the file does not state it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct About {
    /// The name of the design.
    pub title: Option<String>,
    /// The kind of the lens, such as `normal` or `wide-angle`.
    pub kind: Option<String>,
    /// The year of the design.
    pub year: Option<String>,
    /// The field as the file states it.
    pub field: Option<String>,
    /// The whole field angle in degrees; for a zoom lens, the widest.
    pub field_degrees: Option<f64>,
    /// The focal length as the file states it.
    pub focal_length: Option<String>,
    /// The focal length in millimeters; for a zoom lens, the shortest.
    pub focal_length_mm: Option<f64>,
    /// The focal length in millimeters of the lens that was made by the design, if the lengths of
    /// the file are those of another size.
    pub nominal_mm: Option<f64>,
    /// The f-number.
    pub f_number: Option<f64>,
    /// Half of the diagonal of the film, in millimeters.
    pub image_height: Option<f64>,
    /// The patent or book that the data come from.
    pub source: Option<String>,
    /// All other comments.
    pub notes: Vec<String>,
}

impl About {
    /// The design data in the comments of a prescription, and what its format states of the field.
    pub fn of(lens: &Prescription) -> Self {
        let mut about = Self::of_notes(&lens.notes, 1.0);
        about.image_height = lens.image_height.or(about.image_height);
        let by_format = lens.half_field.map(|half| 2.0 * half);
        about.field_degrees = about.field_degrees.or(by_format);
        about
    }

    /// The design data in comments of a file whose unit is `unit` millimeters.
    pub(crate) fn of_notes(notes: &[String], unit: f64) -> Self {
        let mut about = Self::default();
        for note in notes {
            let (key, value) = note.split_once(": ").unwrap_or(("", note));
            let text = Some(value.trim().to_owned());
            match key {
                "name" => about.title = text,
                "kind" => about.kind = text,
                "year" => about.year = text,
                "field" => (about.field, about.field_degrees) = (text, degrees(value)),
                "focal length" => {
                    (about.focal_length, about.focal_length_mm) = (text, millimeters(value, 1.0));
                }
                "nominal" => about.nominal_mm = millimeters(value, 1.0).filter(|f| *f > 0.0),
                "f-number" => about.f_number = number(value).map(|(number, _)| number),
                "image height" => {
                    about.image_height = millimeters(value, unit).filter(|h| *h > 0.0);
                }
                "source" => about.source = text,
                "note" => about.notes.push(value.to_owned()),
                _ => about.notes.push(note.clone()),
            }
        }
        about
    }
}

/// The finite number at the beginning of a text, and the text behind it, where its unit is.
fn number(text: &str) -> Option<(f64, &str)> {
    let text = text.trim_start();
    let is_digit = |c: char| c.is_ascii_digit() || matches!(c, '.' | '+' | '-' | 'e' | 'E');
    let most = text.find(|c| !is_digit(c)).unwrap_or(text.len());
    // Of `70-200` it is the first number, and of `5e` it is 5.
    let number = |end| Some((text[..end].parse::<f64>().ok()?, text[end..].trim_start()));
    (1..=most)
        .rev()
        .find_map(number)
        .filter(|(number, _)| number.is_finite())
}

/// The length in millimeters at the beginning of a text. Without a unit it is in `unit`.
pub(crate) fn millimeters(text: &str, unit: f64) -> Option<f64> {
    let (number, rest) = number(text)?;
    let mut words = rest.split_whitespace();
    let word = words
        .next()
        .unwrap_or("")
        .trim_end_matches([',', ';', '.', ')']);
    // `100 in the patent` is no number of inches.
    let is_unit = !word.eq_ignore_ascii_case("in") || words.next().is_none();
    let stated = LengthUnit::parse(&word.to_ascii_lowercase()).filter(|_| is_unit);
    Some(number * stated.map_or(unit, LengthUnit::millimeters))
}

/// The name of the unit that a comment such as `units: cm` or `Units in` states. It has to be that
/// of a unit, because the comment may be a sentence, except for the one word behind `units:`.
pub(crate) fn stated_unit(note: &str) -> Option<String> {
    let words = note.replace([':', '='], " : ");
    let words: Vec<&str> = words.split_whitespace().collect();
    let (key, name) = words.split_first()?;
    let key = ["units", "unit"]
        .into_iter()
        .find(|word| key.eq_ignore_ascii_case(word))?;
    let name = match name {
        [":", name @ ..] => name.join(" "),
        [name] => (*name).to_owned(),
        _ => return None,
    };
    let must_be_unit = key == "units" && note.contains(':') && !name.contains(' ');
    let is_unit = LengthUnit::parse(&name.to_ascii_lowercase()).is_some();
    (must_be_unit || is_unit).then_some(name)
}

/// The angle in degrees at the beginning of a text, which may be in radians.
fn degrees(text: &str) -> Option<f64> {
    let (number, rest) = number(text)?;
    let is_radians = rest.to_ascii_lowercase().starts_with("rad");
    Some(if is_radians {
        number.to_degrees()
    } else {
        number
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lens::{Lens, LensRay, Toward, shipped_names};
    use glam::DVec3;
    use ivcam_base::diag::{Diagnostic, Severity};

    fn shipped() -> Vec<(Lens, About)> {
        let open = |name| {
            let lens = Lens::named(name).unwrap_or_else(|e| panic!("{name}: {e}"));
            let about = About::of(lens.prescription());
            (lens, about)
        };
        shipped_names().map(open).collect()
    }

    #[test]
    fn every_shipped_lens_says_what_it_is_and_where_it_is_from() {
        let lenses = shipped();
        assert!(lenses.len() >= 25, "{} lenses", lenses.len());
        for (lens, about) in lenses {
            let name = lens.name();
            for stated in [&about.title, &about.kind, &about.field, &about.focal_length] {
                assert!(stated.is_some(), "{name}: {about:?}");
            }
            assert!(about.source.is_some_and(|s| s.len() > 10), "{name}");
            // A part of a maker's catalogue has no year of design.
            if let Some(year) = about.year {
                let year: u32 = year.parse().unwrap();
                assert!((1800..2030).contains(&year), "{name}");
            } else {
                assert_eq!(about.kind.as_deref(), Some("simple"), "{name}");
            }
        }
    }

    #[test]
    fn every_shipped_lens_has_the_focal_length_and_the_f_number_of_its_source() {
        for (lens, about) in shipped() {
            let (name, optics) = (lens.name(), lens.first_order());
            let stated = about.focal_length_mm.unwrap();
            let efl = optics.focal.unwrap().efl;
            assert!(
                (efl / stated - 1.0).abs() < 0.01,
                "{name}: {efl} against {stated}"
            );
            let (stated, n) = (about.f_number.unwrap(), optics.f_number().unwrap());
            assert!(
                (n / stated - 1.0).abs() < 0.06,
                "{name}: f/{n} against f/{stated}"
            );
            let last = lens.prescription().surfaces.last().unwrap().thickness;
            let bfl = optics.focal.unwrap().bfl;
            // The film is at the focus on the axis, or near it where a design balances zonal
            // aberration.
            let off = (bfl - last).abs() / efl;
            assert!(
                last == 0.0 || off < 0.02,
                "{name}: film at {last}, focus at {bfl}"
            );
        }
    }

    #[test]
    fn no_shipped_lens_is_warned_of() {
        for name in shipped_names() {
            let mut sink = ivcam_base::diag::Sink::new();
            Lens::open_with(name, &mut sink).unwrap();
            // A glass that is known by n_d and V_d alone is noted.
            let is_warning = |d: &&Diagnostic| d.severity != Severity::Note;
            let warning = sink.items().iter().find(is_warning);
            assert!(warning.is_none(), "{name}: {}", warning.unwrap());
        }
    }

    #[test]
    fn rays_pass_every_shipped_lens_on_the_axis_and_at_nine_tenths_of_its_field() {
        for (lens, about) in shipped() {
            let half = 0.45 * about.field_degrees.unwrap();
            for angle in [0.0, half] {
                let (sin, cos) = (libm::sin(angle.to_radians()), libm::cos(angle.to_radians()));
                let (d, across) = (DVec3::new(0.0, sin, cos), DVec3::new(0.0, cos, -sin));
                let front = lens.prescription().surfaces[0].semi_diameter;
                let passes = (-1500..=1500).any(|i| {
                    let beside = f64::from(i) / 1000.0 * front;
                    let origin = beside * across - 10.0 * front * d;
                    let ray = LensRay::new(origin, d);
                    lens.trace_path(&ray, Toward::Film, true).outcome.is_ok()
                });
                assert!(passes, "{}: no ray at {angle} degrees", lens.name());
            }
        }
    }
}
