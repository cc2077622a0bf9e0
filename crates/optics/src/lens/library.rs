//! Lenses by name or by path: those that come with the program, and files.

use std::path::Path;
use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result, Sink, Source, nearest};
use ivcam_base::files::{MAX_TEXT, read_file};
use ivcam_base::math::{LengthUnit, parse_length};

use crate::lens::lens::Lens;
use crate::prescription::formats::origin;
use crate::prescription::formats::{Reading, read};
use crate::prescription::prescription::{Prescription, StatedFNumber};
use crate::prescription::text::decoded;

mod shipped {
    include!(concat!(env!("OUT_DIR"), "/lenses.rs"));
}

impl Lens {
    /// Opens a lens by the name of a shipped one or by the path of a file. The reader's warnings
    /// are lost; [`Lens::open_with`] keeps them.
    ///
    /// # Errors
    /// Returns the errors of [`open_prescription`].
    pub fn open(name_or_path: impl AsRef<Path>) -> Result<Self> {
        Self::open_with(name_or_path, &mut Sink::new())
    }

    /// Opens a lens; the reader's warnings go to `sink`.
    ///
    /// # Errors
    /// Returns the errors of [`open_prescription`].
    pub fn open_with(name_or_path: impl AsRef<Path>, sink: &mut Sink) -> Result<Self> {
        Self::open_as(name_or_path, &Reading::default(), sink)
    }

    /// Opens a lens with given glass catalogues and reading options.
    ///
    /// # Errors
    /// Returns the errors of [`open_prescription`].
    pub fn open_as(name_or_path: impl AsRef<Path>, how: &Reading, sink: &mut Sink) -> Result<Self> {
        open_prescription(name_or_path, how, sink).map(Self::new)
    }

    /// A shipped lens by name. It is part of the program and needs no file.
    ///
    /// # Errors
    /// A name that no shipped lens has.
    pub fn named(name: &str) -> Result<Self> {
        read::read(&shipped_source(name)?, &mut Sink::new()).map(Self::new)
    }
}

/// Reads a prescription by the name of a shipped lens or by the path of a file.
///
/// # Errors
/// A name or a file that does not exist, and whatever the reader finds wrong.
pub fn open_prescription(
    name_or_path: impl AsRef<Path>,
    how: &Reading,
    sink: &mut Sink,
) -> Result<Prescription> {
    let source = source(name_or_path.as_ref())?;
    let prescription = read::read_with(&source, how, sink)?;
    warn_if_contradicted(&prescription, &source, sink);
    Ok(prescription)
}

/// Warns of an f-number of the file that its apertures contradict, by paraxial rays and by real
/// rays. Programs state the one or the other.
fn warn_if_contradicted(prescription: &Prescription, source: &Arc<Source>, sink: &mut Sink) {
    let Some(stated) = prescription.stated_f_number else {
        return;
    };
    let StatedFNumber { value, span, .. } = stated;
    let lens = Lens::new(prescription.clone());
    let (Some(paraxial), Some(real)) = (lens.first_order().f_number(), lens.real_f_number()) else {
        return;
    };
    if (real / value - 1.0).abs() <= stated.tolerance {
        return;
    }
    let help = match value > real {
        true => format!(
            "the apertures count; `--aperture {value:.3}` closes the stop to the stated one"
        ),
        false => "the apertures count".to_owned(),
    };
    let before = sink.set_source(Some(decoded(source)));
    let message = format!(
        "the file states f/{value:.3}, but its apertures let through f/{paraxial:.3} by paraxial \
         rays and f/{real:.3} by real rays"
    );
    sink.warn(span, message).help(help);
    sink.set_source(before);
}

/// The text of a shipped lens, or of a file.
fn source(path: &Path) -> Result<Arc<Source>> {
    let word = path.to_string_lossy();
    let is_word = !word.contains(['/', '\\']);
    let is_shipped = (is_word || word.starts_with("lenses/")) && shipped_text(&word).is_some();
    if let Some(length) = focal_length_of(&word).filter(|_| !path.exists()) {
        return Err(lenses_of(&word, length));
    }
    if !path.exists() && (is_shipped || (is_word && !word.contains('.'))) {
        return shipped_source(&word);
    }
    let bytes = read_file(path, MAX_TEXT)?;
    Ok(Arc::new(Source::new(word.into_owned(), bytes)))
}

/// Returns the focal length in millimeters that stands in place of a name, as in `50mm` and `50mm
/// f/1.4`.
fn focal_length_of(word: &str) -> Option<f64> {
    let length = word.split("f/").next()?.trim();
    let length = parse_length(length, LengthUnit::Millimeter)?.0;
    (1.0..=5000.0).contains(&length).then_some(length)
}

/// Returns the error for a focal length in place of a name, with the shipped lenses within a fifth
/// of it.
fn lenses_of(word: &str, length: f64) -> Box<Diagnostic> {
    let open = |name| {
        let lens = Lens::named(name).ok()?;
        let efl = lens.first_order().efl();
        let apart = libm::log(efl / length).abs();
        let number = lens.real_f_number().map(|n| match n < 1.0 {
            true => format!(", f/{n:.2}"),
            false => format!(", f/{n:.1}"),
        });
        let text = format!("{name} ({efl:.0} mm{})", number.unwrap_or_default());
        (apart <= libm::log(1.2)).then_some((apart, text))
    };
    let mut near: Vec<(f64, String)> = shipped_names().filter_map(open).collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    let near: Vec<String> = near.into_iter().map(|(_, text)| text).take(6).collect();
    let scaled = format!("`--lens double-gauss --efl {length}mm` scales a lens to it");
    let help = match near.is_empty() {
        true => scaled,
        false => format!("there are {}; {scaled}", near.join(", ")),
    };
    Diagnostic::not_found(format!(
        "`{word}` is a focal length, and lenses are given by name"
    ))
    .with_help(help)
}

fn shipped_source(name: &str) -> Result<Arc<Source>> {
    let Some((file, text)) = shipped_text(name) else {
        let error = Diagnostic::not_found(format!("there is no lens named `{name}`"));
        let help = match nearest(name, shipped_names()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!(
                "there are {}",
                shipped_names().collect::<Vec<_>>().join(", ")
            ),
        };
        return Err(error.with_help(help));
    };
    let bytes = text.as_bytes().to_vec();
    Ok(Arc::new(Source::new(format!("lenses/{file}"), bytes)))
}

/// Points a message about a zoom position at the place where the lens's file lists them.
pub fn at_zoom_list(error: Box<Diagnostic>, name_or_path: impl AsRef<Path>) -> Box<Diagnostic> {
    match source(name_or_path.as_ref()) {
        Ok(source) => origin::at_zoom_list(error, &source),
        Err(_) => error,
    }
}

/// The names of the lenses in the binary, sorted.
pub fn shipped_names() -> impl Iterator<Item = &'static str> {
    shipped::LENSES.iter().map(|(file, _)| stem(file))
}

/// The file name and text of a shipped lens, by its name with or without folder and ending.
fn shipped_text(name: &str) -> Option<(&'static str, &'static str)> {
    let name = name.strip_prefix("lenses/").unwrap_or(name);
    let last = |file: &'static str| file.rsplit('/').next().unwrap_or(file);
    shipped::LENSES
        .iter()
        .find(|(file, _)| *file == name || last(file) == name || stem(file) == name)
        .copied()
}

/// `wide-angle` of `folder/wide-angle.dat`.
fn stem(file: &str) -> &str {
    let name = file.rsplit('/').next().unwrap_or(file);
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_focal_length_in_place_of_a_name_lists_lenses_near_it() {
        let help = |word: &str| {
            let error = Lens::open(word).expect_err("there is no such lens");
            assert!(error.message.contains("is a focal length"), "{error}");
            error.help.clone().unwrap_or_default()
        };
        for word in ["50mm", "50", "50 mm", "50mm f/1.4", "5cm"] {
            let help = help(word);
            assert!(help.contains("takumar-50 (50 mm, f/1.4)"), "{word}: {help}");
            assert!(
                help.contains("--efl 50mm") && !help.contains("wide-angle"),
                "{help}"
            );
        }
        assert!(!help("1200mm").contains("there are"));
        let error = Lens::open("biogom").expect_err("there is no such lens");
        assert!(error.help.is_some_and(|help| help.contains("`biogon`")));
    }
}
