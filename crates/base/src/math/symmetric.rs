//! Systems of equations with a symmetric matrix, for least squares.

/// Solves a symmetric system by Cholesky's factors; none if it is singular. `matrix` is given row
/// by row, and only its lower half is used. Its diagonal is multiplied by 1 + `damping`.
pub fn solve(matrix: &[f64], right: &[f64], damping: f64) -> Option<Vec<f64>> {
    let n = right.len();
    let mut l = matrix.to_vec();
    for i in 0..n {
        l[i * n + i] += damping * l[i * n + i] + 1e-12;
    }
    for i in 0..n {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| l[i * n + k] * l[j * n + k]).sum();
            let rest = l[i * n + j] - dot;
            if i != j {
                l[i * n + j] = rest / l[j * n + j];
            } else if rest > 0.0 {
                l[i * n + i] = rest.sqrt();
            } else {
                return None;
            }
        }
    }
    let mut x = right.to_vec();
    for i in 0..n {
        let dot: f64 = (0..i).map(|k| l[i * n + k] * x[k]).sum();
        x[i] = (x[i] - dot) / l[i * n + i];
    }
    for i in (0..n).rev() {
        let dot: f64 = (i + 1..n).map(|k| l[k * n + i] * x[k]).sum();
        x[i] = (x[i] - dot) / l[i * n + i];
    }
    x.iter().all(|v| v.is_finite()).then_some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_symmetric_system_is_solved_and_a_singular_one_refused() {
        // 4x + 2y = 10, 2x + 3y = 9: x = 1.5, y = 2.
        let x = solve(&[4.0, 0.0, 2.0, 3.0], &[10.0, 9.0], 0.0).unwrap();
        assert!((x[0] - 1.5).abs() < 1e-9 && (x[1] - 2.0).abs() < 1e-9);
        assert!(solve(&[1.0, 0.0, 2.0, 1.0], &[1.0, 1.0], 0.0).is_none());
    }
}
