//! Local contrast, which hardly changes with gain, gamma and lighting.

use crate::plane::Plane;

/// Returns the local contrast: the difference of the brightness from its surroundings, over the
/// standard deviation there. Gain, offset, gamma and slow shading hardly change it. `counts` is as
/// for [`detail`].
pub(super) fn contrast(luma: &Plane, sigma: f64, counts: Option<&Plane>) -> Plane {
    let (off, spread) = detail(luma, sigma, counts);
    off.zip(&spread, |v, s| v / (s + 0.02))
}

/// Returns the difference of the brightness from its surroundings, and the standard deviation
/// there. `counts` is 0 at pixels that have no effect on others, and 1 at the rest.
pub(super) fn detail(luma: &Plane, sigma: f64, counts: Option<&Plane>) -> (Plane, Plane) {
    let smooth = blurred(luma, sigma, counts);
    let around = blurred(&smooth, 6.0, counts);
    let off = smooth.zip(&around, |v, a| v - a);
    let squares = blurred(&off.map(|v| v * v), 6.0, counts);
    (off, squares.map(|s| s.max(0.0).sqrt()))
}

/// Returns the mean of the pixels that count, weighted by a Gaussian.
fn blurred(plane: &Plane, sigma: f64, counts: Option<&Plane>) -> Plane {
    let Some(counts) = counts else {
        return plane.blurred(sigma);
    };
    let sums = plane.zip(counts, |v, c| v * c).blurred(sigma);
    sums.zip(&counts.blurred(sigma), |sum, c| sum / c.max(1e-9))
}
