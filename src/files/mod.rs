//! Reads files of bounded size, and writes files that appear only when they are complete.

mod read;
mod whole;

pub(crate) use read::{MAX_PICTURE, MAX_TEXT, read_file, read_file_named, read_stream};
pub(crate) use whole::{check_writable, write_whole};
