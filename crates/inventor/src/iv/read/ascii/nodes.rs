//! Reads statements: nodes, `DEF` and `USE`. Stores each node where it belongs.
use ivcam_base::diag::{Result, Span, excerpt, nearest};

use super::reader::{AsciiLevel, AsciiReader, AsciiTarget};
use crate::grammar::value::{NodeId, Value};
use crate::grammar::{self, Treatment};
use crate::iv::document::Connection;
use crate::iv::encoding::text;
use crate::iv::limits::beyond;
use crate::iv::read::syntax_error::expected;
use crate::iv::read::tokens::{def_name, past_braces, past_token, skip, word};

impl<'s> AsciiReader<'_, '_, 's> {
    /// Reads a node, a `USE`, `NULL`, or one of VRML97's statements.
    pub(super) fn statement(&mut self, target: AsciiTarget) -> Result<()> {
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
                    self.damage(span, "`DEF` needs a name");
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
            _ if matches!(target, AsciiTarget::Root)
                && self.asm.header.is_x3d()
                && skip(rest).first() != Some(&b'{')
                && self.x3d_statement(token, rest) =>
            {
                Ok(())
            }
            _ => self.node(target, None, start),
        }
    }

    /// Warns about a token that begins neither a node nor a field, and skips it.
    pub(super) fn stray(&mut self) -> Result<()> {
        let span = self.here();
        let message = expected("a node or a field", self.rest);
        self.damage(span, message);
        self.rest = match self.rest.first() {
            Some(b'{' | b'[' | b'"' | b'(') => past_token(self.rest, self.asm.header.escapes()),
            _ => &self.rest[1.min(self.rest.len())..],
        };
        Ok(())
    }

    /// Reads `Class {`. The name after `DEF` has been read; `start` is the start of the statement.
    pub(super) fn node(
        &mut self,
        target: AsciiTarget,
        name: Option<&[u8]>,
        start: &'s [u8],
    ) -> Result<()> {
        let at = self.rest;
        let Ok((rest, token)) = word(at) else {
            return self.stray();
        };
        self.rest = rest;
        if self.peek() != Some(b'{') {
            let message = format!("expected `{{` after `{}`", excerpt(&text(token)));
            let span = self.span(at, rest);
            self.damage(span, message);
            return self.deliver_nothing(target);
        }
        self.rest = &self.rest[1..];
        let class_name = text(token);
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
            return Err(beyond(&self.asm.document.sink, span, message, "depth"));
        }
        let start = self.offset(start);
        if known.is_none() && !declares {
            self.unknown(&class_name, self.span(at, rest));
        }
        self.stack.push(AsciiLevel::Body {
            node,
            target,
            start,
        });
        Ok(())
    }

    /// Returns whether the body that comes next begins with a declaration of its fields.
    pub(super) fn declares(&mut self) -> bool {
        self.rest = skip(self.rest);
        word(self.rest).is_ok_and(|(rest, token)| is_declaration(token, skip(rest)))
    }

    /// Warns about a node of an undeclared class, and skips its contents up to the closing brace.
    pub(super) fn unknown(&mut self, name: &str, span: Span) {
        let is_inside_itself = self.stack.iter().any(|level| match level {
            AsciiLevel::Proto { scope, .. } => *scope.name == *name,
            _ => false,
        });
        if is_inside_itself {
            let message = format!(
                "the prototype `{}` contains itself; the inner one is left out",
                excerpt(name)
            );
            self.warn(span, message);
            return self.skip_body();
        }
        let near = if self.asm.may_hint() {
            let classes = grammar::CLASSES.iter();
            let classes = classes.filter(|c| c.treatment != Treatment::Abstract);
            nearest(name, classes.map(|c| c.name))
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
        let result = match self.peek() {
            Some(b'}') => "it does nothing",
            _ => "its contents are skipped",
        };
        let message = format!("`{}` is not a known node class; {result}", excerpt(name));
        self.warn(span, message).help(help);
        self.skip_body();
    }

    /// Skips the contents of a node up to its closing brace.
    fn skip_body(&mut self) {
        let inside = self.rest;
        let after = past_braces(inside, self.asm.header.escapes());
        // Stop before the closing brace, which ends the node in the usual way.
        let skipped = inside.len() - after.len();
        let closed = inside[..skipped].last() == Some(&b'}');
        self.rest = &inside[skipped - usize::from(closed)..];
    }

    /// Reads the name after `USE`. In `USE engine.output` the dot is not part of it.
    pub(super) fn use_node(&mut self, target: AsciiTarget) -> Result<()> {
        let at = self.rest;
        let Ok((mut rest, token)) = def_name(at) else {
            let span = self.here();
            self.damage(span, "`USE` needs a name");
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
            let name = text(token);
            let near = self.asm.nearest_name(&name);
            let span = self.span(at, rest);
            let message = format!("no earlier node is named `{}`", excerpt(&name));
            let warning = self.warn(span, message);
            if let Some(near) = near {
                warning.help(format!("did you mean `{}`?", excerpt(&near)));
            }
            return self.deliver_nothing(target);
        };
        self.deliver(target, node)
    }

    /// Stores a node where it belongs, and reads the part of the field that may follow it.
    pub(super) fn deliver(&mut self, target: AsciiTarget, node: NodeId) -> Result<()> {
        self.attach(target, node);
        match target {
            AsciiTarget::Field(holder, entry) | AsciiTarget::Alone(holder, entry) => {
                self.tail(holder, entry)
            }
            AsciiTarget::Source(holder, entry) => self.output(holder, entry, node),
            _ => Ok(()),
        }
    }

    /// Stores a node where it belongs.
    pub(super) fn attach(&mut self, target: AsciiTarget, node: NodeId) {
        match target {
            AsciiTarget::Root => self.roots.push(node),
            AsciiTarget::Child(parent) => self.asm.data(parent).children.push(node),
            AsciiTarget::Field(holder, entry) => {
                self.asm.data(holder).fields[entry].value = Value::Node(Some(node));
            }
            AsciiTarget::Element(holder, entry) | AsciiTarget::Alone(holder, entry) => {
                self.asm.check_child(holder, entry, node);
                if let Value::Nodes(list) = &mut self.asm.data(holder).fields[entry].value {
                    list.push(node);
                }
            }
            AsciiTarget::Source(..) | AsciiTarget::Discarded => {}
            AsciiTarget::Proto(proto) => self.asm.document.protos.list[proto].body.push(node),
        }
    }

    /// Reads the part of the field that may follow a `NULL` or an unknown name.
    pub(super) fn deliver_nothing(&mut self, target: AsciiTarget) -> Result<()> {
        match target {
            AsciiTarget::Field(holder, entry) | AsciiTarget::Alone(holder, entry) => {
                self.tail(holder, entry)
            }
            _ => Ok(()),
        }
    }

    /// Reads `. output` after the node of a connection.
    pub(super) fn output(&mut self, holder: NodeId, entry: usize, from: NodeId) -> Result<()> {
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
        let span = self.span(self.rest, rest);
        self.rest = rest;
        let output: Box<str> = text(name).into();
        self.asm.check_connection(from, &output, span);
        self.asm.data(holder).fields[entry].connection =
            Some(Box::new(Connection { from, output }));
        self.tail(holder, entry)
    }
}

/// Returns whether a word and what follows it declare fields or base classes of a node: a list, or
/// one base class without brackets.
pub(super) fn is_declaration(token: &[u8], after: &[u8]) -> bool {
    matches!(
        (token, after.first()),
        (b"fields" | b"isA", Some(b'[')) | (b"isA", Some(b'"'))
    )
}
