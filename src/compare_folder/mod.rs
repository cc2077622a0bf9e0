//! The comparison of two folders of pictures: which belong together, and a report with a page.
//!
//! `files` finds the pictures, `scenes` photographs scenes that have none, `pairing` pairs names,
//! `stated` reads the pairs that a file states, and `search` pairs what is left by what the
//! pictures show. `pair` compares one pair and `pictures` writes what the page shows of it. `make`
//! puts these together, keeps what is up to date, and writes the report: `entry` as JSON, `table`
//! as CSV, `page` as HTML. `progress` counts the work. All names come from strangers, so `page`
//! escapes every string.

mod entry;
mod files;
mod make;
mod options;
mod page;
mod pair;
mod pairing;
mod pictures;
mod progress;
mod scenes;
mod search;
mod stated;
mod table;

pub(crate) use entry::ReportSum;
pub(crate) use files::has_scenes;
pub(crate) use make::FolderComparison;
pub(crate) use options::{FolderOptions, Photographs};
pub(crate) use progress::ReportProgress;
