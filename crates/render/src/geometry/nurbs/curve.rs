//! Rational B-spline curves.

use glam::{DVec3, DVec4};

use super::basis::{Basis, BasisFunctions};
use super::bezier::BezierSpan;
use super::control::{MAX_CELLS, at_infinity, bend, check_points, pieces, project, size_of};
use super::detail::{ChordalTolerance, Detail, Net, has_positive_weights, is_quick};

/// A curve in space or, with z = 0, in the parameter plane of a surface.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Curve {
    basis: Basis,
    points: Vec<DVec4>,
}

impl Curve {
    /// Makes a curve of control points that fit a basis.
    pub(super) fn over(basis: Basis, points: Vec<DVec4>) -> Self {
        Self { basis, points }
    }

    /// Makes a curve.
    ///
    /// # Errors
    /// Returns a sentence if a control point is not finite, or if the knots do not fit.
    pub(crate) fn new(points: Vec<DVec4>, knots: &[f32]) -> Result<Self, String> {
        check_points(&points)?;
        let basis = Basis::new(points.len(), knots)?;
        Ok(Self { basis, points })
    }

    #[cfg(test)]
    pub(crate) fn domain(&self) -> (f64, f64) {
        self.basis.domain()
    }

    /// Returns the point at a parameter, or `None` if it is at infinity.
    pub(crate) fn point(&self, t: f64) -> Option<DVec3> {
        let mut f = BasisFunctions::default();
        self.basis.functions(self.basis.clamp(t), &mut f);
        let sum = (0..f.value.len()).map(|i| f.value[i] * self.points[f.first + i]);
        project(sum.sum())
    }

    /// Returns points along the curve from end to end.
    ///
    /// # Errors
    /// Returns a sentence if a point is at infinity.
    pub(crate) fn polyline(&self, detail: &Detail<'_>) -> Result<Vec<DVec3>, String> {
        let fine = detail
            .tolerance
            .as_ref()
            .and_then(|t| self.cuts_within(t, 8.0));
        fine.unwrap_or_else(|| self.cuts_by_complexity(detail.complexity))
            .into_iter()
            .map(|t| self.point(t).ok_or_else(at_infinity))
            .collect()
    }

    /// Returns the parameters that cut the curve within a tolerance, or within the part of it that
    /// `eighths` states. Returns `None` if some weight is not positive.
    pub(super) fn cuts_within(
        &self,
        tolerance: &ChordalTolerance<'_>,
        eighths: f64,
    ) -> Option<Vec<f64>> {
        if !has_positive_weights(&self.points) || !is_quick(&self.basis, None) {
            return None;
        }
        let net = Net {
            point: &|i, _| tolerance.place(self.points[i]),
            along: &BezierSpan::all(&self.basis),
            across: &[BezierSpan::across_curve()],
        };
        Some(net.cuts(tolerance, eighths))
    }

    fn cuts_by_complexity(&self, complexity: f32) -> Vec<f64> {
        let bend = bend(self.points.iter().copied());
        let degree = self.basis.order - 1;
        let wanted = pieces(complexity, degree, bend, size_of(&self.points));
        // A curve of degree 1 is straight between knots and needs no division.
        let wanted = if degree == 1 { 1 } else { wanted };
        let most = (MAX_CELLS / self.basis.spans()).max(1);
        self.basis.cuts(wanted.min(most))
    }
}
