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
use ivcam_base::math::lagrange_weight;

use crate::lens::lens::Lens;
use crate::lens::optics::film_place::FilmPlace;
use crate::lens::pupil::lattice::{CellResult, CenteredFigure, Lattice};
use crate::lens::pupil::patch::{Located, Patch};
use crate::lens::pupil::rim_shares::{open_share, open_shares_over};
use crate::lens::pupil::sampler::PupilSampler;
use crate::lens::pupil::search::pupil_search::PupilSearch;
use crate::lens::pupil::sides::{Outline, SIDES};
use crate::lens::pupil::symmetry::{Symmetry, WedgeCopy};

/// The number of cells from the axis outward at the start, and at most.
const RADIAL_CELLS: [u32; 2] = [4, 256];
/// The greatest number of cells from the axis outward where light ends. It bounds the work there.
/// Cells of a quarter of this size in both directions take four times as long to measure, and on a
/// film of 36×24 mm, larger than its image, the anamorphic lens then gets 3% more rays through.
const END_CELLS: u32 = 64;
/// The least arc of a cell, as a share of the film's radius. Shorter arcs take longer to measure
/// and lose fewer rays. With it the median of the shipped lenses lets 96.4 to 98.0% of the rays
/// aimed at six blades through (`measure -- pupils`, docs/accuracy.md).
const MIN_ARC: f64 = 1.0 / 32.0;
/// The least arc where light ends, as for [`END_CELLS`].
const MIN_END_ARC: f64 = 1.0 / 8.0;
/// The least arc if the lens has rotational symmetry, so that only the distance of the film differs
/// around the axis. With it the median of the shipped lenses lets 97.2% or more of the aimed rays
/// through to a film that is tilted by .05 (`measure -- pupils`, docs/accuracy.md).
const MIN_ARC_ROTATIONAL: f64 = 0.2;

/// The places along a side of a cell at which open shares are measured.
pub(super) const PLACES: usize = 5;

/// Measured pupils over the film.
#[derive(Clone, Debug)]
pub(super) struct Cells {
    place: FilmPlace,
    pub symmetry: Symmetry,
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
    pub lenses: Vec<Lens>,
    pub sides: [DVec2; SIDES],
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
    Cell(Box<PolarCell>),
    /// No light reaches film points here.
    Dark,
}

/// The figures at the corners of a cell, the middles of its sides and its middle, row by row.
#[derive(Clone, Debug)]
pub(super) struct PolarCell {
    low: [f64; 2],
    /// Half of the size.
    half: [f64; 2],
    figures: [CenteredFigure; 9],
    /// The four quarters, row by row. Each is prepared when a film point in it is first asked for.
    quarters: [OnceLock<Box<Patch>>; 4],
    /// For each lens, row by row: see [`Cells::open_share`]. Empty if they are not measured.
    open_shares: Vec<OnceLock<Option<f64>>>,
}

impl PolarCell {
    /// A cell from its least place, half of its size, its figures, and the number of places at
    /// which open shares may be measured.
    pub(super) fn new(
        low: [f64; 2],
        half: [f64; 2],
        figures: [CenteredFigure; 9],
        places: usize,
    ) -> Self {
        Self {
            low,
            half,
            figures,
            quarters: Default::default(),
            open_shares: vec![OnceLock::new(); places],
        }
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
    pub(super) fn finest(&self, is_end: bool) -> (u32, f64) {
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
    pub(super) fn place_of<const FUSED: bool>(&self, film: DVec2) -> ([f64; 2], DVec2, f64) {
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
    pub(super) fn unfolded(&self, direction: DVec2, copy: f64) -> (DVec2, WedgeCopy) {
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
    pub(super) fn patch(&self, place: [f64; 2]) -> Option<&Patch> {
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
    fn quarter<'a>(&self, cell: &'a PolarCell, place: [f64; 2]) -> &'a Patch {
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
    fn open_share(&self, cell: &PolarCell, lens: usize, [i, j]: [usize; 2]) -> Option<f64> {
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
    pub(super) fn direction(&self, place: [f64; 2]) -> DVec2 {
        if self.meridian {
            return DVec2::X;
        }
        let (sin, cos) = libm::sincos(self.symmetry.base + place[1] * self.symmetry.wedge());
        DVec2::new(cos, sin)
    }

    /// The film point from which the figure of a place is measured; none if the film is bent and
    /// does not reach that far.
    pub(super) fn point(&self, place: [f64; 2]) -> Option<DVec3> {
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
