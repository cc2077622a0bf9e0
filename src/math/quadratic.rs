//! Quadratic equations without cancellation.

/// The real roots of `a x² + b x + c`, the smaller first; a linear equation has its root twice.
///
/// The root that would subtract nearly equal numbers is taken from the product of the roots
/// instead, so both keep full precision: with b = 1e9, a = c = 1 the plain formula gives 0.
pub fn quadratic(a: f64, b: f64, c: f64) -> Option<(f64, f64)> {
    if a == 0.0 {
        return (b != 0.0).then(|| (-c / b, -c / b));
    }
    let discriminant = diff_of_products(b, b, 4.0 * a, c);
    if !(discriminant >= 0.0) {
        return None;
    }
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    let (x, y) = (q / a, if q == 0.0 { 0.0 } else { c / q });
    Some((x.min(y), x.max(y)))
}

/// `a b − c d` within two units in the last place (Kahan's method).
pub fn diff_of_products(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let cd = c * d;
    let error = (-c).mul_add(d, cd);
    a.mul_add(b, -cd) + error
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_small_root_of_a_stiff_quadratic_survives() {
        let (small, large) = quadratic(1.0, -1e9, 1.0).unwrap();
        assert_eq!((small, large), (1e-9, 1e9));
        assert_eq!(quadratic(1.0, 0.0, 1.0), None);
        assert_eq!(quadratic(0.0, 2.0, -1.0), Some((0.5, 0.5)));
        assert_eq!(quadratic(1.0, 0.0, 0.0), Some((0.0, 0.0)));
    }
}
