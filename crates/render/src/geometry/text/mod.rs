//! Converts strings to triangles (`Text3`, `AsciiText` and VRML97's `Text`) and to pixels
//! (`Text2`).
//!
//! Twelve shipped typefaces replace every font that a file may name (`fonts/LICENSE.txt`), so a
//! picture is the same on every machine. They have the metrics of Times, Helvetica and Courier,
//! which SGI's and Coin's libraries draw for those names, and the 191 characters of Latin-1. Other
//! characters are in further shipped typefaces (`fallback`), which are opened for the first text
//! that has one (`chain`); a box stands for what is in none. If the user gives font folders, these
//! are searched first (`library`). A text makes each of its glyphs once and places it as often as
//! it occurs, and a scene without text loads no fonts.
//!
//! Kerning and ligatures are not supported, and of the scripts whose letters change with their
//! neighbors only Arabic.

mod arabic;
mod batch;
mod chain;
mod face;
mod fallback;
mod flat;
mod flattener;
mod glyph;
mod layout;
mod letters;
mod library;
mod missing;
mod pixels;
mod scripts;
mod solid;
mod style;
mod vrml97;
mod vrml97_bounds;

pub use batch::TextOutput;
pub use face::{Face, Family};
pub use flat::{ascii_text, vrml97_text};
pub(crate) use layout::Layout;
pub(crate) use letters::MAX_GLYPHS;
pub use library::Fonts;
pub(crate) use missing::MissingCharacters;
pub use pixels::{PixelText, pixel_text};
pub use solid::{SolidParts, text3};
pub use style::{Justify, TextStyle, Vrml97Style};
pub(crate) use vrml97_bounds::vrml97_bounds;

/// The licenses of the shipped typefaces, as text.
pub const LICENSE: &str = include_str!("fonts/LICENSE.txt");

#[cfg(test)]
mod tests;
