//! The bindable nodes that are bound (ISO 14772-1, 4.6.10).

use glam::{DMat4, DQuat};

use crate::grammar::class;
use crate::iv::{NodeId, NodeRef};
use crate::pose::CameraPose;

/// The kinds of bindable nodes. Of each, one node at most is bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BindableKind {
    /// `Background`.
    Background,
    /// `Fog`.
    Fog,
    /// `NavigationInfo`.
    NavigationInfo,
    /// `Viewpoint`.
    Viewpoint,
}

impl BindableKind {
    /// The number of kinds.
    pub const COUNT: usize = 4;

    /// Returns the kind of a node, if it is a bindable node of VRML97 that is drawn.
    pub fn of(node: NodeRef<'_>) -> Option<Self> {
        match node.class_id()? {
            class::VRML97_BACKGROUND => Some(Self::Background),
            class::VRML97_FOG => Some(Self::Fog),
            class::VRML97_NAVIGATION_INFO => Some(Self::NavigationInfo),
            class::VIEWPOINT | class::ORTHO_VIEWPOINT => Some(Self::Viewpoint),
            _ => None,
        }
    }
}

/// The nodes that are bound after events have bound or unbound some. A scene without such events
/// has none: its first bindable nodes are bound.
#[derive(Clone, Debug, PartialEq)]
pub struct BoundNodes {
    /// The bound node of each kind, by the number of the kind.
    nodes: [Option<NodeId>; BindableKind::COUNT],
    /// The transform from the viewer to the bound `Viewpoint`. It is the identity unless a
    /// `Viewpoint` with `jump FALSE` was bound, which leaves the viewer where it is.
    viewpoint_from_viewer: DMat4,
}

impl BoundNodes {
    /// Creates the record of the bound nodes, by the number of their kind.
    pub(crate) fn new(
        nodes: [Option<NodeId>; BindableKind::COUNT],
        viewpoint_from_viewer: DMat4,
    ) -> Self {
        Self {
            nodes,
            viewpoint_from_viewer,
        }
    }

    /// Returns the bound node of a kind, if there is one.
    pub fn get(&self, kind: BindableKind) -> Option<NodeId> {
        self.nodes[kind as usize]
    }

    /// Returns whether a node is bound.
    pub fn has(&self, node: NodeId) -> bool {
        self.nodes.contains(&Some(node))
    }

    /// Moves the pose of the bound `Viewpoint` to that of the viewer.
    pub fn place_viewer(&self, pose: &mut CameraPose) {
        move_viewer(pose, self.viewpoint_from_viewer);
    }
}

/// Moves a pose by a rigid transform of its own space.
pub(crate) fn move_viewer(pose: &mut CameraPose, pose_from_viewer: DMat4) {
    if pose_from_viewer != DMat4::IDENTITY {
        pose.position = pose
            .world_from_camera()
            .transform_point3(pose_from_viewer.w_axis.truncate());
        let turn = DQuat::from_mat4(&pose_from_viewer);
        pose.orientation = (pose.orientation * turn).normalize();
    }
}
