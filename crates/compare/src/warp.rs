//! Scaled rotations and shifts between two pictures, and resampling by them.
//!
//! Positions are in pixels from the center of their picture, x right and y down.

use glam::DVec2;

use crate::metric::Mask;
use crate::plane::{Plane, Plate};

/// A map from points of the new picture to points of the old one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Warp {
    /// A scaled rotation: the cosine and sine, times the pixels of the old picture in one of the
    /// new.
    pub turn: DVec2,
    /// The point of the old picture at the new one's center.
    pub shift: DVec2,
}

impl Warp {
    /// Returns the point of the old picture for a point of the new one.
    pub fn apply(self, p: DVec2) -> DVec2 {
        self.turn.rotate(p) + self.shift
    }

    /// Returns the pixels of the old picture in one of the new.
    pub fn scale(self) -> f64 {
        self.turn.length()
    }

    /// Returns the largest distance, in pixels of the old picture, between where two warps put a
    /// corner of the new one.
    pub(super) fn distance(self, other: Self, new: &Plane) -> f64 {
        let half = half(new);
        let across = DVec2::new(half.x, -half.y);
        let off = |p: DVec2| self.apply(p).distance(other.apply(p));
        [half, -half, across, -across]
            .map(off)
            .into_iter()
            .fold(0.0, f64::max)
    }

    /// Returns the warp in the middle between two similar ones.
    pub(super) fn middle(self, other: Self) -> Self {
        Self {
            turn: 0.5 * (self.turn + other.turn),
            shift: 0.5 * (self.shift + other.shift),
        }
    }

    /// Returns the same warp for the pictures reduced by these ratios.
    pub fn between(self, new_ratio: f64, old_ratio: f64) -> Self {
        Self {
            turn: self.turn * (new_ratio / old_ratio),
            shift: self.shift / old_ratio,
        }
    }
}

/// Resamples the old picture on the new one's pixels; the mask has the pixels that it covers.
pub fn resample(old: &Plate, warp: Warp, width: usize, height: usize) -> (Plate, Mask) {
    let ratio = warp.scale().max(1.0);
    let reduced = old.map(|p| reduced(p, ratio));
    let warp = warp.between(1.0, ratio);
    let center = 0.5 * DVec2::new(width as f64, height as f64);
    let place = |x: usize, y: usize| warp.apply(DVec2::new(x as f64, y as f64) + 0.5 - center);
    let plate = reduced.map(|p| {
        Plane::from_fn(width, height, |x, y| {
            let at = place(x, y) + half(p);
            p.sample(at.x, at.y)
        })
    });
    let inside = |i: usize| is_inside(&reduced.channels[0], place(i % width, i / width), 0.5);
    let mask = Mask {
        width,
        height,
        counts: (0..width * height).map(inside).collect(),
    };
    (plate, mask)
}

/// Returns a smaller picture with the same center, whose pixels are `ratio` old ones wide.
pub(super) fn reduced(picture: &Plane, ratio: f64) -> Plane {
    if ratio <= 1.0 {
        return picture.clone();
    }
    let smooth = picture.blurred(0.4 * (ratio * ratio - 1.0).sqrt().max(0.1));
    let size = |n: usize| ((n as f64 / ratio).floor() as usize).max(1);
    let (width, height) = (size(picture.width), size(picture.height));
    let center = 0.5 * DVec2::new(width as f64, height as f64);
    Plane::from_fn(width, height, |x, y| {
        let p = DVec2::new(x as f64, y as f64) + 0.5 - center;
        let at = ratio * p + half(picture);
        smooth.sample(at.x, at.y)
    })
}

/// Returns half of the size, the position of the center from the corner.
pub(super) fn half(picture: &Plane) -> DVec2 {
    0.5 * DVec2::new(picture.width as f64, picture.height as f64)
}

/// Returns whether a position is at least `margin` pixels from the border. At 0.5 it has a pixel on
/// every side.
pub(super) fn is_inside(picture: &Plane, p: DVec2, margin: f64) -> bool {
    let room = half(picture) - margin + 1e-9;
    p.x.abs() <= room.x && p.y.abs() <= room.y
}
