//! SLSQP: `basin` takes the steps, this module judges them.
//!
//! `basin` separates objective, constraints and gradients, stops on absolute changes and gives up after five restarts
//! of its quasi-Newton matrix. Here one evaluation serves all, objective and constraints are scaled at the start, the
//! run ends on the first-order conditions of the problem as it was put, a failed analysis halves the step, and a leg
//! that gave up is followed by another from where it stood as long as that leads anywhere.

mod bridge;

use super::kkt::Iterate;
use super::ledger::Ledger;
use super::optimizer::{Limits, Optimizer};
use super::outcome::{OptimizeError, Outcome, Progress, Termination};
use super::scope::Scope;
use super::settings::Setting;
use super::verdict as report;
use super::watch::{Ending, Watch};
use crate::design::Problem;
use basin::{SelectedFirstOrderState, SlsqpFailure, Solver, State};
use bridge::{BasinProblem, SlsqpRun};
use std::cell::RefCell;
use std::ops::ControlFlow;

/// Sequential least-squares programming (Kraft, DFVLR-FB 88-28), for problems with equality, one- and two-sided
/// constraints and bounds.
///
/// Each iteration solves a quadratic model of the Lagrangian (damped BFGS from the identity) under the linearised
/// constraints, costs one evaluation, rarely more, and approaches feasibility and optimality together; the start need
/// not be feasible. A failed analysis halves the step, up to ten times.
///
/// The run has converged where every constraint is met within
/// [`feasibility_tolerance`](Self::feasibility_tolerance) and the [KKT residual](Outcome::kkt_residual), which is
/// relative to the objective, is at most [`optimality_tolerance`](Self::optimality_tolerance). [`Outcome::multipliers`] and the message tell which constraints hold the design.
///
/// Where no constraint can be met any better the run ends as [`Termination::Infeasible`] and the message names what
/// stands against what.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slsqp {
    /// KKT residual, relative to the objective, at which the run has converged.
    pub optimality_tolerance: f64,
    /// Largest violation of a constraint, in its own unit, that counts as none.
    pub feasibility_tolerance: f64,
    /// Length of a step along the negative gradient of the objective at the start, in scaled variables: the scale of
    /// the objective.
    pub first_step: f64,
    /// Iterations without progress after which the run has stalled.
    pub patience: usize,
    /// Limits of the run.
    pub limits: Limits,
}

impl Default for Slsqp {
    fn default() -> Self {
        Self {
            optimality_tolerance: 1e-6,
            feasibility_tolerance: 1e-9,
            first_step: 0.1,
            patience: 40,
            limits: Limits::default(),
        }
    }
}

impl Slsqp {
    /// The name in case files.
    pub const NAME: &'static str = "slsqp";
    pub(super) const SCOPE: Scope = Scope { method: Self::NAME, constraints: true, dense: true };

    fn settings(&self) -> [Setting; 4] {
        let [optimality, feasibility] = Setting::of_constraints(self.optimality_tolerance, self.feasibility_tolerance);
        [
            optimality,
            feasibility,
            Setting::count("patience", self.patience),
            Setting::positive("first_step", self.first_step),
        ]
    }
}

impl Optimizer for Slsqp {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn minimize(
        &self,
        problem: &mut dyn Problem,
        observer: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
    ) -> Result<Outcome, OptimizeError> {
        Self::SCOPE.check(problem, self.limits, &self.settings())?;
        let ledger = Ledger::new(problem, observer, self.limits);
        let ledger = ledger.feasible_within(self.feasibility_tolerance).measured();
        let run = RefCell::new(SlsqpRun::new(ledger, self.first_step));
        let verdict = drive(&run, *self);
        Ok(run.into_inner().ledger.close(verdict))
    }
}

/// Most legs of a run.
const LEGS: usize = 20;

/// Why a leg ended.
enum LegEnd {
    /// With a reason for the whole run.
    Verdict(Termination, String),
    /// `basin` saw no way on.
    GaveUp(Option<SlsqpFailure>),
    /// The ledger refused an evaluation; it words the reason.
    Halted,
}

/// Judges the points steps lead to.
struct Judge {
    settings: Slsqp,
    watch: Watch,
}

impl Judge {
    fn new(settings: Slsqp) -> Self {
        Self { settings, watch: Watch::new(settings.feasibility_tolerance, settings.patience) }
    }

    /// The end of the run, if `point` is one.
    fn judge(&mut self, run: &mut SlsqpRun<'_>, point: &Iterate) -> Option<(Termination, String)> {
        let wanted = self.settings.optimality_tolerance * run.ledger.unit(&point.evaluation);
        Some(match self.watch.judge(&run.ledger, point, wanted)? {
            Ending::Optimal => {
                run.ledger.settle_on(&point.x, &point.evaluation);
                (Termination::Converged, report::converged(&run.ledger, point))
            }
            Ending::OutOfIterations => {
                (Termination::IterationLimit, report::out_of_iterations(&run.ledger, &run.ledger.handed_out(point)))
            }
            Ending::Stalled => self.stuck(&run.ledger, point),
        })
    }

    /// No step leads on from `point`.
    fn stuck(&self, ledger: &Ledger<'_>, point: &Iterate) -> (Termination, String) {
        let point = ledger.handed_out(point);
        if ledger.last_failed() {
            return report::beset(ledger, &point);
        }
        report::at_rest(ledger, &point, self.settings.feasibility_tolerance)
    }
}

/// Runs `basin` leg by leg, each from the point reached with the identity for the Hessian, until there is a reason to
/// stop.
fn drive(run: &RefCell<SlsqpRun<'_>>, settings: Slsqp) -> (Termination, String) {
    let mut point = match run.borrow_mut().begin() {
        Ok(point) => point,
        Err(failure) => return report::fails_at_start(&failure.reason),
    };
    let mut judge = Judge::new(settings);
    if let Some(verdict) = judge.judge(&mut run.borrow_mut(), &point) {
        return verdict;
    }
    for _ in 0..LEGS {
        let before = judge.watch.gained_at();
        match leg(run, &mut judge, &mut point) {
            LegEnd::Verdict(status, message) => return (status, message),
            LegEnd::Halted => return (Termination::Interrupted, String::new()),
            // constraints that no linear model can meet are the same in the next leg
            LegEnd::GaveUp(Some(SlsqpFailure::IncompatibleConstraints)) => break,
            LegEnd::GaveUp(_) if judge.watch.gained_at() > before => {}
            LegEnd::GaveUp(_) => break,
        }
    }
    judge.stuck(&run.borrow().ledger, &point)
}

/// Steps from `point`, which follows, until there is a verdict or `basin` gives up.
fn leg(run: &RefCell<SlsqpRun<'_>>, judge: &mut Judge, point: &mut Iterate) -> LegEnd {
    run.borrow_mut().stand_at(point);
    let mut problem = basin::Problem::new(BasinProblem::new(run));
    let mut solver = basin::Slsqp::new().with_absolute_accuracy_tolerance(None);
    let Ok(mut state) = solver.init(&mut problem, SelectedFirstOrderState::new(point.x.clone())) else {
        return LegEnd::Halted;
    };
    loop {
        let Ok(step) = solver.next_iter(&mut problem, state) else { return LegEnd::Halted };
        state = step.state;
        if step.termination.is_some() {
            return LegEnd::GaveUp(solver.failure());
        }
        let mut run = run.borrow_mut();
        match run.point(state.param()) {
            Ok(next) => *point = next,
            // an accepted point has an evaluation; only a run that has ended does not give it
            Err(_) => return LegEnd::Halted,
        }
        run.stand_at(point);
        rebase(&mut state);
        run.ledger.iteration += 1;
        if let Some((status, message)) = judge.judge(&mut run, point) {
            return LegEnd::Verdict(status, message);
        }
    }
}

/// Calls the objective of the state 0, as it is seen from where it stands.
fn rebase(state: &mut SelectedFirstOrderState<Vec<f64>>) {
    let parts = state.current().map(|(x, _, gradient, violation)| (x.clone(), gradient.clone(), violation.clone()));
    if let Some((x, gradient, violation)) = parts {
        // x and gradient fit each other as they come from the state
        let _ = state.replace(x, 0.0, gradient, violation);
    }
}
