//! The exit pupil as seen from film points, and where on the lens to aim rays from them.
//!
//! The rest of the crate aims at a `target`, which is an exit pupil or the rear element. It asks
//! for the `window` of one film point, or for the `aims` of many.
//!
//! `search` finds the outline of the pupil from one film point. Two tables interpolate outlines
//! over the film: `radial_table` by film radius, for a lens and a film with rotational symmetry,
//! and `polar_table` by film position. They are refined where interpolation is not exact enough:
//! the first from the film points of a `film_row`, the second in `polar_cells` and with the help of
//! `symmetry`. Both consist of `patch`es, from which rays are aimed at a `polygon`, and
//! `exit_pupil` holds one of the two. `vignetting` measures how much of a polygon lets light
//! through, `obstruction` what is closed inside it, and `secondary_region` where light comes
//! through other openings. `support` has the arithmetic of convex outlines.
//!
//! # Glossary
//!
//! * **exit pupil**: the opening of the lens as seen from a film point: the image of the stop,
//!   cut off by the rims of the elements (vignetting).
//! * **rear vertex plane**: the plane through the last vertex of the lens and perpendicular to
//!   its axis, in which pupils are measured and rays are aimed.
//! * **aim**: the point of the rear vertex plane toward which a ray starts.
//! * **fill**: the greatest ratio of a ray's height at a surface to the semi-diameter; below 1
//!   the ray gets through (`search`).
//! * **rim, outline**: where the fill is 1; the outline of a pupil is the convex hull of its
//!   rim.
//! * **support**: an outline as the distances of its supporting lines from the axis, in 32
//!   directions.
//! * **normals**: those 32 directions, which are the same for all outlines of a lens.
//! * **half width**: half of the distance between two opposite supporting lines; margins and
//!   errors are fractions of it.
//! * **polygon**: the polygon that the supporting lines make, at which rays are aimed; it
//!   contains the outline.
//! * **patch**: the interpolated polygons of one region of the film.
//! * **wedge, copy**: the part of the film to which symmetry maps all others, and the rotation
//!   and reflection that maps it to one of them.
//! * **window**: what rays from one film point are aimed at: a polygon, a disc, or a mixture of
//!   both.
//! * **density**: the probability of an aim per square millimeter; a ray's importance weight is
//!   equation 1 of the paper over it (`camera::aim` of the renderer).
//! * **area**: the reciprocal of the density; for a polygon, its area.
//! * **unvignetted fraction**: the fraction of that area from which light gets through: rays
//!   that are aimed again until they do are weighted by it (rejection sampling).
//! * **secondary opening**: another part of the rear vertex plane through which light comes, if
//!   a beam is folded inside the lens.

pub(crate) mod aims;
pub(crate) mod exit_pupil;
mod film_row;
mod obstruction;
mod patch;
mod polar_cells;
mod polar_table;
mod polygon;
mod pupil_table;
mod radial_table;
pub(crate) mod rear_element;
pub(crate) mod search;
mod secondary_region;
mod support;
mod symmetry;
pub(crate) mod target;
pub(crate) mod vignetting;
pub(crate) mod window;
