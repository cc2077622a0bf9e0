//! Prepares a program: refuses what cannot be bounded, and lets strings be measured.
//!
//! The engine counts instructions, and one instruction can double a string. So every expression
//! that makes a string from others, `a + b`, `a += b` and a template, is put into a call of the
//! host's function that measures it. The rest of the program stays as it is, with its lines.

use std::ops::{ControlFlow, Range};

use boa_engine::Source;
use boa_engine::ast::Expression;
use boa_engine::ast::expression::literal::LiteralKind;
use boa_engine::ast::expression::operator::assign::AssignOp;
use boa_engine::ast::expression::operator::binary::{ArithmeticOp, BinaryOp};
use boa_engine::ast::expression::operator::unary::UnaryOp;
use boa_engine::ast::scope::Scope;
use boa_engine::ast::visitor::{VisitWith, Visitor};
use boa_engine::interner::Interner;
use boa_engine::parser::Parser;

use super::places::ProgramText;

/// The name of the function that measures a string.
pub(super) const GROW: &str = "$ivcam$grow";

/// The deepest nesting of brackets, and the number of operators and keywords in one statement. The
/// engine handles both by recursion.
const MAX_BRACKETS: usize = 300;
const MAX_OPERATORS: usize = 3_000;

/// The longest regular expression in characters, and the number of steps that one may take.
const MAX_PATTERN: usize = 1_000;
const MAX_STEPS: f64 = 1e8;

/// Returns a program with its strings measured.
///
/// # Errors
/// Returns a message if the program is not valid or contains what cannot be bounded.
pub(super) fn guarded(program: &str) -> Result<String, String> {
    let text = program
        .replace("\r\n", "\n")
        .replace(['\r', '\u{2028}', '\u{2029}'], "\n");
    nesting(&text)?;
    let mut interner = Interner::default();
    let mut parser = Parser::new(Source::from_bytes(text.as_bytes()));
    let parsed = parser.parse_script(&Scope::new_global(), &mut interner);
    let parsed = parsed.map_err(|error| error.to_string())?;
    let mut finder = Finder {
        interner: &interner,
        text: ProgramText::new(&text),
        spans: Vec::new(),
    };
    if let ControlFlow::Break(message) = parsed.visit_with(&mut finder) {
        return Err(message);
    }
    Ok(wrapped(&finder.text, &finder.spans))
}

/// Ends with an error if a program nests too deep. Strings and comments do not count.
fn nesting(text: &str) -> Result<(), String> {
    let too_deep = || Err("it nests too deep".to_owned());
    let (mut depth, mut operators, mut elses) = (0_usize, 0_usize, 0_usize);
    let mut rest = text.char_indices().peekable();
    let mut word = String::new();
    while let Some((at, c)) = rest.next() {
        if c.is_alphanumeric() || c == '_' || c == '$' {
            word.push(c);
            continue;
        }
        match std::mem::take(&mut word).as_str() {
            "else" => elses += 1,
            "if" | "while" | "for" | "do" | "with" | "typeof" | "void" | "delete" | "new"
            | "return" | "function" | "in" | "instanceof" => operators += 1,
            _ => {}
        }
        match c {
            '"' | '\'' | '`' => {
                while let Some((_, inner)) = rest.next() {
                    match inner {
                        '\\' => drop(rest.next()),
                        '\n' if c != '`' => break,
                        _ if inner == c => break,
                        _ => {}
                    }
                }
            }
            '/' if text[at..].starts_with("//") => {
                while rest.next_if(|(_, c)| *c != '\n').is_some() {}
            }
            '/' if text[at..].starts_with("/*") => {
                let end = text[at + 2..].find("*/").map_or(text.len(), |n| at + 2 + n);
                while rest.next_if(|(at, _)| *at < end).is_some() {}
            }
            '(' | '[' | '{' => {
                depth += 1;
                operators += 1;
            }
            ')' | ']' => depth = depth.saturating_sub(1),
            '}' => {
                depth = depth.saturating_sub(1);
                operators = 0;
            }
            ';' | ',' => operators = 0,
            c if "=?:!~+-*/%&|^<>.".contains(c) => operators += 1,
            _ => {}
        }
        if depth > MAX_BRACKETS || operators > MAX_OPERATORS || elses > MAX_OPERATORS {
            return too_deep();
        }
    }
    Ok(())
}

/// Finds the expressions that make strings.
struct Finder<'a> {
    interner: &'a Interner,
    text: ProgramText,
    spans: Vec<Range<usize>>,
}

impl Finder<'_> {
    fn add(&mut self, expression: &Expression) {
        self.spans
            .push(self.text.start(expression)..self.text.end(expression));
    }
}

impl<'ast> Visitor<'ast> for Finder<'_> {
    type BreakTy = String;

    fn visit_expression(&mut self, node: &'ast Expression) -> ControlFlow<String> {
        match node {
            Expression::Binary(binary) => {
                let adds = binary.op() == BinaryOp::Arithmetic(ArithmeticOp::Add);
                if adds && !(is_number(binary.lhs()) && is_number(binary.rhs())) {
                    self.add(node);
                }
            }
            Expression::Assign(assign) if assign.op() == AssignOp::Add => {
                self.add(node);
            }
            Expression::TemplateLiteral(_) => self.add(node),
            Expression::Literal(literal) => {
                if matches!(literal.kind(), LiteralKind::BigInt(_)) {
                    return ControlFlow::Break("integers of any size are not supported".into());
                }
            }
            Expression::RegExpLiteral(literal) => {
                let pattern = self.interner.resolve_expect(literal.pattern()).to_string();
                if let Err(message) = pattern_fits(&pattern, 0) {
                    return ControlFlow::Break(message);
                }
            }
            _ => {}
        }
        node.visit_with(self)
    }
}

/// Returns whether an expression can only be a number, or is refused with its operands' own growth.
fn is_number(node: &Expression) -> bool {
    match node {
        Expression::Literal(literal) => {
            matches!(literal.kind(), LiteralKind::Num(_) | LiteralKind::Int(_))
        }
        Expression::Parenthesized(inner) => is_number(inner.expression()),
        Expression::Binary(binary) => match binary.op() {
            BinaryOp::Arithmetic(ArithmeticOp::Add) => {
                is_number(binary.lhs()) && is_number(binary.rhs())
            }
            BinaryOp::Arithmetic(_) | BinaryOp::Bitwise(_) => true,
            _ => false,
        },
        Expression::Unary(unary) => matches!(unary.op(), UnaryOp::Minus | UnaryOp::Plus),
        Expression::Update(_) => true,
        _ => false,
    }
}

/// Puts each expression into a call.
fn wrapped(text: &ProgramText, spans: &[Range<usize>]) -> String {
    let mut openings: Vec<usize> = spans.iter().map(|s| s.start).collect();
    let mut closings: Vec<usize> = spans.iter().map(|s| s.end).collect();
    openings.sort_unstable();
    closings.sort_unstable();
    let mut openings = openings.into_iter().peekable();
    let mut closings = closings.into_iter().peekable();
    let mut out = String::with_capacity(text.chars.len() + 16 * spans.len());
    for place in 0..=text.chars.len() {
        // Expressions end before others begin at the same place.
        while closings.next_if(|at| *at <= place).is_some() {
            out.push(')');
        }
        while openings.next_if(|at| *at <= place).is_some() {
            out += GROW;
            out.push('(');
        }
        out.extend(text.chars.get(place));
    }
    out
}

/// Returns a message if a regular expression can take too many steps on a text of a length. The
/// engine tries the ways to match one after the other: a repetition inside a repetition has
/// exponentially many, and n repetitions in a row have as many as the length to the power n.
pub(super) fn pattern_fits(pattern: &str, length: usize) -> Result<(), String> {
    let refused = || Err("a regular expression could take too many steps".to_owned());
    if pattern.len() > MAX_PATTERN {
        return refused();
    }
    let mut groups: Vec<bool> = Vec::new();
    let (mut repeats, mut in_class, mut closed) = (0, false, false);
    let mut chars = pattern.chars().peekable();
    while let Some(c) = chars.next() {
        let after_group = std::mem::take(&mut closed);
        match c {
            '\\' => drop(chars.next()),
            '[' => in_class = true,
            ']' => in_class = false,
            _ if in_class => {}
            '(' => {
                groups.push(false);
                // `(?:`, `(?=` and the like are not repetitions.
                chars.next_if_eq(&'?');
            }
            ')' => {
                let repeats_inside = groups.pop().unwrap_or(false);
                if let Some(outer) = groups.last_mut() {
                    *outer |= repeats_inside;
                }
                closed = repeats_inside;
            }
            '*' | '+' | '{' => {
                if after_group {
                    return refused();
                }
                repeats += 1;
                if let Some(group) = groups.last_mut() {
                    *group = true;
                }
            }
            '|' => {
                if let Some(group) = groups.last_mut() {
                    *group = true;
                }
            }
            _ => {}
        }
    }
    if (length as f64).powi(repeats + 1) > MAX_STEPS {
        return refused();
    }
    Ok(())
}
