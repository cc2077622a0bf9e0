//! Picture files in and out, one place for each format.
//!
//! What comes in is a [`Raster`]: samples as they are in the file, without a word on what they
//! mean. What goes out is a [`Picture`]: linear exposure values of a developed film, with how it
//! was made written into it.

mod developed;
mod exr;
mod raster;
mod read;
mod sgi;
mod whole_file;
mod write;

pub use developed::{Depth, Picture, PictureFormat};
pub(crate) use raster::{Raster, Samples};
pub(crate) use whole_file::write_whole;
