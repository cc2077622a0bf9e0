//! What `ivcam lens` is asked about: the lens, its focus, and the conditions of its data sheet.

use std::cell::OnceCell;
use std::ops::RangeBounds;
use std::path::PathBuf;

use clap::ArgMatches;
use ivcam_base::diag::{Diagnostic, Result, Sink, counted};
use ivcam_base::math::Meters;
use ivcam_optics::lens::{
    Aberrations, FieldPoint, Focus, FocusMethod, Lens, LensSheet, SheetSetting,
};
use ivcam_optics::picture::Picture;

use super::trace_rays::{Traced, wavelength};
use super::{flags, parsed, print_diagnostic, text};
use crate::photo::options::{POSITIVE, positive};
use crate::photo::{LensChoice, LensWavelength};

/// The options that set the conditions, each with the name of its value and its help.
pub(super) const CONDITIONS: [(&str, &str, &str); 5] = [
    (
        "wavelength",
        "NM",
        "the wavelength in nanometers; default that of the file, or the d line",
    ),
    (
        "defocus",
        "MM",
        "shifts the film of the data sheet away from the lens by this many millimeters",
    ),
    (
        "fields",
        "LIST",
        "the points of the data sheet on the film's diagonal: heights in mm, 70% or 20deg [0,50%,70%,100%]",
    ),
    (
        "frequencies",
        "LIST",
        "the frequencies of the modulation, in line pairs per millimeter",
    ),
    (
        "film",
        "WxH",
        "the film of the data sheet, or its diagonal, in millimeters [the stated field of the lens]",
    ),
];

/// What an output writes.
pub(super) enum Content {
    Text(String),
    /// Pictures, each with its file.
    Pictures(Vec<(PathBuf, Picture)>),
}

impl Default for Content {
    fn default() -> Self {
        Self::Text(String::new())
    }
}

/// A lens and the conditions that the options set.
pub(super) struct LensRequest<'m> {
    pub(super) matches: &'m ArgMatches,
    pub(super) choice: LensChoice,
    /// The lens, focused if there is a distance.
    pub(super) lens: Lens,
    pub(super) focus: Option<Focus>,
    /// The width and the height of the film in millimeters, if both are given.
    pub(super) film: Option<[f64; 2]>,
    /// The rays of `--trace`.
    pub(super) rays: Option<Traced>,
    unfocused: Lens,
    distance: Option<Meters>,
    conditions: SheetSetting<'static>,
    sheet: OnceCell<Option<(LensSheet, Aberrations)>>,
}

impl<'m> LensRequest<'m> {
    /// Opens the lens and reads the options.
    ///
    /// # Errors
    /// Fails if the lens cannot be read or focused, or if the value of an option is invalid.
    pub(super) fn open(name: &str, matches: &'m ArgMatches) -> Result<Self> {
        let mut sink = Sink::new();
        let (choice, distance) = choice(name, matches, &mut sink)?;
        let opened = choice.open(&mut sink);
        sink.items().iter().for_each(print_diagnostic);
        Self::with(choice, distance, opened?, matches)
    }

    /// Takes a lens that was opened with the lens's options, and reads the others.
    ///
    /// # Errors
    /// Fails if the lens cannot be focused, or if the value of an option is invalid.
    pub(super) fn of(lens: &Lens, matches: &'m ArgMatches) -> Result<Self> {
        let (choice, distance) = choice(lens.name(), matches, &mut Sink::new())?;
        Self::with(choice, distance, lens.clone(), matches)
    }

    fn with(
        choice: LensChoice,
        distance: Option<Meters>,
        opened: Lens,
        matches: &'m ArgMatches,
    ) -> Result<Self> {
        let unfocused = match choice.wavelength {
            LensWavelength::Nm(nm) => {
                warn_of_index(&opened, nm);
                opened.at_wavelength(nm)
            }
            _ => opened.at_primary_wavelength(),
        };
        let (lens, focus) = focused(&unfocused, choice.method, distance)?;
        let (conditions, film) = conditions(matches)?;
        let rays = text(matches, "trace").map(|file| Traced::read(&lens, file));
        let request = Self {
            matches,
            choice,
            focus,
            film,
            rays: rays.transpose()?,
            lens,
            unfocused,
            distance,
            conditions,
            sheet: OnceCell::new(),
        };
        request.warn_of_dark_fields();
        Ok(request)
    }

    /// Returns the conditions of the data sheet.
    pub(super) fn setting(&self) -> SheetSetting<'_> {
        SheetSetting {
            unfocused: Some(&self.unfocused),
            focus: self.focus.as_ref(),
            ..self.conditions.clone()
        }
    }

    /// Returns the data sheet with the aberrations, which are computed once for all outputs. An
    /// afocal lens and a lens that lets no light through have none.
    pub(super) fn sheet(&self) -> Option<&(LensSheet, Aberrations)> {
        let compute = || {
            let sheet = Aberrations::with_sheet(&self.lens, &self.setting());
            if sheet.is_none() && self.lens.first_order().focal.is_some() {
                let message =
                    "the film has no image, so there are no curves and no images of points";
                print_diagnostic(&Diagnostic::warning(message).with_help(NO_IMAGE));
            }
            sheet
        };
        self.sheet.get_or_init(compute).as_ref()
    }

    /// Whether a distance is given, and the surfaces of the lens are where they are without it.
    pub(super) fn moves_film_alone(&self) -> bool {
        self.focus.is_some() && self.lens.prescription() == self.unfocused.prescription()
    }

    /// Returns the z of the film: at the focus, or at the focal point if no distance is given.
    pub(super) fn film_z(&self) -> Option<f64> {
        let at_infinity = || self.lens.first_order().focal.map(|f| f.rear_focal_point);
        self.focus.map(|f| f.film_z).or_else(at_infinity)
    }

    /// Returns the gaps behind the surfaces at a zoom position with the same focus. The last one
    /// reaches to the film.
    ///
    /// # Errors
    /// Fails if the lens cannot be focused there, or has no image.
    pub(super) fn gaps_at_zoom(&self, position: usize) -> Result<Vec<f64>> {
        let unfocused = self.unfocused.at_zoom(position)?;
        let (lens, focus) = focused(&unfocused, self.choice.method, self.distance)?;
        let setting = SheetSetting {
            unfocused: Some(&unfocused),
            focus: focus.as_ref(),
            ..self.conditions.clone()
        };
        let conjugate = setting.conjugate(&lens).ok_or_else(|| no_image(&lens))?;
        let surfaces = lens.prescription().surfaces.iter();
        let mut gaps: Vec<f64> = surfaces.map(|surface| surface.thickness).collect();
        if let Some(last) = gaps.last_mut() {
            *last = conjugate.film_z - lens.length();
        }
        Ok(gaps)
    }

    /// Warns about the points of `--fields` that get no light.
    fn warn_of_dark_fields(&self) {
        let dark = self.setting().dark_fields(&self.lens);
        if dark > 0 {
            let (dark, all) = (counted(dark, "point"), self.conditions.fields.len());
            let text =
                format!("no light gets through the lens to {dark} of the {all} of `--fields`");
            print_diagnostic(&Diagnostic::warning(text));
        }
    }
}

/// Returns the choice of the options with the wavelength of the sheet, and the distance in focus.
fn choice(
    name: &str,
    matches: &ArgMatches,
    sink: &mut Sink,
) -> Result<(LensChoice, Option<Meters>)> {
    let (mut choice, distance) =
        LensChoice::from_options(name, &flags::given_options(matches), sink)?;
    choice.wavelength = match parsed(matches, "wavelength", POSITIVE, positive)? {
        Some(nm) => LensWavelength::Nm(wavelength(nm)?),
        None => LensWavelength::Primary,
    };
    Ok((choice, distance))
}

/// Returns the lens focused at a distance, with its focus, if there is a distance.
fn focused(
    lens: &Lens,
    method: FocusMethod,
    distance: Option<Meters>,
) -> Result<(Lens, Option<Focus>)> {
    let Some(distance) = distance else {
        return Ok((lens.clone(), None));
    };
    let focused = lens.focused(method, distance);
    let (lens, focus) = focused.map_err(|fault| fault.diagnostic(lens.name()))?;
    Ok((lens, Some(focus)))
}

/// Warns about a wavelength at which the index of a glass is not to be relied on.
fn warn_of_index(lens: &Lens, nm: f64) {
    if let Some((_, message)) = lens.prescription().doubtful_index(nm) {
        let warning = Diagnostic::warning(message);
        print_diagnostic(&warning.with_help("the glass may be opaque there"));
    }
}

/// Returns the error for an output of the image of a lens that has none.
pub(super) fn no_image(lens: &Lens) -> Box<Diagnostic> {
    Diagnostic::error(format!("`{}` has no image to describe", lens.name())).with_help(NO_IMAGE)
}

/// Why a lens has no data sheet.
const NO_IMAGE: &str = "there is none behind an afocal lens, behind one whose image is virtual, in \
                        front of the last surface, and where no light comes through";

/// Reads the conditions of the data sheet, without the focus, and the sides of the film.
fn conditions(matches: &ArgMatches) -> Result<(SheetSetting<'static>, Option<[f64; 2]>)> {
    let wanted = "a length in millimeters, such as 0.05 or -0.1mm";
    let shift = |word: &str| number(word.trim_end_matches("mm"), -1e6..1e6);
    let defocus = parsed(matches, "defocus", wanted, shift)?;
    let wanted = "a film size in millimeters such as 36x24, or the diagonal alone";
    let (diagonal, sides) = parsed(matches, "film", wanted, film)?.unzip();
    let wanted = "a list of up to 400 numbers of line pairs per millimeter, such as 10,20,40";
    let positives = |word: &str| list(word, positive);
    let mut frequencies = parsed(matches, "frequencies", wanted, positives)?.unwrap_or_default();
    frequencies.sort_by(f64::total_cmp);
    frequencies.dedup();
    let wanted = "a list of up to 400 heights in mm (10), shares (70%) or angles (20deg), such as \
                  0,50%,100%";
    let fields = parsed(matches, "fields", wanted, |word| list(word, field_point))?;
    let setting = SheetSetting {
        defocus: defocus.unwrap_or_default(),
        image_height: diagonal.map(|diagonal| 0.5 * diagonal),
        fields: fields.unwrap_or_default(),
        frequencies,
        ..SheetSetting::default()
    };
    Ok((setting, sides.flatten()))
}

/// Parses a number in a range.
fn number(word: &str, range: impl RangeBounds<f64>) -> Option<f64> {
    word.parse().ok().filter(|number| range.contains(number))
}

/// Parses a film in millimeters: its diagonal, or its sides, `36x24`. Returns the diagonal, and the
/// sides if both are given.
fn film(word: &str) -> Option<(f64, Option<[f64; 2]>)> {
    let sides = word.trim_end_matches("mm").split(['x', 'X', '×']);
    let sides: Option<Vec<f64>> = sides.map(|side| positive(side.trim())).collect();
    match sides?[..] {
        [diagonal] => Some((diagonal, None)),
        [width, height] => Some((width.hypot(height), Some([width, height]))),
        _ => None,
    }
}

/// Parses a list of 1 to 400 words with commas between them.
fn list<T>(value: &str, word: impl Fn(&str) -> Option<T>) -> Option<Vec<T>> {
    let all: Option<Vec<T>> = value.split(',').map(|w| word(w.trim())).collect();
    all.filter(|all| all.len() <= 400)
}

/// Parses a place on the film's diagonal: `10` or `10mm`, `70%`, or `20deg`.
fn field_point(word: &str) -> Option<FieldPoint> {
    let number = |word: &str| number(word, 0.0..1e6);
    if let Some(share) = word.strip_suffix('%') {
        return Some(FieldPoint::Share(0.01 * number(share)?));
    }
    if let Some(angle) = word.strip_suffix("deg") {
        return Some(FieldPoint::Angle(number(angle)?.to_radians()));
    }
    number(word.trim_end_matches("mm")).map(FieldPoint::Height)
}
