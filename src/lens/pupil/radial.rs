//! The pupil by film radius, where everything is even around the axis.

use super::polygon::{SIDES, Support};
use super::search::outline::{Hint, Seen, next};
use super::support::{MARGIN, excess, hull, mix, widened};

/// An interval of film radii is halved until interpolation cuts less than this share of the
/// half width in its middle, and adds less than the other. What is cut is within the margin.
const MAY_CUT: f64 = 0.0025;
const MAY_ADD: f64 = 0.008;
/// Pupils of two wavelengths may differ by this share of the half width and still be mixed for
/// one between them.
const MAY_DIFFER: f64 = 0.1;
const FIRST_NODES: usize = 8;
/// Intervals this short, as a share of the film's radius, are not halved again.
const NARROW: f64 = 1e-3;
const MAX_NODES: usize = 192;

/// By film radius, ascending; the pupil as seen from (radius, 0). None beyond the last.
pub(super) type Radial = Vec<(f64, Support)>;

pub(super) fn radial_at(nodes: &Radial, radius: f64) -> Option<Support> {
    let above = nodes.partition_point(|(r, _)| *r < radius);
    let (r1, b) = nodes.get(above)?;
    Some(match above.checked_sub(1).map(|i| &nodes[i]) {
        None => *b,
        Some((r0, a)) => mix(a, b, (radius - r0) / (r1 - r0)),
    })
}

/// What holds the pupils of several wavelengths as seen from one film point, and those between.
pub(super) fn support_around(supports: &[Option<Support>]) -> Option<Support> {
    let all = supports
        .iter()
        .flatten()
        .copied()
        .reduce(|a, b| hull(&a, &b))?;
    if supports.iter().any(Option::is_none) {
        // Light ends between them: with room to move.
        return Some(widened(&all, MAY_DIFFER));
    }
    // Where a pupil closes it moves like a square root.
    let least = |support: &Support| excess(&all, support);
    let apart = supports.iter().flatten().map(least).fold(0.0, f64::max);
    Some(if apart > MAY_DIFFER {
        widened(&all, MARGIN)
    } else {
        all
    })
}

/// The table around several. Between two film radii each figure is a mixture, and the mixture of
/// the figures around them holds it.
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
        // One that ends here is no more from here on.
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

/// The figure of a film radius; of all at this radius, where there are several.
fn widest_at(nodes: &Radial, radius: f64) -> Option<Support> {
    let same = nodes.iter().filter(|(r, _)| *r == radius).map(|(_, s)| *s);
    same.reduce(|a, b| hull(&a, &b))
        .or_else(|| radial_at(nodes, radius))
}

/// Measured supports by film radius: halved where interpolation errs, ended where light ends.
pub(super) fn radial_table(
    measure: &mut dyn FnMut(f64, Option<&Hint>) -> Option<Seen>,
    film_radius: f64,
    everything: impl Fn() -> f64,
) -> Radial {
    let mut done: Vec<(f64, Seen)> = Vec::new();
    let Some(first) = measure(0.0, None) else {
        return radial_fallback(measure, film_radius, everything);
    };
    done.push((0.0, first));
    // Radii still to be reached, the nearest last.
    let mut ahead: Vec<(f64, Option<Seen>)> = Vec::new();
    let mut last = [None, Some(first.hint)];
    for i in 1..=FIRST_NODES {
        let radius = film_radius * i as f64 / FIRST_NODES as f64;
        let seen = measure(radius, next(last).as_ref());
        last = [last[1], seen.map(|seen| seen.hint)];
        ahead.push((radius, seen));
    }
    ahead.reverse();
    while let Some((radius, seen)) = ahead.pop() {
        let (last_radius, last) = done[done.len() - 1];
        let middle = 0.5 * (last_radius + radius);
        let narrow = radius - last_radius <= NARROW * film_radius;
        let Some(seen) = seen else {
            // Light ends between the two.
            if narrow {
                done.push((radius, last));
                break;
            }
            ahead.push((radius, None));
            ahead.push((middle, measure(middle, Some(&last.hint))));
            continue;
        };
        let between = measure(middle, Some(&Hint::between(&last, &seen)));
        let straight = mix(&last.support, &seen.support, 0.5);
        // What is cut and what is added too much, in parts of what may be.
        let bad = between.map_or(f64::INFINITY, |m| {
            let cut = excess(&m.support, &straight) / MAY_CUT;
            cut.max(excess(&straight, &m.support) / MAY_ADD)
        });
        let may_halve = !narrow && done.len() + ahead.len() < MAX_NODES;
        match between {
            _ if bad <= 1.0 => done.push((radius, seen)),
            // With the middle itself in the table less errs, and that is within the margin.
            Some(between) if bad <= 1.25 => done.extend([(middle, between), (radius, seen)]),
            _ if may_halve => {
                ahead.push((radius, Some(seen)));
                ahead.push((middle, between));
            }
            // A pupil closes like a square root: where that is not resolved take all of it.
            _ => {
                let between = between.unwrap_or(last).support;
                let support = hull(&hull(&last.support, &seen.support), &between);
                let all = Seen { support, ..seen };
                done.extend([(last_radius, all), (radius, all), (radius, seen)]);
            }
        }
    }
    done.iter()
        .map(|(radius, seen)| (*radius, widened(&seen.support, MARGIN)))
        .collect()
}

/// Nothing gets through on the axis: start where something does, with the disc before it.
fn radial_fallback(
    measure: &mut dyn FnMut(f64, Option<&Hint>) -> Option<Seen>,
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
