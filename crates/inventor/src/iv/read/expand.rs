//! Expands the instances of protos, and connects routes to the nodes of their bodies.
//!
//! The body of a proto is a template that is not part of the scene. An instance is a node with the
//! fields that the file states. Expanding it makes a copy of the body whose `IS` fields have the
//! instance's values. [`Document::expansions`] maps the instance to the first node of the copy.

use std::collections::HashMap;

use ivcam_base::diag::{Result, Span, excerpt};
use ivcam_base::work::{self, Budget};

use super::stated::StatedPlaces;
use crate::grammar::FieldType;
use crate::grammar::value::{NodeId, Value};
use crate::iv::declarations::{EventBinding, Link, Route};
use crate::iv::document::{ClassRef, Document, FieldEntry};
use crate::iv::limits::{Limits, beyond, cut_at};

/// The steps of work that a copy of a node takes.
const COPY_STEPS: u64 = 500;
/// The steps of work that a link, a route or an event takes.
const LINK_STEPS: u64 = 20;

/// Expands an instance, and the instances in its body.
///
/// # Errors
/// Returns an error if the limit of copies, of nodes or of bytes is exceeded.
pub(super) fn expand(document: &mut Document, instance: NodeId, limits: &Limits) -> Result<()> {
    let mut work = vec![instance];
    let mut expanded = Vec::new();
    while let Some(instance) = work.pop() {
        let Some(proto) = proto_of(document, instance) else {
            continue;
        };
        let proto = document.protos.list[proto].clone();
        let Some(&first) = proto.body.first() else {
            continue;
        };
        let mut copies = HashMap::new();
        for &root in &proto.body {
            copy(document, root, &mut copies, limits)?;
        }
        let mut event_bindings = Vec::new();
        let counts = proto.links.len() + proto.routes.len() + proto.interface.len();
        count_steps(document, instance, LINK_STEPS * counts as u64)?;
        let mut stated = StatedValues {
            extension: proto.extension,
            instance: (instance, StatedPlaces::default()),
            defaults: (proto.defaults, StatedPlaces::default()),
        };
        for link in &proto.links {
            // A linked node may be missing from the copy, because nodes in unknown fields are
            // dropped.
            if let Some(&node) = copies.get(&link.node) {
                fill(document, &mut stated, link, node, &mut copies, limits)?;
                event_bindings.push((link.interface.clone(), node, link.name.clone()));
            }
        }
        document
            .protos
            .event_bindings
            .insert(instance, event_bindings);
        for route in &proto.routes {
            let end = |id: &NodeId| copies.get(id).copied().unwrap_or(*id);
            let route = Route {
                from: end(&route.from),
                to: end(&route.to),
                ..route.clone()
            };
            document.routes.push(route);
        }
        document.expansions.insert(instance, copies[&first]);
        expanded.push(instance);
        let mut inner: Vec<NodeId> = copies
            .into_values()
            .filter(|&id| proto_of(document, id).is_some())
            .collect();
        inner.sort();
        work.extend(inner.into_iter().rev());
    }
    // The first node of a body may be an instance itself. Its node is known before those around it.
    for instance in expanded.into_iter().rev() {
        if let Some(&node) = document.expansions.get(&document.expansions[&instance]) {
            document.expansions.insert(instance, node);
        }
    }
    Ok(())
}

/// Counts steps of work for a node.
///
/// # Errors
/// Returns an error if the scene's account is used up, or if reading has to end.
fn count_steps(document: &Document, id: NodeId, steps: u64) -> Result<()> {
    let span = document.nodes[id.0 as usize].span;
    work::spend(steps).map_err(|cut| cut_at(&document.sink, span, cut))
}

/// Returns the index of the proto that a node is an instance of.
pub(super) fn proto_of(document: &Document, node: NodeId) -> Option<usize> {
    match document.nodes[node.0 as usize].class {
        ClassRef::Extension(i) => document.protos.of_extension(i),
        ClassRef::Known(_) => None,
    }
}

/// Copies a node of a template and all nodes below it. A node that is used twice is copied once.
fn copy(
    document: &mut Document,
    root: NodeId,
    copies: &mut HashMap<NodeId, NodeId>,
    limits: &Limits,
) -> Result<NodeId> {
    let mut order = Vec::new();
    let mut stack = vec![root];
    while let Some(id) = stack.pop() {
        if copies.contains_key(&id) {
            continue;
        }
        document.protos.copies += 1;
        let span = document.nodes[id.0 as usize].span;
        count_steps(document, id, COPY_STEPS)?;
        if document.protos.copies > limits.copies {
            let message = format!("protos expand to more than {} nodes", limits.copies);
            return Err(beyond(&document.sink, span, message, "copies"));
        }
        if document.nodes.len() >= limits.nodes {
            let message = format!("the scene has more than {} nodes", limits.nodes);
            return Err(beyond(&document.sink, span, message, "nodes"));
        }
        let fields = document.nodes[id.0 as usize].fields.iter();
        let bytes = fields.map(|field| field.value.list_bytes()).sum();
        count_bytes(document, id, bytes, limits)?;
        let node = document.nodes[id.0 as usize].clone();
        stack.extend(&node.children);
        for field in &node.fields {
            match &field.value {
                Value::Node(Some(target)) => stack.push(*target),
                Value::Nodes(targets) => stack.extend(targets),
                _ => {}
            }
            stack.extend(field.connection.iter().map(|c| c.from));
        }
        let new = document.add(node);
        copies.insert(id, new);
        order.push(new);
    }
    let redirect = |id: &mut NodeId| *id = copies.get(id).copied().unwrap_or(*id);
    for id in order {
        let node = &mut document.nodes[id.0 as usize];
        node.children.iter_mut().for_each(redirect);
        for field in &mut node.fields {
            match &mut field.value {
                Value::Node(Some(target)) => redirect(target),
                Value::Nodes(targets) => targets.iter_mut().for_each(redirect),
                _ => {}
            }
            if let Some(connection) = &mut field.connection {
                redirect(&mut connection.from);
            }
        }
    }
    Ok(copies[&root])
}

/// Counts the lists of a copy.
///
/// # Errors
/// Returns an error if all copies together have more bytes than one file may have.
fn count_bytes(document: &mut Document, id: NodeId, bytes: usize, limits: &Limits) -> Result<()> {
    count_steps(document, id, bytes as u64 / 8)?;
    let copied = document.protos.copied_bytes.saturating_add(bytes);
    document.protos.copied_bytes = copied;
    if copied <= limits.bytes {
        return Ok(());
    }
    let message = format!("protos expand to more than {} bytes", limits.bytes);
    let span = document.nodes[id.0 as usize].span;
    Err(beyond(&document.sink, span, message, "bytes"))
}

/// The values that an instance states, and the defaults of its proto.
struct StatedValues {
    /// The class of the proto.
    extension: u32,
    instance: (NodeId, StatedPlaces),
    defaults: (NodeId, StatedPlaces),
}

impl StatedValues {
    /// Returns the value of a field of the interface.
    fn value(
        (id, places): &mut (NodeId, StatedPlaces),
        document: &Document,
        index: usize,
    ) -> Option<Value> {
        let fields = &document.nodes[id.0 as usize].fields;
        let place = places.place(fields, index as u16)?;
        Some(fields[place].value.clone())
    }
}

/// Sets a field of the body's copy to the value that the instance states, or to the default of the
/// interface.
fn fill(
    document: &mut Document,
    stated: &mut StatedValues,
    link: &Link,
    node: NodeId,
    copies: &mut HashMap<NodeId, NodeId>,
    limits: &Limits,
) -> Result<()> {
    let fields = &document.extensions[stated.extension as usize].fields;
    let Some(source) = fields.place(&link.interface) else {
        return Ok(()); // The link is for an event, which has no value.
    };
    let kind = fields[source].1;
    let Some((index, inner_kind)) = field_of(document, node, &link.name) else {
        return Ok(());
    };
    if kind != inner_kind {
        let span = document.nodes[node.0 as usize].span;
        let message = format!(
            "`{}` is a {} and cannot be `{}`, which is a {}",
            excerpt(&link.name),
            inner_kind.name(),
            excerpt(&link.interface),
            kind.name()
        );
        document.sink.warn(span, message);
        return Ok(());
    }
    let value = match StatedValues::value(&mut stated.instance, document, source) {
        Some(value) => value,
        None => match StatedValues::value(&mut stated.defaults, document, source) {
            // Nodes in a default are part of the template, so each instance gets its own copy.
            Some(Value::Node(Some(id))) => Value::Node(Some(copy(document, id, copies, limits)?)),
            Some(Value::Nodes(ids)) => {
                let ids = ids.into_iter().map(|id| copy(document, id, copies, limits));
                Value::Nodes(ids.collect::<Result<_>>()?)
            }
            Some(value) => value,
            None => return Ok(()),
        },
    };
    count_bytes(document, node, value.list_bytes(), limits)?;
    let fields = &mut document.nodes[node.0 as usize].fields;
    fields.retain(|f| f.index != index);
    fields.push(FieldEntry::new(index, value, Span::default()));
    Ok(())
}

/// Finds a field by its name or by the names of its events, `set_name` and `name_changed`.
fn field_of(document: &Document, node: NodeId, name: &str) -> Option<(u16, FieldType)> {
    let find = |name: &str| match document.nodes[node.0 as usize].class {
        ClassRef::Known(id) => id.get().field(name).map(|(i, f)| (i as u16, f.kind)),
        ClassRef::Extension(i) => {
            let fields = &document.extensions[i as usize].fields;
            let i = fields.place(name)?;
            Some((i as u16, fields[i].1))
        }
    };
    find(name).or_else(|| find(field_of_event(name)))
}

/// Returns the name of an exposed field from the name of one of its events.
pub(super) fn field_of_event(name: &str) -> &str {
    let name = name.strip_prefix("set_").unwrap_or(name);
    name.strip_suffix("_changed").unwrap_or(name)
}

/// Replaces the ends of routes that are instances of protos by the nodes of their bodies.
pub(super) fn resolve_routes(document: &mut Document) {
    document.stated_routes = document
        .routes
        .iter()
        .filter(|r| r.stated)
        .cloned()
        .collect();
    let routes = std::mem::take(&mut document.routes);
    for route in routes {
        let sources = route_ends(document, route.from, &route.output);
        let targets = route_ends(document, route.to, &route.input);
        let pairs = (sources.len() * targets.len()) as u64;
        if let Err(cut) = work::spend(LINK_STEPS * pairs) {
            document.sink.add(*Budget::current().warning(cut));
            return;
        }
        for (from, output) in &sources {
            for (to, input) in &targets {
                document.routes.push(Route {
                    from: *from,
                    output: output.clone(),
                    to: *to,
                    input: input.clone(),
                    stated: route.stated,
                });
            }
        }
    }
}

/// Returns the nodes that an event of a node belongs to, with its name in each. For a node that is
/// not an instance of a proto this is the node itself.
pub(super) fn route_ends(document: &Document, node: NodeId, name: &str) -> Vec<(NodeId, Box<str>)> {
    let mut out = Vec::new();
    let mut work = vec![(node, Box::<str>::from(name))];
    while let Some((node, name)) = work.pop() {
        let Some(event_bindings) = document.protos.event_bindings.get(&node) else {
            out.push((node, name));
            continue;
        };
        if work::spend(1 + event_bindings.len() as u64).is_err() {
            return Vec::new(); // Whoever follows is cut too, and says so.
        }
        let same =
            |p: &&EventBinding| *p.0 == *name || field_of_event(&p.0) == field_of_event(&name);
        work.extend(
            event_bindings
                .iter()
                .filter(same)
                .map(|(_, inner, name)| (*inner, name.clone())),
        );
    }
    out
}
