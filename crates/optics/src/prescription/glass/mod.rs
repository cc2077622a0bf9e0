//! Glasses: indices and dispersion, the catalogue of names, and coatings.

pub mod agf;
pub(crate) mod catalogue;
pub(crate) mod coating;
pub mod medium;

pub use catalogue::Catalogue;
pub use coating::Coating;
pub use medium::{D_LINE, named_line};
pub use medium::{Dispersion, Formula, Medium};
