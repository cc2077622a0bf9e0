//! How a pixel weighs the light around its middle.
//!
//! A sample's place is drawn from the filter itself, so that every sample of a pixel counts the
//! same (but for its sign) and none is shared with a neighbor: pixels stay independent.

/// A separable pixel filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Filter {
    /// The pixel itself, evenly: the 1999 program. Default.
    #[default]
    Box,
    /// Standard deviation ½ pixel, ended at 1½.
    Gaussian,
    /// Blackman and Harris's window of four terms over 3 pixels.
    BlackmanHarris,
    /// Mitchell and Netravali's cubic with B = C = ⅓, over 4 pixels; negative in places.
    Mitchell,
}

/// Parts of a filter's half width in which samples are spread evenly.
const CELLS: usize = 128;

impl Filter {
    pub const ALL: [(&'static str, Self); 4] = [
        ("box", Self::Box),
        ("gaussian", Self::Gaussian),
        ("blackman-harris", Self::BlackmanHarris),
        ("mitchell", Self::Mitchell),
    ];

    pub fn name(self) -> &'static str {
        Self::ALL
            .iter()
            .find(|(_, f)| *f == self)
            .map_or("", |(n, _)| n)
    }

    /// Half the width, in pixels.
    pub fn radius(self) -> f64 {
        match self {
            Self::Box => 0.5,
            Self::Gaussian | Self::BlackmanHarris => 1.5,
            Self::Mitchell => 2.0,
        }
    }

    /// The weight at a distance from the middle along one axis, not normalized.
    pub fn at(self, x: f64) -> f64 {
        let x = x.abs();
        if x > self.radius() {
            return 0.0;
        }
        match self {
            Self::Box => 1.0,
            Self::Gaussian => libm::exp(-2.0 * x * x) - libm::exp(-2.0 * 1.5 * 1.5),
            Self::BlackmanHarris => {
                let angle = std::f64::consts::PI * x / 1.5;
                0.35875
                    + 0.48829 * libm::cos(angle)
                    + 0.14128 * libm::cos(2.0 * angle)
                    + 0.01168 * libm::cos(3.0 * angle)
            }
            Self::Mitchell if x < 1.0 => (7.0 * x * x * x - 12.0 * x * x + 16.0 / 3.0) / 6.0,
            Self::Mitchell => (-7.0 / 3.0 * x * x * x + 12.0 * x * x - 20.0 * x + 32.0 / 3.0) / 6.0,
        }
    }
}

/// A filter made ready for drawing samples.
#[derive(Clone, Debug)]
pub(crate) struct FilterTable {
    filter: Filter,
    /// The share of |filter| in the cells before each, over half the filter.
    before: Vec<f64>,
    /// Integral of the filter over both halves.
    integral: f64,
}

impl FilterTable {
    pub(crate) fn new(filter: Filter) -> Self {
        let width = filter.radius() / CELLS as f64;
        let middle = |i: usize| filter.at((i as f64 + 0.5) * width);
        let mut before = vec![0.0];
        let (mut sum, mut signed) = (0.0, 0.0);
        for i in 0..CELLS {
            // Simpson's rule: exact for the cubics.
            let (a, b) = (i as f64 * width, (i + 1) as f64 * width);
            signed += (filter.at(a) + 4.0 * middle(i) + filter.at(b)) / 6.0;
            // Never nothing, so that no place is left out.
            let most = filter.at(a).abs().max(filter.at(b).abs());
            sum += middle(i).abs().max(most).max(1e-6);
            before.push(sum);
        }
        before.iter_mut().for_each(|b| *b /= sum);
        Self {
            filter,
            before,
            integral: 2.0 * width * signed,
        }
    }

    /// Takes places along one axis from the unit interval to the filter's, and multiplies the
    /// weights by what each counts.
    pub(crate) fn spread(&self, places: &mut [f64], weights: &mut [f64]) {
        if self.filter == Filter::Box {
            return;
        }
        for (place, weight) in places.iter_mut().zip(weights) {
            let (across, share) = self.sample(*place);
            *place = across;
            *weight *= share;
        }
    }

    /// Where from the pixel's corner, and what the sample counts: 1 for most. `u` goes over the
    /// filter from one side to the other, so that what is even in it stays so.
    pub(crate) fn sample(&self, u: f64) -> (f64, f64) {
        if self.filter == Filter::Box {
            return (u, 1.0);
        }
        let (sign, share) = if u < 0.5 {
            (-1.0, 1.0 - 2.0 * u)
        } else {
            (1.0, 2.0 * u - 1.0)
        };
        let i = self.before.partition_point(|b| *b <= share).clamp(1, CELLS) - 1;
        let part = self.before[i + 1] - self.before[i];
        let width = self.filter.radius() / CELLS as f64;
        let x = (i as f64 + (share - self.before[i]) / part) * width;
        let density = 0.5 * part / width;
        let weight = self.filter.at(x) / (density * self.integral);
        (0.5 + sign * x, weight)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Moments of the drawn places against moments of the filter by Simpson's rule.
    #[test]
    fn places_are_drawn_as_the_filter_weighs_them() {
        for (name, filter) in Filter::ALL {
            let table = FilterTable::new(filter);
            let (n, r) = (1 << 18, filter.radius());
            let moment = |k: i32| {
                let f = |i: i32| {
                    let x = r * (2.0 * f64::from(i) / f64::from(n) - 1.0);
                    filter.at(x) * x.powi(k)
                };
                let pair = |i: i32| f(2 * i) + 4.0 * f(2 * i + 1) + f(2 * i + 2);
                (0..n / 2).map(pair).sum::<f64>()
            };
            for k in [0, 1, 2, 4] {
                let drawn: f64 = (0..n)
                    .map(|i| {
                        let (x, w) = table.sample((f64::from(i) + 0.5) / f64::from(n));
                        w * (x - 0.5).powi(k) / f64::from(n)
                    })
                    .sum();
                let exact = moment(k) / moment(0);
                assert!((drawn - exact).abs() < 1e-4, "{name} {k}: {drawn} {exact}");
            }
        }
    }

    #[test]
    fn mitchells_filter_is_one_for_a_field_of_one() {
        // Weights of neighboring pixels add up to 1 at any place.
        for x in [0.0, 0.2, 0.5, 0.9] {
            let sum: f64 = (-2..=2)
                .map(|i| Filter::Mitchell.at(x + f64::from(i)))
                .sum();
            assert!((sum - 1.0).abs() < 1e-12, "{sum}");
        }
    }
}
