//! Engines, connections and routes: values that come from other values, evaluated at one time.
//!
//! Inventor's `=` connections and VRML97's `ROUTE`s are followed from the fields that have them
//! back to engines, sensors and other fields, once, at the time asked for; the walk then sees
//! plain values. Time 0 is when the scene was opened. Nobody has clicked or will, so triggers come
//! from clocks alone. Scripts do not run.

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
