//! Points of an outline: the search for one, and what can be said between them.

use std::f64::consts::{PI, TAU};

use glam::DVec2;

/// A point of the outline.
#[derive(Clone, Copy, Default)]
pub(super) struct Rim {
    pub angle: f64,
    pub distance: f64,
    pub point: DVec2,
    /// The surface whose rim it is, or the edge of an iris.
    pub limit: u64,
}

/// Points of an outline by their angle: all around, or over half a turn with the axis at both ends,
/// where the other half mirrors it.
#[derive(Clone, Copy)]
pub(super) struct Row<'a> {
    pub rims: &'a [Rim],
    pub mirrored: bool,
}

impl Row<'_> {
    /// The point of a number, which goes on before the first and behind the last.
    pub fn at(&self, number: isize) -> Rim {
        let count = self.rims.len() as isize;
        let period = if self.mirrored {
            2 * (count - 1)
        } else {
            count
        };
        let turns = number.div_euclid(period) as f64;
        let rest = number.rem_euclid(period);
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

/// What is known of the rim in one direction: inside at `low`, outside at `high`.
#[derive(Clone, Copy)]
pub(super) struct Bracket {
    pub low: f64,
    pub high: f64,
    /// The fill less 1 at both; not above 0 at `high` while nothing outside is known.
    f_low: f64,
    f_high: f64,
    /// The last two places tried, with the fill less 1.
    tried: [(f64, f64); 2],
    pub next: f64,
    pub limit: u64,
}

impl Bracket {
    pub fn new(f_center: f64, guess: f64) -> Self {
        Self {
            low: 0.0,
            high: guess,
            f_low: f_center,
            f_high: f64::NEG_INFINITY,
            tried: [(0.0, f_center); 2],
            next: guess,
            limit: 0,
        }
    }

    pub fn is_open(&self, width: f64) -> bool {
        !(self.f_high > 0.0) || self.high - self.low > width * self.high
    }

    /// Where the fill would be 1 if it were linear in the last two places.
    fn secant(&self) -> Option<f64> {
        let [(a, f), (b, g)] = self.tried;
        let root = b - g * (b - a) / (g - f);
        root.is_finite().then_some(root)
    }

    /// The next place to try. The root's own neighborhood is closed in from both sides, half of
    /// the width apart, so that two rays end a search that has come near.
    pub fn choose(&mut self, width: f64, round: usize, reach: f64) {
        if round == 0 {
            return;
        }
        let near = 0.45 * width * self.high;
        if !(self.f_high > 0.0) {
            let outward = 1.5 * self.low;
            let far = 4.0 * self.low;
            let root = self.secant().filter(|root| *root >= self.low && round < 6);
            self.next = root
                .map_or(outward, |root| (root + near).min(far))
                .min(reach);
            return;
        }
        let span = self.high - self.low;
        let inside = |x: &f64| *x > self.low && *x < self.high;
        let line = || self.low - self.f_low * span / (self.f_high - self.f_low);
        let root = match self.f_high.is_finite() && (round < 6 || !round.is_multiple_of(3)) {
            true => self.secant().filter(inside).unwrap_or_else(line),
            false => 0.5 * (self.low + self.high),
        };
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

    pub fn learn(&mut self, over: f64, limit: u64, reach: f64) {
        self.tried = [self.tried[1], (self.next, over)];
        if over <= 0.0 && self.next < reach {
            (self.low, self.f_low) = (self.next, over);
        } else {
            (self.high, self.f_high) = (self.next, over.max(f64::MIN_POSITIVE));
            self.limit = limit;
        }
    }
}

/// A corner of an outline, where one surface's shadow meets another's between the third and the
/// fourth of six points: on either side the line through the nearer two, bent as the farthest of
/// the three is from it, nearly. None where that is far from both, or farther out than so many
/// times the way between those two.
pub(super) fn corner([a, b, c, d, e, f]: [Rim; 6], times: f64) -> Option<DVec2> {
    let cross = |p: DVec2, along: DVec2, q: DVec2, other: DVec2| {
        let t = (q - p).perp_dot(other) / along.perp_dot(other);
        (t > 0.0).then(|| p + t * along)
    };
    let (along, other) = (c.point - b.point, d.point - e.point);
    let straight = cross(c.point, along, d.point, other)?;
    let bent = |far: &Rim, next: &Rim, last: &Rim| {
        if far.limit != last.limit || next.limit != last.limit {
            return DVec2::ZERO;
        }
        let step = last.point - next.point;
        let (side, length) = (step.perp().normalize_or_zero(), step.length());
        let out = (straight - last.point).length();
        // Points need not be evenly spaced: the parabola through all three.
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
