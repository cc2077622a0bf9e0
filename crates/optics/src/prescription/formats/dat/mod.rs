//! Tables of one surface in a line: radius, thickness, index and aperture diameter.
//!
//! The paper prints such a table, and pbrt's `.dat` files are such tables. A stop is a row with
//! radius 0 and index 0, or as the paper prints it, a row without a radius (`10.353 1.000 39.8`).
//! Radius 0 with an index is a plane. A stop takes the medium in front of it, so one in a fluid
//! stays in it (pbrt assumes air). `#` starts a comment; header words are skipped; commas count as
//! blanks.
//!
//! A heading may name the columns in another order and add an Abbe number, the name of a glass, a
//! conic constant and the coefficients of an asphere (`columns`), and cells of them may be missing
//! (`row`). What the file does not state is decided by evidence: the meaning of the second
//! column (`gap`), the order of five columns without a heading, and whether apertures are diameters
//! or semi-diameters.
//!
//! A comment `units: cm` (mm, cm, in or m) scales all lengths.

mod columns;
mod gap;
mod lines;
mod reader;
mod row;
#[cfg(test)]
mod tests;

pub(crate) use reader::FORMAT;
pub(super) use reader::{NOMINAL_F_NUMBER, NOMINAL_FOCAL_LENGTH, adopt_a_stop};
