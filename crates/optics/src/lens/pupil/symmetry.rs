//! The symmetry of a lens and its film about the axis.

use std::f64::consts::{PI, TAU};

use glam::DVec2;
use ivcam_base::math::lanes::fused;

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
    /// The symmetry of a lens and its film.
    pub(super) fn new(lens: &Lens, place: &FilmPlace) -> Self {
        if !place.is_centered() || lens.prescription().is_decentered() || lens.has_outlines() {
            return Self {
                turns: 1,
                base: 0.0,
                mirrored: false,
            };
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

    /// The rotations and signs that map the first wedge to the others.
    pub(super) fn copies(&self) -> Vec<WedgeCopy> {
        let part = TAU / f64::from(self.turns);
        let copies = (0..self.turns).flat_map(|number| {
            let plain = unit(f64::from(number) * part);
            let mirrored = WedgeCopy {
                turn: unit(-2.0 * self.base - f64::from(number + 1) * part),
                mirror: DVec2::new(1.0, -1.0),
            };
            [WedgeCopy::turned(plain), mirrored]
        });
        copies.collect()
    }

    /// The angle of a wedge, in radians.
    pub(super) fn wedge(&self) -> f64 {
        let circle = if self.mirrored { PI } else { TAU };
        circle / f64::from(self.turns)
    }

    /// The position of a direction in its wedge, 0 to 1, and the number in [`Self::copies`] of that
    /// wedge. The direction need not be of unit length.
    #[inline(always)]
    pub(super) fn fold<const FUSED: bool>(&self, x: f64, y: f64) -> (f64, f64) {
        let turns = f64::from(self.turns);
        let around = (turns_of::<FUSED>(x, y) - self.base / TAU) * turns;
        let whole = around.floor();
        let rest = around - whole;
        let number = 2.0 * (whole - turns * (whole / turns).floor());
        let is_mirrored = self.mirrored & (rest > 0.5);
        let scale = if self.mirrored { 2.0 } else { 1.0 };
        let rest = if is_mirrored { 1.0 - rest } else { rest };
        (
            scale * rest,
            if is_mirrored { number + 1.0 } else { number },
        )
    }
}

/// A rotation and a reflection of a wedge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WedgeCopy {
    /// The wedge is rotated so that +x becomes this unit vector.
    pub turn: DVec2,
    /// The coordinates of the rotated wedge are multiplied by these signs.
    pub mirror: DVec2,
}

impl WedgeCopy {
    /// The wedge rotated by a unit vector.
    #[inline(always)]
    pub(super) fn turned(turn: DVec2) -> Self {
        let mirror = DVec2::ONE;
        Self { turn, mirror }
    }

    /// Maps a direction of this wedge to the first.
    #[inline(always)]
    pub(super) fn unfold(&self, direction: DVec2) -> DVec2 {
        inverse(self.turn).rotate(self.mirror * direction)
    }

    /// Maps a point of the first wedge to this one.
    #[inline(always)]
    pub(super) fn placed(&self, point: DVec2) -> DVec2 {
        self.mirror * self.turn.rotate(point)
    }
}

/// The angle of a vector as a fraction of a full turn, from −1/2 to 1/2, with an error below 1e-12.
/// It has no branches.
#[inline(always)]
fn turns_of<const FUSED: bool>(x: f64, y: f64) -> f64 {
    let (ax, ay) = (x.abs(), y.abs());
    let (near, far) = (ax.min(ay), ax.max(ay));
    // Above the tangent of π/8 the angle is measured from π/4.
    let is_wide = near > 0.414_213_562_373_095_03 * far;
    let across = if is_wide { near - far } else { near };
    let along = if is_wide { near + far } else { far };
    let t = across / (if along > 0.0 { along } else { 1.0 });
    let square = -t * t;
    let mut sum = 1.0 / 29.0;
    for k in (0..14).rev() {
        sum = fused::<FUSED>(sum, square, 1.0 / f64::from(2 * k + 1));
    }
    let angle = t * sum * (1.0 / TAU) + if is_wide { 0.125 } else { 0.0 };
    let angle = if ay > ax { 0.25 - angle } else { angle };
    let angle = if x < 0.0 { 0.5 - angle } else { angle };
    if y < 0.0 { -angle } else { angle }
}

/// Whether a set of edges is the same after a rotation or a reflection.
fn is_same(edges: &[DVec2], change: impl Fn(DVec2) -> DVec2) -> bool {
    edges.iter().all(|edge| {
        let wanted = change(*edge);
        let near = |e: &DVec2| (*e - wanted).length() < 1e-6 * wanted.length();
        edges.iter().any(near)
    })
}

/// The unit vector at an angle from +x, in radians. It is the same on every machine.
pub(super) fn unit(angle: f64) -> DVec2 {
    let (sin, cos) = libm::sincos(angle);
    DVec2::new(cos, sin)
}

/// The inverse of a rotation.
pub(super) fn inverse(turn: DVec2) -> DVec2 {
    DVec2::new(turn.x, -turn.y)
}
