//! Focuses a lens by any [`FocusMethod`].

use ivcam_base::math::{Meters, Mm};

use crate::lens::lens::Lens;
use crate::lens::optics::focus::{Focus, FocusFault, FocusMethod, focus};
use crate::lens::optics::focus_group::move_group;

impl Lens {
    /// Focuses on an object at a distance, which [`FocusMethod`] defines. A focusing group changes
    /// the lens itself; [`Self::focused`] returns the changed lens.
    ///
    /// # Errors
    ///
    /// Returns a [`FocusFault`] if the distance cannot be in focus.
    pub fn focus(&self, method: FocusMethod, distance: Meters) -> Result<Focus, FocusFault> {
        let distance = Mm::from(distance).0;
        match method {
            FocusMethod::Film | FocusMethod::Lens => focus(self.first_order(), method, distance),
            _ if !(distance > 0.0) => Err(FocusFault::NotADistance),
            FocusMethod::Best => move_film_to_best(self, distance),
            FocusMethod::Group => move_group(self, distance).map(|(_, focus)| focus),
        }
    }

    /// The focused lens and its focus.
    ///
    /// # Errors
    ///
    /// Returns a [`FocusFault`] if the distance cannot be in focus.
    pub fn focused(
        &self,
        method: FocusMethod,
        distance: Meters,
    ) -> Result<(Self, Focus), FocusFault> {
        match method {
            FocusMethod::Group if distance.0 > 0.0 => move_group(self, Mm::from(distance).0),
            _ => self
                .focus(method, distance)
                .map(|focus| (self.clone(), focus)),
        }
    }
}

/// Moves the film to the smallest spot of real rays on the axis.
fn move_film_to_best(lens: &Lens, distance: f64) -> Result<Focus, FocusFault> {
    let paraxial = focus(lens.first_order(), FocusMethod::Film, distance)?;
    let film_z = lens.best_focus(distance).ok_or(FocusFault::NoRays)?;
    if film_z < lens.length() {
        return Err(FocusFault::FilmInsideLens {
            film_z,
            nearest: None,
        });
    }
    let shift = film_z - paraxial.film_z;
    Ok(Focus {
        method: FocusMethod::Best,
        film_z,
        image_distance: paraxial.image_distance + shift,
        extension: paraxial.extension + shift,
        ..paraxial
    })
}
