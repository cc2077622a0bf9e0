//! What a script can reach: the fields, events and routes of nodes, also of instances of protos.

use super::cascade::is_script;
use super::log::MAX_LOGGED;
use super::survey::WorldSurvey;
use super::wires::output_name;
use super::world::{Event, World};
use crate::grammar::FieldType;
use crate::iv::declarations::{Access, Interface};
use crate::iv::{ClassRef, NodeId, NodeRef, Value, value_text};
use crate::snapshot::SentEvent;
use crate::snapshot::engines::edges::{Slot, slot};
use crate::snapshot::engines::sensors::interpolate;

impl World {
    /// Returns the class of a node, for messages.
    pub fn class_name(&self, id: NodeId) -> String {
        let is_known = (id.0 as usize) < self.document.nodes.len();
        let name = is_known.then(|| {
            NodeRef {
                document: &self.document,
                id,
            }
            .class_name()
        });
        name.unwrap_or("node").to_owned()
    }

    /// Returns the type and value of a node's field.
    pub fn field(&self, id: NodeId, name: &str) -> Option<(FieldType, Value)> {
        if id.0 as usize >= self.document.nodes.len() {
            return None;
        }
        let ends = self.document.event_ends(id, name);
        let end = ends.into_iter().next().unwrap_or_else(|| (id, name.into()));
        let document = &self.document;
        let node = NodeRef {
            document,
            id: end.0,
        };
        let short = end.1.strip_prefix("set_").unwrap_or(&end.1);
        let short = short.strip_suffix("_changed").unwrap_or(short);
        let field = [&*end.1, short].into_iter().find_map(|name| {
            let kind = match node.data().class {
                ClassRef::Known(class) => class.get().field(name)?.1.kind,
                ClassRef::Extension(i) => {
                    let fields = &document.extensions[i as usize].fields;
                    fields.iter().find(|(n, _)| **n == *name)?.1
                }
            };
            Some((kind, node.value(name)?.clone()))
        });
        field.or_else(|| self.output(node, &end.1))
    }

    /// Returns the type and value of an output: the value that it had last, or before that an
    /// interpolator's first value, or the default of its type (ISO 14772-1, 4.6.8).
    fn output(&self, node: NodeRef<'_>, name: &str) -> Option<(FieldType, Value)> {
        let name = output_name(node, name);
        let kind = self.output_type(node.id, name)?;
        let last = self.last_output(&(node.id, name.into()));
        let first = || interpolate(node, node.class_id()?, f32::NEG_INFINITY);
        Some((
            kind,
            last.or_else(first).unwrap_or_else(|| Value::empty(kind)),
        ))
    }

    /// Returns the type of an event that a node receives.
    pub fn input_type(&self, id: NodeId, name: &str) -> Option<FieldType> {
        if id.0 as usize >= self.document.nodes.len() {
            return None;
        }
        let ends = self.document.event_ends(id, name);
        ends.into_iter().find_map(|(id, name)| {
            let node = NodeRef {
                document: &self.document,
                id,
            };
            if let ClassRef::Extension(i) = node.data().class {
                return script_input(&self.document.extensions[i as usize].interface, &name);
            }
            let (Slot::Field(_, kind) | Slot::Input(_, kind)) = slot(node, &name)?;
            Some(kind)
        })
    }

    /// Records an event, if the events are recorded.
    pub(super) fn log(&mut self, from: NodeId, event: &str, value: &Value) {
        let Some(log) = &mut self.log else { return };
        if log.sent.len() >= MAX_LOGGED {
            if !std::mem::replace(&mut log.is_full, true) {
                self.limit(format!(
                    "more than {MAX_LOGGED} events are sent; the rest is not listed"
                ));
            }
            return;
        }
        let kind = self.field(from, event);
        let kind = kind.map_or(FieldType::SFTrigger, |(kind, _)| kind);
        let sent = SentEvent {
            time: self.now,
            node: self.logged_name(from),
            event: event.to_owned(),
            value: match value {
                Value::Node(Some(node)) => self.logged_name(*node),
                Value::Nodes(nodes) if !nodes.is_empty() => {
                    let nodes = nodes.iter().map(|node| self.logged_name(*node));
                    format!("[ {} ]", nodes.collect::<Vec<_>>().join(", "))
                }
                _ => value_text(value, kind),
            },
        };
        if let Some(log) = &mut self.log {
            log.sent.push(sent);
        }
    }

    /// Returns a node's name in the main file, or its class if it has none.
    fn logged_name(&self, id: NodeId) -> String {
        let names = self.log.as_ref().map(|log| &log.names);
        let is_known = (id.0 as usize) < self.document.nodes.len();
        let id = if is_known {
            self.document.node(id).id
        } else {
            id
        };
        let name = names.and_then(|names| names.get(&id));
        name.map_or_else(|| self.class_name(id), |name| name.to_string())
    }

    /// Sends an event to a node. A node of the catalogue has it at once, so that a script sees what
    /// it wrote; a script has it when its turn comes.
    pub fn send_directly(&mut self, id: NodeId, name: &str, value: &Value) {
        for (to, input) in self.document.event_ends(id, name) {
            let document = &self.document;
            let waits = is_script(NodeRef { document, id: to });
            let value = value.clone();
            let event = Event { to, input, value };
            if waits {
                self.post(event);
            } else {
                self.deliver(&event);
            }
        }
    }

    /// Adds or deletes the routes between two events.
    pub fn change_route(&mut self, adds: bool, from: (NodeId, &str), to: (NodeId, &str)) {
        let nodes = self.document.nodes.len() as u32;
        if from.0.0 >= nodes || to.0.0 >= nodes {
            return;
        }
        let sources = self.document.event_ends(from.0, from.1);
        let targets = self.document.event_ends(to.0, to.1);
        for (id, output) in &sources {
            let node = NodeRef {
                document: &self.document,
                id: *id,
            };
            let source = (*id, output_name(node, output).into());
            for target in &targets {
                if adds {
                    self.wires.add(source.clone(), target.clone());
                } else {
                    self.wires.remove(&source, target);
                }
            }
        }
    }

    /// Takes in nodes that a script has created: those from an index on, and the routes from one
    /// on.
    pub fn created(&mut self, first: usize, routes: usize) {
        let created = self.document.routes.split_off(routes);
        self.wires.extend(&self.document, &created);
        self.document.routes.extend(created);
        self.find_timers(first);
        self.find_viewer_sensors(first);
        self.leading = WorldSurvey::leading(&self.document);
        self.holds_new_nodes = true;
    }
}

/// Returns the type of an event in a script's interface. The prefix `set_` of an `exposedField` is
/// optional.
pub fn script_input(interface: &[Interface], name: &str) -> Option<FieldType> {
    let short = name.strip_prefix("set_").unwrap_or(name);
    let found = interface.iter().find(|i| match i.access {
        Access::EventIn => *i.name == *name,
        Access::ExposedField => *i.name == *name || *i.name == *short,
        Access::Field | Access::EventOut => false,
    });
    found.map(|i| i.kind)
}
