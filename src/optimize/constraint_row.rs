//! One-sided constraints, scaled.

use super::vector::norm;
use crate::design::Evaluation;

/// One side of a constraint, scaled: `factor · (value − bound)`.
#[derive(Debug, Clone, Copy)]
pub(super) struct ConstraintRow {
    /// Position of the constraint in the problem.
    pub constraint: usize,
    pub bound: f64,
    pub factor: f64,
}

impl ConstraintRow {
    /// The scaled distance of the constraint from the bound.
    pub fn value(&self, evaluation: &Evaluation) -> f64 {
        self.of(evaluation.constraints[self.constraint])
    }

    /// The scaled distance of a value of the constraint from the bound.
    pub fn of(&self, value: f64) -> f64 {
        self.factor * (value - self.bound)
    }
}

/// The factor that brings a gradient to length one; 1 for a gradient that vanishes.
pub(super) fn scale_factor(gradient: &[f64]) -> f64 {
    let slope = norm(gradient);
    if slope > 0.0 { 1.0 / slope } else { 1.0 }
}
