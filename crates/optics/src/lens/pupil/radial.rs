//! A table of pupils by film radius, for a lens and a film with rotational symmetry.

use crate::lens::pupil::search::outline::{OutlineGuess, PupilOutline};
use crate::lens::pupil::sides::{SIDES, Support};
use crate::lens::pupil::support::{MARGIN, excess, hull, mix, widened};

/// An interval of film radii is halved until interpolation at its middle cuts off less of the pupil
/// than this share of its half width. That is 5/8 of [`MARGIN`], which is added on each side.
const MAX_CUT: f64 = 0.0025;
/// An interval is also halved until interpolation adds less than this share of the half width. What
/// is added costs rays that are lost. With it 98.5 to 98.9% of the rays aimed at the lenses of the
/// oracle get through, all but the anamorphic one (docs/accuracy.md, *The pupil*).
const MAX_ADDED: f64 = 0.008;
/// The pupils of two wavelengths may differ by this share of the half width. If they differ more,
/// the pupil of a wavelength between them is not regarded as a mixture of them, and the margin is
/// added again. No search is recorded: a smaller value costs lost rays, and
/// `no_ray_of_any_wavelength_that_passes_is_outside_the_pupil` tests that no ray is cut with it.
const MAX_DIFFERENCE: f64 = 0.1;
/// The number of intervals of film radii at the start.
const FIRST_NODES: usize = 8;
/// An interval this short, as a share of the film's radius, is not halved again. A pupil closes
/// like a square root of the film radius: halving down to 1e-5 took most of the time of a table.
const MIN_INTERVAL: f64 = 1e-3;
/// The number of nodes at which a table is no longer refined. It bounds the time and the memory.
const MAX_NODES: usize = 192;

/// Film radii in millimeters, ascending, each with the support of the pupil as seen from the film
/// point (radius, 0). No light reaches film points beyond the last radius.
pub(super) type Radial = Vec<(f64, Support)>;

/// The pupil from a film radius, interpolated linearly; none beyond the last node.
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
        // The light ends at some wavelength between them: leave room for the pupil to move.
        return Some(widened(&all, MAX_DIFFERENCE));
    }
    // A pupil that closes moves like a square root of the wavelength, not linearly.
    let least = |support: &Support| excess(&all, support);
    let apart = supports.iter().flatten().map(least).fold(0.0, f64::max);
    Some(if apart > MAX_DIFFERENCE {
        widened(&all, MARGIN)
    } else {
        all
    })
}

/// The table whose figures contain those of several tables. Between two film radii each figure is a
/// mixture of two, and the mixture of the containing figures contains it.
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
        // A table that ends here does not count beyond this radius.
        let continues = |t: &&Radial| t.last().is_some_and(|(end, _)| *end > radius);
        if ends.contains(&radius) && tables.iter().any(continues) {
            let on: Vec<Option<Support>> = std::iter::zip(&at, tables)
                .map(|(at, t)| at.filter(|_| continues(t)))
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

/// Measures the table with `measure`, which returns the outline from a film radius. Intervals are
/// halved until the interpolation error is within [`MAX_CUT`] and [`MAX_ADDED`]. The table ends
/// where the light ends. `disc_radius` is the radius of a disc that contains every pupil.
pub(super) fn radial_table(
    measure: &mut dyn FnMut(f64, Option<&OutlineGuess>) -> Option<PupilOutline>,
    film_radius: f64,
    disc_radius: impl Fn() -> f64,
) -> Radial {
    let mut done: Vec<(f64, PupilOutline)> = Vec::new();
    let Some(first) = measure(0.0, None) else {
        return radial_fallback(measure, film_radius, disc_radius);
    };
    done.push((0.0, first));
    // The radii that are not in the table yet, in descending order.
    let mut pending: Vec<(f64, Option<PupilOutline>)> = Vec::new();
    let mut last = [None, Some(first.guess)];
    for i in 1..=FIRST_NODES {
        let radius = film_radius * i as f64 / FIRST_NODES as f64;
        let outline = measure(radius, OutlineGuess::following(last).as_ref());
        last = [last[1], outline.map(|outline| outline.guess)];
        pending.push((radius, outline));
    }
    pending.reverse();
    while let Some((radius, outline)) = pending.pop() {
        let (last_radius, last) = done[done.len() - 1];
        let middle = 0.5 * (last_radius + radius);
        let narrow = radius - last_radius <= MIN_INTERVAL * film_radius;
        let Some(outline) = outline else {
            // The light ends between the two radii.
            if narrow {
                done.push((radius, last));
                break;
            }
            pending.push((radius, None));
            pending.push((middle, measure(middle, Some(&last.guess))));
            continue;
        };
        let between = measure(middle, Some(&OutlineGuess::between(&last, &outline)));
        let straight = mix(&last.support, &outline.support, 0.5);
        // The greater ratio of an interpolation error to its bound.
        let ratio = between.map_or(f64::INFINITY, |m| {
            let cut = excess(&m.support, &straight) / MAX_CUT;
            cut.max(excess(&straight, &m.support) / MAX_ADDED)
        });
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
            // hull of all three figures.
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

/// The table for a lens from which no light reaches the middle of the film. All film points have
/// the disc of radius `disc_radius`, if light reaches any.
fn radial_fallback(
    measure: &mut dyn FnMut(f64, Option<&OutlineGuess>) -> Option<PupilOutline>,
    film_radius: f64,
    disc_radius: impl Fn() -> f64,
) -> Radial {
    let steps = 4 * FIRST_NODES;
    for i in 0..=steps {
        if measure(film_radius * i as f64 / steps as f64, None).is_some() {
            let disc = [disc_radius(); SIDES];
            return vec![(0.0, disc), (film_radius, disc)];
        }
    }
    Vec::new()
}
