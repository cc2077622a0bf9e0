//! Points of an outline: the search for one, and the corner between two that are limited by
//! different surfaces.

use std::f64::consts::{PI, TAU};

use glam::DVec2;
use ivcam_base::math::lanes::{LANES, Lane};

/// A point of the outline.
#[derive(Clone, Copy, Default)]
pub(super) struct RimPoint {
    /// The angle of the direction from the center of the search, in radians.
    pub angle: f64,
    /// The distance from the center of the search, in millimeters.
    pub distance: f64,
    /// The point of the rear vertex plane, in millimeters.
    pub point: DVec2,
    /// The number of the surface, or of the edge of an iris, that limits the pupil here.
    pub limit: u64,
}

/// The points of an outline by angle: over the whole turn, or over half a turn with the axis of
/// symmetry at both ends.
#[derive(Clone, Copy)]
pub(super) struct RimRow<'a> {
    pub rims: &'a [RimPoint],
    /// Whether the points cover half a turn.
    pub mirrored: bool,
}

impl RimRow<'_> {
    /// The point of an index, which may lie before the first point or after the last one.
    pub(super) fn at(&self, index: isize) -> RimPoint {
        let count = self.rims.len() as isize;
        let period = if self.mirrored {
            2 * (count - 1)
        } else {
            count
        };
        let turns = index.div_euclid(period) as f64;
        let rest = index.rem_euclid(period);
        let is_mirrored = rest >= count;
        let mut rim = self.rims[if is_mirrored { period - rest } else { rest } as usize];
        if is_mirrored {
            rim.angle = 2.0 * PI - rim.angle;
            rim.point.y = -rim.point.y;
        }
        rim.angle += turns * TAU;
        rim
    }
}

/// An interval of distances that contains the rim in one direction, in millimeters.
#[derive(Clone, Copy)]
pub(crate) struct Bracket {
    /// A distance inside the pupil.
    low: f64,
    /// A distance outside the pupil, once one is known.
    pub high: f64,
    /// The fill less 1 at `low`.
    f_low: f64,
    /// The fill less 1 at `high`. It is positive only if a distance outside is known.
    f_high: f64,
    /// The last two distances tested, with the fill less 1.
    tested: [(f64, f64); 2],
    /// The distance to test next.
    pub next: f64,
    /// The number of the surface or edge that limits the pupil at `high`.
    pub limit: u64,
}

/// The number of rounds in which the secant alone chooses the distance. Later every third round
/// bisects, so that the search ends for any fill. Nearly every search ends before, so the exact
/// value does not matter.
const SECANT_ROUNDS: usize = 6;

impl Bracket {
    /// A bracket in which only the fill at the center, less 1, is known. `guess` is the distance to
    /// test first.
    pub(crate) fn new(f_center: f64, guess: f64) -> Self {
        Self {
            low: 0.0,
            high: guess,
            f_low: f_center,
            f_high: f64::NEG_INFINITY,
            tested: [(0.0, f_center); 2],
            next: guess,
            limit: 0,
        }
    }

    /// Whether the bracket is wider than the fraction `width` of the distance.
    fn is_open(&self, width: f64) -> bool {
        !(self.f_high > 0.0) || self.high - self.low > width * self.high
    }

    /// The distance at which the fill would be 1 if it were linear through the last two distances
    /// tested; none if they do not determine one.
    fn secant(&self) -> Option<f64> {
        let [(a, f), (b, g)] = self.tested;
        let root = b - g * (b - a) / (g - f);
        root.is_finite().then_some(root)
    }

    /// Chooses the next distance to test. Near the root it is placed a little less than half of the
    /// width away (0.45), alternately on both sides, so that two rays close the bracket. The
    /// distance is at most `farthest`.
    fn choose(&mut self, width: f64, round: usize, farthest: f64) {
        if round == 0 {
            return;
        }
        let near = 0.45 * width * self.high;
        if !(self.f_high > 0.0) {
            // No distance outside is known: increase the distance by 1.5, or as the secant says, by
            // a factor of 4 at most.
            let outward = 1.5 * self.low;
            let far = 4.0 * self.low;
            let is_secant = round < SECANT_ROUNDS;
            let root = self.secant().filter(|root| *root >= self.low && is_secant);
            self.next = root
                .map_or(outward, |root| (root + near).min(far))
                .min(farthest);
            return;
        }
        let span = self.high - self.low;
        let inside = |x: &f64| *x > self.low && *x < self.high;
        let line = || self.low - self.f_low * span / (self.f_high - self.f_low);
        let is_secant = round < SECANT_ROUNDS || !round.is_multiple_of(3);
        let root = match self.f_high.is_finite() && is_secant {
            true => self.secant().filter(inside).unwrap_or_else(line),
            false => 0.5 * (self.low + self.high),
        };
        // From an end that is already near, the far side of the root is 2.1 times `near` away:
        // 0.945 of the width, so that the bracket closes there.
        self.next = if root - self.low < 2.0 * near {
            self.low + 2.1 * near
        } else if self.high - root < 2.0 * near {
            self.high - 2.1 * near
        } else {
            root - near
        };
        if !inside(&self.next) {
            self.next = 0.5 * (self.low + self.high);
        }
    }

    /// Narrows the bracket by the fill less 1, `over`, and the limiting surface at the distance
    /// tested. A distance of `farthest` counts as outside.
    fn update(&mut self, over: f64, limit: u64, farthest: f64) {
        self.tested = [self.tested[1], (self.next, over)];
        if over <= 0.0 && self.next < farthest {
            (self.low, self.f_low) = (self.next, over);
        } else {
            (self.high, self.f_high) = (self.next, over.max(f64::MIN_POSITIVE));
            self.limit = limit;
        }
    }
}

/// Narrows the brackets of up to one bundle to the fraction `width` of their distances. `fills`
/// returns the fills at the distances to test next, and the numbers of the surfaces that limit
/// them. A distance of `farthest` counts as outside.
pub(crate) fn close(
    brackets: &mut [Bracket],
    width: f64,
    farthest: f64,
    fills: impl Fn(&[Bracket]) -> (Lane, [u64; LANES]),
) {
    // From the sixth round on, every third bisects: 160 rounds narrow a bracket by 2^51, which is
    // the precision of a double.
    for round in 0..160 {
        let mut open = 0;
        for bracket in brackets.iter_mut() {
            open += usize::from(bracket.is_open(width));
            bracket.choose(width, round, farthest);
        }
        if open == 0 {
            break;
        }
        let (fills, limits) = fills(brackets);
        for (lane, bracket) in brackets.iter_mut().enumerate() {
            if bracket.is_open(width) {
                bracket.update(fills[lane] - 1.0, limits[lane], farthest);
            }
        }
    }
}

/// Finds the corner where the shadow of one surface meets that of another, between the third and
/// the fourth of six points of an outline.
///
/// On either side the shadow's edge is extended by the line through the two nearer points, bent by
/// the parabola through all three. There is no corner if it lies farther from the points than
/// twice their distance, or than `times` the distance between the two points of a line.
pub(super) fn corner([a, b, c, d, e, f]: [RimPoint; 6], times: f64) -> Option<DVec2> {
    let cross = |p: DVec2, along: DVec2, q: DVec2, other: DVec2| {
        let t = (q - p).perp_dot(other) / along.perp_dot(other);
        (t > 0.0).then(|| p + t * along)
    };
    let (along, other) = (c.point - b.point, d.point - e.point);
    let straight = cross(c.point, along, d.point, other)?;
    let bent = |far: &RimPoint, next: &RimPoint, last: &RimPoint| {
        if far.limit != last.limit || next.limit != last.limit {
            return DVec2::ZERO;
        }
        let step = last.point - next.point;
        let (side, length) = (step.perp().normalize_or_zero(), step.length());
        let out = (straight - last.point).length();
        // The points need not be evenly spaced.
        let before = (next.point - far.point).dot(step) / length;
        let off = (far.point - next.point).dot(side);
        0.5 * off * out * (out + length) / (before * (before + length)) * side
    };
    let (p, q) = (bent(&a, &b, &c), bent(&f, &e, &d));
    let corner = cross(c.point + p, along, d.point + q, other).unwrap_or(straight);
    let gap = 2.0 * (d.point - c.point).length();
    let near = |p: DVec2, step: DVec2| (corner - p).length() <= gap.min(times * step.length());
    (near(c.point, along) && near(d.point, other)).then_some(corner)
}
