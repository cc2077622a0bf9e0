//! The pupil over a film that does not look the same all around the axis: blades in the stop,
//! cylinders, a film that is moved. It is measured cell by cell in polar coordinates about the
//! lens's axis, where rims cut along circles, and cells are halved outward or around, whichever
//! errs, until interpolation holds.

use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_4, PI, TAU};
use std::sync::OnceLock;

use glam::{DVec2, DVec3};

use super::polygon::{SIDES, Support};
use super::sampler::Look;
use super::search::outline::{Hint, Seen};
use super::search::pupil_search::Sight;
use super::support::{Figure, MARGIN, excess, hull, mix, widened};
use crate::lens::lens::Lens;
use crate::lens::optics::film_place::FilmPlace;

/// A cell is halved until what its middle and the middles of its sides stick out of the mixture
/// of its corners, and what that adds to them, is less than these shares of the half width. What
/// sticks out is added to the margin of the cell.
const MAY_CUT: f64 = 0.01;
const MAY_ADD: f64 = 0.025;
/// Where light ends within the smallest cells they take all that is seen from them, and more.
const AT_THE_END: f64 = 0.02;
/// Cells from the axis outward to begin with, and at most.
const OUTWARD: [u32; 2] = [4, 256];
/// The least arc of a cell at the film's rim, as a share of the film's radius.
const LEAST_ARC: f64 = 1.0 / 32.0;
/// The same where only the film's distance differs around the axis.
const LEAST_ARC_MOVED: f64 = 0.2;

/// What makes a film point's pupil that of a point in one wedge of the film: turns by a whole
/// part of a circle, and mirrors.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Symmetry {
    /// Turns by one of so many parts of a circle change nothing.
    turns: u32,
    /// The angle of a mirror, if there is one, or where the first wedge begins.
    base: f64,
    mirrored: bool,
}

impl Symmetry {
    const NONE: Self = Self {
        turns: 1,
        base: 0.0,
        mirrored: false,
    };

    fn of(lens: &Lens, place: &FilmPlace) -> Self {
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

    /// The angle of a wedge.
    fn wedge(&self) -> f64 {
        let circle = if self.mirrored { PI } else { TAU };
        circle / f64::from(self.turns)
    }

    /// How far into the wedge a direction is, in parts of it, and the turn and the mirror that
    /// bring a figure from there to it.
    fn fold(&self, direction: DVec2) -> (f64, DVec2, DVec2) {
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

/// Whether a row of edges is the same after a turn or a mirror.
fn is_same(edges: &[DVec2], change: impl Fn(DVec2) -> DVec2) -> bool {
    edges.iter().all(|edge| {
        let wanted = change(*edge);
        let near = |e: &DVec2| (*e - wanted).length() < 1e-6 * wanted.length();
        edges.iter().any(near)
    })
}

/// Measured supports over the film.
#[derive(Clone, Debug)]
pub(super) struct Cells {
    place: FilmPlace,
    symmetry: Symmetry,
    /// Figures are kept as seen from the meridian, and turned to the film point.
    meridian: bool,
    /// The farthest film point from the axis.
    reach: f64,
    /// Cells around to begin with.
    around: u32,
    lens: Lens,
    sides: [DVec2; SIDES],
    /// What grows from each of the cells to begin with, from the axis outward: measured when a film
    /// point there is first asked for. Each is measured by itself, so that the same comes out
    /// whichever is asked for first.
    trees: Vec<OnceLock<Vec<Branch>>>,
}

/// A place is (share of the reach, share of the wedge).
#[derive(Clone, Debug)]
enum Branch {
    /// Two branches below and above a share of the reach, or of the wedge.
    Halved {
        axis: usize,
        at: f64,
        next: [usize; 2],
    },
    Cell(Box<Cell>),
    Dark,
}

/// Figures at the corners of a cell, the middles of its sides and its middle, row by row.
#[derive(Clone, Debug)]
struct Cell {
    low: [f64; 2],
    /// From a corner to the middle.
    half: [f64; 2],
    figures: [Around; 9],
}

/// A figure by where its middle is, outward and around as the film point has it, and its support
/// from there. A small pupil goes far around the axis: its middle along a circle, while its shape,
/// as that of blades, stays upright.
#[derive(Clone, Copy, Debug)]
struct Around {
    middle: DVec2,
    support: Support,
}

impl Around {
    /// What is seen from a film point in a direction.
    fn of(seen: &Seen, direction: DVec2, sides: &[DVec2; SIDES]) -> Self {
        let middle = seen.hint.center();
        Self {
            middle: inverse(direction).rotate(middle),
            support: shifted(&seen.support, -middle, sides),
        }
    }

    /// The support, as it is from a film point in a direction.
    fn seen_from(&self, direction: DVec2, sides: &[DVec2; SIDES]) -> Support {
        shifted(&self.support, direction.rotate(self.middle), sides)
    }

    fn mix(a: &Self, b: &Self, t: f64) -> Self {
        Self {
            middle: a.middle.lerp(b.middle, t),
            support: mix(&a.support, &b.support, t),
        }
    }

    fn widened(&self, share: f64) -> Self {
        Self {
            support: widened(&self.support, share),
            ..*self
        }
    }
}

/// Turns the other way.
fn inverse(turn: DVec2) -> DVec2 {
    DVec2::new(turn.x, -turn.y)
}

fn shifted(support: &Support, by: DVec2, sides: &[DVec2; SIDES]) -> Support {
    std::array::from_fn(|j| support[j] + by.dot(sides[j]))
}

impl Cell {
    fn at(&self, place: [f64; 2]) -> Around {
        let [u, v] = [0, 1].map(|k| ((place[k] - self.low[k]) / self.half[k]).clamp(0.0, 2.0));
        let (i, j) = ((u >= 1.0) as usize, (v >= 1.0) as usize);
        let (u, v) = (u - i as f64, v - j as f64);
        let row = |j: usize| Around::mix(&self.figures[3 * j + i], &self.figures[3 * j + i + 1], u);
        Around::mix(&row(j), &row(j + 1), v)
    }
}

impl Cells {
    pub fn new(lens: &Lens, place: &FilmPlace, sides: &[DVec2; SIDES], film_radius: f64) -> Self {
        let place = *place;
        let far = |k: i32| {
            let film = 1.01 * film_radius * DVec2::from_angle(TAU * f64::from(k) / 64.0);
            place.point(film).truncate().length()
        };
        let meridian = lens.is_rotational();
        let symmetry = Symmetry::of(lens, &place);
        let around = match meridian {
            true => 4,
            false => (symmetry.wedge() / FRAC_PI_4 - 1e-9).ceil() as u32,
        };
        Self {
            place,
            symmetry,
            meridian,
            reach: (0..64).map(far).fold(film_radius, f64::max),
            around,
            lens: lens.clone(),
            sides: *sides,
            trees: vec![OnceLock::new(); (OUTWARD[0] * around) as usize],
        }
    }

    fn least_arc(&self) -> f64 {
        match self.meridian {
            true => LEAST_ARC_MOVED,
            false => LEAST_ARC,
        }
    }

    /// Measures what grows from one of the cells to begin with; it is the first branch.
    fn grown(&self, root: u32) -> Vec<Branch> {
        let sight = Sight::new(&self.lens);
        let look = &Look::new(&sight, &self.place, &self.sides);
        let arcs = self.symmetry.wedge() / (f64::from(self.around) * self.least_arc());
        let finest = [
            2 * OUTWARD[1],
            2 * self.around * (arcs.max(1.0) as u32).next_power_of_two(),
        ];
        let mut growth = Growth {
            look,
            finest,
            nodes: HashMap::new(),
        };
        let size = [finest[0] / OUTWARD[0], finest[1] / self.around];
        let mut tree = vec![Branch::Dark];
        let low = [root / self.around * size[0], root % self.around * size[1]];
        let mut ahead = vec![(0, low, size)];
        while let Some((branch, low, size)) = ahead.pop() {
            match growth.cell(self, low, size) {
                Found::Dark => {}
                Found::Cell(cell) => tree[branch] = Branch::Cell(cell),
                Found::ToHalve(axis) => {
                    let next = [tree.len(), tree.len() + 1];
                    tree.extend([Branch::Dark, Branch::Dark]);
                    let (mut size, mut middle) = (size, low);
                    size[axis] /= 2;
                    middle[axis] += size[axis];
                    let at = f64::from(middle[axis]) / f64::from(finest[axis]);
                    tree[branch] = Branch::Halved { axis, at, next };
                    ahead.extend([(next[1], middle, size), (next[0], low, size)]);
                }
            }
        }
        tree
    }

    /// What a film point sees.
    pub fn figure(&self, film: DVec2) -> Option<Figure> {
        let point = self.place.point(film).truncate();
        let direction = point.try_normalize().unwrap_or(DVec2::X);
        let (into, turn, mirror) = self.symmetry.fold(direction);
        let place = [(point.length() / self.reach).min(1.0), into.clamp(0.0, 1.0)];
        let cells = [OUTWARD[0], self.around];
        let [i, j] = [0, 1].map(|k| ((place[k] * f64::from(cells[k])) as u32).min(cells[k] - 1));
        let root = i * self.around + j;
        let tree = self.trees[root as usize].get_or_init(|| self.grown(root));
        let mut branch = 0;
        let cell = loop {
            match &tree[branch] {
                Branch::Halved { axis, at, next } => {
                    branch = next[usize::from(place[*axis] >= *at)];
                }
                Branch::Cell(cell) => break cell,
                Branch::Dark => return None,
            }
        };
        let (folded, turn, mirror) = match self.meridian {
            true => (DVec2::X, direction, DVec2::ONE),
            false => (inverse(turn).rotate(mirror * direction), turn, mirror),
        };
        Some(Figure {
            support: cell.at(place).seen_from(folded, &self.sides),
            turn,
            mirror,
        })
    }

    /// The direction from the axis of a place, as what is seen from there is kept.
    fn direction(&self, place: [f64; 2]) -> DVec2 {
        if self.meridian {
            return DVec2::X;
        }
        let (sin, cos) = libm::sincos(self.symmetry.base + place[1] * self.symmetry.wedge());
        DVec2::new(cos, sin)
    }

    /// The film point of a place, as it is to be measured. None beside a film that is bent.
    fn point(&self, place: [f64; 2]) -> Option<DVec3> {
        let radius = place[0] * self.reach;
        let angle = self.symmetry.base + place[1] * self.symmetry.wedge();
        let (sin, cos) = libm::sincos(angle);
        let point = self.place.over(radius * DVec2::new(cos, sin))?;
        Some(match self.meridian {
            true => DVec3::new(radius, 0.0, point.z),
            false => point,
        })
    }
}

enum Found {
    Dark,
    Cell(Box<Cell>),
    /// Outward (0) or around (1).
    ToHalve(usize),
}

/// Measuring the nodes of the finest lattice, each once.
struct Growth<'a> {
    look: &'a Look<'a>,
    finest: [u32; 2],
    nodes: HashMap<[u32; 2], Option<Seen>>,
}

impl Growth<'_> {
    fn node(&mut self, cells: &Cells, at: [u32; 2], hint: Option<&Hint>) -> Option<Seen> {
        // All around, the axis is one point.
        let key = if at[0] == 0 { [0, 0] } else { at };
        if let Some(seen) = self.nodes.get(&key) {
            return *seen;
        }
        let place = self.place(key);
        let seen = cells.point(place).and_then(|p| self.look.at(p, hint));
        self.nodes.insert(key, seen);
        seen
    }

    fn place(&self, at: [u32; 2]) -> [f64; 2] {
        [0, 1].map(|k| f64::from(at[k]) / f64::from(self.finest[k]))
    }

    /// The nine nodes of a cell, its corners first, as later ones begin from those.
    fn nine(&mut self, cells: &Cells, low: [u32; 2], size: [u32; 2]) -> [Option<Seen>; 9] {
        let mut all = [None; 9];
        let mut hint: Option<Hint> = None;
        // The film point that the hint is from.
        let mut last = DVec2::ZERO;
        for k in [0, 2, 8, 6, 1, 5, 7, 3, 4] {
            let [i, j] = [k % 3, k / 3];
            let at = [
                low[0] + i as u32 * size[0] / 2,
                low[1] + j as u32 * size[1] / 2,
            ];
            // Between two, in the middle.
            let [before, behind] = match (i, j) {
                (1, _) => [k - 1, k + 1],
                (_, 1) => [k - 3, k + 3],
                _ => [k, k],
            };
            let mut between = false;
            if let (Some(a), Some(b)) = (&all[before], &all[behind])
                && before != behind
            {
                (hint, between) = (Some(Hint::between(a, b)), true);
            }
            let place = self.place(at);
            let film = place[0] * cells.direction(place);
            if let (Some(hint), true) = (&mut hint, !between && last.length() > 0.0) {
                // Its middle goes along with the film point, nearly.
                let along = inverse(last).rotate(film) / last.length_squared();
                *hint = hint.turned(along);
            }
            all[k] = self.node(cells, at, hint.as_ref());
            if let Some(seen) = &all[k] {
                (hint, last) = (Some(seen.hint), film);
            }
        }
        all
    }

    fn cell(&mut self, cells: &Cells, low: [u32; 2], size: [u32; 2]) -> Found {
        let nine = self.nine(cells, low, size);
        let sides = &cells.sides;
        let place = |k: usize, v: u32| f64::from(v) / f64::from(self.finest[k]);
        // Directions below, in the middle and above.
        let ways = [0, 1, 2].map(|j| cells.direction([0.0, place(1, low[1] + j * size[1] / 2)]));
        let figures: [Option<Around>; 9] = std::array::from_fn(|k| {
            let seen = nine[k].as_ref()?;
            Some(Around::of(seen, ways[k / 3], sides))
        });
        let between = |ends: [usize; 2], middle: usize| {
            let [a, b] = ends.map(|k| figures[k].as_ref());
            let seen = |figure: &Around| figure.seen_from(ways[middle / 3], sides);
            let straight = a.zip(b).map(|(a, b)| seen(&Around::mix(a, b, 0.5)));
            let middle = nine[middle].as_ref().map(|seen| &seen.support);
            Between::of([a.is_some(), b.is_some()], straight.as_ref(), middle)
        };
        // The middle of a row outward, and of one around.
        let row = |j: usize| between([3 * j, 3 * j + 2], 3 * j + 1);
        let column = |i: usize| between([i, i + 6], i + 3);
        let errs = [row(0).with(&row(2)), column(0).with(&column(2))];
        let within = row(1).with(&column(1));
        let all = errs[0].with(&errs[1]).with(&within);
        let coarse = size[0] > self.finest[0] / 8;
        let is_dark = nine.iter().all(Option::is_none);
        if is_dark && !coarse {
            return Found::Dark;
        }
        if all.bad > 1.0 || is_dark {
            let lengths = [
                place(0, size[0]),
                place(1, size[1]) * cells.symmetry.wedge() * place(0, low[0] + size[0]),
            ];
            let worse = match errs[0].bad.partial_cmp(&errs[1].bad) {
                // Rims cut along circles: where light ends outward first.
                _ if is_dark || !errs[0].bad.is_finite() => 0,
                Some(std::cmp::Ordering::Greater) => 0,
                Some(std::cmp::Ordering::Less) => 1,
                _ => usize::from(lengths[1] > lengths[0]),
            };
            let may = [0, 1].map(|k| size[k] > 2 && (k == 0 || lengths[1] > cells.least_arc()));
            if may[worse] || may[1 - worse] {
                return Found::ToHalve(if may[worse] { worse } else { 1 - worse });
            }
        }
        let seen: Vec<(usize, &Around)> = (0..9)
            .filter_map(|k| Some((k, figures[k].as_ref()?)))
            .collect();
        let Some((_, first)) = seen.first() else {
            return Found::Dark;
        };
        let figures = match all.bad <= 1.0 {
            true => figures.map(|f| f.unwrap_or(**first).widened(MARGIN + all.cut)),
            false => {
                // All that is seen, around the middle of all.
                let middles = seen.iter().map(|(_, figure)| figure.middle);
                let middle = middles.sum::<DVec2>() / seen.len() as f64;
                let upright = |(k, figure): &(usize, &Around)| {
                    let off = ways[k / 3].rotate(figure.middle - middle);
                    shifted(&figure.support, off, sides)
                };
                let supports = seen.iter().map(upright);
                let support = supports
                    .reduce(|a, b| hull(&a, &b))
                    .unwrap_or(first.support);
                [Around { middle, support }.widened(MARGIN + AT_THE_END); 9]
            }
        };
        Found::Cell(Box::new(Cell {
            low: [0, 1].map(|k| place(k, low[k])),
            half: [0, 1].map(|k| 0.5 * place(k, size[k])),
            figures,
        }))
    }
}

/// How a node is missed by the mixture of its two neighbors.
#[derive(Clone, Copy)]
struct Between {
    /// What it sticks out, as a share of the half width.
    cut: f64,
    /// The worse of what it sticks out and what is added, in parts of what may be.
    bad: f64,
}

impl Between {
    fn of(ends: [bool; 2], straight: Option<&Support>, middle: Option<&Support>) -> Self {
        match (straight, middle) {
            (Some(straight), Some(middle)) => {
                let cut = excess(middle, straight).max(0.0);
                let added = excess(straight, middle);
                let bad = (cut / MAY_CUT).max(added / MAY_ADD);
                Self { cut, bad }
            }
            (None, None) if ends == [false; 2] => Self { cut: 0.0, bad: 0.0 },
            _ => Self {
                cut: 0.0,
                bad: f64::INFINITY,
            },
        }
    }

    fn with(&self, other: &Self) -> Self {
        Self {
            cut: self.cut.max(other.cut),
            bad: self.bad.max(other.bad),
        }
    }
}
