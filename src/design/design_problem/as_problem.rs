//! The view that optimisers have of a design problem.

use super::DesignProblem;
use crate::design::parallel::{in_parallel_with, processors};
use crate::design::quantity::Quantity;
use crate::design::{AnalysisFailure, DesignError, Evaluation, Problem, ProblemDescription, ValueAndGradient};
use nalgebra::DMatrix;

impl From<DesignError> for AnalysisFailure {
    fn from(error: DesignError) -> Self {
        Self { reason: error.to_string() }
    }
}

impl Problem for DesignProblem {
    fn description(&self) -> &ProblemDescription {
        &self.description
    }
    fn evaluate(&mut self, x: &[f64]) -> Result<Evaluation, AnalysisFailure> {
        Ok(self.try_evaluate(x)?)
    }
    fn evaluate_near(&mut self, base: &[f64], points: &[Vec<f64>]) -> Vec<Result<Evaluation, AnalysisFailure>> {
        let Some(flow) = &self.instruments.flow else {
            return points.iter().map(|x| self.evaluate(x)).collect();
        };
        let shape = self.geometry.shape(&self.unscaled(base)).ok();
        let flow = flow.near(shape.as_ref());
        let worker = || {
            let mut worker = self.clone();
            worker.instruments.flow = Some(flow.on_the_same_clock());
            worker
        };
        in_parallel_with(processors(), points, worker, |worker, x| worker.evaluate(x))
    }
    fn hessian(&mut self, x: &[f64]) -> Option<Result<DMatrix<f64>, AnalysisFailure>> {
        let of_flow = |(q, w): (&Quantity, &f64)| *w != 0.0 && q.needs_flow();
        if self.quantities.iter().zip(&self.weights).any(of_flow) {
            return None;
        }
        Some(self.try_hessian(x).map_err(AnalysisFailure::from))
    }
    fn gauss_newton(&mut self, x: &[f64]) -> Option<Result<DMatrix<f64>, AnalysisFailure>> {
        self.is_sum_of_squares().then(|| self.normal_matrix(x).map_err(AnalysisFailure::from))
    }
    fn residual_curvature(&mut self, x: &[f64], step: &[f64]) -> Option<Vec<f64>> {
        self.curvature_along(x, step)
    }
    fn metric(&mut self, x: &[f64]) -> Option<DMatrix<f64>> {
        self.distortion(x)
    }
    fn known_constraints(&mut self, x: &[f64]) -> Option<Vec<Option<ValueAndGradient>>> {
        // without a flow an evaluation costs no more than this
        self.instruments.flow.as_ref()?;
        self.constraints_of_shape(x).ok()
    }
    fn likely_curvature(&mut self, x: &[f64]) -> Option<DMatrix<f64>> {
        self.slope_of_displacement(x)
    }
    fn natural_steps(&self) -> Option<Vec<f64>> {
        Some(self.geometry.variables().iter().map(|v| v.step / v.scale).collect())
    }
}
