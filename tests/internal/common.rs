//! A call of the program in this process.

use std::ffi::OsString;

pub(crate) use crate::folder::Folder;

/// Runs the program with a line of arguments without spaces in them, and more arguments; returns
/// the exit code.
pub(crate) fn ivcam(line: &str, more: &[&str]) -> i32 {
    let words = ["ivcam"].into_iter().chain(line.split_whitespace());
    crate::cli::run(words.chain(more.iter().copied()).map(OsString::from))
}
