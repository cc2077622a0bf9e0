//! Writes a document: ASCII and binary V2.1, and VRML97 where that is what it holds.
//!
//! What was read is written, field by field in its order; what a file leaves to the catalogue
//! stays unsaid. Reading the result gives the same document. Files that a scene includes stay
//! files.

mod ascii;
mod binary;
mod format;
mod protos;
mod spelling;
mod text_values;

pub use format::Format;
