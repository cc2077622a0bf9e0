//! A table of pupils by film radius, for a lens and a film with rotational symmetry.
//!
//! The row of film points is refined until the interpolation error is below a bound.

use glam::DVec2;

use crate::lens::pupil::film_row::FilmRow;
use crate::lens::pupil::patch::{Located, RadialPatch};
use crate::lens::pupil::pupil_table::PupilTable;
use crate::lens::pupil::search::outline::{OutlineGuess, PupilOutline};
use crate::lens::pupil::support::{
    InterpolationError, MARGIN, PolygonCorners, SIDES, SideNormals, Support,
};
use crate::lens::pupil::symmetry::WedgeCopy;
use crate::lens::pupil::vignetting::Vignetting;

/// An interval of film radii is halved until interpolation at its middle cuts off less of the pupil
/// than this fraction of its half width. That is 5/8 of [`MARGIN`], which is added on each side.
const MAX_CUT: f64 = 0.0025;
/// An interval is also halved until interpolation adds less than this fraction of the half width.
/// What is added costs rays that are lost. With it 98.5 to 98.9% of the rays aimed at the lenses of
/// the oracle get through, all but the anamorphic one (docs/accuracy.md, *The pupil*).
const MAX_ADDED: f64 = 0.008;
/// The pupils of two wavelengths may differ by this fraction of the half width. If they differ
/// more, the pupil of a wavelength between them is not regarded as a mixture of them, and the
/// margin is added again. No search is recorded: a smaller value costs lost rays, and
/// `no_ray_of_any_wavelength_that_passes_is_outside_the_pupil` tests that no ray is cut with it.
const MAX_DIFFERENCE: f64 = 0.1;
/// The number of intervals of film radii at the start.
const FIRST_NODES: usize = 8;
/// An interval this short, as a fraction of the film's radius, is not halved again. A pupil closes
/// like a square root of the film radius: halving down to 1e-5 took most of the time of a table.
const MIN_INTERVAL: f64 = 1e-3;
/// The number of nodes at which a table is no longer refined. It bounds the time and the memory.
const MAX_NODES: usize = 192;
/// The number of equal parts of the film's radius in the table that finds a patch.
const BINS: usize = 256;

/// Film radii in millimeters, ascending from 0, each with the support of the outline as seen from
/// the film point (radius, 0). No light reaches film points beyond the last radius.
pub(super) type RadialNodes = Vec<(f64, Support)>;

/// The pupils by film radius.
#[derive(Clone, Debug)]
pub(super) struct RadialTable {
    normals: SideNormals,
    nodes: RadialNodes,
    /// The polygon of each node.
    polygons: Vec<PolygonCorners>,
    /// The patches between the nodes.
    pub patches: Vec<RadialPatch>,
    bins_per_mm: f64,
    /// The first patch that each of [`BINS`] equal parts of the radius overlaps.
    starts: Vec<usize>,
}

impl RadialTable {
    /// Measures the table from a row of film points. It ends where the light ends. `disc_radius`
    /// returns the radius of a disc that contains every pupil.
    pub(super) fn measure(row: &FilmRow<'_>, disc_radius: impl Fn() -> f64) -> Self {
        let nodes = match row.outline(0.0, None) {
            Some(first) => measured_nodes(row, first),
            None => disc_nodes(row, disc_radius),
        };
        Self::new(nodes, row.search.normals)
    }

    /// The table whose outlines contain those of several tables. Between two film radii each
    /// outline is a mixture of two, and the mixture of the containing outlines contains it.
    pub(super) fn around(tables: &[&Self]) -> Self {
        let end = |t: &&Self| t.nodes.last().map(|(end, _)| *end);
        let nodes = tables.iter().flat_map(|t| &t.nodes);
        let mut radii: Vec<f64> = nodes.map(|(radius, _)| *radius).collect();
        radii.sort_by(f64::total_cmp);
        radii.dedup();
        let mut nodes = RadialNodes::new();
        for radius in radii {
            let at: Vec<Option<Support>> = tables.iter().map(|t| t.widest_at(radius)).collect();
            nodes.extend(support_around(&at).map(|support| (radius, support)));
            // A table that ends here does not count beyond this radius.
            let continues = |t: &&Self| end(t).is_some_and(|end| end > radius);
            let ends = tables.iter().any(|t| end(t) == Some(radius));
            if ends && tables.iter().any(continues) {
                let beyond = std::iter::zip(&at, tables);
                let beyond = beyond.map(|(at, t)| at.filter(|_| continues(t)));
                let support = support_around(&beyond.collect::<Vec<_>>());
                nodes.extend(support.map(|support| (radius, support)));
            }
        }
        Self::new(nodes, tables[0].normals)
    }

    /// Prepares the patches between nodes.
    pub(super) fn new(nodes: RadialNodes, normals: SideNormals) -> Self {
        let polygons = nodes
            .iter()
            .map(|(_, support)| PolygonCorners::new(support, &normals));
        let polygons: Vec<PolygonCorners> = polygons.collect();
        let patch = |i: usize| {
            let [low, high] = [i, i + 1].map(|i| nodes[i].0);
            let length = high - low;
            let inverse = if length > 0.0 { 1.0 / length } else { 0.0 };
            RadialPatch::new(
                i,
                ([low, 0.0], [high, f64::INFINITY]),
                [inverse, 0.0],
                [DVec2::ZERO; 2],
                [&polygons[i], &polygons[i + 1]],
            )
        };
        let patches = (0..nodes.len().saturating_sub(1)).map(patch).collect();
        let reach = nodes.last().map_or(0.0, |(end, _)| *end);
        let ends = nodes.get(1..).unwrap_or_default();
        let start = |bin: usize| {
            let radius = reach * bin as f64 / BINS as f64;
            ends.partition_point(|(end, _)| *end < radius)
        };
        Self {
            starts: (0..BINS).map(start).collect(),
            polygons,
            patches,
            bins_per_mm: BINS as f64 / reach.max(f64::MIN_POSITIVE),
            nodes,
            normals,
        }
    }

    /// The film radius at which the light ends, in millimeters.
    pub(super) fn end(&self) -> f64 {
        self.nodes.last().map_or(0.0, |(end, _)| *end)
    }

    /// The film radii between which a patch interpolates.
    pub(super) fn radii(&self, patch: usize) -> [f64; 2] {
        [patch, patch + 1].map(|node| self.nodes[node].0)
    }

    /// The polygon of a film point at (radius, 0), from its patch and the coordinate in it.
    pub(super) fn polygon(&self, patch: usize, t: f64) -> PolygonCorners {
        self.polygons[patch].mix(&self.polygons[patch + 1], t)
    }

    /// Locates a film point in the table; none if no light reaches it.
    pub(super) fn locate(&self, film: DVec2) -> Option<Located<'_, 2, 3>> {
        let radius = film.length();
        let patch = self.patch([radius, 0.0])?;
        let turn = if radius > 0.0 {
            film / radius
        } else {
            DVec2::X
        };
        Some(Located {
            patch,
            at: patch.coordinates([radius, 0.0]),
            direction: DVec2::X,
            copy: WedgeCopy::turned(turn),
        })
    }

    /// The outline from a film radius: the hull of all nodes at this radius, or interpolated
    /// linearly; none beyond the last node.
    fn widest_at(&self, radius: f64) -> Option<Support> {
        let above = self.nodes.partition_point(|(r, _)| *r < radius);
        let same = self.nodes[above..].iter().take_while(|(r, _)| *r == radius);
        let hull = same.map(|(_, s)| *s).reduce(|a, b| a.hull(&b));
        hull.or_else(|| {
            let (r1, b) = self.nodes.get(above)?;
            let (r0, a) = &self.nodes[above.checked_sub(1)?];
            Some(a.mix(b, (radius - r0) / (r1 - r0)))
        })
    }
}

impl PupilTable<2, 3> for RadialTable {
    #[inline(always)]
    fn coordinates<const FUSED: bool>(&self, film: DVec2) -> ([f64; 2], DVec2, f64) {
        let radius = (film.x * film.x + film.y * film.y).sqrt();
        // On the axis every direction is the same: take +x.
        let off_axis = radius > 0.0;
        let scale = 1.0 / (if off_axis { radius } else { 1.0 });
        let cos = if off_axis { film.x * scale } else { 1.0 };
        ([radius, 0.0], DVec2::new(cos, film.y * scale), 0.0)
    }

    #[inline(always)]
    fn patch(&self, [radius, _]: [f64; 2]) -> Option<&RadialPatch> {
        if self.patches.is_empty() || !(radius <= self.end()) {
            return None;
        }
        let bin = (radius * self.bins_per_mm) as usize;
        let mut i = self.starts[bin.min(BINS - 1)];
        // Rounding may have placed the radius in a neighboring bin.
        while i > 0 && radius <= self.nodes[i].0 {
            i -= 1;
        }
        while self.nodes[i + 1].0 < radius {
            i += 1;
        }
        Some(&self.patches[i])
    }

    #[inline(always)]
    fn unfolded(&self, direction: DVec2, _: f64) -> (DVec2, WedgeCopy) {
        (DVec2::X, WedgeCopy::turned(direction))
    }

    #[inline(always)]
    fn unvignetted<'a>(
        &'a self,
        patch: &'a RadialPatch,
        vignetting: &'a Vignetting,
    ) -> &'a [[f64; 3]] {
        let number = patch.number;
        vignetting.by_patch.get(number..=number).unwrap_or_default()
    }
}

/// An outline that contains the pupils of several wavelengths from one film point, and those of the
/// wavelengths between.
pub(super) fn support_around(supports: &[Option<Support>]) -> Option<Support> {
    let lit = || supports.iter().flatten();
    let all = lit().copied().reduce(|a, b| a.hull(&b))?;
    if lit().count() < supports.len() {
        // The light ends at some wavelength between them: leave room for the pupil to move.
        return Some(all.widened(MAX_DIFFERENCE));
    }
    // A pupil that closes moves like a square root of the wavelength, not linearly.
    let apart = lit().map(|support| all.excess(support)).fold(0.0, f64::max);
    Some(if apart > MAX_DIFFERENCE {
        all.widened(MARGIN)
    } else {
        all
    })
}

/// Measures the nodes of a table whose first outline is given. Intervals are halved until the
/// interpolation error is within [`MAX_CUT`] and [`MAX_ADDED`].
fn measured_nodes(row: &FilmRow<'_>, first: PupilOutline) -> RadialNodes {
    let mut done = vec![(0.0, first)];
    // The radii that are not in the table yet, in descending order.
    let mut pending: Vec<(f64, Option<PupilOutline>)> = Vec::new();
    let mut last = [None, Some(first.guess)];
    for i in 1..=FIRST_NODES {
        let radius = row.film_radius * i as f64 / FIRST_NODES as f64;
        let outline = row.outline(radius, OutlineGuess::following(last).as_ref());
        last = [last[1], outline.map(|outline| outline.guess)];
        pending.push((radius, outline));
    }
    pending.reverse();
    while let Some((radius, outline)) = pending.pop() {
        let (last_radius, last) = done[done.len() - 1];
        let middle = 0.5 * (last_radius + radius);
        let narrow = radius - last_radius <= MIN_INTERVAL * row.film_radius;
        let Some(outline) = outline else {
            // The light ends between the two radii.
            if narrow {
                done.push((radius, last));
                break;
            }
            pending.push((radius, None));
            pending.push((middle, row.outline(middle, Some(&last.guess))));
            continue;
        };
        let between = row.outline(middle, Some(&OutlineGuess::between(&last, &outline)));
        let mixed = last.support.mix(&outline.support, 0.5);
        let error = |m: PupilOutline| {
            InterpolationError::new(&mixed, &m.support, [MAX_CUT, MAX_ADDED]).ratio
        };
        let ratio = between.map_or(f64::INFINITY, error);
        let may_halve = !narrow && done.len() + pending.len() < MAX_NODES;
        match between {
            _ if ratio <= 1.0 => done.push((radius, outline)),
            // With the middle in the table the error is a quarter of this, and within the margin.
            Some(between) if ratio <= 1.25 => done.extend([(middle, between), (radius, outline)]),
            _ if may_halve => {
                pending.push((radius, Some(outline)));
                pending.push((middle, between));
            }
            // The interval is too short to resolve the square root of a closing pupil: take the
            // hull of all three outlines.
            _ => {
                let between = between.unwrap_or(last).support;
                let support = last.support.hull(&outline.support).hull(&between);
                let all = PupilOutline { support, ..outline };
                done.extend([(last_radius, all), (radius, all), (radius, outline)]);
            }
        }
    }
    let widened =
        |(radius, outline): &(f64, PupilOutline)| (*radius, outline.support.widened(MARGIN));
    done.iter().map(widened).collect()
}

/// The nodes for a lens from which no light reaches the middle of the film. All film points have
/// the disc of radius `disc_radius`, if light reaches any.
fn disc_nodes(row: &FilmRow<'_>, disc_radius: impl Fn() -> f64) -> RadialNodes {
    let steps = 4 * FIRST_NODES;
    let radius = |i: usize| row.film_radius * i as f64 / steps as f64;
    if !(0..=steps).any(|i| row.outline(radius(i), None).is_some()) {
        return RadialNodes::new();
    }
    let disc = Support([disc_radius(); SIDES]);
    vec![(0.0, disc), (row.film_radius, disc)]
}
