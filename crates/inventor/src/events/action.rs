//! What a user does with a scene: sends an event to a node, touches it, or drags it.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::DVec2;
use ivcam_base::diag::{Diagnostic, Result, nearest};

use super::pointer_path::PointerPath;
use super::wires::output_name;
use super::world::{Event, World};
use crate::grammar::FieldType;
use crate::iv::{Document, Limits, NoFiles, NodeId, Value};
use crate::pose::CameraPose;

/// Something that a user does at a time, or that stands for it in a still picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Action {
    /// Seconds since the scene was opened.
    pub time: f64,
    /// The name of the node in the main file, or the class of a node that is the only one of it. It
    /// may be empty if the pointer has a place: what is there is touched.
    pub node: String,
    /// What is done with it.
    pub what: ActionKind,
    /// The viewer that sees the places of the pointer. Without it they are those of the picture.
    pub viewer: Option<CameraPose>,
}

impl Action {
    /// Returns whether what happens depends on where the viewer is.
    pub fn depends_on_viewer(&self) -> bool {
        !matches!(self.what, ActionKind::Send { .. })
    }

    /// Returns whether the pointer has a place in a picture.
    pub fn has_place(&self) -> bool {
        match &self.what {
            ActionKind::Send { .. } => false,
            ActionKind::Touch { place } => place.is_some(),
            ActionKind::Drag { .. } => true,
        }
    }
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
    Touch {
        /// Where the pointer is in the picture, as [`CameraPose::ray`] takes it. Without it the
        /// pointer is over the middle of the node's shapes, whatever is before them.
        ///
        /// [`CameraPose::ray`]: crate::pose::CameraPose::ray
        place: Option<DVec2>,
    },
    /// Presses, moves the pointer, and releases it.
    Drag {
        /// The places of the pointer in the picture. It takes the same time from each to the next.
        path: Vec<DVec2>,
        /// When the pointer is at the last place and is released, in seconds.
        end: f64,
    },
}

impl World {
    /// Does what a user does. The events wait.
    pub(super) fn act(&mut self, action: &Action) {
        self.document.sink.set_source(None);
        let (node, now) = (&action.node, action.time);
        let from = action.viewer.clone();
        let done = match &action.what {
            ActionKind::Send { event, value } => self.send_from_user(node, event, value),
            ActionKind::Touch { place } => {
                let path = place.iter().copied().collect();
                self.press(node, PointerPath::new(path, [now, now]), from)
            }
            ActionKind::Drag { path, end } => {
                self.press(node, PointerPath::new(path.clone(), [now, *end]), from)
            }
        };
        if let Err(problem) = done {
            self.document.sink.add(*problem);
        }
    }

    /// Returns the node of a name, or the only node of a class.
    ///
    /// # Errors
    /// Returns a warning if the main file has no such name, and not exactly one node of that class.
    pub(super) fn named(&self, name: &str) -> Result<NodeId> {
        let names = &self.document.names;
        if let Some(id) = names.get(name) {
            return Ok(*id);
        }
        let all = self.document.ids();
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
}
