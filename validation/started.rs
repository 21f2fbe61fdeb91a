//! A problem with another start.

use aeroform::design::{AnalysisFailure, DesignProblem, Evaluation, Problem, ProblemDescription, ValueAndGradient};
use nalgebra::DMatrix;

/// A problem with another start and without second derivatives.
pub struct Started<'a> {
    problem: &'a mut DesignProblem,
    description: ProblemDescription,
}

impl<'a> Started<'a> {
    /// The problem from `start`, in scaled variables.
    pub fn new(problem: &'a mut DesignProblem, start: Vec<f64>) -> Self {
        let description = ProblemDescription { start, ..problem.description().clone() };
        Self { problem, description }
    }
}

impl Problem for Started<'_> {
    fn description(&self) -> &ProblemDescription {
        &self.description
    }
    fn evaluate(&mut self, x: &[f64]) -> Result<Evaluation, AnalysisFailure> {
        self.problem.evaluate(x)
    }
    fn hessian(&mut self, _: &[f64]) -> Option<Result<DMatrix<f64>, AnalysisFailure>> {
        None
    }
    fn metric(&mut self, x: &[f64]) -> Option<DMatrix<f64>> {
        self.problem.metric(x)
    }
    fn known_constraints(&mut self, x: &[f64]) -> Option<Vec<Option<ValueAndGradient>>> {
        self.problem.known_constraints(x)
    }
    fn likely_curvature(&mut self, x: &[f64]) -> Option<DMatrix<f64>> {
        self.problem.likely_curvature(x)
    }
    fn natural_steps(&self) -> Option<Vec<f64>> {
        self.problem.natural_steps()
    }
}
