//! The syntax tree of a program, and its evaluation.

use glam::DVec3;

/// The values of all variables. The first index is the [`OperandKind`], the second the letter.
#[derive(Clone, Copy, Default)]
pub(super) struct Bank {
    pub scalars: [[f64; 8]; 3],
    pub vectors: [[DVec3; 8]; 3],
    /// The number of random numbers that have been drawn.
    pub draws: u32,
}

/// The kind of a variable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum OperandKind {
    Input = 0,
    Temporary = 1,
    Output = 2,
}

/// A variable, such as `ta`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Variable {
    pub kind: OperandKind,
    pub vector: bool,
    pub index: usize,
}

impl Variable {
    pub(super) fn named(name: &str) -> Option<Self> {
        let (kind, letter) = match name.as_bytes() {
            [letter] => (OperandKind::Input, *letter),
            [b't', letter] => (OperandKind::Temporary, *letter),
            [b'o', letter] => (OperandKind::Output, *letter),
            _ => return None,
        };
        let last = if kind == OperandKind::Output { 4 } else { 8 };
        let index = usize::from(letter.to_ascii_lowercase().checked_sub(b'a')?);
        (index < last && letter.is_ascii_alphabetic()).then_some(Self {
            kind,
            vector: letter.is_ascii_uppercase(),
            index,
        })
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Val {
    Number(f64),
    Vector(DVec3),
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Op {
    Or,
    And,
    Equal,
    Unequal,
    Less,
    More,
    AtMost,
    AtLeast,
    Add,
    Subtract,
    Multiply,
    Divide,
    Remainder,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Expr {
    Number(f64),
    Variable(Variable),
    Component(Box<Expr>, Box<Expr>),
    Negative(Box<Expr>),
    Not(Box<Expr>),
    Binary(Op, Box<Expr>, Box<Expr>),
    Choice(Box<Expr>, Box<Expr>, Box<Expr>),
    Call(&'static Function, Vec<Expr>),
}

#[derive(Debug)]
pub(super) struct Function {
    pub name: &'static str,
    pub arguments: usize,
    pub apply: fn(&[Val], &mut u32) -> Option<Val>,
}

impl PartialEq for Function {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Statement {
    pub target: Variable,
    pub component: Option<Expr>,
    pub value: Expr,
    pub size: usize,
}

impl Statement {
    pub(super) fn run(&self, bank: &mut Bank) -> Result<(), String> {
        let value = eval(&self.value, bank)?;
        let (kind, index) = (self.target.kind as usize, self.target.index);
        if !self.target.vector {
            bank.scalars[kind][index] = number(value)?;
            return Ok(());
        }
        match &self.component {
            None => bank.vectors[kind][index] = vector(value)?,
            Some(at) => {
                let at = component(number(eval(at, bank)?)?)?;
                bank.vectors[kind][index][at] = number(value)?;
            }
        }
        Ok(())
    }
}

fn component(index: f64) -> Result<usize, String> {
    if (0.0..3.0).contains(&index) {
        Ok(index as usize)
    } else {
        Err(format!("a vector has components 0 to 2, not {index}"))
    }
}

fn number(value: Val) -> Result<f64, String> {
    match value {
        Val::Number(n) => Ok(n),
        Val::Vector(_) => Err("expected a number, not a vector".to_owned()),
    }
}

fn vector(value: Val) -> Result<DVec3, String> {
    match value {
        Val::Vector(v) => Ok(v),
        Val::Number(_) => Err("expected a vector, not a number".to_owned()),
    }
}

fn eval(expr: &Expr, bank: &mut Bank) -> Result<Val, String> {
    Ok(match expr {
        Expr::Number(n) => Val::Number(*n),
        Expr::Variable(v) if v.vector => Val::Vector(bank.vectors[v.kind as usize][v.index]),
        Expr::Variable(v) => Val::Number(bank.scalars[v.kind as usize][v.index]),
        Expr::Component(of, at) => {
            let at = component(number(eval(at, bank)?)?)?;
            Val::Number(vector(eval(of, bank)?)?[at])
        }
        Expr::Negative(of) => match eval(of, bank)? {
            Val::Number(n) => Val::Number(-n),
            Val::Vector(v) => Val::Vector(-v),
        },
        Expr::Not(of) => truth(number(eval(of, bank)?)? == 0.0),
        Expr::Choice(test, yes, no) => {
            let branch = if number(eval(test, bank)?)? != 0.0 {
                yes
            } else {
                no
            };
            eval(branch, bank)?
        }
        Expr::Binary(Op::And, a, b) => {
            truth(number(eval(a, bank)?)? != 0.0 && number(eval(b, bank)?)? != 0.0)
        }
        Expr::Binary(Op::Or, a, b) => {
            truth(number(eval(a, bank)?)? != 0.0 || number(eval(b, bank)?)? != 0.0)
        }
        Expr::Binary(op, a, b) => binary(*op, eval(a, bank)?, eval(b, bank)?)?,
        Expr::Call(function, arguments) => {
            let values: Result<Vec<Val>, String> =
                arguments.iter().map(|a| eval(a, bank)).collect();
            (function.apply)(&values?, &mut bank.draws)
                .ok_or_else(|| format!("`{}` has an argument of the wrong kind", function.name))?
        }
    })
}

fn truth(is: bool) -> Val {
    Val::Number(f64::from(u8::from(is)))
}

fn binary(op: Op, a: Val, b: Val) -> Result<Val, String> {
    use Val::{Number, Vector};
    Ok(match (op, a, b) {
        (Op::Add, Number(a), Number(b)) => Number(a + b),
        (Op::Subtract, Number(a), Number(b)) => Number(a - b),
        (Op::Multiply, Number(a), Number(b)) => Number(a * b),
        (Op::Divide, Number(a), Number(b)) => Number(a / b),
        (Op::Remainder, Number(a), Number(b)) => Number(libm::fmod(a, b)),
        (Op::Less, Number(a), Number(b)) => truth(a < b),
        (Op::More, Number(a), Number(b)) => truth(a > b),
        (Op::AtMost, Number(a), Number(b)) => truth(a <= b),
        (Op::AtLeast, Number(a), Number(b)) => truth(a >= b),
        (Op::Equal, a, b) => truth(a == b),
        (Op::Unequal, a, b) => truth(a != b),
        (Op::Add, Vector(a), Vector(b)) => Vector(a + b),
        (Op::Subtract, Vector(a), Vector(b)) => Vector(a - b),
        (Op::Multiply, Vector(a), Number(b)) | (Op::Multiply, Number(b), Vector(a)) => {
            Vector(a * b)
        }
        (Op::Divide, Vector(a), Number(b)) => Vector(a / b),
        _ => return Err("an operator has an operand of the wrong kind".to_owned()),
    })
}
