//! Points of the rear vertex plane to aim at, a lane for each ray.

use glam::DVec2;
use ivcam_base::math::lanes::{LANES, Lane, SimdKernel};

use crate::lens::pupil::patch::{PupilPatch, unvignetted_at};
use crate::lens::pupil::pupil_table::PupilTable;
use crate::lens::pupil::symmetry::WedgeCopy;
use crate::lens::pupil::vignetting::Vignetting;
use crate::lens::pupil::window::PupilWindow;

/// Points of the rear vertex plane to aim at, a lane for each ray.
#[derive(Clone, Debug, Default)]
pub struct Aims {
    /// The x coordinates, in millimeters.
    pub x: Lane,
    /// The y coordinates, in millimeters.
    pub y: Lane,
    /// The reciprocal of each point's probability density, in square millimeters. It is 0 if no
    /// light reaches the film point.
    pub area: Lane,
    /// The unvignetted fraction of that area; 0 if it is not known.
    pub unvignetted: Lane,
}

impl Aims {
    /// A mask of the lanes whose unvignetted fraction is known.
    pub fn known_vignetting(&self) -> u32 {
        let lanes = self.unvignetted.iter().zip(&self.area).enumerate();
        lanes.fold(0, |all, (lane, (fraction, area))| {
            all | u32::from((*fraction > 0.0) & (*area > 0.0)) << lane
        })
    }

    /// Copies the point and the area of a lane of other aims to a lane.
    #[inline(always)]
    pub fn copy(&mut self, lane: usize, (from, at): (&Self, usize)) {
        (self.x[lane], self.y[lane], self.area[lane]) = (from.x[at], from.y[at], from.area[at]);
    }

    /// Sets the aim of a lane to the point of a window for a pair of numbers in the unit square.
    pub(super) fn set(&mut self, lane: usize, window: &PupilWindow<'_>, [u, v]: [f64; 2]) {
        [self.area[lane], self.unvignetted[lane]] = [0.0; 2];
        if !window.is_closed() {
            let aim = window.point(u, v);
            [self.x[lane], self.y[lane]] = aim.to_array();
            self.area[lane] = 1.0 / window.density(aim);
        }
    }
}

/// The kernel of [`PupilTarget::aims`](crate::lens::pupil::target::PupilTarget::aims) for a table.
pub(super) struct TableAims<'a, T, const L: usize, const Q: usize> {
    pub table: &'a T,
    pub vignetting: &'a Vignetting,
    /// The film points, in millimeters from the film's middle.
    pub film: &'a [Lane; 2],
    /// Points of the unit square.
    pub pupil: &'a [Lane; 2],
    /// The result.
    pub aims: &'a mut Aims,
}

impl<T: PupilTable<L, Q>, const L: usize, const Q: usize> SimdKernel for TableAims<'_, T, L, Q> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let ([fx, fy], [u, v]) = (self.film, self.pupil);
        let (table, aims) = (self.table, self.aims);
        let [mut film, mut directions, mut turns, mut mirrors] = [[[0.0; LANES]; 2]; 4];
        let [mut numbers, mut out] = [[0.0; LANES]; 2];
        for i in 0..LANES {
            let (at, direction, number) = table.coordinates::<FUSED>(DVec2::new(fx[i], fy[i]));
            [film[0][i], film[1][i]] = at;
            [directions[0][i], directions[1][i]] = direction.to_array();
            (numbers[i], out[i]) = (number, v[i].sqrt());
        }
        let mut patches: [Option<&PupilPatch<L, Q>>; LANES] = [None; LANES];
        let mut last = None;
        for i in 0..LANES {
            let direction = DVec2::new(directions[0][i], directions[1][i]);
            let (direction, copy) = table.unfolded(direction, numbers[i]);
            [directions[0][i], directions[1][i]] = direction.to_array();
            [turns[0][i], turns[1][i]] = copy.turn.to_array();
            [mirrors[0][i], mirrors[1][i]] = copy.mirror.to_array();
            let at = [film[0][i], film[1][i]];
            patches[i] = match last {
                Some(patch) if PupilPatch::contains(patch, at) => last,
                _ => table.patch(at),
            };
            last = patches[i];
        }
        let mut first = 0;
        // Mostly the film points of one pixel lie in one patch.
        for run in patches.chunk_by(|a, b| a.map(std::ptr::from_ref) == b.map(std::ptr::from_ref)) {
            let lanes = first..first + run.len();
            first = lanes.end;
            let Some(patch) = run[0] else {
                aims.area[lanes.clone()].fill(0.0);
                aims.unvignetted[lanes].fill(0.0);
                continue;
            };
            let (mut at, mut centers) = ([[0.0; LANES]; 2], [[0.0; LANES]; 2]);
            for i in lanes.clone() {
                let position = patch.coordinates([film[0][i], film[1][i]]);
                [at[0][i], at[1][i]] = position;
                aims.area[i] = patch.area::<FUSED>(position).max(0.0);
                let direction = DVec2::new(directions[0][i], directions[1][i]);
                let center = patch.center::<FUSED>(position, direction);
                [centers[0][i], centers[1][i]] = center.to_array();
            }
            let fractions = table.unvignetted(patch, self.vignetting);
            let (weights, sums) = (&self.vignetting.weights, &mut aims.unvignetted);
            unvignetted_at::<FUSED, Q>(fractions, weights, &at, lanes.clone(), sums);
            for i in lanes {
                let rim = patch.rim::<FUSED>([at[0][i], at[1][i]], aims.area[i], u[i]);
                aims.x[i] = centers[0][i] + out[i] * rim.x;
                aims.y[i] = centers[1][i] + out[i] * rim.y;
            }
        }
        for i in 0..LANES {
            let copy = WedgeCopy {
                turn: DVec2::new(turns[0][i], turns[1][i]),
                mirror: DVec2::new(mirrors[0][i], mirrors[1][i]),
            };
            let aim = copy.placed(DVec2::new(aims.x[i], aims.y[i]));
            [aims.x[i], aims.y[i]] = aim.to_array();
        }
    }
}
