//! The `Calculator` engine and its expression language.
//!
//! `oA = vec3f(cos(a), ta, 0); tb = A[1] > 0 ? a : -a`: statements that assign to outputs (`oa` to
//! `od`, `oA` to `oD`) and temporaries (`ta` to `th`, `tA` to `tH`) from inputs (`a` to `h`, `A` to
//! `H`). Lower case is a number, upper case a vector; `[0]` to `[2]` is a vector's component.

use glam::DVec3;

use super::lists::MAX_VALUES;
use super::outputs::Outputs;
use crate::grammar::calculator;
use crate::grammar::value::Value;
use crate::iv::NodeRef;

/// Operations of one statement, and operations over all values.
const MAX_NODES: usize = 1000;
const MAX_WORK: usize = 100_000_000;

pub fn outputs(node: NodeRef<'_>) -> Result<Outputs, String> {
    use calculator as c;
    let scalars = [c::A, c::B, c::C, c::D, c::E, c::F, c::G, c::H].map(|f| node.get(f));
    let points = [
        c::CAPITAL_A,
        c::CAPITAL_B,
        c::CAPITAL_C,
        c::CAPITAL_D,
        c::CAPITAL_E,
        c::CAPITAL_F,
        c::CAPITAL_G,
        c::CAPITAL_H,
    ];
    let points = points.map(|f| node.get(f));
    let mut program = Vec::new();
    for line in node.get(c::EXPRESSION) {
        program.extend(parse(line).map_err(|e| format!("expression `{}`: {e}", short(line)))?);
    }
    let lengths = scalars
        .iter()
        .map(|s| s.len())
        .chain(points.iter().map(|p| p.len()));
    let count = lengths.max().unwrap_or(1).clamp(1, MAX_VALUES);
    let size: usize = program.iter().map(|s| s.size).sum();
    if size.saturating_mul(count) > MAX_WORK {
        return Err(format!(
            "{count} values through {size} operations are too much work"
        ));
    }
    let mut bank = Bank::default();
    let mut results: Vec<Bank> = Vec::with_capacity(count);
    for i in 0..count {
        let value = |v: &[f32]| v.get(i).or(v.last()).map_or(0.0, |&x| f64::from(x));
        let point = |v: &[glam::Vec3]| v.get(i).or(v.last()).map_or(DVec3::ZERO, |p| p.as_dvec3());
        bank.scalars[0] = std::array::from_fn(|k| value(scalars[k]));
        bank.vectors[0] = std::array::from_fn(|k| point(points[k]));
        for statement in &program {
            statement.run(&mut bank)?;
        }
        results.push(bank);
    }
    Ok(collect(&results))
}

fn short(line: &str) -> String {
    line.chars().take(60).collect()
}

fn collect(results: &[Bank]) -> Outputs {
    let scalar = |k: usize| {
        let each = results
            .iter()
            .map(|b| b.scalars[Kind::Output as usize][k] as f32);
        Value::Floats(each.collect())
    };
    let vector = |k: usize| {
        let each = results
            .iter()
            .map(|b| b.vectors[Kind::Output as usize][k].as_vec3());
        Value::Vec3s(each.collect())
    };
    vec![
        ("oa", scalar(0)),
        ("ob", scalar(1)),
        ("oc", scalar(2)),
        ("od", scalar(3)),
        ("oA", vector(0)),
        ("oB", vector(1)),
        ("oC", vector(2)),
        ("oD", vector(3)),
    ]
}

/// All variables: inputs, temporaries, outputs.
#[derive(Clone, Copy, Default)]
struct Bank {
    scalars: [[f64; 8]; 3],
    vectors: [[DVec3; 8]; 3],
    draws: u32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Input = 0,
    Temporary = 1,
    Output = 2,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Variable {
    kind: Kind,
    vector: bool,
    index: usize,
}

impl Variable {
    fn named(name: &str) -> Option<Self> {
        let (kind, letter) = match name.as_bytes() {
            [letter] => (Kind::Input, *letter),
            [b't', letter] => (Kind::Temporary, *letter),
            [b'o', letter] => (Kind::Output, *letter),
            _ => return None,
        };
        let last = if kind == Kind::Output { 4 } else { 8 };
        let index = usize::from(letter.to_ascii_lowercase().checked_sub(b'a')?);
        (index < last && letter.is_ascii_alphabetic()).then_some(Self {
            kind,
            vector: letter.is_ascii_uppercase(),
            index,
        })
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Val {
    Number(f64),
    Vector(DVec3),
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Op {
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

/// Binary operators from the loosest to the tightest.
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

#[derive(Clone, Debug, PartialEq)]
enum Expr {
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
struct Function {
    name: &'static str,
    arguments: usize,
    apply: fn(&[Val], &mut u32) -> Option<Val>,
}

impl PartialEq for Function {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

#[derive(Clone, Debug, PartialEq)]
struct Statement {
    target: Variable,
    component: Option<Expr>,
    value: Expr,
    size: usize,
}

impl Statement {
    fn run(&self, bank: &mut Bank) -> Result<(), String> {
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
        Val::Vector(_) => Err("a vector stands where a number should".to_owned()),
    }
}

fn vector(value: Val) -> Result<DVec3, String> {
    match value {
        Val::Vector(v) => Ok(v),
        Val::Number(_) => Err("a number stands where a vector should".to_owned()),
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
                .ok_or_else(|| format!("`{}` is given the wrong kind of value", function.name))?
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
        _ => return Err("an operator is given the wrong kind of value".to_owned()),
    })
}

macro_rules! functions {
    ($($name:literal $count:literal ($($arg:ident: $kind:ident),*) => $out:ident $body:expr;)*) => {
        static FUNCTIONS: &[Function] = &[$(Function {
            name: $name,
            arguments: $count,
            apply: |values, _| match values {
                [$(Val::$kind($arg)),*] => {
                    $(let $arg = *$arg;)*
                    Some(Val::$out($body))
                }
                _ => None,
            },
        }),*];
    };
}

functions! {
    "cos" 1 (x: Number) => Number libm::cos(x);
    "sin" 1 (x: Number) => Number libm::sin(x);
    "tan" 1 (x: Number) => Number libm::tan(x);
    "acos" 1 (x: Number) => Number libm::acos(x);
    "asin" 1 (x: Number) => Number libm::asin(x);
    "atan" 1 (x: Number) => Number libm::atan(x);
    "atan2" 2 (y: Number, x: Number) => Number libm::atan2(y, x);
    "cosh" 1 (x: Number) => Number libm::cosh(x);
    "sinh" 1 (x: Number) => Number libm::sinh(x);
    "tanh" 1 (x: Number) => Number libm::tanh(x);
    "sqrt" 1 (x: Number) => Number x.sqrt();
    "pow" 2 (x: Number, y: Number) => Number libm::pow(x, y);
    "exp" 1 (x: Number) => Number libm::exp(x);
    "log" 1 (x: Number) => Number libm::log(x);
    "log10" 1 (x: Number) => Number libm::log10(x);
    "ceil" 1 (x: Number) => Number x.ceil();
    "floor" 1 (x: Number) => Number x.floor();
    "fabs" 1 (x: Number) => Number x.abs();
    "abs" 1 (x: Number) => Number x.abs();
    "fmod" 2 (x: Number, y: Number) => Number libm::fmod(x, y);
    "cross" 2 (a: Vector, b: Vector) => Vector a.cross(b);
    "dot" 2 (a: Vector, b: Vector) => Number a.dot(b);
    "length" 1 (v: Vector) => Number v.length();
    "normalize" 1 (v: Vector) => Vector v.normalize_or_zero();
    "vec3f" 3 (x: Number, y: Number, z: Number) => Vector DVec3::new(x, y, z);
}

/// A number from 0 to its argument. The same file gives the same numbers every time.
static RANDOM: Function = Function {
    name: "rand",
    arguments: 1,
    apply: |values, draws| match values {
        [Val::Number(most)] => {
            *draws = draws.wrapping_add(1);
            let mut bits = draws.wrapping_mul(0x9e37_79b9);
            bits = (bits ^ (bits >> 16)).wrapping_mul(0x85eb_ca6b);
            bits = (bits ^ (bits >> 13)).wrapping_mul(0xc2b2_ae35);
            bits ^= bits >> 16;
            Some(Val::Number(most * f64::from(bits) / 4_294_967_296.0))
        }
        _ => None,
    },
};

fn constant(name: &str) -> Option<f64> {
    use std::f64::consts as c;
    Some(match name {
        "MAXFLOAT" => f64::from(f32::MAX),
        "MINFLOAT" => f64::from(f32::MIN_POSITIVE),
        "M_E" => c::E,
        "M_LOG2E" => c::LOG2_E,
        "M_LOG10E" => c::LOG10_E,
        "M_LN2" => c::LN_2,
        "M_LN10" => c::LN_10,
        "M_PI" => c::PI,
        "M_TWOPI" => c::TAU,
        "M_PI_2" => c::FRAC_PI_2,
        "M_PI_4" => c::FRAC_PI_4,
        "M_1_PI" => c::FRAC_1_PI,
        "M_2_PI" => c::FRAC_2_PI,
        "M_2_SQRTPI" => c::FRAC_2_SQRT_PI,
        "M_SQRT2" => c::SQRT_2,
        "M_SQRT1_2" => c::FRAC_1_SQRT_2,
        "M_RAD" => c::PI / 180.0,
        "M_DEG" => 180.0 / c::PI,
        _ => return None,
    })
}

fn parse(text: &str) -> Result<Vec<Statement>, String> {
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
                short(self.rest)
            ))
        }
    }

    fn odd(&self) -> String {
        if self.rest.is_empty() {
            "something is missing at the end".to_owned()
        } else {
            format!("`{}` is not understood", short(self.rest))
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
            .filter(|v| v.kind != Kind::Input)
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

    /// Counts an operation, so that no statement is too long to be walked by recursion.
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

    /// Signs before a value, then its components.
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
            .ok_or_else(|| format!("there is no variable `{}`", short(name)))
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
            .ok_or_else(|| format!("there is no function `{}`", short(name)))?;
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

#[cfg(test)]
mod tests {
    use super::*;

    fn run(text: &str) -> Result<Bank, String> {
        let mut bank = Bank::default();
        bank.scalars[0] = [2.0, 3.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0];
        bank.vectors[0][0] = DVec3::new(1.0, 2.0, 3.0);
        for statement in parse(text)? {
            statement.run(&mut bank)?;
        }
        Ok(bank)
    }

    fn oa(text: &str) -> f64 {
        run(text).unwrap().scalars[2][0]
    }

    #[test]
    fn operators_bind_as_in_c() {
        assert_eq!(oa("oa = a + b * 2"), 8.0);
        assert_eq!(oa("oa = (a + b) * 2 - -1"), 11.0);
        assert_eq!(oa("oa = a - b - 1"), -2.0);
        assert_eq!(oa("oa = 7 % 4"), 3.0);
        assert_eq!(oa("oa = a < b && !(a == 2) || c >= .5"), 1.0);
        assert_eq!(oa("oa = a > b ? 1 : c > 1 ? 2 : 3"), 3.0);
        assert_eq!(oa("oa = -A[1] + 1"), -1.0);
    }

    #[test]
    fn vectors_have_components_and_products() {
        let bank = run(
            "oA = 2 * A + vec3f(a, 0, 1e1); oB[1] = A[2]; oa = dot(A, A); ob = length(cross(A, A))",
        )
        .unwrap();
        assert_eq!(bank.vectors[2][0], DVec3::new(4.0, 4.0, 16.0));
        assert_eq!(bank.vectors[2][1], DVec3::new(0.0, 3.0, 0.0));
        assert_eq!((bank.scalars[2][0], bank.scalars[2][1]), (14.0, 0.0));
    }

    #[test]
    fn functions_constants_and_temporaries() {
        assert_eq!(
            oa("ta = M_PI / 2; oa = sin(ta) + atan2(0, 1) + pow(a, b)"),
            9.0
        );
        assert_eq!(
            oa("oa = floor(2.7) + ceil(0.1) + fabs(-4) + fmod(7, 4)"),
            10.0
        );
        let (once, again) = (oa("oa = rand(5)"), oa("oa = rand(5)"));
        assert!(once == again && (0.0..5.0).contains(&once));
    }

    #[test]
    fn mistakes_are_sentences() {
        for (text, part) in [
            ("oa = ", "missing at the end"),
            ("a = 1", "cannot be assigned"),
            ("oa = A", "vector stands where"),
            ("oA = 1", "number stands where"),
            ("oa = q", "no variable `q`"),
            ("oa = foo(1)", "no function `foo`"),
            ("oa = pow(1)", "takes 2 values"),
            ("oa = A[3]", "components 0 to 2"),
            ("oa = (1", "`)` is missing"),
            ("oa = 1 2", "not understood"),
            ("oa = 1..2", "not understood"),
            ("oa = A * A", "wrong kind"),
        ] {
            let error = run(text).map(|_| ()).unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
        let deep = format!("oa = {}1", "(".repeat(100_000));
        assert!(run(&deep).is_err());
        let long = format!("oa = 1{}", "+1".repeat(100_000));
        assert!(run(&long).is_err());
        let signs = format!("oa = {}1", "-".repeat(100_000));
        assert!(run(&signs).is_err());
    }

    proptest::proptest! {
        #[test]
        fn no_text_breaks_the_language(text in "(oa|tA|oB|A|b|\\[|\\]|=|\\?|:|;|\\(|\\)|,|[-+*/%!<>&|.]|1|2e3|cos|vec3f|rand| ){0,24}") {
            let _ = run(&text);
        }
    }
}
