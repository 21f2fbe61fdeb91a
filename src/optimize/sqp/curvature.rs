//! The curvature of the Lagrangian, learnt from the gradients at the ends of steps.

use nalgebra::{DMatrix, DVector};
use std::collections::VecDeque;

/// Share of the modelled curvature that an update keeps at least (Powell's damping): the model stays positive definite.
const DAMPING: f64 = 0.2;
/// Factor by which an update lowers the curvature in all directions at most.
///
/// Where a step finds less curvature than was modelled, the directions that nothing is known of most likely have less
/// as well (self-scaling as by Al-Baali, J. Optim. Theory Appl. 96, 1998). With every update the share of these
/// directions falls, and with it what an update may lower: after as many updates as there are directions, nothing,
/// unless the step finds less than this factor of what was modelled. From then on a step changes its own direction
/// alone: the model would otherwise sink without end where steps go back and forth along one line.
const RELAXATION: f64 = 0.5;
/// Number of the latest steps, at most, that are gone through once more at the end: they hold best where the run is now,
/// and an update by one step spoils what the others have found. There are never more of them than directions, as more
/// steps than that say nothing that the latest of them do not say better.
const REPEATED: usize = 20;
/// Number of steps from which on the latest ones are gone through once more, at least and at most: the first steps of a
/// run are long, and what they find is no better than what they spoil. Between these bounds it is half as many steps
/// again as there are directions.
const SETTLED: [usize; 2] = [10, 25];
/// Number of steps that are remembered.
const REMEMBERED: usize = 300;
/// Number of updates that are taken to be needed at least, where there are few directions.
const FEWEST_UPDATES: usize = 30;

/// A step, and what changed along it.
struct Step {
    way: DVector<f64>,
    /// Changes of the gradients: of the objective in the first column, of the constraints in the others.
    changes: DMatrix<f64>,
}

/// A positive definite model of the Hessian of the Lagrangian, in natural steps of the variables.
///
/// The steps are remembered with the change of every gradient, and the model is made anew from all of them with every
/// change of the multipliers: what a constraint has shown on the way counts as much as its multiplier does now.
pub(super) struct Curvature {
    matrix: DMatrix<f64>,
    steps: VecDeque<Step>,
    first: DMatrix<f64>,
    /// Number of updates the model is made of.
    updates: usize,
}

impl Curvature {
    /// A model that begins with a symmetric positive definite curvature.
    pub fn new(first: DMatrix<f64>) -> Self {
        Self { matrix: first.clone(), steps: VecDeque::new(), first, updates: 0 }
    }

    pub fn matrix(&self) -> &DMatrix<f64> {
        &self.matrix
    }

    /// Starts anew; whether that changes anything.
    pub fn forget(&mut self) -> bool {
        let known = !self.steps.is_empty();
        self.steps.clear();
        self.restart();
        known
    }

    fn restart(&mut self) {
        self.matrix.copy_from(&self.first);
        self.updates = 0;
    }

    /// Learns from a step. `changes` are the changes of the gradients along it, of the objective in the first column and
    /// of the constraints in the others; the Lagrangian is the objective less the constraints times `multipliers`.
    pub fn learn(&mut self, way: DVector<f64>, changes: DMatrix<f64>, multipliers: &[f64]) {
        if self.steps.len() == REMEMBERED {
            self.steps.pop_front();
        }
        self.steps.push_back(Step { way, changes });
        let weights = std::iter::once(1.0).chain(multipliers.iter().map(|m| -m));
        let weights = DVector::from_iterator(1 + multipliers.len(), weights);
        self.restart();
        let steps = std::mem::take(&mut self.steps);
        let directions = self.matrix.nrows();
        let settled = (directions + directions / 2).clamp(SETTLED[0], SETTLED[1]);
        let repeated = if steps.len() < settled { 0 } else { REPEATED.min(directions) };
        let latest = steps.len() - repeated;
        for step in steps.iter().chain(steps.range(latest..)) {
            self.update(&step.way, &(&step.changes * &weights));
        }
        self.steps = steps;
    }

    /// Damped update of Broyden, Fletcher, Goldfarb and Shanno by a step and the change of the gradient of the
    /// Lagrangian along it.
    fn update(&mut self, step: &DVector<f64>, change: &DVector<f64>) {
        let found = step.dot(change);
        let along = step.dot(&(&self.matrix * step));
        if !(along > 0.0 && found.is_finite()) {
            return;
        }
        let known = self.updates as f64 / self.matrix.nrows().max(FEWEST_UPDATES) as f64;
        self.updates += 1;
        let ratio = found / along;
        let scale = match ratio < RELAXATION {
            true if known < 1.0 => RELAXATION,
            _ => ratio.max(known).min(1.0),
        };
        let relaxed = &self.matrix * scale;
        let (modelled, along) = (&relaxed * step, along * scale);
        let share = if found >= DAMPING * along { 1.0 } else { (1.0 - DAMPING) * along / (along - found) };
        let change = change * share + &modelled * (1.0 - share);
        let kept = step.dot(&change);
        if kept > 0.0 {
            self.matrix = relaxed;
            self.matrix.ger(-1.0 / along, &modelled, &modelled, 1.0);
            self.matrix.ger(1.0 / kept, &change, &change, 1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Changes of an objective and a constraint with these Hessians along a step.
    fn changes(objective: &DMatrix<f64>, constraint: &DMatrix<f64>, step: &DVector<f64>) -> DMatrix<f64> {
        DMatrix::from_columns(&[objective * step, constraint * step])
    }

    #[test]
    fn the_curvature_of_a_quadratic_is_learnt_and_follows_the_multiplier() {
        let objective = DMatrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 3.0]);
        let constraint = DMatrix::from_row_slice(2, 2, &[-2.0, 0.5, 0.5, -1.0]);
        let mut curvature = Curvature::new(DMatrix::identity(2, 2) * 100.0);
        for k in 0..60 {
            let angle = 1.1 * f64::from(k);
            let step = DVector::from_vec(vec![angle.cos(), angle.sin()]);
            let multiplier = if k < 59 { 0.3 } else { 2.0 };
            curvature.learn(step.clone(), changes(&objective, &constraint, &step), &[multiplier]);
        }
        // one step with the last multiplier is enough
        assert_relative_eq!(*curvature.matrix(), &objective - &constraint * 2.0, epsilon = 1e-6);
        assert!(curvature.forget() && !curvature.forget());
    }

    #[test]
    fn the_model_stays_positive_where_the_curvature_is_negative() {
        let mut curvature = Curvature::new(DMatrix::identity(2, 2) * 8.0);
        let step = DVector::from_vec(vec![1.0, 0.0]);
        curvature.update(&step, &(&step * -5.0));
        assert_relative_eq!(curvature.matrix()[(0, 0)], 8.0 * RELAXATION * DAMPING, epsilon = 1e-12);
        assert!(curvature.matrix().clone().cholesky().is_some());
    }
}
