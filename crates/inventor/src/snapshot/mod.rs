//! A document at one time, with events delivered, engines evaluated and, on request, handles of
//! draggers. [`events`](crate::events) takes it.
//!
//! All code that reads the values of nodes for a picture (traversal, compiling, the search for a
//! camera, `check`) uses a [`Snapshot`] and not a [`Document`], so that it sees the same values.
//! Some engines and the handles depend on the size of a part of the scene, which only the code that
//! draws knows; a snapshot gets it through `Bounds`. `scene::snapshot` implements that trait and
//! is the usual function to take a snapshot.
//!
//! [`Document`]: crate::iv::Document

mod at_time;
mod bound;
mod bounds;
pub mod engines;
pub(crate) mod handles;

pub use at_time::{SentEvent, Snapshot};
pub(crate) use bound::move_viewer;
pub use bound::{BindableKind, BoundNodes};
pub use bounds::{Bounds, Corners, NoBounds};
