//! Lens sections with ray paths and the data sheet of a lens, as SVG or xfig, and point spread
//! functions as a picture.
//!
//! Optics are computed by `lens::analysis`.

mod aberration_page;
pub mod chart;
pub mod drawing;
mod fig;
mod footprints;
mod measures;
mod numbers;
mod page;
mod point_spreads;
mod section;
mod svg;

pub use page::{html_page, svg_page};
pub use point_spreads::{point_spread_map, point_spreads, white_light};
pub use section::{LensDiagram, SectionOptions};
