//! The part of the rear vertex plane that contains secondary openings, and the film radii that
//! light may reach through them.

use glam::DVec2;

use crate::lens::pupil::film_row::FilmRow;

/// The number of intervals of the film's radius between the film points from which secondary
/// openings are searched. It is multiplied by
/// [`PupilSearch::grid`](crate::lens::pupil::search::pupil_search::PupilSearch::grid), and its cost
/// is proportional to it. With it and the thresholds below, 2 of 8,343 random lenses lost some of
/// their rays (docs/decisions/0011-measuring-a-pupil.md).
const SEARCHES: usize = 16;
/// The number of film points beyond the end of a table from which light is searched again. The cost
/// is proportional to it. The record is that of [`SEARCHES`].
const SEARCHES_BEYOND: usize = 16;
/// The number of surfaces up to which secondary openings are searched. The rays of a search grow
/// with the third power of the number of surfaces, and the time with the fourth. A lens of more
/// surfaces, which no known camera has, is taken to have such openings everywhere: of its rays 2.5%
/// are aimed at the disc, and all where the table has no pupil.
const MAX_SURFACES: usize = 112;
/// A ray whose fill is below this may get through from a neighboring film point, so the film point
/// is moved. A larger value costs more of these searches, and a smaller one misses openings between
/// film points. The record is that of [`SEARCHES`].
const NEARLY_THROUGH: f64 = 1.2;
/// A fill that the search lowers to less than this is regarded as that of a ray that gets through:
/// the search may end 1% above the minimum. A larger value finds secondary openings where there are
/// none, which costs 2.5% of the rays there and no bias (docs/decisions/0011-measuring-a-pupil.md).
const THROUGH: f64 = 1.01;

/// The film radii from which light may come through secondary openings, and the part of the rear
/// vertex plane that contains them.
#[derive(Clone, Copy, Debug)]
pub(super) struct SecondaryRegion {
    /// The radius, in millimeters, of the disc on the rear vertex plane that contains all openings.
    pub disc: f64,
    /// The range of film radii, in millimeters, that such light may reach.
    radii: [f64; 2],
    /// The range of film radii from which rays are aimed at the disc where the table has no pupil.
    dark_radii: Option<[f64; 2]>,
}

impl SecondaryRegion {
    /// Searches for secondary openings from the film points of a row; none if no light comes
    /// through any. The openings of a lens of more than [`MAX_SURFACES`] may be anywhere. `end` is
    /// the film radius at which a table over the film's radius ends, and none without rotational
    /// symmetry. `disc` returns the radius of a disc that contains all openings. `is_aimed_at`
    /// tells whether the polygon of a film radius contains an aim.
    pub(super) fn find(
        row: &FilmRow<'_>,
        end: Option<f64>,
        disc: impl Fn() -> f64,
        is_aimed_at: impl Fn(f64, DVec2) -> bool,
    ) -> Option<Self> {
        if row.search.surfaces() > MAX_SURFACES {
            let everywhere = [0.0, f64::INFINITY];
            return Some(Self {
                disc: disc(),
                radii: everywhere,
                dark_radii: Some(everywhere),
            });
        }
        let lit = row.lit_through_secondary_openings(end.is_some(), is_aimed_at);
        let continues = |end: &f64| lit.is_some_and(|[_, to]| to > *end) || row.is_lit_beyond(*end);
        let beyond = end
            .filter(continues)
            .and_then(|end| row.lit_radii_beyond(end));
        // Without rotational symmetry the film points of one row do not represent the others.
        let all = (end.is_none() && lit.is_some()).then_some([0.0, f64::INFINITY]);
        let dark_radii = all.or(beyond);
        let radii = [all, lit, dark_radii].into_iter().flatten().reduce(union)?;
        Some(Self {
            disc: disc(),
            radii,
            dark_radii,
        })
    }

    /// The region that contains two.
    pub(super) fn merge(a: Self, b: Self) -> Self {
        let dark_radii = [a.dark_radii, b.dark_radii];
        Self {
            disc: a.disc.max(b.disc),
            radii: union(a.radii, b.radii),
            dark_radii: dark_radii.into_iter().flatten().reduce(union),
        }
    }

    /// Whether rays from a film radius are aimed at the disc. `is_dark` says whether the table has
    /// no pupil there.
    pub(super) fn is_seen_from(&self, radius: f64, is_dark: bool) -> bool {
        let radii = if is_dark {
            self.dark_radii
        } else {
            Some(self.radii)
        };
        radii.is_some_and(|[from, to]| (from..=to).contains(&radius))
    }
}

impl FilmRow<'_> {
    /// The distance between the film points beyond the end of a table, in millimeters.
    fn step_beyond(&self, end: f64) -> f64 {
        (self.film_radius - end) / SEARCHES_BEYOND as f64
    }

    /// The film radii beyond the end of a table from which light is searched.
    fn radii_beyond(&self, end: f64) -> impl Iterator<Item = f64> {
        let step = self.step_beyond(end);
        (1..=SEARCHES_BEYOND).map(move |i| end + i as f64 * step)
    }

    /// Whether light reaches a film point between the end of a table and the film's radius.
    fn is_lit_beyond(&self, end: f64) -> bool {
        let is_lit = |radius| self.search.find_outline(self.point(radius), None).is_some();
        self.measured().iter().any(|(radius, _)| *radius > end)
            || self.step_beyond(end) > 0.0 && self.radii_beyond(end).any(is_lit)
    }

    /// The range of film radii beyond the end of a table that any light reaches; none if no light
    /// was found. Secondary openings are searched from the film points and between them.
    fn lit_radii_beyond(&self, end: f64) -> Option<[f64; 2]> {
        let step = self.step_beyond(end);
        let film_point = |radius: f64| {
            let beyond = radius > end && radius <= self.film_radius;
            beyond.then(|| self.point(radius))
        };
        let measured = self.measured();
        let slopes = measured.iter().map(|(_, outline)| outline.guess.slope());
        let slope = slopes.fold(0.0, f64::max);
        let slope = if slope > 0.0 { slope } else { f64::INFINITY };
        let lit_near = |radius: f64| {
            let film = self.point(radius);
            let search = self.search;
            let mut found = search.secondary_openings(film, None, slope, NEARLY_THROUGH);
            found.sort_by(|a, b| a.1.total_cmp(&b.1));
            // The two aims of least fill are the likeliest to get through from a neighboring point.
            found.into_iter().take(2).find_map(|(aim, fill)| {
                let start = (radius, aim);
                let ((there, _), least) = match fill < 1.0 {
                    true => (start, fill),
                    false => search.least_around(start, step, &film_point, &|_, _| true),
                };
                (least < 1.0).then_some([there - step, there + step])
            })
        };
        self.radii_beyond(end).filter_map(lit_near).reduce(union)
    }

    /// The range of film radii that light reaches through secondary openings; none if no light was
    /// found.
    ///
    /// The openings are searched from film points from the middle outward. Where a ray nearly gets
    /// through, the film point is moved until it does, or until the fill has reached a minimum.
    fn lit_through_secondary_openings(
        &self,
        is_rotational: bool,
        is_aimed_at: impl Fn(f64, DVec2) -> bool,
    ) -> Option<[f64; 2]> {
        let searches = SEARCHES * self.search.grid;
        let step = self.film_radius / searches as f64;
        let row = self.widened_outlines(searches);
        let film_point = |radius: f64| {
            let on_film = (0.0..=self.film_radius).contains(&radius);
            on_film.then(|| self.point(radius))
        };
        let outside = |radius: f64, aim: DVec2| {
            let i = ((radius / step) as usize).min(searches - 1);
            let mut near = row[i..i + 2]
                .iter()
                .filter_map(|(_, outline)| outline.as_ref());
            near.all(|outline| outline.support.is_outside(aim, &self.search.normals))
        };
        let (mut range, mut is_light) = (None, false);
        let mut slope = f64::INFINITY;
        for (radius, outline) in &row {
            let (film, outline) = (self.point(*radius), outline.as_ref());
            // A film that is moved may reach far beyond the field, where the slopes are no guide:
            // no ray is dropped there.
            if let (Some(outline), true) = (outline, is_rotational) {
                slope = outline.guess.slope();
            }
            let search = self.search;
            for (aim, fill) in search.secondary_openings(film, outline, slope, NEARLY_THROUGH) {
                range = Some(range.map_or([*radius; 2], |range| union(range, [*radius; 2])));
                let is_there = || {
                    let start = (*radius, aim);
                    let ((radius, aim), least) =
                        search.least_around(start, step, &film_point, &outside);
                    // A ridge of the fill separates a secondary opening from an open pupil. Where
                    // the pupil has closed, the aim may lie in the pupil of a neighboring film
                    // point.
                    let is_separate = outline.is_some();
                    least < THROUGH && (is_separate || least < 1.0 && !is_aimed_at(radius, aim))
                };
                is_light = is_light || fill < 1.0 || is_there();
            }
        }
        let around = 2.0 * self.film_radius / SEARCHES as f64;
        range
            .filter(|_| is_light)
            .map(|[from, to]| [from - around, to + around])
    }
}

/// The smallest range that contains two.
fn union([a, b]: [f64; 2], [c, d]: [f64; 2]) -> [f64; 2] {
    [a.min(c), b.max(d)]
}
