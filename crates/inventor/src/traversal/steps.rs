//! The matrices by which a walk came from one place to another.
//!
//! Matrices are multiplied in the order of the walk, and rounding makes that order matter. A part
//! of the scene that is drawn again elsewhere has the same bits as an expanded one only if its
//! matrices are multiplied one by one.

use std::sync::Arc;

use glam::DMat4;

/// The longest chain. A longer one begins again, so that it takes little memory and dropping it
/// little stack.
const LONGEST: u32 = 64;

/// A matrix that was multiplied to the state's, and those before it.
#[derive(Debug)]
pub struct Step {
    matrix: DMat4,
    before: Option<Arc<Step>>,
    /// The number of steps before this one.
    number: u32,
}

impl Step {
    /// The first step of a chain.
    pub fn start() -> Arc<Self> {
        Arc::new(Self {
            matrix: DMat4::IDENTITY,
            before: None,
            number: 0,
        })
    }

    /// Returns this chain with one more matrix.
    pub(super) fn then(self: &Arc<Self>, matrix: DMat4) -> Arc<Self> {
        let (before, number) = if self.number < LONGEST {
            (Some(self.clone()), self.number + 1)
        } else {
            (None, 0)
        };
        Arc::new(Self {
            matrix,
            before,
            number,
        })
    }

    /// Returns the matrices that were multiplied after an earlier step, in order, or `None` if the
    /// chain began again since.
    pub fn since(self: &Arc<Self>, earlier: &Arc<Self>) -> Option<Vec<DMat4>> {
        let (mut matrices, mut step) = (Vec::new(), self);
        while !Arc::ptr_eq(step, earlier) {
            matrices.push(step.matrix);
            step = step.before.as_ref()?;
        }
        matrices.reverse();
        Some(matrices)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn a_chain_returns_its_matrices_unless_it_is_too_long() {
        let matrix = |x: f64| DMat4::from_translation(DVec3::X * x);
        let start = Step::start();
        let (first, second) = (start.then(matrix(1.0)), start.then(matrix(9.0)));
        let third = first.then(matrix(2.0)).then(matrix(3.0));
        assert_eq!(third.since(&first), Some(vec![matrix(2.0), matrix(3.0)]));
        assert_eq!(third.since(&third), Some(Vec::new()));
        assert_eq!(third.since(&second), None);
        let mut long = start.clone();
        (0..1_000_000).for_each(|_| long = long.then(matrix(1.0)));
        assert_eq!(long.since(&start), None);
    }
}
