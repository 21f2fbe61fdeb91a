use super::super::testcases::{rosenbrock, run};
use super::*;
use crate::design::{AnalysisFailure, Bounds, ProblemDescription};
use crate::differentiate::{VectorFunction, jacobian};
use crate::optimize::{Journaled, Termination};
use crate::scalar::Scalar;
use approx::assert_relative_eq;
use num_dual::Dual2_64;
use std::convert::Infallible;

/// A sum of squares of residuals whose Jacobian comes from dual numbers.
struct Squares<F> {
    residuals: F,
    description: ProblemDescription,
    fails: fn(&[f64]) -> bool,
    /// Whether the curvature of the residuals is told.
    bends: bool,
}

impl<F: VectorFunction<Error = Infallible>> Squares<F> {
    fn new(residuals: F, start: &[f64], bounds: (f64, f64)) -> Self {
        let description = ProblemDescription {
            variable_names: (0..start.len()).map(|k| format!("x{k}")).collect(),
            start: start.to_vec(),
            variable_bounds: vec![Bounds { lower: bounds.0, upper: bounds.1 }; start.len()],
            ..ProblemDescription::default()
        };
        Self { residuals, description, fails: |_| false, bends: false }
    }
}

const FREE: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

impl<F: VectorFunction<Error = Infallible>> Problem for Squares<F> {
    fn description(&self) -> &ProblemDescription {
        &self.description
    }
    fn evaluate(&mut self, x: &[f64]) -> Result<Evaluation, AnalysisFailure> {
        if (self.fails)(x) {
            return Err(AnalysisFailure { reason: "the test forbids it".into() });
        }
        let Ok((r, matrix)) = jacobian(&self.residuals, x);
        let r = DVector::from_vec(r);
        let gradient = (matrix.tr_mul(&r) * 2.0).as_slice().to_vec();
        let objective = r.norm_squared();
        Ok(Evaluation { objective, gradient, constraints: vec![], jacobian: vec![], values: vec![] })
    }
    fn hessian(&mut self, _: &[f64]) -> Option<Result<DMatrix<f64>, AnalysisFailure>> {
        None
    }
    fn gauss_newton(&mut self, x: &[f64]) -> Option<Result<DMatrix<f64>, AnalysisFailure>> {
        let Ok((_, matrix)) = jacobian(&self.residuals, x);
        Some(Ok(matrix.tr_mul(&matrix) * 2.0))
    }
    fn residual_curvature(&mut self, x: &[f64], step: &[f64]) -> Option<Vec<f64>> {
        let along: Vec<Dual2_64> = x.iter().zip(step).map(|(x, s)| Dual2_64::new(*x, *s, 0.0)).collect();
        let Ok(residuals) = self.residuals.evaluate(&along);
        let Ok((_, matrix)) = jacobian(&self.residuals, x);
        let second = DVector::from_iterator(residuals.len(), residuals.iter().map(|r| r.v2));
        self.bends.then(|| (matrix.tr_mul(&second) * 2.0).as_slice().to_vec())
    }
}

struct Valley;
impl VectorFunction for Valley {
    type Error = Infallible;
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, Infallible> {
        Ok(vec![(x[1] - x[0] * x[0]) * 10.0, -x[0] + 1.0])
    }
}

/// Rosenbrock's valley with walls of any steepness.
struct Steep(f64);
impl VectorFunction for Steep {
    type Error = Infallible;
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, Infallible> {
        Ok(vec![(x[1] - x[0] * x[0]) * self.0, -x[0] + 1.0])
    }
}

/// Problem 16 of Moré, Garbow and Hillstrom (Brown and Dennis), with a large residual: 85822.2.
struct BrownDennis;
impl VectorFunction for BrownDennis {
    type Error = Infallible;
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, Infallible> {
        let one = |i: usize| {
            let t = i as f64 / 5.0;
            let a = x[0] + x[1] * t - t.exp();
            let b = x[2] + x[3] * t.sin() - t.cos();
            a * a + b * b
        };
        Ok((1..=20).map(one).collect())
    }
}

/// Problem 8 of Moré, Garbow and Hillstrom (Bard): 8.21487e-3.
struct Bard;
impl VectorFunction for Bard {
    type Error = Infallible;
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, Infallible> {
        const Y: [f64; 15] = [0.14, 0.18, 0.22, 0.25, 0.29, 0.32, 0.35, 0.39, 0.37, 0.58, 0.73, 0.96, 1.34, 2.10, 4.39];
        let one = |(k, y): (usize, &f64)| {
            let u = k as f64 + 1.0;
            let v = 16.0 - u;
            let w = u.min(v);
            -(x[0] + (x[1] * v + x[2] * w).recip() * u) + *y
        };
        Ok(Y.iter().enumerate().map(one).collect())
    }
}

#[test]
fn published_problems() {
    let exact = GaussNewton { objective_tolerance: 1e-9, ..GaussNewton::default() };
    let valley = run(&exact, &mut Squares::new(Valley, &[-1.2, 1.0], FREE));
    assert_eq!(valley.status, Termination::Converged, "{}", valley.message);
    valley.x.iter().for_each(|&x| assert_relative_eq!(x, 1.0, epsilon = 1e-8));
    assert!(valley.evaluations <= 30, "{}", valley.evaluations);
    let bard = run(&exact, &mut Squares::new(Bard, &[1.0; 3], FREE));
    assert_eq!(bard.status, Termination::Converged, "{}", bard.message);
    assert_relative_eq!(bard.evaluation.unwrap().objective, 8.21487e-3, max_relative = 1e-5);
    let brown = run(&exact, &mut Squares::new(BrownDennis, &[25.0, 5.0, -5.0, -1.0], FREE));
    assert_eq!(brown.status, Termination::Converged, "{}", brown.message);
    assert_relative_eq!(brown.evaluation.unwrap().objective, 85822.2, max_relative = 1e-6);
}

#[test]
fn steep_walls_do_not_shorten_the_way_along_a_curved_valley() {
    let exact = GaussNewton { objective_tolerance: 1e-9, progress_tolerance: 0.0, ..GaussNewton::default() };
    for steepness in [100.0, 1000.0] {
        let mut ends = Vec::new();
        let mut note = |p: &Progress<'_>| {
            ends.push((p.iteration, p.result.map_or(f64::NAN, |e| e.objective)));
            ControlFlow::Continue(())
        };
        let mut problem = Squares::new(Steep(steepness), &[-1.2, -1.2], FREE);
        let outcome = exact.minimize(&mut problem, &mut note).unwrap();
        assert_eq!(outcome.status, Termination::Converged, "{}", outcome.message);
        outcome.x.iter().for_each(|&x| assert_relative_eq!(x, 1.0, epsilon = 1e-6));
        // where steps onto the slope are refused, the milder valley takes 31 and the steeper one is given up after 44
        assert!(outcome.evaluations <= 12, "{steepness}: {}", outcome.evaluations);
        // a step up the slope and the one back to the floor are one iteration
        let pair = ends.windows(2).any(|w| w[0].0 == w[1].0 && w[1].1 < w[0].1);
        assert!(pair, "{ends:?}");
    }
}

/// A valley along a circle, whose floor falls slowly towards the point (0, 1).
struct Ring;
impl VectorFunction for Ring {
    type Error = Infallible;
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, Infallible> {
        let radius = (x[0] * x[0] + x[1] * x[1]).sqrt();
        Ok(vec![(radius - 1.0) * 1e3, x[0] * 0.1, (x[1] - 1.0) * 0.1])
    }
}

#[test]
fn a_step_that_is_bent_follows_a_curved_valley() {
    let exact =
        GaussNewton { objective_tolerance: 1e-9, progress_tolerance: 0.0, match_tolerance: 0.0, ..Default::default() };
    let [straight, bent] = [false, true].map(|bends| {
        let mut problem = Squares::new(Ring, &[0.6, -0.8], FREE);
        problem.bends = bends;
        let outcome = run(&exact, &mut problem);
        assert_eq!(outcome.status, Termination::Converged, "{}", outcome.message);
        assert!(outcome.x[0].abs() < 1e-4 && (outcome.x[1] - 1.0).abs() < 1e-4, "{:?}", outcome.x);
        outcome.evaluations
    });
    assert!(bent < straight, "{bent} {straight}");
    // bounds are met by bent steps as well
    let mut problem = Squares::new(Ring, &[0.6, -0.8], (-2.0, 0.5));
    problem.bends = true;
    let outcome = run(&exact, &mut problem);
    assert_eq!(outcome.status, Termination::Converged, "{}", outcome.message);
    assert!(outcome.x.iter().all(|x| *x <= 0.5), "{:?}", outcome.x);
}

#[test]
fn bounds_are_met_exactly() {
    // on the bound x0 = 0.5 the other variable follows the parabola
    let exact = GaussNewton { objective_tolerance: 1e-12, ..GaussNewton::default() };
    let outcome = run(&exact, &mut Squares::new(Valley, &[-1.2, 1.0], (-2.0, 0.5)));
    assert_eq!(outcome.status, Termination::Converged, "{}", outcome.message);
    assert_eq!(outcome.x[0], 0.5);
    assert_relative_eq!(outcome.x[1], 0.25, epsilon = 1e-7);
    assert!(outcome.kkt_residual < 1e-4 && outcome.bound_multipliers[0] != 0.0);
    assert!(outcome.message.contains("bound of the variable x0"), "{}", outcome.message);
}

#[test]
fn failed_analyses_are_rejected_steps() {
    let mut case = Squares::new(Valley, &[-1.2, 1.0], FREE);
    case.fails = |x| (x[1] - x[0] * x[0]).abs() > 0.6;
    // the first step of this length leads far beyond
    let hasty = GaussNewton { first_radius: 100.0, ..GaussNewton::default() };
    let outcome = run(&hasty, &mut case);
    assert_eq!(outcome.status, Termination::Converged, "{}", outcome.message);
    assert!(outcome.failures > 0);
    case.fails = |_| true;
    let outcome = run(&GaussNewton::default(), &mut case);
    assert_eq!((outcome.status, outcome.evaluations), (Termination::Failed, 1));
    let mut case = Squares::new(Valley, &[-1.2, 1.0], FREE);
    case.fails = |x| x[0] > 0.0;
    assert_eq!(run(&GaussNewton::default(), &mut case).status, Termination::Failed);
}

#[test]
fn other_objectives_are_refused() {
    let error = GaussNewton::default().minimize(&mut rosenbrock(2), &mut |_| ControlFlow::Continue(())).unwrap_err();
    assert!(matches!(error, OptimizeError::NoSquares { .. }), "{error}");
    let error = GaussNewton { first_radius: 0.0, ..GaussNewton::default() };
    let error = error.minimize(&mut rosenbrock(2), &mut |_| ControlFlow::Continue(())).unwrap_err();
    assert!(matches!(error, OptimizeError::Setting { setting: "first_radius", .. }), "{error}");
}

#[test]
fn a_resumed_run_continues_bit_for_bit() {
    let method = GaussNewton::default();
    let whole = run(&method, &mut Squares::new(BrownDennis, &[25.0, 5.0, -5.0, -1.0], FREE));
    for k in [1, 2, 7] {
        let mut killed = Journaled::new(Squares::new(BrownDennis, &[25.0, 5.0, -5.0, -1.0], FREE));
        let stop = &mut |p: &Progress<'_>| {
            if p.evaluation == k { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        method.minimize(&mut killed, stop).unwrap();
        let (problem, journal) = killed.into_parts();
        let mut resumed = Journaled::resume(problem, journal);
        let outcome = run(&method, &mut resumed);
        assert_eq!(resumed.divergence(), None);
        assert_eq!((outcome.x, outcome.evaluations), (whole.x.clone(), whole.evaluations));
    }
}

/// A nearly perfect match, whose rest falls ever more slowly along a flat valley.
struct Flat;
impl VectorFunction for Flat {
    type Error = Infallible;
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, Infallible> {
        Ok(vec![x[0] - 1.0, (x[1] - 1.0).powi(3) * 1e-3])
    }
}

#[test]
fn a_match_that_is_good_enough_ends_where_progress_is_slow() {
    let problem = || Squares::new(Flat, &[4.0, 1.5], FREE);
    let tight = GaussNewton { objective_tolerance: 0.0, progress_tolerance: 0.0, ..GaussNewton::default() };
    let outcome = run(&tight, &mut problem());
    assert_eq!(outcome.status, Termination::Converged, "{}", outcome.message);
    let objective = outcome.evaluation.as_ref().unwrap().objective;
    assert!(objective <= 1e-8 * 9.0 && outcome.message.contains("at the start is left"), "{}", outcome.message);
    // without that tolerance the run goes on
    let longer = run(&GaussNewton { match_tolerance: 0.0, ..tight }, &mut problem());
    assert!(longer.evaluations > outcome.evaluations && longer.evaluation.unwrap().objective < objective);
}
