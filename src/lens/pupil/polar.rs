//! A table of pupils for a lens or a film without rotational symmetry: a stop with blades,
//! cylindrical surfaces, or a film that is moved.
//!
//! The film is divided into cells in polar coordinates about the axis of the lens, because the rims
//! of the lens cut off light along circles. A cell is halved, radially or in angle, whichever
//! direction has the greater error, until the interpolation error is below a bound.

use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_4, TAU};
use std::sync::OnceLock;

use glam::{DVec2, DVec3};

use crate::lens::lens::Lens;
use crate::lens::optics::film_place::FilmPlace;
use crate::lens::pupil::polygon::{SIDES, Support};
use crate::lens::pupil::sampler::PupilSampler;
use crate::lens::pupil::search::outline::{OutlineGuess, PupilOutline};
use crate::lens::pupil::search::pupil_search::PupilSearch;
use crate::lens::pupil::support::{Figure, MARGIN, excess, hull, mix, widened};
use crate::lens::pupil::symmetry::{Symmetry, inverse};

/// A cell is halved until interpolation between its corners cuts off less than this share of the
/// half width at its middle and at the middles of its sides. What is cut off is added to its
/// margin, so that the value bounds the lost rays and not the error. It was chosen by trial.
const MAX_CUT: f64 = 0.01;
/// A cell is also halved until interpolation adds less than this share of the half width. What is
/// added costs rays that are lost. It was chosen by trial.
const MAX_ADDED: f64 = 0.025;
/// The margin of a cell that is too small to be halved and in which the light ends, as a share of
/// the half width. Such a cell takes the hull of all its figures. It was chosen by trial.
const END_MARGIN: f64 = 0.02;
/// The number of cells from the axis outward at the start, and at most.
const RADIAL_CELLS: [u32; 2] = [4, 256];
/// The least arc of a cell, as a share of the film's radius. It bounds the work where light ends,
/// and was chosen by trial.
const MIN_ARC: f64 = 1.0 / 32.0;
/// The least arc if the lens has rotational symmetry, so that only the distance of the film differs
/// around the axis. It was chosen by trial.
const MIN_ARC_ROTATIONAL: f64 = 0.2;

/// Measured pupils over the film.
#[derive(Clone, Debug)]
pub(super) struct Cells {
    place: FilmPlace,
    symmetry: Symmetry,
    /// Whether the lens has rotational symmetry. Figures are then measured from film points in the
    /// meridian y = 0, and rotated to the film point.
    meridian: bool,
    /// The distance of the farthest film point from the axis, in millimeters.
    reach: f64,
    /// The number of cells around the axis at the start.
    around: u32,
    lens: Lens,
    sides: [DVec2; SIDES],
    /// The tree of each starting cell, from the axis outward. It is measured when a film point in
    /// the cell is first asked for, and independently of the others, so that the order of the
    /// requests does not change the result.
    trees: Vec<OnceLock<Vec<Branch>>>,
}

/// A node of a tree of cells. A place in it is (share of the reach, share of the wedge).
#[derive(Clone, Debug)]
enum Branch {
    /// Two branches, below and above a value of one coordinate.
    Split {
        axis: usize,
        at: f64,
        next: [usize; 2],
    },
    Cell(Box<Cell>),
    /// No light reaches film points here.
    Dark,
}

/// The figures at the corners of a cell, the middles of its sides and its middle, row by row.
#[derive(Clone, Debug)]
struct Cell {
    low: [f64; 2],
    /// Half of the size.
    half: [f64; 2],
    figures: [CenteredFigure; 9],
}

/// A figure, stored as its center relative to the direction of the film point, and its support from
/// that center.
///
/// The two are interpolated separately: the center of a small pupil moves along a circle as the
/// film point does, while its shape, that of the blades, is not rotated.
#[derive(Clone, Copy, Debug)]
struct CenteredFigure {
    center: DVec2,
    support: Support,
}

impl CenteredFigure {
    /// The figure from a film point in a direction.
    fn of(outline: &PupilOutline, direction: DVec2, sides: &[DVec2; SIDES]) -> Self {
        let center = outline.guess.center();
        Self {
            center: inverse(direction).rotate(center),
            support: shifted(&outline.support, -center, sides),
        }
    }

    /// The support from a film point in a direction.
    fn seen_from(&self, direction: DVec2, sides: &[DVec2; SIDES]) -> Support {
        shifted(&self.support, direction.rotate(self.center), sides)
    }

    /// Interpolates linearly between two figures.
    fn mix(a: &Self, b: &Self, t: f64) -> Self {
        Self {
            center: a.center.lerp(b.center, t),
            support: mix(&a.support, &b.support, t),
        }
    }

    /// The figure widened by a share of its half width.
    fn widened(&self, share: f64) -> Self {
        Self {
            support: widened(&self.support, share),
            ..*self
        }
    }
}

/// The support of a figure that is moved.
fn shifted(support: &Support, by: DVec2, sides: &[DVec2; SIDES]) -> Support {
    std::array::from_fn(|j| support[j] + by.dot(sides[j]))
}

impl Cell {
    /// The figure at a place, interpolated bilinearly in one of the four quarters of the cell.
    fn at(&self, place: [f64; 2]) -> CenteredFigure {
        let [u, v] = [0, 1].map(|k| ((place[k] - self.low[k]) / self.half[k]).clamp(0.0, 2.0));
        let (i, j) = ((u >= 1.0) as usize, (v >= 1.0) as usize);
        let (u, v) = (u - i as f64, v - j as f64);
        let row = |j: usize| {
            CenteredFigure::mix(&self.figures[3 * j + i], &self.figures[3 * j + i + 1], u)
        };
        CenteredFigure::mix(&row(j), &row(j + 1), v)
    }
}

impl Cells {
    /// Prepares a table for film points up to `film_radius` from the film's middle. Nothing is
    /// measured yet.
    pub(super) fn new(
        lens: &Lens,
        place: &FilmPlace,
        sides: &[DVec2; SIDES],
        film_radius: f64,
    ) -> Self {
        let place = *place;
        // The rim of the film is sampled at 64 points, and the reach has 1% to spare.
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
            trees: vec![OnceLock::new(); (RADIAL_CELLS[0] * around) as usize],
        }
    }

    /// The least arc of a cell, as a share of the film's radius.
    fn min_arc(&self) -> f64 {
        match self.meridian {
            true => MIN_ARC_ROTATIONAL,
            false => MIN_ARC,
        }
    }

    /// Measures the tree of a starting cell. The root is the first branch.
    fn measure_tree(&self, root: u32) -> Vec<Branch> {
        let search = PupilSearch::new(&self.lens);
        let sampler = &PupilSampler::new(&search, &self.place, &self.sides);
        let arcs = self.symmetry.wedge() / (f64::from(self.around) * self.min_arc());
        let finest = [
            2 * RADIAL_CELLS[1],
            2 * self.around * (arcs.max(1.0) as u32).next_power_of_two(),
        ];
        let mut lattice = Lattice {
            sampler,
            finest,
            nodes: HashMap::new(),
        };
        let size = [finest[0] / RADIAL_CELLS[0], finest[1] / self.around];
        let mut tree = vec![Branch::Dark];
        let low = [root / self.around * size[0], root % self.around * size[1]];
        let mut pending = vec![(0, low, size)];
        while let Some((branch, low, size)) = pending.pop() {
            match lattice.cell(self, low, size) {
                CellResult::Dark => {}
                CellResult::Cell(cell) => tree[branch] = Branch::Cell(cell),
                CellResult::Split(axis) => {
                    let next = [tree.len(), tree.len() + 1];
                    tree.extend([Branch::Dark, Branch::Dark]);
                    let (mut size, mut middle) = (size, low);
                    size[axis] /= 2;
                    middle[axis] += size[axis];
                    let at = f64::from(middle[axis]) / f64::from(finest[axis]);
                    tree[branch] = Branch::Split { axis, at, next };
                    pending.extend([(next[1], middle, size), (next[0], low, size)]);
                }
            }
        }
        tree
    }

    /// The figure of the pupil from a film point; none if no light reaches it.
    pub(super) fn figure(&self, film: DVec2) -> Option<Figure> {
        let point = self.place.point(film).truncate();
        let direction = point.try_normalize().unwrap_or(DVec2::X);
        let (into, turn, mirror) = self.symmetry.fold(direction);
        let place = [(point.length() / self.reach).min(1.0), into.clamp(0.0, 1.0)];
        let cells = [RADIAL_CELLS[0], self.around];
        let [i, j] = [0, 1].map(|k| ((place[k] * f64::from(cells[k])) as u32).min(cells[k] - 1));
        let root = i * self.around + j;
        let tree = self.trees[root as usize].get_or_init(|| self.measure_tree(root));
        let mut branch = 0;
        let cell = loop {
            match &tree[branch] {
                Branch::Split { axis, at, next } => {
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

    /// The direction from the axis for which the figure of a place is stored.
    fn direction(&self, place: [f64; 2]) -> DVec2 {
        if self.meridian {
            return DVec2::X;
        }
        let (sin, cos) = libm::sincos(self.symmetry.base + place[1] * self.symmetry.wedge());
        DVec2::new(cos, sin)
    }

    /// The film point from which the figure of a place is measured; none if the film is bent and
    /// does not reach that far.
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

/// The result of measuring a cell.
enum CellResult {
    /// No light reaches the nodes of the cell.
    Dark,
    Cell(Box<Cell>),
    /// The cell must be halved, radially (0) or in angle (1).
    Split(usize),
}

/// The nodes of the finest lattice, each measured at most once.
struct Lattice<'a> {
    sampler: &'a PupilSampler<'a>,
    /// The number of lattice steps radially and in angle.
    finest: [u32; 2],
    nodes: HashMap<[u32; 2], Option<PupilOutline>>,
}

impl Lattice<'_> {
    /// The outline from a node, measured if it was not yet.
    fn node(
        &mut self,
        cells: &Cells,
        at: [u32; 2],
        guess: Option<&OutlineGuess>,
    ) -> Option<PupilOutline> {
        // On the axis all directions are one point.
        let key = if at[0] == 0 { [0, 0] } else { at };
        if let Some(outline) = self.nodes.get(&key) {
            return *outline;
        }
        let place = self.place(key);
        let outline = cells.point(place).and_then(|p| self.sampler.at(p, guess));
        self.nodes.insert(key, outline);
        outline
    }

    /// The place of a node.
    fn place(&self, at: [u32; 2]) -> [f64; 2] {
        [0, 1].map(|k| f64::from(at[k]) / f64::from(self.finest[k]))
    }

    /// The outlines from the nine nodes of a cell. The corners are measured first, because the
    /// search at the other nodes starts from them.
    fn measure_nodes(
        &mut self,
        cells: &Cells,
        low: [u32; 2],
        size: [u32; 2],
    ) -> [Option<PupilOutline>; 9] {
        let mut all = [None; 9];
        let mut guess: Option<OutlineGuess> = None;
        // The film point that the guess comes from.
        let mut last = DVec2::ZERO;
        for k in [0, 2, 8, 6, 1, 5, 7, 3, 4] {
            let [i, j] = [k % 3, k / 3];
            let at = [
                low[0] + i as u32 * size[0] / 2,
                low[1] + j as u32 * size[1] / 2,
            ];
            // The nodes on both sides of a middle. A corner has none and stands for both.
            let [before, behind] = match (i, j) {
                (1, _) => [k - 1, k + 1],
                (_, 1) => [k - 3, k + 3],
                _ => [k, k],
            };
            let mut between = false;
            if let (Some(a), Some(b)) = (&all[before], &all[behind])
                && before != behind
            {
                (guess, between) = (Some(OutlineGuess::between(a, b)), true);
            }
            let place = self.place(at);
            let film = place[0] * cells.direction(place);
            if let (Some(guess), true) = (&mut guess, !between && last.length() > 0.0) {
                // To first order the center rotates and scales as the film point does.
                let along = inverse(last).rotate(film) / last.length_squared();
                *guess = guess.turned(along);
            }
            all[k] = self.node(cells, at, guess.as_ref());
            if let Some(outline) = &all[k] {
                (guess, last) = (Some(outline.guess), film);
            }
        }
        all
    }

    /// Measures the cell of a size, in lattice steps, whose lowest node is `low`.
    fn cell(&mut self, cells: &Cells, low: [u32; 2], size: [u32; 2]) -> CellResult {
        let outlines = self.measure_nodes(cells, low, size);
        let sides = &cells.sides;
        let place = |k: usize, v: u32| f64::from(v) / f64::from(self.finest[k]);
        // The directions of the three rows.
        let directions =
            [0, 1, 2].map(|j| cells.direction([0.0, place(1, low[1] + j * size[1] / 2)]));
        let figures: [Option<CenteredFigure>; 9] = std::array::from_fn(|k| {
            let outline = outlines[k].as_ref()?;
            Some(CenteredFigure::of(outline, directions[k / 3], sides))
        });
        let between = |ends: [usize; 2], middle: usize| {
            let [a, b] = ends.map(|k| figures[k].as_ref());
            let support = |figure: &CenteredFigure| figure.seen_from(directions[middle / 3], sides);
            let straight = a
                .zip(b)
                .map(|(a, b)| support(&CenteredFigure::mix(a, b, 0.5)));
            let middle = outlines[middle].as_ref().map(|outline| &outline.support);
            MixtureError::of([a.is_some(), b.is_some()], straight.as_ref(), middle)
        };
        // The error at the middle of a row, outward, and of a column, around.
        let row = |j: usize| between([3 * j, 3 * j + 2], 3 * j + 1);
        let column = |i: usize| between([i, i + 6], i + 3);
        let errors = [row(0).with(&row(2)), column(0).with(&column(2))];
        let within = row(1).with(&column(1));
        let all = errors[0].with(&errors[1]).with(&within);
        let coarse = size[0] > self.finest[0] / 8;
        let is_dark = outlines.iter().all(Option::is_none);
        if is_dark && !coarse {
            return CellResult::Dark;
        }
        if all.ratio > 1.0 || is_dark {
            let lengths = [
                place(0, size[0]),
                place(1, size[1]) * cells.symmetry.wedge() * place(0, low[0] + size[0]),
            ];
            let worse = match errors[0].ratio.partial_cmp(&errors[1].ratio) {
                // Rims cut off light along circles, so a cell in which the light ends is halved
                // radially first.
                _ if is_dark || !errors[0].ratio.is_finite() => 0,
                Some(std::cmp::Ordering::Greater) => 0,
                Some(std::cmp::Ordering::Less) => 1,
                _ => usize::from(lengths[1] > lengths[0]),
            };
            let may = [0, 1].map(|k| size[k] > 2 && (k == 0 || lengths[1] > cells.min_arc()));
            if may[worse] || may[1 - worse] {
                return CellResult::Split(if may[worse] { worse } else { 1 - worse });
            }
        }
        let lit: Vec<(usize, &CenteredFigure)> = (0..9)
            .filter_map(|k| Some((k, figures[k].as_ref()?)))
            .collect();
        let Some((_, first)) = lit.first() else {
            return CellResult::Dark;
        };
        let figures = match all.ratio <= 1.0 {
            true => figures.map(|f| f.unwrap_or(**first).widened(MARGIN + all.cut)),
            false => {
                // The hull of all figures, around the mean of their centers.
                let centers = lit.iter().map(|(_, figure)| figure.center);
                let center = centers.sum::<DVec2>() / lit.len() as f64;
                let upright = |(k, figure): &(usize, &CenteredFigure)| {
                    let off = directions[k / 3].rotate(figure.center - center);
                    shifted(&figure.support, off, sides)
                };
                let supports = lit.iter().map(upright);
                let support = supports
                    .reduce(|a, b| hull(&a, &b))
                    .unwrap_or(first.support);
                [CenteredFigure { center, support }.widened(MARGIN + END_MARGIN); 9]
            }
        };
        CellResult::Cell(Box::new(Cell {
            low: [0, 1].map(|k| place(k, low[k])),
            half: [0, 1].map(|k| 0.5 * place(k, size[k])),
            figures,
        }))
    }
}

/// The interpolation error at a node between two others.
#[derive(Clone, Copy)]
struct MixtureError {
    /// What interpolation cuts off, as a share of the half width.
    cut: f64,
    /// The greater of two ratios: what is cut off to [`MAX_CUT`], and what is added to
    /// [`MAX_ADDED`].
    ratio: f64,
}

impl MixtureError {
    /// The error of the interpolated support `straight`, if `middle` was measured. `ends` says
    /// whether light reaches the two nodes. If it reaches only some of the three, the ratio is
    /// infinite.
    fn of(ends: [bool; 2], straight: Option<&Support>, middle: Option<&Support>) -> Self {
        match (straight, middle) {
            (Some(straight), Some(middle)) => {
                let cut = excess(middle, straight).max(0.0);
                let added = excess(straight, middle);
                let ratio = (cut / MAX_CUT).max(added / MAX_ADDED);
                Self { cut, ratio }
            }
            (None, None) if ends == [false; 2] => Self {
                cut: 0.0,
                ratio: 0.0,
            },
            _ => Self {
                cut: 0.0,
                ratio: f64::INFINITY,
            },
        }
    }

    /// The greater of two errors.
    fn with(&self, other: &Self) -> Self {
        Self {
            cut: self.cut.max(other.cut),
            ratio: self.ratio.max(other.ratio),
        }
    }
}
