//! The B-spline basis functions of one parameter.

/// The largest order that is drawn. The limit of GLU is 24.
pub(crate) const MAX_ORDER: usize = 64;

/// The knots of a curve or of one direction of a surface. The order is the number of knots minus
/// the number of control points.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Basis {
    pub(super) order: usize,
    /// The number of control points.
    pub(super) count: usize,
    pub(super) knots: Vec<f64>,
}

impl Basis {
    /// Makes a basis; returns a sentence if the knots do not fit the number of control points.
    pub(super) fn new(count: usize, knots: &[f32]) -> Result<Self, String> {
        let Some(order) = knots.len().checked_sub(count).filter(|&o| o >= 2) else {
            return Err(format!(
                "{} knots are too few for {count} control points: there must be at least {}",
                knots.len(),
                count.saturating_add(2)
            ));
        };
        if order > MAX_ORDER {
            return Err(format!(
                "{} knots for {count} control points mean order {order}, but the limit is {MAX_ORDER}",
                knots.len()
            ));
        }
        if order > count {
            return Err(format!(
                "order {order} needs {order} control points, but there are {count}"
            ));
        }
        if let Some(i) = knots.iter().position(|k| !k.is_finite()) {
            return Err(format!("knot {i} is not finite"));
        }
        if let Some(i) = knots.windows(2).position(|k| k[1] < k[0]) {
            return Err(format!("knot {} is less than the one before it", i + 1));
        }
        let knots: Vec<f64> = knots.iter().map(|&k| f64::from(k)).collect();
        if !(knots[count] > knots[order - 1]) {
            return Err("the domain is empty: its first and its last knot are equal".to_owned());
        }
        Ok(Self {
            order,
            count,
            knots,
        })
    }

    /// The smallest and the largest parameter.
    pub(super) fn domain(&self) -> (f64, f64) {
        (self.knots[self.order - 1], self.knots[self.count])
    }

    /// Returns the knot span that contains a parameter. The last span includes its end.
    fn span(&self, t: f64) -> usize {
        let (first, last) = (self.order - 1, self.count - 1);
        let inside = &self.knots[first..=self.count];
        let mut at = first + inside.partition_point(|&k| k <= t).saturating_sub(1);
        at = at.min(last);
        while at > first && self.knots[at] >= self.knots[at + 1] {
            at -= 1;
        }
        at
    }

    /// Evaluates the basis functions that are not zero at `t`, and their derivatives. The first one
    /// belongs to control point `span − order + 1` (Piegl and Tiller, The NURBS Book, algorithms
    /// A2.2 and A2.3).
    pub(super) fn functions(&self, t: f64, out: &mut BasisFunctions) {
        let span = self.span(t);
        let k = &self.knots;
        out.first = span + 1 - self.order;
        out.value.clear();
        out.value.push(1.0);
        let mut lower = Vec::new();
        for degree in 1..self.order {
            if degree + 1 == self.order {
                lower.clone_from(&out.value);
            }
            let mut saved = 0.0;
            for r in 0..degree {
                let right = k[span + r + 1];
                let left = k[span + 1 + r - degree];
                let share = out.value[r] / (right - left);
                out.value[r] = saved + (right - t) * share;
                saved = (t - left) * share;
            }
            out.value.push(saved);
        }
        let degree = self.order - 1;
        out.slope.clear();
        out.slope.resize(self.order, 0.0);
        for (r, n) in lower.iter().enumerate() {
            let slope = degree as f64 * n / (k[span + r + 1] - k[span + 1 + r - degree]);
            out.slope[r] -= slope;
            out.slope[r + 1] += slope;
        }
    }

    /// Returns the parameters that divide each knot span into `pieces` pieces.
    pub(super) fn cuts(&self, pieces: usize) -> Vec<f64> {
        let mut cuts = vec![self.domain().0];
        for k in self.knots[self.order - 1..=self.count].windows(2) {
            if k[1] > k[0] {
                cuts.extend((1..=pieces).map(|i| {
                    if i == pieces {
                        k[1]
                    } else {
                        k[0] + (k[1] - k[0]) * (i as f64 / pieces as f64)
                    }
                }));
            }
        }
        cuts
    }

    /// The number of knot spans that are not empty.
    pub(super) fn spans(&self) -> usize {
        let inside = &self.knots[self.order - 1..=self.count];
        inside.windows(2).filter(|k| k[1] > k[0]).count()
    }

    /// Clamps a parameter to the domain.
    pub(super) fn clamp(&self, t: f64) -> f64 {
        let (lo, hi) = self.domain();
        t.clamp(lo, hi)
    }
}

/// The basis functions that are not zero at a parameter.
#[derive(Default)]
pub(super) struct BasisFunctions {
    /// The control point of the first function.
    pub(super) first: usize,
    /// The value of each function.
    pub(super) value: Vec<f64>,
    /// The derivative of each function.
    pub(super) slope: Vec<f64>,
}
