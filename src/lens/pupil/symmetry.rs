//! The symmetry of a lens and its film about the axis.

use std::f64::consts::{PI, TAU};

use glam::DVec2;

use crate::lens::lens::Lens;
use crate::lens::optics::film_place::FilmPlace;

/// The rotations and reflections that map the lens and its film onto themselves. The pupil of every
/// film point is that of a point in one wedge of the film, rotated and mirrored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Symmetry {
    /// The order of the rotational symmetry: a rotation by 2π/`turns` changes nothing.
    pub turns: u32,
    /// The angle in radians at which the first wedge begins: that of an axis of reflection, or 0.
    pub base: f64,
    /// Whether there is an axis of reflection.
    pub mirrored: bool,
}

impl Symmetry {
    const NONE: Self = Self {
        turns: 1,
        base: 0.0,
        mirrored: false,
    };

    /// The symmetry of a lens and its film.
    pub(super) fn of(lens: &Lens, place: &FilmPlace) -> Self {
        if !place.is_centered() {
            return Self::NONE;
        }
        let edges = lens.iris_edges();
        let surfaces = &lens.prescription().surfaces;
        let is_round = surfaces.iter().all(|s| s.shape.is_rotational());
        let most = if is_round { edges.len() as u32 } else { 2 };
        let turns = (1..=most)
            .rev()
            .find(|n| is_same(edges, |e| DVec2::from_angle(TAU / f64::from(*n)).rotate(e)));
        let turns = turns.unwrap_or(1);
        let mut mirrors = vec![0.0];
        if let ([first, second, ..], true) = (edges, is_round) {
            mirrors = vec![
                first.to_angle(),
                0.5 * (first.to_angle() + second.to_angle()),
            ];
        }
        let is_mirror = |base: &f64| {
            is_same(edges, |e| {
                DVec2::from_angle(2.0 * base).rotate(DVec2::new(e.x, -e.y))
            })
        };
        let base = mirrors.into_iter().find(is_mirror);
        Self {
            turns,
            base: base.unwrap_or(0.0),
            mirrored: base.is_some(),
        }
    }

    /// The angle of a wedge, in radians.
    pub(super) fn wedge(&self) -> f64 {
        let circle = if self.mirrored { PI } else { TAU };
        circle / f64::from(self.turns)
    }

    /// The position of a direction in its wedge, 0 to 1, and the rotation and the signs that map a
    /// figure in the first wedge to that direction.
    pub(super) fn fold(&self, direction: DVec2) -> (f64, DVec2, DVec2) {
        let part = TAU / f64::from(self.turns);
        let angle = libm::atan2(direction.y, direction.x) - self.base;
        let whole = (angle / part).floor();
        let rest = angle - whole * part;
        let turned = |angle: f64| {
            let (sin, cos) = libm::sincos(angle);
            DVec2::new(cos, sin)
        };
        if self.mirrored && rest > 0.5 * part {
            let back = turned(-2.0 * self.base - (whole + 1.0) * part);
            return ((part - rest) / self.wedge(), back, DVec2::new(1.0, -1.0));
        }
        (rest / self.wedge(), turned(whole * part), DVec2::ONE)
    }
}

/// Whether a set of edges is the same after a rotation or a reflection.
fn is_same(edges: &[DVec2], change: impl Fn(DVec2) -> DVec2) -> bool {
    edges.iter().all(|edge| {
        let wanted = change(*edge);
        let near = |e: &DVec2| (*e - wanted).length() < 1e-6 * wanted.length();
        edges.iter().any(near)
    })
}

/// The inverse of a rotation.
pub(super) fn inverse(turn: DVec2) -> DVec2 {
    DVec2::new(turn.x, -turn.y)
}
