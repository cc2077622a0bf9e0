//! A document at one time.

pub mod engines;
