//! The ledger of a run: it stands between method and problem, counts, times, reports, keeps the best point and
//! enforces the limits.

use super::kkt::{Iterate, Optimality, optimality};
use super::optimizer::Limits;
use super::outcome::{OptimizeError, Outcome, Progress, Termination};
use super::trend::{Trend, standing};
use super::vector::distance;
use crate::design::{AnalysisFailure, Evaluation, Problem, ProblemDescription, ValueAndGradient};
use nalgebra::DMatrix;
use std::ops::ControlFlow;
use std::time::Instant;

/// The refusal of an evaluation after the run has ended.
#[derive(Debug, thiserror::Error)]
#[error("the run has ended")]
pub(super) struct Halted;

/// The event outside of the method that ends a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Halt {
    /// No evaluation is left.
    Evaluations,
    /// The observer said so.
    Observer,
}

/// Natural step of a variable over the largest, at least, where the start of a run is all that is known.
const LEAST_STEP: f64 = 0.3;

/// A problem that keeps the books of a run.
pub(super) struct Ledger<'a> {
    problem: &'a mut dyn Problem,
    observer: &'a mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
    limits: Limits,
    /// Largest violation of a constraint that counts as none.
    feasibility: f64,
    /// Natural steps of the variables, where the method wants optimality relative to the objective.
    steps: Option<Vec<f64>>,
    /// Magnitude of the objective and of its gradient at the start.
    first: (f64, f64),
    begun: Instant,
    best: Option<(Vec<f64>, Evaluation)>,
    trend: Trend,
    evaluations: usize,
    failures: usize,
    hessians: usize,
    last_failure: String,
    last_failed: bool,
    halt: Option<Halt>,
    no_hessian: bool,
    no_squares: bool,
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
            feasibility: 0.0,
            steps: None,
            first: (0.0, 0.0),
            begun: Instant::now(),
            best: None,
            trend: Trend::default(),
            evaluations: 0,
            failures: 0,
            hessians: 0,
            last_failure: String::new(),
            last_failed: false,
            halt: None,
            no_hessian: false,
            no_squares: false,
            iteration: 0,
        }
    }

    /// Counts constraints as met that are violated by `feasibility` at most.
    pub(super) fn feasible_within(mut self, feasibility: f64) -> Self {
        self.feasibility = feasibility;
        self
    }

    /// Measures optimality relative to the objective, and variables in natural steps; where the problem knows none, they
    /// are the entries of its start, small ones as the third of the largest, or 1 if it starts at the origin.
    pub(super) fn measured(mut self) -> Self {
        self.steps = self.natural_steps().or_else(|| {
            let start = &self.description().start;
            let largest = start.iter().fold(0.0, |l: f64, x| l.max(x.abs()));
            let step = |x: &f64| if largest > 0.0 { x.abs().max(LEAST_STEP * largest) } else { 1.0 };
            Some(start.iter().map(step).collect())
        });
        self
    }

    /// The KKT residual that counts as one: a hundredth of a natural step would then change the objective by as much as
    /// itself. No more than a thousand times the gradient, and no less than a ten-thousandth of the unit at the start. It
    /// is 1 for methods that do not ask for a relative measure.
    pub(super) fn unit(&self, evaluation: &Evaluation) -> f64 {
        if self.steps.is_none() {
            return 1.0;
        }
        let (size, slope) = self.size_and_slope(evaluation);
        let floor = 1e-4 * (100.0 * self.first.0).max(self.first.1);
        (100.0 * size).min(1e3 * slope.max(1e-2 * self.first.1)).max(floor).max(f64::MIN_POSITIVE)
    }

    /// Magnitude of the objective, and the largest entry of its gradient by natural steps.
    fn size_and_slope(&self, evaluation: &Evaluation) -> (f64, f64) {
        let slope = |(k, g): (usize, &f64)| g.abs() * self.steps.as_ref().map_or(1.0, |steps| steps[k]);
        let steepest = evaluation.gradient.iter().enumerate().map(slope).fold(0.0, f64::max);
        (evaluation.objective.abs(), steepest)
    }

    /// The KKT residual of a point, relative where the method asked for that.
    pub(super) fn residual(&self, point: &Iterate) -> f64 {
        point.optimality.residual / self.unit(&point.evaluation)
    }

    /// The point that a run which ends at `point` hands out: the best so far, which is the lowest objective among the
    /// feasible ones, and the least violation before there are any.
    pub(super) fn handed_out(&self, point: &Iterate) -> Iterate {
        match &self.best {
            Some((x, evaluation)) if *x != point.x => Iterate::new(self, x, evaluation.clone()),
            _ => point.clone(),
        }
    }

    /// Declares a point the best whatever came before.
    pub(super) fn settle_on(&mut self, x: &[f64], evaluation: &Evaluation) {
        self.best = Some((x.to_vec(), evaluation.clone()));
    }

    fn improves(&self, evaluation: &Evaluation) -> bool {
        let Some((_, best)) = &self.best else { return true };
        let excess = |e: &Evaluation| {
            let violation = e.violation(&self.problem.description().constraint_bounds);
            if violation <= self.feasibility { 0.0 } else { violation }
        };
        let (new, old) = (excess(evaluation), excess(best));
        new < old || (new == old && evaluation.objective < best.objective)
    }

    /// The event outside of the method that ended the run, if there was one: every further evaluation is refused.
    pub(super) fn halted(&self) -> Option<Halt> {
        self.halt
    }

    /// Whether a Hessian was asked for that the problem does not offer.
    pub(super) fn lacks_hessian(&self) -> bool {
        self.no_hessian
    }

    /// Whether a Gauss-Newton matrix was asked for of an objective that is no sum of squares.
    pub(super) fn lacks_squares(&self) -> bool {
        self.no_squares
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
    pub(super) fn close(self, verdict: (Termination, String)) -> Outcome {
        let (status, mut message) = match self.halt {
            Some(Halt::Evaluations) => (
                Termination::EvaluationLimit,
                format!("Stopped at the limit of {} evaluations before a tolerance was met.", self.limits.evaluations),
            ),
            Some(Halt::Observer) => {
                (Termination::Interrupted, format!("Interrupted after {} evaluations.", self.evaluations))
            }
            None => verdict,
        };
        let (x, evaluation) = match &self.best {
            Some((x, evaluation)) => (x.clone(), Some(evaluation.clone())),
            None => (self.problem.description().start.clone(), None),
        };
        let (optimality, unit, violation) = match &evaluation {
            Some(evaluation) => (
                optimality(&self, &x, evaluation),
                self.unit(evaluation),
                evaluation.violation(&self.problem.description().constraint_bounds),
            ),
            None => (Optimality::unknown(), 1.0, f64::NAN),
        };
        let cut = [Termination::EvaluationLimit, Termination::IterationLimit, Termination::Interrupted];
        if cut.contains(&status) && evaluation.is_some() {
            // at the limit of iterations the methods for constraints have said it
            if self.halt.is_some() || self.problem.description().constraint_names.is_empty() {
                message += &standing(optimality.residual / unit, violation);
            }
            message += &self.trend.words(self.evaluations, self.feasibility);
        }
        if self.failures > 0 && status != Termination::Failed {
            let plural = if self.failures == 1 { "analysis" } else { "analyses" };
            message += &format!(" {} {plural} failed on the way (latest: {}).", self.failures, self.last_failure);
        }
        Outcome {
            status,
            message,
            x,
            evaluation,
            evaluations: self.evaluations,
            failures: self.failures,
            hessians: self.hessians,
            iterations: self.iteration,
            kkt_residual: optimality.residual / unit,
            gradient_norm: optimality.norm,
            multipliers: optimality.multipliers,
            bound_multipliers: optimality.bound_multipliers,
            violation,
            seconds: self.begun.elapsed().as_secs_f64(),
        }
    }

    /// Closes the books, unless the problem turned out to be unfit for a method.
    pub(super) fn finish(self, method: &'static str, verdict: (Termination, String)) -> Result<Outcome, OptimizeError> {
        if self.no_squares {
            return Err(OptimizeError::NoSquares { method });
        }
        if self.no_hessian {
            return Err(OptimizeError::NoHessian { method });
        }
        Ok(self.close(verdict))
    }

    /// The start, within the bounds of the variables.
    pub(super) fn start_in_bounds(&self) -> Vec<f64> {
        let description = self.description();
        let pairs = description.start.iter().zip(&description.variable_bounds);
        pairs.map(|(x, b)| x.max(b.lower).min(b.upper)).collect()
    }
}

/// An evaluation that an optimiser can use, or the reason why not.
fn usable(evaluation: Evaluation, n: usize, constraints: usize) -> Result<Evaluation, AnalysisFailure> {
    let rows_fit = evaluation.jacobian.len() == constraints && evaluation.jacobian.iter().all(|row| row.len() == n);
    let complaint = if evaluation.constraints.len() != constraints || !rows_fit {
        Some(format!("the constraints do not come as {constraints} values with {n} derivatives each"))
    } else if let Some(k) = (0..constraints)
        .find(|&k| !(evaluation.constraints[k].is_finite() && evaluation.jacobian[k].iter().all(|a| a.is_finite())))
    {
        Some(format!("constraint {k} is {}, or its gradient is not finite", evaluation.constraints[k]))
    } else if evaluation.gradient.len() != n {
        Some(format!("the gradient has {} entries for {n} variables", evaluation.gradient.len()))
    } else if !evaluation.objective.is_finite() {
        Some(format!("the objective is {}", evaluation.objective))
    } else {
        let bad = evaluation.gradient.iter().position(|g| !g.is_finite());
        bad.map(|i| format!("entry {i} of the gradient is {}", evaluation.gradient[i]))
    };
    complaint.map_or(Ok(evaluation), |reason| Err(AnalysisFailure { reason }))
}

/// A matrix of second derivatives that an optimiser can use, or the reason why not.
fn square_and_finite(matrix: DMatrix<f64>, n: usize, name: &str) -> Result<DMatrix<f64>, AnalysisFailure> {
    if matrix.shape() != (n, n) {
        let reason = format!("the {name} is {} × {} for {n} variables", matrix.nrows(), matrix.ncols());
        return Err(AnalysisFailure { reason });
    }
    if !matrix.iter().all(|h| h.is_finite()) {
        return Err(AnalysisFailure { reason: format!("the {name} has entries that are not finite") });
    }
    Ok(matrix)
}

impl Ledger<'_> {
    fn ended() -> AnalysisFailure {
        AnalysisFailure { reason: "the run has ended".into() }
    }

    /// Why there is no further evaluation, if there is none.
    fn refused(&mut self) -> Option<AnalysisFailure> {
        if self.evaluations >= self.limits.evaluations {
            self.halt.get_or_insert(Halt::Evaluations);
        }
        self.halt.map(|_| Self::ended())
    }

    /// Enters the result of an evaluation; its optimality only where it is `wanted`.
    fn enter(
        &mut self,
        x: &[f64],
        result: Result<Evaluation, AnalysisFailure>,
        wanted: bool,
    ) -> Result<Evaluation, AnalysisFailure> {
        self.evaluations += 1;
        let constraints = self.problem.description().constraint_names.len();
        let result = result.and_then(|evaluation| usable(evaluation, x.len(), constraints));
        let result = result.map_err(|failure| self.failed(failure));
        self.last_failed = result.is_err();
        if let Ok(evaluation) = &result
            && self.best.is_none()
        {
            self.first = self.size_and_slope(evaluation);
        }
        let step = self.best.as_ref().map_or(0.0, |(best, _)| distance(best, x));
        let improved = result.as_ref().is_ok_and(|evaluation| self.improves(evaluation));
        if let Ok(evaluation) = &result
            && improved
        {
            let violation = evaluation.violation(&self.problem.description().constraint_bounds);
            self.trend.note(self.evaluations, evaluation.objective, violation);
            self.best = Some((x.to_vec(), evaluation.clone()));
        }
        let (violation, gradient_norm) = match &result {
            Ok(evaluation) => {
                let violation = evaluation.violation(&self.problem.description().constraint_bounds);
                (violation, if wanted { optimality(self, x, evaluation).norm } else { f64::NAN })
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
            sampling: !wanted,
            improved,
        };
        if (self.observer)(&progress).is_break() {
            self.halt = Some(Halt::Observer);
        }
        result
    }
}

impl Problem for Ledger<'_> {
    fn description(&self) -> &ProblemDescription {
        self.problem.description()
    }

    fn evaluate(&mut self, x: &[f64]) -> Result<Evaluation, AnalysisFailure> {
        if let Some(refused) = self.refused() {
            return Err(refused);
        }
        let result = self.problem.evaluate(x);
        self.enter(x, result, true)
    }

    fn evaluate_near(&mut self, base: &[f64], points: &[Vec<f64>]) -> Vec<Result<Evaluation, AnalysisFailure>> {
        let left = self.limits.evaluations.saturating_sub(self.evaluations).min(points.len());
        let mut found =
            if self.halt.is_some() { Vec::new() } else { self.problem.evaluate_near(base, &points[..left]) };
        let mut found = found.drain(..);
        points
            .iter()
            .map(|x| match (self.refused(), found.next()) {
                (None, Some(result)) => self.enter(x, result, false),
                (refused, _) => Err(refused.unwrap_or_else(Self::ended)),
            })
            .collect()
    }

    fn hessian(&mut self, x: &[f64]) -> Option<Result<DMatrix<f64>, AnalysisFailure>> {
        let Some(result) = self.problem.hessian(x) else {
            self.no_hessian = true;
            return None;
        };
        self.hessians += 1;
        let result = result.and_then(|hessian| square_and_finite(hessian, x.len(), "Hessian"));
        Some(result.inspect_err(|failure| self.last_failure.clone_from(&failure.reason)))
    }

    fn gauss_newton(&mut self, x: &[f64]) -> Option<Result<DMatrix<f64>, AnalysisFailure>> {
        let Some(result) = self.problem.gauss_newton(x) else {
            self.no_squares = true;
            return None;
        };
        let result = result.and_then(|matrix| square_and_finite(matrix, x.len(), "Gauss-Newton matrix"));
        Some(result.inspect_err(|failure| self.last_failure.clone_from(&failure.reason)))
    }

    fn residual_curvature(&mut self, x: &[f64], step: &[f64]) -> Option<Vec<f64>> {
        let fits = |sum: &Vec<f64>| sum.len() == x.len() && sum.iter().all(|v| v.is_finite());
        self.problem.residual_curvature(x, step).filter(fits)
    }

    fn metric(&mut self, x: &[f64]) -> Option<DMatrix<f64>> {
        let fits = |m: &DMatrix<f64>| m.shape() == (x.len(), x.len()) && m.iter().all(|v| v.is_finite());
        self.problem.metric(x).filter(fits)
    }

    fn known_constraints(&mut self, x: &[f64]) -> Option<Vec<Option<ValueAndGradient>>> {
        let whole = |(value, gradient): &ValueAndGradient| {
            value.is_finite() && gradient.len() == x.len() && gradient.iter().all(|g| g.is_finite())
        };
        let constraints = self.description().constraint_bounds.len();
        let fits = |known: &Vec<_>| known.len() == constraints && known.iter().flatten().all(whole);
        self.problem.known_constraints(x).filter(fits)
    }

    fn likely_curvature(&mut self, x: &[f64]) -> Option<DMatrix<f64>> {
        let fits = |m: &DMatrix<f64>| m.shape() == (x.len(), x.len()) && m.iter().all(|v| v.is_finite());
        self.problem.likely_curvature(x).filter(fits)
    }

    fn natural_steps(&self) -> Option<Vec<f64>> {
        if self.steps.is_some() {
            return self.steps.clone();
        }
        let n = self.description().variable_names.len();
        let fits = |steps: &Vec<f64>| steps.len() == n && steps.iter().all(|s| s.is_finite() && *s > 0.0);
        self.problem.natural_steps().filter(fits)
    }
}
