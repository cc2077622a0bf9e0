//! Options of metering: shutter, ISO and the luminance of white, which determine the exposure
//! together with the lens's light.

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_optics::film::Metering;

use super::given::GivenOptions;
use super::values::{POSITIVE, duration, finite, positive};

/// The time for which a shutter is open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Shutter {
    /// A time in seconds.
    Seconds(f64),
    /// A part of a movie's frame, from 0 to 1.
    Part(f64),
}

impl Shutter {
    /// Parses a time (`1/60`, `0.5s`, `20ms`) or a part of a frame (`0.5`, or `180deg` of a movie
    /// camera's rotary shutter).
    pub(crate) fn parse(word: &str) -> Option<Self> {
        let part = |part: f64| (0.0..=1.0).contains(&part).then_some(Self::Part(part));
        let bare = word.trim_end_matches('s');
        if let Some((over, under)) = bare.split_once('/') {
            return Some(Self::Seconds(positive(over)? / positive(under)?));
        }
        if let Some(degrees) = word.strip_suffix("deg") {
            return part(finite(degrees)? / 360.0);
        }
        match duration(word) {
            Some(time) => Some(Self::Seconds(time.as_secs_f64())),
            None => part(finite(word)?),
        }
    }

    /// Returns the value of `--shutter`, if it is given.
    ///
    /// # Errors
    /// Returns an error if the value is neither a time nor a part of a frame.
    pub(crate) fn of(words: &GivenOptions) -> Result<Option<Self>> {
        let expects = "a time such as 1/60 or 0.5s, nor a part of a frame such as 0.5 or 180deg";
        words.parsed("shutter", expects, Self::parse)
    }
}

/// Returns the text that [`Shutter::parse`] reads as exactly this time.
pub(super) fn shutter_word(seconds: f64) -> String {
    let candidates = [
        format!("1/{}", (1.0 / seconds).round()),
        format!("{seconds}s"),
    ];
    let exact = |word: &String| Shutter::parse(word) == Some(Shutter::Seconds(seconds));
    let found = candidates.into_iter().find(exact);
    found.unwrap_or_else(|| format!("{seconds}/1"))
}

/// Returns the metering if a time or an ISO is given. A part of a frame alone affects only the
/// motion blur.
///
/// # Errors
/// Returns an error if a value is invalid, or if no option gives a time.
pub(super) fn metering(words: &GivenOptions) -> Result<Option<Metering>> {
    let iso = words.parsed("iso", POSITIVE, positive)?;
    let expects = "a luminance in cd/m2 greater than 0";
    let white = words.parsed("white", expects, positive)?;
    let seconds = match (Shutter::of(words)?, words.frame) {
        (Some(Shutter::Seconds(seconds)), _) => Some(seconds),
        (Some(Shutter::Part(_)), None) => {
            return Err(Diagnostic::error(
                "only a movie can have a shutter that is open for a part of a frame",
            )
            .with_help("give a time, such as `--shutter 1/60` or `--shutter 0.5s`"));
        }
        (_, Some(frame)) if iso.is_some() => Some(frame.open * frame.seconds),
        _ => None,
    };
    let asked = iso.is_some() || white.is_some();
    let Some(seconds) = seconds.filter(|s| *s > 0.0) else {
        return if asked {
            Err(
                Diagnostic::error("`--iso` and `--white` need an open shutter")
                    .with_help("give its time, such as `--shutter 1/60`"),
            )
        } else {
            Ok(None)
        };
    };
    let plain = Metering::new(seconds);
    Ok(Some(Metering {
        iso: iso.unwrap_or(plain.iso),
        white: white.unwrap_or(plain.white),
        ..plain
    }))
}

#[cfg(test)]
mod tests {
    use super::super::given::MovieFrame;
    use super::*;

    #[test]
    fn a_shutter_is_a_time_or_a_part_of_a_frame() {
        let shutter = |word: &str| Shutter::parse(word);
        assert_eq!(shutter("1/60"), Some(Shutter::Seconds(1.0 / 60.0)));
        assert_eq!(shutter("1/60s"), Some(Shutter::Seconds(1.0 / 60.0)));
        assert_eq!(shutter("2s"), Some(Shutter::Seconds(2.0)));
        assert_eq!(shutter("20ms"), Some(Shutter::Seconds(0.02)));
        assert_eq!(shutter("0.5"), Some(Shutter::Part(0.5)));
        assert_eq!(shutter("180deg"), Some(Shutter::Part(0.5)));
        for wrong in ["1/0", "-1/60", "2", "400deg", "soon", "0/0", ""] {
            assert_eq!(shutter(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn a_time_or_an_iso_exposes_by_light_and_a_part_of_a_frame_alone_does_not() {
        let frame = Some(MovieFrame {
            seconds: 1.0 / 24.0,
            open: 0.5,
        });
        let asked = |line: &[(&'static str, &str)], frame| {
            let mut words = GivenOptions::default();
            words.frame = frame;
            for (name, value) in line {
                words.add(name, vec![value.into()]);
            }
            metering(&words)
        };
        let open = |line: &[(&'static str, &str)], frame| asked(line, frame).unwrap();
        assert_eq!(open(&[], None), None);
        let still = open(&[("shutter", "1/60"), ("iso", "400")], None).unwrap();
        assert_eq!((still.shutter, still.iso), (1.0 / 60.0, 400.0));
        assert_eq!(open(&[("shutter", "1/60")], None).unwrap().iso, 100.0);
        assert_eq!(open(&[("shutter", "0.5")], frame), None);
        let movie = open(&[("shutter", "180deg"), ("iso", "50")], frame).unwrap();
        assert_eq!((movie.shutter, movie.iso), (1.0 / 48.0, 50.0));
        for wrong in [
            &[("iso", "100")][..],
            &[("shutter", "0.5")],
            &[("shutter", "1/60"), ("iso", "0")],
            &[("white", "5")],
        ] {
            assert!(asked(wrong, None).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn a_time_is_written_as_it_is_read() {
        for (seconds, word) in [
            (1.0 / 60.0, "1/60"),
            (2.0, "2s"),
            (0.5, "1/2"),
            (1.0, "1/1"),
        ] {
            assert_eq!(shutter_word(seconds), word);
        }
        for seconds in [3.0 / 70.0, 1e-9 / 3.0, 0.0167, 1_234.567_891_234_5] {
            let word = shutter_word(seconds);
            assert_eq!(
                Shutter::parse(&word),
                Some(Shutter::Seconds(seconds)),
                "{word}"
            );
        }
    }
}
