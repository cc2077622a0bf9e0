//! The engine, which runs its statements for each value of its inputs.

use glam::DVec3;
use ivcam_base::diag::excerpt;
use ivcam_base::work::{self, Budget};

use super::parse::parse;
use super::program::{Bank, OperandKind};
use crate::grammar::calculator;
use crate::grammar::value::Value;
use crate::iv::NodeRef;
use crate::snapshot::engines::outputs::Outputs;

/// The steps of work that an operation takes.
const OPERATION_STEPS: u64 = 4;

/// Computes the outputs of a `Calculator`.
///
/// # Errors
/// Returns a message if an expression is wrong, or if the account of the scene cuts the work.
pub(crate) fn outputs(node: NodeRef<'_>) -> Result<Outputs, String> {
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
        program.extend(parse(line).map_err(|e| format!("expression `{}`: {e}", excerpt(line)))?);
    }
    let lengths = scalars
        .iter()
        .map(|s| s.len())
        .chain(points.iter().map(|p| p.len()));
    let count = lengths.max().unwrap_or(1).max(1);
    let size: usize = program.iter().map(|s| s.size).sum();
    let steps = OPERATION_STEPS.saturating_mul(size.saturating_mul(count) as u64);
    work::spend(steps).map_err(|cut| Budget::current().warning(cut).message)?;
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

fn collect(results: &[Bank]) -> Outputs {
    let scalar = |k: usize| {
        let each = results
            .iter()
            .map(|b| b.scalars[OperandKind::Output as usize][k] as f32);
        Value::Floats(each.collect())
    };
    let vector = |k: usize| {
        let each = results
            .iter()
            .map(|b| b.vectors[OperandKind::Output as usize][k].as_vec3());
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
