//! Maps from the unit square to the unit disc.

use libm::{cos, sin};

/// A map from the unit square to the unit disc that preserves areas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DiscMap {
    /// r = √u, θ = 2πv, equation 3 of the paper. The 1999 program uses it.
    Polar,
    /// Shirley and Chiu's map of concentric squares to concentric circles, which keeps strata
    /// compact. This is the default.
    Concentric,
}

impl DiscMap {
    /// The point of the unit disc for a point of the unit square.
    pub fn point(self, [u, v]: [f64; 2]) -> [f64; 2] {
        match self {
            Self::Polar => polar_disc(u, v),
            Self::Concentric => concentric_disc(u, v),
        }
    }
}

/// The point with r = √u and θ = 2πv, by equation 3 of the paper.
pub(crate) fn polar_disc(u: f64, v: f64) -> [f64; 2] {
    let (r, angle) = (u.sqrt(), std::f64::consts::TAU * v);
    [r * cos(angle), r * sin(angle)]
}

/// The point by the concentric map (Shirley and Chiu, "A low distortion map between disk and
/// square", 1997).
pub fn concentric_disc(u: f64, v: f64) -> [f64; 2] {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
    let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    if x == 0.0 && y == 0.0 {
        return [0.0, 0.0];
    }
    let (r, angle) = if x.abs() > y.abs() {
        (x, FRAC_PI_4 * (y / x))
    } else {
        (y, FRAC_PI_2 - FRAC_PI_4 * (x / y))
    };
    [r * cos(angle), r * sin(angle)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_maps_cover_the_disc_evenly() {
        // A quarter of the area lies within half the radius, and in each quadrant.
        for map in [DiscMap::Polar, DiscMap::Concentric] {
            let n = 400;
            let (mut inner, mut quadrant) = (0, 0);
            for i in 0..n * n {
                let u = (f64::from(i % n) + 0.5) / f64::from(n);
                let v = (f64::from(i / n) + 0.5) / f64::from(n);
                let [x, y] = map.point([u, v]);
                assert!(x * x + y * y <= 1.0 + 1e-12);
                inner += i32::from(x * x + y * y < 0.25);
                quadrant += i32::from(x > 0.0 && y > 0.0);
            }
            for count in [inner, quadrant] {
                let share = f64::from(count) / f64::from(n * n);
                assert!((share - 0.25).abs() < 2e-3, "{map:?}: {share}");
            }
        }
    }
}
