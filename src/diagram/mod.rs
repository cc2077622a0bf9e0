//! Lens sections with ray paths and the data sheet of a lens, as SVG or xfig, and point spread
//! functions as a picture.
//!
//! Optics are computed by `lens::analysis`.

mod aberration_page;
pub(crate) mod chart;
pub(crate) mod drawing;
mod fig;
mod numbers;
mod page;
mod point_spreads;
mod section;
mod svg;

pub(crate) use page::{html_page, svg_page};
pub(crate) use point_spreads::{point_spread_map, point_spreads};
pub(crate) use section::{LensDiagram, SectionOptions};
