//! A document at one time: engines and routes evaluated, handles of draggers added if asked for.
//!
//! Whoever reads the values of nodes for a picture (the walk, the compiler, the search for a
//! camera, `check`) takes a [`Snapshot`] and not a [`Document`], so that all of them see the same
//! values. Some engines and the handles depend on how large a part of the scene is, which only
//! drawing tells; [`Bounds`] is how a snapshot asks. `scene::snapshot` answers it and is the usual
//! way to take one.
//!
//! [`Document`]: crate::iv::Document

mod at_time;
mod bounds;
mod engines;
mod handles;
mod take;

pub use at_time::{Snapshot, SnapshotOptions};
pub(crate) use bounds::{Bounds, Corners};
