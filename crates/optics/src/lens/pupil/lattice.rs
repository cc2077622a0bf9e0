//! The lattice of film points from which the pupils of a table of cells are measured, and the
//! cells between them.

use std::cmp::Ordering;
use std::collections::HashMap;

use glam::{DVec2, DVec3};

use crate::lens::pupil::polar::{Cells, PLACES, PolarCell};
use crate::lens::pupil::radial::support_around;
use crate::lens::pupil::sampler::PupilSampler;
use crate::lens::pupil::search::outline::{OutlineGuess, PupilOutline};
use crate::lens::pupil::sides::{SIDES, Support};
use crate::lens::pupil::support::{MARGIN, excess, hull, mix, widened};
use crate::lens::pupil::symmetry::inverse;

/// A cell is halved until interpolation between its corners cuts off less than this share of the
/// half width at its middle and at the middles of its sides. What is cut off is added to its
/// margin, so that the value bounds the lost rays and not the error. It was .01 before lost rays
/// were aimed again; since then a larger polygon costs rays and no noise
/// (docs/decisions/0004-lost-rays.md).
const MAX_CUT: f64 = 0.015;
/// A cell is also halved until interpolation adds less than this share of the half width. What is
/// added costs rays that are lost and aimed again. It was .025 before lost rays were aimed again,
/// as for [`MAX_CUT`].
const MAX_ADDED: f64 = 0.035;
/// The margin of a cell that is too small to be halved and in which the light ends, as a share of
/// the half width. Such a cell takes the hull of all its figures. A larger value loses more rays.
/// With it at most 12 of about 4 million rays are cut on a film of 36×24 mm (docs/accuracy.md, *The
/// pupils of the shipped lenses*).
const END_MARGIN: f64 = 0.05;

/// A figure, stored as its center relative to the direction of the film point, and its support from
/// that center.
///
/// The two are interpolated separately: the center of a small pupil moves along a circle as the
/// film point does, while its shape, that of the blades, is not rotated.
#[derive(Clone, Copy, Debug)]
pub(super) struct CenteredFigure {
    pub center: DVec2,
    pub support: Support,
}

impl CenteredFigure {
    /// The figure from a film point in a direction.
    pub(super) fn of(outline: &PupilOutline, direction: DVec2, sides: &[DVec2; SIDES]) -> Self {
        let center = outline.guess.center();
        Self {
            center: inverse(direction).rotate(center),
            support: shifted(&outline.support, -center, sides),
        }
    }

    /// The support from a film point in a direction.
    pub(super) fn seen_from(&self, direction: DVec2, sides: &[DVec2; SIDES]) -> Support {
        shifted(&self.support, direction.rotate(self.center), sides)
    }

    /// Interpolates linearly between two figures.
    pub(super) fn mix(a: &Self, b: &Self, t: f64) -> Self {
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

/// The result of measuring a cell.
pub(super) enum CellResult {
    /// No light reaches the nodes of the cell.
    Dark,
    Cell(Box<PolarCell>),
    /// The cell must be halved, radially (0) or in angle (1).
    Split(usize),
}

/// The nodes of the finest lattice, each measured at most once.
pub(super) struct Lattice<'a> {
    /// One for each wavelength.
    pub samplers: &'a [PupilSampler<'a>],
    /// The number of lattice steps radially and in angle.
    pub finest: [u32; 2],
    pub nodes: HashMap<[u32; 2], Option<PupilOutline>>,
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
    pub(super) fn cell(&mut self, cells: &Cells, low: [u32; 2], size: [u32; 2]) -> CellResult {
        let outlines = self.measure_nodes(cells, low, size);
        let is_dark = outlines.iter().all(Option::is_none);
        let is_coarse = size[0] > self.finest[0] / 8;
        if is_dark && !is_coarse {
            return CellResult::Dark;
        }
        let row = |j: u32| self.place([low[0], low[1] + j * size[1] / 2]);
        let directions = [0, 1, 2].map(|j| cells.direction(row(j)));
        let nodes = CellNodes::of(outlines, directions, &cells.sides);
        let errors = nodes.errors(&cells.sides);
        if is_dark || errors.all.ratio > 1.0 {
            let axis = self.split_axis(cells, (low, size), &errors, is_dark);
            if let Some(axis) = axis {
                return CellResult::Split(axis);
            }
        }
        let Some(first) = nodes.figures.iter().flatten().next() else {
            return CellResult::Dark;
        };
        let is_interpolated = errors.all.ratio <= 1.0;
        let figures = match is_interpolated {
            true => nodes
                .figures
                .map(|f| f.unwrap_or(*first).widened(MARGIN + errors.all.cut)),
            false => [nodes.hull(first, &cells.sides).widened(MARGIN + END_MARGIN); 9],
        };
        // The open share of a hull varies too much to be interpolated.
        let places = match is_interpolated && cells.lenses[0].is_iris_convex() {
            true => PLACES * PLACES * cells.lenses.len(),
            false => 0,
        };
        let half = self.place(size).map(|size| 0.5 * size);
        CellResult::Cell(Box::new(PolarCell::new(
            self.place(low),
            half,
            figures,
            places,
        )))
    }

    /// The coordinate in which a cell is halved, outward (0) or around (1); none if it is too small
    /// to be halved. `low` and `size` are in lattice steps.
    fn split_axis(
        &self,
        cells: &Cells,
        (low, size): ([u32; 2], [u32; 2]),
        errors: &CellErrors,
        is_dark: bool,
    ) -> Option<usize> {
        let [outer, _] = self.place([low[0] + size[0], 0]);
        let [radial, angle] = self.place(size);
        let lengths = [radial, angle * cells.symmetry.wedge() * outer];
        let [outward, around] = errors.axes.map(|error| error.ratio);
        let worse = match outward.partial_cmp(&around) {
            // Rims cut off light along circles, so a cell in which the light ends is halved
            // radially first.
            _ if is_dark || !outward.is_finite() => 0,
            Some(Ordering::Greater) => 0,
            Some(Ordering::Less) => 1,
            _ => usize::from(lengths[1] > lengths[0]),
        };
        let (most, arc) = cells.finest(!errors.all.ratio.is_finite());
        let may = [
            size[0] > self.finest[0] / most,
            size[1] > 2 && lengths[1] > arc,
        ];
        [worse, 1 - worse].into_iter().find(|axis| may[*axis])
    }
}

/// The outlines from the nodes of a cell: its corners, the middles of its sides and its middle, row
/// by row.
struct CellNodes {
    outlines: [Option<PupilOutline>; 9],
    figures: [Option<CenteredFigure>; 9],
    /// The directions of the film points of the three rows.
    directions: [DVec2; 3],
}

/// The errors of interpolation in a cell.
struct CellErrors {
    /// On its sides outward and around.
    axes: [MixtureError; 2],
    /// Anywhere.
    all: MixtureError,
}

impl CellNodes {
    fn of(
        outlines: [Option<PupilOutline>; 9],
        directions: [DVec2; 3],
        sides: &[DVec2; SIDES],
    ) -> Self {
        let figures = std::array::from_fn(|k| {
            let outline = outlines[k].as_ref()?;
            Some(CenteredFigure::of(outline, directions[k / 3], sides))
        });
        Self {
            outlines,
            figures,
            directions,
        }
    }

    fn errors(&self, sides: &[DVec2; SIDES]) -> CellErrors {
        let between = |ends: [usize; 2], middle: usize| {
            let [a, b] = ends.map(|k| self.figures[k].as_ref());
            let straight = a.zip(b).map(|(a, b)| {
                CenteredFigure::mix(a, b, 0.5).seen_from(self.directions[middle / 3], sides)
            });
            let middle = self.outlines[middle].as_ref();
            let middle = middle.map(|outline| &outline.support);
            MixtureError::of([a.is_some(), b.is_some()], straight.as_ref(), middle)
        };
        let row = |j: usize| between([3 * j, 3 * j + 2], 3 * j + 1);
        let column = |i: usize| between([i, i + 6], i + 3);
        let axes = [row(0).with(&row(2)), column(0).with(&column(2))];
        let within = row(1).with(&column(1));
        CellErrors {
            all: axes[0].with(&axes[1]).with(&within),
            axes,
        }
    }

    /// The hull of all figures, of which `first` is one, around the mean of their centers.
    fn hull(&self, first: &CenteredFigure, sides: &[DVec2; SIDES]) -> CenteredFigure {
        let lit = || (0..9).filter_map(|k| Some((k, self.figures[k].as_ref()?)));
        let centers = lit().map(|(_, figure)| figure.center);
        let center = centers.sum::<DVec2>() / lit().count() as f64;
        let upright = lit().map(|(k, figure)| {
            let off = self.directions[k / 3].rotate(figure.center - center);
            shifted(&figure.support, off, sides)
        });
        let support = upright.reduce(|a, b| hull(&a, &b));
        CenteredFigure {
            center,
            support: support.unwrap_or(first.support),
        }
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
