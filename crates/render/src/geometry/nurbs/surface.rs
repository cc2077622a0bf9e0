//! Rational B-spline surfaces, with their points, derivatives and normals.

use glam::{DVec3, DVec4};

use super::basis::{Basis, BasisFunctions};
use super::control::{MAX_CELLS, bend, check_points, largest, pieces, project, size_of};
use super::curve::Curve;

/// A rational B-spline surface. Consecutive control points are neighbors along u, as in Inventor.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct NurbsSurface {
    pub(super) u: Basis,
    pub(super) v: Basis,
    pub(super) points: Vec<DVec4>,
}

/// A point of a surface and its derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SurfacePoint {
    /// The point.
    pub position: DVec3,
    /// The derivative along u.
    pub du: DVec3,
    /// The derivative along v.
    pub dv: DVec3,
}

impl SurfacePoint {
    /// Projects a homogeneous point and its derivatives to space.
    fn of(s: DVec4, su: DVec4, sv: DVec4) -> Option<Self> {
        let position = project(s)?;
        let quotient = |d: DVec4| (d.truncate() - d.w * position) / s.w;
        Some(Self {
            position,
            du: quotient(su),
            dv: quotient(sv),
        })
    }

    /// Evaluates one point of a row (see [`NurbsSurface::row`]).
    pub(super) fn on_row(row: &[(DVec4, DVec4)], fu: &BasisFunctions) -> Option<Self> {
        let (mut s, mut su, mut sv) = (DVec4::ZERO, DVec4::ZERO, DVec4::ZERO);
        for (i, (p, dp)) in row[fu.first..].iter().take(fu.value.len()).enumerate() {
            s += fu.value[i] * *p;
            su += fu.slope[i] * *p;
            sv += fu.value[i] * *dp;
        }
        Self::of(s, su, sv)
    }
}

impl NurbsSurface {
    /// Makes a surface from the first `u_count · v_count` points; further ones are ignored.
    ///
    /// # Errors
    /// Returns a sentence if there are too few points, if one of them is not finite, or if the
    /// knots do not fit.
    pub(crate) fn new(
        u_count: usize,
        v_count: usize,
        u_knots: &[f32],
        v_knots: &[f32],
        mut points: Vec<DVec4>,
    ) -> Result<Self, String> {
        let needed = u_count.checked_mul(v_count).filter(|&n| n <= points.len());
        let Some(needed) = needed else {
            return Err(format!(
                "the surface needs {u_count} by {v_count} control points, but there are {}",
                points.len()
            ));
        };
        points.truncate(needed);
        check_points(&points)?;
        let u = Basis::new(u_count, u_knots).map_err(|e| format!("along u: {e}"))?;
        let v = Basis::new(v_count, v_knots).map_err(|e| format!("along v: {e}"))?;
        Ok(Self { u, v, points })
    }

    /// The smallest and the largest u.
    pub(crate) fn u_domain(&self) -> (f64, f64) {
        self.u.domain()
    }

    /// The smallest and the largest v.
    pub(crate) fn v_domain(&self) -> (f64, f64) {
        self.v.domain()
    }

    /// Returns the point at some parameters, or `None` if it is at infinity.
    pub(crate) fn point(&self, u: f64, v: f64) -> Option<SurfacePoint> {
        let (mut fu, mut fv) = (BasisFunctions::default(), BasisFunctions::default());
        self.u.functions(self.u.clamp(u), &mut fu);
        self.v.functions(self.v.clamp(v), &mut fv);
        self.combine(&fu, &fv)
    }

    fn combine(&self, fu: &BasisFunctions, fv: &BasisFunctions) -> Option<SurfacePoint> {
        let (mut s, mut su, mut sv) = (DVec4::ZERO, DVec4::ZERO, DVec4::ZERO);
        for j in 0..fv.value.len() {
            let row = (fv.first + j) * self.u.count + fu.first;
            let (mut p, mut pu) = (DVec4::ZERO, DVec4::ZERO);
            for i in 0..fu.value.len() {
                p += fu.value[i] * self.points[row + i];
                pu += fu.slope[i] * self.points[row + i];
            }
            s += fv.value[j] * p;
            su += fv.value[j] * pu;
            sv += fv.slope[j] * p;
        }
        SurfacePoint::of(s, su, sv)
    }

    /// Returns the curve of u at one v, as control points with their derivatives along v.
    pub(super) fn row(&self, v: f64) -> Vec<(DVec4, DVec4)> {
        let mut f = BasisFunctions::default();
        self.v.functions(self.v.clamp(v), &mut f);
        let column = |i: usize| {
            let terms = (0..f.value.len()).map(|j| {
                let p = self.points[(f.first + j) * self.u.count + i];
                (f.value[j] * p, f.slope[j] * p)
            });
            terms.fold((DVec4::ZERO, DVec4::ZERO), |a, b| (a.0 + b.0, a.1 + b.1))
        };
        (0..self.u.count).map(column).collect()
    }

    /// Returns the unit normal ∂u × ∂v. If it vanishes (at the tip of a cone, or on an edge that
    /// degenerates to a point) the normal is that of a point nearer to the middle of the domain.
    /// The steps toward the middle grow until the sine between the derivatives exceeds 1e-6.
    pub(super) fn normal(&self, u: f64, v: f64, at: &SurfacePoint) -> DVec3 {
        let cross = |p: &SurfacePoint| {
            let (du, dv) = (p.du.try_normalize()?, p.dv.try_normalize()?);
            let n = du.cross(dv);
            (n.length() > 1e-6).then(|| n.normalize())
        };
        if let Some(n) = cross(at) {
            return n;
        }
        let middle = |(lo, hi): (f64, f64)| 0.5 * (lo + hi);
        let (mu, mv) = (middle(self.u.domain()), middle(self.v.domain()));
        [1e-4, 1e-2, 0.1]
            .into_iter()
            .find_map(|t| {
                let p = self.point(u + t * (mu - u), v + t * (mv - v))?;
                cross(&p)
            })
            .unwrap_or(DVec3::Z)
    }

    /// Returns the curve of u at one v.
    pub(super) fn curve_at(&self, v: f64) -> Curve {
        let points = self.row(v).into_iter().map(|(p, _)| p);
        Curve::over(self.u.clone(), points.collect())
    }

    /// Returns the surface with u and v exchanged.
    pub(super) fn transposed(&self) -> Self {
        let (nu, nv) = (self.u.count, self.v.count);
        let points = (0..nu * nv).map(|k| self.points[(k % nv) * nu + k / nv]);
        Self {
            u: self.v.clone(),
            v: self.u.clone(),
            points: points.collect(),
        }
    }

    /// Returns the number of pieces of each knot span along u and along v.
    pub(super) fn density(&self, complexity: f32) -> (usize, usize) {
        let size = size_of(&self.points);
        let (nu, nv) = (self.u.count, self.v.count);
        let row = |j: usize| self.points[j * nu..(j + 1) * nu].iter().copied();
        let column = |i: usize| (0..nv).map(move |j| self.points[j * nu + i]);
        let bend_u = largest((0..nv).map(|j| bend(row(j))));
        let bend_v = largest((0..nu).map(|i| bend(column(i))));
        // A bilinear patch may be twisted, so only a flat net is not divided.
        let twist = self.twist();
        let mut along_u = pieces(complexity, self.u.order - 1, bend_u.max(twist), size);
        let mut along_v = pieces(complexity, self.v.order - 1, bend_v.max(twist), size);
        while along_u * self.u.spans() * along_v * self.v.spans() > MAX_CELLS
            && along_u.max(along_v) > 1
        {
            along_u = along_u.div_ceil(2);
            along_v = along_v.div_ceil(2);
        }
        (along_u, along_v)
    }

    /// Returns the largest difference between opposite edges of a cell of the control net, which is
    /// 0 if all cells are parallelograms.
    fn twist(&self) -> f64 {
        let at =
            |i: usize, j: usize| project(self.points[j * self.u.count + i]).unwrap_or_default();
        let mut most = 0.0_f64;
        for j in 1..self.v.count {
            for i in 1..self.u.count {
                let twist = at(i, j) - at(i - 1, j) - at(i, j - 1) + at(i - 1, j - 1);
                most = most.max(twist.length());
            }
        }
        most
    }
}
