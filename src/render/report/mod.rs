//! What a render cost, how wrong its picture is, and what the scene did not need.
//!
//! The JSON form is an interface that other programs read: `docs/guide/machine.md`.

mod account;
mod chart;
mod convergence;
mod deviation;

pub use account::{RenderReport, Seconds, count};
pub use convergence::{Convergence, Row};
pub use deviation::Deviation;
