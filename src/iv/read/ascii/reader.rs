//! The reader of an ASCII file: the stack of open nodes, and the step from one item to the next.

use std::collections::HashMap;

use crate::diag::{Diagnostic, Result, Span};
use crate::grammar::value::NodeId;
use crate::iv::declarations::Route;
use crate::iv::read::assemble::Assembler;
use crate::iv::read::tokens::{skip, word};

/// Where a node goes once it is read.
#[derive(Clone, Copy, Debug)]
pub(super) enum Target {
    Root,
    Child(NodeId),
    /// The value of an `SFNode`, by the field's place among the stated fields of the node.
    Field(NodeId, usize),
    /// One of the nodes of an `MFNode` in brackets.
    Element(NodeId, usize),
    /// The only node of an `MFNode` without brackets.
    Alone(NodeId, usize),
    /// The node to which a field is connected.
    Source(NodeId, usize),
    /// A node of a proto's body.
    Proto(usize),
    /// The value of a field that the class does not have.
    Nowhere,
}

/// What is open. The innermost is last on the stack.
pub(super) enum Level {
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

/// What is put aside while a proto is read.
pub(super) struct Scope {
    pub(super) names: HashMap<Box<[u8]>, NodeId>,
    /// The number of declarations before it, as `Assembler::shadowed` counts them.
    pub(super) shadowed: usize,
    pub(super) routes: Vec<Route>,
    pub(super) name: Box<str>,
    /// The number of nodes before it.
    pub(super) first: u32,
}

pub(super) struct Reader<'r, 'd, 's> {
    pub(super) asm: &'r mut Assembler<'d>,
    pub(super) text: &'s [u8],
    pub(super) rest: &'s [u8],
    pub(super) stack: Vec<Level>,
    pub(super) roots: Vec<NodeId>,
    /// Whether it has been reported that the file ends too soon.
    pub(super) truncated: bool,
}

/// Reads the nodes of a file.
///
/// # Errors
/// A limit is passed.
pub(crate) fn read(asm: &mut Assembler<'_>, text: &[u8]) -> Result<Vec<NodeId>> {
    let rest = &text[asm.header.length.min(text.len())..];
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
    pub(super) fn offset(&self, rest: &[u8]) -> usize {
        self.text.len() - rest.len()
    }

    pub(super) fn span(&self, from: &[u8], to: &[u8]) -> Span {
        Span::new(self.offset(from), self.offset(to))
    }

    pub(super) fn here(&self) -> Span {
        let end = word(self.rest).map_or(&self.rest[self.rest.len().min(1)..], |(rest, _)| rest);
        self.span(self.rest, end)
    }

    pub(super) fn warn(&mut self, span: Span, message: impl Into<String>) -> &mut Diagnostic {
        self.asm.document.sink.warn(span, message)
    }

    /// Adds a warning that the file is damaged at a range.
    pub(super) fn damage(&mut self, span: Span, message: impl Into<String>) -> &mut Diagnostic {
        self.asm.document.sink.damage(span, message)
    }

    /// Skips blanks, then takes a byte if it is the next one.
    pub(super) fn take(&mut self, byte: u8) -> bool {
        self.rest = skip(self.rest);
        let next = self.rest.first() == Some(&byte);
        self.rest = &self.rest[usize::from(next)..];
        next
    }

    pub(super) fn peek(&mut self) -> Option<u8> {
        self.rest = skip(self.rest);
        self.rest.first().copied()
    }

    /// Reads one item. Returns `false` at the end of the file.
    pub(super) fn step(&mut self) -> Result<bool> {
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
                self.damage(span, "this list of nodes has no closing `]`");
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

    /// Closes a node or list inside of which the file ends, and reports that once.
    pub(super) fn end_early(&mut self) {
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
            self.damage(
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

    pub(super) fn line_of(&self, offset: usize) -> u32 {
        let source = self.asm.document.sources.get(usize::from(self.asm.source));
        source.map_or(1, |s| s.line_column(offset as u32).0)
    }

    pub(super) fn finish(&mut self, node: NodeId, start: usize) {
        let end = self.offset(self.rest);
        let data = self.asm.data(node);
        data.span = Span::new(start, end);
        data.fields.shrink_to_fit();
        data.children.shrink_to_fit();
    }
}
