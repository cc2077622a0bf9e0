//! A difference of products without cancellation.

/// `a b − c d` within two units in the last place (Kahan's method).
#[inline(always)]
pub fn diff_of_products(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let cd = c * d;
    let error = (-c).mul_add(d, cd);
    a.mul_add(b, -cd) + error
}
