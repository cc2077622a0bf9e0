//! Numerical tools that know nothing of lenses and scenes: lengths with units, SIMD lanes, Fourier
//! transforms, interpolation and systems of equations.
//!
//! Inside the crate a length is an `f64` in the unit that its module states: millimeters in `lens`,
//! meters in scenes. Interfaces between the two use [`Mm`] and [`Meters`].

mod difference;
pub(crate) mod fourier;
mod lagrange;
pub(crate) mod lanes;
pub(crate) mod least_squares;
mod length;
pub(crate) mod simd;
pub(crate) mod symmetric;

pub(crate) use difference::diff_of_products;
pub(crate) use lagrange::lagrange_weight;
pub use length::{LengthUnit, Meters, Mm, meters, mm, parse_length};
pub use simd::use_portable_arithmetic;
