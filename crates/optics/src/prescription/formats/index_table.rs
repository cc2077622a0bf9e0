//! Media of tables of refractive indices.

use crate::prescription::glass::medium::{C_LINE, D_LINE, F_LINE, Medium, tabulated};

/// The medium of a table of wavelengths in nanometers and indices. None if the table does not reach
/// the d line; a table of that line alone, or of one with another, has no dispersion.
pub(super) fn medium(table: &[(f64, f64)]) -> Option<Medium> {
    let mut lines = table.to_vec();
    lines.sort_by(|a, b| a.0.total_cmp(&b.0));
    lines.dedup_by_key(|(at, _)| *at);
    let reaches = |nm: f64| {
        let [first, last] = [lines.first()?.0, lines.last()?.0];
        (first..=last).contains(&nm).then(|| tabulated(&lines, nm))
    };
    let n_d = reaches(D_LINE)?;
    let at: Vec<f64> = lines.iter().map(|(at, _)| *at).collect();
    Some(match (reaches(F_LINE), reaches(C_LINE)) {
        (Some(n_f), Some(n_c)) if at == [F_LINE, D_LINE, C_LINE] => {
            Medium::from_lines(n_f, n_d, n_c)
        }
        _ if lines.len() > 2 => Medium::from_table(n_d, lines),
        (Some(n_f), Some(n_c)) => Medium::from_lines(n_f, n_d, n_c),
        _ => Medium::constant(n_d),
    })
}
