//! The timeline of a movie: the values that change, at any moment.

use std::ops::RangeInclusive;

use glam::{DQuat, DVec3};
use ivcam_base::diag::{Diagnostic, Result};

use super::ease::{Ease, EaseKey, Scale, Track};

/// The largest number of frames of a timeline, more than two hours at 24 frames per second.
pub(super) const MOST_FRAMES: u32 = 200_000;

/// The frames per second that a movie can have.
pub(crate) const RATES: RangeInclusive<f64> = 0.001..=1000.0;
/// [`RATES`], for messages.
pub(crate) const RATES_TEXT: &str = "from 0.001 to 1000";

/// The values that change in a movie. A track without keys leaves the plan's value.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Timeline {
    /// The number of frames.
    pub frames: u32,
    /// Frames per second.
    pub rate: f64,
    /// The part of a frame's time that the shutter is open; 0 is an instant.
    pub shutter: f64,
    /// The focus distance in meters.
    pub(crate) focus: Track<f64>,
    /// The scale factor of the lens.
    pub(crate) zoom: Track<f64>,
    /// The f-number.
    pub(crate) aperture: Track<f64>,
    /// The position of the camera.
    pub(crate) position: Track<DVec3>,
    /// The orientation of the camera.
    pub(crate) orientation: Track<DQuat>,
    /// The time of the scene in seconds.
    pub(crate) time: Track<f64>,
}

/// The values at one moment; `None` leaves the plan's value.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    /// The focus distance in meters.
    pub focus: Option<f64>,
    /// The scale factor of the lens.
    pub zoom: Option<f64>,
    /// The f-number.
    pub f_number: Option<f64>,
    /// The position of the camera in meters.
    pub position: Option<DVec3>,
    /// The orientation of the camera.
    pub orientation: Option<DQuat>,
    /// The time of the scene in seconds.
    pub time: Option<f64>,
}

/// A function from a focus distance in meters to the travel of film or lens in millimeters, or
/// `None` if the lens cannot focus there.
pub(crate) type Travel<'a> = dyn Fn(f64) -> Option<f64> + 'a;

impl Timeline {
    /// Returns a timeline in which nothing changes, at 24 frames per second.
    pub(crate) fn still(frames: u32) -> Self {
        Self {
            frames,
            rate: 24.0,
            ..Self::default()
        }
    }

    /// Returns a timeline that pulls focus from one distance in meters to another.
    ///
    /// # Errors
    /// Fails if there are fewer than 2 frames or too many.
    pub(crate) fn pull_focus(from: f64, to: f64, frames: u32, ease: Ease) -> Result<Self> {
        if !(2..=MOST_FRAMES).contains(&frames) {
            return Err(
                Diagnostic::error(format!("a focus pull can't have {frames} frames"))
                    .with_help(format!("give 2 to {MOST_FRAMES}; the paper's has 200")),
            );
        }
        let mut this = Self::still(frames);
        for (frame, value) in [(0.0, from), (f64::from(frames - 1), to)] {
            // `push` fails only for keys out of order.
            let _ = this.focus.push(EaseKey { frame, value, ease });
        }
        Ok(this)
    }

    /// Returns the values at a frame, or between two.
    pub(crate) fn at(&self, frame: f64, travel: &Travel<'_>) -> Moment {
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

    /// Returns the moments that one frame is exposed at, each for an equal part of it.
    pub fn exposures(&self, frame: u32, count: u32, travel: &Travel<'_>) -> Vec<Moment> {
        if self.shutter <= 0.0 {
            return vec![self.at(f64::from(frame), travel)];
        }
        let part = |i: u32| (f64::from(i) + 0.5) / f64::from(count);
        (0..count)
            .map(|i| self.at(f64::from(frame) + self.shutter * part(i), travel))
            .collect()
    }

    /// Checks that the lens can focus at the distance of every frame. `reaches` answers for one
    /// moment, with its zoom.
    ///
    /// # Errors
    /// Fails at the first frame that is too near, with the distance.
    pub(crate) fn check_focus(
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
                     --focus DISTANCE` prints the nearest distance",
                ));
            }
        }
        Ok(())
    }
}

/// Interpolates a focus distance linearly in a scale, or in distance if the lens cannot focus
/// there.
fn focus_between(from: f64, to: f64, t: f64, scale: Scale, travel: &Travel<'_>) -> f64 {
    if t <= 0.0 || t >= 1.0 || from == to {
        return if t < 0.5 { from } else { to };
    }
    let even = from + t * (to - from);
    let diopters = 1.0 / (1.0 / from + t * (1.0 / to - 1.0 / from));
    match scale {
        // A linear interpolation to or from infinity has no distances, so diopters are used.
        Scale::Distance if !even.is_finite() => diopters,
        Scale::Distance => even,
        Scale::Diopters => diopters,
        Scale::Travel => {
            let (Some(a), Some(b)) = (travel(from), travel(to)) else {
                return if even.is_finite() { even } else { diopters };
            };
            distance_of_travel(a + t * (b - a), (from, a), (to, b), travel)
        }
    }
}

/// Finds the distance between two known ones that has a given travel, by bisection in diopters.
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

/// Interpolates two orientations along the shorter arc at a constant rate.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_focus_pull_from_infinity_is_the_reverse_of_one_to_infinity() {
        for scale in [Scale::Distance, Scale::Diopters, Scale::Travel] {
            // A travel that is proportional to diopters, and a lens whose travel is unknown.
            let travels: [&Travel<'_>; 2] = [&|distance| Some(1.0 / distance), &|_| None];
            for travel in travels {
                for t in [0.0, 0.25, 0.5, 0.9, 1.0] {
                    let out = focus_between(2.0, f64::INFINITY, t, scale, travel);
                    let back = focus_between(f64::INFINITY, 2.0, 1.0 - t, scale, travel);
                    let diopters = (1.0 - t) / 2.0;
                    for distance in [out, back] {
                        assert!((1.0 / distance - diopters).abs() < 1e-12, "{t}: {distance}");
                    }
                }
            }
        }
    }
}
