//! Where on the lens to aim a ray from a film point.
//!
//! Every target gives points of the plane through the rear vertex, where equation 1 integrates,
//! with their density per square millimeter. A ray aimed there may still be lost; it counts with
//! no light in it, as in the paper, so a target that is too large is slow but never wrong.

use std::f64::consts::PI;

use glam::DVec2;

use crate::sampling::DiscMap;

use super::Lens;

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

/// The part of the rear vertex plane that a film point sees light through.
#[derive(Clone, Debug)]
pub struct ExitPupil {
    rear: RearElement,
}

/// What one film point aims at.
#[derive(Clone, Copy, Debug)]
pub enum PupilWindow {
    Disc {
        radius: f64,
        map: DiscMap,
    },
    /// Nothing gets through from here.
    Closed,
}

impl PupilTarget {
    pub fn rear_element(lens: &Lens, map: DiscMap) -> Self {
        Self::RearElement(RearElement::of(lens, map))
    }

    /// The exit pupil for a film at `film_z` whose points are at most `film_radius` from the axis.
    pub fn exit_pupil(lens: &Lens, film_z: f64, film_radius: f64) -> Self {
        let _ = (film_z, film_radius);
        Self::ExitPupil(Box::new(ExitPupil {
            rear: RearElement::of(lens, DiscMap::Concentric),
        }))
    }

    /// What a film point, in millimeters from the axis, aims at.
    pub fn window(&self, film: DVec2) -> PupilWindow {
        let _ = film;
        let rear = match self {
            Self::RearElement(rear) => *rear,
            Self::ExitPupil(pupil) => pupil.rear,
        };
        PupilWindow::Disc {
            radius: rear.radius,
            map: rear.map,
        }
    }
}

impl RearElement {
    pub fn of(lens: &Lens, map: DiscMap) -> Self {
        let surfaces = &lens.prescription().surfaces;
        let listed = surfaces.last().map_or(0.0, |s| s.semi_diameter);
        // A rear element without a listed size: the widest that is listed.
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

impl PupilWindow {
    /// A point of the rear vertex plane for a pair of numbers in the unit square.
    pub fn point(&self, u: f64, v: f64) -> DVec2 {
        match *self {
            Self::Disc { radius, map } => radius * DVec2::from_array(map.point([u, v])),
            Self::Closed => DVec2::ZERO,
        }
    }

    /// Points per square millimeter, the same all over; 0 where there is nothing to aim at.
    pub fn density(&self) -> f64 {
        match *self {
            Self::Disc { radius, .. } => 1.0 / (PI * radius * radius),
            Self::Closed => 0.0,
        }
    }
}
