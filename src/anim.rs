//! What changes from frame to frame: focus, zoom, aperture, the camera's path, the scene's time.
//!
//! A timeline is a text file, one key a line (`docs/guide/film.md`):
//!
//! ```text
//! frames 200
//! focus    0    1.2
//! focus    199  1.99   diopters smooth
//! position 0    0 0.7 1.6
//! ```
//!
//! The paper pulls focus over 200 frames and says that the choice of the function between them
//! matters; the three that it could mean are here.

use std::sync::Arc;

use glam::{DQuat, DVec3};

use crate::diag::{Diagnostic, Result, Source, Span, nearest};
use crate::math::{LengthUnit, Meters, parse_length};

/// Frames that a timeline can have: an hour and a half.
const MOST_FRAMES: u32 = 200_000;

/// How a value goes from the key before to this one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ease {
    pub pace: Pace,
    pub scale: Scale,
}

/// How fast, over the frames between two keys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pace {
    /// At one speed.
    #[default]
    Linear,
    /// Starts and ends at rest: 3t² − 2t³.
    Smooth,
    /// Not at all until the key.
    Hold,
}

/// In what a focus moves evenly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    #[default]
    Distance,
    /// One over the distance: blur grows evenly.
    Diopters,
    /// The way of the film, or of the lens: as a hand turns the ring.
    Travel,
}

impl Pace {
    /// The part of the way after a part of the time.
    pub fn at(self, t: f64) -> f64 {
        match self {
            Self::Linear => t,
            Self::Smooth => t * t * (3.0 - 2.0 * t),
            Self::Hold => t.floor(),
        }
    }
}

/// The words for a pace and a scale.
pub const PACES: [(&str, Pace); 3] = [
    ("linear", Pace::Linear),
    ("smooth", Pace::Smooth),
    ("hold", Pace::Hold),
];
pub const SCALES: [(&str, Scale); 3] = [
    ("distance", Scale::Distance),
    ("diopters", Scale::Diopters),
    ("travel", Scale::Travel),
];

impl Ease {
    /// Reads words such as `diopters smooth`; those left out stay as they are by default.
    pub fn parse(words: &str) -> Option<Self> {
        let mut ease = Self::default();
        for word in words.split([' ', ',', '+']).filter(|w| !w.is_empty()) {
            if let Some((_, pace)) = PACES.iter().find(|(n, _)| *n == word) {
                ease.pace = *pace;
            } else {
                ease.scale = SCALES.iter().find(|(n, _)| *n == word)?.1;
            }
        }
        Some(ease)
    }
}

/// A value at a frame, and how it is reached from the key before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key<T> {
    pub frame: f64,
    pub value: T,
    pub ease: Ease,
}

/// The keys of one value, by rising frame. Before the first and after the last it stands still.
#[derive(Clone, Debug, PartialEq)]
pub struct Track<T> {
    keys: Vec<Key<T>>,
}

impl<T> Default for Track<T> {
    fn default() -> Self {
        Self { keys: Vec::new() }
    }
}

impl<T: Copy> Track<T> {
    pub fn keys(&self) -> &[Key<T>] {
        &self.keys
    }

    /// Adds a key after the last.
    ///
    /// # Errors
    /// A frame that is not after the last one's, which is given back.
    pub fn push(&mut self, key: Key<T>) -> std::result::Result<(), f64> {
        match self.keys.last() {
            Some(last) if !(key.frame > last.frame) => Err(last.frame),
            _ => {
                self.keys.push(key);
                Ok(())
            }
        }
    }

    /// The value at a frame; `between(a, b, part, scale)` mixes two. `None` without keys.
    pub fn at(&self, frame: f64, between: impl Fn(T, T, f64, Scale) -> T) -> Option<T> {
        let after = self.keys.partition_point(|k| k.frame <= frame);
        let Some(last) = after.checked_sub(1).map(|i| self.keys[i]) else {
            return self.keys.first().map(|k| k.value);
        };
        let Some(next) = self.keys.get(after) else {
            return Some(last.value);
        };
        let part = next
            .ease
            .pace
            .at((frame - last.frame) / (next.frame - last.frame));
        Some(between(last.value, next.value, part, next.ease.scale))
    }
}

/// Everything that a film can change. A track without keys leaves its value as the plan has it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Timeline {
    pub frames: u32,
    /// Frames a second of the film.
    pub rate: f64,
    /// The part of a frame during which the shutter is open; 0 is an instant.
    pub shutter: f64,
    /// Distance in focus, in meters.
    pub focus: Track<f64>,
    /// Factor on the lens.
    pub zoom: Track<f64>,
    /// f-number.
    pub aperture: Track<f64>,
    pub position: Track<DVec3>,
    pub orientation: Track<DQuat>,
    /// The scene's own time in seconds.
    pub time: Track<f64>,
}

/// The values at one moment; `None` is left as the plan has it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    pub focus: Option<f64>,
    pub zoom: Option<f64>,
    pub f_number: Option<f64>,
    pub position: Option<DVec3>,
    pub orientation: Option<DQuat>,
    pub time: Option<f64>,
}

/// The way of film or lens (millimeters) that focuses at a distance (meters); `None` where none
/// does.
pub type Travel<'a> = dyn Fn(f64) -> Option<f64> + 'a;

impl Timeline {
    /// Nothing moves.
    pub fn still(frames: u32) -> Self {
        Self {
            frames,
            rate: 24.0,
            ..Self::default()
        }
    }

    /// Focus goes from one distance (meters) to another.
    ///
    /// # Errors
    /// No frames, or too many.
    pub fn pull_focus(from: f64, to: f64, frames: u32, ease: Ease) -> Result<Self> {
        if !(2..=MOST_FRAMES).contains(&frames) {
            return Err(
                Diagnostic::error(format!("a pull of focus can't have {frames} frames"))
                    .with_help(format!("give 2 to {MOST_FRAMES}; the paper's has 200")),
            );
        }
        let mut this = Self::still(frames);
        for (frame, value) in [(0.0, from), (f64::from(frames - 1), to)] {
            // The second frame is after the first, so that neither is refused.
            let _ = this.focus.push(Key { frame, value, ease });
        }
        Ok(this)
    }

    /// What is to be seen at a frame, or between two.
    pub fn at(&self, frame: f64, travel: &Travel<'_>) -> Moment {
        let even = |a: f64, b: f64, t: f64, _| a + t * (b - a);
        let ratio = |a: f64, b: f64, t: f64, _| a * libm::pow(b / a, t);
        Moment {
            focus: self.focus.at(frame, |a, b, t, scale| {
                focus_between(a, b, t, scale, travel)
            }),
            zoom: self.zoom.at(frame, ratio),
            f_number: self.aperture.at(frame, ratio),
            position: self.position.at(frame, |a, b, t, _| a.lerp(b, t)),
            orientation: self
                .orientation
                .at(frame, |a, b, t, _| turn_between(a, b, t)),
            time: self.time.at(frame, even),
        }
    }

    /// Moments over which one frame is exposed, each for an equal part of it.
    pub fn exposures(&self, frame: u32, count: u32, travel: &Travel<'_>) -> Vec<Moment> {
        if self.shutter <= 0.0 {
            return vec![self.at(f64::from(frame), travel)];
        }
        let part = |i: u32| (f64::from(i) + 0.5) / f64::from(count);
        (0..count)
            .map(|i| self.at(f64::from(frame) + self.shutter * part(i), travel))
            .collect()
    }

    /// Whether the lens can follow the focus of every frame; `reaches` tells it of one, where the
    /// lens may be zoomed.
    ///
    /// # Errors
    /// The first frame at which it can't, and the distance.
    pub fn check_focus(
        &self,
        travel: &Travel<'_>,
        reaches: &dyn Fn(&Moment) -> bool,
    ) -> Result<()> {
        for frame in 0..self.frames {
            let moment = self.at(f64::from(frame), travel);
            let Some(distance) = moment.focus else {
                return Ok(());
            };
            if !(distance > 0.0) || !reaches(&moment) {
                return Err(Diagnostic::error(format!(
                    "frame {frame} focuses at {distance:.4} m, nearer than the lens can"
                ))
                .with_help(
                    "focus farther away, or use a shorter lens (`--efl`); `ivcam lens NAME \
                     --focus DISTANCE` tells the nearest distance",
                ));
            }
        }
        Ok(())
    }

    /// Reads the text of a timeline.
    ///
    /// # Errors
    /// The first line that is wrong, with its place.
    pub fn read(source: &Arc<Source>) -> Result<Self> {
        Reader::new(source).read()
    }
}

/// Even in the scale asked for; in distance where the lens can't follow.
fn focus_between(from: f64, to: f64, t: f64, scale: Scale, travel: &Travel<'_>) -> f64 {
    if t <= 0.0 || t >= 1.0 || from == to {
        return if t < 0.5 { from } else { to };
    }
    let even = from + t * (to - from);
    let diopters = 1.0 / (1.0 / from + t * (1.0 / to - 1.0 / from));
    match scale {
        // No part of the way to infinity is a distance.
        Scale::Distance if even.is_infinite() => diopters,
        Scale::Distance => even,
        Scale::Diopters => diopters,
        Scale::Travel => {
            let (Some(a), Some(b)) = (travel(from), travel(to)) else {
                return if even.is_infinite() { diopters } else { even };
            };
            distance_of_travel(a + t * (b - a), (from, a), (to, b), travel)
        }
    }
}

/// The distance between two known ones whose travel is this, by halving in diopters.
fn distance_of_travel(
    aim: f64,
    (mut near, near_travel): (f64, f64),
    (mut far, far_travel): (f64, f64),
    travel: &Travel<'_>,
) -> f64 {
    let rising = far_travel > near_travel;
    let middle = |a: f64, b: f64| 2.0 / (1.0 / a + 1.0 / b);
    for _ in 0..60 {
        let mid = middle(near, far);
        let Some(at) = travel(mid) else { break };
        if (at < aim) == rising {
            near = mid;
        } else {
            far = mid;
        }
    }
    middle(near, far)
}

/// Along the shorter arc, at an even rate.
fn turn_between(a: DQuat, b: DQuat, t: f64) -> DQuat {
    let b = if a.dot(b) < 0.0 { -b } else { b };
    let cos = a.dot(b).clamp(-1.0, 1.0);
    let angle = libm::acos(cos);
    if angle < 1e-9 {
        return a;
    }
    let part = |t: f64| libm::sin(t * angle) / libm::sin(angle);
    (a * part(1.0 - t) + b * part(t)).normalize()
}

/// A word of a line and where it stands.
#[derive(Clone, Copy)]
struct Word<'a> {
    text: &'a str,
    span: Span,
}

struct Reader<'a> {
    source: &'a Arc<Source>,
    timeline: Timeline,
    /// The last key of each track, to be held against the number of frames.
    last: Vec<(f64, Span)>,
}

/// The first words a line can have.
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

impl<'a> Reader<'a> {
    fn new(source: &'a Arc<Source>) -> Self {
        let mut timeline = Timeline::still(0);
        timeline.rate = 24.0;
        Self {
            source,
            timeline,
            last: Vec::new(),
        }
    }

    fn read(mut self) -> Result<Timeline> {
        let source = self.source.clone();
        let text = std::str::from_utf8(&source.bytes)
            .map_err(|e| self.wrong(Span::at(e.valid_up_to()), "a timeline is text in UTF-8"))?;
        let mut start = 0;
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
                    .wrong(span, format!("frame {frame} lies behind the end"))
                    .with_help(format!(
                        "the timeline has {} frames, from 0",
                        self.timeline.frames
                    )));
            }
        }
        Ok(self.timeline)
    }

    fn line(&mut self, name: Word<'_>, values: &[Word<'_>]) -> Result<()> {
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
                Ok(())
            }
            "rate" => {
                let [rate] = self.positive(name, values)?;
                self.timeline.rate = rate;
                Ok(())
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
                Ok(())
            }
            _ => self.key(name, values),
        }
    }

    /// `TRACK FRAME VALUE… [ease…]`
    fn key(&mut self, name: Word<'_>, values: &[Word<'_>]) -> Result<()> {
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
        let is_ease = |w: &Word<'_>| Ease::parse(w.text).is_some();
        let split = rest.iter().position(is_ease).unwrap_or(rest.len());
        let (values, eases) = rest.split_at(split);
        let ease = self.ease(name, eases)?;
        let mut added = Ok(());
        match name.text {
            "focus" => {
                let value = self.distance(name, values)?;
                added = self.timeline.focus.push(Key { frame, value, ease });
            }
            "zoom" => {
                let [value] = self.positive(name, values)?;
                added = self.timeline.zoom.push(Key { frame, value, ease });
            }
            "aperture" => {
                let value = self.f_number(name, values)?;
                added = self.timeline.aperture.push(Key { frame, value, ease });
            }
            "time" => {
                let [value] = self.numbers(name, values)?;
                added = self.timeline.time.push(Key { frame, value, ease });
            }
            "position" => {
                let value = DVec3::from_array(self.numbers(name, values)?);
                added = self.timeline.position.push(Key { frame, value, ease });
            }
            "orientation" => {
                let [x, y, z, angle] = self.numbers(name, values)?;
                let Some(axis) = DVec3::new(x, y, z).try_normalize() else {
                    return Err(self.wrong(values[0].span, "an axis of no length turns nothing"));
                };
                let v = axis * libm::sin(0.5 * angle);
                let value = DQuat::from_xyzw(v.x, v.y, v.z, libm::cos(0.5 * angle));
                added = self.timeline.orientation.push(Key { frame, value, ease });
            }
            _ => {}
        }
        self.last.push((frame, frame_word.span));
        added.map_err(|last| {
            self.wrong(frame_word.span, format!("`{}` runs backwards", name.text))
                .with_help(format!(
                    "its key before is at frame {last}; keys stand by rising frame"
                ))
        })
    }

    fn ease(&self, name: Word<'_>, words: &[Word<'_>]) -> Result<Ease> {
        let mut all = String::new();
        for word in words {
            if Ease::parse(word.text).is_none() {
                let known = PACES.iter().map(|p| p.0).chain(SCALES.iter().map(|s| s.0));
                let known = known.collect::<Vec<_>>().join(", ");
                return Err(self
                    .wrong(word.span, format!("`{}` is no way to move", word.text))
                    .with_help(format!("there is {known}")));
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

    fn distance(&self, name: Word<'_>, values: &[Word<'_>]) -> Result<f64> {
        let [word] = self.exactly(name, values)?;
        let length = parse_length(word.text, LengthUnit::Meter).map(Meters::from);
        match length {
            Some(Meters(d)) if d > 0.0 => Ok(d),
            _ => Err(self
                .wrong(word.span, "not a distance to focus at")
                .with_help("give meters such as 1.2, or a length such as 40cm, or inf")),
        }
    }

    fn f_number(&self, name: Word<'_>, values: &[Word<'_>]) -> Result<f64> {
        let [word] = self.exactly(name, values)?;
        let number = word.text.trim_start_matches("f/").parse().ok();
        number
            .filter(|n: &f64| *n > 0.0 && n.is_finite())
            .ok_or_else(|| {
                self.wrong(word.span, "not an f-number")
                    .with_help("write it as f/8 or 8")
            })
    }

    fn positive<const N: usize>(&self, name: Word<'_>, values: &[Word<'_>]) -> Result<[f64; N]> {
        let numbers = self.numbers(name, values)?;
        match numbers.iter().position(|n| !(*n > 0.0)) {
            None => Ok(numbers),
            Some(i) => Err(self.wrong(values[i].span, "not a number greater than 0")),
        }
    }

    fn numbers<const N: usize>(&self, name: Word<'_>, values: &[Word<'_>]) -> Result<[f64; N]> {
        let words: [Word<'_>; N] = self.exactly(name, values)?;
        let mut numbers = [0.0; N];
        for (number, word) in numbers.iter_mut().zip(words) {
            *number = self.number(word)?;
        }
        Ok(numbers)
    }

    fn exactly<'w, const N: usize>(
        &self,
        name: Word<'w>,
        values: &[Word<'w>],
    ) -> Result<[Word<'w>; N]> {
        values.try_into().map_err(|_| {
            let span = values.get(N).map_or(name.span, |w| w.span);
            let found = values.len();
            self.wrong(
                span,
                format!("`{}` takes {N} values, not {found}", name.text),
            )
        })
    }

    fn number(&self, word: Word<'_>) -> Result<f64> {
        let number: Option<f64> = word.text.parse().ok();
        number
            .filter(|n| n.is_finite())
            .ok_or_else(|| self.wrong(word.span, format!("`{}` is not a number", word.text)))
    }

    fn wrong(&self, span: Span, what: impl Into<String>) -> Box<Diagnostic> {
        Diagnostic::error(what).at(self.source, span)
    }
}

/// The words of a line that starts at this byte.
fn words(line: &str, start: usize) -> Vec<Word<'_>> {
    line.split_whitespace()
        .map(|text| {
            // A word is a part of the line it was split from.
            let at = start + (text.as_ptr() as usize - line.as_ptr() as usize);
            Word {
                text,
                span: Span::new(at, at + text.len()),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const NO_TRAVEL: &Travel<'static> = &|_| None;

    /// A thin lens of 50 mm: the film is at f·d/(d − f).
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
    fn each_way_to_pull_focus_is_even_in_its_own_scale_and_ends_exactly() {
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
    fn a_timeline_is_read_with_units_comments_and_ways_to_move() {
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
    fn a_wrong_line_is_told_with_its_place_and_what_to_do() {
        for (text, place, what) in [
            (
                "frames 10\nfocus 5 1\nfocus 3 2\n",
                (3, 7),
                "runs backwards",
            ),
            (
                "frames 10\nfocus 5 1\nfocus 5 2\n",
                (3, 7),
                "runs backwards",
            ),
            ("frames 10\nfocsu 5 1\n", (2, 1), "no track"),
            ("frames 10\nfocus 0 -1\n", (2, 9), "not a distance"),
            ("frames 10\nfocus 0 1 smoth\n", (2, 1), "takes 1"),
            ("frames 10\nfocus 0 1 smooth fast\n", (2, 18), "no way"),
            ("frames 10\nzoom 0 1 diopters\n", (2, 10), "not a distance"),
            ("frames 10\nfocus 50 1\n", (2, 7), "behind the end"),
            ("frames ten\n", (1, 8), "not a number"),
            ("focus 0 1\n", (1, 1), "how many frames"),
            ("frames 3\nposition 0 1 2\n", (2, 1), "takes 3"),
            ("frames 3\nshutter 2\n", (2, 9), "part of a frame"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.message.contains(what), "{text}: {}", error.message);
            let (_, at) = error.location();
            // The misspelt way to move is counted as a value too many, and marked itself.
            let place = if text.contains("smoth") {
                (2, 11)
            } else {
                place
            };
            assert_eq!(at, Some(place), "{text}");
        }
    }

    #[test]
    fn a_pull_to_infinity_is_even_in_diopters_and_never_jumps() {
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
