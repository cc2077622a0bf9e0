//! `ivcam lens --export`: writes a lens for other programs.

use std::path::PathBuf;

use clap::Arg;
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_optics::diagram::point_spread_map;
use ivcam_optics::lens::Focus;
use ivcam_optics::lens_export::{
    CameraModel, Chosen, Frame, StMaps, View, lensfun, opencv, opentrackio, osl, ros,
};
use ivcam_optics::prescription::formats::write::{OutputFormat, write_at};
use ivcam_optics::prescription::{About, Prescription};

use super::lens_request::{Content, LensRequest, no_image};
use super::{parsed, text, value};
use crate::photo::LensChoice;
use crate::photo::options::{POSITIVE, positive};

/// The formats, each with the function that writes it.
const FORMATS: [(&str, Write); 10] = [
    ("opencv", |export| export.fitted(opencv)),
    ("ros", |export| export.fitted(ros)),
    ("opentrackio", |export| {
        opentrackio(&export.view()?, export.tolerance.unwrap_or(TOLERANCE)).map(Content::Text)
    }),
    ("lensfun", |export| {
        let tolerance = export.tolerance.unwrap_or(LENSFUN_TOLERANCE);
        lensfun(&export.view()?, tolerance).map(Content::Text)
    }),
    ("stmap", |export| export.maps()),
    ("psf", |export| export.point_spreads()),
    ("osl", |export| osl(&export.view()?).map(Content::Text)),
    ("zmx", |export| export.prescription(OutputFormat::Zemax)),
    ("seq", |export| export.prescription(OutputFormat::CodeV)),
    ("json", |export| export.prescription(OutputFormat::Json)),
];

type Write = fn(&Export<'_>) -> Result<Content>;

/// The greatest residual of a model in pixels, if none is given.
const TOLERANCE: f64 = 0.25;
/// The same for Lensfun, whose models have two or three coefficients: 0.1% of the usual width.
const LENSFUN_TOLERANCE: f64 = 2.0;

/// A lens to export, with the options of `--export`.
struct Export<'a> {
    request: &'a LensRequest<'a>,
    model: Option<CameraModel>,
    tolerance: Option<f64>,
    pixels: Option<[u32; 2]>,
}

/// Returns the options of `--export`.
pub(super) fn arguments() -> impl Iterator<Item = Arg> {
    let all = [
        value(
            "output",
            "FILE",
            "with --export: the file to write [standard output]",
        )
        .short('o'),
        value(
            "size",
            "WxH",
            "with --export: the pixels of the picture [1920 across]",
        ),
        value(
            "model",
            "MODEL",
            "with --export: brown (plumb_bob), rational or fisheye (equidistant) [the first that fits]",
        ),
        value(
            "residual",
            "PIXELS",
            "with --export: the largest residual of a model that counts as a fit [0.25; lensfun: 2]",
        ),
    ];
    all.into_iter().map(|argument| argument.requires("export"))
}

/// Writes the lens in a format.
pub(super) fn export(request: &LensRequest<'_>, name: &str) -> Result<Content> {
    let matches = request.matches;
    let Some((_, write)) = FORMATS.iter().find(|(known, _)| *known == name) else {
        let names = FORMATS.map(|(name, _)| name).join(", ");
        let error = Diagnostic::unsupported(format!("there is no export format `{name}`"));
        let help = match name {
            "blender" | "cycles" => "`osl` is a camera of Blender's renderer Cycles".to_owned(),
            "zemax" => "`zmx` is Zemax's format".to_owned(),
            "codev" => "`seq` is Code V's format".to_owned(),
            _ => format!("the formats are {names}"),
        };
        return Err(error.with_help(help));
    };
    let size = "a width and a height in pixels, such as 1920x1280";
    write(&Export {
        request,
        model: parsed(
            matches,
            "model",
            "brown, rational or fisheye",
            CameraModel::named,
        )?,
        tolerance: parsed(matches, "residual", POSITIVE, positive)?,
        pixels: parsed(matches, "size", size, pixels)?,
    })
}

impl Export<'_> {
    /// Returns the picture of the lens: its film and its pixels.
    fn view(&self) -> Result<View<'_>> {
        let (lens, setting) = (&self.request.lens, self.request.setting());
        let conjugate = setting.conjugate(lens).ok_or_else(|| no_image(lens))?;
        let half = match self.request.film {
            Some(_) => 0.0,
            None => setting.full_height(lens).ok_or_else(|| no_image(lens))?,
        };
        let frame = Frame::of(self.request.film, 2.0 * half, self.pixels)?;
        View::of(lens, conjugate, frame)
    }

    /// Writes the model that fits.
    fn fitted(&self, write: fn(&View<'_>, &Chosen) -> String) -> Result<Content> {
        let view = self.view()?;
        let chosen = Chosen::of(&view, self.model, self.tolerance.unwrap_or(TOLERANCE))?;
        Ok(Content::Text(write(&view, &chosen)))
    }

    /// Makes the map of point spreads.
    fn point_spreads(&self) -> Result<Content> {
        let view = self.view()?;
        let refused = Diagnostic::error("a map of point spreads is written as EXR");
        let stem = self
            .stem()
            .ok_or_else(|| refused.with_help("give `-o NAME.exr`"))?;
        let (lens, setting) = (&self.request.lens, self.request.setting());
        let map = point_spread_map(lens, &setting, view.frame.film)?;
        let file = text(self.request.matches, "output").unwrap_or(stem);
        Ok(Content::Pictures(vec![(file.into(), map)]))
    }

    /// Makes both maps: of `map.exr`, `map-undistort.exr` and `map-distort.exr`.
    fn maps(&self) -> Result<Content> {
        let view = self.view()?;
        let refused = Diagnostic::error("maps are written as EXR");
        let stem = self.stem().ok_or_else(|| {
            refused
                .with_help("give `-o NAME.exr`; it makes NAME-undistort.exr and NAME-distort.exr")
        })?;
        let maps = StMaps::of(&view)?;
        let file = |what: &str| PathBuf::from(format!("{stem}-{what}.exr"));
        let undistort = (file("undistort"), maps.undistort);
        let distort = (file("distort"), maps.distort);
        Ok(Content::Pictures(vec![undistort, distort]))
    }

    /// Returns the name of the EXR file of `--output` without its ending.
    fn stem(&self) -> Option<&str> {
        text(self.request.matches, "output").and_then(stem_of_exr)
    }

    /// Writes the prescription as it is focused: with a focus or a defocus, the gap behind the last
    /// surface reaches to the film.
    fn prescription(&self, target: OutputFormat) -> Result<Content> {
        let (lens, setting) = (&self.request.lens, self.request.setting());
        let mut prescription = restated(self.request, target);
        let gap = prescription.surfaces.last().map_or(0.0, |s| s.thickness);
        let focus = setting
            .conjugate(lens)
            .filter(|_| setting.focus.is_some() || gap == 0.0 || setting.defocus != 0.0);
        if let (Some(last), Some(conjugate)) = (prescription.surfaces.last_mut(), focus) {
            last.thickness = conjugate.film_z - lens.length();
            self.focus_zoom(&mut prescription);
        }
        let object = setting.focus.map_or(f64::INFINITY, Focus::object_distance);
        let (text, left_out) = write_at(&prescription, target, object)?;
        for what in left_out {
            super::status!("warning: the file leaves out {what}");
        }
        Ok(Content::Text(text))
    }

    /// Gives the zoom positions of a focused prescription their gaps at the same focus.
    fn focus_zoom(&self, prescription: &mut Prescription) {
        let count = prescription.zoom.len();
        let all: Result<Vec<_>> = (0..count).map(|i| self.request.gaps_at_zoom(i)).collect();
        let Ok(all) = all else {
            super::status!(
                "warning: the file leaves out the zoom positions: not all of them have this focus"
            );
            prescription.zoom.clear();
            return;
        };
        let surfaces = &prescription.surfaces;
        for (position, gaps) in prescription.zoom.iter_mut().zip(all) {
            let changed = |(i, gap): &(usize, f64)| *gap != surfaces[*i].thickness;
            position.gaps = gaps.into_iter().enumerate().filter(changed).collect();
        }
    }
}

/// Returns the prescription with what its file states, as far as the lens is still that of the
/// file. The film and the wavelength of the options are its field and its primary wavelength. In
/// Zemax's and CODE V's formats it states the field of the data sheet, if its file does not state
/// one.
pub(super) fn restated(request: &LensRequest<'_>, target: OutputFormat) -> Prescription {
    let (lens, setting) = (&request.lens, request.setting());
    let mut prescription = lens.prescription().clone();
    drop_old_notes(&mut prescription, &request.choice);
    if let Some(height) = setting.image_height {
        drop_notes(&mut prescription, &["field:", "image height:"]);
        prescription.half_field = None;
        prescription.image_height = Some(height);
    }
    if text(request.matches, "wavelength").is_some() {
        prescription.make_primary(lens.wavelength());
    }
    let about = About::of(&prescription);
    let has_field = about.field_degrees.is_some() || about.image_height.is_some();
    let needs_field = matches!(target, OutputFormat::Zemax | OutputFormat::CodeV) && !has_field;
    if needs_field && let Some(height) = setting.full_height(lens) {
        // Micrometers are enough of a field that nobody states.
        let height = (1e3 * height).round() / 1e3;
        super::status!(
            "field: the lens states none; that of the data sheet is written, {height} mm on the film"
        );
        prescription.image_height = Some(height);
    }
    prescription
}

/// Returns the name of an EXR file without its ending, which may be in capitals.
fn stem_of_exr(name: &str) -> Option<&str> {
    let (stem, ending) = name.split_at_checked(name.len().checked_sub(4)?)?;
    ending.eq_ignore_ascii_case(".exr").then_some(stem)
}

/// Drops what the notes of the original file say of its focal length and its f-number if the lens
/// was changed, and states the f-number that was asked for.
fn drop_old_notes(prescription: &mut Prescription, choice: &LensChoice) {
    if choice.efl.is_none() && choice.zoom == 1.0 && choice.f_number.is_none() {
        return;
    }
    drop_notes(prescription, &["focal length:", "f-number:"]);
    let stated = choice.f_number.map(|n| format!("f-number: {n}"));
    prescription.notes.extend(stated);
}

/// Drops the notes that begin with any of some keys.
fn drop_notes(prescription: &mut Prescription, keys: &[&str]) {
    let is_one = |note: &String| {
        let note = note.to_ascii_lowercase();
        keys.iter().any(|key| note.starts_with(key))
    };
    prescription.notes.retain(|note| !is_one(note));
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
    use ivcam_base::diag::Sink;

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
    fn every_zoom_position_is_exported_with_the_film_at_its_own_focus() {
        let exported = |position: usize| -> serde_json::Value {
            let line = format!("canon-70-200 --zoom-position {position} --focus 5 --export json");
            serde_json::from_str(&printed(&line).unwrap()).unwrap()
        };
        let [wide, long] = [0, 1].map(exported);
        let gap = |lens: &serde_json::Value| {
            lens["surfaces"].as_array().unwrap().last().unwrap()["t"].clone()
        };
        let last = (wide["surfaces"].as_array().unwrap().len() - 1).to_string();
        assert_ne!(gap(&wide), gap(&long));
        assert_eq!(wide["zoom"][1]["gaps"][&last], gap(&long));
        assert_eq!(long["zoom"][0]["gaps"][&last], gap(&wide));
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
        assert_eq!(
            error.message,
            "`--size 1920xabcx1080` is not a width and a height in pixels, such as 1920x1280"
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
    fn several_lenses_have_a_line_each_and_no_options_of_one() {
        let text = printed("double-gauss biotar no-such-lens").unwrap();
        let lines: Vec<&str> = text.lines().collect();
        for (line, name) in lines[1..]
            .iter()
            .zip(["double-gauss", "biotar", "no-such-lens"])
        {
            assert!(line.trim_start().starts_with(name), "{text}");
        }
        assert!(
            lines[1].contains("100.7") && lines[3].contains("not read"),
            "{text}"
        );
        for option in [
            "--efl 50mm",
            "--fields 0,10",
            "--tolerance a.csv",
            "--psf a.png",
        ] {
            let error = printed(&format!("double-gauss biotar {option}")).unwrap_err();
            assert!(
                error.message.ends_with("needs one lens, and 2 are named"),
                "{error}"
            );
        }
        assert!(
            printed("double-gauss biotar --json")
                .unwrap()
                .starts_with('[')
        );
    }

    /// A doublet of Zemax at wavelengths of its own, without a field.
    #[test]
    fn the_sheet_names_wavelengths_and_an_export_has_the_field_of_the_sheet() {
        let file = std::env::temp_dir().join(format!("ivcam-own-{}.zmx", std::process::id()));
        let text = "VERS 1\nMODE SEQ\nENPD 10\nWAVM 1 0.45 1\nWAVM 2 0.55 1\nWAVM 3 0.64 1\nPWAV 2\n\
            SURF 0\n  DISZ INFINITY\nSURF 1\n  STOP\n  CURV 0.02\n  DISZ 5\n  GLAS N-BK7\n  DIAM 5\n\
            SURF 2\n  CURV 0\n  DISZ 95\n  DIAM 6\nSURF 3\n  CURV 0\n";
        std::fs::write(&file, text).unwrap();
        let sheet = printed(&file.display().to_string());
        let zemax = printed(&format!("{} --export zmx --film 24", file.display()));
        std::fs::remove_file(file).unwrap();
        let sheet = sheet.unwrap();
        let heads = sheet
            .lines()
            .find(|line| line.contains("distortion  "))
            .unwrap();
        assert!(heads.ends_with("   450 nm    640 nm"), "{sheet}");
        assert!(!sheet.contains("lateral F"), "{sheet}");
        let zemax = zemax.unwrap();
        assert!(
            zemax.contains("\nFTYP 3 0 3 3 ") && zemax.contains(" 8.4 12\n"),
            "{zemax}"
        );
        assert!(printed("biogon").unwrap().contains("lateral F lateral C\n"));
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

    #[test]
    fn an_option_that_no_output_uses_is_refused() {
        for (line, option) in [
            (
                "double-gauss --trace rays.json --wavelength 450 --defocus 3",
                "defocus",
            ),
            ("double-gauss --json --film 20", "film"),
            ("double-gauss --json --fields 3", "fields"),
            (
                "double-gauss --as-scene a.iv --frequencies 3",
                "frequencies",
            ),
            ("double-gauss --batch a.jsonl --defocus 1", "defocus"),
            ("double-gauss --export zmx --size 30x20", "size"),
            ("double-gauss --export osl --residual 1", "residual"),
            ("double-gauss --trials 5", "trials"),
        ] {
            let error = printed(line).unwrap_err().message.clone();
            assert!(
                error.starts_with(&format!("`--{option}` does nothing without ")),
                "{error}"
            );
        }
        for line in ["--efl 50mm", "--aperture f/8 --json", "--fields 3"] {
            let error = printed(line).unwrap_err();
            assert!(error.message.ends_with("needs a lens"), "{error}");
        }
        assert!(printed("nikon --efl 50mm").is_err());
    }

    #[test]
    fn an_option_of_the_lens_that_an_output_does_not_use_has_a_warning() {
        let file = std::env::temp_dir().join(format!("ivcam-idle-{}.dat", std::process::id()));
        let warned = |line: &str| {
            let words = format!("double-gauss {line} --write {}", file.display());
            let words: Vec<String> = words.split(' ').map(str::to_owned).collect();
            lens::lens_output(&words).unwrap().messages
        };
        let focus = warned("--focus 2");
        std::fs::remove_file(&file).unwrap();
        assert!(
            focus[0].contains("`--focus` does nothing with `--write`"),
            "{focus:?}"
        );
        let [plain, coated] = ["", "--coating none "].map(|option| {
            let line = format!("double-gauss {option}--as-scene {}.iv", file.display());
            let words: Vec<String> = line.split(' ').map(str::to_owned).collect();
            lens::lens_output(&words).unwrap().messages
        });
        std::fs::remove_file(format!("{}.iv", file.display())).unwrap();
        assert!(plain.is_empty(), "{plain:?}");
        assert!(
            coated[0].contains("`--coating` does nothing without `--write`"),
            "{coated:?}"
        );
    }

    /// The files of such lenses state a focal length that the lens is scaled to when it is read.
    #[test]
    fn a_lens_of_a_nominal_focal_length_is_written_with_the_one_that_it_has() {
        use ivcam_optics::lens::{Lens, Reading, open_prescription, shipped_names};
        let file = std::env::temp_dir().join(format!("ivcam-nominal-{}", std::process::id()));
        let as_published = Reading {
            as_published: true,
            ..Reading::default()
        };
        let mut written = 0;
        for name in shipped_names() {
            let lens = open_prescription(name, &as_published, &mut Sink::new()).unwrap();
            if About::of(&lens).nominal_mm.is_none() {
                continue;
            }
            let nominal = Lens::named(name).unwrap().first_order().efl();
            let sizes = [("--efl 20mm", 20.0), ("--efl 101mm", 101.0)];
            for (option, efl) in sizes.into_iter().chain([("--zoom 0.5", 0.5 * nominal)]) {
                for format in ["zmx", "seq", "json"] {
                    let text = printed(&format!("{name} {option} --export {format}")).unwrap();
                    std::fs::write(&file, text).unwrap();
                    let found = Lens::open(&file).unwrap().first_order().efl();
                    assert!(
                        (found / efl - 1.0).abs() < 1e-9,
                        "{name} {option} {format}: {found}"
                    );
                    written += 1;
                }
            }
        }
        std::fs::remove_file(file).unwrap();
        assert_eq!(written, 5 * 9);
    }

    /// The film's diagonal is 36 mm; the paraxial image of the double Gauss is some millimeters
    /// from its last gap.
    #[test]
    fn a_prescription_has_the_film_the_defocus_and_the_wavelength_of_the_options() {
        let text =
            |options: &str| printed(&format!("double-gauss --export zmx {options}")).unwrap();
        let film = text("--film 28.8x21.6");
        assert!(
            film.contains("\nFTYP 3 0 3 3 ") && film.contains(" 12.6 18\n"),
            "{film}"
        );
        let gap = |options: &str| {
            let text = text(options);
            let last = text
                .lines()
                .filter(|line| line.trim_start().starts_with("DISZ"));
            let last: Vec<f64> = last
                .filter_map(|line| line.split_whitespace().nth(1)?.parse().ok())
                .collect();
            last[last.len() - 2]
        };
        let moved = gap("--focus 2 --defocus 0.5") - gap("--focus 2");
        assert!((moved - 0.5).abs() < 1e-9, "{moved}");
        assert!((gap("--defocus 0.5") - gap("--defocus 0.2") - 0.3).abs() < 1e-9);
        let blue = text("--wavelength 450");
        assert!(
            blue.contains("WAVM 1 0.45 1\n") && blue.contains("PWAV 1\n"),
            "{blue}"
        );
    }

    #[test]
    fn a_lens_of_a_list_that_is_not_read_is_an_error_behind_the_list() {
        let matches = lens::command().try_get_matches_from(["lens", "biotar", "no-such.zmx"]);
        let mut out = Vec::new();
        assert_eq!(lens::run(&matches.unwrap(), &mut out).unwrap(), 2);
        assert!(
            String::from_utf8(out)
                .unwrap()
                .contains("no-such.zmx  not read: ")
        );
    }

    #[test]
    fn a_folder_says_how_many_files_are_no_lenses() {
        let folder = std::env::temp_dir().join(format!("ivcam-lenses-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("a.dat"), "50 5 1.5 9\n-50 0 1 9\n").unwrap();
        std::fs::write(folder.join("empty.dat"), "").unwrap();
        let text = printed(&folder.display().to_string());
        std::fs::remove_dir_all(folder).unwrap();
        let text = text.unwrap();
        assert!(
            text.ends_with("not listed, because it is no lens: 1 file (.dat, .json, .txt)\n"),
            "{text}"
        );
    }

    #[test]
    fn the_sheet_says_how_many_frequencies_it_leaves_out() {
        let text = |list: &str| printed(&format!("petzval --frequencies {list}")).unwrap();
        assert!(text("1,2,3,4,5,6,7,8,9,10,11").contains("the first 8 of 11 frequencies"));
        assert!(!text("1,2,3").contains("the first"));
    }
}
