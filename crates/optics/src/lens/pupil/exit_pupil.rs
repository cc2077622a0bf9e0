//! The exit pupil as seen from every film point. It is measured from some film points and
//! interpolated between them.

use glam::DVec2;

use crate::lens::lens::Lens;
use crate::lens::optics::film_place::FilmPlace;
use crate::lens::pupil::film_row::FilmRow;
use crate::lens::pupil::polar_table::PolarTable;
use crate::lens::pupil::polygon::PupilPolygon;
use crate::lens::pupil::radial_table::RadialTable;
use crate::lens::pupil::rear_element::reach_of;
use crate::lens::pupil::search::pupil_search::PupilSearch;
use crate::lens::pupil::secondary_region::SecondaryRegion;
use crate::lens::pupil::window::{PupilWindow, disc};

/// The part of the rear vertex plane through which light reaches each film point, and a margin.
///
/// The outline of the pupil is measured from some film points, as its support in 32 directions, and
/// interpolated between them.
///
/// If a beam is folded inside the lens, light may come through several openings, which open and
/// close as the film point moves. For such a lens the largest opening is interpolated, and a few
/// rays are aimed anywhere in a disc that contains the rear element, so that every ray that gets
/// through has a density above 0.
#[derive(Clone, Debug)]
pub struct ExitPupil {
    pub(super) table: ExitPupilTable,
    /// Where secondary openings may be.
    pub(super) secondary: Option<SecondaryRegion>,
}

/// The measured pupils. A lens has one table, so that a table of the smaller kind needs no box.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug)]
pub(super) enum ExitPupilTable {
    /// The pupils by film radius, for a lens and a film with rotational symmetry.
    Radial(RadialTable),
    /// The pupils by film position, for a lens or a film without rotational symmetry.
    Polar(Box<PolarTable>),
}

impl ExitPupilTable {
    /// The polygon at which rays from a film point are aimed; none if no light reaches it.
    fn polygon(&self, film: DVec2) -> Option<PupilPolygon<'_>> {
        match self {
            Self::Radial(table) => PupilPolygon::radial(table, film),
            Self::Polar(table) => PupilPolygon::polar(table, film),
        }
    }
}

impl ExitPupil {
    /// Measures the pupil for film points up to `film_radius`, in millimeters, from the film's
    /// middle.
    pub fn new(lens: &Lens, place: &FilmPlace, film_radius: f64) -> Self {
        let film_radius = film_radius.abs();
        let search = PupilSearch::new(lens);
        let row = FilmRow::new(&search, place, film_radius);
        let disc = || reach_of(lens, place, film_radius);
        let (table, end) = if place.is_centered() && lens.is_rotational() {
            let table = RadialTable::measure(&row, disc);
            let end = table.end();
            (ExitPupilTable::Radial(table), Some(end))
        } else {
            let table = PolarTable::new(lens, place, film_radius);
            (ExitPupilTable::Polar(Box::new(table)), None)
        };
        let is_aimed_at = |radius, aim| {
            let polygon = table.polygon(DVec2::new(radius, 0.0));
            polygon.is_some_and(|polygon| polygon.contains(aim))
        };
        let secondary = SecondaryRegion::find(&row, end, disc, is_aimed_at);
        Self { table, secondary }
    }

    /// The smallest pupil that contains those of three wavelengths of one lens and film, with room
    /// for all wavelengths between them.
    pub fn around(pupils: &[&Self; 3]) -> Self {
        let (mut radial, mut polar) = (Vec::new(), Vec::new());
        for pupil in pupils {
            match &pupil.table {
                ExitPupilTable::Radial(table) => radial.push(table),
                ExitPupilTable::Polar(table) => polar.push(&**table),
            }
        }
        // All tables are of one kind, because the lenses differ in their indices alone.
        let table = match polar.is_empty() {
            true => ExitPupilTable::Radial(RadialTable::around(&radial)),
            false => ExitPupilTable::Polar(Box::new(PolarTable::around(&polar))),
        };
        let regions = pupils.iter().filter_map(|pupil| pupil.secondary);
        Self {
            table,
            secondary: regions.reduce(SecondaryRegion::merge),
        }
    }

    /// The window at which rays from a film point, in millimeters from the film's middle, are
    /// aimed.
    pub fn window(&self, film: DVec2) -> PupilWindow<'_> {
        let polygon = self.table.polygon(film);
        let is_seen =
            |region: &SecondaryRegion| region.is_seen_from(film.length(), polygon.is_none());
        match (polygon, self.secondary.filter(is_seen)) {
            (Some(polygon), Some(region)) => PupilWindow::Defensive(polygon, region.disc),
            (None, Some(region)) => disc(region.disc),
            (Some(polygon), None) => PupilWindow::Polygon(polygon),
            (None, None) => PupilWindow::Closed,
        }
    }
}
