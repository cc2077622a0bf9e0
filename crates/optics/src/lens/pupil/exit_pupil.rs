//! The exit pupil as seen from every film point. It is measured from some film points and
//! interpolated between them.

use glam::DVec2;

use crate::lens::lens::Lens;
use crate::lens::optics::film_place::FilmPlace;
use crate::lens::pupil::polar::Cells;
use crate::lens::pupil::polygon::Polygon;
use crate::lens::pupil::radial::{Radial, radial_around, radial_table};
use crate::lens::pupil::rear_element::reach_of;
use crate::lens::pupil::sampler::{PupilSampler, union};
use crate::lens::pupil::search::outline::OutlineGuess;
use crate::lens::pupil::search::pupil_search::PupilSearch;
use crate::lens::pupil::sides::{SIDES, directions_along};
use crate::lens::pupil::spans::Spans;
use crate::lens::pupil::window::{PupilWindow, disc};

/// The part of the rear vertex plane through which light reaches each film point, and a margin.
///
/// The outline of the pupil is measured from a row of film points, as its support in 32 directions,
/// and interpolated between them. The row is refined until the interpolation error is below a
/// bound. Without rotational symmetry the film is divided into cells around the axis (`Cells`).
///
/// If a beam is folded inside the lens, light may come through several openings, which open and
/// close as the film point moves. For such a lens the largest opening is interpolated, and a few
/// rays are aimed anywhere in a disc that contains the rear element, so that every ray that gets
/// through has a density above 0.
#[derive(Clone, Debug)]
pub struct ExitPupil {
    pub(super) table: Table,
    sides: [DVec2; SIDES],
    pub(super) stray_region: Option<StrayRegion>,
}

/// The film radii from which light may come through secondary openings, and the part of the rear
/// vertex plane that contains them.
#[derive(Clone, Copy, Debug)]
pub(super) struct StrayRegion {
    /// The radius, in millimeters, of the disc on the rear vertex plane that contains all openings.
    disc: f64,
    /// The range of film radii, in millimeters, that such light may reach.
    radii: [f64; 2],
    /// The range of film radii from which rays are aimed at the disc where the table has no pupil.
    dark_radii: Option<[f64; 2]>,
}

/// The measured pupils.
#[derive(Clone, Debug)]
pub(super) enum Table {
    /// The pupils by film radius, for a lens and a film with rotational symmetry.
    Radial(Radial, Spans),
    /// The pupils by film position, for a lens or a film without rotational symmetry.
    Cells(Box<Cells>),
}

impl Table {
    /// The outlines by film radius; none without rotational symmetry.
    fn nodes(&self) -> Option<&Radial> {
        match self {
            Self::Radial(nodes, _) => Some(nodes),
            Self::Cells(_) => None,
        }
    }

    /// The outlines by film position; none with rotational symmetry.
    fn cells(&self) -> Option<&Cells> {
        match self {
            Self::Cells(cells) => Some(cells),
            Self::Radial(..) => None,
        }
    }

    fn radial(nodes: Radial, sides: &[DVec2; SIDES]) -> Self {
        let spans = Spans::new(&nodes, sides);
        Self::Radial(nodes, spans)
    }
}

impl ExitPupil {
    /// Measures the pupil for film points up to `film_radius`, in millimeters, from the film's
    /// middle.
    pub fn new(lens: &Lens, place: &FilmPlace, film_radius: f64) -> Self {
        let sides = directions_along(lens.iris_edges());
        let film_radius = film_radius.abs();
        let search = PupilSearch::new(lens);
        let sampler = PupilSampler::new(&search, place, &sides);
        let disc_radius = || reach_of(lens, place, film_radius);
        let is_rotational = place.is_centered() && lens.is_rotational();
        let mut end = f64::INFINITY;
        let table = if is_rotational {
            let mut measure = |r, guess: Option<&OutlineGuess>| sampler.at_radius(r, guess);
            let nodes = radial_table(&mut measure, film_radius, disc_radius);
            end = nodes.last().map_or(0.0, |(radius, _)| *radius);
            Table::radial(nodes, &sides)
        } else {
            Table::Cells(Box::new(Cells::new(lens, place, &sides, film_radius)))
        };
        let mut this = Self {
            table,
            sides,
            stray_region: None,
        };
        let is_aimed_at = |radius, aim| this.window(DVec2::new(radius, 0.0)).contains(aim);
        let lit = sampler.stray_radii(film_radius, is_rotational, is_aimed_at);
        let continues =
            lit.is_some_and(|[_, to]| to > end) || sampler.opens_again(end, film_radius);
        let beyond = continues
            .then(|| sampler.lit_beyond(end, film_radius))
            .flatten();
        // Without rotational symmetry the film points of one row do not represent the others.
        let all = (!is_rotational && lit.is_some()).then_some([0.0, f64::INFINITY]);
        let dark_radii = all.or(beyond);
        let radii = [all, lit, dark_radii].into_iter().flatten().reduce(union);
        this.stray_region = radii.map(|radii| StrayRegion {
            disc: disc_radius(),
            radii,
            dark_radii,
        });
        this
    }

    /// The smallest pupil that contains those of three wavelengths of one lens and film, with room
    /// for all wavelengths between them.
    pub fn around(pupils: &[&Self; 3]) -> Self {
        let sides = pupils[1].sides;
        let nodes: Option<Vec<&Radial>> = pupils.iter().map(|pupil| pupil.table.nodes()).collect();
        let cells: Option<Vec<&Cells>> = pupils.iter().map(|pupil| pupil.table.cells()).collect();
        // All tables are of one kind, because the lenses differ in their indices alone.
        let table = match (nodes, cells) {
            (_, Some(cells)) => Table::Cells(Box::new(Cells::around(&cells))),
            (nodes, None) => Table::radial(radial_around(&nodes.unwrap_or_default()), &sides),
        };
        let stray_regions = pupils.iter().filter_map(|pupil| pupil.stray_region);
        let merge = |a: StrayRegion, b: StrayRegion| StrayRegion {
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
            stray_region: stray_regions.reduce(merge),
        }
    }

    /// The window at which rays from a film point, in millimeters from the film's middle, are
    /// aimed.
    pub fn window(&self, film: DVec2) -> PupilWindow<'_> {
        let polygon = match &self.table {
            Table::Radial(_, spans) => spans.window(film),
            Table::Cells(cells) => cells.locate(film).as_ref().and_then(Polygon::within),
        };
        self.with_stray_region(polygon, film)
    }

    /// The window of a polygon, extended by the stray region if the film point lies in its radii.
    fn with_stray_region<'a>(&self, polygon: Option<Polygon<'a>>, film: DVec2) -> PupilWindow<'a> {
        let region = self.stray_region.filter(|region| {
            let radii = polygon.map_or(region.dark_radii, |_| Some(region.radii));
            radii.is_some_and(|[from, to]| (from..=to).contains(&film.length()))
        });
        match (polygon, region) {
            (Some(polygon), Some(region)) => PupilWindow::Defensive(polygon, region.disc),
            (None, Some(region)) => disc(region.disc),
            (Some(polygon), None) => PupilWindow::Polygon(polygon),
            (None, None) => PupilWindow::Closed,
        }
    }
}
