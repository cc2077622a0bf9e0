//! Media of tables of refractive indices.

use crate::prescription::glass::medium::{C_LINE, D_LINE, F_LINE, Medium, tabulated};

/// The medium of a table of wavelengths in nanometers and indices; none of an empty one. A table of
/// the d line alone, or of that with another, has no dispersion, and so has any of one wavelength.
/// One that does not reach the d line is that of a glass for the infrared or the ultraviolet.
pub(super) fn medium(table: &[(f64, f64)]) -> Option<Medium> {
    let mut lines = table.to_vec();
    lines.sort_by(|a, b| a.0.total_cmp(&b.0));
    lines.dedup_by_key(|(at, _)| *at);
    let reaches = |nm: f64| {
        let [first, last] = [lines.first()?.0, lines.last()?.0];
        (first..=last).contains(&nm).then(|| tabulated(&lines, nm))
    };
    let Some(n_d) = reaches(D_LINE) else {
        return match &lines[..] {
            [(_, n)] => Some(Medium::constant(*n)),
            lines => Medium::from_distant_table(lines),
        };
    };
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
