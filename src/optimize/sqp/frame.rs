//! The variables as the method counts them: those that are free, in natural steps.

use crate::design::{Bounds, Problem};
use crate::optimize::vector::norm;
use nalgebra::{DMatrix, DVector};

/// Curvature in all directions that is added to what is likely, over the likely curvature along the gradient: no direction
/// is straight.
const LEAST_CURVATURE: f64 = 0.1;

/// Free variables and their natural steps.
pub(super) struct Frame {
    /// Natural step of every variable, fixed ones included.
    steps: Vec<f64>,
    free: Vec<usize>,
    bounds: Vec<Bounds>,
}

impl Frame {
    pub fn new(problem: &dyn Problem) -> Self {
        let bounds = problem.description().variable_bounds.clone();
        let steps = problem.natural_steps().unwrap_or_else(|| vec![1.0; bounds.len()]);
        let free = (0..bounds.len()).filter(|&k| bounds[k].lower < bounds[k].upper).collect();
        Self { steps, free, bounds }
    }

    /// Number of free variables.
    pub fn size(&self) -> usize {
        self.free.len()
    }

    /// A gradient by the free variables in natural steps.
    pub fn gradient(&self, of: &[f64]) -> DVector<f64> {
        DVector::from_iterator(self.size(), self.free.iter().map(|&k| of[k] * self.steps[k]))
    }

    /// The way from one point to another.
    pub fn way(&self, from: &[f64], to: &[f64]) -> DVector<f64> {
        DVector::from_iterator(self.size(), self.free.iter().map(|&k| (to[k] - from[k]) / self.steps[k]))
    }

    /// The point a step leads to, within the bounds.
    pub fn moved(&self, from: &[f64], step: &DVector<f64>) -> Vec<f64> {
        let mut x = from.to_vec();
        for (&k, d) in self.free.iter().zip(step.iter()) {
            x[k] = (x[k] + d * self.steps[k]).clamp(self.bounds[k].lower, self.bounds[k].upper);
        }
        x
    }

    /// How far each variable can go down and up from a point, at most `reach`.
    pub fn room(&self, from: &[f64], reach: f64) -> (Vec<f64>, Vec<f64>) {
        let room = |&k: &usize| {
            let low = ((self.bounds[k].lower - from[k]) / self.steps[k]).max(-reach);
            let high = ((self.bounds[k].upper - from[k]) / self.steps[k]).min(reach);
            // the quadratic program needs an interior
            if high - low > 1e-14 { (low, high) } else { (low - 1e-14, high + 1e-14) }
        };
        self.free.iter().map(room).unzip()
    }

    /// The metric in which steps from a point are measured; the identity where the problem knows none.
    pub fn metric(&self, problem: &mut dyn Problem, x: &[f64]) -> DMatrix<f64> {
        let n = self.size();
        problem.metric(x).map_or_else(|| DMatrix::identity(n, n), |metric| self.form(&metric))
    }

    /// A quadratic form of the variables, by the free ones in natural steps.
    fn form(&self, of: &DMatrix<f64>) -> DMatrix<f64> {
        DMatrix::from_fn(self.size(), self.size(), |i, j| {
            let (a, b) = (self.free[i], self.free[j]);
            of[(a, b)] * self.steps[a] * self.steps[b]
        })
    }

    /// The likely curvature near a point, in a size at which Newton's step from there is as long as the gradient; the
    /// identity where the problem knows none.
    pub fn likely_curvature(&self, problem: &mut dyn Problem, x: &[f64], gradient: &DVector<f64>) -> DMatrix<f64> {
        let n = self.size();
        let mut shaped = || {
            let form = self.form(&problem.likely_curvature(x)?);
            let along = gradient.dot(&(&form * gradient)) / gradient.norm_squared();
            let matrix = form + DMatrix::identity(n, n) * (LEAST_CURVATURE * along);
            let newton = matrix.clone().cholesky()?.solve(gradient).norm() / gradient.norm();
            (along > 0.0 && newton > 0.0 && newton.is_finite()).then(|| matrix * newton)
        };
        shaped().unwrap_or_else(|| DMatrix::identity(n, n))
    }

    /// Euclidean norm of a gradient by the free variables in natural steps.
    pub fn slope(&self, of: &[f64]) -> f64 {
        norm(self.gradient(of).as_slice())
    }
}
