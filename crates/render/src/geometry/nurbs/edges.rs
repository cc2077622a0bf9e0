//! The edges of a surface as polylines that depend on nothing but the edges.
//!
//! A surface may be cut more finely inside than on an edge. Its vertices on the edge are then moved
//! to the edge's polyline. A neighbor with the same edge has the same polyline, so there is no gap.

use glam::DVec3;

use super::curve::Curve;
use super::detail::ChordalTolerance;
use super::surface::NurbsSurface;

/// A polyline with a parameter at each of its points.
struct Polyline {
    cuts: Vec<f64>,
    points: Vec<DVec3>,
}

impl Polyline {
    /// Returns the polyline of a curve within half a tolerance, or `None` if the curve cannot be
    /// cut.
    fn of(curve: &Curve, tolerance: &ChordalTolerance<'_>) -> Option<Self> {
        let cuts = curve.cuts_within(tolerance, 4.0)?;
        let points: Option<Vec<DVec3>> = cuts.iter().map(|&t| curve.point(t)).collect();
        points.map(|points| Self { cuts, points })
    }

    /// Returns the point at a parameter.
    fn at(&self, t: f64) -> DVec3 {
        let last = self.cuts.len() - 1;
        let i = self.cuts.partition_point(|&cut| cut <= t).clamp(1, last) - 1;
        let (from, to) = (self.cuts[i], self.cuts[i + 1]);
        self.points[i].lerp(self.points[i + 1], (t - from) / (to - from))
    }
}

/// The edges of a surface.
pub(super) struct Edges {
    /// The edges along u, at the smallest and the largest v.
    along_u: [Polyline; 2],
    /// The edges along v, at the smallest and the largest u.
    along_v: [Polyline; 2],
    u: (f64, f64),
    v: (f64, f64),
}

impl Edges {
    /// Cuts the edges of a surface within half a tolerance. Returns `None` if some point of them
    /// is at infinity.
    pub(super) fn of(surface: &NurbsSurface, tolerance: &ChordalTolerance<'_>) -> Option<Self> {
        let pair = |surface: &NurbsSurface| -> Option<[Polyline; 2]> {
            let (low, high) = surface.v_domain();
            let edge = |v| Polyline::of(&surface.curve_at(v), tolerance);
            Some([edge(low)?, edge(high)?])
        };
        Some(Self {
            along_u: pair(surface)?,
            along_v: pair(&surface.transposed())?,
            u: surface.u_domain(),
            v: surface.v_domain(),
        })
    }

    /// The parameters u of the points of the edges along u, at the smallest and the largest v.
    pub(super) fn u_cuts(&self) -> [&[f64]; 2] {
        self.along_u.each_ref().map(|edge| &edge.cuts[..])
    }

    /// The parameters v of the points of the edges along v, at the smallest and the largest u.
    pub(super) fn v_cuts(&self) -> [&[f64]; 2] {
        self.along_v.each_ref().map(|edge| &edge.cuts[..])
    }

    /// Returns the point of an edge's polyline, or `None` inside the domain.
    pub(super) fn point(&self, u: f64, v: f64) -> Option<DVec3> {
        let side = |t: f64, (low, high): (f64, f64)| match t {
            t if t == low => Some(0),
            t if t == high => Some(1),
            _ => None,
        };
        match (side(v, self.v), side(u, self.u)) {
            (Some(i), _) => Some(self.along_u[i].at(u)),
            (None, Some(i)) => Some(self.along_v[i].at(v)),
            (None, None) => None,
        }
    }
}
