//! Works through a folder of scenes: which files, what each becomes, and what is already there.
//!
//! `jobs` pairs every scene with the file that is made of it, `names` writes paths as text,
//! `record` decides which of these files are up to date, `results` keeps what earlier runs found,
//! and `work` runs the rest on threads and survives a scene that fails. `picture` is the work of
//! `ivcam render FOLDER`, and `csv` reads and writes tables. Nothing here prints.

pub(crate) mod csv;
mod jobs;
mod names;
mod picture;
mod record;
mod results;
mod work;

pub(crate) use jobs::{Job, Jobs, Naming, is_below};
pub(crate) use names::{bytes_of, name_of, path_of};
pub(crate) use picture::{MadePicture, make_picture, one_color};
pub(crate) use record::{Record, RecordState, is_newer};
pub(crate) use results::EarlierResults;
pub(crate) use work::for_each;
