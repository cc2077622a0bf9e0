//! Tests of compiling scenes through the public interface of the crate.

mod hostile;
mod nodes;
mod pointer;
