//! Where a surface is cut.

use glam::{DAffine3, DVec3};

use super::bezier::BezierSpan;
use super::control::MAX_CELLS;
use super::detail::{ChordalTolerance, Detail, Net, has_positive_weights, is_quick};
use super::edges::Edges;
use super::surface::NurbsSurface;

impl NurbsSurface {
    /// Returns where the surface is cut along u and along v, and its edges if it is cut within a
    /// tolerance.
    pub(super) fn cuts(&self, detail: &Detail<'_>) -> (Vec<f64>, Vec<f64>, Option<Edges>) {
        let within = detail.tolerance.as_ref().filter(|_| self.can_be_halved());
        if let Some((us, vs, edges)) = within.and_then(|t| self.cuts_within(t)) {
            return (us, vs, Some(edges));
        }
        let (along_u, along_v) = self.density(detail.complexity);
        (self.u.cuts(along_u), self.v.cuts(along_v), None)
    }

    /// Whether the surface can be cut within a tolerance.
    fn can_be_halved(&self) -> bool {
        has_positive_weights(&self.points) && is_quick(&self.u, Some(&self.v))
    }

    /// Returns the cuts within a tolerance. It is increased as often as there are too many cells.
    fn cuts_within(&self, tolerance: &ChordalTolerance<'_>) -> Option<(Vec<f64>, Vec<f64>, Edges)> {
        const MOST_INCREASES: i32 = 16;
        let (us, vs) = (BezierSpan::all(&self.u), BezierSpan::all(&self.v));
        let point = |i: usize, j: usize| tolerance.place(self.points[j * self.u.count + i]);
        (0..MOST_INCREASES).find_map(|k| {
            let distance = |corners| 4f64.powi(k) * (tolerance.distance)(corners);
            let tolerance = ChordalTolerance {
                distance: &distance,
                ..*tolerance
            };
            let net = |along, across, point| Net {
                point,
                along,
                across,
            };
            let u_cuts = net(&us, &vs, &point).cuts(&tolerance, 4.0);
            let v_cuts = net(&vs, &us, &|j, i| point(i, j)).cuts(&tolerance, 4.0);
            if (u_cuts.len() - 1) * (v_cuts.len() - 1) > MAX_CELLS {
                return None;
            }
            let edges = Edges::of(self, &tolerance)?;
            Some((u_cuts, v_cuts, edges))
        })
    }

    /// Returns how finely the surface's trimming curves are cut. Their points are parameters of the
    /// surface, so their tolerance is that of the surface over its largest derivatives.
    pub(crate) fn detail_of_trims(&self, detail: &Detail<'_>) -> Detail<'static> {
        let tolerance = detail.tolerance.as_ref().filter(|_| self.can_be_halved());
        let tolerance = tolerance.map(|tolerance| {
            let net = Net {
                point: &|i, j| tolerance.place(self.points[j * self.u.count + i]),
                along: &BezierSpan::all(&self.u),
                across: &BezierSpan::all(&self.v),
            };
            let [u, v] = net.speed(tolerance);
            ChordalTolerance {
                world_from_object: DAffine3::from_scale(DVec3::new(u, v, 1.0)),
                distance: &|_| 0.5,
            }
        });
        Detail {
            tolerance,
            ..*detail
        }
    }
}

/// Returns all cuts of some lists in ascending order.
pub(super) fn merged(lists: &[&[f64]]) -> Vec<f64> {
    let mut cuts = lists.concat();
    cuts.sort_by(f64::total_cmp);
    cuts.dedup();
    cuts
}
