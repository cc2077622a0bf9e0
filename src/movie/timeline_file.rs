//! Timeline files: focus, zoom, aperture, the camera's path, and scene time by frame.
//!
//! A timeline is a text file with one key per line (`docs/guide/film.md`):
//!
//! ```text
//! frames 200
//! focus    0    1.2
//! focus    199  1.99   diopters smooth
//! position 0    0 0.7 1.6
//! ```
//!
//! The paper pulls focus over 200 frames and notes that the choice of the interpolating function
//! matters. The three functions that it could mean are provided.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use ivcam_base::diag::{Diagnostic, Result, Source, Span, nearest};
use ivcam_base::math::Meters;

use super::ease::{Ease, EaseKey, PACES, SCALES, Scale};
use super::timeline::{MOST_FRAMES, RATES, RATES_TEXT, Timeline};
use crate::photo::options::distance;

impl Timeline {
    /// Reads the text of a timeline.
    ///
    /// # Errors
    /// Fails at the first wrong line, with its location.
    pub fn read(source: &Arc<Source>) -> Result<Self> {
        TimelineReader::new(source).read()
    }
}

/// A word of a line with its location.
#[derive(Clone, Copy)]
struct TimelineWord<'a> {
    text: &'a str,
    span: Span,
}

/// The state of reading a timeline file.
struct TimelineReader<'a> {
    source: &'a Arc<Source>,
    timeline: Timeline,
    /// The frame of each key, to be checked against the number of frames.
    last: Vec<(f64, Span)>,
    /// The settings that the lines before have.
    settings: Vec<&'a str>,
}

/// The words that a line can start with.
const NAMES: [&str; 9] = [
    "frames",
    "rate",
    "shutter",
    "focus",
    "zoom",
    "aperture",
    "position",
    "orientation",
    "time",
];

impl<'a> TimelineReader<'a> {
    fn new(source: &'a Arc<Source>) -> Self {
        let mut timeline = Timeline::still(0);
        timeline.rate = 24.0;
        Self {
            source,
            timeline,
            last: Vec::new(),
            settings: Vec::new(),
        }
    }

    fn read(mut self) -> Result<Timeline> {
        let source = self.source;
        let text = std::str::from_utf8(&source.bytes)
            .map_err(|e| self.wrong(Span::at(e.valid_up_to()), "a timeline is text in UTF-8"))?;
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut start = source.bytes.len() - text.len();
        for line in text.split_inclusive(['\n', '\r']) {
            let content = line.split('#').next().unwrap_or_default();
            let words = words(content, start);
            start += line.len();
            if let Some((name, values)) = words.split_first() {
                self.line(*name, values)?;
            }
        }
        if self.timeline.frames == 0 {
            return Err(self
                .wrong(
                    Span::at(0),
                    "the timeline does not say how many frames it has",
                )
                .with_help("add a line such as `frames 200`"));
        }
        for &(frame, span) in &self.last {
            if frame > f64::from(self.timeline.frames) {
                return Err(self
                    .wrong(span, format!("frame {frame} is after the end"))
                    .with_help(format!(
                        "the timeline has {} frames, from 0",
                        self.timeline.frames
                    )));
            }
        }
        Ok(self.timeline)
    }

    /// Reads a line with a setting, or with a key of a track.
    fn line(&mut self, name: TimelineWord<'a>, values: &[TimelineWord<'_>]) -> Result<()> {
        match name.text {
            "frames" => {
                let [frames] = self.numbers(name, values)?;
                let whole = frames.fract() == 0.0;
                if !whole || !(1.0..=f64::from(MOST_FRAMES)).contains(&frames) {
                    let most = format!("a whole number from 1 to {MOST_FRAMES} is");
                    return Err(self
                        .wrong(values[0].span, "not a number of frames")
                        .with_help(most));
                }
                self.timeline.frames = frames as u32;
                self.once(name)
            }
            "rate" => {
                let [rate] = self.numbers(name, values)?;
                if !RATES.contains(&rate) {
                    return Err(self
                        .wrong(values[0].span, "not a rate of frames")
                        .with_help(format!("frames a second, {RATES_TEXT}")));
                }
                self.timeline.rate = rate;
                self.once(name)
            }
            "shutter" => {
                let [part] = self.numbers(name, values)?;
                if !(0.0..=1.0).contains(&part) {
                    let help = "0 is an instant, 0.5 half of a frame's time, 1 all of it";
                    return Err(self
                        .wrong(values[0].span, "not a part of a frame")
                        .with_help(help));
                }
                self.timeline.shutter = part;
                self.once(name)
            }
            _ => self.key(name, values),
        }
    }

    /// Refuses a second line with a setting.
    fn once(&mut self, name: TimelineWord<'a>) -> Result<()> {
        if self.settings.contains(&name.text) {
            return Err(self
                .wrong(name.span, format!("a second line `{}`", name.text))
                .with_help("leave one of them out"));
        }
        self.settings.push(name.text);
        Ok(())
    }

    /// Reads a key: `TRACK FRAME VALUE… [EASE…]`.
    fn key(&mut self, name: TimelineWord<'_>, values: &[TimelineWord<'_>]) -> Result<()> {
        if !NAMES.contains(&name.text) {
            let help = nearest(name.text, NAMES).map_or_else(
                || format!("a line starts with {}", NAMES.join(", ")),
                |near| format!("did you mean `{near}`?"),
            );
            let what = format!("there is no track `{}`", name.text);
            return Err(self.wrong(name.span, what).with_help(help));
        }
        let Some((frame_word, rest)) = values.split_first() else {
            return Err(self
                .wrong(
                    name.span,
                    format!("`{}` has no frame and no value", name.text),
                )
                .with_help(format!("write it as `{} 0 VALUE`", name.text)));
        };
        let frame = self.number(*frame_word)?;
        if frame < 0.0 {
            return Err(self.wrong(frame_word.span, "frames are counted from 0"));
        }
        let is_ease = |w: &TimelineWord<'_>| Ease::parse(w.text).is_some();
        let split = rest.iter().position(is_ease).unwrap_or(rest.len());
        let (values, eases) = rest.split_at(split);
        let ease = self.ease(name, eases)?;
        let mut added = Ok(());
        match name.text {
            "focus" => {
                let value = self.distance(name, values)?;
                added = self.timeline.focus.push(EaseKey { frame, value, ease });
            }
            "zoom" => {
                let [value] = self.positive(name, values)?;
                added = self.timeline.zoom.push(EaseKey { frame, value, ease });
            }
            "aperture" => {
                let value = self.f_number(name, values)?;
                added = self.timeline.aperture.push(EaseKey { frame, value, ease });
            }
            "time" => {
                let [value] = self.numbers(name, values)?;
                added = self.timeline.time.push(EaseKey { frame, value, ease });
            }
            "position" => {
                let value = DVec3::from_array(self.numbers(name, values)?);
                added = self.timeline.position.push(EaseKey { frame, value, ease });
            }
            "orientation" => {
                let [x, y, z, angle] = self.numbers(name, values)?;
                let Some(axis) = DVec3::new(x, y, z).try_normalize() else {
                    return Err(self.wrong(values[0].span, "the axis of a rotation can't be 0 0 0"));
                };
                let v = axis * libm::sin(0.5 * angle);
                let value = DQuat::from_xyzw(v.x, v.y, v.z, libm::cos(0.5 * angle));
                added = self
                    .timeline
                    .orientation
                    .push(EaseKey { frame, value, ease });
            }
            _ => {}
        }
        self.last.push((frame, frame_word.span));
        added.map_err(|last| {
            self.wrong(
                frame_word.span,
                format!("the keys of `{}` are not in order of frames", name.text),
            )
            .with_help(format!(
                "the key before it is at frame {last}; sort the keys by frame"
            ))
        })
    }

    fn ease(&self, name: TimelineWord<'_>, words: &[TimelineWord<'_>]) -> Result<Ease> {
        let mut all = String::new();
        for word in words {
            if Ease::parse(word.text).is_none() {
                let known = PACES.iter().map(|p| p.0).chain(SCALES.iter().map(|s| s.0));
                let known = known.collect::<Vec<_>>().join(", ");
                return Err(self
                    .wrong(
                        word.span,
                        format!("`{}` is not an interpolation", word.text),
                    )
                    .with_help(format!("use {known}")));
            }
            all += word.text;
            all.push(' ');
        }
        let ease = Ease::parse(&all).unwrap_or_default();
        if ease.scale != Scale::Distance && name.text != "focus" {
            return Err(self
                .wrong(words[0].span, format!("`{}` is not a distance", name.text))
                .with_help("`diopters` and `travel` are for `focus`"));
        }
        Ok(ease)
    }

    fn distance(&self, name: TimelineWord<'_>, values: &[TimelineWord<'_>]) -> Result<f64> {
        let [word] = self.exactly(name, values)?;
        let distance = distance(word.text).map(|Meters(d)| d);
        distance.ok_or_else(|| {
            self.wrong(word.span, "not a distance to focus at")
                .with_help("give meters such as 1.2, or a length such as 40cm, or inf")
        })
    }

    fn f_number(&self, name: TimelineWord<'_>, values: &[TimelineWord<'_>]) -> Result<f64> {
        let [word] = self.exactly(name, values)?;
        let number = word.text.trim_start_matches("f/").parse().ok();
        number
            .filter(|n: &f64| *n > 0.0 && n.is_finite())
            .ok_or_else(|| {
                self.wrong(word.span, "not an f-number")
                    .with_help("write it as f/8 or 8")
            })
    }

    fn positive<const N: usize>(
        &self,
        name: TimelineWord<'_>,
        values: &[TimelineWord<'_>],
    ) -> Result<[f64; N]> {
        let numbers = self.numbers(name, values)?;
        match numbers.iter().position(|n| !(*n > 0.0)) {
            None => Ok(numbers),
            Some(i) => Err(self.wrong(values[i].span, "not a number greater than 0")),
        }
    }

    fn numbers<const N: usize>(
        &self,
        name: TimelineWord<'_>,
        values: &[TimelineWord<'_>],
    ) -> Result<[f64; N]> {
        let words: [TimelineWord<'_>; N] = self.exactly(name, values)?;
        let mut numbers = [0.0; N];
        for (number, word) in numbers.iter_mut().zip(words) {
            *number = self.number(word)?;
        }
        Ok(numbers)
    }

    fn exactly<'w, const N: usize>(
        &self,
        name: TimelineWord<'w>,
        values: &[TimelineWord<'w>],
    ) -> Result<[TimelineWord<'w>; N]> {
        values.try_into().map_err(|_| {
            let span = values.get(N).map_or(name.span, |w| w.span);
            let found = values.len();
            self.wrong(
                span,
                format!("`{}` takes {N} values, not {found}", name.text),
            )
        })
    }

    fn number(&self, word: TimelineWord<'_>) -> Result<f64> {
        let number: Option<f64> = word.text.parse().ok();
        number
            .filter(|n| n.is_finite())
            .ok_or_else(|| self.wrong(word.span, format!("`{}` is not a number", word.text)))
    }

    fn wrong(&self, span: Span, what: impl Into<String>) -> Box<Diagnostic> {
        Diagnostic::error(what).at(self.source, span)
    }
}

/// Splits a line, which starts at a byte of the file, into words.
fn words(line: &str, start: usize) -> Vec<TimelineWord<'_>> {
    line.split_whitespace()
        .map(|text| {
            // `text` is a slice of `line`, so the difference of addresses is its offset.
            let at = start + (text.as_ptr() as usize - line.as_ptr() as usize);
            TimelineWord {
                text,
                span: Span::new(at, at + text.len()),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::timeline::{Moment, Travel};
    use super::*;

    const NO_TRAVEL: &Travel<'static> = &|_| None;

    /// Returns the image distance of a thin lens of 50 mm, f·d/(d − f).
    fn thin(distance: f64) -> Option<f64> {
        let d = 1000.0 * distance;
        (d > 50.0).then(|| 50.0 * d / (d - 50.0))
    }

    fn read(text: &str) -> Result<Timeline> {
        Timeline::read(&Arc::new(Source::new("t.film", text.as_bytes().to_vec())))
    }

    fn pull(words: &str) -> Vec<f64> {
        let ease = Ease::parse(words).unwrap();
        let timeline = Timeline::pull_focus(1.0, 4.0, 7, ease).unwrap();
        (0..7)
            .map(|f| timeline.at(f64::from(f), &thin).focus.unwrap())
            .collect()
    }

    #[test]
    fn a_focus_pull_is_linear_in_its_own_scale_and_ends_exactly() {
        let even = |values: Vec<f64>| {
            let step = (values[6] - values[0]) / 6.0;
            for (i, v) in values.iter().enumerate() {
                assert!((v - values[0] - i as f64 * step).abs() < 1e-9, "{values:?}");
            }
        };
        even(pull("distance"));
        even(pull("diopters").iter().map(|d| 1.0 / d).collect());
        even(pull("travel").iter().map(|d| thin(*d).unwrap()).collect());
        for words in ["distance", "diopters", "travel smooth"] {
            let values = pull(words);
            assert_eq!((values[0], values[6]), (1.0, 4.0));
        }
    }

    #[test]
    fn a_smooth_pull_starts_and_ends_slowly_and_is_half_way_in_the_middle() {
        let values = pull("smooth");
        assert!((values[3] - 2.5).abs() < 1e-12);
        assert!(values[1] - values[0] < 0.5 * (values[3] - values[2]));
        assert_eq!(pull("hold"), [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 4.0]);
    }

    #[test]
    fn a_timeline_is_read_with_units_comments_and_interpolations() {
        let text = "# a film\nframes 100\nrate 25\nshutter 0.5\n\
                    focus 0 120cm # near\nfocus 99 inf diopters smooth\n\
                    position 0 0 0 5\nposition 50 0 2 5\n\
                    orientation 0 0 1 0 0\norientation 50 0 1 0 1.0\naperture 0 f/8\n";
        let timeline = read(text).unwrap();
        assert_eq!((timeline.frames, timeline.rate), (100, 25.0));
        let moment = timeline.at(25.0, NO_TRAVEL);
        assert_eq!(moment.position, Some(DVec3::new(0.0, 1.0, 5.0)));
        let turn = moment.orientation.unwrap();
        let half = DQuat::from_axis_angle(DVec3::Y, 0.5);
        assert!(turn.dot(half) > 1.0 - 1e-12);
        assert_eq!(moment.f_number, Some(8.0));
        assert_eq!(moment.zoom, None);
        assert_eq!(timeline.at(99.0, NO_TRAVEL).focus, Some(f64::INFINITY));
        assert!(timeline.at(98.0, NO_TRAVEL).focus.unwrap() > 100.0);
    }

    #[test]
    fn a_wrong_line_is_reported_with_its_location_and_a_remedy() {
        for (text, place, what) in [
            (
                "frames 10\nfocus 5 1\nfocus 3 2\n",
                (3, 7),
                "not in order of frames",
            ),
            (
                "frames 10\nfocus 5 1\nfocus 5 2\n",
                (3, 7),
                "not in order of frames",
            ),
            ("frames 10\nfocsu 5 1\n", (2, 1), "no track"),
            ("frames 10\nfocus 0 -1\n", (2, 9), "not a distance"),
            ("frames 10\nfocus 0 1 smoth\n", (2, 1), "takes 1"),
            (
                "frames 10\nfocus 0 1 smooth fast\n",
                (2, 18),
                "not an interpolation",
            ),
            ("frames 10\nzoom 0 1 diopters\n", (2, 10), "not a distance"),
            ("frames 10\nfocus 50 1\n", (2, 7), "after the end"),
            ("frames ten\n", (1, 8), "not a number"),
            ("focus 0 1\n", (1, 1), "how many frames"),
            ("frames 3\nposition 0 1 2\n", (2, 1), "takes 3"),
            ("frames 3\nshutter 2\n", (2, 9), "part of a frame"),
            ("frames 3\nrate 1001\n", (2, 6), "not a rate"),
            ("frames 3\nframes 4\n", (2, 1), "second line `frames`"),
            ("\u{feff}frames 3\nrate 0\n", (2, 6), "not a rate"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.message.contains(what), "{text}: {}", error.message);
            let (_, at) = error.location();
            // A misspelled interpolation counts as an excess value, and its own location is
            // reported.
            let place = if text.contains("smoth") {
                (2, 11)
            } else {
                place
            };
            assert_eq!(at, Some(place), "{text}");
        }
    }

    #[test]
    fn a_pull_to_infinity_is_linear_in_diopters_and_never_jumps() {
        for ease in ["distance", "diopters", "travel"] {
            let ease = Ease::parse(ease).unwrap();
            let timeline = Timeline::pull_focus(1.0, f64::INFINITY, 5, ease).unwrap();
            let at = |frame| timeline.at(frame, NO_TRAVEL).focus.unwrap();
            assert_eq!(
                [at(0.0), at(1.0), at(2.0), at(3.0)],
                [1.0, 4.0 / 3.0, 2.0, 4.0]
            );
            assert_eq!(at(4.0), f64::INFINITY);
        }
    }

    #[test]
    fn focus_nearer_than_the_lens_can_is_refused_with_its_frame() {
        let timeline = Timeline::pull_focus(1.0, 0.02, 50, Ease::default()).unwrap();
        let reaches = |moment: &Moment| moment.focus.is_some_and(|d| thin(d).is_some());
        let error = timeline.check_focus(&thin, &reaches).unwrap_err();
        // 1 - 0.02·f reaches 50 mm at frame 47.5.
        assert!(error.message.contains("frame 48"), "{}", error.message);
        let good = Timeline::pull_focus(1.0, 0.06, 50, Ease::default()).unwrap();
        assert!(good.check_focus(&thin, &reaches).is_ok());
    }

    #[test]
    fn an_open_shutter_is_sampled_evenly_over_its_part_of_the_frame() {
        let mut timeline = Timeline::pull_focus(0.0, 10.0, 11, Ease::default()).unwrap();
        let at = |t: &Timeline| -> Vec<f64> {
            let moments = t.exposures(4, 4, NO_TRAVEL);
            moments.iter().map(|m| m.focus.unwrap()).collect()
        };
        assert_eq!(at(&timeline), [4.0]);
        timeline.shutter = 0.5;
        assert_eq!(at(&timeline), [4.0625, 4.1875, 4.3125, 4.4375]);
    }
}
