//! Writes a document as Inventor V2.1, ASCII or binary, or as VRML97.
//!
//! The fields that the file states are written in their order, and no others. Reading the result
//! gives the same document. Files that a scene includes are not written.

mod ascii;
mod binary;
mod format;
mod protos;
mod spelling;
mod text_values;

pub use format::Format;
