//! Reports: the cost of a render, the error of its picture, and the parts of the scene left out.
//!
//! The JSON form is an interface that other programs read: `docs/guide/machine.md`.

pub(crate) mod account;
mod chart;
mod convergence;
pub(crate) mod deviation;

pub(crate) use account::{RenderReport, Seconds, count, percent};
pub(crate) use convergence::{Convergence, Row};
