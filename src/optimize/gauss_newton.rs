//! Gauss and Newton's method for sums of squares, damped after Levenberg and Marquardt, within bounds.

use super::box_quadratic::minimum_in_box;
use super::cubic::{LineSample, cubic_minimum};
use super::kkt::Iterate;
use super::ledger::Ledger;
use super::optimizer::{Limits, Optimizer};
use super::outcome::{OptimizeError, Outcome, Progress, Termination};
use super::scope::Scope;
use super::settings::Setting;
use super::vector::norm;
use super::verdict;
use crate::design::{Evaluation, Problem};
use nalgebra::{DMatrix, DVector};
use std::ops::ControlFlow;

/// Levenberg-Marquardt for an objective that is a sum of squares, with bounds on variables and no other constraints.
///
/// The model of the objective is its value and gradient with the [Gauss-Newton matrix](Problem::gauss_newton) of the
/// problem. Each iteration minimises it within the bounds, which are met exactly, damped just enough for the step to stay
/// within a ball of the problem's [`metric`](Problem::metric), or of [natural steps](Problem::natural_steps) where there
/// is none. It costs one evaluation. Where the problem tells the
/// [curvature of its residuals](Problem::residual_curvature) along the step, the step is bent by it, so that it follows a
/// curved valley. A step that fell short of the model is followed by a further one from its end, for
/// a second evaluation, and the lower of the two ends counts: long steps along a curved valley end on its slope, from
/// where the next leads back to its floor. A matrix is asked for only where a step was accepted or is followed by a
/// further one. A step that was rejected gives the next radius by the cubic through the objective and its slope at both
/// ends. A failed analysis counts as a rejected step.
///
/// The run has converged where the model without damping promises less than
/// [`objective_tolerance`](Self::objective_tolerance) of the objective, or where the objective has fallen to a 10⁻²⁰th
/// of its start: an exact match. It has converged as well where [`WINDOW`](Self::WINDOW) accepted steps together lowered
/// the objective by less than [`progress_tolerance`](Self::progress_tolerance) of its size, as near optima that hardly
/// depend on some of many variables, and where the objective has fallen to [`match_tolerance`](Self::match_tolerance) of
/// its start and the latest step did not halve it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaussNewton {
    /// Predicted relative decrease of the objective that counts as none.
    pub objective_tolerance: f64,
    /// Relative decrease of the objective over [`WINDOW`](Self::WINDOW) accepted steps below which the run has
    /// converged. The objective is a square, so that the default of 0.01 stands for half a per cent of the distance
    /// from a target over ten steps.
    pub progress_tolerance: f64,
    /// Objective over that of the start below which slow progress ends the run: the root of it is the share of the
    /// distance from a target that is left.
    pub match_tolerance: f64,
    /// First radius of the ball.
    pub first_radius: f64,
    /// Limits of the run.
    pub limits: Limits,
}

impl Default for GaussNewton {
    fn default() -> Self {
        Self {
            objective_tolerance: 1e-4,
            progress_tolerance: 1e-2,
            match_tolerance: 1e-8,
            first_radius: 1.0,
            limits: Limits::default(),
        }
    }
}

/// Share of the predicted decrease from which a step is accepted.
const ACCEPT: f64 = 1e-4;
/// Share of the predicted decrease below which a step is corrected by a further one.
const FAIR: f64 = 0.25;
/// Objective over that before a step from which no further step is tried.
const STEEP: f64 = 10.0;
/// Share of the predicted decrease below which the ball shrinks, and above which it grows.
const POOR: f64 = 0.1;
const GOOD: f64 = 0.75;
/// Objective over that of the start at which nothing is left to match.
const NOTHING: f64 = 1e-20;
/// Least damping, as a share of the largest curvature: it keeps the matrix positive definite in round-off.
const LEAST: f64 = 1e-13;
/// Damping from which that of the first step is sought, as a share of the largest curvature.
const FIRST_DAMPING: f64 = 1e-3;
/// Length of what bends a step over its own, up to which it is bent.
const MOST_BENT: f64 = 0.75;
/// Steps rejected in a row before the run counts as stalled.
const PATIENCE: usize = 20;

impl GaussNewton {
    /// The name in case files.
    pub const NAME: &'static str = "gauss-newton";
    pub(super) const SCOPE: Scope = Scope { method: Self::NAME, constraints: false, dense: true };
    /// Accepted steps over which progress is judged.
    pub const WINDOW: usize = 10;

    fn settings(&self) -> [Setting; 4] {
        [
            Setting::tolerance("objective_tolerance", self.objective_tolerance),
            Setting::tolerance("progress_tolerance", self.progress_tolerance),
            Setting::tolerance("match_tolerance", self.match_tolerance),
            Setting::positive("first_radius", self.first_radius),
        ]
    }
}

impl Optimizer for GaussNewton {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn minimize(
        &self,
        problem: &mut dyn Problem,
        observer: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
    ) -> Result<Outcome, OptimizeError> {
        Self::SCOPE.check(problem, self.limits, &self.settings())?;
        let steps = problem.natural_steps().unwrap_or_else(|| vec![1.0; problem.description().start.len()]);
        let mut run = Run {
            settings: *self,
            ledger: Ledger::new(problem, observer, self.limits),
            steps,
            radius: self.first_radius,
            damping: 0.0,
            latest: None,
            rejected: 0,
            failed_at: None,
            accepted: Vec::new(),
            steepest: 0.0,
        };
        let verdict = run.drive();
        run.ledger.finish(Self::NAME, verdict)
    }
}

/// A point with the model of the objective there, the variables counted in natural steps.
struct Modelled {
    x: Vec<f64>,
    evaluation: Evaluation,
    gradient: DVector<f64>,
    matrix: DMatrix<f64>,
    /// Steps `s` are of the length √(sᵀ metric s).
    metric: DMatrix<f64>,
    /// Largest curvature along a variable, for a step of unit length.
    size: f64,
}

impl Modelled {
    fn length(&self, step: &DVector<f64>) -> f64 {
        step.dot(&(&self.metric * step)).sqrt()
    }

    /// By how much the model falls along a step.
    fn fall(&self, step: &DVector<f64>) -> f64 {
        -self.gradient.dot(step) - 0.5 * step.dot(&(&self.matrix * step))
    }
}

/// A step in natural steps.
struct Step {
    step: DVector<f64>,
    /// Length in the metric.
    length: f64,
    /// By how much the model falls.
    fall: f64,
    /// Whether it is damped to stay within the ball.
    at_surface: bool,
}

struct Run<'a> {
    settings: GaussNewton,
    ledger: Ledger<'a>,
    steps: Vec<f64>,
    /// Largest length of a step.
    radius: f64,
    /// Damping and step of the latest model, from which the next are sought.
    damping: f64,
    latest: Option<DVector<f64>>,
    /// Steps rejected in a row.
    rejected: usize,
    /// Iteration at which an analysis failed last.
    failed_at: Option<usize>,
    /// Objectives of the accepted points, that of the start first.
    accepted: Vec<f64>,
    /// Largest norm of the gradient so far.
    steepest: f64,
}

impl Run<'_> {
    fn drive(&mut self) -> (Termination, String) {
        let start = self.ledger.start_in_bounds();
        let first = self.ledger.evaluate(&start).ok().and_then(|evaluation| self.expand(start, evaluation));
        let Some(mut point) = first else {
            return verdict::fails_at_start(self.ledger.last_failure());
        };
        self.accepted.push(point.evaluation.objective);
        self.damping = FIRST_DAMPING * point.size;
        loop {
            let step = self.step(&point);
            if let Some(verdict) = self.judge(&point, step.as_ref()) {
                return verdict;
            }
            self.ledger.iteration += 1;
            match step.and_then(|step| self.advance(&point, step)) {
                Some(next) => {
                    self.rejected = 0;
                    self.accepted.push(next.evaluation.objective);
                    point = next;
                }
                None => self.rejected += 1,
            }
        }
    }

    /// Adds the model to an evaluated point; `None` where there is none.
    fn expand(&mut self, x: Vec<f64>, evaluation: Evaluation) -> Option<Modelled> {
        let matrix = self.ledger.gauss_newton(&x)?.ok()?;
        self.steepest = self.steepest.max(norm(&evaluation.gradient));
        let in_steps =
            |m: DMatrix<f64>| DMatrix::from_fn(x.len(), x.len(), |i, j| m[(i, j)] * self.steps[i] * self.steps[j]);
        let metric = self.ledger.metric(&x).map_or_else(|| DMatrix::identity(x.len(), x.len()), in_steps);
        let matrix = in_steps(matrix);
        let gradient = DVector::from_fn(x.len(), |k, _| evaluation.gradient[k] * self.steps[k]);
        let curvature = matrix.diagonal().component_div(&metric.diagonal());
        let size = curvature.amax().max(f64::MIN_POSITIVE);
        Some(Modelled { x, evaluation, gradient, matrix, metric, size })
    }

    /// The minimum of the model of this gradient with some damping within the bounds, as a step in natural steps;
    /// `near` is a guess.
    fn damped(
        &self,
        point: &Modelled,
        damping: f64,
        gradient: &DVector<f64>,
        near: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        let room = |bound: f64, k: usize| (bound - point.x[k]) / self.steps[k];
        let bounds = self.ledger.description().variable_bounds.iter().enumerate();
        let (lower, upper): (Vec<f64>, Vec<f64>) =
            bounds.map(|(k, b)| (room(b.lower, k).min(0.0), room(b.upper, k).max(0.0))).unzip();
        minimum_in_box(&(&point.matrix + &point.metric * damping), gradient, &lower, &upper, near)
    }

    /// The step within the ball, damped as little as that allows.
    fn step(&mut self, point: &Modelled) -> Option<Step> {
        let least = LEAST * point.size;
        let mut damping = self.damping.max(least);
        // the length falls with the damping
        let (mut low, mut high) = (None, None);
        let mut inside: Option<DVector<f64>> = None;
        let mut near = self.latest.clone().unwrap_or_else(|| DVector::zeros(point.x.len()));
        for _ in 0..60 {
            let found = self.damped(point, damping, &point.gradient, &near);
            let length = found.as_ref().map_or(f64::INFINITY, |step| point.length(step));
            // written so that what is no number is too long
            if let Some(step) = found.filter(|_| length <= self.radius) {
                near.clone_from(&step);
                inside = Some(step);
                high = Some(damping);
                if length >= 0.7 * self.radius || damping <= least {
                    break;
                }
                damping = low.map_or(0.03 * damping, |low: f64| (low * damping).sqrt()).max(least);
            } else {
                low = Some(damping);
                damping = high.map_or(30.0 * damping, |high: f64| (high * damping).sqrt());
            }
            if low.zip(high).is_some_and(|(low, high)| high <= 1.01 * low) {
                break;
            }
        }
        let step = inside?;
        let damping = high?;
        self.damping = damping;
        self.latest = Some(step.clone());
        let (fall, length) = (point.fall(&step), point.length(&step));
        let step = self.bent(point, damping, step);
        Some(Step { fall, length, at_surface: damping > least, step })
    }

    /// A step bent so that the residuals go straight to second order, where the problem knows their curvature and that
    /// bends it little: steps along curved valleys may then be long (geodesic acceleration; Transtrum and Sethna,
    /// arXiv:1201.5885, 2012).
    fn bent(&mut self, point: &Modelled, damping: f64, step: DVector<f64>) -> DVector<f64> {
        let along: Vec<f64> = step.iter().zip(&self.steps).map(|(s, h)| s * h).collect();
        let Some(curvature) = self.ledger.residual_curvature(&point.x, &along) else { return step };
        let curvature = DVector::from_fn(step.len(), |k, _| 0.5 * curvature[k] * self.steps[k]);
        match self.damped(point, damping, &(&point.gradient + curvature), &step) {
            Some(bent) if point.length(&(&bent - &step)) <= MOST_BENT * point.length(&step) => bent,
            _ => step,
        }
    }

    /// By how much the model could fall without damping, beside what it falls by a step within the ball.
    fn left(&self, point: &Modelled, step: &Step) -> f64 {
        if !step.at_surface || step.fall > self.settings.objective_tolerance * point.evaluation.objective {
            return step.fall;
        }
        let mut damping = LEAST * point.size;
        while damping <= point.size {
            if let Some(free) = self.damped(point, damping, &point.gradient, &step.step) {
                return point.fall(&free);
            }
            damping *= 100.0;
        }
        f64::INFINITY
    }

    /// The end of a step, within the bounds to the last bit.
    fn moved(&self, point: &Modelled, step: &DVector<f64>) -> Vec<f64> {
        let bounds = &self.ledger.description().variable_bounds;
        let move_by = |k: usize| (point.x[k] + step[k] * self.steps[k]).max(bounds[k].lower).min(bounds[k].upper);
        (0..point.x.len()).map(move_by).collect()
    }

    /// One step: the next point, or `None` where it is rejected.
    fn advance(&mut self, point: &Modelled, step: Step) -> Option<Modelled> {
        let x = self.moved(point, &step.step);
        let Ok(evaluation) = self.ledger.evaluate(&x) else {
            self.failed_at = Some(self.ledger.iteration);
            self.radius = 0.25 * step.length;
            return None;
        };
        let along =
            |e: &Evaluation| e.gradient.iter().zip(&self.steps).zip(&step.step).map(|((g, h), s)| g * h * s).sum();
        let sample = |step: f64, e: &Evaluation| LineSample { step, value: e.objective, slope: along(e) };
        let (here, there) = (sample(0.0, &point.evaluation), sample(1.0, &evaluation));
        let shorter = cubic_minimum(here, there).unwrap_or(0.5).clamp(0.1, 0.7) * step.length;
        let share_of = |objective: f64| (point.evaluation.objective - objective) / step.fall;
        let share = share_of(evaluation.objective);
        if !(share >= FAIR || evaluation.objective < STEEP * point.evaluation.objective) {
            // so far up, or so far from a number, that there is no way back within a step
            self.radius = shorter;
            return None;
        }
        let next = if share >= FAIR { self.expand(x, evaluation) } else { self.corrected(x, evaluation) };
        let Some(next) = next else {
            self.radius = 0.25 * step.length;
            return None;
        };
        let share = share_of(next.evaluation.objective);
        if share > GOOD && step.at_surface {
            self.radius = 2.0 * step.length;
        } else if share < ACCEPT {
            self.radius = shorter;
        } else if share < POOR {
            self.radius = 0.5 * step.length;
        }
        (share >= ACCEPT).then_some(next)
    }

    /// The lower one of the end of a step that fell short and of the end of a further step from there.
    ///
    /// Long steps along a curved valley end on its slope, from where the next step leads back to its floor, so that
    /// the two together may have gone far (the watchdog of Chamberlain, Powell, Lemarechal and Pedersen, Mathematical
    /// Programming Study 16, 1982, with a patience of one step).
    fn corrected(&mut self, x: Vec<f64>, evaluation: Evaluation) -> Option<Modelled> {
        let end = self.expand(x, evaluation)?;
        let (damping, latest) = (self.damping, self.latest.take());
        let back = self.step(&end);
        (self.damping, self.latest) = (damping, latest);
        let Some(back) = back else { return Some(end) };
        let x = self.moved(&end, &back.step);
        match self.ledger.evaluate(&x) {
            Ok(further) if further.objective < end.evaluation.objective => self.expand(x, further).or(Some(end)),
            Ok(_) => Some(end),
            Err(_) => {
                self.failed_at = Some(self.ledger.iteration);
                Some(end)
            }
        }
    }

    /// A wall of failures is met again and again, with short accepted steps in between.
    fn failed_recently(&self) -> bool {
        self.failed_at.is_some_and(|iteration| iteration + GaussNewton::WINDOW > self.ledger.iteration)
    }

    /// Why the run ends at `point`, if it does.
    fn judge(&self, point: &Modelled, step: Option<&Step>) -> Option<(Termination, String)> {
        if self.ledger.halted().is_some() || self.ledger.lacks_squares() {
            // the ledger words it
            return Some((Termination::Interrupted, String::new()));
        }
        let objective = point.evaluation.objective;
        let before = self.accepted.iter().rev().nth(1).copied().unwrap_or(f64::INFINITY);
        if objective <= self.settings.match_tolerance * self.accepted[0] && objective > 0.5 * before {
            let share = objective / self.accepted[0];
            let message =
                format!("Converged: {share:.0e} of the objective at the start is left, which falls slowly now.");
            return Some((Termination::Converged, message));
        }
        if objective <= NOTHING * self.accepted[0] {
            let message = format!("Converged: the match is exact, {:.0e} of the objective at the start.", NOTHING);
            return Some((Termination::Converged, message));
        }
        let left = step.map_or(f64::INFINITY, |step| self.left(point, step));
        if left <= self.settings.objective_tolerance * objective {
            let share = left.max(0.0) / objective;
            let at = Iterate::new(&self.ledger, &point.x, point.evaluation.clone());
            let message = format!("Converged: at most {share:.1e} of the objective is left to gain.");
            return Some((Termination::Converged, message + &verdict::holding(&self.ledger, &at)));
        }
        if let Some(earlier) = self.accepted.len().checked_sub(GaussNewton::WINDOW + 1).map(|k| self.accepted[k])
            && earlier - objective < self.settings.progress_tolerance * objective
        {
            if self.failed_recently() {
                return Some(verdict::walled_in(&self.ledger, norm(&point.evaluation.gradient)));
            }
            let share = (earlier - objective) / objective;
            let at = Iterate::new(&self.ledger, &point.x, point.evaluation.clone());
            let message = format!(
                "Converged: the last {} steps together lowered the objective by only {share:.1e} of its size.",
                GaussNewton::WINDOW,
            );
            return Some((Termination::Converged, message + &verdict::holding(&self.ledger, &at)));
        }
        if self.rejected >= PATIENCE {
            let slope = norm(&point.evaluation.gradient);
            let words = if self.failed_recently() {
                verdict::walled_in(&self.ledger, slope)
            } else {
                verdict::no_descent(slope, self.steepest)
            };
            return Some(words);
        }
        self.ledger.out_of_iterations().then(|| verdict::iteration_limit(self.settings.limits.iterations))
    }
}

#[cfg(test)]
#[path = "gauss_newton_tests.rs"]
mod tests;
