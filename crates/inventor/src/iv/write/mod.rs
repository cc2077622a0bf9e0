//! Writes a document as Inventor V2.1, ASCII or binary, or as VRML97.
//!
//! Only the fields that the file states are written, in the file's order. Reading the result gives
//! an equal document. Included files are not written.

mod ascii;
mod binary;
mod format;
mod output;
mod protos;
mod spelling;
mod text_values;

pub use format::{Format, FormatLoss};
pub(crate) use text_values::value_text;
