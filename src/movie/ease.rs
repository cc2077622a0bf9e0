//! Interpolation between keys, and the keys of one value.

/// The interpolation from the key before to this one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Ease {
    pub pace: Pace,
    pub scale: Scale,
}

/// The speed of a change over the frames between two keys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Pace {
    /// A constant speed.
    #[default]
    Linear,
    /// A change that starts and ends at rest: 3t² − 2t³.
    Smooth,
    /// No change until the key.
    Hold,
}

/// The quantity in which focus changes linearly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Scale {
    /// The focus distance.
    #[default]
    Distance,
    /// The reciprocal of the distance, in which blur grows linearly.
    Diopters,
    /// The travel of the film or lens, as when a hand turns the focus ring.
    Travel,
}

impl Pace {
    /// Returns the part of the change after a part of the time.
    pub(crate) fn at(self, t: f64) -> f64 {
        match self {
            Self::Linear => t,
            Self::Smooth => t * t * (3.0 - 2.0 * t),
            Self::Hold => t.floor(),
        }
    }
}

/// The names of the paces.
pub(crate) const PACES: [(&str, Pace); 3] = [
    ("linear", Pace::Linear),
    ("smooth", Pace::Smooth),
    ("hold", Pace::Hold),
];
/// The names of the scales.
pub(crate) const SCALES: [(&str, Scale); 3] = [
    ("distance", Scale::Distance),
    ("diopters", Scale::Diopters),
    ("travel", Scale::Travel),
];

impl Ease {
    /// Parses words such as `diopters smooth`. Omitted ones have their defaults.
    pub(crate) fn parse(words: &str) -> Option<Self> {
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

/// A value at a frame, with the interpolation from the key before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EaseKey<T> {
    pub frame: f64,
    pub value: T,
    pub ease: Ease,
}

/// The keys of one value in order of frames. The value is constant before the first key and after
/// the last.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Track<T> {
    keys: Vec<EaseKey<T>>,
}

impl<T> Default for Track<T> {
    fn default() -> Self {
        Self { keys: Vec::new() }
    }
}

impl<T: Copy> Track<T> {
    /// Returns whether the track has no keys.
    pub(crate) fn is_empty(&self) -> bool {
        self.keys.is_empty()
    }

    /// Adds a key after the last.
    ///
    /// # Errors
    /// Returns the last key's frame if the new one is not after it.
    pub(crate) fn push(&mut self, key: EaseKey<T>) -> std::result::Result<(), f64> {
        match self.keys.last() {
            Some(last) if !(key.frame > last.frame) => Err(last.frame),
            _ => {
                self.keys.push(key);
                Ok(())
            }
        }
    }

    /// Returns the value at a frame, or `None` without keys; `between(a, b, part, scale)`
    /// interpolates two values.
    pub(crate) fn at(&self, frame: f64, between: impl Fn(T, T, f64, Scale) -> T) -> Option<T> {
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
