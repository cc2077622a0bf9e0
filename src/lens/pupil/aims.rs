//! Points of the rear vertex plane to aim at, a lane for each ray.

use crate::lens::pupil::spans::Spans;
use crate::lens::pupil::transmission::PupilTransmission;
use crate::lens::pupil::window::PupilWindow;
use crate::math::lanes::{LANES, Lane, SimdKernel};

/// Points of the rear vertex plane to aim at, a lane for each ray.
#[derive(Clone, Debug, Default)]
pub(crate) struct Aims {
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
    pub(crate) fn known_shares(&self) -> u32 {
        let lanes = self.open_share.iter().zip(&self.area).enumerate();
        lanes.fold(0, |all, (lane, (share, area))| {
            all | u32::from((*share > 0.0) & (*area > 0.0)) << lane
        })
    }

    /// Copies the point and the area of a lane of other aims to a lane.
    #[inline(always)]
    pub(crate) fn copy(&mut self, lane: usize, (from, at): (&Self, usize)) {
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
