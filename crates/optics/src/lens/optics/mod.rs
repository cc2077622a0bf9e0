//! The optics of a lens with a film: focusing, movements, chief rays and spots.

pub(crate) mod breathing;
pub(crate) mod chief_ray;
mod f_number;
pub(crate) mod film_place;
pub mod focus;
mod focus_group;
mod focusing;
pub(crate) mod spot;
