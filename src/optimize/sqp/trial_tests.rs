//! When a step is tried a second time, with the curvature of the constraints taken into account.

use super::*;
use crate::differentiate::VectorFunction;
use crate::optimize::Limits;
use crate::optimize::sqp::{Sqp, begin};
use crate::optimize::testcases::Constrained;
use crate::scalar::Scalar;
use std::convert::Infallible;
use std::ops::ControlFlow;

/// `−x + wall x⁴` on the curve `y = bend x²`, from the origin.
#[derive(Clone)]
struct OnCurve {
    bend: f64,
    wall: f64,
}

impl VectorFunction for OnCurve {
    type Error = Infallible;
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, Infallible> {
        Ok(vec![x[0].powi(4) * self.wall - x[0], x[1] - x[0] * x[0] * self.bend])
    }
}

/// The end of the first attempt, how many points it asked for, and the last of them.
fn first_attempt(function: OnCurve, fails: fn(&[f64]) -> bool) -> (Trial, Vec<Vec<f64>>) {
    let mut problem = Constrained::new(function, &[0.0, 0.0], &[(0.0, 0.0)]).failing(fails);
    let mut observer = |_: &crate::optimize::Progress<'_>| ControlFlow::Continue(());
    let mut ledger = Ledger::new(&mut problem, &mut observer, Limits::default());
    let Ok(mut run) = begin(&mut ledger, &Sqp::default()) else { panic!("no start") };
    run.funnel = 0.3;
    let proposal = run.propose().unwrap();
    let trial = attempt(&mut ledger, &run, &proposal);
    drop(ledger);
    (trial, problem.asked.split_off(1))
}

#[test]
fn a_step_that_only_the_constraint_spoilt_is_corrected() {
    let (_, asked) = first_attempt(OnCurve { bend: 0.8, wall: 0.0 }, |_| false);
    assert_eq!(asked.len(), 2);
    // the first point follows the tangent, the second makes up for what that missed
    let off = |x: &[f64]| (x[1] - 0.8 * x[0] * x[0]).abs();
    assert!(asked[0][1].abs() < 1e-6 && off(&asked[0]) > 0.3, "{asked:?}");
    assert!((asked[1][1] - off(&asked[0])).abs() < 1e-9 && asked[1][0] > 0.1, "{asked:?}");
}

#[test]
fn a_step_that_the_objective_spoilt_is_not() {
    // uphill by the wall, whatever the constraint does
    let (trial, asked) = first_attempt(OnCurve { bend: 0.8, wall: 10.0 }, |_| false);
    assert!(matches!(trial, Trial::Rejected(..)) && asked.len() == 1, "{asked:?}");
    let (trial, asked) = first_attempt(OnCurve { bend: 0.0, wall: 10.0 }, |_| false);
    assert!(matches!(trial, Trial::Rejected(..)) && asked.len() == 1, "{asked:?}");
    // and a step that is good is taken at once
    let (trial, asked) = first_attempt(OnCurve { bend: 0.0, wall: 0.0 }, |_| false);
    assert!(matches!(trial, Trial::Accepted(..)) && asked.len() == 1, "{asked:?}");
}

#[test]
fn a_correction_without_analysis_leaves_the_first_point_to_learn_from() {
    let (trial, asked) = first_attempt(OnCurve { bend: 0.8, wall: 0.0 }, |x| x[1] > 0.01);
    let Trial::Rejected(x, evaluation) = trial else { panic!("not refused") };
    assert_eq!((asked.len(), &x), (2, &asked[0]));
    assert!((evaluation.objective + x[0]).abs() < 1e-15);
    let (trial, asked) = first_attempt(OnCurve { bend: 0.8, wall: 0.0 }, |x| x[0] > 0.1);
    assert!(matches!(trial, Trial::Failed) && asked.len() == 1);
}

#[test]
fn a_row_whose_gradient_was_steep_once_is_still_measured_in_its_own_unit() {
    let mut problem = Constrained::new(OnCurve { bend: 0.8, wall: 0.0 }, &[0.0, 0.0], &[(0.0, 0.0)]);
    let mut observer = |_: &crate::optimize::Progress<'_>| ControlFlow::Continue(());
    let mut ledger = Ledger::new(&mut problem, &mut observer, Limits::default());
    let Ok(mut run) = begin(&mut ledger, &Sqp::default()) else { panic!("no start") };
    let here = run.point.evaluation.clone();
    let off_by = |value: f64, gradient: f64| Evaluation {
        constraints: vec![value],
        jacobian: vec![vec![0.0, gradient]],
        ..here.clone()
    };
    (run.funnel, run.reach) = (0.03, 0.3);
    assert!(run.admits(&off_by(0.02, 1.0)) && !run.admits(&off_by(0.04, 1.0)));
    // rows measured by a steep gradient, as the funnel has them, fall short of nearly nothing far from their bounds
    let steep = off_by(0.0, 1e4);
    run.rows.iter_mut().for_each(|row| row.rescale(&run.frame, &steep));
    assert!(run.short(&off_by(5.0, 1.0)) < 0.03 && !run.admits(&off_by(5.0, 1.0)));
    assert!(run.admits(&off_by(0.2, 1.0)));
    // no step is refused that leads towards the bound
    run.point.evaluation = off_by(6.0, 1.0);
    assert!(run.admits(&off_by(5.0, 1.0)));
}
