//! Glasses: indices and dispersion, the catalogue of names, and coatings.

pub mod agf;
pub mod catalogue;
pub mod coating;
pub mod medium;

pub use catalogue::Catalogue;
pub use coating::Coating;
pub use medium::{C_LINE, D_LINE, Dispersion, F_LINE, Formula, Medium, named_line};
