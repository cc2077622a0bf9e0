//! Finds where an expression begins and ends in the text of a program.
//!
//! The engine's own spans leave parts out: that of a call begins at its arguments, and that of
//! `a[b]` ends before the bracket. So both ends are found from the parts of an expression.

use boa_engine::ast::expression::Expression;
use boa_engine::ast::expression::access::{PropertyAccess, PropertyAccessField};
use boa_engine::ast::expression::operator::assign::AssignTarget;
use boa_engine::ast::expression::operator::update::{UpdateOp, UpdateTarget};
use boa_engine::ast::{Position, Spanned};

/// A program with the places of its lines. Places are indices of characters.
pub(super) struct ProgramText {
    pub chars: Vec<char>,
    /// The place where each line begins.
    lines: Vec<usize>,
}

impl ProgramText {
    pub(super) fn new(text: &str) -> Self {
        let chars: Vec<char> = text.chars().collect();
        let after = chars.iter().enumerate().filter(|(_, c)| **c == '\n');
        let lines = std::iter::once(0)
            .chain(after.map(|(i, _)| i + 1))
            .collect();
        Self { chars, lines }
    }

    /// Returns the place of a position, which counts lines and columns from 1.
    fn place(&self, position: Position) -> usize {
        let line = self.lines.get(position.line_number() as usize - 1);
        let place = line.map_or(self.chars.len(), |l| {
            l + position.column_number() as usize - 1
        });
        place.min(self.chars.len())
    }

    /// Returns where an expression begins.
    pub(super) fn start(&self, expression: &Expression) -> usize {
        let mut inner = expression;
        loop {
            inner = match inner {
                Expression::Call(call) => call.function(),
                Expression::Binary(binary) => binary.lhs(),
                Expression::Conditional(choice) => choice.condition(),
                Expression::TaggedTemplate(template) => template.tag(),
                Expression::Optional(optional) => optional.target(),
                Expression::PropertyAccess(PropertyAccess::Simple(access)) => access.target(),
                Expression::PropertyAccess(PropertyAccess::Private(access)) => access.target(),
                Expression::Assign(assign) => match assign.lhs() {
                    AssignTarget::Access(PropertyAccess::Simple(access)) => access.target(),
                    AssignTarget::Access(PropertyAccess::Private(access)) => access.target(),
                    target => return self.place(target.span().start()),
                },
                Expression::Update(update) => match (update.op(), update.target()) {
                    (
                        UpdateOp::IncrementPost | UpdateOp::DecrementPost,
                        UpdateTarget::PropertyAccess(PropertyAccess::Simple(access)),
                    ) => access.target(),
                    _ => return self.place(inner.span().start()),
                },
                _ => return self.place(inner.span().start()),
            };
        }
    }

    /// Returns where an expression ends.
    pub(super) fn end(&self, expression: &Expression) -> usize {
        let mut inner = expression;
        loop {
            inner = match inner {
                Expression::Binary(binary) => binary.rhs(),
                Expression::Assign(assign) => assign.rhs(),
                Expression::Conditional(choice) => choice.if_false(),
                Expression::Unary(unary) => unary.target(),
                Expression::PropertyAccess(PropertyAccess::Simple(access)) => {
                    match access.field() {
                        PropertyAccessField::Const(name) => return self.place(name.span().end()),
                        PropertyAccessField::Expr(field) => return self.bracket(self.end(field)),
                    }
                }
                Expression::Update(update) => match (update.op(), update.target()) {
                    (
                        UpdateOp::IncrementPre | UpdateOp::DecrementPre,
                        UpdateTarget::PropertyAccess(PropertyAccess::Simple(access)),
                    ) => match access.field() {
                        PropertyAccessField::Const(name) => return self.place(name.span().end()),
                        PropertyAccessField::Expr(field) => return self.bracket(self.end(field)),
                    },
                    _ => return self.place(inner.span().end()),
                },
                // Without arguments a `new` ends with its class.
                Expression::New(new) if !self.closes(inner) => new.constructor(),
                _ => return self.place(inner.span().end()),
            };
        }
    }

    /// Returns the place after the next `]`. Only spaces and comments are before it.
    fn bracket(&self, from: usize) -> usize {
        let mut at = from;
        while let Some(c) = self.chars.get(at) {
            at += 1;
            match (c, self.chars.get(at)) {
                (']', _) => break,
                ('/', Some('/')) => {
                    while self.chars.get(at).is_some_and(|c| *c != '\n') {
                        at += 1;
                    }
                }
                ('/', Some('*')) => {
                    at += 1;
                    while at < self.chars.len() && self.chars[at..].get(..2) != Some(&['*', '/']) {
                        at += 1;
                    }
                    at += 2;
                }
                _ => {}
            }
        }
        at.min(self.chars.len())
    }

    /// Returns whether an expression's span ends with a closing parenthesis.
    fn closes(&self, expression: &Expression) -> bool {
        let end = self.place(expression.span().end());
        end > 0 && self.chars.get(end - 1) == Some(&')')
    }
}
