//! The optics of a lens with a film: first-order data, focusing, movements, chief rays and spots.

mod adjust;
pub mod breathing;
pub mod chief_ray;
pub mod film_place;
pub mod first_order;
pub mod focus;
mod focus_group;
mod focusing;
pub mod spot;
