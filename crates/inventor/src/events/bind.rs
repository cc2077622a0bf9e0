//! Binds nodes, and moves the viewer to the bound `Viewpoint` (ISO 14772-1, 4.6.10 and 6.53).

use glam::DMat4;

use super::world::World;
use crate::grammar::viewpoint;
use crate::iv::{NodeId, Value};
use crate::snapshot::BindableKind;

impl World {
    /// Lets the nodes that are bound when the scene is opened say so.
    pub(super) fn announce_first(&mut self) {
        for stack in 0..BindableKind::COUNT {
            if let Some(node) = self.binding.stacks[stack].last().copied() {
                self.announce(node, true);
            }
        }
    }

    /// Obeys the event `set_bind`.
    pub(super) fn set_bind(&mut self, node: NodeId, binds: bool) {
        let Some(kind) = BindableKind::of(self.document.node(node)) else {
            return;
        };
        let top = self.binding.top(kind);
        let stack = &mut self.binding.stacks[kind as usize];
        stack.retain(|other| *other != node);
        if binds {
            stack.push(node);
        }
        let new = stack.last().copied();
        if new == top {
            return;
        }
        self.binding.is_changed = true;
        if kind == BindableKind::Viewpoint {
            self.change_viewpoint(top, new);
        }
        if let Some(old) = top {
            self.announce(old, false);
        }
        if let Some(new) = new {
            self.announce(new, true);
        }
    }

    /// Puts the viewer at a `Viewpoint` that is newly bound, or leaves it where it is.
    fn change_viewpoint(&mut self, old: Option<NodeId>, new: Option<NodeId>) {
        let binding = &mut self.binding;
        let old_from_viewer = binding.viewpoint_from_viewer;
        if let Some(old) = old {
            binding.saved.insert(old, old_from_viewer);
        }
        let saved = new.and_then(|new| binding.saved.remove(&new));
        binding.viewpoint_from_viewer = saved.unwrap_or(DMat4::IDENTITY);
        if let Some(new) = new
            && !self.document.node(new).get(viewpoint::JUMP)
        {
            let survey = self.survey();
            let view = self.viewer_at(&survey, old, old_from_viewer);
            let place = self.viewer_at(&survey, Some(new), DMat4::IDENTITY);
            self.binding.viewpoint_from_viewer =
                place.world_from_camera().inverse() * view.world_from_camera();
        }
    }

    /// Sends that a node is or is no longer bound.
    fn announce(&mut self, node: NodeId, is_bound: bool) {
        self.send(node, "isBound", &Value::Bool(is_bound));
        self.send(node, "bindTime", &Value::Double(self.now));
    }
}
