//! Problems of the collection of Hock and Schittkowski (Test Examples for Nonlinear Programming Codes, 1981) with the
//! solutions printed there, and what else can happen.

use super::*;
use crate::design::{Bounds, Problem};
use crate::differentiate::VectorFunction;
use crate::optimize::testcases::*;
use crate::optimize::{Checkpoint, Journaled};
use crate::scalar::Scalar;
use approx::assert_relative_eq;
use std::convert::Infallible;
use std::ops::ControlFlow;
use std::time::Duration;

const INFINITY: f64 = f64::INFINITY;

/// Functions of x: the objective, then the constraints.
macro_rules! functions {
    ($name:ident, $x:ident, [$($value:expr),+ $(,)?]) => {
        #[derive(Clone)]
        struct $name;
        impl VectorFunction for $name {
            type Error = Infallible;
            fn evaluate<S: Scalar>(&self, $x: &[S]) -> Result<Vec<S>, Infallible> {
                Ok(vec![$($value),+])
            }
        }
    };
}

fn squares<S: Scalar>(x: &[S]) -> S {
    x.iter().map(|x| *x * *x).sum()
}

functions!(Hs6, x, [(-x[0] + 1.0).powi(2), (x[1] - x[0] * x[0]) * 10.0]);
functions!(
    Hs35,
    x,
    [
        x[0] * -8.0 - x[1] * 6.0 - x[2] * 4.0
            + 9.0
            + x[0].powi(2) * 2.0
            + x[1].powi(2) * 2.0
            + x[2].powi(2)
            + x[0] * x[1] * 2.0
            + x[0] * x[2] * 2.0,
        x[0] + x[1] + x[2] * 2.0
    ]
);
functions!(
    Hs43,
    x,
    [
        squares(x) + x[2].powi(2) - x[0] * 5.0 - x[1] * 5.0 - x[2] * 21.0 + x[3] * 7.0,
        squares(x) + x[0] - x[1] + x[2] - x[3],
        squares(x) + x[1].powi(2) + x[3].powi(2) - x[0] - x[3],
        squares(&x[..3]) + x[0].powi(2) + x[0] * 2.0 - x[1] - x[3],
    ]
);
functions!(Hs71, x, [x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2], x[0] * x[1] * x[2] * x[3], squares(x)]);
functions!(
    Hs100,
    x,
    [
        (x[0] - 10.0).powi(2)
            + (x[1] - 12.0).powi(2) * 5.0
            + x[2].powi(4)
            + (x[3] - 11.0).powi(2) * 3.0
            + x[4].powi(6) * 10.0
            + x[5].powi(2) * 7.0
            + x[6].powi(4)
            - x[5] * x[6] * 4.0
            - x[5] * 10.0
            - x[6] * 8.0,
        x[0].powi(2) * 2.0 + x[1].powi(4) * 3.0 + x[2] + x[3].powi(2) * 4.0 + x[4] * 5.0,
        x[0] * 7.0 + x[1] * 3.0 + x[2].powi(2) * 10.0 + x[3] - x[4],
        x[0] * 23.0 + x[1].powi(2) + x[5].powi(2) * 6.0 - x[6] * 8.0,
        x[0].powi(2) * 4.0 + x[1].powi(2) - x[0] * x[1] * 3.0 + x[2].powi(2) * 2.0 + x[5] * 5.0 - x[6] * 11.0,
    ]
);
fn valley<S: Scalar>(x: &[S]) -> S {
    x.windows(2).map(|w| (w[1] - w[0].powi(2)).powi(2) * 100.0 + (w[0] - 1.0).powi(2)).sum()
}
functions!(Valley, x, [valley(x), squares(x), x.iter().copied().sum()]);
functions!(Disk, x, [x[0] + x[1] * 2.0, squares(x), x[0] + x[1]]);

/// Both methods that take constraints, with a tolerance and limits.
fn methods(optimality_tolerance: f64, limits: Limits) -> [Method; 2] {
    [
        Method::Slsqp(Slsqp { optimality_tolerance, limits, ..Slsqp::default() }),
        Method::Sqp(Sqp { optimality_tolerance, limits, ..Sqp::default() }),
    ]
}

fn tight() -> [Method; 2] {
    methods(1e-10, Limits::default())
}

/// Runs to convergence by both methods; objective, solution and multipliers as given.
fn solves<F: VectorFunction<Error = Infallible> + Clone>(
    case: Constrained<F>,
    objective: f64,
    x: &[f64],
    multipliers: &[f64],
    most: usize,
) -> Outcome {
    let [slsqp, sqp] = tight();
    solves_by(&sqp, case.clone(), objective, x, multipliers, 3 * most);
    solves_by(&slsqp, case, objective, x, multipliers, most)
}

fn solves_by<F: VectorFunction<Error = Infallible>>(
    method: &Method,
    mut case: Constrained<F>,
    objective: f64,
    x: &[f64],
    multipliers: &[f64],
    most: usize,
) -> Outcome {
    let outcome = run(method, &mut case);
    assert_eq!(outcome.status, Termination::Converged, "{}", outcome.message);
    assert_relative_eq!(
        outcome.evaluation.as_ref().unwrap().objective,
        objective,
        max_relative = 1e-8,
        epsilon = 1e-12
    );
    assert_relative_eq!(outcome.x[..], x[..], max_relative = 2e-6, epsilon = 2e-6);
    assert_relative_eq!(outcome.multipliers[..], multipliers[..], max_relative = 1e-5, epsilon = 1e-6);
    assert!(outcome.kkt_residual <= 1e-7 && outcome.violation <= 1e-9, "{outcome:?}");
    assert!(outcome.evaluations <= most, "{} evaluations", outcome.evaluations);
    assert_eq!(outcome.evaluations, case.asked.len());
    // bounds hold at every point asked for
    for point in &case.asked {
        assert!(point.iter().zip(&case.description.variable_bounds).all(|(x, b)| b.violation(*x) == 0.0));
    }
    outcome
}

#[test]
fn problems_of_hock_and_schittkowski() {
    solves(Constrained::new(Hs6, &[-1.2, 1.0], &[(0.0, 0.0)]), 0.0, &[1.0, 1.0], &[0.0], 40);
    let (third, ninth) = (1.0 / 3.0, 1.0 / 9.0);
    solves(
        Constrained::new(Hs35, &[0.5; 3], &[(-INFINITY, 3.0)]).bounded(0.0, INFINITY),
        ninth,
        &[4.0 * third, 7.0 * ninth, 4.0 * ninth],
        &[-2.0 * ninth],
        30,
    );
    solves(
        Constrained::new(Hs43, &[0.0; 4], &[(-INFINITY, 8.0), (-INFINITY, 10.0), (-INFINITY, 5.0)]),
        -44.0,
        &[0.0, 1.0, 2.0, -1.0],
        &[-1.0, 0.0, -2.0],
        40,
    );
    let outcome = solves(
        Constrained::new(Hs71, &[1.0, 5.0, 5.0, 1.0], &[(25.0, INFINITY), (40.0, 40.0)]).bounded(1.0, 5.0),
        17.014_017_289_1,
        &[1.0, 4.742_999_642_8, 3.821_149_978_95, 1.379_408_293_21],
        &[0.552_293_66, -0.161_468_57],
        30,
    );
    assert!(outcome.message.contains("c0 at its minimum 25"), "{}", outcome.message);
    // the first variable stands at its lower bound; its multiplier as other interior-point and SQP codes find it
    assert_relative_eq!(outcome.bound_multipliers[..], [1.087_871_2, 0.0, 0.0, 0.0], epsilon = 1e-5);
    assert!(outcome.message.contains("the bound of the variable x0"), "{}", outcome.message);
    solves(
        Constrained::new(
            Hs100,
            &[1.0, 2.0, 0.0, 4.0, 0.0, 1.0, 1.0],
            &[(-INFINITY, 127.0), (-INFINITY, 282.0), (-INFINITY, 196.0), (-INFINITY, 0.0)],
        ),
        680.630_057_3,
        &[2.330_499, 1.951_372, -0.477_541_4, 4.365_726, -0.624_487_0, 1.038_131, 1.594_227],
        &[-1.139_724, 0.0, 0.0, -0.368_614_3],
        80,
    );
}

#[test]
fn a_curved_valley_with_two_sided_constraints_from_an_infeasible_start() {
    for (n, sum) in [(2, (0.4, 1.5)), (10, (-1.0, 4.0)), (10, (3.0, 3.0)), (10, (6.0, 7.5))] {
        let mut case = Constrained::new(Valley, &vec![-0.7; n], &[(0.3, 6.0), sum]).bounded(-2.0, 2.0);
        let first = case.clone();
        for method in methods(5e-11, Limits::default()) {
            case = first.clone();
            let outcome = run(&method, &mut case);
            assert_eq!(outcome.status, Termination::Converged, "{n} {sum:?}: {}", outcome.message);
            // the conditions, from the evaluation itself
            let evaluation = outcome.evaluation.unwrap();
            for (k, multiplier) in outcome.multipliers.iter().enumerate() {
                let (value, bounds) = (evaluation.constraints[k], case.description.constraint_bounds[k]);
                assert!(bounds.violation(value) <= 1e-9);
                let equality = bounds.lower == bounds.upper;
                assert!(*multiplier <= 0.0 || equality || (value - bounds.lower).abs() < 1e-6);
                assert!(*multiplier >= 0.0 || equality || (value - bounds.upper).abs() < 1e-6);
            }
            for i in 0..n {
                let along: f64 = (0..2).map(|k| outcome.multipliers[k] * evaluation.jacobian[k][i]).sum();
                let inside = outcome.x[i].abs() < 2.0 - 1e-9;
                assert!(!inside || (evaluation.gradient[i] - along).abs() <= 1e-7, "{n} {sum:?}");
            }
            assert!(outcome.evaluations < 250, "{}", outcome.evaluations);
        }
    }
}

#[test]
fn multipliers_are_the_slope_of_the_optimum() {
    for method in tight() {
        let optimum = |radius2: f64| {
            let mut case = Constrained::new(Disk, &[0.1, 0.2], &[(-INFINITY, radius2), (-5.0, 5.0)]);
            let outcome = run(&method, &mut case);
            (outcome.evaluation.unwrap().objective, outcome.multipliers[0])
        };
        let (_, slope) = optimum(2.0);
        assert_relative_eq!(slope, (optimum(2.001).0 - optimum(1.999).0) / 0.002, max_relative = 1e-6);
    }
}

#[test]
fn without_constraints() {
    for method in tight() {
        let outcome = run(&method, &mut rosenbrock(8));
        assert_eq!(outcome.status, Termination::Converged, "{}", outcome.message);
        outcome.x.iter().for_each(|&x| assert_relative_eq!(x, 1.0, epsilon = 1e-6));
        let outcome = run(&method, &mut rosenbrock(2).bounded(-2.0, 0.8));
        assert_relative_eq!(outcome.x[..], [0.8, 0.64], epsilon = 1e-6);
        assert!(outcome.multipliers.is_empty());
    }
}

#[test]
fn variables_between_equal_bounds_are_fixed() {
    for method in tight() {
        let mut case = Constrained::new(Disk, &[0.1, 0.2], &[(-INFINITY, 2.0), (-5.0, 5.0)]);
        case.description.variable_bounds[0] = Bounds { lower: 0.5, upper: 0.5 };
        let outcome = run(&method, &mut case);
        assert_eq!(outcome.status, Termination::Converged, "{}", outcome.message);
        assert_relative_eq!(outcome.x[..], [0.5, -(1.75f64.sqrt())], epsilon = 1e-6);
    }
    // nothing is free: the start is judged
    let fixed = |limit: f64| Constrained::new(Disk, &[0.5, 0.5], &[(-INFINITY, limit), (-5.0, 5.0)]).bounded(0.5, 0.5);
    assert_eq!(run(&Sqp::default(), &mut fixed(1.0)).status, Termination::Converged);
    assert_eq!(run(&Sqp::default(), &mut fixed(0.1)).status, Termination::Infeasible);
}

#[test]
fn failed_analyses_are_rejected_steps() {
    for method in tight() {
        let case = || Constrained::new(Valley, &[-0.7, 0.5], &[(0.3, 6.0), (0.4, 1.5)]);
        let free = run(&method, &mut case());
        let mut hindered = case().failing(|x| (x[1] - x[0] * x[0]).abs() > 0.25);
        let outcome = run(&method, &mut hindered);
        assert!(outcome.failures > 0, "{outcome:?}");
        if method.name() == Slsqp::NAME {
            assert_eq!(outcome.status, Termination::Converged, "{}", outcome.message);
            assert!(outcome.message.contains("failed on the way"), "{}", outcome.message);
            assert_relative_eq!(outcome.x[..], free.x[..], epsilon = 1e-6);
        } else {
            // a trust region creeps up to the wall and says so
            assert!(matches!(outcome.status, Termination::Converged | Termination::Failed), "{}", outcome.message);
        }
        // a wall in front of the optimum
        let outcome = run(&method, &mut case().failing(|x| x[0] > 0.1 || x[0] < -1.0));
        if method.name() == Slsqp::NAME {
            assert_eq!(outcome.status, Termination::Failed, "{}", outcome.message);
            assert!(outcome.message.contains("the test forbids it"), "{}", outcome.message);
        }
        assert!(outcome.x[0] <= 0.1 && outcome.evaluation.is_some());
        let outcome = run(&method, &mut case().failing(|_| true));
        assert_eq!((outcome.status, outcome.evaluations), (Termination::Failed, 1));
        assert!(outcome.evaluation.is_none() && outcome.multipliers.is_empty());
    }
}

#[test]
fn an_infeasible_problem_is_reported_with_what_stands_against_what() {
    for method in tight() {
        // a disk of radius 1 and a half plane beyond it
        let mut case = Constrained::new(Disk, &[0.3, -0.4], &[(-INFINITY, 1.0), (3.0, INFINITY)]);
        let outcome = run(&method, &mut case);
        assert_eq!(outcome.status, Termination::Infeasible, "{}", outcome.message);
        assert!(outcome.message.contains("c1 is") && outcome.message.contains("the minimum 3"), "{}", outcome.message);
        assert!(outcome.violation > 0.5);
        // bounds against a constraint
        let mut case = Constrained::new(Disk, &[0.3, -0.4], &[(-INFINITY, 9.0), (3.0, 3.0)]).bounded(-1.0, 1.0);
        let outcome = run(&method, &mut case);
        assert_eq!(outcome.status, Termination::Infeasible, "{}", outcome.message);
        assert!(outcome.message.contains("bounds of variables"), "{}", outcome.message);
        assert_relative_eq!(outcome.x[..], [1.0, 1.0], epsilon = 1e-6);
        assert_relative_eq!(outcome.violation, 1.0, epsilon = 1e-6);
    }
}

#[test]
fn limits_and_observers_end_the_run_with_the_best_feasible_design() {
    let case = || Constrained::new(Hs43, &[0.0; 4], &[(-INFINITY, 8.0), (-INFINITY, 10.0), (-INFINITY, 5.0)]);
    for method in methods(1e-8, Limits { evaluations: 100, iterations: 5 }) {
        let outcome = run(&method, &mut case());
        assert_eq!((outcome.status, outcome.iterations), (Termination::IterationLimit, 5));
    }
    // the quickest method has converged after ten
    for evaluations in 1..10 {
        for method in methods(1e-8, Limits { evaluations, iterations: 100 }) {
            let mut problem = case();
            let mut seen: Vec<(f64, f64)> = vec![];
            let outcome = method
                .minimize(&mut problem, &mut |p| {
                    seen.push((p.violation, p.result.unwrap().objective));
                    ControlFlow::Continue(())
                })
                .unwrap();
            assert_eq!((outcome.status, outcome.evaluations), (Termination::EvaluationLimit, evaluations));
            let feasible = seen.iter().filter(|(v, _)| *v <= 1e-9).map(|(_, f)| *f).fold(INFINITY, f64::min);
            assert_eq!(outcome.evaluation.unwrap().objective, feasible);
        }
    }
    let stop =
        &mut |p: &Progress<'_>| if p.evaluation == 4 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
    for method in tight() {
        let outcome = method.minimize(&mut case(), stop).unwrap();
        assert_eq!((outcome.status, outcome.evaluations), (Termination::Interrupted, 4));
    }
}

#[test]
fn resumed_runs_continue_bit_for_bit() {
    for method in tight() {
        let fails: fn(&[f64]) -> bool = |x| x[0].to_bits() % 7 == 3;
        let case = || Constrained::new(Valley, &[-0.7; 6], &[(0.3, 6.0), (3.0, 3.0)]).bounded(-2.0, 2.0).failing(fails);
        let whole = run(&method, &mut case());
        assert!(whole.failures > 0 && whole.evaluations > 20, "{whole:?}");
        for k in [1, 2, 9, 17, whole.evaluations - 1] {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("checkpoint.json");
            let mut killed = Journaled::new(case()).with_checkpoints(&path, "case", Duration::ZERO);
            let stop = &mut |p: &Progress<'_>| {
                if p.evaluation == k { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            };
            method.minimize(&mut killed, stop).unwrap();
            let mut resumed = Journaled::resume(case(), Checkpoint::load(&path, "case").unwrap().journal);
            let outcome = run(&method, &mut resumed);
            assert_eq!(resumed.divergence(), None);
            assert_eq!(Outcome { seconds: 0.0, ..outcome }, Outcome { seconds: 0.0, ..whole.clone() });
            assert_eq!(resumed.into_parts().0.asked.len(), whole.evaluations - k);
        }
    }
}

#[test]
fn unfit_problems_and_settings_are_errors() {
    let attempt = |case: &mut dyn Problem, method: &dyn Optimizer| {
        method.minimize(case, &mut |_| ControlFlow::Continue(())).expect_err("unfit")
    };
    let mut case = Constrained::new(Disk, &[0.0, 0.0], &[(1.0, 0.5), (0.0, 1.0)]);
    assert!(matches!(attempt(&mut case, &Slsqp::default()), OptimizeError::EmptyConstraint { .. }));
    case.description.constraint_bounds.truncate(1);
    assert!(matches!(attempt(&mut case, &Slsqp::default()), OptimizeError::ConstraintBounds { .. }));
    let mut case = Constrained::new(Disk, &[0.0, 0.0], &[(0.0, 1.0), (0.0, 1.0)]);
    for method in [
        &Slsqp { first_step: 0.0, ..Slsqp::default() } as &dyn Optimizer,
        &Slsqp { feasibility_tolerance: f64::NAN, ..Slsqp::default() },
        &Slsqp { patience: 0, ..Slsqp::default() },
        &Sqp { radius: 0.0, ..Sqp::default() },
        &Sqp { feasibility_tolerance: -1.0, ..Sqp::default() },
    ] {
        assert!(matches!(attempt(&mut case, method), OptimizeError::Setting { .. }));
    }
}
