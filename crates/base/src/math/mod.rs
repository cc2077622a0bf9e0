//! Numerical tools that know nothing of lenses and scenes: lengths with units, SIMD lanes, Fourier
//! transforms, interpolation, systems of equations and numbers of 32 digits.
//!
//! Inside the crate a length is an `f64` in the unit that its module states: millimeters in `lens`,
//! meters in scenes. Interfaces between the two use [`Mm`] and [`Meters`].

mod difference;
mod double;
pub mod fourier;
mod lagrange;
pub mod lanes;
pub mod least_squares;
mod length;
mod polygon;
pub mod simd;
pub mod symmetric;

pub use difference::diff_of_products;
pub use double::Double;
pub use lagrange::lagrange_weight;
pub use length::{LengthUnit, Meters, Mm, meters, mm, parse_length};
pub use polygon::polygon_normal;
pub use simd::use_portable_arithmetic;
