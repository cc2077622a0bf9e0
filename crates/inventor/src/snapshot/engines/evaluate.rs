//! Evaluates the connections and routes of a document at one time.

use std::collections::{HashMap, HashSet};

use glam::DVec3;
use ivcam_base::diag::Span;
use ivcam_base::work::{self, Budget, Cut};

use super::compute::{self, EngineMoment};
use super::edges::{Edge, Slot, edges, sorted};
use super::outputs::{Outputs, Pulses};
use super::{clocks, convert};
use crate::grammar::{FieldType, class, compute_bounding_box};
use crate::iv::{Document, FieldEntry, NodeId, Value};
use crate::snapshot::at_time::Snapshot;
use crate::snapshot::bounds::{Bounds, Corners};

/// Returns the document with connected fields at their values at a time, or `None` if it has no
/// connections. Warnings are added to the copy's sink.
pub(crate) fn evaluate(document: &Document, time: f64, bounds: &dyn Bounds) -> Option<Document> {
    let edges = edges(document);
    if edges.is_empty() {
        return None;
    }
    let mut work = EngineWork {
        document: document.clone(),
        time,
        outputs: HashMap::new(),
        triggers: HashMap::new(),
        warned: HashSet::new(),
        bounds,
        boxes: 0,
        bytes: 0,
    };
    work.run(edges);
    // The values that are left are the document's, whose lists are counted when it is compiled.
    Budget::current().give_back(work.bytes);
    Some(work.document)
}

/// The largest number of bounding boxes that are computed. Each needs a traversal, so the number
/// bounds the time for hostile files. No search is recorded; an engine beyond it has no output.
const MAX_BOXES: usize = 100;

/// The state of an evaluation.
struct EngineWork<'a> {
    document: Document,
    /// The time in seconds since the scene was opened.
    time: f64,
    /// The outputs of the engines that have been computed.
    outputs: HashMap<NodeId, Outputs>,
    /// The pulses that were sent to trigger fields.
    triggers: HashMap<(NodeId, u16), Pulses>,
    /// The warnings that have been reported.
    warned: HashSet<String>,
    bounds: &'a dyn Bounds,
    /// The number of bounding boxes that have been computed.
    boxes: usize,
    /// The bytes of the account that values take.
    bytes: u64,
}

/// The bytes that an engine takes for each value of its longest input: the outputs of a
/// `ComposeMatrix`, and for a `Calculator` also its variables.
const VALUE_BYTES: usize = 64;
const CALCULATOR_BYTES: usize = 1024;
/// The steps of work that a connection takes besides its values.
const EDGE_STEPS: u64 = 50;

impl EngineWork<'_> {
    /// Delivers the values along all edges, in an order in which they are computed before use.
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

    /// Delivers the value of an edge to its target.
    fn deliver(&mut self, to: NodeId, edge: &Edge) {
        if let Slot::Field(index, FieldType::SFTrigger) = edge.slot {
            let pulses = self.pulses(edge.from, &edge.output);
            self.triggers.insert((to, index), pulses);
            return;
        }
        let (Slot::Field(_, kind) | Slot::Input(_, kind)) = edge.slot;
        self.compute_once(edge.from, edge.span);
        let output = self.output(edge.from, &edge.output);
        let Some(bytes) = output.map(Value::list_bytes) else {
            return;
        };
        if let Err(cut) = self.take(bytes) {
            return self.warn_cut(to, edge.span, cut);
        }
        let Some(value) = self.output(edge.from, &edge.output) else {
            return;
        };
        let Some(value) = convert::to_type(value, kind) else {
            let name = self.document.node(edge.from).class_name();
            let message = format!(
                "`{}` of `{name}` does not convert to {}",
                edge.output,
                kind.name()
            );
            return self.warn(to, edge.span, message);
        };
        match edge.slot {
            Slot::Input(..) => {} // Only events have an effect there.
            Slot::Field(index, _) => {
                let fields = &mut self.document.nodes[to.0 as usize].fields;
                match fields.iter_mut().find(|f| f.index == index) {
                    Some(entry) => entry.value = value,
                    None => fields.push(FieldEntry::new(index, value, edge.span)),
                }
            }
        }
    }

    /// Counts the bytes of values that are about to be made, and the work.
    fn take(&mut self, bytes: usize) -> Result<(), Cut> {
        let bytes = bytes as u64;
        work::spend(EDGE_STEPS)?;
        work::spend_bytes(bytes)?;
        self.bytes += bytes;
        Ok(())
    }

    /// Warns that values of a node are left out.
    fn warn_cut(&mut self, node: NodeId, span: Span, cut: Cut) {
        let warning = Budget::current().warning(cut);
        if self.warned.insert(warning.message.clone()) {
            let source = self.document.node(node).source();
            let warning = match source {
                Some(source) => warning.at(source, span),
                None => warning,
            };
            self.document.sink.add(*warning);
        }
    }

    /// Computes the outputs of an engine, unless they are known.
    fn compute_once(&mut self, from: NodeId, span: Span) {
        if self.outputs.contains_key(&from) {
            return;
        }
        let outputs = match self.take(self.output_bytes(from)) {
            Ok(()) => self.compute(from, span),
            Err(cut) => {
                self.warn_cut(from, span, cut);
                Vec::new()
            }
        };
        self.outputs.insert(from, outputs);
    }

    /// Returns a bound of the bytes of a node's outputs. A node that is no engine has none.
    fn output_bytes(&self, from: NodeId) -> usize {
        let node = self.document.node(from);
        let Some(class) = node.known_class() else {
            return 0;
        };
        let fields = || node.data().fields.iter().map(|field| &field.value);
        match class.id {
            class::CONCATENATE | class::GATE | class::SELECT_ONE => {
                fields().map(Value::list_bytes).sum()
            }
            _ if class.descends_from(class::ENGINE) => {
                let longest = fields().map(Value::list_len).max().unwrap_or(0);
                longest.saturating_mul(match class.id {
                    class::CALCULATOR => CALCULATOR_BYTES,
                    _ => VALUE_BYTES,
                })
            }
            _ => 0,
        }
    }

    /// Returns an output of an engine that was computed, or the value of a field.
    fn output(&self, from: NodeId, name: &str) -> Option<&Value> {
        let short = name.strip_suffix("_changed").unwrap_or(name);
        let made = &self.outputs[&from];
        if let Some((_, value)) = made.iter().find(|(n, _)| *n == name || *n == short) {
            return Some(value);
        }
        let node = self.document.node(from);
        node.value(name).or_else(|| node.value(short))
    }

    /// Returns the pulses of a node's output. Only clocks create pulses.
    fn pulses(&self, from: NodeId, output: &str) -> Pulses {
        let node = self.document.node(from);
        match node.known_class().map(|c| c.id) {
            Some(class::TIME_COUNTER) if output == "syncOut" => clocks::rounds(node, self.time),
            Some(class::TRIGGER_ANY) => {
                let mine = self.triggers.iter().filter(|((to, _), _)| *to == from);
                mine.fold(Pulses::default(), |sum, (_, p)| Pulses {
                    count: sum.count.saturating_add(p.count),
                    last: sum.last.max(p.last),
                })
            }
            _ => Pulses::default(),
        }
    }

    /// Computes the outputs of an engine.
    fn compute(&mut self, from: NodeId, span: Span) -> Outputs {
        let node = self.document.node(from);
        let Some(class) = node.known_class() else {
            return Vec::new();
        };
        if class.id == class::COMPUTE_BOUNDING_BOX {
            return self.bounding_box(from);
        }
        let moment = EngineMoment {
            time: self.time,
            fired: &|field| {
                let pulses = self.triggers.get(&(from, field.index));
                pulses.copied().unwrap_or_default()
            },
        };
        let made = compute::outputs(node, class.id, &moment);
        made.unwrap_or_else(|message| {
            match Budget::current().cut() {
                Some(cut) => self.warn_cut(from, span, cut),
                None => self.warn(from, span, message),
            }
            Vec::new()
        })
    }

    /// Computes the outputs of a `ComputeBoundingBox`.
    fn bounding_box(&mut self, engine: NodeId) -> Outputs {
        let node = self.document.node(engine);
        let subject = node
            .get_node(compute_bounding_box::NODE)
            .or_else(|| node.get_node(compute_bounding_box::PATH));
        let Some(subject) = subject.map(|s| s.id).filter(|_| self.boxes < MAX_BOXES) else {
            return Vec::new();
        };
        self.boxes += 1;
        let roots = std::mem::replace(&mut self.document.roots, vec![subject]);
        let found = self
            .bounds
            .of_roots(&Snapshot::of_part(&self.document, self.time));
        self.document.roots = roots;
        found.map(corners).unwrap_or_default()
    }
}

/// Returns the outputs of a `ComputeBoundingBox`. Inventor's `objectCenter` is the box's center
/// unless an action sets another one; here it always is.
fn corners((min, max): Corners) -> Outputs {
    let vector = |v: DVec3| Value::Vec3(v.as_vec3());
    let center = vector(0.5 * (min + max));
    vec![
        ("min", vector(min)),
        ("max", vector(max)),
        ("boxCenter", center.clone()),
        ("objectCenter", center),
    ]
}
