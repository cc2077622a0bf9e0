//! Zemax's sequential files: `SURF n` and indented lines of a keyword and its values.
//!
//! Read: STANDARD, EVENASPH, ODDASPHE, XASPHERE, XOSPHERE, TOROIDAL and BICONICX where it is a
//! cylinder or of revolution; glasses by name, as `___BLANK` models or as that of another surface;
//! configurations that change thicknesses or the stop, as zoom positions. What tilts, reflects or
//! diffracts is refused by name. DIAM is a semi-diameter. Dummy planes that do nothing are dropped.

mod file;
mod reader;
mod shapes;
#[cfg(test)]
mod tests;
mod zoom;

pub(crate) use reader::FORMAT;
