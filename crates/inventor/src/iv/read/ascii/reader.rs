//! The main loop of the ASCII reader, and its stack of open nodes.

use std::collections::HashMap;

use ivcam_base::diag::{Diagnostic, Result, Span, excerpt};

use crate::grammar::value::NodeId;
use crate::iv::declarations::Route;
use crate::iv::read::assemble::Assembler;
use crate::iv::read::tokens::{skip, word};

/// Where a node belongs. A field is given by its index among the stated fields of its node.
#[derive(Clone, Copy, Debug)]
pub(super) enum AsciiTarget {
    /// A top-level node.
    Root,
    /// A child of a node.
    Child(NodeId),
    /// The value of an `SFNode`.
    Field(NodeId, usize),
    /// One of the nodes of an `MFNode` in brackets.
    Element(NodeId, usize),
    /// The only node of an `MFNode` without brackets.
    Alone(NodeId, usize),
    /// The node that a field is connected to.
    Source(NodeId, usize),
    /// A node of a proto's body.
    Proto(usize),
    /// The value of an unknown field, which is not stored.
    Discarded,
}

/// An open part of the file.
pub(super) enum AsciiLevel {
    /// The body of a node, in braces. `start` is the offset of the node.
    Body {
        node: NodeId,
        target: AsciiTarget,
        start: usize,
    },
    /// The nodes of an `MFNode` field, in brackets.
    List { node: NodeId, entry: usize },
    /// The interface of a proto, in brackets.
    Interface { proto: usize, scope: Scope },
    /// The body of a proto, in braces.
    Proto { proto: usize, scope: Scope },
}

/// The state that is saved while a proto is read.
pub(super) struct Scope {
    /// The nodes by name of the scope around the proto.
    pub(super) names: HashMap<Box<[u8]>, NodeId>,
    /// The length of `Assembler::shadowed` before the proto.
    pub(super) shadowed: usize,
    /// The routes of the scope around the proto.
    pub(super) routes: Vec<Route>,
    /// The name of the proto.
    pub(super) name: Box<str>,
    /// The number of nodes in the arena before the proto.
    pub(super) first: u32,
}

/// The state of the reader.
pub(super) struct AsciiReader<'r, 'd, 's> {
    pub(super) asm: &'r mut Assembler<'d>,
    /// The whole file.
    pub(super) text: &'s [u8],
    /// The suffix of `text` that is still to be read.
    pub(super) rest: &'s [u8],
    /// The open parts of the file. The innermost is last.
    pub(super) stack: Vec<AsciiLevel>,
    pub(super) roots: Vec<NodeId>,
    /// Whether a warning has reported that the file ends too early.
    pub(super) truncated: bool,
}

/// Reads the nodes of a file and returns the top-level ones.
///
/// # Errors
/// Returns an error if a limit is exceeded.
pub(crate) fn read(asm: &mut Assembler<'_>, text: &[u8]) -> Result<Vec<NodeId>> {
    let rest = &text[asm.header.length.min(text.len())..];
    let mut reader = AsciiReader {
        asm,
        text,
        rest,
        stack: Vec::new(),
        roots: Vec::new(),
        truncated: false,
    };
    loop {
        let before = reader.rest.len();
        if !reader.step()? {
            return Ok(reader.roots);
        }
        let at = reader.offset(reader.rest);
        reader.asm.spend_read(before - reader.rest.len(), at)?;
    }
}

impl<'s> AsciiReader<'_, '_, 's> {
    /// Returns the offset of a suffix of the file.
    pub(super) fn offset(&self, rest: &[u8]) -> usize {
        self.text.len() - rest.len()
    }

    /// Returns the range between two suffixes of the file.
    pub(super) fn span(&self, from: &[u8], to: &[u8]) -> Span {
        Span::new(self.offset(from), self.offset(to))
    }

    /// Returns the range of the next token.
    pub(super) fn here(&self) -> Span {
        let end = word(self.rest).map_or(&self.rest[self.rest.len().min(1)..], |(rest, _)| rest);
        self.span(self.rest, end)
    }

    /// Adds a warning.
    pub(super) fn warn(&mut self, span: Span, message: impl Into<String>) -> &mut Diagnostic {
        self.asm.document.sink.warn(span, message)
    }

    /// Adds a warning that the file is damaged at a range.
    pub(super) fn damage(&mut self, span: Span, message: impl Into<String>) -> &mut Diagnostic {
        self.asm.document.sink.damage(span, message)
    }

    /// Skips blanks, then consumes a byte if it comes next. Returns whether it did.
    pub(super) fn take(&mut self, byte: u8) -> bool {
        self.rest = skip(self.rest);
        let next = self.rest.first() == Some(&byte);
        self.rest = &self.rest[usize::from(next)..];
        next
    }

    /// Skips blanks and returns the next byte.
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
            (None, Some(_)) => self.statement(AsciiTarget::Root).map(|()| true),
            (
                Some(&AsciiLevel::Body {
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
            (Some(&AsciiLevel::Body { node, .. }), Some(_)) => self.item(node).map(|()| true),
            (Some(&AsciiLevel::List { node, entry }), Some(b']')) => {
                self.rest = &self.rest[1..];
                self.stack.pop();
                self.tail(node, entry)?;
                Ok(true)
            }
            (Some(&AsciiLevel::List { .. }), Some(b'}')) => {
                let span = self.here();
                self.damage(span, "this list of nodes has no closing `]`");
                self.stack.pop();
                Ok(true)
            }
            (Some(&AsciiLevel::List { node, entry }), Some(_)) => self
                .statement(AsciiTarget::Element(node, entry))
                .map(|()| true),
            (Some(AsciiLevel::Interface { .. }), Some(b']')) => {
                self.rest = &self.rest[1..];
                self.interface_done().map(|()| true)
            }
            (Some(&AsciiLevel::Interface { proto, .. }), Some(_)) => {
                self.interface(proto).map(|()| true)
            }
            (Some(AsciiLevel::Proto { .. }), Some(b'}')) => {
                self.rest = &self.rest[1..];
                self.proto_done();
                Ok(true)
            }
            (Some(&AsciiLevel::Proto { proto, .. }), Some(_)) => {
                self.statement(AsciiTarget::Proto(proto)).map(|()| true)
            }
        }
    }

    /// Closes the innermost open part at the end of the file. The first call warns about it.
    pub(super) fn end_early(&mut self) {
        if !self.truncated {
            self.truncated = true;
            let open = self.stack.iter().rev().find_map(|level| match level {
                AsciiLevel::Body { node, start, .. } => Some((*node, *start)),
                _ => None,
            });
            let class = open.map_or("a node", |(node, _)| {
                self.asm.document.node(node).class_name()
            });
            let class = excerpt(class).into_owned();
            let line = open.map_or(1, |(_, start)| self.line_of(start));
            let span = Span::at(self.text.len());
            self.damage(
                span,
                format!("the file ends inside the `{class}` that begins on line {line}"),
            )
            .help("a `}` is missing, or the file was cut off; what was read is kept");
        }
        match self.stack.pop() {
            Some(AsciiLevel::Body {
                node,
                target,
                start,
            }) => {
                self.finish(node, start);
                self.attach(target, node);
            }
            Some(level @ (AsciiLevel::Interface { .. } | AsciiLevel::Proto { .. })) => {
                self.stack.push(level);
                self.proto_done();
            }
            Some(AsciiLevel::List { .. }) | None => {}
        }
    }

    /// Returns the line of an offset.
    pub(super) fn line_of(&self, offset: usize) -> u32 {
        let source = self.asm.document.sources.get(usize::from(self.asm.source));
        source.map_or(1, |s| s.line_column(offset as u32).0)
    }

    /// Sets the range of a node that has been read completely.
    pub(super) fn finish(&mut self, node: NodeId, start: usize) {
        self.asm.complete(node);
        let end = self.offset(self.rest);
        let data = self.asm.data(node);
        data.span = Span::new(start, end);
        data.fields.shrink_to_fit();
        data.children.shrink_to_fit();
    }
}
