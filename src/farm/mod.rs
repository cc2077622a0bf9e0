//! Job files: one piece of work, divided into tasks, in the forms that schedulers of farms read.
//!
//! A [`Division`] has a shell script for one task, the argument of each task, and a script that
//! runs when all tasks have succeeded. [`Scheduler`] writes them for OpenJD, Slurm, HyperQueue and
//! GNU parallel. Nothing here starts a job or knows what a task makes.

mod division;
mod hyperqueue;
mod openjd;
mod parallel;
mod scheduler;
mod shell;
mod slurm;

pub(crate) use division::{Division, pieces};
pub(crate) use parallel::LOG;
pub(crate) use scheduler::Scheduler;
pub(crate) use shell::{ShellWord, script};
