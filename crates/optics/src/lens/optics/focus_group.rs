//! Focuses by moving a group of surfaces, as many lenses do.

use crate::lens::lens::Lens;
use crate::lens::optics::focus::{Focus, FocusFault, FocusMethod, focus};
use crate::prescription::first_order::FirstOrder;
use crate::prescription::prescription::{FocusGroup, Prescription};
use crate::prescription::surface::Meridian;

/// Moves the focusing group until a distance, in millimeters, is in focus on the film at its
/// position for infinity. Returns the lens with its gaps changed. The group stays between its
/// neighbors.
pub(super) fn move_group(lens: &Lens, distance: f64) -> Result<(Lens, Focus), FocusFault> {
    let travel = GroupTravel::of(lens)?;
    if distance.is_infinite() {
        let at_rest = focus(lens.first_order(), FocusMethod::Film, distance)?;
        let focus = Focus {
            method: FocusMethod::Group,
            ..at_rest
        };
        return Ok((lens.clone(), focus));
    }
    let Some(shift) = travel.solve(distance) else {
        return Err(FocusFault::TooNear {
            nearest: travel.nearest_beyond(distance),
        });
    };
    let moved = lens.with(travel.moved(shift));
    let focus = Focus {
        method: FocusMethod::Group,
        film_z: travel.film_at(shift),
        extension: -shift,
        ..focus(moved.first_order(), FocusMethod::Film, distance)?
    };
    Ok((moved, focus))
}

/// The travel of a focusing group. Lengths are in millimeters.
struct GroupTravel<'a> {
    lens: &'a Lens,
    group: FocusGroup,
    /// Whether the group contains the last surface.
    is_last: bool,
    /// The z of the film for infinity.
    rest: f64,
    /// The distance by which the group may move forward.
    before: f64,
    /// The distance by which the group may move backward.
    after: f64,
}

impl<'a> GroupTravel<'a> {
    /// The travel of the focusing group of a lens.
    fn of(lens: &'a Lens) -> Result<Self, FocusFault> {
        let group = lens.prescription().focus_group.ok_or(FocusFault::NoGroup)?;
        let rest = focus(lens.first_order(), FocusMethod::Film, f64::INFINITY)?.film_z;
        let surfaces = &lens.prescription().surfaces;
        let focal = lens.first_order().focal.ok_or(FocusFault::Afocal)?;
        // The group may move up to its neighbors. Where there is none, half a focal length is
        // assumed.
        let free = 0.5 * focal.efl.abs();
        let before = group.first.checked_sub(1);
        let is_last = group.last + 1 == surfaces.len();
        Ok(Self {
            lens,
            group,
            is_last,
            rest,
            before: before.map_or(free, |i| surfaces[i].thickness),
            after: match is_last {
                true => free.min(focal.bfl),
                false => surfaces[group.last].thickness,
            },
        })
    }

    /// The lens with its group moved backward by a distance.
    fn moved(&self, shift: f64) -> Prescription {
        let mut prescription = self.lens.prescription().clone();
        if let Some(i) = self.group.first.checked_sub(1) {
            prescription.surfaces[i].thickness += shift;
        }
        if !self.is_last {
            prescription.surfaces[self.group.last].thickness -= shift;
        }
        prescription
    }

    /// The z of the film, from the front vertex. If the group is in front, the front vertex moves
    /// too.
    fn film_at(&self, shift: f64) -> f64 {
        if self.group.first == 0 {
            self.rest - shift
        } else {
            self.rest
        }
    }

    /// The distance of the image behind the film; none if there is no real image.
    fn error(&self, shift: f64, distance: f64) -> Option<f64> {
        let moved = self.moved(shift);
        let indices = moved.indices(self.lens.wavelength());
        let optics = FirstOrder::of(&moved, &indices, Meridian::Y);
        let image = focus(&optics, FocusMethod::Film, distance).ok()?;
        Some(image.film_z - self.film_at(shift))
    }

    /// The smaller of the two shifts, backward and forward, that bring a distance into focus.
    fn solve(&self, distance: f64) -> Option<f64> {
        let backward = self.solve_along(self.after, distance);
        let forward = self.solve_along(-self.before, distance);
        let both = [backward, forward].into_iter().flatten();
        both.min_by(|a, b| a.abs().total_cmp(&b.abs()))
    }

    /// The first shift from 0 to `reach` that brings a distance into focus.
    fn solve_along(&self, reach: f64, distance: f64) -> Option<f64> {
        /// The number of steps in which a change of sign is searched. Two roots within one step are
        /// missed.
        const STEPS: i32 = 200;
        let place = |i: i32| reach * f64::from(i) / f64::from(STEPS);
        let mut last = self.error(0.0, distance)?;
        for i in 1..=STEPS {
            let next = self.error(place(i), distance)?;
            if last == 0.0 || last.signum() != next.signum() {
                return bisect(place(i - 1), place(i), |shift| self.error(shift, distance));
            }
            last = next;
        }
        None
    }

    /// The nearest distance beyond a given one that the group can bring into focus; infinite if
    /// there is none.
    fn nearest_beyond(&self, distance: f64) -> f64 {
        let works = |d: &f64| self.solve(*d).is_some();
        let mut farther = (1..60).map(|i| distance * libm::pow(1.25, f64::from(i)));
        let Some(mut near) = farther.find(works) else {
            return f64::INFINITY;
        };
        let mut too_near = near / 1.25;
        for _ in 0..20 {
            let middle = 0.5 * (near + too_near);
            if works(&middle) {
                near = middle
            } else {
                too_near = middle
            }
        }
        near
    }
}

/// The root between two positions at which the signs differ.
fn bisect(mut a: f64, mut b: f64, f: impl Fn(f64) -> Option<f64>) -> Option<f64> {
    let start = f(a)?;
    if start == 0.0 {
        return Some(a);
    }
    for _ in 0..200 {
        let middle = 0.5 * (a + b);
        if middle == a || middle == b {
            break;
        }
        if f(middle)?.signum() == start.signum() {
            a = middle
        } else {
            b = middle
        }
    }
    Some(0.5 * (a + b))
}
