//! A smooth odd function of one variable as a table.

/// The number of neighbors from which a value is interpolated.
const STENCIL: usize = 8;
/// The barycentric weights of [`STENCIL`] nodes of equal distance.
const WEIGHTS: [f64; STENCIL] = [1.0, -7.0, 21.0, -35.0, 35.0, -21.0, 7.0, -1.0];

/// An odd function from 0 to a reach. Its ratio to the variable is an even function, which is
/// interpolated by the polynomial through eight neighbors of equal distance.
#[derive(Clone, Debug)]
pub(super) struct OddCurve {
    /// The end of the table.
    pub reach: f64,
    /// The ratios at the middles of steps from 0; the last is at `reach`.
    ratios: Vec<f64>,
}

impl OddCurve {
    /// Tabulates a function at `nodes` places; none if it has no value at one of them.
    pub(super) fn of(reach: f64, nodes: usize, value: impl Fn(f64) -> Option<f64>) -> Option<Self> {
        let ratio = |k: usize| {
            let x = reach * (k as f64 + 0.5) / (nodes as f64 - 0.5);
            Some(value(x)? / x)
        };
        let ratios = (0..nodes).map(ratio).collect::<Option<_>>()?;
        Some(Self { reach, ratios })
    }

    /// The value at a place up to the reach.
    pub(super) fn at(&self, x: f64) -> f64 {
        let nodes = self.ratios.len();
        // The place among the nodes, and the first of the neighbors. Those beyond 0 are the mirror
        // images of the others.
        let at = x / self.reach * (nodes as f64 - 0.5) - 0.5;
        let first = (at.floor() as i64 + 1 - STENCIL as i64 / 2).min((nodes - STENCIL) as i64);
        let (mut above, mut below) = (0.0, 0.0);
        for (k, weight) in WEIGHTS.iter().enumerate() {
            let node = first + k as i64;
            let ratio = self.ratios[if node < 0 { -1 - node } else { node } as usize];
            let off = at - node as f64;
            if off == 0.0 {
                return x * ratio;
            }
            above += weight / off * ratio;
            below += weight / off;
        }
        x * above / below
    }

    /// The value at any place: beyond the reach it grows in proportion.
    pub(super) fn beyond(&self, x: f64) -> f64 {
        match x <= self.reach {
            true => self.at(x),
            false => x / self.reach * self.at(self.reach),
        }
    }
}
