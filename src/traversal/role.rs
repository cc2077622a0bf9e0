//! What a node does to a walk: the role that the catalogue states for its class.

use crate::grammar::Class;
pub(crate) use crate::grammar::Role;
use crate::iv::NodeRef;

/// Returns the role of a node: of its class, or of the known class that it says it is.
pub(crate) fn role(node: NodeRef<'_>) -> Role {
    node.known_class().map_or(Role::Kept, role_of)
}

pub(crate) fn role_of(class: &Class) -> Role {
    class.role
}

/// Whether the class is VRML97's alone.
pub(crate) fn is_vrml97(class: &Class) -> bool {
    class.is_vrml97()
}
