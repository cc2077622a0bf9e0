//! Where on the lens to aim a ray from a film point.
//!
//! Every target gives points of the plane through the rear vertex, over which equation 1 of the
//! paper (Kolb, Mitchell and Hanrahan, 1995) integrates, with their density per square millimeter.
//! A ray aimed there may still be lost; it then counts as black, as in the paper. So a target that
//! is too large makes a picture noisier, but not wrong. One that is too small makes it wrong, and
//! [`ExitPupil`] has a margin for that reason.

use glam::DVec2;
use ivcam_base::math::lanes::{LANES, Lane, dispatch};

use crate::lens::lens::Lens;
use crate::lens::optics::film_place::FilmPlace;
use crate::lens::pupil::aims::{Aims, TableAims};
use crate::lens::pupil::exit_pupil::{ExitPupil, ExitPupilTable};
use crate::lens::pupil::rear_element::RearElement;
use crate::lens::pupil::vignetting::Vignetting;
use crate::lens::pupil::window::PupilWindow;
use crate::sampling::DiscMap;

/// Where to aim. The default is `ExitPupil`; the 1999 program uses `RearElement`.
#[derive(Clone, Debug)]
pub enum PupilTarget {
    /// The whole rear element.
    RearElement(RearElement),
    /// The exit pupil as measured from the film point.
    ExitPupil(Box<ExitPupil>),
}

impl PupilTarget {
    /// The disc of the rear element, sampled by a map from the unit square.
    pub fn rear_element(lens: &Lens, map: DiscMap) -> Self {
        Self::RearElement(RearElement::new(lens, map))
    }

    /// The exit pupil for a flat film at `film_z` whose points are at most `film_radius` from the
    /// axis, both in millimeters.
    pub fn exit_pupil(lens: &Lens, film_z: f64, film_radius: f64) -> Self {
        Self::exit_pupil_of(lens, &FilmPlace::flat(film_z), film_radius)
    }

    /// The exit pupil for a film that may be moved or bent. `film_radius` is the greatest distance
    /// of a film point from the film's middle, in millimeters.
    pub fn exit_pupil_of(lens: &Lens, place: &FilmPlace, film_radius: f64) -> Self {
        Self::ExitPupil(Box::new(ExitPupil::new(lens, place, film_radius)))
    }

    /// The window at which rays from a film point, in millimeters from the film's middle, are
    /// aimed.
    pub fn window(&self, film: DVec2) -> PupilWindow<'_> {
        match self {
            Self::RearElement(rear) => PupilWindow::Disc {
                radius: rear.radius,
                map: rear.map,
            },
            Self::ExitPupil(pupil) => pupil.window(film),
        }
    }

    /// Aims a bundle of rays from film points, in millimeters from the film's middle, by points of
    /// the unit square. Up to rounding, the aims are those of [`Self::window`].
    pub fn aims(
        &self,
        film: &[Lane; 2],
        pupil: &[Lane; 2],
        vignetting: &Vignetting,
        aims: &mut Aims,
    ) {
        match self.table() {
            Some(ExitPupilTable::Radial(table)) => dispatch(TableAims {
                table,
                vignetting,
                film,
                pupil,
                aims,
            }),
            Some(ExitPupilTable::Polar(table)) => dispatch(TableAims {
                table: &**table,
                vignetting,
                film,
                pupil,
                aims,
            }),
            None => {
                for lane in 0..LANES {
                    let window = self.window(DVec2::new(film[0][lane], film[1][lane]));
                    aims.set(lane, &window, [pupil[0][lane], pupil[1][lane]]);
                }
            }
        }
    }

    /// Measures the unvignetted fraction of the aimed area, for the lens and film that this target
    /// was made for. It is known if the iris is convex and there are no secondary openings. Without
    /// rotational symmetry it is measured as film points are asked for.
    pub fn vignetting(&self, lens: &Lens, place: &FilmPlace) -> Vignetting {
        match self.table() {
            Some(ExitPupilTable::Radial(table)) => Vignetting::measure(table, lens, place),
            Some(ExitPupilTable::Polar(table)) => Vignetting {
                by_patch: Vec::new(),
                weights: table.weights_at(lens.wavelength()),
            },
            None => Vignetting::default(),
        }
    }

    /// The table of pupils from which alone rays are aimed; none if they are aimed at a disc, too.
    fn table(&self) -> Option<&ExitPupilTable> {
        match self {
            Self::ExitPupil(pupil) if pupil.secondary.is_none() => Some(&pupil.table),
            _ => None,
        }
    }
}
