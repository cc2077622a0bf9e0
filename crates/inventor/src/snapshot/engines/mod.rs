//! Evaluates Inventor's engines and connections at one time.
//!
//! Inventor's `=` connections, and `ROUTE`s from Inventor's engines, are followed from the
//! connected fields back to engines and other fields, once, at the requested time. Traversal then
//! sees plain values. Time 0 is when the scene was opened. There is no user input, so triggers come
//! only from clocks. All other `ROUTE`s carry events, which `events` delivers before.

mod calculator;
mod clocks;
mod compose;
mod compute;
pub mod convert;
pub mod edges;
mod evaluate;
mod interpolate;
mod lists;
mod matrix;
mod movers;
mod outputs;
pub(crate) mod sensors;
mod values;

pub(crate) use evaluate::evaluate;

#[cfg(test)]
mod tests;
