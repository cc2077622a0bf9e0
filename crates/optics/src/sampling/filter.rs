//! Pixel filters.
//!
//! The positions of samples are distributed as the filter, so that every sample of a pixel has the
//! same weight except for its sign, and none is shared with a neighbor: pixels stay independent.

/// A separable pixel filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Filter {
    /// A constant over the pixel. This is the default, and what the 1999 program uses.
    #[default]
    Box,
    /// A Gaussian with a standard deviation of ½ pixel, truncated at 1½ pixels.
    Gaussian,
    /// The window of Blackman and Harris with four terms, over 3 pixels.
    BlackmanHarris,
    /// The cubic of Mitchell and Netravali with B = C = ⅓, over 4 pixels. It has negative lobes.
    Mitchell,
}

/// The number of parts of a filter's half width. In each the density of samples is constant.
const CELLS: usize = 128;

impl Filter {
    /// All filters with their names.
    pub const ALL: [(&'static str, Self); 4] = [
        ("box", Self::Box),
        ("gaussian", Self::Gaussian),
        ("blackman-harris", Self::BlackmanHarris),
        ("mitchell", Self::Mitchell),
    ];

    /// The name in options and reports.
    pub fn name(self) -> &'static str {
        Self::ALL
            .iter()
            .find(|(_, f)| *f == self)
            .map_or("", |(n, _)| n)
    }

    /// Half of the width, in pixels.
    pub fn radius(self) -> f64 {
        match self {
            Self::Box => 0.5,
            Self::Gaussian | Self::BlackmanHarris => 1.5,
            Self::Mitchell => 2.0,
        }
    }

    /// The weight at a distance from the middle along one axis, in pixels. It is not normalized.
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

/// A filter prepared for importance sampling.
#[derive(Clone, Debug)]
pub struct FilterTable {
    filter: Filter,
    /// The cumulative distribution of |filter| over half of the filter, at the ends of the cells.
    before: Vec<f64>,
    /// The integral of the filter over its whole width.
    integral: f64,
}

impl FilterTable {
    /// Makes the table of a filter.
    pub fn new(filter: Filter) -> Self {
        let width = filter.radius() / CELLS as f64;
        let middle = |i: usize| filter.at((i as f64 + 0.5) * width);
        let mut before = vec![0.0];
        let (mut sum, mut signed) = (0.0, 0.0);
        for i in 0..CELLS {
            // Simpson's rule is exact for cubics.
            let (a, b) = (i as f64 * width, (i + 1) as f64 * width);
            signed += (filter.at(a) + 4.0 * middle(i) + filter.at(b)) / 6.0;
            // The density is never 0, so that every position may be sampled.
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

    /// Maps numbers in [0, 1) to positions along one axis of the filter, and multiplies `weights`
    /// by the weights of the samples.
    pub fn spread(&self, places: &mut [f64], weights: &mut [f64]) {
        if self.filter == Filter::Box {
            return;
        }
        for (place, weight) in places.iter_mut().zip(weights) {
            let (across, share) = self.sample(*place);
            *place = across;
            *weight *= share;
        }
    }

    /// The position of a sample along one axis, in pixels from the pixel's corner, and its weight,
    /// which is about 1 or −1. The position is a monotonic function of `u`, so that stratified
    /// numbers give stratified positions.
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

    /// Half of the filter's width, in pixels.
    pub fn radius(&self) -> f64 {
        self.filter.radius()
    }

    /// The number that [`FilterTable::spread`] maps to a position along one axis, in pixels from
    /// the pixel's corner; 0 or 1 beyond the filter's ends.
    pub fn number_at(&self, position: f64) -> f64 {
        if self.filter == Filter::Box {
            return position.clamp(0.0, 1.0);
        }
        let x = position - 0.5;
        let cells = x.abs() / self.filter.radius() * CELLS as f64;
        let i = (cells as usize).min(CELLS - 1);
        let part = self.before[i + 1] - self.before[i];
        let share = (self.before[i] + part * (cells - i as f64)).min(1.0);
        0.5 + 0.5 * share.copysign(x)
    }

    /// The share of a light in a pixel's level for each pixel of its area, along one axis: the
    /// filter at a position in pixels from the pixel's corner over its integral.
    pub fn share_at(&self, position: f64) -> f64 {
        self.filter.at(position - 0.5) / self.integral
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_positions_are_inverse() {
        for (name, filter) in Filter::ALL {
            let table = FilterTable::new(filter);
            for i in 0..1000 {
                let u = (f64::from(i) + 0.5) / 1000.0;
                let again = table.number_at(table.sample(u).0);
                assert!((again - u).abs() < 1e-12, "{name}: {u} {again}");
            }
            assert_eq!([-2.0, 3.0].map(|x| table.number_at(x)), [0.0, 1.0]);
        }
    }

    /// The moments of the sampled positions are compared with those of the filter by Simpson's
    /// rule.
    #[test]
    fn positions_are_distributed_as_the_filter() {
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
    fn the_mitchell_filters_of_all_pixels_add_up_to_one() {
        for x in [0.0, 0.2, 0.5, 0.9] {
            let sum: f64 = (-2..=2)
                .map(|i| Filter::Mitchell.at(x + f64::from(i)))
                .sum();
            assert!((sum - 1.0).abs() < 1e-12, "{sum}");
        }
    }
}
