//! How much work a scene may cause, and when work ends before it is done.
//!
//! A [`Budget`] is the account of one scene: the bytes and the steps that all who read, expand,
//! evaluate and compile it may use together, and a [`StopSignal`] that long loops read. A thread
//! works on one account at a time ([`Budget::during`]); code deep inside a reader or a search draws
//! from it by [`spend`] without receiving it as an argument. A thread that works for another one
//! takes its account over ([`Budget::current`]), as with the record of files.
//!
//! A step is about 5 ns of a processor of 2020: one number that is read or made. What takes longer
//! counts as more steps.

mod allowance;
mod budget;
mod limit;
mod stop;

pub use allowance::Allowance;
pub use budget::{Budget, Cut, is_cut, spend, spend_bytes, until_stopped};
pub use limit::WorkLimit;
pub use stop::{StopCause, StopSignal, StopTimer};
