//! Reads the binary formats V1.0, V2.0 and V2.1: big-endian words, as XDR lays them out.
//!
//! A node consists of its class's name, from V2.1 on a word of flags (2: has children), the number
//! of its fields, and the fields. For groups the number of children and the children follow. A
//! field consists of its name, its value and a word of flags: 1 ignored, 2 connected, 4 default.
//! Reading cannot continue after a mistake, so it ends at the first one. The nodes before it are
//! kept.

use ivcam_base::diag::{Result, Span, excerpt};
use nom::Parser;

use super::assemble::{Assembler, FieldSlot};
use super::binary_values::{self, Context};
use super::syntax_error::SyntaxError;
use super::tokens::is_word;
use crate::grammar::value::{NodeId, Value};
use crate::grammar::{FieldType, class, path};
use crate::iv::document::{ClassRef, Connection};
use crate::iv::limits::beyond;

/// The flag of a field with the ignore flag `~`.
const IGNORED: u32 = 1;
/// The flag of a connected field.
const CONNECTED: u32 = 2;
/// The flag of a field that has its default.
const DEFAULT: u32 = 4;
/// The flag of a node that has children.
const HAS_CHILDREN: u32 = 2;
/// The flag in the number of fields: the types and names of the fields follow.
const DESCRIBED: u32 = 0x4000;

/// Where a node belongs. A field is given by its index among the stated fields of its node.
#[derive(Clone, Copy)]
enum BinaryTarget {
    /// A top-level node.
    Root,
    /// A child of a node.
    Child(NodeId),
    /// The value of an `SFNode` field.
    Field(NodeId, usize),
    /// One of the nodes of an `MFNode` field.
    Element(NodeId, usize),
    /// The node that a field is connected to.
    Source(NodeId, usize),
}

/// An open part of the file. `left` is the number of items that are still to be read.
#[derive(Clone, Copy)]
enum BinaryLevel {
    /// The fields of a node.
    Fields {
        node: NodeId,
        target: BinaryTarget,
        left: u32,
        children: bool,
    },
    /// The children of a node.
    Children {
        node: NodeId,
        target: BinaryTarget,
        left: u32,
    },
    /// The nodes of an `MFNode` field.
    List {
        node: NodeId,
        entry: usize,
        left: u32,
    },
}

/// A mistake that ends reading.
struct BinaryStop {
    /// The offset of the mistake.
    at: usize,
    message: String,
}

impl BinaryStop {
    /// Creates a mistake at an offset. The rest of the file cannot be read.
    fn new(at: usize, message: impl Into<String>) -> Self {
        Self {
            at,
            message: message.into(),
        }
    }
}

/// The result of a reading step.
type BinaryStep<T> = std::result::Result<T, BinaryStop>;

/// The state of the reader.
struct BinaryReader<'r, 'd, 's> {
    asm: &'r mut Assembler<'d>,
    bytes: &'s [u8],
    /// The suffix of `bytes` that is still to be read.
    rest: &'s [u8],
    /// The open parts of the file. The innermost is last.
    stack: Vec<BinaryLevel>,
    roots: Vec<NodeId>,
    /// The error if a limit is exceeded. Unlike a mistake in the file it makes reading fail.
    limit: Option<Box<ivcam_base::diag::Diagnostic>>,
}

/// Reads the nodes of a file and returns the top-level ones.
///
/// # Errors
/// Returns an error if a limit is exceeded.
pub(super) fn read(asm: &mut Assembler<'_>, bytes: &[u8]) -> Result<Vec<NodeId>> {
    let rest = &bytes[asm.header.length.min(bytes.len())..];
    let mut reader = BinaryReader {
        asm,
        bytes,
        rest,
        stack: Vec::new(),
        roots: Vec::new(),
        limit: None,
    };
    loop {
        let before = reader.rest.len();
        match reader.step() {
            Ok(true) => {
                let at = reader.at();
                reader.asm.spend_read(before - reader.rest.len(), at)?;
            }
            Ok(false) => break,
            Err(stop) => {
                if let Some(limit) = reader.limit.take() {
                    return Err(limit);
                }
                reader.stop(stop);
                break;
            }
        }
    }
    Ok(reader.roots)
}

impl<'s> BinaryReader<'_, '_, 's> {
    /// Reports a mistake, and attaches each open node to its parent, so that the nodes that were
    /// read form a tree.
    fn stop(&mut self, stop: BinaryStop) {
        let sink = &mut self.asm.document.sink;
        let damage = sink.damage(Span::at(stop.at), stop.message);
        damage.help("a binary file cannot be read past a mistake; the nodes before it are kept");
        while let Some(level) = self.stack.pop() {
            match level {
                BinaryLevel::Fields { node, target, .. }
                | BinaryLevel::Children { node, target, .. } => {
                    self.attach(target, node);
                }
                BinaryLevel::List { .. } => {}
            }
        }
    }

    /// Returns the offset of the next byte.
    fn at(&self) -> usize {
        self.bytes.len() - self.rest.len()
    }

    /// Runs a parser on the rest of the file and advances past the bytes that it reads.
    fn parse<T>(
        &mut self,
        mut parser: impl Parser<&'s [u8], Output = T, Error = SyntaxError<'s>>,
    ) -> BinaryStep<T> {
        match parser.parse(self.rest) {
            Ok((rest, value)) => {
                self.rest = rest;
                Ok(value)
            }
            Err(error) => {
                let error = SyntaxError::from(error);
                Err(BinaryStop::new(
                    self.bytes.len() - error.at.len(),
                    error.message(),
                ))
            }
        }
    }

    fn word(&mut self) -> BinaryStep<u32> {
        self.parse(binary_values::word)
    }

    fn string(&mut self) -> BinaryStep<String> {
        self.parse(binary_values::string)
    }

    /// Reads a count of items that take at least four bytes each.
    fn count(&mut self) -> BinaryStep<u32> {
        self.parse(|input| binary_values::checked_count(input, 4))
            .map(|count| count as u32)
    }

    /// Reads one item. Returns `false` at the end of the file.
    fn step(&mut self) -> BinaryStep<bool> {
        match self.stack.last_mut() {
            None => {
                if self.rest.iter().all(|&b| b == 0) {
                    return Ok(false);
                }
                self.statement(BinaryTarget::Root)?;
            }
            Some(BinaryLevel::Fields { left: 0, .. }) => self.fields_done()?,
            Some(BinaryLevel::Fields { node, left, .. }) => {
                *left -= 1;
                let node = *node;
                self.field(node)?;
            }
            Some(BinaryLevel::Children { left: 0, .. }) => {
                if let Some(BinaryLevel::Children { node, target, .. }) = self.stack.pop() {
                    self.end_of_children()?;
                    self.deliver(target, node)?;
                }
            }
            Some(BinaryLevel::Children { node, left, .. }) => {
                *left -= 1;
                let target = BinaryTarget::Child(*node);
                self.statement(target)?;
            }
            Some(BinaryLevel::List { left: 0, .. }) => {
                if let Some(BinaryLevel::List { node, entry, .. }) = self.stack.pop() {
                    self.tail(node, entry)?;
                }
            }
            Some(BinaryLevel::List { node, entry, left }) => {
                *left -= 1;
                let target = BinaryTarget::Element(*node, *entry);
                self.statement(target)?;
            }
        }
        Ok(true)
    }

    /// Ends the fields of a node and begins its children.
    fn fields_done(&mut self) -> BinaryStep<()> {
        let Some(BinaryLevel::Fields {
            node,
            target,
            children,
            ..
        }) = self.stack.pop()
        else {
            return Ok(());
        };
        if self.asm.document.nodes[node.0 as usize].class == ClassRef::Known(class::PATH) {
            let indices = self.parse(|input| binary_values::list(input, binary_values::int))?;
            self.asm.set(
                node,
                path::INDICES.index,
                Value::Ints(indices),
                Span::at(self.at()),
            );
            return self.deliver(target, node);
        }
        if !children {
            return self.deliver(target, node);
        }
        let left = self.count()?;
        self.stack
            .push(BinaryLevel::Children { node, target, left });
        Ok(())
    }

    /// Reads a node, `USE` or `NULL`.
    fn statement(&mut self, target: BinaryTarget) -> BinaryStep<()> {
        let start = self.at();
        let mut name = self.string()?;
        match name.as_str() {
            "NULL" => return self.deliver_nothing(target),
            "USE" => {
                let token = self.string()?;
                return match self.asm.used(token.as_bytes()) {
                    Some(node) => self.deliver(target, node),
                    None => {
                        let message = format!("no earlier node is named `{}`", excerpt(&token));
                        self.asm.document.sink.warn(Span::at(start), message);
                        self.deliver_nothing(target)
                    }
                };
            }
            _ => {}
        }
        let mut defined = None;
        if name == "DEF" {
            defined = Some(self.string()?);
            name = self.string()?;
        }
        self.node(target, defined, &name, start)
    }

    /// Reads a node up to its fields. Its class and the name after `DEF` have been read.
    fn node(
        &mut self,
        target: BinaryTarget,
        defined: Option<String>,
        name: &str,
        start: usize,
    ) -> BinaryStep<()> {
        let known = self.asm.class_named(name);
        // Bytes that are read at a wrong offset mostly are no word.
        if known.is_none() && !is_word(name.as_bytes()) {
            return Err(BinaryStop::new(start, "expected a node here"));
        }
        let class = known.unwrap_or_else(|| self.asm.unknown(name));
        let node = match self.asm.add(class, None, Span::at(start)) {
            Ok(node) => node,
            Err(error) => return self.limit(error),
        };
        if self.stack.len() >= self.asm.limits.depth {
            let message = format!("nodes are nested more than {} deep", self.asm.limits.depth);
            let sink = &self.asm.document.sink;
            return self.limit(beyond(sink, Span::at(start), message, "depth"));
        }
        if let Some(defined) = defined {
            self.asm.define(defined.as_bytes(), node);
        }
        if class == ClassRef::Known(class::PATH) {
            // The head comes first, then the indices of the children along the path.
            self.stack.push(BinaryLevel::Fields {
                node,
                target,
                left: 0,
                children: false,
            });
            let entry = self
                .asm
                .set(node, path::HEAD.index, Value::Node(None), Span::at(start));
            return self.statement(BinaryTarget::Field(node, entry));
        }
        let flagged = self.asm.header.version >= (2, 1);
        let group = match class {
            ClassRef::Known(id) => id.get().is_a("Group"),
            ClassRef::Extension(_) => false,
        };
        let children = if flagged {
            self.word()? & HAS_CHILDREN != 0
        } else {
            group
        };
        self.type_first(node)?;
        let fields = if self.lacks_field_count(class) {
            0
        } else if class == ClassRef::Known(class::GLOBAL_FIELD) {
            self.word()?.max(1) // SGI's library writes 0 before the one field, Coin 1.
        } else {
            self.word()?
        };
        if fields & !(DESCRIBED | 0x3fff) != 0 {
            return Err(BinaryStop::new(
                self.at() - 4,
                format!("`{}` cannot have {fields} fields", excerpt(name)),
            ));
        }
        if fields & DESCRIBED != 0 {
            let blank = self.asm.blank(name, known);
            self.asm.data(node).class = blank;
            self.descriptions(node, fields & 0x3fff)?;
        } else if known.is_none() && fields & 0x3fff != 0 {
            return Err(BinaryStop::new(
                start,
                format!(
                    "`{}` is not a known node class, so the end of the node is unknown",
                    excerpt(name)
                ),
            ));
        }
        self.stack.push(BinaryLevel::Fields {
            node,
            target,
            left: fields & 0x3fff,
            children,
        });
        Ok(())
    }

    /// Reads the type of a `GlobalField`, or of an engine whose fields depend on it. The type comes
    /// before the number of fields. In a `GlobalField` no flags follow it.
    fn type_first(&mut self, node: NodeId) -> BinaryStep<()> {
        let ClassRef::Known(id) = self.asm.document.nodes[node.0 as usize].class else {
            return Ok(());
        };
        let global = id == class::GLOBAL_FIELD;
        if !global && !matches!(id, class::GATE | class::SELECT_ONE | class::CONCATENATE) {
            return Ok(());
        }
        let start = self.at();
        if self.string()? != "type" {
            return Err(BinaryStop::new(
                start,
                format!("a `{}` should begin with its type", id.get().name),
            ));
        }
        let kind = self.string()?;
        let entry = self.asm.set(
            node,
            0,
            Value::String(kind.as_str().into()),
            Span::at(start),
        );
        if !global {
            self.tail(node, entry)?;
            self.asm.specialize(node, &kind, None);
        }
        Ok(())
    }

    /// Returns whether the number of fields is missing, as it is before V2.1 for groups that have
    /// no fields in the version: `Separator` has some from V2.0 on.
    fn lacks_field_count(&self, class: ClassRef) -> bool {
        let ClassRef::Known(id) = class else {
            return false;
        };
        let version = self.asm.header.version;
        let is_bare = [class::GROUP, class::TRANSFORM_SEPARATOR].contains(&id);
        version < (2, 1) && is_bare || version < (2, 0) && id == class::SEPARATOR
    }

    /// Reads the word −1 that follows the children of a group in V1.0.
    fn end_of_children(&mut self) -> BinaryStep<()> {
        if self.asm.header.version < (2, 0) && self.word()? != u32::MAX {
            let message = "the word -1 is missing after the children of a group";
            return Err(BinaryStop::new(self.at() - 4, message.to_owned()));
        }
        Ok(())
    }

    /// Ends reading with the error for an exceeded limit.
    fn limit<T>(&mut self, error: Box<ivcam_base::diag::Diagnostic>) -> BinaryStep<T> {
        self.limit = Some(error);
        Err(BinaryStop::new(self.at(), String::new()))
    }

    /// Reads the types and names of the fields of a class that the file declares.
    fn descriptions(&mut self, node: NodeId, count: u32) -> BinaryStep<()> {
        let mut fields = Vec::new();
        for _ in 0..count {
            let (kind, name) = (self.string()?, self.string()?);
            match FieldType::named(&kind) {
                Some(_) if name == "isA" => {}
                Some(_) if !is_word(name.as_bytes()) => {
                    let message = format!("a field cannot be named `{}`", excerpt(&name));
                    return Err(BinaryStop::new(self.at(), message));
                }
                Some(kind) => fields.push((name.into(), kind)),
                None => {
                    let message = format!("`{}` is not a field type", excerpt(&kind));
                    return Err(BinaryStop::new(self.at(), message));
                }
            }
        }
        self.asm.declare(node, fields, Vec::new());
        Ok(())
    }

    /// Reads a field.
    fn field(&mut self, node: NodeId) -> BinaryStep<()> {
        let start = self.at();
        let name = self.string()?;
        let class = self.asm.document.nodes[node.0 as usize].class;
        if name == "isA" && matches!(class, ClassRef::Extension(_)) {
            return self.is_a(node);
        }
        let mut slot = self.asm.slot(node, &name);
        if slot.is_none()
            && let Some(Value::String(kind)) = self.asm.document.node(node).value("type").cloned()
            && self.asm.specialize(node, &kind, Some(&name)).is_some()
        {
            slot = self.asm.slot(node, &name);
        }
        let Some(slot) = slot else {
            let class = self.asm.document.node(node).class_name();
            let message = format!(
                "`{}` has no field `{}`, so the end of the field is unknown",
                excerpt(class),
                excerpt(&name)
            );
            return Err(BinaryStop::new(start, message));
        };
        let span = Span::at(start);
        let FieldSlot::Field { index, kind } = slot else {
            let value = self.value(node, slot)?;
            self.word()?;
            if let FieldSlot::Old(old) = slot {
                self.asm.old.push((node, old, value));
            }
            return Ok(());
        };
        match kind {
            FieldType::SFNode | FieldType::SFPath | FieldType::SFEngine => {
                let entry = self.asm.set(node, index, Value::Node(None), span);
                self.statement(BinaryTarget::Field(node, entry))
            }
            FieldType::MFNode => {
                let left = self.count()?;
                let entry = self.asm.set(node, index, Value::Nodes(Vec::new()), span);
                self.stack.push(BinaryLevel::List { node, entry, left });
                Ok(())
            }
            _ => {
                let value = self.value(node, slot)?;
                let dynamic = match &value {
                    Value::String(kind) if name == "type" => Some(kind.clone()),
                    _ => None,
                };
                let entry = self.asm.set(node, index, value, span);
                if let Some(kind) = dynamic {
                    self.asm.specialize(node, &kind, None);
                }
                self.tail(node, entry)
            }
        }
    }

    /// Reads a value that contains no nodes, and reports names that the enumeration does not have.
    fn value(&mut self, node: NodeId, slot: FieldSlot) -> BinaryStep<Value> {
        let left = self.asm.releases(self.bytes.len());
        let mut context = Context {
            left: &left,
            names: self.asm.names_of(node, slot),
            wide_pixels: self.asm.header.version < (2, 1),
            mistakes: Vec::new(),
        };
        let kind = self.asm.written_as(node, slot);
        let value = self.parse(|input| binary_values::value(input, kind, &mut context));
        for mistake in context.mistakes {
            let span = Span::at(self.bytes.len() - mistake.at.len());
            let warning = self.asm.document.sink.warn(span, mistake.message());
            warning.kind = mistake.kind();
        }
        value
    }

    /// Reads `isA`, which is written as a field in this format.
    fn is_a(&mut self, node: NodeId) -> BinaryStep<()> {
        let list = self.parse(|input| binary_values::list(input, binary_values::string))?;
        self.word()?;
        self.asm
            .declare(node, Vec::new(), list.into_iter().map(Into::into).collect());
        Ok(())
    }

    /// Reads a field's flags, and the node and output to which it is connected.
    fn tail(&mut self, node: NodeId, entry: usize) -> BinaryStep<()> {
        let flags = self.word()?;
        self.asm.data(node).fields[entry].ignored = flags & IGNORED != 0;
        // A field with both the default and the connected flag is connected.
        if flags == DEFAULT && self.is_default(node, entry) {
            self.asm.data(node).fields.remove(entry);
            return Ok(());
        }
        if flags & !7 != 0 {
            return Err(BinaryStop::new(
                self.at() - 4,
                format!("a field's flags cannot be {flags:#x}"),
            ));
        }
        if flags & CONNECTED != 0 {
            return self.statement(BinaryTarget::Source(node, entry));
        }
        Ok(())
    }

    /// Returns whether the value of a field that is marked as default is the catalogue's default.
    fn is_default(&self, node: NodeId, entry: usize) -> bool {
        let data = &self.asm.document.nodes[node.0 as usize];
        let field = &data.fields[entry];
        match data.class {
            ClassRef::Known(id) => {
                field.value == Value::default_of(&id.get().fields[usize::from(field.index)])
            }
            ClassRef::Extension(_) => true,
        }
    }

    /// Stores a node where it belongs.
    fn attach(&mut self, target: BinaryTarget, node: NodeId) {
        match target {
            BinaryTarget::Root => self.roots.push(node),
            BinaryTarget::Child(parent) => self.asm.data(parent).children.push(node),
            BinaryTarget::Field(holder, entry) => {
                self.asm.data(holder).fields[entry].value = Value::Node(Some(node));
            }
            BinaryTarget::Element(holder, entry) => {
                if let Value::Nodes(list) = &mut self.asm.data(holder).fields[entry].value {
                    list.push(node);
                }
            }
            BinaryTarget::Source(..) => {}
        }
    }

    /// Stores a node where it belongs, and reads the part of the field that follows it.
    fn deliver(&mut self, target: BinaryTarget, node: NodeId) -> BinaryStep<()> {
        self.asm.complete(node);
        self.attach(target, node);
        match target {
            BinaryTarget::Field(holder, entry) if !self.is_path(holder) => self.tail(holder, entry),
            BinaryTarget::Source(holder, entry) => {
                let output = self.string()?;
                if !is_word(output.as_bytes()) {
                    let message = format!("an output cannot be named `{}`", excerpt(&output));
                    return Err(BinaryStop::new(self.at(), message));
                }
                let here = Span::at(self.at());
                self.asm.check_connection(node, &output, here);
                let output = output.into();
                let connection = Some(Box::new(Connection { from: node, output }));
                self.asm.data(holder).fields[entry].connection = connection;
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn is_path(&self, node: NodeId) -> bool {
        self.asm.document.nodes[node.0 as usize].class == ClassRef::Known(class::PATH)
    }

    /// Reads the part of the field that follows a `NULL` or an unknown name.
    fn deliver_nothing(&mut self, target: BinaryTarget) -> BinaryStep<()> {
        match target {
            BinaryTarget::Field(holder, entry) if !self.is_path(holder) => self.tail(holder, entry),
            BinaryTarget::Source(..) => self.string().map(|_| ()),
            _ => Ok(()),
        }
    }
}
