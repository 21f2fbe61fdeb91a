//! A solver of `argmin` on a design problem of the crate.
//!
//! The built-in case `l2-match` fits the shape of one section to another by a free-form deformation box. Its problem is
//! handed to BFGS of `argmin` by an adapter of a few lines, and the answer is compared with that of the crate's own
//! method.
//!
//! `cargo run --example argmin_solver`

use aeroform::case::Case;
use aeroform::design::{DesignProblem, Evaluation, Problem};
use aeroform::optimize::Optimizer;
use argmin::core::{CostFunction, Error, Executor, Gradient, State, TerminationStatus};
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::quasinewton::BFGS;
use std::cell::RefCell;
use std::ops::ControlFlow;

/// A problem of the crate for `argmin`, which asks for cost and gradient one after the other.
struct Adapter {
    problem: RefCell<DesignProblem>,
    /// The last point and what was found there.
    last: RefCell<Option<(Vec<f64>, Evaluation)>>,
    evaluations: RefCell<usize>,
}

impl Adapter {
    fn new(problem: DesignProblem) -> Self {
        Self { problem: RefCell::new(problem), last: RefCell::default(), evaluations: RefCell::default() }
    }

    /// `part` of the evaluation at a point; a point asked for again is not evaluated again.
    fn at<T>(&self, x: &[f64], part: impl Fn(&Evaluation) -> T) -> Result<T, Error> {
        let mut last = self.last.borrow_mut();
        if let Some((known, evaluation)) = &*last
            && known == x
        {
            return Ok(part(evaluation));
        }
        *self.evaluations.borrow_mut() += 1;
        let evaluation = self.problem.borrow_mut().evaluate(x)?;
        let result = part(&evaluation);
        *last = Some((x.to_vec(), evaluation));
        Ok(result)
    }
}

impl CostFunction for &Adapter {
    type Param = Vec<f64>;
    type Output = f64;
    fn cost(&self, x: &Self::Param) -> Result<f64, Error> {
        self.at(x, |evaluation| evaluation.objective)
    }
}

impl Gradient for &Adapter {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;
    fn gradient(&self, x: &Self::Param) -> Result<Vec<f64>, Error> {
        self.at(x, |evaluation| evaluation.gradient.clone())
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let case = Case::open("l2-match")?;
    let start = case.problem.description().start.clone();
    let n = start.len();
    println!("{}: {} variables; {}", case.name, n, case.description);

    let adapter = Adapter::new(case.problem.clone());
    let identity: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| if i == j { 1.0 } else { 0.0 }).collect()).collect();
    let solver = BFGS::new(MoreThuenteLineSearch::new()).with_tolerance_grad(1e-7)?;
    let result = Executor::new(&adapter, solver)
        .configure(|state| state.param(start).inv_hessian(identity).max_iters(1000))
        .run()?;
    let state = result.state();
    let reason = match state.get_termination_status() {
        TerminationStatus::Terminated(reason) => reason.text().to_string(),
        TerminationStatus::NotTerminated => "not ended".into(),
    };
    let evaluations = *adapter.evaluations.borrow();
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
