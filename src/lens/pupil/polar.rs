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
use crate::lens::pupil::aims::Aims;
use crate::lens::pupil::patch::{Located, Patch, Position};
use crate::lens::pupil::radial::support_around;
use crate::lens::pupil::rim_shares::{open_share, open_shares_over};
use crate::lens::pupil::sampler::PupilSampler;
use crate::lens::pupil::search::outline::{OutlineGuess, PupilOutline};
use crate::lens::pupil::search::pupil_search::PupilSearch;
use crate::lens::pupil::sides::{Outline, SIDES, Support};
use crate::lens::pupil::support::{MARGIN, excess, hull, mix, widened};
use crate::lens::pupil::symmetry::{Symmetry, WedgeCopy, inverse};
use crate::math::lagrange_weight;
use crate::math::lanes::{LANES, Lane, SimdKernel};

/// A cell is halved until interpolation between its corners cuts off less than this share of the
/// half width at its middle and at the middles of its sides. What is cut off is added to its
/// margin, so that the value bounds the lost rays and not the error. It was chosen by trial.
const MAX_CUT: f64 = 0.015;
/// A cell is also halved until interpolation adds less than this share of the half width. What is
/// added costs rays that are lost and aimed again. It was chosen by trial.
const MAX_ADDED: f64 = 0.035;
/// The margin of a cell that is too small to be halved and in which the light ends, as a share of
/// the half width. Such a cell takes the hull of all its figures. It was chosen by trial.
const END_MARGIN: f64 = 0.05;
/// The number of cells from the axis outward at the start, and at most.
const RADIAL_CELLS: [u32; 2] = [4, 256];
/// The greatest number of cells from the axis outward where light ends. It bounds the work there.
/// Cells of a quarter of this size in both directions take four times as long to measure, and on a
/// film of 36×24 mm, larger than its image, the anamorphic lens then gets 3% more rays through.
const END_CELLS: u32 = 64;
/// The least arc of a cell, as a share of the film's radius. It was chosen by trial.
const MIN_ARC: f64 = 1.0 / 32.0;
/// The least arc where light ends, as for [`END_CELLS`].
const MIN_END_ARC: f64 = 1.0 / 8.0;
/// The least arc if the lens has rotational symmetry, so that only the distance of the film differs
/// around the axis. It was chosen by trial.
const MIN_ARC_ROTATIONAL: f64 = 0.2;

/// The places along a side of a cell at which open shares are measured.
const PLACES: usize = 5;

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
    /// The rotations and signs that map the first wedge to the others.
    copies: Vec<WedgeCopy>,
    /// The lens at one wavelength, or at the shortest, its own and the longest.
    lenses: Vec<Lens>,
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
    /// The four quarters, row by row. Each is prepared when a film point in it is first asked for.
    quarters: [OnceLock<Box<Patch>>; 4],
    /// For each lens, row by row: see [`Cells::open_share`]. Empty if they are not measured.
    open_shares: Vec<OnceLock<Option<f64>>>,
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
            copies: symmetry.copies(),
            lenses: vec![lens.clone()],
            sides: *sides,
            trees: vec![OnceLock::new(); (RADIAL_CELLS[0] * around) as usize],
        }
    }

    /// The table whose figures contain the pupils of several wavelengths, of which each table has
    /// one. Nothing is measured yet.
    pub(super) fn around(tables: &[&Self]) -> Self {
        let middle = tables[tables.len() / 2];
        Self {
            lenses: tables.iter().flat_map(|t| t.lenses.clone()).collect(),
            trees: vec![OnceLock::new(); middle.trees.len()],
            ..middle.clone()
        }
    }

    /// The greatest number of cells from the axis outward, and the least arc of a cell as a share
    /// of the film's radius, where light ends or elsewhere.
    fn finest(&self, is_end: bool) -> (u32, f64) {
        match (self.meridian, is_end) {
            (true, _) => (RADIAL_CELLS[1], MIN_ARC_ROTATIONAL),
            (false, true) => (END_CELLS, MIN_END_ARC),
            (false, false) => (RADIAL_CELLS[1], MIN_ARC),
        }
    }

    /// Measures the tree of a starting cell. The root is the first branch.
    fn measure_tree(&self, root: u32) -> Vec<Branch> {
        let searches: Vec<PupilSearch<'_>> = self.lenses.iter().map(PupilSearch::new).collect();
        let sampler = |search| PupilSampler::new(search, &self.place, &self.sides);
        let samplers: Vec<PupilSampler<'_>> = searches.iter().map(sampler).collect();
        let (radial, arc) = self.finest(false);
        let arcs = self.symmetry.wedge() / (f64::from(self.around) * arc);
        let finest = [
            2 * radial,
            2 * self.around * (arcs.max(1.0) as u32).next_power_of_two(),
        ];
        let mut lattice = Lattice {
            samplers: &samplers,
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

    /// The place of a film point, its direction from the axis, and the number of its wedge's copy.
    #[inline(always)]
    fn place_of<const FUSED: bool>(&self, film: DVec2) -> ([f64; 2], DVec2, f64) {
        let point = self.place.point(film);
        let radius = (point.x * point.x + point.y * point.y).sqrt();
        // On the axis every direction is the same: take +x.
        let (x, y) = if radius > 0.0 {
            (point.x, point.y)
        } else {
            (1.0, 0.0)
        };
        let length = if radius > 0.0 { radius } else { 1.0 };
        let (into, copy) = self.symmetry.fold::<FUSED>(x, y);
        let place = [(radius / self.reach).min(1.0), into.clamp(0.0, 1.0)];
        (place, DVec2::new(x / length, y / length), copy)
    }

    /// Locates a film point in the table; none if no light reaches it.
    pub(super) fn locate(&self, film: DVec2) -> Option<Located<'_>> {
        let (place, direction, copy) = self.place_of::<false>(film);
        let patch = self.patch(place)?;
        let (direction, copy) = self.unfolded(direction, copy);
        Some(Located {
            patch,
            at: patch.position(place),
            direction,
            copy,
        })
    }

    /// The direction of a film point in the first wedge, and the copy that maps it to its own.
    #[inline(always)]
    fn unfolded(&self, direction: DVec2, copy: f64) -> (DVec2, WedgeCopy) {
        if self.meridian {
            let turn = direction;
            let copy = WedgeCopy {
                turn,
                ..WedgeCopy::NONE
            };
            return (DVec2::X, copy);
        }
        let copy = self.copies[copy as usize];
        (copy.unfold(direction), copy)
    }

    /// The patch of a place; none if no light reaches it. The tree of the place is measured if it
    /// was not yet.
    fn patch(&self, place: [f64; 2]) -> Option<&Patch> {
        let cells = [RADIAL_CELLS[0], self.around];
        let [i, j] = [0, 1].map(|k| ((place[k] * f64::from(cells[k])) as u32).min(cells[k] - 1));
        let root = i * self.around + j;
        let tree = self.trees[root as usize].get_or_init(|| self.measure_tree(root));
        let mut branch = 0;
        loop {
            match &tree[branch] {
                Branch::Split { axis, at, next } => {
                    branch = next[usize::from(place[*axis] >= *at)];
                }
                Branch::Cell(cell) => return Some(self.quarter(cell, place)),
                Branch::Dark => return None,
            }
        }
    }

    /// The quarter of a cell that contains a place.
    fn quarter<'a>(&self, cell: &'a Cell, place: [f64; 2]) -> &'a Patch {
        let [i, j] = [0, 1].map(|k| usize::from(place[k] >= cell.low[k] + cell.half[k]));
        cell.quarters[2 * j + i].get_or_init(|| {
            let corners = [0, 1, 3, 4].map(|k| &cell.figures[3 * j + i + k]);
            let low = |k: usize, half: usize| cell.low[k] + half as f64 * cell.half[k];
            let patch = Patch::new(
                [low(0, i), low(1, j)],
                cell.half,
                corners.map(|figure| (figure.center, &figure.support)),
                &self.sides,
            );
            if cell.open_shares.is_empty() {
                return Box::new(patch);
            }
            let share = |lens, k| self.open_share(cell, lens, [2 * i + k % 3, 2 * j + k / 3]);
            let shares = open_shares_over(self.lenses.len(), share);
            Box::new(patch.with_open_shares(shares.unwrap_or_default()))
        })
    }

    /// The open share for a lens at one of the places that divide each side of a cell into four
    /// parts. It is measured when it is first asked for, from the cell alone, because quarters
    /// share places.
    fn open_share(&self, cell: &Cell, lens: usize, [i, j]: [usize; 2]) -> Option<f64> {
        let known = &cell.open_shares[PLACES * (PLACES * lens + j) + i];
        *known.get_or_init(|| {
            let place =
                [(0, i), (1, j)].map(|(k, at)| cell.low[k] + 0.5 * at as f64 * cell.half[k]);
            let direction = self.direction(place);
            let row = |j: usize| {
                let [a, b] = [i / 2, i.div_ceil(2)].map(|i| &cell.figures[3 * j + i]);
                CenteredFigure::mix(a, b, 0.5)
            };
            let figure = CenteredFigure::mix(&row(j / 2), &row(j.div_ceil(2)), 0.5);
            let support = figure.seen_from(direction, &self.sides);
            let outline = Outline::of(&support, &self.sides);
            open_share(&self.lenses[lens], self.point(place)?, &outline)
        })
    }

    /// The weights of the lenses' open shares for a wavelength in nanometers. The pupil is regarded
    /// as a quadratic of the square of the wavenumber, as by Cauchy's formula the index is nearly.
    pub(super) fn weights_at(&self, wavelength_nm: f64) -> Vec<f64> {
        let square = |nm: f64| 1.0 / (nm * nm);
        let at: Vec<f64> = self.lenses.iter().map(|l| square(l.wavelength())).collect();
        let weight = |k: usize| lagrange_weight(&at, k, square(wavelength_nm));
        (0..at.len()).map(weight).collect()
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
    /// One for each wavelength.
    samplers: &'a [PupilSampler<'a>],
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
        let point = cells.point(self.place(key));
        let outline = point.and_then(|point| self.measure(point, guess));
        self.nodes.insert(key, outline);
        outline
    }

    /// Measures the outline around the pupils of all wavelengths from a film point.
    fn measure(&self, point: DVec3, guess: Option<&OutlineGuess>) -> Option<PupilOutline> {
        let outlines = self.samplers.iter().map(|sampler| sampler.at(point, guess));
        let outlines: Vec<Option<PupilOutline>> = outlines.collect();
        let supports: Vec<Option<Support>> =
            outlines.iter().map(|o| o.map(|o| o.support)).collect();
        let support = support_around(&supports)?;
        let middle = outlines[outlines.len() / 2];
        let any = middle.or_else(|| outlines.into_iter().flatten().next())?;
        Some(PupilOutline { support, ..any })
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
            let (radial, arc) = cells.finest(!all.ratio.is_finite());
            let may = [
                size[0] > self.finest[0] / radial,
                size[1] > 2 && lengths[1] > arc,
            ];
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
        let is_interpolated = all.ratio <= 1.0;
        // The open share of a hull varies too much to be interpolated.
        let places = match is_interpolated && cells.lenses[0].is_iris_convex() {
            true => PLACES * PLACES * cells.lenses.len(),
            false => 0,
        };
        let figures = match is_interpolated {
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
            quarters: Default::default(),
            open_shares: vec![OnceLock::new(); places],
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
