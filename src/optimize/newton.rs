//! Newton's method in a trust region, with the exact Hessian.

use super::bounded::Bounded;
use super::cubic::{LineSample, cubic_minimum};
use super::ledger::Ledger;
use super::optimizer::{Limits, Optimizer};
use super::outcome::{OptimizeError, Outcome, Progress, Termination};
use super::scope::Scope;
use super::settings::Setting;
use super::trust_region::QuadraticModel;
use super::vector::norm;
use super::verdict;
use crate::design::{Evaluation, Problem};
use std::ops::ControlFlow;

/// Trust-region Newton with the problem's exact Hessian, for problems without constraints.
///
/// Each iteration minimises the local quadratic exactly within a ball of the problem's [`metric`](Problem::metric)
/// (indefinite Hessians and the hard case included) and costs one evaluation; a Hessian is asked for only where a step
/// was accepted. A step that fell short gives the next radius by the cubic through the objective and its slope at both
/// ends. Bounds on variables are met by a change of variables ([`Bounded`]). A failed analysis counts as a rejected
/// step: the ball shrinks.
///
/// The run has converged where the Hessian is positive semidefinite and either
///
/// * the minimum of the quadratic lies less than [`objective_tolerance`](Self::objective_tolerance) of the objective
///   below it, or
/// * the norm of the gradient is below [`gradient_tolerance`](Self::gradient_tolerance) times the largest met so far;
///
/// so a saddle point or maximum is left, even when the run starts there. It has stalled where
/// [`WINDOW`](Self::WINDOW) accepted steps together lowered the objective by less than
/// [`progress_tolerance`](Self::progress_tolerance) of its size: a valley whose floor hardly falls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Newton {
    /// Predicted relative decrease of the objective that counts as none.
    pub objective_tolerance: f64,
    /// Reduction of the norm of the gradient at which the run has converged.
    pub gradient_tolerance: f64,
    /// Relative decrease of the objective over [`WINDOW`](Self::WINDOW) accepted steps below which the run has stalled.
    pub progress_tolerance: f64,
    /// First radius of the ball, in scaled variables.
    pub first_radius: f64,
    /// Largest radius of the ball.
    pub largest_radius: f64,
    /// Limits of the run.
    pub limits: Limits,
}

impl Default for Newton {
    fn default() -> Self {
        Self {
            objective_tolerance: 1e-10,
            gradient_tolerance: 1e-12,
            progress_tolerance: 5e-3,
            first_radius: 1.0,
            largest_radius: 100.0,
            limits: Limits::default(),
        }
    }
}

/// Share of the predicted decrease from which a step is accepted.
const ACCEPT: f64 = 1e-4;
/// Share of the predicted decrease below which the ball shrinks.
const POOR: f64 = 0.1;
/// Share of the predicted decrease above which it grows, if the objective still falls at the end of the step.
const GOOD: f64 = 0.75;
/// Relative change of the objective that may be round-off.
const ROUND_OFF: f64 = 1e-12;
/// Steps rejected in a row before the run counts as stalled: the ball has shrunk by 2^20 at least.
const PATIENCE: usize = 20;

impl Newton {
    /// The name in case files.
    pub const NAME: &'static str = "newton";
    pub(super) const SCOPE: Scope = Scope { method: Self::NAME, constraints: false, dense: true };
    /// Accepted steps over which progress is judged.
    pub const WINDOW: usize = 25;

    fn settings(&self) -> [Setting; 5] {
        [
            Setting::tolerance("objective_tolerance", self.objective_tolerance),
            Setting::tolerance("gradient_tolerance", self.gradient_tolerance),
            Setting::tolerance("progress_tolerance", self.progress_tolerance),
            Setting::positive("first_radius", self.first_radius),
            Setting::positive("largest_radius", self.largest_radius),
        ]
    }
}

impl Optimizer for Newton {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn minimize(
        &self,
        problem: &mut dyn Problem,
        observer: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
    ) -> Result<Outcome, OptimizeError> {
        Self::SCOPE.check(problem, self.limits, &self.settings())?;
        let mut run = NewtonRun {
            settings: *self,
            problem: Bounded::new(Ledger::new(problem, observer, self.limits)),
            radius: self.first_radius.min(self.largest_radius),
            steepest: 0.0,
            rejected: 0,
            failed_at: None,
            accepted: Vec::new(),
        };
        let verdict = run.drive();
        run.problem.into_inner().finish(Self::NAME, verdict)
    }
}

/// A point with everything known there.
struct SecondOrderPoint {
    x: Vec<f64>,
    evaluation: Evaluation,
    quadratic: QuadraticModel,
}

struct NewtonRun<'a> {
    settings: Newton,
    problem: Bounded<Ledger<'a>>,
    radius: f64,
    /// Largest norm of the gradient so far.
    steepest: f64,
    /// Steps rejected in a row.
    rejected: usize,
    /// Iteration at which an analysis failed last.
    failed_at: Option<usize>,
    /// Objectives of the accepted points.
    accepted: Vec<f64>,
}

impl NewtonRun<'_> {
    fn drive(&mut self) -> (Termination, String) {
        let start = self.problem.description().start.to_vec();
        let first = self.problem.evaluate(&start).ok().and_then(|evaluation| self.expand(start, evaluation));
        let Some(mut point) = first else {
            return verdict::fails_at_start(self.problem.inner().last_failure());
        };
        loop {
            if let Some(verdict) = self.judge(&mut point) {
                return verdict;
            }
            self.problem.inner_mut().iteration += 1;
            match self.advance(&mut point) {
                Some(next) => {
                    self.rejected = 0;
                    self.accepted.push(next.evaluation.objective);
                    point = next;
                }
                None => self.rejected += 1,
            }
        }
    }

    /// Adds the quadratic to an evaluated point; `None` where the Hessian fails.
    fn expand(&mut self, x: Vec<f64>, evaluation: Evaluation) -> Option<SecondOrderPoint> {
        let hessian = self.problem.hessian(&x)?.ok()?;
        let quadratic = QuadraticModel::new(&evaluation.gradient, hessian, self.problem.metric(&x));
        self.steepest = self.steepest.max(norm(&evaluation.gradient));
        Some(SecondOrderPoint { x, evaluation, quadratic })
    }

    /// One trust-region step: the next point, or `None` where the step is rejected.
    fn advance(&mut self, point: &mut SecondOrderPoint) -> Option<SecondOrderPoint> {
        let step = point.quadratic.minimum_within(self.radius);
        let length = step.length;
        let x: Vec<f64> = point.x.iter().zip(&step.vector).map(|(x, p)| x + p).collect();
        let shorter = 0.25 * length;
        let Ok(evaluation) = self.problem.evaluate(&x) else {
            self.failed_at = Some(self.problem.inner().iteration);
            self.radius = shorter;
            return None;
        };
        let before = &point.evaluation;
        let decrease = before.objective - evaluation.objective;
        let in_noise = step.decrease.max(decrease.abs()) <= ROUND_OFF * before.objective.abs();
        let share = decrease / step.decrease;
        if in_noise {
            // the objective cannot tell; the gradient can
            if norm(&evaluation.gradient) >= norm(&before.gradient) {
                self.radius = shorter;
                return None;
            }
        } else {
            let along = |e: &Evaluation| -> f64 { e.gradient.iter().zip(&step.vector).map(|(g, p)| g * p).sum() };
            let slopes = [along(before), along(&evaluation)];
            if share < POOR || share.is_nan() {
                let here = LineSample { step: 0.0, value: before.objective, slope: slopes[0] };
                let there = LineSample { step: 1.0, value: evaluation.objective, slope: slopes[1] };
                let t = cubic_minimum(here, there).unwrap_or(0.5);
                self.radius = t.clamp(0.1, 0.7) * length;
            } else if share > GOOD && step.at_boundary && slopes[1] < 0.0 {
                self.radius = (2.0 * length).min(self.settings.largest_radius);
            }
        }
        if !in_noise && (share < ACCEPT || share.is_nan()) {
            return None;
        }
        let next = self.expand(x, evaluation);
        if next.is_none() {
            self.radius = shorter;
        }
        next
    }

    /// Why the run ends at `point`, if it does.
    fn judge(&self, point: &mut SecondOrderPoint) -> Option<(Termination, String)> {
        let ledger = self.problem.inner();
        if ledger.halted().is_some() || ledger.lacks_hessian() {
            // the ledger words it
            return Some((Termination::Interrupted, String::new()));
        }
        let slope = norm(&point.evaluation.gradient);
        let Newton { objective_tolerance, gradient_tolerance, limits, .. } = self.settings;
        if slope <= gradient_tolerance * self.steepest && !point.quadratic.is_indefinite() {
            return Some((Termination::Converged, format!("Converged: the norm of the gradient is {slope:.1e}.")));
        }
        let size = point.evaluation.objective.abs();
        if let Some(decrement) = point.quadratic.decrement()
            && decrement <= objective_tolerance * size
        {
            return Some((
                Termination::Converged,
                format!(
                    "Converged: at most {:.1e} of the objective is left to gain; the norm of the gradient is {slope:.1e}.",
                    decrement / size
                ),
            ));
        }
        if self.rejected >= PATIENCE || self.radius <= f64::EPSILON * norm(&point.x) {
            return Some(self.stuck(slope));
        }
        if let Some(earlier) = self.accepted.len().checked_sub(Newton::WINDOW + 1).map(|k| self.accepted[k]) {
            let fall = earlier - point.evaluation.objective;
            if fall < self.settings.progress_tolerance * size {
                if self.failed_recently() {
                    return Some(self.stuck(slope));
                }
                let message = format!(
                    "The last {} steps lowered the objective by only {:.1e} of its size; the norm of the gradient is {slope:.1e}.",
                    Newton::WINDOW,
                    fall / size
                );
                return Some((Termination::Stalled, message));
            }
        }
        if ledger.out_of_iterations() {
            return Some(verdict::iteration_limit(limits.iterations));
        }
        None
    }

    /// A wall of failures is met again and again, with short accepted steps in between.
    fn failed_recently(&self) -> bool {
        self.failed_at.is_some_and(|iteration| iteration + 5 > self.problem.inner().iteration)
    }

    /// The verdict where no step is accepted.
    fn stuck(&self, slope: f64) -> (Termination, String) {
        if self.failed_recently() {
            return verdict::walled_in(self.problem.inner(), slope);
        }
        verdict::no_descent(slope, self.steepest)
    }
}

#[cfg(test)]
mod tests {
    use super::super::testcases::*;
    use super::*;
    use approx::assert_relative_eq;

    fn converged(method: Newton, case: &mut dyn Problem, most: usize) -> Outcome {
        let outcome = run(&method, case);
        assert_eq!(outcome.status, Termination::Converged, "{}", outcome.message);
        assert!(outcome.evaluations <= most, "{} evaluations", outcome.evaluations);
        assert_eq!(outcome.evaluations, outcome.iterations + 1);
        outcome
    }

    #[test]
    fn curved_valley() {
        for (n, most) in [(2, 30), (32, 80)] {
            let mut case = rosenbrock(n);
            let outcome = converged(Newton::default(), &mut case, most);
            assert_eq!((outcome.evaluations, outcome.hessians), (case.asked.len(), case.hessians));
            assert!(outcome.hessians <= outcome.evaluations);
            outcome.x.iter().for_each(|&x| assert_relative_eq!(x, 1.0, epsilon = 1e-8));
        }
    }

    #[test]
    fn a_quadratic_is_one_step() {
        let outcome =
            converged(Newton { first_radius: 100.0, ..Newton::default() }, &mut quadratic(32, 1e8, 1e-10, 4e-7), 3);
        outcome.x.iter().for_each(|&x| assert_relative_eq!(x, 1.0, epsilon = 1e-5));
    }

    #[test]
    fn shape_match_reaches_the_optimum() {
        for first_radius in [0.03, 0.3, 1.0, 3.0] {
            let outcome = converged(Newton { first_radius, ..Newton::default() }, &mut shape_match(), 50);
            assert_relative_eq!(outcome.evaluation.unwrap().objective, 1.3425663e-7, max_relative = 1e-7);
        }
    }

    #[test]
    fn saddle_points_are_left() {
        for start in [[0.0, 0.0], [1.0, 0.0], [0.3, 1e-9]] {
            let mut case = Unconstrained::new(Saddle, &start);
            let outcome = converged(Newton::default(), &mut case, 20);
            assert_relative_eq!(outcome.evaluation.unwrap().objective, -0.25, max_relative = 1e-10);
        }
    }

    #[test]
    fn failed_analyses_are_rejected_steps() {
        let mut case = rosenbrock(2).failing(|x| (x[1] - x[0] * x[0]).abs() > 0.6);
        let outcome = run(&Newton { first_radius: 10.0, ..Newton::default() }, &mut case);
        assert_eq!(outcome.status, Termination::Converged, "{}", outcome.message);
        assert!(outcome.failures > 0);
        outcome.x.iter().for_each(|&x| assert_relative_eq!(x, 1.0, epsilon = 1e-8));
        let outcome = run(&Newton::default(), &mut quadratic(3, 10.0, 1.0, 0.0).failing(|x| x[0] > 0.5));
        assert_eq!(outcome.status, Termination::Failed, "{}", outcome.message);
        assert!(outcome.x[0] > 0.49 && outcome.x[0] <= 0.5);
        let outcome = run(&Newton::default(), &mut rosenbrock(2).failing(|_| true));
        assert_eq!((outcome.status, outcome.evaluations), (Termination::Failed, 1));
    }

    #[test]
    fn active_bounds() {
        for (lower, upper) in [(-0.5, 0.8), (f64::NEG_INFINITY, 0.8), (1.5, f64::INFINITY), (0.5, 3.0)] {
            let mut case = quadratic(5, 100.0, 1.0, 0.0).bounded(lower, upper);
            let outcome = converged(Newton::default(), &mut case, 40);
            assert!(outcome.kkt_residual < 1e-6, "{lower} {upper}: {:e}", outcome.kkt_residual);
            assert!(case.asked.iter().flatten().all(|x| (lower..=upper).contains(x)));
        }
        // a variable without room
        let mut case = rosenbrock(2);
        case.description.variable_bounds[0] = crate::design::Bounds { lower: 0.5, upper: 0.5 };
        let outcome = converged(Newton::default(), &mut case, 20);
        assert_relative_eq!(outcome.x[..], [0.5, 0.25], epsilon = 1e-9);
    }

    #[test]
    fn limits_and_observers_end_the_run() {
        let limits = Limits { evaluations: 7, iterations: 4 };
        let method = Newton { limits, ..Newton::default() };
        let outcome = run(&method, &mut rosenbrock(32));
        assert_eq!((outcome.status, outcome.iterations), (Termination::IterationLimit, 4));
        let limits = Limits { evaluations: 3, iterations: 4 };
        let outcome = run(&Newton { limits, ..method }, &mut rosenbrock(32));
        assert_eq!((outcome.status, outcome.evaluations), (Termination::EvaluationLimit, 3));
        let stop =
            &mut |p: &Progress<'_>| if p.evaluation == 5 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
        let outcome = Newton::default().minimize(&mut rosenbrock(32), stop).unwrap();
        assert_eq!((outcome.status, outcome.evaluations), (Termination::Interrupted, 5));
    }

    #[test]
    fn tolerances_of_zero_end_in_words() {
        let method = Newton { objective_tolerance: 0.0, gradient_tolerance: 0.0, ..Newton::default() };
        let outcome = run(&method, &mut quadratic(6, 1e3, 1.0, 1.0));
        assert!(matches!(outcome.status, Termination::Stalled | Termination::Converged), "{}", outcome.message);
        assert!(outcome.evaluations < 40);
    }
}
