//! The processes that make one picture together: messages between them, and who does what.
//!
//! The first process of a team leads it. `Schedule` decides how much each process gets at a time;
//! it has no clock and no messages of its own. What the messages mean is the business of `render`.

mod link;
#[cfg(feature = "mpi")]
pub(crate) mod mpi;
mod schedule;
#[cfg(test)]
mod threads;

pub(crate) use link::Team;
pub(crate) use schedule::Schedule;
#[cfg(test)]
pub(crate) use threads::threads;
