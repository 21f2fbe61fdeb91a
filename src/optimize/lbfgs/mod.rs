//! L-BFGS: `argmin` drives, this module supplies what it lacks.
//!
//! `argmin` asks for cost and gradient separately, takes every step for a good one, measures progress in absolute
//! terms and gives up for good when a line search fails. Here one evaluation serves both calls, the line search is
//! [`WolfeLineSearch`], the objective is scaled so that the very first step has a chosen length, the stopping criteria
//! are relative, and a failed line search restarts the method from the best point with an empty memory as long as that
//! leads anywhere.

mod line_search;
mod run;
mod settings;

pub use settings::Lbfgs;

use super::optimizer::Optimizer;
use super::outcome::{OptimizeError, Outcome, Progress, Termination};
use crate::design::Problem;
use argmin::core::Executor;
use argmin::solver::quasinewton::LBFGS;
use line_search::WolfeLineSearch;
use run::{ArgminProblem, LbfgsRun, Supervised};
use std::cell::RefCell;
use std::ops::ControlFlow;

impl Optimizer for Lbfgs {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn minimize(
        &self,
        problem: &mut dyn Problem,
        observer: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
    ) -> Result<Outcome, OptimizeError> {
        Self::SCOPE.check(problem, self.limits, &self.settings())?;
        let run = RefCell::new(LbfgsRun::new(*self, problem, observer));
        let verdict = drive(&run);
        Ok(run.into_inner().problem.into_inner().close(verdict))
    }
}

/// Runs `argmin` leg by leg, each from the point reached with an empty memory, until there is a reason to stop.
fn drive(run: &RefCell<LbfgsRun<'_>>) -> (Termination, String) {
    if let Err(verdict) = run.borrow_mut().begin() {
        return verdict;
    }
    loop {
        let (x, gradient, cost) = run.borrow_mut().begin_leg();
        if let Some(verdict) = run.borrow_mut().verdict.take() {
            return verdict;
        }
        let solver = Supervised { run, lbfgs: LBFGS::new(WolfeLineSearch::default(), run.borrow().settings.memory) };
        let ended = Executor::new(ArgminProblem(run), solver)
            .configure(|state| state.param(x).gradient(gradient).cost(cost))
            .ctrlc(false)
            .run();
        let mut run = run.borrow_mut();
        if let Some(verdict) = run.verdict.take() {
            return verdict;
        }
        if run.problem.inner().halted().is_some() {
            // the ledger words it
            return (Termination::Interrupted, String::new());
        }
        // a line search failed; the memory may be to blame unless a new one led nowhere either
        if ended.is_err() || !run.leg_gained() {
            return run.stuck();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testcases::*;
    use super::*;
    use crate::design::Bounds;
    use crate::optimize::Limits;
    use approx::assert_relative_eq;

    fn at_ones(outcome: &Outcome, tolerance: f64) {
        outcome.x.iter().for_each(|&x| assert_relative_eq!(x, 1.0, epsilon = tolerance));
    }

    #[test]
    fn curved_valley() {
        for (n, most) in [(2, 60), (32, 250)] {
            let mut case = rosenbrock(n);
            let outcome = run(&Lbfgs::default(), &mut case);
            assert_eq!(outcome.status, Termination::Converged, "{}", outcome.message);
            assert_eq!(outcome.evaluations, case.asked.len());
            assert!(outcome.evaluations <= most, "{n} variables: {} evaluations", outcome.evaluations);
            at_ones(&outcome, 1e-6);
        }
    }

    #[test]
    fn ill_conditioned_and_tiny() {
        // objective about 1e-2 at the start, 4e-7 at the end
        let outcome = run(&Lbfgs::default(), &mut quadratic(32, 1e8, 1e-10, 4e-7));
        assert_eq!(outcome.status, Termination::Converged, "{}", outcome.message);
        assert!(outcome.evaluation.unwrap().objective - 4e-7 < 1e-13);
        assert!(outcome.evaluations <= 300, "{}", outcome.evaluations);
    }

    #[test]
    fn path_does_not_depend_on_the_size_of_the_objective() {
        let runs = [1.0, 2.0_f64.powi(-60), 2.0_f64.powi(40)].map(|size| {
            let mut case = quadratic(8, 1e4, size, 0.0);
            let outcome = run(&Lbfgs::default(), &mut case);
            (outcome.x, outcome.evaluations)
        });
        assert_eq!(runs[0], runs[1]);
        assert_eq!(runs[0], runs[2]);
    }

    #[test]
    fn shape_match_reaches_the_optimum() {
        let mut case = shape_match();
        let mut first_good = None;
        let outcome = Lbfgs::default()
            .minimize(&mut case, &mut |p| {
                if p.best_objective <= 4e-7 {
                    first_good.get_or_insert(p.evaluation);
                }
                ControlFlow::Continue(())
            })
            .unwrap();
        assert_eq!(outcome.status, Termination::Converged, "{}", outcome.message);
        // Newton finds 1.342566e-7
        let objective = outcome.evaluation.unwrap().objective;
        assert!(objective < 1.3426e-7, "{objective:e}");
        // NLopt 2.11 LD_LBFGS on the same problem: 56 to 4e-7, stops after 192 at 1.34498e-7
        assert!(first_good.unwrap() <= 65, "{first_good:?}");
        assert!(outcome.evaluations <= 300, "{}", outcome.evaluations);
        // each point is evaluated once
        let mut points: Vec<Vec<u64>> = case.asked.iter().map(|x| x.iter().map(|v| v.to_bits()).collect()).collect();
        points.sort();
        points.dedup();
        assert_eq!(points.len(), outcome.evaluations);
    }

    #[test]
    fn failed_analyses_are_rejected_steps() {
        let mut case = rosenbrock(2).failing(|x| (x[1] - x[0] * x[0]).abs() > 0.6);
        let outcome = run(&Lbfgs { first_step: 5.0, ..Lbfgs::default() }, &mut case);
        assert_eq!(outcome.status, Termination::Converged, "{}", outcome.message);
        assert!(outcome.failures > 0);
        assert!(outcome.message.contains("failed on the way (latest: the test forbids it)"), "{}", outcome.message);
        at_ones(&outcome, 1e-6);
    }

    #[test]
    fn minimum_behind_a_failing_region() {
        // the analysis ends at x0 = 0.5, the minimum is at 1
        let mut case = quadratic(3, 10.0, 1.0, 0.0).failing(|x| x[0] > 0.5);
        let outcome = run(&Lbfgs::default(), &mut case);
        assert_eq!(outcome.status, Termination::Failed, "{}", outcome.message);
        assert!(outcome.x[0] > 0.49 && outcome.x[0] <= 0.5);
        assert!(outcome.evaluations < 150, "{}", outcome.evaluations);
    }

    #[test]
    fn failing_start() {
        let mut case = rosenbrock(2).failing(|_| true);
        let outcome = run(&Lbfgs::default(), &mut case);
        assert_eq!((outcome.status, outcome.evaluations, outcome.failures), (Termination::Failed, 1, 1));
        assert_eq!(outcome.message, "The analysis fails at the start: the test forbids it.");
        assert!(outcome.evaluation.is_none() && outcome.x == case.description.start && outcome.kkt_residual.is_nan());
    }

    #[test]
    fn active_bounds() {
        // the free minimum is outside of the box in every variable
        for (lower, upper) in [(-0.5, 0.8), (f64::NEG_INFINITY, 0.8), (1.5, f64::INFINITY), (0.5, 3.0)] {
            let mut case = quadratic(5, 100.0, 1.0, 0.0).bounded(lower, upper);
            let outcome = run(&Lbfgs::default(), &mut case);
            assert_eq!(outcome.status, Termination::Converged, "{}", outcome.message);
            assert!(outcome.kkt_residual < 1e-5, "{lower} {upper}: {:e}", outcome.kkt_residual);
            for x in case.asked.iter().flatten() {
                assert!((lower..=upper).contains(x));
            }
        }
    }

    #[test]
    fn limits_and_observers_end_the_run() {
        let limits = Limits { evaluations: 7, ..Limits::default() };
        let outcome = run(&Lbfgs { limits, ..Lbfgs::default() }, &mut rosenbrock(2));
        assert_eq!((outcome.status, outcome.evaluations), (Termination::EvaluationLimit, 7));
        let limits = Limits { iterations: 5, ..Limits::default() };
        let outcome = run(&Lbfgs { limits, ..Lbfgs::default() }, &mut rosenbrock(2));
        assert_eq!((outcome.status, outcome.iterations), (Termination::IterationLimit, 5));
        for stop in [1, 2, 9] {
            let mut best = f64::INFINITY;
            let outcome = Lbfgs::default()
                .minimize(&mut rosenbrock(2), &mut |p| {
                    best = best.min(p.result.unwrap().objective);
                    if p.evaluation == stop { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                })
                .unwrap();
            assert_eq!((outcome.status, outcome.evaluations), (Termination::Interrupted, stop));
            assert_eq!(outcome.evaluation.unwrap().objective, best);
        }
    }

    #[test]
    fn start_at_the_minimum() {
        let mut case = rosenbrock(4);
        case.description.start = vec![1.0; 4];
        let outcome = run(&Lbfgs::default(), &mut case);
        assert_eq!((outcome.status, outcome.evaluations), (Termination::Converged, 1));
        assert_eq!(outcome.message, "Converged: the gradient vanishes.");
    }

    #[test]
    fn stalls_at_round_off() {
        // no tolerance can be met, the end is where slopes are noise
        let method = Lbfgs { objective_tolerance: 0.0, gradient_tolerance: 0.0, ..Lbfgs::default() };
        let outcome = run(&method, &mut quadratic(6, 1e3, 1.0, 1.0));
        assert!(matches!(outcome.status, Termination::Stalled | Termination::Converged), "{}", outcome.message);
        assert!(outcome.message.contains("gradient"), "{}", outcome.message);
        at_ones(&outcome, 1e-6);
    }

    #[test]
    fn unfit_problems_are_refused() {
        let refuse = |method: Lbfgs, case: &mut dyn Problem| {
            method.minimize(case, &mut |_| ControlFlow::Continue(())).unwrap_err()
        };
        let mut case = rosenbrock(2);
        case.description.constraint_names = vec!["area".into()];
        case.description.constraint_bounds = vec![Bounds::FREE];
        let error = refuse(Lbfgs::default(), &mut case);
        assert_eq!(error, OptimizeError::ConstraintsNotSupported { method: "lbfgs", count: 1, first: "area".into() });
        let error = refuse(Lbfgs::default(), &mut rosenbrock(2).bounded(2.0, 1.0));
        assert!(matches!(error, OptimizeError::EmptyBounds { lower: 2.0, upper: 1.0, .. }));
        let mut case = rosenbrock(2);
        case.description.start[1] = f64::NAN;
        assert!(matches!(refuse(Lbfgs::default(), &mut case), OptimizeError::Start { .. }));
        case.description.start.pop();
        assert!(matches!(refuse(Lbfgs::default(), &mut case), OptimizeError::Length { variables: 2, found: 1, .. }));
        let error = refuse(Lbfgs { memory: 0, ..Lbfgs::default() }, &mut rosenbrock(2));
        assert!(matches!(error, OptimizeError::Setting { setting: "memory", .. }));
    }
}
