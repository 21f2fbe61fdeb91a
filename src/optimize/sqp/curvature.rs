//! The curvature of the Lagrangian, learnt from the gradients at the ends of steps.

use nalgebra::{DMatrix, DVector};

/// Share of the modelled curvature that an update keeps at least (Powell's damping): the model stays positive definite.
const DAMPING: f64 = 0.2;
/// Factor by which an update lowers the curvature in all directions at most.
///
/// Where a step finds less curvature than was modelled, the directions that nothing is known of most likely have less
/// as well (self-scaling as by Al-Baali, J. Optim. Theory Appl. 96, 1998). With every update the share of these
/// directions falls, and with it what an update may lower: after as many updates as there are directions, nothing,
/// unless the step finds less than this factor of what was modelled. Then all that was learnt is out of date.
const RELAXATION: f64 = 0.5;
/// Number of updates that are taken to be needed at least, where there are few directions.
const FEWEST_UPDATES: usize = 30;

/// A positive definite model of the Hessian of the Lagrangian, in natural steps of the variables.
pub(super) struct Curvature {
    matrix: DMatrix<f64>,
    first: f64,
    /// Number of updates since the start.
    updates: usize,
}

impl Curvature {
    /// Equal curvature `first` in all of `n` directions.
    pub fn new(n: usize, first: f64) -> Self {
        Self { matrix: DMatrix::identity(n, n) * first, first, updates: 0 }
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
        self.updates = 0;
        other
    }

    /// Damped update of Broyden, Fletcher, Goldfarb and Shanno by a step and the change of the gradient of the
    /// Lagrangian along it.
    pub fn update(&mut self, step: &DVector<f64>, change: &DVector<f64>) {
        let found = step.dot(change);
        let along = step.dot(&(&self.matrix * step));
        if !(along > 0.0 && found.is_finite()) {
            return;
        }
        let known = self.updates as f64 / self.matrix.nrows().max(FEWEST_UPDATES) as f64;
        self.updates += 1;
        let ratio = found / along;
        let scale = if ratio < RELAXATION { RELAXATION } else { ratio.max(known).min(1.0) };
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

    #[test]
    fn the_curvature_of_a_quadratic_is_learnt_and_stays_positive() {
        let hessian = DMatrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 3.0]);
        let mut curvature = Curvature::new(2, 100.0);
        for k in 0..60 {
            let angle = 1.1 * f64::from(k);
            let step = DVector::from_vec(vec![angle.cos(), angle.sin()]);
            curvature.update(&step, &(&hessian * &step));
        }
        assert_relative_eq!(*curvature.matrix(), hessian, epsilon = 1e-6);
        // negative curvature leaves a share of what was modelled
        let step = DVector::from_vec(vec![1.0, 0.0]);
        curvature.update(&step, &(&step * -5.0));
        assert_relative_eq!(curvature.matrix()[(0, 0)], 4.0 * RELAXATION * DAMPING, epsilon = 1e-6);
        assert!(curvature.forget() && !curvature.forget());
    }
}
