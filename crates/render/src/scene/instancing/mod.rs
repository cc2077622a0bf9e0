//! Instancing: what is drawn many times is stored once.
//!
//! A walk offers the parts of a scene that it could draw without entering them, as
//! [`ivcam_inventor::traversal::Instance`]s: nodes that restore the state, and the copies of an
//! `Array` or a `MultipleCopy`. `ExpandedSizes::pays` decides once for a scene whether its
//! repeated parts are stored once. If so, the first instance of a part in a state is recorded as a
//! prototype by a walk of its own, and each instance places the prototype by its matrix
//! ([`draw_instance`]). What cannot be placed by a matrix is expanded: drawn where the walk meets
//! it.
//!
//! [`Instancer`] is what a visitor does for that; the compiler (`compile/instances.rs`) and the
//! survey (`surveyed_prototypes.rs`) are instancers. `instances/` holds the prototypes of a
//! compiled scene and finds the hits of rays. The decision records 25 and 29 give the reasons.

mod instancer;
mod prototypes;
mod sizes;

pub(super) use instancer::{Instancer, draw_instance};
pub(super) use prototypes::Prototypes;
