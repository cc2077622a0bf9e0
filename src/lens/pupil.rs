//! Where on the lens to aim a ray from a film point.
//!
//! Every target gives points of the plane through the rear vertex, where equation 1 integrates,
//! with their density per square millimeter. A ray aimed there may still be lost; it counts with
//! no light in it, as in the paper, so a target that is too large is slow but never wrong. One
//! that is too small is wrong, so [`ExitPupil`] keeps a margin and checks itself.

mod polygon;

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use crate::math::lanes::{LANES, Lane, Lanewise, widely};
use crate::sampling::DiscMap;

use super::sight::{Hint, Sight};
use super::{FilmPlace, Lens};
use polygon::{Outline, Span, directions_along};

pub use polygon::{Polygon, SIDES, Support};

/// Where to aim. The 1999 program: `RearElement`. Default now: `ExitPupil`.
#[derive(Clone, Debug)]
pub enum PupilTarget {
    RearElement(RearElement),
    ExitPupil(Box<ExitPupil>),
}

/// The disc of the rear-most element, the same from every film point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RearElement {
    pub radius: f64,
    pub map: DiscMap,
}

/// What one film point aims at. It lives on the stack for one pixel; a box would cost more.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Copy, Debug)]
pub enum PupilWindow<'a> {
    Disc {
        radius: f64,
        map: DiscMap,
    },
    Polygon(Polygon<'a>),
    /// Nothing gets through from here.
    Closed,
}

impl PupilTarget {
    pub fn rear_element(lens: &Lens, map: DiscMap) -> Self {
        Self::RearElement(RearElement::of(lens, map))
    }

    /// The exit pupil for a film at `film_z` whose points are at most `film_radius` from the axis.
    pub fn exit_pupil(lens: &Lens, film_z: f64, film_radius: f64) -> Self {
        Self::exit_pupil_of(lens, &FilmPlace::flat(film_z), film_radius)
    }

    /// The same for a film that is moved or bent; `film_radius` is from the film's middle.
    pub fn exit_pupil_of(lens: &Lens, place: &FilmPlace, film_radius: f64) -> Self {
        Self::ExitPupil(Box::new(ExitPupil::new(lens, place, film_radius)))
    }

    /// What a film point, in millimeters from the film's middle, aims at.
    pub fn window(&self, film: DVec2) -> PupilWindow<'_> {
        match self {
            Self::RearElement(rear) => PupilWindow::Disc {
                radius: rear.radius,
                map: rear.map,
            },
            Self::ExitPupil(pupil) => pupil.window(film),
        }
    }
}

/// Points of the rear vertex plane to aim at, side by side.
#[derive(Clone, Debug)]
pub struct Aims {
    pub x: Lane,
    pub y: Lane,
    /// The area that a point stands for, in square millimeters; 0 where there is nothing to aim at.
    pub area: Lane,
}

impl Default for Aims {
    fn default() -> Self {
        let [x, y, area] = [[0.0; LANES]; 3];
        Self { x, y, area }
    }
}

impl Aims {
    /// Aims through a window with a pair of numbers in the unit square.
    pub fn set(&mut self, lane: usize, window: &PupilWindow<'_>, [u, v]: [f64; 2]) {
        let density = window.density();
        self.area[lane] = 0.0;
        if density > 0.0 {
            [self.x[lane], self.y[lane]] = window.point(u, v).to_array();
            self.area[lane] = 1.0 / density;
        }
    }
}

impl PupilTarget {
    /// Aims from film points by pairs of numbers in the unit square, side by side: what their
    /// windows give, but for rounding.
    pub fn aims(&self, film: &[Lane; 2], pupil: &[Lane; 2], aims: &mut Aims) {
        if let Self::ExitPupil(target) = self
            && let Table::Radial(_, spans) = &target.table
        {
            return widely(SpanAims {
                spans,
                film,
                pupil,
                aims,
            });
        }
        for lane in 0..LANES {
            let window = self.window(DVec2::new(film[0][lane], film[1][lane]));
            aims.set(lane, &window, [pupil[0][lane], pupil[1][lane]]);
        }
    }
}

impl RearElement {
    pub fn of(lens: &Lens, map: DiscMap) -> Self {
        let surfaces = &lens.prescription().surfaces;
        let listed = surfaces.last().map_or(0.0, |s| s.semi_diameter);
        // A rear element without a listed size: twice the widest that is listed.
        let widest = surfaces
            .iter()
            .map(|s| s.semi_diameter)
            .filter(|r| r.is_finite());
        let radius = if listed.is_finite() {
            listed
        } else {
            2.0 * widest.fold(0.0, f64::max)
        };
        Self { radius, map }
    }
}

impl PupilWindow<'_> {
    /// A point of the rear vertex plane for a pair of numbers in the unit square.
    pub fn point(&self, u: f64, v: f64) -> DVec2 {
        match self {
            Self::Disc { radius, map } => *radius * DVec2::from_array(map.point([u, v])),
            Self::Polygon(polygon) => polygon.point(u, v),
            Self::Closed => DVec2::ZERO,
        }
    }

    /// Points per square millimeter, the same all over; 0 where there is nothing to aim at.
    pub fn density(&self) -> f64 {
        match self {
            Self::Disc { radius, .. } => 1.0 / (PI * radius * radius),
            Self::Polygon(polygon) => 1.0 / polygon.area(),
            Self::Closed => 0.0,
        }
    }

    /// Whether a point of the rear vertex plane can come out of [`Self::point`].
    pub fn contains(&self, point: DVec2) -> bool {
        match self {
            Self::Disc { radius, .. } => point.length_squared() <= radius * radius,
            Self::Polygon(polygon) => polygon.contains(point),
            Self::Closed => false,
        }
    }
}

/// How much wider than measured, on each side, as a share of the pupil's own half width.
const MARGIN: f64 = 0.004;
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
/// Places along the axis at which the pupil is measured for a film that is moved.
const LEVELS: usize = 9;
/// Cells along each axis of the film's quadrant, for lenses without rotational symmetry.
const GRID: usize = 16;

/// The part of the rear vertex plane that each film point sees light through, and a little more.
///
/// The figure that gets through is measured from a row of film points, as the reach of its
/// outline in 32 directions, and interpolated between them. Rows are put closer until the
/// interpolation holds. Without rotational symmetry the rows are a grid over a film quadrant.
#[derive(Clone, Debug)]
pub struct ExitPupil {
    table: Table,
    sides: [DVec2; SIDES],
}

/// By film radius, ascending; the pupil as seen from (radius, 0). None beyond the last.
type Radial = Vec<(f64, Support)>;

#[derive(Clone, Debug)]
enum Table {
    Radial(Radial, Spans),
    /// The same at several places of the film along the axis.
    Levels(Levels),
    /// By film position, in rows of x.
    Grid(Grid),
}

/// The same, ready to aim by.
#[derive(Clone, Debug, Default)]
struct Spans {
    /// Where the spans end, ascending; the first begins at 0.
    ends: Vec<f64>,
    spans: Vec<Span>,
    /// One over the length of each; 0 for one of no length.
    steepness: Vec<f64>,
    /// Parts of the radius a millimeter.
    cells_per_mm: f64,
    /// The first span that each of [`CELLS`] equal parts of the radius meets.
    starts: Vec<u32>,
}

/// Parts of the film's radius, to find a span in.
const CELLS: usize = 256;

impl Spans {
    fn new(nodes: &Radial, sides: &[DVec2; SIDES]) -> Self {
        let outline = |node: &(f64, Support)| Outline::of(&node.1, sides);
        let mut this = Self::default();
        for pair in nodes.windows(2) {
            let length = pair[1].0 - pair[0].0;
            this.ends.push(pair[1].0);
            this.steepness
                .push(if length > 0.0 { 1.0 / length } else { 0.0 });
            this.spans
                .push(Span::new(outline(&pair[0]), outline(&pair[1])));
        }
        let reach = this.ends.last().copied().unwrap_or(0.0);
        this.cells_per_mm = CELLS as f64 / reach.max(f64::MIN_POSITIVE);
        for cell in 0..CELLS {
            let radius = reach * cell as f64 / CELLS as f64;
            let first = this.ends.partition_point(|end| *end < radius);
            this.starts.push(first as u32);
        }
        this
    }

    fn window(&self, film: DVec2) -> Option<Polygon<'_>> {
        let (span, t, turn) = self.find(film)?;
        Polygon::between(span, t, turn)
    }

    /// The span of a film point, how far into it, and the turn from +x.
    fn find(&self, film: DVec2) -> Option<(&Span, f64, DVec2)> {
        let radius = film.length();
        let (span, t) = self.at(radius)?;
        Some((span, t, turn(film, radius)))
    }

    /// The span of a film radius, and how far into it.
    #[inline(always)]
    fn at(&self, radius: f64) -> Option<(&Span, f64)> {
        let i = self.number(radius)?;
        let start = self.start(i);
        Some((&self.spans[i], (radius - start) * self.steepness[i]))
    }

    /// The number of the span of a film radius.
    #[inline(always)]
    fn number(&self, radius: f64) -> Option<usize> {
        let reach = *self.ends.last()?;
        if !(radius <= reach) {
            return None;
        }
        let cell = (radius * self.cells_per_mm) as usize;
        let mut i = self.starts[cell.min(CELLS - 1)] as usize;
        // Rounding may have put the radius into the next cell.
        while i > 0 && radius <= self.ends[i - 1] {
            i -= 1;
        }
        while self.ends[i] < radius {
            i += 1;
        }
        Some(i)
    }

    /// The span that all radii are in, as those of a pixel mostly are.
    #[inline(always)]
    fn all_in_one(&self, radii: &Lane) -> Option<usize> {
        let number = self.number(radii[0])?;
        let (start, end) = (self.start(number), self.ends[number]);
        let mut inside = true;
        for radius in radii {
            inside &= (*radius >= start) & (*radius <= end);
        }
        inside.then_some(number)
    }

    /// The film radius where a span begins.
    #[inline(always)]
    fn start(&self, number: usize) -> f64 {
        if number > 0 {
            self.ends[number - 1]
        } else {
            0.0
        }
    }
}

/// [`PupilTarget::aims`] by a table over the film's radius.
struct SpanAims<'a> {
    spans: &'a Spans,
    film: &'a [Lane; 2],
    pupil: &'a [Lane; 2],
    aims: &'a mut Aims,
}

impl Lanewise for SpanAims<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let [[fx, fy], [u, v]] = [self.film, self.pupil];
        let Aims { x, y, area } = self.aims;
        let [mut radius, mut out] = [[0.0; LANES]; 2];
        for i in 0..LANES {
            radius[i] = (fx[i] * fx[i] + fy[i] * fy[i]).sqrt();
            out[i] = v[i].sqrt();
        }
        if let Some(number) = self.spans.all_in_one(&radius) {
            let (span, start) = (&self.spans.spans[number], self.spans.start(number));
            let mut t = [0.0; LANES];
            for i in 0..LANES {
                t[i] = (radius[i] - start) * self.spans.steepness[number];
                area[i] = span.area(t[i]).max(0.0);
            }
            for i in 0..LANES {
                [x[i], y[i]] = span.point(t[i], u[i], out[i]).to_array();
            }
        } else {
            for i in 0..LANES {
                area[i] = 0.0;
                if let Some((span, t)) = self.spans.at(radius[i]) {
                    area[i] = span.area(t).max(0.0);
                    [x[i], y[i]] = span.point(t, u[i], out[i]).to_array();
                }
            }
        }
        for i in 0..LANES {
            let some = radius[i] > 0.0;
            let scale = 1.0 / (if some { radius[i] } else { 1.0 });
            let (cos, sin) = (if some { fx[i] * scale } else { 1.0 }, fy[i] * scale);
            let (across, along) = (x[i], y[i]);
            x[i] = across * cos - along * sin;
            y[i] = across * sin + along * cos;
        }
    }
}

/// Turns +x to a film point.
fn turn(film: DVec2, radius: f64) -> DVec2 {
    if radius > 0.0 {
        film / radius
    } else {
        DVec2::X
    }
}

impl ExitPupil {
    /// Measures the pupil for film points up to `film_radius` from the film's middle.
    pub fn new(lens: &Lens, place: &FilmPlace, film_radius: f64) -> Self {
        let sides = directions_along(lens.iris_edges());
        let sight = Sight::new(lens);
        let mut look = Look {
            sight: &sight,
            place,
            sides: &sides,
            hint: None,
        };
        let table = match (place.is_centered(), lens.is_rotational()) {
            (true, true) => {
                let mut measure = |r| look.at(place.point(DVec2::new(r, 0.0)));
                let nodes = radial_table(&mut measure, film_radius.abs(), sight.reach());
                let spans = Spans::new(&nodes, &sides);
                Table::Radial(nodes, spans)
            }
            (false, true) => Table::Levels(Levels::new(&mut look, film_radius.abs())),
            (centered, false) => {
                let mirrored = centered && is_mirrored(lens.iris_edges());
                Table::Grid(Grid::new(&mut look, film_radius.abs(), mirrored))
            }
        };
        Self { table, sides }
    }

    /// What a film point, in millimeters from the film's middle, aims at.
    pub fn window(&self, film: DVec2) -> PupilWindow<'_> {
        if let Table::Radial(_, spans) = &self.table {
            let polygon = spans.window(film);
            return polygon.map_or(PupilWindow::Closed, PupilWindow::Polygon);
        }
        self.figure(film)
            .map_or(PupilWindow::Closed, |figure| self.placed(&figure))
    }

    /// The same between this pupil (`share` 0) and another of the same lens and film (1): the
    /// pupil at a wavelength between two.
    pub fn window_between(&self, other: &Self, share: f64, film: DVec2) -> PupilWindow<'static> {
        let (a, b) = match (self.figure(film), other.figure(film)) {
            (Some(a), Some(b)) => (a, b.support),
            (None, None) => return PupilWindow::Closed,
            // Light ends between the two: what one sees, with room to move.
            (a, b) => {
                let Some(figure) = a.or(b) else {
                    return PupilWindow::Closed;
                };
                let support = widened(&figure.support, MAY_DIFFER);
                return self.placed(&Figure { support, ..figure });
            }
        };
        // Where a pupil closes it moves like a square root, which a mixture would cut.
        let apart = excess(&a.support, &b).max(excess(&b, &a.support));
        let support = if apart > MAY_DIFFER {
            widened(&hull(&a.support, &b), MARGIN)
        } else {
            mix(&a.support, &b, share)
        };
        self.placed(&Figure { support, ..a })
    }

    /// What a film point sees; none where it sees nothing.
    fn figure(&self, film: DVec2) -> Option<Figure> {
        let turned = |support, point: DVec2| Figure {
            support,
            turn: point.try_normalize().unwrap_or(DVec2::X),
            mirror: DVec2::ONE,
        };
        match &self.table {
            Table::Radial(nodes, _) => Some(turned(radial_at(nodes, film.length())?, film)),
            Table::Levels(levels) => {
                let point = levels.place.point(film);
                Some(turned(levels.at(point)?, point.truncate()))
            }
            Table::Grid(grid) => {
                let mirror = match grid.mirrored {
                    true => DVec2::new(1f64.copysign(film.x), 1f64.copysign(film.y)),
                    false => DVec2::ONE,
                };
                Some(Figure {
                    support: grid.at(mirror * film)?,
                    turn: DVec2::X,
                    mirror,
                })
            }
        }
    }

    fn placed(&self, figure: &Figure) -> PupilWindow<'static> {
        let outline = Outline::of(&figure.support, &self.sides);
        let polygon = Polygon::whole(outline, figure.turn, figure.mirror);
        polygon.map_or(PupilWindow::Closed, PupilWindow::Polygon)
    }
}

/// Whether a row of edges is its own mirror image in both axes.
fn is_mirrored(edges: &[DVec2]) -> bool {
    let has = |wanted: DVec2| {
        let near = |e: &DVec2| (*e - wanted).length() < 1e-6 * wanted.length();
        edges.iter().any(near)
    };
    let mirrors = [DVec2::new(-1.0, 1.0), DVec2::new(1.0, -1.0)];
    mirrors.iter().all(|m| edges.iter().all(|e| has(*m * *e)))
}

/// A support and where it goes: +x becomes `turn`, then it is mirrored.
struct Figure {
    support: Support,
    turn: DVec2,
    mirror: DVec2,
}

fn radial_at(nodes: &Radial, radius: f64) -> Option<Support> {
    let above = nodes.partition_point(|(r, _)| *r < radius);
    let (r1, b) = nodes.get(above)?;
    Some(match above.checked_sub(1).map(|i| &nodes[i]) {
        None => *b,
        Some((r0, a)) => mix(a, b, (radius - r0) / (r1 - r0)),
    })
}

/// Measures what points of a film see.
struct Look<'a> {
    sight: &'a Sight<'a>,
    place: &'a FilmPlace,
    sides: &'a [DVec2; SIDES],
    hint: Option<Hint>,
}

impl Look<'_> {
    fn at(&mut self, point: DVec3) -> Option<Support> {
        self.sight.support(point, self.sides, &mut self.hint)
    }
}

fn mix(a: &Support, b: &Support, t: f64) -> Support {
    std::array::from_fn(|j| a[j] + t * (b[j] - a[j]))
}

/// The support of the smallest convex figure around two.
fn hull(a: &Support, b: &Support) -> Support {
    std::array::from_fn(|j| a[j].max(b[j]))
}

/// Bilinear; a corner that sees nothing is taken as the hull of those that do.
fn mix_corners(corners: [Option<&Support>; 4], x: f64, y: f64) -> Option<Support> {
    let mut all: Option<Support> = None;
    for corner in corners.into_iter().flatten() {
        all = Some(match all {
            None => *corner,
            Some(so_far) => hull(&so_far, corner),
        });
    }
    let all = all?;
    let [a, b, c, d] = corners.map(|corner| corner.unwrap_or(&all));
    Some(mix(&mix(a, b, x), &mix(c, d, x), y))
}

/// A support widened by a share of the figure's own half width in each direction.
fn widened(support: &Support, share: f64) -> Support {
    std::array::from_fn(|j| {
        let opposite = support[(j + SIDES / 2) % SIDES];
        support[j] + share * 0.5 * (support[j] + opposite)
    })
}

/// How far `inner` sticks out of `outer`, as a share of `outer`'s half width; negative if inside.
fn excess(inner: &Support, outer: &Support) -> f64 {
    (0..SIDES)
        .map(|j| {
            let half = 0.5 * (outer[j] + outer[(j + SIDES / 2) % SIDES]);
            (inner[j] - outer[j]) / half.max(f64::MIN_POSITIVE)
        })
        .fold(f64::NEG_INFINITY, f64::max)
}

/// Measured supports by film radius: halved where interpolation errs, ended where light ends.
fn radial_table(
    measure: &mut dyn FnMut(f64) -> Option<Support>,
    film_radius: f64,
    reach: f64,
) -> Radial {
    let mut done: Radial = Vec::new();
    let Some(first) = measure(0.0) else {
        return radial_fallback(measure, film_radius, reach);
    };
    done.push((0.0, first));
    // Radii still to be reached, the nearest last.
    let mut ahead: Vec<(f64, Option<Support>)> = (1..=FIRST_NODES)
        .rev()
        .map(|i| film_radius * i as f64 / FIRST_NODES as f64)
        .map(|radius| (radius, measure(radius)))
        .collect();
    while let Some((radius, support)) = ahead.pop() {
        let (last_radius, last) = done[done.len() - 1];
        let middle = 0.5 * (last_radius + radius);
        let narrow = radius - last_radius <= NARROW * film_radius;
        let Some(support) = support else {
            // Light ends between the two.
            if narrow {
                done.push((radius, last));
                break;
            }
            ahead.push((radius, None));
            ahead.push((middle, measure(middle)));
            continue;
        };
        let between = measure(middle);
        let straight = mix(&last, &support, 0.5);
        let bad = match &between {
            None => true,
            Some(m) => excess(m, &straight) > MAY_CUT || excess(&straight, m) > MAY_ADD,
        };
        if bad && !narrow && done.len() + ahead.len() < MAX_NODES {
            ahead.push((radius, Some(support)));
            ahead.push((middle, between));
            continue;
        }
        // A pupil closes like a square root: where that is not resolved take all of it.
        let support = if bad {
            hull(&hull(&last, &support), &between.unwrap_or(last))
        } else {
            support
        };
        done.push((radius, support));
    }
    done.iter()
        .map(|(radius, support)| (*radius, widened(support, MARGIN)))
        .collect()
}

/// Nothing gets through on the axis: start where something does, with the disc before it.
fn radial_fallback(
    measure: &mut dyn FnMut(f64) -> Option<Support>,
    film_radius: f64,
    reach: f64,
) -> Radial {
    let steps = 4 * FIRST_NODES;
    let everything = [reach; SIDES];
    for i in 0..=steps {
        if measure(film_radius * i as f64 / steps as f64).is_some() {
            return vec![(0.0, everything), (film_radius, everything)];
        }
    }
    Vec::new()
}

/// Radial tables at several places along the axis, for a film that is moved.
#[derive(Clone, Debug)]
struct Levels {
    place: FilmPlace,
    low: f64,
    step: f64,
    tables: Vec<Radial>,
}

impl Levels {
    fn new(look: &mut Look<'_>, film_radius: f64) -> Self {
        // The places of the film, with a little to spare.
        let (mut low, mut high, mut far) = (f64::INFINITY, f64::NEG_INFINITY, 0.0f64);
        for k in 0..=64 {
            let turn = TAU * f64::from(k) / 64.0;
            let out = film_radius * if k == 64 { 0.0 } else { 1.01 };
            let (sin, cos) = libm::sincos(turn);
            let point = look.place.point(out * DVec2::new(cos, sin));
            (low, high) = (low.min(point.z), high.max(point.z));
            far = far.max(point.truncate().length());
        }
        let step = ((high - low) / (LEVELS - 1) as f64).max(1e-9 * film_radius);
        let reach = look.sight.reach();
        let mut table = |z: f64| {
            look.hint = None;
            radial_table(&mut |r| look.at(DVec3::new(r, 0.0, z)), far, reach)
        };
        let tables: Vec<Radial> = (0..LEVELS).map(|k| table(low + k as f64 * step)).collect();
        let mut this = Self {
            place: *look.place,
            low,
            step,
            tables,
        };
        let share = this.excess(look, far);
        for (_, support) in this.tables.iter_mut().flatten() {
            *support = widened(support, share);
        }
        this
    }

    fn at(&self, point: DVec3) -> Option<Support> {
        let level = (point.z - self.low) / self.step;
        let k = (level.floor().max(0.0) as usize).min(LEVELS - 2);
        let radius = point.truncate().length();
        let [a, b] = [k, k + 1].map(|k| radial_at(&self.tables[k], radius));
        match (a, b) {
            (Some(a), Some(b)) => Some(mix(&a, &b, (level - k as f64).clamp(0.0, 1.0))),
            (a, b) => a.or(b),
        }
    }

    /// The most that a figure between two levels sticks out of what is interpolated.
    fn excess(&self, look: &mut Look<'_>, far: f64) -> f64 {
        const RADII: usize = 24;
        let mut worst: f64 = 0.0;
        for k in 0..LEVELS - 1 {
            look.hint = None;
            for i in 0..=RADII {
                let r = far * i as f64 / RADII as f64;
                let point = DVec3::new(r, 0.0, self.low + (k as f64 + 0.5) * self.step);
                if let (Some(inner), Some(outer)) = (look.at(point), self.at(point)) {
                    worst = worst.max(excess(&inner, &outer));
                }
            }
        }
        worst
    }
}

/// Measured supports over the film, square cell by square cell.
#[derive(Clone, Debug)]
struct Grid {
    low: DVec2,
    cell: f64,
    /// Nodes along each side.
    count: usize,
    nodes: Vec<Option<Support>>,
    /// The grid is the quadrant x, y ≥ 0, and the others are its mirror images.
    mirrored: bool,
}

impl Grid {
    fn new(look: &mut Look<'_>, film_radius: f64, mirrored: bool) -> Self {
        let cell = film_radius.max(f64::MIN_POSITIVE) / GRID as f64;
        let (low, cells) = match mirrored {
            true => (DVec2::ZERO, GRID),
            false => (DVec2::splat(-film_radius), 2 * GRID),
        };
        let mut this = Self {
            low,
            cell,
            count: cells + 1,
            nodes: Vec::new(),
            mirrored,
        };
        // Only where there is film, and the corners of cells that reach it.
        let mut at = |x: f64, y: f64| {
            let film = low + cell * DVec2::new(x, y);
            let near = film.length() <= film_radius + 1.5 * cell;
            near.then(|| look.at(look.place.point(film))).flatten()
        };
        for j in 0..this.count {
            for i in 0..this.count {
                this.nodes.push(at(i as f64, j as f64));
            }
        }
        this.widen(at);
        if !mirrored {
            this.open_borders(look.sight.reach());
        }
        this
    }

    /// The corners of the cell at a column and a row.
    fn corners(&self, i: usize, j: usize) -> [usize; 4] {
        let first = j * self.count + i;
        [first, first + 1, first + self.count, first + self.count + 1]
    }

    /// The support at a film point.
    fn at(&self, film: DVec2) -> Option<Support> {
        let place = (film - self.low) / self.cell;
        let at = |v: f64| (v.floor().max(0.0) as usize).min(self.count - 2);
        let (i, j) = (at(place.x), at(place.y));
        let corners = self.corners(i, j).map(|c| self.nodes[c].as_ref());
        let part = (place - DVec2::new(i as f64, j as f64)).clamp(DVec2::ZERO, DVec2::ONE);
        mix_corners(corners, part.x, part.y)
    }

    /// Widens the corners of every cell by what its middle sticks out. Along a line through a
    /// cell, what bulges out concavely bulges at most twice as far as in the middle; the quadrant
    /// of a film that is not moved is smooth enough not to need that.
    fn widen(&mut self, mut at: impl FnMut(f64, f64) -> Option<Support>) {
        let mut share = vec![0.0f64; self.nodes.len()];
        let bulge = if self.mirrored { 1.0 } else { 2.0 };
        for j in 0..self.count - 1 {
            for i in 0..self.count - 1 {
                let corners = self.corners(i, j);
                let Some(middle) = at(i as f64 + 0.5, j as f64 + 0.5) else {
                    continue;
                };
                match mix_corners(corners.map(|c| self.nodes[c].as_ref()), 0.5, 0.5) {
                    Some(straight) => {
                        let excess = bulge * excess(&middle, &straight).max(0.0);
                        corners
                            .iter()
                            .for_each(|&c| share[c] = share[c].max(excess));
                    }
                    None => corners.iter().for_each(|&c| self.nodes[c] = Some(middle)),
                }
            }
        }
        for (node, share) in self.nodes.iter_mut().zip(share) {
            *node = node
                .as_ref()
                .map(|support| widened(support, MARGIN + share));
        }
    }

    /// Dark nodes next to light ones aim at everything: a film moved aside ends the image circle
    /// in the midst of cells.
    fn open_borders(&mut self, reach: f64) {
        let count = self.count as isize;
        let lit = |nodes: &[Option<Support>], i: isize, j: isize| {
            let inside = (0..count).contains(&i) && (0..count).contains(&j);
            inside && nodes[(j * count + i) as usize].is_some()
        };
        let before = self.nodes.clone();
        for (k, node) in self.nodes.iter_mut().enumerate() {
            let (i, j) = (k as isize % count, k as isize / count);
            let near_light = (-1..=1).any(|y| (-1..=1).any(|x| lit(&before, i + x, j + y)));
            if node.is_none() && near_light {
                *node = Some([reach; SIDES]);
            }
        }
    }
}
