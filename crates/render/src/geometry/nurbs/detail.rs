//! How finely curves and surfaces are cut.

use glam::{DAffine3, DVec3, DVec4};

use super::basis::Basis;
use super::bezier::{BezierPatch, BezierSpan, PatchBounds};

/// The number of halvings of a knot span that bends. Patches are halved across as often, so that
/// the bounds of their derivatives and distances are close.
const HALVINGS: u32 = 2;
/// The number of pieces up to which what was halved so often is not halved again.
const FEW_PIECES: f64 = 8.0;
/// The largest number of halvings of a knot span.
const MOST_HALVINGS: u32 = 8;
/// The largest number of halves in all, which bounds the work.
const MOST_HALVES: usize = 1 << 12;
/// The largest number of multiplications to make the patches of a surface. A surface that needs
/// more is cut by its complexity.
const MOST_WORK: f64 = 1e9;

/// How finely curves and surfaces are cut.
#[derive(Clone, Copy)]
pub(crate) struct Detail<'a> {
    /// Inventor's complexity from 0 to 1.
    pub complexity: f32,
    /// The distance that is allowed from the curve or surface. If there is none, or if some weight
    /// is not positive, the complexity decides.
    pub tolerance: Option<ChordalTolerance<'a>>,
}

/// The largest distance of a mesh from its surface in world space.
#[derive(Clone, Copy)]
pub(crate) struct ChordalTolerance<'a> {
    /// The matrix from object space to world space.
    pub world_from_object: DAffine3,
    /// Returns the largest distance for what is inside a box.
    pub distance: &'a dyn Fn((DVec3, DVec3)) -> f64,
}

impl ChordalTolerance<'_> {
    /// Returns a control point in world space.
    pub(super) fn place(&self, p: DVec4) -> DVec4 {
        let affine = &self.world_from_object;
        (affine.matrix3 * p.truncate() + p.w * affine.translation).extend(p.w)
    }

    /// Returns the distance for a patch. It is not 0, so that a number of halvings is enough.
    fn at(&self, bounds: &PatchBounds) -> f64 {
        let (low, high) = bounds.corners;
        (self.distance)((low, high)).max(1e-9 * low.distance(high))
    }
}

/// A net of homogeneous control points in world space with positive weights.
pub(super) struct Net<'a> {
    /// Returns the control point at a column and a row.
    pub(super) point: &'a dyn Fn(usize, usize) -> DVec4,
    pub(super) along: &'a [BezierSpan],
    pub(super) across: &'a [BezierSpan],
}

impl Net<'_> {
    /// Returns the parameters that cut the net in the first direction, so that cells keep within a
    /// tolerance. `eighths` is eight times the part of the distance for cuts in this direction.
    ///
    /// Two edges with equal control points have equal cuts.
    pub(super) fn cuts(&self, tolerance: &ChordalTolerance<'_>, eighths: f64) -> Vec<f64> {
        let most = (MOST_HALVES / self.along.len().max(1)).max(1).ilog2();
        let pieces = |patch: &BezierPatch, depth: u32| {
            let bounds = patch.bounds();
            (patch.bend(&bounds, depth >= HALVINGS) / (eighths * tolerance.at(&bounds))).sqrt()
        };
        let halving = Halving {
            pieces: &pieces,
            most: most.min(MOST_HALVINGS),
        };
        let mut cuts: Vec<f64> = self.along.first().map(|s| s.ends.0).into_iter().collect();
        for span in self.along {
            let patches = self
                .across
                .iter()
                .map(|a| BezierPatch::new(span, a, self.point));
            cuts.extend(halving.divide(patches.collect(), span.ends, 0).cuts);
        }
        cuts
    }

    /// Returns how many tolerances a point of the surface moves at most, per unit of the
    /// parameters.
    pub(super) fn speed(&self, tolerance: &ChordalTolerance<'_>) -> [f64; 2] {
        let pairs = self
            .along
            .iter()
            .flat_map(|a| self.across.iter().map(move |b| (a, b)));
        pairs.fold([0.0; 2], |most: [f64; 2], (a, b)| {
            let bounds = BezierPatch::new(a, b, self.point).bounds();
            let distance = tolerance.at(&bounds);
            let speed = |axis: usize, span: &BezierSpan| {
                bounds.first[axis] / (span.ends.1 - span.ends.0) / distance
            };
            [most[0].max(speed(0, a)), most[1].max(speed(1, b))]
        })
    }
}

/// How spans are halved.
struct Halving<'a> {
    /// Returns into how many pieces a patch after a number of halvings has to be cut.
    pieces: &'a dyn Fn(&BezierPatch, u32) -> f64,
    /// The largest number of halvings.
    most: u32,
}

/// The cuts of a span or of a part of it.
struct NurbsDivision {
    /// The parameters after the start, up to the end.
    cuts: Vec<f64>,
    /// The number of equal pieces that would be enough. It need not be a whole number.
    pieces: f64,
}

impl Halving<'_> {
    /// Cuts the patches of a span or of a part of it: evenly, or each half by itself if these are
    /// fewer cuts. Patches that are flat enough are left out of the halves.
    fn divide(&self, mut patches: Vec<BezierPatch>, ends: (f64, f64), depth: u32) -> NurbsDivision {
        let (mut most, mut flattest) = (0.0_f64, 0.0_f64);
        patches.retain(|patch| {
            let pieces = (self.pieces)(patch, depth);
            most = most.max(pieces); // ignores NaN
            if !(pieces > 1.0) {
                flattest = flattest.max(pieces);
            }
            pieces > 1.0
        });
        let middle = 0.5 * (ends.0 + ends.1);
        let is_enough = depth >= self.most || depth >= HALVINGS && most <= FEW_PIECES;
        if patches.is_empty() || is_enough || !(ends.0 < middle && middle < ends.1) {
            let pieces = most.min(FEW_PIECES);
            return NurbsDivision {
                cuts: even_cuts(ends, pieces),
                pieces,
            };
        }
        let (mut low, mut high) = (Vec::new(), Vec::new());
        for patch in patches {
            let parts = match depth {
                0..HALVINGS => patch.halves_across(),
                _ => vec![patch],
            };
            for part in parts {
                let [first, second] = part.halves();
                low.push(first);
                high.push(second);
            }
        }
        let low = self.divide(low, (ends.0, middle), depth + 1);
        let high = self.divide(high, (middle, ends.1), depth + 1);
        // The bounds of halves are closer than those of the whole.
        let pieces = most.min(flattest.max(2.0 * low.pieces.max(high.pieces)));
        let mut cuts = low.cuts;
        cuts.extend(high.cuts);
        let even = even_cuts(ends, pieces);
        NurbsDivision {
            cuts: if even.len() <= cuts.len() { even } else { cuts },
            pieces,
        }
    }
}

/// Returns the parameters that cut an interval into equal pieces, without the start. A number that
/// is whole but for rounding is not rounded up.
fn even_cuts((from, to): (f64, f64), pieces: f64) -> Vec<f64> {
    let pieces = (pieces - 1e-9).ceil().max(1.0) as usize;
    let inner = (1..pieces).map(|i| from + (to - from) * (i as f64 / pieces as f64));
    inner.chain([to]).collect()
}

/// Whether the patches of a surface, or of a curve without `v`, can be made in a short time.
pub(super) fn is_quick(u: &Basis, v: Option<&Basis>) -> bool {
    let size = |basis: &Basis| (basis.order as f64, basis.spans() as f64);
    let ((m, a), (n, b)) = (size(u), v.map_or((1.0, 1.0), size));
    let matrices = a * m.powi(4) + b * n.powi(4);
    a * b * m * n * (m + n) + matrices < MOST_WORK
}

/// Whether all weights are positive.
pub(super) fn has_positive_weights(points: &[DVec4]) -> bool {
    points.iter().all(|p| p.w > 0.0)
}
