//! Reports: the cost of a render, the error of its picture, and the parts of the scene left out.
//!
//! The JSON form is an interface that other programs read: `docs/guide/machine.md`.

pub(crate) mod account;
mod chart;
mod convergence;
pub(crate) mod deviation;
mod peers;
mod slope;

pub(crate) use account::{RenderReport, Seconds, count, error_text, percent, stated_error};
pub(crate) use chart::Across;
pub(crate) use convergence::{Convergence, Row};
pub(crate) use peers::Peer;
