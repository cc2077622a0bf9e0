//! VRML 97's geometry: coordinates, colors and normals are nodes in the shape's own fields.

use crate::graph::State;
use crate::iv::NodeRef;
use crate::scene::Builder;

/// Draws a geometry node; `false` if its class has no picture here.
pub fn draw<'a>(
    _class: &str,
    _node: NodeRef<'a>,
    _state: &State<'a>,
    _out: &mut Builder<'a>,
) -> bool {
    false
}
