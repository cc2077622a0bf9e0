//! Tests of alignment through the public interface of the crate.

mod alignment;
