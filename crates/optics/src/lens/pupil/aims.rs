//! Points of the rear vertex plane to aim at, a lane for each ray.

use glam::DVec2;
use ivcam_base::math::lanes::{LANES, Lane, SimdKernel};

use crate::lens::pupil::patch::{Patch, Position};
use crate::lens::pupil::polar::Cells;
use crate::lens::pupil::spans::Spans;
use crate::lens::pupil::symmetry::WedgeCopy;
use crate::lens::pupil::transmission::PupilTransmission;
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
    /// The share of that area that is open; 0 if it is not known.
    pub open_share: Lane,
}

impl Aims {
    /// A mask of the lanes whose open share is known.
    pub fn known_shares(&self) -> u32 {
        let lanes = self.open_share.iter().zip(&self.area).enumerate();
        lanes.fold(0, |all, (lane, (share, area))| {
            all | u32::from((*share > 0.0) & (*area > 0.0)) << lane
        })
    }

    /// Copies the point and the area of a lane of other aims to a lane.
    #[inline(always)]
    pub fn copy(&mut self, lane: usize, (from, at): (&Self, usize)) {
        (self.x[lane], self.y[lane], self.area[lane]) = (from.x[at], from.y[at], from.area[at]);
    }

    /// Sets the aim of a lane to the point of a window for a pair of numbers in the unit square.
    pub(crate) fn set(&mut self, lane: usize, window: &PupilWindow<'_>, [u, v]: [f64; 2]) {
        [self.area[lane], self.open_share[lane]] = [0.0; 2];
        if !window.is_closed() {
            let aim = window.point(u, v);
            [self.x[lane], self.y[lane]] = aim.to_array();
            self.area[lane] = 1.0 / window.density(aim);
        }
    }
}

/// The kernel of [`PupilTarget::aims`](crate::lens::pupil::target::PupilTarget::aims) for a table
/// over the film's radius.
pub(crate) struct SpanAims<'a> {
    pub spans: &'a Spans,
    pub transmission: &'a PupilTransmission,
    /// The film points, in millimeters from the film's middle.
    pub film: &'a [Lane; 2],
    /// Points of the unit square.
    pub pupil: &'a [Lane; 2],
    /// The result.
    pub aims: &'a mut Aims,
}

impl SimdKernel for SpanAims<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let [[fx, fy], [u, v]] = [self.film, self.pupil];
        let Aims {
            x,
            y,
            area,
            open_share,
        } = self.aims;
        let [mut radius, mut out] = [[0.0; LANES]; 2];
        for i in 0..LANES {
            radius[i] = (fx[i] * fx[i] + fy[i] * fy[i]).sqrt();
            out[i] = v[i].sqrt();
        }
        if let Some(number) = self.spans.all_in_one(&radius) {
            let (span, start) = (&self.spans.spans[number], self.spans.start(number));
            let mut t = [0.0; LANES];
            for i in 0..LANES {
                t[i] = (radius[i] - start) * self.spans.inverse_length[number];
                area[i] = span.area(t[i]).max(0.0);
            }
            let [a, b, c] = self.transmission.share(number);
            for i in 0..LANES {
                open_share[i] = a + t[i] * (b + t[i] * c);
            }
            for i in 0..LANES {
                [x[i], y[i]] = span.point(t[i], u[i], out[i]).to_array();
            }
        } else {
            for i in 0..LANES {
                [area[i], open_share[i]] = [0.0; 2];
                if let Some((number, t)) = self.spans.at(radius[i]) {
                    let span = &self.spans.spans[number];
                    let [a, b, c] = self.transmission.share(number);
                    open_share[i] = a + t * (b + t * c);
                    area[i] = span.area(t).max(0.0);
                    [x[i], y[i]] = span.point(t, u[i], out[i]).to_array();
                }
            }
        }
        for i in 0..LANES {
            // On the axis every rotation is the same: take none.
            let off_axis = radius[i] > 0.0;
            let scale = 1.0 / (if off_axis { radius[i] } else { 1.0 });
            let (cos, sin) = (if off_axis { fx[i] * scale } else { 1.0 }, fy[i] * scale);
            let (across, along) = (x[i], y[i]);
            x[i] = across * cos - along * sin;
            y[i] = across * sin + along * cos;
        }
    }
}

/// The kernel of [`PupilTarget::aims`](crate::lens::pupil::target::PupilTarget::aims) for a table
/// over film positions.
pub(super) struct CellAims<'a> {
    pub cells: &'a Cells,
    /// The weights of the open shares of the table's lenses; none if they are not needed.
    pub weights: &'a [f64],
    /// The film points, in millimeters from the film's middle.
    pub film: &'a [Lane; 2],
    /// Points of the unit square.
    pub pupil: &'a [Lane; 2],
    /// The result.
    pub aims: &'a mut Aims,
}

impl SimdKernel for CellAims<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let [[fx, fy], [u, v]] = [self.film, self.pupil];
        let aims = self.aims;
        let mut places = [[0.0; LANES]; 2];
        let [mut dx, mut dy, mut numbers, mut out] = [[0.0; LANES]; 4];
        for i in 0..LANES {
            let (place, direction, number) = self.cells.place_of::<FUSED>(DVec2::new(fx[i], fy[i]));
            [places[0][i], places[1][i]] = place;
            [dx[i], dy[i]] = [direction.x, direction.y];
            (numbers[i], out[i]) = (number, v[i].sqrt());
        }
        let (mut copies, mut patches) = ([WedgeCopy::NONE; LANES], [None; LANES]);
        let mut last: Option<&Patch> = None;
        for i in 0..LANES {
            let place = [places[0][i], places[1][i]];
            let (direction, copy) = self.cells.unfolded(DVec2::new(dx[i], dy[i]), numbers[i]);
            ([dx[i], dy[i]], copies[i]) = (direction.to_array(), copy);
            patches[i] = match last.filter(|patch| patch.contains(place)) {
                None => self.cells.patch(place),
                same => same,
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
                aims.open_share[lanes].fill(0.0);
                continue;
            };
            let (mut at, mut middles) = ([[0.0; LANES]; 2], [[0.0; LANES]; 2]);
            for i in lanes.clone() {
                let position = patch.position([places[0][i], places[1][i]]);
                [at[0][i], at[1][i]] = [position.u, position.v];
                aims.area[i] = patch.area::<FUSED>(position).max(0.0);
                let middle = patch.middle::<FUSED>(position, DVec2::new(dx[i], dy[i]));
                [middles[0][i], middles[1][i]] = middle.to_array();
            }
            let shares = &mut aims.open_share;
            patch.open_shares::<FUSED>(&at, lanes.clone(), self.weights, shares);
            for i in lanes {
                let position = Position {
                    u: at[0][i],
                    v: at[1][i],
                };
                let rim = patch.rim::<FUSED>(position, aims.area[i], u[i]);
                let point = DVec2::new(middles[0][i], middles[1][i]) + out[i] * rim;
                [aims.x[i], aims.y[i]] = copies[i].placed(point).to_array();
            }
        }
    }
}
