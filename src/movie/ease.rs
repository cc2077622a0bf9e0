//! How a value goes from one key to the next, and the keys of one value.

/// How a value goes from the key before to this one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Ease {
    pub pace: Pace,
    pub scale: Scale,
}

/// How fast, over the frames between two keys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Pace {
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
pub(crate) enum Scale {
    #[default]
    Distance,
    /// One over the distance: blur grows evenly.
    Diopters,
    /// The way of the film, or of the lens: as a hand turns the ring.
    Travel,
}

impl Pace {
    /// The part of the way after a part of the time.
    pub(crate) fn at(self, t: f64) -> f64 {
        match self {
            Self::Linear => t,
            Self::Smooth => t * t * (3.0 - 2.0 * t),
            Self::Hold => t.floor(),
        }
    }
}

/// The words for a pace and a scale.
pub(crate) const PACES: [(&str, Pace); 3] = [
    ("linear", Pace::Linear),
    ("smooth", Pace::Smooth),
    ("hold", Pace::Hold),
];
pub(crate) const SCALES: [(&str, Scale); 3] = [
    ("distance", Scale::Distance),
    ("diopters", Scale::Diopters),
    ("travel", Scale::Travel),
];

impl Ease {
    /// Reads words such as `diopters smooth`; those left out stay as they are by default.
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

/// A value at a frame, and how it is reached from the key before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Key<T> {
    pub frame: f64,
    pub value: T,
    pub ease: Ease,
}

/// The keys of one value, by rising frame. Before the first and after the last it stands still.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Track<T> {
    keys: Vec<Key<T>>,
}

impl<T> Default for Track<T> {
    fn default() -> Self {
        Self { keys: Vec::new() }
    }
}

impl<T: Copy> Track<T> {
    /// Adds a key after the last.
    ///
    /// # Errors
    /// A frame that is not after the last one's, which is given back.
    pub(crate) fn push(&mut self, key: Key<T>) -> std::result::Result<(), f64> {
        match self.keys.last() {
            Some(last) if !(key.frame > last.frame) => Err(last.frame),
            _ => {
                self.keys.push(key);
                Ok(())
            }
        }
    }

    /// The value at a frame; `between(a, b, part, scale)` mixes two. `None` without keys.
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
