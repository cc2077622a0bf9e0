//! Samples of a pixel that are dense in a part of it.

use serde::{Deserialize, Serialize};

/// The share of a pixel's samples that are drawn inside the window only.
const INSIDE: f64 = 0.6;

/// The part of a pixel's samples, by their numbers from 0 to 1 along each axis, that lead to the
/// image of a small light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct SampleWindow {
    pub from: [f64; 2],
    pub size: [f64; 2],
}

impl SampleWindow {
    /// The share of evenly distributed samples that fall into the window.
    pub(super) fn area(&self) -> f64 {
        self.size[0] * self.size[1]
    }

    /// Replaces even numbers of a sample by those that are dense in the window. Returns the weight
    /// of the sample.
    pub(super) fn narrow(&self, numbers: [&mut f64; 2]) -> f64 {
        let [u, v] = numbers;
        let is_narrowed = *u < INSIDE;
        if is_narrowed {
            *u = self.from[0] + *u / INSIDE * self.size[0];
            *v = self.from[1] + *v * self.size[1];
        } else {
            *u = (*u - INSIDE) / (1.0 - INSIDE);
        }
        let is_in = |x: f64, axis: usize| (0.0..=self.size[axis]).contains(&(x - self.from[axis]));
        let density = match is_narrowed || is_in(*u, 0) && is_in(*v, 1) {
            true => 1.0 - INSIDE + INSIDE / self.area(),
            false => 1.0 - INSIDE,
        };
        1.0 / density
    }
}
