//! Writes scenes in the formats of other programs.
//!
//! [`convert`] makes the bytes of a file, and a list of what the format could not express. Formats
//! that hold triangles are written from a [`Model`], in which Inventor's state is resolved; the
//! guide `docs/guide/convert.md` describes how materials are mapped. Nothing here reads the files
//! of other programs.
//!
//! A target is added in three places: [`Target`] gets its names and the features that it can hold,
//! `convert` calls its function, and a file or folder of its name has the function.
//!
//! [`Model`]: ivcam_render::scene::model::Model

mod appearance;
mod base64;
mod clipping;
mod color;
mod companions;
mod conversion;
mod gltf;
mod highlight;
mod indent;
mod inventor;
mod losses;
mod names;
mod nodes;
mod obj;
mod ply;
mod source_report;
mod target;
mod trs;
mod usd;
mod web3d;

#[cfg(test)]
mod tests;

pub(crate) use base64::base64;
pub(crate) use conversion::rewriting;
pub use conversion::{Conversion, ExportOptions, convert};
pub use losses::{ConversionLoss, Losses};
pub(crate) use source_report::source_report;
pub use target::Target;
