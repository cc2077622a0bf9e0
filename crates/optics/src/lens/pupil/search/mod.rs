//! Finds the exit pupil's outline as seen from a point on the film, on the rear vertex plane.
//!
//! A ray from the film is traced without blocking. Its *fill* is the largest ratio, over all
//! surfaces, of the ray's height at a surface to the surface's semi-diameter. If the fill is below
//! 1, the ray gets through. The fill is continuous and nearly linear in the aim, so that its
//! minimum, and the outline where it is 1, are found with few rays, at f/1024 as well as at full
//! aperture. Rays are traced in bundles: 32 directions of an outline are searched at once.

pub(crate) mod find_outline;
pub(crate) mod outline;
pub(crate) mod pupil_search;
pub(crate) mod rim;
pub(crate) mod secondary_openings;
