//! The command line: both spellings of the flags, the commands, and where text goes.
//!
//! Data goes to stdout, talk to stderr. Exit 0: done; 1: pictures differ, or a limit was passed;
//! 2: an error.

pub(crate) mod check;
pub(crate) mod compare;
pub(crate) mod converge;
pub(crate) mod convert;
mod dispatch;
pub(crate) mod expose;
pub(crate) mod fit;
pub(crate) mod flags;
pub(crate) mod lens;
mod messages;
pub(crate) mod nodes;
pub(crate) mod pull_focus;
pub(crate) mod render;
pub(crate) mod sheet;
pub(crate) mod view;
mod words;

pub use dispatch::run;
pub(crate) use messages::say;
pub(crate) use messages::{ERROR, tell, tell_all, written};
pub(crate) use words::{fonts, limits, parsed, scene_argument, switch, text};
