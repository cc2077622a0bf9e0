//! The motion of the pointer while it is pressed.

use glam::DVec2;

use super::timer::FRAME;

/// The number of moves of one drag, at most. A longer drag has longer steps.
const MAX_MOVES: f64 = 1_000.0;

/// The places of the pointer in the picture, from the press to the release.
#[derive(Clone, Debug)]
pub(super) struct PointerPath {
    places: Vec<DVec2>,
    /// When it is pressed, in seconds.
    start: f64,
    /// When it is released, in seconds.
    pub(super) end: f64,
}

impl PointerPath {
    /// Begins with the first place at the first of two times, and ends with the last one at the
    /// second. Without a place the pointer stays over what it touches.
    pub(super) fn new(places: Vec<DVec2>, [start, end]: [f64; 2]) -> Self {
        Self {
            places,
            start,
            end: end.max(start),
        }
    }

    /// Returns where the pointer is pressed.
    pub(super) fn first(&self) -> Option<DVec2> {
        self.places.first().copied()
    }

    /// Returns where the pointer is at a time.
    pub(super) fn at(&self, time: f64) -> Option<DVec2> {
        let last = *self.places.last()?;
        if time >= self.end {
            return Some(last);
        }
        let share = (time - self.start).max(0.0) / (self.end - self.start);
        let along = share * (self.places.len() - 1) as f64;
        let first = (along as usize).min(self.places.len() - 1);
        let next = self.places.get(first + 1).unwrap_or(&last);
        Some(self.places[first].lerp(*next, along - first as f64))
    }

    /// Returns the next time after a moment at which it is moved or released.
    pub(super) fn next_time(&self, now: f64) -> f64 {
        let step = FRAME.max((self.end - self.start) / MAX_MOVES);
        let mut moves = ((now - self.start) / step).floor() + 1.0;
        if self.start + moves * step <= now {
            moves += 1.0;
        }
        (self.start + moves * step).min(self.end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pointer_takes_the_same_time_for_each_leg() {
        let places = vec![DVec2::ZERO, DVec2::new(1.0, 0.0), DVec2::new(1.0, 4.0)];
        let path = PointerPath::new(places, [2.0, 4.0]);
        let at = |time| path.at(time).expect("has places");
        assert_eq!(at(1.0), DVec2::ZERO);
        assert_eq!(at(2.5), DVec2::new(0.5, 0.0));
        assert_eq!(at(3.5), DVec2::new(1.0, 2.0));
        assert_eq!(at(9.0), DVec2::new(1.0, 4.0));
    }

    #[test]
    fn the_pointer_moves_in_frames_until_its_release() {
        let path = PointerPath::new(vec![DVec2::ZERO, DVec2::ONE], [1.0, 1.1]);
        let mut times = vec![1.0];
        while times[times.len() - 1] < 1.1 {
            times.push(path.next_time(times[times.len() - 1]));
        }
        assert_eq!(times, [1.0, 1.0 + FRAME, 1.0 + 2.0 * FRAME, 1.1]);
    }
}
