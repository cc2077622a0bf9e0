//! The role of a node in a walk, which the catalogue states for its class.

pub use crate::grammar::Role;
use crate::iv::NodeRef;

/// Returns the role of a node's class, or of the nearest known class that it descends from.
pub fn role(node: NodeRef<'_>) -> Role {
    node.known_class().map_or(Role::Kept, |class| class.role)
}
