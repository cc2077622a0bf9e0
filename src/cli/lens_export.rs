//! `ivcam lens --export`: writes a lens for other programs.

use std::io::Write;
use std::path::Path;

use clap::{Arg, ArgMatches};
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::write_whole;
use ivcam_optics::diagram::point_spread_map;
use ivcam_optics::lens::{Focus, Lens, SheetSetting};
use ivcam_optics::lens_export::{
    CameraModel, Chosen, Frame, StMaps, View, lensfun, opencv, opentrackio, osl, ros,
};
use ivcam_optics::picture::Depth;
use ivcam_optics::prescription::Prescription;
use ivcam_optics::prescription::formats::write::{Target, write_at};

use super::value;
use crate::photo::LensChoice;

/// The formats with their names.
const FORMATS: [(&str, Format); 10] = [
    ("opencv", Format::OpenCv),
    ("ros", Format::Ros),
    ("opentrackio", Format::OpenTrackIo),
    ("lensfun", Format::Lensfun),
    ("stmap", Format::StMap),
    ("psf", Format::Psf),
    ("osl", Format::Osl),
    ("zmx", Format::Prescription(Target::Zemax)),
    ("seq", Format::Prescription(Target::CodeV)),
    ("json", Format::Prescription(Target::Json)),
];

/// The greatest residual of a model in pixels, if none is given.
const TOLERANCE: f64 = 0.25;
/// The same for Lensfun, whose models have two or three coefficients: 0.1% of the usual width.
const LENSFUN_TOLERANCE: f64 = 2.0;

/// A format for another program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    OpenCv,
    Ros,
    OpenTrackIo,
    Lensfun,
    /// Two pictures.
    StMap,
    /// A picture.
    Psf,
    Osl,
    /// The surfaces themselves.
    Prescription(Target),
}

/// Returns the options of `--export`.
pub(super) fn arguments() -> [Arg; 5] {
    let of_export = |arg: Arg| arg.requires("export");
    [
        value(
            "export",
            "FORMAT",
            "writes the lens for another program: opencv, ros, opentrackio, lensfun, stmap, psf, osl, zmx, seq or json",
        ),
        of_export(
            value(
                "output",
                "FILE",
                "with --export: the file to write [standard output]",
            )
            .short('o'),
        ),
        of_export(value(
            "size",
            "WxH",
            "with --export: the pixels of the picture [1920 across]",
        )),
        of_export(value(
            "model",
            "MODEL",
            "with --export: brown (plumb_bob), rational or fisheye (equidistant) [the first that fits]",
        )),
        of_export(value(
            "tolerance",
            "PIXELS",
            "with --export: the largest residual of a model that counts as a fit [0.25; lensfun: 2]",
        )),
    ]
}

/// Writes a lens in the format of `--export` and returns the exit code.
pub(super) fn run(
    lens: &Lens,
    choice: &LensChoice,
    setting: &SheetSetting<'_>,
    sides: Option<[f64; 2]>,
    matches: &ArgMatches,
    out: &mut dyn Write,
) -> Result<i32> {
    let text = |name: &str| matches.get_one::<String>(name).map(String::as_str);
    let format = format(text("export").unwrap_or_default())?;
    let model = text("model").map(model).transpose()?;
    let tolerance = match text("tolerance") {
        Some(value) => super::lens::positive(value, "tolerance")?,
        None if format == Format::Lensfun => LENSFUN_TOLERANCE,
        None => TOLERANCE,
    };
    let view = || view(lens, setting, sides, text("size"));
    let fitted = |write: fn(&View<'_>, &Chosen) -> String| {
        let view = view()?;
        Ok(write(&view, &Chosen::of(&view, model, tolerance)?))
    };
    let written = match format {
        Format::OpenCv => fitted(opencv),
        Format::Ros => fitted(ros),
        Format::OpenTrackIo => opentrackio(&view()?, tolerance),
        Format::Lensfun => lensfun(&view()?, tolerance),
        Format::Osl => osl(&view()?),
        Format::Psf => return save_psf(lens, setting, &view()?, text("output")),
        Format::StMap => return save_maps(&view()?, text("output")),
        Format::Prescription(target) => prescription(lens, choice, setting, target),
    }?;
    match text("output") {
        Some(file) => {
            write_whole(Path::new(file), |to| to.write_all(written.as_bytes()))?;
            Ok(0)
        }
        None => super::exit_code(out.write_all(written.as_bytes())),
    }
}

/// Writes the map of point spreads.
fn save_psf(
    lens: &Lens,
    setting: &SheetSetting<'_>,
    view: &View<'_>,
    output: Option<&str>,
) -> Result<i32> {
    let file = output
        .filter(|name| stem_of_exr(name).is_some())
        .ok_or_else(|| {
            Diagnostic::error("a map of point spreads is written as EXR")
                .with_help("give `-o NAME.exr`")
        })?;
    let map = point_spread_map(lens, setting, view.frame.film)?;
    map.save(Path::new(file), Depth::Sixteen)?;
    Ok(0)
}

/// Writes both maps beside each other: of `map.exr`, `map-undistort.exr` and `map-distort.exr`.
fn save_maps(view: &View<'_>, output: Option<&str>) -> Result<i32> {
    let stem = output.and_then(stem_of_exr).ok_or_else(|| {
        Diagnostic::error("maps are written as EXR")
            .with_help("give `-o NAME.exr`; it makes NAME-undistort.exr and NAME-distort.exr")
    })?;
    let maps = StMaps::of(view)?;
    for (picture, what) in [(maps.undistort, "undistort"), (maps.distort, "distort")] {
        picture.save(Path::new(&format!("{stem}-{what}.exr")), Depth::Sixteen)?;
    }
    Ok(0)
}

/// The name of an EXR file without its ending, which may be in capitals.
fn stem_of_exr(name: &str) -> Option<&str> {
    let (stem, ending) = name.split_at_checked(name.len().checked_sub(4)?)?;
    ending.eq_ignore_ascii_case(".exr").then_some(stem)
}

/// The prescription as it is focused: with a focus, the gap behind the last surface reaches to the
/// film.
fn prescription(
    lens: &Lens,
    choice: &LensChoice,
    setting: &SheetSetting<'_>,
    target: Target,
) -> Result<String> {
    let mut prescription = lens.prescription().clone();
    drop_old_notes(&mut prescription, choice);
    let gap = prescription.surfaces.last().map_or(0.0, |s| s.thickness);
    let focus = setting
        .conjugate(lens)
        .filter(|_| setting.focus.is_some() || gap == 0.0);
    if let (Some(last), Some(conjugate)) = (prescription.surfaces.last_mut(), focus) {
        last.thickness = conjugate.film_z - lens.length();
    }
    let object = setting.focus.map_or(f64::INFINITY, Focus::object_distance);
    let (text, left_out) = write_at(&prescription, target, object)?;
    for what in left_out {
        super::status!("warning: the file leaves out {what}");
    }
    Ok(text)
}

/// Drops what the notes of the original file say of its focal length and its f-number if the lens
/// was changed.
fn drop_old_notes(prescription: &mut Prescription, choice: &LensChoice) {
    if choice.efl.is_none() && choice.zoom == 1.0 && choice.f_number.is_none() {
        return;
    }
    prescription.notes.retain(|note| {
        let note = note.to_ascii_lowercase();
        !["focal length:", "f-number:"]
            .iter()
            .any(|key| note.starts_with(key))
    });
}

fn format(name: &str) -> Result<Format> {
    let found = FORMATS.iter().find(|(known, _)| *known == name);
    found.map(|(_, format)| *format).ok_or_else(|| {
        let names: Vec<&str> = FORMATS.iter().map(|(name, _)| *name).collect();
        Diagnostic::unsupported(format!("there is no export format `{name}`"))
            .with_help(format!("the formats are {}", names.join(", ")))
    })
}

fn model(name: &str) -> Result<CameraModel> {
    CameraModel::named(name)
        .ok_or_else(|| super::lens::invalid_value("model", name, "brown, rational or fisheye"))
}

/// The picture of the lens: its film and its pixels.
fn view<'a>(
    lens: &'a Lens,
    setting: &SheetSetting<'_>,
    sides: Option<[f64; 2]>,
    size: Option<&str>,
) -> Result<View<'a>> {
    let no_image = || {
        Diagnostic::error(format!("`{}` makes no image to describe", lens.name()))
            .with_help("an afocal lens, or one that lets no light through, has none")
    };
    let conjugate = setting.conjugate(lens).ok_or_else(no_image)?;
    let half = match sides {
        Some(_) => 0.0,
        None => setting.full_height(lens).ok_or_else(no_image)?,
    };
    let pixels = size.map(|word| {
        let wanted = "a width and a height in pixels, such as 1920x1280";
        pixels(word).ok_or_else(|| super::lens::invalid_value("size", word, wanted))
    });
    let frame = Frame::of(sides, 2.0 * half, pixels.transpose()?)?;
    View::of(lens, conjugate, frame)
}

/// Parses a width and a height greater than 0.
fn pixels(word: &str) -> Option<[u32; 2]> {
    let side = |w: &str| {
        let is_digits = w.bytes().all(|b| b.is_ascii_digit());
        w.parse().ok().filter(|n: &u32| is_digits && *n > 0)
    };
    let (width, height) = word.split_once(['x', 'X'])?;
    Some([side(width)?, side(height)?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::lens;

    fn printed(line: &str) -> Result<String> {
        let words = std::iter::once("lens").chain(line.split_whitespace());
        let matches = lens::command().try_get_matches_from(words).unwrap();
        let mut out = Vec::new();
        lens::run(&matches, &mut out)?;
        Ok(String::from_utf8(out).unwrap())
    }

    #[test]
    fn a_size_is_two_numbers_and_nothing_else() {
        assert_eq!(pixels("1920x1280"), Some([1920, 1280]));
        assert_eq!(pixels("30X20"), Some([30, 20]));
        for bad in [
            "1920xabcx1080",
            "1920",
            "x20",
            "30x",
            "0x20",
            "+30x20",
            "30x20x",
            "9999999999x1",
        ] {
            assert_eq!(pixels(bad), None, "{bad}");
        }
        let error = printed("biogon --film 36x24 --export ros --size 1920xabcx1080").unwrap_err();
        let help = error.help.unwrap();
        assert!(
            help.contains("a width and a height in pixels, such as 1920x1280"),
            "{help}"
        );
    }

    #[test]
    fn the_ending_of_an_exr_file_may_be_in_capitals() {
        assert_eq!(stem_of_exr("a.exr"), Some("a"));
        assert_eq!(stem_of_exr("A.EXR"), Some("A"));
        for bad in ["a.png", "exr", "", "aéxr"] {
            assert_eq!(stem_of_exr(bad), None, "{bad}");
        }
    }

    #[test]
    fn an_export_without_a_lens_is_refused() {
        let error = printed("--export opencv").unwrap_err();
        assert_eq!(error.message, "`--export` needs a lens");
        assert!(error.help.unwrap().contains("lists the lenses"));
    }

    #[test]
    fn a_changed_lens_loses_the_notes_of_the_original_focal_length_and_f_number() {
        for format in ["zmx", "seq", "json"] {
            let text =
                |changes: &str| printed(&format!("double-gauss --export {format} {changes}"));
            let original = text("").unwrap();
            assert!(original.contains("100.7"), "{format}: {original}");
            for changes in ["--efl 50mm", "--scale 0.5", "--aperture 8"] {
                let changed = text(changes).unwrap();
                assert!(
                    !changed.contains("100.7 mm"),
                    "{format} {changes}: {changed}"
                );
                assert!(
                    !changed.contains("f-number: 2"),
                    "{format} {changes}: {changed}"
                );
            }
        }
    }
}
