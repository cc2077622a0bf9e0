//! The `Calculator` engine and its expression language.
//!
//! An example is `oA = vec3f(cos(a), ta, 0); tb = A[1] > 0 ? a : -a`. Statements assign to outputs
//! (`oa` to `od`, `oA` to `oD`) and temporaries (`ta` to `th`, `tA` to `tH`) from inputs (`a` to
//! `h`, `A` to `H`). A lower-case letter is a number, an upper-case letter a vector, and `[0]` to
//! `[2]` a component of a vector.

mod engine;
mod functions;
mod parse;
mod program;

pub(crate) use engine::outputs;

#[cfg(test)]
mod tests;
