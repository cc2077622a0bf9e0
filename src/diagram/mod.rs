//! Lens sections with ray paths, and the data sheet of a lens, as SVG or xfig; and point spreads as a
//! picture.
//!
//! Nothing here computes optics: `lens::analysis` does.

mod chart;
mod drawing;
mod fig;
mod numbers;
mod page;
mod point_spreads;
mod section;
mod svg;

pub use drawing::{Anchor, Drawing, Ink, Item, Output, Path, Text};
pub use page::{html_page, svg_page};
pub use point_spreads::point_spreads;
pub use section::{LensDiagram, SectionOptions};
