//! Local contrast, which hardly changes with gain, gamma and lighting.

use crate::plane::Plane;

/// Returns the local contrast: the difference of the brightness from its surroundings, over the
/// standard deviation there. Gain, offset, gamma and slow shading hardly change it.
pub(super) fn contrast(luma: &Plane, sigma: f64) -> Plane {
    let (off, spread) = detail(luma, sigma);
    off.zip(&spread, |v, s| v / (s + 0.02))
}

/// Returns the difference of the brightness from its surroundings, and the standard deviation
/// there.
pub(super) fn detail(luma: &Plane, sigma: f64) -> (Plane, Plane) {
    let smooth = luma.blurred(sigma);
    let around = smooth.blurred(6.0);
    let off = smooth.zip(&around, |v, a| v - a);
    let squares = off.map(|v| v * v).blurred(6.0);
    (off, squares.map(|s| s.max(0.0).sqrt()))
}
