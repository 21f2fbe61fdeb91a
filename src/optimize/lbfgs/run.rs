//! The state of a run of L-BFGS, and the faces it shows to `argmin`.

use super::super::bounded::Bounded;
use super::super::ledger::{Halted, Ledger};
use super::super::outcome::{Progress, Termination};
use super::super::vector::{dot, norm};
use super::super::verdict;
use super::line_search::{ArgminState, Rejected, WolfeLineSearch};
use super::settings::Lbfgs;
use crate::design::Problem;
use argmin::core::{
    CostFunction, Error, Gradient, KV, Problem as Counted, Solver, State, TerminationReason, TerminationStatus,
};
use argmin::solver::quasinewton::LBFGS;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::ops::ControlFlow;

/// A point, its objective and gradient, in the unbounded variables.
#[derive(Debug, Clone, Default)]
struct FirstOrderPoint {
    x: Vec<f64>,
    objective: f64,
    gradient: Vec<f64>,
}

/// The state of a run, which lasts from leg to leg.
pub(super) struct LbfgsRun<'a> {
    pub(super) problem: Bounded<Ledger<'a>>,
    pub(super) settings: Lbfgs,
    /// The latest points, so that cost and gradient share an evaluation.
    recent: VecDeque<FirstOrderPoint>,
    /// Where the run stands.
    current: FirstOrderPoint,
    /// Objectives of the last `patience` iterations.
    objectives: VecDeque<f64>,
    /// Objective where the leg began.
    leg_start: f64,
    /// Length of the last step.
    step: f64,
    /// Largest norm of the gradient so far.
    steepest: f64,
    /// Divisor of the objective.
    scale: f64,
    /// Whether an analysis succeeded since the last step.
    succeeded: bool,
    /// Failed analyses until the last step.
    failures: usize,
    /// Iterations in a row in which an analysis failed, and in which none did.
    hindered: usize,
    unhindered: usize,
    pub(super) verdict: Option<(Termination, String)>,
}

impl<'a> LbfgsRun<'a> {
    /// Points kept: a little more than those of one line search.
    const RECENT: usize = 24;

    pub(super) fn new(
        settings: Lbfgs,
        problem: &'a mut dyn Problem,
        observer: &'a mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
    ) -> Self {
        Self {
            problem: Bounded::new(Ledger::new(problem, observer, settings.limits)),
            settings,
            recent: VecDeque::new(),
            current: FirstOrderPoint::default(),
            objectives: VecDeque::new(),
            leg_start: f64::INFINITY,
            step: settings.first_step,
            steepest: 0.0,
            scale: 1.0,
            succeeded: false,
            failures: 0,
            hindered: 0,
            unhindered: 0,
            verdict: None,
        }
    }

    /// Evaluates the start.
    pub(super) fn begin(&mut self) -> Result<(), (Termination, String)> {
        let start = self.problem.description().start.to_vec();
        let first = self.at(&start);
        self.current = first.map_err(|_| verdict::fails_at_start(self.problem.inner().last_failure()))?;
        self.judge();
        Ok(())
    }

    /// Chooses the scale of the objective such that the first step of a leg has the length of the last step, and
    /// returns point, scaled gradient and scaled objective.
    pub(super) fn begin_leg(&mut self) -> (Vec<f64>, Vec<f64>, f64) {
        self.leg_start = self.current.objective;
        self.scale = (norm(&self.current.gradient) / self.step).max(f64::MIN_POSITIVE);
        let gradient = self.current.gradient.iter().map(|g| g / self.scale).collect();
        (self.current.x.clone(), gradient, self.current.objective / self.scale)
    }

    /// Objective and gradient at `x`, evaluated once.
    fn at(&mut self, x: &[f64]) -> Result<FirstOrderPoint, Error> {
        if let Some(point) = self.recent.iter().rfind(|p| p.x == x) {
            return Ok(point.clone());
        }
        let evaluation = match self.problem.evaluate(x) {
            Ok(evaluation) => evaluation,
            Err(_) if self.problem.inner().halted().is_some() => return Err(Halted.into()),
            Err(_) => return Err(Rejected.into()),
        };
        self.succeeded = true;
        if self.recent.len() == Self::RECENT {
            self.recent.pop_front();
        }
        let point = FirstOrderPoint { x: x.to_vec(), objective: evaluation.objective, gradient: evaluation.gradient };
        self.recent.push_back(point.clone());
        Ok(point)
    }

    /// Takes the step to `next`. Returns whether the leg can go on.
    fn accept(&mut self, next: FirstOrderPoint) -> bool {
        let change = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>();
        let s = change(&next.x, &self.current.x);
        let y = change(&next.gradient, &self.current.gradient);
        self.step = norm(&s).clamp(f64::MIN_POSITIVE, self.settings.first_step);
        self.current = next;
        self.succeeded = false;
        let failures = self.problem.inner().failures();
        let hindered = failures > self.failures;
        self.failures = failures;
        (self.hindered, self.unhindered) = if hindered { (self.hindered + 1, 0) } else { (0, self.unhindered + 1) };
        self.problem.inner_mut().iteration += 1;
        self.judge();
        // a pair without positive curvature would spoil the memory, which argmin does not check
        self.verdict.is_none() && dot(&s, &y) > 0.0
    }

    /// Whether the current point ends the run.
    fn judge(&mut self) {
        let slope = norm(&self.current.gradient);
        self.steepest = self.steepest.max(slope);
        let Lbfgs { objective_tolerance, gradient_tolerance, patience, limits, .. } = self.settings;
        if self.objectives.len() > patience {
            self.objectives.pop_front();
        }
        self.objectives.push_back(self.current.objective);
        let objective = self.current.objective;
        let before = self.objectives[0];
        let unchanged =
            |tolerance: f64| self.objectives.len() > patience && before - objective <= tolerance * objective.abs();
        self.verdict = if slope <= gradient_tolerance * self.steepest {
            let message = if slope == 0.0 {
                "Converged: the gradient vanishes.".into()
            } else {
                let ratio = slope / self.steepest;
                format!("Converged: the gradient fell to {slope:.1e}, {ratio:.1e} of its largest norm.")
            };
            Some((Termination::Converged, message))
        } else if self.hindered >= patience && unchanged(objective_tolerance.sqrt()) {
            // steps that are short because of failures are no sign of a minimum
            Some(verdict::walled_in(self.problem.inner(), slope))
        } else if self.unhindered >= patience && unchanged(objective_tolerance) {
            let change = (before - objective) / objective.abs();
            let message = format!(
                "Converged: the objective changed by {change:.1e} of its size over {patience} iterations; the norm of the gradient is {slope:.1e}."
            );
            Some((Termination::Converged, message))
        } else if self.problem.inner().out_of_iterations() {
            Some(verdict::iteration_limit(limits.iterations))
        } else {
            None
        };
    }

    /// Whether the leg that just ended lowered the objective by more than the tolerance.
    pub(super) fn leg_gained(&self) -> bool {
        let FirstOrderPoint { objective, .. } = self.current;
        self.leg_start - objective > self.settings.objective_tolerance * objective.abs()
    }

    /// The verdict where no line search leads on.
    pub(super) fn stuck(&self) -> (Termination, String) {
        let slope = norm(&self.current.gradient);
        if !self.succeeded && self.problem.inner().last_failed() {
            return verdict::walled_in(self.problem.inner(), slope);
        }
        verdict::no_descent(slope, self.steepest)
    }
}

/// The scaled objective as `argmin` sees it.
pub(super) struct ArgminProblem<'r, 'a>(pub(super) &'r RefCell<LbfgsRun<'a>>);

impl CostFunction for ArgminProblem<'_, '_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, x: &Vec<f64>) -> Result<f64, Error> {
        let mut run = self.0.borrow_mut();
        Ok(run.at(x)?.objective / run.scale)
    }
}

impl Gradient for ArgminProblem<'_, '_> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, x: &Vec<f64>) -> Result<Vec<f64>, Error> {
        let mut run = self.0.borrow_mut();
        let mut gradient = run.at(x)?.gradient;
        gradient.iter_mut().for_each(|g| *g /= run.scale);
        Ok(gradient)
    }
}

/// `argmin`'s L-BFGS under the stopping criteria of this module.
pub(super) struct Supervised<'r, 'a> {
    pub(super) run: &'r RefCell<LbfgsRun<'a>>,
    pub(super) lbfgs: LBFGS<WolfeLineSearch, Vec<f64>, Vec<f64>, f64>,
}

impl<'r, 'a> Solver<ArgminProblem<'r, 'a>, ArgminState> for Supervised<'r, 'a> {
    fn name(&self) -> &str {
        "supervised L-BFGS"
    }

    fn init(
        &mut self,
        problem: &mut Counted<ArgminProblem<'r, 'a>>,
        state: ArgminState,
    ) -> Result<(ArgminState, Option<KV>), Error> {
        self.lbfgs.init(problem, state)
    }

    fn next_iter(
        &mut self,
        problem: &mut Counted<ArgminProblem<'r, 'a>>,
        state: ArgminState,
    ) -> Result<(ArgminState, Option<KV>), Error> {
        let (state, kv) = self.lbfgs.next_iter(problem, state)?;
        if state.terminated() {
            return Ok((state, kv));
        }
        let Some(x) = state.get_param() else { return Ok((state, kv)) };
        let mut run = self.run.borrow_mut();
        let next = run.at(x)?;
        let state = if run.accept(next) { state } else { state.terminate_with(TerminationReason::SolverConverged) };
        Ok((state, kv))
    }

    fn terminate(&mut self, _state: &ArgminState) -> TerminationStatus {
        TerminationStatus::NotTerminated
    }
}
