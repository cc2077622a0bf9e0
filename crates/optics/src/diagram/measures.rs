//! The measures of a data sheet, in pixels of the page.

/// The width of the page.
pub(super) const WIDTH: f64 = 1040.0;
/// The empty border of the page.
pub(super) const MARGIN: f64 = 44.0;
/// The space between columns.
pub(super) const GUTTER: f64 = 32.0;
