//! The curvature of the Lagrangian: sampled from neighbouring gradients, updated by steps.

use super::super::kkt::Iterate;
use super::super::ledger::Ledger;
use crate::design::{Bounds, Evaluation, Problem};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Distance of the neighbouring gradients, in scaled variables.
const PROBE: f64 = 1e-4;
/// Damping of updates (Powell): the share of the modelled curvature that is kept at least.
const DAMPING: f64 = 0.2;

/// A positive definite model of the Hessian of the Lagrangian.
pub(super) struct Curvature {
    matrix: DMatrix<f64>,
    first: f64,
    /// Least curvature: what is flatter is not known to be so far off.
    least: f64,
    /// Iterations since the last sample.
    pub age: usize,
    /// Whether the curvature has been sampled.
    pub sampled: bool,
}

/// Gradient of the Lagrangian for given multipliers.
fn lagrangian(evaluation: &Evaluation, multipliers: &[f64]) -> DVector<f64> {
    let mut gradient = DVector::from_column_slice(&evaluation.gradient);
    for (row, multiplier) in evaluation.jacobian.iter().zip(multipliers).filter(|(_, m)| **m != 0.0) {
        gradient.iter_mut().zip(row).for_each(|(g, a)| *g -= multiplier * a);
    }
    gradient
}

impl Curvature {
    /// Equal curvature `first` in all of `n` directions.
    pub fn new(n: usize, first: f64, least: f64) -> Self {
        Self { matrix: DMatrix::identity(n, n) * first, first, least, age: 0, sampled: false }
    }

    /// The curvature it began with.
    pub fn first(&self) -> f64 {
        self.first
    }

    /// The least curvature of the model.
    pub fn least(&self) -> f64 {
        self.least
    }

    pub fn matrix(&self) -> &DMatrix<f64> {
        &self.matrix
    }

    /// Starts anew; whether that changes anything.
    pub fn forget(&mut self) -> bool {
        let n = self.matrix.nrows();
        let fresh = DMatrix::identity(n, n) * self.first;
        let other = self.matrix != fresh;
        self.matrix = fresh;
        other
    }

    /// Damped update of Broyden, Fletcher, Goldfarb and Shanno by the step from `from` to `x`.
    pub fn update(&mut self, from: &Iterate, x: &[f64], evaluation: &Evaluation, multipliers: &[f64]) {
        self.age += 1;
        let step = DVector::from_iterator(x.len(), x.iter().zip(&from.x).map(|(x, from)| x - from));
        let change = lagrangian(evaluation, multipliers) - lagrangian(&from.evaluation, multipliers);
        let modelled = &self.matrix * &step;
        let (along, found) = (step.dot(&modelled), step.dot(&change));
        if !(along > 0.0 && found.is_finite()) {
            return;
        }
        let share = if found >= DAMPING * along { 1.0 } else { (1.0 - DAMPING) * along / (along - found) };
        let change = change * share + &modelled * (1.0 - share);
        let kept = step.dot(&change);
        self.matrix.ger(-1.0 / along, &modelled, &modelled, 1.0);
        self.matrix.ger(1.0 / kept, &change, &change, 1.0);
    }

    /// Reads the curvature along every variable off the gradients next to `point`.
    pub fn sample(&mut self, ledger: &mut Ledger<'_>, point: &Iterate, bounds: &[Bounds]) {
        let n = point.x.len();
        let multipliers = &point.optimality.multipliers;
        let steps: Vec<f64> =
            (0..n).map(|k| if point.x[k] + PROBE <= bounds[k].upper { PROBE } else { -PROBE }).collect();
        let moved = |k: usize, step: f64| {
            let mut x = point.x.clone();
            x[k] += step;
            x
        };
        let probes: Vec<Vec<f64>> = (0..n).map(|k| moved(k, steps[k])).collect();
        let found = ledger.evaluate_near(&point.x, &probes);
        self.age = 0;
        let here = lagrangian(&point.evaluation, multipliers);
        let mut hessian = DMatrix::zeros(n, n);
        for (k, result) in found.into_iter().enumerate() {
            // where there is no gradient the direction keeps the least curvature
            if let Ok(evaluation) = result {
                hessian.set_column(k, &((lagrangian(&evaluation, multipliers) - &here) / steps[k]));
            }
        }
        if ledger.halted().is_some() {
            return;
        }
        let hessian = (&hessian + hessian.transpose()) * 0.5;
        self.matrix = self.positive(hessian, point, multipliers);
        self.sampled = true;
    }

    /// Positive definite: across the constraints that hold, stiff whatever it was; elsewhere by magnitude.
    fn positive(&self, mut hessian: DMatrix<f64>, point: &Iterate, multipliers: &[f64]) -> DMatrix<f64> {
        let stiffness = hessian.amax();
        for (row, _) in point.evaluation.jacobian.iter().zip(multipliers).filter(|(_, m)| **m != 0.0) {
            let row = DVector::from_column_slice(row);
            let square = row.norm_squared();
            if square > 0.0 {
                hessian.ger(stiffness / square, &row, &row, 1.0);
            }
        }
        let eigen = SymmetricEigen::new(hessian);
        let sizes = eigen.eigenvalues.map(|v| v.abs().max(self.least));
        let scaled = DMatrix::from_fn(sizes.len(), sizes.len(), |i, j| eigen.eigenvectors[(i, j)] * sizes[j]);
        scaled * eigen.eigenvectors.transpose()
    }
}
