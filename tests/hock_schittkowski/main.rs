//! Problems of the collection of W. Hock and K. Schittkowski (Test Examples for Nonlinear Programming Codes, Lecture
//! Notes in Economics and Mathematical Systems 187, Springer 1981), numbered as there, with the printed solutions.

mod collection;
mod equalities;
mod large;
mod medium;
mod small;

use aeroform::design::Problem;
use aeroform::optimize::{Limits, Optimizer, Outcome, Sqp, Termination};
use collection::Entry;
use std::ops::ControlFlow;

fn all() -> Vec<Entry> {
    [small::problems(), medium::problems(), equalities::problems(), large::problems()].into_iter().flatten().collect()
}

fn solve(problem: &mut dyn Problem) -> Outcome {
    let method = Sqp { limits: Limits { evaluations: 500, iterations: usize::MAX }, ..Sqp::default() };
    method.minimize(problem, &mut |_| ControlFlow::Continue(())).expect("a problem that suits the method")
}

fn objective(outcome: &Outcome) -> f64 {
    outcome.evaluation.as_ref().map_or(f64::NAN, |e| e.objective)
}
