//! Writes the text formats: Inventor V2.1, or VRML97 for a document that was read from VRML97.
//!
//! The tasks that remain are on an explicit stack, because files may nest deeper than recursion
//! allows.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::fmt::Write as _;
use std::io;

use super::output::PieceWriter;
use super::protos::{instanced, instances_in, protos_by_body};
use super::spelling::{Tokens, class_name, described, field_order, has_type_first};
use super::text_values::{self, list, quoted};
use crate::grammar::value::{NodeId, Value};
use crate::grammar::{FieldType, class, path};
use crate::iv::declarations::{Extension, Interface, Proto, Route};
use crate::iv::document::{ClassRef, Document, FieldEntry};
use crate::iv::encoding::text;
use crate::iv::x3d_names::in_x3d;

/// Writes a document as text.
pub(super) fn write(document: &Document, to: &mut dyn io::Write) -> io::Result<()> {
    Ascii::new(document, PieceWriter::to(to)).document()
}

/// The largest number of indentation levels that are written. Without it the size of a file would
/// be quadratic in its nesting depth, which can be a hundred thousand.
const DEEPEST_INDENT: usize = 40;

/// Something that remains to be written. The next task is last on the stack.
enum AsciiTask<'d> {
    /// A node, or `USE` if it is written already.
    Node(NodeId),
    /// The name and value of a field, as its index among the stated fields of the node.
    Field(NodeId, usize),
    /// The part after a field's value: `~` and the connection.
    Tail(NodeId, usize),
    /// The output of a connection.
    Output(&'d str),
    /// The closing brace of a node.
    Close,
    /// A fixed text.
    Text(Cow<'static, str>),
    /// The end of a line.
    Line,
    /// A change of the indentation, or for 0 the indentation itself.
    Indent(i32),
    /// A line of the interface of a script or proto.
    Interface(NodeId, &'d Interface),
}

/// The state of the text writer.
struct Ascii<'d> {
    document: &'d Document,
    /// Whether the classes are those of VRML97 and X3D, without a prefix.
    vrml97: bool,
    /// Whether fields have the names of X3D.
    x3d: bool,
    out: PieceWriter<'d>,
    indent: usize,
    /// Whether this is the first of two passes, which only records the order of the nodes.
    dry: bool,
    /// The nodes in the order in which the first pass visited them, repeated visits included.
    visited: Vec<NodeId>,
    /// The nodes that this pass has written.
    written: HashSet<NodeId>,
    tokens: Tokens,
    /// The `IS` links of the proto that is being written: for each node, the name of its field and
    /// the name in the interface.
    links: HashMap<NodeId, Vec<(&'d str, &'d str)>>,
    /// The name under which each proto is written, by the index of its extension.
    proto_names: HashMap<u32, String>,
    /// The protos that remain to be written, grouped by the proto whose body declares them.
    within: HashMap<Option<usize>, Vec<usize>>,
    /// The extensions of protos that have instances.
    instanced: HashSet<u32>,
}

impl<'d> Ascii<'d> {
    fn new(document: &'d Document, out: PieceWriter<'d>) -> Self {
        Self {
            document,
            vrml97: document.is_vrml97() || document.is_x3d(),
            x3d: document.is_x3d(),
            out,
            indent: 0,
            dry: false,
            visited: Vec::new(),
            written: HashSet::new(),
            tokens: Tokens::default(),
            links: HashMap::new(),
            proto_names: HashMap::new(),
            within: HashMap::new(),
            instanced: instanced(document),
        }
    }

    /// Writes the whole document.
    fn document(mut self) -> io::Result<()> {
        match (self.x3d, self.vrml97) {
            (true, _) => self.x3d_head(),
            (false, true) => self.out.push_str("#VRML V2.0 utf8\n\n"),
            (false, false) => self.out.push_str("#Inventor V2.1 ascii\n\n"),
        }
        self.within = protos_by_body(self.document);
        self.protos_within(None);
        let roots = &self.document.roots;
        self.scope(roots, &self.document.stated_routes);
        self.out.finish()
    }

    /// Writes the first lines of X3D's classic encoding.
    fn x3d_head(&mut self) {
        let version = match self.document.multiplying.contains(&0) {
            true => "4.0",
            false => "3.3",
        };
        let _ = writeln!(self.out, "#X3D V{version} utf8\nPROFILE Immersive");
        for (name, content) in &self.document.meta {
            let _ = writeln!(self.out, "META {} {}", quoted(name), quoted(content));
        }
        self.out.push_str("\n");
    }

    /// Returns the keyword for the access of an entry of an interface.
    fn access(&self, interface: &Interface) -> &'static str {
        match self.x3d {
            true => interface.access.x3d_name(),
            false => interface.access.name(),
        }
    }

    /// Returns the name of a field or event of a node as the format has it.
    fn name_of<'n>(&self, id: NodeId, name: &'n str) -> Cow<'n, str> {
        let class = match self.document.nodes[id.0 as usize].class {
            ClassRef::Known(class) if self.x3d && class.get().is_vrml97() => class.get().name,
            _ => return Cow::Borrowed(name),
        };
        in_x3d(class, name).map_or(Cow::Borrowed(name), |name| Cow::Owned(name.into()))
    }

    /// Writes nodes and routes in a scope of names. It makes two passes, of which the first finds
    /// the nodes that are used more than once.
    fn scope(&mut self, nodes: &'d [NodeId], routes: &'d [Route]) {
        let tasks = |_: &mut Self| -> Vec<AsciiTask<'d>> {
            nodes
                .iter()
                .rev()
                .flat_map(|&n| [AsciiTask::Line, AsciiTask::Node(n)])
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

    /// Begins a pass.
    fn begin(&mut self, dry: bool) {
        self.dry = dry;
        self.written.clear();
        if dry {
            self.visited.clear();
        } else {
            self.tokens = Tokens::new(self.document, &self.visited);
        }
    }

    fn route(&mut self, route: &Route) {
        let both = self.written.contains(&route.from) && self.written.contains(&route.to);
        if !both {
            return; // A route cannot refer to a node that is not written.
        }
        if self.dry {
            self.visited.extend([route.from, route.to]);
            return;
        }
        let name = |id| self.tokens.get(id).unwrap_or("_").to_owned();
        let (from, to) = (name(route.from), name(route.to));
        self.start_line();
        let _ = writeln!(
            self.out,
            "ROUTE {from}.{} TO {to}.{}",
            self.name_of(route.from, &route.output),
            self.name_of(route.to, &route.input)
        );
    }

    fn start_line(&mut self) {
        if !self.dry {
            self.out.indent(self.indent.min(DEEPEST_INDENT));
        }
    }

    /// Appends text, except in the first pass.
    fn put(&mut self, text: &str) {
        if !self.dry {
            self.out.push_str(text);
        }
    }

    /// Carries out tasks and the tasks that they create.
    fn run(&mut self, mut tasks: Vec<AsciiTask<'d>>) {
        while let Some(task) = tasks.pop() {
            match task {
                AsciiTask::Text(text) => self.put(&text),
                AsciiTask::Line => self.put("\n"),
                AsciiTask::Indent(by) => {
                    self.indent = self.indent.saturating_add_signed(by as isize);
                    if by == 0 {
                        self.start_line();
                    }
                }
                AsciiTask::Node(id) => self.node(id, &mut tasks),
                AsciiTask::Field(id, field) => self.field(id, field, &mut tasks),
                AsciiTask::Tail(id, field) => self.tail(id, field, &mut tasks),
                AsciiTask::Output(name) => {
                    self.put(" . ");
                    self.put(name);
                }
                AsciiTask::Close => {
                    self.indent -= 1;
                    self.start_line();
                    self.put("}");
                }
                AsciiTask::Interface(id, interface) => self.interface(id, interface, &mut tasks),
            }
        }
    }

    /// Writes the beginning of a node, or `USE` if the node is written already. The rest of the
    /// node becomes tasks.
    fn node(&mut self, id: NodeId, tasks: &mut Vec<AsciiTask<'d>>) {
        if self.dry {
            self.visited.push(id);
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
        tasks.push(AsciiTask::Close);
        let own = |id| [AsciiTask::Line, AsciiTask::Node(id), AsciiTask::Indent(0)];
        tasks.extend(node.children.iter().rev().flat_map(|&c| own(c)));
        if node.class == ClassRef::Known(class::PATH) {
            self.path(id, tasks);
            return;
        }
        let interface: &'d [Interface] = match node.class {
            ClassRef::Extension(i) => {
                let extension = &document.extensions[i as usize];
                if document.protos.of_extension(i).is_none() {
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
                let name = self.name_of(id, name).into_owned();
                self.put(&format!("{name} IS {of}\n"));
            }
        }
    }

    /// Writes the fields in the file's order. A field that the node declares is written after the
    /// events that precede it in the interface.
    fn body(&mut self, id: NodeId, interface: &'d [Interface], tasks: &mut Vec<AsciiTask<'d>>) {
        let document = self.document;
        let node = &document.nodes[id.0 as usize];
        let mut out = Vec::new();
        let mut declared = 0;
        for i in field_order(document, id) {
            let name = described(document, node.class, node.fields[i].index).0;
            match interface.iter().position(|item| *item.name == *name) {
                Some(place) => {
                    let until = declared.max(place + 1);
                    let items = &interface[declared..until];
                    out.extend(items.iter().map(|item| AsciiTask::Interface(id, item)));
                    declared = until;
                }
                None => out.extend([
                    AsciiTask::Indent(0),
                    AsciiTask::Field(id, i),
                    AsciiTask::Line,
                ]),
            }
        }
        let rest = &interface[declared..];
        out.extend(rest.iter().map(|item| AsciiTask::Interface(id, item)));
        tasks.extend(out.into_iter().rev());
    }

    /// Returns the body of a node of an undeclared class, copied from the source file.
    fn skipped(&self, id: NodeId) -> Option<String> {
        let node = &self.document.nodes[id.0 as usize];
        let ClassRef::Extension(i) = node.class else {
            return None;
        };
        let extension = &self.document.extensions[i as usize];
        let declared = !extension.fields.is_empty() || !extension.is_a.is_empty();
        if declared || !node.children.is_empty() || self.document.protos.of_extension(i).is_some() {
            return None;
        }
        let source = self
            .document
            .sources
            .get(usize::from(node.source))
            .filter(|s| !s.binary)?;
        let bytes = source
            .bytes
            .get(node.span.start as usize..node.span.end as usize)?;
        let open = bytes.iter().position(|&b| b == b'{')?;
        bytes.ends_with(b"}").then(|| text(&bytes[open..]))
    }

    /// Writes the head of a path and the indices of the children below it.
    fn path(&mut self, id: NodeId, tasks: &mut Vec<AsciiTask<'d>>) {
        let fields = &self.document.nodes[id.0 as usize].fields;
        let value = |index| fields.iter().find(|f| f.index == index).map(|f| &f.value);
        if let (Some(Value::Ints(steps)), false) = (value(path::INDICES.index), self.dry) {
            let mut text = format!("{}", steps.len());
            steps.iter().for_each(|n| text.push_str(&format!(" {n}")));
            text.push('\n');
            tasks.push(AsciiTask::Text(text.into()));
            tasks.push(AsciiTask::Indent(0));
        }
        if let Some(Value::Node(Some(head))) = value(path::HEAD.index) {
            tasks.extend([
                AsciiTask::Line,
                AsciiTask::Node(*head),
                AsciiTask::Indent(0),
            ]);
        }
    }

    /// Writes `fields [ … ]` and `isA [ … ]` of a class that the file declares. SGI's library and
    /// Coin read `isA` only if it is among the fields.
    fn declaration(&mut self, class: ClassRef, extension: &Extension, children: bool) {
        if has_type_first(self.document, class) || !extension.interface.is_empty() {
            return;
        }
        let known = extension.is_a.len() == 1 && extension.is_a[0] == extension.name;
        let is_a = !extension.is_a.is_empty() && !known;
        if !extension.fields.is_empty() || children || is_a {
            let own = extension.fields.iter();
            let own = own.map(|(name, kind)| format!("{} {name}", kind.name()));
            let fields: Vec<String> = own.chain(is_a.then(|| "MFString isA".into())).collect();
            self.start_line();
            self.put(&format!("fields [ {} ]\n", fields.join(", ")));
        }
        if is_a {
            let names: Vec<String> = extension.is_a.iter().map(|n| quoted(n)).collect();
            self.start_line();
            self.put(&format!("isA [ {} ]\n", names.join(", ")));
        }
    }

    /// Writes a line of the interface of a script or proto, with its value.
    fn interface(&mut self, id: NodeId, interface: &'d Interface, tasks: &mut Vec<AsciiTask<'d>>) {
        self.start_line();
        let head = format!(
            "{} {} {}",
            self.access(interface),
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
                tasks.push(AsciiTask::Line);
                self.value(id, field, tasks);
            }
            None => {
                let empty = Value::empty(interface.kind);
                self.plain(&empty, interface.kind, &[]);
                self.put("\n");
            }
        }
    }

    fn field(&mut self, id: NodeId, field: usize, tasks: &mut Vec<AsciiTask<'d>>) {
        let node = &self.document.nodes[id.0 as usize];
        let name = described(self.document, node.class, node.fields[field].index).0;
        self.put(&self.name_of(id, name));
        self.put(" ");
        self.value(id, field, tasks);
    }

    fn value(&mut self, id: NodeId, field: usize, tasks: &mut Vec<AsciiTask<'d>>) {
        let node = &self.document.nodes[id.0 as usize];
        let entry = &node.fields[field];
        tasks.push(AsciiTask::Tail(id, field));
        match &entry.value {
            Value::Node(Some(target)) => tasks.push(AsciiTask::Node(*target)),
            Value::Nodes(targets) => {
                tasks.extend([
                    AsciiTask::Text("]".into()),
                    AsciiTask::Indent(0),
                    AsciiTask::Indent(-1),
                ]);
                let own =
                    |&id: &NodeId| [AsciiTask::Line, AsciiTask::Node(id), AsciiTask::Indent(0)];
                tasks.extend(targets.iter().rev().flat_map(own));
                tasks.extend([AsciiTask::Indent(1), AsciiTask::Text("[\n".into())]);
            }
            value => {
                let (_, kind, names) = described(self.document, node.class, entry.index);
                self.plain(value, kind, names);
            }
        }
    }

    fn tail(&mut self, id: NodeId, field: usize, tasks: &mut Vec<AsciiTask<'d>>) {
        let entry = &self.document.nodes[id.0 as usize].fields[field];
        if entry.ignored {
            self.put(" ~");
        }
        if let Some(connection) = &entry.connection {
            self.put(" = ");
            tasks.extend([
                AsciiTask::Output(&connection.output),
                AsciiTask::Node(connection.from),
            ]);
        }
    }

    /// Writes a value that contains no nodes.
    fn plain(&mut self, value: &Value, kind: FieldType, names: &[(&str, i64)]) {
        if !self.dry {
            let indent = self.indent.min(DEEPEST_INDENT);
            let escapes = self.document.escapes();
            text_values::put(&mut self.out, indent, value, kind, names, escapes);
        }
    }

    /// Writes the protos that are declared in the body of a proto, or for `None` the protos that
    /// are declared at the top level.
    fn protos_within(&mut self, within: Option<usize>) {
        for place in self.within.remove(&within).unwrap_or_default() {
            let proto = &self.document.protos.list[place];
            if !self.is_declared(proto) {
                self.proto(place, proto);
            }
        }
    }

    /// Returns whether an equal `EXTERNPROTO` is written already. If so, its name is reused.
    fn is_declared(&mut self, proto: &Proto) -> bool {
        let named = |p: &Proto| &self.document.extensions[p.extension as usize].name;
        let same = |p: &&Proto| {
            p.external
                && (named(p), &p.interface, &p.urls)
                    == (named(proto), &proto.interface, &proto.urls)
        };
        let first = self.document.protos.list.iter().find(same);
        let Some(first) = first.filter(|_| proto.external) else {
            return false;
        };
        let name = self.proto_names.get(&first.extension).cloned();
        let is_declared = name.is_some();
        self.proto_names
            .extend(name.map(|name| (proto.extension, name)));
        is_declared
    }

    /// Returns a name that is unique where the proto is declared: no other proto of the same body
    /// has it, and no proto that the surrounding body has instances of. Protos without instances
    /// may share a name. This occurs for several forms of an `EXTERNPROTO` that a class of the
    /// catalogue replaces.
    fn name_for(&self, proto: &Proto) -> String {
        let protos = &self.document.protos.list;
        let beside = protos.iter().filter(|p| p.within == proto.within);
        let around = proto.within.map(|p| instances_in(self.document, p));
        let used = around.iter().flatten().map(|&p| &protos[p]);
        let unused = |p: &Proto| !self.instanced.contains(&p.extension);
        let written = |p: &Proto| match self.proto_names.get(&p.extension) {
            Some(_) if unused(p) && unused(proto) => None,
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

    /// Writes the declaration of a proto.
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
                    let (access, kind) = (self.access(interface), interface.kind.name());
                    self.put(&format!("  {access} {kind} {}\n", interface.name));
                } else {
                    self.run(vec![AsciiTask::Interface(proto.defaults, interface)]);
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
