//! The pupil by film radius, for a lens and a film that are symmetric about the axis.

use crate::lens::pupil::polygon::{SIDES, Support};
use crate::lens::pupil::search::outline::{OutlineGuess, PupilOutline};
use crate::lens::pupil::support::{MARGIN, excess, hull, mix, widened};

/// An interval of film radii is halved until interpolation at its middle cuts off less of the pupil
/// than this share of its half width. That is 5/8 of [`MARGIN`], which is added on each side.
const MAY_CUT: f64 = 0.0025;
/// And until interpolation adds less than this share. What is added costs rays that are lost.
const MAY_ADD: f64 = 0.008;
/// The pupils of two wavelengths may differ by this share of the half width. If they differ more,
/// the pupil of a wavelength between them is not taken for a mixture of them, and the margin is
/// added again.
const MAY_DIFFER: f64 = 0.1;
const FIRST_NODES: usize = 8;
/// An interval this short, as a share of the film's radius, is not halved again. A pupil closes
/// like a square root of the film radius: halving down to 1e-5 took most of the time of a table.
const NARROW: f64 = 1e-3;
const MAX_NODES: usize = 192;

/// The pupil as outline from the film points (radius, 0), by ascending radius. No light reaches film
/// points beyond the last.
pub(super) type Radial = Vec<(f64, Support)>;

/// The pupil from a film radius, interpolated.
pub(super) fn radial_at(nodes: &Radial, radius: f64) -> Option<Support> {
    let above = nodes.partition_point(|(r, _)| *r < radius);
    let (r1, b) = nodes.get(above)?;
    Some(match above.checked_sub(1).map(|i| &nodes[i]) {
        None => *b,
        Some((r0, a)) => mix(a, b, (radius - r0) / (r1 - r0)),
    })
}

/// A figure that contains the pupils of several wavelengths from one film point, and those of the
/// wavelengths between.
pub(super) fn support_around(supports: &[Option<Support>]) -> Option<Support> {
    let all = supports
        .iter()
        .flatten()
        .copied()
        .reduce(|a, b| hull(&a, &b))?;
    if supports.iter().any(Option::is_none) {
        // At some wavelength between them the light ends: leave room for the pupil to move.
        return Some(widened(&all, MAY_DIFFER));
    }
    // A pupil that closes moves like a square root of the wavelength, not linearly.
    let least = |support: &Support| excess(&all, support);
    let apart = supports.iter().flatten().map(least).fold(0.0, f64::max);
    Some(if apart > MAY_DIFFER {
        widened(&all, MARGIN)
    } else {
        all
    })
}

/// The table that contains several. Between two film radii each figure is a mixture of two, and the
/// mixture of the containing figures contains it.
pub(super) fn radial_around(tables: &[&Radial]) -> Radial {
    let ends: Vec<f64> = tables.iter().filter_map(|t| Some(t.last()?.0)).collect();
    let mut radii: Vec<f64> = tables
        .iter()
        .flat_map(|t| t.iter().map(|(r, _)| *r))
        .collect();
    radii.sort_by(f64::total_cmp);
    radii.dedup();
    let mut nodes = Radial::new();
    for radius in radii {
        let at: Vec<Option<Support>> = tables.iter().map(|t| widest_at(t, radius)).collect();
        let put = |nodes: &mut Radial, at: &[Option<Support>]| {
            nodes.extend(support_around(at).map(|support| (radius, support)));
        };
        put(&mut nodes, &at);
        // A table that ends here counts no more behind this radius.
        let goes_on = |t: &&Radial| t.last().is_some_and(|(end, _)| *end > radius);
        if ends.contains(&radius) && tables.iter().any(goes_on) {
            let on: Vec<Option<Support>> = std::iter::zip(&at, tables)
                .map(|(at, t)| at.filter(|_| goes_on(t)))
                .collect();
            put(&mut nodes, &on);
        }
    }
    nodes
}

/// The figure of a film radius: the hull of all nodes at this radius, if there are several.
fn widest_at(nodes: &Radial, radius: f64) -> Option<Support> {
    let same = nodes.iter().filter(|(r, _)| *r == radius).map(|(_, s)| *s);
    same.reduce(|a, b| hull(&a, &b))
        .or_else(|| radial_at(nodes, radius))
}

/// Measures the table. Intervals are halved until interpolation holds; the table ends where the
/// light ends.
pub(super) fn radial_table(
    measure: &mut dyn FnMut(f64, Option<&OutlineGuess>) -> Option<PupilOutline>,
    film_radius: f64,
    everything: impl Fn() -> f64,
) -> Radial {
    let mut done: Vec<(f64, PupilOutline)> = Vec::new();
    let Some(first) = measure(0.0, None) else {
        return radial_fallback(measure, film_radius, everything);
    };
    done.push((0.0, first));
    // The radii that are not in the table yet, the nearest last.
    let mut ahead: Vec<(f64, Option<PupilOutline>)> = Vec::new();
    let mut last = [None, Some(first.guess)];
    for i in 1..=FIRST_NODES {
        let radius = film_radius * i as f64 / FIRST_NODES as f64;
        let outline = measure(radius, OutlineGuess::following(last).as_ref());
        last = [last[1], outline.map(|outline| outline.guess)];
        ahead.push((radius, outline));
    }
    ahead.reverse();
    while let Some((radius, outline)) = ahead.pop() {
        let (last_radius, last) = done[done.len() - 1];
        let middle = 0.5 * (last_radius + radius);
        let narrow = radius - last_radius <= NARROW * film_radius;
        let Some(outline) = outline else {
            // The light ends between the two radii.
            if narrow {
                done.push((radius, last));
                break;
            }
            ahead.push((radius, None));
            ahead.push((middle, measure(middle, Some(&last.guess))));
            continue;
        };
        let between = measure(middle, Some(&OutlineGuess::between(&last, &outline)));
        let straight = mix(&last.support, &outline.support, 0.5);
        // What is cut off and what is added, over what may be.
        let bad = between.map_or(f64::INFINITY, |m| {
            let cut = excess(&m.support, &straight) / MAY_CUT;
            cut.max(excess(&straight, &m.support) / MAY_ADD)
        });
        let may_halve = !narrow && done.len() + ahead.len() < MAX_NODES;
        match between {
            _ if bad <= 1.0 => done.push((radius, outline)),
            // With the middle in the table the error is a quarter, within the margin.
            Some(between) if bad <= 1.25 => done.extend([(middle, between), (radius, outline)]),
            _ if may_halve => {
                ahead.push((radius, Some(outline)));
                ahead.push((middle, between));
            }
            // The square root of a closing pupil is not resolved: take the hull of all three.
            _ => {
                let between = between.unwrap_or(last).support;
                let support = hull(&hull(&last.support, &outline.support), &between);
                let all = PupilOutline { support, ..outline };
                done.extend([(last_radius, all), (radius, all), (radius, outline)]);
            }
        }
    }
    done.iter()
        .map(|(radius, outline)| (*radius, widened(&outline.support, MARGIN)))
        .collect()
}

/// The table where no light reaches the middle of the film: the disc of radius `everything` from all
/// film points, if light reaches any.
fn radial_fallback(
    measure: &mut dyn FnMut(f64, Option<&OutlineGuess>) -> Option<PupilOutline>,
    film_radius: f64,
    everything: impl Fn() -> f64,
) -> Radial {
    let steps = 4 * FIRST_NODES;
    for i in 0..=steps {
        if measure(film_radius * i as f64 / steps as f64, None).is_some() {
            let everything = [everything(); SIDES];
            return vec![(0.0, everything), (film_radius, everything)];
        }
    }
    Vec::new()
}
