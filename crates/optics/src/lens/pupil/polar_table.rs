//! A table of pupils for a lens or a film without rotational symmetry: a stop with blades,
//! cylindrical surfaces, or a film that is moved.
//!
//! The film is divided into cells in polar coordinates about the axis of the lens, because the rims
//! of the lens cut off light along circles. A cell is halved, radially or in angle, whichever
//! direction has the greater error, until the interpolation error is below a bound. Film
//! coordinates in this table are the radius as a fraction of the reach, and the angle as a fraction
//! of the wedge.

use std::f64::consts::{FRAC_PI_4, TAU};
use std::sync::OnceLock;

use glam::{DVec2, DVec3};
use ivcam_base::math::lagrange_weight;

use crate::lens::lens::Lens;
use crate::lens::optics::film_place::FilmPlace;
use crate::lens::pupil::patch::{Located, PolarPatch};
use crate::lens::pupil::polar_cells::{CenteredOutline, Lattice};
use crate::lens::pupil::pupil_table::PupilTable;
use crate::lens::pupil::support::{PolygonCorners, SideNormals, normals_along};
use crate::lens::pupil::symmetry::{Symmetry, WedgeCopy, unit};
use crate::lens::pupil::vignetting::{Vignetting, unvignetted_fraction, unvignetted_over};

/// The number of cells from the axis outward at the start, and at most.
pub(super) const RADIAL_CELLS: [u32; 2] = [4, 256];
/// The greatest number of cells from the axis outward where light ends. It bounds the work there.
/// Cells of a quarter of this size in both directions take four times as long to measure, and on a
/// film of 36×24 mm, larger than its image, the anamorphic lens then gets 3% more rays through.
const END_CELLS: u32 = 64;
/// The least arc of a cell, as a fraction of the film's radius. Shorter arcs take longer to measure
/// and lose fewer rays. With it the median of the shipped lenses lets 96.4 to 98.0% of the rays
/// aimed at six blades through (`measure -- pupils`, docs/accuracy.md).
const MIN_ARC: f64 = 1.0 / 32.0;
/// The least arc where light ends, as for [`END_CELLS`].
const MIN_END_ARC: f64 = 1.0 / 8.0;
/// The least arc if the lens has rotational symmetry, so that only the distance of the film differs
/// around the axis. With it the median of the shipped lenses lets 97.2% or more of the aimed rays
/// through to a film that is tilted by .05 (`measure -- pupils`, docs/accuracy.md).
const MIN_ARC_ROTATIONAL: f64 = 0.2;

/// The points along a side of a cell at which unvignetted fractions are measured.
pub(super) const POINTS: usize = 5;

/// The pupils by film position.
#[derive(Clone, Debug)]
pub(super) struct PolarTable {
    place: FilmPlace,
    pub symmetry: Symmetry,
    /// Whether the lens has rotational symmetry. Outlines are then measured from film points in the
    /// meridian y = 0, and rotated to the film point.
    meridian: bool,
    /// The distance of the farthest film point from the axis, in millimeters.
    reach: f64,
    /// The number of cells around the axis at the start.
    pub around: u32,
    /// The rotations and signs that map the first wedge to the others.
    copies: Vec<WedgeCopy>,
    /// The lens at one wavelength, or at the shortest, its own and the longest.
    pub lenses: Vec<Lens>,
    pub normals: SideNormals,
    /// The tree of each starting cell, from the axis outward. It is measured when a film point in
    /// the cell is first asked for, and independently of the others, so that the order of the
    /// requests does not change the result.
    trees: Vec<OnceLock<Vec<Branch>>>,
}

/// A node of a tree of cells.
#[derive(Clone, Debug)]
pub(super) enum Branch {
    /// Two branches, below and above a value of one film coordinate.
    Split {
        axis: usize,
        at: f64,
        next: [usize; 2],
    },
    Cell(Box<PolarCell>),
    /// No light reaches film points here.
    Dark,
}

/// A cell with the outlines at its corners, at the middles of its sides and at its middle, row by
/// row.
#[derive(Clone, Debug)]
pub(super) struct PolarCell {
    /// The least film coordinates.
    pub low: [f64; 2],
    /// Half of the size.
    pub half: [f64; 2],
    pub outlines: [CenteredOutline; 9],
    /// The patches of the four quarters, row by row. Each is prepared when a film point in it is
    /// first asked for.
    pub quarters: [OnceLock<Box<PolarPatch>>; 4],
    /// The unvignetted fractions for each lens at [`POINTS`]² points, row by row: see
    /// [`PolarTable::unvignetted_at`]. Empty if they are not measured.
    pub unvignetted: Vec<OnceLock<Option<f64>>>,
}

impl PolarTable {
    /// Prepares a table for film points up to `film_radius` from the film's middle. Nothing is
    /// measured yet.
    pub(super) fn new(lens: &Lens, place: &FilmPlace, film_radius: f64) -> Self {
        // The rim of the film is sampled at 64 points, and the reach has 1% to spare.
        let far = |k: i32| {
            let film = 1.01 * film_radius * DVec2::from_angle(TAU * f64::from(k) / 64.0);
            place.point(film).truncate().length()
        };
        let meridian = lens.is_rotational();
        let symmetry = Symmetry::new(lens, place);
        let around = match meridian {
            true => 4,
            false => (symmetry.wedge() / FRAC_PI_4 - 1e-9).ceil() as u32,
        };
        Self {
            place: *place,
            symmetry,
            meridian,
            reach: (0..64).map(far).fold(film_radius, f64::max),
            around,
            copies: symmetry.copies(),
            lenses: vec![lens.clone()],
            normals: normals_along(lens.iris_edges()),
            trees: vec![OnceLock::new(); (RADIAL_CELLS[0] * around) as usize],
        }
    }

    /// The table whose outlines contain the pupils of several wavelengths, of which each table has
    /// one. Nothing is measured yet.
    pub(super) fn around(tables: &[&Self]) -> Self {
        let middle = tables[tables.len() / 2];
        Self {
            lenses: tables.iter().flat_map(|t| t.lenses.clone()).collect(),
            trees: vec![OnceLock::new(); middle.trees.len()],
            ..middle.clone()
        }
    }

    /// The greatest number of cells from the axis outward, and the least arc of a cell as a
    /// fraction of the film's radius, where light ends or elsewhere.
    pub(super) fn finest(&self, is_end: bool) -> (u32, f64) {
        match (self.meridian, is_end) {
            (true, _) => (RADIAL_CELLS[1], MIN_ARC_ROTATIONAL),
            (false, true) => (END_CELLS, MIN_END_ARC),
            (false, false) => (RADIAL_CELLS[1], MIN_ARC),
        }
    }

    /// Locates a film point in the table; none if no light reaches it.
    pub(super) fn locate(&self, film: DVec2) -> Option<Located<'_, 4, 9>> {
        let (film, direction, copy) = self.coordinates::<false>(film);
        let patch = self.patch(film)?;
        let (direction, copy) = self.unfolded(direction, copy);
        Some(Located {
            patch,
            at: patch.coordinates(film),
            direction,
            copy,
        })
    }

    /// The quarter of a cell that contains film coordinates.
    fn quarter<'a>(&self, cell: &'a PolarCell, film: [f64; 2]) -> &'a PolarPatch {
        let [i, j] = [0, 1].map(|k| usize::from(film[k] >= cell.low[k] + cell.half[k]));
        cell.quarters[2 * j + i].get_or_init(|| {
            let corners = [0, 1, 3, 4].map(|k| &cell.outlines[3 * j + i + k]);
            let low = [(0, i), (1, j)].map(|(k, half)| cell.low[k] + half as f64 * cell.half[k]);
            let high = [0, 1].map(|k| match low[k] + cell.half[k] {
                // The greatest coordinate is 1, and belongs to the last patch.
                high if high >= 1.0 => f64::INFINITY,
                high => high,
            });
            let polygons =
                corners.map(|outline| PolygonCorners::new(&outline.support, &self.normals));
            let mut patch = PolarPatch::new(
                0,
                (low, high),
                cell.half.map(f64::recip),
                corners.map(|outline| outline.center),
                polygons.each_ref(),
            );
            if !cell.unvignetted.is_empty() {
                let at = |lens, k| self.unvignetted_at(cell, lens, [2 * i + k % 3, 2 * j + k / 3]);
                patch.unvignetted = unvignetted_over(self.lenses.len(), at).unwrap_or_default();
            }
            Box::new(patch)
        })
    }

    /// The unvignetted fraction for a lens at one of the points that divide each side of a cell
    /// into four parts. It is measured when it is first asked for, from the cell alone, because
    /// quarters share points.
    fn unvignetted_at(&self, cell: &PolarCell, lens: usize, [i, j]: [usize; 2]) -> Option<f64> {
        let known = &cell.unvignetted[POINTS * (POINTS * lens + j) + i];
        *known.get_or_init(|| {
            let film = [(0, i), (1, j)].map(|(k, at)| cell.low[k] + 0.5 * at as f64 * cell.half[k]);
            let row = |j: usize| {
                let [a, b] = [i / 2, i.div_ceil(2)].map(|i| &cell.outlines[3 * j + i]);
                CenteredOutline::mix(a, b, 0.5)
            };
            let outline = CenteredOutline::mix(&row(j / 2), &row(j.div_ceil(2)), 0.5);
            let support = outline.seen_from(self.direction(film), &self.normals);
            let polygon = PolygonCorners::new(&support, &self.normals);
            let is_tested = lens == self.lenses.len() / 2;
            unvignetted_fraction(&self.lenses[lens], self.point(film)?, &polygon, is_tested)
        })
    }

    /// The weights of the lenses' unvignetted fractions for a wavelength in nanometers. The pupil
    /// is regarded as a quadratic of the square of the wavenumber, as by Cauchy's formula the index
    /// nearly is.
    pub(super) fn weights_at(&self, wavelength_nm: f64) -> Vec<f64> {
        let square = |nm: f64| 1.0 / (nm * nm);
        let at: Vec<f64> = self.lenses.iter().map(|l| square(l.wavelength())).collect();
        let weight = |k: usize| lagrange_weight(&at, k, square(wavelength_nm));
        (0..at.len()).map(weight).collect()
    }

    /// The direction from the axis of film coordinates.
    fn toward(&self, film: [f64; 2]) -> DVec2 {
        unit(self.symmetry.base + film[1] * self.symmetry.wedge())
    }

    /// The direction from the axis for which the outline of film coordinates is stored.
    pub(super) fn direction(&self, film: [f64; 2]) -> DVec2 {
        match self.meridian {
            true => DVec2::X,
            false => self.toward(film),
        }
    }

    /// The film point from which the outline of film coordinates is measured; none if the film is
    /// bent and does not reach that far.
    pub(super) fn point(&self, film: [f64; 2]) -> Option<DVec3> {
        let radius = film[0] * self.reach;
        let point = self.place.over(radius * self.toward(film))?;
        Some(match self.meridian {
            true => DVec3::new(radius, 0.0, point.z),
            false => point,
        })
    }
}

impl PupilTable<4, 9> for PolarTable {
    #[inline(always)]
    fn coordinates<const FUSED: bool>(&self, film: DVec2) -> ([f64; 2], DVec2, f64) {
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
        let film = [(radius / self.reach).min(1.0), into.clamp(0.0, 1.0)];
        (film, DVec2::new(x / length, y / length), copy)
    }

    /// The tree of the film coordinates is measured if it was not yet.
    fn patch(&self, film: [f64; 2]) -> Option<&PolarPatch> {
        let cells = [RADIAL_CELLS[0], self.around];
        let [i, j] = [0, 1].map(|k| ((film[k] * f64::from(cells[k])) as u32).min(cells[k] - 1));
        let tree = &self.trees[(i * self.around + j) as usize];
        let tree = tree.get_or_init(|| Lattice::new(self).tree([i, j]));
        let mut branch = 0;
        loop {
            match &tree[branch] {
                Branch::Split { axis, at, next } => {
                    branch = next[usize::from(film[*axis] >= *at)];
                }
                Branch::Cell(cell) => return Some(self.quarter(cell, film)),
                Branch::Dark => return None,
            }
        }
    }

    #[inline(always)]
    fn unfolded(&self, direction: DVec2, copy: f64) -> (DVec2, WedgeCopy) {
        if self.meridian {
            return (DVec2::X, WedgeCopy::turned(direction));
        }
        let copy = self.copies[copy as usize];
        (copy.unfold(direction), copy)
    }

    #[inline(always)]
    fn unvignetted<'a>(&'a self, patch: &'a PolarPatch, _: &'a Vignetting) -> &'a [[f64; 9]] {
        &patch.unvignetted
    }
}
