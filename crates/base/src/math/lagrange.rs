//! Interpolation by Lagrange's polynomials.

/// The value at `x` of the polynomial that is 1 at the place `at[k]` and 0 at the other places,
/// which differ. The polynomial through given values is their sum with these weights.
pub fn lagrange_weight(at: &[f64], k: usize, x: f64) -> f64 {
    let others = (0..at.len()).filter(|j| *j != k);
    others.map(|j| (x - at[j]) / (at[k] - at[j])).product()
}
