//! The exit pupil as seen from film points, and where on the lens to aim rays from them.
//!
//! `search` finds the outline of the pupil from one film point, and `sampler` calls it for many.
//! `radial` and `polar` are tables of outlines over the film, with and without rotational
//! symmetry; `exit_pupil` holds one of the two. `lattice` measures the cells of `polar`, and
//! `support` and `symmetry` are tools of the tables.
//! `sides`, `span`, `spans`, `patch` and `polygon` sample points from an outline. `rim_shares` and
//! `transmission` measure how much of an outline is open.
//!
//! The rest of the crate aims at a `target`, which is an exit pupil or the rear element. It asks
//! for the `window` of one film point, or for the `aims` of many.

pub(crate) mod aims;
pub(crate) mod exit_pupil;
mod film_row;
mod patch;
mod polar_cells;
mod polar_table;
mod polygon;
mod radial_table;
pub(crate) mod rear_element;
pub(crate) mod search;
mod secondary_region;
mod support;
mod symmetry;
pub(crate) mod target;
pub(crate) mod vignetting;
pub(crate) mod window;
