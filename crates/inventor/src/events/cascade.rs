//! What a node of the catalogue does with an event.

use super::wires::output_name;
use super::world::{Event, World};
use crate::grammar::{FieldType, class};
use crate::iv::{NodeId, NodeRef, Value};
use crate::snapshot::engines::convert::to_type;
use crate::snapshot::engines::edges::{Slot, slot};
use crate::snapshot::engines::sensors::interpolate;

impl World {
    /// Delivers an event to a node that is not a script. A node without that event ignores it.
    pub fn deliver(&mut self, event: &Event) {
        let node = self.document.node(event.to);
        let to = node.id;
        let Some(slot) = slot(node, &event.input) else {
            return;
        };
        let (Slot::Field(_, kind) | Slot::Input(_, kind)) = slot;
        let Some(value) = to_type(&event.value, kind) else {
            let name = node.class_name();
            let message = format!(
                "an event for `{}` of `{name}` does not convert to {}",
                event.input,
                kind.name()
            );
            self.warn(to, message);
            return;
        };
        match slot {
            Slot::Field(index, kind) => self.set_field(to, index, kind, value),
            Slot::Input("set_fraction", _) => self.interpolate(to, &value),
            Slot::Input("set_bind", _) => self.set_bind(to, value == Value::Bool(true)),
            Slot::Input("addChildren", _) => self.change_children(to, &value, true),
            Slot::Input("removeChildren", _) => self.change_children(to, &value, false),
            Slot::Input(..) => {}
        }
    }

    /// Sets a field and sends the event that it has changed.
    fn set_field(&mut self, id: NodeId, index: u16, kind: FieldType, value: Value) {
        let document = &self.document;
        let Some(class) = document.node(id).class() else {
            return;
        };
        let name = class.fields[usize::from(index)].name;
        if let Some(timer) = self.timers.get_mut(&id)
            && !timer.accepts(NodeRef { document, id }, name, &value)
        {
            return;
        }
        self.holds_new_nodes |= matches!(kind, FieldType::SFNode | FieldType::MFNode);
        let output = output_name(self.document.node(id), name);
        self.send(id, output, &value);
        self.document.store(id, index, value);
    }

    /// Sends the value of an interpolator at a fraction.
    fn interpolate(&mut self, id: NodeId, fraction: &Value) {
        let node = self.document.node(id);
        let (Some(class), Value::Float(fraction)) = (node.class_id(), fraction) else {
            return;
        };
        if let Some(value) = interpolate(node, class, *fraction) {
            self.send(id, "value_changed", &value);
        }
    }

    /// Adds nodes to a group's children or removes them. A child that a group has already is not
    /// added again, and one that it does not have is not removed (VRML97, 4.6.5).
    fn change_children(&mut self, id: NodeId, nodes: &Value, add: bool) {
        let (node, Value::Nodes(nodes)) = (self.document.node(id), nodes) else {
            return;
        };
        let Some((index, decl)) = node.class().and_then(|c| c.field("children")) else {
            return;
        };
        let mut children = match node.value("children") {
            Some(Value::Nodes(children)) => children.clone(),
            _ => Vec::new(),
        };
        if add {
            for node in nodes {
                if !children.contains(node) {
                    children.push(*node);
                }
            }
        } else {
            children.retain(|child| !nodes.contains(child));
        }
        self.set_field(id, index as u16, decl.kind, Value::Nodes(children));
    }
}

/// Returns whether a node is a `Script`.
pub(super) fn is_script(node: NodeRef<'_>) -> bool {
    node.known_class().is_some_and(|c| c.id == class::SCRIPT)
}
