//! Bounds on variables by a smooth change of variables.

use crate::design::{AnalysisFailure, Bounds, Evaluation, Problem, ProblemDescription};
use crate::scalar::Scalar;
use nalgebra::DMatrix;
use num_dual::{Dual2_64, second_derivative};

/// A problem with bounded variables as one without bounds, for methods that know none.
///
/// Each bounded variable `x` becomes a smooth function of a free `z` (the transformations of the MINUIT user's guide,
/// section 1.2, scaled so that far from the bounds a step in `z` is a step in `x`), with `w = upper − lower`:
///
/// | bounds | x(z) |
/// | --- | --- |
/// | none | `z` |
/// | both | `lower + w/2 (1 + sin(2 z / w))` |
/// | lower | `lower − 1 + √(z² + 1)` |
/// | upper | `upper + 1 − √(z² + 1)` |
/// | equal | `lower`, whatever `z` |
///
/// Gradients, Jacobians and Hessians follow by the exact chain rule. A minimum at a bound is an ordinary smooth minimum
/// in `z`. Because `dx/dz = 0` at a bound, a start at (or beyond) a bound is moved inside, by a thousandth of `w`, or
/// by 0.001 with one bound. Without any bounds the problem is passed through untouched.
#[derive(Debug)]
pub struct Bounded<P> {
    inner: P,
    /// One for each variable; empty without bounds.
    bounds: Vec<Bounds>,
    description: ProblemDescription,
    /// Where the inner problem was evaluated last, and its gradient there.
    last: Option<(Vec<f64>, Vec<f64>)>,
}

/// Distance from a bound at which a start is let in, as a share of the width, or of one.
const NUDGE: f64 = 1e-3;

/// x(z) between `bounds`.
fn inside<S: Scalar>(z: S, bounds: Bounds) -> S {
    let Bounds { lower, upper } = bounds;
    match (lower > f64::NEG_INFINITY, upper < f64::INFINITY) {
        (false, false) => z,
        (true, true) if lower == upper => S::from(lower),
        (true, true) => {
            let half = (upper - lower) / 2.0;
            ((z / half).sin() + 1.0) * half + lower
        }
        (true, false) => (z * z + 1.0).sqrt() + (lower - 1.0),
        (false, true) => -(z * z + 1.0).sqrt() + (upper + 1.0),
    }
}

/// The `z` in the principal branch with x(z) = `x`, which is first moved inside of `bounds`.
fn outside(x: f64, bounds: Bounds) -> f64 {
    let Bounds { lower, upper } = bounds;
    match (lower > f64::NEG_INFINITY, upper < f64::INFINITY) {
        (false, false) => x,
        (true, true) if lower == upper => 0.0,
        (true, true) => {
            let half = (upper - lower) / 2.0;
            let share = ((x - lower) / half - 1.0).clamp(2.0 * NUDGE - 1.0, 1.0 - 2.0 * NUDGE);
            half * share.asin()
        }
        (one_sided_from_below, _) => {
            let depth = if one_sided_from_below { x - lower } else { upper - x }.max(NUDGE);
            // (depth + 1)² − 1 without cancellation
            (depth * (depth + 2.0)).sqrt()
        }
    }
}

impl<P: Problem> Bounded<P> {
    /// Wraps a problem. Its bounds must leave room, lower ≤ upper; the start may be anywhere.
    pub fn new(inner: P) -> Self {
        let mut description = inner.description().clone();
        let mut bounds = Vec::new();
        if description.variable_bounds.iter().any(|b| !b.is_free()) {
            let free = vec![Bounds::FREE; description.variable_bounds.len()];
            bounds = std::mem::replace(&mut description.variable_bounds, free);
            description.start.iter_mut().zip(&bounds).for_each(|(x, &b)| *x = outside(*x, b));
        }
        Self { inner, bounds, description, last: None }
    }

    /// The wrapped problem.
    pub fn inner(&self) -> &P {
        &self.inner
    }

    /// The wrapped problem, mutable.
    pub fn inner_mut(&mut self) -> &mut P {
        &mut self.inner
    }

    /// The wrapped problem, out of its wrapping.
    pub fn into_inner(self) -> P {
        self.inner
    }

    /// The point of the wrapped problem for a point of this one (both of length n).
    pub fn unwrap_point(&self, z: &[f64]) -> Vec<f64> {
        if self.bounds.is_empty() {
            return z.to_vec();
        }
        // at a bound, rounding must not push x out
        z.iter().zip(&self.bounds).map(|(&z, &b)| inside(z, b).clamp(b.lower, b.upper)).collect()
    }

    /// First and second derivatives of x(z), entry by entry.
    fn derivatives(&self, z: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let each = z.iter().zip(&self.bounds).map(|(&z, &b)| {
            let (_, first, second) = second_derivative(|z: Dual2_64| inside(z, b), z);
            (first, second)
        });
        each.unzip()
    }
}

impl<P: Problem> Problem for Bounded<P> {
    fn description(&self) -> &ProblemDescription {
        &self.description
    }

    fn evaluate(&mut self, z: &[f64]) -> Result<Evaluation, AnalysisFailure> {
        if self.bounds.is_empty() {
            return self.inner.evaluate(z);
        }
        let x = self.unwrap_point(z);
        let mut evaluation = self.inner.evaluate(&x)?;
        self.last = Some((x, evaluation.gradient.clone()));
        let (first, _) = self.derivatives(z);
        let rows = std::iter::once(&mut evaluation.gradient).chain(&mut evaluation.jacobian);
        rows.for_each(|row| row.iter_mut().zip(&first).for_each(|(g, d)| *g *= d));
        Ok(evaluation)
    }

    fn metric(&mut self, z: &[f64]) -> Option<DMatrix<f64>> {
        let mut metric = self.inner.metric(&self.unwrap_point(z))?;
        if !self.bounds.is_empty() {
            let (first, _) = self.derivatives(z);
            for (j, mut column) in metric.column_iter_mut().enumerate() {
                column.iter_mut().zip(&first).for_each(|(m, d)| *m *= d * first[j]);
                // at a bound the change of variables is stationary; the step in z still has a size
                column[j] += 1e-6;
            }
        }
        Some(metric)
    }

    fn gauss_newton(&mut self, z: &[f64]) -> Option<Result<DMatrix<f64>, AnalysisFailure>> {
        let mut result = self.inner.gauss_newton(&self.unwrap_point(z))?;
        if let Ok(matrix) = &mut result
            && !self.bounds.is_empty()
        {
            let (first, _) = self.derivatives(z);
            for (j, mut column) in matrix.column_iter_mut().enumerate() {
                column.iter_mut().zip(&first).for_each(|(h, d)| *h *= d * first[j]);
            }
        }
        Some(result)
    }

    fn hessian(&mut self, z: &[f64]) -> Option<Result<DMatrix<f64>, AnalysisFailure>> {
        if self.bounds.is_empty() {
            return self.inner.hessian(z);
        }
        let x = self.unwrap_point(z);
        let mut hessian = match self.inner.hessian(&x)? {
            Ok(hessian) => hessian,
            failure => return Some(failure),
        };
        if self.last.as_ref().is_none_or(|(at, _)| *at != x) {
            match self.inner.evaluate(&x) {
                Ok(evaluation) => self.last = Some((x, evaluation.gradient)),
                Err(failure) => return Some(Err(failure)),
            }
        }
        let (first, second) = self.derivatives(z);
        for (j, mut column) in hessian.column_iter_mut().enumerate() {
            column.iter_mut().zip(&first).for_each(|(h, d)| *h *= d * first[j]);
        }
        if let Some((_, gradient)) = &self.last {
            for (i, (g, d2)) in gradient.iter().zip(&second).enumerate() {
                hessian[(i, i)] += g * d2;
            }
        }
        Some(Ok(hessian))
    }
}

#[cfg(test)]
mod tests {
    use super::super::testcases::*;
    use super::*;
    use crate::differentiate::finite_difference;
    use crate::differentiate::{Function, StepRange, gradient, hessian};
    use approx::assert_relative_eq;
    use std::convert::Infallible;

    const MIXED: [Bounds; 5] = [
        Bounds::FREE,
        Bounds { lower: -2.0, upper: 0.5 },
        Bounds { lower: -1.0, upper: f64::INFINITY },
        Bounds { lower: f64::NEG_INFINITY, upper: 3.0 },
        Bounds { lower: 0.25, upper: 0.25 },
    ];

    /// The composed function, differentiated as a whole.
    struct Composed;
    impl Function for Composed {
        type Error = Infallible;
        fn evaluate<S: Scalar>(&self, z: &[S]) -> Result<S, Infallible> {
            let x: Vec<S> = z.iter().zip(MIXED).map(|(&z, b)| inside(z, b)).collect();
            Rosenbrock.evaluate(&x)
        }
    }

    fn mixed() -> Unconstrained<Rosenbrock> {
        let mut case = rosenbrock(5);
        case.description.variable_bounds = MIXED.to_vec();
        case.description.start = vec![0.3, -0.4, 2.0, -5.0, 7.0];
        case
    }

    #[test]
    fn start_maps_back() {
        let problem = Bounded::new(mixed());
        let x = problem.unwrap_point(&problem.description().start);
        assert_relative_eq!(x[..], [0.3, -0.4, 2.0, -5.0, 0.25], epsilon = 1e-14);
        // at and beyond the bounds, starts move inside
        let mut case = mixed();
        case.description.start = vec![0.3, 9.0, -1.0, 3.5, 0.25];
        let problem = Bounded::new(case);
        let x = problem.unwrap_point(&problem.description().start);
        assert_relative_eq!(x[..], [0.3, 0.5 - 2.5e-3, -0.999, 2.999, 0.25], epsilon = 1e-14);
    }

    #[test]
    fn derivatives_are_those_of_the_composition() {
        let mut problem = Bounded::new(mixed());
        for z in [[0.3, 0.2, -0.7, 1.4, 0.1], [-1.0, 3.0, 0.0, 0.0, 2.0], [0.5, -8.0, 10.0, -3.0, 0.0]] {
            let (value, slope) = gradient(&Composed, &z).unwrap();
            let (_, _, curvature) = hessian(&Composed, &z).unwrap();
            // once with the gradient at hand, once without
            for fresh in [false, true] {
                if fresh {
                    problem.last = None;
                }
                let matrix = problem.hessian(&z).unwrap().unwrap();
                assert_relative_eq!(matrix, curvature, max_relative = 1e-11, epsilon = 1e-9);
            }
            let evaluation = problem.evaluate(&z).unwrap();
            assert_relative_eq!(evaluation.objective, value, max_relative = 1e-13);
            assert_relative_eq!(evaluation.gradient[..], slope[..], max_relative = 1e-12, epsilon = 1e-12);
            for i in 0..5 {
                let along = |t: f64| {
                    let mut z = z;
                    z[i] = t;
                    Composed.evaluate(&z)
                };
                let estimate = finite_difference(along, z[i], StepRange::for_scale(1.0)).unwrap();
                assert!((estimate.value - slope[i]).abs() <= estimate.error.max(1e-9 * slope[i].abs()));
            }
        }
    }

    #[test]
    fn rows_of_the_jacobian_follow_the_chain_rule() {
        struct Linear(Unconstrained<Rosenbrock>);
        impl Problem for Linear {
            fn description(&self) -> &ProblemDescription {
                self.0.description()
            }
            fn evaluate(&mut self, x: &[f64]) -> Result<Evaluation, AnalysisFailure> {
                let jacobian = vec![vec![1.0; 5], vec![2.0; 5]];
                self.0.evaluate(x).map(|e| Evaluation { jacobian, ..e })
            }
            fn hessian(&mut self, _: &[f64]) -> Option<Result<DMatrix<f64>, AnalysisFailure>> {
                None
            }
        }
        let mut problem = Bounded::new(Linear(mixed()));
        let z = [0.3, 0.2, -0.7, 1.4, 0.1];
        let evaluation = problem.evaluate(&z).unwrap();
        let (first, _) = problem.derivatives(&z);
        assert_eq!(evaluation.jacobian[0], first);
        assert_relative_eq!(evaluation.jacobian[1][2], 2.0 * -0.7 / 1.49_f64.sqrt(), max_relative = 1e-15);
        assert!(problem.hessian(&z).is_none());
    }

    #[test]
    fn without_bounds_nothing_is_touched() {
        let mut problem = Bounded::new(rosenbrock(4));
        let z = [0.1, 0.2, 0.3, 0.4];
        assert_eq!(problem.description(), rosenbrock(4).description());
        assert_eq!(problem.evaluate(&z), rosenbrock(4).evaluate(&z));
        assert_eq!(problem.hessian(&z), rosenbrock(4).hessian(&z));
        assert_eq!(problem.unwrap_point(&z), z);
        assert!(problem.last.is_none());
    }
}
