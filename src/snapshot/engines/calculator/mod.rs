//! The `Calculator` engine and its expression language.
//!
//! `oA = vec3f(cos(a), ta, 0); tb = A[1] > 0 ? a : -a`: statements that assign to outputs (`oa` to
//! `od`, `oA` to `oD`) and temporaries (`ta` to `th`, `tA` to `tH`) from inputs (`a` to `h`, `A` to
//! `H`). Lower case is a number, upper case a vector; `[0]` to `[2]` is a vector's component.

mod engine;
mod functions;
mod parse;
mod program;

pub(crate) use engine::outputs;

#[cfg(test)]
mod tests;
