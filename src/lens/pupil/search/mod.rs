//! What a film point sees through a lens: the outline of the light on the rear vertex plane.
//!
//! A ray from the film is followed without blocking, and its *fill* is how much of the tightest
//! semi-diameter it uses: below 1 it gets through. The fill is continuous and nearly linear in
//! the aim, so the least fill and the outline where it is 1 are found in few rays, at f/1024 as
//! at full aperture. Rays go in bundles: a whole outline is sought at once.

pub mod find_outline;
pub mod outline;
pub mod pupil_search;
mod rim;
pub mod secondary_openings;
