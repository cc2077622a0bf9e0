//! The response: how an exposure becomes a level, linearly, by a display's curve, or by a film's.
//!
//! An emulsion is a table of density against the logarithm of exposure, the characteristic curve of
//! Hurter and Driffield. Its level is the transmittance of the developed film relative to its
//! clearest part, 10^−(D − D_min), encoded as sRGB for display. A sequence of emulsions is a chain
//! of copies: each is exposed through the one before it, so a negative and a paper make a print.
//! Grain is not simulated. A film without colors gets the luminance in place of three exposures.

use std::path::Path;
use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result, Source, Span, nearest};
use ivcam_base::files::{MAX_TEXT, read_file};

use super::white_balance::WhiteBalance;

/// A map from exposure to a level between 0 and 1.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Response {
    /// The level is the exposure, clipped at 1, as in the paper. It suits Inventor's colors, which
    /// are display values.
    Linear,
    /// The sRGB transfer curve over linear light.
    Srgb,
    /// The sRGB transfer curve over linear light whose highlights are compressed: see [`shoulder`].
    Filmic,
    /// One emulsion, or several that are exposed through each other in turn.
    Film(Arc<[Emulsion]>),
    /// A film without colors: another response to the luminance alone.
    Mono(Arc<Response>),
    /// A filter that balances white, before another response.
    Balanced(WhiteBalance, Arc<Response>),
}

/// A film stock, described by its characteristic curves.
#[derive(Clone, Debug, PartialEq)]
pub struct Emulsion {
    /// The name of a shipped emulsion, or the path of its file.
    pub name: String,
    /// The decimal logarithm, in the table's units, of exposure 1.
    white: f64,
    /// Decimal logarithms of exposure, ascending, with the densities of the red, green and blue
    /// layers.
    rows: Vec<(f64, [f64; 3])>,
}

/// The responses that are curves, with their names.
static CURVES: [(&str, Response); 3] = [
    ("linear", Response::Linear),
    ("srgb", Response::Srgb),
    ("filmic", Response::Filmic),
];

/// The word of a response to the luminance alone.
const MONO: &str = "mono";
/// Other words for it, which are no names of films.
const MONO_ELSEWHERE: [&str; 7] = [
    "bw",
    "b&w",
    "monochrome",
    "grayscale",
    "greyscale",
    "gray",
    "black-and-white",
];

/// The luminance of the primaries of linear sRGB (Rec. 709).
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// The names and tables of the emulsions in the program.
const SHIPPED: [(&str, &str); 3] = [
    ("reversal", include_str!("../../films/reversal.txt")),
    ("negative", include_str!("../../films/negative.txt")),
    ("paper", include_str!("../../films/paper.txt")),
];

impl Response {
    /// Returns the response that `words` names: `linear`, `srgb`, `filmic`, or emulsions separated
    /// by commas, each the name of a shipped one or the path of a file. A color temperature before
    /// it, as in `3200K,srgb`, balances white. With the word `mono`, as in `mono,filmic`, it is
    /// that of the luminance alone; `mono` by itself is `mono,linear`.
    ///
    /// # Errors
    /// Fails if a file cannot be read or is not the table of an emulsion.
    pub fn open(words: &str) -> Result<Self> {
        if let Some((first, rest)) = words.split_once(',')
            && let Some(kelvin) = first.strip_suffix('K').and_then(|n| n.parse().ok())
            && let Some(balance) = WhiteBalance::of_kelvin(kelvin)
        {
            return Ok(Self::open(rest)?.balanced(Some(balance)));
        }
        let words: Vec<&str> = words.split(',').map(str::trim).collect();
        let colored: Vec<&str> = words.iter().copied().filter(|word| *word != MONO).collect();
        let curve = |name: &str| CURVES.iter().find(|(known, _)| *known == name);
        let response = match colored[..] {
            [] => Self::Linear,
            [name] if let Some((_, response)) = curve(name) => response.clone(),
            _ => {
                let films = colored.iter().map(|word| Emulsion::open(word));
                Self::Film(films.collect::<Result<_>>()?)
            }
        };
        Ok(match colored.len() < words.len() {
            true => Self::Mono(Arc::new(response)),
            false => response,
        })
    }

    /// Returns the names of all responses in the program. Emulsions may be combined, and each may
    /// be with `mono`.
    pub fn names() -> impl Iterator<Item = &'static str> + Clone {
        let curves = CURVES.iter().map(|(name, _)| *name);
        let films = SHIPPED.iter().map(|(name, _)| *name);
        curves.chain(films).chain([MONO])
    }

    /// Returns the words that [`Response::open`] accepts for this response.
    pub fn name(&self) -> String {
        match self {
            Self::Linear => "linear".into(),
            Self::Srgb => "srgb".into(),
            Self::Filmic => "filmic".into(),
            Self::Film(films) => {
                let names: Vec<&str> = films.iter().map(|f| f.name.as_str()).collect();
                names.join(",")
            }
            Self::Mono(film) => format!("{MONO},{}", film.name()),
            Self::Balanced(balance, film) => format!("{}K,{}", balance.kelvin(), film.name()),
        }
    }

    /// Returns the response with another white balance, or without one.
    pub fn balanced(&self, balance: Option<WhiteBalance>) -> Self {
        let film = self.unbalanced();
        match balance {
            Some(balance) => Self::Balanced(balance, Arc::new(film.clone())),
            None => film.clone(),
        }
    }

    /// The response without its white balance.
    pub fn unbalanced(&self) -> &Self {
        match self {
            Self::Balanced(_, film) => film.unbalanced(),
            film => film,
        }
    }

    /// The white balance, if there is one.
    pub fn balance(&self) -> Option<WhiteBalance> {
        match self {
            Self::Balanced(balance, _) => Some(*balance),
            _ => None,
        }
    }

    /// Returns the levels of an exposure to red, green and blue.
    pub fn levels(&self, exposure: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Mono(film) => {
                let parts = exposure.iter().zip(LUMINANCE).map(|(x, part)| x * part);
                [film.level(parts.sum(), 1); 3]
            }
            Self::Balanced(balance, film) => {
                film.levels(std::array::from_fn(|i| exposure[i] * balance.gain(i)))
            }
            film => std::array::from_fn(|i| film.level(exposure[i], i)),
        }
    }

    /// Returns the level of an exposure in a channel: 0 red, 1 green, 2 blue. For a film without
    /// colors it is that of gray light, by the green layer's curve.
    pub fn level(&self, exposure: f64, channel: usize) -> f64 {
        match self {
            Self::Mono(film) => film.level(exposure, 1),
            Self::Linear => clipped(exposure),
            Self::Srgb => encoded(clipped(exposure)),
            Self::Filmic => encoded(clipped(shoulder(exposure))),
            Self::Balanced(balance, film) => film.level(exposure * balance.gain(channel), channel),
            Self::Film(_) if exposure.is_nan() => 0.0,
            Self::Film(films) => {
                let through = |x, film: &Emulsion| film.light_through(x, channel);
                encoded(clipped(films.iter().fold(exposure.max(0.0), through)))
            }
        }
    }
}

/// Clips to 0 to 1; NaN and infinite values become 0.
fn clipped(x: f64) -> f64 {
    if x.is_finite() {
        x.clamp(0.0, 1.0)
    } else {
        0.0
    }
}

/// Compresses what is brighter than 60% of white, so that no highlight is clipped: there the level
/// is 1 − 0.4·e^(−(x − 0.6)/0.4), which continues the line with its slope. White has 85%, and twice
/// as much light 99%.
fn shoulder(x: f64) -> f64 {
    const START: f64 = 0.6;
    match x > START {
        true => 1.0 - (1.0 - START) * libm::exp((START - x) / (1.0 - START)),
        false => x,
    }
}

/// Applies the sRGB transfer curve (IEC 61966-2-1).
fn encoded(x: f64) -> f64 {
    if x <= 0.003_130_8 {
        12.92 * x
    } else {
        1.055 * libm::pow(x, 1.0 / 2.4) - 0.055
    }
}

impl Emulsion {
    /// Returns the shipped emulsion of a name, or reads the file at a path.
    ///
    /// # Errors
    /// Fails if the file cannot be read or is not the table of an emulsion.
    pub fn open(word: &str) -> Result<Self> {
        if let Some((name, text)) = SHIPPED.iter().find(|(name, _)| *name == word) {
            let source = Source::new(format!("films/{name}.txt"), text.as_bytes().to_vec());
            return Self::read(&Arc::new(source)).map(|film| film.named(word));
        }
        let is_word = !word.contains(['/', '\\', '.']);
        let bytes = match read_file(Path::new(word), MAX_TEXT) {
            Err(_) if is_word => return Err(unknown(word)),
            read => read?,
        };
        Self::read(&Arc::new(Source::new(word, bytes)))
    }

    fn named(mut self, name: &str) -> Self {
        self.name = name.to_owned();
        self
    }

    /// Reads a table: `white LOG`, `sense positive` or `sense negative`, then rows of a logarithm
    /// of exposure and one density, or one for each of red, green and blue. `#` begins a comment.
    ///
    /// # Errors
    /// Fails at the first line of any other form, and if the table is too short or too long.
    pub fn read(source: &Arc<Source>) -> Result<Self> {
        let mut film = Self {
            name: source.name.clone(),
            white: 0.0,
            rows: Vec::new(),
        };
        let mut positive = None;
        let text = String::from_utf8_lossy(&source.bytes);
        let mut start = 0;
        for line in text.split_inclusive('\n') {
            let span = Span::new(start, start + line.trim_end().len());
            start += line.len();
            let words = line.split('#').next().unwrap_or_default();
            let words: Vec<&str> = words.split_whitespace().collect();
            let fail = |message: String| Diagnostic::error(message).at(source, span);
            match words[..] {
                [] => {}
                ["sense", "positive"] => positive = Some(true),
                ["sense", "negative"] => positive = Some(false),
                ["white", at] => {
                    film.white = number(at).ok_or_else(|| {
                        fail(format!("`{at}` is not the logarithm of an exposure"))
                    })?
                }
                _ => film.rows.push(row(&words).map_err(fail)?),
            }
            if let [.., (a, _), (b, _)] = film.rows[..]
                && b <= a
            {
                return Err(fail("the logarithms of exposure do not rise".into()));
            }
        }
        film.check(positive, source)?;
        Ok(film)
    }

    /// Checks the number of rows, and that the densities have the stated sense.
    fn check(&self, positive: Option<bool>, source: &Arc<Source>) -> Result<()> {
        let fail = |message: &str| Diagnostic::error(message).in_file(source.name.clone());
        let ([first, .., last], true) = (&self.rows[..], self.rows.len() < 100_000) else {
            return Err(
                fail("a film's table needs at least 2 and fewer than 100,000 rows").with_help(
                    "a row is the logarithm of an exposure and a density, such as `-1.5 0.3`",
                ),
            );
        };
        let falls = last.1[1] < first.1[1];
        if positive.is_some_and(|positive| positive != falls) {
            return Err(fail("the densities contradict the `sense` line")
                .with_help("a negative's density rises with exposure, a positive's falls"));
        }
        Ok(())
    }

    /// Returns the transmittance of the developed film relative to its clearest part.
    fn light_through(&self, exposure: f64, channel: usize) -> f64 {
        let layer = channel.min(2);
        let clear = self.rows.iter().map(|r| r.1[layer]);
        let clear = clear.fold(f64::INFINITY, f64::min);
        let density = self.density(libm::log10(exposure) + self.white, layer);
        libm::pow(10.0, clear - density)
    }

    /// Returns the density of a layer at a logarithm of exposure: linear between rows, constant
    /// beyond the ends of the table.
    fn density(&self, log: f64, layer: usize) -> f64 {
        let after = self.rows.partition_point(|r| r.0 < log);
        let at = |i: usize| (self.rows[i].0, self.rows[i].1[layer]);
        if after == 0 {
            return at(0).1;
        }
        if after == self.rows.len() {
            return at(after - 1).1;
        }
        let ((x0, d0), (x1, d1)) = (at(after - 1), at(after));
        d0 + (d1 - d0) * (log - x0) / (x1 - x0)
    }
}

/// Returns the error for a name that is not a response.
fn unknown(word: &str) -> Box<Diagnostic> {
    let names = Response::names();
    if CURVES.iter().any(|(known, _)| *known == word) {
        let error = format!("`{word}` is not a film, so it can't be combined with others");
        return Diagnostic::unsupported(error)
            .with_help(format!("give `{word}` alone, or `mono,{word}`"));
    }
    let mono = MONO_ELSEWHERE.contains(&word).then_some(MONO);
    let help = match mono.or_else(|| nearest(word, names.clone())) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!(
            "use {}, or the path of a film's table",
            names.collect::<Vec<_>>().join(", ")
        ),
    };
    Diagnostic::not_found(format!("there is no response named `{word}`")).with_help(help)
}

fn number(word: &str) -> Option<f64> {
    word.parse().ok().filter(|x: &f64| x.is_finite())
}

/// Parses a row of a table. The error is a message.
fn row(words: &[&str]) -> std::result::Result<(f64, [f64; 3]), String> {
    let numbers: Option<Vec<f64>> = words.iter().map(|w| number(w)).collect();
    let Some(numbers) = numbers else {
        return Err(format!(
            "`{}` is not a row of a film's table",
            words.join(" ")
        ));
    };
    match numbers[..] {
        [log, d] => Ok((log, [d; 3])),
        [log, r, g, b] => Ok((log, [r, g, b])),
        _ => Err(format!(
            "a row has a logarithm of exposure and one density or three, not {} numbers",
            numbers.len()
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film(text: &str) -> Result<Emulsion> {
        Emulsion::read(&Arc::new(Source::new("a.txt", text.as_bytes().to_vec())))
    }

    #[test]
    fn a_curve_among_films_is_named_as_no_film() {
        for words in ["linear,srgb", "negative,filmic"] {
            let error = Response::open(words).unwrap_err();
            assert!(error.message.contains("can't be combined"), "{error}");
        }
    }

    #[test]
    fn an_overexposed_and_an_undefined_pixel_stay_in_range() {
        assert_eq!(Response::Linear.level(3.0, 0), 1.0);
        assert_eq!(Response::Linear.level(f64::NAN, 0), 0.0);
        assert!((Response::Srgb.level(0.5, 0) - 0.735_357).abs() < 1e-6);
        let slide = Response::open("reversal").unwrap();
        assert_eq!(slide.level(f64::NAN, 1), 0.0);
        for x in [f64::INFINITY, f64::NEG_INFINITY, -1.0, 0.0, 1e300] {
            assert!((0.0..=1.0).contains(&slide.level(x, 2)));
        }
    }

    #[test]
    fn a_balanced_response_shows_its_light_as_white_and_is_read_from_its_name() {
        let film = Response::open("3200K,filmic").unwrap();
        assert_eq!(film.name(), "3200K,filmic");
        assert_eq!(film.unbalanced(), &Response::Filmic);
        let balance = film.balance().unwrap();
        for channel in 0..3 {
            let gray = 0.18 / balance.gain(channel);
            let shown = film.level(gray, channel);
            assert!((shown - Response::Filmic.level(0.18, channel)).abs() < 1e-12);
        }
        assert!(film.level(0.18, 0) < film.level(0.18, 1));
        assert!(film.level(0.18, 1) < film.level(0.18, 2));
        let again = film.balanced(WhiteBalance::of_kelvin(6504.0));
        assert_eq!(again.name(), "6504K,filmic");
        assert_eq!(again.balanced(None), Response::Filmic);
        assert!(Response::open("900K,filmic").is_err());
    }

    #[test]
    fn a_mono_response_shows_the_luminance_in_all_channels() {
        let green = [0.0, 0.5, 0.0];
        for (words, curve) in [
            ("mono", Response::Linear),
            ("mono,filmic", Response::Filmic),
            ("filmic,mono", Response::Filmic),
            ("mono, reversal", Response::open("reversal").unwrap()),
        ] {
            let mono = Response::open(words).unwrap();
            assert_eq!(
                mono.levels(green),
                [curve.level(0.5 * 0.7152, 1); 3],
                "{words}"
            );
            // The weights of the primaries add up to 1.
            let gray = mono.levels([0.3; 3])[2];
            assert!((gray - curve.level(0.3, 1)).abs() < 1e-12, "{words}");
            assert_eq!(Response::open(&mono.name()).unwrap(), mono);
        }
        let balanced = Response::open("3200K,mono,srgb").unwrap();
        assert_eq!(balanced.name(), "3200K,mono,srgb");
        let [warm, plain] = ["3200K,mono,srgb", "mono,srgb"]
            .map(|words| Response::open(words).unwrap().levels([1.0, 0.5, 0.2])[0]);
        assert!(warm < plain, "{warm} {plain}");
    }

    #[test]
    fn levels_are_those_of_each_channel() {
        for words in ["linear", "srgb", "3200K,filmic", "negative,paper"] {
            let response = Response::open(words).unwrap();
            let exposure = [0.1, 0.4, 1.2];
            let levels = [0, 1, 2].map(|i| response.level(exposure[i], i));
            assert_eq!(response.levels(exposure), levels, "{words}");
        }
    }

    #[test]
    fn a_filmic_response_keeps_what_is_below_sixty_percent_and_clips_nothing() {
        for x in [0.0, 0.18, 0.6] {
            assert_eq!(Response::Filmic.level(x, 0), Response::Srgb.level(x, 0));
        }
        let levels = [0.6, 0.600_1, 0.8, 1.0, 2.0, 4.0].map(|x| Response::Filmic.level(x, 1));
        assert!(
            levels.is_sorted_by(|a, b| a < b) && levels[5] < 1.0,
            "{levels:?}"
        );
        let slope = (shoulder(0.600_01) - 0.6) / 1e-5;
        assert!((slope - 1.0).abs() < 1e-4);
        assert_eq!(Response::Filmic.level(f64::NAN, 2), 0.0);
    }

    /// A positive whose density falls by 1 for a tenfold exposure reproduces light unchanged.
    #[test]
    fn a_straight_positive_of_contrast_1_is_a_linear_film_on_a_display() {
        let straight = film("sense positive\nwhite 2\n-4 6\n2 0 # clear\n").unwrap();
        let straight = Response::Film([straight].into());
        for exposure in [1e-4, 0.01, 0.18, 0.5, 0.9, 1.0, 7.0] {
            let (level, known) = (
                straight.level(exposure, 0),
                Response::Srgb.level(exposure, 0),
            );
            assert!((level - known).abs() < 1e-12, "{exposure}: {level} {known}");
        }
    }

    #[test]
    fn a_negative_of_a_negative_is_straight_again() {
        let negative = film("sense negative\n-5 0\n0 5\n").unwrap();
        let print = Response::Film([negative.clone(), negative].into());
        for exposure in [0.001, 0.18, 0.7] {
            let (level, known) = (print.level(exposure, 0), Response::Srgb.level(exposure, 0));
            assert!((level - known).abs() < 1e-12, "{exposure}: {level} {known}");
        }
    }

    #[test]
    fn layers_have_curves_of_their_own() {
        let warm = film("-1 1 1 1\n0 0 0.1 0.3\n").unwrap();
        let warm = Response::Film([warm].into());
        // Each layer is relative to its own clearest part, so only shadows have a color cast.
        let at = |channel| warm.level(0.3, channel);
        assert!(at(0) < at(1) && at(1) < at(2));
        assert!((warm.level(1.0, 2) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn shipped_films_rise_from_black_to_white() {
        for words in ["reversal", "negative,paper"] {
            let response = Response::open(words).unwrap();
            let levels: Vec<f64> = (0..=60)
                .map(|i| response.level(libm::pow(10.0, -4.0 + 0.1 * f64::from(i)), 1))
                .collect();
            assert!(levels.is_sorted(), "{words}");
            assert!(levels[0] < 0.1 && levels[60] > 0.97, "{words}: {levels:?}");
            // A gray card, 18% of white, has a middle level.
            let gray = response.level(0.18, 1);
            assert!((0.3..0.65).contains(&gray), "{words}: {gray}");
        }
        assert_eq!(
            Response::open("negative, paper").unwrap().name(),
            "negative,paper"
        );
        let negative = Response::open("negative").unwrap();
        assert!(negative.level(0.01, 0) > negative.level(1.0, 0));
    }

    #[test]
    fn a_wrong_line_of_a_table_is_reported_with_its_number() {
        let line = |text: &str| film(text).unwrap_err().location().1.map(|(line, _)| line);
        assert_eq!(line("-1 1\n0 x\n"), Some(2));
        assert_eq!(line("# a\n-1 1\n-2 2\n"), Some(3));
        assert_eq!(line("-1 1 2\n"), Some(1));
        assert_eq!(line("white nan\n"), Some(1));
        assert!(film("").is_err() && film("1 1\n").is_err());
        let error = film("sense negative\n-1 1\n0 0\n").unwrap_err();
        assert!(error.message.contains("contradict"));
        let error = Response::open("revesal").unwrap_err();
        assert_eq!(error.help.as_deref(), Some("did you mean `reversal`?"));
        assert!(Response::open("films/none.txt").is_err());
    }
}
