//! The ledger of a run: it stands between method and problem, counts, times, reports, keeps the best point and
//! enforces the limits.

use super::outcome::projected_gradient;
use super::{Limits, OptimizeError, Outcome, Progress, Status};
use crate::design::{AnalysisFailure, Bounds, Evaluation, Problem};
use nalgebra::DMatrix;
use std::ops::ControlFlow;
use std::time::Instant;

/// What ends a run from outside of the method.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Halt {
    /// No evaluation is left.
    Evaluations,
    /// The observer said so.
    Observer,
}

/// A problem that keeps the books of a run.
pub(super) struct Ledger<'a> {
    problem: &'a mut dyn Problem,
    observer: &'a mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
    limits: Limits,
    begun: Instant,
    best: Option<(Vec<f64>, Evaluation)>,
    evaluations: usize,
    failures: usize,
    hessians: usize,
    last_failure: String,
    last_failed: bool,
    halt: Option<Halt>,
    no_hessian: bool,
    /// Iterations completed; the method counts them.
    pub(super) iteration: usize,
}

impl<'a> Ledger<'a> {
    pub(super) fn new(
        problem: &'a mut dyn Problem,
        observer: &'a mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
        limits: Limits,
    ) -> Self {
        Self {
            problem,
            observer,
            limits,
            begun: Instant::now(),
            best: None,
            evaluations: 0,
            failures: 0,
            hessians: 0,
            last_failure: String::new(),
            last_failed: false,
            halt: None,
            no_hessian: false,
            iteration: 0,
        }
    }

    /// What ended the run from outside, if anything did: every further evaluation is refused.
    pub(super) fn halted(&self) -> Option<Halt> {
        self.halt
    }

    /// Whether a Hessian was asked for that the problem does not offer.
    pub(super) fn lacks_hessian(&self) -> bool {
        self.no_hessian
    }

    /// Whether the iterations are used up.
    pub(super) fn out_of_iterations(&self) -> bool {
        self.iteration >= self.limits.iterations
    }

    /// The reason of the latest failed evaluation.
    pub(super) fn last_failure(&self) -> &str {
        &self.last_failure
    }

    /// How many evaluations failed so far.
    pub(super) fn failures(&self) -> usize {
        self.failures
    }

    /// Whether the latest evaluation failed.
    pub(super) fn last_failed(&self) -> bool {
        self.last_failed
    }

    fn failed(&mut self, failure: AnalysisFailure) -> AnalysisFailure {
        self.failures += 1;
        self.last_failure.clone_from(&failure.reason);
        failure
    }

    /// Closes the books. `verdict` is the method's own reason, which a halt from outside overrides.
    pub(super) fn close(self, verdict: (Status, String)) -> Outcome {
        let (status, mut message) = match self.halt {
            Some(Halt::Evaluations) => (
                Status::EvaluationLimit,
                format!("Stopped at the limit of {} evaluations before a tolerance was met.", self.limits.evaluations),
            ),
            Some(Halt::Observer) => {
                (Status::Interrupted, format!("Interrupted after {} evaluations.", self.evaluations))
            }
            None => verdict,
        };
        if self.failures > 0 && status != Status::Failed {
            let plural = if self.failures == 1 { "analysis" } else { "analyses" };
            message += &format!(" {} {plural} failed on the way (latest: {}).", self.failures, self.last_failure);
        }
        let (x, evaluation) = match self.best {
            Some((x, evaluation)) => (x, Some(evaluation)),
            None => (self.problem.start().to_vec(), None),
        };
        let (kkt_residual, gradient_norm) = match &evaluation {
            Some(evaluation) => norms(&x, &evaluation.gradient, self.problem.variable_bounds()),
            None => (f64::NAN, f64::NAN),
        };
        Outcome {
            status,
            message,
            x,
            evaluation,
            evaluations: self.evaluations,
            failures: self.failures,
            hessians: self.hessians,
            iterations: self.iteration,
            kkt_residual,
            gradient_norm,
            seconds: self.begun.elapsed().as_secs_f64(),
        }
    }

    /// The error to return instead of an outcome, if the problem turned out to be unfit.
    pub(super) fn unfit(&self, method: &'static str) -> Option<OptimizeError> {
        self.no_hessian.then_some(OptimizeError::NoHessian { method })
    }
}

/// Largest entry and Euclidean norm of the projected gradient.
fn norms(x: &[f64], gradient: &[f64], bounds: &[Bounds]) -> (f64, f64) {
    let (largest, squares) =
        projected_gradient(x, gradient, bounds).fold((0.0, 0.0), |(l, s): (f64, f64), g| (l.max(g.abs()), s + g * g));
    (largest, squares.sqrt())
}

/// An evaluation that an optimiser can use, or the reason why not.
fn usable(evaluation: Evaluation, n: usize) -> Result<Evaluation, AnalysisFailure> {
    let complaint = if evaluation.gradient.len() != n {
        Some(format!("the gradient has {} entries for {n} variables", evaluation.gradient.len()))
    } else if !evaluation.objective.is_finite() {
        Some(format!("the objective is {}", evaluation.objective))
    } else {
        let bad = evaluation.gradient.iter().position(|g| !g.is_finite());
        bad.map(|i| format!("entry {i} of the gradient is {}", evaluation.gradient[i]))
    };
    complaint.map_or(Ok(evaluation), |reason| Err(AnalysisFailure { reason }))
}

impl Problem for Ledger<'_> {
    fn variable_names(&self) -> &[String] {
        self.problem.variable_names()
    }

    fn start(&self) -> &[f64] {
        self.problem.start()
    }

    fn variable_bounds(&self) -> &[Bounds] {
        self.problem.variable_bounds()
    }

    fn constraint_names(&self) -> &[String] {
        self.problem.constraint_names()
    }

    fn constraint_bounds(&self) -> &[Bounds] {
        self.problem.constraint_bounds()
    }

    fn value_names(&self) -> &[String] {
        self.problem.value_names()
    }

    fn evaluate(&mut self, x: &[f64]) -> Result<Evaluation, AnalysisFailure> {
        if self.evaluations >= self.limits.evaluations {
            self.halt.get_or_insert(Halt::Evaluations);
        }
        if self.halt.is_some() {
            return Err(AnalysisFailure { reason: "the run has ended".into() });
        }
        self.evaluations += 1;
        let result = self.problem.evaluate(x).and_then(|evaluation| usable(evaluation, x.len()));
        let result = result.map_err(|failure| self.failed(failure));

        self.last_failed = result.is_err();
        let step = self.best.as_ref().map_or(0.0, |(best, _)| distance(best, x));
        if let Ok(evaluation) = &result
            && self.best.as_ref().is_none_or(|(_, best)| evaluation.objective < best.objective)
        {
            self.best = Some((x.to_vec(), evaluation.clone()));
        }
        let (violation, gradient_norm) = match &result {
            Ok(evaluation) => {
                let bounds = self.problem.constraint_bounds();
                let violations = evaluation.constraints.iter().zip(bounds).map(|(&c, b)| b.violation(c));
                let (_, norm) = norms(x, &evaluation.gradient, self.problem.variable_bounds());
                (violations.fold(0.0, f64::max), norm)
            }
            Err(_) => (f64::NAN, f64::NAN),
        };
        let progress = Progress {
            evaluation: self.evaluations,
            iteration: self.iteration,
            x,
            result: result.as_ref(),
            best_objective: self.best.as_ref().map_or(f64::INFINITY, |(_, best)| best.objective),
            violation,
            gradient_norm,
            step,
            seconds: self.begun.elapsed().as_secs_f64(),
            evaluation_limit: self.limits.evaluations,
        };
        if (self.observer)(&progress).is_break() {
            self.halt = Some(Halt::Observer);
        }
        result
    }

    fn hessian(&mut self, x: &[f64]) -> Option<Result<DMatrix<f64>, AnalysisFailure>> {
        let Some(result) = self.problem.hessian(x) else {
            self.no_hessian = true;
            return None;
        };
        self.hessians += 1;
        let n = x.len();
        let result = result.and_then(|hessian| {
            if hessian.shape() != (n, n) {
                let reason = format!("the Hessian is {} × {} for {n} variables", hessian.nrows(), hessian.ncols());
                return Err(AnalysisFailure { reason });
            }
            if !hessian.iter().all(|h| h.is_finite()) {
                return Err(AnalysisFailure { reason: "the Hessian has entries that are not finite".into() });
            }
            Ok(hessian)
        });
        Some(result.inspect_err(|failure| self.last_failure.clone_from(&failure.reason)))
    }

    fn metric(&mut self, x: &[f64]) -> Option<DMatrix<f64>> {
        let fits = |m: &DMatrix<f64>| m.shape() == (x.len(), x.len()) && m.iter().all(|v| v.is_finite());
        self.problem.metric(x).filter(fits)
    }
}

/// Euclidean distance of two points.
pub(super) fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

/// Euclidean norm.
pub(super) fn norm(v: &[f64]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Scalar product.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
