//! Parses statements by recursive descent, to a bounded depth and length.

use ivcam_base::diag::excerpt;

use super::functions::{FUNCTIONS, RANDOM, constant};
use super::program::{Expr, Op, OperandKind, Statement, Variable};

/// The largest number of operations in one statement. Evaluation recurses, so the number bounds the
/// use of the stack. No search is recorded: statements that people write are far shorter.
const MAX_NODES: usize = 1000;

/// The binary operators by precedence, lowest first.
const LEVELS: [&[(&str, Op)]; 6] = [
    &[("||", Op::Or)],
    &[("&&", Op::And)],
    &[("==", Op::Equal), ("!=", Op::Unequal)],
    &[
        ("<=", Op::AtMost),
        (">=", Op::AtLeast),
        ("<", Op::Less),
        (">", Op::More),
    ],
    &[("+", Op::Add), ("-", Op::Subtract)],
    &[("*", Op::Multiply), ("/", Op::Divide), ("%", Op::Remainder)],
];

/// Parses the statements of an expression.
///
/// # Errors
/// Returns a message if the text has a mistake or exceeds a limit.
pub(super) fn parse(text: &str) -> Result<Vec<Statement>, String> {
    let mut parser = Parser {
        rest: text,
        size: 0,
        depth: 0,
    };
    let mut program = Vec::new();
    loop {
        while parser.take(";") {}
        if parser.rest.is_empty() {
            return Ok(program);
        }
        program.push(parser.statement()?);
        if !parser.rest.is_empty() && !parser.take(";") {
            return Err(parser.odd());
        }
    }
}

struct Parser<'a> {
    rest: &'a str,
    size: usize,
    depth: usize,
}

impl<'a> Parser<'a> {
    fn take(&mut self, token: &str) -> bool {
        self.rest = self.rest.trim_start();
        match self.rest.strip_prefix(token) {
            Some(rest) => {
                self.rest = rest.trim_start();
                true
            }
            None => false,
        }
    }

    fn expect(&mut self, token: &str) -> Result<(), String> {
        if self.take(token) {
            Ok(())
        } else {
            Err(format!(
                "`{token}` is missing before `{}`",
                excerpt(self.rest)
            ))
        }
    }

    fn odd(&self) -> String {
        if self.rest.is_empty() {
            "something is missing at the end".to_owned()
        } else {
            format!("`{}` is not understood", excerpt(self.rest))
        }
    }

    fn word(&mut self) -> Option<&'a str> {
        self.rest = self.rest.trim_start();
        let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let end = self.rest.find(|c| !is_part(c)).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        if word.is_empty() || word.starts_with(|c: char| c.is_ascii_digit()) {
            return None;
        }
        self.rest = rest.trim_start();
        Some(word)
    }

    fn statement(&mut self) -> Result<Statement, String> {
        self.size = 0;
        let name = self.word().ok_or_else(|| self.odd())?;
        let target = Variable::named(name)
            .filter(|v| v.kind != OperandKind::Input)
            .ok_or_else(|| format!("`{name}` cannot be assigned to; `ta` or `oa` can"))?;
        let component = if self.take("[") {
            let at = self.expression()?;
            self.expect("]")?;
            Some(at)
        } else {
            None
        };
        self.expect("=")?;
        let value = self.expression()?;
        Ok(Statement {
            target,
            component,
            value,
            size: self.size + 1,
        })
    }

    /// Counts an operation, so that recursion over a statement is bounded.
    fn count(&mut self) -> Result<(), String> {
        self.size += 1;
        if self.size > MAX_NODES {
            return Err(format!("a statement has more than {MAX_NODES} operations"));
        }
        Ok(())
    }

    fn expression(&mut self) -> Result<Expr, String> {
        self.depth += 1;
        if self.depth > 60 {
            return Err("brackets are nested more than 60 deep".to_owned());
        }
        let test = self.level(0)?;
        let made = if self.take("?") {
            self.count()?;
            let yes = self.expression()?;
            self.expect(":")?;
            let no = self.expression()?;
            Expr::Choice(Box::new(test), Box::new(yes), Box::new(no))
        } else {
            test
        };
        self.depth -= 1;
        Ok(made)
    }

    fn level(&mut self, level: usize) -> Result<Expr, String> {
        if level == LEVELS.len() {
            return self.unary();
        }
        let mut left = self.level(level + 1)?;
        while let Some(&(_, op)) = LEVELS[level].iter().find(|(token, _)| self.take(token)) {
            self.count()?;
            let right = self.level(level + 1)?;
            left = Expr::Binary(op, Box::new(left), Box::new(right));
        }
        Ok(left)
    }

    /// Parses signs before a value and components after it.
    fn unary(&mut self) -> Result<Expr, String> {
        let mut signs = Vec::new();
        loop {
            if self.take("-") {
                signs.push('-');
            } else if self.rest.starts_with('!') && !self.rest.starts_with("!=") {
                self.take("!");
                signs.push('!');
            } else if !self.take("+") {
                break;
            }
            self.count()?;
        }
        let mut value = self.primary()?;
        while self.take("[") {
            self.count()?;
            let at = self.expression()?;
            self.expect("]")?;
            value = Expr::Component(Box::new(value), Box::new(at));
        }
        for sign in signs.into_iter().rev() {
            value = match sign {
                '-' => Expr::Negative(Box::new(value)),
                _ => Expr::Not(Box::new(value)),
            };
        }
        Ok(value)
    }

    fn primary(&mut self) -> Result<Expr, String> {
        self.count()?;
        if self.take("(") {
            let inside = self.expression()?;
            self.expect(")")?;
            return Ok(inside);
        }
        if self
            .rest
            .starts_with(|c: char| c.is_ascii_digit() || c == '.')
        {
            return self.number();
        }
        let name = self.word().ok_or_else(|| self.odd())?;
        if self.take("(") {
            return self.call(name);
        }
        if let Some(value) = constant(name) {
            return Ok(Expr::Number(value));
        }
        let variable = Variable::named(name);
        variable
            .map(Expr::Variable)
            .ok_or_else(|| format!("there is no variable `{}`", excerpt(name)))
    }

    fn number(&mut self) -> Result<Expr, String> {
        let bytes = self.rest.as_bytes();
        let mut end = 0;
        while end < bytes.len() {
            let signed = matches!(bytes[end], b'+' | b'-')
                && end > 0
                && matches!(bytes[end - 1], b'e' | b'E');
            let part = bytes[end].is_ascii_digit() || matches!(bytes[end], b'.' | b'e' | b'E');
            if !(part || signed) {
                break;
            }
            end += 1;
        }
        let value = self.rest[..end].parse().map_err(|_| self.odd())?;
        self.rest = self.rest[end..].trim_start_matches(['f', 'F']).trim_start();
        Ok(Expr::Number(value))
    }

    fn call(&mut self, name: &str) -> Result<Expr, String> {
        let function = std::iter::once(&RANDOM)
            .chain(FUNCTIONS)
            .find(|f| f.name == name)
            .ok_or_else(|| format!("there is no function `{}`", excerpt(name)))?;
        let mut arguments = vec![self.expression()?];
        while self.take(",") {
            arguments.push(self.expression()?);
        }
        self.expect(")")?;
        if arguments.len() != function.arguments {
            let (given, wanted) = (arguments.len(), function.arguments);
            return Err(format!("`{name}` takes {wanted} values, not {given}"));
        }
        Ok(Expr::Call(function, arguments))
    }
}
