//! The optics of a lens with a film: focusing, movements, chief rays and spots.

pub mod breathing;
pub mod chief_ray;
pub mod film_place;
pub mod focus;
mod focus_group;
mod focusing;
pub mod spot;
