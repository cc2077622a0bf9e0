//! Fourier transforms of squares, for the registration of pictures and for convolution.

use glam::DVec2;

/// The Fourier transform of a square field whose side is a power of two.
#[derive(Clone)]
pub struct FourierSpectrum {
    side: usize,
    values: Vec<DVec2>,
}

impl FourierSpectrum {
    /// Transforms a square field, row by row.
    pub fn of(side: usize, mut values: Vec<DVec2>) -> Self {
        debug_assert!(side.is_power_of_two() && values.len() == side * side);
        transform_square(&mut values, side, -1.0);
        Self { side, values }
    }

    /// Returns the spectrum of the field of vectors that is turned by half a turn about the middle
    /// of the square: each vector is reversed, and lies at the opposite place.
    pub fn half_turned(&self) -> Self {
        let side = self.side;
        let phase = |k: usize| {
            let angle = std::f64::consts::TAU * k as f64 / side as f64;
            DVec2::new(libm::cos(angle), libm::sin(angle))
        };
        let phases: Vec<DVec2> = (0..side).map(phase).collect();
        let value = |i: usize| {
            let (x, y) = (i % side, i / side);
            let opposite = self.values[(side - y) % side * side + (side - x) % side];
            -times(times(phases[x], phases[y]), opposite)
        };
        Self {
            side,
            values: (0..side * side).map(value).collect(),
        }
    }

    /// The shift of `self` relative to `other` with the largest real part of the correlation, and
    /// that correlation. `self` at `p + shift` is most similar to `other` at `p`.
    pub fn best_shift(&self, other: &Self) -> ([isize; 2], f64) {
        let products = self.values.iter().zip(&other.values);
        let mut cross: Vec<DVec2> = products.map(|(a, b)| times(*a, conjugate(*b))).collect();
        transform_square(&mut cross, self.side, 1.0);
        let best = (0..cross.len()).fold(0, |m, i| if cross[i].x > cross[m].x { i } else { m });
        let signed = |i: usize| {
            let i = i as isize;
            let side = self.side as isize;
            if 2 * i >= side { i - side } else { i }
        };
        let shift = [signed(best % self.side), signed(best / self.side)];
        (shift, cross[best].x / (self.side * self.side) as f64)
    }
}

/// Transforms a square field: its rows, then its columns. The result is not divided by the number
/// of points. `sign` is that of the exponent: −1 forward, 1 backward.
pub fn transform_square(values: &mut [DVec2], side: usize, sign: f64) {
    let turns: Vec<DVec2> = (0..side / 2)
        .map(|k| {
            let angle = sign * std::f64::consts::TAU * k as f64 / side as f64;
            DVec2::new(libm::cos(angle), libm::sin(angle))
        })
        .collect();
    for row in values.chunks_mut(side) {
        transform(row, &turns);
    }
    let mut column = vec![DVec2::ZERO; side];
    for x in 0..side {
        for (y, c) in column.iter_mut().enumerate() {
            *c = values[y * side + x];
        }
        transform(&mut column, &turns);
        for (y, c) in column.iter().enumerate() {
            values[y * side + x] = *c;
        }
    }
}

/// The transform of Cooley and Tukey, in place. `turns` are the first half of the roots of unity of
/// the length.
fn transform(line: &mut [DVec2], turns: &[DVec2]) {
    let n = line.len();
    let bits = n.trailing_zeros();
    for i in 0..n {
        let j = i.reverse_bits() >> (usize::BITS - bits);
        if i < j {
            line.swap(i, j);
        }
    }
    let mut half = 1;
    while half < n {
        let stride = n / (2 * half);
        for block in line.chunks_mut(2 * half) {
            let (low, high) = block.split_at_mut(half);
            for (k, (l, h)) in low.iter_mut().zip(high).enumerate() {
                let turned = times(turns[k * stride], *h);
                (*l, *h) = (*l + turned, *l - turned);
            }
        }
        half *= 2;
    }
}

/// The product of two complex numbers.
pub fn times(a: DVec2, b: DVec2) -> DVec2 {
    DVec2::new(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x)
}

/// The complex conjugate.
fn conjugate(a: DVec2) -> DVec2 {
    DVec2::new(a.x, -a.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_moved_by_five_and_minus_three_has_that_best_shift() {
        let side = 32;
        let value =
            |x: usize, y: usize| DVec2::new(((x * 7 + y * 13) * (x + 3 * y) % 17) as f64, 0.0);
        let field = |dx: usize, dy: usize| {
            let at = |i: usize| value((i % side + dx) % side, (i / side + dy) % side);
            FourierSpectrum::of(side, (0..side * side).map(at).collect())
        };
        // The second shows at p what the first shows at p + (5, -3).
        let (shift, _) = field(0, 0).best_shift(&field(5, side - 3));
        assert_eq!(shift, [5, -3]);
    }

    #[test]
    fn half_a_turn_reverses_vectors_and_places() {
        let side = 16;
        let value = |i: usize| DVec2::new((i * i % 23) as f64, (i * 7 % 19) as f64 - 5.0);
        let spectrum = |f: &dyn Fn(usize) -> DVec2| {
            FourierSpectrum::of(side, (0..side * side).map(f).collect())
        };
        let turned = spectrum(&value).half_turned();
        let expected = spectrum(&|i| -value(side * side - 1 - i));
        for (a, b) in turned.values.iter().zip(&expected.values) {
            assert!(a.distance(*b) < 1e-9, "{a} {b}");
        }
    }

    #[test]
    fn the_transform_of_a_wave_is_one_line() {
        let wave = |i: usize| {
            let angle = std::f64::consts::TAU * 3.0 * (i % 16) as f64 / 16.0;
            DVec2::new(libm::cos(angle), libm::sin(angle))
        };
        let spectrum = FourierSpectrum::of(16, (0..256).map(wave).collect());
        for (i, v) in spectrum.values.iter().enumerate() {
            let expected = if i == 3 { 256.0 } else { 0.0 };
            assert!((v.length() - expected).abs() < 1e-9);
        }
    }
}
