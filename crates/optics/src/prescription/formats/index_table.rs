//! Media of tables of refractive indices.

use ivcam_base::math::lagrange_weight;

use crate::prescription::glass::medium::{C_LINE, D_LINE, F_LINE, Medium};

/// The medium of a table of wavelengths in nanometers and indices. None if the table does not reach
/// the d line; without the F and C lines the medium has no dispersion.
pub(super) fn medium(table: &[(f64, f64)]) -> Option<Medium> {
    let at = |nm| interpolated(table, nm);
    let n_d = at(D_LINE)?;
    Some(match (at(F_LINE), at(C_LINE)) {
        (Some(n_f), Some(n_c)) => Medium::from_lines(n_f, n_d, n_c),
        _ => Medium::constant(n_d),
    })
}

/// Within a table, the polynomial in 1/λ² through the four wavelengths around one, or through all
/// of a shorter table.
///
/// For a flint and wavelengths that are 100 nm apart, the error of linear interpolation is 3e-4,
/// and that of the cubic is 1e-6.
fn interpolated(table: &[(f64, f64)], nm: f64) -> Option<f64> {
    if let Some((_, n)) = table.iter().find(|(at, _)| *at == nm) {
        return Some(*n);
    }
    let mut near: Vec<(f64, f64)> = table.to_vec();
    near.sort_by(|a, b| (a.0 - nm).abs().total_cmp(&(b.0 - nm).abs()));
    near.dedup_by_key(|(at, _)| *at);
    let inside = near.iter().any(|(at, _)| *at < nm) && near.iter().any(|(at, _)| *at > nm);
    near.truncate(4);
    let x = |nm: f64| 1.0 / (nm * nm);
    let at: Vec<f64> = near.iter().map(|(nm, _)| x(*nm)).collect();
    let term = |(k, (_, n)): (usize, &(f64, f64))| lagrange_weight(&at, k, x(nm)) * n;
    inside.then(|| near.iter().enumerate().map(term).sum())
}
