//! Linear least squares by Householder's reflections with pivoting.

/// The ratio of a pivot to the first one below which a column counts as a combination of others.
const RANK: f64 = 1e-13;

/// The vector x that minimizes the sum of squares of `rows` x − `right`; none if the numbers are
/// not finite or if there are fewer rows than columns.
///
/// A column that is a combination of others gets the coefficient 0. `rows` all have the same
/// length.
pub fn least_squares(rows: &[Vec<f64>], right: &[f64]) -> Option<Vec<f64>> {
    let (count, columns) = (rows.len(), rows.first()?.len());
    let is_finite = |v: &f64| v.is_finite();
    if count < columns || right.len() != count || !rows.iter().flatten().chain(right).all(is_finite)
    {
        return None;
    }
    // Stored by columns, with the right side as the last.
    let column = |j: usize| -> Vec<f64> { rows.iter().map(|row| row[j]).collect() };
    let mut a: Vec<Vec<f64>> = (0..columns).map(column).collect();
    // Columns of unit length have comparable pivots.
    let lengths: Vec<f64> = a.iter().map(|c| norm(c).max(f64::MIN_POSITIVE)).collect();
    for (c, length) in a.iter_mut().zip(&lengths) {
        c.iter_mut().for_each(|v| *v /= length);
    }
    let mut b = right.to_vec();
    let mut order: Vec<usize> = (0..columns).collect();
    let mut rank = 0;
    for k in 0..columns {
        let rest = |j: &usize| norm(&a[*j][k..]);
        let next = (k..columns).max_by(|i, j| rest(&order[*i]).total_cmp(&rest(&order[*j])))?;
        order.swap(k, next);
        let mut v: Vec<f64> = a[order[k]][k..].to_vec();
        let length = norm(&v);
        if !(length > RANK) {
            break;
        }
        v[0] += length.copysign(v[0]);
        let square: f64 = v.iter().map(|x| x * x).sum();
        for target in order[k..].iter().map(|j| Some(*j)).chain([None]) {
            let c = match target {
                Some(j) => &mut a[j],
                None => &mut b,
            };
            let dot: f64 = v.iter().zip(&c[k..]).map(|(x, y)| x * y).sum();
            let factor = 2.0 * dot / square;
            c[k..]
                .iter_mut()
                .zip(&v)
                .for_each(|(y, x)| *y -= factor * x);
        }
        rank = k + 1;
    }
    let mut x = vec![0.0; columns];
    for i in (0..rank).rev() {
        let known: f64 = order[i + 1..rank].iter().map(|j| a[*j][i] * x[*j]).sum();
        x[order[i]] = (b[i] - known) / a[order[i]][i];
    }
    x.iter_mut()
        .zip(&lengths)
        .for_each(|(x, length)| *x /= length);
    x.iter().all(|v| v.is_finite()).then_some(x)
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_is_found_in_its_values_and_a_repeated_column_gets_zero() {
        let row = |t: f64| vec![1.0, t, t * t, t];
        let rows: Vec<Vec<f64>> = (0..20).map(|i| row(f64::from(i) / 19.0)).collect();
        let right: Vec<f64> = rows.iter().map(|r| 3.0 - 2.0 * r[1] + 0.5 * r[2]).collect();
        let x = least_squares(&rows, &right).unwrap();
        assert!(
            (x[0] - 3.0).abs() < 1e-12 && (x[2] - 0.5).abs() < 1e-12,
            "{x:?}"
        );
        assert!(
            (x[1] + x[3] + 2.0).abs() < 1e-12 && x[1] * x[3] == 0.0,
            "{x:?}"
        );
    }

    #[test]
    fn the_residual_is_perpendicular_to_every_column() {
        let rows: Vec<Vec<f64>> = (0..9)
            .map(|i| vec![f64::from(i), f64::from(i * i % 7), 1.0])
            .collect();
        let right: Vec<f64> = (0..9).map(|i| f64::from((i * 5) % 4)).collect();
        let x = least_squares(&rows, &right).unwrap();
        for column in 0..3 {
            let dot: f64 = rows
                .iter()
                .zip(&right)
                .map(|(r, b)| {
                    let value: f64 = r.iter().zip(&x).map(|(a, x)| a * x).sum();
                    r[column] * (value - b)
                })
                .sum();
            assert!(dot.abs() < 1e-12, "{dot}");
        }
        assert_eq!(least_squares(&rows[..2], &right[..2]), None);
    }

    #[test]
    fn numbers_that_are_not_finite_have_no_solution() {
        let right = [1.0, 2.0, 3.0];
        for bad in [f64::NAN, f64::INFINITY] {
            let rows = [vec![1.0], vec![bad], vec![3.0]];
            assert_eq!(least_squares(&rows, &right), None);
            let rows = [vec![1.0], vec![2.0], vec![3.0]];
            assert_eq!(least_squares(&rows, &[1.0, bad, 3.0]), None);
        }
    }
}
