//! Where on the lens to aim a ray from a film point.
//!
//! Every target gives points of the plane through the rear vertex, where equation 1 integrates,
//! with their density per square millimeter. A ray aimed there may still be lost; it counts with
//! no light in it, as in the paper, so a target that is too large is slow but never wrong. One
//! that is too small is wrong, so [`ExitPupil`] keeps a margin and checks itself.

mod light;
mod polar;
mod polygon;
mod spans;
mod support;

use std::cell::RefCell;
use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use crate::math::lanes::{LANES, Lane, widely};
use crate::sampling::DiscMap;

use super::sight::{Hint, Seen, Sight, is_outside};
use super::{FilmPlace, Lens};
use polar::Cells;
use polygon::{Outline, directions_along};
use spans::{SpanAims, Spans};
use support::{excess, hull, mix, widened};

pub use light::Light;
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
    /// The polygon, but for a share [`ASIDE`] of the aims that go anywhere in a disc: light may come
    /// from beside the polygon.
    Beside(Polygon<'a>, f64),
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
    /// The share of that area that is light; 0 where it isn't known.
    pub light: Lane,
}

impl Default for Aims {
    fn default() -> Self {
        let [x, y, area, light] = [[0.0; LANES]; 4];
        Self { x, y, area, light }
    }
}

impl Aims {
    /// Aims through a window with a pair of numbers in the unit square.
    pub fn set(&mut self, lane: usize, window: &PupilWindow<'_>, [u, v]: [f64; 2]) {
        [self.area[lane], self.light[lane]] = [0.0; 2];
        if !window.is_closed() {
            let aim = window.point(u, v);
            [self.x[lane], self.y[lane]] = aim.to_array();
            self.area[lane] = 1.0 / window.density(aim);
        }
    }
}

impl PupilTarget {
    /// Aims from film points by pairs of numbers in the unit square, side by side: what their
    /// windows give, but for rounding.
    pub fn aims(&self, film: &[Lane; 2], pupil: &[Lane; 2], light: &Light, aims: &mut Aims) {
        if let Self::ExitPupil(target) = self
            && let Table::Radial(_, spans) = &target.table
            && target.beside.is_none()
        {
            return widely(SpanAims {
                spans,
                light,
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

impl PupilTarget {
    /// How much of what is aimed at is light, for the lens and film that this was made for: where
    /// they are even around the axis, and light comes in one piece.
    pub fn light(&self, lens: &Lens, place: &FilmPlace) -> Light {
        match self {
            Self::ExitPupil(pupil) if pupil.beside.is_none() => match &pupil.table {
                Table::Radial(_, spans) => Light::of(spans, lens, place),
                _ => Light::default(),
            },
            _ => Light::default(),
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
            Self::Beside(_, radius) if u < ASIDE => disc(*radius).point(u / ASIDE, v),
            Self::Beside(polygon, _) => polygon.point((u - ASIDE) / (1.0 - ASIDE), v),
            Self::Closed => DVec2::ZERO,
        }
    }

    /// How many of the points of [`Self::point`] fall on a square millimeter there.
    pub fn density(&self, point: DVec2) -> f64 {
        match self {
            Self::Disc { radius, .. } => 1.0 / (PI * radius * radius),
            Self::Polygon(polygon) => 1.0 / polygon.area(),
            Self::Beside(polygon, radius) => {
                let share = |inside: bool, of: f64, area: f64| match inside {
                    true => of / area,
                    false => 0.0,
                };
                let disc = PI * radius * radius;
                share(point.length_squared() <= radius * radius, ASIDE, disc)
                    + share(polygon.contains(point), 1.0 - ASIDE, polygon.area())
            }
            Self::Closed => 0.0,
        }
    }

    /// Whether there is nothing to aim at.
    pub fn is_closed(&self) -> bool {
        matches!(self, Self::Closed)
    }

    /// Whether a point of the rear vertex plane can come out of [`Self::point`].
    pub fn contains(&self, point: DVec2) -> bool {
        match self {
            Self::Disc { radius, .. } => point.length_squared() <= radius * radius,
            Self::Polygon(polygon) => polygon.contains(point),
            Self::Beside(polygon, radius) => {
                polygon.contains(point) || disc(*radius).contains(point)
            }
            Self::Closed => false,
        }
    }
}

/// All of a disc.
fn disc(radius: f64) -> PupilWindow<'static> {
    PupilWindow::Disc {
        radius,
        map: DiscMap::Concentric,
    }
}

/// The share of the aims that go anywhere where light may come from beside the pupil.
const ASIDE: f64 = 0.025;
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
/// Film points from the middle outward at which light is sought beside the pupil.
const SEARCHES: usize = 16;
/// Film points past the end of the light from which it is sought again.
const CLOSER: usize = 16;
/// Rays that use less of the tightest semi-diameter than this may get through from a film point
/// beside; less than that does, but for rounding of a search.
const NEARLY_THROUGH: f64 = 1.2;
const THROUGH: f64 = 1.01;

/// The part of the rear vertex plane that each film point sees light through, and a little more.
///
/// The figure that gets through is measured from a row of film points, as the reach of its
/// outline in 32 directions, and interpolated between them. Rows are put closer until the
/// interpolation holds. Without rotational symmetry they are cells around the axis ([`Cells`]).
///
/// Where a beam is folded inside the lens light may come in several pieces, which open and close
/// as the film point moves. With a lens where that is seen the figure is that of the largest, and
/// a few rays go all over the rear element, so that none that gets through is never sent.
#[derive(Clone, Debug)]
pub struct ExitPupil {
    table: Table,
    sides: [DVec2; SIDES],
    beside: Option<Beside>,
}

/// Where light may come from beside the figure.
#[derive(Clone, Copy, Debug)]
struct Beside {
    /// The radius of the disc on the rear vertex plane.
    radius: f64,
    /// Film radii that may see some beside a figure.
    range: [f64; 2],
    /// Film radii that may see some and have no figure.
    alone: Option<[f64; 2]>,
}

/// The range that two are in.
fn both([a, b]: [f64; 2], [c, d]: [f64; 2]) -> [f64; 2] {
    [a.min(c), b.max(d)]
}

/// By film radius, ascending; the pupil as seen from (radius, 0). None beyond the last.
type Radial = Vec<(f64, Support)>;

#[derive(Clone, Debug)]
enum Table {
    Radial(Radial, Spans),
    /// By film position.
    Cells(Box<Cells>),
    /// Around others, which are of neighboring wavelengths.
    Around([Box<ExitPupil>; 3]),
}

impl Table {
    fn nodes(&self) -> Option<&Radial> {
        match self {
            Self::Radial(nodes, _) => Some(nodes),
            _ => None,
        }
    }

    fn radial(nodes: Radial, sides: &[DVec2; SIDES]) -> Self {
        let spans = Spans::new(&nodes, sides);
        Self::Radial(nodes, spans)
    }
}

impl ExitPupil {
    /// Measures the pupil for film points up to `film_radius` from the film's middle.
    pub fn new(lens: &Lens, place: &FilmPlace, film_radius: f64) -> Self {
        let sides = directions_along(lens.iris_edges());
        let film_radius = film_radius.abs();
        let sight = Sight::new(lens);
        let look = Look {
            sight: &sight,
            place,
            sides: &sides,
            outward: RefCell::default(),
        };
        let everything = || reach_of(lens, place, film_radius);
        let is_even = place.is_centered() && lens.is_rotational();
        let mut end = f64::INFINITY;
        let table = if is_even {
            let mut measure = |r, hint: Option<&Hint>| look.at_radius(r, hint);
            let nodes = radial_table(&mut measure, film_radius, everything);
            end = nodes.last().map_or(0.0, |(radius, _)| *radius);
            Table::radial(nodes, &sides)
        } else {
            Table::Cells(Box::new(Cells::new(lens, place, &sides, film_radius)))
        };
        let mut this = Self {
            table,
            sides,
            beside: None,
        };
        let is_aimed_at = |radius, aim| this.window(DVec2::new(radius, 0.0)).contains(aim);
        let strays = look.strays(film_radius, is_even, is_aimed_at);
        let goes_on = strays.is_some_and(|[_, to]| to > end) || look.opens_again(end, film_radius);
        let alone = goes_on.then(|| look.alone(end, film_radius)).flatten();
        // Elsewhere only one row of film points was looked at.
        let all = Some([0.0, f64::INFINITY]).filter(|_| !is_even && strays.is_some());
        let alone = all.or(alone);
        let range = [all, strays, alone].into_iter().flatten().reduce(both);
        this.beside = range.map(|range| Beside {
            radius: everything(),
            range,
            alone,
        });
        this
    }

    /// The pupil that holds those of several wavelengths of one lens and film, from one end to
    /// the other, and all between them.
    pub fn around(pupils: &[&Self; 3]) -> Self {
        let sides = pupils[1].sides;
        let nodes: Option<Vec<&Radial>> = pupils.iter().map(|pupil| pupil.table.nodes()).collect();
        let table = match nodes {
            Some(nodes) => Table::radial(radial_around(&nodes), &sides),
            None => Table::Around(pupils.map(|pupil| Box::new(pupil.clone()))),
        };
        let beside = pupils.iter().filter_map(|pupil| pupil.beside);
        let of_both = |a: Beside, b: Beside| Beside {
            radius: a.radius.max(b.radius),
            range: both(a.range, b.range),
            alone: [a.alone, b.alone].into_iter().flatten().reduce(both),
        };
        Self {
            table,
            sides,
            beside: beside.reduce(of_both),
        }
    }

    /// What a film point, in millimeters from the film's middle, aims at.
    pub fn window(&self, film: DVec2) -> PupilWindow<'_> {
        if let Table::Radial(_, spans) = &self.table {
            return self.opened(spans.window(film), film);
        }
        self.figure(film)
            .map_or(self.opened(None, film), |figure| self.placed(&figure, film))
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
            Table::Cells(cells) => cells.figure(film),
            Table::Around(pupils) => {
                let figures = pupils.each_ref().map(|pupil| pupil.figure(film));
                let supports = figures.each_ref().map(|f| f.as_ref().map(|f| f.support));
                let support = support_around(&supports)?;
                let any = figures.into_iter().flatten().next()?;
                Some(Figure { support, ..any })
            }
        }
    }

    fn placed(&self, figure: &Figure, film: DVec2) -> PupilWindow<'static> {
        let outline = Outline::of(&figure.support, &self.sides);
        let polygon = Polygon::whole(outline, figure.turn, figure.mirror);
        self.opened(polygon, film)
    }

    fn opened<'a>(&self, polygon: Option<Polygon<'a>>, film: DVec2) -> PupilWindow<'a> {
        let beside = self.beside.filter(|beside| {
            let range = polygon.map_or(beside.alone, |_| Some(beside.range));
            range.is_some_and(|[from, to]| (from..=to).contains(&film.length()))
        });
        match (polygon, beside) {
            (Some(polygon), Some(beside)) => PupilWindow::Beside(polygon, beside.radius),
            (None, Some(beside)) => disc(beside.radius),
            (Some(polygon), None) => PupilWindow::Polygon(polygon),
            (None, None) => PupilWindow::Closed,
        }
    }
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

/// What holds the pupils of several wavelengths as seen from one film point, and those between.
fn support_around(supports: &[Option<Support>]) -> Option<Support> {
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
fn radial_around(tables: &[&Radial]) -> Radial {
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

/// Measures what points of a film see.
struct Look<'a> {
    sight: &'a Sight<'a>,
    place: &'a FilmPlace,
    sides: &'a [DVec2; SIDES],
    /// What was seen from film points of (radius, 0).
    outward: RefCell<Vec<(f64, Option<Seen>)>>,
}

impl Look<'_> {
    fn at(&self, point: DVec3, hint: Option<&Hint>) -> Option<Seen> {
        self.sight.seen(point, self.sides, hint)
    }

    fn at_radius(&self, radius: f64, hint: Option<&Hint>) -> Option<Seen> {
        let known = |(r, seen): &(f64, Option<Seen>)| (*r == radius).then_some(*seen);
        if let Some(seen) = self.outward.borrow().iter().find_map(known) {
            return seen;
        }
        let seen = self.at(self.place.point(DVec2::new(radius, 0.0)), hint);
        self.outward.borrow_mut().push((radius, seen));
        seen
    }

    /// Whether there is light again beyond the end of a table.
    fn opens_again(&self, end: f64, film_radius: f64) -> bool {
        let known = |r: &f64, seen: &Option<Seen>| *r > end && seen.is_some();
        let mut again = self.outward.borrow().iter().any(|(r, s)| known(r, s));
        let step = (film_radius - end) / CLOSER as f64;
        again |= step > 0.0
            && (1..=CLOSER).any(|i| {
                let point = DVec2::new(end + i as f64 * step, 0.0);
                self.at(self.place.point(point), None).is_some()
            });
        again
    }

    /// The film radii beyond the end of a table that see light anywhere, by a closer row of film
    /// points and what is between them.
    fn alone(&self, end: f64, film_radius: f64) -> Option<[f64; 2]> {
        let step = (film_radius - end) / CLOSER as f64;
        let point = |radius: f64| {
            let beyond = radius > end && radius <= film_radius;
            beyond.then(|| self.place.point(DVec2::new(radius, 0.0)))
        };
        let slopes = self.outward.borrow();
        let slopes = slopes
            .iter()
            .filter_map(|(_, seen)| Some(seen.as_ref()?.hint.slope()));
        let slope = slopes.fold(0.0, f64::max);
        let slope = if slope > 0.0 { slope } else { f64::INFINITY };
        let mut lit = None;
        for i in 1..=CLOSER {
            let radius = end + i as f64 * step;
            let film = self.place.point(DVec2::new(radius, 0.0));
            let mut found = self
                .sight
                .strays(film, None, self.sides, slope, NEARLY_THROUGH);
            found.sort_by(|a, b| a.1.total_cmp(&b.1));
            // What comes nearest to light is first to see some from beside.
            for (aim, fill) in found.into_iter().take(2) {
                let start = (radius, aim);
                let (there, least) = match fill < 1.0 {
                    true => (start, fill),
                    false => self.sight.least_around(start, step, &point, &|_, _| true),
                };
                if least < 1.0 {
                    let near = [there.0 - step, there.0 + step];
                    lit = Some(lit.map_or(near, |lit| both(lit, near)));
                    break;
                }
            }
        }
        lit
    }

    /// Whether there is light beside the pupil, from film points in a row from the middle outward.
    /// Where there nearly is any, the film point is moved until there is, or can't be. If there
    /// is, the film radii that see any.
    fn strays(
        &self,
        film_radius: f64,
        is_even: bool,
        is_aimed_at: impl Fn(f64, DVec2) -> bool,
    ) -> Option<[f64; 2]> {
        let searches = SEARCHES * self.sight.grid;
        let step = film_radius / searches as f64;
        let mut last = [None; 2];
        let row: Vec<Option<Seen>> = (0..=searches)
            .map(|i| {
                let radius = film_radius * i as f64 / searches as f64;
                let seen = self.at_radius(radius, next(last).as_ref());
                last = [last[1], seen.map(|seen| seen.hint)];
                seen.map(|seen| Seen {
                    support: widened(&seen.support, MARGIN),
                    ..seen
                })
            })
            .collect();
        let point = |radius: f64| {
            let on_film = (0.0..=film_radius).contains(&radius);
            on_film.then(|| self.place.point(DVec2::new(radius, 0.0)))
        };
        let outside = |radius: f64, aim: DVec2| {
            let i = ((radius / step) as usize).min(searches - 1);
            let mut near = row[i..i + 2].iter().flatten();
            near.all(|seen| is_outside(aim, &seen.support, self.sides))
        };
        let (mut from, mut to, mut is_light) = (f64::INFINITY, f64::NEG_INFINITY, false);
        let mut slope = f64::INFINITY;
        for (i, seen) in row.iter().enumerate() {
            let radius = film_radius * i as f64 / searches as f64;
            let film = self.place.point(DVec2::new(radius, 0.0));
            // A film that is moved reaches far beyond the field: nothing is left out there.
            if let (Some(seen), true) = (seen, is_even) {
                slope = seen.hint.slope();
            }
            let found = self
                .sight
                .strays(film, seen.as_ref(), self.sides, slope, NEARLY_THROUGH);
            for (aim, fill) in found {
                (from, to) = (from.min(radius), to.max(radius));
                let is_there = || {
                    let start = (radius, aim);
                    let ((radius, aim), least) =
                        self.sight.least_around(start, step, &point, &outside);
                    // Behind a ridge it is not the pupil; past its end it may be.
                    least < THROUGH && (seen.is_some() || least < 1.0 && !is_aimed_at(radius, aim))
                };
                is_light = is_light || fill < 1.0 || is_there();
            }
        }
        let around = 2.0 * film_radius / SEARCHES as f64;
        is_light.then_some([from - around, to + around])
    }
}

/// How far from the axis a ray through the rear surface may cross the rear vertex plane: through
/// the rim, from the farthest film point.
fn reach_of(lens: &Lens, place: &FilmPlace, film_radius: f64) -> f64 {
    let rear = RearElement::of(lens, DiscMap::Concentric).radius;
    let film = |k: i32| place.point(film_radius * DVec2::from_angle(TAU * f64::from(k) / 64.0));
    let (mut near, mut far) = (place.point(DVec2::ZERO).z, 0.0f64);
    for point in (0..64).map(film) {
        (near, far) = (near.min(point.z), far.max(point.truncate().length()));
    }
    // The part of the way from the rim to the film point at which the vertex plane is crossed.
    let sag = lens
        .prescription()
        .surfaces
        .last()
        .map_or(0.0, |s| s.sag(rear));
    let t = sag / (sag - (near - lens.length()));
    let reach = match t < 1.0 {
        true => (1.0 - t).abs() * rear + t.abs() * far,
        false => rear,
    };
    reach.clamp(rear, 100.0 * rear) * (1.0 + MARGIN)
}

/// Where to begin behind two in a row.
fn next(last: [Option<Hint>; 2]) -> Option<Hint> {
    match last {
        [Some(a), Some(b)] => Some(Hint::beyond(&a, &b)),
        [_, b] => b,
    }
}

/// Measured supports by film radius: halved where interpolation errs, ended where light ends.
fn radial_table(
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
