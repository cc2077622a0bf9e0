//! Reads the ASCII formats: Inventor V1.0 to V2.1, VRML 1.0 and VRML97.
//!
//! The meaning of a token depends on the field that it is in, so the catalogue leads. Open nodes
//! stand on a `Vec` and not on the program's stack: a file may nest as deep as it likes. A mistake
//! is reported, and reading goes on at the next field name or brace.

mod fields;
mod nodes;
mod reader;
mod vrml97;

pub(crate) use reader::read;
