//! Choosing one of many things in proportion to their weights, in constant time.

/// An alias table (Vose, "A linear algorithm for generating random numbers with a given
/// distribution", 1991).
#[derive(Clone, Debug, Default)]
pub(crate) struct AliasTable {
    /// Of each slot, the share that is its own, and the number that has the rest.
    slots: Vec<(f32, u32)>,
    /// The sum of the weights.
    pub(crate) total: f64,
}

impl AliasTable {
    /// Makes the table of weights, of which none is negative or NaN. Without a positive one it is
    /// empty.
    pub(crate) fn new(weights: &[f32]) -> Self {
        let total: f64 = weights.iter().copied().map(f64::from).sum();
        if !(total > 0.0 && total.is_finite()) {
            return Self::default();
        }
        let scale = weights.len() as f64 / total;
        let mut shares: Vec<f64> = weights.iter().map(|w| f64::from(*w) * scale).collect();
        let mut slots: Vec<(f32, u32)> = (0..weights.len() as u32).map(|i| (1.0, i)).collect();
        let (mut small, mut large): (Vec<u32>, Vec<u32>) =
            (0..weights.len() as u32).partition(|i| shares[*i as usize] < 1.0);
        while let (Some(&low), Some(&high)) = (small.last(), large.last()) {
            small.pop();
            slots[low as usize] = (shares[low as usize] as f32, high);
            let rest = shares[high as usize] - (1.0 - shares[low as usize]);
            shares[high as usize] = rest;
            if rest < 1.0 {
                large.pop();
                small.push(high);
            }
        }
        Self { slots, total }
    }

    /// Whether nothing can be chosen.
    pub(crate) fn is_empty(&self) -> bool {
        self.slots.is_empty()
    }

    /// Chooses by two numbers from 0 to 1, of which the second continues the first below its 24
    /// bits. Returns the choice, and a number from 0 to 1 that does not depend on it.
    ///
    /// Of 24 bits, 2²¹ slots leave three to share a slot, and slots get up to an eighth more or
    /// less than their weight: a picture of 2048 × 1024 pixels lit a scene by 0.7% too little.
    #[inline]
    pub(crate) fn choose(&self, [u, below]: [f32; 2]) -> (u32, f32) {
        const STEP: f64 = 1.0 / (1 << 24) as f64;
        let u = f64::from(u) + f64::from(below) * STEP;
        let at = u * self.slots.len() as f64;
        let slot = (at as usize).min(self.slots.len() - 1);
        let rest = (at - slot as f64) as f32;
        let (own, other) = self.slots[slot];
        let (choice, rest) = match rest < own {
            true => (slot as u32, rest / own),
            false => (other, (rest - own) / (1.0 - own)),
        };
        (choice, rest.clamp(0.0, 1.0f32.next_down()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn choices_have_the_shares_of_their_weights_and_leave_an_even_number() {
        let weights = [0.0, 3.0, 1.0, 0.5, 7.25, 0.0, 1e-3];
        let table = AliasTable::new(&weights);
        let n = 1_000_000;
        let (mut counts, mut rest) = ([0u32; 7], 0.0);
        for i in 0..n {
            let (choice, left) = table.choose([(i as f32 + 0.5) / n as f32, 0.0]);
            counts[choice as usize] += 1;
            rest += f64::from(left) / f64::from(n);
        }
        for (count, weight) in counts.iter().zip(weights) {
            let share = f64::from(*count) / f64::from(n);
            assert!((share - f64::from(weight) / table.total).abs() < 2e-6);
        }
        assert!((rest - 0.5).abs() < 1e-3, "{rest}");
        assert!(AliasTable::new(&[0.0, 0.0]).is_empty() && AliasTable::new(&[]).is_empty());
    }

    /// Half of 2²¹ weights are 0.3, the others 1.7: 15% of the choices. |z| above 4.4 has a
    /// probability of 1e-5; by 24 bits alone z is 47.
    #[test]
    fn a_table_of_two_million_weights_keeps_their_shares() {
        let weights: Vec<f32> = (0..1 << 21).map(|i| [0.3, 1.7][i % 2]).collect();
        let table = AliasTable::new(&weights);
        let n: u32 = 200_000;
        let fraction = |i: u32, odd: u32| (i.wrapping_mul(odd) >> 8) as f32 / (1 << 24) as f32;
        let light = (0..n).filter(|i| {
            let u = [fraction(*i, 2_654_435_769), fraction(*i, 1_779_033_703)];
            table.choose(u).0.is_multiple_of(2)
        });
        let share = light.count() as f64 / f64::from(n);
        let z = (share - 0.15) / (0.15 * 0.85 / f64::from(n)).sqrt();
        assert!(z.abs() < 4.4, "{share}: {z}");
    }
}
