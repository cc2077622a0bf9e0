//! Arithmetic that is the same everywhere, and lengths with units.
//!
//! Inside the crate a length is an `f64` in the unit its module states: millimeters in `lens`,
//! meters in scenes. [`Mm`] and [`Meters`] stand at the borders, where the two meet.

mod difference;
pub(crate) mod fourier;
pub(crate) mod lanes;
mod length;
pub(crate) mod symmetric;

pub(crate) use difference::diff_of_products;
pub use length::{LengthUnit, Meters, Mm, meters, mm, parse_length};
