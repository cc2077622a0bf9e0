//! One row of the table.

use serde::Serialize;

/// A computation beside its known answer.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Case {
    /// What is computed, with its unit.
    pub name: String,
    /// The known answer.
    pub expected: f64,
    /// The computed answer.
    pub got: f64,
    /// The error. For a ray it is the largest of its coordinates, over the size of the answer.
    pub error: f64,
    /// The largest error that is allowed.
    pub bound: f64,
}

impl Case {
    /// Returns the case of one number, with its relative error; absolute if the answer is 0.
    pub(super) fn of(name: impl Into<String>, expected: f64, got: f64, bound: f64) -> Self {
        let size = match expected {
            0.0 => 1.0,
            _ => expected.abs(),
        };
        Self {
            name: name.into(),
            expected,
            got,
            error: (got - expected).abs() / size,
            bound,
        }
    }

    /// Returns whether the error is within its bound. A NaN error counts as outside.
    pub(crate) fn holds(&self) -> bool {
        self.error <= self.bound
    }
}
