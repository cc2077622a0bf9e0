//! Engines, connections and routes: values that come from other values, worked out at one time.
//!
//! Inventor's `=` connections and VRML97's `ROUTE`s are followed from the fields that have them
//! back to engines, sensors and other fields, once, at the time asked for; the walk then sees
//! plain values. Time 0 is when the scene was opened. Nobody has clicked or will, so triggers come
//! from clocks alone. Scripts do not run.

mod calculator;
mod compute;
mod convert;
mod lists;
mod matrix;
mod sensors;

use std::collections::{HashMap, HashSet};

use glam::DVec3;

use super::read::Fields;
use crate::diag::Span;
use crate::grammar::FieldType;
use crate::iv::document::ClassRef;
use crate::iv::{Document, FieldEntry, NodeId, NodeRef, Value};

/// The box (smallest and largest corner) around what a document draws, for
/// `ComputeBoundingBox`: the caller answers, since it can draw. The document it is given has the
/// node in question as its only root, and the connections before that node worked out.
pub type BoundsOf<'a> = dyn Fn(&Document) -> Option<(DVec3, DVec3)> + 'a;

/// The document with connected fields at their values at `time`; `None` where nothing changes.
pub fn at_time(document: &Document, time: f64) -> Option<Document> {
    at_time_with(document, time, &|_| None)
}

/// The same, with an answer for `ComputeBoundingBox`. Warnings are added to the copy's sink.
pub fn at_time_with(document: &Document, time: f64, bounds: &BoundsOf<'_>) -> Option<Document> {
    let edges = edges(document);
    if edges.is_empty() {
        return None;
    }
    let mut work = Work {
        document: document.clone(),
        time: if time.is_finite() { time } else { 0.0 },
        inputs: HashMap::new(),
        outputs: HashMap::new(),
        triggers: HashMap::new(),
        warned: HashSet::new(),
        bounds,
        boxes: 0,
    };
    work.run(edges);
    Some(work.document)
}

/// Boxes asked for; each is a walk.
const MAX_BOXES: usize = 100;

/// Where a value goes.
#[derive(Clone, Debug, PartialEq)]
enum Slot {
    Field(u16, FieldType),
    /// A VRML97 `eventIn` that is not a field.
    Input(&'static str, FieldType),
}

/// A connection or route.
#[derive(Clone, Debug)]
struct Edge {
    from: NodeId,
    output: Box<str>,
    slot: Slot,
    span: Span,
}

/// What flows into each node that anything flows into, in the order of the file.
fn edges(document: &Document) -> Vec<(NodeId, Vec<Edge>)> {
    let mut out: Vec<(NodeId, Vec<Edge>)> = Vec::new();
    for index in 0..document.nodes.len() {
        let id = NodeId(index as u32);
        let node = NodeRef { document, id };
        let mut into: Vec<Edge> = Vec::new();
        for entry in &document.nodes[index].fields {
            if let Some(connection) = &entry.connection
                && let Some(kind) = field_type(node, entry.index)
            {
                into.push(Edge {
                    from: document.node(connection.from).id,
                    output: connection.output.clone(),
                    slot: Slot::Field(entry.index, kind),
                    span: entry.span,
                });
            }
        }
        if !into.is_empty() {
            out.push((id, into));
        }
    }
    let mut places: HashMap<NodeId, usize> = out
        .iter()
        .enumerate()
        .map(|(i, (id, _))| (*id, i))
        .collect();
    for route in &document.routes {
        let to = document.node(route.to);
        let Some(slot) = slot(to, &route.input) else {
            continue; // a script's, or of a class that is not drawn
        };
        let edge = Edge {
            from: document.node(route.from).id,
            output: route.output.clone(),
            slot,
            span: to.span(),
        };
        let place = *places.entry(to.id).or_insert_with(|| {
            out.push((to.id, Vec::new()));
            out.len() - 1
        });
        out[place].1.push(edge);
    }
    out
}

fn field_type(node: NodeRef<'_>, index: u16) -> Option<FieldType> {
    let index = usize::from(index);
    match node.data().class {
        ClassRef::Known(id) => id.get().fields.get(index).map(|f| f.kind),
        ClassRef::Extension(i) => {
            let fields = &node.document.extensions[i as usize].fields;
            fields.get(index).map(|f| f.1)
        }
    }
}

/// The field or input that a route's `TO` names; `set_` before a field's name is dropped.
fn slot(node: NodeRef<'_>, name: &str) -> Option<Slot> {
    let class = node.class()?;
    let short = name.strip_prefix("set_").unwrap_or(name);
    let field = class.field(name).or_else(|| class.field(short));
    if let Some((index, decl)) = field {
        return Some(Slot::Field(index as u16, decl.kind));
    }
    let input = class.inputs.iter().find(|(n, _)| *n == name || *n == short);
    input.map(|&(name, kind)| Slot::Input(name, kind))
}

/// How often a trigger has fired by now, and when it last did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Pulses {
    count: u64,
    last: f64,
}

/// Values by the names of an engine's outputs.
type Outputs = Vec<(&'static str, Value)>;

struct Work<'a> {
    document: Document,
    time: f64,
    /// What has arrived at inputs that are not fields.
    inputs: HashMap<(NodeId, &'static str), Value>,
    outputs: HashMap<NodeId, Outputs>,
    /// What has come to the fields that are triggers.
    triggers: HashMap<(NodeId, u16), Pulses>,
    warned: HashSet<String>,
    bounds: &'a BoundsOf<'a>,
    boxes: usize,
}

impl Work<'_> {
    fn run(&mut self, edges: Vec<(NodeId, Vec<Edge>)>) {
        let (order, cut) = sorted(&edges);
        for (place, which) in &cut {
            let (id, into) = &edges[*place];
            let name = self.document.node(*id).class_name().to_owned();
            let span = into[*which].span;
            let message = format!("a connection of `{name}` leads back to itself and is left out");
            self.warn(*id, span, message);
        }
        for place in order {
            let (id, into) = &edges[place];
            for (which, edge) in into.iter().enumerate() {
                if !cut.contains(&(place, which)) {
                    self.deliver(*id, edge);
                }
            }
        }
    }

    fn warn(&mut self, node: NodeId, span: Span, message: String) {
        if self.warned.insert(message.clone()) {
            let source = self.document.node(node).source().cloned();
            let before = self.document.sink.set_source(source);
            self.document.sink.warn(span, message);
            self.document.sink.set_source(before);
        }
    }

    fn deliver(&mut self, to: NodeId, edge: &Edge) {
        if let Slot::Field(index, FieldType::SFTrigger) = edge.slot {
            let pulses = self.pulses(edge.from, &edge.output);
            self.triggers.insert((to, index), pulses);
            return;
        }
        let Some(value) = self.output(edge.from, &edge.output, edge.span) else {
            return;
        };
        let (Slot::Field(_, kind) | Slot::Input(_, kind)) = edge.slot;
        let Some(value) = convert::to_type(&value, kind) else {
            let name = self.document.node(edge.from).class_name();
            let message = format!(
                "`{}` of `{name}` does not convert to {}",
                edge.output,
                kind.name()
            );
            return self.warn(to, edge.span, message);
        };
        match edge.slot {
            Slot::Input(name, _) => {
                self.inputs.insert((to, name), value);
            }
            Slot::Field(index, _) => {
                let fields = &mut self.document.nodes[to.0 as usize].fields;
                match fields.iter_mut().find(|f| f.index == index) {
                    Some(entry) => entry.value = value,
                    None => fields.push(FieldEntry {
                        index,
                        value,
                        ignored: false,
                        connection: None,
                        span: edge.span,
                    }),
                }
            }
        }
    }

    /// What comes out of a node under a name: of an engine or sensor, or the value of a field.
    fn output(&mut self, from: NodeId, name: &str, span: Span) -> Option<Value> {
        if !self.outputs.contains_key(&from) {
            let outputs = self.compute(from, span);
            self.outputs.insert(from, outputs);
        }
        let short = name.strip_suffix("_changed").unwrap_or(name);
        let made = &self.outputs[&from];
        if let Some((_, value)) = made.iter().find(|(n, _)| *n == name || *n == short) {
            return Some(value.clone());
        }
        let node = self.document.node(from);
        let value = node.value(name).or_else(|| node.value(short))?;
        Some(value.clone())
    }

    /// The trigger that comes out of a node. Clocks alone give any by themselves.
    fn pulses(&self, from: NodeId, output: &str) -> Pulses {
        let node = self.document.node(from);
        match node.known_class().map(|c| c.name) {
            Some("TimeCounter") if output == "syncOut" => compute::rounds(node, self.time),
            Some("TriggerAny") => {
                let mine = self.triggers.iter().filter(|((to, _), _)| *to == from);
                mine.fold(Pulses::default(), |sum, (_, p)| Pulses {
                    count: sum.count.saturating_add(p.count),
                    last: sum.last.max(p.last),
                })
            }
            _ => Pulses::default(),
        }
    }

    fn compute(&mut self, from: NodeId, span: Span) -> Outputs {
        let node = self.document.node(from);
        let Some(class) = node.known_class() else {
            return Vec::new();
        };
        let made = match class.name {
            "ComputeBoundingBox" => Ok(self.bounding_box(from)),
            _ => match sensors::outputs(node, class.name, self.time, &self.inputs) {
                Some(outputs) => Ok(outputs),
                None => {
                    let fired = |name: &str| {
                        let index = class.field(name).map(|(i, _)| i as u16);
                        let pulses = index.and_then(|i| self.triggers.get(&(from, i)));
                        pulses.copied().unwrap_or_default()
                    };
                    compute::outputs(node, class.name, self.time, &fired)
                }
            },
        };
        made.unwrap_or_else(|message| {
            self.warn(from, span, message);
            Vec::new()
        })
    }

    fn bounding_box(&mut self, engine: NodeId) -> Outputs {
        let node = self.document.node(engine);
        let subject = node.node_in("node").or_else(|| node.node_in("path"));
        let Some(subject) = subject.map(|s| s.id).filter(|_| self.boxes < MAX_BOXES) else {
            return Vec::new();
        };
        self.boxes += 1;
        let roots = std::mem::replace(&mut self.document.roots, vec![subject]);
        let found = (self.bounds)(&self.document);
        self.document.roots = roots;
        found.map(compute::corners).unwrap_or_default()
    }
}

/// The places of nodes so that each comes after those it takes values from, and the edges (place,
/// number) left out because they close a circle. Depth first, without recursion.
fn sorted(edges: &[(NodeId, Vec<Edge>)]) -> (Vec<usize>, HashSet<(usize, usize)>) {
    #[derive(Clone, Copy, PartialEq)]
    enum Mark {
        New,
        Open,
        Done,
    }
    let places: HashMap<NodeId, usize> = edges
        .iter()
        .enumerate()
        .map(|(i, (id, _))| (*id, i))
        .collect();
    let mut marks = vec![Mark::New; edges.len()];
    let mut order = Vec::with_capacity(edges.len());
    let mut cut = HashSet::new();
    for start in 0..edges.len() {
        if marks[start] != Mark::New {
            continue;
        }
        marks[start] = Mark::Open;
        let mut stack = vec![(start, 0)];
        while let Some((place, next)) = stack.last_mut() {
            let (place, which) = (*place, *next);
            let Some(edge) = edges[place].1.get(which) else {
                marks[place] = Mark::Done;
                order.push(place);
                stack.pop();
                continue;
            };
            *next += 1;
            if let Some(&from) = places.get(&edge.from) {
                match marks[from] {
                    Mark::New => {
                        marks[from] = Mark::Open;
                        stack.push((from, 0));
                    }
                    Mark::Open => {
                        cut.insert((place, which));
                    }
                    Mark::Done => {}
                }
            }
        }
    }
    (order, cut)
}

#[cfg(test)]
mod tests;
