//! Reading and writing of picture files, with one module per format.
//!
//! Reading gives a `Raster`, the uninterpreted samples of the file. Writing takes a [`Picture`],
//! the linear exposure values of a developed film with their provenance, or a `Heading` and a
//! source of rows that are made while they are written.

mod channels;
mod cryptomatte;
mod developed;
mod exr;
mod jpeg;
mod raster;
mod read;
mod rows;
mod save_rows;
mod sgi;
mod tiff;
mod write;

pub use channels::ChannelImage;
pub use cryptomatte::matte_id;
pub use developed::{Depth, Picture, PictureFormat};
pub use exr::exr_text;
pub use raster::{Raster, Samples};
pub use rows::{Heading, ROWS, RowSource};
pub use save_rows::{save_rows, write_png_rows};
