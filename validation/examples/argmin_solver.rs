//! A solver of `argmin` on a design problem of the crate.
//!
//! The built-in case `l2-match` fits the shape of one section to another by a free-form deformation box. Its problem is
//! handed to BFGS of `argmin` by the adapter `ArgminProblem`, and the answer is compared with that of the crate's own
//! method.
//!
//! `cargo run --example argmin_solver`

use aeroform::case::Case;
use aeroform::design::Problem;
use aeroform::optimize::{ArgminProblem, Optimizer};
use argmin::core::{Executor, State, TerminationStatus};
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::quasinewton::BFGS;
use std::ops::ControlFlow;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let case = Case::open("l2-match")?;
    let n = case.problem.description().start.len();
    println!("{}: {} variables; {}", case.name, n, case.description);

    let problem = ArgminProblem::new(case.problem.clone())?;
    let identity: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| if i == j { 1.0 } else { 0.0 }).collect()).collect();
    let solver = BFGS::new(MoreThuenteLineSearch::new()).with_tolerance_grad(1e-7)?;
    let result = Executor::new(&problem, solver)
        .configure(|state| state.param(problem.start()).inv_hessian(identity).max_iters(1000))
        .run()?;
    let state = result.state();
    let reason = match state.get_termination_status() {
        TerminationStatus::Terminated(reason) => reason.text().to_string(),
        TerminationStatus::NotTerminated => "not ended".into(),
    };
    let evaluations = problem.evaluations();
    println!("argmin BFGS:  objective {:.4e} after {evaluations} evaluations ({reason})", state.get_best_cost());

    let own = case.run(&mut |_| ControlFlow::Continue(()))?;
    let objective = own.outcome.evaluation.map_or(f64::NAN, |evaluation| evaluation.objective);
    println!(
        "crate's {}: objective {objective:.4e} after {} evaluations",
        Optimizer::name(&case.method),
        own.outcome.evaluations
    );
    Ok(())
}
