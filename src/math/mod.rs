//! Arithmetic that is the same everywhere, and lengths with units.
//!
//! Inside the crate a length is an `f64` in the unit its module states: millimeters in `lens`,
//! meters in scenes. [`Mm`] and [`Meters`] stand at the borders, where the two meet.

pub mod fourier;
pub mod lanes;
mod length;
mod quadratic;
pub mod symmetric;

pub use length::{LengthUnit, Meters, Mm, meters, mm, parse_length};
pub use quadratic::{diff_of_products, quadratic};
