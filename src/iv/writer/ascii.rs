//! Writes text: Inventor V2.1, or VRML97 for a document of that kind.
//!
//! Nodes wait on a `Vec`, not on the program's stack.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::fmt::Write as _;

use super::spelling::{
    Tokens, bit_names, class_name, described, enumeration, field_order, has_type_first,
};
use crate::grammar::{FieldType, class, path};
use crate::iv::document::{ClassRef, Document, Extension, FieldEntry, Route};
use crate::iv::proto::{Interface, Proto};
use crate::iv::value::{Image, NodeId, Rotation, Value};

pub fn write(document: &Document) -> Vec<u8> {
    Ascii::new(document).document()
}

/// Deeper nodes stand no further right: a file may nest a hundred thousand.
const DEEPEST_INDENT: usize = 40;

/// What is left to write, the next last.
enum Task<'d> {
    Node(NodeId),
    Field(NodeId, usize),
    /// After a field's value: `~` and the connection.
    Tail(NodeId, usize),
    Output(&'d str),
    Close,
    Text(Cow<'static, str>),
    Line,
    Indent(i32),
    Interface(NodeId, &'d Interface),
}

struct Ascii<'d> {
    document: &'d Document,
    vrml97: bool,
    out: String,
    indent: usize,
    /// The first of two passes, which only notes the order of nodes.
    dry: bool,
    met: Vec<NodeId>,
    written: HashSet<NodeId>,
    tokens: Tokens,
    /// `IS` of the proto being written.
    links: HashMap<NodeId, Vec<(&'d str, &'d str)>>,
    proto_names: HashMap<u32, String>,
    /// The protos to write, by the one in whose body they are.
    within: HashMap<Option<usize>, Vec<usize>>,
    /// The classes of protos that some node has.
    instanced: HashSet<u32>,
}

impl<'d> Ascii<'d> {
    fn new(document: &'d Document) -> Self {
        Self {
            document,
            vrml97: document.is_vrml97(),
            out: String::new(),
            indent: 0,
            dry: false,
            met: Vec::new(),
            written: HashSet::new(),
            tokens: Tokens::default(),
            links: HashMap::new(),
            proto_names: HashMap::new(),
            within: HashMap::new(),
            instanced: instanced(document),
        }
    }

    fn document(mut self) -> Vec<u8> {
        self.out.push_str(if self.vrml97 {
            "#VRML V2.0 utf8\n\n"
        } else {
            "#Inventor V2.1 ascii\n\n"
        });
        self.within = protos_by_body(self.document);
        self.protos_within(None);
        let roots = &self.document.roots;
        self.scope(roots, &self.document.stated_routes);
        self.out.into_bytes()
    }

    /// Nodes and routes with names of their own, twice: to see what is used again, and to write.
    fn scope(&mut self, nodes: &'d [NodeId], routes: &'d [Route]) {
        let tasks = |_: &mut Self| -> Vec<Task<'d>> {
            nodes
                .iter()
                .rev()
                .flat_map(|&n| [Task::Line, Task::Node(n)])
                .collect()
        };
        for dry in [true, false] {
            self.begin(dry);
            let tasks = tasks(self);
            self.run(tasks);
            for route in routes {
                self.route(route);
            }
        }
    }

    fn begin(&mut self, dry: bool) {
        self.dry = dry;
        self.written.clear();
        if dry {
            self.met.clear();
        } else {
            self.tokens = Tokens::new(self.document, &self.met);
        }
    }

    fn route(&mut self, route: &Route) {
        let both = self.written.contains(&route.from) && self.written.contains(&route.to);
        if !both {
            return; // one end is in nothing that is drawn or kept
        }
        if self.dry {
            self.met.extend([route.from, route.to]);
            return;
        }
        let name = |id| self.tokens.get(id).unwrap_or("_").to_owned();
        let (from, to) = (name(route.from), name(route.to));
        self.start_line();
        let _ = writeln!(
            self.out,
            "ROUTE {from}.{} TO {to}.{}",
            route.output, route.input
        );
    }

    fn start_line(&mut self) {
        if !self.dry {
            self.out
                .extend(std::iter::repeat_n("  ", self.indent.min(DEEPEST_INDENT)));
        }
    }

    fn put(&mut self, text: &str) {
        if !self.dry {
            self.out.push_str(text);
        }
    }

    fn run(&mut self, mut tasks: Vec<Task<'d>>) {
        while let Some(task) = tasks.pop() {
            match task {
                Task::Text(text) => self.put(&text),
                Task::Line => self.put("\n"),
                Task::Indent(by) => {
                    self.indent = self.indent.saturating_add_signed(by as isize);
                    if by == 0 {
                        self.start_line();
                    }
                }
                Task::Node(id) => self.node(id, &mut tasks),
                Task::Field(id, field) => self.field(id, field, &mut tasks),
                Task::Tail(id, field) => self.tail(id, field, &mut tasks),
                Task::Output(name) => {
                    self.put(" . ");
                    self.put(name);
                }
                Task::Close => {
                    self.indent -= 1;
                    self.start_line();
                    self.put("}");
                }
                Task::Interface(id, interface) => self.interface(id, interface, &mut tasks),
            }
        }
    }

    fn node(&mut self, id: NodeId, tasks: &mut Vec<Task<'d>>) {
        if self.dry {
            self.met.push(id);
        }
        let token = self.tokens.get(id).map(str::to_owned);
        if !self.written.insert(id) {
            self.put("USE ");
            self.put(token.as_deref().unwrap_or("_"));
            return;
        }
        if let Some(token) = token {
            self.put("DEF ");
            self.put(&token);
            self.put(" ");
        }
        let document = self.document;
        let node = &document.nodes[id.0 as usize];
        let mut name = class_name(document, node.class, self.vrml97);
        if let ClassRef::Extension(i) = node.class {
            name = self.proto_names.get(&i).cloned().unwrap_or(name);
        }
        self.put(&name);
        if let Some(skipped) = self.skipped(id) {
            self.put(" ");
            self.put(&skipped);
            return;
        }
        self.put(" {\n");
        self.indent += 1;
        tasks.push(Task::Close);
        let own = |id| [Task::Line, Task::Node(id), Task::Indent(0)];
        tasks.extend(node.children.iter().rev().flat_map(|&c| own(c)));
        if node.class == ClassRef::Known(class::PATH) {
            self.path(id, tasks);
            return;
        }
        let interface: &'d [Interface] = match node.class {
            ClassRef::Extension(i) => {
                let extension = &document.extensions[i as usize];
                if document.proto_of_extension(i).is_none() {
                    self.declaration(node.class, extension, !node.children.is_empty());
                }
                &extension.interface
            }
            ClassRef::Known(_) => &[],
        };
        self.body(id, interface, tasks);
        for (name, of) in self.links.get(&id).cloned().unwrap_or_default() {
            if !interface.iter().any(|i| *i.name == *name) {
                self.start_line();
                self.put(&format!("{name} IS {of}\n"));
            }
        }
    }

    /// Fields in their order, and with each that the node declares its place in the interface,
    /// events before it included.
    fn body(&mut self, id: NodeId, interface: &'d [Interface], tasks: &mut Vec<Task<'d>>) {
        let document = self.document;
        let node = &document.nodes[id.0 as usize];
        let mut out = Vec::new();
        let mut told = 0;
        for i in field_order(document, id) {
            let name = described(document, node.class, node.fields[i].index).0;
            match interface.iter().position(|item| *item.name == *name) {
                Some(place) => {
                    let until = told.max(place + 1);
                    let items = &interface[told..until];
                    out.extend(items.iter().map(|item| Task::Interface(id, item)));
                    told = until;
                }
                None => out.extend([Task::Indent(0), Task::Field(id, i), Task::Line]),
            }
        }
        let rest = &interface[told..];
        out.extend(rest.iter().map(|item| Task::Interface(id, item)));
        tasks.extend(out.into_iter().rev());
    }

    /// The braces, as the file has them, of a node whose class nothing declares.
    fn skipped(&self, id: NodeId) -> Option<String> {
        let node = &self.document.nodes[id.0 as usize];
        let ClassRef::Extension(i) = node.class else {
            return None;
        };
        let extension = &self.document.extensions[i as usize];
        let declared = !extension.fields.is_empty() || !extension.is_a.is_empty();
        if declared || !node.children.is_empty() || self.document.proto_of_extension(i).is_some() {
            return None;
        }
        let source = self
            .document
            .sources
            .get(usize::from(node.source))
            .filter(|s| !s.binary)?;
        let text = source
            .bytes
            .get(node.span.start as usize..node.span.end as usize)?;
        let open = text.iter().position(|&b| b == b'{')?;
        text.ends_with(b"}")
            .then(|| crate::iv::field::text(&text[open..]))
    }

    /// The head, and the numbers of the children from there.
    fn path(&mut self, id: NodeId, tasks: &mut Vec<Task<'d>>) {
        let fields = &self.document.nodes[id.0 as usize].fields;
        let value = |index| fields.iter().find(|f| f.index == index).map(|f| &f.value);
        if let (Some(Value::Ints(steps)), false) = (value(path::INDICES.index), self.dry) {
            let mut text = format!("{}", steps.len());
            steps.iter().for_each(|n| text.push_str(&format!(" {n}")));
            text.push('\n');
            tasks.push(Task::Text(text.into()));
            tasks.push(Task::Indent(0));
        }
        if let Some(Value::Node(Some(head))) = value(path::HEAD.index) {
            tasks.extend([Task::Line, Task::Node(*head), Task::Indent(0)]);
        }
    }

    /// `fields [ … ]` and `isA [ … ]` of a class that the file declares.
    fn declaration(&mut self, class: ClassRef, extension: &Extension, children: bool) {
        if has_type_first(self.document, class) || !extension.interface.is_empty() {
            return;
        }
        if !extension.fields.is_empty() || children {
            let fields: Vec<String> = extension
                .fields
                .iter()
                .map(|(n, k)| format!("{} {n}", k.name()))
                .collect();
            self.start_line();
            self.put(&format!("fields [ {} ]\n", fields.join(", ")));
        }
        let known = extension.is_a.len() == 1 && extension.is_a[0] == extension.name;
        if !extension.is_a.is_empty() && !known {
            let names: Vec<String> = extension.is_a.iter().map(|n| quoted(n)).collect();
            self.start_line();
            self.put(&format!("isA [ {} ]\n", names.join(", ")));
        }
    }

    /// A line of a script's or proto's interface, with its value.
    fn interface(&mut self, id: NodeId, interface: &'d Interface, tasks: &mut Vec<Task<'d>>) {
        self.start_line();
        let head = format!(
            "{} {} {}",
            interface.access.name(),
            interface.kind.name(),
            interface.name
        );
        self.put(&head);
        let linked = self
            .links
            .get(&id)
            .and_then(|l| l.iter().find(|(n, _)| **n == *interface.name));
        if let Some((_, of)) = linked {
            self.put(&format!(" IS {of}\n"));
            return;
        }
        if !interface.access.has_value() {
            self.put("\n");
            return;
        }
        self.put(" ");
        let node = &self.document.nodes[id.0 as usize];
        let of_name =
            |f: &FieldEntry| *described(self.document, node.class, f.index).0 == *interface.name;
        match node.fields.iter().position(of_name) {
            Some(field) => {
                tasks.push(Task::Line);
                self.value(id, field, tasks);
            }
            None => {
                let empty = Value::empty(interface.kind);
                self.plain(&empty, interface.kind, &[]);
                self.put("\n");
            }
        }
    }

    fn field(&mut self, id: NodeId, field: usize, tasks: &mut Vec<Task<'d>>) {
        let node = &self.document.nodes[id.0 as usize];
        let name = described(self.document, node.class, node.fields[field].index).0;
        self.put(name);
        self.put(" ");
        self.value(id, field, tasks);
    }

    fn value(&mut self, id: NodeId, field: usize, tasks: &mut Vec<Task<'d>>) {
        let node = &self.document.nodes[id.0 as usize];
        let entry = &node.fields[field];
        tasks.push(Task::Tail(id, field));
        match &entry.value {
            Value::Node(Some(target)) => tasks.push(Task::Node(*target)),
            Value::Nodes(targets) => {
                tasks.extend([Task::Text("]".into()), Task::Indent(0), Task::Indent(-1)]);
                let own = |&id: &NodeId| [Task::Line, Task::Node(id), Task::Indent(0)];
                tasks.extend(targets.iter().rev().flat_map(own));
                tasks.extend([Task::Indent(1), Task::Text("[\n".into())]);
            }
            value => {
                let (_, kind, names) = described(self.document, node.class, entry.index);
                self.plain(value, kind, names);
            }
        }
    }

    fn tail(&mut self, id: NodeId, field: usize, tasks: &mut Vec<Task<'d>>) {
        let entry = &self.document.nodes[id.0 as usize].fields[field];
        if entry.ignored {
            self.put(" ~");
        }
        if let Some(connection) = &entry.connection {
            self.put(" = ");
            tasks.extend([
                Task::Output(&connection.output),
                Task::Node(connection.from),
            ]);
        }
    }

    /// A value that holds no nodes.
    fn plain(&mut self, value: &Value, kind: FieldType, names: &[(&str, i64)]) {
        if self.dry {
            return;
        }
        let indent = self.indent.min(DEEPEST_INDENT);
        let out = &mut self.out;
        match value {
            Value::Bool(b) => out.push_str(boolean(*b)),
            Value::Int(n) => match kind {
                FieldType::SFEnum => out.push_str(&enumeration(*n, names)),
                FieldType::SFBitMask => out.push_str(&bit_mask(*n, names)),
                _ => integer(out, *n),
            },
            Value::UInt(n) => {
                let _ = write!(out, "{n:#x}");
            }
            Value::Float(n) => float(out, *n),
            Value::Double(n) => double(out, *n),
            Value::String(s) if kind == FieldType::SFEnum => out.push_str(s),
            Value::String(s) => out.push_str(&quoted(s)),
            Value::Vec2(v) => floats(out, &v.to_array()),
            Value::Vec3(v) => floats(out, &v.to_array()),
            Value::Vec4(v) => floats(out, &v.to_array()),
            Value::Rotation(r) => floats(out, &rotation(r)),
            Value::Matrix(m) => floats(out, &m.to_cols_array()),
            Value::Plane(p) => floats(out, &[p.normal.x, p.normal.y, p.normal.z, p.distance]),
            Value::Image(i) => image(out, i, kind == FieldType::SFImage3),
            Value::Node(_) => out.push_str("NULL"),
            Value::Nodes(_) => out.push_str("[ ]"),
            Value::Trigger => {}
            Value::Bools(l) => list(out, indent, l, 16, |out, b| out.push_str(boolean(*b))),
            Value::Ints(l) if !kind.is_multiple() => numbers(out, l, |out, n| integer(out, *n)),
            Value::Ints(l) if kind.width() > 1 => {
                let tuples: Vec<&[i32]> = l.chunks(kind.width()).collect();
                list(out, indent, &tuples, 4, |out, t| {
                    numbers(out, t, |out, n| integer(out, *n))
                });
            }
            Value::Ints(l) if kind == FieldType::MFEnum => {
                list(out, indent, l, 4, |out, n| {
                    out.push_str(&enumeration(*n, names))
                });
            }
            Value::Ints(l) => list(out, indent, l, 16, |out, n| integer(out, *n)),
            Value::UInts(l) => list(out, indent, l, 8, |out, n| {
                let _ = write!(out, "{n:#x}");
            }),
            Value::Floats(l) => list(out, indent, l, 8, |out, n| float(out, *n)),
            Value::Doubles(l) if !kind.is_multiple() => numbers(out, l, |out, n| double(out, *n)),
            Value::Doubles(l) if kind.width() > 1 => {
                let tuples: Vec<&[f64]> = l.chunks(kind.width()).collect();
                list(out, indent, &tuples, 1, |out, t| {
                    numbers(out, t, |out, n| double(out, *n))
                });
            }
            Value::Doubles(l) => list(out, indent, l, 8, |out, n| double(out, *n)),
            Value::Strings(l) if kind == FieldType::MFEnum => {
                list(out, indent, l, 4, |out, s| out.push_str(s));
            }
            Value::Strings(l) => list(out, indent, l, 1, |out, s| out.push_str(&quoted(s))),
            Value::Vec2s(l) => list(out, indent, l, 4, |out, v| floats(out, &v.to_array())),
            Value::Vec3s(l) => list(out, indent, l, 1, |out, v| floats(out, &v.to_array())),
            Value::Vec4s(l) => list(out, indent, l, 1, |out, v| floats(out, &v.to_array())),
            Value::Rotations(l) => list(out, indent, l, 1, |out, r| floats(out, &rotation(r))),
            Value::Matrices(l) => list(out, indent, l, 1, |out, m| floats(out, &m.to_cols_array())),
            Value::Planes(l) => list(out, indent, l, 1, |out, p| {
                floats(out, &[p.normal.x, p.normal.y, p.normal.z, p.distance]);
            }),
        }
    }

    /// The protos that are declared in the body of another, or in none.
    fn protos_within(&mut self, within: Option<usize>) {
        for place in self.within.remove(&within).unwrap_or_default() {
            let proto = &self.document.protos[place];
            if !self.is_declared(proto) {
                self.proto(place, proto);
            }
        }
    }

    /// Whether this is an `EXTERNPROTO` once more, which then goes by the name of the first.
    fn is_declared(&mut self, proto: &Proto) -> bool {
        let named = |p: &Proto| &self.document.extensions[p.extension as usize].name;
        let same = |p: &&Proto| {
            p.external
                && (named(p), &p.interface, &p.urls)
                    == (named(proto), &proto.interface, &proto.urls)
        };
        let first = self.document.protos.iter().find(same);
        let Some(first) = first.filter(|_| proto.external) else {
            return false;
        };
        let name = self.proto_names.get(&first.extension).cloned();
        let is_declared = name.is_some();
        self.proto_names
            .extend(name.map(|name| (proto.extension, name)));
        is_declared
    }

    /// A name that means nothing else where the proto is declared: neither one declared beside
    /// it nor one that the body around it has instances of. Those without instances may share it,
    /// as an `EXTERNPROTO` in several forms of which a class known to us serves.
    fn name_for(&self, proto: &Proto) -> String {
        let protos = &self.document.protos;
        let beside = protos.iter().filter(|p| p.within == proto.within);
        let around = proto.within.map(|p| instances_in(self.document, p));
        let used = around.iter().flatten().map(|&p| &protos[p]);
        let served = |p: &Proto| !self.instanced.contains(&p.extension);
        let written = |p: &Proto| match self.proto_names.get(&p.extension) {
            Some(_) if served(p) && served(proto) => None,
            name => name,
        };
        let taken: Vec<&String> = beside.chain(used).filter_map(written).collect();
        let mut name = self.document.extensions[proto.extension as usize]
            .name
            .to_string();
        while taken.contains(&&name) {
            name.push('_');
        }
        name
    }

    fn proto(&mut self, place: usize, proto: &'d Proto) {
        let name = self.name_for(proto);
        self.proto_names.insert(proto.extension, name.clone());
        let keyword = if proto.external {
            "EXTERNPROTO"
        } else {
            "PROTO"
        };
        let _ = writeln!(self.out, "{keyword} {name} [");
        self.indent += 1;
        for dry in [true, false] {
            self.begin(dry);
            for interface in &proto.interface {
                if proto.external {
                    let (access, kind) = (interface.access.name(), interface.kind.name());
                    self.put(&format!("  {access} {kind} {}\n", interface.name));
                } else {
                    self.run(vec![Task::Interface(proto.defaults, interface)]);
                }
            }
        }
        self.indent -= 1;
        if proto.external {
            self.out.push_str("] ");
            list(&mut self.out, 0, &proto.urls, 1, |out, s| {
                out.push_str(&quoted(s))
            });
            self.out.push_str("\n\n");
            return;
        }
        self.out.push_str("] {\n");
        self.protos_within(Some(place));
        for link in &proto.links {
            self.links
                .entry(link.node)
                .or_default()
                .push((&link.name, &link.interface));
        }
        self.scope(&proto.body, &proto.routes);
        self.links.clear();
        self.out.push_str("}\n\n");
    }
}

/// The file's own protos by the one in whose body they are, each after those that it needs.
fn protos_by_body(document: &Document) -> HashMap<Option<usize>, Vec<usize>> {
    let order = proto_order(document);
    let written: HashSet<usize> = order.iter().copied().collect();
    let mut within: HashMap<Option<usize>, Vec<usize>> = HashMap::new();
    for place in order {
        let around = document.protos[place].within;
        let around = around.filter(|p| written.contains(p));
        within.entry(around).or_default().push(place);
    }
    within
}

/// The file's own protos, each after those whose instances its body has.
fn proto_order(document: &Document) -> Vec<usize> {
    let own = |p: &Proto| document.nodes[p.defaults.0 as usize].source == 0;
    let mut order = Vec::new();
    for (i, proto) in document.protos.iter().enumerate() {
        if !own(proto) && !proto.external {
            continue;
        }
        let mut stack = vec![(i, false)];
        while let Some((i, ready)) = stack.pop() {
            if order.contains(&i) {
                continue;
            }
            if ready {
                order.push(i);
                continue;
            }
            stack.push((i, true));
            if !document.protos[i].external {
                stack.extend(instances_in(document, i).into_iter().map(|k| (k, false)));
            }
        }
    }
    order
}

/// The classes of protos that nodes have, those that hold a proto's defaults left out.
fn instanced(document: &Document) -> HashSet<u32> {
    let defaults: HashSet<NodeId> = document.protos.iter().map(|p| p.defaults).collect();
    let ids = (0..document.nodes.len()).map(|i| NodeId(i as u32));
    let nodes = ids.filter(|id| !defaults.contains(id));
    nodes
        .filter_map(|id| match document.nodes[id.0 as usize].class {
            ClassRef::Extension(i) if document.proto_of_extension(i).is_some() => Some(i),
            _ => None,
        })
        .collect()
}

/// The protos of which a proto's body and defaults have instances.
fn instances_in(document: &Document, proto: usize) -> Vec<usize> {
    let proto = &document.protos[proto];
    let mut stack = proto.body.clone();
    stack.push(proto.defaults);
    let mut seen = HashSet::new();
    let mut out = Vec::new();
    while let Some(id) = stack.pop() {
        if !seen.insert(id) {
            continue;
        }
        let node = &document.nodes[id.0 as usize];
        if id != proto.defaults
            && let ClassRef::Extension(i) = node.class
        {
            out.extend(document.proto_of_extension(i));
        }
        stack.extend(targets(document, id));
    }
    out
}

/// Every node that a node names: children, values, sources of connections.
fn targets(document: &Document, id: NodeId) -> Vec<NodeId> {
    let node = &document.nodes[id.0 as usize];
    let mut out = node.children.clone();
    for field in &node.fields {
        match &field.value {
            Value::Node(Some(target)) => out.push(*target),
            Value::Nodes(targets) => out.extend(targets),
            _ => {}
        }
        out.extend(field.connection.iter().map(|c| c.from));
    }
    out
}

fn boolean(b: bool) -> &'static str {
    if b { "TRUE" } else { "FALSE" }
}

fn integer(out: &mut String, n: i32) {
    let _ = write!(out, "{n}");
}

/// The shortest text that reads back as the same number.
fn float(out: &mut String, n: f32) {
    let plain = n == 0.0 || (1e-5..1e9).contains(&n.abs());
    let _ = match n {
        n if n.is_nan() => write!(out, "nan"),
        n if plain || n.is_infinite() => write!(out, "{n}"),
        n => write!(out, "{n:e}"),
    };
}

fn double(out: &mut String, n: f64) {
    let plain = n == 0.0 || (1e-5..1e15).contains(&n.abs());
    let _ = match n {
        n if n.is_nan() => write!(out, "nan"),
        n if plain || n.is_infinite() => write!(out, "{n}"),
        n => write!(out, "{n:e}"),
    };
}

fn numbers<T>(out: &mut String, list: &[T], one: impl Fn(&mut String, &T)) {
    for (i, n) in list.iter().enumerate() {
        if i > 0 {
            out.push(' ');
        }
        one(out, n);
    }
}

fn floats(out: &mut String, list: &[f32]) {
    numbers(out, list, |out, n| float(out, *n));
}

fn rotation(r: &Rotation) -> [f32; 4] {
    [r.axis.x, r.axis.y, r.axis.z, r.angle]
}

fn list<T>(
    out: &mut String,
    indent: usize,
    list: &[T],
    in_line: usize,
    one: impl Fn(&mut String, &T),
) {
    if let [value] = list {
        return one(out, value);
    }
    out.push_str("[ ");
    for (i, value) in list.iter().enumerate() {
        if i > 0 {
            out.push(',');
            if i % in_line == 0 {
                out.push('\n');
                out.extend(std::iter::repeat_n("  ", indent + 1));
            } else {
                out.push(' ');
            }
        }
        one(out, value);
    }
    out.push_str(" ]");
}

fn image(out: &mut String, image: &Image, solid: bool) {
    let _ = write!(out, "{} {}", image.width, image.height);
    if solid {
        let _ = write!(out, " {}", image.depth);
    }
    let _ = write!(out, " {}", image.components);
    for (i, pixel) in image
        .bytes
        .chunks(usize::from(image.components.max(1)))
        .enumerate()
    {
        out.push_str(if i % 8 == 0 { "\n 0x" } else { " 0x" });
        for byte in pixel {
            let _ = write!(out, "{byte:02x}");
        }
    }
}

/// In quotes. A backslash is doubled only where the reader would take it for an escape.
fn quoted(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 2);
    out.push('"');
    let mut chars = text.chars().peekable();
    while let Some(c) = chars.next() {
        match (c, chars.peek()) {
            ('"', _) => out.push_str("\\\""),
            ('\\', None | Some('"' | '\\')) => out.push_str("\\\\"),
            _ => out.push(c),
        }
    }
    out.push('"');
    out
}

fn bit_mask(n: i32, names: &[(&str, i64)]) -> String {
    match bit_names(n, names).as_slice() {
        [one] => one.clone(),
        several => format!("({})", several.join(" | ")),
    }
}
