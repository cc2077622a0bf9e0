//! Evaluates engines, connections and routes at one time.
//!
//! Inventor's `=` connections and VRML97's `ROUTE`s are followed from the connected fields back to
//! engines, sensors and other fields, once, at the requested time. Traversal then sees plain
//! values. Time 0 is when the scene was opened. There is no user input, so triggers come only from
//! clocks. Scripts do not run.

mod calculator;
mod clocks;
mod compose;
mod compute;
mod convert;
mod edges;
mod evaluate;
mod interpolate;
mod lists;
mod matrix;
mod movers;
mod outputs;
mod sensors;
mod values;

pub(super) use evaluate::evaluate;

#[cfg(test)]
mod tests;
