//! Writes VRML97, and X3D in its XML encoding.
//!
//! Both are graphs of the same nodes. A scene in VRML97 is written node by node, with its
//! prototypes, scripts and routes. Of a scene in Inventor or VRML 1.0, whose state leaks from node
//! to node, `graph` makes a document in VRML97 from the [`Model`], with lights of the strength that
//! `levels` finds. `xml` writes a document in VRML97 as X3D, with the values of `values`. `write`
//! chooses between these ways.
//!
//! [`Model`]: ivcam_render::scene::model::Model

mod graph;
mod levels;
#[cfg(test)]
mod tests;
mod values;
mod write;
mod xml;

pub(super) use write::{rewritten, vrml97, x3d};
