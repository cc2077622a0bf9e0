//! Where on the lens to aim a ray from a film point.
//!
//! Every target gives points of the plane through the rear vertex, where equation 1 integrates,
//! with their density per square millimeter. A ray aimed there may still be lost; it counts with
//! no light in it, as in the paper, so a target that is too large is slow but never wrong. One
//! that is too small is wrong, so [`ExitPupil`] keeps a margin and checks itself.

use glam::DVec2;

use super::aims::{Aims, SpanAims};
use super::exit_pupil::{ExitPupil, Table};
use super::rear_element::RearElement;
use super::transmission::Light;
use super::window::PupilWindow;
use crate::lens::lens::Lens;
use crate::lens::optics::film_place::FilmPlace;
use crate::math::lanes::{LANES, Lane, widely};
use crate::sampling::DiscMap;

/// Where to aim. The 1999 program: `RearElement`. Default now: `ExitPupil`.
#[derive(Clone, Debug)]
pub enum PupilTarget {
    RearElement(RearElement),
    ExitPupil(Box<ExitPupil>),
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
