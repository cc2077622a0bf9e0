//! Reads the ASCII formats: Inventor V1.0 to V2.1, VRML 1.0 and VRML97.
//!
//! The meaning of a token depends on its field, so the catalogue determines how tokens are parsed.
//! Open nodes are on an explicit stack, because files may nest deeper than recursion allows. A
//! mistake is reported, and reading continues at the next field name or brace.

mod fields;
mod nodes;
mod reader;
mod vrml97;
mod x3d;

pub(crate) use reader::read;
