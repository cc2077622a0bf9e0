//! Points of the rear vertex plane to aim at, a lane for each ray.

use crate::lens::pupil::spans::Spans;
use crate::lens::pupil::transmission::PupilTransmission;
use crate::lens::pupil::window::PupilWindow;
use crate::math::lanes::{LANES, Lane, SimdKernel};

/// Points of the rear vertex plane to aim at, a lane for each ray.
#[derive(Clone, Debug)]
pub(crate) struct Aims {
    pub x: Lane,
    pub y: Lane,
    /// The area that a point stands for, in square millimeters; 0 if no light reaches the film point.
    pub area: Lane,
    /// The share of that area that is open; 0 if it is not known.
    pub light: Lane,
}

impl Default for Aims {
    fn default() -> Self {
        let [x, y, area, light] = [[0.0; LANES]; 4];
        Self { x, y, area, light }
    }
}

impl Aims {
    /// Aims through a window with a pair of numbers in the unit square.
    pub(crate) fn set(&mut self, lane: usize, window: &PupilWindow<'_>, [u, v]: [f64; 2]) {
        [self.area[lane], self.light[lane]] = [0.0; 2];
        if !window.is_closed() {
            let aim = window.point(u, v);
            [self.x[lane], self.y[lane]] = aim.to_array();
            self.area[lane] = 1.0 / window.density(aim);
        }
    }
}

/// The work of [`PupilTarget::aims`](crate::lens::pupil::target::PupilTarget::aims) by a table over the film's
/// radius.
pub(crate) struct SpanAims<'a> {
    pub spans: &'a Spans,
    pub transmission: &'a PupilTransmission,
    pub film: &'a [Lane; 2],
    pub pupil: &'a [Lane; 2],
    pub aims: &'a mut Aims,
}

impl SimdKernel for SpanAims<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let [[fx, fy], [u, v]] = [self.film, self.pupil];
        let Aims { x, y, area, light } = self.aims;
        let [mut radius, mut out] = [[0.0; LANES]; 2];
        for i in 0..LANES {
            radius[i] = (fx[i] * fx[i] + fy[i] * fy[i]).sqrt();
            out[i] = v[i].sqrt();
        }
        if let Some(number) = self.spans.all_in_one(&radius) {
            let (span, start) = (&self.spans.spans[number], self.spans.start(number));
            let mut t = [0.0; LANES];
            for i in 0..LANES {
                t[i] = (radius[i] - start) * self.spans.steepness[number];
                area[i] = span.area(t[i]).max(0.0);
            }
            let [a, b, c] = self.transmission.share(number);
            for i in 0..LANES {
                light[i] = a + t[i] * (b + t[i] * c);
            }
            for i in 0..LANES {
                [x[i], y[i]] = span.point(t[i], u[i], out[i]).to_array();
            }
        } else {
            for i in 0..LANES {
                [area[i], light[i]] = [0.0; 2];
                if let Some((number, t)) = self.spans.at(radius[i]) {
                    let span = &self.spans.spans[number];
                    let [a, b, c] = self.transmission.share(number);
                    light[i] = a + t * (b + t * c);
                    area[i] = span.area(t).max(0.0);
                    [x[i], y[i]] = span.point(t, u[i], out[i]).to_array();
                }
            }
        }
        for i in 0..LANES {
            let some = radius[i] > 0.0;
            let scale = 1.0 / (if some { radius[i] } else { 1.0 });
            let (cos, sin) = (if some { fx[i] * scale } else { 1.0 }, fy[i] * scale);
            let (across, along) = (x[i], y[i]);
            x[i] = across * cos - along * sin;
            y[i] = across * sin + along * cos;
        }
    }
}
