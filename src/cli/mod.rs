//! The command line: both spellings of the flags, the commands, and where text goes.
//!
//! Data goes to stdout, talk to stderr. Exit 0: done; 1: pictures differ, or a limit was passed;
//! 2: an error.

pub mod check;
pub mod compare;
pub mod converge;
pub mod convert;
mod dispatch;
pub mod expose;
pub mod fit;
pub mod flags;
pub mod lens;
mod messages;
pub mod nodes;
pub mod pull_focus;
pub mod render;
pub mod sheet;
pub mod view;
mod words;

pub use dispatch::{commands, run};
pub(crate) use messages::say;
pub use messages::{ERROR, tell, tell_all, written};
pub use words::{fonts, limits, parsed, scene_argument, switch, text};
