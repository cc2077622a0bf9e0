//! What a user does with a scene: sends an event to a node, or touches it.

use std::collections::BTreeSet;
use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result, nearest};

use super::wires::output_name;
use super::world::{Event, World};
use crate::grammar::{FieldType, anchor, class, vrml_sensor};
use crate::iv::{Document, Limits, NoFiles, NodeId, NodeRef, Value};
use crate::snapshot::BindableKind;
use crate::traversal::{Parents, each_child};

/// Something that a user does at a time, or that stands for it in a still picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Action {
    /// Seconds since the scene was opened.
    pub time: f64,
    /// The name of the node in the main file, or the class of a node that is the only one of it.
    pub node: String,
    /// What is done with it.
    pub what: ActionKind,
}

/// The kinds of actions.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ActionKind {
    /// Sends an event to a field or an `eventIn`, or from an `eventOut`.
    Send {
        /// The name of the event.
        event: String,
        /// Its value, as a file states it. For a node it is the node's name.
        value: String,
    },
    /// Moves the pointer over the node, presses and releases it. The sensors and the `Anchor` act
    /// that act for a shape there.
    Touch,
}

impl World {
    /// Does what a user does. The events wait.
    pub(super) fn act(&mut self, action: &Action) {
        self.document.sink.set_source(None);
        let done = match &action.what {
            ActionKind::Send { event, value } => self.send_from_user(&action.node, event, value),
            ActionKind::Touch => self.touch(&action.node),
        };
        if let Err(problem) = done {
            self.document.sink.add(*problem);
        }
    }

    /// Returns the node of a name, or the only node of a class.
    ///
    /// # Errors
    /// Returns a warning if the main file has no such name, and not exactly one node of that class.
    fn named(&self, name: &str) -> Result<NodeId> {
        let names = &self.document.names;
        if let Some(id) = names.get(name) {
            return Ok(*id);
        }
        let all = (0..self.document.nodes.len() as u32).map(NodeId);
        let of_class = all.filter(|id| self.document.node(*id).class_name() == name);
        let of_class: BTreeSet<NodeId> = of_class.map(|id| self.document.node(id).id).collect();
        if let (1, Some(id)) = (of_class.len(), of_class.first()) {
            return Ok(*id);
        }
        let warning = Diagnostic::warning(format!("no node is called `{name}`"));
        Err(match nearest(name, names.keys().map(|name| &**name)) {
            _ if !of_class.is_empty() => {
                let count = of_class.len();
                warning.with_help(format!("there are {count} of this class; `DEF` names one"))
            }
            Some(other) => warning.with_help(format!("there is `{other}`")),
            None => warning.with_help("`DEF NAME` gives a node a name"),
        })
    }

    /// Sends an event to a node, or from an output of a node.
    fn send_from_user(&mut self, name: &str, event: &str, text: &str) -> Result<()> {
        let id = self.named(name)?;
        let input = self.input_type(id, event);
        let output = self.output_type(id, event);
        let Some(kind) = input.or(output) else {
            let class = self.class_name(id);
            let message = format!("`{name}`, a `{class}`, has no event `{event}`");
            return Err(Diagnostic::warning(message)
                .with_help(format!("`ivcam nodes {class}` lists its fields and events")));
        };
        let value = self.read_value(kind, text)?;
        if input.is_some() {
            for (to, input) in self.document.event_ends(id, event) {
                let value = value.clone();
                self.post(Event { to, input, value });
            }
        } else {
            for (from, output) in self.document.event_ends(id, event) {
                self.send(from, &output, &value);
            }
        }
        Ok(())
    }

    /// Returns the type of an output of a node's class.
    pub(super) fn output_type(&self, id: NodeId, name: &str) -> Option<FieldType> {
        let node = self.document.node(id);
        let name = output_name(node, name);
        let outputs = node.class()?.outputs.iter();
        outputs.copied().find(|(n, _)| *n == name).map(|(_, k)| k)
    }

    /// Reads a value as a file states it, or finds the node of a name.
    fn read_value(&self, kind: FieldType, text: &str) -> Result<Value> {
        if matches!(kind, FieldType::SFNode | FieldType::MFNode) {
            let node = match text {
                "NULL" => None,
                name => Some(self.named(name)?),
            };
            return Ok(match kind {
                FieldType::SFNode => Value::Node(node),
                _ => Value::Nodes(node.into_iter().collect()),
            });
        }
        let kind = kind.name();
        let node =
            format!("#Inventor V2.1 ascii\nValue {{ fields [ {kind} value ] value {text}\n}}");
        let limits = Limits::default();
        let read = Document::read("the value", node.into_bytes(), Arc::new(NoFiles), &limits)?;
        let value = read.roots().next().and_then(|node| node.value("value"));
        match value {
            Some(value) if read.sink.items().is_empty() => Ok(value.clone()),
            _ => Err(Diagnostic::warning(format!(
                "`{text}` is not a value of type {kind}"
            ))),
        }
    }

    /// Touches a node.
    fn touch(&mut self, name: &str) -> Result<()> {
        let id = self.named(name)?;
        let targets = self.touched_with(id);
        if targets.is_empty() {
            let message = format!("nothing happens when `{name}` is touched");
            return Err(Diagnostic::warning(message)
                .with_help("neither a sensor nor an `Anchor` is in it, beside it or above it"));
        }
        for target in targets {
            match self.document.node(target).class_id() {
                Some(class::ANCHOR) => self.follow_anchor(target),
                _ => self.press(target),
            }
        }
        Ok(())
    }

    /// Returns the sensors and anchors that act when a node is touched: those of the lowest group
    /// that has any, from the node itself upward. All sensors of that group act together
    /// (ISO 14772-1, 4.6.7.3).
    fn touched_with(&self, id: NodeId) -> Vec<NodeId> {
        let document = &self.document;
        let id = document.node(id).id;
        let own = self.sensors_of(id);
        if !own.is_empty() {
            return own;
        }
        let parents = Parents::of(document);
        // The node, and the instance of a prototype that it represents.
        let all = (0..document.nodes.len() as u32).map(NodeId);
        let same = all.filter(|other| document.node(*other).id == id);
        let mut level: BTreeSet<NodeId> = same.collect();
        let mut known = level.clone();
        while !level.is_empty() {
            let above = level.iter().flat_map(|node| parents.of_node(*node));
            let above: BTreeSet<NodeId> = above.collect();
            let groups = above.iter().flat_map(|group| self.sensors_of(*group));
            let mut sensors: BTreeSet<NodeId> = groups.collect();
            if document.roots.iter().any(|root| level.contains(root)) {
                let roots = document.roots().filter(|node| is_sensor(*node));
                sensors.extend(roots.map(|node| node.id));
            }
            if !sensors.is_empty() {
                return sensors.into_iter().collect();
            }
            level = &above - &known;
            known.extend(&level);
        }
        Vec::new()
    }

    /// Returns what acts for the shapes below a group: the sensors among its children, and the
    /// group itself if it is an `Anchor`.
    fn sensors_of(&self, group: NodeId) -> Vec<NodeId> {
        let document = &self.document;
        let node = document.node(group);
        let mut sensors = Vec::new();
        if node.class_id() == Some(class::ANCHOR) {
            sensors.push(node.id);
        }
        each_child(document, group, |child| {
            let child = document.node(child);
            if is_sensor(child) {
                sensors.push(child.id);
            }
        });
        sensors
    }

    /// Sends what a pointing-device sensor sends when the pointer comes, presses and releases.
    fn press(&mut self, id: NodeId) {
        let node = self.document.node(id);
        if !node.get(vrml_sensor::ENABLED) {
            self.warn(id, "this sensor was touched while it is not enabled".into());
            return;
        }
        let is_touch_sensor = node.class_id() == Some(class::TOUCH_SENSOR);
        let (on, off) = (Value::Bool(true), Value::Bool(false));
        let mut events = vec![("isActive", on.clone()), ("isActive", off.clone())];
        if is_touch_sensor {
            events.insert(0, ("isOver", on));
            events.push(("touchTime", Value::Double(self.now)));
            events.push(("isOver", off));
        }
        self.cascades.extend(
            events
                .into_iter()
                .map(|(output, value)| (id, output, value)),
        );
    }

    /// Follows an `Anchor` to a `Viewpoint` of the scene, or reports where it leads.
    fn follow_anchor(&mut self, id: NodeId) {
        let url = self.document.node(id).get(anchor::URL);
        let Some(url) = url.first().cloned() else {
            return;
        };
        let name = url.strip_prefix('#').unwrap_or_default();
        let view = self.document.names.get(name).copied();
        let kind = view.and_then(|view| BindableKind::of(self.document.node(view)));
        match view {
            Some(view) if kind == Some(BindableKind::Viewpoint) => {
                self.send_directly(view, "set_bind", &Value::Bool(true));
            }
            _ => {
                let message = format!("this `Anchor` leads to `{url}`, which is not opened");
                self.warn(id, message);
            }
        }
    }
}

/// Returns whether a node is a pointing-device sensor.
fn is_sensor(node: NodeRef<'_>) -> bool {
    matches!(
        node.class_id(),
        Some(
            class::TOUCH_SENSOR
                | class::PLANE_SENSOR
                | class::CYLINDER_SENSOR
                | class::SPHERE_SENSOR
        )
    )
}
