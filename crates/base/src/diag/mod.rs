//! Messages about files, and the locations in files that they refer to.
//!
//! A mistake in a file becomes a [`Diagnostic`], which states what is wrong, where, and what the
//! user can do about it. Messages are in lower case, without a full stop, with names in backticks.
//! Nothing in this module prints: [`Diagnostic::render`] returns text, and the caller decides where
//! to write it.

mod diagnostic;
mod differences;
mod sink;
mod source;
mod spelling;

pub use diagnostic::{Diagnostic, ErrorKind, Result, Severity};
pub use differences::differences;
pub use sink::Sink;
pub use source::{Source, Span};
pub use spelling::{counted, excerpt, excerpt_path, nearest, printable};
