//! Reading and writing of picture files, with one module per format.
//!
//! Reading gives a `Raster`, the uninterpreted samples of the file. Writing takes a [`Picture`],
//! the linear exposure values of a developed film with their provenance.

mod channels;
mod developed;
mod exr;
mod raster;
mod read;
mod sgi;
mod tiff;
mod write;

pub use channels::ChannelImage;
pub use developed::{Depth, Picture, PictureFormat};
pub(crate) use raster::{Raster, Samples};
