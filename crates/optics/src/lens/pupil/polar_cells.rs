//! Measures the cells of a [`PolarTable`] from a lattice of film points.

use std::cmp::Ordering;
use std::collections::HashMap;
use std::sync::OnceLock;

use glam::DVec2;

use crate::lens::pupil::polar_table::{Branch, POINTS, PolarCell, PolarTable, RADIAL_CELLS};
use crate::lens::pupil::radial_table::support_around;
use crate::lens::pupil::search::outline::{OutlineGuess, PupilOutline};
use crate::lens::pupil::search::pupil_search::PupilSearch;
use crate::lens::pupil::support::{InterpolationError, MARGIN, SideNormals, Support};
use crate::lens::pupil::symmetry::inverse;

/// A cell is halved until interpolation between its corners cuts off less than this fraction of the
/// half width at its middle and at the middles of its sides. What is cut off is added to its
/// margin, so that the value bounds the lost rays and not the error. It was .01 before lost rays
/// were aimed again; since then a larger polygon costs rays and no noise
/// (docs/decisions/0004-lost-rays.md).
const MAX_CUT: f64 = 0.015;
/// A cell is also halved until interpolation adds less than this fraction of the half width. What
/// is added costs rays that are lost and aimed again. It was .025 before lost rays were aimed
/// again, as for [`MAX_CUT`].
const MAX_ADDED: f64 = 0.035;
/// The margin of a cell that is too small to be halved and in which the light ends, as a fraction
/// of the half width. Such a cell takes the hull of all its outlines. A larger value loses more
/// rays. With it at most 12 of about 4 million rays are cut on a film of 36×24 mm
/// (docs/accuracy.md, *The pupils of the shipped lenses*).
const END_MARGIN: f64 = 0.05;

/// An outline, stored as its center relative to the direction of the film point, and its support
/// from that center.
///
/// The two are interpolated separately: the center of a small pupil moves along a circle as the
/// film point does, while its shape, that of the blades, is not rotated.
#[derive(Clone, Copy, Debug)]
pub(super) struct CenteredOutline {
    pub center: DVec2,
    pub support: Support,
}

impl CenteredOutline {
    /// The outline from a film point in a direction.
    fn new(outline: &PupilOutline, direction: DVec2, normals: &SideNormals) -> Self {
        let center = outline.guess.center();
        Self {
            center: inverse(direction).rotate(center),
            support: outline.support.shifted(-center, normals),
        }
    }

    /// The support from a film point in a direction.
    pub(super) fn seen_from(&self, direction: DVec2, normals: &SideNormals) -> Support {
        self.support.shifted(direction.rotate(self.center), normals)
    }

    /// Interpolates linearly between two outlines.
    pub(super) fn mix(a: &Self, b: &Self, t: f64) -> Self {
        Self {
            center: a.center.lerp(b.center, t),
            support: a.support.mix(&b.support, t),
        }
    }

    /// The outline widened by a fraction of its half width.
    fn widened(&self, fraction: f64) -> Self {
        Self {
            support: self.support.widened(fraction),
            ..*self
        }
    }
}

/// A cell by its lowest node and its size, in lattice steps.
type CellBounds = ([u32; 2], [u32; 2]);

/// The nodes of the finest lattice, each measured at most once.
pub(super) struct Lattice<'a> {
    table: &'a PolarTable,
    /// One for each wavelength.
    searches: Vec<PupilSearch<'a>>,
    /// The number of lattice steps radially and in angle.
    finest: [u32; 2],
    nodes: HashMap<[u32; 2], Option<PupilOutline>>,
}

impl<'a> Lattice<'a> {
    /// The lattice of a table. Nothing is measured yet.
    pub(super) fn new(table: &'a PolarTable) -> Self {
        let (radial, arc) = table.finest(false);
        let arcs = table.symmetry.wedge() / (f64::from(table.around) * arc);
        Self {
            table,
            searches: table.lenses.iter().map(PupilSearch::new).collect(),
            finest: [
                2 * radial,
                2 * table.around * (arcs.max(1.0) as u32).next_power_of_two(),
            ],
            nodes: HashMap::new(),
        }
    }

    /// Measures the tree of a starting cell. The root is the first branch.
    pub(super) fn tree(&mut self, root: [u32; 2]) -> Vec<Branch> {
        let size = [
            self.finest[0] / RADIAL_CELLS[0],
            self.finest[1] / self.table.around,
        ];
        let low = [0, 1].map(|k| root[k] * size[k]);
        let mut tree = vec![Branch::Dark];
        let mut pending = vec![(0, low, size)];
        while let Some((branch, low, mut size)) = pending.pop() {
            let nodes = self.measure((low, size));
            let Some(axis) = self.split_axis((low, size), &nodes) else {
                if let Some(cell) = self.cell((low, size), &nodes) {
                    tree[branch] = Branch::Cell(Box::new(cell));
                }
                continue;
            };
            let next = [tree.len(), tree.len() + 1];
            tree.extend([Branch::Dark, Branch::Dark]);
            let mut middle = low;
            size[axis] /= 2;
            middle[axis] += size[axis];
            let at = f64::from(middle[axis]) / f64::from(self.finest[axis]);
            tree[branch] = Branch::Split { axis, at, next };
            pending.extend([(next[1], middle, size), (next[0], low, size)]);
        }
        tree
    }

    /// The film coordinates of a node, or the size of a cell in film coordinates.
    fn film_coordinates(&self, at: [u32; 2]) -> [f64; 2] {
        [0, 1].map(|k| f64::from(at[k]) / f64::from(self.finest[k]))
    }

    /// The outline around the pupils of all wavelengths from a node, measured if it was not yet.
    fn node(&mut self, at: [u32; 2], guess: Option<&OutlineGuess>) -> Option<PupilOutline> {
        // On the axis all directions are one point.
        let key = if at[0] == 0 { [0, 0] } else { at };
        if let Some(outline) = self.nodes.get(&key) {
            return *outline;
        }
        let outline = self.find_outline(key, guess);
        self.nodes.insert(key, outline);
        outline
    }

    fn find_outline(&self, at: [u32; 2], guess: Option<&OutlineGuess>) -> Option<PupilOutline> {
        let point = self.table.point(self.film_coordinates(at))?;
        let outlines = self.searches.iter().map(|s| s.find_outline(point, guess));
        let outlines: Vec<Option<PupilOutline>> = outlines.collect();
        let supports = outlines.iter().map(|o| o.map(|o| o.support));
        let support = support_around(&supports.collect::<Vec<_>>())?;
        let middle = outlines[outlines.len() / 2];
        let any = middle.or_else(|| outlines.into_iter().flatten().next())?;
        Some(PupilOutline { support, ..any })
    }

    /// Measures the outlines from the nine nodes of a cell. The corners are measured first, because
    /// the search at the other nodes starts from them.
    fn measure(&mut self, (low, size): CellBounds) -> CellNodes {
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
            let film = self.film_coordinates(at);
            let film = film[0] * self.table.direction(film);
            // The nodes on both sides of a middle. A corner has none and stands for both.
            let [before, behind] = match (i, j) {
                (1, _) => [k - 1, k + 1],
                (_, 1) => [k - 3, k + 3],
                _ => [k, k],
            };
            if let (Some(a), Some(b)) = (&all[before], &all[behind]) {
                guess = Some(OutlineGuess::between(a, b));
            } else if let (Some(guess), true) = (&mut guess, last.length() > 0.0) {
                // To first order the center rotates and scales as the film point does.
                let along = inverse(last).rotate(film) / last.length_squared();
                *guess = guess.turned(along);
            }
            all[k] = self.node(at, guess.as_ref());
            if let Some(outline) = &all[k] {
                (guess, last) = (Some(outline.guess), film);
            }
        }
        let row = |j: u32| self.film_coordinates([low[0], low[1] + j * size[1] / 2]);
        let directions = [0, 1, 2].map(|j| self.table.direction(row(j)));
        CellNodes::new(all, directions, &self.table.normals)
    }

    /// Makes a cell from its nodes; none if no light reaches them.
    fn cell(&self, (low, size): CellBounds, nodes: &CellNodes) -> Option<PolarCell> {
        let (table, error) = (self.table, nodes.errors.all);
        let first = nodes.outlines.iter().flatten().next()?;
        let is_interpolated = error.ratio <= 1.0;
        let outlines = match is_interpolated {
            true => nodes
                .outlines
                .map(|outline| outline.unwrap_or(*first).widened(MARGIN + error.cut)),
            false => {
                [nodes
                    .hull(first, &table.normals)
                    .widened(MARGIN + END_MARGIN); 9]
            }
        };
        // The unvignetted fraction of a hull varies too much to be interpolated.
        let measured = match is_interpolated && table.lenses[0].is_iris_convex() {
            true => POINTS * POINTS * table.lenses.len(),
            false => 0,
        };
        Some(PolarCell {
            low: self.film_coordinates(low),
            half: self.film_coordinates(size).map(|size| 0.5 * size),
            outlines,
            quarters: Default::default(),
            unvignetted: vec![OnceLock::new(); measured],
        })
    }

    /// The coordinate in which a cell is halved, outward (0) or around (1); none if its error is
    /// within the bounds or it is too small to be halved.
    fn split_axis(&self, (low, size): CellBounds, nodes: &CellNodes) -> Option<usize> {
        let is_dark = nodes.outlines.iter().all(Option::is_none);
        let is_halved = match is_dark {
            true => size[0] > self.finest[0] / 8,
            false => nodes.errors.all.ratio > 1.0,
        };
        let [outer, _] = self.film_coordinates([low[0] + size[0], 0]);
        let [radial, angle] = self.film_coordinates(size);
        let lengths = [radial, angle * self.table.symmetry.wedge() * outer];
        let [outward, around] = nodes.errors.axes.map(|error| error.ratio);
        let worse = match outward.partial_cmp(&around) {
            // Rims cut off light along circles, so a cell in which the light ends is halved
            // radially first.
            _ if is_dark || !outward.is_finite() => 0,
            Some(Ordering::Greater) => 0,
            Some(Ordering::Less) => 1,
            _ => usize::from(lengths[1] > lengths[0]),
        };
        let (most, arc) = self.table.finest(!nodes.errors.all.ratio.is_finite());
        let may = [
            size[0] > self.finest[0] / most,
            size[1] > 2 && lengths[1] > arc,
        ];
        let axes = [worse, 1 - worse].into_iter();
        axes.filter(|_| is_halved).find(|axis| may[*axis])
    }
}

/// The outlines from the nodes of a cell: its corners, the middles of its sides and its middle, row
/// by row.
struct CellNodes {
    outlines: [Option<CenteredOutline>; 9],
    /// The directions of the film points of the three rows.
    directions: [DVec2; 3],
    errors: CellErrors,
}

/// The errors of interpolation in a cell.
struct CellErrors {
    /// On its sides outward and around.
    axes: [InterpolationError; 2],
    /// Anywhere.
    all: InterpolationError,
}

impl CellNodes {
    fn new(
        nodes: [Option<PupilOutline>; 9],
        directions: [DVec2; 3],
        normals: &SideNormals,
    ) -> Self {
        let outlines = std::array::from_fn(|k| {
            let outline = nodes[k].as_ref()?;
            Some(CenteredOutline::new(outline, directions[k / 3], normals))
        });
        let error = |a: usize, middle: usize, b: usize| {
            let ends: [Option<CenteredOutline>; 2] = [outlines[a], outlines[b]];
            match (ends, &nodes[middle]) {
                ([Some(a), Some(b)], Some(middle_node)) => {
                    let mixed = CenteredOutline::mix(&a, &b, 0.5);
                    let mixed = mixed.seen_from(directions[middle / 3], normals);
                    InterpolationError::new(&mixed, &middle_node.support, [MAX_CUT, MAX_ADDED])
                }
                ([None, None], None) => InterpolationError::NONE,
                _ => InterpolationError::INFINITE,
            }
        };
        let row = |j: usize| error(3 * j, 3 * j + 1, 3 * j + 2);
        let column = |i: usize| error(i, i + 3, i + 6);
        let axes = [row(0).max(&row(2)), column(0).max(&column(2))];
        let all = axes[0].max(&axes[1]).max(&row(1)).max(&column(1));
        Self {
            outlines,
            directions,
            errors: CellErrors { axes, all },
        }
    }

    /// The hull of all outlines, of which `first` is one, around the mean of their centers.
    fn hull(&self, first: &CenteredOutline, normals: &SideNormals) -> CenteredOutline {
        let lit = || (0..9).filter_map(|k| Some((k, self.outlines[k].as_ref()?)));
        let centers = lit().map(|(_, outline)| outline.center);
        let center = centers.sum::<DVec2>() / lit().count() as f64;
        let upright = lit().map(|(k, outline)| {
            let off = self.directions[k / 3].rotate(outline.center - center);
            outline.support.shifted(off, normals)
        });
        let support = upright.reduce(|a, b| a.hull(&b));
        CenteredOutline {
            center,
            support: support.unwrap_or(first.support),
        }
    }
}
