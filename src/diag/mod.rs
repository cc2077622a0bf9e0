//! Where something is, and what to say about it.
//!
//! A wrong file is a [`Diagnostic`]: what, where, and what to do next. Messages are lower case,
//! without a full stop, names in backticks. Nothing here prints; [`Diagnostic::render`] makes the
//! text and the caller decides where it goes.

mod diagnostic;
mod sink;
mod source;
mod spelling;

pub use diagnostic::{Diagnostic, Result, Severity};
pub use sink::Sink;
pub use source::{Source, Span};
pub(crate) use spelling::nearest;
