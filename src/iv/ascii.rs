//! Reads the ASCII formats: Inventor V1.0 to V2.1, VRML 1.0 and VRML97.
//!
//! What a token means depends on the field that it is in, so the catalogue leads. Nodes that are
//! open stand on a `Vec`, not on the program's stack: a file may nest as deep as it likes. What is
//! wrong is reported and skipped to the next field's name or brace.

use super::assemble::{Assembler, Slot};
use super::document::{ClassRef, Connection};
use super::field::{self, Bad, def_name, skip, word};
use super::proto::Access;
use super::upgrade::nearest_class;
use super::value::{NodeId, Value};
use crate::diag::{Diagnostic, Result, Span, nearest};
use crate::grammar::{ClassId, FieldType, Treatment, class, path};

mod vrml97;

use vrml97::Scope;

/// Where a node goes once it is read.
#[derive(Clone, Copy, Debug)]
enum Target {
    Root,
    Child(NodeId),
    /// The value of an `SFNode`, by its place among the node's fields.
    Field(NodeId, usize),
    /// One of an `MFNode`'s, in brackets or alone.
    Element(NodeId, usize),
    Alone(NodeId, usize),
    /// The node that a field's value comes from.
    Source(NodeId, usize),
    /// A node of a proto's body.
    Proto(usize),
    /// The value of a field that the class does not have.
    Nowhere,
}

/// What is open, innermost last.
enum Level {
    Body {
        node: NodeId,
        target: Target,
        start: usize,
    },
    List {
        node: NodeId,
        entry: usize,
    },
    /// The interface of a proto, in brackets.
    Interface {
        proto: usize,
        scope: Scope,
    },
    /// The body of a proto, in braces.
    Proto {
        proto: usize,
        scope: Scope,
    },
}

struct Reader<'r, 'd, 's> {
    asm: &'r mut Assembler<'d>,
    text: &'s [u8],
    rest: &'s [u8],
    stack: Vec<Level>,
    roots: Vec<NodeId>,
    /// Said that the file ends too soon.
    truncated: bool,
}

/// Reads the nodes of a file. `Err` is a limit that was passed.
pub fn read(asm: &mut Assembler<'_>, text: &[u8]) -> Result<Vec<NodeId>> {
    let rest = &text[asm.header.length.min(text.len())..];
    // Anything after the header on its line is a comment.
    let mut reader = Reader {
        asm,
        text,
        rest,
        stack: Vec::new(),
        roots: Vec::new(),
        truncated: false,
    };
    while reader.step()? {}
    Ok(reader.roots)
}

impl<'s> Reader<'_, '_, 's> {
    fn offset(&self, rest: &[u8]) -> usize {
        self.text.len() - rest.len()
    }

    fn span(&self, from: &[u8], to: &[u8]) -> Span {
        Span::new(self.offset(from), self.offset(to))
    }

    fn here(&self) -> Span {
        let end = word(self.rest).map_or(&self.rest[self.rest.len().min(1)..], |(rest, _)| rest);
        self.span(self.rest, end)
    }

    fn warn(&mut self, span: Span, message: impl Into<String>) -> &mut Diagnostic {
        self.asm.document.sink.warn(span, message)
    }

    /// Skips space, then takes a byte if it is the next one.
    fn take(&mut self, byte: u8) -> bool {
        self.rest = skip(self.rest);
        let next = self.rest.first() == Some(&byte);
        self.rest = &self.rest[usize::from(next)..];
        next
    }

    fn peek(&mut self) -> Option<u8> {
        self.rest = skip(self.rest);
        self.rest.first().copied()
    }

    /// Reads one thing. `false`: the file is at its end.
    fn step(&mut self) -> Result<bool> {
        let next = self.peek();
        match (self.stack.last(), next) {
            (None, None) => Ok(false),
            (Some(_), None) => {
                self.end_early();
                Ok(true)
            }
            (None, Some(_)) => self.statement(Target::Root).map(|()| true),
            (
                Some(&Level::Body {
                    node,
                    target,
                    start,
                }),
                Some(b'}'),
            ) => {
                self.rest = &self.rest[1..];
                self.stack.pop();
                self.finish(node, start);
                self.expand(node)?;
                self.deliver(target, node)?;
                Ok(true)
            }
            (Some(&Level::Body { node, .. }), Some(_)) => self.item(node).map(|()| true),
            (Some(&Level::List { node, entry }), Some(b']')) => {
                self.rest = &self.rest[1..];
                self.stack.pop();
                self.tail(node, entry)?;
                Ok(true)
            }
            (Some(&Level::List { .. }), Some(b'}')) => {
                let span = self.here();
                self.warn(span, "this list of nodes has no closing `]`");
                self.stack.pop();
                Ok(true)
            }
            (Some(&Level::List { node, entry }), Some(_)) => {
                self.statement(Target::Element(node, entry)).map(|()| true)
            }
            (Some(Level::Interface { .. }), Some(b']')) => {
                self.rest = &self.rest[1..];
                self.interface_done().map(|()| true)
            }
            (Some(&Level::Interface { proto, .. }), Some(_)) => {
                self.interface(proto).map(|()| true)
            }
            (Some(Level::Proto { .. }), Some(b'}')) => {
                self.rest = &self.rest[1..];
                self.proto_done();
                Ok(true)
            }
            (Some(&Level::Proto { proto, .. }), Some(_)) => {
                self.statement(Target::Proto(proto)).map(|()| true)
            }
        }
    }

    /// The file ends inside a node or list: says so once, and closes it.
    fn end_early(&mut self) {
        if !self.truncated {
            self.truncated = true;
            let open = self.stack.iter().rev().find_map(|level| match level {
                Level::Body { node, start, .. } => Some((*node, *start)),
                _ => None,
            });
            let class = open
                .map_or("a node", |(node, _)| {
                    self.asm.document.node(node).class_name()
                })
                .to_owned();
            let line = open.map_or(1, |(_, start)| self.line_of(start));
            let span = Span::at(self.text.len());
            self.warn(
                span,
                format!("the file ends inside the `{class}` that line {line} begins"),
            )
            .help("a `}` is missing, or the file was cut off; what was read is kept");
        }
        match self.stack.pop() {
            Some(Level::Body {
                node,
                target,
                start,
            }) => {
                self.finish(node, start);
                self.attach(target, node);
            }
            Some(level @ (Level::Interface { .. } | Level::Proto { .. })) => {
                self.stack.push(level);
                self.proto_done();
            }
            Some(Level::List { .. }) | None => {}
        }
    }

    fn line_of(&self, offset: usize) -> u32 {
        let source = self.asm.document.sources.get(usize::from(self.asm.source));
        source.map_or(1, |s| s.line_column(offset as u32).0)
    }

    fn finish(&mut self, node: NodeId, start: usize) {
        let end = self.offset(self.rest);
        let data = self.asm.data(node);
        data.span = Span::new(start, end);
        data.fields.shrink_to_fit();
        data.children.shrink_to_fit();
    }

    /// A node, or a `USE`, or `NULL`, or one of VRML97's statements.
    fn statement(&mut self, target: Target) -> Result<()> {
        let start = self.rest;
        let Ok((rest, token)) = word(start) else {
            return self.stray();
        };
        match token {
            b"DEF" => {
                let named = skip(rest);
                let Ok((after, name)) = def_name(named) else {
                    self.rest = rest;
                    let span = self.here();
                    self.warn(span, "`DEF` needs a name");
                    return Ok(());
                };
                self.rest = skip(after);
                self.node(target, Some(name), start)
            }
            b"USE" => {
                self.rest = skip(rest);
                self.use_node(target)
            }
            b"NULL" => {
                self.rest = rest;
                self.deliver_nothing(target)
            }
            b"PROTO" | b"EXTERNPROTO" if skip(rest).first() != Some(&b'{') => {
                self.rest = skip(rest);
                self.proto(token == b"EXTERNPROTO")
            }
            b"ROUTE" if skip(rest).first() != Some(&b'{') => {
                self.rest = skip(rest);
                self.route();
                Ok(())
            }
            _ => self.node(target, None, start),
        }
    }

    /// Something that begins nothing: said, and skipped.
    fn stray(&mut self) -> Result<()> {
        let span = self.here();
        let message = field::expected("a node or a field", self.rest);
        self.warn(span, message);
        self.rest = match self.rest.first() {
            Some(b'{' | b'[' | b'"' | b'(') => field::past_token(self.rest),
            _ => &self.rest[1.min(self.rest.len())..],
        };
        Ok(())
    }

    /// `Class {`, its name having been read; `start` is where the statement began.
    fn node(&mut self, target: Target, name: Option<&[u8]>, start: &'s [u8]) -> Result<()> {
        let at = self.rest;
        let Ok((rest, token)) = word(at) else {
            return self.stray();
        };
        self.rest = rest;
        if self.peek() != Some(b'{') {
            let message = format!("expected `{{` after `{}`", field::text(token));
            let span = self.span(at, rest);
            self.warn(span, message);
            return self.deliver_nothing(target);
        }
        self.rest = &self.rest[1..];
        let class_name = field::text(token);
        let span = self.span(start, rest);
        let known = self.asm.class_named(&class_name);
        let declares = self.declares();
        let class = match known {
            Some(class) if !declares => class,
            _ => self.asm.blank(&class_name, known),
        };
        let node = self.asm.add(class, None, span)?;
        if let Some(name) = name {
            self.asm.define(name, node);
        }
        if self.stack.len() >= self.asm.limits.depth {
            let message = format!("nodes are nested more than {} deep", self.asm.limits.depth);
            return Err(self
                .asm
                .document
                .sink
                .error(span, message)
                .with_help("`--scene-limit depth=N` raises this"));
        }
        let start = self.offset(start);
        if known.is_none() && !declares && self.peek() != Some(b'}') {
            self.unknown(&class_name, self.span(at, rest));
        }
        self.stack.push(Level::Body {
            node,
            target,
            start,
        });
        Ok(())
    }

    /// Whether the body that is about to be read says what its fields are.
    fn declares(&mut self) -> bool {
        self.rest = skip(self.rest);
        word(self.rest).is_ok_and(|(rest, w)| {
            matches!(w, b"fields" | b"isA") && skip(rest).first() == Some(&b'[')
        })
    }

    /// Skips the contents of a node that nothing declares, up to its closing brace.
    fn unknown(&mut self, name: &str, span: Span) {
        let near = if self.asm.may_hint() {
            nearest_class(name)
        } else {
            None
        };
        let help = match near {
            Some(near) => format!("did you mean `{near}`?"),
            None => {
                "a file can declare its own classes: `fields [ SFFloat width ]` first in the braces"
                    .into()
            }
        };
        self.warn(
            span,
            format!("`{name}` is not a class of nodes; its contents are skipped"),
        )
        .help(help);
        let inside = self.rest;
        let after = field::past_braces(inside);
        // Stay before the closing brace, which is closed like any other.
        let skipped = inside.len() - after.len();
        let closed = inside[..skipped].last() == Some(&b'}');
        self.rest = &inside[skipped - usize::from(closed)..];
    }

    /// A name after `USE`. In `USE engine.output` the dot is not part of it.
    fn use_node(&mut self, target: Target) -> Result<()> {
        let at = self.rest;
        let Ok((mut rest, token)) = def_name(at) else {
            let span = self.here();
            self.warn(span, "`USE` needs a name");
            return self.deliver_nothing(target);
        };
        let mut found = self.asm.used(token);
        if found.is_none() {
            for dot in token
                .iter()
                .enumerate()
                .filter(|(_, b)| **b == b'.')
                .map(|(i, _)| i)
            {
                found = self.asm.used(&token[..dot]);
                if found.is_some() {
                    rest = &at[dot..];
                    break;
                }
            }
        }
        self.rest = rest;
        let Some(node) = found else {
            let name = field::text(token);
            let near = self.asm.nearest_name(&name);
            let span = self.span(at, rest);
            let warning = self.warn(span, format!("no node before this is called `{name}`"));
            if let Some(near) = near {
                warning.help(format!("did you mean `{near}`?"));
            }
            return self.deliver_nothing(target);
        };
        self.deliver(target, node)
    }

    /// Puts a node where it goes, and reads what may follow it there.
    fn deliver(&mut self, target: Target, node: NodeId) -> Result<()> {
        self.attach(target, node);
        match target {
            Target::Field(holder, entry) | Target::Alone(holder, entry) => self.tail(holder, entry),
            Target::Source(holder, entry) => self.output(holder, entry, node),
            _ => Ok(()),
        }
    }

    fn attach(&mut self, target: Target, node: NodeId) {
        match target {
            Target::Root => self.roots.push(node),
            Target::Child(parent) => self.asm.data(parent).children.push(node),
            Target::Field(holder, entry) => {
                self.asm.data(holder).fields[entry].value = Value::Node(Some(node));
            }
            Target::Element(holder, entry) | Target::Alone(holder, entry) => {
                if let Value::Nodes(list) = &mut self.asm.data(holder).fields[entry].value {
                    list.push(node);
                }
            }
            Target::Source(..) | Target::Nowhere => {}
            Target::Proto(proto) => self.asm.document.protos[proto].body.push(node),
        }
    }

    fn deliver_nothing(&mut self, target: Target) -> Result<()> {
        match target {
            Target::Field(holder, entry) | Target::Alone(holder, entry) => self.tail(holder, entry),
            _ => Ok(()),
        }
    }

    /// `. output` after the node of a connection.
    fn output(&mut self, holder: NodeId, entry: usize, from: NodeId) -> Result<()> {
        if !self.take(b'.') {
            let span = self.here();
            self.warn(
                span,
                "a connection needs `.` and a field's or output's name after its node",
            );
            return Ok(());
        }
        self.rest = skip(self.rest);
        let Ok((rest, name)) = word(self.rest) else {
            let span = self.here();
            self.warn(
                span,
                "a connection needs a field's or output's name after the dot",
            );
            return Ok(());
        };
        self.rest = rest;
        let output = field::text(name).into();
        self.asm.data(holder).fields[entry].connection =
            Some(Box::new(Connection { from, output }));
        self.tail(holder, entry)
    }

    /// One item of a node's body: a field, a child, or a declaration.
    fn item(&mut self, node: NodeId) -> Result<()> {
        let start = self.rest;
        let Ok((rest, token)) = word(start) else {
            return self.stray();
        };
        let after = skip(rest);
        let opens = after.first() == Some(&b'{');
        match token {
            b"DEF" | b"USE" => return self.child(node),
            b"fields" | b"isA" if after.first() == Some(&b'[') => {
                self.rest = after;
                return self.declaration(node, token == b"isA");
            }
            b"PROTO" | b"EXTERNPROTO" | b"ROUTE" if !opens => {
                return self.statement(Target::Child(node));
            }
            _ => {}
        }
        if self.is_script(node)
            && let Some(access) = Access::named(token)
        {
            self.rest = rest;
            return self.script_interface(node, access);
        }
        let name = std::str::from_utf8(token).unwrap_or("\u{fffd}");
        if self.asm.in_protos > 0 && word(after).is_ok_and(|(_, w)| w == b"IS") {
            self.rest = rest;
            return self.is_link(node, name);
        }
        if !opens && let Some(slot) = self.asm.slot(node, name) {
            self.rest = rest;
            return self.field(node, slot, self.span(start, rest));
        }
        if opens || token == b"NULL" {
            return self.child(node);
        }
        if self.class_of(node) == Some(class::PATH) && field::integer(start).is_ok() {
            self.path_indices(node);
            return Ok(());
        }
        if self.is_global_field(node)
            && let Some(Value::String(kind)) = self.asm.document.node(node).value("type").cloned()
            && self.asm.specialize(node, &kind, Some(name)).is_some()
        {
            return Ok(()); // the word is a field's name now
        }
        self.rest = rest;
        self.no_field(node, name, self.span(start, rest))
    }

    fn is_global_field(&self, node: NodeId) -> bool {
        self.class_of(node) == Some(class::GLOBAL_FIELD)
    }

    fn class_of(&self, node: NodeId) -> Option<ClassId> {
        match self.asm.document.nodes[node.0 as usize].class {
            ClassRef::Known(id) => Some(id),
            ClassRef::Extension(_) => None,
        }
    }

    fn child(&mut self, node: NodeId) -> Result<()> {
        if self.class_of(node) == Some(class::PATH) {
            let entry = self
                .asm
                .set(node, path::HEAD.index, Value::Node(None), self.here());
            self.statement(Target::Field(node, entry))?;
            return Ok(());
        }
        if let Some(id) = self.class_of(node)
            && matches!(id.get().treatment, Treatment::Rendered | Treatment::State)
        {
            let span = self.here();
            self.warn(
                span,
                format!(
                    "a `{}` has no children; this one is not drawn",
                    id.get().name
                ),
            );
        }
        self.statement(Target::Child(node))
    }

    fn no_field(&mut self, node: NodeId, name: &str, span: Span) -> Result<()> {
        let class = self.asm.document.node(node).class_name().to_owned();
        let hint = self.asm.may_hint();
        let fields = self.asm.field_names(node);
        let near = nearest(name, fields.iter().copied().filter(|_| hint));
        let help = match near {
            Some(near) => format!("did you mean `{near}`?"),
            None if fields.is_empty() => format!("a `{class}` has no fields"),
            None if fields.len() > 100 => format!("a `{class}` has {} fields", fields.len()),
            None => format!("a `{class}` has {}", fields.join(", ")),
        };
        self.warn(span, format!("`{class}` has no field `{name}`"))
            .help(help);
        if self.value_is_node(node) {
            return self.statement(Target::Nowhere);
        }
        self.recover(node);
        Ok(())
    }

    /// Whether a node comes next that is the value of a field and not a child. Where children
    /// stand among the fields, what follows a mistake may be one of them.
    fn value_is_node(&mut self, node: NodeId) -> bool {
        self.rest = skip(self.rest);
        let has_children = !self.asm.header.is_vrml97()
            && self
                .class_of(node)
                .is_some_and(|id| id.get().treatment == Treatment::Group);
        match word(self.rest) {
            Ok((_, b"DEF" | b"USE" | b"NULL")) => !has_children,
            Ok((rest, _)) => !has_children && skip(rest).first() == Some(&b'{'),
            Err(_) => false,
        }
    }

    /// Skips to what can be read again: a field of this node, a child, or the closing brace.
    fn recover(&mut self, node: NodeId) {
        loop {
            let Some(next) = self.peek() else { return };
            if next == b'}' {
                return;
            }
            if let Ok((rest, token)) = word(self.rest) {
                let name = std::str::from_utf8(token).unwrap_or_default();
                let known = matches!(token, b"DEF" | b"USE" | b"ROUTE" | b"PROTO")
                    || self.asm.slot(node, name).is_some();
                if known || skip(rest).first() == Some(&b'{') {
                    return;
                }
            }
            self.rest = field::past_token(self.rest);
        }
    }

    /// A field's value, its name having been read.
    fn field(&mut self, node: NodeId, slot: Slot, name: Span) -> Result<()> {
        let kind = slot.kind();
        let next = self.peek();
        let Slot::Field { index, .. } = slot else {
            return self.old_field(node, slot, name);
        };
        // `name = …` and `name ~` leave the value to the catalogue or the connection.
        if kind == FieldType::SFTrigger || matches!(next, Some(b'=' | b'~')) {
            let value = self.default_of(node, index, kind);
            let entry = self.asm.set(node, index, value, name);
            return self.tail(node, entry);
        }
        match kind {
            FieldType::SFNode | FieldType::SFPath | FieldType::SFEngine => {
                let entry = self.asm.set(node, index, Value::Node(None), name);
                self.statement(Target::Field(node, entry))
            }
            FieldType::MFNode => {
                let entry = self.asm.set(node, index, Value::Nodes(Vec::new()), name);
                if self.take(b'[') {
                    self.stack.push(Level::List { node, entry });
                    return Ok(());
                }
                self.statement(Target::Alone(node, entry))
            }
            _ => self.plain(node, slot, index, name),
        }
    }

    fn plain(&mut self, node: NodeId, slot: Slot, index: u16, name: Span) -> Result<()> {
        let at = self.rest;
        match field::value(
            at,
            self.asm.written_as(node, slot),
            self.asm.names_of(node, slot),
        ) {
            Ok(read) => {
                self.rest = read.rest;
                let span = Span {
                    start: name.start,
                    end: self.offset(read.rest) as u32,
                };
                let dynamic = self.dynamic_type(node, index, &read.value);
                if let Value::String(s) = &read.value {
                    self.long_string(s, at);
                }
                let entry = self.asm.set(node, index, read.value, span);
                if let Some(bad) = read.bad {
                    self.bad_value(node, index, &bad);
                }
                if let Some(kind) = dynamic {
                    self.asm.specialize(node, &kind, None);
                }
                self.tail(node, entry)
            }
            Err(bad) => {
                self.bad_value(node, index, &bad);
                if bad.what.contains("closing quote") {
                    self.truncated = true; // it was said: nothing after the quote is left
                    self.rest = &[];
                } else {
                    self.rest = at;
                }
                self.recover(node);
                Ok(())
            }
        }
    }

    /// The type that an engine's other fields follow, if this is the field that says so.
    fn dynamic_type(&self, node: NodeId, index: u16, value: &Value) -> Option<Box<str>> {
        let name = self.class_of(node)?.get().fields[usize::from(index)].name;
        match value {
            Value::String(kind) if name == "type" => Some(kind.clone()),
            _ => None,
        }
    }

    /// An escaped quote at a line's end was sometimes meant to end the string.
    fn long_string(&mut self, string: &str, at: &[u8]) {
        if string.contains("\"\n") || string.contains("\"\r") {
            let span = self.span(at, &at[1..]);
            self.warn(
                span,
                "this string goes on over the line's end, because the quote there has a backslash",
            )
            .help("double the backslash if the string should end there");
        }
    }

    fn bad_value(&mut self, node: NodeId, index: u16, bad: &Bad<'_>) {
        let fields = self.asm.field_names(node);
        let name = fields
            .get(usize::from(index))
            .copied()
            .unwrap_or_default()
            .to_owned();
        let class = self.asm.document.node(node).class_name().to_owned();
        let end = def_name(bad.at).map_or(bad.at, |(rest, _)| rest);
        let span = self.span(bad.at, end);
        self.warn(span, format!("`{class}.{name}`: {}", bad.what));
    }

    fn old_field(&mut self, node: NodeId, slot: Slot, name: Span) -> Result<()> {
        let Slot::Old(old) = slot else { return Ok(()) };
        match field::value(self.rest, slot.kind(), self.asm.names_of(node, slot)) {
            Ok(read) => {
                self.rest = read.rest;
                self.asm.old.push((node, old, read.value));
                self.take(b'~');
            }
            Err(bad) => {
                self.warn(name, format!("`{}`: {}", old.name, bad.what));
                self.recover(node);
            }
        }
        Ok(())
    }

    fn default_of(&self, node: NodeId, index: u16, kind: FieldType) -> Value {
        let data = &self.asm.document.nodes[node.0 as usize];
        if let Some(stated) = data.fields.iter().find(|f| f.index == index) {
            return stated.value.clone();
        }
        match data.class {
            ClassRef::Known(id) => Value::default_of(&id.get().fields[usize::from(index)]),
            ClassRef::Extension(_) => Value::empty(kind),
        }
    }

    /// What may follow a value: `~`, and `= node . output`.
    fn tail(&mut self, node: NodeId, entry: usize) -> Result<()> {
        if self.take(b'~') {
            self.asm.data(node).fields[entry].ignored = true;
        }
        if self.take(b'=') {
            self.rest = skip(self.rest);
            return self.statement(Target::Source(node, entry));
        }
        Ok(())
    }

    /// The numbers of a path: how many, then the child's number at each step from the head.
    fn path_indices(&mut self, node: NodeId) {
        let start = self.rest;
        let mut numbers = Vec::new();
        while let Ok((rest, n)) = field::integer(skip(self.rest)) {
            numbers.push(n as i32);
            self.rest = rest;
        }
        let span = self.span(start, self.rest);
        if numbers.first().map(|&n| n as usize) != Some(numbers.len() - 1) {
            self.warn(span, "a path's first number says how many follow");
        }
        numbers.remove(0);
        self.asm
            .set(node, path::INDICES.index, Value::Ints(numbers), span);
    }

    /// `fields [ SFFloat width, … ]` or `isA [ "Group" ]`.
    fn declaration(&mut self, node: NodeId, is_a: bool) -> Result<()> {
        let list = &self.rest[1..];
        let mut rest = skip(list);
        let mut words: Vec<(String, &'s [u8])> = Vec::new();
        while !matches!(rest.first(), None | Some(b']' | b'}')) {
            let at = rest;
            let (next, text) = match rest.first() {
                Some(b'"') => match field::string(rest) {
                    Ok((next, text)) => (next, text),
                    Err(_) => break,
                },
                _ => match word(rest) {
                    Ok((next, text)) => (next, field::text(text)),
                    Err(_) => (&rest[1..], String::new()),
                },
            };
            if !text.is_empty() {
                words.push((text, at));
            }
            rest = skip(next);
        }
        self.rest = &rest[usize::from(rest.first() == Some(&b']'))..];
        if is_a {
            let bare = |s: &str| s.strip_prefix("So").unwrap_or(s).into();
            self.asm.declare(
                node,
                Vec::new(),
                words.iter().map(|(w, _)| bare(w)).collect(),
            );
            return Ok(());
        }
        let mut fields: Vec<(Box<str>, FieldType)> = Vec::new();
        for pair in words.chunks_exact(2) {
            let (kind, at) = &pair[0];
            match FieldType::named(kind.strip_prefix("So").unwrap_or(kind)) {
                Some(_) if pair[1].0 == "isA" => {}
                Some(kind) => fields.push((pair[1].0.as_str().into(), kind)),
                None => {
                    let span = self.span(at, &at[kind.len().min(at.len())..]);
                    self.warn(span, format!("`{kind}` is not a type of fields"));
                }
            }
        }
        self.asm.declare(node, fields, Vec::new());
        Ok(())
    }
}
