//! The exit pupil from every film point, measured from some and interpolated between them.

use glam::DVec2;

use crate::lens::lens::Lens;
use crate::lens::optics::film_place::FilmPlace;
use crate::lens::pupil::polar::Cells;
use crate::lens::pupil::polygon::{Outline, Polygon, SIDES, directions_along};
use crate::lens::pupil::radial::{Radial, radial_around, radial_at, radial_table, support_around};
use crate::lens::pupil::rear_element::reach_of;
use crate::lens::pupil::sampler::{PupilSampler, union};
use crate::lens::pupil::search::outline::OutlineGuess;
use crate::lens::pupil::search::pupil_search::PupilSearch;
use crate::lens::pupil::spans::Spans;
use crate::lens::pupil::support::Figure;
use crate::lens::pupil::window::{PupilWindow, disc};

/// The part of the rear vertex plane through which light reaches each film point, and a margin.
///
/// From a row of film points the outline of the pupil is measured, as its reach in 32 directions, and
/// interpolated between them; the row is refined until interpolation holds. Without rotational
/// symmetry the film is divided into cells around the axis ([`Cells`]).
///
/// If a beam is folded inside the lens, light may come through several openings, which open and close
/// as the film point moves. For such a lens the largest opening is interpolated, and a few rays go
/// anywhere behind the rear element, so that every ray that gets through may be drawn.
#[derive(Clone, Debug)]
pub struct ExitPupil {
    pub(super) table: Table,
    sides: [DVec2; SIDES],
    pub(super) strays: Option<StrayRegion>,
}

/// Where light may come through secondary openings.
#[derive(Clone, Copy, Debug)]
pub(super) struct StrayRegion {
    /// The radius of the disc on the rear vertex plane that contains them.
    disc: f64,
    /// The film radii that such light may reach.
    radii: [f64; 2],
    /// The film radii that such light may reach and that have no pupil otherwise.
    dark_radii: Option<[f64; 2]>,
}

#[derive(Clone, Debug)]
pub(super) enum Table {
    Radial(Radial, Spans),
    /// By film position, without rotational symmetry.
    Cells(Box<Cells>),
    /// Around the pupils of neighboring wavelengths.
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
        let search = PupilSearch::new(lens);
        let sampler = PupilSampler::new(&search, place, &sides);
        let everything = || reach_of(lens, place, film_radius);
        let is_even = place.is_centered() && lens.is_rotational();
        let mut end = f64::INFINITY;
        let table = if is_even {
            let mut measure = |r, guess: Option<&OutlineGuess>| sampler.at_radius(r, guess);
            let nodes = radial_table(&mut measure, film_radius, everything);
            end = nodes.last().map_or(0.0, |(radius, _)| *radius);
            Table::radial(nodes, &sides)
        } else {
            Table::Cells(Box::new(Cells::new(lens, place, &sides, film_radius)))
        };
        let mut this = Self {
            table,
            sides,
            strays: None,
        };
        let is_aimed_at = |radius, aim| this.window(DVec2::new(radius, 0.0)).contains(aim);
        let lit = sampler.stray_radii(film_radius, is_even, is_aimed_at);
        let continues =
            lit.is_some_and(|[_, to]| to > end) || sampler.opens_again(end, film_radius);
        let beyond = continues
            .then(|| sampler.lit_beyond(end, film_radius))
            .flatten();
        // Without symmetry the row of film points does not speak for the others.
        let all = Some([0.0, f64::INFINITY]).filter(|_| !is_even && lit.is_some());
        let dark_radii = all.or(beyond);
        let radii = [all, lit, dark_radii].into_iter().flatten().reduce(union);
        this.strays = radii.map(|radii| StrayRegion {
            disc: everything(),
            radii,
            dark_radii,
        });
        this
    }

    /// The pupil that contains those of three wavelengths of one lens and film, and of all
    /// wavelengths between them.
    pub fn around(pupils: &[&Self; 3]) -> Self {
        let sides = pupils[1].sides;
        let nodes: Option<Vec<&Radial>> = pupils.iter().map(|pupil| pupil.table.nodes()).collect();
        let table = match nodes {
            Some(nodes) => Table::radial(radial_around(&nodes), &sides),
            None => Table::Around(pupils.map(|pupil| Box::new(pupil.clone()))),
        };
        let strays = pupils.iter().filter_map(|pupil| pupil.strays);
        let of_both = |a: StrayRegion, b: StrayRegion| StrayRegion {
            disc: a.disc.max(b.disc),
            radii: union(a.radii, b.radii),
            dark_radii: [a.dark_radii, b.dark_radii]
                .into_iter()
                .flatten()
                .reduce(union),
        };
        Self {
            table,
            sides,
            strays: strays.reduce(of_both),
        }
    }

    /// The window that rays from a film point, in millimeters from the film's middle, are aimed at.
    pub fn window(&self, film: DVec2) -> PupilWindow<'_> {
        if let Table::Radial(_, spans) = &self.table {
            return self.with_strays(spans.window(film), film);
        }
        self.figure(film)
            .map_or(self.with_strays(None, film), |figure| {
                self.window_of(&figure, film)
            })
    }

    /// The figure of the pupil from a film point; none if no light reaches it.
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

    fn window_of(&self, figure: &Figure, film: DVec2) -> PupilWindow<'static> {
        let outline = Outline::of(&figure.support, &self.sides);
        let polygon = Polygon::whole(outline, figure.turn, figure.mirror);
        self.with_strays(polygon, film)
    }

    /// The window of a polygon, opened to secondary openings where there are any.
    fn with_strays<'a>(&self, polygon: Option<Polygon<'a>>, film: DVec2) -> PupilWindow<'a> {
        let strays = self.strays.filter(|strays| {
            let radii = polygon.map_or(strays.dark_radii, |_| Some(strays.radii));
            radii.is_some_and(|[from, to]| (from..=to).contains(&film.length()))
        });
        match (polygon, strays) {
            (Some(polygon), Some(strays)) => PupilWindow::Defensive(polygon, strays.disc),
            (None, Some(strays)) => disc(strays.disc),
            (Some(polygon), None) => PupilWindow::Polygon(polygon),
            (None, None) => PupilWindow::Closed,
        }
    }
}
