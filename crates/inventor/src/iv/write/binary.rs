//! Writes the binary format V2.1, whose layout `read::binary` describes.

use std::collections::HashSet;
use std::io;

use super::output::PieceWriter;
use super::spelling::{
    Tokens, bit_names, class_name, described, enumeration, field_order, has_type_first,
};
use crate::grammar::value::{Image, NodeId, Rotation, Value};
use crate::grammar::{FieldType, class, path};
use crate::iv::declarations::Extension;
use crate::iv::document::{ClassRef, Document, FieldEntry};

/// The header, padded to a multiple of four bytes.
const HEADER: &[u8; 24] = b"#Inventor V2.1 binary  \n";
/// The flag of a field with the ignore flag `~`.
const IGNORED: u32 = 1;
/// The flag of a connected field.
const CONNECTED: u32 = 2;
/// The flag of a field that has its default.
const DEFAULT: u32 = 4;
/// The flag of a node that is an engine.
const ENGINE: u32 = 1;
/// The flag of a node that has children.
const HAS_CHILDREN: u32 = 2;
/// The flag in the number of fields: the types and names of the fields follow.
const DESCRIBED: u32 = 0x4000;

/// Something that remains to be written. The next task is last on the stack.
enum BinaryTask<'d> {
    /// A node, or `USE` if it is written already.
    Node(NodeId),
    /// A field, as its index among the stated fields of the node.
    Field(NodeId, usize),
    /// The flags after a field's value.
    Flags(&'d FieldEntry),
    /// A number.
    Word(u32),
    /// A string.
    Text(&'d str),
    /// A field of a declared class that the node does not state.
    Unstated(&'d str, FieldType),
    /// The string `NULL` in place of a node.
    Null,
}

/// The state of the binary writer.
struct BinaryWriter<'d> {
    document: &'d Document,
    out: PieceWriter<'d>,
    /// The nodes in the order in which they were visited, repeated visits included.
    visited: Vec<NodeId>,
    /// The nodes that this pass has written.
    written: HashSet<NodeId>,
    tokens: Tokens,
}

/// Writes a document in the binary format. It makes two passes, of which the first finds the nodes
/// that are used more than once.
pub(super) fn write(document: &Document, to: &mut dyn io::Write) -> io::Result<()> {
    let mut nowhere = io::sink();
    let mut writer = BinaryWriter {
        document,
        out: PieceWriter::to(&mut nowhere),
        visited: Vec::new(),
        written: HashSet::new(),
        tokens: Tokens::default(),
    };
    writer.run();
    writer.tokens = Tokens::new(document, &writer.visited);
    writer.written.clear();
    writer.out = PieceWriter::to(to);
    writer.out.push_bytes(HEADER);
    writer.run();
    writer.out.finish()
}

impl<'d> BinaryWriter<'d> {
    fn word(&mut self, n: u32) {
        self.out.push_bytes(&n.to_be_bytes());
    }

    /// Appends bytes and pads them to a multiple of four.
    fn bytes(&mut self, bytes: &[u8]) {
        self.out.push_bytes(bytes);
        let padding = bytes.len().next_multiple_of(4) - bytes.len();
        self.out.push_bytes(&[0; 3][..padding]);
    }

    fn string(&mut self, text: &str) {
        self.word(text.len() as u32);
        self.bytes(text.as_bytes());
    }

    fn run(&mut self) {
        let mut tasks: Vec<BinaryTask<'d>> = self
            .document
            .roots
            .iter()
            .rev()
            .map(|&r| BinaryTask::Node(r))
            .collect();
        while let Some(task) = tasks.pop() {
            match task {
                BinaryTask::Node(id) => self.node(id, &mut tasks),
                BinaryTask::Field(id, field) => self.field(id, field, &mut tasks),
                BinaryTask::Word(n) => self.word(n),
                BinaryTask::Text(text) => self.string(text),
                BinaryTask::Null => self.string("NULL"),
                BinaryTask::Unstated(name, kind) => self.unstated(name, kind),
                BinaryTask::Flags(entry) => self.flags(entry, &mut tasks),
            }
        }
    }

    /// Writes the beginning of a node; its fields and children become tasks. For an instance of a
    /// proto it writes the first node of the body's copy.
    fn node(&mut self, id: NodeId, tasks: &mut Vec<BinaryTask<'d>>) {
        let document = self.document;
        let id = document.node(id).id;
        self.visited.push(id);
        let token = self.tokens.get(id).map(str::to_owned);
        if !self.written.insert(id) {
            self.string("USE");
            self.string(token.as_deref().unwrap_or("_"));
            return;
        }
        if let Some(token) = token {
            self.string("DEF");
            self.string(&token);
        }
        let node = &document.nodes[id.0 as usize];
        self.string(&class_name(document, node.class, false));
        if node.class == ClassRef::Known(class::PATH) {
            return self.path(id, tasks);
        }
        let extension = match node.class {
            ClassRef::Extension(i) => Some(&document.extensions[i as usize]),
            ClassRef::Known(_) => None,
        };
        let first = has_type_first(document, node.class);
        let declared = extension.filter(|_| !first);
        let group = match node.class {
            ClassRef::Known(id) => id.get().is_a("Group") && id.get().field("children").is_none(),
            ClassRef::Extension(_) => declared.is_some(),
        };
        let group = group || !node.children.is_empty();
        let engine = match node.class {
            ClassRef::Known(id) => id.get().is_a("Engine"),
            ClassRef::Extension(_) => first,
        };
        self.word(if group {
            HAS_CHILDREN
        } else if engine {
            ENGINE
        } else {
            0
        });
        if group {
            tasks.extend(node.children.iter().rev().map(|&c| BinaryTask::Node(c)));
            tasks.push(BinaryTask::Word(node.children.len() as u32));
        }
        let mut order = field_order(document, id);
        if first && order.first().is_some_and(|&i| node.fields[i].index == 0) {
            let entry = &node.fields[order.remove(0)];
            self.string("type");
            if let Value::String(kind) = &entry.value {
                self.string(kind);
            }
            if class_name(document, node.class, false) != "GlobalField" {
                self.word(0);
            }
        }
        match declared {
            Some(extension) => self.declaration(id, extension, order, tasks),
            None => {
                self.word(order.len() as u32);
                tasks.extend(order.into_iter().rev().map(|i| BinaryTask::Field(id, i)));
            }
        }
    }

    /// Writes the names and types of all fields that the file declares for a class. Tasks then
    /// write the fields of a node of that class: the stated ones in the file's order, then the
    /// others.
    fn declaration(
        &mut self,
        id: NodeId,
        extension: &'d Extension,
        order: Vec<usize>,
        tasks: &mut Vec<BinaryTask<'d>>,
    ) {
        let node = &self.document.nodes[id.0 as usize];
        let own_name = extension.is_a.len() == 1 && extension.is_a[0] == extension.name;
        let is_a = !extension.is_a.is_empty() && !own_name;
        self.word(DESCRIBED | (extension.fields.len() + usize::from(is_a)) as u32);
        for (name, kind) in extension.fields.iter() {
            self.string(kind.name());
            self.string(name);
        }
        let stated = |k: usize| node.fields.iter().any(|f| usize::from(f.index) == k);
        let unstated = (0..extension.fields.len()).rev().filter(|&k| !stated(k));
        tasks.extend(
            unstated.map(|k| BinaryTask::Unstated(&extension.fields[k].0, extension.fields[k].1)),
        );
        tasks.extend(order.into_iter().rev().map(|i| BinaryTask::Field(id, i)));
        if is_a {
            self.string("MFString");
            self.string("isA");
            tasks.push(BinaryTask::Word(0));
            tasks.extend(extension.is_a.iter().rev().map(|n| BinaryTask::Text(n)));
            tasks.extend([
                BinaryTask::Word(extension.is_a.len() as u32),
                BinaryTask::Text("isA"),
            ]);
        }
    }

    fn path(&mut self, id: NodeId, tasks: &mut Vec<BinaryTask<'d>>) {
        let fields = &self.document.nodes[id.0 as usize].fields;
        let value = |index| fields.iter().find(|f| f.index == index).map(|f| &f.value);
        let steps: &[i32] = match value(path::INDICES.index) {
            Some(Value::Ints(steps)) => steps,
            _ => &[],
        };
        tasks.extend(steps.iter().rev().map(|&n| BinaryTask::Word(n as u32)));
        tasks.push(BinaryTask::Word(steps.len() as u32));
        match value(path::HEAD.index) {
            Some(Value::Node(Some(head))) => tasks.push(BinaryTask::Node(*head)),
            _ => tasks.push(BinaryTask::Null),
        }
    }

    fn field(&mut self, id: NodeId, field: usize, tasks: &mut Vec<BinaryTask<'d>>) {
        let node = &self.document.nodes[id.0 as usize];
        let entry = &node.fields[field];
        let (name, kind, names) = described(self.document, node.class, entry.index);
        self.string(name);
        tasks.push(BinaryTask::Flags(entry));
        match &entry.value {
            Value::Node(Some(target)) => tasks.push(BinaryTask::Node(*target)),
            Value::Node(None) => self.string("NULL"),
            Value::Nodes(targets) => {
                self.word(targets.len() as u32);
                tasks.extend(targets.iter().rev().map(|&t| BinaryTask::Node(t)));
            }
            value => self.value(value, kind, names),
        }
    }

    fn flags(&mut self, entry: &'d FieldEntry, tasks: &mut Vec<BinaryTask<'d>>) {
        let ignored = if entry.ignored { IGNORED } else { 0 };
        match &entry.connection {
            Some(connection) => {
                self.word(ignored | CONNECTED);
                tasks.extend([
                    BinaryTask::Text(&connection.output),
                    BinaryTask::Node(connection.from),
                ]);
            }
            None => self.word(ignored),
        }
    }

    /// Writes a field of a declared class that the node does not state, marked as default.
    fn unstated(&mut self, name: &str, kind: FieldType) {
        self.string(name);
        match (kind, Value::empty(kind)) {
            (_, Value::Node(_)) => self.string("NULL"),
            (_, Value::Nodes(_)) => self.word(0),
            (FieldType::SFEnum, _) => self.string(""),
            (_, value) => self.value(&value, kind, &[]),
        }
        self.word(DEFAULT);
    }

    fn float(&mut self, n: f32) {
        self.word(n.to_bits());
    }

    fn floats(&mut self, list: &[f32]) {
        list.iter().for_each(|&n| self.float(n));
    }

    fn double(&mut self, n: f64) {
        self.out.push_bytes(&n.to_bits().to_be_bytes());
    }

    fn rotation(&mut self, r: &Rotation) {
        self.floats(&[r.axis.x, r.axis.y, r.axis.z, r.angle]);
    }

    fn image(&mut self, image: &Image, solid: bool) {
        self.word(image.width);
        self.word(image.height);
        if solid {
            self.word(image.depth);
        }
        self.word(u32::from(image.components));
        // SGI's library reads images without padding. It has no solid ones, which Coin pads.
        if solid {
            self.bytes(&image.bytes);
        } else {
            self.out.push_bytes(&image.bytes);
        }
    }

    fn many<T>(&mut self, list: &[T], one: impl Fn(&mut Self, &T)) {
        self.word(list.len() as u32);
        list.iter().for_each(|v| one(self, v));
    }

    fn value(&mut self, value: &Value, kind: FieldType, names: &[(&str, i64)]) {
        match value {
            Value::Bool(b) => self.word(u32::from(*b)),
            Value::Int(n) => match kind {
                FieldType::SFEnum => self.string(&enumeration(*n, names)),
                FieldType::SFBitMask => {
                    bit_names(*n, names).iter().for_each(|n| self.string(n));
                    self.word(0);
                }
                _ => self.word(*n as u32),
            },
            Value::UInt(n) => self.word(*n),
            Value::Float(n) => self.float(*n),
            Value::Double(n) => self.double(*n),
            Value::String(s) => self.string(s),
            Value::Vec2(v) => self.floats(&v.to_array()),
            Value::Vec3(v) => self.floats(&v.to_array()),
            Value::Vec4(v) => self.floats(&v.to_array()),
            Value::Rotation(r) => self.rotation(r),
            Value::Matrix(m) => self.floats(&m.to_cols_array()),
            Value::Plane(p) => self.floats(&[p.normal.x, p.normal.y, p.normal.z, p.distance]),
            Value::Image(i) => self.image(i, kind == FieldType::SFImage3),
            Value::Node(_) | Value::Nodes(_) | Value::Trigger => {}
            Value::Bools(l) => self.many(l, |w, b| w.word(u32::from(*b))),
            Value::Ints(l) if kind == FieldType::MFEnum => {
                self.many(l, |w, n| w.string(&enumeration(*n, names)));
            }
            Value::Ints(l) => {
                if kind.is_multiple() {
                    self.word((l.len() / kind.width()) as u32);
                }
                l.iter().for_each(|&n| self.word(n as u32));
            }
            Value::UInts(l) => self.many(l, |w, n| w.word(*n)),
            Value::Floats(l) => self.many(l, |w, n| w.float(*n)),
            Value::Doubles(l) => {
                if kind.is_multiple() {
                    self.word((l.len() / kind.width()) as u32);
                }
                l.iter().for_each(|&n| self.double(n));
            }
            Value::Strings(l) => self.many(l, |w, s| w.string(s)),
            Value::Vec2s(l) => self.many(l, |w, v| w.floats(&v.to_array())),
            Value::Vec3s(l) => self.many(l, |w, v| w.floats(&v.to_array())),
            Value::Vec4s(l) => self.many(l, |w, v| w.floats(&v.to_array())),
            Value::Rotations(l) => self.many(l, Self::rotation),
            Value::Matrices(l) => self.many(l, |w, m| w.floats(&m.to_cols_array())),
            Value::Planes(l) => self.many(l, |w, p| {
                w.floats(&[p.normal.x, p.normal.y, p.normal.z, p.distance]);
            }),
        }
    }
}
