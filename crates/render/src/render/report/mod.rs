//! Reports: the cost of a render, the error of its picture, and the parts of the scene left out.
//!
//! The JSON form is an interface that other programs read: `docs/guide/machine.md`.

pub mod account;
mod chart;
mod convergence;
pub mod deviation;
mod peers;
mod slope;

pub use account::{RenderReport, StageSeconds, count, error_text, percent, stated_error};
pub use chart::Across;
pub use convergence::{Convergence, Row, Slopes};
pub use peers::Peer;
pub use slope::Slope;
