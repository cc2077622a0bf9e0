//! Numerical stability: extreme lenses and scenes beside answers that are known otherwise.
//!
//! The answers for lenses are computed here with twice the digits, those for scenes are closed
//! formulas. A case fails if its error is above its bound. The bound of a lens case is what
//! rounding each number of the prescription, and the ray behind each surface, once would do to the
//! exact answer, times a constant, so that a stiff case has the bound of its stiffness and not a
//! chosen one.

mod case;
mod lens_cases;
mod lens_reference;
mod scene_cases;

pub(crate) use case::Case;
pub(crate) use lens_cases::lens_cases;
pub(crate) use scene_cases::scene_cases;
