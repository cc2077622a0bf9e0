//! What a render cost, how wrong its picture is, and what the scene did not need.
//!
//! The JSON form is an interface that other programs read: `docs/guide/machine.md`.

pub(crate) mod account;
mod chart;
mod convergence;
pub(crate) mod deviation;

pub(crate) use account::{RenderReport, Seconds};
pub(crate) use convergence::{Convergence, Row};
