//! The processes that make one picture together: messages between them, and who does what.
//!
//! The first process of a team leads it. `Schedule` decides how much each process gets at a time;
//! it has no clock and no messages of its own. What the messages mean is the business of `render`.

mod link;
#[cfg(feature = "mpi")]
pub mod mpi;
mod schedule;
mod threads;

pub use link::Team;
pub use schedule::Schedule;
pub use threads::threads;
