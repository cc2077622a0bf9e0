//! The exit pupil as each film point sees it, measured once and interpolated.

use glam::DVec2;

use super::polar::Cells;
use super::polygon::{Outline, Polygon, SIDES, directions_along};
use super::radial::{Radial, radial_around, radial_at, radial_table, support_around};
use super::rear_element::reach_of;
use super::sampler::{Look, both};
use super::search::outline::Hint;
use super::search::pupil_search::Sight;
use super::spans::Spans;
use super::support::Figure;
use super::window::{PupilWindow, disc};
use crate::lens::lens::Lens;
use crate::lens::optics::film_place::FilmPlace;

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
    pub(super) table: Table,
    sides: [DVec2; SIDES],
    pub(super) beside: Option<Beside>,
}

/// Where light may come from beside the figure.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beside {
    /// The radius of the disc on the rear vertex plane.
    radius: f64,
    /// Film radii that may see some beside a figure.
    range: [f64; 2],
    /// Film radii that may see some and have no figure.
    alone: Option<[f64; 2]>,
}

#[derive(Clone, Debug)]
pub(super) enum Table {
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
        let look = Look::new(&sight, place, &sides);
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
