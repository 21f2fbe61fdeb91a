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

#[test]
fn every_standard_start_leads_to_the_solution() {
    let problems = all();
    assert!(problems.len() >= 60, "{}", problems.len());
    let mut total = 0;
    for entry in &problems {
        let outcome = solve(&mut entry.problem(&entry.start));
        let found = objective(&outcome);
        assert_eq!(outcome.status, Termination::Converged, "problem {}: {}", entry.number, outcome.message);
        assert!(entry.knows(found), "problem {}: {found} instead of {}", entry.number, entry.optimum);
        assert!(outcome.violation <= 1e-9 && outcome.kkt_residual <= 1e-6, "problem {}", entry.number);
        total += outcome.evaluations;
    }
    assert!(total <= 1700, "{total} evaluations");
}

/// Two dozen problems of all kinds.
const SOME: [usize; 24] =
    [5, 6, 7, 12, 14, 18, 22, 28, 29, 30, 31, 35, 39, 40, 43, 48, 53, 60, 63, 65, 71, 76, 78, 100];

fn some() -> Vec<Entry> {
    all().into_iter().filter(|entry| SOME.contains(&entry.number)).collect()
}

#[test]
fn two_dozen_problems_take_few_evaluations() {
    let total: usize = some().iter().map(|entry| solve(&mut entry.problem(&entry.start)).evaluations).sum();
    assert_eq!(some().len(), 24);
    assert!(total <= 330, "{total} evaluations");
}

/// Numbers between −1 and 1, always the same ones.
fn numbers() -> impl FnMut() -> f64 {
    let mut seed = 99_u64;
    move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

#[test]
fn random_starts_lead_there_too() {
    let mut number = numbers();
    let mut missed = Vec::new();
    for entry in &some() {
        for _ in 0..4 {
            let places = entry.start.iter().zip(&entry.bounds);
            let start: Vec<f64> =
                places.map(|(x, b)| (x + 0.5 * number() * x.abs().max(1.0)).clamp(b.0, b.1)).collect();
            let outcome = solve(&mut entry.problem(&start));
            if outcome.status != Termination::Converged || !entry.knows(objective(&outcome)) {
                missed.push((entry.number, start, objective(&outcome)));
            }
        }
    }
    assert!(missed.len() <= 1, "{missed:?}");
}

#[test]
fn scales_of_objective_and_variables_make_no_difference() {
    for entry in some().iter().filter(|entry| entry.start.iter().any(|x| *x != 0.0)) {
        let plain = solve(&mut entry.problem(&entry.start));
        for (objective_scale, variable_scale) in [(1e-4, 1.0), (1e4, 1.0), (1.0, 1e-4), (1.0, 1e4), (1e4, 1e-4)] {
            let scaled = solve(&mut entry.problem(&entry.start).scaled(objective_scale, variable_scale));
            let place = format!("problem {}, scales {objective_scale} and {variable_scale}", entry.number);
            assert_eq!(scaled.status, Termination::Converged, "{place}: {}", scaled.message);
            assert!(entry.knows(objective(&scaled) / objective_scale), "{place}");
            let (most, least) = (1.2 * plain.evaluations as f64, plain.evaluations as f64 / 1.2);
            let count = scaled.evaluations as f64;
            assert!(count <= most.ceil() && count >= least.floor(), "{place}: {count} for {}", plain.evaluations);
        }
    }
}
