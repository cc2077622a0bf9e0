//! Reads the body of a node: its fields, connections, and the fields that it declares.
use ivcam_base::diag::{Result, Span, excerpt, nearest};

use super::nodes::is_declaration;
use super::reader::{AsciiLevel, AsciiReader, AsciiTarget};
use crate::grammar::value::{NodeId, Value};
use crate::grammar::{ClassId, FieldType, Treatment, class, path};
use crate::iv::declarations::Access;
use crate::iv::document::ClassRef;
use crate::iv::encoding::{Escapes, text};
use crate::iv::read::assemble::FieldSlot;
use crate::iv::read::numbers::integer;
use crate::iv::read::syntax_error::{Problem, SyntaxError};
use crate::iv::read::tokens::{def_name, past_token, skip, string, word};
use crate::iv::read::values;

/// The field of `Material` that is no field of the standards, which files declare.
const REFRACTION: &str = "refractionIndex";

impl<'s> AsciiReader<'_, '_, 's> {
    /// Reads one item of a node's body: a field, a child, or a declaration.
    pub(super) fn item(&mut self, node: NodeId) -> Result<()> {
        let start = self.rest;
        let Ok((rest, token)) = word(start) else {
            return self.stray();
        };
        let after = skip(rest);
        let opens = after.first() == Some(&b'{');
        match token {
            b"DEF" | b"USE" => return self.child(node),
            _ if is_declaration(token, after) => {
                self.rest = after;
                return self.declaration(node, token == b"isA");
            }
            b"PROTO" | b"EXTERNPROTO" | b"ROUTE" if !opens => {
                return self.statement(AsciiTarget::Child(node));
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
        if self.class_of(node) == Some(class::PATH) && integer(start).is_ok() {
            self.path_indices(node);
            return Ok(());
        }
        if self.is_global_field(node)
            && let Some(Value::String(kind)) = self.asm.document.node(node).value("type").cloned()
            && self.asm.specialize(node, &kind, Some(name)).is_some()
        {
            return Ok(()); // The class now has a field of this name, which is read next.
        }
        self.rest = rest;
        self.no_field(node, name, self.span(start, rest))
    }

    /// Returns whether a node is a `GlobalField`.
    pub(super) fn is_global_field(&self, node: NodeId) -> bool {
        self.class_of(node) == Some(class::GLOBAL_FIELD)
    }

    /// Returns the catalogue's class of a node, or `None` if the file declares the class.
    pub(super) fn class_of(&self, node: NodeId) -> Option<ClassId> {
        match self.asm.document.nodes[node.0 as usize].class {
            ClassRef::Known(id) => Some(id),
            ClassRef::Extension(_) => None,
        }
    }

    /// Reads a child of a node, or the head of a path.
    pub(super) fn child(&mut self, node: NodeId) -> Result<()> {
        if self.class_of(node) == Some(class::PATH) {
            let entry = self
                .asm
                .set(node, path::HEAD.index, Value::Node(None), self.here());
            self.statement(AsciiTarget::Field(node, entry))?;
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
        self.statement(AsciiTarget::Child(node))
    }

    /// Warns about an unknown field and skips its value.
    pub(super) fn no_field(&mut self, node: NodeId, name: &str, span: Span) -> Result<()> {
        let class = excerpt(self.asm.document.node(node).class_name()).into_owned();
        let hint = self.asm.may_hint();
        let fields = self.asm.field_names(node);
        let near = nearest(name, fields.iter().copied().filter(|_| hint));
        let header = &self.asm.header;
        let is_inventors = !(header.is_vrml97() || header.is_x3d());
        let help = match near {
            _ if is_inventors && class == "Material" && name == REFRACTION => format!(
                "declare the field: `Material {{ fields [ SFFloat {REFRACTION} ] {REFRACTION} 1.5 }}`"
            ),
            Some(near) => format!("did you mean `{near}`?"),
            None if fields.is_empty() => format!("a `{class}` has no fields"),
            None if fields.len() > 100 => format!("a `{class}` has {} fields", fields.len()),
            None => format!("a `{class}` has {}", fields.join(", ")),
        };
        self.warn(span, format!("`{class}` has no field `{}`", excerpt(name)))
            .help(help);
        if self.value_is_node(node) {
            return self.statement(AsciiTarget::Discarded);
        }
        self.recover(node);
        Ok(())
    }

    /// Returns whether the next item is a node that is the value of an unknown field. In a group a
    /// node is more likely a child, because children are written among the fields.
    pub(super) fn value_is_node(&mut self, node: NodeId) -> bool {
        self.rest = skip(self.rest);
        let has_children = !(self.asm.header.is_vrml97() || self.asm.header.is_x3d())
            && self
                .class_of(node)
                .is_some_and(|id| id.get().treatment == Treatment::Group);
        match word(self.rest) {
            Ok((_, b"DEF" | b"USE" | b"NULL")) => !has_children,
            Ok((rest, _)) => !has_children && skip(rest).first() == Some(&b'{'),
            Err(_) => false,
        }
    }

    /// Skips to the next item from which reading can continue: a field of this node, a child, or
    /// the closing brace.
    pub(super) fn recover(&mut self, node: NodeId) {
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
            self.rest = past_token(self.rest, self.asm.header.escapes());
        }
    }

    /// Reads the value of a field, whose name has been read.
    pub(super) fn field(&mut self, node: NodeId, slot: FieldSlot, name: Span) -> Result<()> {
        let kind = slot.kind();
        let next = self.peek();
        let FieldSlot::Field { index, .. } = slot else {
            return self.old_field(node, slot, name);
        };
        // `name = …` and `name ~` state no value, so the default is stored.
        if kind == FieldType::SFTrigger || matches!(next, Some(b'=' | b'~')) {
            let value = self.default_of(node, index, kind);
            let entry = self.asm.set(node, index, value, name);
            return self.tail(node, entry);
        }
        match kind {
            FieldType::SFNode | FieldType::SFPath | FieldType::SFEngine => {
                let entry = self.asm.set(node, index, Value::Node(None), name);
                self.statement(AsciiTarget::Field(node, entry))
            }
            FieldType::MFNode => {
                let stated = self
                    .asm
                    .entry_of(node, index)
                    .filter(|_| self.asm.is_translated);
                let empty = || self.asm.set(node, index, Value::Nodes(Vec::new()), name);
                let entry = stated.unwrap_or_else(empty);
                if self.take(b'[') {
                    self.stack.push(AsciiLevel::List { node, entry });
                    return Ok(());
                }
                self.statement(AsciiTarget::Alone(node, entry))
            }
            _ => self.plain(node, slot, index, name),
        }
    }

    /// Reads the value of a field that contains no nodes.
    pub(super) fn plain(
        &mut self,
        node: NodeId,
        slot: FieldSlot,
        index: u16,
        name: Span,
    ) -> Result<()> {
        let at = self.rest;
        let kind = self.asm.written_as(node, slot);
        let names = self.asm.names_of(node, slot);
        let left = self.asm.releases(self.text.len());
        match values::value(at, kind, names, self.asm.header.escapes(), &left) {
            Ok((rest, read)) => {
                self.rest = rest;
                let span = Span {
                    start: name.start,
                    end: self.offset(rest) as u32,
                };
                let dynamic = self.dynamic_type(node, index, &read.value);
                if let Value::String(s) = &read.value {
                    self.long_string(s, at);
                }
                let entry = self.asm.set(node, index, read.value, span);
                if let Some(mistake) = read.mistake {
                    self.bad_value(node, index, &mistake);
                }
                if let Some(kind) = dynamic {
                    self.asm.specialize(node, &kind, None);
                }
                self.tail(node, entry)
            }
            Err(error) => {
                let error = SyntaxError::from(error);
                self.bad_value(node, index, &error);
                if error.problem == Problem::UnclosedString {
                    self.truncated = true; // The warning above is enough: the string has no end.
                    self.rest = &[];
                } else {
                    self.rest = at;
                }
                self.recover(node);
                Ok(())
            }
        }
    }

    /// Returns the type of an engine's other fields, if this is the field that states it.
    pub(super) fn dynamic_type(&self, node: NodeId, index: u16, value: &Value) -> Option<Box<str>> {
        let name = self.class_of(node)?.get().fields[usize::from(index)].name;
        match value {
            Value::String(kind) if name == "type" => Some(kind.clone()),
            _ => None,
        }
    }

    /// Warns about an escaped quote at the end of a line, which is often meant to end the string.
    pub(super) fn long_string(&mut self, string: &str, at: &[u8]) {
        if string.contains("\"\n") || string.contains("\"\r") {
            let span = self.span(at, &at[1..]);
            let help = match self.asm.header.escapes() {
                Escapes::Quote => "put a blank before the quote if the string should end there",
                Escapes::QuoteAndBackslash => "double the backslash if the string should end there",
            };
            self.warn(
                span,
                "this string continues on the next line, because the quote has a backslash before it",
            )
            .help(help);
        }
    }

    /// Warns about a value that cannot be parsed.
    pub(super) fn bad_value(&mut self, node: NodeId, index: u16, error: &SyntaxError<'_>) {
        let fields = self.asm.field_names(node);
        let name = fields.get(usize::from(index)).copied().unwrap_or_default();
        let name = excerpt(name).into_owned();
        let class = excerpt(self.asm.document.node(node).class_name()).into_owned();
        let end = def_name(error.at).map_or(error.at, |(rest, _)| rest);
        let span = self.span(error.at, end);
        self.warn(span, format!("`{class}.{name}`: {}", error.message()))
            .kind = error.kind();
    }

    /// Reads the value of a field that later versions do not have.
    pub(super) fn old_field(&mut self, node: NodeId, slot: FieldSlot, name: Span) -> Result<()> {
        let FieldSlot::Old(old) = slot else {
            return Ok(());
        };
        let names = self.asm.names_of(node, slot);
        let escapes = self.asm.header.escapes();
        match values::value(self.rest, slot.kind(), names, escapes, &|_| {}) {
            Ok((rest, read)) => {
                self.rest = rest;
                self.asm.old.push((node, old, read.value));
                self.take(b'~');
            }
            Err(error) => {
                let error = SyntaxError::from(error);
                self.warn(name, format!("`{}`: {}", old.name, error.message()))
                    .kind = error.kind();
                self.recover(node);
            }
        }
        Ok(())
    }

    /// Returns the stated value of a field, or its default.
    pub(super) fn default_of(&self, node: NodeId, index: u16, kind: FieldType) -> Value {
        let data = &self.asm.document.nodes[node.0 as usize];
        if let Some(stated) = data.fields.iter().find(|f| f.index == index) {
            return stated.value.clone();
        }
        match data.class {
            ClassRef::Known(id) => Value::default_of(&id.get().fields[usize::from(index)]),
            ClassRef::Extension(_) => Value::empty(kind),
        }
    }

    /// Reads the optional parts after a value: `~`, and `= node . output`.
    pub(super) fn tail(&mut self, node: NodeId, entry: usize) -> Result<()> {
        if self.take(b'~') {
            self.asm.data(node).fields[entry].ignored = true;
        }
        if self.take(b'=') {
            self.rest = skip(self.rest);
            return self.statement(AsciiTarget::Source(node, entry));
        }
        Ok(())
    }

    /// Reads the indices of a path: their count, then the index of the child at each level.
    pub(super) fn path_indices(&mut self, node: NodeId) {
        let start = self.rest;
        let mut numbers = Vec::new();
        while let Ok((rest, n)) = integer(skip(self.rest)) {
            numbers.push(n as i32);
            self.rest = rest;
        }
        let span = self.span(start, self.rest);
        if numbers.first().map(|&n| n as usize) != Some(numbers.len() - 1) {
            self.damage(
                span,
                "the first number of a path must be the number of indices after it",
            );
        }
        numbers.remove(0);
        self.asm
            .set(node, path::INDICES.index, Value::Ints(numbers), span);
    }

    /// Reads the words of a declaration: a list, or one string without brackets.
    fn declared_words(&mut self) -> Vec<(String, &'s [u8])> {
        let is_list = self.rest.first() == Some(&b'[');
        let mut rest = skip(&self.rest[usize::from(is_list)..]);
        let mut words = Vec::new();
        while !matches!(rest.first(), None | Some(b']' | b'}')) {
            let at = rest;
            let (next, text) = match rest.first() {
                Some(b'"') => match string(rest, self.asm.header.escapes()) {
                    Ok((next, text)) => (next, text),
                    Err(_) => break,
                },
                _ => match word(rest) {
                    Ok((next, bare)) => (next, text(bare)),
                    Err(_) => (&rest[1..], String::new()),
                },
            };
            if !text.is_empty() {
                words.push((text, at));
            }
            rest = skip(next);
            if !is_list {
                break;
            }
        }
        self.rest = &rest[usize::from(is_list && rest.first() == Some(&b']'))..];
        words
    }

    /// Reads `fields [ SFFloat width, … ]`, `isA [ "Group" ]` or `isA "Group"`.
    pub(super) fn declaration(&mut self, node: NodeId, is_a: bool) -> Result<()> {
        let words = self.declared_words();
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
                    self.warn(span, format!("`{}` is not a field type", excerpt(kind)));
                }
            }
        }
        self.asm.declare(node, fields, Vec::new());
        Ok(())
    }
}
